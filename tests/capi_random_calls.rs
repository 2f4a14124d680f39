//! Never a crash: seeded random call sequences and mutated text give statuses and texts, and
//! errors change nothing. The same bodies run as fuzz targets (`fuzz/`).
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test may panic")]

use crate::capi_support::{calls, scene};

/// The generator SplitMix64: the same bytes everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }

    fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.next() as u8).collect()
    }
}

/// Runs `body` for every seed; says which seed failed.
fn seeds(count: u64, body: impl Fn(&mut Random)) {
    let count = match std::env::var_os("TOILE_SOAK") {
        Some(_) => 20 * count,
        None => count,
    };
    for seed in 0..count {
        let run = || body(&mut Random(seed));
        let start = std::time::Instant::now();
        if let Err(cause) = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)) {
            eprintln!("failed with seed {seed}");
            std::panic::resume_unwind(cause);
        }
        let seconds = start.elapsed().as_secs_f64();
        if seconds > 1.0 {
            eprintln!("seed {seed} took {seconds:.1} s");
        }
    }
}

#[test]
fn ten_thousand_random_call_sequences_give_statuses_and_change_nothing_on_error() {
    let total = std::cell::Cell::new(calls::Tally::default());
    seeds(10_000, |random| {
        let length = 60 + random.below(900);
        let tally = calls::run(&random.bytes(length));
        let mut sum = total.get();
        sum.done += tally.done;
        sum.refused += tally.refused;
        sum.changes += tally.changes;
        total.set(sum);
    });
    let total = total.get();
    println!("{total:?}");
    // the sequences are neither all refused nor all harmless
    assert!(total.done > 50_000, "{total:?}");
    assert!(total.refused > 50_000, "{total:?}");
    assert!(total.changes > 10_000, "{total:?}");
}

/// Pieces of text that readers stumble over.
const PIECES: [&str; 16] = [
    "null",
    "-1",
    "1e999",
    "NaN",
    "\"\"",
    "[]",
    "{}",
    "0",
    "1e-300",
    "4294967296",
    "\\u0000",
    "[[[[[[[[",
    "}",
    ",",
    "\"name\":",
    "true",
];

fn mutate(random: &mut Random, text: &[u8]) -> Vec<u8> {
    let mut out = text.to_vec();
    for _ in 0..1 + random.below(3) {
        let at = random.below(out.len());
        match random.below(12) {
            // the commonest slip: a number with a wrong digit
            6.. => {
                let digits: Vec<usize> = (0..out.len())
                    .filter(|&i| out[i].is_ascii_digit())
                    .collect();
                if let Some(&i) = digits.get(random.below(digits.len())) {
                    out[i] = b'0' + random.below(10) as u8;
                }
            }
            0 => out.truncate(at),
            1 => {
                if let Some(byte) = out.get_mut(at) {
                    *byte = random.next() as u8;
                }
            }
            2 => {
                let end = (at + random.below(40)).min(out.len());
                out.drain(at..end);
            }
            3 => {
                let end = (at + random.below(60)).min(out.len());
                let piece = out[at..end].to_vec();
                let to = random.below(out.len() + 1);
                out.splice(to..to, piece);
            }
            // a whole number or word becomes another
            4 | 5 => {
                let is_word = |b: &u8| b.is_ascii_alphanumeric() || b"-+.".contains(b);
                let start = out[..at]
                    .iter()
                    .rposition(|b| !is_word(b))
                    .map_or(0, |i| i + 1);
                let end = out[at..]
                    .iter()
                    .position(|b| !is_word(b))
                    .map_or(out.len(), |i| at + i);
                let piece = PIECES[random.below(PIECES.len())];
                out.splice(start..end.max(start), piece.bytes());
            }
        }
        if out.is_empty() {
            break;
        }
    }
    out
}

#[test]
fn ten_thousand_mutated_garments_give_a_status_and_a_text() {
    let whole = scene::square(0.1, 0.05).json();
    let sewn = {
        let garment = scene::tunic();
        garment.json().replace("0.045", "0.2")
    };
    let (read, refused) = (std::cell::Cell::new(0), std::cell::Cell::new(0));
    seeds(10_000, |random| {
        let text = if random.below(2) == 0 { &whole } else { &sewn };
        let mutated = mutate(random, text.as_bytes());
        let counter = match calls::read_text(&mutated) {
            0 => &read,
            _ => &refused,
        };
        counter.set(counter.get() + 1);
    });
    println!("{} read, {} refused", read.get(), refused.get());
    assert!(read.get() > 500 && refused.get() > 2000);
}

#[test]
fn random_bytes_are_no_garment() {
    seeds(2000, |random| {
        let length = random.below(300);
        assert_ne!(calls::read_text(&random.bytes(length)), 0);
    });
}
