//! Garments: made, built panel by panel, edited. What is read of them stands in
//! `garment_readout`.

use super::desc;
use super::guard::{entry, guard};
use super::handle::Table;
use super::input;
use super::output;
use super::panel::{LARGEST_PANEL, panel};
use super::status::{TOILE_NONE, toile_status};
use super::types::{toile_garment, toile_garment_desc, toile_panel_desc, toile_seam_desc};
use crate::blend::trace;
use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::{BlendRegion, EdgeRef, Fabric, Garment, Panel, Seam, Shape, import};
use crate::tri::triangulate;
use std::ffi::c_char;
use std::ptr;

/// A garment and what was said while it was read.
#[derive(Debug)]
pub(super) struct GarmentObject {
    pub(super) garment: Garment,
    pub(super) warnings: Vec<String>,
}

pub(super) static GARMENTS: Table<GarmentObject> = Table::new(0x71, "garment");

pub(super) fn insert(garment: Garment, warnings: Vec<String>) -> Result<*mut toile_garment> {
    let object = GarmentObject { garment, warnings };
    Ok(ptr::without_provenance_mut(GARMENTS.insert(object)?))
}

pub(super) fn read<R>(
    garment: *const toile_garment,
    f: impl FnOnce(&GarmentObject) -> Result<R>,
) -> Result<R> {
    GARMENTS.get(garment.addr())?.read(f)
}

fn write<R>(
    garment: *mut toile_garment,
    f: impl FnOnce(&mut GarmentObject) -> Result<R>,
) -> Result<R> {
    GARMENTS.get(garment.addr())?.write(f)
}

/// Tries an edit on a copy: an error leaves the garment as it was.
fn edit<R>(garment: *mut toile_garment, f: impl FnOnce(&mut Garment) -> Result<R>) -> Result<R> {
    edit_saying(garment, Vec::new(), f)
}

fn edit_saying<R>(
    garment: *mut toile_garment,
    mut warnings: Vec<String>,
    f: impl FnOnce(&mut Garment) -> Result<R>,
) -> Result<R> {
    write(garment, |object| {
        let mut changed = object.garment.clone();
        let result = f(&mut changed)?;
        // a garment on its way may still be without panels; how fine it gets is asked when it is
        // simulated
        if !changed.panels.is_empty() {
            changed.check_geometry()?;
        }
        object.garment = changed;
        object.warnings.append(&mut warnings);
        Ok(result)
    })
}

pub(super) fn index(count: usize, what: &str) -> Result<u32> {
    u32::try_from(count)
        .ok()
        .filter(|&i| i != TOILE_NONE)
        .ok_or_else(|| Error::limit(format!("too many {what}: {count}")))
}

pub(super) fn panel_of(garment: &Garment, panel: u32) -> Result<&Panel> {
    garment.panels.get(panel as usize).ok_or_else(|| {
        Error::argument(format!(
            "panel {panel} does not exist: the garment has {}",
            garment.panels.len()
        ))
    })
}

/// Makes an empty garment with one fabric, a plain cotton. `desc` NULL takes the defaults. Free it
/// with toile_garment_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_create(
    desc: *const toile_garment_desc,
    out: *mut *mut toile_garment,
) -> toile_status {
    entry!({
        input::target(out, "out")?;
        let desc = desc::read_or_default(desc)?;
        let garment = Garment {
            name: input::optional_name(desc.name, "name")?
                .unwrap_or_default()
                .to_owned(),
            edge_length: input::positive(desc.edge_length, "edge_length")?,
            fabrics: vec![Fabric::default()],
            ..Garment::default()
        };
        output::put(out, insert(garment, Vec::new())?);
        Ok(())
    })
}

/// Reads a garment from JSON: the `garment` object of a scene file, or a GarmentCode
/// specification. `utf8` has `length` bytes. Files named inside are looked for in `base_dir` (UTF-8,
/// ends with NUL; NULL: the working directory). Free it with toile_garment_free. TOILE_E_PARSE names
/// the place in the text; TOILE_E_GEOMETRY the panel, edge or seam.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_from_json(
    utf8: *const c_char,
    length: usize,
    base_dir: *const c_char,
    out: *mut *mut toile_garment,
) -> toile_status {
    entry!({
        input::target(out, "out")?;
        let text = input::text(utf8, length, "utf8")?;
        let folder = input::optional_folder(base_dir)?;
        let (garment, notes) = import::garment_with_notes(text, folder.as_deref())?;
        output::put(out, insert(garment, notes)?);
        Ok(())
    })
}

