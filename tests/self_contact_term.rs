//! Laws of the contact of cloth with itself.

#![allow(clippy::expect_used, reason = "test code")]

use crate::self_contact_cases::{Random, at, sew, squares, state};
use toile::math::{Mat3, Vec3};
use toile::system::contact::self_contact::SelfContact;
use toile::system::contact::spheres::{Grid, Spheres, covering_radius};
use toile::system::points::Points;
use toile::system::state::State;
use toile::system::term::{HessianKind, Term};

const SPACING: f64 = 0.01;

/// Two panels of 6 x 6 cells, the second above the first, shifted and crumpled.
fn crumpled(seed: u64, gap: f64) -> (SelfContact, State) {
    let cloth = squares(2, 6, SPACING);
    let mut random = Random(seed);
    let half = cloth.mesh.uv.len() / 2;
    let x = cloth.mesh.uv.iter().enumerate().map(|(i, p)| {
        let up = if i < half { 0.0 } else { gap };
        let shift = if i < half { 0.0 } else { 0.37 * SPACING };
        Vec3::new(p.x + shift, up, p.y + 0.6 * shift) + random.vector() * (0.1 * SPACING)
    });
    let x = x.collect();
    let contact =
        SelfContact::new(&cloth, &Points::new(&cloth, None), None, 1e6, 0.4).expect("valid");
    (contact, state(x))
}

/// Runs one step that ends where it began plus a random motion, so that pairs rub in the next.
fn rubbing(seed: u64, gap: f64, slide: f64) -> (SelfContact, State) {
    let (mut contact, mut state) = crumpled(seed, gap);
    let x0 = state.positions.clone();
    contact.begin_step(&state, &at(&x0, &x0, 1e-3));
    contact.accept(&at(&x0, &x0, 1e-3), &mut state);
    assert!(!state.pair_anchors.is_empty(), "nothing touches");
    let half = x0.len() / 2;
    let mut random = Random(seed + 100);
    for (i, p) in state.positions.iter_mut().enumerate() {
        *p += random.vector() * (0.02 * SPACING);
        if i >= half {
            p.x += slide;
        }
    }
    contact.begin_step(&state, &at(&x0, &x0, 1e-3));
    (contact, state)
}

/// The gradient is the derivative of the value and the exact Hessian that of the gradient, sliding
/// and sticking, by central differences of second order.
#[test]
fn derivatives_agree_with_finite_differences() {
    for (gap, slide) in [(0.7, 0.0), (0.7, 0.3), (0.0, 0.0), (0.3, 0.05)] {
        let (contact, state) = rubbing(3, gap * SPACING, slide * SPACING);
        let mut x = state.positions.clone();
        let x0 = x.clone();
        let step = 1e-7;
        let mut active = 0;
        for e in 0..contact.stencils().count() {
            let v: Vec<usize> = contact
                .stencils()
                .get(e)
                .iter()
                .map(|&i| i as usize)
                .collect();
            let mut g = [Vec3::zeros(); 2];
            let mut h = [Mat3::zeros(); 3];
            contact.gradient(e, &at(&x, &x0, 1e-3), &mut g);
            contact.hessian(e, &at(&x, &x0, 1e-3), HessianKind::Exact, &mut h);
            active += usize::from(g[0] != Vec3::zeros());
            for (p, &i) in v.iter().enumerate() {
                for c in 0..3 {
                    let mut both = [(0.0, [Vec3::zeros(); 2]); 2];
                    for (out, sign) in both.iter_mut().zip([1.0, -1.0]) {
                        let kept = x[i][c];
                        x[i][c] += sign * step;
                        out.0 = contact.value(e, &at(&x, &x0, 1e-3));
                        contact.gradient(e, &at(&x, &x0, 1e-3), &mut out.1);
                        x[i][c] = kept;
                    }
                    let slope = (both[0].0 - both[1].0) / (2.0 * step);
                    assert!(
                        (slope - g[p][c]).abs() < 1e-5 * (0.1 + g[p].norm()),
                        "gradient {slope} {}",
                        g[p][c]
                    );
                    for q in 0..2 {
                        let numeric = (both[0].1[q] - both[1].1[q]) / (2.0 * step);
                        let exact = match (p, q) {
                            (0, 0) => h[0].column(c).into_owned(),
                            (1, 1) => h[2].column(c).into_owned(),
                            (1, 0) => h[1].row(c).transpose(),
                            _ => h[1].column(c).into_owned(),
                        };
                        // A pair just at the contact distance, or just at the friction bound, has
                        // no second derivative; none of these states holds one.
                        let error = (numeric - exact).norm();
                        assert!(
                            error < 2e-3 * (1.0 + exact.norm()),
                            "gap {gap} slide {slide} pair {e}: {error} of {}",
                            exact.norm()
                        );
                    }
                }
            }
            // No net force, and the semi-definite Hessian is that.
            assert!((g[0] + g[1]).norm() <= 1e-14 * g[0].norm());
            contact.hessian(e, &at(&x, &x0, 1e-3), HessianKind::Psd, &mut h);
            let lowest = h[0].symmetric_eigenvalues().min();
            assert!(lowest >= -1e-9 * h[0].norm(), "{lowest}");
            assert!((h[1] + h[0]).norm() == 0.0 && h[0] == h[2]);
        }
        println!(
            "gap {gap} slide {slide}: {active} active of {}",
            contact.stencils().count()
        );
        assert!(active > 20);
    }
}

