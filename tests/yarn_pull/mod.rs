//! Stretch tests of fabrics of yarns: a rectangle held at two opposite edges and pulled, in equilibrium at every length.

pub(crate) mod lace;

use toile::pattern::import::garment_from_json;
use toile::sim::{DrapeOptions, Outcome, Sim, SimOptions};

/// Largest residual of an equilibrium [N].
pub(crate) const RESIDUAL: f64 = 1e-5;

/// A rectangle of a fabric [m] between two grips.
pub(crate) struct Swatch {
    /// The simulation.
    pub(crate) sim: Sim,
    /// Nodes in each grip.
    grips: [Vec<u32>; 2],
    /// Axis of the pull, 0 along u, 1 along v.
    axis: usize,
    /// Length as laid [m].
    pub(crate) laid: f64,
}

/// What a length takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    /// Length between the grips over the laid one.
    pub(crate) stretch: f64,
    /// Pull on the grips, mean of both [N].
    pub(crate) force: f64,
    /// Largest residual [N].
    pub(crate) residual: f64,
    /// Newton iterations.
    pub(crate) newton: u64,
}

impl Swatch {
    /// A fabric (`yarns` as in a garment file) of this size [m], its warp or wales turned by `grain` degrees, to be
    /// pulled along an axis.
    pub(crate) fn new(yarns: &str, size: [f64; 2], grain: f64, axis: usize) -> Self {
        let [width, height] = size;
        let text = format!(
            r#"{{"toile_garment": 1, "name": "swatch", "edge_length": {},
                "panels": [{{"name": "p", "fabric": "y", "grain_deg": {grain},
                    "vertices": [[0, 0], [{width}, 0], [{width}, {height}], [0, {height}]],
                    "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}],
                "fabrics": [{{"name": "y", "yarns": {yarns}}}],
                "blend_regions": [{{"panel": "p", "polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}}]}}"#,
            0.2 * width.max(height)
        );
        let garment = garment_from_json(&text, None).expect("garment");
        let options = SimOptions {
            gravity: Some([0.0; 3]),
            ..SimOptions::default()
        };
        let sim = Sim::new(&garment, &options).expect("sim");
        let edges = if axis == 0 { [3, 1] } else { [0, 2] };
        let grips = edges.map(|e| sim.yarn_nodes_along(0, e).expect("nodes"));
        Self {
            sim,
            grips,
            axis,
            laid: size[axis],
        }
    }

    /// The finished size of so many wales and courses of the jersey's loops [m].
    pub(crate) fn knit_size(wales: usize, courses: usize) -> [f64; 2] {
        let (w, h) = (0.003, 0.85 * 0.003);
        [
            (wales as f64 + 0.4) * w,
            (courses as f64 + 0.5) * h + 0.18 * w,
        ]
    }

    /// A knit of so many wales and courses of the jersey's loops.
    pub(crate) fn knit(keys: &str, wales: usize, courses: usize, axis: usize) -> Self {
        let size = Self::knit_size(wales, courses);
        Self::new(
            &format!(r#"{{"preset": "jersey", {keys}}}"#),
            size,
            0.0,
            axis,
        )
    }

    /// Brings it to rest.
    pub(crate) fn rest(&mut self) -> (f64, u64) {
        let options = DrapeOptions {
            force_tolerance: RESIDUAL,
            max_steps: 6000,
        };
        let report = self.sim.drape(&options, &mut |_| true).expect("drape");
        assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
        assert!(report.residual < RESIDUAL);
        (report.residual, report.newton_iterations)
    }

    /// Holds it at `stretch` times its laid length, its grips flat and as wide as laid, in equilibrium.
    pub(crate) fn pull(&mut self, stretch: f64) -> Reading {
        let mesh = self.sim.yarns().expect("yarns");
        let shift = 0.5 * self.laid * (stretch - 1.0);
        let targets = [0, 1].map(|side: usize| {
            let grip = &self.grips[side];
            let shift = if side == 0 { -shift } else { shift };
            let place = |n: &u32| {
                let p = mesh.uv[*n as usize];
                let mut target = [p.x, p.y, 0.0];
                target[self.axis] += shift;
                target
            };
            grip.iter().map(place).collect::<Vec<_>>()
        });
        for (grip, targets) in self.grips.iter().zip(&targets) {
            self.sim.pin_yarn_nodes(grip, Some(targets)).expect("pins");
        }
        let (residual, newton) = self.rest();
        let forces = self.sim.yarn_forces().expect("forces");
        let on = |k: usize| -> f64 {
            let grip = self.grips[k].iter();
            grip.map(|n| forces[*n as usize][self.axis]).sum()
        };
        Reading {
            stretch,
            force: 0.5 * (on(0) - on(1)),
            residual,
            newton,
        }
    }
}

/// Stretch at which a curve that rises reaches a force, between its readings.
pub(crate) fn stretch_at(curve: &[Reading], force: f64) -> f64 {
    let (a, b) = curve
        .windows(2)
        .map(|w| (w[0], w[1]))
        .find(|(a, b)| a.force <= force && b.force >= force)
        .expect("a force within the curve");
    a.stretch + (b.stretch - a.stretch) * (force - a.force) / (b.force - a.force)
}
