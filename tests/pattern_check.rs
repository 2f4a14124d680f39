//! Every refusal names its place and value.

use toile::math::Vec2;
use toile::pattern::curve::Curve;
use toile::pattern::{BlendRegion, Edge, EdgeRef, Fabric, Garment, Seam, Shape};
use toile::tri::grid::{rectangle, sheet_garment};

fn base() -> Garment {
    let mut garment = sheet_garment(0.4, 0.3, 0.02, Fabric::default());
    garment.panels.push(rectangle("second", 0.2, 0.2));
    garment.seams.push(Seam {
        a: EdgeRef { panel: 0, edge: 1 },
        b: EdgeRef { panel: 1, edge: 3 },
        same_direction: false,
        rest_angle: 0.0,
    });
    garment
}

fn edge(start: u32, end: u32, curve: Curve) -> Edge {
    Edge {
        start,
        end,
        curve,
        label: None,
    }
}

/// Adds a hole of straight edges to panel 0.
fn hole(garment: &mut Garment, points: &[[f64; 2]]) {
    let panel = &mut garment.panels[0];
    let first = panel.vertices.len() as u32;
    let n = points.len() as u32;
    panel
        .vertices
        .extend(points.iter().map(|p| Vec2::new(p[0], p[1])));
    let ring = (0..n).map(|k| edge(first + k, first + (k + 1) % n, Curve::Line));
    panel.holes.push(ring.collect());
}

fn refused(change: impl FnOnce(&mut Garment), words: &[&str]) {
    let mut garment = base();
    garment.check().unwrap();
    change(&mut garment);
    let error = garment.check().unwrap_err();
    for word in words {
        assert!(error.message.contains(word), "{error} lacks {word:?}");
    }
    // what check refuses, triangulation refuses too
    assert!(toile::tri::triangulate(&garment, 1.0, 100_000).is_err());
}

#[test]
fn indices_out_of_range_are_refused() {
    refused(
        |g| g.panels[0].outline[2].end = 9,
        &["panel 'sheet'", "edge 2", "corner 9 of 4"],
    );
    refused(
        |g| g.panels[1].fabric = 3,
        &["panel 'second'", "fabric 3 of 1"],
    );
    refused(
        |g| g.seams[0].b.panel = 7,
        &["seam 0 side b", "panel 7 of 2"],
    );
    refused(
        |g| g.seams[0].a.edge = 4,
        &["seam 0 side a", "edge 4", "'sheet'"],
    );
}

#[test]
fn empty_and_ambiguous_garments_are_refused() {
    refused(|g| g.panels.clear(), &["no panels"]);
    refused(|g| g.fabrics.clear(), &["no fabrics"]);
    refused(
        |g| {
            g.seams.clear();
            g.panels[0].outline.clear();
        },
        &["panel 'sheet'", "outline has no edges"],
    );
    refused(|g| g.panels[0].holes.push(vec![]), &["hole 0 has no edges"]);
    refused(
        |g| g.panels[1].name = "sheet".into(),
        &["panels 0 and 1", "'sheet'"],
    );
    refused(|g| g.fabrics.push(Fabric::default()), &["fabrics 0 and 1"]);
}

#[test]
fn open_loops_are_refused() {
    refused(
        |g| {
            g.panels[0].outline.remove(1);
        },
        &[
            "panel 'sheet'",
            "outline is open",
            "edge 0 ends in corner 1",
        ],
    );
}

#[test]
fn numbers_that_cannot_be_are_refused() {
    refused(
        |g| g.panels[0].vertices[1].x = f64::NAN,
        &["vertex 1", "NaN"],
    );
    refused(
        |g| g.panels[0].vertices[1].y = 2e4,
        &["vertex 1", "20000", "10000"],
    );
    refused(|g| g.panels[0].grain = f64::INFINITY, &["grain"]);
    refused(
        |g| g.panels[0].placement.translation.z = f64::NAN,
        &["translation[2]"],
    );
    refused(
        |g| g.seams[0].rest_angle = f64::NAN,
        &["seam 0", "rest angle"],
    );
    refused(|g| g.edge_length = 0.0, &["edge length 0"]);
    refused(|g| g.edge_length = f64::NAN, &["edge length NaN"]);
    refused(
        |g| g.panels[1].edge_length = Some(-0.1),
        &["panel 'second'", "-0.1"],
    );
    refused(
        |g| g.edge_length = 1e-6,
        &["edge length of 0.000001", "limit"],
    );
    refused(|g| g.edge_length = 1e-200, &["limit"]);
    refused(
        |g| g.panels[0].outline[0].curve = Curve::Quadratic(Vec2::new(f64::NAN, 0.0)),
        &["edge 0", "NaN"],
    );
    refused(|g| g.fabrics[0].density = -1.0, &["density"]);
}