/// The grid finds the pairs that comparing all with all finds, in clouds dense and sparse.
#[test]
fn the_grid_finds_what_brute_force_finds() {
    let mut random = Random(8);
    for (count, scale) in [
        (400, 1.0),
        (400, 0.1),
        (50, 1e7),
        (3, 0.0),
        (1, 1.0),
        (0, 1.0),
    ] {
        let x: Vec<Vec3> = (0..count).map(|_| random.vector() * scale).collect();
        let reach: Vec<f64> = (0..count)
            .map(|i| {
                if i % 7 == 0 {
                    0.0
                } else {
                    0.05 * (2.0 + random.signed())
                }
            })
            .collect();
        let mut found = Vec::new();
        Grid::default().pairs(&x, &reach, |a, b| found.push((a, b)));
        found.sort_unstable();
        let mut expected = Vec::new();
        for a in 0..count {
            for b in a + 1..count {
                if reach[a] > 0.0 && reach[b] > 0.0 && (x[a] - x[b]).norm() < reach[a] + reach[b] {
                    expected.push((a as u32, b as u32));
                }
            }
        }
        assert_eq!(found, expected, "{count} points at scale {scale}");
    }
}

/// Radii let no edge slip: every crossing pair of edges, every vertex in a triangle, is within
/// reach, on random triangles.
#[test]
fn no_place_of_an_edge_or_triangle_is_out_of_reach() {
    let mut random = Random(21);
    for _ in 0..2_000 {
        let corners = [random.vector(), random.vector(), random.vector()].map(|mut v| {
            v.z = 0.0;
            v
        });
        let [a, b, c] = corners;
        let cover = covering_radius((b - c).norm(), (c - a).norm(), (a - b).norm());
        let mut worst = 0.0_f64;
        for i in 0..=40 {
            for j in 0..=40 - i {
                let (s, t) = (f64::from(i) / 40.0, f64::from(j) / 40.0);
                let p = a + (b - a) * s + (c - a) * t;
                worst = worst.max(
                    corners
                        .iter()
                        .map(|q| (q - p).norm())
                        .fold(f64::INFINITY, f64::min),
                );
            }
        }
        assert!(worst <= cover * (1.0 + 1e-9), "{worst} beyond {cover}");
        assert!(worst > 0.85 * cover, "{worst} is far below {cover}");
    }
    let cloth = squares(1, 5, SPACING);
    let spheres = Spheres::new(&cloth, &Points::new(&cloth, None), None, 0.15).expect("valid");
    let edges = toile::math::topology::edges(&cloth.mesh.triangles);
    let length =
        |e: &[u32; 2]| (cloth.mesh.uv[e[0] as usize] - cloth.mesh.uv[e[1] as usize]).norm();
    let mut tightest = f64::INFINITY;
    for e in &edges {
        for f in &edges {
            let slip = 0.5 * length(e).hypot(length(f));
            for a in e {
                for b in f {
                    tightest = tightest.min(spheres.rest_distance(*a, *b) / slip);
                }
            }
        }
    }
    println!(
        "largest radius {:.3} of the spacing, tightest reserve {:.3}",
        spheres.largest / SPACING,
        tightest - 1.0
    );
    assert!(tightest > 1.15 - 1e-12 && tightest < 1.5);
}

