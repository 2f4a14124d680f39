//! Weaves on flat panels.

use crate::sheets::Random;
use crate::yarn_common::{circle, garment, laid, panel, random_panel, rectangle, u, weave};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};
use toile::error::Status;
use toile::math::Vec2;
use toile::pattern::yarn_fabric::{Mask, WEAVES};
use toile::yarn::{Cell, Family, Layout, YarnMesh, lay};

const PITCH: f64 = 1e-3;
const RADIUS: f64 = 0.3e-3;

fn mask(name: &str) -> Mask {
    Mask::preset(name).unwrap()
}

/// No yarn is stretched, bent, sheared or pushed in the layout.
fn assert_without_force(mesh: &YarnMesh, rest: f64) {
    for y in 0..mesh.yarn_count() {
        let yarn = mesh.yarn(y);
        for w in yarn.windows(2) {
            let d = (mesh.uv[w[1].node as usize] - mesh.uv[w[0].node as usize]).norm();
            assert!(((w[1].u - w[0].u) / (rest * d) - 1.0).abs() < 1e-9);
        }
        for w in yarn.windows(3) {
            let [a, b, c] = [0, 1, 2].map(|k| mesh.uv[w[k].node as usize]);
            let (d, e) = ((b - a).normalize(), (c - b).normalize());
            assert!((d.x * e.y - d.y * e.x).abs() < 1e-6, "a yarn bends");
        }
    }
    for c in &mesh.corners {
        let [q, a, b] = c.nodes.map(|n| mesh.uv[n as usize]);
        let cosine = (a - q).normalize().dot(&(b - q).normalize());
        assert!(cosine.abs() < 1e-6);
        // jamming begins beyond the right angle
        assert!(FRAC_PI_2 - 2.0 * (RADIUS / c.length).asin() > 0.0);
    }
    for s in &mesh.spacings {
        let du = u(mesh, s.incidences[1]) - u(mesh, s.incidences[0]);
        assert!(s.least < du);
    }
    assert!(mesh.lift.iter().all(|z| *z == 0.0));
}

#[test]
fn counts_follow_the_size() {
    for (nx, ny, name) in [(7, 5, "plain"), (12, 9, "twill 2/2"), (2, 2, "satin 5")] {
        let size = Vec2::new(nx as f64 * PITCH, ny as f64 * 1.5 * PITCH);
        let yarns = weave(mask(name), [PITCH, 1.5 * PITCH], RADIUS);
        let mesh = laid(&garment(rectangle(size), yarns));
        let c = mesh.counts();
        assert_eq!(c.yarns, nx + ny);
        assert_eq!(c.nodes, nx * ny + 2 * (nx + ny));
        assert_eq!(c.incidences, 2 * nx * ny + 2 * (nx + ny));
        assert_eq!(c.corners, 4 * nx * ny);
        assert_eq!(c.spacings, nx * (ny - 1) + ny * (nx - 1));
        assert_eq!(c.wraps + c.stitch_springs + c.ties, 0);
        assert_without_force(&mesh, 1.0);
        // half a pitch beyond the last crossing
        for y in 0..mesh.yarn_count() {
            let pitch = if mesh.yarn_family[y] == Family::Warp {
                1.5 * PITCH
            } else {
                PITCH
            };
            let yarn = mesh.yarn(y);
            assert!((yarn[1].u - 0.5 * pitch).abs() < 1e-12);
        }
    }
}

