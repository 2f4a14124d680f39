//! What a variable of an FMU is: its type, its role, its unit, and the quantity of the simulation
//! behind it. `table` makes the list of them from a scene; the value reference of a variable is its
//! place in that list.

use super::fabric_numbers::FabricNumber;
use crate::error::{Error, Result};
use crate::solve::settings::Settings;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Data type, as FMI 3 names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// 64-bit floating point; `Real` in FMI 2.
    Float64,
    /// 32-bit signed; `Integer` in FMI 2.
    Int32,
    /// 32-bit unsigned; not in FMI 2.
    UInt32,
    /// 64-bit unsigned; not in FMI 2.
    UInt64,
    /// True or false.
    Boolean,
    /// Bytes; not in FMI 2.
    Binary,
}

impl Kind {
    /// Name of the element in FMI 3.
    pub fn name(self) -> &'static str {
        match self {
            Self::Float64 => "Float64",
            Self::Int32 => "Int32",
            Self::UInt32 => "UInt32",
            Self::UInt64 => "UInt64",
            Self::Boolean => "Boolean",
            Self::Binary => "Binary",
        }
    }

    /// Name of the element in FMI 2, where it has one.
    pub fn fmi2_name(self) -> Option<&'static str> {
        match self {
            Self::Float64 => Some("Real"),
            Self::Int32 => Some("Integer"),
            Self::Boolean => Some("Boolean"),
            Self::UInt32 | Self::UInt64 | Self::Binary => None,
        }
    }
}

/// Role of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Time.
    Independent,
    /// Size of arrays.
    Structural,
    /// Set before the run.
    Parameter,
    /// Set by the master at communication points.
    Input,
    /// Computed.
    Output,
    /// Computed, not for connections.
    Local,
}

impl Causality {
    /// Name of the attribute's value.
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Structural => "structuralParameter",
            Self::Parameter => "parameter",
            Self::Input => "input",
            Self::Output => "output",
            Self::Local => "local",
        }
    }
}

/// When a variable may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variability {
    /// Not after initialisation.
    Fixed,
    /// At communication points, by the master.
    Tunable,
    /// In steps.
    Discrete,
    /// Any time.
    Continuous,
}

impl Variability {
    /// Name of the attribute's value.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Tunable => "tunable",
            Self::Discrete => "discrete",
            Self::Continuous => "continuous",
        }
    }
}

/// An energy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnergyPart {
    /// Of motion.
    Kinetic,
    /// Of height.
    Gravity,
    /// Stretch of triangles.
    Membrane,
    /// Bending of triangles.
    Bending,
    /// Springs of seams.
    Seam,
    /// With bodies and of cloth with itself.
    Contact,
    /// Of yarns.
    Yarn,
    /// All of the above.
    Total,
}

/// What a variable stands for. Indices count bodies, pins, probes and axes from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// Time of the master [s].
    Time,
    /// A size of arrays.
    Count,
    /// A number of a fabric.
    Fabric(usize, FabricNumber),
    /// Friction, gap and stiffness (0, 1, 2) of a body's contact.
    Contact(usize, usize),
    /// A tunable of the solvers, by its place in `Settings::KEYS`.
    Setting(usize),
    /// Drape to rest before the run?
    Drape,
    /// Does the body follow the inputs, or the scene's motion?
    Driven(usize),
    /// Acceleration of gravity.
    Gravity(usize),
    /// Velocity of the air.
    Wind(usize),
    /// Pressure along the cloth's normal.
    Pressure,
    /// Position of a body's origin.
    BodyPosition(usize, usize),
    /// Rotation of a body.
    BodyQuaternion(usize, usize),
    /// Velocity of a body's origin.
    BodyVelocity(usize, usize),
    /// Angular velocity of a body, world axes.
    BodyAngularVelocity(usize, usize),
    /// Does a deforming mesh follow the array of its vertices, or the scene's frames?
    MeshDriven(usize),
    /// Vertices of a deforming mesh, body frame.
    MeshVertices(usize),
    /// Displacement of a pin from where the scene has it.
    PinDisplacement(usize, usize),
    /// Does the pin hold?
    PinHeld(usize),
    /// Force of the cloth on a body.
    BodyForce(usize, usize),
    /// Torque of the cloth on a body about its origin.
    BodyTorque(usize, usize),
    /// Force of the cloth on what holds a pin.
    PinReaction(usize, usize),
    /// An energy.
    Energy(EnergyPart),
    /// Largest relative stretch of an edge.
    MaxStrain,
    /// Smallest distance to a body.
    MinGap,
    /// Largest opening of a seam.
    MaxSeamGap,
    /// Residual of the last solve.
    Residual,
    /// How the last step ended.
    Outcome,
    /// Newton iterations of the last step.
    NewtonIterations,
    /// Linear iterations of the last step.
    LinearIterations,
    /// Substeps of the last step.
    Substeps,
    /// Least coordinates of the garment.
    ExtentMin(usize),
    /// Greatest coordinates of the garment.
    ExtentMax(usize),
    /// Centre of mass.
    Centre(usize),
    /// Position of a probe.
    ProbePosition(usize, usize),
    /// Velocity of a probe.
    ProbeVelocity(usize, usize),
    /// Length of a probe that is a curve.
    CurveLength(usize),
    /// Points of a probe that is a curve.
    CurvePoints(usize),
    /// All positions.
    Positions,
    /// Number of the yarns' nodes.
    NodeCount,
    /// Positions of the yarns' nodes, zeros after the last one.
    Nodes,
    /// All velocities.
    Velocities,
    /// All normals.
    Normals,
    /// All triangles.
    Triangles,
    /// The state as bytes.
    Snapshot,
}

