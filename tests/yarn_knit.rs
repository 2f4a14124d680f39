//! Knits on flat panels.

use crate::common_data::data_dir;
use crate::sheets::Random;
use crate::yarn_common::{
    assert_no_short_segment, garment, knit, knit_of, laid, patch, random_panel, rectangle, u,
};
use std::time::Instant;
use toile::error::Status;
use toile::math::{Vec2, Vec3};
use toile::pattern::Garment;
use toile::pattern::chart::{Chart, PRESETS};
use toile::pattern::yarn_fabric::Structure;
use toile::yarn::{Layout, Wrap, YarnMesh, lay};

fn chart(grid: &str) -> Chart {
    Chart::from_grid(grid).unwrap()
}

fn stockinette() -> Chart {
    Chart::preset("stockinette").unwrap()
}

/// The same chart, used once.
fn once(chart: Chart, wales: usize, courses: usize) -> Garment {
    let mut yarns = knit(chart);
    if let Structure::Knitted(knit) = &mut yarns.structure {
        knit.once = true;
    }
    patch(yarns, wales, courses)
}

/// The other end of a wing's segment, and the one after it: the axis' nodes as incidences.
fn strand(mesh: &YarnMesh, wrap: &Wrap, end: usize) -> [u32; 3] {
    let wing = wrap.wings[end];
    let node = |k: u32| mesh.incidences[k as usize].node;
    for at in [wing.wrapping_sub(1), wing + 1] {
        let beyond = if at < wing {
            at.wrapping_sub(1)
        } else {
            at + 1
        };
        let (near, far) = (wrap.axis[end], wrap.axis[1 - end]);
        let last = mesh.incidences.len() as u32;
        if at < last && beyond < last && node(at) == near && node(beyond) == far {
            return [wing, at, beyond];
        }
    }
    panic!("wrap {wrap:?} has no strand");
}

fn rank(mesh: &YarnMesh, incidence: u32) -> usize {
    let node = mesh.incidences[incidence as usize].node as usize;
    let stack = mesh.stack(node);
    stack.iter().position(|s| s.incidence == incidence).unwrap()
}

/// Turn of one strand about the other from wing to wing, in the laid layout with every strand at its
/// height in the stack [turns]; none where a wing is missing. At `q0` a strand crosses over to the
/// other side of the axis than its wing, at `q1` it comes back.
fn turn(mesh: &YarnMesh, garment: &Garment, wrap: &Wrap) -> Option<f64> {
    let panel = &garment.panels[mesh.node_panel[wrap.axis[0] as usize] as usize];
    let up = Vec3::z() * panel.signed_outline_area().unwrap().signum();
    let place = |k: u32| {
        let p = mesh.uv[mesh.incidences[k as usize].node as usize];
        Vec3::new(p.x, p.y, 0.0)
    };
    // incidences of both strands: wing, q0, q1, wing
    let (a, b) = (strand(mesh, wrap, 0), strand(mesh, wrap, 1));
    let on = |s: [u32; 3]| {
        let k = if s[2] > s[1] { s[2] + 1 } else { s[2] - 1 };
        ((k as usize) < mesh.incidences.len()).then_some(k)
    };
    let first = [a[0], a[1], a[2], on(a)?];
    let second = [on(b)?, b[2], b[1], b[0]];
    let [q0, q1] = wrap.axis.map(|q| mesh.uv[q as usize]);
    let e = Vec3::new(q1.x - q0.x, q1.y - q0.y, 0.0).normalize();
    let across = up.cross(&e);
    let thick = 1e-4;
    let points = |s: [u32; 4], other: [u32; 4]| {
        let height = |k: usize| {
            let front = rank(mesh, s[k]) > rank(mesh, other[k]);
            place(s[k]) + up * if front { thick } else { -thick }
        };
        let side = (place(s[0]) - place(s[1])).dot(&across).signum();
        let middle = (place(s[1]) + place(s[2])) * 0.5 - across * (side * thick);
        [place(s[0]), height(1), middle, height(2), place(s[3])]
    };
    let (p, q) = (points(first, second), points(second, first));
    let at = |list: &[Vec3; 5], s: f64| {
        let k = (s as usize).min(3);
        list[k] + (list[k + 1] - list[k]) * (s - k as f64)
    };
    let angle = |s: f64| {
        let d = at(&p, s) - at(&q, s);
        d.dot(&up).atan2(d.dot(&across))
    };
    let steps = 400;
    let mut total = 0.0;
    for k in 0..steps {
        let [from, to] = [k, k + 1].map(|k| angle(4.0 * f64::from(k) / f64::from(steps)));
        total += toile::math::geometry::wrap_angle(to - from);
    }
    Some(total / std::f64::consts::TAU)
}

