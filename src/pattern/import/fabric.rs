//! Fabrics from JSON: toile's own keys in SI units, and ARCSim's measured format.
//!
//! toile's own keys stand in [`super::schema::FABRIC`]; absent keys take the values of
//! `Fabric::default()`.
//!
//! ARCSim's files (Wang, O'Brien, Ramamoorthi 2011, "Data-driven elastic models for cloth") hold
//! `density` [kg/m^2]; `stretching`: rows `[c11, c12, c22, c33]` [N/m] for several strains;
//! `bending`: rows for 0, 45 and 90 degrees to the first axis, each with values at growing
//! curvature [N m]. The measured law is `S11 = c11 E11 + c12 E22`, `S22 = c12 E11 + c22 E22`,
//! `S12 = c33 E12` with Green strain `E` and second Piola-Kirchhoff stress `S`, so the one energy per
//! rest area that has these stresses, and that is used here, is
//!
//! `1/2 (c11 E11^2 + 2 c12 E11 E22 + c22 E22^2) + c33 E12^2`.
//!
//! In [`Fabric`]'s form: `weft = c11`, `coupling = c12`, `warp = c22`, `shear = c33 / 2` (its shear
//! strain is `2 E12`). ARCSim's own code doubles every stiffness on loading, and its energy has
//! `c33 E12^2 / 2` where its force is that of `c33 E12^2`; neither is taken over. Row 0 of each table
//! is used: the smallest strain, and per direction the smallest curvature (0 degrees curves the
//! weft, 90 degrees the warp). Thickness, friction and damping take defaults.

use super::read::{Node, Object, parse};
use super::schema;
use super::yarns::read_yarns;
use crate::error::{Error, Result};
use crate::pattern::{BendingModel, Fabric, Ridge};

/// Reads a fabric, either kind; the notes say what the file holds that was not used.
pub fn fabric_from_json(text: &str) -> Result<(Fabric, Vec<String>)> {
    fabric_from_node(&Node::new(&parse(text)?, ""))
}

/// Reads a fabric that stands inside another JSON text.
pub fn fabric_from_node(node: &Node<'_>) -> Result<(Fabric, Vec<String>)> {
    let object = node.object()?;
    let (fabric, notes) = if object.has("stretching") {
        read_measured(&object)?
    } else {
        (read_own(&object)?, Vec::new())
    };
    fabric.check().map_err(|e| {
        if node.path.is_empty() {
            e
        } else {
            e.at(&node.path)
        }
    })?;
    Ok((fabric, notes))
}

fn read_own(object: &Object<'_>) -> Result<Fabric> {
    object.only(schema::FABRIC)?;
    let mut fabric = Fabric::default();
    if let Some(name) = object.get("name") {
        fabric.name = name.text()?.to_owned();
    }
    fabric.density = object.number_or("density", fabric.density)?;
    fabric.thickness = object.number_or("thickness", fabric.thickness)?;
    fabric.friction = object.number_or("friction", fabric.friction)?;
    if let Some(node) = object.get("membrane") {
        let membrane = node.object()?;
        membrane.only(schema::MEMBRANE)?;
        fabric.warp = membrane.number_or("warp", fabric.warp)?;
        fabric.weft = membrane.number_or("weft", fabric.weft)?;
        fabric.shear = membrane.number_or("shear", fabric.shear)?;
        fabric.coupling = match (membrane.get("coupling"), membrane.get("poisson")) {
            (Some(_), Some(_)) => {
                return Err(membrane.error("has both 'coupling' and 'poisson'; give one"));
            }
            (Some(coupling), None) => coupling.number()?,
            (None, Some(poisson)) => poisson.number()? * (fabric.warp * fabric.weft).sqrt(),
            (None, None) => fabric.coupling,
        };
    }
    if let Some(node) = object.get("ridges") {
        fabric.ridges = node
            .array()?
            .iter()
            .map(read_ridge)
            .collect::<Result<_>>()?;
    }
    if let Some(node) = object.get("bending") {
        let bending = node.object()?;
        bending.only(schema::BENDING)?;
        fabric.bending_warp = bending.number_or("warp", fabric.bending_warp)?;
        fabric.bending_weft = bending.number_or("weft", fabric.bending_weft)?;
        fabric.curvature_warp = bending.number_or("curvature_warp", fabric.curvature_warp)?;
        fabric.curvature_weft = bending.number_or("curvature_weft", fabric.curvature_weft)?;
        if let Some(model) = bending.get("model") {
            fabric.bending_model = match model.text()? {
                "hinge" => BendingModel::Hinge,
                "quadratic" => BendingModel::Quadratic,
                other => {
                    return Err(
                        model.error(format!("must be \"hinge\" or \"quadratic\", is {other:?}"))
                    );
                }
            };
        }
    }
    if let Some(node) = object.get("damping") {
        let damping = node.object()?;
        damping.only(schema::DAMPING)?;
        fabric.damping_mass = damping.number_or("mass", fabric.damping_mass)?;
        fabric.damping_stiffness = damping.number_or("stiffness", fabric.damping_stiffness)?;
    }
    if let Some(node) = object.get("triangles") {
        fabric.fitted = match node.text()? {
            "given" => false,
            "fitted" => true,
            other => {
                return Err(node.error(format!("must be \"given\" or \"fitted\", is {other:?}")));
            }
        };
    }
    fabric.yarns = object.get("yarns").map(|n| read_yarns(&n)).transpose()?;
    Ok(fabric)
}

