//! The panels of a factor as they are kept: tiles of [`SIDE`] rows.
//!
//! The panel of a supernode has the columns of its unknowns. They are taken in groups of [`SIDE`], the last ones by half as many
//! where no more are left. A group has its own rows and all rows after them; the unknowns and the rows below them are each filled up with
//! zeros to whole tiles. A tile is stored column by column. The first tile of a group has the inverse of the triangle there:
//! no unknown of the group waits for another one, and there are no quotients.
//!
//! A vector of a supernode has its unknowns and then the rows below, filled up in the same way.

use super::LinearError;
use super::cholesky::Number;
use std::ops::Range;

/// Rows of a tile, and columns of a group.
pub(super) const SIDE: usize = 8;
const HALF: usize = SIDE / 2;

/// Rows of a tile in a vector.
pub(super) type Rows<T> = [T; SIDE];
/// A column of a tile as it is kept.
type Column<T> = [<T as Number>::Stored; SIDE];
/// The inverse of a triangle, column by column.
type Inverse<T> = [Rows<T>; SIDE];

/// The tiles of all supernodes.
pub(super) struct Tiles<T: Number> {
    shapes: Vec<Shape>,
    /// Where the columns and the groups of each supernode begin, and their numbers.
    begins: Vec<[usize; 2]>,
    columns: Vec<Column<T>>,
    inverses: Vec<Inverse<T>>,
}

impl<T: Number> Default for Tiles<T> {
    fn default() -> Self {
        Self {
            shapes: Vec::new(),
            begins: Vec::new(),
            columns: Vec::new(),
            inverses: Vec::new(),
        }
    }
}

impl<T: Number> Tiles<T> {
    /// For the panels of these shapes, in the memory of `self`; what they hold has no meaning.
    pub(super) fn reshaped(self, shapes: Vec<Shape>) -> Result<Self, LinearError> {
        let (mut begins, mut end) = (vec![[0; 2]], [0; 2]);
        for shape in &shapes {
            end = [end[0] + shape.len(), end[1] + shape.groups()];
            begins.push(end);
        }
        let Self {
            mut columns,
            mut inverses,
            ..
        } = self;
        columns.truncate(end[0]);
        inverses.truncate(end[1]);
        let refused = |_| LinearError::NoConvergence;
        let more = [end[0] - columns.len(), end[1] - inverses.len()];
        columns.try_reserve_exact(more[0]).map_err(refused)?;
        inverses.try_reserve_exact(more[1]).map_err(refused)?;
        columns.resize(end[0], [T::Stored::default(); SIDE]);
        inverses.resize(end[1], [[T::of(0.0); SIDE]; SIDE]);
        Ok(Self {
            shapes,
            begins,
            columns,
            inverses,
        })
    }

    /// The panel of a supernode.
    #[inline(always)]
    pub(super) fn panel(&self, s: usize) -> Panel<'_, T> {
        let ([from, first], [to, last]) = (self.begins[s], self.begins[s + 1]);
        Panel {
            shape: self.shapes[s],
            columns: &self.columns[from..to],
            inverses: &self.inverses[first..last],
        }
    }

    /// All panels, to be written.
    pub(super) fn rest(&mut self) -> Rest<'_, T> {
        Rest {
            shapes: &self.shapes,
            columns: &mut self.columns,
            inverses: &mut self.inverses,
        }
    }

    /// Stored numbers, zeros that fill tiles up included.
    pub(super) fn len(&self) -> usize {
        SIDE * (self.columns.len() + SIDE * self.inverses.len())
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.shapes[..])
            + size_of_val(&self.begins[..])
            + size_of_val(&self.columns[..])
            + size_of_val(&self.inverses[..])
    }
}

/// Panels of supernodes in their order, to be written.
pub(super) struct Rest<'a, T: Number> {
    shapes: &'a [Shape],
    columns: &'a mut [Column<T>],
    inverses: &'a mut [Inverse<T>],
}

impl<'a, T: Number> Rest<'a, T> {
    /// Takes the first `count` away.
    pub(super) fn take(&mut self, count: usize) -> Self {
        let (shapes, rest) = self.shapes.split_at(count);
        self.shapes = rest;
        let columns = shapes.iter().map(|shape| shape.len()).sum();
        let groups = shapes.iter().map(|shape| shape.groups()).sum();
        Self {
            shapes,
            columns: first(&mut self.columns, columns),
            inverses: first(&mut self.inverses, groups),
        }
    }

