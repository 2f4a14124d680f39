//! What is read of a garment: checks, counts, names, its text and its pattern.

use super::garment::{GARMENTS, index, panel_of, read};
use super::guard::entry;
use super::input;
use super::output;
use super::status::toile_status;
use super::types::toile_garment;
use crate::error::Error;
use crate::pattern::export;
use std::ffi::c_char;

/// Refuses a garment that cannot be, naming panel, edge, seam or blend region, as toile_sim_create would; what only triangles and
/// laid yarns tell, such as a region that holds no triangle, is left to that.
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
        output::count(&GARMENTS, garment.addr(), out_count, "panels", |o| {
            o.garment.panels.len()
        })
    })
}

/// Number of seams.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_seam_count(
    garment: *const toile_garment,
    out_count: *mut u32,
) -> toile_status {
    entry!({
        output::count(&GARMENTS, garment.addr(), out_count, "seams", |o| {
            o.garment.seams.len()
        })
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
