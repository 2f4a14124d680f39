//! Mesh bodies: exactness, derivatives, signs, limits, real bodies.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::PathBuf;
use std::time::Duration;
use toile::body::Body;
use toile::math::Vec3;

/// Small deterministic generator (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.next()
    }

    fn point(&mut self, r: f64) -> Vec3 {
        Vec3::new(self.within(-r, r), self.within(-r, r), self.within(-r, r))
    }
}

/// Processor time of this thread; wall time is of no use on a shared machine.
fn cpu() -> Duration {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanos = text.split(' ').next().and_then(|w| w.parse().ok());
    Duration::from_nanos(nanos.unwrap_or(0))
}

type Soup = (Vec<[f64; 3]>, Vec<[u32; 3]>);

fn cube(half: f64) -> Soup {
    let p = (0..8)
        .map(|i| [4, 2, 1].map(|b| if i & b != 0 { half } else { -half }))
        .collect();
    let quads = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    let t = quads
        .iter()
        .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
        .collect();
    (p, t)
}

fn torus(big: f64, small: f64, n: usize, m: usize) -> Soup {
    let tau = std::f64::consts::TAU;
    let mut p = Vec::new();
    let mut t = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let (s, c) = (tau * i as f64 / n as f64).sin_cos();
            let (v, u) = (tau * j as f64 / m as f64).sin_cos();
            p.push([(big + small * u) * c, small * v, (big + small * u) * s]);
            let at = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
            t.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
            t.push([at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]);
        }
    }
    (p, t)
}

fn sphere(radius: f64) -> Soup {
    let (p, t) = Body::sphere(radius).unwrap().display_mesh();
    (p.iter().map(|p| [p.x, p.y, p.z]).collect(), t)
}

fn data(name: &str) -> Option<PathBuf> {
    match std::env::var_os("TOILE_DATA") {
        Some(d) => Some(PathBuf::from(d).join("bodies").join(name)),
        None if std::env::var("CI").as_deref() == Ok("true") => panic!("TOILE_DATA is not set"),
        None => {
            println!("skipped: TOILE_DATA is not set, no {name}");
            None
        }
    }
}

#[test]
fn mesh_cube_distance_is_exact_to_the_sampling_error() {
    // exact outside of faces; across kinks (edges seen from inside) first order in the cell
    let (p, t) = cube(0.3);
    let body = Body::mesh(&p, &t, 0.01).unwrap();
    let mut r = Random(1);
    let (mut worst_smooth, mut worst): (f64, f64) = (0.0, 0.0);
    for _ in 0..20_000 {
        let x = r.point(0.4);
        let q = x.abs().add_scalar(-0.3);
        let exact = if q.max() < 0.0 {
            q.max()
        } else {
            q.map(|c| c.max(0.0)).norm()
        };
        assert!((body.exact_distance(&x) - exact).abs() < 1e-12);
        let e = (body.value(&x) - exact).abs();
        if exact.abs() < 0.03 {
            worst = worst.max(e);
        }
        // deep inside the next level answers, with its own spacing
        assert!(e < 0.04, "{e} at {x:?}");
        // near one face only
        let far = x.abs();
        let sorted = {
            let mut s = [far.x, far.y, far.z];
            s.sort_by(f64::total_cmp);
            s
        };
        if sorted[1] < 0.2 && (sorted[2] - 0.3).abs() < 0.02 {
            worst_smooth = worst_smooth.max(e);
        }
    }
    println!("cube: flat {worst_smooth:.2e} m, within 3 cells {worst:.2e} m at cell 0.01");
    assert!(worst_smooth < 1e-8, "{worst_smooth}");
    assert!(worst < 0.01, "{worst}");
}

