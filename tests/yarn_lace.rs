//! Openwork: what is left open between yarns that have relaxed to a residual below 1e-5 N.
//!
//! The yarns as they are drawn, tubes of their radius, are projected along the normal of the frame that holds the sides; openings
//! are the connected parts of the plane that no tube covers.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::yarn_pull::Swatch;
use toile::sim::Sim;

/// Side of a pixel [m].
const PIXEL: f64 = 5e-5;

/// Areas of the openings that do not reach the border [m^2], the largest first.
fn openings(sim: &Sim, size: [f64; 2]) -> Vec<f64> {
    let [wide, high] = size.map(|s| (s / PIXEL) as usize);
    let mut covered = vec![false; wide * high];
    for curve in sim.yarn_curves(4) {
        let r = curve.radius / PIXEL;
        for ends in curve.points.windows(2) {
            let [a, b] = [ends[0].xy() / PIXEL, ends[1].xy() / PIXEL];
            let (low, top) = (a.inf(&b), a.sup(&b));
            let range = |from: f64, to: f64, n: usize| {
                (from - r).max(0.0) as usize..((to + r + 1.0).max(0.0) as usize).min(n)
            };
            for j in range(low.y, top.y, high) {
                for i in range(low.x, top.x, wide) {
                    let p = toile::math::Vec2::new(i as f64 + 0.5, j as f64 + 0.5) - a;
                    let t = (p.dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                    covered[j * wide + i] |= (p - (b - a) * t).norm() <= r;
                }
            }
        }
    }
    let mut areas = Vec::new();
    for start in 0..covered.len() {
        let (mut stack, mut count, mut inside) = (vec![start], 0, true);
        while let Some(k) = stack.pop() {
            if std::mem::replace(&mut covered[k], true) {
                continue;
            }
            count += 1;
            let (i, j) = (k % wide, k / wide);
            if i == 0 || j == 0 || i + 1 == wide || j + 1 == high {
                inside = false;
                continue;
            }
            stack.extend([k - 1, k + 1, k - wide, k + wide]);
        }
        if inside && count > 0 {
            areas.push(f64::from(count) * PIXEL * PIXEL);
        }
    }
    areas.sort_by(|a, b| b.total_cmp(a));
    areas
}

/// A yarn-over beside a decrease leaves a hole that is larger by far than any opening of plain jersey in the same frame.
#[test]
fn a_yarn_over_opens_a_hole() {
    let plain = "........";
    let [jersey, eyelet] = [plain, "../o...."].map(|row| {
        let rows = [plain, plain, plain, row, plain, plain, plain, plain];
        let mut swatch = Swatch::knit(&format!("\"chart\": {rows:?}"), 8, 8, 0);
        let reading = swatch.pull(1.0);
        let areas = openings(&swatch.sim, Swatch::knit_size(8, 8));
        println!(
            "{row}: residual {:.1e} N, openings {:.2?} mm2",
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
