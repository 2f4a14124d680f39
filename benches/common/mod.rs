//! What several benchmarks need: processor time, random numbers, medians, fitted exponents, garments of others.

#![allow(dead_code, reason = "every benchmark uses a part of it")]

use std::path::PathBuf;
use toile::body::Body;
use toile::pattern::Garment;
use toile::pattern::import::garment_from_file;
use toile::sim::Settings;

/// A GarmentCode pattern of the folder that `TOILE_DATA` names, and the body that it is for; `None`, and a line that says so, without.
pub(crate) fn garment(name: &str) -> Option<(Garment, Body)> {
    let Some(data) = std::env::var_os("TOILE_DATA").map(PathBuf::from) else {
        println!("\n{name} is left out: TOILE_DATA is not set");
        return None;
    };
    let path = data.join(format!("garmentcode/{name}_specification.json"));
    let (garment, _) = garment_from_file(&path).expect("pattern");
    let body = Body::obj(&data.join("bodies/mean_all.obj"), 1.0, 0.0).expect("body");
    Some((garment, body))
}

/// The number that follows an argument of this name.
pub(crate) fn given(name: &str, default: f64) -> f64 {
    let mut arguments = std::env::args();
    arguments
        .find(|a| a == name)
        .map(|_| arguments.next().and_then(|v| v.parse().ok()))
        .map_or(default, |v| v.expect("a number"))
}

/// Settings with the threads that `--threads` gives, one without.
pub(crate) fn settings() -> Settings {
    Settings {
        threads: given("--threads", 1.0),
        ..Settings::default()
    }
}

/// Processor time of all threads of this process [s], in steps of 10 ms.
pub(crate) fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = text.rsplit(')').next().unwrap_or("");
    let field = |n: usize| -> f64 {
        let word = after.split_whitespace().nth(n);
        word.and_then(|w| w.parse().ok()).unwrap_or(f64::NAN)
    };
    (field(11) + field(12)) / 100.0
}

/// A small deterministic generator (xorshift64*).
pub(crate) struct Random(u64);

impl Random {
    /// Streams of different seeds have nothing in common.
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// Uniform in 0..1.
    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The value in the middle.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The exponent `p` of `cost = c n^p`, by least squares of the logarithms.
pub(crate) fn exponent(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2))
}