#[test]
fn mesh_sphere_and_torus_distance_and_gradient_are_close_to_analytic() {
    let (p, t) = torus(0.3, 0.1, 240, 120);
    let ring = Body::mesh(&p, &t, 0.008).unwrap();
    let mut r = Random(2);
    let (mut ev, mut eg): (f64, f64) = (0.0, 0.0);
    for _ in 0..20_000 {
        let x = r.point(0.5);
        let u = x.xz().norm() - 0.3;
        let d = (u * u + x.y * x.y).sqrt();
        if !(0.07..0.13).contains(&d) {
            continue;
        }
        let got = ring.distance(&x);
        ev = ev.max((got.value - (d - 0.1)).abs());
        let n = Vec3::new(u * x.x / (u + 0.3), x.y, u * x.z / (u + 0.3)) / d;
        eg = eg.max((got.gradient - n).norm());
    }
    println!("torus: value {ev:.2e} m, gradient {eg:.2e}");
    assert!(ev < 3e-4, "{ev}");
    assert!(eg < 0.06, "{eg}");
}

#[test]
fn mesh_field_gradient_and_hessian_are_derivatives_of_its_value() {
    let (p, t) = torus(0.3, 0.1, 40, 20);
    let body = Body::mesh(&p, &t, 0.01).unwrap();
    let mut r = Random(3);
    let e = 1e-6;
    let mut compared = 0;
    for _ in 0..4000 {
        // inside, in the band, across levels, beyond the box
        let x = r.point(1.2);
        let at = body.distance(&x);
        assert_eq!(at.value.to_bits(), body.value(&x).to_bits());
        for d in 0..3 {
            let mut s = Vec3::zeros();
            s[d] = e;
            let (a, b) = (body.distance(&(x + s)), body.distance(&(x - s)));
            let fd = (a.value - b.value) / (2.0 * e);
            assert!(
                (fd - at.gradient[d]).abs() < 1e-4 * (1.0 + 1.0),
                "gradient {d} at {x:?}: {fd} {}",
                at.gradient[d]
            );
            let fd = (a.gradient - b.gradient) / (2.0 * e);
            let exact: Vec3 = at.hessian.column(d).into();
            // the Hessian jumps at knots; a difference across one is not compared
            if a.hessian.relative_eq(&b.hessian, 1e-3, 1e-3) {
                compared += 1;
                assert!(
                    (fd - exact).norm() < 1e-2 * (1.0 + exact.norm()),
                    "{fd} {exact}"
                );
            }
        }
    }
    assert!(compared > 9000, "{compared}");
}

#[test]
fn mesh_field_is_continuous_with_its_gradient_along_lines() {
    let (p, t) = torus(0.3, 0.1, 40, 20);
    let body = Body::mesh(&p, &t, 0.01).unwrap();
    let mut r = Random(4);
    // within the box of the stored levels; at its border the gradient may jump
    let mut inside = || r.point(0.45).component_mul(&Vec3::new(1.0, 0.37, 1.0));
    for _ in 0..40 {
        let (a, b) = (inside(), inside());
        let n = 20_000;
        let mut last = body.distance(&a);
        for i in 1..=n {
            let x = a.lerp(&b, i as f64 / n as f64);
            let now = body.distance(&x);
            let step = (b - a).norm() / n as f64;
            assert!((now.value - last.value).abs() < 2.0 * step);
            // second derivatives are bounded by the spacing: 4 / h
            assert!((now.gradient - last.gradient).norm() < 8.0 / 0.01 * step);
            last = now;
        }
    }
}

#[test]
fn distance_beyond_the_box_is_a_lower_bound() {
    let (p, t) = sphere(0.2);
    let body = Body::mesh(&p, &t, 0.01).unwrap();
    let mut r = Random(5);
    for _ in 0..5000 {
        let x = r.point(5.0);
        let exact = x.norm() - 0.2;
        let got = body.value(&x);
        if exact > 0.5 {
            assert!(got > 0.0 && got < exact + 2e-3, "{got} {exact}");
            assert!(got > 0.5 * exact);
        }
    }
}

