//! Time of the yarns' energies: gather, arithmetic and scatter of gradient and Hessian of each term, in
//! microseconds of processor time per node, by the assembler on one thread.
//!
//! The cloth is a grid of crossings with every energy that woven and knitted cloth has per node: two segments, two
//! bends, four corners, two spacings, one wrapping spring, one length of stitch, two strands; once with all
//! material coordinates fixed, once with all sliding, in a disturbed state with damping.
//! Argument: crossings along a side (200).
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

mod common;

use common::{Random, cpu};
use toile::blend::Riders;
use toile::body::Distance;
use toile::math::parallel::Workers;
use toile::math::{Vec2, Vec3};
use toile::system::assemble::Assembler;
use toile::system::state::{State, StrandState};
use toile::system::term::{Bodies, Configuration, ContactSettings, HessianKind, World};
use toile::system::yarn::compression::{Compression, YarnPlace};
use toile::system::yarn::stack::StackRule;
use toile::system::yarn::unknowns::Unknowns;
use toile::system::yarn::{YarnOptions, terms};
use toile::yarn::{
    Corner, Family, Incidence, Spacing, StitchSpring, Strand, Wrap, YarnMaterial, YarnMesh,
};

const PITCH: f64 = 1e-3;

struct Nothing;

impl Bodies for Nothing {
    fn count(&self) -> usize {
        0
    }
    fn distance(&self, _: usize, _: &Vec3) -> Distance {
        unreachable!("no body")
    }
    fn value(&self, _: usize, _: &Vec3) -> f64 {
        unreachable!("no body")
    }
    fn carried(&self, _: usize, _: &Vec3) -> Vec3 {
        unreachable!("no body")
    }
    fn contact(&self, _: usize) -> &ContactSettings {
        unreachable!("no body")
    }
}

fn grid(n: usize) -> YarnMesh {
    let mut mesh = YarnMesh {
        starts: vec![0],
        stack_starts: vec![0],
        lift: vec![0.0; n * n],
        node_panel: vec![0; n * n],
        ..YarnMesh::default()
    };
    for j in 0..n {
        for i in 0..n {
            mesh.uv.push(Vec2::new(i as f64 * PITCH, j as f64 * PITCH));
        }
    }
    for y in 0..2 * n {
        for k in 0..n {
            let node = if y < n { y * n + k } else { k * n + (y - n) };
            mesh.incidences.push(Incidence {
                node: node as u32,
                u: k as f64 * PITCH,
                slides: k > 0 && k + 1 < n,
            });
        }
        mesh.starts.push(mesh.incidences.len() as u32);
        mesh.yarn_fabric.push(0);
        mesh.yarn_family
            .push(if y < n { Family::Weft } else { Family::Warp });
    }
    let weft = |i: usize, j: usize| (j * n + i) as u32;
    let warp = |i: usize, j: usize| (n * n + i * n + j) as u32;
    for j in 0..n {
        for i in 0..n {
            let pair = [(weft(i, j), 0), (warp(i, j), 1)];
            let order = if (i + j) % 2 == 0 { [0, 1] } else { [1, 0] };
            for k in order {
                let (incidence, group) = pair[k];
                mesh.stacks.push(Strand { incidence, group });
            }
            mesh.stack_starts.push(mesh.stacks.len() as u32);
            if i == 0 || j == 0 || i + 1 == n || j + 1 == n {
                continue;
            }
            let node = |i: usize, j: usize| (j * n + i) as u32;
            for (k, l) in [
                (i + 1, j + 1),
                (i + 1, j - 1),
                (i - 1, j + 1),
                (i - 1, j - 1),
            ] {
                mesh.corners.push(Corner {
                    nodes: [node(i, j), node(k, j), node(i, l)],
                    length: PITCH,
                });
            }
            mesh.wraps.push(Wrap {
                axis: [node(i, j), node(i, j + 1)],
                wings: [weft(i - 1, j), weft(i + 1, j + 1)],
                length: PITCH,
                sign: 1.0,
            });
            mesh.stitch_springs.push(StitchSpring {
                incidences: [warp(i, j), warp(i, j + 1)],
                length: PITCH,
            });
            for [a, b] in [[weft(i, j), weft(i + 1, j)], [warp(i, j), warp(i, j + 1)]] {
                mesh.spacings.push(Spacing {
                    incidences: [a, b],
                    least: 0.98 * PITCH,
                    length: PITCH,
                });
            }
        }
    }
    mesh
}

