//! Charts as a knitter's instructions: words with counts, rows as worked, `turn` between them.
//!
//! ```text
//! co 13 turn
//! p 13 turn
//! k 1 * yo 1 k2tog 1 k 1 * 3 turn
//! bo 13
//! ```
//!
//! The first row is worked on the front, from the right to the left; `turn` shows the other side.
//! Seen from the front a row of the back runs from the left to the right, its knit stitches are purls, and
//! the stacks of its decreases are turned round. `* ... * N` works what stands between the stars `N`
//! times; a count that is left out is 1. Words that begin with `!` are labels, `#` begins a comment.

use super::{Chart, Face, Fan, MAX_SIDE, Notation, Stack, Stitch, refuse};
use crate::error::Result;

/// The stitch of a word, as seen from the side on which it is worked.
fn stitch(word: &str) -> Option<Stitch> {
    use Face::{Knit, Purl};
    let together = |face, stack| Some(Stitch::Together(face, stack));
    match word {
        "co" => Some(Stitch::CastOn),
        "bo" => Some(Stitch::BindOff),
        "k" => Some(Stitch::Plain(Knit)),
        "p" => Some(Stitch::Plain(Purl)),
        "yo" => Some(Stitch::Over),
        "m1" => Some(Stitch::Lifted(Knit)),
        "m1p" => Some(Stitch::Lifted(Purl)),
        "k2tog" => together(Knit, Stack::leaning_right(2)),
        "k3tog" => together(Knit, Stack::leaning_right(3)),
        "k4tog" => together(Knit, Stack::leaning_right(4)),
        "k5tog" => together(Knit, Stack::leaning_right(5)),
        "ssk" | "skp" => together(Knit, Stack::leaning_left(2)),
        "sssk" => together(Knit, Stack::leaning_left(3)),
        "sk2p" => together(Knit, Stack::slipped_over(3)),
        "s2kp" | "cdd" => together(Knit, Stack::central(3)),
        // the back of these looks like the front of k2tog, k3tog, ssk
        "p2tog" => together(Purl, Stack::leaning_right(2).turned()),
        "p3tog" => together(Purl, Stack::leaning_right(3).turned()),
        "ssp" => together(Purl, Stack::leaning_left(2).turned()),
        "kfb" => Some(Stitch::Into(Fan::new(&[Some(Knit); 2]))),
        "pfb" => Some(Stitch::Into(Fan::new(&[Some(Purl); 2]))),
        "kyok" => Some(Stitch::Into(Fan::new(&[Some(Knit), None, Some(Knit)]))),
        _ => None,
    }
}

/// A word, with its place in its row.
struct Word<'a> {
    text: &'a str,
    column: usize,
}

/// Rows of words between the turns; a comment runs to the end of its line.
fn split(text: &str) -> Vec<Vec<Word<'_>>> {
    let mut rows = vec![Vec::new()];
    let mut column = 0;
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default();
        for word in line.split_whitespace().filter(|w| !w.starts_with('!')) {
            if word.eq_ignore_ascii_case("turn") {
                rows.push(Vec::new());
                column = 0;
            } else {
                column += 1;
                let at = rows.len() - 1;
                rows[at].push(Word { text: word, column });
            }
        }
    }
    // after the last turn nothing need follow
    if rows.last().is_some_and(Vec::is_empty) {
        rows.pop();
    }
    rows
}

/// A count of at least 1 if the next word is a number, else 1.
fn count(row: usize, words: &[Word<'_>], at: &mut usize) -> Result<usize> {
    let Some(word) = words.get(*at) else {
        return Ok(1);
    };
    if !word.text.starts_with(|c: char| c.is_ascii_digit()) {
        return Ok(1);
    }
    *at += 1;
    match word.text.parse::<usize>() {
        Ok(n) if (1..=MAX_SIDE).contains(&n) => Ok(n),
        _ => Err(refuse(
            row,
            word.column,
            format!(
                "the count {:?} must be a whole number from 1 to {MAX_SIDE}",
                short(word.text)
            ),
        )),
    }
}

fn short(text: &str) -> String {
    text.chars().take(20).collect()
}

/// Stitches of one row in the order of working, with the columns of their words.
fn row_of(row: usize, words: &[Word<'_>]) -> Result<Vec<(Stitch, usize)>> {
    let mut out: Vec<(Stitch, usize)> = Vec::new();
    let mut star = None;
    let mut at = 0;
    while let Some(word) = words.get(at) {
        at += 1;
        let (from, times) = if word.text == "*" {
            let Some((from, _)) = star.take() else {
                star = Some((out.len(), word.column));
                continue;
            };
            if from == out.len() {
                let reason = "no stitch between the stars";
                return Err(refuse(row, word.column, reason));
            }
            (from, count(row, words, &mut at)? - 1)
        } else {
            let Some(stitch) = stitch(&word.text.to_ascii_lowercase()) else {
                return Err(refuse(
                    row,
                    word.column,
                    format!("unknown word {:?}", short(word.text)),
                ));
            };
            out.push((stitch, word.column));
            (out.len() - 1, count(row, words, &mut at)? - 1)
        };
        let part = out.len() - from;
        if out.len() + part * times > MAX_SIDE {
            return Err(refuse(
                row,
                word.column,
                format!("more than {MAX_SIDE} stitches in the row"),
            ));
        }
        for _ in 0..times {
            out.extend_from_within(from..from + part);
        }
    }
    if let Some((_, column)) = star {
        return Err(refuse(row, column, "the star has no second star"));
    }
    Ok(out)
}

impl Chart {
    /// Reads instructions; errors name the row, counted as worked, and the word in it.
    pub fn from_worked(text: &str) -> Result<Self> {
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        for (r, words) in split(text).iter().enumerate() {
            if r >= MAX_SIDE {
                return Err(refuse(r + 1, 1, format!("more than {MAX_SIDE} rows")));
            }
            let mut row = row_of(r + 1, words)?;
            if r % 2 == 0 {
                row.reverse();
            } else {
                for (stitch, _) in &mut row {
                    *stitch = stitch.turned();
                }
            }
            let (row, places) = row.into_iter().unzip();
            rows.push(row);
            columns.push(places);
        }
        let source = text.lines().map(str::to_owned).collect();
        Self::build(Notation::Worked, source, rows, &columns)
    }
}
