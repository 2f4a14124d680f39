//! Lays a knitted panel: nodes, yarns, and what holds at every stitch contact.
//!
//! The two yarns of a contact make one turn about each other between its nodes `q0` (inner) and `q1`
//! (outer). For every pair of a new and an old strand there are two wraps: the old wing at `q0` with the
//! new wing at `q1`, and the other way round. Handedness, with `e = q0 -> q1` and `d` from the axis to the
//! new yarn's wing, both in the flat layout seen from the front:
//!
//! ```text
//! s = -sign(e x d) (+1 if the new yarn lies in front at q0, else -1)
//! ```
//!
//! which gives 1 for the left contact of a knit stitch, -1 for the right one, and the opposite for
//! purl. A wrap is left out if a wing is missing, or if both wings lie on one side of the axis or on the
//! axis: its angle would begin at a half turn (at cast-on and bind-off). Every strand has a spring of
//! its length inside of the contact. Where the yarn of a piece ends uncut, and its ends are woven in, it does
//! not slide at its last contact.

use super::builder::{Builder, EdgeNode};
use super::cut::cut;
use super::knit::{Passage, Path, is_inner};
use super::layout::Cell;
use super::piece::{Piece, counts, origin, pitch, size};
use super::region::Region;
use super::weave::spacing;
use super::{Family, StitchSpring, Wrap};
use crate::error::Result;
use crate::math::Vec2;
use crate::math::geometry::cross2;
use crate::math::hash::Hash;
use crate::pattern::yarn_fabric::{Knit, YarnFabric};

/// Height of the disturbance over the loop width.
const LIFT: f64 = 0.01;
/// Sine of the angle between an axis and a wing, below which the wing lies on no side.
const ASIDE: f64 = 0.02;
/// Borders farther from the outline than this are not sewn [loop widths].
const REACH: f64 = 1.0;

const NONE: u32 = u32::MAX;

/// A strand's passage through a contact.
#[derive(Clone, Copy)]
struct Strand {
    contact: u32,
    new: bool,
    in_front: bool,
    /// Incidences at the inner and the outer node.
    at: [u32; 2],
    /// Incidences of the yarn: first and one after the last.
    yarn: [u32; 2],
}

/// Lays the yarns of one knitted panel.
pub(super) fn lay(
    builder: &mut Builder,
    region: &Region,
    knit: &Knit,
    yarns: &YarnFabric,
    cell: &Cell,
    fabric: u32,
    panel: u32,
) -> Result<()> {
    let [low, high] = region.bounds();
    let [w, h] = pitch(knit, cell);
    let piece = Piece::new(knit, cell, high - low)?;
    // in the middle of the panel's box
    let courses = piece.rows.len() as f64 - 1.0;
    let corner = (low + high - size([w, h], piece.wales as f64, courses)) * 0.5;
    let origin = corner + origin([w, h]);
    let path = Path::new(&piece, w, h);
    let cut = cut(&path, region, origin, w);
    let mut ids = vec![NONE; path.points.len()];
    let mut strands: Vec<Strand> = Vec::new();
    for part in cut.parts.iter().filter(|part| !part.dropped) {
        let end = |builder: &mut Builder, at: usize| {
            let Some(rim) = part.ends[at] else { return };
            let node = builder.node(panel, region.to_panel(rim.point), 0.0);
            builder.edge_nodes.push(EdgeNode {
                node,
                panel,
                edge: rim.edge,
                fraction: rim.fraction,
            });
            builder.pass(node, Default::default());
        };
        let first = builder.yarn_start();
        let from = strands.len();
        end(builder, 0);
        let mut before: Option<(Passage, u32)> = None;
        for passage in &path.passages[part.range.clone()] {
            let old = passage.node as usize;
            if !cut.alive[old] {
                continue;
            }
            if ids[old] == NONE {
                let lift = LIFT * w * noise(panel, passage.node);
                ids[old] = builder.node(panel, region.to_panel(path.points[old] + origin), lift);
            }
            let incidence = builder.pass(ids[old], passage.place);
            if let Some((last, at)) = before {
                let contact = |node: u32| (node as usize) < path.contact_nodes;
                if contact(last.node) && contact(passage.node) {
                    let du = builder.mesh.incidences[incidence as usize].u
                        - builder.mesh.incidences[at as usize].u;
                    if last.node / 2 == passage.node / 2 {
                        let (inner, outer) = if is_inner(last.node) {
                            ((last, at), incidence)
                        } else {
                            ((*passage, incidence), at)
                        };
                        strands.push(Strand {
                            contact: passage.node / 2,
                            new: passage.place.group == 1,
                            in_front: inner.0.front,
                            at: [inner.1, outer],
                            yarn: [first, first],
                        });
                    } else {
                        let changes = last.front != passage.front;
                        let spacing = spacing(yarns.radius, changes, [at, incidence], du);
                        builder.mesh.spacings.push(spacing);
                    }
                }
            }
            before = Some((*passage, incidence));
        }
        end(builder, 1);
        builder.end_yarn(fabric, Family::Course);
        let end = builder.yarn_start();
        for strand in &mut strands[from..] {
            strand.yarn[1] = end;
        }
        if let [a, ..] = strands[from..]
            && let [.., b] = strands[from..]
        {
            let contacts = [a.at[0].min(a.at[1]), b.at[0].max(b.at[1])];
            for (rim, contact) in part.ends.iter().zip(contacts) {
                if yarns.fastened && rim.is_none() {
                    builder.mesh.incidences[contact as usize].slides = false;
                }
            }
        }
    }
    strands.sort_by_key(|s| (s.contact, !s.new, s.at[0]));
    for contact in strands.chunk_by(|a, b| a.contact == b.contact) {
        hold(builder, region, contact);
    }
    // finished borders can be sewn like cut ones
    for node in path.border {
        let id = ids[node as usize];
        if id == NONE {
            continue;
        }
        if let Some((distance, rim)) = region.nearest(path.points[node as usize] + origin)
            && distance <= REACH * w
        {
            builder.edge_nodes.push(EdgeNode {
                node: id,
                panel,
                edge: rim.edge,
                fraction: rim.fraction,
            });
        }
    }
    Ok(())
}