fn main() {
    let n = std::env::args()
        .filter_map(|a| a.parse().ok())
        .next()
        .unwrap_or(200);
    let mesh = grid(n);
    let nodes = (n * n) as f64;
    let material = YarnMaterial {
        radius: 0.25e-3,
        density: 1.5e-4,
        stretch: 2.0,
        bending: 6e-11,
        wrapping: 1e-3,
        stitch: 2.0,
        shear: 6e-5,
        spacing: 2e6,
        friction: 0.3,
        anchor: 300.0,
        sliding_damping: 1e-3,
        damping_mass: 2.0,
        damping_stiffness: 0.01,
    };
    let world = World {
        gravity: Vec3::new(0.0, 0.0, -9.81),
        wind: Vec3::zeros(),
        pressure: 0.0,
        bodies: &Nothing,
    };
    let workers = Workers::default();
    println!(
        "{:18} {:>8} {:>8}   microseconds per node",
        "", "frozen", "sliding"
    );
    let mut table: std::collections::BTreeMap<&str, [f64; 2]> = Default::default();
    for (column, slides) in [false, true].into_iter().enumerate() {
        let mut random = Random::new(5);
        let sliding: Vec<bool> = mesh.incidences.iter().map(|i| i.slides && slides).collect();
        let unknowns = Unknowns::new(&mesh, 0, (n * n) as u32, &sliding).expect("unknowns");
        let options = YarnOptions::default();
        let mut all = terms(&mesh, &[material], &unknowns, &options).expect("terms");
        let u: Vec<f64> = mesh
            .incidences
            .iter()
            .map(|i| i.u + 0.02 * PITCH * (random.next() - 0.5))
            .collect();
        let mut x: Vec<Vec3> = mesh
            .uv
            .iter()
            .map(|p| {
                let noise = Vec3::new(random.next(), random.next(), random.next());
                Vec3::new(p.x, p.y, 0.0) + noise * (0.3 * PITCH)
            })
            .collect();
        let place = x.clone();
        x.resize(x.len() + unknowns.slide_blocks(), Vec3::zeros());
        for (slide, u) in unknowns.slides.iter().zip(&u) {
            if let Some((block, c)) = slide {
                x[*block as usize][usize::from(*c)] = *u;
            }
        }
        let mut strands = vec![StrandState::default(); mesh.stacks.len()];
        let mut normals = vec![Vec3::zeros(); n * n];
        let mut compression =
            Compression::new(&mesh, &[material], &options, StackRule::LeastSquares).expect("stack");
        let held = vec![false; n * n];
        let at = YarnPlace {
            x: &place,
            u: &u,
            held: &held,
            gravity: world.gravity,
        };
        compression.update(&at, &workers, &mut normals, &mut strands);
        let from = cpu();
        const UPDATES: u32 = 10;
        for _ in 0..UPDATES {
            compression.update(&at, &workers, &mut normals, &mut strands);
        }
        let spent = (cpu() - from) / f64::from(UPDATES);
        table.entry("compression").or_default()[column] = 1e6 * spent / nodes;
        let state = State {
            topology: Default::default(),
            time: 0.0,
            velocities: vec![Vec3::zeros(); x.len()],
            positions: x.clone(),
            pins: Vec::new(),
            bodies: Vec::new(),
            body_anchors: Vec::new(),
            pair_anchors: Vec::new(),
            step_size: 1.0,
            gravity: world.gravity,
            wind: Vec3::zeros(),
            pressure: 0.0,
            u: u.clone(),
            u_rates: vec![0.0; u.len()],
            sliding: vec![false; u.len()],
            strands,
            yarn_normals: normals,
        };
        let moved: Vec<Vec3> = x.iter().map(|p| p * 1.001).collect();
        let at = Configuration {
            x: &moved,
            x0: &x,
            u: &u,
            inv_dt: 1000.0,
            world: &world,
        };
        let mut gradient = vec![Vec3::zeros(); x.len()];
        for term in &mut all {
            term.begin_step(&state, &at);
        }
        for term in all {
            let name = term.name();
            let one = [term];
            let mut assembler = Assembler::new(&vec![3; x.len()], &one, &Riders::default());
            assembler.add(&one, &at, Some(HessianKind::Psd), &workers, &mut gradient);
            const ROUNDS: u32 = 10;
            let from = cpu();
            for _ in 0..ROUNDS {
                assembler.add(&one, &at, Some(HessianKind::Psd), &workers, &mut gradient);
            }
            let spent = (cpu() - from) / f64::from(ROUNDS);
            table.entry(name).or_default()[column] += 1e6 * spent / nodes;
        }
    }
    let mut sum = [0.0; 2];
    for (name, [a, b]) in &table {
        println!("{name:18} {a:8.3} {b:8.3}");
        sum = [sum[0] + a, sum[1] + b];
    }
    println!("{:18} {:8.3} {:8.3}", "all", sum[0], sum[1]);
}