#[test]
fn deformed_bits_depend_on_the_vertices_alone() {
    let (p, t) = torus(0.3, 0.1, 60, 30);
    let start = Body::mesh(&p, &t, 0.01).unwrap();
    let rest: Vec<Vec3> = start.vertices().to_vec();
    let bend = |k: f64, only: f64| -> Vec<Vec3> {
        rest.iter()
            .map(|p| {
                let w = ((p.x - only) / 0.2).clamp(0.0, 1.0);
                p + Vec3::new(0.0, k * w * w, 0.3 * k * w)
            })
            .collect()
    };
    let (a, b) = (bend(0.1, 0.1), bend(-0.2, -0.5));
    let direct = start.deformed(&a).unwrap();
    let detour = start
        .deformed(&b)
        .unwrap()
        .deformed(&rest)
        .unwrap()
        .deformed(&b)
        .unwrap()
        .deformed_with(&a, &toile::math::parallel::Workers::new(3))
        .unwrap();
    // built anew from the deformed vertices
    let soup: Vec<[f64; 3]> = a.iter().map(|p| [p.x, p.y, p.z]).collect();
    let anew = Body::mesh(&soup, &t, 0.01).unwrap();
    let back = detour.deformed(&rest).unwrap();
    assert_eq!(direct.field_size(), anew.field_size());
    let mut r = Random(6);
    let mut changed = 0;
    for _ in 0..40_000 {
        let x = r.point(0.6);
        let d = direct.distance(&x);
        assert_eq!(d, detour.distance(&x));
        assert_eq!(d, anew.distance(&x), "{x:?}");
        assert_eq!(start.distance(&x), back.distance(&x));
        assert_eq!(
            direct.nearest(&x).map(|n| n.0),
            anew.nearest(&x).map(|n| n.0)
        );
        changed += usize::from(d != start.distance(&x));
    }
    assert!(changed > 10_000, "{changed}");
}

#[test]
fn a_part_that_swallows_another_turns_its_sign() {
    // a small cube that does not move, inside a large one that comes over it
    let (mut p, mut t) = cube(0.05);
    let (q, u) = cube(0.3);
    p.extend(q.iter().map(|q| [q[0] + 2.0, q[1], q[2]]));
    t.extend(u.iter().map(|t| t.map(|v| v + 8)));
    let apart = Body::mesh(&p, &t, 0.01).unwrap();
    let mut moved = apart.vertices().to_vec();
    moved[8..].iter_mut().for_each(|p| p.x -= 2.0);
    let over = apart.deformed(&moved).unwrap();
    let x = Vec3::new(0.07, 0.0, 0.0);
    assert!(apart.value(&x) > 0.015);
    assert!(over.value(&x) < -0.015);
    let soup: Vec<[f64; 3]> = moved.iter().map(|p| [p.x, p.y, p.z]).collect();
    let anew = Body::mesh(&soup, &t, 0.01).unwrap();
    let mut r = Random(7);
    for _ in 0..5000 {
        let x = r.point(0.5);
        assert_eq!(over.distance(&x), anew.distance(&x));
    }
}

