//! `L L^T x = b` by supernodes, with the subtrees of the [elimination tree](super::tree) side by side.
//!
//! Each subtree has a vector of its own unknowns and of the rows above it that it takes from, the rows of its root; what it takes from these is
//! added to the whole in the order of the subtrees.

use super::cholesky::Number;
use super::tree::{Tree, columns, panel, place, rows};
use crate::math::parallel::Workers;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Columns that are taken at once.
const GROUP: usize = 4;

/// Vectors that the solution with a factor needs.
#[derive(Default)]
pub(super) struct Substitution<T> {
    /// For every row below a supernode its place in the vector of the supernode's part.
    places: Vec<u32>,
    /// Subtrees, then the supernodes above them by levels.
    parts: Vec<Part<T>>,
    /// Ends of the levels among the parts.
    ends: Vec<usize>,
}

struct Part<T> {
    nodes: Range<usize>,
    /// The unknowns of these supernodes.
    inside: Range<usize>,
    /// Part of the parent of the last one, itself at a root.
    parent: usize,
    /// Parts whose parent this is.
    children: Vec<usize>,
    /// Places in the parent's vector of the rows above.
    above: Vec<u32>,
    /// The unknowns and the rows above them that they are coupled with, those of the last supernode.
    x: Vec<T>,
    /// Part of a vector below a supernode.
    below: Vec<T>,
}

impl<T: Number> Substitution<T> {
    /// For the supernodes of a pattern.
    pub(super) fn new(symbolic: &SymbolicSupernodalCholesky<u32>, tree: &Tree) -> Self {
        let mut places = symbolic.row_idx().to_vec();
        let (mut parts, mut ends): (Vec<Part<T>>, _) = (Vec::new(), Vec::new());
        let mut part_of = vec![usize::MAX; tree.parent.len()];
        let mut add = |nodes: Range<usize>, parts: &mut Vec<Part<T>>| {
            let Some(last) = nodes.clone().last() else {
                return;
            };
            let inside = columns(symbolic, nodes.start).start..columns(symbolic, last).end;
            let above = panel(symbolic, last).0;
            let mut longest = 0;
            for s in nodes.clone() {
                longest = longest.max(rows(symbolic, s).len());
                let mut at = 0;
                for row in &mut places[rows(symbolic, s)] {
                    *row = place(*row, &inside, above, &mut at);
                }
            }
            part_of[last] = parts.len();
            let children = if nodes.len() == 1 {
                tree.children(last).map(|s| part_of[s]).collect()
            } else {
                Vec::new()
            };
            parts.push(Part {
                nodes,
                parent: parts.len(),
                x: vec![T::of(0.0); inside.len() + above.len()],
                below: vec![T::of(0.0); longest],
                children,
                above: Vec::new(),
                inside,
            });
        };
        for nodes in &tree.subtrees {
            add(nodes.clone(), &mut parts);
        }
        ends.push(parts.len());
        for level in &tree.levels {
            for &s in level {
                add(s..s + 1, &mut parts);
            }
            ends.push(parts.len());
        }
        for k in 0..parts.len() {
            let children = std::mem::take(&mut parts[k].children);
            let inside = parts[k].inside.clone();
            let rows_above = panel(symbolic, parts[k].nodes.end - 1).0;
            for child in &children {
                let child = &mut parts[*child];
                child.parent = k;
                let mut at = 0;
                let own = panel(symbolic, child.nodes.end - 1).0.iter();
                let places = own.map(|row| place(*row, &inside, rows_above, &mut at));
                child.above = places.collect();
            }
            parts[k].children = children;
        }
        Self {
            places,
            parts,
            ends,
        }
    }

