//! A saved FMU state: everything that the instance's next answers depend on, as bytes.
//!
//! ```text
//! "TOILEFMU" | version u32 | token hash u64 | length u64 | payload | checksum u64   (little endian)
//! ```
//!
//! The master's pointer to a state is a token for these bytes; serializing hands them out as they
//! are. There is one way back, whether bytes come from this instance, another, or a file.

use super::instance::Mode;
use crate::error::{Error, Result};
use crate::fmi::variables::Values;
use crate::math::hash::Hash;
use crate::sim::StepReport;
use serde::{Deserialize, Serialize};

const MAGIC: &[u8; 8] = b"TOILEFMU";
const VERSION: u32 = 2;
const HEADER: usize = 8 + 4 + 8 + 8;

/// What an instance is, beside its scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Saved {
    pub(super) mode: Mode,
    /// Values of all variables that a master may set.
    pub(super) values: Values,
    /// Those that the simulation's tunables were last taken from.
    pub(super) applied: Vec<f64>,
    pub(super) start: f64,
    pub(super) stop: Option<f64>,
    pub(super) time: f64,
    /// Whether the simulation is yet to be made from the values.
    pub(super) stale: bool,
    pub(super) report: Option<StepReport>,
    /// The simulation's own snapshot; empty if it is yet to be made.
    pub(super) snapshot: Vec<u8>,
}

impl Saved {
    /// As bytes that only an FMU of this token takes back.
    pub(super) fn to_bytes(&self, token: &str) -> Result<Vec<u8>> {
        let payload =
            postcard::to_stdvec(self).map_err(|e| Error::state(format!("FMU state: {e}")))?;
        let mut bytes = Vec::with_capacity(HEADER + payload.len() + 8);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&VERSION.to_le_bytes());
        bytes.extend_from_slice(&Hash::of(token.as_bytes()).to_le_bytes());
        bytes.extend_from_slice(&(payload.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&payload);
        let sum = Hash::of(&bytes);
        bytes.extend_from_slice(&sum.to_le_bytes());
        Ok(bytes)
    }

    /// From bytes of anybody.
    pub(super) fn from_bytes(bytes: &[u8], token: &str) -> Result<Self> {
        let bad = |what: String| Err(Error::parse(format!("FMU state: {what}")));
        if bytes.len() < HEADER + 8 || &bytes[..8] != MAGIC {
            return bad(format!("{} bytes are not one of toile's", bytes.len()));
        }
        let number = |from: usize| {
            let mut b = [0_u8; 8];
            b.copy_from_slice(&bytes[from..from + 8]);
            u64::from_le_bytes(b)
        };
        let version = number(8) as u32;
        if version != VERSION {
            return bad(format!("version {version}, this library reads {VERSION}"));
        }
        let there = bytes.len() - HEADER - 8;
        if number(20) != there as u64 {
            return bad(format!("{} bytes announced, {there} there", number(20)));
        }
        if Hash::of(&bytes[..bytes.len() - 8]) != number(bytes.len() - 8) {
            return bad("the checksum does not agree".into());
        }
        if number(12) != Hash::of(token.as_bytes()) {
            return bad("it was taken of another FMU".into());
        }
        let payload = &bytes[HEADER..bytes.len() - 8];
        let (saved, rest): (Self, _) = postcard::take_from_bytes(payload)
            .map_err(|e| Error::parse(format!("FMU state: {e}")))?;
        let times = [saved.start, saved.time];
        if !rest.is_empty() || times.iter().chain(&saved.stop).any(|t| !t.is_finite()) {
            return bad("it holds numbers that cannot be".into());
        }
        Ok(saved)
    }
}
