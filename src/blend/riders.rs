//! Points that ride on others: their places are fixed combinations of those, such as of the vertices of a triangle.
//!
//! ```text
//! x_r = Q sum_k b_k x_k,   dV/dx_k += b_k Q^T dV/dx_r,   d2V/dx_j dx_k += b_j b_k Q^T d2V/dx_r2 Q
//! ```
//!
//! `Q` turns images in a cell that is bent, and is the identity elsewhere.
//!
//! The transpose of the map `B` of Casafranca et al. 2020 (equation 1) without displacements: energies know
//! nothing of it, the assembly hands what belongs to a rider to the vertices that carry it.

use crate::error::{Error, Result};
use crate::math::{Mat3, Vec3};

/// A point and the vertices that carry it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rider {
    /// Number of the point.
    pub point: u32,
    /// Points that carry it, which ride on nothing: the vertices of its triangle.
    pub vertices: [u32; 3],
    /// Their weights; of sum 1 on a triangle.
    pub weights: [f64; 3],
    /// `Q`.
    pub turn: Mat3,
}

const NONE: u32 = u32::MAX;

/// All riders of a system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Riders {
    list: Vec<Rider>,
    /// Place in the list of each point, up to the last rider.
    place: Vec<u32>,
    /// Whether one of them is turned.
    turns: bool,
}

impl Riders {
    /// Riders by point; what carries one may not ride itself.
    pub fn new(list: Vec<Rider>) -> Result<Self> {
        let count = list.iter().map(|r| r.point as usize + 1).max().unwrap_or(0);
        let mut place = vec![NONE; count];
        for (k, rider) in (0..).zip(&list) {
            if std::mem::replace(&mut place[rider.point as usize], k) != NONE {
                return Err(Error::argument(format!(
                    "point {} rides twice",
                    rider.point
                )));
            }
        }
        let turns = list.iter().any(|r| r.turn != Mat3::identity());
        let riders = Self { list, place, turns };
        for rider in &riders.list {
            if let Some(v) = rider.vertices.iter().find(|v| riders.rides(**v)) {
                return Err(Error::argument(format!(
                    "point {} rides on point {v}, which rides itself",
                    rider.point
                )));
            }
        }
        Ok(riders)
    }

    /// All of them.
    pub fn list(&self) -> &[Rider] {
        &self.list
    }

    /// What carries a point, if it rides.
    pub fn of(&self, point: u32) -> Option<&Rider> {
        let place = self.place.get(point as usize)?;
        self.list.get(*place as usize)
    }

    /// `Q` of a point; none where no point of the system is turned.
    pub fn turn(&self, point: u32) -> Option<Mat3> {
        (self.turns).then(|| self.of(point).map_or_else(Mat3::identity, |r| r.turn))
    }

    /// Whether a point rides.
    pub fn rides(&self, point: u32) -> bool {
        self.of(point).is_some()
    }

    /// Gives the riders the values that those of their vertices make.
    pub fn carry(&self, values: &mut [Vec3]) {
        for r in &self.list {
            let sum: Vec3 = (r.vertices.iter().zip(&r.weights))
                .map(|(v, w)| values[*v as usize] * *w)
                .sum();
            values[r.point as usize] = if self.turns { r.turn * sum } else { sum };
        }
    }
}
