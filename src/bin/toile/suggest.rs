//! `toile suggest`: drapes and runs triangles alone, and tells where yarns would change the answer.

use crate::args::SuggestArgs;
use crate::info::load;
use crate::output::{Done, Failure, err, file, not_written, out};
use crate::picture::upright;
use crate::report;
use serde_json::{Map, Value, json};
use std::fmt::Write;
use toile::error::Error;
use toile::indicate::cost::Cost;
use toile::indicate::indicator::{CRITERIA, Indicator, LeftOut};
use toile::indicate::{Suggestion, Wish};
use toile::math::topology;
use toile::pattern::Garment;
use toile::readout::picture::render;
use toile::readout::{Part, palette};
use toile::report::{rivals, same_cost};
use toile::scene::Scene;
use toile::sim::{DrapeOptions, Outcome, Sim};
use toile::sim_scene::{Driver, build};

pub(crate) fn suggest(args: &SuggestArgs) -> Done {
    let dir = &args.out;
    std::fs::create_dir_all(dir).map_err(|e| Failure {
        code: 4,
        text: format!("cannot make {}: {e}", dir.display()),
    })?;
    let drawn = load(&args.scene)?;
    let mut scene = drawn.clone();
    scene.garment.blend_regions.clear();
    let wish = wish(args, &drawn)?;
    let alone = |e: Error| e.at("the scene by triangles alone, without its blend regions");
    let mut sim = build(&scene).map_err(alone)?;
    let mut text = String::new();
    let errors = judge(args, &scene, &mut sim, &wish.left_out, &mut text)?;
    let found = sim.suggest_for(&errors, &wish)?;
    text += &criteria(&sim, &found, &wish);
    text += &costs(&found);
    let garment = Garment {
        blend_regions: found.regions.clone(),
        ..scene.garment.clone()
    };
    let regions = toile::pattern::export::blend_regions(&garment)?;
    let garment = toile::pattern::export::garment_to_json(&garment)?;
    file(&dir.join("garment.json"), garment.as_bytes())?;
    let region = format!("{:#}\n", region(regions, &found, &wish));
    file(&dir.join("region.json"), region.as_bytes())?;
    let parts = parts(&scene, &sim, &found)?;
    render(&parts, &upright(&scene, args.picture_size))?
        .write_png(&dir.join("picture.png"))
        .map_err(not_written)?;
    if args.compare {
        let compared = rivals(&drawn, &found.regions, &mut |name| {
            err(&format!("{name}\n"));
        })?;
        report::write(&compared, dir)?;
        text.push('\n');
        text += &report::table(&compared);
    }
    out(&text)
}

/// What is asked for; a comparison without numbers asks for what the drawn regions cost.
fn wish(args: &SuggestArgs, drawn: &Scene) -> Result<Wish, Error> {
    let own = if args.compare {
        same_cost(drawn)?
    } else {
        Wish::default()
    };
    let given = args.tolerance.is_some() || args.budget.is_some();
    let mut left_out = LeftOut::default();
    for (left_out, name) in left_out.iter_mut().zip(CRITERIA) {
        *left_out = args.without.iter().any(|w| w == name);
    }
    let wish = Wish {
        tolerance: args.tolerance,
        budget: if given { args.budget } else { own.budget },
        rings: args.rings.unwrap_or(own.rings),
        left_out,
    };
    wish.check()?;
    Ok(wish)
}

/// Drapes and runs the scene and tells which states the errors are of: the largest after the drape and after every step.
fn judge(
    args: &SuggestArgs,
    scene: &Scene,
    sim: &mut Sim,
    left_out: &LeftOut,
    text: &mut String,
) -> Result<Indicator, Error> {
    let mut driver = Driver::new(sim, scene)?;
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
            *text += "it has not come to rest: errors are of where it stopped\n";
        }
    }
    let mut errors = sim.vertex_errors(left_out)?;
    let steps = if args.compare { 0 } else { scene.run.steps() };
    if let Some(until) = args.until
        && !(0.0..=scene.run.duration).contains(&until)
    {
        return Err(Error::argument(format!(
            "--until {until}: the scene's run ends at {} s",
            scene.run.duration
        )));
    }
    let until = args.until.unwrap_or(scene.run.duration);
    let origin = sim.time();
    let mut last = 0.0;
    for step in 1..=steps {
        // the last step is one that ends by then
        if scene.run.time_after(step) > until + 1e-9 * scene.run.dt {
            break;
        }
        driver.step(sim, scene, origin, step)?;
        errors.widen(&sim.vertex_errors(left_out)?);
        last = scene.run.time_after(step);
    }
    let begin = if scene.run.drape {
        "where the drape ended"
    } else {
        "the garment as it is placed"
    };
    *text += &if last > 0.0 {
        format!("errors are the largest of {begin} and of every step to {last} s of the run\n\n")
    } else if scene.run.steps() > 0 {
        format!(
            "errors are of {begin}; the scene's run of {} s is not judged\n\n",
            scene.run.duration
        )
    } else {
        format!("errors are of {begin}\n\n")
    };
    Ok(errors)
}

