//! Analytic and grid bodies, and OBJ text of any kind.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use toile::body::Body;
use toile::math::Vec3;

struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn point(&mut self, r: f64) -> Vec3 {
        Vec3::from_fn(|_, _| r * ((self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0))
    }
}

/// Central differences of value and gradient at random points; points where the Hessian differs
/// on the two sides (a knot, a seam of the shape) are not compared for it.
fn check_derivatives(body: &Body, range: f64, tolerance: f64) {
    let mut r = Random(1);
    let (e, mut compared) = (1e-6, 0);
    for _ in 0..2000 {
        let x = r.point(range);
        let at = body.distance(&x);
        for d in 0..3 {
            let mut s = Vec3::zeros();
            s[d] = e;
            let (a, b) = (body.distance(&(x + s)), body.distance(&(x - s)));
            if !a.hessian.relative_eq(&b.hessian, 1e-2, 1e-2) {
                continue;
            }
            compared += 1;
            let fd = (a.value - b.value) / (2.0 * e);
            assert!((fd - at.gradient[d]).abs() < tolerance, "{x:?} {fd} {at:?}");
            let fd = (a.gradient - b.gradient) / (2.0 * e);
            let column: Vec3 = at.hessian.column(d).into();
            assert!(
                (fd - column).norm() < tolerance * (10.0 + column.norm()),
                "{x:?} {fd} {column}"
            );
        }
    }
    assert!(compared > 5000, "{compared}");
}

#[test]
fn analytic_distances_are_exact_with_their_derivatives() {
    let ball = Body::sphere(0.3).unwrap();
    let rod = Body::capsule(0.4, 0.1).unwrap();
    let floor = Body::plane([0.0, 3.0, 4.0], 5.0).unwrap();
    let mut r = Random(2);
    for _ in 0..1000 {
        let x = r.point(1.0);
        assert!((ball.value(&x) - (x.norm() - 0.3)).abs() < 1e-15);
        let y = x.y.clamp(-0.4, 0.4);
        assert!((rod.value(&x) - ((x - Vec3::y() * y).norm() - 0.1)).abs() < 1e-15);
        assert!((floor.value(&x) - (0.6 * x.y + 0.8 * x.z - 1.0)).abs() < 1e-15);
    }
    for body in [&ball, &rod, &floor] {
        check_derivatives(body, 0.8, 1e-5);
        let d = body.distance(&Vec3::zeros());
        assert!(
            d.hessian
                .iter()
                .chain(d.gradient.iter())
                .all(|c| c.is_finite())
        );
        assert!((d.gradient.norm() - 1.0).abs() < 1e-12);
    }
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Body::sphere(bad).is_err());
        assert!(Body::capsule(0.1, bad).is_err());
    }
    assert!(Body::capsule(-0.1, 1.0).is_err());
    assert!(Body::plane([0.0; 3], 0.0).is_err());
    assert!(Body::plane([0.0, f64::NAN, 1.0], 0.0).is_err());
    assert!(Body::plane([0.0, 1e-300, 0.0], 1e300).is_err());
}

#[test]
fn display_meshes_are_closed_and_turned_outward() {
    for body in [
        Body::sphere(0.3).unwrap(),
        Body::capsule(0.4, 0.1).unwrap(),
        ball_grid(24),
    ] {
        let (v, t) = body.display_mesh();
        let p: Vec<[f64; 3]> = v.iter().map(|p| [p.x, p.y, p.z]).collect();
        let mesh = Body::mesh(&p, &t, 0.05).unwrap();
        let report = mesh.mesh_report().unwrap();
        assert_eq!((report.euler(), report.flipped), (2, false));
        let off = v.iter().map(|p| body.value(p).abs()).fold(0.0, f64::max);
        assert!(off < 1e-3, "{off}");
    }
}

/// A ball of radius 0.3 on `n` cells per axis of a cube of 1 m.
fn ball_grid(n: usize) -> Body {
    let h = 1.0 / n as f64;
    let at = |i: usize| -0.5 + h * i as f64;
    let mut f = Vec::new();
    for i in 0..=n {
        for j in 0..=n {
            for k in 0..=n {
                f.push(Vec3::new(at(i), at(j), at(k)).norm() - 0.3);
            }
        }
    }
    Body::grid([n + 1; 3], [-0.5; 3], h, &f).unwrap()
}