/// Flat sewn cloth touches itself nowhere, across the seam neither; unsewn panels side by side do.
#[test]
fn neighbours_across_a_seam_do_not_meet() {
    let cells = 6;
    for sewn in [true, false] {
        let mut cloth = squares(2, cells, SPACING);
        if sewn {
            sew(&mut cloth, cells);
        }
        let width = cells as f64 * SPACING;
        let half = cloth.mesh.uv.len() / 2;
        let x: Vec<Vec3> = (0..2 * half)
            .map(|i| {
                let p = cloth.mesh.uv[i];
                let second = f64::from(u8::from(i >= half));
                Vec3::new(p.x + second * width, 0.0, p.y + second * 0.5 * SPACING)
            })
            .collect();
        let mut contact =
            SelfContact::new(&cloth, &Points::new(&cloth, None), None, 1e6, 0.3).expect("valid");
        let state = state(x.clone());
        contact.begin_step(&state, &at(&x, &x, 1e-3));
        let touching = (0..contact.stencils().count())
            .filter(|&e| contact.value(e, &at(&x, &x, 1e-3)) > 0.0)
            .count();
        println!(
            "sewn {sewn}: {touching} pairs touch, {} excluded",
            contact.spheres().excluded_count()
        );
        assert_eq!(touching == 0, sewn);
    }
}

/// A fold keeps its layers apart though they are one panel.
#[test]
fn far_parts_of_one_panel_meet() {
    let cloth = squares(1, 12, SPACING);
    let x: Vec<Vec3> = cloth
        .mesh
        .uv
        .iter()
        .map(|p| {
            let s = p.x - 6.0 * SPACING;
            Vec3::new(-s.abs(), if s > 0.0 { 0.3 * SPACING } else { 0.0 }, p.y)
        })
        .collect();
    let mut contact =
        SelfContact::new(&cloth, &Points::new(&cloth, None), None, 1e6, 0.3).expect("valid");
    let state = state(x.clone());
    contact.begin_step(&state, &at(&x, &x, 1e-3));
    let mut lift = 0.0;
    for e in 0..contact.stencils().count() {
        let mut g = [Vec3::zeros(); 2];
        contact.gradient(e, &at(&x, &x, 1e-3), &mut g);
        let upper =
            usize::from(cloth.mesh.uv[contact.stencils().get(e)[1] as usize].x > 6.0 * SPACING);
        lift -= g[upper].y;
    }
    assert!(lift > 0.1, "lift {lift} N");
}

