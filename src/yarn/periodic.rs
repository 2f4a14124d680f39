//! One repeat of laid yarns, whose ends meet those of the next repeat.
//!
//! Nodes of one box of the laid yarns are the cell's own. Energies that reach beyond it have nodes that are images of
//! the cell's, whole numbers `k` of repeats away. With the weight `w` of an energy, the part of its nodes that are own
//! ([`YarnMesh::weight`] with `alpha` 1 on own nodes and 0 on images), the sum
//!
//! ```text
//! V = sum_e w_e V_e
//! ```
//!
//! has every energy of the endless fabric once for each repeat: an energy across the border is there once for each
//! box that it reaches, with weights of sum 1. A passage through an image has its own's coordinate, a constant apart
//! ([`Image`]). Rows of a knit run to and fro; images of a row that runs the other way are turned round.

use super::{Image, YarnMesh};
use crate::error::{Error, Result};
use crate::math::Vec2;

const NONE: u32 = u32::MAX;
/// Distance, over the box's smaller side, within which a node lies where another one's image is.
const NEAR: f64 = 1e-6;
/// Most nodes of a cell.
const MOST: usize = 20_000;

/// Yarns of one repeat and where the images are.
#[derive(Clone, Debug, PartialEq)]
pub struct Periodic {
    /// The cell's nodes and the images that its energies need.
    pub mesh: YarnMesh,
    /// Which nodes are images of which others.
    pub images: Vec<NodeImage>,
}

/// A node that is the image of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeImage {
    /// The node.
    pub node: u32,
    /// Whose image it is.
    pub of: u32,
    /// How many repeats away, across and along.
    pub steps: [i32; 2],
}

impl YarnMesh {
    /// The cell of a box with this size, one repeat, somewhere in the middle of these yarns, with images of all nodes
    /// within `around` of the box.
    pub fn periodic(&self, size: Vec2, around: Vec2) -> Result<Periodic> {
        let low = self.corner(size);
        let within = |ring: Vec2| -> Vec<bool> {
            let place = |uv: &Vec2| {
                let (below, above) = (uv - low + ring, low + size + ring - uv);
                below.min() >= 0.0 && above.min() > 0.0
            };
            self.uv.iter().map(place).collect()
        };
        let inside = within(Vec2::zeros());
        let count = inside.iter().filter(|i| **i).count();
        if count == 0 || count > MOST {
            return Err(Error::limit(format!(
                "a repeat has {count} nodes, must have 1 to {MOST}"
            )));
        }
        let mut wanted = within(around);
        for (near, needed) in wanted.iter_mut().zip(self.wanted(&inside)) {
            *near |= needed;
        }
        let (mut mesh, nodes, passages) = self.part_with(&inside, &wanted);
        let mut laid_passage = vec![NONE; mesh.incidences.len()];
        for (laid, own) in passages.iter().enumerate() {
            if *own != NONE {
                laid_passage[*own as usize] = laid as u32;
            }
        }
        let mut images = Vec::new();
        let mut pairs = Vec::new();
        for node in (0..mesh.uv.len()).filter(|n| mesh.outside[*n]) {
            let laid = nodes[node];
            let (of, steps) = self.own(&nodes, &mesh, laid, low, size)?;
            images.push(NodeImage {
                node: node as u32,
                of,
                steps,
            });
            let here = self.stack(laid as usize);
            let there = self.stack(nodes[of as usize] as usize);
            if here.len() != there.len() {
                return Err(self.uneven(laid));
            }
            for (a, b) in here.iter().zip(there) {
                let image = passages[a.incidence as usize];
                if image == NONE {
                    continue;
                }
                let own = passages[b.incidence as usize];
                if own == NONE {
                    return Err(self.uneven(laid));
                }
                let turns = self
                    .runs_back(a.incidence, b.incidence, NEAR * size.min())
                    .ok_or_else(|| self.uneven(laid))?;
                pairs.push((image, own, turns));
            }
        }
        mesh.alpha = mesh
            .outside
            .iter()
            .map(|o| if *o { 0.0 } else { 1.0 })
            .collect();
        let turned = mesh.against(&pairs)?;
        let moved = mesh.turn(&turned);
        mesh.images = pairs
            .into_iter()
            .map(|(image, own, _)| Image {
                incidence: moved[image as usize],
                of: moved[own as usize],
            })
            .collect();
        Ok(Periodic { mesh, images })
    }

    fn uneven(&self, node: u32) -> Error {
        let uv = self.uv[node as usize];
        Error::material(format!(
            "the fabric does not repeat at ({}, {}) m: it has no periodic cell",
            uv.x, uv.y
        ))
    }