/// Nodes of the panel's box full of loops, roughly, before any memory is taken.
pub(super) fn estimate(knit: &Knit, cell: &Cell, size: Vec2) -> f64 {
    let [wales, courses] = counts(knit, cell, size).map(|n| n.max(0.0));
    4.0 * wales * (courses + 1.0)
}

/// A number in [-1, 1] that belongs to the node.
fn noise(panel: u32, node: u32) -> f64 {
    let key = (u64::from(panel) << 32) | u64::from(node);
    let bits = Hash::of(&key.to_le_bytes()) >> 11;
    2.0 * bits as f64 / (1u64 << 53) as f64 - 1.0
}

/// Springs and wraps of one contact: its new strand first.
fn hold(builder: &mut Builder, region: &Region, strands: &[Strand]) {
    let mesh = &mut builder.mesh;
    let length = |s: &Strand, mesh: &super::YarnMesh| {
        let [a, b] = s.at.map(|k| mesh.incidences[k as usize].u);
        (a - b).abs()
    };
    for s in strands {
        let mut incidences = s.at;
        incidences.sort_unstable();
        mesh.stitch_springs.push(StitchSpring {
            incidences,
            length: length(s, mesh),
        });
    }
    let Some((new, olds)) = strands.split_first() else {
        return;
    };
    let place = |k: u32| {
        let node = mesh.incidences[k as usize].node;
        region.to_frame(mesh.uv[node as usize])
    };
    let axis = new.at.map(|k| mesh.incidences[k as usize].node);
    let [q0, q1] = new.at.map(place);
    let e = q1 - q0;
    let mut wraps = Vec::new();
    for old in olds {
        for (a, b) in [(old, new), (new, old)] {
            let (Some(wing_a), Some(wing_b)) = (a.wing(0), b.wing(1)) else {
                continue;
            };
            let (d_a, d_b) = (place(wing_a) - q0, place(wing_b) - q1);
            let side = |d: Vec2| {
                let sine = cross2(&e, &d) / (e.norm() * d.norm());
                if sine.abs() < ASIDE {
                    0.0
                } else {
                    sine.signum()
                }
            };
            let (side_a, side_b) = (side(d_a), side(d_b));
            if side_a * side_b >= 0.0 {
                continue;
            }
            let side_new = if a.new { side_a } else { side_b };
            wraps.push(Wrap {
                axis,
                wings: [wing_a, wing_b],
                length: length(new, mesh),
                sign: if new.in_front { -side_new } else { side_new },
            });
        }
    }
    mesh.wraps.extend(wraps);
}

impl Strand {
    /// The incidence beyond the inner (0) or outer (1) node, if the yarn goes on there.
    fn wing(&self, end: usize) -> Option<u32> {
        let (here, there) = (self.at[end], self.at[1 - end]);
        if here < there {
            here.checked_sub(1).filter(|k| *k >= self.yarn[0])
        } else {
            Some(here + 1).filter(|k| *k < self.yarn[1])
        }
    }
}