/// One axis of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// A fixed size.
    Size(usize),
    /// The size that a structural parameter has: its value reference, and its value.
    Count(u32, usize),
}

impl Dimension {
    /// The size.
    pub fn size(self) -> usize {
        match self {
            Self::Size(n) | Self::Count(_, n) => n,
        }
    }
}

/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Structured name.
    pub name: String,
    /// Data type.
    pub kind: Kind,
    /// Role.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// What it stands for.
    pub quantity: Quantity,
    /// Name of its unit; "" has none.
    pub unit: &'static str,
    /// For people.
    pub description: String,
    /// Value before anything is set; of settable scalars only.
    pub start: f64,
    /// The same of a settable array, row by row; empty for all others.
    pub starts: Vec<f64>,
    /// Smallest admissible value.
    pub min: Option<f64>,
    /// Greatest admissible value.
    pub max: Option<f64>,
    /// Typical magnitude.
    pub nominal: Option<f64>,
    /// Axes of an array, outermost first; empty for a scalar.
    pub dimensions: Vec<Dimension>,
}

impl Variable {
    /// Whether a master may ever set it.
    pub fn is_settable(&self) -> bool {
        matches!(
            self.causality,
            Causality::Structural | Causality::Parameter | Causality::Input
        )
    }

    /// Whether the simulation computes it.
    pub fn is_computed(&self) -> bool {
        matches!(self.causality, Causality::Output | Causality::Local)
    }

    /// Whether it has a place in FMI 2, which has scalars only, and no use for what is about arrays.
    pub fn is_in_fmi2(&self) -> bool {
        let about_array = matches!(self.quantity, Quantity::MeshDriven(_));
        self.dimensions.is_empty() && self.kind.fmi2_name().is_some() && !about_array
    }

    /// Number of scalars in it.
    pub fn size(&self) -> usize {
        self.dimensions.iter().map(|d| d.size()).product()
    }

    /// Refuses a value that it, or an element of it, cannot take.
    pub fn check(&self, value: f64) -> Result<()> {
        let below = self.min.is_some_and(|min| value < min);
        let above = self.max.is_some_and(|max| value > max);
        if !value.is_finite() || below || above {
            let bound = |b: Option<f64>, none: &str| b.map_or(none.to_owned(), |b| b.to_string());
            return Err(Error::argument(format!(
                "{} = {value} must be finite and in [{}, {}]",
                self.name,
                bound(self.min, "-inf"),
                bound(self.max, "inf")
            )));
        }
        match self.quantity {
            Quantity::Setting(s) => Settings::KEYS[s].check(value),
            _ => Ok(()),
        }
    }
}

/// Values of all variables that a master may set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Values {
    /// One number for each variable of the list; of scalars that can be set it means something.
    pub scalars: Vec<f64>,
    /// Arrays that can be set, by value reference, row by row.
    pub arrays: BTreeMap<u32, Vec<f64>>,
}

impl Values {
    /// Values before anything is set.
    pub fn start(variables: &[Variable]) -> Self {
        let listed = (0..).zip(variables);
        let arrays = listed.filter(|(_, v)| !v.starts.is_empty());
        Self {
            scalars: variables.iter().map(|v| v.start).collect(),
            arrays: arrays.map(|(r, v)| (r, v.starts.clone())).collect(),
        }
    }

    /// Numbers of a variable, one for each of its elements.
    pub fn of(&self, reference: u32) -> &[f64] {
        match self.arrays.get(&reference) {
            Some(array) => array,
            None => std::slice::from_ref(&self.scalars[reference as usize]),
        }
    }

    /// The same, to be set.
    pub fn of_mut(&mut self, reference: u32) -> &mut [f64] {
        match self.arrays.get_mut(&reference) {
            Some(array) => array,
            None => std::slice::from_mut(&mut self.scalars[reference as usize]),
        }
    }

    /// Refuses values that are not those of `variables`, or that one of them cannot take.
    pub fn check(&self, variables: &[Variable]) -> Result<()> {
        let (own, all) = (self.scalars.len(), variables.len());
        if own != all {
            return Err(Error::parse(format!("{own} values, {all} are expected")));
        }
        let arrays = variables.iter().filter(|v| !v.starts.is_empty());
        let (own, all) = (self.arrays.len(), arrays.count());
        if own != all {
            return Err(Error::parse(format!("{own} arrays, {all} are expected")));
        }
        for (reference, variable) in (0..).zip(variables).filter(|(_, v)| v.is_settable()) {
            let values = self.of(reference);
            if values.len() != variable.size() {
                return Err(Error::parse(format!(
                    "{} has {} numbers, {} are expected",
                    variable.name,
                    values.len(),
                    variable.size()
                )));
            }
            values.iter().try_for_each(|&v| variable.check(v))?;
        }
        Ok(())
    }
}
