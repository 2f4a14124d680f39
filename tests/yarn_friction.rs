//! Friction and slip of yarns at their contacts, and what the State keeps of it.

use crate::terms_cases::add;
use crate::yarn_cases::{MATERIAL, P, WORLD, cloth, lay, stitch, weave};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{FRAC_PI_2, PI};
use toile::math::parallel::Workers;
use toile::math::{Vec2, Vec3};
use toile::system::snapshot::{Origin, read, write};
use toile::system::state::State;
use toile::system::term::{Configuration, HessianKind};
use toile::system::yarn::compression::{Compression, YarnPlace};
use toile::system::yarn::friction::loose;
use toile::system::yarn::slip::{SlipRule, set_anchors, sliding};
use toile::system::yarn::springs::frictions;
use toile::system::yarn::stack::StackRule;
use toile::system::yarn::unknowns::Unknowns;
use toile::system::yarn::{YarnOptions, terms};
use toile::yarn::{Family, YarnMaterial};

/// One contact held by friction alone, moved by hand: sticking keeps the anchor, slipping draws it along at
/// the distance of the bound, in both directions; without normal force there is no friction.
#[test]
fn anchors_stick_slip_and_follow() {
    let mut cloth = cloth("", stitch(), |_| true);
    let (x, u) = (cloth.laid(), cloth.u());
    let mut state = cloth.state(&x, &u, 1);
    let start = cloth.blocks(&x, &u);
    let mut terms = std::mem::take(&mut cloth.terms);
    let lambda = 0.02;
    // the new yarn at q0 crosses the strand behind it; the two old yarns lie beside each other
    let new = (0..3)
        .find(|&s| cloth.mesh.stacks[s].incidence == 1)
        .expect("a strand");
    let (own, pair) = (new, 0);
    let (reach, force) = (0.3 * lambda / MATERIAL.anchor, 0.3 * lambda);
    for (contact, moved, kept, pull) in [
        (lambda, 0.5 * reach, 0.0, 0.5 * force),
        (lambda, -0.5 * reach, 0.0, -0.5 * force),
        (lambda, 3.0 * reach, 2.0 * reach, force),
        (lambda, -3.0 * reach, -2.0 * reach, -force),
        (0.0, 3.0 * reach, 3.0 * reach, 0.0),
    ] {
        state.strands = loose(&cloth.mesh, &u);
        for strand in &mut state.strands {
            strand.contact = contact;
        }
        // only the strand in question is moved, and for the pair only its first one
        for (s, name) in [(own, "sliding_friction"), (pair, "parallel_friction")] {
            let i = cloth.mesh.stacks[s].incidence as usize;
            let mut now = u.clone();
            now[i] += moved;
            let blocks = cloth.blocks(&x, &now);
            let at = Configuration {
                x: &blocks,
                x0: &start,
                u: &u,
                inv_dt: 0.0,
                world: &WORLD,
            };
            let mut after = state.clone();
            let mut g = vec![Vec3::zeros(); blocks.len()];
            for term in terms.iter_mut().filter(|t| t.name() == name) {
                term.begin_step(&state, &at);
                add(term.as_ref(), &at, &mut g);
                term.accept(&at, &mut after);
            }
            let (block, c) = cloth.unknowns.slides[i].expect("it slides");
            let got = g[block as usize][usize::from(c)];
            assert!((got - pull).abs() < 1e-12, "{name}: {got} {pull}");
            let drawn = if s == own {
                after.strands[s].anchor - state.strands[s].anchor
            } else {
                after.strands[s].beside - state.strands[s].beside
            };
            assert!((drawn - kept).abs() < 1e-15, "{name}: {drawn} {kept}");
        }
    }
}

