//! Stitch maps: which loops each stitch of a knitted piece takes up and makes, row by row.
//!
//! Rows go from the bottom up, stitches from left to right, both as seen from the front: what a
//! knitter works on the back is turned round by the reader ([`worked`]). A row takes up exactly the
//! loops that the row below makes. Two notations are read: grids of symbols ([`grid`]) and the
//! knitter's instructions ([`worked`]).

pub mod grid;
mod presets;
pub mod worked;

use crate::error::{Error, Result};
pub use presets::PRESETS;

/// Most loops that one stitch takes up or makes.
pub const MAX_STACK: usize = 5;
/// Most rows of a chart, and most stitches of a row.
pub const MAX_SIDE: usize = 10_000;
/// Most stitches of a chart.
pub const MAX_STITCHES: usize = 1_000_000;

/// Which way a loop comes through the loop below, seen from the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// From the back to the front.
    Knit,
    /// From the front to the back.
    Purl,
}

/// Loops worked as one, from the front to the back: places from the left, 0 first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stack {
    count: u8,
    order: [u8; MAX_STACK],
}

/// Loops made out of one, from the left; `None` is a yarn-over between two of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fan {
    count: u8,
    loops: [Option<Face>; MAX_STACK],
}

/// One stitch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stitch {
    /// A loop of the first row.
    CastOn,
    /// A loop through one loop.
    Plain(Face),
    /// The yarn laid without a loop below.
    Over,
    /// A loop through the yarn between two stitches of the row below (m1).
    Lifted(Face),
    /// One loop through several (a decrease).
    Together(Face, Stack),
    /// Several loops through one (an increase).
    Into(Fan),
    /// The last turn of yarn through a loop.
    BindOff,
}

/// How a chart was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notation {
    /// One symbol a stitch, as the front looks, bottom row first.
    Grid,
    /// Instructions row by row as worked, sides alternating.
    Worked,
}

/// A stitch map that has passed its checks.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    notation: Notation,
    source: Vec<String>,
    rows: Vec<Vec<Stitch>>,
}

impl Face {
    /// As it looks from the other side of the cloth.
    #[must_use]
    pub fn turned(self) -> Self {
        match self {
            Self::Knit => Self::Purl,
            Self::Purl => Self::Knit,
        }
    }
}

impl Stack {
    /// `count` loops, 2 to 5, with the leftmost in front: k2tog, k3tog.
    pub fn leaning_right(count: usize) -> Self {
        Self::from_order(count, |k| k)
    }

    /// `count` loops with the rightmost in front: ssk, sssk.
    pub fn leaning_left(count: usize) -> Self {
        Self::from_order(count, |k| count - 1 - k)
    }

    /// The rightmost slipped over the others, which are knitted together: SK2P.
    pub fn slipped_over(count: usize) -> Self {
        Self::from_order(count, |k| if k == 0 { count - 1 } else { k - 1 })
    }

    /// The middle one in front: the right half, slipped as one, goes over the left half.
    pub fn central(count: usize) -> Self {
        Self::from_order(count, |k| (k + count / 2) % count)
    }

    fn from_order(count: usize, place: impl Fn(usize) -> usize) -> Self {
        let count = count.clamp(2, MAX_STACK);
        let mut order = [0; MAX_STACK];
        for (k, entry) in order.iter_mut().enumerate().take(count) {
            *entry = place(k) as u8;
        }
        Self {
            count: count as u8,
            order,
        }
    }

    /// Places of the loops, counted from the left, from the front to the back.
    pub fn order(&self) -> &[u8] {
        &self.order[..self.count as usize]
    }

    /// As it looks from the other side of the cloth: left and right, front and back change.
    #[must_use]
    pub fn turned(&self) -> Self {
        let count = self.count as usize;
        Self::from_order(count, |k| count - 1 - self.order[count - 1 - k] as usize)
    }
}

impl Fan {
    /// 1 to 5 loops; the outer two are no yarn-overs.
    fn new(list: &[Option<Face>]) -> Self {
        let count = list.len().min(MAX_STACK);
        let mut loops = [None; MAX_STACK];
        loops[..count].copy_from_slice(&list[..count]);
        Self {
            count: count as u8,
            loops,
        }
    }

    /// The loops, from the left.
    pub fn loops(&self) -> &[Option<Face>] {
        &self.loops[..self.count as usize]
    }

    fn turned(&self) -> Self {
        let mut loops = *self;
        loops.loops[..self.count as usize].reverse();
        loops.loops = loops.loops.map(|face| face.map(Face::turned));
        loops
    }
}

impl Stitch {
    /// Loops of the row below that it takes up.
    pub fn takes(&self) -> usize {
        match self {
            Self::CastOn | Self::Over | Self::Lifted(_) => 0,
            Self::Plain(_) | Self::Into(_) | Self::BindOff => 1,
            Self::Together(_, stack) => stack.count as usize,
        }
    }

    /// Loops that it makes for the row above.
    pub fn makes(&self) -> usize {
        match self {
            Self::BindOff => 0,
            Self::Into(fan) => fan.count as usize,
            _ => 1,
        }
    }

    /// As it looks from the other side of the cloth.
    #[must_use]
    pub fn turned(&self) -> Self {
        match *self {
            Self::Plain(face) => Self::Plain(face.turned()),
            Self::Lifted(face) => Self::Lifted(face.turned()),
            Self::Together(face, stack) => Self::Together(face.turned(), stack.turned()),
            Self::Into(fan) => Self::Into(fan.turned()),
            Self::CastOn | Self::Over | Self::BindOff => *self,
        }
    }
}

