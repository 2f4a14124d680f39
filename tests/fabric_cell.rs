//! The periodic cell of a fabric: the same for one repeat and for several, like the middle of a large patch, and its stress
//! the derivative of its energy.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::yarn_sims::{WHOLE, patch, sim};
use nalgebra::{Matrix3x2, Rotation3, Vector3};
use toile::fabric::PeriodicCell;
use toile::fabric::fit::{Fit, Range, fit};
use toile::fabric::rest::{cells, rest};
use toile::pattern::export::fabric_to_json;
use toile::pattern::import::fabric_from_json;
use toile::pattern::{Fabric, YarnFabric};
use toile::sim::{DrapeOptions, Outcome};
use toile::solve::settings::Settings;

/// A cell of a preset whose contacts are held, or not.
pub(crate) fn cell(preset: &str, repeats: [usize; 2], slides: bool) -> PeriodicCell {
    let fabric = YarnFabric::preset(preset).unwrap();
    let mut cell = PeriodicCell::new(&fabric, repeats, &Settings::default()).unwrap();
    cell.set_sliding(slides).unwrap();
    cell
}

fn gradient(weft: f64, warp: f64, shear: f64) -> Matrix3x2<f64> {
    Matrix3x2::new(1.0 + weft, shear, 0.0, 1.0 + warp, 0.0, 0.0)
}

/// One repeat, several, and repeats across or along: one energy per area, and one mass, to 1e-9. Odd and even numbers of
/// courses, whose yarns run to and fro.
#[test]
fn cells_of_any_number_of_repeats_agree() {
    for (preset, more) in [
        ("plain shirting", [2, 2]),
        ("satin shirting", [1, 2]),
        ("jersey", [1, 2]),
        ("jersey", [3, 3]),
        ("sweater", [2, 1]),
        ("rib", [1, 3]),
    ] {
        let mut found = Vec::new();
        for repeats in [[1, 1], more] {
            let mut cell = cell(preset, repeats, false);
            cell.stretch(&gradient(0.01, 0.02, 0.015));
            cell.relax(1e-10).unwrap();
            found.push([cell.energy().unwrap(), cell.density()]);
        }
        for k in 0..2 {
            let [one, several] = [found[0][k], found[1][k]];
            assert!(
                (one / several - 1.0).abs() < 1e-9,
                "{preset} {more:?}: {found:?}"
            );
        }
    }
}

/// `P = dW/dF` by differences to 1e-5 of the largest, at a garter's own state of stress.
#[test]
fn the_stress_of_a_cell_is_the_derivative_of_its_energy() {
    for (preset, size) in [("plain shirting", 0.01), ("sweater", -0.03)] {
        let mut cell = cell(preset, [1, 1], false);
        let at = gradient(size, -0.5 * size, 0.02);
        cell.stretch(&at);
        cell.relax(1e-11).unwrap();
        let stress = cell.stress().unwrap();
        let h = 1e-5;
        for (row, column) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let mut energy = [0.0; 2];
            for (energy, side) in energy.iter_mut().zip([h, -h]) {
                let mut moved = at;
                moved[(row, column)] += side;
                cell.stretch(&moved);
                cell.relax(1e-11).unwrap();
                *energy = cell.energy().unwrap();
            }
            let slope = (energy[0] - energy[1]) / (2.0 * h);
            let error = (slope - stress[(row, column)]).abs() / stress.amax();
            assert!(error < 1e-5, "{preset} ({row}, {column}): {slope} {stress}");
        }
    }
}

/// A turned cell has the energy and the turned stress of the one that was not turned.
#[test]
fn a_cell_is_the_same_in_every_direction_of_space() {
    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), 1.1)
        * Rotation3::from_axis_angle(&Vector3::x_axis(), -0.4);
    let mut found = Vec::new();
    for rotation in [Rotation3::identity(), turn] {
        let mut cell = cell("rib", [1, 1], false);
        cell.stretch(&(rotation.matrix() * gradient(0.03, 0.01, 0.02)));
        cell.relax(1e-11).unwrap();
        let stress = rotation.inverse().matrix() * cell.stress().unwrap();
        found.push((cell.energy().unwrap(), stress));
    }
    assert!((found[0].0 / found[1].0 - 1.0).abs() < 1e-9, "{found:?}");
    assert!(
        (found[0].1 - found[1].1).amax() < 1e-6 * found[0].1.amax(),
        "{found:?}"
    );
}