#[test]
fn grid_error_is_of_third_order_in_value_and_second_in_gradient() {
    let mut last: Option<(f64, f64)> = None;
    for n in [16, 32, 64] {
        let body = ball_grid(n);
        let mut r = Random(3);
        let (mut ev, mut eg): (f64, f64) = (0.0, 0.0);
        for _ in 0..4000 {
            let x = r.point(1.0).normalize() * 0.3 + r.point(0.02);
            let d = body.distance(&x);
            ev = ev.max((d.value - (x.norm() - 0.3)).abs());
            eg = eg.max((d.gradient - x.normalize()).norm());
        }
        println!("n {n}: value {ev:.2e} m, gradient {eg:.2e}");
        if let Some((v, g)) = last {
            println!("  orders {:.2} {:.2}", (v / ev).log2(), (g / eg).log2());
            assert!(v / ev > 6.5 && g / eg > 3.3, "{} {}", v / ev, g / eg);
        }
        last = Some((ev, eg));
    }
}

#[test]
fn grid_derivatives_are_consistent_inside_at_the_border_and_outside() {
    let body = ball_grid(20);
    check_derivatives(&body, 0.5, 1e-5);
    check_derivatives(&body, 2.0, 1e-5);
}

#[test]
fn grid_beyond_its_box_is_a_lower_bound_with_the_right_sign() {
    let body = ball_grid(20);
    let mut r = Random(4);
    for _ in 0..5000 {
        let x = r.point(3.0);
        if x.amax() > 0.5 {
            let got = body.value(&x);
            assert!(got > 0.0 && got <= x.norm() - 0.3 + 1e-3, "{x:?} {got}");
        }
    }
    // a floor that leaves the box goes on
    let mut f = Vec::new();
    for _ in 0..25 {
        f.extend([-0.5, -0.25, 0.0, 0.25, 0.5]); // height along z
    }
    let floor = Body::grid([5; 3], [0.0, 0.0, -0.5], 0.25, &f).unwrap();
    assert!((floor.value(&Vec3::new(9.0, -7.0, 0.1)) - 0.1).abs() < 1e-12);
    assert!(floor.value(&Vec3::new(9.0, -7.0, -3.0)) < 0.0);
    assert!(floor.value(&Vec3::new(9.0, -7.0, 3.0)) > 0.0);
}

#[test]
fn bad_grids_are_refused() {
    let f = vec![1.0; 27];
    assert!(Body::grid([3; 3], [0.0; 3], 0.1, &f).is_ok());
    assert!(Body::grid([3, 3, 1], [0.0; 3], 0.1, &f[..9]).is_err());
    assert!(Body::grid([3; 3], [0.0; 3], 0.1, &f[1..]).is_err());
    assert!(Body::grid([usize::MAX; 3], [0.0; 3], 0.1, &f).is_err());
    assert!(Body::grid([1 << 21; 3], [0.0; 3], 0.1, &f).is_err());
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Body::grid([3; 3], [0.0; 3], bad, &f).is_err());
    }
    assert!(Body::grid([3; 3], [0.0, f64::NAN, 0.0], 0.1, &f).is_err());
    let mut g = f.clone();
    g[13] = f64::NAN;
    assert!(
        Body::grid([3; 3], [0.0; 3], 0.1, &g)
            .unwrap_err()
            .message
            .contains("value 13")
    );
}

const BOX: &str = "# a box\nmtllib none.mtl\no box\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\n\
v -1 -1 1\nv 1 -1 1\r\nv 1 1 1\nv -1 1 1 1.0\nvt 0 0\nvn 0 0 1\ng sides\nf 4/1/1 3/1/1 2/1/1 1\n\
f 5//1 6 7 8\nf 1 2 6 5\nf -6 -5 \\\n-1 -2\nf 2 3 7 6\nf 1 5 8 4\n";

