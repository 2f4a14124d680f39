//! Laws that every garment mesh keeps.

use std::f64::consts::PI;
use toile::math::topology::edges;
use toile::math::{Vec2, Vec3};
use toile::pattern::Garment;
use toile::tri::quality::hinges;
use toile::tri::{GarmentMesh, Transfer};

fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Fractions of length along a chain of vertices, by chords.
fn fractions(mesh: &GarmentMesh, chain: &[u32]) -> Vec<f64> {
    let mut list = vec![0.0];
    for w in chain.windows(2) {
        let step = (mesh.uv[w[1] as usize] - mesh.uv[w[0] as usize]).norm();
        list.push(list[list.len() - 1] + step);
    }
    let total = list[list.len() - 1];
    list.iter().map(|x| x / total).collect()
}

/// Area, orientation, topology, placement, boundary and seams of a mesh.
pub(crate) fn check_mesh(garment: &Garment, mesh: &GarmentMesh) {
    let panels = garment.panels.len();
    assert_eq!(mesh.panel_starts.len(), panels + 1);
    assert_eq!(mesh.uv.len(), mesh.placed.len());
    let mut area = vec![0.0; panels];
    for (t, panel) in mesh.triangles.iter().zip(&mesh.triangle_panel) {
        let [a, b, c] = t.map(|v| mesh.uv[v as usize]);
        let signed = 0.5 * cross(b - a, c - a);
        let loop_area = garment.panels[*panel as usize]
            .signed_outline_area()
            .unwrap();
        assert!(signed * loop_area > 0.0, "triangle against its loop");
        area[*panel as usize] += signed.abs();
        assert!(t.iter().all(|v| mesh.vertex_panel[*v as usize] == *panel));
    }
    for (k, panel) in garment.panels.iter().enumerate() {
        let range = mesh.panel_starts[k]..mesh.panel_starts[k + 1];
        for v in range {
            assert_eq!(mesh.vertex_panel[v as usize] as usize, k);
            let placed = panel.placement.apply(&mesh.uv[v as usize]);
            assert_eq!(placed, mesh.placed[v as usize]);
        }
        // the polygon through the boundary vertices, exactly; the outline up to its sagittas
        let mut polygon = 0.0;
        let mut sagitta = 0.0;
        let segments = panel.segments().unwrap();
        for (ring, range) in panel.loops().into_iter().enumerate() {
            let part: f64 = range
                .clone()
                .flat_map(|e| mesh.edge_vertices[k][e].windows(2))
                .map(|w| 0.5 * cross(mesh.uv[w[0] as usize], mesh.uv[w[1] as usize]))
                .sum();
            polygon += if ring == 0 { part.abs() } else { -part.abs() };
            for e in range {
                let chain = &mesh.edge_vertices[k][e];
                assert_eq!(mesh.uv[chain[0] as usize], segments[e].start);
                assert_eq!(mesh.uv[chain[chain.len() - 1] as usize], segments[e].end);
                for w in chain.windows(2) {
                    let chord = (mesh.uv[w[1] as usize] - mesh.uv[w[0] as usize]).norm();
                    // a piece turning by 45 degrees stands off its chord by a tenth at most
                    if segments[e].turning() > 0.0 {
                        sagitta += 0.1 * chord * chord;
                    }
                }
            }
        }
        assert!(
            (area[k] / polygon - 1.0).abs() < 1e-9,
            "{} {polygon}",
            area[k]
        );
        let exact = panel.area().unwrap();
        assert!((area[k] - exact).abs() <= 1e-9 * exact + sagitta);
    }
    // each panel is a disc with holes: V - E + F = 1 - holes
    let all = edges(&mesh.triangles);
    let holes: i64 = garment.panels.iter().map(|p| p.holes.len() as i64).sum();
    let euler = mesh.uv.len() as i64 - all.len() as i64 + mesh.triangles.len() as i64;
    assert_eq!(euler, panels as i64 - holes);
    let boundary: usize = mesh
        .edge_vertices
        .iter()
        .flatten()
        .map(|chain| chain.len() - 1)
        .sum();
    assert_eq!(all.len() - hinges(mesh).len(), boundary);
    assert!(mesh.min_angle > 0.0 && mesh.min_angle <= PI / 3.0 + 1e-12);
    check_seams(garment, mesh);
}

fn check_seams(garment: &Garment, mesh: &GarmentMesh) {
    assert_eq!(mesh.seams.len(), garment.seams.len());
    for (seam, ties) in garment.seams.iter().zip(&mesh.seams) {
        let side = |e: toile::pattern::EdgeRef| {
            let panel = &garment.panels[e.panel as usize];
            let length = panel.segments().unwrap()[e.edge as usize].length();
            (
                &mesh.edge_vertices[e.panel as usize][e.edge as usize],
                length,
            )
        };
        let ((a, length_a), (b, length_b)) = (side(seam.a), side(seam.b));
        assert_eq!(a.len(), b.len());
        let sum: f64 = ties.links.iter().map(|l| l.length).sum();
        assert!((sum - 0.5 * (length_a + length_b)).abs() < 1e-9);
        let (fa, mut fb) = (fractions(mesh, a), fractions(mesh, b));
        let mut b = b.clone();
        if !seam.same_direction {
            b.reverse();
            fb = fb.iter().rev().map(|x| 1.0 - x).collect();
        }
        let shared = a.iter().zip(&b).filter(|(x, y)| x == y).count();
        assert_eq!(ties.links.len(), a.len() - shared);
        for link in &ties.links {
            let k = a.iter().position(|v| *v == link.vertex).unwrap();
            assert!(link.t == 0.0 || link.t == 1.0);
            let met = link.edge[usize::from(link.t == 1.0)];
            let other = link.edge[usize::from(link.t != 1.0)];
            assert_eq!(met, b[k]);
            assert!(b.windows(2).any(|w| w == [met, other] || w == [other, met]));
            // chords of unlike curves differ a little from arcs
            assert!((fa[k] - fb[k]).abs() < 0.02, "{} {}", fa[k], fb[k]);
            assert!(link.length > 0.0);
        }
    }
}

/// A field linear on every panel is carried exactly, and seam vertices stay together.
pub(crate) fn check_transfer(garment: &Garment, coarse: &GarmentMesh, fine: &GarmentMesh) {
    let transfer = Transfer::new(coarse, fine).unwrap();
    let carried = transfer.apply(&coarse.triangles, &coarse.placed);
    for (p, q) in carried.iter().zip(&fine.placed) {
        assert!((p - q).norm() < 1e-10, "{p} {q}");
    }
    for (t, v) in transfer.triangle.iter().zip(0..) {
        assert_eq!(
            coarse.triangle_panel[*t as usize],
            fine.vertex_panel[v as usize]
        );
    }
    // weights sum to one, and reach outside by no more than a curve stands off its chord
    for w in &transfer.weights {
        assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(w.iter().all(|x| (-0.5..1.5).contains(x)), "{w:?}");
    }
    let sewn: Vec<Vec3> = transfer.apply(&coarse.triangles, &vec![Vec3::x(); coarse.uv.len()]);
    assert!(sewn.iter().all(|p| (p - Vec3::x()).norm() < 1e-12));
    assert_eq!(garment.panels.len() + 1, fine.panel_starts.len());
}
