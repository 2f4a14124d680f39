//! What is left open between yarns, and how an edge waves.
//!
//! The yarns as they are drawn, tubes of their radius, are projected along the normal of the frame that holds the sides; openings
//! are the connected parts of the plane that no tube covers.

use super::Swatch;
use toile::math::Vec2;
use toile::sim::Sim;

/// Laid length of a repeat of feather and fan [m].
const FAN: f64 = 12.0 * 0.003;

/// Jersey of `n` by `n` loops, to be held at its sides; in its middle a yarn-over beside a decrease, if asked for.
pub(crate) fn eyelet(n: usize, hole: bool) -> Swatch {
    let plain = ".".repeat(n);
    let mut rows = vec![plain.clone(); n];
    if hole {
        rows[n / 2 - 1].replace_range(n / 2 - 2..n / 2, "/o");
    }
    Swatch::knit(&format!("\"chart\": {rows:?}"), n, n, 0)
}

/// A yarn of radius 0.5 mm in loops of 3 mm, 36 wales, the cast-on held straight: three repeats of feather and fan, or plain.
pub(crate) fn feather_and_fan(courses: usize, fan: bool) -> Swatch {
    let [plain, purl] = [".", "-"].map(|s| s.repeat(12));
    let first = if fan { "//o.o.o.o.//" } else { &plain };
    let rows = [first, &plain, &plain, &purl];
    let yarns =
        format!(r#"{{"loop_width": 0.003, "radius": 0.0005, "bending": 1e-3, "chart": {rows:?}}}"#);
    let mut swatch = Swatch::new(&yarns, Swatch::knit_size(36, courses), 0.0, 1);
    let cast_on = swatch.sim.yarn_nodes_along(0, 0).expect("nodes");
    swatch.sim.pin_yarn_nodes(&cast_on, None).expect("pins");
    swatch
}

/// Side of a pixel [m].
const PIXEL: f64 = 5e-5;

/// Areas of the openings that do not reach the border [m^2], the largest first.
pub(crate) fn openings(sim: &Sim, size: [f64; 2]) -> Vec<f64> {
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
                    let p = Vec2::new(i as f64 + 0.5, j as f64 + 0.5) - a;
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

/// Depth of the scallops of the bind-off from trough to crest, over the length of a repeat: the part of its height that goes up and
/// down with the chart. Its mean heights at three middles of repeats and the two borders between them are summed with the weights
/// 1, -4, 6, -4, 1, to which a line that is bent as a whole adds nothing.
pub(crate) fn scallops(sim: &Sim) -> f64 {
    let mesh = sim.yarns().expect("yarns");
    let nodes = sim.yarn_nodes_along(0, 2).expect("nodes");
    let place = |k: usize| {
        let middle = 0.5 * FAN * (k + 1) as f64;
        let near = |n: &&u32| (mesh.uv[**n as usize].x - middle).abs() < 0.1 * FAN;
        let found: Vec<Vec2> = (nodes.iter().filter(near))
            .map(|n| sim.yarn_nodes()[*n as usize].xy())
            .collect();
        found.iter().sum::<Vec2>() / found.len() as f64
    };
    let at: Vec<Vec2> = (0..5).map(place).collect();
    let waves = at.iter().zip([1.0, -4.0, 6.0, -4.0, 1.0]);
    waves.map(|(p, w)| w * p.y).sum::<f64>() / 8.0 / (0.5 * (at[4].x - at[0].x))
}