    /// `x = L^-T L^-1 x`.
    pub(super) fn solve(
        &mut self,
        symbolic: &SymbolicSupernodalCholesky<u32>,
        factor: &[T],
        x: &mut [T],
        workers: &Workers,
    ) {
        let arch = Arch::new();
        let panels = Panels {
            symbolic,
            places: &self.places,
            factor,
        };
        let right = &*x;
        let mut from = 0;
        for &end in &self.ends {
            let (earlier, rest) = self.parts.split_at_mut(from);
            workers.chunks(&mut rest[..end - from], 1, |_, parts| {
                for part in parts {
                    part.take(right, earlier);
                    arch.dispatch(Forward(part.vectors(panels)));
                }
            });
            from = end;
        }
        for k in (0..self.ends.len()).rev() {
            let begin = if k == 0 { 0 } else { self.ends[k - 1] };
            let first = self.ends[k];
            let (rest, later) = self.parts.split_at_mut(first);
            workers.chunks(&mut rest[begin..], 1, |_, parts| {
                for part in parts {
                    part.follow(later, first);
                    arch.dispatch(Backward(part.vectors(panels)));
                }
            });
        }
        for part in &self.parts {
            x[part.inside.clone()].copy_from_slice(&part.x[..part.inside.len()]);
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let parts: usize = self.parts.iter().map(|p| p.x.len() + p.below.len()).sum();
        size_of::<T>() * parts + 4 * self.places.len()
    }
}

impl<T: Number> Part<T> {
    /// Starts with the right-hand side and with what parts below have taken from it.
    fn take(&mut self, right: &[T], parts: &[Self]) {
        let count = self.inside.len();
        self.x[..count].copy_from_slice(&right[self.inside.clone()]);
        self.x[count..].fill(T::of(0.0));
        for child in &self.children {
            let child = &parts[*child];
            for (place, taken) in child.above.iter().zip(&child.x[child.inside.len()..]) {
                self.x[*place as usize] += *taken;
            }
        }
    }

    /// Copies what the parts above, which begin with number `first`, have found.
    fn follow(&mut self, parts: &[Self], first: usize) {
        let count = self.inside.len();
        for (x, place) in self.x[count..].iter_mut().zip(&self.above) {
            *x = parts[self.parent - first].x[*place as usize];
        }
    }

    fn vectors<'a>(&'a mut self, panels: Panels<'a, T>) -> Vectors<'a, T> {
        Vectors {
            panels,
            nodes: self.nodes.clone(),
            begin: self.inside.start,
            x: &mut self.x,
            below: &mut self.below,
        }
    }
}

/// The panels of a factor, with the places of their rows in the vectors.
struct Panels<'a, T> {
    symbolic: &'a SymbolicSupernodalCholesky<u32>,
    places: &'a [u32],
    factor: &'a [T],
}

impl<T> Clone for Panels<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Panels<'_, T> {}

impl<'a, T> Panels<'a, T> {
    /// Rows below a supernode, its panel and its unknowns in a vector that begins with unknown `begin`.
    #[inline(always)]
    fn get(&self, s: usize, begin: usize) -> (&'a [u32], Panel<'a, T>, Range<usize>) {
        let inside = columns(self.symbolic, s);
        let places = &self.places[rows(self.symbolic, s)];
        let panel = Panel {
            columns: &self.factor[panel(self.symbolic, s).1],
            width: inside.len(),
            height: inside.len() + places.len(),
        };
        (places, panel, inside.start - begin..inside.end - begin)
    }
}

/// What supernodes work on.
struct Vectors<'a, T> {
    panels: Panels<'a, T>,
    nodes: Range<usize>,
    /// First unknown of the vector.
    begin: usize,
    x: &'a mut [T],
    below: &'a mut [T],
}

/// Elimination of the supernodes in their order.
struct Forward<'a, T>(Vectors<'a, T>);
/// Solution for them against their order.
struct Backward<'a, T>(Vectors<'a, T>);

