//! Charts known by name: the plain structures that every machine knits.

use super::Chart;
use crate::error::{Error, Result};

/// Names and repeats, bottom row first.
pub const PRESETS: &[(&str, &str)] = &[
    ("stockinette", "."),
    ("reverse stockinette", "-"),
    ("garter", ".\n-"),
    ("rib 1x1", ".-"),
    ("rib 2x2", "..--"),
];

impl Chart {
    /// The chart of one of [`PRESETS`].
    pub fn preset(name: &str) -> Result<Self> {
        let Some((_, grid)) = PRESETS.iter().find(|(known, _)| *known == name) else {
            let known: Vec<&str> = PRESETS.iter().map(|(known, _)| *known).collect();
            return Err(Error::parse(format!(
                "unknown knit {name:?}; known are {}, or give a chart",
                known.join(", ")
            )));
        };
        Self::from_grid(grid)
    }
}