#[test]
fn bad_meshes_are_refused_with_place() {
    let (p, t) = cube(0.3);
    let text = |r: toile::error::Result<Body>| r.unwrap_err().message;
    let open = text(Body::mesh(&p, &t[1..], 0.0));
    assert!(
        open.contains("3 open edges") && open.contains("example"),
        "{open}"
    );
    let mut turned = t.clone();
    turned[0].swap(0, 1);
    assert!(text(Body::mesh(&p, &turned, 0.0)).contains("run the same way"));
    let mut out = t.clone();
    out[3][1] = 8;
    assert!(text(Body::mesh(&p, &out, 0.0)).contains("triangle 3 names vertex 8"));
    assert!(text(Body::mesh(&p, &t[..3], 0.0)).contains("at least 4"));
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let mut q = p.clone();
        q[5][2] = bad;
        assert!(text(Body::mesh(&q, &t, 0.0)).contains("vertex 5"));
    }
    for bad in [f64::NAN, -1.0, f64::INFINITY] {
        assert!(text(Body::mesh(&p, &t, bad)).contains("cell size"));
    }
    let small = text(Body::mesh(&p, &t, 1e-4));
    assert!(small.contains("MB") && small.contains("limit"), "{small}");
    text(Body::mesh(&p, &t, 1e-300));
    let flat: Vec<[f64; 3]> = p.iter().map(|p| [p[0], p[1], 0.0]).collect();
    assert!(text(Body::mesh(&flat, &t, 0.0)).contains("volume"));
    assert!(text(Body::mesh(&[], &[], 0.0)).contains("0 triangles"));
    let body = Body::mesh(&p, &t, 0.0).unwrap();
    assert!(
        body.deformed(&body.vertices()[1..])
            .unwrap_err()
            .message
            .contains("7 vertices")
    );
    let mut v = body.vertices().to_vec();
    v[2].y = f64::NAN;
    assert!(body.deformed(&v).unwrap_err().message.contains("vertex 2"));
    v.iter_mut().for_each(|p| p.y = 0.0);
    assert!(body.deformed(&v).unwrap_err().message.contains("flat"));
    let mirrored: Vec<Vec3> = body
        .vertices()
        .iter()
        .map(|p| Vec3::new(-p.x, p.y, p.z))
        .collect();
    assert!(
        body.deformed(&mirrored)
            .unwrap_err()
            .message
            .contains("inside out")
    );
}

