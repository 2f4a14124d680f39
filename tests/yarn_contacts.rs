//! Compression of yarns at their contacts.

use crate::sheets::Random;
use crate::terms_cases::add;
use crate::yarn_cases::{BEFORE, Cloth, MATERIAL, P, WORLD, cloth, stitch, weave};
use nalgebra::{DMatrix, DVector};
use toile::math::parallel::Workers;
use toile::math::{Rotation, Vec3};
use toile::system::state::StrandState;
use toile::system::term::Configuration;
use toile::system::yarn::YarnOptions;
use toile::system::yarn::compression::{Compression, YarnPlace};
use toile::system::yarn::stack::{StackRule, held_normal_forces, normal_forces};
use toile::yarn::{YarnMaterial, YarnMesh};

fn pressed(
    compression: &mut Compression,
    mesh: &YarnMesh,
    x: &[Vec3],
    u: &[f64],
    held: &[bool],
    normals: &mut [Vec3],
) -> Vec<StrandState> {
    let mut strands = vec![StrandState::default(); mesh.stacks.len()];
    let place = YarnPlace {
        x,
        u,
        held,
        gravity: Vec3::zeros(),
    };
    compression.update(&place, &Workers::default(), normals, &mut strands);
    strands
}

/// The forces of a stack are the best of all active sets, for up to five yarns; equation 4 of the paper is
/// not for three and more.
#[test]
fn normal_forces_are_the_non_negative_least_squares() {
    let mut lambda = [0.0; 2];
    // r = (1, -5)
    normal_forces(&[0.0, -1.0, 4.0], StackRule::LeastSquares, &mut lambda);
    assert!((lambda[0] - 0.5).abs() < 1e-15 && lambda[1] == 0.0);
    normal_forces(&[0.0, -1.0, 4.0], StackRule::ClosedForm, &mut lambda);
    assert!((lambda[0] - 2.0 / 3.0).abs() < 1e-15 && (lambda[1] - 1.0 / 3.0).abs() < 1e-15);
    let mut random = Random::new(2);
    let mut differ = 0;
    for k in 0..4000 {
        let n = 2 + k % 4;
        let b: Vec<f64> = (0..n).map(|_| random.signed()).collect();
        let mut lambda = vec![f64::NAN; n - 1];
        normal_forces(&b, StackRule::LeastSquares, &mut lambda);
        let a = DMatrix::from_fn(n, n - 1, |i, j| {
            f64::from(i8::from(i == j + 1)) - f64::from(i8::from(i == j))
        });
        let rest =
            |l: &[f64]| (&a * DVector::from_row_slice(l) + DVector::from_row_slice(&b)).norm();
        // every active set by brute force
        let mut best = rest(&vec![0.0; n - 1]);
        for set in 1..1_u32 << (n - 1) {
            let columns: Vec<usize> = (0..n - 1).filter(|j| set >> j & 1 == 1).collect();
            let part = a.select_columns(&columns);
            let normal = part.transpose() * &part;
            let right = -(part.transpose() * DVector::from_row_slice(&b));
            let Some(solution) = normal.lu().solve(&right) else {
                continue;
            };
            if solution.iter().all(|l| *l >= 0.0) {
                let mut full = vec![0.0; n - 1];
                for (j, l) in columns.iter().zip(solution.iter()) {
                    full[*j] = *l;
                }
                best = best.min(rest(&full));
            }
        }
        assert!(lambda.iter().all(|l| *l >= 0.0));
        assert!((rest(&lambda) - best).abs() < 1e-12, "{b:?}: {lambda:?}");
        let mut closed = vec![0.0; n - 1];
        normal_forces(&b, StackRule::ClosedForm, &mut closed);
        let same = rest(&closed) < best + 1e-9;
        assert!(same || n > 2);
        differ += usize::from(!same);
    }
    assert!(differ > 500);
}