#[test]
fn stacks_follow_the_mask_and_floats_are_closer() {
    for name in WEAVES {
        let pitch = 1.5 * PITCH;
        let size = Vec2::new(10.0 * pitch, 10.0 * pitch);
        let mesh = laid(&garment(
            rectangle(size),
            weave(mask(name), [pitch; 2], RADIUS),
        ));
        let cell = |k: u32| {
            let p = mesh.uv[k as usize] / pitch;
            [(p.x - 0.5).round() as usize, (p.y - 0.5).round() as usize]
        };
        let family = |incidence: u32| {
            let y = mesh.starts.partition_point(|s| *s <= incidence) - 1;
            mesh.yarn_family[y]
        };
        let mut over = 0;
        for node in 0..mesh.uv.len() {
            let stack = mesh.stack(node);
            if let [_, front] = stack {
                let [i, j] = cell(node as u32);
                let warp = family(front.incidence) == Family::Warp;
                assert_eq!(warp, mask(name).warp_over(i, j), "{name} {i} {j}");
                over += usize::from(warp);
            }
        }
        let share = match *name {
            "twill 3/1" => 75,
            "satin 5" => 20,
            _ => 50,
        };
        assert!((over as i32 - share).abs() <= 3, "{name}: {over} of 100");
        for s in &mesh.spacings {
            let front = |k: u32| {
                let node = mesh.incidences[k as usize].node as usize;
                mesh.stack(node)[1].incidence == k
            };
            let changes = front(s.incidences[0]) != front(s.incidences[1]);
            let least = if changes { 4.0 } else { 2.0 } * RADIUS;
            assert!((s.least / least - 1.0).abs() < 1e-12 && s.least < s.length);
        }
        assert_without_force(&mesh, 1.0);
    }
}

#[test]
fn a_dense_weave_exerts_no_force() {
    // 4 R = 1.2 pitch
    let size = Vec2::new(0.01, 0.01);
    let mesh = laid(&garment(
        rectangle(size),
        weave(mask("plain"), [PITCH; 2], RADIUS),
    ));
    for s in &mesh.spacings {
        assert!((s.least / (0.95 * PITCH) - 1.0).abs() < 1e-9);
    }
    assert_without_force(&mesh, 1.0);
}

#[test]
fn a_circle_cuts_every_yarn_on_its_rim() {
    let r = 0.0153;
    let mesh = laid(&garment(
        circle(r),
        weave(mask("twill 2/2"), [PITCH; 2], RADIUS),
    ));
    assert_without_force(&mesh, 1.0);
    for y in 0..mesh.yarn_count() {
        let yarn = mesh.yarn(y);
        assert!(yarn.len() >= 4);
        for end in [yarn[0], yarn[yarn.len() - 1]] {
            let off = (mesh.uv[end.node as usize].norm() - r).abs();
            // sagitta of the polygon's sides
            assert!(
                off < r * (std::f64::consts::PI / 64.0).powi(2) / 8.0,
                "{off}"
            );
            assert_eq!(mesh.stack(end.node as usize).len(), 1);
        }
        for w in yarn.windows(2) {
            assert!(w[1].u - w[0].u > 0.2 * PITCH * (1.0 - 1e-9));
        }
    }
    // nearly all of the area is covered
    let crossings = mesh.counts().nodes - 2 * mesh.yarn_count();
    let area = std::f64::consts::PI * r * r / (PITCH * PITCH);
    assert!(crossings as f64 > area - 0.5 * 2.0 * std::f64::consts::PI * r / PITCH);
    assert!((crossings as f64) < area + 5.0);
}

#[test]
fn yarns_follow_the_grain_and_the_outside() {
    for reverse in [false, true] {
        let v = Vec2::new;
        let mut corners = vec![v(0.0, 0.0), v(0.02, 0.0), v(0.02, 0.03), v(0.0, 0.03)];
        if reverse {
            corners.reverse();
        }
        let mut panel = panel(&corners, &[]);
        panel.grain = FRAC_PI_6;
        let own = Mask::from_lines(&["x..", ".x.", "..x"]).unwrap();
        let mesh = laid(&garment(panel, weave(own, [PITCH; 2], RADIUS)));
        let side = if reverse { -1.0 } else { 1.0 };
        for y in 0..mesh.yarn_count() {
            let yarn = mesh.yarn(y);
            let at = |k: usize| mesh.uv[yarn[k].node as usize];
            let d = (at(yarn.len() - 1) - at(0)).normalize();
            let expected = match mesh.yarn_family[y] {
                Family::Warp => Vec2::new(-FRAC_PI_6.sin(), FRAC_PI_6.cos()),
                _ => Vec2::new(FRAC_PI_6.cos(), FRAC_PI_6.sin()) * side,
            };
            assert!((d - expected).norm() < 1e-9, "{d}");
        }
        // seen from the outside the diagonal of the twill rises to the right
        let warp_over = |n: usize| {
            let stack = mesh.stack(n);
            stack.len() == 2 && {
                let y = mesh.starts.partition_point(|s| *s <= stack[1].incidence) - 1;
                mesh.yarn_family[y] == Family::Warp
            }
        };
        let across = Vec2::new(FRAC_PI_6.cos(), FRAC_PI_6.sin()) * side;
        let along = Vec2::new(-FRAC_PI_6.sin(), FRAC_PI_6.cos());
        let mut seen = 0;
        for n in (0..mesh.uv.len()).filter(|n| warp_over(*n)) {
            let next = mesh.uv[n] + (across + along) * PITCH;
            if let Some(m) = (0..mesh.uv.len())
                .find(|m| (mesh.uv[*m] - next).norm() < 1e-6 && mesh.stack(*m).len() == 2)
            {
                assert!(warp_over(m));
                seen += 1;
            }
        }
        assert!(seen > 50);
    }
}

