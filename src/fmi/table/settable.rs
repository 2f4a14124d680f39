//! What a master sets: the world, bodies, pins, fabrics, tunables. Forces stand with what they act on.

use super::{AXES, Table, body_names};
use crate::fmi::fabric_numbers::FabricNumber;
use crate::fmi::names;
use crate::fmi::units;
use crate::fmi::variables::{Kind, Quantity, Variability};
use crate::scene::Scene;
use crate::solve::settings::Settings;

impl Table {
    pub(super) fn world(&mut self, scene: &Scene) {
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

    pub(super) fn bodies(&mut self, scene: &Scene) {
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

    pub(super) fn pins(&mut self, scene: &Scene) {
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

    pub(super) fn fabrics(&mut self, scene: &Scene) {
        let fabrics = &scene.garment.fabrics;
        let names = names::unique(fabrics.iter().map(|f| f.name.as_str()));
        for (f, (fabric, name)) in fabrics.iter().zip(names).enumerate() {
            for &number in FabricNumber::ALL {
                if fabric.fitted && number.is_fitted() {
                    continue;
                }
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

    pub(super) fn settings(&mut self, scene: &Scene) {
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
}
