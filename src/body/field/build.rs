//! Sampling a field, and updating it where triangles have moved.
//!
//! An update takes over what no moved triangle can have changed. All nodes of a brick whose centre
//! was `d` away from the surface have their nearest triangle within `d + 2 r` of the centre (`r`:
//! half the brick's diagonal); if nothing that moved lay or lies within that reach, their distances
//! are the same numbers. Their signs come from lattice rows and are decided anew where a moved
//! triangle crosses one of the brick's rows, before or after. All else is sampled from the triangles.

use super::plan::{RADIUS, band, check_bytes, mark, plan};
use super::{Brick, Field, Level, NONE};
use crate::body::nearby::Sampler;
use crate::body::sign::{self, Blocks, Rows};
use crate::body::tree::{Moved, Tree};
use crate::error::Result;
use crate::math::Vec3;
use crate::math::parallel::Workers;
use std::sync::Arc;

/// What a stored brick was made from, kept for updates.
#[derive(Debug, Default)]
struct Samples {
    /// Distance of the brick's centre [m].
    centers: Vec<f64>,
    /// Signed distances of the nodes.
    distances: Vec<Brick>,
    /// Nodes inside, one bit each.
    inside: Vec<u64>,
    /// Whether a sign was left open by the rows.
    open: Vec<bool>,
}

/// The field of the mesh as created and what updates need of it.
#[derive(Debug)]
pub(in crate::body) struct Origin {
    pub(in crate::body) field: Arc<Field>,
    samples: Vec<Samples>,
}

/// A mesh at given positions.
#[derive(Clone, Copy)]
pub(in crate::body) struct Source<'a> {
    pub(in crate::body) positions: &'a [Vec3],
    pub(in crate::body) triangles: &'a [[u32; 3]],
    pub(in crate::body) tree: &'a Tree,
}

/// The mesh as created, and which triangles differ.
#[derive(Clone, Copy)]
struct Before<'a> {
    origin: &'a Origin,
    source: Source<'a>,
    moved: &'a Moved,
}

/// A level of the field of the mesh as created.
#[derive(Clone, Copy)]
struct Old<'a> {
    level: &'a Level,
    samples: &'a Samples,
}

/// One brick on its way.
#[derive(Clone)]
struct Draft {
    brick: [i64; 3],
    /// Slot in the origin whose distances hold, or `NONE`.
    kept: u32,
    /// Whether the signs have to be found.
    signs: bool,
    stored: bool,
    /// Distance of the centre.
    center: f64,
    inside: u64,
    open: bool,
    distances: Option<Box<Brick>>,
}

/// Builds a field; with `before`, takes over what moved triangles do not reach.
fn assemble(
    source: Source<'_>,
    h: f64,
    workers: &Workers,
    before: Option<Before<'_>>,
) -> Result<(Field, Vec<Samples>)> {
    let bounds = source.tree.bounds();
    let (mut levels, lo, hi) = plan(bounds, h, source.triangles.len())?;
    let mut all = Vec::new();
    let mut taken = 0.0;
    let count = levels.len();
    for l in 0..count {
        let s = levels[l].h;
        let band = band(l, count, s);
        let old = before.and_then(|b| {
            Some(Old {
                level: b.origin.field.levels.get(l)?,
                samples: &b.origin.samples[l],
            })
        });
        let level = &levels[l];
        let near = candidates(level, source, band, before, old);
        let bricks = near.iter().filter(|&&m| m).count() as f64;
        taken += bricks * (3.0 * 256.0 + 160.0);
        let size = bounds.1 - bounds.0;
        check_bytes(taken, "its bricks", h, &size, source.triangles.len())?;
        let mut drafts = Vec::with_capacity(bricks as usize);
        for i in (0..near.len()).filter(|&i| near[i]) {
            let n = level.n;
            let brick = [i / (n[1] * n[2]), i / n[2] % n[1], i % n[2]];
            let brick = [0, 1, 2].map(|d| brick[d] as i64 + level.lo[d]);
            drafts.push(Draft {
                brick,
                kept: old.map_or(NONE, |o| o.level.slot(brick)),
                signs: true,
                stored: true,
                center: 0.0,
                inside: 0,
                open: false,
                distances: None,
            });
        }
        measure_centers(&mut drafts, level, source, band, before, old, workers);
        drafts.retain(|d| d.stored);
        let wanted = rows_wanted(&mut drafts, level, source, before, old);
        let rows = Rows::new(
            source.positions,
            source.triangles,
            bounds,
            s,
            wanted.as_ref(),
            workers,
        );
        workers.chunks(&mut drafts, 16, |_, part| {
            let mut sampler = Sampler::new(source.tree);
            for draft in part {
                sample(draft, level, &rows, source, old, &mut sampler);
            }
        });
        all.push(finish(&mut levels[l], drafts, old, workers));
    }
    Ok((Field { levels, lo, hi }, all))
}

