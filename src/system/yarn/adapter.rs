//! Kernels as terms: gathers a stencil's scalars from blocks of unknowns or from constants, scatters
//! derivatives to the blocks.
//!
//! A stencil's blocks are those of its nodes and then those of its sliding coordinates, each once; two
//! coordinates may lie in one block. Stencils are grouped by their number of blocks, a term for
//! each; a stencil of coordinates alone that do not slide has no unknowns and is left out, its
//! energy a constant. Where triangles have a part in the cloth an energy has the weight of its nodes' `alpha`
//! ([`YarnMesh::weight`]).

use super::super::state::State;
use super::super::term::{Configuration, HessianKind, MaxStep, Stencils, Term};
use super::kernel::{Damped, Kernel, Local, Lower, MAX_POSITIONS, MAX_SLIDES};
use super::unknowns::Unknowns;
use crate::math::{Mat3, Vec3};
use crate::yarn::YarnMesh;
use std::sync::Arc;

/// Place of a scalar that is no unknown.
const FROZEN: u8 = u8::MAX;

/// A kernel and the scalars that it acts on.
pub(super) struct Stencil<K> {
    /// Its nodes; only the first `POSITIONS` count.
    pub(super) nodes: [u32; MAX_POSITIONS],
    /// Incidences of its material coordinates; only as many count as the kernel has.
    pub(super) incidences: [u32; MAX_SLIDES],
    /// Its energy.
    pub(super) kernel: K,
}

struct Element<K, const N: usize> {
    kernel: K,
    /// Damping in this step.
    start: Damped,
    /// Part of the energy that is the yarns'.
    weight: f64,
    incidences: [u32; MAX_SLIDES],
    /// Three times the block plus the component of each scalar among the stencil's blocks.
    place: [u8; N],
}

/// All stencils of one kernel with the same number of blocks.
pub struct YarnTerm<K, const N: usize> {
    arity: usize,
    blocks: Vec<u32>,
    elements: Vec<Element<K, N>>,
    /// Distances of images' coordinates from their own, by incidence; empty without images.
    shifts: Arc<[Option<f64>]>,
}

/// Terms of all stencils, one for each number of blocks that occurs.
pub(super) fn terms<K: Kernel<N> + 'static, const N: usize>(
    unknowns: &Unknowns,
    mesh: &YarnMesh,
    stencils: impl IntoIterator<Item = Stencil<K>>,
) -> Vec<Box<dyn Term>> {
    let mut groups: Vec<YarnTerm<K, N>> = (0..=MAX_POSITIONS + MAX_SLIDES)
        .map(|arity| YarnTerm {
            arity,
            blocks: Vec::new(),
            elements: Vec::new(),
            shifts: unknowns.shifts.clone(),
        })
        .collect();
    for stencil in stencils {
        let mut blocks = [0; MAX_POSITIONS + MAX_SLIDES];
        let mut arity = 0;
        let mut place = [FROZEN; N];
        let mut local = |block: u32| {
            let known = blocks[..arity].iter().position(|&b| b == block);
            known.unwrap_or_else(|| {
                blocks[arity] = block;
                arity += 1;
                arity - 1
            }) as u8
        };
        for p in 0..K::POSITIONS {
            let b = local(unknowns.node(stencil.nodes[p]));
            for c in 0..3 {
                place[3 * p + c] = 3 * b + c as u8;
            }
        }
        for k in 3 * K::POSITIONS..N {
            let incidence = stencil.incidences[k - 3 * K::POSITIONS];
            if let Some((block, component)) = unknowns.slides[incidence as usize] {
                place[k] = 3 * local(block) + component;
            }
        }
        let on = stencil.incidences.map(|i| mesh.incidences[i as usize].node);
        let nodes = if K::POSITIONS > 0 {
            &stencil.nodes[..K::POSITIONS]
        } else {
            &on[..N]
        };
        if !mesh.reaches(nodes) {
            continue;
        }
        let weight = mesh.weight(nodes);
        let group = &mut groups[arity];
        group.blocks.extend_from_slice(&blocks[..arity]);
        group.elements.push(Element {
            kernel: stencil.kernel,
            start: Damped::default(),
            weight,
            incidences: stencil.incidences,
            place,
        });
    }
    groups
        .into_iter()
        .skip(1)
        .filter(|g| !g.elements.is_empty())
        .map(|g| Box::new(g) as Box<dyn Term>)
        .collect()
}

