//! Nodes along the edges of panels: whatever gap a knitted piece leaves, an edge holds the piece's border there.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::yarn_sims::{WHOLE, patch, sim};
use toile::math::Vec2;
use toile::pattern::import::garment_from_json;
use toile::sim::{Sim, SimOptions};
use toile::sim_scene;

/// Loop width and height of the jersey [m].
const LOOP: [f64; 2] = [0.003, 0.0027];
const LACE: &str = r#"{"chart": ["++++++++", "........", ".o\\../o.", "........", "xxxxxxxx"], "once": true,
    "loop_width": 0.004, "radius": 0.0008}"#;

fn places(sim: &Sim, nodes: &[u32]) -> Vec<Vec2> {
    let mesh = sim.yarns().unwrap();
    nodes.iter().map(|n| mesh.uv[*n as usize]).collect()
}

/// How far a place is out along a direction, and where it is across it [m].
fn seen(p: &Vec2, out: Vec2) -> [f64; 2] {
    [p.dot(&out), out.x * p.y - out.y * p.x]
}

/// Checks the nodes of one side of a rectangular piece: they reach over the whole side without a gap wider than `gap` [m], no
/// node is farther out than they are there, and none lies deeper in the piece than `depth` [m].
fn check_side(sim: &Sim, edge: u32, out: Vec2, gap: f64, depth: f64) {
    let nodes = sim.yarn_nodes_along(0, edge).unwrap();
    let own: Vec<[f64; 2]> = (places(sim, &nodes).iter()).map(|p| seen(p, out)).collect();
    let all: Vec<[f64; 2]> = (sim.yarns().unwrap().uv.iter())
        .map(|p| seen(p, out))
        .collect();
    let furthest = |list: &[[f64; 2]], k: usize| list.iter().fold(f64::MIN, |m, p| m.max(p[k]));
    let least = |list: &[[f64; 2]], k: usize| list.iter().fold(f64::MAX, |m, p| m.min(p[k]));
    assert_eq!(furthest(&own, 0), furthest(&all, 0), "edge {edge}");
    assert!(least(&own, 0) > furthest(&all, 0) - depth, "edge {edge}");
    let mut across: Vec<f64> = own.iter().map(|p| p[1]).collect();
    across.sort_by(f64::total_cmp);
    let widest = across.windows(2).fold(0.0_f64, |m, w| m.max(w[1] - w[0]));
    assert!(widest < gap, "edge {edge}: a gap of {widest} m");
    assert!(across[0] - least(&all, 1) < gap, "edge {edge}");
    assert!(
        furthest(&all, 1) - across[across.len() - 1] < gap,
        "edge {edge}"
    );
}

fn check_rectangle(sim: &Sim, [width, height]: [f64; 2]) {
    let depth = 0.75 * width;
    check_side(sim, 0, -Vec2::y(), 1.1 * width, depth);
    check_side(sim, 1, Vec2::x(), 1.1 * height, depth);
    check_side(sim, 2, Vec2::y(), 1.1 * width, depth);
    check_side(sim, 3, -Vec2::x(), 1.1 * height, depth);
}

