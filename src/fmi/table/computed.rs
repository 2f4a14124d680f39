//! What the simulation answers: energies, extremes, counts, probes, arrays.

use super::{AXES, Sizes, Table, body_names, probe_names};
use crate::fmi::variables::{Causality, Dimension, EnergyPart, Kind, Quantity, Variability};
use crate::scene::{PinPlace, Scene};

impl Table {
    pub(super) fn results(&mut self, scene: &Scene) {
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
            (
                "yarn",
                EnergyPart::Yarn,
                "energy of yarns: stretch, bending, contacts, friction",
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
            "largest relative stretch of an edge or of yarn",
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
                "how the last step or drape ended: 0 converged, 1 in substeps, 2 iteration limit, 4 stalled, 5 falling",
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

    pub(super) fn probes(&mut self, scene: &Scene) {
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

    /// Vertices of a deforming mesh, as an array to be set.
    fn mesh(&mut self, body: usize, name: &str, first: &[[f64; 3]], moves: bool) {
        let name = format!("body.{name}.vertex");
        let count = self.count(
            format!("{name}.count"),
            first.len(),
            "number of vertices of the body's mesh",
        );
        self.parameter(
            format!("{name}.driven"),
            Quantity::MeshDriven(body),
            "",
            f64::from(u8::from(!moves)),
            "true: the mesh follows vertex.position; false: the scene's frames",
        )
        .kind = Kind::Boolean;
        let v = self.input(
            format!("{name}.position"),
            Quantity::MeshVertices(body),
            "m",
            0.0,
            "vertices of the mesh in the body's frame where they are when a step ends, shape [count, 3]",
        );
        v.dimensions = vec![count, Dimension::Size(3)];
        v.starts = first.as_flattened().to_vec();
    }

    pub(super) fn arrays(&mut self, scene: &Scene, sizes: &Sizes) {
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
        if sizes.nodes > 0 {
            let nodes = self.count(
                "yarn.node.capacity".into(),
                sizes.nodes,
                "room for nodes of yarns",
            );
            let v = self.push(
                "yarn.node.count",
                Quantity::NodeCount,
                "",
                "number of the yarns' nodes",
            );
            v.kind = Kind::Int32;
            v.variability = Variability::Discrete;
            (v.min, v.max) = (Some(0.0), Some(sizes.nodes as f64));
            self.push(
                "yarn.node.position",
                Quantity::Nodes,
                "m",
                "positions of the yarns' nodes, zeros from yarn.node.count on, shape [yarn.node.capacity, 3]",
            )
            .dimensions = vec![nodes, three];
        }
        for (b, (body, name)) in scene.bodies.iter().zip(body_names(scene)).enumerate() {
            if let Some(first) = body.motion.frames.first() {
                self.mesh(b, &name, first, body.motion.frames.len() > 1);
            }
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