impl<K: Kernel<N>, const N: usize> YarnTerm<K, N> {
    #[inline]
    fn gather(&self, e: usize, from: &[Vec3], u: &[f64]) -> [f64; N] {
        let element = &self.elements[e];
        let blocks = &self.blocks[self.arity * e..][..self.arity];
        let mut q = [0.0; N];
        for p in 0..K::POSITIONS {
            let x = &from[blocks[usize::from(element.place[3 * p] / 3)] as usize];
            q[3 * p] = x.x;
            q[3 * p + 1] = x.y;
            q[3 * p + 2] = x.z;
        }
        for k in 3 * K::POSITIONS..N {
            let place = element.place[k];
            q[k] = if place == FROZEN {
                u[element.incidences[k - 3 * K::POSITIONS] as usize]
            } else {
                let incidence = element.incidences[k - 3 * K::POSITIONS] as usize;
                let shift = self.shifts.get(incidence).copied().flatten();
                let own = from[blocks[usize::from(place / 3)] as usize][usize::from(place % 3)];
                shift.map_or(own, |shift| own + shift)
            };
        }
        q
    }

    fn with<R>(
        &self,
        e: usize,
        at: &Configuration<'_>,
        f: impl FnOnce(&K, &Local<'_, N>) -> R,
    ) -> R {
        let q = self.gather(e, at.x, at.u);
        let q0 = if K::LOOKS_BACK {
            self.gather(e, at.x0, at.u)
        } else {
            [0.0; N]
        };
        let Element { kernel, start, .. } = &self.elements[e];
        let local = Local {
            q: &q,
            q0: &q0,
            start: *start,
            inv_dt: at.inv_dt,
            gravity: at.world.gravity,
        };
        f(kernel, &local)
    }

    fn spread_gradient(&self, e: usize, g: &[f64; N], out: &mut [Vec3]) {
        out.fill(Vec3::zeros());
        let Element { weight, place, .. } = &self.elements[e];
        for (place, g) in place.iter().zip(g) {
            if *place != FROZEN {
                out[usize::from(place / 3)][usize::from(place % 3)] += g * weight;
            }
        }
    }

    fn spread_hessian(&self, e: usize, h: &Lower<N>, out: &mut [Mat3]) {
        let Element { weight, place, .. } = &self.elements[e];
        out.fill(Mat3::zeros());
        for p in 0..K::POSITIONS {
            for r in 0..=p {
                let (i, j) = (usize::from(place[3 * p] / 3), usize::from(place[3 * r] / 3));
                let mut m = Mat3::zeros();
                for a in 0..3 {
                    for b in 0..3 {
                        m[(a, b)] = weight
                            * if p == r && b > a {
                                h[3 * p + b][3 * p + a]
                            } else {
                                h[3 * p + a][3 * r + b]
                            };
                    }
                }
                let slot = &mut out[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)];
                if i > j || p == r {
                    *slot += m;
                } else if i < j {
                    *slot += m.transpose();
                } else {
                    // a node that is in the stencil twice
                    *slot += m + m.transpose();
                }
            }
        }
        for k in 3 * K::POSITIONS..N {
            if place[k] == FROZEN {
                continue;
            }
            let (i, a) = (usize::from(place[k] / 3), usize::from(place[k] % 3));
            for l in 0..=k {
                if place[l] == FROZEN {
                    continue;
                }
                let (j, b) = (usize::from(place[l] / 3), usize::from(place[l] % 3));
                let slot = &mut out[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)];
                let second = weight * h[k][l];
                if i >= j {
                    slot[(a, b)] += second;
                } else {
                    slot[(b, a)] += second;
                }
                // a coordinate that is in the stencil twice, itself and its image, has both halves
                if i == j && (a != b || k != l) {
                    slot[(b, a)] += second;
                }
            }
        }
    }
}