impl<T: Number> WithSimd for Forward<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let at = self.0;
        for s in at.nodes {
            let (places, panel, inside) = at.panels.get(s, at.begin);
            let below = &mut at.below[..places.len()];
            below.fill(T::of(0.0));
            let inside = &mut at.x[inside];
            let mut j = 0;
            while j + GROUP <= panel.width {
                panel.forward::<GROUP>(j, inside, below);
                j += GROUP;
            }
            match panel.width - j {
                1 => panel.forward::<1>(j, inside, below),
                2 => panel.forward::<2>(j, inside, below),
                3 => panel.forward::<3>(j, inside, below),
                _ => {}
            }
            for (b, place) in below.iter().zip(places) {
                at.x[*place as usize] -= *b;
            }
        }
    }
}

impl<T: Number> WithSimd for Backward<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let at = self.0;
        for s in at.nodes.rev() {
            let (places, panel, inside) = at.panels.get(s, at.begin);
            let below = &mut at.below[..places.len()];
            for (b, place) in below.iter_mut().zip(places) {
                *b = at.x[*place as usize];
            }
            let inside = &mut at.x[inside];
            let mut j = panel.width - panel.width % GROUP;
            match panel.width - j {
                1 => panel.backward::<S, 1>(simd, j, inside, below),
                2 => panel.backward::<S, 2>(simd, j, inside, below),
                3 => panel.backward::<S, 3>(simd, j, inside, below),
                _ => {}
            }
            while j > 0 {
                j -= GROUP;
                panel.backward::<S, GROUP>(simd, j, inside, below);
            }
        }
    }
}

/// The panel of a supernode: the columns of its unknowns, each with all rows. Plain loops over a few of them at a time beat the general
/// dense kernels for one right-hand side and narrow panels.
struct Panel<'a, T> {
    columns: &'a [T],
    width: usize,
    height: usize,
}

impl<'a, T: Number> Panel<'a, T> {
    /// `K` columns from the one of unknown `j` on, each from row `j` on.
    #[inline(always)]
    fn group<const K: usize>(&self, j: usize) -> [&'a [T]; K] {
        std::array::from_fn(|k| &self.columns[(j + k) * self.height + j..(j + k + 1) * self.height])
    }

    /// Eliminates unknowns `j..j + K`.
    #[inline(always)]
    fn forward<const K: usize>(&self, j: usize, inside: &mut [T], below: &mut [T]) {
        let columns = self.group::<K>(j);
        // all quotients at once: none waits for another
        let inverse: [T; K] = std::array::from_fn(|k| T::of(1.0) / columns[k][k]);
        let (solved, rest) = inside[j..].split_at_mut(K);
        let mut values = [T::of(0.0); K];
        for k in 0..K {
            let mut value = solved[k];
            for i in 0..k {
                value -= columns[i][k] * values[i];
            }
            values[k] = value * inverse[k];
        }
        solved.copy_from_slice(&values);
        let (inner, outer) = (
            columns.map(|c| &c[K..][..rest.len()]),
            columns.map(|c| &c[self.width - j..][..below.len()]),
        );
        for (i, x) in rest.iter_mut().enumerate() {
            for k in 0..K {
                *x -= inner[k][i] * values[k];
            }
        }
        for (i, x) in below.iter_mut().enumerate() {
            for k in 0..K {
                *x += outer[k][i] * values[k];
            }
        }
    }

    /// Solves for unknowns `j..j + K` when all after them are known.
    #[inline(always)]
    fn backward<S: Simd, const K: usize>(&self, simd: S, j: usize, inside: &mut [T], below: &[T]) {
        let columns = self.group::<K>(j);
        let inverse: [T; K] = std::array::from_fn(|k| T::of(1.0) / columns[k][k]);
        let (solved, rest) = inside[j..].split_at_mut(K);
        let inner = T::dots(simd, columns.map(|c| &c[K..][..rest.len()]), rest);
        let outer = T::dots(simd, columns.map(|c| &c[self.width - j..]), below);
        for k in (0..K).rev() {
            let mut value = solved[k] - inner[k] - outer[k];
            for i in k + 1..K {
                value -= columns[k][i] * solved[i];
            }
            solved[k] = value * inverse[k];
        }
    }
}