#[test]
fn inward_and_doubled_meshes_are_mended() {
    let (p, t) = cube(0.3);
    let turned: Vec<[u32; 3]> = t.iter().map(|t| [t[0], t[2], t[1]]).collect();
    let body = Body::mesh(&p, &turned, 0.02).unwrap();
    assert!(body.mesh_report().unwrap().flipped);
    assert!(body.value(&Vec3::zeros()) < -0.2);
    // every triangle with corners of its own
    let soup: Vec<[f64; 3]> = t.iter().flatten().map(|&v| p[v as usize]).collect();
    let own: Vec<[u32; 3]> = (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let body = Body::mesh(&soup, &own, 0.02).unwrap();
    let report = body.mesh_report().unwrap();
    assert_eq!((report.welded, report.vertices, report.euler()), (28, 8, 2));
    let mut v = body.vertices().to_vec();
    v[7].x += 0.01;
    assert!(body.deformed(&v).unwrap_err().message.contains("one point"));
}

#[test]
fn segments_through_the_surface_are_found() {
    let (p, t) = torus(0.3, 0.1, 60, 30);
    let mesh = Body::mesh(&p, &t, 0.02).unwrap();
    let ball = Body::sphere(0.3).unwrap();
    let mut r = Random(8);
    let segments: Vec<(Vec3, Vec3)> = (0..3000).map(|_| (r.point(0.5), r.point(0.5))).collect();
    let tri = mesh.triangles();
    let v = mesh.vertices();
    let hit = mesh.intersections(&segments);
    for (i, (a, b)) in segments.iter().enumerate() {
        let brute = tri.iter().any(|t| {
            let [p, q, s] = t.map(|i| v[i as usize]);
            let m = nalgebra::Matrix3::from_columns(&[q - p, s - p, a - b]);
            m.lu().solve(&(a - p)).is_some_and(|x| {
                x.x >= 0.0 && x.y >= 0.0 && x.x + x.y <= 1.0 && (0.0..=1.0).contains(&x.z)
            })
        });
        assert_eq!(brute, hit.binary_search(&i).is_ok(), "segment {i}");
    }
    let hit = ball.intersections(&segments);
    for (i, (a, b)) in segments.iter().enumerate() {
        let s = (-a.dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        let low = a.lerp(b, s).norm();
        let high = a.norm().max(b.norm());
        if (low - 0.3).abs() > 1e-3 && (high - 0.3).abs() > 1e-9 {
            assert_eq!(low < 0.3 && high > 0.3, hit.binary_search(&i).is_ok());
        }
    }
}

#[test]
fn points_are_carried_with_the_nearest_surface() {
    let (p, t) = cube(0.3);
    let body = Body::mesh(&p, &t, 0.02).unwrap();
    let turned: Vec<Vec3> = body
        .vertices()
        .iter()
        .map(|p| Vec3::new(p.z + 0.1, p.y, -p.x))
        .collect();
    let x = Vec3::new(0.3, 0.1, 0.2);
    let y = body.carried(&turned, &x).unwrap();
    assert!((y - Vec3::new(0.3, 0.1, -0.3)).norm() < 1e-12);
    let (tri, w) = body.nearest(&Vec3::new(0.5, 0.1, 0.2)).unwrap();
    let at: Vec3 = (0..3)
        .map(|k| body.vertices()[body.triangles()[tri as usize][k] as usize] * w[k])
        .sum();
    assert!((at - x).norm() < 1e-12);
    assert!(body.carried(&turned[1..], &x).is_none());
}

/// Compares the field's sign with the winding number; returns (points, disagreements beyond one
/// cell, disagreements in all, largest depth of a disagreement, largest value error in the band).
fn compare(body: &Body, seed: u64, count: usize) -> (usize, usize, usize, f64, f64) {
    let h = body.cell_size().unwrap();
    let v = body.vertices();
    let tri = body.triangles();
    let (lo, hi) = v.iter().fold((v[0], v[0]), |b, p| (b.0.inf(p), b.1.sup(p)));
    let mut r = Random(seed);
    let (mut far, mut any, mut depth, mut error) = (0, 0, 0.0f64, 0.0f64);
    for i in 0..count {
        let x = if i % 4 == 0 {
            Vec3::from_fn(|d, _| r.within(lo[d] - 0.1, hi[d] + 0.1))
        } else {
            let t = tri[(r.next() * tri.len() as f64) as usize].map(|i| v[i as usize]);
            let n = (t[1] - t[0]).cross(&(t[2] - t[0])).normalize();
            (t[0] + t[1] + t[2]) / 3.0 + n * r.within(-0.04, 0.04)
        };
        let exact = body.exact_distance(&x);
        let got = body.value(&x);
        if (got < 0.0) != (exact < 0.0) {
            any += 1;
            depth = depth.max(exact.abs());
            far += usize::from(exact.abs() > h);
        }
        if exact.abs() < 2.0 * h {
            error = error.max((got - exact).abs());
        }
    }
    (count, far, any, depth, error)
}

#[test]
fn real_bodies_have_the_sign_of_their_winding_number() {
    for name in ["mean_all.obj", "makehuman_body_closed_m.obj"] {
        let Some(path) = data(name) else { return };
        let start = cpu();
        let body = Body::obj(&path, 1.0, 0.005).unwrap();
        let built = cpu() - start;
        let (bricks, bytes) = body.field_size().unwrap();
        println!(
            "{name}: {:?} Euler {}",
            body.mesh_report().unwrap(),
            body.mesh_report().unwrap().euler()
        );
        println!(
            "  built in {built:?}, bricks {bricks:?}, {:.1} MB",
            bytes as f64 / 1e6
        );
        let (n, far, any, depth, error) = compare(&body, 9, 1000);
        println!(
            "  {n} points: {far} wrong signs beyond a cell, {any} in all (deepest {depth:.2e} m), \
             value error within two cells {error:.2e} m"
        );
        assert_eq!(far, 0);
        // query time over points near the surface
        let mut r = Random(10);
        let tri = body.triangles();
        let v = body.vertices();
        let points: Vec<Vec3> = (0..20_000)
            .map(|_| {
                let t = tri[(r.next() * tri.len() as f64) as usize];
                v[t[0] as usize] + r.point(0.01)
            })
            .collect();
        let start = cpu();
        let mut sum = 0.0;
        for _ in 0..10 {
            for x in &points {
                sum += body.distance(x).gradient.x;
            }
        }
        let each = (cpu() - start) / 200_000;
        println!("  query {each:?} ({sum:.1})");
        let all: Vec<Vec3> = v.iter().map(|p| p * 1.01).collect();
        let start = cpu();
        let grown = body.deformed(&all).unwrap();
        println!("  deformed everywhere in {:?}", (cpu() - start));
        let (_, far, ..) = compare(&grown, 11, 1000);
        assert_eq!(far, 0);
        let arm: Vec<Vec3> = v
            .iter()
            .map(|p| p + Vec3::new(0.0, 0.0, 0.3 * (p.x - 0.25).max(0.0)))
            .collect();
        let start = cpu();
        let waved = body.deformed(&arm).unwrap();
        println!("  one arm deformed in {:?}", (cpu() - start));
        let (_, far, ..) = compare(&waved, 12, 1000);
        assert_eq!(far, 0);
    }
}

/// Distance of a point to a triangle by its definition: the plane's foot or the nearest of the three
/// edges' points.
fn to_triangle(p: &Vec3, t: &[Vec3; 3]) -> f64 {
    let n = (t[1] - t[0]).cross(&(t[2] - t[0]));
    let inside = (0..3).all(|k| {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        (b - a).cross(&(p - a)).dot(&n) >= 0.0
    });
    let plane = if inside && n.norm() > 0.0 {
        (p - t[0]).dot(&n).abs() / n.norm()
    } else {
        f64::INFINITY
    };
    (0..3).fold(plane, |best, k| {
        let (a, e) = (t[k], t[(k + 1) % 3] - t[k]);
        let s = if e.norm_squared() > 0.0 {
            ((p - a).dot(&e) / e.norm_squared()).clamp(0.0, 1.0)
        } else {
            0.0
        };
        best.min((p - a - e * s).norm())
    })
}

#[test]
fn distances_agree_with_every_triangle_looked_at() {
    // slivers, triangles without area, far from the origin, few and many triangles
    let mut r = Random(21);
    for (n, m, squeeze, shift) in [
        (3, 3, 1.0, 0.0),
        (12, 9, 1.0, 0.0),
        (40, 23, 1e-3, 0.0),
        (60, 31, 1.0, 3e4),
        (25, 14, 1e-9, 2.0),
    ] {
        let (mut p, mut t) = torus(0.3, 0.1, n, m);
        for q in &mut p {
            q[1] *= squeeze;
            q[0] += shift;
        }
        // a fan around a doubled vertex adds triangles without area
        let (a, b) = (t[0][0], t[0][1]);
        let double = p.len() as u32;
        p.push(p[b as usize]);
        t.push([a, b, double]);
        t.push([b, a, double]);
        // given cells must not be coarser than the body is thin
        let cell = if squeeze < 1.0 { 0.0 } else { 0.03 };
        let Ok(body) = Body::mesh(&p, &t, cell) else {
            assert!(squeeze < 1e-8, "{n} {m}");
            continue;
        };
        let corners: Vec<[Vec3; 3]> = t
            .iter()
            .map(|t| t.map(|v| Vec3::from(p[v as usize])))
            .collect();
        for _ in 0..600 {
            let x = r.point(1.0) * r.next() + Vec3::new(shift, 0.0, 0.0);
            let brute = corners
                .iter()
                .map(|t| to_triangle(&x, t))
                .fold(f64::INFINITY, f64::min);
            let got = body.exact_distance(&x).abs();
            assert!(
                (got - brute).abs() <= 1e-12 * (1.0 + shift),
                "{n} {m} at {x:?}: {got} {brute}"
            );
        }
    }
}

#[test]
fn real_bodies_deform_to_the_bits_of_a_field_built_anew() {
    for (name, only) in [
        ("mean_all.obj", 0.3),
        ("makehuman_body_closed_m.obj", -9.0),
        ("makehuman_body_closed_m.obj", 0.42),
    ] {
        let Some(path) = data(name) else { return };
        let body = Body::obj(&path, 1.0, 0.008).unwrap();
        // an arm, everything, a finger
        let moved: Vec<Vec3> = body
            .vertices()
            .iter()
            .map(|p| {
                let w = (p.x - only).clamp(0.0, 0.5);
                p + Vec3::new(-0.1 * w * w, 0.4 * w, 0.2 * w + 0.1 * w * p.y)
            })
            .collect();
        let one = body.deformed(&moved).unwrap();
        let two = toile::math::parallel::Workers::new(2);
        let two = body.deformed_with(&moved, &two).unwrap();
        let soup: Vec<[f64; 3]> = moved.iter().map(|p| [p.x, p.y, p.z]).collect();
        let anew = Body::mesh(&soup, body.triangles(), 0.008).unwrap();
        assert_eq!(one.field_size(), anew.field_size());
        let mut r = Random(22);
        let mut changed = 0;
        for i in 0..60_000 {
            let x = if i % 2 == 0 {
                Vec3::new(0.0, 0.9, 0.0) + r.point(1.3)
            } else {
                moved[(r.next() * moved.len() as f64) as usize] + r.point(0.05)
            };
            let d = anew.distance(&x);
            assert_eq!(one.distance(&x), d, "{name} {x:?}");
            assert_eq!(two.distance(&x), d, "{name} {x:?}");
            changed += usize::from(d != body.distance(&x));
        }
        println!("{name}: {changed} of 60000 points changed");
        assert!(changed > 100);
    }
}

#[test]
fn slopes_of_fields_stay_below_what_paths_are_walked_with() {
    // system::bodies takes 3
    let mut bodies = Vec::new();
    let (p, t) = cube(0.3);
    bodies.push(Body::mesh(&p, &t, 0.01).unwrap());
    let (p, t) = torus(0.3, 0.1, 12, 5);
    bodies.push(Body::mesh(&p, &t, 0.02).unwrap());
    for name in ["mean_all.obj", "makehuman_body_closed_m.obj"] {
        let Some(path) = data(name) else { continue };
        bodies.push(Body::obj(&path, 1.0, 0.01).unwrap());
    }
    for body in &bodies {
        let mut r = Random(23);
        let v = body.vertices();
        let mut worst: f64 = 0.0;
        for i in 0..60_000 {
            let at = v[(r.next() * v.len() as f64) as usize];
            let x = at + r.point(if i % 3 == 0 { 0.5 } else { 0.08 });
            worst = worst.max(body.distance(&x).gradient.norm());
        }
        println!("steepest {worst:.3}");
        assert!(worst < 2.5, "{worst}");
    }
}

/// Depths that a field finds at given points.
fn depths(body: &Body, at: &[Vec3], scale: f64) -> Vec<f64> {
    at.iter()
        .map(|x| body.value(&(x * scale)) / scale)
        .collect()
}

#[test]
fn a_damaged_real_body_is_mended_or_refused_with_its_place() {
    let Some(path) = data("makehuman_body_closed_m.obj") else {
        return;
    };
    let (p, t) = toile::body::read_obj(&path, 1.0).unwrap();
    let p: Vec<[f64; 3]> = p.iter().map(|p| [p.x, p.y, p.z]).collect();
    let n = p.len() as u32;
    let whole = Body::mesh(&p, &t, 0.01).unwrap();
    let mut r = Random(31);
    let at: Vec<Vec3> = (0..400)
        .map(|_| Vec3::from(p[(r.next() * p.len() as f64) as usize]) + r.point(0.03))
        .collect();
    let reference = depths(&whole, &at, 1.0);
    let agree = |name: &str, body: &Body, scale: f64, tolerance: f64| {
        for (x, (a, b)) in at
            .iter()
            .zip(depths(body, &at, scale).iter().zip(&reference))
        {
            assert!((a - b).abs() < tolerance, "{name} at {x:?}: {a} {b}");
        }
    };
    // centimetres, millimetres, kilometres
    for scale in [100.0, 1000.0, 1e-3] {
        let q: Vec<_> = p.iter().map(|p| p.map(|c| c * scale)).collect();
        agree(
            "scaled",
            &Body::mesh(&q, &t, 0.01 * scale).unwrap(),
            scale,
            1e-4,
        );
    }
    let inward: Vec<_> = t.iter().map(|t| [t[0], t[2], t[1]]).collect();
    let body = Body::mesh(&p, &inward, 0.01).unwrap();
    assert!(body.mesh_report().unwrap().flipped);
    agree("inward", &body, 1.0, 1e-12);
    // every triangle with corners of its own, as exporters write texture seams
    let own: Vec<_> = t.iter().flatten().map(|&v| p[v as usize]).collect();
    let soup: Vec<[u32; 3]> = (0..t.len() as u32)
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    let body = Body::mesh(&own, &soup, 0.01).unwrap();
    assert_eq!(body.mesh_report().unwrap().euler(), 2);
    agree("soup", &body, 1.0, 1e-12);
    // vertices of no triangle, triangles without area, triangles back to back
    let mut q = p.clone();
    q.extend([[0.0, 50.0, 0.0]; 3]);
    agree("loose", &Body::mesh(&q, &t, 0.01).unwrap(), 1.0, 1e-12);
    let mut back = t.clone();
    back.push(t[77]);
    back.push([t[77][0], t[77][2], t[77][1]]);
    agree(
        "back to back",
        &Body::mesh(&p, &back, 0.01).unwrap(),
        1.0,
        1e-9,
    );
    let mut collapsed = p.clone();
    for t in t.iter().step_by(70) {
        collapsed[t[1] as usize] = collapsed[t[0] as usize];
    }
    let body = Body::mesh(&collapsed, &t, 0.01).unwrap();
    assert!(body.mesh_report().unwrap().welded > 100);
    agree("collapsed", &body, 1.0, 0.01);
    // what cannot be mended names a place
    let text = |p: &[[f64; 3]], t: &[[u32; 3]]| Body::mesh(p, t, 0.01).unwrap_err().message;
    let hole = text(&p, &[&t[..500], &t[503..]].concat());
    assert!(hole.contains("open edges and 0 edges"), "{hole}");
    assert!(
        hole.contains("for example edge") && !hole.contains("same coordinates"),
        "{hole}"
    );
    let mut one = t.clone();
    one[500].swap(0, 1);
    let one = text(&p, &one);
    assert!(
        one.contains("3 edges whose triangles run") && one.contains("triangle 500"),
        "{one}"
    );
    let rounded: Vec<_> = own.iter().map(|p| p.map(|c| c + 1e-9 * r.next())).collect();
    let rounded = text(&rounded, &soup);
    assert!(
        rounded.contains("must have the same coordinates"),
        "{rounded}"
    );
    let mut pair = p.clone();
    pair.extend(p.iter().map(|p| [p[0] + 2.0, p[1], p[2]]));
    let mut both = t.clone();
    both.extend(inward.iter().map(|t| t.map(|v| v + n)));
    let pair = text(&pair, &both);
    assert!(
        pair.contains("1 parts are turned outward and 1 inward") && pair.contains("26756"),
        "{pair}"
    );
}

#[test]
fn cells_too_coarse_for_a_body_are_refused() {
    let (p, t) = cube(0.5);
    for cell in [0.3, 2.0, 1e300] {
        let error = Body::mesh(&p, &t, cell).unwrap_err();
        assert_eq!(error.status, toile::error::Status::Geometry);
        assert!(error.message.contains("1 m thin"), "{error}");
    }
    let body = Body::mesh(&p, &t, 0.25).unwrap();
    for depth in [0.01, 0.05, 0.2, 0.5] {
        let d = body.distance(&Vec3::new(0.5 - depth, 0.1, 0.05)).value;
        assert!(d < 0.0, "{depth}: {d}");
    }
}
