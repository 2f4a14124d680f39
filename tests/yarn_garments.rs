//! Yarns of whole garments, tied at their seams.

use crate::common_data::data_dir;
use crate::yarn_common::{knit, laid, rectangle, weave};
use std::collections::{BTreeMap, BTreeSet};
use toile::error::Status;
use toile::math::Vec2;
use toile::pattern::chart::Chart;
use toile::pattern::import::garment_from_file;
use toile::pattern::yarn_fabric::Mask;
use toile::pattern::{EdgeRef, Fabric, Garment, Seam, YarnFabric};
use toile::readout::flat_yarns::flat_yarns_svg;
use toile::yarn::{Family, Layout, YarnMesh, lay};

/// Two panels beside each other; the right edge of the first is sewn to the left one of the second.
fn two(first: YarnFabric, second: YarnFabric, sizes: [Vec2; 2], same_direction: bool) -> Garment {
    let fabric = |name: &str, yarns: YarnFabric| Fabric {
        name: name.into(),
        yarns: Some(yarns),
        ..Fabric::default()
    };
    let mut panels = sizes.map(rectangle).to_vec();
    panels[0].name = "left".into();
    panels[1].name = "right".into();
    panels[1].fabric = 1;
    let garment = Garment {
        name: "two".into(),
        panels,
        seams: vec![Seam {
            a: EdgeRef { panel: 0, edge: 1 },
            b: EdgeRef { panel: 1, edge: 3 },
            same_direction,
            rest_angle: 0.0,
        }],
        fabrics: vec![fabric("a", first), fabric("b", second)],
        edge_length: 0.01,
        ..Garment::default()
    };
    garment.check().unwrap();
    garment
}

fn plain(pitch: f64, radius: f64) -> YarnFabric {
    weave(Mask::preset("plain").unwrap(), [pitch; 2], radius)
}

/// The yarn of a node of one yarn.
fn yarn_of(mesh: &YarnMesh, node: u32) -> usize {
    let incidence = mesh.stack(node as usize)[0].incidence;
    mesh.starts.partition_point(|s| *s <= incidence) - 1
}

/// Every tie holds a node at its own fraction of the seam, and the ties of a side make up its length.
fn check_seams(garment: &Garment, mesh: &YarnMesh) {
    // all panels are laid: rods stand last, one for each seam
    let first = mesh.yarn_count() - garment.seams.len();
    let mut lengths = vec![BTreeMap::<u32, f64>::new(); garment.seams.len()];
    for tie in &mesh.ties {
        let rod = yarn_of(mesh, tie.segment[0]);
        assert_eq!(mesh.yarn_family[rod], Family::Seam);
        let seam = &garment.seams[rod - first];
        let panel = mesh.node_panel[tie.node as usize];
        assert!(panel == seam.a.panel || panel == seam.b.panel);
        *lengths[rod - first].entry(panel).or_default() += tie.length;
        assert!(tie.length > 0.0);
        // along the first side the node lies at its point or close inside
        if panel == seam.a.panel && panel != seam.b.panel {
            let [a, b] = tie.segment.map(|n| mesh.uv[n as usize]);
            let gap = (a + (b - a) * tie.t - mesh.uv[tie.node as usize]).norm();
            let fabric = &garment.fabrics[garment.panels[panel as usize].fabric];
            let pitch = fabric.yarns.as_ref().unwrap().structure.pitch();
            assert!(gap < pitch[0].max(pitch[1]), "{gap}");
        }
    }
    for (k, (sides, seam)) in lengths.iter().zip(&garment.seams).enumerate() {
        let total = mesh.yarn(first + k).last().unwrap().u;
        for length in sides.values() {
            let dart = seam.a.panel == seam.b.panel;
            let edges = (length / total).round();
            assert!(edges == 1.0 || (dart && edges == 2.0));
            // a rod is a polygon, its seam a curve
            assert!((length / total - edges).abs() < 0.02 * edges);
        }
    }
}

#[test]
fn wefts_of_two_panels_meet_at_one_rod() {
    for same_direction in [false, true] {
        let size = Vec2::new(0.02, 0.03);
        let garment = two(
            plain(1e-3, 2e-4),
            plain(2e-3, 5e-4),
            [size; 2],
            same_direction,
        );
        let mesh = laid(&garment);
        check_seams(&garment, &mesh);
        assert_eq!(mesh.ties.len(), 30 + 15);
        let rod = mesh.yarn_count() - 1;
        // the coarser yarn
        assert_eq!(mesh.yarn_fabric[rod], 1);
        assert_eq!(mesh.yarn(rod).len(), 16);
        // height along the rod against height in the panel
        for tie in &mesh.ties {
            let [a, b] = tie.segment.map(|n| mesh.uv[n as usize]);
            let at = a + (b - a) * tie.t;
            let y = mesh.uv[tie.node as usize].y;
            let right = mesh.node_panel[tie.node as usize] == 1;
            // edge 1 runs up, edge 3 down
            let expected = if right && same_direction { 0.03 - y } else { y };
            assert!((at.y - expected).abs() < 1e-12 && (at.x - 0.02).abs() < 1e-12);
            assert!(
                mesh.stack(tie.node as usize)
                    .iter()
                    .all(|s| { !mesh.incidences[s.incidence as usize].slides })
            );
        }
    }
}

