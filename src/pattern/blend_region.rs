//! Where every yarn is wanted: the shapes that say it on a panel.

use super::Panel;
use super::outline::{Piece, inside, point_distance, polylines};
use crate::error::{Error, Result};
use crate::math::Vec2;

/// Turn of an edge between two points that distances are measured from [rad].
const TURN: f64 = 0.1;

/// Most hybrid rings.
const MOST_RINGS: u32 = 3;

/// A part of a panel in which every yarn is simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct BlendRegion {
    /// Panel index.
    pub panel: u32,
    /// What of the panel.
    pub shape: Shape,
    /// Hybrid rings around it.
    pub rings: u32,
}

/// What of a panel is in a region; flat coordinates [m].
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// The inside of a polygon: what a ray from there leaves through an odd number of sides.
    Polygon(Vec<Vec2>),
    /// What is no farther than `radius` from `center`.
    Disc {
        /// Its middle.
        center: Vec2,
        /// How far it goes.
        radius: f64,
    },
    /// What is no farther than `width` from an edge of the panel, such as one side of a seam.
    Edge {
        /// The edge.
        edge: u32,
        /// How far from it.
        width: f64,
    },
}

/// Refuses more hybrid rings than there can be.
pub fn check_rings(rings: u32) -> Result<()> {
    if rings <= MOST_RINGS {
        return Ok(());
    }
    Err(Error::argument(format!(
        "{rings} hybrid rings, at most {MOST_RINGS} can be"
    )))
}

impl BlendRegion {
    /// Tells which points of its panel it holds, within a tolerance [m].
    pub fn holds(&self, panel: &Panel, tolerance: f64) -> Result<impl Fn(Vec2) -> bool> {
        // within some distance of pieces, or inside of them
        let (pieces, reach, closed) = match &self.shape {
            Shape::Polygon(corners) => (sides(corners), 0.0, true),
            Shape::Disc { center, radius } => (sides(&[*center]), *radius, false),
            Shape::Edge { edge, width } => {
                let mut pieces = polylines(&panel.segments()?, &panel.loops(), TURN);
                pieces.retain(|p| p.edge == *edge as usize);
                (pieces, *width, false)
            }
        };
        Ok(move |p: Vec2| {
            let near = |piece: &Piece| point_distance(p, piece.a, piece.b) <= reach + tolerance;
            (closed && inside(p, &pieces, 0)) || pieces.iter().any(near)
        })
    }

    /// The same, so many times as large: about the middle of its corners, or as far again from where it begins.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let shape = match &self.shape {
            Shape::Polygon(corners) => {
                let middle = corners.iter().sum::<Vec2>() / corners.len().max(1) as f64;
                let place = |p: &Vec2| middle + (p - middle) * factor;
                Shape::Polygon(corners.iter().map(place).collect())
            }
            Shape::Disc { center, radius } => Shape::Disc {
                center: *center,
                radius: radius * factor,
            },
            Shape::Edge { edge, width } => Shape::Edge {
                edge: *edge,
                width: width * factor,
            },
        };
        Self {
            shape,
            ..self.clone()
        }
    }
}

/// Straight sides from corner to corner and back to the first.
fn sides(corners: &[Vec2]) -> Vec<Piece> {
    let n = corners.len();
    (0..n)
        .map(|i| Piece {
            a: corners[i],
            b: corners[(i + 1) % n],
            edge: i,
            ring: 0,
            next: (i + 1) % n,
        })
        .collect()
}