/// The region and why, for programs.
fn region(regions: Value, found: &Suggestion, wish: &Wish) -> Value {
    let criterion = |k: usize| -> Vec<f64> {
        let all = found.indicator.criteria.iter();
        all.map(|c| c[k]).collect()
    };
    let criteria: Map<String, Value> = (CRITERIA.iter().enumerate())
        .map(|(k, name)| ((*name).to_owned(), json!(criterion(k))))
        .collect();
    let left_out: Vec<&str> = (CRITERIA.iter().zip(wish.left_out))
        .filter(|(_, left_out)| *left_out)
        .map(|p| *p.0)
        .collect();
    let cost = |c: &Cost| {
        json!({
            "yarn_nodes": c.yarn_nodes,
            "carried_nodes": c.carried_nodes,
            "triangles": c.triangles,
            "unknowns": c.unknowns,
            "bytes": c.bytes,
            "time_ratio": c.time_ratio,
            "iteration_ratio": c.iteration_ratio,
        })
    };
    let errors = |[rms, largest]: [f64; 2]| json!({"rms": rms, "largest": largest});
    json!({
        "blend_regions": regions,
        "tolerance": found.tolerance,
        "left_out": left_out,
        "triangles": {"errors": errors(found.whole), "cost": cost(&found.triangles)},
        "suggested": {"errors": errors(found.left), "cost": cost(&found.cost)},
        "yarns_everywhere": {"cost": cost(&found.everywhere)},
        "alpha": found.region.alpha,
        "error": found.indicator.error,
        "criteria": criteria,
    })
}

/// Root mean square over the triangles' area and largest of a triangle, by each criterion and together.
fn criteria(sim: &Sim, found: &Suggestion, wish: &Wish) -> String {
    let mut text = format!(
        "{:<24} {:>13} {:>10}\n",
        "error of triangles", "rms over area", "largest"
    );
    let mut row = |name: &str, [rms, largest]: [f64; 2]| {
        let _ = writeln!(text, "{name:<24} {rms:>13.5} {largest:>10.5}");
    };
    for (k, name) in CRITERIA.iter().enumerate() {
        let value = |v: usize| found.indicator.criteria[v][k];
        let name = if wish.left_out[k] {
            format!("{name}, left out")
        } else {
            (*name).to_owned()
        };
        row(&name, found.indicator.over(sim.mesh(), value, |_| true));
    }
    row("together", found.whole);
    row("those that are left", found.left);
    let _ = writeln!(
        text,
        "\ntolerance {:.5}: rms over a vertex and what is around it",
        found.tolerance
    );
    text
}

/// What three models cost.
fn costs(found: &Suggestion) -> String {
    let mut text = format!(
        "\n{:<24} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}\n",
        "predicted", "yarn nodes", "triangles", "unknowns", "iteration", "drape", "MiB"
    );
    let mut row = |name: &str, c: &Cost| {
        let mib = c.bytes as f64 / f64::from(1 << 20);
        let _ = writeln!(
            text,
            "{name:<24} {:>10} {:>10} {:>10} {:>9.1}x {:>9.1}x {mib:>10.1}",
            c.yarn_nodes, c.triangles, c.unknowns, c.iteration_ratio, c.time_ratio
        );
    };
    row("triangles", &found.triangles);
    row("suggested (laid)", &found.cost);
    row("yarns everywhere", &found.everywhere);
    if found.regions.is_empty() {
        text += "\nno region: no triangle's error is above the tolerance, or the least region has more nodes than the budget\n";
    }
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
