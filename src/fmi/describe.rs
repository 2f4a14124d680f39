//! `modelDescription.xml` of FMI 3.0 and FMI 2.0, and the terminals, from the list of variables.

use super::log;
use super::table::body_names;
use super::units::UNITS;
use super::variables::{Causality, Dimension, Kind, Quantity, Variable};
use super::xml::{Attribute, Xml, attribute};
use crate::error::Result;
use crate::scene::Scene;

/// What an archive is described by.
#[derive(Clone, Debug)]
pub(super) struct Description<'a> {
    /// Name of the binary, a C identifier.
    pub(super) identifier: &'a str,
    /// Instantiation token.
    pub(super) token: &'a str,
    /// The scene.
    pub(super) scene: &'a Scene,
    /// Its variables.
    pub(super) variables: &'a [Variable],
}

/// Stop time where the scene names no duration [s].
const STOP_TIME: f64 = 0.25;

fn truth(yes: bool) -> String {
    yes.to_string()
}

/// The start value as the type writes it, of an array all of them.
fn start(v: &Variable) -> String {
    if !v.starts.is_empty() {
        let each: Vec<String> = v.starts.iter().map(f64::to_string).collect();
        return each.join(" ");
    }
    match v.kind {
        Kind::Boolean => truth(v.start > 0.5),
        _ => v.start.to_string(),
    }
}

/// Attributes that numbers of both versions have.
fn bounds(v: &Variable, out: &mut Vec<Attribute<'static>>) {
    if v.kind == Kind::Float64 && !v.unit.is_empty() {
        out.push(attribute("unit", v.unit));
    }
    if matches!(v.kind, Kind::Boolean | Kind::Binary) {
        return;
    }
    out.extend(v.min.map(|min| attribute("min", min)));
    out.extend(v.max.map(|max| attribute("max", max)));
    out.extend(v.nominal.map(|nominal| attribute("nominal", nominal)));
}

/// The attribute `initial`; time and inputs have none.
fn initial(v: &Variable) -> Option<&'static str> {
    match v.causality {
        Causality::Independent | Causality::Input => None,
        Causality::Structural | Causality::Parameter => Some("exact"),
        Causality::Output | Causality::Local => Some("calculated"),
    }
}