    /// Keeps the panel of the first one, whose columns have all rows each, and goes on to the next.
    pub(super) fn keep(&mut self, panel: &[T]) {
        let one = self.take(1);
        if let [shape] = one.shapes {
            shape.keep(panel, one.columns, one.inverses);
        }
    }
}

/// Takes the first elements of a slice away from it.
fn first<'a, U>(rest: &mut &'a mut [U], count: usize) -> &'a mut [U] {
    let (own, after) = std::mem::take(rest).split_at_mut(count);
    *rest = after;
    own
}

/// What a panel is made of.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    /// Unknowns.
    pub(super) width: usize,
    /// Rows below them.
    pub(super) below: usize,
}

impl Shape {
    /// Groups of columns, which is where the rows below begin in a vector.
    pub(super) fn groups(self) -> usize {
        self.width.div_ceil(SIDE)
    }

    /// Tiles of a vector.
    pub(super) fn tiles(self) -> usize {
        self.groups() + self.below.div_ceil(SIDE)
    }

    /// Columns that a group is stored with.
    fn columns(self, group: usize) -> usize {
        if self.width - SIDE * group <= HALF {
            HALF
        } else {
            SIDE
        }
    }

    /// Where the columns of the tiles after the first of a group are.
    fn group(self, group: usize) -> Range<usize> {
        let tiles = self.tiles();
        // all groups before are whole
        let begin = SIDE * (group * (tiles - 1) - group * group.saturating_sub(1) / 2);
        begin..begin + (tiles - 1 - group) * self.columns(group)
    }

    /// Columns of all these tiles.
    pub(super) fn len(self) -> usize {
        match self.groups() {
            0 => 0,
            groups => self.group(groups - 1).end,
        }
    }

    fn keep<T: Number>(self, panel: &[T], kept: &mut [Column<T>], inverses: &mut [Inverse<T>]) {
        let Self { width, below } = self;
        let height = width + below;
        for (group, first) in inverses.iter_mut().enumerate() {
            let (columns, from) = (self.columns(group), SIDE * group);
            let count = columns.min(width - from);
            *first = inverse(&panel[from * height + from..], height, count);
            let rest = &mut kept[self.group(group)];
            for k in 0..columns {
                let mut tiles = rest.iter_mut().skip(k).step_by(columns);
                if k >= count {
                    tiles.for_each(|to| *to = [T::Stored::default(); SIDE]);
                    continue;
                }
                let column = &panel[(from + k) * height..(from + k + 1) * height];
                let (inside, below) = column.split_at(width);
                for part in [inside.get(from + SIDE..).unwrap_or_default(), below] {
                    let (whole, last) = part.as_chunks::<SIDE>();
                    for (rows, to) in whole.iter().zip(&mut tiles) {
                        *to = rows.map(T::stored);
                    }
                    if !last.is_empty()
                        && let Some(to) = tiles.next()
                    {
                        *to = [T::Stored::default(); SIDE];
                        for (to, value) in to.iter_mut().zip(last) {
                            *to = value.stored();
                        }
                    }
                }
            }
        }
    }
}

/// Inverse of the lower triangle of the first `count` columns, column by column.
fn inverse<T: Number>(columns: &[T], height: usize, count: usize) -> Inverse<T> {
    let mut out = [[T::of(0.0); SIDE]; SIDE];
    for j in 0..count {
        out[j][j] = T::of(1.0) / columns[j * height + j];
        for i in j + 1..count {
            let mut sum = T::of(0.0);
            for k in j..i {
                sum += columns[k * height + i] * out[j][k];
            }
            out[j][i] = -sum / columns[i * height + i];
        }
    }
    out
}

/// What is kept of the panel of a supernode.
#[derive(Clone, Copy)]
pub(super) struct Panel<'a, T: Number> {
    pub(super) shape: Shape,
    columns: &'a [Column<T>],
    inverses: &'a [Inverse<T>],
}

