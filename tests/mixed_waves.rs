//! Pulses that run from triangles into yarns: little of them comes back.

use crate::wave_cases::{Cloth, Pulse, reflected};

/// A pulse two edges wide passes into yarns that are joined directly, and what comes back is less than a hundredth of its energy; in triangles
/// alone next to nothing does.
#[test]
fn a_long_wave_passes_into_yarns() {
    let pulse = Pulse {
        along: true,
        from_yarns: false,
        width: 8e-3,
    };
    let [triangles, direct] =
        [Cloth::Triangles, Cloth::Half(0)].map(|cloth| reflected(0.16, cloth, &pulse, 100));
    println!("triangles {triangles:.2e}, direct {direct:.2e}");
    assert!(triangles < 1e-3 && direct < 1e-2, "{triangles} {direct}");
}