/// Adds a panel. `out_panel`, which may be NULL, gets its index. TOILE_E_GEOMETRY names the edge
/// that cannot be.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_add_panel(
    garment: *mut toile_garment,
    desc: *const toile_panel_desc,
    out_panel: *mut u32,
) -> toile_status {
    entry!({
        GARMENTS.get(garment.addr())?;
        let panel = panel(&desc::read(desc)?)?;
        let number = edit(garment, |g| {
            let number = index(g.panels.len(), "panels")?;
            let mut panel = panel;
            if panel.name.is_empty() {
                panel.name = format!("panel_{number}");
            }
            if panel.fabric >= g.fabrics.len() {
                return Err(Error::argument(format!(
                    "panel '{}': fabric {} does not exist: the garment has {}",
                    panel.name,
                    panel.fabric,
                    g.fabrics.len()
                )));
            }
            g.panels.push(panel);
            Ok(number)
        })?;
        if !out_panel.is_null() {
            output::put(out_panel, number);
        }
        Ok(())
    })
}

/// Sews two edges together. `out_seam`, which may be NULL, gets the seam's index.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_add_seam(
    garment: *mut toile_garment,
    desc: *const toile_seam_desc,
    out_seam: *mut u32,
) -> toile_status {
    entry!({
        GARMENTS.get(garment.addr())?;
        let desc = desc::read(desc)?;
        input::reserved(desc.reserved)?;
        let side = |panel, edge| EdgeRef { panel, edge };
        let seam = Seam {
            a: side(desc.panel_a, desc.edge_a),
            b: side(desc.panel_b, desc.edge_b),
            same_direction: input::flag(desc.same_direction, "same_direction")?,
            rest_angle: input::finite(desc.rest_angle, "rest_angle")?,
        };
        let number = edit(garment, |g| {
            let number = index(g.seams.len(), "seams")?;
            for side in [seam.a, seam.b] {
                let panel = panel_of(g, side.panel)?;
                if side.edge as usize >= panel.edge_count() {
                    return Err(Error::argument(format!(
                        "seam {number}: panel '{}' has {} edges, none of number {}",
                        panel.name,
                        panel.edge_count(),
                        side.edge
                    )));
                }
            }
            g.seams.push(seam);
            Ok(number)
        })?;
        if !out_seam.is_null() {
            output::put(out_seam, number);
        }
        Ok(())
    })
}

unsafe fn fabric(text: *const c_char, length: usize) -> Result<(Fabric, Vec<String>)> {
    // SAFETY: handed on.
    let text = unsafe { input::text(text, length, "fabric_json")? };
    let (fabric, warnings) = import::fabric_from_json(text)?;
    fabric.check()?;
    Ok((fabric, warnings))
}

/// Makes every panel of this one fabric, and fabric 0 the only one. JSON: toile's own (SI units) or
/// ARCSim's measured one; what of it was not used is told by toile_garment_warnings.
/// TOILE_E_MATERIAL names the number that cannot be.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_set_fabric(
    garment: *mut toile_garment,
    fabric_json: *const c_char,
    length: usize,
) -> toile_status {
    entry!({
        GARMENTS.get(garment.addr())?;
        let (fabric, warnings) = fabric(fabric_json, length)?;
        edit_saying(garment, warnings, |g| {
            g.fabrics = vec![fabric];
            for panel in &mut g.panels {
                panel.fabric = 0;
            }
            Ok(())
        })
    })
}

/// Adds a fabric for single panels; `out_fabric`, which may be NULL, gets its index.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_add_fabric(
    garment: *mut toile_garment,
    fabric_json: *const c_char,
    length: usize,
    out_fabric: *mut u32,
) -> toile_status {
    entry!({
        GARMENTS.get(garment.addr())?;
        let (fabric, warnings) = fabric(fabric_json, length)?;
        let number = edit_saying(garment, warnings, |g| {
            let number = index(g.fabrics.len(), "fabrics")?;
            g.fabrics.push(fabric);
            Ok(number)
        })?;
        if !out_fabric.is_null() {
            output::put(out_fabric, number);
        }
        Ok(())
    })
}

