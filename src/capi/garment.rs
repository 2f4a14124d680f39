//! Garments: built panel by panel or read from JSON, edited, written.

use super::desc;
use super::guard::{entry, guard};
use super::handle::Table;
use super::input;
use super::output;
use super::status::{TOILE_NONE, toile_status};
use super::types::{
    TOILE_EDGE_ARC, TOILE_EDGE_CUBIC, TOILE_EDGE_LINE, TOILE_EDGE_QUADRATIC, toile_garment,
    toile_garment_desc, toile_panel_desc, toile_seam_desc,
};
use crate::error::{Error, Result};
use crate::math::{Rotation, Vec2, Vec3};
use crate::pattern::curve::Curve;
use crate::pattern::{
    BlendRegion, Edge, EdgeRef, Fabric, Garment, Panel, Placement, Seam, export, import,
};
use std::ffi::c_char;
use std::ptr;

/// A garment and what was said while it was read.
#[derive(Debug)]
pub(super) struct GarmentObject {
    pub(super) garment: Garment,
    warnings: Vec<String>,
}

pub(super) static GARMENTS: Table<GarmentObject> = Table::new(0x71, "garment");

/// Most corners, edges or holes of one panel.
const LARGEST_PANEL: usize = 1 << 20;

pub(super) fn insert(garment: Garment, warnings: Vec<String>) -> Result<*mut toile_garment> {
    let object = GarmentObject { garment, warnings };
    Ok(ptr::without_provenance_mut(GARMENTS.insert(object)?))
}

