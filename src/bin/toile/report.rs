//! `toile report`: one scene by several models, error against time.

use crate::args::SceneArgs;
use crate::info::load;
use crate::output::{Done, Failure, err, file, out};
use std::fmt::Write;
use std::path::Path;
use toile::report::Report;

pub(crate) fn report(args: &SceneArgs, dir: &Path) -> Done {
    std::fs::create_dir_all(dir).map_err(|e| Failure {
        code: 4,
        text: format!("cannot make {}: {e}", dir.display()),
    })?;
    let scene = load(args)?;
    let report = toile::report::run(&scene, &mut |name| err(&format!("{name}\n")))?;
    write(&report, dir)?;
    out(&table(&report))
}

/// The report's files.
pub(crate) fn write(report: &Report, dir: &Path) -> Result<(), Failure> {
    let json = format!("{:#}\n", report.to_json());
    file(&dir.join("report.json"), json.as_bytes())?;
    file(&dir.join("report.csv"), report.to_csv().as_bytes())?;
    file(&dir.join("report.html"), report.to_html().as_bytes())
}

/// One line for each model.
pub(crate) fn table(report: &Report) -> String {
    let mut text = format!(
        "{:<24} {:>10} {:>9} {:>9} {:>9} {:>11} {:>8} {:>12}\n",
        "model",
        "yarn nodes",
        "unknowns",
        "Newton",
        "seconds",
        "error [mm]",
        "height",
        "correlation"
    );
    for row in &report.rows {
        let _ = write!(
            text,
            "{:<24} {:>10} {:>9} {:>9} {:>9.2} ",
            row.name, row.yarn_nodes, row.unknowns, row.newton_iterations, row.seconds
        );
        let _ = match row.deviation {
            Some(d) => writeln!(
                text,
                "{:>11.4} {:>8.3} {:>12.4} {}",
                1e3 * d.error,
                d.height,
                d.correlation,
                if row.front { "front" } else { "" }
            ),
            None if row.reference => writeln!(text, "reference"),
            None => writeln!(text, "{}", row.reason),
        };
    }
    text
}
