//! `L L^T x = b` by supernodes, with the subtrees of the [elimination tree](super::tree) side by side.
//!
//! Each subtree has a vector of its own unknowns and of the rows above it that it takes from, the rows of its root; what it takes from these is
//! added to the whole in the order of the subtrees.

use super::cholesky::Number;
use super::tiles::{Right, Rows, SIDE, Shape, Tiles};
use super::tree::{Tree, columns, panel, place, rows};
use crate::math::parallel::Workers;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

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
    /// The vector of a supernode.
    own: Vec<Rows<T>>,
}

impl<T: Number> Substitution<T> {
    /// For the supernodes of a pattern.
    pub(super) fn new(
        symbolic: &SymbolicSupernodalCholesky<u32>,
        tree: &Tree,
        tiles: &Tiles<T>,
    ) -> Self {
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
                longest = longest.max(tiles.panel(s).shape.tiles());
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
                own: vec![[T::of(0.0); SIDE]; longest],
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
    pub(super) fn solve(&mut self, factor: Factor<'_, T>, x: &mut [T], workers: &Workers) {
        let arch = Arch::new();
        let panels = Panels {
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
        let parts: usize = (self.parts.iter())
            .map(|p| p.x.len() + SIDE * p.own.len())
            .sum();
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
            own: &mut self.own,
        }
    }
}

/// A factor: its supernodes and their tiles.
pub(super) struct Factor<'a, T: Number> {
    pub(super) symbolic: &'a SymbolicSupernodalCholesky<u32>,
    pub(super) tiles: &'a Tiles<T>,
}

impl<T: Number> Clone for Factor<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: Number> Copy for Factor<'_, T> {}

impl<T: Number> Factor<'_, T> {
    /// `X = L^-T L^-1 X` for several right-hand sides.
    pub(super) fn solve_all(self, x: &mut [Right<T>]) {
        Arch::new().dispatch(All { factor: self, x });
    }
}

/// The factor with the places of its rows in the vectors of parts.
struct Panels<'a, T: Number> {
    factor: Factor<'a, T>,
    places: &'a [u32],
}

impl<T: Number> Clone for Panels<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: Number> Copy for Panels<'_, T> {}

/// What supernodes work on.
struct Vectors<'a, T: Number> {
    panels: Panels<'a, T>,
    nodes: Range<usize>,
    /// First unknown of the vector.
    begin: usize,
    x: &'a mut [T],
    own: &'a mut [Rows<T>],
}

/// Elimination of the supernodes in their order.
struct Forward<'a, T: Number>(Vectors<'a, T>);
/// Solution for them against their order.
struct Backward<'a, T: Number>(Vectors<'a, T>);

impl<T: Number> WithSimd for Forward<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Vectors {
            panels: Panels { factor, places },
            nodes,
            begin,
            x,
            own,
        } = self.0;
        for s in nodes {
            let panel = factor.tiles.panel(s);
            let shape = panel.shape;
            let first = columns(factor.symbolic, s).start - begin;
            let own = &mut own[..shape.tiles()];
            let below = load(own, shape, &x[first..first + shape.width]);
            below.fill(T::of(0.0));
            panel.forward(own);
            let (unknowns, below) = parts(own, shape);
            x[first..first + shape.width].copy_from_slice(&unknowns[..shape.width]);
            for (b, place) in below.iter().zip(&places[rows(factor.symbolic, s)]) {
                x[*place as usize] += *b;
            }
        }
    }
}

impl<T: Number> WithSimd for Backward<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Vectors {
            panels: Panels { factor, places },
            nodes,
            begin,
            x,
            own,
        } = self.0;
        for s in nodes.rev() {
            let panel = factor.tiles.panel(s);
            let shape = panel.shape;
            let first = columns(factor.symbolic, s).start - begin;
            let own = &mut own[..shape.tiles()];
            let below = load(own, shape, &x[first..first + shape.width]);
            below[shape.below..].fill(T::of(0.0));
            for (b, place) in below.iter_mut().zip(&places[rows(factor.symbolic, s)]) {
                *b = x[*place as usize];
            }
            panel.backward(own);
            let (unknowns, _) = parts(own, shape);
            x[first..first + shape.width].copy_from_slice(&unknowns[..shape.width]);
        }
    }
}

/// Writes the unknowns of a supernode's vector and tells the rows below.
#[inline(always)]
fn load<'a, T: Number>(own: &'a mut [Rows<T>], shape: Shape, x: &[T]) -> &'a mut [T] {
    let (unknowns, below) = parts(own, shape);
    let (own, rest) = unknowns.split_at_mut(shape.width);
    own.copy_from_slice(x);
    rest.fill(T::of(0.0));
    below
}

/// The unknowns of a supernode's vector and the rows below.
#[inline(always)]
fn parts<T>(own: &mut [Rows<T>], shape: Shape) -> (&mut [T], &mut [T]) {
    own.as_flattened_mut().split_at_mut(SIDE * shape.groups())
}

/// Both for all supernodes and several right-hand sides.
struct All<'a, T: Number> {
    factor: Factor<'a, T>,
    x: &'a mut [Right<T>],
}

impl<T: Number> WithSimd for All<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { factor, x } = self;
        let symbolic = factor.symbolic;
        let zero = [T::of(0.0); SIDE];
        let mut own = Vec::new();
        for s in 0..symbolic.n_supernodes() {
            let tiles = factor.tiles.panel(s);
            let shape = tiles.shape;
            let (inside, below) = (columns(symbolic, s), panel(symbolic, s).0);
            own.clear();
            own.extend_from_slice(&x[inside.clone()]);
            own.resize(SIDE * shape.tiles(), zero);
            tiles.forward_all(&mut own);
            x[inside].copy_from_slice(&own[..shape.width]);
            for (row, taken) in below.iter().zip(&own[SIDE * shape.groups()..]) {
                for (x, taken) in x[*row as usize].iter_mut().zip(taken) {
                    *x += *taken;
                }
            }
        }
        for s in (0..symbolic.n_supernodes()).rev() {
            let tiles = factor.tiles.panel(s);
            let shape = tiles.shape;
            let (inside, below) = (columns(symbolic, s), panel(symbolic, s).0);
            own.clear();
            own.extend_from_slice(&x[inside.clone()]);
            own.resize(SIDE * shape.groups(), zero);
            own.extend(below.iter().map(|row| x[*row as usize]));
            own.resize(SIDE * shape.tiles(), zero);
            tiles.backward_all(&mut own);
            x[inside].copy_from_slice(&own[..shape.width]);
        }
    }
}
