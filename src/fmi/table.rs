//! The list of an FMU's variables, made from its scene and the sizes of its mesh. A pure function of
//! both: the program that writes the model description and the library that answers the master make
//! the same list.

use super::fabric_numbers::FabricNumber;
use super::names;
use super::units;
use super::variables::{Causality, Dimension, EnergyPart, Kind, Quantity, Variability, Variable};
use crate::math::hash::Hash;
use crate::scene::{PinPlace, Scene};
use crate::solve::settings::Settings;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Sizes that the mesh decides.
#[derive(Clone, Debug, PartialEq)]
pub struct Sizes {
    /// Vertices.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
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

    fn world(&mut self, scene: &Scene) {
        for (k, axis) in AXES.iter().enumerate() {
            self.input(
                format!("gravity[{}]", k + 1),
                Quantity::Gravity(k),
                "m/s^2",
                scene.gravity[k],
                format!("acceleration of gravity along {axis}"),
            )
            .nominal = Some(10.0);
        }
        for (k, axis) in AXES.iter().enumerate() {
            self.input(
                format!("wind[{}]", k + 1),
                Quantity::Wind(k),
                "m/s",
                scene.wind[k],
                format!("velocity of the air along {axis}"),
            );
        }
        self.input(
            "pressure",
            Quantity::Pressure,
            "Pa",
            scene.pressure,
            "pressure along the cloth's normal",
        );
        self.parameter(
            "drape",
            Quantity::Drape,
            "",
            f64::from(u8::from(scene.run.drape)),
            "sew and drape to rest when the initialization ends; time does not pass meanwhile",
        )
        .kind = Kind::Boolean;
    }

    fn bodies(&mut self, scene: &Scene) {
        for (b, (body, name)) in scene.bodies.iter().zip(body_names(scene)).enumerate() {
            let name = format!("body.{name}");
            let pose = body.motion.pose(0.0);
            let q = pose.rotation.quaternion();
            let q = [q.i, q.j, q.k, q.w];
            self.parameter(
                format!("{name}.driven"),
                Quantity::Driven(b),
                "",
                f64::from(u8::from(!body.motion.moves())),
                "true: the body follows position, quaternion and velocities; false: the scene's motion",
            )
            .kind = Kind::Boolean;
            for k in 0..3 {
                self.input(
                    format!("{name}.position[{}]", k + 1),
                    Quantity::BodyPosition(b, k),
                    "m",
                    pose.position[k],
                    format!(
                        "position of the body's origin along {}; where it is when a step ends, if the velocities are zero",
                        AXES[k]
                    ),
                );
            }
            for (k, part) in ["x", "y", "z", "w"].iter().enumerate() {
                self.input(
                    format!("{name}.quaternion[{}]", k + 1),
                    Quantity::BodyQuaternion(b, k),
                    "",
                    q[k],
                    format!("rotation from body to world, part {part}; need not be of unit length"),
                );
            }
            for k in 0..3 {
                self.input(
                    format!("{name}.velocity[{}]", k + 1),
                    Quantity::BodyVelocity(b, k),
                    "m/s",
                    0.0,
                    format!(
                        "velocity along {}: carries the body on from its position during a step",
                        AXES[k]
                    ),
                );
            }
            for k in 0..3 {
                self.input(
                    format!("{name}.angular_velocity[{}]", k + 1),
                    Quantity::BodyAngularVelocity(b, k),
                    "rad/s",
                    0.0,
                    format!("angular velocity about {} of the world", AXES[k]),
                );
            }
            for k in 0..3 {
                self.push(
                    format!("{name}.force[{}]", k + 1),
                    Quantity::BodyForce(b, k),
                    "N",
                    format!("force of the cloth on the body along {}", AXES[k]),
                )
                .nominal = Some(1.0);
            }
            for k in 0..3 {
                self.push(
                    format!("{name}.torque[{}]", k + 1),
                    Quantity::BodyTorque(b, k),
                    "N.m",
                    format!(
                        "torque of the cloth on the body about its origin, axis {}",
                        AXES[k]
                    ),
                )
                .nominal = Some(0.1);
            }
            let numbers = [
                (
                    "friction",
                    "",
                    body.contact.friction,
                    0.0,
                    "Coulomb friction of cloth on the body",
                ),
                (
                    "thickness",
                    "m",
                    body.contact.thickness,
                    0.0,
                    "gap kept free between body and cloth",
                ),
                (
                    "stiffness",
                    "Pa/m",
                    body.contact.stiffness,
                    1e-6,
                    "penalty of the contact, pressure per depth",
                ),
            ];
            for (n, (key, unit, start, min, doc)) in numbers.into_iter().enumerate() {
                self.parameter(
                    format!("{name}.contact.{key}"),
                    Quantity::Contact(b, n),
                    unit,
                    start,
                    doc,
                )
                .min = Some(min);
            }
        }
    }