/// Makes one panel of the fabric with this index.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_set_panel_fabric(
    garment: *mut toile_garment,
    panel: u32,
    fabric: u32,
) -> toile_status {
    entry!({
        edit(garment, |g| {
            panel_of(g, panel)?;
            if fabric as usize >= g.fabrics.len() {
                return Err(Error::argument(format!(
                    "fabric {fabric} does not exist: the garment has {}",
                    g.fabrics.len()
                )));
            }
            g.panels[panel as usize].fabric = fabric as usize;
            Ok(())
        })
    })
}

/// The garment's regions with a polygon in the place of a panel's, none without corners; both garments and simulations have this
/// call.
pub(super) fn regions_with(
    garment: &Garment,
    panel: u32,
    uv: &[[f64; 2]],
    rings: u32,
) -> Result<Vec<BlendRegion>> {
    let name = &panel_of(garment, panel)?.name;
    let others = garment.blend_regions.iter().filter(|r| r.panel != panel);
    let mut regions: Vec<BlendRegion> = others.cloned().collect();
    if uv.is_empty() {
        return Ok(regions);
    }
    if uv.len() < 3 {
        return Err(Error::geometry(format!(
            "blend region of panel '{name}': {} corners are no polygon",
            uv.len()
        )));
    }
    if rings > 1000 {
        return Err(Error::limit(format!(
            "blend region of panel '{name}': {rings} rings are above the limit of 1000"
        )));
    }
    regions.push(BlendRegion {
        panel,
        shape: Shape::Polygon(uv.iter().map(|&[u, v]| Vec2::new(u, v)).collect()),
        rings,
    });
    Ok(regions)
}

/// Asks for every yarn inside a polygon of a panel: flat coordinates [m], shape [count, 2], with
/// `rings` hybrid rings around it. Takes the place of the panel's earlier region; a count of 0
/// takes it away.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_set_blend_region(
    garment: *mut toile_garment,
    panel: u32,
    uv: *const f64,
    count: usize,
    rings: u32,
) -> toile_status {
    entry!({
        GARMENTS.get(garment.addr())?;
        let uv = input::points::<2>(uv, count, LARGEST_PANEL, "uv")?;
        edit(garment, |g| {
            g.blend_regions = regions_with(g, panel, &uv, rings)?;
            Ok(())
        })
    })
}

/// Asks for every yarn in the triangles whose three corners have an `alpha` of 1, with `rings` hybrid rings around them: one number from
/// 0 to 1 for each vertex of the garment's simulation, shape [count], as toile_sim_suggest_region gives them. Values below 1 are
/// those of the rings. Takes the place of all earlier regions; 0 everywhere takes them away. The garment must not have
/// changed since in panels, seams or edge lengths. TOILE_E_ARGUMENT: another number of vertices, a value outside of 0 to 1, or
/// no triangle has three corners with 1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_set_blend_vertices(
    garment: *mut toile_garment,
    alpha: *const f64,
    count: usize,
    rings: u32,
) -> toile_status {
    entry!({
        GARMENTS.get(garment.addr())?;
        let alpha = input::array(alpha, count, input::LARGEST_COUNT, "alpha")?.to_vec();
        edit(garment, |g| {
            // estimates are rough; far more vertices than values are refused before they are made
            let most = 2 * alpha.len() + 1000;
            g.blend_regions.clear();
            g.check_within(most)?;
            let mesh = triangulate(g, 1.0, most)?;
            g.blend_regions = trace::from_alpha(&mesh, &alpha, rings)?;
            Ok(())
        })
    })
}

/// Takes every blend region away.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_clear_blend_region(
    garment: *mut toile_garment,
) -> toile_status {
    entry!({
        write(garment, |object| {
            object.garment.blend_regions.clear();
            Ok(())
        })
    })
}

/// Frees a garment; NULL is allowed. Simulations made of it are not concerned.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_free(garment: *mut toile_garment) {
    if !garment.is_null() {
        guard(|| GARMENTS.remove(garment.addr()));
    }
}
