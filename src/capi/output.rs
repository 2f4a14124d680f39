//! What goes out: the two-call idiom for arrays and text, single values.

use super::desc;
use super::garment;
use super::handle::Table;
use super::input;
use super::types::toile_view_f64;
use crate::error::{Error, Result, Status};
use crate::math::{Vec2, Vec3};
use std::ffi::c_char;
use std::ptr;

/// Copies an array out. `needed` is told the number of elements; `out` NULL asks for it only; a
/// `capacity` that is too small is an error and leaves `out` alone.
pub(super) unsafe fn copy<T: Copy>(
    data: &[T],
    out: *mut T,
    capacity: usize,
    needed: *mut usize,
) -> Result<()> {
    // SAFETY: handed on.
    if !unsafe { takes(data.len(), out, capacity, needed)? } {
        return Ok(());
    }
    // SAFETY: not NULL is valid; `data` fits; the memory may overlap when `out` is a view's.
    unsafe {
        ptr::copy(
            data.as_ptr().cast::<u8>(),
            out.cast::<u8>(),
            size_of_val(data),
        );
    }
    Ok(())
}

/// Tells the number of elements; whether they are to be copied too, so that none are made where only it is asked for.
pub(super) unsafe fn takes<T>(
    count: usize,
    out: *mut T,
    capacity: usize,
    needed: *mut usize,
) -> Result<bool> {
    if out.is_null() && needed.is_null() {
        return Err(Error::argument("out and needed are both NULL"));
    }
    if !needed.is_null() {
        // SAFETY: not NULL is valid.
        unsafe { needed.write_unaligned(count) };
    }
    if !out.is_null() && capacity < count {
        return Err(Error::new(
            Status::Size,
            format!("capacity {capacity} is below the {count} elements needed"),
        ));
    }
    Ok(!out.is_null())
}

/// Copies text out, with a NUL at its end that counts.
pub(super) unsafe fn copy_text(
    text: &str,
    out: *mut c_char,
    capacity: usize,
    needed: *mut usize,
) -> Result<()> {
    let bytes: Vec<u8> = text.bytes().filter(|&b| b != 0).chain([0]).collect();
    // SAFETY: handed on.
    unsafe { copy(&bytes, out.cast::<u8>(), capacity, needed) }
}

/// Points as plain numbers, row-major.
pub(super) fn flat3(points: &[Vec3]) -> &[f64] {
    const { assert!(size_of::<Vec3>() == 24 && align_of::<Vec3>() == align_of::<f64>()) };
    // SAFETY: a Vec3 is three numbers without padding.
    unsafe { std::slice::from_raw_parts(points.as_ptr().cast(), 3 * points.len()) }
}

/// Flat points as plain numbers, row-major.
pub(super) fn flat2(points: &[Vec2]) -> &[f64] {
    const { assert!(size_of::<Vec2>() == 16 && align_of::<Vec2>() == align_of::<f64>()) };
    // SAFETY: a Vec2 is two numbers without padding.
    unsafe { std::slice::from_raw_parts(points.as_ptr().cast(), 2 * points.len()) }
}

/// Writes a view of points in space.
pub(super) unsafe fn view3(points: &[Vec3], epoch: u64, out: *mut toile_view_f64) -> Result<()> {
    let view = toile_view_f64 {
        struct_size: size_of::<toile_view_f64>(),
        data: if points.is_empty() {
            ptr::null()
        } else {
            flat3(points).as_ptr()
        },
        count: points.len() as u64,
        components: 3,
        stride: 24,
        epoch,
    };
    // SAFETY: handed on.
    unsafe { desc::write(out, &view) }
}

/// Writes how many there are of something.
pub(super) unsafe fn count<T>(
    table: &Table<T>,
    handle: usize,
    out: *mut u32,
    what: &str,
    count: impl FnOnce(&T) -> usize,
) -> Result<()> {
    let object = table.get(handle)?;
    input::target(out, "out_count")?;
    let count = object.read(|o| garment::index(count(o), what))?;
    // SAFETY: checked above.
    unsafe { put(out, count) };
    Ok(())
}

/// Writes one value.
pub(super) unsafe fn put<T>(out: *mut T, value: T) {
    // SAFETY: checked by `input::target` before the work was done.
    unsafe { out.write_unaligned(value) }
}