/// An error in the chart, places counted from 1.
fn refuse(row: usize, column: usize, text: impl std::fmt::Display) -> Error {
    Error::parse(format!("row {row} column {column}: {text}"))
}

/// Loops that a row takes up and makes.
fn balance(row: &[Stitch]) -> [usize; 2] {
    [
        row.iter().map(Stitch::takes).sum(),
        row.iter().map(Stitch::makes).sum(),
    ]
}

/// Refuses a row that does not take up just what the row below makes. `columns[k]` is the place of
/// stitch `k` in the text.
fn check_balance(row: usize, stitches: &[Stitch], columns: &[usize], below: usize) -> Result<()> {
    let mut taken = 0;
    for (stitch, column) in stitches.iter().zip(columns) {
        taken += stitch.takes();
        if taken > below {
            return Err(refuse(
                row,
                *column,
                format!("takes up loop {taken}, the row below makes {below}"),
            ));
        }
    }
    if taken < below {
        let last = columns.last().copied().unwrap_or(1);
        return Err(refuse(
            row,
            last,
            format!("the row takes up {taken} loops, the row below makes {below}"),
        ));
    }
    Ok(())
}

impl Chart {
    /// Checks rows with the places of their stitches in the text.
    fn build(
        notation: Notation,
        source: Vec<String>,
        rows: Vec<Vec<Stitch>>,
        columns: &[Vec<usize>],
    ) -> Result<Self> {
        if rows.is_empty() {
            return Err(refuse(1, 1, "the chart has no rows"));
        }
        let total = rows.len();
        let mut stitches = 0;
        for (r, (row, places)) in rows.iter().zip(columns).enumerate() {
            let number = r + 1;
            stitches += row.len();
            if row.is_empty() {
                return Err(refuse(number, 1, "the row has no stitches"));
            }
            if stitches > MAX_STITCHES {
                return Err(refuse(
                    number,
                    1,
                    format!("{stitches} stitches, limit {MAX_STITCHES}"),
                ));
            }
            for (stitch, column) in row.iter().zip(places) {
                let (what, allowed) = match stitch {
                    Stitch::CastOn => ("cast-on", r == 0),
                    Stitch::BindOff => ("bind-off", r + 1 == total),
                    _ => continue,
                };
                if !allowed || row.iter().any(|other| other != stitch) {
                    let which = if what == "cast-on" { "first" } else { "last" };
                    return Err(refuse(
                        number,
                        *column,
                        format!("{what} must fill the {which} row of the chart, and no other"),
                    ));
                }
            }
            if r > 0 {
                check_balance(number, row, places, balance(&rows[r - 1])[1])?;
            }
        }
        Ok(Self {
            notation,
            source,
            rows,
        })
    }

    /// Rows from the bottom, stitches from the left, seen from the front.
    pub fn rows(&self) -> &[Vec<Stitch>] {
        &self.rows
    }

    /// How it was written.
    pub fn notation(&self) -> Notation {
        self.notation
    }

    /// The lines that it was read from.
    pub fn source(&self) -> &[String] {
        &self.source
    }

    /// Refuses a chart that cannot stand above and beside itself: the first row takes up what the
    /// last one makes, and nothing is cast on or bound off.
    pub fn check_repeat(&self) -> Result<()> {
        let last = self.rows.len();
        for (r, row) in self.rows.iter().enumerate() {
            if matches!(row[0], Stitch::CastOn | Stitch::BindOff) {
                return Err(refuse(
                    r + 1,
                    1,
                    "a chart that repeats cannot cast on or bind off",
                ));
            }
        }
        let ([taken, _], [_, made]) = (balance(&self.rows[0]), balance(&self.rows[last - 1]));
        if taken != made {
            return Err(refuse(
                1,
                1,
                format!("the row takes up {taken} loops, row {last} below its repeat makes {made}"),
            ));
        }
        Ok(())
    }

    /// Whether every stitch is one loop through one loop, so that any part of a row is balanced.
    pub fn is_plain(&self) -> bool {
        let plain = |stitch: &Stitch| matches!(stitch, Stitch::Plain(_));
        self.rows.iter().flatten().all(plain)
    }

    /// The rows with every lifted loop written out: a yarn-over in the row below, where the yarn is
    /// lifted, and a plain stitch through it. `repeats` says whether the last row lies below the
    /// first.
    pub fn resolved(&self, repeats: bool) -> Vec<Vec<Stitch>> {
        let mut rows = self.rows.clone();
        for r in (0..rows.len()).rev() {
            let mut lifts = Vec::new();
            let mut taken = 0;
            for stitch in &mut rows[r] {
                if let Stitch::Lifted(face) = *stitch {
                    lifts.push(taken);
                    *stitch = Stitch::Plain(face);
                } else {
                    taken += stitch.takes();
                }
            }
            let below = match r.checked_sub(1) {
                Some(below) => below,
                None if repeats => rows.len() - 1,
                None => continue,
            };
            if lifts.is_empty() {
                continue;
            }
            let bar = match rows[below].first() {
                Some(Stitch::CastOn) => Stitch::CastOn,
                _ => Stitch::Over,
            };
            let old = std::mem::take(&mut rows[below]);
            let mut lifts = lifts.into_iter().peekable();
            let mut made = 0;
            for stitch in old {
                while lifts.next_if(|at| *at <= made).is_some() {
                    rows[below].push(bar);
                }
                made += stitch.makes();
                rows[below].push(stitch);
            }
            rows[below].extend(lifts.map(|_| bar));
        }
        rows
    }
}
