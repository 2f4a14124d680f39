//! Refuses yarn meshes that contradict themselves or their garment.

use super::region::Region;
use super::{Family, Wrap, YarnMesh};
use crate::error::{Error, Result};
use crate::pattern::Garment;

/// Relative difference of lengths that rounding explains.
const ROUNDING: f64 = 1e-9;
/// Nodes may lie this far outside [m]: polygons stand in for curves.
const OUTSIDE: f64 = 1e-4;

fn refuse<T>(text: impl Into<String>) -> Result<T> {
    Err(Error::geometry(text.into()))
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
}

impl YarnMesh {
    /// Checks every index, order and length: `u` grows along each yarn; every incidence stands in the
    /// stack of its node and in no other; yarns are frozen at their ends and at nodes of one yarn; what
    /// joins incidences joins neighbours of one yarn.
    pub fn check(&self) -> Result<()> {
        self.check_sizes()?;
        self.check_yarns()?;
        self.check_stacks()?;
        self.check_contacts()?;
        self.check_crossings()
    }

    /// [`YarnMesh::check`], and that nodes lie on the panels and yarns are of the garment's fabrics.
    pub fn check_on(&self, garment: &Garment) -> Result<()> {
        self.check()?;
        let regions = garment
            .panels
            .iter()
            .map(Region::new)
            .collect::<Result<Vec<_>>>()?;
        for (k, (uv, panel)) in self.uv.iter().zip(&self.node_panel).enumerate() {
            let Some(region) = regions.get(*panel as usize) else {
                return refuse(format!("node {k}: panel {panel} of {}", regions.len()));
            };
            let p = region.to_frame(*uv);
            if !region.inside(p)
                && region
                    .nearest(p)
                    .is_none_or(|(distance, _)| distance > OUTSIDE)
            {
                return refuse(format!(
                    "node {k} at ({}, {}) m lies outside of panel '{}'",
                    uv.x, uv.y, garment.panels[*panel as usize].name
                ));
            }
        }
        for (y, fabric) in self.yarn_fabric.iter().enumerate() {
            let known = garment.fabrics.get(*fabric as usize);
            if known.is_none_or(|f| f.yarns.is_none()) {
                return refuse(format!("yarn {y}: fabric {fabric} has no yarns"));
            }
        }
        Ok(())
    }

    fn check_sizes(&self) -> Result<()> {
        let (nodes, yarns) = (self.uv.len(), self.yarn_count());
        for (name, has, wants) in [
            ("lift", self.lift.len(), nodes),
            ("node_panel", self.node_panel.len(), nodes),
            ("stack_starts", self.stack_starts.len(), nodes + 1),
            ("stacks", self.stacks.len(), self.incidences.len()),
            ("starts", self.starts.len(), yarns + 1),
            ("yarn_family", self.yarn_family.len(), yarns),
        ] {
            if has != wants {
                return refuse(format!("{name} has {has} entries, must have {wants}"));
            }
        }
        for (name, starts, total) in [
            ("starts", &self.starts, self.incidences.len()),
            ("stack_starts", &self.stack_starts, self.stacks.len()),
        ] {
            let grows = starts.windows(2).all(|w| w[0] <= w[1]);
            if !grows || starts[0] != 0 || starts[starts.len() - 1] as usize != total {
                return refuse(format!("{name} must grow from 0 to {total}"));
            }
        }
        for (k, (uv, lift)) in self.uv.iter().zip(&self.lift).enumerate() {
            if !(uv.x.is_finite() && uv.y.is_finite() && lift.is_finite()) {
                return refuse(format!("node {k} at ({}, {}, {lift})", uv.x, uv.y));
            }
        }
        if ![0, nodes].contains(&self.outside.len()) {
            return refuse(format!(
                "outside has {} entries, must have none or {nodes}",
                self.outside.len()
            ));
        }
        if ![0, nodes].contains(&self.alpha.len()) {
            return refuse(format!(
                "alpha has {} entries, must have none or {nodes}",
                self.alpha.len()
            ));
        }
        if let Some(k) = self.alpha.iter().position(|a| !(0.0..=1.0).contains(a)) {
            return refuse(format!("node {k}: alpha is {}", self.alpha[k]));
        }
        if let Some(bad) = self.across.iter().find(|a| a.node as usize >= nodes) {
            return refuse(format!("across: node {} of {nodes}", bad.node));
        }
        Ok(())
    }