#[test]
fn a_knit_is_sewn_by_its_selvedges() {
    let rib = knit(Chart::preset("rib 2x2").unwrap());
    let size = crate::yarn_common::knit_of(&rib).size(12, 10);
    let garment = two(
        rib,
        plain(2e-3, 5e-4),
        [size, Vec2::new(0.02, size.y)],
        false,
    );
    let mesh = laid(&garment);
    check_seams(&garment, &mesh);
    let left = mesh
        .ties
        .iter()
        .filter(|t| mesh.node_panel[t.node as usize] == 0)
        .count();
    // turns at the right: after the cast-on and every second course, two nodes each
    assert_eq!(left, 12);
    // the rod is of the coarser yarn, the knit's
    assert_eq!(mesh.yarn_fabric[mesh.yarn_count() - 1], 0);
}

#[test]
fn panels_are_laid_by_choice() {
    let size = Vec2::new(0.02, 0.03);
    let mut garment = two(plain(1e-3, 2e-4), plain(2e-3, 5e-4), [size; 2], false);
    let only = |panels: &[u32], garment: &Garment| {
        lay(
            garment,
            &Layout {
                panels: Some(panels),
                ..Layout::default()
            },
        )
    };
    let right = only(&[1, 1], &garment).unwrap();
    right.check_on(&garment).unwrap();
    assert!(right.node_panel.iter().all(|p| *p == 1));
    assert_eq!(right.ties.len(), 15);
    // the rod runs along the only side that is laid: edge 3, down
    let rod = right.yarn(right.yarn_count() - 1);
    assert_eq!(right.uv[rod[0].node as usize], Vec2::new(0.0, 0.03));
    for tie in &right.ties {
        let [a, b] = tie.segment.map(|n| right.uv[n as usize]);
        let gap = a + (b - a) * tie.t - right.uv[tie.node as usize];
        assert!(gap.norm() < 1e-12);
    }
    assert!(only(&[], &garment).unwrap().uv.is_empty());
    assert_eq!(only(&[2], &garment).unwrap_err().status, Status::Argument);
    garment.fabrics[1].yarns = None;
    let error = only(&[1], &garment).unwrap_err();
    assert_eq!(error.status, Status::Material);
    assert!(error.message.contains("'right'"), "{error}");
    // panels without yarns are left out when nobody asks for them
    let rest = lay(&garment, &Layout::default()).unwrap();
    assert!(rest.node_panel.iter().all(|p| *p == 0) && rest.ties.len() == 30);
}

#[test]
fn real_garments_are_laid_and_every_end_at_a_seam_is_tied() {
    let Some(data) = data_dir() else { return };
    for name in ["gen_tshirt", "dress_pencil", "shirt_mean"] {
        let path = data.join(format!("garmentcode/{name}_specification.json"));
        let (mut garment, _) = garment_from_file(&path).unwrap();
        for yarns in [plain(5e-3, 1.5e-3), YarnFabric::preset("pullover").unwrap()] {
            for fabric in &mut garment.fabrics {
                fabric.yarns = Some(yarns.clone());
            }
            let mesh = laid(&garment);
            println!("{name}: {:?}", mesh.counts());
            check_seams(&garment, &mesh);
            // seams that end on an edge, by panel
            let mut sewn = BTreeSet::new();
            for seam in &garment.seams {
                sewn.extend([seam.a, seam.b].map(|side| (side.panel, side.edge)));
            }
            let tied: BTreeSet<u32> = mesh.ties.iter().map(|t| t.node).collect();
            let mut edges: Vec<Vec<Vec<Vec2>>> = Vec::new();
            for panel in &garment.panels {
                let segments = panel.segments().unwrap();
                edges.push(segments.iter().map(|s| s.sample(200)).collect());
            }
            let distance = |p: Vec2, line: &[Vec2]| {
                line.windows(2)
                    .map(|w| toile::pattern::outline::point_distance(p, w[0], w[1]))
                    .fold(f64::INFINITY, f64::min)
            };
            let mut ends = [0, 0];
            for y in 0..mesh.yarn_count() {
                let yarn = mesh.yarn(y);
                for end in [yarn[0], yarn[yarn.len() - 1]] {
                    let panel = mesh.node_panel[end.node as usize];
                    let p = mesh.uv[end.node as usize];
                    let on = |e: &usize| distance(p, &edges[panel as usize][*e]) < 1e-4;
                    let near: Vec<usize> = (0..edges[panel as usize].len()).filter(on).collect();
                    if let [edge] = near[..]
                        && mesh.yarn_family[y] != Family::Seam
                    {
                        let should = sewn.contains(&(panel, edge as u32));
                        assert_eq!(should, tied.contains(&end.node));
                        ends[usize::from(should)] += 1;
                    }
                }
            }
            println!("{} ends are tied, {} are free", ends[1], ends[0]);
            assert!(ends[1] > 100 && ends[0] > 10);
        }
    }
}

#[test]
fn flat_yarns_are_drawn() {
    let size = Vec2::new(0.02, 0.03);
    let garment = two(plain(1e-3, 2e-4), plain(2e-3, 5e-4), [size; 2], false);
    let mesh = laid(&garment);
    let svg = flat_yarns_svg(&garment, &mesh).unwrap();
    let mut reader = quick_xml::Reader::from_str(&svg);
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    loop {
        match reader.read_event().unwrap() {
            quick_xml::events::Event::Empty(tag) => {
                let name = tag.name().as_ref().to_owned();
                *counts.entry(name).or_default() += 1;
            }
            quick_xml::events::Event::Eof => break,
            _ => {}
        }
    }
    // a stroke for every passage, one more under each that lies in front
    let crossings = 20 * 30 + 10 * 15;
    assert_eq!(counts["path"], mesh.incidences.len() + crossings);
    assert_eq!(counts["circle"], mesh.uv.len() - crossings);
    let mut wrong = mesh.clone();
    wrong.uv[0].x += 1.0;
    assert!(flat_yarns_svg(&garment, &wrong).is_err());
}
