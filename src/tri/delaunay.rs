//! Constrained Delaunay triangulation of every panel, refined to the target edge length.
//!
//! The outline is cut first (see [`super::boundary`]) and kept as cut, so that seams match. Inside, a
//! hexagonal lattice of the target length, turned with the warp, seeds nearly equilateral triangles;
//! refinement (Ruppert, Chew; crate spade) then inserts circumcentres until no angle is below 30
//! degrees and no triangle larger than the lattice allows. Angles that the outline itself makes, and
//! triangles pinched between two pieces of it, stay as they are. Where refinement does not end, the
//! angle limit is lowered in steps, and the mesh says so; a mesh whose area differs from its polygon's is refused.

use super::boundary::edge_fractions;
use super::seam::{Side, link};
use super::{GarmentMesh, LoweredAngle, SeamMesh, quality};
use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::curve::Segment;
use crate::pattern::outline::point_distance;
use crate::pattern::{Garment, Panel};
use spade::{
    AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation,
};

/// Angle limits tried one after the other [degrees].
const ANGLES: [f64; 5] = [30.0, 25.0, 20.0, 10.0, 0.0];
/// Largest triangle, in squares of the target length; an equilateral one has 0.433.
const MAX_AREA: f64 = 0.65;
/// Distance that lattice points keep from the outline, in target lengths.
const CLEARANCE: f64 = 0.65;
/// Times a panel's outline is cut finer before it is refused.
const RETRIES: usize = 4;

/// Mesh of one panel in flat coordinates.
struct PanelMesh {
    uv: Vec<Vec2>,
    /// Counter-clockwise in the plane.
    triangles: Vec<[u32; 3]>,
    /// Vertices along each edge.
    edges: Vec<Vec<u32>>,
    /// Angle limit that refinement ended with [degrees].
    angle_limit: f64,
}

/// Why a panel could not be meshed as cut.
enum Failure {
    /// The cut outline crosses itself: cut it finer.
    Outline(Error),
    /// Anything else.
    Final(Error),
}

/// Triangulates a garment; `edge_length_scale` multiplies all target lengths (above 1 for coarse
/// levels). Refuses what `Garment::check_geometry` refuses and more than `max_vertices` vertices.
pub fn triangulate(
    garment: &Garment,
    edge_length_scale: f64,
    max_vertices: usize,
) -> Result<GarmentMesh> {
    if !edge_length_scale.is_finite() || edge_length_scale <= 0.0 {
        return Err(Error::argument(format!(
            "edge length scale {edge_length_scale} must be finite and positive"
        )));
    }
    garment.check_geometry()?;
    // u32 indices, and room for a margin above the estimate
    let max_vertices = max_vertices.min(u32::MAX as usize / 2);
    garment.check_vertices(edge_length_scale, max_vertices)?;
    let segments: Vec<Vec<Segment>> = garment
        .panels
        .iter()
        .map(Panel::segments)
        .collect::<Result<_>>()?;
    let targets: Vec<f64> = garment
        .panels
        .iter()
        .map(|panel| edge_length_scale * garment.panel_edge_length(panel))
        .collect();
    // outlines may need finer cuts than the cloth: these shrink on a retry
    let mut cuts = targets.clone();
    let mut fractions = edge_fractions(garment, &segments, &cuts, max_vertices)?;
    let mut meshes: Vec<Option<PanelMesh>> = garment.panels.iter().map(|_| None).collect();
    let mut retries = vec![0; garment.panels.len()];
    let mut next = 0;
    while let Some(panel) = garment.panels.get(next) {
        if meshes[next].is_some() {
            next += 1;
            continue;
        }
        let place = |e: Error| e.at(format!("panel '{}'", panel.name));
        let h = targets[next];
        match mesh_panel(panel, &segments[next], &fractions[next], h, max_vertices) {
            Ok(mesh) => meshes[next] = Some(mesh),
            Err(Failure::Final(error)) => return Err(place(error)),
            Err(Failure::Outline(error)) => {
                retries[next] += 1;
                if retries[next] > RETRIES {
                    return Err(place(error));
                }
                cuts[next] *= 0.5;
                let finer = edge_fractions(garment, &segments, &cuts, max_vertices)?;
                // seams carry the new cuts to panels already meshed: mesh those again
                for (k, mesh) in meshes.iter_mut().enumerate() {
                    if finer[k] != fractions[k] {
                        *mesh = None;
                    }
                }
                fractions = finer;
                next = 0;
            }
        }
    }
    let meshes: Vec<PanelMesh> = meshes.into_iter().flatten().collect();
    join(garment, &segments, &fractions, meshes, max_vertices)
}