    fn check_yarns(&self) -> Result<()> {
        for y in 0..self.yarn_count() {
            let yarn = self.yarn(y);
            let [Some(first), Some(last)] = [yarn.first(), yarn.last()] else {
                return refuse(format!("yarn {y} is empty"));
            };
            if yarn.len() < 2 || first.slides || last.slides {
                return refuse(format!("yarn {y} must have two ends that do not slide"));
            }
            for (k, pair) in yarn.windows(2).enumerate() {
                if !(pair[1].u > pair[0].u && pair[1].u.is_finite()) {
                    return refuse(format!(
                        "yarn {y}: u goes from {} to {} m after passage {k}",
                        pair[0].u, pair[1].u
                    ));
                }
            }
            if let Some(bad) = yarn.iter().find(|i| i.node as usize >= self.uv.len()) {
                return refuse(format!("yarn {y} passes {}", self.node_text(bad.node)));
            }
        }
        Ok(())
    }

    fn check_stacks(&self) -> Result<()> {
        let mut seen = vec![false; self.incidences.len()];
        for node in 0..self.uv.len() {
            let stack = self.stack(node);
            for strand in stack {
                let Some(incidence) = self.incidences.get(strand.incidence as usize) else {
                    return refuse(format!(
                        "{}: {} in its stack",
                        self.node_text(node as u32),
                        self.passage_text(strand.incidence)
                    ));
                };
                if incidence.node as usize != node || seen[strand.incidence as usize] {
                    return refuse(format!(
                        "{} stands in the stack of node {node}, or twice in its own",
                        self.passage_text(strand.incidence)
                    ));
                }
                seen[strand.incidence as usize] = true;
                if stack.len() == 1 && incidence.slides {
                    return refuse(format!(
                        "{}: no other yarn passes there, and it slides",
                        self.passage_text(strand.incidence)
                    ));
                }
            }
            // the crossing yarn lies before or behind all strands of the other group
            let changes = stack
                .windows(2)
                .filter(|w| w[0].group != w[1].group)
                .count();
            let beside = stack.len() > 1 && changes == 0;
            if changes > 1 || (beside && self.is_inside(node as u32)) {
                return refuse(format!(
                    "{}: the {} yarns through it must cross, all of one beside each other; from back to front they make {} groups",
                    self.node_text(node as u32),
                    stack.len(),
                    changes + 1
                ));
            }
        }
        Ok(())
    }

    /// Whether the two incidences follow each other in one yarn.
    pub(super) fn neighbours(&self, a: u32, b: u32) -> bool {
        let total = self.incidences.len() as u32;
        if a >= total || b >= total || a.abs_diff(b) != 1 {
            return false;
        }
        // no yarn begins at the later of the two
        self.starts.binary_search(&a.max(b)).is_err()
    }

    /// Whether a yarn goes from node `q` to node `other` without passing another.
    pub(super) fn beside(&self, q: u32, other: u32) -> bool {
        (q as usize) < self.uv.len()
            && self.stack(q as usize).iter().any(|s| {
                let i = s.incidence;
                [i.checked_sub(1), i.checked_add(1)]
                    .into_iter()
                    .flatten()
                    .any(|n| self.neighbours(i, n) && self.incidences[n as usize].node == other)
            })
    }