/// A contact gains its unknown beyond the bound, keeps it within the hysteresis and while it moves, loses it at rest below;
/// the anchor set at the beginning makes friction go on with the force that held the yarn.
#[test]
fn slip_begins_at_the_bound_and_ends_below_it() {
    let mesh = weave(5, 5);
    let all = frictions(&mesh, &[MATERIAL]).expect("frictions");
    let cloth = cloth("", mesh.clone(), |_| true);
    let mut state = cloth.state(&cloth.laid(), &cloth.u(), 3);
    state.u_rates.fill(0.0);
    for s in &mut state.strands {
        s.contact = 0.0;
    }
    let node = 12;
    let strand = mesh.stack_starts[node] as usize;
    state.strands[strand].contact = 0.1;
    let i = mesh.stacks[strand].incidence as usize;
    let other = mesh.stacks[strand + 1].incidence as usize;
    let bound = 0.3 * 0.1;
    let rule = SlipRule::default();
    let slides = |force: f64, present: bool, rate: f64| {
        let mut forces = vec![0.0; mesh.incidences.len()];
        (forces[i], forces[other]) = (force, force);
        let mut before = vec![false; mesh.incidences.len()];
        (before[i], before[other]) = (present, present);
        let mut state = state.clone();
        (state.u_rates[i], state.u_rates[other]) = (rate, rate);
        let out = sliding(&mesh, &all, &state, &forces, &before, &rule);
        assert_eq!(
            out[i], out[other],
            "both yarns of a crossing are held by its force"
        );
        assert!((0..out.len()).all(|k| !out[k] || k == i || k == other));
        out[i]
    };
    for sign in [1.0, -1.0] {
        assert!(!slides(sign * 0.99 * bound, false, 0.0));
        assert!(slides(sign * 1.01 * bound, false, 0.0));
        assert!(slides(sign * 0.9 * bound, true, 0.0));
        assert!(!slides(sign * 0.7 * bound, true, 0.0));
        assert!(slides(sign * 0.7 * bound, true, 1e-3));
    }
    // ends of yarns never slide
    let forces = vec![1.0; mesh.incidences.len()];
    let none = vec![false; mesh.incidences.len()];
    let free = sliding(&mesh, &all, &state, &forces, &none, &rule);
    assert!(
        mesh.incidences
            .iter()
            .zip(&free)
            .all(|(p, f)| p.slides == *f)
    );
    let mut forces = vec![0.0; mesh.incidences.len()];
    (forces[i], forces[other]) = (0.6 * bound, 1.5 * bound);
    set_anchors(&mesh, &all, &forces, &none, &free, &mut state);
    let off = |s: usize, i: usize| MATERIAL.anchor * (state.u[i] - state.strands[s].anchor);
    assert!((off(strand, i) - 0.6 * bound).abs() < 1e-12);
    assert!((off(strand + 1, other) - bound).abs() < 1e-12);
}

/// Material that is shot through one contact swings between its neighbours and comes to rest there. At a constant normal force the
/// sum of kinetic energy, stretch and the anchor's spring never grows, what it loses is `sum mu lambda |d anchor|`, and in the end
/// the yarn sticks within `mu lambda / k_f`. Velocity Verlet; the anchor follows after each step.
#[test]
fn friction_takes_the_energy_of_sliding() {
    let mut cloth = cloth("", weave(5, 5), |_| true);
    let (x, mut u) = (cloth.laid(), cloth.u());
    let mut state = cloth.state(&x, &u, 4);
    let mut terms = std::mem::take(&mut cloth.terms);
    terms.retain(|t| ["yarn_stretch", "sliding_friction"].contains(&t.name()));
    let strand = cloth.mesh.stack_starts[12] as usize;
    let i = cloth.mesh.stacks[strand].incidence as usize;
    let (block, c) = cloth.unknowns.slides[i].expect("it slides");
    state.strands = loose(&cloth.mesh, &u);
    state.strands[strand].contact = 0.02;
    let bound = MATERIAL.friction * 0.02;
    let mass = MATERIAL.density * P;
    let spring = 2.0 * MATERIAL.stretch / P;
    let h = 0.01 / (spring / mass).sqrt();
    // as far as a tenth of the pitch without friction
    let mut rate = 0.1 * P * (spring / mass).sqrt();
    let mut lost = 0.0;
    let mut look = |u: &[f64], state: &mut State, follow: bool| {
        let blocks = cloth.blocks(&x, u);
        let at = Configuration {
            x: &blocks,
            x0: &blocks,
            u,
            inv_dt: 0.0,
            world: &WORLD,
        };
        let (mut energy, mut g) = (0.0, vec![Vec3::zeros(); blocks.len()]);
        for term in &mut terms {
            let _ = term.begin_step(state, &at);
            energy += (0..term.stencils().count())
                .map(|e| term.value(e, &at))
                .sum::<f64>();
            add(term.as_ref(), &at, &mut g);
            if follow {
                term.accept(&at, state);
            }
        }
        (energy, g[block as usize][usize::from(c)])
    };
    let start = 0.5 * mass * rate * rate + look(&u, &mut state, false).0;
    let mut energy = start;
    for _ in 0..20_000 {
        let (_, slope) = look(&u, &mut state, false);
        rate -= 0.5 * h * slope / mass;
        u[i] += h * rate;
        let before = state.strands[strand].anchor;
        let (_, slope) = look(&u, &mut state, true);
        rate -= 0.5 * h * slope / mass;
        lost += bound * (state.strands[strand].anchor - before).abs();
        let now = 0.5 * mass * rate * rate + look(&u, &mut state, false).0;
        assert!(now < energy + 1e-4 * start, "{now:e} after {energy:e} J");
        energy = now;
    }
    let off = (u[i] - state.strands[strand].anchor).abs();
    println!(
        "{start:.3e} J, {energy:.3e} J left, {lost:.3e} J lost: {:.1e} beside it; {:.2} of the bound",
        (start - energy - lost) / start,
        off * MATERIAL.anchor / bound
    );
    assert!((start - energy - lost).abs() < 1e-3 * start);
    assert!(lost > 0.9 * start, "{lost:e} of {start:e} J");
    assert!(off <= bound / MATERIAL.anchor * (1.0 + 1e-12));
}