fn read<R>(
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

fn index(count: usize, what: &str) -> Result<u32> {
    u32::try_from(count)
        .ok()
        .filter(|&i| i != TOILE_NONE)
        .ok_or_else(|| Error::limit(format!("too many {what}: {count}")))
}

fn panel_of(garment: &Garment, panel: u32) -> Result<&Panel> {
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

/// A panel from its description; everything about it that does not need the garment is checked.
unsafe fn panel(desc: &toile_panel_desc) -> Result<Panel> {
    const LIMIT: usize = LARGEST_PANEL;
    input::reserved(desc.reserved)?;
    // SAFETY: the description's pointers are the caller's, as the header asks.
    let (name, vertices, pairs, kinds, controls, holes) = unsafe {
        let kinds = if desc.edge_kinds.is_null() {
            &[]
        } else {
            input::array(desc.edge_kinds, desc.edge_count, LIMIT, "edge_kinds")?
        };
        let controls = if desc.edge_controls.is_null() {
            Vec::new()
        } else {
            controls(desc.edge_controls, desc.edge_count, kinds)?
        };
        (
            input::optional_name(desc.name, "name")?.unwrap_or_default(),
            input::points::<2>(desc.vertices, desc.vertex_count, LIMIT, "vertices")?,
            input::array(
                desc.edges.cast::<[u32; 2]>(),
                desc.edge_count,
                LIMIT,
                "edges",
            )?,
            kinds,
            controls,
            input::array(desc.hole_sizes, desc.hole_count, LIMIT, "hole_sizes")?,
        )
    };
    if vertices.len() < 2 {
        return Err(Error::geometry(format!(
            "panel '{name}': {} corners cannot enclose anything",
            vertices.len()
        )));
    }

    // edges, straight around the corners if none are given
    let corner_count = vertices.len();
    let mut edges = Vec::with_capacity(pairs.len().max(corner_count));
    if pairs.is_empty() {
        if !kinds.is_empty() || !holes.is_empty() {
            return Err(Error::argument(format!(
                "panel '{name}': edge kinds or holes without edges"
            )));
        }
        for i in 0..corner_count {
            edges.push(Edge {
                start: i as u32,
                end: ((i + 1) % corner_count) as u32,
                curve: Curve::Line,
                label: None,
            });
        }
    }
    for (i, &[start, end]) in pairs.iter().enumerate() {
        for corner in [start, end] {
            if corner as usize >= corner_count {
                return Err(Error::geometry(format!(
                    "panel '{name}': edge {i} uses corner {corner} of {corner_count}"
                )));
            }
        }
        let kind = kinds.get(i).copied().unwrap_or(TOILE_EDGE_LINE);
        let curve = curve(kind, controls.get(i), i).map_err(|e| e.at(format!("panel '{name}'")))?;
        edges.push(Edge {
            start,
            end,
            curve,
            label: None,
        });
    }

    // loops: the outline has what the holes leave
    let in_holes: u64 = holes.iter().map(|&n| u64::from(n)).sum();
    if in_holes >= edges.len() as u64 {
        return Err(Error::geometry(format!(
            "panel '{name}': the holes have {in_holes} of {} edges, which leaves no outline",
            edges.len()
        )));
    }
    let mut rest = edges.split_off(edges.len() - in_holes as usize).into_iter();
    let holes = holes
        .iter()
        .map(|&n| rest.by_ref().take(n as usize).collect())
        .collect();

    input::finite_all(&desc.position, "position")?;
    let [x, y, z, w] = input::quaternion(desc.quaternion_xyzw, "quaternion_xyzw")?;
    let rotation = Rotation::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
    Ok(Panel {
        name: name.to_owned(),
        vertices: vertices.iter().map(|&[u, v]| Vec2::new(u, v)).collect(),
        outline: edges,
        holes,
        placement: Placement {
            rotation,
            translation: Vec3::from(desc.position),
        },
        fabric: desc.fabric as usize,
        grain: input::finite(desc.grain, "grain")?,
        edge_length: match input::not_negative(desc.edge_length, "edge_length")? {
            0.0 => None,
            length => Some(length),
        },
        label: None,
    })
}

/// Control numbers of the edges, finite where the kind uses them.
unsafe fn controls(from: *const f64, count: usize, kinds: &[u32]) -> Result<Vec<[f64; 4]>> {
    // SAFETY: handed on.
    let all = unsafe {
        input::array(
            from.cast::<[f64; 4]>(),
            count,
            LARGEST_PANEL,
            "edge_controls",
        )?
    };
    for (i, numbers) in all.iter().enumerate() {
        let used = match kinds.get(i) {
            Some(&TOILE_EDGE_QUADRATIC) => 2,
            Some(&TOILE_EDGE_CUBIC) => 4,
            Some(&TOILE_EDGE_ARC) => 3,
            _ => 0,
        };
        input::finite_all(&numbers[..used], &format!("edge_controls[{i}]"))?;
    }
    Ok(all.to_vec())
}

fn curve(kind: u32, controls: Option<&[f64; 4]>, edge: usize) -> Result<Curve> {
    if kind == TOILE_EDGE_LINE {
        return Ok(Curve::Line);
    }
    let bit = |x: f64, what: &str| match x {
        0.0 => Ok(false),
        1.0 => Ok(true),
        _ => Err(Error::argument(format!(
            "edge {edge}: {what} = {x} must be 0 or 1"
        ))),
    };
    let c = controls
        .ok_or_else(|| Error::argument(format!("edge {edge} is curved, edge_controls is NULL")))?;
    match kind {
        TOILE_EDGE_QUADRATIC => Ok(Curve::Quadratic(Vec2::new(c[0], c[1]))),
        TOILE_EDGE_CUBIC => Ok(Curve::Cubic(Vec2::new(c[0], c[1]), Vec2::new(c[2], c[3]))),
        TOILE_EDGE_ARC => Ok(Curve::Arc {
            radius: input::positive(c[0], "radius")?,
            large: bit(c[1], "larger arc")?,
            right: bit(c[2], "bulge to the right")?,
        }),
        _ => Err(Error::argument(format!(
            "edge {edge}: {kind} is not a kind of edge"
        ))),
    }
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

/// Reads a polygon of a panel; both garments and simulations have this call.
pub(super) fn region(
    garment: &Garment,
    panel: u32,
    uv: &[[f64; 2]],
    rings: u32,
) -> Result<BlendRegion> {
    let name = &panel_of(garment, panel)?.name;
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
    Ok(BlendRegion {
        panel,
        polygon: uv.iter().map(|&[u, v]| Vec2::new(u, v)).collect(),
        rings,
    })
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
            panel_of(g, panel)?;
            let new = if uv.is_empty() {
                None
            } else {
                Some(region(g, panel, &uv, rings)?)
            };
            g.blend_regions.retain(|r| r.panel != panel);
            g.blend_regions.extend(new);
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

/// Refuses a garment that cannot be, naming panel, edge or seam, as toile_sim_create would.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_check(garment: *const toile_garment) -> toile_status {
    entry!({ read(garment, |object| object.garment.check()) })
}

/// Number of panels.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_panel_count(
    garment: *const toile_garment,
    out_count: *mut u32,
) -> toile_status {
    entry!({
        input::target(out_count, "out_count")?;
        let count = read(garment, |o| index(o.garment.panels.len(), "panels"))?;
        output::put(out_count, count);
        Ok(())
    })
}

/// Number of seams.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_seam_count(
    garment: *const toile_garment,
    out_count: *mut u32,
) -> toile_status {
    entry!({
        input::target(out_count, "out_count")?;
        let count = read(garment, |o| index(o.garment.seams.len(), "seams"))?;
        output::put(out_count, count);
        Ok(())
    })
}

/// Index of the panel of this name (UTF-8, ends with NUL). TOILE_E_ARGUMENT if there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_panel_index(
    garment: *const toile_garment,
    name: *const c_char,
    out_panel: *mut u32,
) -> toile_status {
    entry!({
        GARMENTS.get(garment.addr())?;
        input::target(out_panel, "out_panel")?;
        let name = input::name(name, "name")?;
        let found = read(garment, |object| {
            let position = object.garment.panels.iter().position(|p| p.name == name);
            match position {
                Some(i) => index(i, "panels"),
                None => Err(Error::argument(format!("there is no panel '{name}'"))),
            }
        })?;
        output::put(out_panel, found);
        Ok(())
    })
}