/// Bricks that may be stored: all that are near triangles; for an update those near moved triangles
/// and those stored before.
fn candidates(
    level: &Level,
    source: Source<'_>,
    band: f64,
    before: Option<Before<'_>>,
    old: Option<Old<'_>>,
) -> Vec<bool> {
    if band == f64::INFINITY {
        return vec![true; level.slots.len()];
    }
    let (Some(before), Some(old)) = (before, old) else {
        let boxes = source.triangles.iter().map(|t| box_of(source.positions, t));
        return mark(level, boxes, band);
    };
    let moved = source
        .triangles
        .iter()
        .filter(|t| before.differs(source, t))
        .map(|t| box_of(source.positions, t));
    let mut near = mark(level, moved, band);
    for &brick in &old.level.bricks {
        if (0..3).all(|d| (0..level.n[d] as i64).contains(&(brick[d] - level.lo[d]))) {
            near[level.index(brick)] = true;
        }
    }
    near
}

/// Finds which bricks are stored, and of which the distances are kept.
fn measure_centers(
    drafts: &mut [Draft],
    level: &Level,
    source: Source<'_>,
    band: f64,
    before: Option<Before<'_>>,
    old: Option<Old<'_>>,
    workers: &Workers,
) {
    workers.chunks(drafts, 32, |_, part| {
        let mut sampler = Sampler::new(source.tree);
        for draft in part {
            let c = level.center(draft.brick);
            if let (Some(before), Some(old)) = (before, old.filter(|_| draft.kept != NONE)) {
                let center = old.samples.centers[draft.kept as usize];
                if !before.reaches(source, &c, center + 2.0 * RADIUS * level.h) {
                    draft.center = center;
                    draft.stored = center <= band;
                    continue;
                }
            }
            draft.kept = NONE;
            let center = sampler.distance(&c, band);
            draft.stored = center.is_some();
            draft.center = center.unwrap_or(f64::NAN);
        }
    });
}

/// Decides for which kept bricks signs have to be found anew; returns the rows that this takes, or
/// nothing when it takes all of them.
fn rows_wanted(
    drafts: &mut [Draft],
    level: &Level,
    source: Source<'_>,
    before: Option<Before<'_>>,
    old: Option<Old<'_>>,
) -> Option<Blocks> {
    let (before, old) = (before?, old?);
    let mut touched = Blocks::new(level.lo, level.n);
    for t in source
        .triangles
        .iter()
        .filter(|t| before.differs(source, t))
    {
        for positions in [before.source.positions, source.positions] {
            let (lo, hi) = box_of(positions, t);
            touched.mark_box(&lo, &hi, level.h);
        }
    }
    let mut wanted = Blocks::new(level.lo, level.n);
    for draft in drafts {
        draft.signs = draft.kept == NONE
            || old.samples.open[draft.kept as usize]
            || touched.touches(draft.brick);
        if draft.signs {
            wanted.mark_brick(draft.brick);
        }
    }
    Some(wanted)
}

/// Signs and distances of a stored brick.
fn sample(
    draft: &mut Draft,
    level: &Level,
    rows: &[Rows; 3],
    source: Source<'_>,
    old: Option<Old<'_>>,
    sampler: &mut Sampler<'_>,
) {
    let old = old.filter(|_| draft.kept != NONE);
    if draft.signs {
        let (inside, open) = sign::vote(rows, draft.brick, level.h);
        draft.inside = inside;
        draft.open = open != 0;
        for n in (0..64).filter(|n| open >> n & 1 == 1) {
            let p = level.node(draft.brick, n);
            let winding = sign::winding_number(source.positions, source.triangles, &p);
            draft.inside |= u64::from(winding > 0.5) << n;
        }
    } else if let Some(old) = old {
        draft.inside = old.samples.inside[draft.kept as usize];
        draft.open = old.samples.open[draft.kept as usize];
    }
    let mut distances = match old {
        Some(old) if old.samples.inside[draft.kept as usize] == draft.inside => return,
        // a part of the mesh that swept over the brick turned its sign
        Some(old) => old.samples.distances[draft.kept as usize].map(f32::abs),
        None => {
            let c = level.center(draft.brick);
            let node = |n| level.node(draft.brick, n);
            let found = sampler.brick(&c, draft.center, level.h, node);
            found.map(|d| d as f32)
        }
    };
    draft.kept = NONE;
    for (n, d) in distances.iter_mut().enumerate() {
        if draft.inside >> n & 1 == 1 {
            *d = -*d;
        }
    }
    draft.distances = Some(Box::new(distances));
}

