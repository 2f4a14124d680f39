//! The mannequin: closed, of the stated measures, and walking.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use toile::body::mannequin;
use toile::math::Vec3;

/// Length of the cut of the mesh at a height, of the segments with `|x| < limit`; and its largest x.
fn cut(v: &[Vec3], t: &[[u32; 3]], y: f64, limit: f64) -> (f64, f64) {
    let (mut length, mut wide) = (0.0, 0.0f64);
    for t in t {
        let p = t.map(|i| v[i as usize]);
        let mut ends = Vec::new();
        for k in 0..3 {
            let (a, b) = (p[k], p[(k + 1) % 3]);
            if (a.y < y) != (b.y < y) {
                ends.push(a.lerp(&b, (y - a.y) / (b.y - a.y)));
            }
        }
        if let [a, b] = ends[..]
            && a.x.abs() < limit
        {
            length += (b - a).norm();
            wide = wide.max(a.x.abs()).max(b.x.abs());
        }
    }
    (length, wide)
}

#[test]
fn mannequin_is_a_closed_surface_for_every_cell() {
    for cell in [0.0, 0.012, 0.017, 0.03] {
        let (v, t) = mannequin::mesh(cell).unwrap();
        let p: Vec<[f64; 3]> = v.iter().map(|p| [p.x, p.y, p.z]).collect();
        let body = toile::body::Body::mesh(&p, &t, 0.02).unwrap();
        let r = body.mesh_report().unwrap();
        println!("cell {cell}: {r:?}");
        assert_eq!(
            (
                r.euler(),
                r.components,
                r.pinched,
                r.crowded_edges,
                r.flipped
            ),
            (2, 1, 0, 0, false)
        );
        let worst = v
            .iter()
            .map(|p| mannequin::implicit(p).abs())
            .fold(0.0, f64::max);
        assert!(worst < 0.1 * 0.022, "a vertex lies {worst} off the surface");
        if cell == 0.0 {
            assert!((8000..13000).contains(&t.len()), "{}", t.len());
        }
    }
    for bad in [-1.0, 1e-9, 0.2, f64::NAN, f64::INFINITY] {
        assert!(mannequin::mesh(bad).is_err());
    }
}

#[test]
fn mannequin_has_the_stated_measures() {
    let (v, t) = mannequin::mesh(0.012).unwrap();
    let girth = |name: &str, y: f64, limit: f64, wanted: f64| {
        let (got, _) = cut(&v, &t, y, limit);
        println!("{name} at {y}: {got:.4} m, wanted {wanted}");
        assert!((got / wanted - 1.0).abs() < 0.02, "{name}: {got}");
    };
    girth("hips", 0.88, 0.3, 0.98);
    girth("waist", 1.06, 0.25, 0.76);
    girth("chest", 1.27, 0.185, 0.95);
    girth("neck", 1.47, 0.2, std::f64::consts::TAU * 0.06);
    let (_, half) = cut(&v, &t, 1.42, 1.0);
    println!("shoulder width at 1.42: {:.4}", 2.0 * half);
    assert!((2.0 * half - 0.40).abs() < 0.01);
    let (lo, hi) = v.iter().fold((v[0], v[0]), |b, p| (b.0.inf(p), b.1.sup(p)));
    println!("box {lo:?} {hi:?}");
    assert!(lo.y.abs() < 2e-3 && (hi.y - 1.72).abs() < 3e-3);
    // legs stand apart at mid-thigh
    let gap = cut(&v, &t, 0.6, 0.02).0;
    assert_eq!(gap, 0.0);
}

#[test]
fn mannequin_walks_without_turning_inside_out() {
    let body = mannequin::body(0.0).unwrap();
    let rest = body.vertices().to_vec();
    let size = |v: &[Vec3]| -> f64 {
        body.triangles()
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| v[i as usize]);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    };
    let still = mannequin::pose(&rest, 0.0);
    assert!(rest.iter().zip(&still).all(|(a, b)| (a - b).norm() < 1e-12));
    for k in 1..8 {
        let phase = k as f64 * std::f64::consts::TAU / 8.0;
        let v = mannequin::pose(&rest, phase);
        let start = std::time::Instant::now();
        let moved = body.deformed(&v).unwrap();
        let took = start.elapsed();
        let furthest = rest
            .iter()
            .zip(&v)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f64::max);
        let stretch = body
            .triangles()
            .iter()
            .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]])
            .map(|e| {
                let [a, b] = e.map(|i| i as usize);
                (v[a] - v[b]).norm() / (rest[a] - rest[b]).norm()
            })
            .fold(0.0, f64::max);
        println!(
            "phase {phase:.2}: moved {furthest:.3} m, stretch {stretch:.2}, volume {:.4} of {:.4}, {took:?}",
            size(&v),
            size(&rest)
        );
        assert!((size(&v) / size(&rest) - 1.0).abs() < 0.05);
        assert!(stretch < 2.0);
        assert_eq!(furthest > 0.1, k != 4);
        assert!(moved.value(&Vec3::new(0.0, 1.2, 0.0)) < -0.05);
    }
}