    fn pins(&mut self, scene: &Scene) {
        for p in 0..scene.pins.len() {
            let name = format!("pin[{}]", p + 1);
            let held = self.input(
                format!("{name}.held"),
                Quantity::PinHeld(p),
                "",
                1.0,
                "false lets the pin go; where the scene says until when it holds, it lets go then in any case",
            );
            held.kind = Kind::Boolean;
            held.variability = Variability::Discrete;
            for k in 0..3 {
                self.input(
                    format!("{name}.displacement[{}]", k + 1),
                    Quantity::PinDisplacement(p, k),
                    "m",
                    0.0,
                    format!("displacement along {} from where the scene has the pin, reached when a step ends", AXES[k]),
                );
            }
            for k in 0..3 {
                self.push(
                    format!("{name}.reaction[{}]", k + 1),
                    Quantity::PinReaction(p, k),
                    "N",
                    format!("force of the cloth on what holds the pin along {}, without the inertia of the held vertices", AXES[k]),
                )
                .nominal = Some(1.0);
            }
        }
    }

    fn fabrics(&mut self, scene: &Scene) {
        let fabrics = &scene.garment.fabrics;
        let names = names::unique(fabrics.iter().map(|f| f.name.as_str()));
        for (f, (fabric, name)) in fabrics.iter().zip(names).enumerate() {
            for &number in FabricNumber::ALL {
                self.parameter(
                    format!("fabric.{name}.{}", number.name()),
                    Quantity::Fabric(f, number),
                    number.unit(),
                    number.of(fabric),
                    number.doc(),
                )
                .min = number.min();
            }
        }
    }

    fn settings(&mut self, scene: &Scene) {
        for (s, key) in Settings::KEYS.iter().enumerate() {
            // the mesh is made when the FMU is built
            if key.name == "limits.vertices" {
                continue;
            }
            let start = scene.settings.get(key.name).unwrap_or(key.default);
            let tunable = ["solver.newton.", "solver.step.", "air."]
                .iter()
                .any(|p| key.name.starts_with(p))
                || key.name == "solver.linear.tolerance";
            let v = self.parameter(
                key.name,
                Quantity::Setting(s),
                units::named(key.unit),
                start,
                key.doc.trim(),
            );
            v.min = Some(key.min);
            v.max = Some(key.max);
            if tunable {
                v.variability = Variability::Tunable;
            }
        }
    }

    fn results(&mut self, scene: &Scene) {
        let parts = [
            ("kinetic", EnergyPart::Kinetic, "energy of motion"),
            (
                "gravity",
                EnergyPart::Gravity,
                "potential of gravity, zero at the world's origin",
            ),
            (
                "membrane",
                EnergyPart::Membrane,
                "elastic energy of stretch",
            ),
            ("bending", EnergyPart::Bending, "elastic energy of bending"),
            ("seam", EnergyPart::Seam, "energy of the seams' springs"),
            (
                "contact",
                EnergyPart::Contact,
                "energy of contacts with bodies and of cloth with itself",
            ),
            ("total", EnergyPart::Total, "sum of these energies"),
        ];
        for (name, part, doc) in parts {
            let v = self.push(format!("energy.{name}"), Quantity::Energy(part), "J", doc);
            v.nominal = Some(0.1);
            if part == EnergyPart::Kinetic {
                v.min = Some(0.0);
            }
        }
        let v = self.push(
            "strain.max",
            Quantity::MaxStrain,
            "",
            "largest relative stretch of an edge",
        );
        (v.min, v.nominal) = (Some(0.0), Some(0.1));
        if !scene.bodies.is_empty() {
            self.push(
                "gap.min",
                Quantity::MinGap,
                "m",
                "smallest distance of a vertex to a body, negative inside",
            )
            .nominal = Some(1e-2);
        }
        let v = self.push(
            "seam.gap.max",
            Quantity::MaxSeamGap,
            "m",
            "largest opening of a seam",
        );
        (v.min, v.nominal) = (Some(0.0), Some(1e-3));
        let v = self.push(
            "step.residual",
            Quantity::Residual,
            "N",
            "largest force that the last solve left on a free vertex",
        );
        (v.min, v.nominal) = (Some(0.0), Some(1e-3));
        let counts = [
            (
                "step.outcome",
                Quantity::Outcome,
                "how the last step or drape ended: 0 converged, 1 in substeps, 2 iteration limit",
            ),
            (
                "step.newton_iterations",
                Quantity::NewtonIterations,
                "Newton iterations of the last step",
            ),
            (
                "step.linear_iterations",
                Quantity::LinearIterations,
                "iterations of the linear solver in the last step",
            ),
            (
                "step.substeps",
                Quantity::Substeps,
                "substeps of the last step",
            ),
        ];
        for (name, quantity, doc) in counts {
            let v = self.push(name, quantity, "", doc);
            v.kind = Kind::Int32;
            v.variability = Variability::Discrete;
            v.min = Some(0.0);
        }
        type Axis = fn(usize) -> Quantity;
        let points: [(&str, Axis, &str); 3] = [
            (
                "extent.min",
                Quantity::ExtentMin,
                "least coordinate of a vertex along",
            ),
            (
                "extent.max",
                Quantity::ExtentMax,
                "greatest coordinate of a vertex along",
            ),
            ("centre_of_mass", Quantity::Centre, "centre of mass along"),
        ];
        for (name, quantity, doc) in points {
            for (k, axis) in AXES.iter().enumerate() {
                self.push(
                    format!("{name}[{}]", k + 1),
                    quantity(k),
                    "m",
                    format!("{doc} {axis}"),
                );
            }
        }
    }

