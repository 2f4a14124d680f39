//! Which stitches a knitted piece has: a chart repeated over a panel's box, or used once.
//!
//! A piece that is knitted to size has `wales` loops in its widest row and `courses` rows between a
//! cast-on and a bind-off course. A chart of plain stitches is repeated and broken off anywhere; one with
//! yarn-overs, decreases or increases is repeated as a whole, with plain knitting for what is left at the two
//! sides.

use super::layout::Cell;
use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::chart::{Face, Stitch};
use crate::pattern::yarn_fabric::Knit;

/// Selvedges reach this far beyond the middle of the outermost loops, in loop widths.
pub(super) const SELVEDGE: f64 = 0.66;
/// The turn below the cast-on course, in loop heights.
pub(super) const CAST_ON_DEPTH: f64 = 0.5;
/// The bind-off course reaches this far above its row, in loop widths.
pub(super) const BIND_OFF_HEIGHT: f64 = 0.1;
/// Cloth left around all of this, in loop widths, so that no node lies on the outline.
pub(super) const MARGIN: f64 = 0.04;
/// Relative slack of sizes, so that a panel made for a number of loops holds them.
const SLACK: f64 = 1e-6;

/// Rows of stitches, the last one binding off, and where loops lie.
pub(super) struct Piece {
    /// Loops of the cast-on course.
    pub cast_on: usize,
    /// Rows, without the cast-on.
    pub rows: Vec<Vec<Stitch>>,
    /// Loops of the widest row.
    pub wales: usize,
    repeat: Option<Repeat>,
}

/// A repeat that is laid as a whole.
struct Repeat {
    /// Plain loops before the first repeat.
    left: usize,
    count: usize,
    /// Loops of its widest row: room for each repeat.
    width: usize,
}

impl Knit {
    /// Size of the panel [m] that holds just this many wales and courses, selvedges included.
    pub fn size(&self, wales: usize, courses: usize) -> Vec2 {
        size(
            [self.loop_width, self.loop_height],
            wales as f64,
            courses as f64,
        )
    }
}

/// From the corner of a piece's box to the middle of the first wale of row 0 [m].
pub(super) fn origin(pitch: [f64; 2]) -> Vec2 {
    let [w, h] = pitch;
    Vec2::new((SELVEDGE + MARGIN) * w, CAST_ON_DEPTH * h + MARGIN * w)
}

/// Size of a piece's box [m].
pub(super) fn size(pitch: [f64; 2], wales: f64, courses: f64) -> Vec2 {
    let [w, h] = pitch;
    let x = 2.0 * origin(pitch).x + (wales - 1.0) * w;
    let y = origin(pitch).y + courses * h + (BIND_OFF_HEIGHT + MARGIN) * w;
    Vec2::new(x, y)
}

/// Loop width and height as laid [m].
pub(super) fn pitch(knit: &Knit, cell: &Cell) -> [f64; 2] {
    [knit.loop_width * cell.across, knit.loop_height * cell.along]
}

/// Wales and courses that a panel of this size holds, before any memory is taken.
pub(super) fn counts(knit: &Knit, cell: &Cell, room: Vec2) -> [f64; 2] {
    let [w, h] = pitch(knit, cell);
    let bare = size([w, h], 0.0, 0.0);
    let fit = |room: f64, bare: f64, step: f64| ((room * (1.0 + SLACK) - bare) / step).floor();
    [fit(room.x, bare.x, w), fit(room.y, bare.y, h)]
}