/// Puts the panels' meshes after one another, orients, places and sews them.
fn join(
    garment: &Garment,
    segments: &[Vec<Segment>],
    fractions: &[Vec<Vec<f64>>],
    meshes: Vec<PanelMesh>,
    max_vertices: usize,
) -> Result<GarmentMesh> {
    let total: usize = meshes.iter().map(|m| m.uv.len()).sum();
    if total > max_vertices {
        return Err(Error::limit(format!(
            "{}: {total} vertices, limit {max_vertices}",
            garment.title()
        )));
    }
    let mut mesh = GarmentMesh {
        panel_starts: vec![0],
        ..GarmentMesh::default()
    };
    for (k, (panel, part)) in garment.panels.iter().zip(meshes).enumerate() {
        let first = mesh.uv.len() as u32;
        let clockwise = panel.signed_outline_area()? < 0.0;
        for uv in &part.uv {
            mesh.placed.push(panel.placement.apply(uv));
            mesh.vertex_panel.push(k as u32);
        }
        if part.angle_limit < ANGLES[0] {
            mesh.lowered.push(LoweredAngle {
                panel: k as u32,
                asked: ANGLES[0].to_radians(),
                kept: part.angle_limit.to_radians(),
            });
        }
        mesh.uv.extend(part.uv);
        for [a, b, c] in part.triangles {
            let [a, b, c] = [first + a, first + b, first + c];
            // a clockwise loop is seen from behind the plane
            mesh.triangles
                .push(if clockwise { [a, c, b] } else { [a, b, c] });
            mesh.triangle_panel.push(k as u32);
        }
        mesh.edge_vertices.push(
            part.edges
                .into_iter()
                .map(|list| list.into_iter().map(|v| first + v).collect())
                .collect(),
        );
        mesh.panel_starts.push(mesh.uv.len() as u32);
    }
    for seam in &garment.seams {
        let side = |e: crate::pattern::EdgeRef| (e.panel as usize, e.edge as usize);
        let ((pa, ea), (pb, eb)) = (side(seam.a), side(seam.b));
        let length = 0.5 * (segments[pa][ea].length() + segments[pb][eb].length());
        let mut vertices = mesh.edge_vertices[pb][eb].clone();
        let mut cut = fractions[pb][eb].clone();
        if !seam.same_direction {
            vertices.reverse();
            cut = cut.iter().rev().map(|x| 1.0 - x).collect();
        }
        mesh.seams.push(SeamMesh {
            links: link(
                Side {
                    vertices: &mesh.edge_vertices[pa][ea],
                    fractions: &fractions[pa][ea],
                },
                Side {
                    vertices: &vertices,
                    fractions: &cut,
                },
                length,
            ),
            rest_angle: seam.rest_angle,
        });
    }
    mesh.min_angle = quality::min_angle(&mesh);
    Ok(mesh)
}

