//! Temporary stub.

use super::Body;
use crate::error::Result;

/// Temporary stub.
pub fn mannequin(_cell: f64) -> Result<Body> {
    Body::sphere(0.3)
}