/// A yarn pulled over `n` held pegs: the tension grows at each by `(1 + mu s)/(1 - mu s)`, `s = sin(t/2)`, in the
/// limit by `exp(mu Theta)`.
#[test]
fn a_yarn_over_pegs_obeys_the_capstan_equation() {
    for (n, friction, around, printed) in [(12, 0.3, PI, 2.561), (6, 0.5, FRAC_PI_2, 2.191)] {
        let ratio = capstan(n, friction, around);
        let s = (0.5 * around / n as f64).sin();
        let exact = ((1.0 + friction * s) / (1.0 - friction * s)).powi(n as i32);
        println!(
            "capstan {n} pegs: {ratio:.4}, {exact:.4}, limit {:.4}",
            (friction * around).exp()
        );
        assert!((exact - printed).abs() < 2e-3);
        assert!((ratio / exact - 1.0).abs() < 3e-3, "{ratio} {exact}");
    }
}

fn capstan(n: usize, friction: f64, around: f64) -> f64 {
    // flat: the yarn along the first axis, a peg across it at each inner node
    let ends = n + 2;
    let mut uv: Vec<Vec2> = (0..ends).map(|k| Vec2::new(k as f64 * P, 0.0)).collect();
    let mut yarns = vec![(Family::Weft, (0..ends as u32).collect::<Vec<u32>>())];
    for k in 1..=n {
        let first = uv.len() as u32;
        uv.push(Vec2::new(k as f64 * P, -P));
        uv.push(Vec2::new(k as f64 * P, P));
        yarns.push((Family::Warp, vec![first, k as u32, first + 1]));
    }
    let mesh = lay(uv, &yarns, |node| match node {
        k if k >= 1 && k <= n => vec![(k, 1), (0, 0)],
        _ => vec![],
    });
    let material = YarnMaterial {
        radius: 0.0,
        bending: 0.0,
        friction,
        anchor: 1000.0,
        ..MATERIAL
    };
    // in space: segments of equal length that turn by the same angle at each peg, outwards up
    let mut x = vec![Vec3::zeros(); mesh.uv.len()];
    let mut direction = 0.5 * around;
    for k in 1..ends {
        let (s, c) = direction.sin_cos();
        x[k] = x[k - 1] + Vec3::new(c, 0.0, s) * P;
        direction -= around / n as f64;
    }
    for k in 1..=n {
        x[ends + 2 * k - 2] = x[k] - Vec3::y() * P;
        x[ends + 2 * k - 1] = x[k] + Vec3::y() * P;
    }
    let sliding: Vec<bool> = (0..mesh.incidences.len())
        .map(|i| i >= 1 && i <= n)
        .collect();
    let first_slide = mesh.uv.len() as u32;
    let unknowns = Unknowns::new(&mesh, 0, first_slide, &sliding).expect("unknowns");
    let options = YarnOptions::default();
    let mut terms = terms(&mesh, &[material], &unknowns, &options).expect("terms");
    terms.retain(|t| ["yarn_stretch", "sliding_friction"].contains(&t.name()));
    let mut compression =
        Compression::new(&mesh, &[material], &options, StackRule::LeastSquares).expect("rest data");
    let mut u: Vec<f64> = mesh.incidences.iter().map(|i| i.u).collect();
    let tension = 0.002;
    let strain = tension / material.stretch;
    u[..ends].iter_mut().for_each(|u| *u /= 1.0 + strain);
    let mut state: State = crate::yarn_cases::empty(Vec::new());
    state.strands = loose(&mesh, &u);
    let mut normals = vec![Vec3::zeros(); x.len()];
    let held = vec![true; x.len()];
    let pull = |u: &[f64], k: usize| material.stretch * (P / (u[k + 1] - u[k]) - 1.0);
    for _ in 0..400 {
        let place = YarnPlace {
            x: &x,
            u: &u,
            held: &held,
            gravity: Vec3::zeros(),
        };
        compression.update(
            &place,
            &Workers::default(),
            &mut normals,
            &mut state.strands,
        );
        u[ends - 1] -= 2e-7;
        u[0] = u[1] - P / (1.0 + strain);
        let start = blocks(&x, &u, &unknowns);
        state.velocities = vec![Vec3::zeros(); start.len()];
        state.u_rates = vec![0.0; u.len()];
        for _ in 0..50 {
            let now = blocks(&x, &u, &unknowns);
            let at = Configuration {
                x: &now,
                x0: &start,
                u: &u,
                inv_dt: 0.0,
                world: &WORLD,
            };
            let (mut g, mut h) = (vec![Vec3::zeros(); now.len()], DMatrix::zeros(n, n));
            for term in &mut terms {
                term.begin_step(&state, &at);
                add(term.as_ref(), &at, &mut g);
                for e in 0..term.stencils().count() {
                    let m = crate::terms_cases::hessian(term.as_ref(), e, &at, HessianKind::Exact);
                    let v = term.stencils().get(e);
                    for (a, &i) in v.iter().enumerate() {
                        for (b, &j) in v.iter().enumerate() {
                            if i >= first_slide && j >= first_slide {
                                let at = |b: u32| (b - first_slide) as usize;
                                h[(at(i), at(j))] += m[(3 * a, 3 * b)];
                            }
                        }
                    }
                }
            }
            let r = DVector::from_fn(n, |k, _| -g[first_slide as usize + k].x);
            let d = h.cholesky().expect("definite").solve(&r);
            for k in 0..n {
                u[k + 1] += d[k];
            }
            if d.amax() < 1e-14 {
                break;
            }
        }
        let now = blocks(&x, &u, &unknowns);
        let at = Configuration {
            x: &now,
            x0: &start,
            u: &u,
            inv_dt: 0.0,
            world: &WORLD,
        };
        for term in &mut terms {
            term.accept(&at, &mut state);
        }
    }
    pull(&u, n) / pull(&u, 0)
}