#[test]
fn degenerate_shapes_are_refused() {
    refused(
        |g| {
            let copy = g.panels[0].vertices[1];
            g.panels[0].vertices[2] = copy;
        },
        &["panel 'sheet'", "edge 1", "length 0"],
    );
    refused(
        |g| {
            for p in &mut g.panels[0].vertices {
                p.y = 0.0;
            }
        },
        &["panel 'sheet'"],
    );
    refused(
        |g| {
            let panel = &mut g.panels[0];
            panel.outline = vec![edge(0, 1, Curve::Line), edge(1, 0, Curve::Line)];
            g.seams.clear();
        },
        &["area 0"],
    );
    let arc = |radius| Curve::Arc {
        radius,
        large: false,
        right: true,
    };
    refused(
        |g| g.panels[0].outline[0].curve = arc(0.19),
        &["edge 0", "radius 0.19", "half the chord"],
    );
    refused(|g| g.panels[0].outline[0].curve = arc(-1.0), &["radius -1"]);
    refused(
        |g| g.panels[0].outline[0] = edge(0, 0, arc(0.1)),
        &["outline is open"],
    );
}

#[test]
fn outlines_that_cross_touch_or_fold_are_refused() {
    refused(
        |g| g.panels[0].vertices[0] = Vec2::new(0.45, 0.2),
        &["cross or touch", "edges"],
    );
    refused(
        |g| g.panels[0].outline[0].curve = Curve::Quadratic(Vec2::new(0.2, 0.8)),
        &["edges 0 and", "cross or touch"],
    );
    refused(
        |g| {
            let far = [Vec2::new(0.9, -0.3), Vec2::new(-0.5, -0.3)];
            g.panels[0].outline[0].curve = Curve::Cubic(far[0], far[1]);
        },
        &["edge 0 crosses or touches itself"],
    );
    // an edge that returns along its neighbour
    refused(
        |g| {
            let panel = &mut g.panels[0];
            panel.vertices.push(Vec2::new(0.2, 0.0));
            panel.outline = vec![
                edge(0, 1, Curve::Line),
                edge(1, 4, Curve::Line),
                edge(4, 2, Curve::Line),
                edge(2, 3, Curve::Line),
                edge(3, 0, Curve::Line),
            ];
        },
        &["cross or touch"],
    );
}

#[test]
fn holes_outside_crossing_or_nested_are_refused() {
    refused(
        |g| hole(g, &[[0.5, 0.1], [0.6, 0.1], [0.6, 0.2]]),
        &["hole 0 lies outside the outline"],
    );
    refused(
        |g| hole(g, &[[0.3, 0.1], [0.6, 0.1], [0.6, 0.2]]),
        &["outline and hole 0 cross or touch"],
    );
    refused(
        |g| {
            hole(g, &[[0.1, 0.1], [0.3, 0.1], [0.3, 0.2], [0.1, 0.2]]);
            hole(g, &[[0.15, 0.12], [0.2, 0.12], [0.2, 0.15]]);
        },
        &["hole 1 lies inside hole 0"],
    );
    refused(
        |g| {
            hole(g, &[[0.1, 0.1], [0.3, 0.1], [0.3, 0.2], [0.1, 0.2]]);
            hole(g, &[[0.25, 0.12], [0.35, 0.12], [0.35, 0.15]]);
        },
        &["hole 0 and hole 1 cross or touch"],
    );
}

#[test]
fn edges_sewn_twice_and_overlapping_darts_are_refused() {
    refused(
        |g| {
            let first = g.seams[0];
            g.seams.push(first);
        },
        &["edge 1 of panel 'sheet'", "seams 0 and 1"],
    );
    refused(|g| g.seams[0].b = g.seams[0].a, &["seam 0", "to itself"]);
    refused(
        |g| {
            let panel = &mut g.panels[0];
            // two darts from the top edge whose tips pass each other
            for p in [
                [0.25, 0.3],
                [0.12, 0.1],
                [0.2, 0.3],
                [0.18, 0.3],
                [0.22, 0.1],
                [0.1, 0.3],
            ] {
                panel.vertices.push(Vec2::new(p[0], p[1]));
            }
            let chain = [0, 1, 2, 4, 5, 6, 7, 8, 9, 3];
            panel.outline = (0..chain.len())
                .map(|k| edge(chain[k], chain[(k + 1) % chain.len()], Curve::Line))
                .collect();
            for first in [3, 6] {
                g.seams.push(Seam {
                    a: EdgeRef {
                        panel: 0,
                        edge: first,
                    },
                    b: EdgeRef {
                        panel: 0,
                        edge: first + 1,
                    },
                    same_direction: false,
                    rest_angle: 0.0,
                });
            }
        },
        &["panel 'sheet'", "darts of seams", "overlap"],
    );
}

#[test]
fn blend_regions_are_checked() {
    let region = |panel, count: usize| BlendRegion {
        panel,
        shape: Shape::Polygon(vec![Vec2::new(0.1, 0.1); count]),
        rings: 2,
    };
    refused(
        |g| g.blend_regions.push(region(5, 3)),
        &["blend_regions[0]", "panel 5 of 2"],
    );
    refused(
        |g| g.blend_regions.push(region(0, 2)),
        &["blend_regions[0]", "2 corners"],
    );
    refused(
        |g| {
            g.blend_regions.push(BlendRegion {
                rings: 4,
                ..region(0, 3)
            });
        },
        &["blend_regions[0]", "4 hybrid rings, at most 3"],
    );
}
