//! Fabrics of yarns that are pulled: what holds them, how far, and what they do not give back.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::yarn_pull::{Reading, Swatch, stretch_at};

/// Plain weave with a pitch of 1 mm of yarns of radius 0.3 mm: they touch when sheared by 55 degrees.
const WEAVE: &str = r#"{"weave": "plain", "warp_pitch": 0.001, "radius": 0.0003}"#;

fn curve(swatch: &mut Swatch, stretches: &[f64]) -> Vec<Reading> {
    let read = |s: &f64| {
        let reading = swatch.pull(*s);
        println!(
            "  {s:.3}: {:.4e} N, residual {:.1e} N, {} iterations",
            reading.force, reading.residual, reading.newton
        );
        reading
    };
    stretches.iter().map(read).collect()
}

/// Slope between two readings [N/m].
fn slope(swatch: &Swatch, from: &Reading, to: &Reading) -> f64 {
    (to.force - from.force) / (swatch.laid * (to.stretch - from.stretch))
}

/// Jersey gives way 1.5 to 3 times as far along its courses as along its wales, at equal force over its width.
#[test]
fn jersey_stretches_more_along_courses_than_along_wales() {
    let mut across = Swatch::knit("\"knit\": \"stockinette\"", 8, 8, 0);
    let mut along = Swatch::knit("\"knit\": \"stockinette\"", 8, 8, 1);
    let courses = curve(&mut across, &[1.0, 1.1, 1.15, 1.2, 1.25, 1.3]);
    let wales = curve(&mut along, &[1.0, 1.05, 1.1, 1.15, 1.2]);
    for tension in [100.0, 200.0] {
        // each is as wide as the other is long
        let [a, b] = [
            stretch_at(&courses, tension * along.laid),
            stretch_at(&wales, tension * across.laid),
        ];
        let ratio = (a - 1.0) / (b - 1.0);
        println!("jersey at {tension} N/m: courses {a:.4}, wales {b:.4}, ratio {ratio:.2}");
        assert!((1.5..3.0).contains(&ratio), "{ratio}");
    }
}

/// Rib 2x2 unfolds, then its loops bend, then its yarn is stretched: each stiffer than the one before by far; what friction has
/// taken does not come back.
#[test]
fn rib_has_three_regimes_and_hysteresis() {
    let mut rib = Swatch::knit("\"knit\": \"rib 2x2\"", 8, 5, 0);
    let up = curve(&mut rib, &[0.8, 1.0, 1.1, 1.2, 1.3]);
    let down = curve(&mut rib, &[1.2, 1.1, 1.0]);
    let slopes = [(0, 1), (1, 2), (3, 4)].map(|(a, b)| slope(&rib, &up[a], &up[b]));
    println!("rib: {slopes:.2?} N/m");
    assert!(slopes[0] > 0.0 && slopes[1] > 3.0 * slopes[0], "{slopes:?}");
    assert!(slopes[2] > 50.0 * slopes[1], "{slopes:?}");
    for (k, back) in [(2, &down[1]), (1, &down[2])] {
        println!(
            "at {:.1}: {:.3e} N, back {:.3e} N",
            up[k].stretch, up[k].force, back.force
        );
        assert!(back.force < 0.95 * up[k].force);
    }
}

/// A weave is as stiff as its yarns along them, a thousand times softer on the bias, and locks there. Along its yarns
/// it gives back everything; on the bias yarns stay where they have slid.
#[test]
fn a_weave_is_stiff_along_its_yarns_and_soft_on_the_bias_until_it_locks() {
    let mut along = Swatch::new(WEAVE, [0.006, 0.018], 0.0, 1);
    let grain = curve(&mut along, &[1.0, 1.005, 1.01, 1.0]);
    let stiff = slope(&along, &grain[0], &grain[2]);
    assert!(grain[3].force.abs() < 1e-6 * grain[2].force);
    assert!(along.sim.yarn_slips().iter().all(|s| s.abs() < 1e-9));
    let mut biased = Swatch::new(WEAVE, [0.006, 0.018], 45.0, 1);
    let bias = curve(&mut biased, &[1.0, 1.05, 1.1, 1.2, 1.3, 1.35]);
    let soft = slope(&biased, &bias[0], &bias[1]);
    let locked = slope(&biased, &bias[4], &bias[5]);
    println!("weave: {stiff:.0} N/m along, {soft:.3} on the bias, {locked:.2} where it locks");
    assert!(stiff > 1000.0 * soft, "{stiff} {soft}");
    assert!(
        locked > 5.0 * slope(&biased, &bias[2], &bias[3]),
        "{locked}"
    );
    let back = curve(&mut biased, &[1.2, 1.1, 1.0]);
    let slid = biased.sim.yarn_slips();
    let slid = slid.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
    println!(
        "weave: slid by {:.0} um when it is back at {:.1}",
        1e6 * slid,
        back[2].stretch
    );
    assert!(slid > 5e-5, "{slid}");
}

/// Jersey that was stretched until its yarn slid is longer under the load that held it at first, the longer the further it
/// was stretched.
#[test]
fn an_overstretched_knit_keeps_a_set_that_grows() {
    let mut jersey = Swatch::knit("\"knit\": \"stockinette\"", 6, 6, 0);
    let load = curve(&mut jersey, &[1.0])[0].force;
    let mut sets = vec![0.0];
    for (up, down) in [
        (&[][..], &[1.04, 1.02, 1.0][..]),
        (&[1.04], &[1.08, 1.06, 1.04, 1.02, 1.0]),
        (&[1.04, 1.08], &[1.12, 1.09, 1.06, 1.03, 1.0]),
        (&[1.15], &[1.3, 1.2, 1.15, 1.1, 1.05, 1.0]),
    ] {
        curve(&mut jersey, up);
        let mut back = curve(&mut jersey, down);
        back.reverse();
        let set = stretch_at(&back, load) - 1.0;
        println!(
            "jersey: {:.1} % longer at {:.2} mN",
            100.0 * set,
            1e3 * load
        );
        sets.push(set);
    }
    // beyond 1.12 the loops are taut and yarn itself stretches: the set stays, as far as the path of friction lets
    let (taut, slack) = sets.split_last().expect("sets");
    assert!(slack.windows(2).all(|w| w[1] > w[0] + 0.005), "{sets:?}");
    assert!(*taut > slack[2] + 0.005, "{sets:?}");
}

/// Jersey that was stretched by 1 % once, which lets go what its laying has left at the limit of friction, pulls as before after
/// it was again where friction holds its yarn, and less where it was stretched until it slid.
#[test]
fn a_knit_stretched_below_slip_keeps_no_set() {
    let lost = [(20.0, 1.01), (0.3, 1.05)].map(|(friction, stretch)| {
        let keys = format!("\"knit\": \"stockinette\", \"friction\": {friction}");
        let mut jersey = Swatch::knit(&keys, 6, 6, 0);
        let read = curve(&mut jersey, &[1.0, 1.01, 1.0, stretch, 1.0]);
        1.0 - read[4].force / read[2].force
    });
    println!("jersey: lost {lost:.6?} of its load");
    assert!(lost[0].abs() < 1e-3, "{lost:?}");
    assert!(lost[1] > 1e-2, "{lost:?}");
}