impl Description<'_> {
    fn about(&self) -> [Attribute<'static>; 4] {
        let text = format!(
            "{}: cloth of {} panels simulated by toile",
            self.scene.name,
            self.scene.garment.panels.len()
        );
        [
            attribute("modelName", &self.scene.name),
            attribute("description", text),
            attribute(
                "generationTool",
                concat!("toile ", env!("CARGO_PKG_VERSION")),
            ),
            attribute("variableNamingConvention", "structured"),
        ]
    }

    fn experiment(&self, xml: &mut Xml) -> Result<()> {
        let run = &self.scene.run;
        let stop = if run.duration > 0.0 {
            run.duration
        } else {
            STOP_TIME
        };
        xml.empty(
            "DefaultExperiment",
            &[
                attribute("startTime", 0.0),
                attribute("stopTime", stop),
                attribute("stepSize", run.dt),
            ],
        )
    }

    fn units(&self, xml: &mut Xml, used: &[&Variable]) -> Result<()> {
        xml.element("UnitDefinitions", &[], |xml| {
            for (name, kg, m, s, rad) in UNITS {
                if used.iter().all(|v| v.unit != *name) {
                    continue;
                }
                xml.element("Unit", &[attribute("name", name)], |xml| {
                    let exponents = [("kg", kg), ("m", m), ("s", s), ("rad", rad)];
                    let some: Vec<_> = exponents
                        .iter()
                        .filter(|e| *e.1 != 0)
                        .map(|e| attribute(e.0, e.1))
                        .collect();
                    xml.empty("BaseUnit", &some)
                })?;
            }
            Ok(())
        })
    }

    /// The model description of FMI 3.0.
    pub(super) fn fmi3(&self) -> Result<Vec<u8>> {
        let mut xml = Xml::new()?;
        let mut root = vec![attribute("fmiVersion", "3.0")];
        root.extend(self.about());
        root.push(attribute("instantiationToken", self.token));
        let all: Vec<&Variable> = self.variables.iter().collect();
        xml.element("fmiModelDescription", &root, |xml| {
            xml.empty(
                "CoSimulation",
                &[
                    attribute("modelIdentifier", self.identifier),
                    attribute("canGetAndSetFMUState", true),
                    attribute("canSerializeFMUState", true),
                    attribute("canHandleVariableCommunicationStepSize", true),
                    attribute("providesDirectionalDerivatives", false),
                    attribute("providesAdjointDerivatives", false),
                    attribute("hasEventMode", false),
                    attribute("providesIntermediateUpdate", false),
                    attribute("mightReturnEarlyFromDoStep", false),
                    attribute("canBeInstantiatedOnlyOncePerProcess", false),
                ],
            )?;
            self.units(xml, &all)?;
            xml.element("LogCategories", &[], |xml| {
                for (name, doc) in log::CATEGORIES {
                    let category = [attribute("name", name), attribute("description", doc)];
                    xml.empty("Category", &category)?;
                }
                Ok(())
            })?;
            self.experiment(xml)?;
            xml.element("ModelVariables", &[], |xml| {
                self.variables
                    .iter()
                    .enumerate()
                    .try_for_each(|(reference, v)| variable3(xml, reference, v))
            })?;
            xml.element("ModelStructure", &[], |xml| {
                for element in ["Output", "InitialUnknown"] {
                    for (reference, v) in self.variables.iter().enumerate() {
                        if v.causality == Causality::Output {
                            xml.empty(element, &[attribute("valueReference", reference)])?;
                        }
                    }
                }
                Ok(())
            })
        })?;
        Ok(xml.finish())
    }

    /// The model description of FMI 2.0: scalars only.
    pub(super) fn fmi2(&self) -> Result<Vec<u8>> {
        let mut xml = Xml::new()?;
        let mut root = vec![attribute("fmiVersion", "2.0")];
        root.extend(self.about());
        root.push(attribute("guid", self.token));
        root.push(attribute("numberOfEventIndicators", 0));
        let listed = self.variables.iter().enumerate();
        let listed: Vec<(usize, &Variable)> = listed.filter(|(_, v)| v.is_in_fmi2()).collect();
        let used: Vec<&Variable> = listed.iter().map(|l| l.1).collect();
        xml.element("fmiModelDescription", &root, |xml| {
            xml.empty(
                "CoSimulation",
                &[
                    attribute("modelIdentifier", self.identifier),
                    attribute("canHandleVariableCommunicationStepSize", true),
                    attribute("canInterpolateInputs", false),
                    attribute("maxOutputDerivativeOrder", 0),
                    attribute("canRunAsynchronuously", false),
                    attribute("canBeInstantiatedOnlyOncePerProcess", false),
                    attribute("canNotUseMemoryManagementFunctions", true),
                    attribute("canGetAndSetFMUstate", true),
                    attribute("canSerializeFMUstate", true),
                    attribute("providesDirectionalDerivative", false),
                ],
            )?;
            self.units(xml, &used)?;
            xml.element("LogCategories", &[], |xml| {
                let all = (log::ALL, "all messages");
                for (name, doc) in log::CATEGORIES.iter().chain([&all]) {
                    let category = [attribute("name", name), attribute("description", doc)];
                    xml.empty("Category", &category)?;
                }
                Ok(())
            })?;
            self.experiment(xml)?;
            xml.element("ModelVariables", &[], |xml| {
                listed
                    .iter()
                    .try_for_each(|(reference, v)| variable2(xml, *reference, v))
            })?;
            xml.element("ModelStructure", &[], |xml| {
                for element in ["Outputs", "InitialUnknowns"] {
                    xml.element(element, &[], |xml| {
                        for (place, (_, v)) in listed.iter().enumerate() {
                            if v.causality == Causality::Output {
                                xml.empty("Unknown", &[attribute("index", place + 1)])?;
                            }
                        }
                        Ok(())
                    })?;
                }
                Ok(())
            })
        })?;
        Ok(xml.finish())
    }

    /// Terminals of FMI 3.0: a plug for each body and each pin, with what goes both ways.
    pub(super) fn terminals(&self) -> Result<Vec<u8>> {
        let mut xml = Xml::new()?;
        let root = [attribute("fmiVersion", "3.0")];
        xml.element("fmiTerminalsAndIcons", &root, |xml| {
            let bodies = body_names(self.scene);
            let count = self.scene.pins.len();
            if bodies.is_empty() && count == 0 {
                return Ok(());
            }
            xml.element("Terminals", &[], |xml| {
                for (b, name) in bodies.iter().enumerate() {
                    let name = format!("body.{name}");
                    let doc =
                        "pose and velocity of a body in, force and torque of the cloth on it out";
                    self.terminal(xml, &name, doc, |q| of_body(q) == Some(b))?;
                }
                for p in 0..count {
                    let name = format!("pin[{}]", p + 1);
                    let doc =
                        "displacement of what holds the cloth in, force of the cloth on it out";
                    self.terminal(xml, &name, doc, |q| of_pin(q) == Some(p))?;
                }
                Ok(())
            })
        })?;
        Ok(xml.finish())
    }

    fn terminal(
        &self,
        xml: &mut Xml,
        name: &str,
        doc: &str,
        belongs: impl Fn(Quantity) -> bool,
    ) -> Result<()> {
        let attributes = [
            attribute("name", name),
            attribute("matchingRule", "bus"),
            attribute("description", doc),
        ];
        xml.element("Terminal", &attributes, |xml| {
            for v in self.variables.iter().filter(|v| belongs(v.quantity)) {
                let member = v.name.strip_prefix(name).unwrap_or(&v.name);
                xml.empty(
                    "TerminalMemberVariable",
                    &[
                        attribute("variableName", &v.name),
                        attribute("memberName", member.trim_start_matches('.')),
                        attribute("variableKind", "signal"),
                    ],
                )?;
            }
            Ok(())
        })
    }
}