#[test]
fn counts_follow_wales_and_courses() {
    for (name, _) in PRESETS {
        for (n, m) in [(6, 6), (9, 4), (1, 1), (2, 5)] {
            let mesh = laid(&patch(knit(Chart::preset(name).unwrap()), n, m));
            let c = mesh.counts();
            assert_eq!(c.yarns, 1);
            // four nodes in every loop that is taken up, two in a turn, two tails
            assert_eq!(c.nodes, 4 * n * (m + 1) + 2 * (m + 1) + 2, "{name} {n} {m}");
            assert_eq!(c.incidences, 8 * n * (m + 1) + 2 * (m + 1) + 2);
            assert_eq!(c.stitch_springs, 4 * n * (m + 1));
            // two angles a contact, one at cast-on and bind-off
            assert_eq!(c.wraps, 4 * n * m, "{name} {n} {m}");
            assert_eq!(c.corners + c.ties, 0);
        }
    }
}

#[test]
fn a_sweater_has_four_nodes_a_loop() {
    // the paper counts 56K loops and 224353 nodes
    let mesh = laid(&patch(knit(Chart::preset("garter").unwrap()), 250, 224));
    let ratio = mesh.counts().nodes as f64 / (250.0 * 224.0);
    println!("{} nodes, {ratio} a loop", mesh.counts().nodes);
    assert!((ratio - 224_353.0 / 56_000.0).abs() < 0.04);
}

#[test]
fn loops_are_placed_as_the_scheme_says() {
    let (w, h) = (3e-3, 2.55e-3);
    let mesh = laid(&patch(knit(stockinette()), 6, 6));
    // the middle of the first wale of row 0
    let origin = Vec2::new(0.7 * w, 0.5 * h + 0.04 * w);
    let find = |x: f64, y: f64| {
        let p = origin + Vec2::new(x * w, y);
        (0..mesh.uv.len()).find(|k| (mesh.uv[*k] - p).norm() < 1e-9)
    };
    for (i, j) in (0..6).flat_map(|i| (0..=6).map(move |j| (f64::from(i), f64::from(j)))) {
        for side in [-1.0, 1.0] {
            let inner = find(i + 0.17 * side, j * h + 0.1 * w).unwrap();
            let outer = find(i + 0.36 * side, j * h - 0.1 * w).unwrap();
            assert_eq!(mesh.stack(inner).len(), 2);
            assert_eq!(mesh.stack(outer).len(), 2);
            // the new yarn, group 1, lies in front at the inner node and behind at the outer one
            assert_eq!(mesh.stack(inner)[1].group, 1);
            assert_eq!(mesh.stack(outer)[1].group, 0);
        }
    }
    // the cast-on runs to the right, row 0 to the left, two selvedge nodes in each turn
    let yarn = mesh.yarn(0);
    let x = |k: usize| (mesh.uv[yarn[k].node as usize].x - origin.x) / w;
    assert!((x(0) + 0.66).abs() < 1e-9);
    assert!((x(25) - 5.66).abs() < 1e-9 && (x(26) - 5.66).abs() < 1e-9);
    assert!((x(27) - 5.36).abs() < 1e-9 && x(28) < x(27));
    let z: f64 = mesh.lift.iter().fold(0.0, |a, z| a.max(z.abs()));
    assert!(z > 0.005 * w && z <= 0.01 * w);
}

