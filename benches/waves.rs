//! Waves that cross from triangles into yarns and back: what part of their energy comes back, by coupling.
//!
//! The strips of `tests/wave_cases`: 240 mm of a plain weave of 1 mm and triangles of 4 mm. `cargo bench --bench waves`, or `make bench-mixed`.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

#[path = "../tests/wave_cases/mod.rs"]
mod wave_cases;

use wave_cases::{Cloth, Pulse, reflected};

const LONG: f64 = 0.24;
const STEPS: u32 = 400;

fn main() {
    println!("reflected part of the energy of a pulse, {STEPS} steps over half of {LONG} m");
    let cloths = [
        ("triangles alone", Cloth::Triangles),
        ("yarns alone", Cloth::Yarns),
        ("direct", Cloth::Half(0)),
        ("1 ring", Cloth::Half(1)),
        ("2 rings", Cloth::Half(2)),
        ("3 rings", Cloth::Half(3)),
    ];
    for (along, name) in [(true, "along"), (false, "across")] {
        for (from_yarns, width) in [(false, 12e-3), (true, 12e-3), (true, 6e-3)] {
            let pulse = Pulse {
                along,
                from_yarns,
                width,
            };
            let from = if from_yarns { "yarns" } else { "triangles" };
            println!("{name} the strip, from {from}, {:.0} mm wide", 1e3 * width);
            for (name, cloth) in cloths {
                println!("  {name:<16} {:.2e}", reflected(LONG, cloth, &pulse, STEPS));
            }
        }
    }
}