    /// Lower corner of a box in the middle, as far from nodes as can be.
    fn corner(&self, size: Vec2) -> Vec2 {
        let bounds = |axis: usize| {
            let all = self.uv.iter().map(|uv| uv[axis]);
            (
                all.clone().fold(f64::INFINITY, f64::min),
                all.fold(f64::NEG_INFINITY, f64::max),
            )
        };
        let mut corner = Vec2::zeros();
        for axis in 0..2 {
            let (low, high) = bounds(axis);
            let from = 0.5 * (low + high - size[axis]);
            let mut places: Vec<f64> = (self.uv.iter().map(|uv| uv[axis]))
                .filter(|p| (from..from + size[axis]).contains(p))
                .collect();
            places.sort_by(f64::total_cmp);
            let gap = |w: &[f64]| w[1] - w[0];
            let widest = (places.windows(2)).max_by(|a, b| gap(a).total_cmp(&gap(b)));
            corner[axis] = widest.map_or(from, |w| 0.5 * (w[0] + w[1]));
            // as near to the middle as a repeat allows
            if corner[axis] > from + 0.5 * size[axis] {
                corner[axis] -= size[axis];
            }
        }
        corner
    }

    /// The own node whose image a laid node is, and how far it is away.
    fn own(
        &self,
        nodes: &[u32],
        part: &YarnMesh,
        laid: u32,
        low: Vec2,
        size: Vec2,
    ) -> Result<(u32, [i32; 2])> {
        let steps = (self.uv[laid as usize] - low)
            .component_div(&size)
            .map(f64::floor);
        let place = self.uv[laid as usize] - steps.component_mul(&size);
        let near = NEAR * size.min();
        let found = (0..nodes.len())
            .find(|n| !part.outside[*n] && (part.uv[*n] - place).norm() < near)
            .ok_or_else(|| self.uneven(laid))?;
        Ok((found as u32, [steps.x as i32, steps.y as i32]))
    }

    fn yarn_of(&self, incidence: u32) -> usize {
        self.starts.partition_point(|s| *s <= incidence) - 1
    }

    /// Whether the yarn of passage `a` runs against that of passage `b`, whose image `a` is.
    fn runs_back(&self, a: u32, b: u32, near: f64) -> Option<bool> {
        let step = |i: u32, by: i64| {
            let yarn = self.yarn_of(i);
            let range = i64::from(self.starts[yarn])..i64::from(self.starts[yarn + 1]);
            let other = i64::from(i) + by;
            range.contains(&other).then(|| {
                let node = |k: usize| self.uv[self.incidences[k].node as usize];
                node(other as usize) - node(i as usize)
            })
        };
        let next = step(a, 1)?;
        let agrees = |d: Option<Vec2>| d.is_some_and(|d| (d - next).norm() < near);
        match (agrees(step(b, 1)), agrees(step(b, -1))) {
            (true, _) => Some(false),
            (false, true) => Some(true),
            _ => None,
        }
    }

    /// Which yarns to turn round so that images run as their own do; of each pair whether they run against each other.
    fn against(&self, pairs: &[(u32, u32, bool)]) -> Result<Vec<bool>> {
        let mut turned: Vec<Option<bool>> = vec![None; self.yarn_count()];
        for first in 0..turned.len() {
            turned[first].get_or_insert(false);
            // goes on until nothing is left to say about what hangs together with it
            loop {
                let mut grown = false;
                for (image, own, against) in pairs {
                    let [a, b] = [image, own].map(|i| self.yarn_of(*i));
                    match (turned[a], turned[b]) {
                        (Some(x), None) => turned[b] = Some(x != *against),
                        (None, Some(y)) => turned[a] = Some(y != *against),
                        (Some(x), Some(y)) if (x != y) != *against => {
                            return Err(Error::material(
                                "the fabric's yarns run both ways through one of its nodes: it has no periodic cell",
                            ));
                        }
                        _ => continue,
                    }
                    grown = true;
                }
                if !grown {
                    break;
                }
            }
        }
        Ok(turned.into_iter().map(|t| t == Some(true)).collect())
    }

    /// Turns some yarns round; the new number of each passage.
    fn turn(&mut self, turned: &[bool]) -> Vec<u32> {
        let mut moved: Vec<u32> = (0..self.incidences.len() as u32).collect();
        for (y, _) in turned.iter().enumerate().filter(|(_, t)| **t) {
            let range = self.starts[y] as usize..self.starts[y + 1] as usize;
            moved[range.clone()].reverse();
            let yarn = &mut self.incidences[range];
            yarn.reverse();
            let end = yarn.first().map_or(0.0, |i| i.u);
            for incidence in yarn {
                incidence.u = end - incidence.u;
            }
        }
        let to = |i: &mut u32| *i = moved[*i as usize];
        self.stacks.iter_mut().for_each(|s| to(&mut s.incidence));
        self.wraps
            .iter_mut()
            .flat_map(|w| &mut w.wings)
            .for_each(to);
        let springs = self.stitch_springs.iter_mut().map(|s| &mut s.incidences);
        let spacings = self.spacings.iter_mut().map(|s| &mut s.incidences);
        for pair in springs.chain(spacings) {
            pair.iter_mut().for_each(to);
            pair.sort_unstable();
        }
        moved
    }
}