#[test]
fn wraps_unwind_the_turn_of_the_two_yarns() {
    for reverse in [false, true] {
        for grid in [".", "-", ".\n-", "..--", "o..../\\....o\n............"] {
            let mut garment = patch(knit(chart(grid)), 14, 6);
            if reverse {
                let panel = &mut garment.panels[0];
                panel.outline.reverse();
                for edge in &mut panel.outline {
                    std::mem::swap(&mut edge.start, &mut edge.end);
                }
                garment.check_geometry().unwrap();
            }
            let mesh = laid(&garment);
            let mut seen = 0;
            for wrap in &mesh.wraps {
                let two = wrap.axis.iter().all(|q| mesh.stack(*q as usize).len() == 2);
                if !two {
                    continue;
                }
                let Some(turn) = turn(&mesh, &garment, wrap) else {
                    continue;
                };
                if (turn.abs() - 1.0).abs() < 1e-6 {
                    assert_eq!(wrap.sign, -turn.signum(), "{grid}");
                    seen += 1;
                }
            }
            assert!(2 * seen > mesh.wraps.len(), "{grid}: {seen}");
        }
    }
}

#[test]
fn left_and_right_knit_and_purl_mirror_each_other() {
    let knits = laid(&patch(knit(stockinette()), 5, 4));
    let purls = laid(&patch(
        knit(Chart::preset("reverse stockinette").unwrap()),
        5,
        4,
    ));
    assert_eq!(knits.uv, purls.uv);
    assert_eq!(knits.incidences, purls.incidences);
    assert_eq!(knits.wraps.len(), purls.wraps.len());
    for (a, b) in knits.wraps.iter().zip(&purls.wraps) {
        assert_eq!((a.axis, a.wings), (b.axis, b.wings));
        // the bind-off course is knit in both
        let bind_off = knits.uv[a.axis[0] as usize].y > 4.4 * 2.55e-3;
        assert_eq!(a.sign, if bind_off { b.sign } else { -b.sign });
        let [q0, q1] = a.axis.map(|q| knits.uv[q as usize]);
        let left = q1.x < q0.x;
        assert_eq!(a.sign, if left { 1.0 } else { -1.0 });
    }
    let mut turned = 0;
    for node in 0..knits.uv.len() {
        let groups =
            |mesh: &YarnMesh| -> Vec<u8> { mesh.stack(node).iter().map(|s| s.group).collect() };
        let (mut a, b) = (groups(&knits), groups(&purls));
        if knits.uv[node].y < 4.2 * 2.55e-3 && a.len() == 2 {
            a.reverse();
            turned += 1;
        }
        assert_eq!(a, b);
    }
    assert_eq!(turned, 4 * 5 * 4);
}

#[test]
fn decreases_stack_their_loops() {
    for (grid, fronts) in [
        ("/o\n..", vec![0, 1]),
        ("\\o\n..", vec![1, 0]),
        ("o^o\n...", vec![1, 2, 0]),
        ("o<o\n...", vec![2, 0, 1]),
        ("oo5oo\n.....", vec![0, 1, 2, 3, 4]),
        ("ooAoo\n.....", vec![2, 3, 4, 0, 1]),
    ] {
        let width = grid.lines().next().unwrap().len();
        let mesh = laid(&patch(knit(chart(grid)), width, 4));
        let depth = fronts.len();
        let deep: Vec<usize> = (0..mesh.uv.len())
            .filter(|k| mesh.stack(*k).len() == depth + 1)
            .collect();
        // four nodes of each decrease: rows 0 and 2
        assert_eq!(deep.len(), 8, "{grid}");
        for node in &deep {
            let stack = mesh.stack(*node);
            let new = stack.iter().position(|s| s.group == 1).unwrap();
            assert!(new == 0 || new == depth);
            let inner = new == depth;
            // old strands by the wale from which their legs come: order of their feet
            let olds: Vec<u32> = stack
                .iter()
                .rev()
                .filter(|s| s.group == 0)
                .map(|s| s.incidence)
                .collect();
            let mut sorted = olds.clone();
            sorted.sort_unstable();
            // rows 0 and 2 hold the loops of courses that run to the right
            let order: Vec<usize> = olds
                .iter()
                .map(|i| sorted.iter().position(|k| k == i).unwrap())
                .collect();
            assert_eq!(order, fronts, "{grid} inner {inner}");
        }
        let contacts: Vec<_> = mesh
            .stitch_springs
            .iter()
            .filter(|s| {
                let node = mesh.incidences[s.incidences[0] as usize].node as usize;
                mesh.stack(node).len() == depth + 1
            })
            .collect();
        assert_eq!(contacts.len(), 4 * (depth + 1), "a spring for each strand");
        for wrap in &mesh.wraps {
            let groups = [0, 1].map(|end| {
                let at = strand(&mesh, wrap, end)[1];
                let node = mesh.incidences[at as usize].node as usize;
                mesh.stack(node)[rank(&mesh, at)].group
            });
            assert_ne!(groups[0], groups[1], "no wrap between parallel strands");
        }
    }
}