/// Panels of many sizes, of whole numbers of loops and of others: each edge has its side of the piece.
#[test]
fn every_edge_holds_its_side_of_the_piece() {
    for [w, h] in [
        [0.0192, 0.0171],
        [0.03, 0.03],
        [0.031, 0.0287],
        [0.05, 0.04],
        [0.06, 0.06],
        [0.045, 0.052],
    ] {
        let jersey = patch(r#"{"preset": "jersey"}"#, w, h, WHOLE);
        check_rectangle(&sim(&jersey, 0.0, &[]), LOOP);
    }
}

/// A chart that is used once in a panel twice as wide and high lies far from every edge.
#[test]
fn edges_hold_a_piece_that_is_smaller_than_its_panel() {
    let lace = sim(&patch(LACE, 0.07, 0.06, WHOLE), 0.0, &[]);
    let low = (lace.yarns().unwrap().uv.iter()).fold(f64::MAX, |m, p| m.min(p.x));
    assert!(low > 0.01, "{low}");
    // yarn-overs leave holes in the row below the bind-off, no side is open for more than two loops
    check_rectangle(&lace, [0.004, 0.0036]);
}

/// A weave in an L: its ends along an edge are the nodes there, whatever is behind the notch.
#[test]
fn an_edge_in_a_notch_holds_what_lies_along_it_alone() {
    let text = format!(
        r#"{{"toile_garment": 1, "name": "L", "edge_length": 0.006,
            "panels": [{{"name": "p", "fabric": "y",
                "vertices": [[0, 0], [0.03, 0], [0.03, 0.01], [0.012, 0.01], [0.01, 0.03], [0, 0.03]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0]]}}],
            "fabrics": [{{"name": "y", "yarns": {{"weave": "plain", "warp_pitch": 0.002, "radius": 0.0005}}}}],
            "blend_regions": [{{"panel": "p", "polygon": {WHOLE}}}]}}"#
    );
    let weave = sim(&text, 0.0, &[]);
    let corners = [[0.012, 0.01], [0.01, 0.03]].map(Vec2::from);
    let way = (corners[1] - corners[0]).normalize();
    let nodes = weave.yarn_nodes_along(0, 3).unwrap();
    // wefts every 2 mm end on the slanted edge of 20 mm
    assert!(nodes.len() >= 9, "{nodes:?}");
    for p in places(&weave, &nodes) {
        let r = p - corners[0];
        let off = (r - way * r.dot(&way)).norm();
        assert!(off < 0.0009, "{p} is {off} m off");
    }
}

fn chipped(chip: f64) -> String {
    patch(r#"{"preset": "jersey"}"#, 0.05, 0.04, WHOLE)
        .replace(
            "[[0, 0], ",
            &format!("[[0, 0], [{chip}, 0], [{}, 0], ", chip + 2e-5),
        )
        .replace(
            "[[0, 1], [1, 2], [2, 3], [3, 0]]",
            "[[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0]]",
        )
}

/// An edge too short to have a node before it is refused as a pin; it would let the cloth fall.
#[test]
fn a_pin_whose_edge_holds_nothing_is_refused() {
    // vertices follow yarns, and no loop ends within 20 um
    let garment = chipped(0.0251);
    let nodes = sim(&garment, 0.0, &[]).yarn_nodes_along(0, 1).unwrap();
    assert!(nodes.is_empty(), "{nodes:?}");
    let scene = |edge: u32| {
        format!(
            r#"{{"toile": 1, "garment": {garment}, "pins": [{{"panel": "p", "edge": {edge}}}]}}"#
        )
    };
    sim_scene::sim_from_json(&scene(0), None).expect("a pin along a whole edge");
    let error = sim_scene::sim_from_json(&scene(1), None).err().unwrap();
    assert!(error.message.contains("pins[0]"), "{}", error.message);
    assert!(error.message.contains("holds nothing"), "{}", error.message);
}

/// Triangles alone have no nodes along an edge, and an edge that is not there is refused.
#[test]
fn edges_without_yarns_have_no_nodes() {
    let text = patch(r#"{"preset": "jersey"}"#, 0.03, 0.03, WHOLE);
    let cut = text.find("\"blend_regions\"").unwrap();
    let bare = format!("{}}}", text[..cut].trim_end().trim_end_matches(','));
    let garment = garment_from_json(&bare, None).unwrap();
    let bare = Sim::new(&garment, &SimOptions::default()).unwrap();
    assert!(bare.yarn_nodes_along(0, 2).unwrap().is_empty());
    let error = bare.yarn_nodes_along(0, 4).unwrap_err();
    assert!(error.message.contains("no edge 4"), "{}", error.message);
}