impl<'a, T: Number> Panel<'a, T> {
    /// The first tile of a group of `K` columns, and the others.
    #[inline(always)]
    fn group<const K: usize>(&self, group: usize) -> Group<'a, T, K> {
        let columns = &self.columns[self.shape.group(group)];
        (&self.inverses[group], columns.as_chunks::<K>().0)
    }

    /// Eliminates the unknowns of a vector, and takes them from the rows below.
    #[inline(always)]
    pub(super) fn forward(&self, x: &mut [Rows<T>]) {
        for group in 0..self.shape.groups() {
            let x = &mut x[group..];
            match self.shape.columns(group) {
                SIDE => eliminate(self.group::<SIDE>(group), x),
                _ => eliminate(self.group::<HALF>(group), x),
            }
        }
    }

    /// Solves for the unknowns of a vector when what is below is known.
    #[inline(always)]
    pub(super) fn backward(&self, x: &mut [Rows<T>]) {
        for group in (0..self.shape.groups()).rev() {
            let x = &mut x[group..];
            match self.shape.columns(group) {
                SIDE => substitute(self.group::<SIDE>(group), x),
                _ => substitute(self.group::<HALF>(group), x),
            }
        }
    }

    /// [`Self::forward`] for several right-hand sides; `x` has a row for each one of the tiles.
    #[inline(always)]
    pub(super) fn forward_all(&self, x: &mut [Right<T>]) {
        for group in 0..self.shape.groups() {
            let x = &mut x[SIDE * group..];
            match self.shape.columns(group) {
                SIDE => eliminate_all(self.group::<SIDE>(group), x),
                _ => eliminate_all(self.group::<HALF>(group), x),
            }
        }
    }

    /// [`Self::backward`] for several right-hand sides; `x` has a row for each one of the tiles.
    #[inline(always)]
    pub(super) fn backward_all(&self, x: &mut [Right<T>]) {
        for group in (0..self.shape.groups()).rev() {
            let x = &mut x[SIDE * group..];
            match self.shape.columns(group) {
                SIDE => substitute_all(self.group::<SIDE>(group), x),
                _ => substitute_all(self.group::<HALF>(group), x),
            }
        }
    }
}

type Group<'a, T, const K: usize> = (&'a Inverse<T>, &'a [[Column<T>; K]]);

#[inline(always)]
fn eliminate<T: Number, const K: usize>((first, tiles): Group<'_, T, K>, x: &mut [Rows<T>]) {
    if let [own, rest @ ..] = x {
        let mut values = [T::of(0.0); SIDE];
        for k in 0..K {
            for l in 0..SIDE {
                values[l] += first[k][l] * own[k];
            }
        }
        *own = values;
        for (tile, x) in tiles.iter().zip(rest) {
            let mut taken = [T::of(0.0); SIDE];
            for k in 0..K {
                for l in 0..SIDE {
                    taken[l] += T::loaded(tile[k][l]) * values[k];
                }
            }
            for l in 0..SIDE {
                x[l] -= taken[l];
            }
        }
    }
}

#[inline(always)]
fn substitute<T: Number, const K: usize>((first, tiles): Group<'_, T, K>, x: &mut [Rows<T>]) {
    if let [own, rest @ ..] = x {
        let mut sums = [[T::of(0.0); SIDE]; K];
        // the memory of all tiles is read in one direction
        for (tile, x) in tiles.iter().zip(&rest[..tiles.len()]).rev() {
            for k in 0..K {
                sums[k] = plus(sums[k], &tile[k], x);
            }
        }
        let (mut left, taken) = (*own, totals(sums));
        for l in 0..SIDE {
            left[l] -= taken[l];
        }
        for k in 0..K {
            for l in 0..SIDE {
                sums[k][l] = first[k][l] * left[l];
            }
        }
        *own = totals(sums);
    }
}

/// Adds products row by row.
#[inline(always)]
fn plus<T: Number>(mut sum: Rows<T>, column: &Column<T>, x: &Rows<T>) -> Rows<T> {
    for l in 0..SIDE {
        sum[l] += T::loaded(column[l]) * x[l];
    }
    sum
}

/// The sum of each column, zeros after the last one.
#[inline(always)]
fn totals<T: Number, const K: usize>(sums: [Rows<T>; K]) -> Rows<T> {
    let mut out = [T::of(0.0); SIDE];
    for k in 0..K {
        let s = &sums[k];
        out[k] = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
    }
    out
}

/// Values of several right-hand sides in one row.
pub(super) type Right<T> = [T; SIDE];

