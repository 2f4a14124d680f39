//! `toile run`: builds, drapes, steps, writes.

use crate::args::RunArgs;
use crate::info::load;
use crate::output::{Done, Failure, file, not_written, out};
use crate::picture::upright;
use crate::summary::{Summary, table};
use indicatif::{ProgressBar, ProgressStyle};
use std::process::ExitCode;
use std::time::Instant;
use toile::error::Error;
use toile::math::{Vec3, topology};
use toile::readout::export::{gltf, obj, pc2};
use toile::readout::picture::render;
use toile::readout::{Part, crossings, yarns};
use toile::scene::Scene;
use toile::sim::{DrapeOptions, Outcome, Progress, Sim, StepReport};
use toile::sim_scene::{Driver, build};
use toile::system::contact::crossing::SewnSurface;

/// Time of `--verify` [s] and its step [s].
const VERIFY: (u32, f64) = (60, 1.0 / 60.0);

/// Exit code of a drape that does not come to rest.
const NOT_AT_REST: u8 = 5;

/// Frames kept for the model file and the point cache.
#[derive(Default)]
struct Frames {
    times: Vec<f64>,
    garment: Vec<Vec<Vec3>>,
    /// Bodies that move, by number.
    bodies: Vec<(u32, Vec<Vec<Vec3>>)>,
}

impl Frames {
    fn new(scene: &Scene) -> Self {
        let moving = (0..).zip(&scene.bodies).filter(|(_, b)| b.motion.moves());
        Self {
            bodies: moving.map(|(i, _)| (i, Vec::new())).collect(),
            ..Self::default()
        }
    }

    fn keep(&mut self, sim: &Sim) -> Result<(), Error> {
        self.times.push(sim.time());
        self.garment.push(sim.positions().to_vec());
        for (body, frames) in &mut self.bodies {
            frames.push(sim.body_mesh(*body)?.0);
        }
        Ok(())
    }

    /// What moves, by part of the model file: the garment is part 0, then the bodies.
    fn motions(&self) -> Vec<gltf::Animation<'_>> {
        if self.times.is_empty() {
            return Vec::new();
        }
        let bodies = self.bodies.iter().map(|(i, f)| (*i as usize + 1, f));
        std::iter::once((0, &self.garment))
            .chain(bodies)
            .map(|(part, frames)| gltf::Animation {
                part,
                times: &self.times,
                frames,
            })
            .collect()
    }
}

pub(crate) fn run(args: &RunArgs) -> Done {
    std::fs::create_dir_all(&args.out).map_err(|e| Failure {
        code: 4,
        text: format!("cannot make {}: {e}", args.out.display()),
    })?;
    let start = Instant::now();
    let scene = load(&args.scene)?;
    let mut sim = build(&scene)?;
    let mut summary = Summary::new(&scene);
    let bar = bar(args.quiet);
    let mut driver = Driver::new(&sim, &scene)?;
    let mut last = None;
    if scene.run.drape {
        last = Some(drape(&mut sim, &bar)?);
    }
    if let Some(report) = &last {
        summary.take(report);
    }
    let mut frames = Frames::new(&scene);
    let steps = scene.run.steps();
    let every = u64::from(scene.run.frame_every);
    if every > 0 && steps > 0 {
        frames.keep(&sim)?;
    }
    let origin = sim.time();
    bar.set_message("step");
    for step in 1..=steps {
        let report = driver.step(&mut sim, &scene, origin, step)?;
        summary.take(&report);
        summary.steps += 1;
        last = Some(report);
        if every > 0 && step % every == 0 {
            frames.keep(&sim)?;
        }
        bar.set_position((step as f64 / steps as f64 * 1000.0) as u64);
    }
    bar.finish_and_clear();
    let last = match last {
        Some(report) => report,
        None => sim.report()?,
    };
    summary.wall_seconds = start.elapsed().as_secs_f64();
    summary.simulated_seconds = sim.time() - origin;
    summary.measure_memory();
    write(args, &scene, &sim, &frames, &mut summary)?;
    if args.verify {
        summary.further_second_motion = Some(further_second(&mut sim)?);
    }
    let json = summary.to_json(&sim, &last);
    let text = format!("{json:#}\n");
    file(&args.out.join("summary.json"), text.as_bytes())?;
    if !args.quiet {
        out(&table(&scene, &json, &args.out))?;
    }
    Ok(summary.exit_code())
}

/// A bar on the terminal; nothing where there is none.
pub(crate) fn bar(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(1000);
    if let Ok(style) =
        ProgressStyle::with_template("{msg:>7} {bar:36} {percent:>3} %  {elapsed} gone, {eta} left")
    {
        bar.set_style(style);
    }
    bar
}