/// Coincident panels get finite forces that part them, the same ones every time.
#[test]
fn coincident_panels_are_parted() {
    let cloth = squares(2, 5, SPACING);
    let half = cloth.mesh.uv.len() / 2;
    let x: Vec<Vec3> = cloth
        .mesh
        .uv
        .iter()
        .map(|p| Vec3::new(p.x, 0.0, p.y))
        .collect();
    let state = state(x.clone());
    let forces = || {
        let mut contact =
            SelfContact::new(&cloth, &Points::new(&cloth, None), None, 1e6, 0.3).expect("valid");
        contact.begin_step(&state, &at(&x, &x, 1e-3));
        let mut f = vec![Vec3::zeros(); x.len()];
        for e in 0..contact.stencils().count() {
            let mut g = [Vec3::zeros(); 2];
            contact.gradient(e, &at(&x, &x, 1e-3), &mut g);
            for (i, g) in contact.stencils().get(e).iter().zip(g) {
                f[*i as usize] -= g;
            }
        }
        f
    };
    let f = forces();
    let sense = f[0].y.signum();
    for i in 0..half {
        assert!(f[i].iter().all(|v| v.is_finite()));
        assert!(
            f[i].y * sense > 0.0 && f[i + half].y * sense < 0.0,
            "{} {}",
            f[i],
            f[i + half]
        );
    }
    assert!(f.iter().zip(forces()).all(|(a, b)| *a == b));
}

/// Pressed layers pulled apart sideways stick below the friction bound and slide at it.
#[test]
fn the_anchor_follows_so_that_the_bound_holds() {
    for (slide, slips) in [(1e-5 * SPACING, false), (0.4 * SPACING, true)] {
        let (mut contact, mut state) = rubbing(5, 0.7 * SPACING, slide);
        let x = state.positions.clone();
        let before = state.pair_anchors.clone();
        contact.accept(&at(&x, &x, 1e-3), &mut state);
        let mut followed = 0;
        for anchor in &state.pair_anchors {
            let Ok(k) = before.binary_search_by_key(&(anchor.a, anchor.b), |p| (p.a, p.b)) else {
                continue;
            };
            let w = x[anchor.b as usize] - x[anchor.a as usize];
            // Stiffness of a pair: pressure per depth times mean vertex area.
            let stretch = (w - anchor.offset).norm();
            let stiffness = anchor.normal_force
                / (contact.spheres().rest_distance(anchor.a, anchor.b) - w.norm());
            // the stick zone is at least 0.005 mm wide, the spring softer where that is more
            let reach = (0.4 * anchor.normal_force / stiffness).max(5e-6);
            assert!(stretch <= reach * (1.0 + 1e-6));
            followed += usize::from((anchor.offset - before[k].offset).norm() > 0.1 * SPACING);
        }
        assert_eq!(
            followed > 10,
            slips,
            "slide {slide}: {followed} anchors moved on"
        );
        assert!(
            state
                .pair_anchors
                .windows(2)
                .all(|w| (w[0].a, w[0].b) < (w[1].a, w[1].b))
        );
    }
}

/// Pairs and their order depend on the state alone.
#[test]
fn pairs_depend_on_the_state_alone() {
    let (mut used, state) = rubbing(7, 0.6 * SPACING, 0.1 * SPACING);
    let (mut fresh, _) = crumpled(9, 10.0);
    let x = &state.positions;
    used.begin_step(&state, &at(x, x, 1e-3));
    assert!(fresh.begin_step(&state, &at(x, x, 1e-3)));
    assert!(
        !fresh.begin_step(&state, &at(x, x, 1e-3)),
        "unchanged stencils are reported as changed"
    );
    assert_eq!(used.stencils().vertices, fresh.stencils().vertices);
    for e in 0..used.stencils().count() {
        let c = at(x, x, 1e-3);
        assert_eq!(used.value(e, &c).to_bits(), fresh.value(e, &c).to_bits());
    }
}

/// Bad numbers are refused by name.
#[test]
fn bad_numbers_are_refused() {
    let cloth = squares(1, 1, SPACING);
    for (k, mu) in [
        (f64::NAN, 0.1),
        (-1.0, 0.1),
        (1.0, f64::INFINITY),
        (1.0, -0.1),
    ] {
        assert!(SelfContact::new(&cloth, &Points::new(&cloth, None), None, k, mu).is_err());
    }
    assert!(Spheres::new(&cloth, &Points::new(&cloth, None), None, -0.1).is_err());
}
