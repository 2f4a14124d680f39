//! `toile fmu`: packs a scene into an archive for masters of FMI.

use crate::args::FmuArgs;
use crate::info::every_core;
use crate::output::{Done, err, file, out};
use crate::run::bar;
use std::path::PathBuf;
use toile::error::{Error, Result};
use toile::fmi::collect::{AddedBody, Overrides};
use toile::fmi::package::{Options, package};
use toile::fmi::platform::{Platform, Version};
use toile::scene::{THREADS, files};
use toile::sim::Progress;

pub(crate) fn fmu(args: &FmuArgs) -> Done {
    let mut numbers = args.scene.set.clone();
    if let Some(threads) = args.scene.threads {
        numbers.push((THREADS.to_owned(), f64::from(threads)));
    }
    let overrides = Overrides {
        edge_length: args.scene.edge_length,
        numbers,
        body: args.scene.body.clone().map(|file| AddedBody {
            file,
            scale: args.scene.body_scale,
            position: args.scene.body_offset.unwrap_or_default(),
        }),
    };
    let stem = args.out.file_stem().unwrap_or_default();
    let options = Options {
        version: if args.fmi == 2 {
            Version::Two
        } else {
            Version::Three
        },
        identifier: stem.to_string_lossy().into_owned(),
        libraries: libraries(args)?,
        merge: args
            .merge
            .iter()
            .map(|path| Ok((path.display().to_string(), files::read(path)?)))
            .collect::<Result<_>>()?,
        drape: !args.no_drape,
        threads: args.scene.threads.map_or_else(every_core, f64::from),
    };
    let bar = bar(args.quiet);
    let packed = package(
        &args.scene.scene,
        &overrides,
        &options,
        &mut |p: &Progress| {
            bar.set_message(p.stage);
            bar.set_position((p.fraction.clamp(0.0, 1.0) * 1000.0) as u64);
            true
        },
    );
    bar.finish_and_clear();
    let packed = packed?;
    for note in &packed.notes {
        err(&format!("toile: note: {note}\n"));
    }
    file(&args.out, &packed.bytes)?;
    if args.quiet {
        return Ok(std::process::ExitCode::SUCCESS);
    }
    out(&format!(
        "{}: FMI {}.0, {} bytes\n",
        args.out.display(),
        args.fmi,
        packed.bytes.len()
    ))
}

/// The libraries that were named, or the one beside this program.
fn libraries(args: &FmuArgs) -> Result<Vec<(Platform, Vec<u8>)>> {
    if !args.library.is_empty() {
        let all = args.library.iter();
        return all
            .map(|(name, path)| Ok((Platform::named(name)?, files::read(path)?)))
            .collect();
    }
    let own = Platform::own()?;
    let path = beside(&own)?;
    Ok(vec![(own, files::read(&path)?)])
}

/// The library beside this program, or in the `lib` folder beside its own.
fn beside(platform: &Platform) -> Result<PathBuf> {
    let program = std::env::current_exe()
        .map_err(|e| Error::io(format!("cannot tell where this program is: {e}")))?;
    let folder = program.parent().unwrap_or(&program);
    let name = platform.library();
    let places = [folder.join(&name), folder.join("../lib").join(&name)];
    places.iter().find(|p| p.is_file()).cloned().ok_or_else(|| {
        Error::io(format!(
            "{} is not beside this program ({} and {}); give --library {}=FILE",
            name,
            places[0].display(),
            places[1].display(),
            platform.name
        ))
    })
}