    /// The strands that run from a wing's end through the nodes `near` and `far`: which way along
    /// the yarn, and its incidence at `near`. A yarn that turns at the wing has two.
    fn strands(&self, wing: u32, near: u32, far: u32) -> impl Iterator<Item = (i32, u32)> + '_ {
        let node = |i: u32| self.incidences[i as usize].node;
        [-1, 1].into_iter().filter_map(move |step| {
            let at = wing.checked_add_signed(step)?;
            let beyond = at.checked_add_signed(step)?;
            let runs = self.neighbours(wing, at) && self.neighbours(at, beyond);
            (runs && node(at) == near && node(beyond) == far).then_some((step, at))
        })
    }

    /// The two strands of a wrap, apart from each other: each runs from its wing through both nodes of the axis.
    pub(super) fn wrapped(&self, wrap: &Wrap) -> Option<[(i32, u32); 2]> {
        let [q0, q1] = wrap.axis;
        self.strands(wrap.wings[0], q0, q1).find_map(|a| {
            let mut others = self.strands(wrap.wings[1], q1, q0);
            let apart = |b: &(i32, u32)| a.1 != b.1 && !self.neighbours(a.1, b.1);
            others.find(apart).map(|b| [a, b])
        })
    }

    /// A node and where it was laid, for people.
    fn node_text(&self, node: u32) -> String {
        match (
            self.uv.get(node as usize),
            self.node_panel.get(node as usize),
        ) {
            (Some(uv), Some(panel)) => {
                format!("node {node} at ({}, {}) m of panel {panel}", uv.x, uv.y)
            }
            _ => format!("node {node} of {}", self.uv.len()),
        }
    }

    /// A passage, its yarn and its node, for people.
    fn passage_text(&self, i: u32) -> String {
        let Some(incidence) = self.incidences.get(i as usize) else {
            return format!("passage {i} of {}", self.incidences.len());
        };
        let yarn = self.starts.partition_point(|s| *s <= i) - 1;
        let number = i - self.starts[yarn];
        let node = self.node_text(incidence.node);
        format!("yarn {yarn}, passage {number} through {node}")
    }

    fn passages_text(&self, [a, b]: [u32; 2]) -> String {
        format!("{} and {}", self.passage_text(a), self.passage_text(b))
    }

    fn nodes_text(&self, nodes: &[u32]) -> String {
        let all: Vec<String> = nodes.iter().map(|n| self.node_text(*n)).collect();
        all.join(", ")
    }

    fn check_contacts(&self) -> Result<()> {
        let length =
            |[a, b]: [u32; 2]| self.incidences[b as usize].u - self.incidences[a as usize].u;
        for spring in &self.stitch_springs {
            let [a, b] = spring.incidences;
            if a >= b || !self.neighbours(a, b) || !near(length([a, b]), spring.length) {
                return refuse(format!(
                    "the yarn inside of a stitch, between {}, must be {} m of one yarn without another passage",
                    self.passages_text([a, b]),
                    spring.length
                ));
            }
        }
        for spacing in &self.spacings {
            let [a, b] = spacing.incidences;
            let good = a < b
                && self.neighbours(a, b)
                && near(length([a, b]), spacing.length)
                && spacing.least > 0.0
                && spacing.least < spacing.length;
            if !good {
                return refuse(format!(
                    "neighbouring contacts, {}, must be {} m apart along one yarn and be kept apart by less, are by {} m",
                    self.passages_text([a, b]),
                    spacing.length,
                    spacing.least
                ));
            }
        }
        for wrap in &self.wraps {
            let [q0, q1] = wrap.axis;
            let numbers = wrap.length > 0.0 && wrap.sign.abs() == 1.0;
            if q0 == q1 || !numbers || self.wrapped(wrap).is_none() {
                return refuse(format!(
                    "two yarns turn around each other between {}: they must run through both nodes to {}; length {} m, sign {}",
                    self.nodes_text(&wrap.axis),
                    self.passages_text(wrap.wings),
                    wrap.length,
                    wrap.sign
                ));
            }
        }
        Ok(())
    }

    fn check_crossings(&self) -> Result<()> {
        for corner in &self.corners {
            let [q, a, b] = corner.nodes;
            if a == b || !self.beside(q, a) || !self.beside(q, b) || !(corner.length > 0.0) {
                return refuse(format!(
                    "the angle of a crossing, {}: yarns must go from the first to the other two, which differ; pitch {} m",
                    self.nodes_text(&corner.nodes),
                    corner.length
                ));
            }
        }
        for tie in &self.ties {
            let nodes = self.uv.len() as u32;
            let [a, b] = tie.segment;
            let good = tie.node < nodes
                && b < nodes
                && b == a + 1
                && tie.node != a
                && tie.node != b
                && (0.0..=1.0).contains(&tie.t)
                && tie.length >= 0.0;
            if !good {
                return refuse(format!(
                    "{} is tied to a seam's rod between {}: the two must be neighbours and others than it, the fraction {} between 0 and 1, the length {} m not negative",
                    self.node_text(tie.node),
                    self.nodes_text(&tie.segment),
                    tie.t,
                    tie.length
                ));
            }
            let stack = [self.stack(a as usize), self.stack(b as usize)];
            let rod = match (stack[0], stack[1]) {
                ([p], [q]) => self
                    .neighbours(p.incidence, q.incidence)
                    .then_some(p.incidence),
                _ => None,
            };
            let seam = rod.is_some_and(|i| {
                let yarn = self.starts.partition_point(|s| *s <= i) - 1;
                self.yarn_family[yarn] == Family::Seam
            });
            let frozen = self
                .stack(tie.node as usize)
                .iter()
                .all(|s| !self.incidences[s.incidence as usize].slides);
            if !seam || !frozen {
                return refuse(format!(
                    "{} is tied between {}: that must be a seam's rod, and no yarn may slide at the tied node",
                    self.node_text(tie.node),
                    self.nodes_text(&tie.segment)
                ));
            }
        }
        Ok(())
    }
}