/// Cuts and meshes one panel.
fn mesh_panel(
    panel: &Panel,
    segments: &[Segment],
    fractions: &[Vec<f64>],
    h: f64,
    max_vertices: usize,
) -> std::result::Result<PanelMesh, Failure> {
    let mut points: Vec<Vec2> = Vec::new();
    let mut edges: Vec<Vec<u32>> = Vec::with_capacity(segments.len());
    for range in panel.loops() {
        let first = points.len() as u32;
        for k in range.clone() {
            let sampled = segments[k].points_at(&fractions[k]);
            let start = points.len() as u32;
            points.extend(&sampled[..sampled.len() - 1]);
            let mut list: Vec<u32> = (start..points.len() as u32).collect();
            list.push(if k + 1 == range.end {
                first
            } else {
                points.len() as u32
            });
            edges.push(list);
        }
    }
    if points.len() > max_vertices {
        return Err(Failure::Final(Error::limit(format!(
            "{} boundary vertices, limit {max_vertices}",
            points.len()
        ))));
    }
    let pieces: Vec<[u32; 2]> = edges
        .iter()
        .flat_map(|list| list.windows(2).map(|w| [w[0], w[1]]))
        .collect();
    let mut area: f64 = 0.0;
    for (ring, range) in panel.loops().into_iter().enumerate() {
        let part: f64 = edges[range]
            .iter()
            .flat_map(|list| list.windows(2))
            .map(|w| {
                let (a, b) = (points[w[0] as usize], points[w[1] as usize]);
                0.5 * (a.x * b.y - a.y * b.x)
            })
            .sum();
        area += if ring == 0 { part.abs() } else { -part.abs() };
    }
    let seeds = lattice(&points, &pieces, h, panel.grain);
    // a uniform mesh of this area, and a generous ring of finer triangles along the outline
    let extra = (4.0 * area.max(0.0) / (0.433 * h * h)) as usize + 40 * points.len() + 1000;
    let extra = extra.min(max_vertices.saturating_sub(points.len() + seeds.len()));
    for angle in ANGLES {
        let mut cdt = constrain(&points, &pieces).map_err(Failure::Outline)?;
        for seed in &seeds {
            cdt.insert(Point2::new(seed.x, seed.y))
                .map_err(|e| Failure::Final(insertion(&e)))?;
        }
        let outcome = cdt.refine(
            RefinementParameters::new()
                .exclude_outer_faces(true)
                .keep_constraint_edges()
                .with_angle_limit(AngleLimit::from_deg(angle))
                .with_max_allowed_area(MAX_AREA * h * h)
                .with_min_required_area(1e-7 * h * h)
                .with_max_additional_vertices(extra.max(1)),
        );
        if !outcome.refinement_complete {
            continue;
        }
        let mut outside = vec![false; cdt.num_all_faces()];
        for face in &outcome.excluded_faces {
            outside[face.index()] = true;
        }
        let triangles: Vec<[usize; 3]> = cdt
            .inner_faces()
            .filter(|face| !outside[face.fix().index()])
            .map(|face| face.vertices().map(|v| v.fix().index()))
            .collect();
        let all: Vec<Vec2> = cdt
            .vertices()
            .map(|v| Vec2::new(v.position().x, v.position().y))
            .collect();
        let mesh = finish(points.len(), all, &triangles, edges, area)?;
        return Ok(PanelMesh {
            angle_limit: angle,
            ..mesh
        });
    }
    Err(Failure::Final(Error::limit(format!(
        "refinement to edges of {h} m did not end within {extra} further vertices, limit {max_vertices} in all"
    ))))
}

fn insertion(error: &spade::InsertionError) -> Error {
    Error::geometry(format!("point refused by the triangulation: {error}"))
}

/// Triangulation with the outline's pieces as constraints; refuses crossing pieces.
fn constrain(
    points: &[Vec2],
    pieces: &[[u32; 2]],
) -> Result<ConstrainedDelaunayTriangulation<Point2<f64>>> {
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut handles = Vec::with_capacity(points.len());
    for (k, p) in points.iter().enumerate() {
        let handle = cdt
            .insert(Point2::new(p.x, p.y))
            .map_err(|e| insertion(&e))?;
        if handle.index() != k {
            return Err(Error::geometry(format!(
                "two boundary vertices coincide at ({}, {}) m",
                p.x, p.y
            )));
        }
        handles.push(handle);
    }
    for [a, b] in pieces {
        let (from, to) = (handles[*a as usize], handles[*b as usize]);
        let crossed = cdt.try_add_constraint(from, to).is_empty();
        if crossed && !cdt.exists_constraint(from, to) {
            let p = points[*a as usize];
            return Err(Error::geometry(format!(
                "the cut outline crosses itself near ({:.6}, {:.6}) m",
                p.x, p.y
            )));
        }
        // a vertex exactly on the piece would split it
        if !cdt.exists_constraint(from, to) {
            let p = points[*a as usize];
            return Err(Error::geometry(format!(
                "the cut outline touches itself near ({:.6}, {:.6}) m",
                p.x, p.y
            )));
        }
    }
    Ok(cdt)
}