#[test]
fn a_yarn_over_opens_a_hole_and_an_increase_shares_its_head() {
    let plain = laid(&patch(knit(chart("....\n....")), 4, 4)).counts();
    let lace = laid(&patch(knit(chart("./o.\n....")), 4, 4)).counts();
    // rows 0 and 2 each have a foot less: four nodes and, in the decrease, the same passages
    assert_eq!(lace.nodes, plain.nodes - 2 * 4);
    assert_eq!(lace.stitch_springs, plain.stitch_springs - 2 * 4 + 2 * 2);
    let wide = laid(&once(chart("..v._\n....."), 5, 2)).counts();
    // rows of 5 feet, 5 feet and 5 bound off; the increase shares one head
    assert_eq!(wide.nodes, 4 * 15 + 2 * 3 + 2);
    let bar = laid(&once(chart("...._\n..m.."), 5, 2)).counts();
    assert_eq!(bar.nodes, 4 * (4 + 5 + 5) + 2 * 3 + 2);
    for grid in [".w.__\n.....", "_.v._\n_....", "oo/\\o\n....."] {
        laid(&once(chart(grid), 5, 2));
    }
    // the room between two feet in one head, and between two such heads
    let tight = laid(&once(chart("vv.v_____\n.vv...v__"), 10, 2));
    assert_no_short_segment(&tight, 0.05 * 3e-3);
    // yarn-overs at both edges
    laid(&patch(knit(chart("o/..\\o\n......")), 6, 6));
}

#[test]
fn every_chart_of_the_data_is_laid() {
    let Some(data) = data_dir() else { return };
    let mut random = Random::new(3);
    for entry in std::fs::read_dir(data.join("knit")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        let mesh = if name.starts_with("chart_") {
            let yarns = knit(chart(&text));
            laid(&garment(random_panel(&mut random, 0.2), yarns.clone()));
            laid(&patch(yarns, 40, 24))
        } else if name.starts_with("stitchgraph_") {
            laid(&once(Chart::from_worked(&text).unwrap(), 15, 20))
        } else {
            continue;
        };
        println!("{name}: {:?}", mesh.counts());
        assert_no_short_segment(&mesh, 0.09 * 3e-3);
        assert_eq!(mesh.yarn_count(), 1, "{name}");
        let deepest = (0..mesh.uv.len()).map(|k| mesh.stack(k).len()).max();
        let stacked = ["lace", "blue", "feather", "diamond"]
            .iter()
            .any(|n| name.contains(n));
        assert!(deepest >= Some(if stacked { 3 } else { 2 }), "{name}");
    }
}

#[test]
fn random_outlines_with_holes_are_knitted() {
    let mut random = Random::new(21);
    let grids = [
        ".",
        ".\n-",
        "..--",
        "o..../\\....o\n............",
        "oo5oo\n.....",
        "ov_^.\n.....",
        "w__/\\.\n......",
    ];
    for k in 0..40 {
        let size = 0.12 + 0.06 * random.signed().abs();
        let panel = random_panel(&mut random, size);
        let chart = chart(grids[k % grids.len()]);
        chart.check_repeat().unwrap();
        let garment = garment(panel, knit(chart));
        let mesh = laid(&garment);
        let w = 3e-3;
        assert!(mesh.yarn_count() > 10);
        for y in 0..mesh.yarn_count() {
            let yarn = mesh.yarn(y);
            let ends = [
                [yarn[0], yarn[1]],
                [yarn[yarn.len() - 1], yarn[yarn.len() - 2]],
            ];
            for [end, next] in ends {
                if mesh.stack(end.node as usize).len() == 1 {
                    assert!((end.u - next.u).abs() > 0.199 * w);
                }
            }
        }
        // every contact is whole: both of its nodes carry the same strands
        for s in &mesh.stitch_springs {
            let [a, b] = s
                .incidences
                .map(|k| mesh.incidences[k as usize].node as usize);
            assert_eq!(mesh.stack(a).len(), mesh.stack(b).len());
            assert!((u(&mesh, s.incidences[1]) - u(&mesh, s.incidences[0])) > 0.0);
        }
        for node in 0..mesh.uv.len() {
            let strands = mesh.stack(node).len();
            let held = mesh.stitch_springs.iter().any(|s| {
                s.incidences
                    .iter()
                    .any(|k| mesh.incidences[*k as usize].node as usize == node)
            });
            assert_eq!(strands > 1, held);
        }
    }
}