/// The body whose pose, velocity, force or torque this is.
fn of_body(quantity: Quantity) -> Option<usize> {
    match quantity {
        Quantity::BodyPosition(b, _)
        | Quantity::BodyQuaternion(b, _)
        | Quantity::BodyVelocity(b, _)
        | Quantity::BodyAngularVelocity(b, _)
        | Quantity::MeshVertices(b)
        | Quantity::BodyForce(b, _)
        | Quantity::BodyTorque(b, _) => Some(b),
        _ => None,
    }
}

/// The pin whose displacement or reaction this is.
fn of_pin(quantity: Quantity) -> Option<usize> {
    match quantity {
        Quantity::PinDisplacement(p, _) | Quantity::PinReaction(p, _) => Some(p),
        _ => None,
    }
}

fn variable3(xml: &mut Xml, reference: usize, v: &Variable) -> Result<()> {
    let mut attributes = vec![
        attribute("name", &v.name),
        attribute("valueReference", reference),
        attribute("causality", v.causality.name()),
        attribute("variability", v.variability.name()),
        attribute("description", &v.description),
    ];
    attributes.extend(initial(v).map(|i| attribute("initial", i)));
    bounds(v, &mut attributes);
    if v.is_settable() {
        attributes.push(attribute("start", start(v)));
    }
    if v.quantity == Quantity::Snapshot {
        attributes.push(attribute("mimeType", "application/vnd.toile.snapshot"));
    }
    if v.dimensions.is_empty() {
        return xml.empty(v.kind.name(), &attributes);
    }
    xml.element(v.kind.name(), &attributes, |xml| {
        for dimension in &v.dimensions {
            let size = match dimension {
                Dimension::Size(n) => attribute("start", n),
                Dimension::Count(reference, _) => attribute("valueReference", reference),
            };
            xml.empty("Dimension", &[size])?;
        }
        Ok(())
    })
}

fn variable2(xml: &mut Xml, reference: usize, v: &Variable) -> Result<()> {
    let mut attributes = vec![
        attribute("name", &v.name),
        attribute("valueReference", reference),
        attribute("causality", v.causality.name()),
        attribute("variability", v.variability.name()),
        attribute("description", &v.description),
    ];
    attributes.extend(initial(v).map(|i| attribute("initial", i)));
    let mut typed = Vec::new();
    bounds(v, &mut typed);
    if v.is_settable() {
        typed.push(attribute("start", start(v)));
    }
    xml.element("ScalarVariable", &attributes, |xml| {
        xml.empty(v.kind.fmi2_name().unwrap_or_default(), &typed)
    })
}