/// A planar weave under tension presses each crossing with `4 T R / l'`: its yarns lie at `R` before and behind
/// the plane, next to crossings of the other side. Normals point to the front of the panel and follow it.
#[test]
fn a_stretched_plain_weave_presses_its_crossings() {
    let mesh = weave(5, 5);
    let mut compression = Compression::new(
        &mesh,
        &[MATERIAL],
        &YarnOptions::default(),
        StackRule::LeastSquares,
    )
    .expect("rest data");
    let u: Vec<f64> = mesh.incidences.iter().map(|i| i.u).collect();
    let strain = 0.02;
    let mut normals = vec![Vec3::zeros(); 25];
    for turn in 0..4 {
        let turn = Rotation::from_euler_angles(0.3 + f64::from(turn), -0.4, 0.7);
        let x: Vec<Vec3> = mesh
            .uv
            .iter()
            .map(|p| turn * Vec3::new(p.x, p.y, 0.0) * (1.0 + strain))
            .collect();
        let held = vec![false; 25];
        let strands = pressed(&mut compression, &mesh, &x, &u, &held, &mut normals);
        let front = turn * Vec3::z();
        let length = (P * (1.0 + strain)).hypot(2.0 * MATERIAL.radius);
        let expected = 4.0 * MATERIAL.stretch * strain * MATERIAL.radius / length;
        for node in [6, 7, 8, 11, 12, 13, 16, 17, 18] {
            assert!((normals[node] - front).norm() < 1e-9, "{node}");
            let first = strands[mesh.stack_starts[node] as usize].contact;
            assert!(
                (first / expected - 1.0).abs() < 1e-9,
                "{node}: {first} {expected}"
            );
            assert!(strands[mesh.stack_starts[node] as usize + 1].contact == 0.0);
        }
        // at rest nothing is pressed, under compression nothing pulls
        for scale in [1.0, 0.97] {
            let x: Vec<Vec3> = x.iter().map(|p| p * (scale / (1.0 + strain))).collect();
            let strands = pressed(&mut compression, &mesh, &x, &u, &held, &mut normals);
            assert!(strands.iter().all(|s| s.contact.abs() < 1e-12));
        }
    }
}

/// At a held node the reaction counts: one loaded yarn presses with its whole force, not with half of it.
#[test]
fn a_held_contact_carries_the_whole_load() {
    let mut lambda = [0.0];
    for b in [[0.7, 0.0], [0.0, -0.7], [0.7, -0.7]] {
        held_normal_forces(&b, StackRule::LeastSquares, &mut lambda);
        assert!((lambda[0] - 0.7).abs() < 1e-15);
    }
    normal_forces(&[0.7, 0.0], StackRule::LeastSquares, &mut lambda);
    assert!((lambda[0] - 0.35).abs() < 1e-15);
}

/// The forces that compression sees are those of the energies: summed over the yarns of a node they are the
/// gradient by its position; the forces along yarns are the derivatives by the material coordinates.
#[test]
fn forces_of_yarns_sum_to_the_gradient() {
    for mesh in [weave(5, 4), stitch()] {
        let cloth = cloth("", mesh, |_| true);
        let mesh = &cloth.mesh;
        // no yarn has a thickness: the places of the segments' ends are the nodes
        let thin = YarnMaterial {
            radius: 0.0,
            ..MATERIAL
        };
        let mut compression = Compression::new(
            mesh,
            &[thin],
            &YarnOptions::default(),
            StackRule::LeastSquares,
        )
        .expect("rest data");
        let mut random = Random::new(6);
        let x: Vec<Vec3> = cloth
            .laid()
            .iter()
            .map(|p| p + random.vec3(0.2 * P))
            .collect();
        let u: Vec<f64> = mesh
            .incidences
            .iter()
            .map(|i| i.u + 0.1 * P * f64::from(u8::from(i.slides)) * random.signed())
            .collect();
        let mut normals = vec![Vec3::zeros(); x.len()];
        let held = vec![false; x.len()];
        pressed(&mut compression, mesh, &x, &u, &held, &mut normals);
        let blocks = cloth.blocks(&x, &u);
        let at = Configuration {
            x: &blocks,
            x0: &blocks,
            u: &u,
            inv_dt: 0.0,
            world: &WORLD,
        };
        let elastic = ["yarn_stretch", "yarn_bending", "stitch_wrapping"];
        let along = [
            "yarn_stretch",
            "yarn_bending",
            "stitch_length",
            "yarn_spacing",
        ];
        let by_place = sum(&cloth, &elastic, &at);
        let by_u = sum(&cloth, &along, &at);
        let mut total = vec![Vec3::zeros(); x.len()];
        for (incidence, force) in mesh.incidences.iter().zip(compression.forces()) {
            total[incidence.node as usize] += force;
        }
        let size = total.iter().map(|f| f.norm()).fold(0.0, f64::max);
        for (n, force) in total.iter().enumerate() {
            let g = by_place[BEFORE as usize + n];
            assert!((force + g).norm() < 1e-12 * size, "{n}: {force} {g}");
        }
        for (i, force) in compression.sliding_forces().iter().enumerate() {
            if let Some((block, c)) = cloth.unknowns.slides[i] {
                let g = by_u[block as usize][usize::from(c)];
                assert!((force + g).abs() < 1e-12 * size, "{i}: {force} {g}");
            }
        }
    }
}

fn sum(cloth: &Cloth, names: &[&str], at: &Configuration<'_>) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); at.x.len()];
    for term in cloth.terms.iter().filter(|t| names.contains(&t.name())) {
        add(term.as_ref(), at, &mut out);
    }
    out
}
