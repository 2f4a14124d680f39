//! Distance fields of mesh bodies: time of the first build and of a deformation, memory, error.
//!
//! Columns: triangles; cell size [mm]; then, on one thread and on two, seconds of the first build
//! and per frame of a deforming body (`all`: every vertex moves; `arm`: about a fifth of them;
//! `spot`: a dent of 5 cm); memory of the field [MB]; error of the distance against the triangles
//! at points within two cells of the surface (mean and largest, in cells). Wall time, the least of
//! `repeats` (first argument, 3; a second one names the only file to take); the processor time of all threads stands in brackets.
//!
//! Real bodies are read from the folder that `TOILE_DATA` names; the shipped mannequin needs none.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

mod common;

use common::{Random, cpu};
use std::time::Instant;
use toile::body::{Body, mannequin, read_obj};
use toile::math::Vec3;
use toile::math::parallel::Workers;

/// Least wall time of `repeats` calls, and the mean processor time.
fn time<T>(repeats: usize, mut f: impl FnMut(usize) -> T) -> (f64, f64) {
    let mut best = f64::INFINITY;
    let used = cpu();
    for i in 0..repeats {
        let start = Instant::now();
        std::hint::black_box(f(i));
        best = best.min(start.elapsed().as_secs_f64());
    }
    (best, (cpu() - used) / repeats as f64)
}

/// Mean and largest error of the field within two cells of the surface [cells].
fn error(body: &Body) -> (f64, f64) {
    let h = body.cell_size().unwrap();
    let (v, t) = (body.vertices(), body.triangles());
    let mut random = Random::new(1);
    let (mut sum, mut worst, count) = (0.0, 0.0f64, 500);
    for _ in 0..count {
        let tri = t[(random.next() * t.len() as f64) as usize].map(|i| v[i as usize]);
        let center = (tri[0] + tri[1] + tri[2]) / 3.0;
        let shift = Vec3::from_fn(|_, _| 2.0 * random.next() - 1.0) * (2.0 * h);
        let p = center + shift;
        let e = (body.value(&p) - body.exact_distance(&p)).abs() / h;
        sum += e;
        worst = worst.max(e);
    }
    (sum / f64::from(count), worst)
}

/// Vertices of a frame.
type Shape<'a> = &'a dyn Fn(usize) -> Vec<Vec3>;

fn row(name: &str, positions: &[Vec3], triangles: &[[u32; 3]], cell: f64, repeats: usize) {
    let soup: Vec<[f64; 3]> = positions.iter().map(|p| (*p).into()).collect();
    let body = Body::mesh(&soup, triangles, cell).expect("body");
    let (lo, hi) = positions.iter().fold((positions[0], positions[0]), |b, p| {
        (b.0.inf(p), b.1.sup(p))
    });
    let size = hi - lo;
    let edge = hi.x - 0.3 * size.x;
    // every frame differs from the one before
    let all = |i: usize| -> Vec<Vec3> {
        let a = 0.03 * (i + 1) as f64;
        let bend = |p: &Vec3| {
            let s = (p.y - lo.y) / size.y;
            Vec3::new(p.x + a * s * s, p.y, p.z + 0.5 * a * s)
        };
        positions.iter().map(bend).collect()
    };
    let arm = |i: usize| -> Vec<Vec3> {
        let a = 0.1 * (i + 1) as f64;
        let lift = |p: &Vec3| p + Vec3::new(0.0, a * (p.x - edge).max(0.0), 0.0);
        positions.iter().map(lift).collect()
    };
    let top = positions[positions
        .iter()
        .map(|p| p.z)
        .enumerate()
        .fold((0, f64::MIN), |b, p| if p.1 > b.1 { p } else { b })
        .0];
    let spot = |i: usize| -> Vec<Vec3> {
        let a = 0.003 * (i + 1) as f64;
        let dent = |p: &Vec3| p - Vec3::z() * (a * (1.0 - (p - top).norm() / 0.05).max(0.0));
        positions.iter().map(dent).collect()
    };
    let (bricks, bytes) = body.field_size().unwrap();
    let (mean, worst) = error(&body);
    println!(
        "{name}: {} triangles, cell {:.2} mm, bricks {bricks:?}, {:.1} MB, error mean {mean:.4} worst {worst:.3} cells",
        triangles.len(),
        1e3 * body.cell_size().unwrap(),
        bytes as f64 / 1e6,
    );
    for threads in [1, 2] {
        let workers = Workers::new(threads);
        let build = time(repeats, |_| {
            Body::mesh_with(&soup, triangles, cell, &workers)
        });
        let mut parts = vec![format!("build {:.3} ({:.3})", build.0, build.1)];
        let kinds: [(&str, Shape<'_>); 3] = [("all", &all), ("arm", &arm), ("spot", &spot)];
        for (kind, shape) in kinds {
            let frames: Vec<Vec<Vec3>> = (0..repeats).map(shape).collect();
            let t = time(repeats, |i| {
                body.deformed_with(&frames[i], &workers).unwrap()
            });
            parts.push(format!("{kind} {:.3} ({:.3})", t.0, t.1));
        }
        println!("  {threads} threads: {} s", parts.join(", "));
    }
}

fn main() {
    let repeats = std::env::args()
        .filter_map(|a| a.parse().ok())
        .next()
        .unwrap_or(3);
    let only = std::env::args().skip(1).find(|a| a.ends_with(".obj"));
    if only.is_none() {
        let (p, t) = mannequin::body(0.01).expect("mannequin").display_mesh();
        row("mannequin", &p, &t, 0.0, repeats);
    }
    let Some(folder) = std::env::var_os("TOILE_DATA") else {
        println!("TOILE_DATA is unset: no real bodies");
        return;
    };
    for name in ["mean_all.obj", "makehuman_body_closed_m.obj"] {
        if only.as_ref().is_some_and(|o| o != name) {
            continue;
        }
        let path = std::path::Path::new(&folder).join("bodies").join(name);
        let (p, t) = read_obj(&path, 1.0).expect("body");
        row(name, &p, &t, 0.005, repeats);
    }
}
