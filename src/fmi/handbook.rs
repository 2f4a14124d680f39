//! `documentation/index.html` of an archive, made from its scene.

use super::describe::Description;
use super::variables::{Causality, Variable};
use super::xml::{Xml, attribute};
use crate::error::Result;

/// Paragraphs that hold for every FMU of toile.
const RULES: &[(&str, &[&str])] = &[
    (
        "Time and steps",
        &[
            "A step takes the inputs as they are when it begins; outputs are those of its end. Steps of \
             any size may be asked for; inside, a step is cut into substeps where the cloth needs them. A \
             step that finds no admissible state is discarded: nothing has changed, and a shorter one may \
             pass.",
            "A body is at its position and quaternion plus what its velocities add during the step when \
             the step ends. A master that knows where the body will be sets that pose and leaves the \
             velocities at zero; one that knows only the present pose sets the velocities too. In \
             Initialization Mode a pose is a placement and has no velocity.",
            "Forces and torques are those of the cloth on a body or on what holds a pin, in world axes, \
             torques about the body's origin.",
            "With the parameter drape the garment is sewn and draped to rest when the initialization ends. \
             An archive that was draped when it was made begins at rest; if fabric numbers are then \
             changed, the garment begins at the same positions and moves from there, or is draped anew.",
        ],
    ),
    (
        "States",
        &[
            "States can be saved, restored, and written as bytes that this FMU, and no other, takes back. A \
             run that goes on from a restored state has the same bits as the one that it was saved from, \
             whatever the number of threads.",
        ],
    ),
    (
        "Derivatives",
        &[
            "This FMU provides no derivatives: providesDirectionalDerivatives and \
             providesAdjointDerivatives are false, and the functions answer with an error.",
            "What they will mean once they are there: this FMU exposes no continuous states; the history \
             since the initialization belongs to its function. A design variable is a parameter with \
             variability fixed, so that its derivative is the one along the whole trajectory since the \
             start, which central differences of repeated runs confirm. Tunable parameters have no such \
             derivative.",
        ],
    ),
];

/// The page.
pub(super) fn page(description: &Description<'_>, icon: &str) -> Result<Vec<u8>> {
    let scene = description.scene;
    let mut xml = Xml::fragment();
    xml.element("html", &[attribute("lang", "en")], |xml| {
        xml.element("head", &[], |xml| {
            xml.empty("meta", &[attribute("charset", "utf-8")])?;
            xml.text("title", &[], &scene.name)
        })?;
        xml.element("body", &[], |xml| {
            xml.text("h1", &[], &scene.name)?;
            xml.empty(
                "img",
                &[
                    attribute("src", icon),
                    attribute("alt", "the garment when the run begins"),
                ],
            )?;
            let panels = &scene.garment.panels;
            let names: Vec<&str> = panels.iter().map(|p| p.name.as_str()).collect();
            xml.text(
                "p",
                &[],
                &format!(
                    "A garment of {} panels ({}) and {} seams with {} bodies, simulated by toile {}. \
                     Units are those of the SI; no axis is special.",
                    panels.len(),
                    names.join(", "),
                    scene.garment.seams.len(),
                    scene.bodies.len(),
                    env!("CARGO_PKG_VERSION")
                ),
            )?;
            for (title, paragraphs) in RULES {
                xml.text("h2", &[], title)?;
                for paragraph in *paragraphs {
                    xml.text("p", &[], paragraph)?;
                }
            }
            for (title, causality) in [
                ("Inputs", Causality::Input),
                ("Parameters", Causality::Parameter),
                ("Sizes", Causality::Structural),
                ("Outputs", Causality::Output),
                ("Others", Causality::Local),
            ] {
                variables(xml, title, description.variables, causality)?;
            }
            Ok(())
        })
    })?;
    let mut page = b"<!DOCTYPE html>\n".to_vec();
    page.extend(xml.finish());
    Ok(page)
}

fn variables(xml: &mut Xml, title: &str, all: &[Variable], causality: Causality) -> Result<()> {
    xml.text("h2", &[], title)?;
    xml.element("table", &[], |xml| {
        xml.element("tr", &[], |xml| {
            ["name", "type", "variability", "unit", "start", "meaning"]
                .iter()
                .try_for_each(|head| xml.text("th", &[], head))
        })?;
        for v in all.iter().filter(|v| v.causality == causality) {
            let start = if v.is_settable() {
                v.start.to_string()
            } else {
                String::new()
            };
            xml.element("tr", &[], |xml| {
                let kind = match v.dimensions.len() {
                    0 => v.kind.name().to_owned(),
                    _ => format!(
                        "{} {:?}",
                        v.kind.name(),
                        v.dimensions.iter().map(|d| d.size()).collect::<Vec<_>>()
                    ),
                };
                for cell in [
                    v.name.as_str(),
                    &kind,
                    v.variability.name(),
                    v.unit,
                    &start,
                    &v.description,
                ] {
                    xml.text("td", &[], cell)?;
                }
                Ok(())
            })?;
        }
        Ok(())
    })
}
