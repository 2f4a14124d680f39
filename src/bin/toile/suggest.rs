//! `toile suggest`: drapes triangles alone, and tells where yarns would change the answer.

use crate::args::SuggestArgs;
use crate::info::load;
use crate::output::{Done, Failure, err, file, not_written, out};
use crate::picture::upright;
use crate::report::table;
use serde_json::json;
use std::fmt::Write;
use toile::error::Error;
use toile::indicate::cost::Cost;
use toile::indicate::indicator::CRITERIA;
use toile::indicate::{Suggestion, Wish};
use toile::math::topology;
use toile::pattern::Garment;
use toile::readout::picture::render;
use toile::readout::{Part, palette};
use toile::scene::Scene;
use toile::sim::{DrapeOptions, Outcome, Sim};
use toile::sim_scene::build;

pub(crate) fn suggest(args: &SuggestArgs) -> Done {
    let dir = &args.out;
    std::fs::create_dir_all(dir).map_err(|e| Failure {
        code: 4,
        text: format!("cannot make {}: {e}", dir.display()),
    })?;
    let drawn = load(&args.scene)?;
    let mut scene = drawn.clone();
    scene.garment.blend_regions.clear();
    let wish = Wish {
        tolerance: args.tolerance,
        budget: args.budget,
        rings: args.rings,
    };
    wish.check()?;
    if args.compare && drawn.garment.blend_regions.is_empty() {
        return Err(Error::argument(
            "--compare compares with the garment's own regions; it has none",
        )
        .into());
    }
    let mut sim = build(&scene)?;
    let mut text = String::new();
    if scene.run.drape {
        let options = DrapeOptions {
            force_tolerance: 0.0,
            max_steps: 0,
        };
        let report = sim.drape(&options, &mut |_| true)?;
        let _ = writeln!(text, "drape of triangles: {}", report.outcome.name());
        if !report.reason.is_empty() {
            let _ = writeln!(text, "{}", report.reason);
        }
        if report.outcome != Outcome::Converged {
            text += "it has not come to rest: errors are of where it stopped\n";
        }
        text.push('\n');
    } else {
        text += "the scene asks for no drape: errors are of the garment as it is placed\n\n";
    }
    let found = sim.suggest_region(&wish)?;
    text += &criteria(&found);
    text += &costs(&found);
    let garment = Garment {
        blend_regions: found.regions.clone(),
        ..scene.garment.clone()
    };
    let regions = toile::pattern::export::blend_regions(&garment)?;
    let garment = toile::pattern::export::garment_to_json(&garment)?;
    file(&dir.join("garment.json"), garment.as_bytes())?;
    let region = json!({
        "blend_regions": regions,
        "tolerance": found.tolerance,
        "alpha": found.region.alpha,
        "error": found.indicator.error,
    });
    file(&dir.join("region.json"), format!("{region:#}\n").as_bytes())?;
    let parts = parts(&scene, &sim, &found)?;
    render(&parts, &upright(&scene, args.picture_size))?
        .write_png(&dir.join("picture.png"))
        .map_err(not_written)?;
    if args.compare {
        let report = toile::report::rivals(&drawn, &mut |name| err(&format!("{name}\n")))?;
        text.push('\n');
        text += &table(&report);
    }
    out(&text)
}

/// Mean and largest estimate by each criterion.
fn criteria(found: &Suggestion) -> String {
    let mut text = format!("{:<22} {:>10} {:>10}\n", "criterion", "rms", "largest");
    let mut row = |name: &str, values: &mut dyn Iterator<Item = f64>| {
        let [mut sum, mut largest, mut count] = [0.0_f64; 3];
        for v in values {
            sum += v * v;
            largest = largest.max(v);
            count += 1.0;
        }
        let _ = writeln!(
            text,
            "{name:<22} {:>10.5} {largest:>10.5}",
            (sum / count.max(1.0)).sqrt()
        );
    };
    for (k, name) in CRITERIA.iter().enumerate() {
        row(name, &mut found.indicator.criteria.iter().map(|c| c[k]));
    }
    row("error", &mut found.indicator.error.iter().copied());
    let _ = writeln!(text, "\n{:<22} {:>10.5}", "tolerance", found.tolerance);
    let [all, left] = found.errors;
    let _ = writeln!(text, "{:<22} {all:>10.5}", "error of triangles");
    let _ = writeln!(text, "{:<22} {left:>10.5}", "of those that are left");
    text
}

/// What three models cost.
fn costs(found: &Suggestion) -> String {
    let mut text = format!(
        "\n{:<22} {:>10} {:>10} {:>10} {:>10} {:>10}\n",
        "predicted", "yarn nodes", "triangles", "unknowns", "time", "MiB"
    );
    let mut row = |name: &str, c: &Cost| {
        let mib = c.bytes as f64 / f64::from(1 << 20);
        let _ = writeln!(
            text,
            "{name:<22} {:>10} {:>10} {:>10} {:>9.1}x {mib:>10.1}",
            c.yarn_nodes, c.triangles, c.unknowns, c.time_ratio
        );
    };
    row("triangles", &found.triangles);
    row("suggested", &found.cost);
    row("yarns everywhere", &found.everywhere);
    text
}

/// The garment coloured by the root of its error over the largest one, the region's border as lines, and bodies.
fn parts(scene: &Scene, sim: &Sim, found: &Suggestion) -> toile::error::Result<Vec<Part>> {
    let mut garment = Part::garment(
        "garment",
        sim.positions(),
        sim.triangles(),
        sim.vertex_panels(),
    );
    let errors = &found.indicator.error;
    let largest = errors.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    garment.colours = errors
        .iter()
        .map(|e| palette::heat((e / largest).sqrt()))
        .collect();
    for (edge, [a, b]) in topology::inner_edges(sim.triangles()) {
        if found.region.full[a as usize] != found.region.full[b as usize] {
            garment.lines.push(edge);
        }
    }
    let mut parts = vec![garment];
    for (i, body) in (0_u32..).zip(&scene.bodies) {
        let (positions, faces) = sim.body_mesh(i)?;
        parts.push(Part::body(&body.name, positions, faces));
    }
    Ok(parts)
}