    fn probes(&mut self, scene: &Scene) {
        for (i, (probe, name)) in scene.probes.iter().zip(probe_names(scene)).enumerate() {
            if matches!(probe.place, PinPlace::Edge(_)) {
                let v = self.push(
                    format!("curve.{name}.length"),
                    Quantity::CurveLength(i),
                    "m",
                    "length of the curve",
                );
                v.min = Some(0.0);
                continue;
            }
            for (k, axis) in AXES.iter().enumerate() {
                self.push(
                    format!("probe.{name}.position[{}]", k + 1),
                    Quantity::ProbePosition(i, k),
                    "m",
                    format!("position of the point along {axis}"),
                );
            }
            for (k, axis) in AXES.iter().enumerate() {
                self.push(
                    format!("probe.{name}.velocity[{}]", k + 1),
                    Quantity::ProbeVelocity(i, k),
                    "m/s",
                    format!("velocity of the point along {axis}"),
                );
            }
        }
    }

    /// A size that is decided when the FMU is built: its only admissible value is the one it has.
    fn count(&mut self, name: String, size: usize, doc: &str) -> Dimension {
        let reference = self.list.len() as u32;
        let v = self.parameter(name, Quantity::Count, "", size as f64, doc);
        v.causality = Causality::Structural;
        v.kind = Kind::UInt64;
        (v.min, v.max) = (Some(size as f64), Some(size as f64));
        Dimension::Count(reference, size)
    }

    fn arrays(&mut self, scene: &Scene, sizes: &Sizes) {
        let vertices = self.count("vertex.count".into(), sizes.vertices, "number of vertices");
        let triangles = self.count(
            "triangle.count".into(),
            sizes.triangles,
            "number of triangles",
        );
        let three = Dimension::Size(3);
        let arrays = [
            (
                "vertex.position",
                Quantity::Positions,
                "m",
                "positions of the vertices, shape [vertex.count, 3]",
            ),
            (
                "vertex.velocity",
                Quantity::Velocities,
                "m/s",
                "velocities of the vertices, shape [vertex.count, 3]",
            ),
            (
                "vertex.normal",
                Quantity::Normals,
                "",
                "unit normals, to the outside of the cloth, shape [vertex.count, 3]",
            ),
        ];
        for (name, quantity, unit, doc) in arrays {
            self.push(name, quantity, unit, doc).dimensions = vec![vertices, three];
        }
        for (i, (probe, name)) in scene.probes.iter().zip(probe_names(scene)).enumerate() {
            if matches!(probe.place, PinPlace::Edge(_)) {
                let name = format!("curve.{name}");
                let count = self.count(
                    format!("{name}.count"),
                    sizes.probes[i],
                    "number of points of the curve",
                );
                let v = self.push(
                    format!("{name}.position"),
                    Quantity::CurvePoints(i),
                    "m",
                    "points of the curve, shape [count, 3]",
                );
                v.dimensions = vec![count, three];
            }
        }
        let v = self.push(
            "triangle.vertices",
            Quantity::Triangles,
            "",
            "vertices of each triangle from 0, counter-clockwise seen from the outside, shape [triangle.count, 3]",
        );
        v.kind = Kind::UInt32;
        v.causality = Causality::Local;
        v.variability = Variability::Fixed;
        v.dimensions = vec![triangles, three];
        let v = self.push(
            "snapshot",
            Quantity::Snapshot,
            "",
            "state of the cloth as toile_sim_restore reads it",
        );
        v.kind = Kind::Binary;
        v.variability = Variability::Discrete;
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