/// A plain weave held at its rim and stretched by 1 % along the weft has in its middle the energy of the cell, which is
/// `Y pi R^2 / (2 d) (l - 1)^2`, to 1e-6.
#[test]
fn a_cell_is_the_middle_of_a_large_patch() {
    let yarns = r#"{"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025, "young": 1e7}"#;
    let strain = 0.01;
    let mut sim = sim(&patch(yarns, 0.016, 0.016, WHOLE), 0.0, &[]);
    let mesh = sim.yarns().unwrap().clone();
    let far = |n: &u32| {
        let uv = mesh.uv[*n as usize];
        uv.min() < 0.0009 || uv.max() > 0.0151
    };
    let rim: Vec<u32> = (0..mesh.uv.len() as u32).filter(far).collect();
    let targets: Vec<[f64; 3]> = (rim.iter())
        .map(|n| sim.yarn_nodes()[*n as usize])
        .map(|x| [(1.0 + strain) * x.x, x.y, x.z])
        .collect();
    sim.pin_yarn_nodes(&rim, Some(&targets)).unwrap();
    let options = DrapeOptions {
        force_tolerance: 1e-9,
        max_steps: 0,
    };
    sim.drape(&options, &mut |_| true).unwrap();
    let stiffness = 1e7 * std::f64::consts::PI * 0.00025_f64.powi(2);
    let (x, u) = (sim.yarn_nodes(), sim.yarn_coordinates());
    let mut sum = 0.0;
    let middle = |n: u32| {
        let d = mesh.uv[n as usize] - toile::math::Vec2::new(0.008, 0.008);
        d.amax() < 0.004
    };
    for y in 0..mesh.yarn_count() {
        for i in mesh.starts[y] as usize + 1..mesh.starts[y + 1] as usize {
            let [a, b] = [i - 1, i].map(|i| mesh.incidences[i].node);
            let du = u[i] - u[i - 1];
            let length = (x[b as usize] - x[a as usize]).norm();
            // a segment across the border of the middle has half its energy in it
            let part = 0.5 * f64::from(u8::from(middle(a)) + u8::from(middle(b)));
            sum += part * 0.5 * stiffness * du * (length / du - 1.0).powi(2);
        }
    }
    let patch = sum / (0.008 * 0.008);
    let (fabric, _) = fabric_from_json(&format!(r#"{{"yarns": {yarns}}}"#)).unwrap();
    let fabric = fabric.yarns.unwrap();
    let mut cell = PeriodicCell::new(&fabric, [1, 1], &Settings::default()).unwrap();
    cell.stretch(&gradient(strain, 0.0, 0.0));
    cell.relax(1e-10).unwrap();
    let energy = cell.energy().unwrap();
    let formula = 0.5 * stiffness / 0.001 * strain * strain;
    assert!((energy / formula - 1.0).abs() < 1e-6, "{energy} {formula}");
    assert!((patch / energy - 1.0).abs() < 1e-6, "{patch} {energy}");
}

/// A bent plain weave has `1/2 B pi R^2 / d kappa^2` about either axis and to either side, to 1e-6. Jersey gives way if its
/// courses are curved to the back and its wales to the front.
#[test]
fn a_cell_bends_as_its_yarns_do() {
    let flat = cell("plain shirting", [1, 1], false);
    let rigidity = 3e-4 * std::f64::consts::PI * 1.25e-4_f64.powi(2) / 5e-4;
    for axis in [0, 1] {
        for curvature in [-40.0, 40.0] {
            let mut bent = flat.bent(axis, curvature).unwrap();
            bent.relax(1e-13).unwrap();
            let energy = bent.energy().unwrap();
            let formula = 0.5 * rigidity * curvature * curvature;
            assert!(
                (energy / formula - 1.0).abs() < 1e-3,
                "{axis} {curvature}: {energy} {formula}"
            );
        }
    }
    let mut flat = cell("jersey", [1, 1], false);
    flat.relax(1e-9).unwrap();
    for (axis, easy) in [(0, -50.0), (1, 50.0)] {
        let [gives, resists] = [easy, -easy].map(|curvature| {
            let mut bent = flat.bent(axis, curvature).unwrap();
            bent.relax(1e-9).unwrap();
            bent.energy().unwrap()
        });
        assert!(
            gives < flat.energy().unwrap() && gives < resists,
            "{axis}: {gives} {resists}"
        );
    }
}

/// Triangles fitted to a plain weave err by less than 2 % of the energy up to 1 % of stretch and 0.1 of shear, and are those
/// of `Y pi R^2 / d`, `4 S R^2 / d`, `B pi R^2 / d` to 1 %.
#[test]
fn triangles_fitted_to_a_plain_weave_have_its_energy() {
    let yarns = YarnFabric::preset("plain shirting").unwrap();
    let found = fit(&yarns, &Range::of(&yarns), &Settings::default()).unwrap();
    assert!(found.errors[1] < 0.02, "{:?}", found.errors);
    let section = std::f64::consts::PI * yarns.radius * yarns.radius;
    let [weft, coupling, warp, shear] = found.membrane;
    let pitch = 5e-4;
    for (name, value, formula) in [
        ("weft", weft, yarns.young * section / pitch),
        ("warp", warp, yarns.young * section / pitch),
        (
            "shear",
            shear,
            4.0 * yarns.shear * yarns.radius.powi(2) / pitch,
        ),
        (
            "bending",
            found.bending[0].rigidity,
            yarns.bending * section / pitch,
        ),
        (
            "bending",
            found.bending[1].rigidity,
            yarns.bending * section / pitch,
        ),
        ("density", found.density, 2.0 * yarns.density / pitch),
    ] {
        assert!(
            (value / formula - 1.0).abs() < 0.01,
            "{name}: {value} {formula}"
        );
    }
    assert!(coupling.abs() < 1e-3 * weft, "{coupling}");
    assert!(
        (found.rest.factors[0] - 1.0).abs() < 1e-9,
        "{:?}",
        found.rest
    );
}

/// Energies over the rest of a cell and errors of a fit, over the yarns' energy, at strains that are no test's: within the
/// square of the tests, one direction stretched by more than the other is pressed together, every other one sheared.
fn between(yarns: &YarnFabric, found: &Fit, range: &Range, count: usize) -> Vec<f64> {
    let mut cell = PeriodicCell::one(yarns, &Settings::default()).unwrap();
    let [across, along] = rest(&mut cell).unwrap().factors;
    let (nothing, area) = (cell.nothing(), across * along);
    cell.relax(nothing).unwrap();
    let base = Matrix3x2::new(across, 0.0, 0.0, along, 0.0, 0.0);
    let start = cell.energy().unwrap();
    let shear = cell.stress().unwrap()[(0, 1)] / across;
    // from one state of rest: a garter has several at one strain
    let kept = cell.checkpoint();
    let mut random = crate::sheets::Random::new(5);
    let mut at = |k: usize| {
        let v = random.vec3(1.0);
        let (mut e, mut f) = (range.stretch * v.x, range.press * v.y);
        if e + f < 0.0 {
            (e, f) = (-f, -e);
        }
        let g = if k.is_multiple_of(2) {
            0.0
        } else {
            range.shear * v.z
        };
        let side = (1.0 + 2.0 * e).sqrt();
        let slant = g / side;
        let to = Matrix3x2::new(
            side * across,
            slant * along,
            0.0,
            (1.0 + 2.0 * f - slant * slant).sqrt() * along,
            0.0,
            0.0,
        );
        cell.roll_back(kept.clone());
        for step in 1..=4 {
            cell.stretch(&(base + (to - base) * (f64::from(step) / 4.0)));
            cell.relax(nothing).unwrap();
        }
        let energy = (cell.energy().unwrap() - start) / area - shear * g;
        let error = found.energy(&Vector3::new(e, f, g)) / energy - 1.0;
        println!("({e:.3}, {f:.3}, {g:.3}): {energy:.2e} J/m^2, error {error:.2}");
        error
    };
    (0..count).map(&mut at).collect()
}

/// Ridges follow knits within 10 % of the energy (rms) where a constant stiffness is off by more than 25 %, and within 10 % (mean)
/// at strains that are no test's. Pressed together by 5 % or half as much again stretched they are within 25 %. The fabric
/// comes back from its file.
#[test]
fn triangles_with_ridges_have_the_energy_of_knits() {
    for preset in ["jersey", "sweater"] {
        let yarns = YarnFabric::preset(preset).unwrap();
        let usual = Range::of(&yarns);
        let numbers = Settings::default();
        let found = fit(&yarns, &usual, &numbers).unwrap();
        let ridged = found.ridged.as_ref().unwrap();
        println!(
            "{preset}: {:?} without, {:?} with ridges",
            found.errors, ridged.errors
        );
        assert!(found.errors[0] > 0.25, "{preset}: {:?}", found.errors);
        assert!(ridged.errors[0] < 0.1, "{preset}: {:?}", ridged.errors);
        let other = between(&yarns, &found, &usual, 24);
        let mean = other.iter().map(|e| e.abs()).sum::<f64>() / other.len() as f64;
        let rms = (other.iter().map(|e| e * e).sum::<f64>() / other.len() as f64).sqrt();
        println!("{preset} at other strains: {mean:.3} mean, {rms:.3} rms");
        assert!(mean < 0.1, "{preset}: {mean} {rms}");
        let mut cell = PeriodicCell::one(&yarns, &numbers).unwrap();
        let [across, along] = rest(&mut cell).unwrap().factors;
        let nothing = cell.nothing();
        cell.relax(nothing).unwrap();
        let start = cell.energy().unwrap();
        for [weft, warp] in [
            [-0.02, 0.0],
            [-0.05, 0.0],
            [0.0, -0.02],
            [0.0, -0.05],
            [0.15, 0.15],
        ] {
            let [a, b] = [weft, warp].map(|e: f64| (1.0 + 2.0 * e).sqrt());
            cell.stretch(&Matrix3x2::new(across * a, 0.0, 0.0, along * b, 0.0, 0.0));
            cell.relax(nothing).unwrap();
            let yarns = (cell.energy().unwrap() - start) / (across * along);
            let ratio = found.energy(&Vector3::new(weft, warp, 0.0)) / yarns;
            println!("{preset} at {weft}, {warp}: {ratio:.3} of the yarns' energy");
            assert!(
                (ratio - 1.0).abs() < 0.25,
                "{preset} {weft} {warp}: {ratio}"
            );
        }
        let fabric = found.fabric(&Fabric::default());
        fabric.check().unwrap();
        let (read, _) = fabric_from_json(&fabric_to_json(&fabric).unwrap()).unwrap();
        assert_eq!(read, fabric);
    }
}

/// Same for a rib, which unfolds.
#[test]
fn triangles_with_ridges_have_the_energy_of_a_rib() {
    let yarns = YarnFabric::preset("rib").unwrap();
    let found = fit(&yarns, &Range::of(&yarns), &Settings::default()).unwrap();
    let ridged = found.ridged.as_ref().unwrap();
    println!(
        "{:?} without, {:?} with ridges",
        found.errors, ridged.errors
    );
    assert!(found.errors[0] > 0.25, "{:?}", found.errors);
    assert!(ridged.errors[0] < 0.1, "{:?}", ridged.errors);
    // the folds give way to a pull across, and are as stiff as a fold is high against bending that curves the wales
    assert!(found.membrane[0] < 0.1 * found.membrane[2], "{found:?}");
    assert!(found.bending[1].rigidity > 10.0 * found.bending[0].rigidity);
}

/// Bad ranges are refused, a chart that is the whole piece has no cell.
#[test]
fn tests_that_cannot_be_are_refused() {
    let yarns = YarnFabric::preset("jersey").unwrap();
    let usual = Range::of(&yarns);
    let numbers = Settings::default();
    for range in [
        Range {
            stretch: 0.0,
            ..usual
        },
        Range {
            shear: f64::NAN,
            ..usual
        },
        Range {
            curvature: -1.0,
            ..usual
        },
        Range {
            press: -0.1,
            ..usual
        },
        Range {
            press: 0.5,
            ..usual
        },
        Range { steps: 0, ..usual },
    ] {
        assert!(fit(&yarns, &range, &numbers).is_err(), "{range:?}");
    }
    let (once, _) = fabric_from_json(
        r#"{"yarns": {"instructions": ["co 4 turn", "k 4 turn", "bo 4"], "once": true, "loop_width": 0.004, "radius": 0.001}}"#,
    )
    .unwrap();
    let error = PeriodicCell::new(&once.yarns.unwrap(), [1, 1], &numbers)
        .err()
        .unwrap();
    assert!(error.message.contains("repeat"), "{}", error.message);
    // the wrapping of so rough yarns is no bending that a rigidity could tell
    let rough = YarnFabric {
        friction: 10.0,
        ..yarns
    };
    let error = fit(&rough, &usual, &numbers).err().unwrap();
    assert!(error.message.contains("bending"), "{}", error.message);
}

/// A chart that repeats in itself is as small a cell as its repeat.
#[test]
fn a_chart_is_cut_down_to_its_repeat() {
    let repeat = |rows: &[&str]| {
        let rows: Vec<String> = rows.iter().map(|row| format!("\"{row}\"")).collect();
        let text = format!(
            r#"{{"yarns": {{"chart": [{}], "loop_width": 0.004, "radius": 0.001}}}}"#,
            rows.join(", ")
        );
        let (fabric, _) = fabric_from_json(&text).unwrap();
        fabric.yarns.unwrap().structure.repeat()
    };
    assert_eq!(repeat(&["........"; 8]), [1, 1]);
    assert_eq!(repeat(&["..--..--", "..--..--"]), [4, 1]);
    assert_eq!(repeat(&[".-.-", "-.-.", ".-.-", "-.-."]), [2, 2]);
    assert_eq!(repeat(&[".", "-"]), [1, 2]);
    assert_eq!(repeat(&[".-."]), [3, 1]);
}

/// Area at rest over the laid one: of the parallelograms from each contact to those two loops across and two courses on.
fn kept_area(yarns: &str, side: f64) -> f64 {
    let text = patch(yarns, side, side, WHOLE);
    let mut sim = sim(&text, 0.0, &[]);
    let options = DrapeOptions {
        force_tolerance: 1e-5,
        max_steps: 6000,
    };
    let report = sim.drape(&options, &mut |_| true).unwrap();
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
    let cell = cells(sim.garment(), |_| true, &Settings::default()).unwrap()[0];
    let structure = &sim.garment().fabrics[0].yarns.as_ref().unwrap().structure;
    let [w, h] = structure.pitch();
    let steps = [2.0 * w * cell.across, 2.0 * h * cell.along];
    let mesh = sim.yarns().unwrap();
    let x = sim.yarn_nodes();
    let crossed = |n: &u32| mesh.stack(*n as usize).len() > 1;
    let contacts: Vec<u32> = (0..mesh.uv.len() as u32).filter(crossed).collect();
    let (mut area, mut laid) = (0.0, 0.0);
    for n in &contacts {
        let at = |dx: f64, dy: f64| {
            let there = mesh.uv[*n as usize] + toile::math::Vec2::new(dx, dy);
            let near = |m: &&u32| (mesh.uv[**m as usize] - there).norm() < 0.02 * w;
            contacts
                .iter()
                .find(near)
                .map(|m| x[*m as usize] - x[*n as usize])
        };
        if let (Some(a), Some(b)) = (at(steps[0], 0.0), at(0.0, steps[1])) {
            area += a.cross(&b).norm();
            laid += steps[0] * steps[1];
        }
    }
    assert!(laid > 0.0);
    println!("{yarns} {side} m: {:.4} of the laid area", area / laid);
    area / laid
}

/// A garter swatch that is laid as its numbers say draws in; compensated ones keep their area within 1 %, and so does a weave.
#[test]
fn compensated_fabrics_keep_their_size() {
    let bare = kept_area(r#"{"preset": "sweater"}"#, 0.018);
    assert!(bare < 0.97, "{bare}");
    for (yarns, side) in [
        (r#"{"preset": "sweater", "compensated": true}"#, 0.024),
        (
            r#"{"preset": "plain shirting", "compensated": true}"#,
            0.006,
        ),
    ] {
        let kept = kept_area(yarns, side);
        assert!((kept - 1.0).abs() < 0.01, "{yarns} {side}: {kept}");
    }
}

/// Layers of a fold touch each other and their images: what contact of spheres adds to the energy of a rib narrowed as a
/// plane is the same for one repeat and for several to 1 % (spheres in one plane part to either side), and the stress of one at rest
/// is the derivative of the energy to 1e-4.
#[test]
fn layers_of_a_fold_touch_their_images() {
    let fabric = YarnFabric::preset("rib").unwrap();
    let laid = |repeats: [usize; 2], contact: f64| {
        let settings = Settings {
            self_contact: contact,
            ..Settings::default()
        };
        let mut cell = PeriodicCell::new(&fabric, repeats, &settings).unwrap();
        cell.set_sliding(false).unwrap();
        cell
    };
    let added = [[1, 1], [2, 1], [1, 2]].map(|repeats| {
        let [with, without] = [1.0, 0.0].map(|contact| {
            let mut cell = laid(repeats, contact);
            cell.stretch(&gradient(-0.75, -0.1, 0.0));
            cell.energy().unwrap()
        });
        with - without
    });
    println!("contact adds {added:?} J/m^2");
    assert!(added[0] > 0.01, "{added:?}");
    for several in &added[1..] {
        assert!((several / added[0] - 1.0).abs() < 0.01, "{added:?}");
    }
    let mut cell = laid([1, 1], 1.0);
    let mut at = |weft: f64| {
        cell.stretch(&gradient(weft, -0.15, 0.0));
        cell.relax(1e-9).unwrap();
        (cell.energy().unwrap(), cell.stress().unwrap())
    };
    for step in 1..15 {
        at(-0.05 * f64::from(step));
    }
    let (_, stress) = at(-0.75);
    let h = 1e-5;
    let slope = (at(-0.75 + h).0 - at(-0.75 - h).0) / (2.0 * h);
    let error = (slope - stress[(0, 0)]).abs() / stress.amax();
    println!("slope {slope}, stress {stress}");
    assert!(error < 1e-4, "{slope} {stress}");
}

/// A rib folds up at rest, to the width of a swatch that is free (`yarn_fabrics`) within a tenth of the laid one, and as far
/// as its layers let it: no yarns that are apart as laid are nearer than 0.8 of their thickness.
#[test]
fn a_rib_comes_to_rest_on_its_own_layers() {
    let fabric = YarnFabric::preset("rib").unwrap();
    let mut cell = PeriodicCell::one(&fabric, &Settings::default()).unwrap();
    let found = rest(&mut cell).unwrap();
    let [across, along] = found.factors;
    println!("rib: {across:.4} of its width, {along:.4} of its height");
    assert!((across - 0.39).abs() < 0.1, "{across}");
    let (mesh, x) = (&cell.yarns().mesh, cell.nodes());
    let mut nearest = f64::INFINITY;
    for a in (0..x.len()).filter(|n| mesh.is_inside(*n as u32)) {
        for b in (0..x.len()).filter(|b| (mesh.uv[a] - mesh.uv[*b]).norm() > 3e-3) {
            nearest = nearest.min((x[a] - x[b]).norm());
        }
    }
    println!(
        "nearest {:.3} of two radii",
        nearest / (2.0 * fabric.radius)
    );
    assert!(nearest > 0.8 * 2.0 * fabric.radius, "{nearest}");
    assert!(nearest < 1.05 * 2.0 * fabric.radius, "{nearest}");
}