/// Name of a panel, UTF-8. `needed` gets the bytes, the final NUL included; `out` NULL asks for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_panel_name(
    garment: *const toile_garment,
    panel: u32,
    out: *mut c_char,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(garment, |object| {
            let name = &panel_of(&object.garment, panel)?.name;
            output::copy_text(name, out, capacity, needed)
        })
    })
}

/// What the garment's and its fabrics' files contained that is not used: lines of UTF-8 text, empty for nothing.
/// `needed` gets the bytes, the final NUL included; `out` NULL asks for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_warnings(
    garment: *const toile_garment,
    out: *mut c_char,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(garment, |object| {
            output::copy_text(&object.warnings.join("\n"), out, capacity, needed)
        })
    })
}

/// The garment as JSON that toile_garment_from_json reads back, UTF-8. `needed` gets the bytes, the
/// final NUL included; `out` NULL asks for it; a smaller `capacity` is TOILE_E_SIZE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_to_json(
    garment: *const toile_garment,
    out: *mut c_char,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(garment, |object| {
            let text = export::garment_to_json(&object.garment)?;
            output::copy_text(&text, out, capacity, needed)
        })
    })
}

/// The flat pattern as SVG at full size, with this seam allowance [m] around every panel; 0 for
/// none. `needed` gets the bytes, the final NUL included; `out` NULL asks for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_to_svg(
    garment: *const toile_garment,
    seam_allowance: f64,
    out: *mut c_char,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(garment, |object| {
            let allowance = input::not_negative(seam_allowance, "seam_allowance")?;
            let text = export::to_svg(&object.garment, allowance)?;
            output::copy_text(&text, out, capacity, needed)
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
