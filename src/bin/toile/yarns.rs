//! `toile yarns`: lays the yarns of a garment on its flat panels and draws them.

use crate::args::SceneArgs;
use crate::info::load;
use crate::output::{Done, Failure, file, out};
use std::fmt::Write;
use std::path::Path;
use toile::error::Error;
use toile::fabric::rest::cells;
use toile::readout::flat_yarns::flat_yarns_svg;
use toile::solve::settings::Settings;
use toile::yarn::{Layout, lay};

pub(crate) fn yarns(args: &SceneArgs, svg: &Path) -> Done {
    let garment = load(args)?.garment;
    if garment.fabrics.iter().all(|fabric| fabric.yarns.is_none()) {
        return Err(Failure::from(Error::material(format!(
            "{}: no fabric has yarns",
            garment.title()
        ))));
    }
    let cells = cells(&garment, |_| true, &Settings::default())?;
    let layout = Layout {
        cells: &cells,
        ..Layout::default()
    };
    let mesh = lay(&garment, &layout)?;
    let counts = mesh.counts();
    let mut text = String::new();
    for (name, value) in [
        ("nodes", counts.nodes),
        ("yarns", counts.yarns),
        ("passages", counts.incidences),
        ("wraps", counts.wraps),
        ("stitch springs", counts.stitch_springs),
        ("corners", counts.corners),
        ("spacings", counts.spacings),
        ("ties to seams", counts.ties),
        ("bytes", counts.bytes),
    ] {
        let _ = writeln!(text, "{name:<22} {value}");
    }
    file(svg, flat_yarns_svg(&garment, &mesh)?.as_bytes())?;
    out(&text)
}
