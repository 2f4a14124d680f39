//! What a step or a drape reports.

use serde::{Deserialize, Serialize};

/// Why a solve stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u32)]
pub enum Outcome {
    /// Every tolerance was met.
    Converged = 0,
    /// A step needed smaller substeps and reached its end.
    Substepped = 1,
    /// An iteration limit was hit; the state is admissible and the residual is in the report.
    IterationLimit = 2,
    /// The host asked to stop; the state is admissible.
    Cancelled = 3,
    /// A drape ended where no step, however short, leads lower; the state is admissible, the
    /// residual and the reason are in the report.
    Stalled = 4,
    /// Nothing holds a part of the garment and nothing lies on its way: a drape of it would never
    /// end. The state is that at which this was seen, the reason names the part.
    Falling = 5,
}

impl Outcome {
    /// Stable name, as in `summary.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Substepped => "substepped",
            Self::IterationLimit => "iteration_limit",
            Self::Cancelled => "cancelled",
            Self::Stalled => "stalled",
            Self::Falling => "falling",
        }
    }
}

/// Numbers of one `step` or `drape`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Why it stopped.
    pub outcome: Outcome,
    /// What there is to say of that, for people; empty where the outcome says it all.
    pub reason: String,
    /// Newton iterations, all substeps together.
    pub newton_iterations: u64,
    /// Iterations of the linear solver, all together; a direct solve counts one.
    pub linear_iterations: u64,
    /// Substeps taken.
    pub substeps: u64,
    /// Time advanced [s].
    pub advanced: f64,
    /// Largest force residual of a free vertex at the end [N].
    pub residual: f64,
    /// Largest relative stretch of a mesh edge.
    pub max_edge_strain: f64,
    /// Smallest signed distance of a vertex to a body [m]; infinite without bodies.
    pub min_gap: f64,
    /// Kinetic energy [J].
    pub kinetic_energy: f64,
    /// Elastic, gravity and contact energy [J].
    pub potential_energy: f64,
    /// Largest distance between the two points of a seam link [m].
    pub max_seam_gap: f64,
}

/// Energies of the present state [J].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energies {
    /// Kinetic.
    pub kinetic: f64,
    /// Gravity, zero at the world's origin.
    pub gravity: f64,
    /// Membrane (triangles).
    pub membrane: f64,
    /// Bending (hinges or quadratic).
    pub bending: f64,
    /// Seam springs.
    pub seam: f64,
    /// Contact with bodies and of cloth with itself, friction springs included.
    pub contact: f64,
    /// All yarn terms together.
    pub yarn: f64,
}
