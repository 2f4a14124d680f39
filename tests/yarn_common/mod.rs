//! Panels and fabrics for the tests of yarn layouts, and laws that every layout keeps.

use crate::sheets::Random;
use toile::math::Vec2;
use toile::pattern::chart::Chart;
use toile::pattern::curve::Curve;
use toile::pattern::yarn_fabric::{Knit, Mask, Structure, Weave};
use toile::pattern::{Edge, Fabric, Garment, Panel, Placement, YarnFabric};
use toile::yarn::{Layout, YarnMesh, lay};

pub(crate) fn weave(mask: Mask, pitch: [f64; 2], radius: f64) -> YarnFabric {
    let weave = Weave {
        mask,
        warp_pitch: pitch[0],
        weft_pitch: pitch[1],
    };
    YarnFabric::new(Structure::Woven(weave), radius)
}

/// Loops 3 mm wide of a yarn of radius 0.75 mm.
pub(crate) fn knit(chart: Chart) -> YarnFabric {
    let knit = Knit {
        chart,
        once: false,
        loop_width: 3e-3,
        loop_height: 2.55e-3,
    };
    YarnFabric::new(Structure::Knitted(knit), 7.5e-4)
}

pub(crate) fn knit_of(fabric: &YarnFabric) -> &Knit {
    match &fabric.structure {
        Structure::Knitted(knit) => knit,
        Structure::Woven(_) => panic!("not a knit"),
    }
}

/// A ring of straight edges through these corners, added to the panel.
fn ring(panel: &mut Panel, corners: &[Vec2]) -> Vec<Edge> {
    let first = panel.vertices.len() as u32;
    let count = corners.len() as u32;
    panel.vertices.extend(corners);
    (0..count)
        .map(|k| Edge {
            start: first + k,
            end: first + (k + 1) % count,
            curve: Curve::Line,
            label: None,
        })
        .collect()
}

pub(crate) fn panel(outline: &[Vec2], holes: &[Vec<Vec2>]) -> Panel {
    let mut panel = Panel {
        name: "panel".into(),
        vertices: Vec::new(),
        outline: Vec::new(),
        holes: Vec::new(),
        placement: Placement::default(),
        fabric: 0,
        grain: 0.0,
        edge_length: None,
        label: None,
    };
    panel.outline = ring(&mut panel, outline);
    panel.holes = holes.iter().map(|hole| ring(&mut panel, hole)).collect();
    panel
}

pub(crate) fn rectangle(size: Vec2) -> Panel {
    let v = Vec2::new;
    panel(&[v(0.0, 0.0), v(size.x, 0.0), size, v(0.0, size.y)], &[])
}

/// A circle of four arcs about the origin.
pub(crate) fn circle(radius: f64) -> Panel {
    let v = |x: f64, y: f64| Vec2::new(radius * x, radius * y);
    let mut panel = panel(&[v(1.0, 0.0), v(0.0, 1.0), v(-1.0, 0.0), v(0.0, -1.0)], &[]);
    for edge in &mut panel.outline {
        edge.curve = Curve::Arc {
            radius,
            large: false,
            right: true,
        };
    }
    panel
}

/// A star-shaped outline with a star-shaped hole or two, about `size` across.
pub(crate) fn random_panel(random: &mut Random, size: f64) -> Panel {
    let mut star = |middle: Vec2, radius: f64, corners: usize| -> Vec<Vec2> {
        let phase = random.signed();
        (0..corners)
            .map(|k| {
                let angle = phase + std::f64::consts::TAU * k as f64 / corners as f64;
                let r = radius * (1.0 + 0.35 * random.signed());
                middle + Vec2::new(angle.cos(), angle.sin()) * r
            })
            .collect()
    };
    let mut outline = star(Vec2::new(0.3, -0.2), 0.5 * size, 11);
    let holes = vec![
        star(Vec2::new(0.3 + 0.1 * size, -0.2), 0.07 * size, 5),
        star(Vec2::new(0.3 - 0.13 * size, -0.2), 0.05 * size, 7),
    ];
    if random.signed() > 0.0 {
        outline.reverse();
    }
    let mut panel = panel(&outline, &holes);
    panel.grain = random.signed() * 3.0;
    panel
}

pub(crate) fn garment(panel: Panel, yarns: YarnFabric) -> Garment {
    let garment = Garment {
        name: "patch".into(),
        panels: vec![panel],
        fabrics: vec![Fabric {
            yarns: Some(yarns),
            ..Fabric::default()
        }],
        edge_length: 0.01,
        ..Garment::default()
    };
    garment.check_geometry().unwrap();
    garment
}

/// No segment of a finished patch is so short that it would collapse at once.
pub(crate) fn assert_no_short_segment(mesh: &YarnMesh, least: f64) {
    for y in 0..mesh.yarn_count() {
        for w in mesh.yarn(y).windows(2) {
            let du = w[1].u - w[0].u;
            assert!(du > least, "{du} m");
        }
    }
}

/// A finished patch of so many loops.
pub(crate) fn patch(yarns: YarnFabric, wales: usize, courses: usize) -> Garment {
    let size = knit_of(&yarns).size(wales, courses);
    garment(rectangle(size), yarns)
}

/// Lays a garment and checks everything that holds for every layout.
pub(crate) fn laid(garment: &Garment) -> YarnMesh {
    let mesh = lay(garment, &Layout::default()).unwrap();
    mesh.check_on(garment).unwrap();
    assert_eq!(mesh, lay(garment, &Layout::default()).unwrap());
    mesh
}

pub(crate) fn u(mesh: &YarnMesh, incidence: u32) -> f64 {
    mesh.incidences[incidence as usize].u
}
