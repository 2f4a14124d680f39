//! `toile fabric`: the size of a fabric of yarns at rest, and the triangles' material that is like it.

use crate::args::FabricArgs;
use crate::output::{Done, Failure, file, out};
use std::fmt::Write;
use std::path::Path;
use toile::error::Error;
use toile::fabric::fit::{BentSample, Fit, Range, Sample, TESTS, errors, fit};
use toile::pattern::export::fabric_to_json;
use toile::pattern::import::fabric_from_json;
use toile::readout::plot::{Curve, Plot};
use toile::solve::settings::Settings;

/// Error of the energy, root mean square, from which a fit is called poor.
const POOR: f64 = 0.1;
/// Points of a drawn curve.
const POINTS: usize = 60;

pub(crate) fn fabric(args: &FabricArgs) -> Done {
    let text = std::fs::read_to_string(&args.fabric).map_err(|e| Failure {
        code: 1,
        text: format!("cannot read {}: {e}", args.fabric.display()),
    })?;
    let named = |e: Error| e.at(args.fabric.display());
    let (fabric, _) = fabric_from_json(&text).map_err(named)?;
    let Some(yarns) = &fabric.yarns else {
        return Err(Failure::from(named(Error::material(format!(
            "fabric '{}' has no yarns",
            fabric.name
        )))));
    };
    let usual = Range::of(yarns);
    let range = Range {
        stretch: args.stretch.unwrap_or(usual.stretch),
        press: args.press.unwrap_or(usual.press),
        shear: args.shear.unwrap_or(usual.shear),
        curvature: args.curvature.unwrap_or(usual.curvature),
        steps: args.steps.unwrap_or(usual.steps),
    };
    let found = fit(yarns, &range, &Settings::default()).map_err(named)?;
    if let Some(dir) = &args.out {
        write(&found, &range, dir)?;
        let material = fabric_to_json(&found.fabric(&fabric))?;
        file(&dir.join("fabric.json"), material.as_bytes())?;
    }
    out(&table(&found, &range))
}

fn table(fit: &Fit, range: &Range) -> String {
    let [across, along] = fit.rest.factors;
    let [weft, coupling, warp, shear] = fit.membrane;
    let mut text = String::new();
    for (name, value) in [
        (
            "size at rest, across",
            format!("{across:.5} of the laid one"),
        ),
        ("size at rest, along", format!("{along:.5}")),
        ("area at rest", format!("{:.5}", across * along)),
        ("density", format!("{:.4} kg/m^2", fit.density)),
        ("membrane.weft", format!("{weft:.4e} N/m")),
        ("membrane.warp", format!("{warp:.4e} N/m")),
        ("membrane.coupling", format!("{coupling:.4e} N/m")),
        ("membrane.shear", format!("{shear:.4e} N/m")),
        (
            "its error of energy",
            format!(
                "{:.2} % rms, {:.2} % largest; stretch to {}, pressed to {}, shear to {}",
                1e2 * fit.errors[0],
                1e2 * fit.errors[1],
                range.stretch,
                range.press,
                range.shear
            ),
        ),
    ] {
        let _ = writeln!(text, "{name:<24} {value}");
    }
    if let Some(ridged) = &fit.ridged {
        let _ = writeln!(
            text,
            "{:<24} {} with {} strains; error of energy {:.2} % rms, {:.2} % largest",
            "ridges",
            ridged.ridges.len(),
            ridged
                .ridges
                .iter()
                .map(|r| r.strains().len())
                .sum::<usize>(),
            1e2 * ridged.errors[0],
            1e2 * ridged.errors[1]
        );
    }
    for (test, (name, _)) in TESTS.iter().enumerate() {
        let own: Vec<Sample> = (fit.samples.iter().filter(|s| s.test == test))
            .copied()
            .collect();
        if own.is_empty() {
            continue;
        }
        let [mean, largest] = errors(&own, |e| fit.energy(e));
        let _ = writeln!(
            text,
            "{:<24} {:.2} % rms, {:.2} % largest",
            format!("  {name}"),
            1e2 * mean,
            1e2 * largest
        );
    }
    for (name, bending) in
        [("bending.weft", 0), ("bending.warp", 1)].map(|(n, k)| (n, &fit.bending[k]))
    {
        let _ = writeln!(
            text,
            "{name:<24} {:.4e} N m, at rest {:.1} 1/m, error {:.2} %; curvature to {:.1} 1/m",
            bending.rigidity,
            bending.rest(),
            1e2 * bending.error,
            range.curvature
        );
    }
    let _ = writeln!(text, "{:<24} {}", "corrections", fit.corrections);
    let errors = fit.ridged.as_ref().map_or(fit.errors, |r| r.errors);
    if errors[0] > POOR {
        let _ = writeln!(
            text,
            "note: triangles follow this fabric poorly: the material is no more than a mean over these strains"
        );
    }
    text
}

/// Plots of the yarns' energy beside the triangles'.
fn write(fit: &Fit, range: &Range, dir: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(dir).map_err(|e| Failure {
        code: 4,
        text: format!("cannot make {}: {e}", dir.display()),
    })?;
    let mut curves = Vec::new();
    for (test, (name, direction)) in TESTS.iter().enumerate() {
        let part = |k: usize, of: usize| k as f64 / of as f64;
        let own = fit.samples.iter().filter(|s| s.test == test);
        let points: Vec<[f64; 2]> = (1..)
            .zip(own)
            .map(|(k, s)| [part(k, range.steps), s.energy])
            .collect();
        if points.is_empty() {
            continue;
        }
        curves.push(Curve {
            name: format!("yarns: {name}"),
            points,
        });
        let material = |k: usize| {
            let t = part(k, POINTS);
            [t, fit.energy(&(range.end(direction) * t))]
        };
        curves.push(Curve {
            name: format!("triangles: {name}"),
            points: (1..=POINTS).map(material).collect(),
        });
    }
    let membrane = Plot {
        title: "membrane of the fitted triangles beside the yarns".into(),
        x: format!(
            "strain over {} (stretch), {} (shear)",
            range.stretch, range.shear
        ),
        y: "energy [J/m^2]".into(),
        log_y: true,
        curves,
        ..Plot::default()
    };
    membrane.write(&dir.join("membrane.svg"))?;
    let mut curves = Vec::new();
    for (axis, name) in ["weft", "warp"].iter().enumerate() {
        let own = |s: &&BentSample| s.axis == axis;
        let mut points: Vec<[f64; 2]> = (fit.bent.iter().filter(own))
            .map(|s| [s.curvature, s.energy])
            .collect();
        points.push([0.0, 0.0]);
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        curves.push(Curve {
            name: format!("yarns: {name} curved"),
            points,
        });
        let bending = fit.bending[axis];
        let material = |k: usize| {
            let kappa = range.curvature * (2.0 * k as f64 / POINTS as f64 - 1.0);
            let energy = (bending.moment + 0.5 * bending.rigidity * kappa) * kappa;
            [kappa, energy]
        };
        curves.push(Curve {
            name: format!("triangles: {name} curved"),
            points: (0..=POINTS).map(material).collect(),
        });
    }
    let bending = Plot {
        title: "bending of the fitted triangles beside the yarns".into(),
        x: "curvature to the front [1/m]".into(),
        y: "energy [J/m^2]".into(),
        curves,
        ..Plot::default()
    };
    bending.write(&dir.join("bending.svg"))?;
    Ok(())
}
