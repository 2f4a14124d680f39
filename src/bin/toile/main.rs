//! `toile`: runs, checks and explains scenes.
//!
//! Exit codes: 0 done; 1 the scene or a file of it was refused (or `check` found problems); 2 the
//! command line was wrong; 3 the simulation found no admissible state; 4 a result could not be
//! written; 5 a drape of `run` stopped at its iteration limit, stalled or fell: results are written, and `outcome` says which.

mod args;
mod fabric;
mod fmu;
mod info;
mod output;
mod picture;
mod report;
mod run;
mod suggest;
mod summary;
mod yarns;

use args::{Cli, Command};
use clap::Parser;
use output::{Failure, out};
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            // help and version come this way too; a closed pipe is not our problem
            let _ = e.print();
            return ExitCode::from(u8::try_from(e.exit_code()).unwrap_or(2));
        }
    };
    let result = match &cli.command {
        Command::Run(args) => run::run(args),
        Command::Info(args) => info::info(args),
        Command::Check(args) => info::check(args),
        Command::Fmu(args) => fmu::fmu(args),
        Command::Schema { json } => {
            if *json {
                out(&format!("{:#}\n", toile::scene::schema::json_schema()))
            } else {
                out(&toile::scene::schema::text())
            }
        }
        Command::Mannequin { out, cell } => info::mannequin(out, *cell),
        Command::Yarns { scene, out } => yarns::yarns(scene, out),
        Command::Fabric(args) => fabric::fabric(args),
        Command::Report { scene, out } => report::report(scene, out),
        Command::Suggest(args) => suggest::suggest(args),
        Command::Picture {
            garment,
            body,
            body_scale,
            out,
            size,
        } => picture::picture(garment, body, *body_scale, out, *size),
    };
    match result {
        Ok(code) => code,
        Err(Failure { code, text }) => {
            output::err(&format!("toile: error: {text}\n"));
            ExitCode::from(code)
        }
    }
}