impl Piece {
    /// The piece that fills this room [m].
    pub(super) fn new(knit: &Knit, cell: &Cell, room: Vec2) -> Result<Self> {
        let [wales, courses] = counts(knit, cell, room);
        if !(wales >= 1.0 && courses >= 1.0) {
            let least = size(pitch(knit, cell), 1.0, 1.0);
            return Err(Error::geometry(format!(
                "{} x {} m is too small to knit: one loop with its selvedges needs {} x {} m",
                room.x, room.y, least.x, least.y
            )));
        }
        let (wales, courses) = (wales as usize, courses as usize);
        if knit.once {
            return Self::once(knit, wales, courses);
        }
        let repeat = knit.chart.resolved(true);
        if knit.chart.is_plain() {
            let row = |r: usize| -> Vec<Stitch> {
                let row = &repeat[r % repeat.len()];
                (0..wales).map(|i| row[i % row.len()]).collect()
            };
            return Ok(Self::bound_off(
                wales,
                (0..courses).map(row).collect(),
                wales,
                None,
            ));
        }
        let takes: usize = repeat[0].iter().map(Stitch::takes).sum();
        let width = repeat.iter().map(|row| makes(row)).fold(takes, usize::max);
        if width > wales {
            return Err(Error::geometry(format!(
                "the repeat of {width} loops does not fit into the panel, which holds {wales} loops across"
            )));
        }
        let (count, plain) = (wales / width, wales % width);
        let (left, right) = (plain / 2, plain - plain / 2);
        let edge = |n: usize| std::iter::repeat_n(Stitch::Plain(Face::Knit), n);
        let row = |r: usize| -> Vec<Stitch> {
            let row = &repeat[r % repeat.len()];
            let repeats = std::iter::repeat_n(row, count).flatten().copied();
            edge(left).chain(repeats).chain(edge(right)).collect()
        };
        let repeat = Repeat { left, count, width };
        let cast_on = plain + count * takes;
        let rows = (0..courses).map(row).collect();
        Ok(Self::bound_off(cast_on, rows, wales, Some(repeat)))
    }

    fn once(knit: &Knit, wales: usize, courses: usize) -> Result<Self> {
        let mut rows = knit.chart.resolved(false);
        let cast_on = if rows[0][0] == Stitch::CastOn {
            rows.remove(0).len()
        } else {
            rows[0].iter().map(Stitch::takes).sum()
        };
        let bound = rows.last().is_some_and(|row| row[0] == Stitch::BindOff);
        let needed = rows.len() - usize::from(bound);
        let widest = rows.iter().map(|row| makes(row)).fold(cast_on, usize::max);
        if widest > wales || needed > courses {
            return Err(Error::geometry(format!(
                "the chart of {widest} loops and {needed} rows is used once and does not fit into the panel, which holds {wales} loops across and {courses} rows"
            )));
        }
        if bound {
            return Ok(Self {
                cast_on,
                rows,
                wales: widest,
                repeat: None,
            });
        }
        Ok(Self::bound_off(cast_on, rows, widest, None))
    }

    fn bound_off(
        cast_on: usize,
        mut rows: Vec<Vec<Stitch>>,
        wales: usize,
        repeat: Option<Repeat>,
    ) -> Self {
        let last = rows.last().map_or(cast_on, |row| makes(row));
        rows.push(vec![Stitch::BindOff; last]);
        Self {
            cast_on,
            rows,
            wales,
            repeat,
        }
    }

    /// Middle of loop `i` of `n` in a row, in loop widths from the middle of the first wale.
    pub(super) fn wale(&self, i: usize, n: usize) -> f64 {
        let middle = |i: usize, n: usize, room: f64| (i as f64 + 0.5) * room / n as f64 - 0.5;
        match &self.repeat {
            None => i as f64 + 0.5 * (self.wales as f64 - n as f64),
            Some(repeat) => {
                let plain = self.wales - repeat.count * repeat.width;
                let each = (n - plain) / repeat.count;
                match i.checked_sub(repeat.left) {
                    None => i as f64,
                    Some(inner) if inner < each * repeat.count => {
                        let first = repeat.left + inner / each * repeat.width;
                        first as f64 + middle(inner % each, each, repeat.width as f64)
                    }
                    Some(_) => (self.wales - n + i) as f64,
                }
            }
        }
    }
}

fn makes(row: &[Stitch]) -> usize {
    row.iter().map(Stitch::makes).sum()
}