#[test]
fn obj_keeps_the_files_vertices_and_scales_them() {
    let body = Body::obj_bytes(BOX.as_bytes(), 0.1, 0.02).unwrap();
    assert_eq!((body.vertices().len(), body.triangles().len()), (8, 12));
    assert_eq!(body.vertices()[1], Vec3::new(0.1, -0.1, -0.1));
    assert!((body.value(&Vec3::new(0.0, 0.12, 0.0)) - 0.02).abs() < 1e-6);
}

#[test]
fn obj_errors_name_the_line() {
    let text = |s: &str| Body::obj_bytes(s.as_bytes(), 1.0, 0.0).unwrap_err().message;
    for (bad, place) in [
        ("v 0 0 0\nv 0 x 0\n", "line 2: 'x' is not a number"),
        ("v 0 0\n", "line 1: vertex has 2"),
        ("\n\nv 0 0 nan\n", "line 3: coordinate"),
        ("v 0 0 1e999\n", "line 1: coordinate"),
        ("v 0 0 0\nf 1 2 3\n", "line 2: face names vertex 2"),
        ("v 0 0 0\nf 0 1 1\n", "line 2: face names vertex 0"),
        ("v 0 0 0\nf -2 1 1\n", "line 2: face names vertex -2"),
        ("v 0 0 0\nf 1 1\n", "line 2: face has 2 corners"),
        ("v 0 0 0\nf 99999999999999999999 1 1\n", "line 2: '9999"),
        (
            "v 0 0 0\nf -9223372036854775808 1 1\n",
            "line 2: face names",
        ),
        ("", "0 triangles"),
    ] {
        assert!(text(bad).contains(place), "{bad:?}: {}", text(bad));
    }
    let missing = Body::obj(std::path::Path::new("/nowhere/x.obj"), 1.0, 0.0).unwrap_err();
    assert!(missing.message.contains("/nowhere/x.obj"));
    assert!(Body::obj(std::path::Path::new("/dev/zero"), 1.0, 0.0).is_err());
    assert!(Body::obj(std::path::Path::new("/"), 1.0, 0.0).is_err());
    assert!(Body::obj_bytes(BOX.as_bytes(), f64::NAN, 0.0).is_err());
}

#[test]
fn obj_of_any_bytes_is_an_error_or_a_body() {
    let mut r = Random(5);
    let mut good = 0;
    for _ in 0..3000 {
        let mut bytes = BOX.as_bytes().to_vec();
        for _ in 0..1 + r.bits() % 4 {
            let at = (r.bits() % bytes.len() as u64) as usize;
            match r.bits() % 4 {
                0 => bytes[at] = r.bits() as u8,
                1 => bytes.truncate(at + 1),
                2 => bytes.insert(at, b"0123456789-./e\n "[(r.bits() % 16) as usize]),
                _ => {
                    bytes.remove(at);
                }
            }
            if bytes.is_empty() {
                bytes.push(b'v');
            }
        }
        good += usize::from(Body::obj_bytes(&bytes, 1.0, 0.5).is_ok());
    }
    println!("{good} of 3000 mutated files are still bodies");
    assert!(good > 100 && good < 2900);
    for _ in 0..500 {
        let bytes: Vec<u8> = (0..200).map(|_| r.bits() as u8).collect();
        assert!(Body::obj_bytes(&bytes, 1.0, 0.5).is_err());
    }
}

#[test]
fn obj_polygons_with_notches_are_cut_into_ears() {
    // an L-shaped prism: two concave hexagons and six quadrilaterals
    let outline = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]];
    let mut s = String::new();
    for z in [0, 1] {
        for p in outline {
            s += &format!("v {} {} {z}\n", p[0], p[1]);
        }
    }
    s += "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n";
    for i in 0..6 {
        let j = (i + 1) % 6;
        s += &format!("f {} {} {} {}\n", i + 1, j + 1, j + 7, i + 7);
    }
    let body = Body::obj_bytes(s.as_bytes(), 1.0, 0.05).unwrap();
    let report = body.mesh_report().unwrap();
    assert!((report.volume - 3.0).abs() < 1e-12);
    assert!((report.area - 14.0).abs() < 1e-12, "{}", report.area);
    assert!(body.value(&Vec3::new(1.4, 1.4, 0.5)) > 0.3);
}