fn read_ridge(node: &Node<'_>) -> Result<Ridge> {
    let object = node.object()?;
    object.only(schema::RIDGE)?;
    let numbers = |key: &str| -> Result<Vec<f64>> {
        object
            .need(key)?
            .array()?
            .iter()
            .map(Node::number)
            .collect()
    };
    let direction = object.need("direction")?.vec3()?;
    Ridge::new(direction, numbers("strain")?, numbers("stiffness")?).map_err(|e| e.at(&node.path))
}

fn read_measured(object: &Object<'_>) -> Result<(Fabric, Vec<String>)> {
    let mut notes = Vec::new();
    let mut fabric = Fabric {
        name: "measured fabric".into(),
        ..Fabric::default()
    };
    if let Some(name) = object.get("name") {
        fabric.name = name.text()?.to_owned();
    }
    fabric.density = object.need("density")?.number()?;
    if let Some(thickness) = object.get("thickness") {
        fabric.thickness = thickness.number()?;
    }
    let stretching = object.need("stretching")?;
    let mut samples = Vec::new();
    for node in stretching.array()? {
        let row = node.array_of::<4>()?;
        let mut values = [0.0; 4];
        for (value, entry) in values.iter_mut().zip(&row) {
            *value = entry.number()?;
        }
        samples.push(values);
    }
    let Some(&[c11, c12, c22, c33]) = samples.first() else {
        return Err(stretching.error("must have at least one row"));
    };
    if !(c11 > 0.0 && c22 > 0.0 && c33 > 0.0 && c12 * c12 < c11 * c22) {
        return Err(Error::material(format!(
            "{}[0]: [{c11}, {c12}, {c22}, {c33}] is not positive definite: c11, c22, c33 and c11 c22 - c12^2 must be positive",
            stretching.path
        )));
    }
    fabric.weft = c11;
    fabric.coupling = c12;
    fabric.warp = c22;
    fabric.shear = 0.5 * c33;
    if samples.len() > 1 {
        let bad = samples[1..]
            .iter()
            .filter(|s| !(s[0] > 0.0 && s[2] > 0.0 && s[3] > 0.0 && s[1] * s[1] < s[0] * s[2]))
            .count();
        notes.push(format!(
            "stretching: used row 0 of {}; dropped the {} rows at larger strain, {bad} of them not positive definite",
            samples.len(),
            samples.len() - 1
        ));
    }
    let bending = object.need("bending")?;
    let rows = bending.array_of::<3>()?;
    let mut first = [0.0; 3];
    let mut longest = 0;
    for (value, row) in first.iter_mut().zip(&rows) {
        let entries = row.array()?;
        for entry in &entries {
            entry.number()?;
        }
        *value = entries
            .first()
            .ok_or_else(|| row.error("must have at least one value"))?
            .number()?;
        longest = longest.max(entries.len());
    }
    fabric.bending_weft = first[0];
    fabric.bending_warp = first[2];
    notes.push(format!(
        "bending: used the first curvature of the 0 degree (weft) and 90 degree (warp) rows; dropped {} further curvatures of each row and the 45 degree row (first value {:e} N m)",
        longest.saturating_sub(1),
        first[1]
    ));
    notes.push(format!(
        "thickness {} m, friction {} and damping are not measured: defaults",
        fabric.thickness, fabric.friction
    ));
    for (key, _) in object.entries() {
        if !["name", "density", "thickness", "stretching", "bending"].contains(&key) {
            let key: String = key.chars().take(60).collect();
            notes.push(format!("ignored key {key:?}"));
        }
    }
    Ok((fabric, notes))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MEASURED: &str = r#"{"density": 0.3,
        "stretching": [[200, 10, 1000, 50], [210, 40, 1050, -6]],
        "bending": [[6e-5, 5e-5], [7e-5, 6e-5], [9e-5, 8e-5]]}"#;

    #[test]
    fn measured_fabric_takes_sample_zero_and_reports_the_rest() {
        let (fabric, notes) = fabric_from_json(MEASURED).unwrap();
        assert_eq!(
            (fabric.weft, fabric.coupling, fabric.warp, fabric.shear),
            (200.0, 10.0, 1000.0, 25.0)
        );
        assert_eq!((fabric.bending_weft, fabric.bending_warp), (6e-5, 9e-5));
        assert!(
            notes[0].contains("1 of them not positive definite"),
            "{notes:?}"
        );
        assert!(notes[1].contains("45 degree"), "{notes:?}");
    }

    #[test]
    fn indefinite_sample_zero_is_refused() {
        let text = MEASURED.replace("[200, 10, 1000, 50]", "[200, 500, 1000, 50]");
        let error = fabric_from_json(&text).unwrap_err();
        assert!(error.message.contains("stretching[0]"), "{error}");
        let text = MEASURED.replace("[200, 10, 1000, 50]", "[200, 10, 1000, -50]");
        assert!(fabric_from_json(&text).is_err());
    }

    #[test]
    fn own_keys_are_read_and_unknown_ones_name_their_path() {
        let text = r#"{"name": "x", "density": 0.1, "membrane": {"warp": 400, "weft": 100,
            "poisson": 0.25, "shear": 30}, "bending": {"model": "quadratic"},
            "damping": {"mass": 1, "stiffness": 0.001}, "thickness": 0, "friction": 0.5}"#;
        let (fabric, notes) = fabric_from_json(text).unwrap();
        assert!(notes.is_empty());
        assert_eq!(fabric.coupling, 50.0);
        assert_eq!(fabric.bending_model, BendingModel::Quadratic);
        let error = fabric_from_json(r#"{"membrane": {"wrap": 3}}"#).unwrap_err();
        assert!(error.message.starts_with("membrane.wrap:"), "{error}");
        let error = fabric_from_json(r#"{"membrane": {"warp": "3"}}"#).unwrap_err();
        assert!(error.message.starts_with("membrane.warp:"), "{error}");
        assert!(fabric_from_json(r#"{"density": -1}"#).is_err());
    }

    #[test]
    fn ridges_come_back_from_json_and_bad_ones_name_their_place() {
        let text = r#"{"ridges": [{"direction": [1, 0.5, 0], "strain": [-0.1, 0.2], "stiffness": [0, 40]},
            {"direction": [0, 0, 1], "strain": [0], "stiffness": [3]}]}"#;
        let (fabric, _) = fabric_from_json(text).unwrap();
        assert_eq!(fabric.ridges.len(), 2);
        assert_eq!(fabric.ridges[0].stiffness(), [0.0, 40.0]);
        let again = crate::pattern::export::fabric_to_json(&fabric).unwrap();
        assert_eq!(fabric_from_json(&again).unwrap().0, fabric);
        for (from, to, place) in [
            ("[0, 40]", "[0, -40]", "ridges[0]: stiffness[1] = -40"),
            ("[0, 40]", "[0]", "ridges[0]: 2 strains and 1"),
            ("[-0.1, 0.2]", "[0.2, 0.2]", "ridges[0]: strain[1] = 0.2"),
            ("[0, 0, 1]", "[0, 0]", "ridges[1].direction"),
            ("\"strain\": [0]", "\"strains\": [0]", "ridges[1].strains"),
        ] {
            let error = fabric_from_json(&text.replace(from, to)).unwrap_err();
            assert!(error.message.contains(place), "{place}: {error}");
        }
    }
}