#[test]
fn pieces_that_do_not_fit_are_refused() {
    let small = garment(rectangle(Vec2::new(0.002, 0.05)), knit(stockinette()));
    let error = lay(&small, &Layout::default()).unwrap_err();
    assert_eq!(error.status, Status::Geometry);
    assert!(error.message.contains("'panel'") && error.message.contains("too small"));
    let lace = patch(knit(chart("o..../\\....o\n............")), 11, 5);
    let error = lay(&lace, &Layout::default()).unwrap_err().message;
    assert!(
        error.contains("12 loops") && error.contains("11"),
        "{error}"
    );
    let error = lay(&once(chart("....\n...."), 3, 5), &Layout::default())
        .unwrap_err()
        .message;
    assert!(
        error.contains("4 loops and 2 rows") && error.contains("3 loops across and 5 rows"),
        "{error}"
    );
    let huge = patch(knit(stockinette()), 40_000, 20_000);
    let error = lay(&huge, &Layout::default()).unwrap_err();
    assert_eq!(error.status, Status::Limit);
    assert!(error.message.contains("3.200e9"), "{error}");
}

#[test]
fn a_million_nodes_are_laid() {
    let garment = patch(knit(stockinette()), 500, 500);
    assert_eq!(
        knit_of(garment.fabrics[0].yarns.as_ref().unwrap()).loop_width,
        3e-3
    );
    let start = Instant::now();
    let mesh = lay(&garment, &Layout::default()).unwrap();
    let counts = mesh.counts();
    println!(
        "{} nodes in {:.2} s, {:.0} bytes a node",
        counts.nodes,
        start.elapsed().as_secs_f64(),
        counts.bytes as f64 / counts.nodes as f64
    );
    assert!(counts.nodes > 1_000_000);
    assert!(counts.bytes < 250 * counts.nodes);
}

#[test]
fn random_proportions_and_charts_are_laid() {
    let mut random = Random::new(8);
    let grids = [
        ".",
        "-.\n.-",
        "..--",
        "o..../\\....o\n............",
        "oo5oo\n.....",
        "o<o\n...",
        "ov_^.\n.....",
        "m.a.o\n.....",
        "u_pq.o.\n.......",
    ];
    for k in 0..90 {
        let mut yarns = knit(chart(grids[k % grids.len()]));
        let mut next = |low: f64, high: f64| low + (high - low) * 0.5 * (1.0 + random.signed());
        let (width, height) = (next(2e-3, 6e-3), next(0.45, 1.6));
        yarns.radius = width * next(0.05, 0.2249);
        if let Structure::Knitted(knit) = &mut yarns.structure {
            knit.loop_width = width;
            knit.loop_height = height * width;
        }
        let room = [next(15.0, 30.0) * width, next(8.0, 20.0) * width];
        let mut panel = rectangle(Vec2::new(room[0], room[1]));
        if k % 2 == 1 {
            panel = random_panel(&mut random, 30.0 * width);
        }
        let mesh = laid(&garment(panel, yarns));
        let held = mesh.stitch_springs.len();
        assert!(
            held > 100 && mesh.wraps.len() > held / 4,
            "{:?}",
            mesh.counts()
        );
        assert!(
            mesh.spacings
                .iter()
                .all(|s| s.least <= 0.95 * s.length * (1.0 + 1e-9))
        );
    }
}