fn blocks(x: &[Vec3], u: &[f64], unknowns: &Unknowns) -> Vec<Vec3> {
    let mut out = x.to_vec();
    out.resize(x.len() + unknowns.slide_blocks(), Vec3::zeros());
    for (slide, u) in unknowns.slides.iter().zip(u) {
        if let Some((block, c)) = slide {
            out[*block as usize][usize::from(*c)] = *u;
        }
    }
    out
}

/// Material coordinates, rates, anchors and normals are part of a snapshot, and bytes that cannot be are refused.
#[test]
fn snapshots_hold_what_slides() {
    let cloth = cloth("", weave(4, 4), |_| true);
    let state = cloth.state(&cloth.laid(), &cloth.u(), 2);
    // infinity is no number of a file
    let state = State {
        step_size: 1.0,
        ..state
    };
    let origin = Origin {
        garment: 7,
        bodies: Vec::new(),
        numbers: Vec::new(),
    };
    let bytes = write(&state, &origin).expect("bytes");
    assert_eq!(read(&bytes, &origin, &state).expect("the state"), state);
    let spoil: [fn(&mut State); 5] = [
        |s| s.u[3] = f64::NAN,
        |s| s.u_rates.push(0.0),
        |s| s.strands[2].contact = -1.0,
        |s| s.strands[2].beside = f64::INFINITY,
        |s| s.yarn_normals[1].x = f64::NAN,
    ];
    for change in spoil {
        let mut bad = state.clone();
        change(&mut bad);
        let bytes = write(&bad, &origin).expect("bytes");
        assert!(read(&bytes, &origin, &state).is_err());
    }
}
