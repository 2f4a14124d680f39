//! The list of an FMU's variables, made from its scene and the sizes of its mesh. A pure function of
//! both: the program that writes the model description and the library that answers the master make
//! the same list.

mod computed;
mod settable;

use super::names;
use super::variables::{Causality, Kind, Quantity, Variability, Variable};
use crate::math::hash::Hash;
use crate::scene::Scene;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Sizes that the mesh decides.
#[derive(Clone, Debug, PartialEq)]
pub struct Sizes {
    /// Vertices.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
    /// Nodes of yarns as they are laid: there will not be more.
    pub nodes: usize,
    /// Vertices of each probe: 1 for a point.
    pub probes: Vec<usize>,
}

/// The variables of a scene; the place in the list is the value reference.
pub fn variables(scene: &Scene, sizes: &Sizes) -> Vec<Variable> {
    let mut table = Table { list: Vec::new() };
    table
        .push("time", Quantity::Time, "s", "time of the master")
        .causality = Causality::Independent;
    table.world(scene);
    table.bodies(scene);
    table.pins(scene);
    table.fabrics(scene);
    table.settings(scene);
    table.results(scene);
    table.probes(scene);
    table.arrays(scene, sizes);
    table.list
}

/// A number that two lists share only if masters cannot tell them apart. Start values are left out:
/// they may differ in their last bits between platforms.
pub fn fingerprint(variables: &[Variable]) -> u64 {
    let mut hash = Hash::default();
    for v in variables {
        let sizes: Vec<usize> = v.dimensions.iter().map(|d| d.size()).collect();
        let text = format!(
            "{} {:?} {:?} {:?} {:?} {sizes:?}\n",
            v.name, v.kind, v.causality, v.variability, v.quantity
        );
        hash.add(text.as_bytes());
    }
    hash.value()
}

struct Table {
    list: Vec<Variable>,
}

impl Table {
    /// A continuous real output, to be changed by the caller where it is something else.
    fn push(
        &mut self,
        name: impl Into<String>,
        quantity: Quantity,
        unit: &'static str,
        description: impl Into<String>,
    ) -> &mut Variable {
        self.list.push(Variable {
            name: name.into(),
            kind: Kind::Float64,
            causality: Causality::Output,
            variability: Variability::Continuous,
            quantity,
            unit,
            description: description.into(),
            start: 0.0,
            starts: Vec::new(),
            min: None,
            max: None,
            nominal: None,
            dimensions: Vec::new(),
        });
        let last = self.list.len() - 1;
        &mut self.list[last]
    }

    fn input(
        &mut self,
        name: impl Into<String>,
        quantity: Quantity,
        unit: &'static str,
        start: f64,
        description: impl Into<String>,
    ) -> &mut Variable {
        let v = self.push(name, quantity, unit, description);
        v.causality = Causality::Input;
        v.start = start;
        v
    }

    fn parameter(
        &mut self,
        name: impl Into<String>,
        quantity: Quantity,
        unit: &'static str,
        start: f64,
        description: impl Into<String>,
    ) -> &mut Variable {
        let v = self.push(name, quantity, unit, description);
        v.causality = Causality::Parameter;
        v.variability = Variability::Fixed;
        v.start = start;
        v
    }
}

/// Structured names of the scene's bodies.
pub fn body_names(scene: &Scene) -> Vec<String> {
    names::unique(scene.bodies.iter().map(|b| b.name.as_str()))
}

/// Structured names of the scene's probes.
fn probe_names(scene: &Scene) -> Vec<String> {
    names::unique(scene.probes.iter().map(|p| p.name.as_str()))
}