#[test]
fn random_outlines_with_holes_are_woven() {
    let mut random = Random::new(11);
    for k in 0..40 {
        let size = 0.03 + 0.02 * random.signed().abs();
        let panel = random_panel(&mut random, size);
        let name = WEAVES[k % WEAVES.len()];
        let garment = garment(panel, weave(mask(name), [PITCH, 1.3 * PITCH], RADIUS));
        let mesh = laid(&garment);
        assert_without_force(&mesh, 1.0);
        for y in 0..mesh.yarn_count() {
            let yarn = mesh.yarn(y);
            assert!(yarn.windows(2).all(|w| w[1].u - w[0].u > 0.199 * PITCH));
            assert!(yarn.len() >= 4);
        }
        assert!(mesh.counts().nodes > 200);
    }
}

#[test]
fn a_cell_sets_the_laid_pitch_and_the_rest_length() {
    let garment = garment(
        rectangle(Vec2::new(0.012, 0.012)),
        weave(mask("plain"), [PITCH; 2], RADIUS),
    );
    let cells = [Cell {
        across: 1.2,
        along: 0.8,
        rest: 1.05,
    }];
    let layout = Layout {
        cells: &cells,
        ..Layout::default()
    };
    let mesh = lay(&garment, &layout).unwrap();
    mesh.check_on(&garment).unwrap();
    let warps = mesh.yarn_family.iter().filter(|f| **f == Family::Warp);
    assert_eq!((warps.count(), mesh.yarn_count()), (10, 25));
    // yarns are as long as in the nominal layout, and 1.05 times that
    for y in 0..mesh.yarn_count() {
        for pair in mesh.yarn(y)[1..].windows(2).take(4) {
            let du = pair[1].u - pair[0].u;
            assert!((du - 1.05 * PITCH).abs() < 1e-12, "yarn {y}: {du}");
        }
    }
    for bad in [0.0, f64::NAN, 11.0] {
        let cells = [Cell {
            rest: bad,
            ..Cell::default()
        }];
        let layout = Layout {
            cells: &cells,
            ..Layout::default()
        };
        assert_eq!(lay(&garment, &layout).unwrap_err().status, Status::Argument);
    }
}

#[test]
fn too_many_nodes_are_refused_before_they_are_laid() {
    // 1e9 crossings
    let fine = garment(
        rectangle(Vec2::new(1.0, 1.0)),
        weave(mask("plain"), [3.1e-5; 2], 1e-5),
    );
    let error = lay(&fine, &Layout::default()).unwrap_err();
    assert_eq!(error.status, Status::Limit);
    assert!(error.message.contains("'panel'") && error.message.contains("limit 5000000"));
    let small = garment(
        rectangle(Vec2::new(0.01, 0.01)),
        weave(mask("plain"), [PITCH; 2], RADIUS),
    );
    let layout = Layout {
        max_nodes: 100,
        ..Layout::default()
    };
    assert_eq!(lay(&small, &layout).unwrap_err().status, Status::Limit);
}

#[test]
fn a_panel_that_holds_no_yarn_is_refused() {
    for size in [
        Vec2::new(1.5 * PITCH, 0.02),
        Vec2::new(0.5 * PITCH, 0.5 * PITCH),
    ] {
        let garment = garment(rectangle(size), weave(mask("plain"), [PITCH; 2], RADIUS));
        let error = lay(&garment, &Layout::default()).unwrap_err();
        assert_eq!(error.status, Status::Geometry);
        assert!(error.message.contains("'panel': too small"), "{error}");
    }
}