/// Drops vertices that no triangle uses and checks the area.
fn finish(
    boundary: usize,
    all: Vec<Vec2>,
    triangles: &[[usize; 3]],
    edges: Vec<Vec<u32>>,
    area: f64,
) -> std::result::Result<PanelMesh, Failure> {
    let mut used = vec![false; all.len()];
    let mut sum = 0.0;
    for t in triangles {
        let [a, b, c] = t.map(|v| all[v]);
        sum += 0.5 * ((b - a).x * (c - a).y - (b - a).y * (c - a).x);
        for v in t {
            used[*v] = true;
        }
    }
    if (sum - area).abs() > 1e-9 * area.abs().max(1e-12) {
        return Err(Failure::Outline(Error::geometry(format!(
            "triangles cover {sum} m^2 of {area} m^2: the cut outline overlaps itself"
        ))));
    }
    if used[..boundary].iter().any(|u| !u) {
        return Err(Failure::Outline(Error::geometry(
            "a boundary vertex has no triangle".to_string(),
        )));
    }
    let mut number = vec![0; all.len()];
    let mut uv = Vec::with_capacity(all.len());
    for (k, p) in all.into_iter().enumerate() {
        if used[k] {
            number[k] = uv.len() as u32;
            uv.push(p);
        }
    }
    Ok(PanelMesh {
        uv,
        triangles: triangles.iter().map(|t| t.map(|v| number[v])).collect(),
        edges,
        angle_limit: ANGLES[0],
    })
}

/// Points of a hexagonal lattice of spacing `h`, one of its directions across the warp, that lie
/// inside the outline and keep [`CLEARANCE`] from it.
fn lattice(points: &[Vec2], pieces: &[[u32; 2]], h: f64, grain: f64) -> Vec<Vec2> {
    let (sin, cos) = grain.sin_cos();
    let turned: Vec<Vec2> = points
        .iter()
        .map(|p| Vec2::new(cos * p.x + sin * p.y, -sin * p.x + cos * p.y))
        .collect();
    let Some((low, high)) = turned
        .iter()
        .map(|p| (*p, *p))
        .reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d)))
    else {
        return Vec::new();
    };
    let step = 0.75_f64.sqrt() * h;
    let rows = ((high.y - low.y) / step).floor();
    let middle = 0.5 * (low + high);
    let first_y = middle.y - 0.5 * rows * step;
    let rows = rows as usize + 1;
    // pieces that matter to each row: those within the clearance of it
    let reach = CLEARANCE * h;
    let mut near: Vec<Vec<usize>> = vec![Vec::new(); rows];
    for (k, [a, b]) in pieces.iter().enumerate() {
        let (p, q) = (turned[*a as usize], turned[*b as usize]);
        let from = ((p.y.min(q.y) - reach - first_y) / step).ceil().max(0.0) as usize;
        let to = ((p.y.max(q.y) + reach - first_y) / step).floor();
        if to < 0.0 {
            continue;
        }
        for row in near.iter_mut().take(to as usize + 1).skip(from) {
            row.push(k);
        }
    }
    let mut seeds = Vec::new();
    for (row, near) in near.iter().enumerate() {
        let y = first_y + row as f64 * step;
        // where the row enters and leaves the cloth
        let mut crossings: Vec<f64> = Vec::new();
        let mut blocked: Vec<[f64; 2]> = Vec::new();
        for k in near {
            let [a, b] = pieces[*k];
            let (p, q) = (turned[a as usize], turned[b as usize]);
            if (p.y > y) != (q.y > y) {
                crossings.push(p.x + (y - p.y) / (q.y - p.y) * (q.x - p.x));
            }
            blocked.push([p.x.min(q.x) - reach, p.x.max(q.x) + reach]);
        }
        crossings.sort_by(f64::total_cmp);
        let mut order: Vec<usize> = (0..near.len()).collect();
        order.sort_by(|i, j| blocked[*i][0].total_cmp(&blocked[*j][0]).then(i.cmp(j)));
        let mut waiting = order.into_iter().peekable();
        let mut active: Vec<usize> = Vec::new();
        let offset = if row % 2 == 0 { 0.0 } else { 0.5 * h };
        for pair in crossings.chunks_exact(2) {
            let from = ((pair[0] - middle.x - offset) / h).ceil() as i64;
            let to = ((pair[1] - middle.x - offset) / h).floor() as i64;
            for column in from..=to {
                let x = middle.x + offset + column as f64 * h;
                while let Some(k) = waiting.next_if(|k| blocked[*k][0] <= x) {
                    active.push(k);
                }
                active.retain(|k| blocked[*k][1] >= x);
                let point = Vec2::new(x, y);
                let clear = active.iter().all(|k| {
                    let [a, b] = pieces[near[*k]];
                    point_distance(point, turned[a as usize], turned[b as usize]) >= reach
                });
                if clear {
                    seeds.push(Vec2::new(cos * x - sin * y, sin * x + cos * y));
                }
            }
        }
    }
    seeds
}
