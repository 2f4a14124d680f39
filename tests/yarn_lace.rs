//! Openwork: what is left open between yarns that have relaxed to a residual below 1e-5 N, and edges that scallop.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::yarn_pull::Swatch;
use crate::yarn_pull::lace::{self, openings, scallops};

/// A yarn-over beside a decrease leaves a hole that is larger by far than any opening of plain jersey in the same frame.
#[test]
fn a_yarn_over_opens_a_hole() {
    let [jersey, eyelet] = [false, true].map(|hole| {
        let mut swatch = lace::eyelet(8, hole);
        let reading = swatch.pull(1.0);
        let areas = openings(&swatch.sim, Swatch::knit_size(8, 8));
        println!(
            "hole {hole}: residual {:.1e} N, openings {:.2?} mm2",
            reading.residual,
            areas.iter().take(4).map(|a| 1e6 * a).collect::<Vec<_>>()
        );
        areas
    });
    let largest = jersey.first().copied().unwrap_or(0.0);
    assert!(eyelet[0] > 2.0 * largest, "{} {largest}", eyelet[0]);
    // one loop of the jersey takes up 7.65 mm2
    assert!(eyelet[0] > 1e-6, "{}", eyelet[0]);
}

/// Decreases and yarn-overs in turn scallop the bind-off of a piece whose cast-on is held straight; plain knitting of the same yarn
/// stays straight.
#[test]
fn feather_and_fan_scallops_its_edge() {
    let [plain, fan] = [false, true].map(|fan| {
        let mut swatch = lace::feather_and_fan(5, fan);
        let (residual, newton) = swatch.rest();
        let depth = scallops(&swatch.sim);
        println!(
            "fan {fan}: residual {residual:.1e} N after {newton} Newton iterations, scallops of {depth:.4} of their length"
        );
        depth.abs()
    });
    assert!(fan > 0.04 && fan > 4.0 * plain, "{fan} {plain}");
}