impl<K: Kernel<N>, const N: usize> Term for YarnTerm<K, N> {
    fn name(&self) -> &'static str {
        K::NAME
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: self.arity,
            vertices: &self.blocks,
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.blocks[..]) + size_of_val(&self.elements[..])
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        self.with(e, at, |kernel, local| kernel.value(local)) * self.elements[e].weight
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let mut g = [0.0; N];
        self.with(e, at, |kernel, local| kernel.gradient(local, &mut g));
        self.spread_gradient(e, &g, out);
    }

    fn hessian(&self, e: usize, at: &Configuration<'_>, kind: HessianKind, out: &mut [Mat3]) {
        let (mut g, mut h) = ([0.0; N], [[0.0; N]; N]);
        self.with(e, at, |kernel, local| {
            kernel.derivatives(local, kind.exactness(), &mut g, &mut h);
        });
        self.spread_hessian(e, &h, out);
    }

    fn derivatives(
        &self,
        e: usize,
        at: &Configuration<'_>,
        kind: HessianKind,
        gradient: &mut [Vec3],
        hessian: &mut [Mat3],
    ) {
        let (mut g, mut h) = ([0.0; N], [[0.0; N]; N]);
        self.with(e, at, |kernel, local| {
            kernel.derivatives(local, kind.exactness(), &mut g, &mut h);
        });
        self.spread_gradient(e, &g, gradient);
        self.spread_hessian(e, &h, hessian);
    }

    fn is_idle(&self, at: &Configuration<'_>) -> bool {
        K::is_idle(at.inv_dt)
    }

    fn has_hessian(&self, kind: HessianKind) -> bool {
        !(K::LINEAR && (self.arity == K::POSITIONS || kind.exactness() == 0.0))
    }

    fn is_internal(&self) -> bool {
        K::INTERNAL
    }

    fn begin_step(&mut self, state: &State, at: &Configuration<'_>) -> bool {
        if K::DAMPED {
            for e in 0..self.elements.len() {
                self.elements[e].start = if at.inv_dt > 0.0 {
                    let q0 = self.gather(e, at.x0, at.u);
                    self.elements[e].kernel.start(&q0, at.inv_dt)
                } else {
                    Damped::default()
                };
            }
        }
        if !K::LAGGED {
            return false;
        }
        for e in 0..self.elements.len() {
            let q0 = self.gather(e, at.x0, at.u);
            let local = Local {
                q: &q0,
                q0: &q0,
                start: Damped::default(),
                inv_dt: at.inv_dt,
                gravity: at.world.gravity,
            };
            let blocks = &self.blocks[self.arity * e..][..self.arity];
            let element = &mut self.elements[e];
            let mut rates = [0.0; N];
            for k in 0..N {
                let place = element.place[k];
                if k < 3 * K::POSITIONS {
                    let block = blocks[usize::from(place / 3)] as usize;
                    rates[k] = state.velocities[block][usize::from(place % 3)];
                } else if place != FROZEN {
                    rates[k] = state.u_rates[element.incidences[k - 3 * K::POSITIONS] as usize];
                }
            }
            element.kernel.begin(&local, &rates, state);
        }
        false
    }

    fn max_step(&self, at: &Configuration<'_>) -> MaxStep {
        let mut least = MaxStep::default();
        if !K::BOUNDS {
            return least;
        }
        for (e, element) in self.elements.iter().enumerate() {
            let part = self.with(e, at, K::bound);
            if part < least.part {
                let blocks = &self.blocks[self.arity * e..][..self.arity];
                let points = [0, 3].map(|k| blocks[usize::from(element.place[k] / 3)]);
                least = MaxStep { part, points };
            }
        }
        least
    }

    fn accept(&mut self, at: &Configuration<'_>, state: &mut State) {
        if K::LAGGED {
            for e in 0..self.elements.len() {
                self.with(e, at, |kernel, local| kernel.accept(local, state));
            }
        }
    }
}