fn drape(sim: &mut Sim, bar: &ProgressBar) -> Result<StepReport, Error> {
    let options = DrapeOptions {
        force_tolerance: 0.0,
        max_steps: 0,
    };
    let report = sim.drape(&options, &mut |p: &Progress| {
        bar.set_message(p.stage);
        bar.set_position((p.fraction.clamp(0.0, 1.0) * 1000.0) as u64);
        true
    })?;
    bar.reset();
    Ok(report)
}

/// Largest distance of any vertex from where it is now, over one simulated second with bodies and
/// pins standing still [m].
fn further_second(sim: &mut Sim) -> Result<f64, Error> {
    let start = sim.positions().to_vec();
    let mut largest = 0.0_f64;
    for _ in 0..VERIFY.0 {
        sim.step(VERIFY.1)?;
        for (x, x0) in sim.positions().iter().zip(&start) {
            largest = largest.max((x - x0).norm());
        }
    }
    Ok(largest)
}

/// Model files, picture, pattern, state; counts of what crosses bodies go into the summary.
fn write(
    args: &RunArgs,
    scene: &Scene,
    sim: &Sim,
    frames: &Frames,
    summary: &mut Summary,
) -> Result<(), Failure> {
    let dir = &args.out;
    let names: Vec<&str> = scene
        .garment
        .panels
        .iter()
        .map(|p| p.name.as_str())
        .collect();
    let (x, triangles) = (sim.positions(), sim.triangles());
    let text = obj::to_obj(x, triangles, sim.vertex_uv(), sim.vertex_panels(), &names);
    file(&dir.join("garment.obj"), text.as_bytes())?;
    let mut parts = vec![Part::garment("garment", x, triangles, sim.vertex_panels())];
    let mut edges = topology::edges(triangles);
    // what follows yarns passes through nothing by itself
    let active = sim.active_vertices();
    edges.retain(|edge| edge.iter().all(|v| active[*v as usize]));
    for (i, body) in (0_u32..).zip(&scene.bodies) {
        let (positions, faces) = sim.body_mesh(i)?;
        summary.body_crossings += crossings::crossing_edges(x, &edges, &positions, &faces).len();
        parts.push(Part::body(&body.name, positions, faces));
    }
    let mut sewn = SewnSurface::new(sim.mesh(), x).crossings(usize::MAX)?;
    sewn.retain(|(edge, _)| edge.iter().all(|v| active[*v as usize]));
    summary.self_crossings = sewn.len();
    let mut motions = frames.motions();
    if let Some(mesh) = sim.yarns() {
        let (samples, sides) = yarns::detail(mesh);
        let curves = sim.yarn_curves(samples);
        file(
            &dir.join("yarns.obj"),
            obj::curves_to_obj(&curves).as_bytes(),
        )?;
        let tubes = yarns::tubes("yarns", &curves, sides);
        let active = sim.active_vertices();
        let seen = |v: &u32| active[*v as usize];
        parts[0].triangles.retain(|t| t.iter().all(seen));
        parts[0].lines.retain(|l| l.iter().all(seen));
        if parts[0].triangles.is_empty() {
            parts[0] = tubes;
            motions.retain(|m| m.part != 0);
        } else {
            parts.push(tubes);
        }
    }
    let glb = gltf::to_glb(&parts, &motions)?;
    file(&dir.join("scene.glb"), &glb)?;
    let motion = dir.join("garment.pc2");
    if !frames.times.is_empty() {
        file(&motion, &pc2::to_pc2(&frames.garment)?)?;
    } else if motion.is_file() {
        // that of an earlier run does not go with these files
        std::fs::remove_file(&motion).map_err(|e| Failure {
            code: 4,
            text: format!("cannot remove {}: {e}", motion.display()),
        })?;
    }
    render(&parts, &upright(scene, args.picture_size))?
        .write_png(&dir.join("picture.png"))
        .map_err(not_written)?;
    let svg = toile::pattern::export::to_svg(&scene.garment, 0.01);
    file(&dir.join("pattern.svg"), svg?.as_bytes())?;
    file(&dir.join("state.bin"), &sim.save()?)
}

impl Summary {
    /// Whether it came to rest where it was asked to.
    fn exit_code(&self) -> ExitCode {
        match self.outcome {
            Some(Outcome::IterationLimit | Outcome::Stalled | Outcome::Falling) => {
                ExitCode::from(NOT_AT_REST)
            }
            _ => ExitCode::SUCCESS,
        }
    }

    /// Adds the counts of a drape or a step and keeps the outcome that matters most: a limit that was
    /// hit outweighs substeps.
    fn take(&mut self, report: &StepReport) {
        self.add(report);
        let rank = |o: Outcome| match o {
            Outcome::Converged => 0,
            Outcome::Substepped => 1,
            Outcome::IterationLimit => 2,
            Outcome::Stalled => 3,
            Outcome::Falling => 4,
            Outcome::Cancelled => 5,
        };
        if self.outcome.is_none_or(|o| rank(o) < rank(report.outcome)) {
            self.outcome = Some(report.outcome);
            self.reason.clone_from(&report.reason);
        }
    }
}