/// Numbers the bricks, gathers samples, computes coefficients.
fn finish(
    level: &mut Level,
    drafts: Vec<Draft>,
    old: Option<Old<'_>>,
    workers: &Workers,
) -> Samples {
    let mut samples = Samples::default();
    let mut kept = Vec::with_capacity(drafts.len());
    level.bricks.reserve_exact(drafts.len());
    samples.distances.reserve_exact(drafts.len());
    for (slot, draft) in drafts.into_iter().enumerate() {
        let index = level.index(draft.brick);
        level.slots[index] = slot as u32;
        level.bricks.push(draft.brick);
        samples.centers.push(draft.center);
        samples.inside.push(draft.inside);
        samples.open.push(draft.open);
        samples.distances.push(match (draft.distances, old) {
            (Some(new), _) => *new,
            (None, Some(old)) => old.samples.distances[draft.kept as usize],
            // a stored brick has distances of its own or an origin's
            (None, None) => [f32::NAN; 64],
        });
        kept.push(draft.kept);
    }
    let mut coefficients = vec![[0.0f32; 64]; level.bricks.len()];
    {
        let (level, samples, kept) = (&*level, &samples, &kept);
        workers.chunks(&mut coefficients, 256, |chunk, part| {
            for (i, out) in part.iter_mut().enumerate() {
                let slot = chunk * 256 + i;
                let beside = |f: usize| {
                    let mut b = level.bricks[slot];
                    b[f / 2] += if f & 1 == 0 { -1 } else { 1 };
                    b
                };
                let around: [u32; 6] = std::array::from_fn(|f| level.slot(beside(f)));
                // a kept brick among kept neighbours keeps its coefficients
                if let Some(old) = old.filter(|_| kept[slot] != NONE) {
                    let same = (0..6).all(|f| {
                        let then = old.level.slot(beside(f));
                        match around[f] {
                            NONE => then == NONE,
                            now => kept[now as usize] != NONE && kept[now as usize] == then,
                        }
                    });
                    if same {
                        *out = old.level.coefficients[kept[slot] as usize];
                        continue;
                    }
                }
                correct(slot, &around, &samples.distances, out);
            }
        });
    }
    level.coefficients = coefficients;
    samples
}

/// Coefficients `f - 1/8 sum_d delta_d^2 f`; where a neighbour is not stored the second difference
/// of the next node inside the brick serves.
fn correct(slot: usize, around: &[u32; 6], f: &[Brick], out: &mut Brick) {
    let own = &f[slot];
    for n in 0..64usize {
        let mut sum = 0.0;
        for d in 0..3 {
            let stride = 1usize << (4 - 2 * d);
            let i = (n / stride) & 3;
            let base = n - i * stride;
            let at = |m: usize| f64::from(own[base + m * stride]);
            sum += match (i, around[2 * d], around[2 * d + 1]) {
                (0, NONE, _) => at(0) - 2.0 * at(1) + at(2),
                (0, left, _) => {
                    f64::from(f[left as usize][base + 3 * stride]) - 2.0 * at(0) + at(1)
                }
                (3, _, NONE) => at(1) - 2.0 * at(2) + at(3),
                (3, _, right) => at(2) - 2.0 * at(3) + f64::from(f[right as usize][base]),
                _ => at(i - 1) - 2.0 * at(i) + at(i + 1),
            };
        }
        out[n] = (f64::from(own[n]) - 0.125 * sum) as f32;
    }
}

fn box_of(positions: &[Vec3], t: &[u32; 3]) -> (Vec3, Vec3) {
    let [a, b, c] = t.map(|v| positions[v as usize]);
    (a.inf(&b).inf(&c), a.sup(&b).sup(&c))
}

impl Before<'_> {
    /// Whether a triangle stands elsewhere.
    fn differs(&self, now: Source<'_>, t: &[u32; 3]) -> bool {
        t.iter()
            .any(|&v| self.source.positions[v as usize] != now.positions[v as usize])
    }

    /// Whether a moved triangle may have been or be within reach of a point.
    fn reaches(&self, now: Source<'_>, p: &Vec3, reach: f64) -> bool {
        self.source.tree.moved_within(p, reach, self.moved)
            || now.tree.moved_within(p, reach, self.moved)
    }
}

impl Origin {
    /// Field of a mesh as created, with finest spacing `h` [m].
    pub(in crate::body) fn new(source: Source<'_>, h: f64, workers: &Workers) -> Result<Self> {
        let (field, samples) = assemble(source, h, workers, None)?;
        Ok(Self {
            field: Arc::new(field),
            samples,
        })
    }

    /// Field of the mesh at other positions: the bits that `new` would give there. `created` is the
    /// mesh that this was made of.
    pub(in crate::body) fn updated(
        &self,
        created: Source<'_>,
        source: Source<'_>,
        moved: &Moved,
        workers: &Workers,
    ) -> Result<Field> {
        let before = Before {
            origin: self,
            source: created,
            moved,
        };
        // where all is to be sampled there is nothing to compare
        let before = Some(before).filter(|_| moved.count() < source.triangles.len());
        Ok(assemble(source, self.field.cell_size(), workers, before)?.0)
    }
}