#[inline(always)]
fn eliminate_all<T: Number, const K: usize>((first, tiles): Group<'_, T, K>, x: &mut [Right<T>]) {
    let (own, rest) = x.split_at_mut(SIDE);
    let mut values = [[T::of(0.0); SIDE]; SIDE];
    for k in 0..K {
        for r in 0..SIDE {
            for l in 0..SIDE {
                values[r][l] += first[k][r] * own[k][l];
            }
        }
    }
    own.copy_from_slice(&values);
    for (tile, x) in tiles.iter().zip(rest.chunks_exact_mut(SIDE)) {
        for (r, x) in x.iter_mut().enumerate() {
            for k in 0..K {
                let entry = T::loaded(tile[k][r]);
                for l in 0..SIDE {
                    x[l] -= entry * values[k][l];
                }
            }
        }
    }
}

#[inline(always)]
fn substitute_all<T: Number, const K: usize>((first, tiles): Group<'_, T, K>, x: &mut [Right<T>]) {
    let (own, rest) = x.split_at_mut(SIDE);
    for (tile, x) in tiles.iter().zip(rest.chunks_exact(SIDE)) {
        for k in 0..K {
            for r in 0..SIDE {
                let entry = T::loaded(tile[k][r]);
                for l in 0..SIDE {
                    own[k][l] -= entry * x[r][l];
                }
            }
        }
    }
    let mut values = [[T::of(0.0); SIDE]; SIDE];
    for k in 0..K {
        for r in 0..SIDE {
            for l in 0..SIDE {
                values[k][l] += first[k][r] * own[r][l];
            }
        }
    }
    own.copy_from_slice(&values);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A panel with a dominant diagonal, and a vector.
    fn panel(shape: Shape) -> (Vec<f64>, Vec<f64>) {
        let height = shape.width + shape.below;
        let mut panel = vec![0.0; shape.width * height];
        for j in 0..shape.width {
            for i in j..height {
                panel[j * height + i] = ((7 * i + 3 * j) as f64).sin();
            }
            panel[j * height + j] = 2.0 + (j as f64).cos();
        }
        (panel, (0..height).map(|i| (i as f64 * 0.3).cos()).collect())
    }

    #[test]
    fn tiles_solve_as_the_panel_does() {
        for (width, below) in [
            (1, 0),
            (3, 5),
            (4, 8),
            (5, 1),
            (8, 9),
            (12, 22),
            (17, 3),
            (32, 40),
        ] {
            let shape = Shape { width, below };
            let height = width + below;
            let (panel, start) = panel(shape);
            let mut tiles = Tiles::<f64>::default().reshaped(vec![shape]).unwrap();
            tiles.rest().keep(&panel);
            let kept = tiles.panel(0);
            let at = |i: usize| match i.checked_sub(width) {
                None => i,
                Some(b) => SIDE * shape.groups() + b,
            };
            let mut x = vec![[0.0; SIDE]; shape.tiles()];
            for i in 0..height {
                x.as_flattened_mut()[at(i)] = start[i];
            }
            let mut all: Vec<Right<f64>> = (x.as_flattened().iter())
                .map(|v| std::array::from_fn(|l| v * (l + 1) as f64))
                .collect();
            // by columns
            let mut plain = start.clone();
            for j in 0..width {
                plain[j] /= panel[j * height + j];
                for i in j + 1..height {
                    plain[i] -= panel[j * height + i] * plain[j];
                }
            }
            let same = |plain: &[f64], x: &[Rows<f64>], all: &[Right<f64>]| {
                for i in 0..height {
                    let (value, scale) = (x.as_flattened()[at(i)], 1.0 + plain[i].abs());
                    assert!(
                        (value - plain[i]).abs() < 1e-9 * scale,
                        "{width} {below}: {value} {}",
                        plain[i]
                    );
                    for l in 0..SIDE {
                        let value = all[at(i)][l] / (l + 1) as f64;
                        assert!((value - plain[i]).abs() < 1e-9 * scale);
                    }
                }
            };
            kept.forward(&mut x);
            kept.forward_all(&mut all);
            same(&plain, &x, &all);
            for j in (0..width).rev() {
                for i in j + 1..height {
                    plain[j] -= panel[j * height + i] * plain[i];
                }
                plain[j] /= panel[j * height + j];
            }
            kept.backward(&mut x);
            kept.backward_all(&mut all);
            same(&plain, &x, &all);
        }
    }
}
