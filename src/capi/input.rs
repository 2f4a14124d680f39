//! What the caller passes in: measured before a slice is made of it.

use crate::error::{Error, Result, Status};
use std::ffi::{CStr, c_char};
use std::path::PathBuf;

/// Longest text taken [bytes].
pub(super) const LARGEST_TEXT: usize = 1 << 28;
/// Most elements of any array taken.
pub(super) const LARGEST_COUNT: usize = 1 << 28;

/// An array of the caller; at most `limit` elements.
pub(super) unsafe fn array<'a, T: Copy>(
    from: *const T,
    count: usize,
    limit: usize,
    what: &str,
) -> Result<&'a [T]> {
    let limit = limit.min(LARGEST_COUNT);
    if count == 0 {
        return Ok(&[]);
    }
    if from.is_null() {
        return Err(Error::argument(format!(
            "{what} is NULL, with a count of {count}"
        )));
    }
    if count > limit {
        return Err(Error::limit(format!(
            "{what}: a count of {count} is above the limit of {limit}"
        )));
    }
    if !from.is_aligned() {
        return Err(Error::argument(format!(
            "{what}: {from:p} is not aligned to {} bytes",
            align_of::<T>()
        )));
    }
    // SAFETY: not NULL, aligned; the caller says that `count` elements are there, which is few
    // enough for the address space.
    Ok(unsafe { std::slice::from_raw_parts(from, count) })
}

/// An array of `count` tuples of `N` numbers, all finite, as a copy: the caller's memory may belong
/// to an object that is about to change.
pub(super) unsafe fn points<const N: usize>(
    from: *const f64,
    count: usize,
    limit: usize,
    what: &str,
) -> Result<Vec<[f64; N]>> {
    // SAFETY: handed on; `[f64; N]` has the layout of N numbers.
    let points = unsafe { array(from.cast::<[f64; N]>(), count, limit, what)? };
    for (i, point) in points.iter().enumerate() {
        if let Some(k) = point.iter().position(|x| !x.is_finite()) {
            return Err(Error::argument(format!(
                "{what}[{i}][{k}] = {} is not finite",
                point[k]
            )));
        }
    }
    Ok(points.to_vec())
}

/// A fixed number of finite numbers.
pub(super) unsafe fn numbers<const N: usize>(from: *const f64, what: &str) -> Result<[f64; N]> {
    if from.is_null() {
        return Err(Error::argument(format!("{what} is NULL")));
    }
    // SAFETY: not NULL; the header says how many numbers there are.
    let values = unsafe { from.cast::<[f64; N]>().read_unaligned() };
    finite_all(&values, what)?;
    Ok(values)
}

/// Refuses numbers that are not finite.
pub(super) fn finite_all(values: &[f64], what: &str) -> Result<()> {
    match values.iter().position(|x| !x.is_finite()) {
        Some(k) => Err(Error::argument(format!(
            "{what}[{k}] = {} is not finite",
            values[k]
        ))),
        None => Ok(()),
    }
}

/// A finite number.
pub(super) fn finite(value: f64, what: &str) -> Result<f64> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(Error::argument(format!("{what} = {value} is not finite")))
}

/// A finite number that is not negative.
pub(super) fn not_negative(value: f64, what: &str) -> Result<f64> {
    if value.is_finite() && value >= 0.0 {
        return Ok(value);
    }
    Err(Error::argument(format!(
        "{what} = {value} must be finite and not negative"
    )))
}

/// A finite number above zero.
pub(super) fn positive(value: f64, what: &str) -> Result<f64> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(Error::argument(format!(
        "{what} = {value} must be finite and above zero"
    )))
}

/// A quaternion that can be made a unit one; `xyzw`.
pub(super) fn quaternion(q: [f64; 4], what: &str) -> Result<[f64; 4]> {
    finite_all(&q, what)?;
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    if (0.5..=2.0).contains(&norm) {
        return Ok(q.map(|x| x / norm));
    }
    Err(Error::argument(format!(
        "{what} = {q:?} has length {norm}, not 1"
    )))
}

/// A flag: 0 or 1.
pub(super) fn flag(value: u32, what: &str) -> Result<bool> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Error::argument(format!("{what} = {value} must be 0 or 1"))),
    }
}

/// A field kept for later versions: 0 now, so that it can mean something then.
pub(super) fn reserved(value: u32) -> Result<()> {
    match value {
        0 => Ok(()),
        _ => Err(Error::argument(format!("reserved = {value} must be 0"))),
    }
}

/// Text with its length; one NUL at its end is allowed and dropped.
pub(super) unsafe fn text<'a>(from: *const c_char, length: usize, what: &str) -> Result<&'a str> {
    // SAFETY: handed on.
    let bytes = unsafe { array(from.cast::<u8>(), length, LARGEST_TEXT, what)? };
    let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|e| {
        Error::parse(format!(
            "{what} is not UTF-8 at byte {} of {length}",
            e.valid_up_to()
        ))
    })
}

/// Text that ends with NUL.
pub(super) unsafe fn name<'a>(from: *const c_char, what: &str) -> Result<&'a str> {
    if from.is_null() {
        return Err(Error::argument(format!("{what} is NULL")));
    }
    // SAFETY: not NULL; the header asks for a NUL at the end.
    unsafe { CStr::from_ptr(from) }
        .to_str()
        .map_err(|_| Error::argument(format!("{what} is not UTF-8")))
}

/// Text that ends with NUL, or none.
pub(super) unsafe fn optional_name<'a>(from: *const c_char, what: &str) -> Result<Option<&'a str>> {
    if from.is_null() {
        return Ok(None);
    }
    // SAFETY: handed on.
    unsafe { name(from, what) }.map(Some)
}

/// A folder, or none.
pub(super) unsafe fn optional_folder(from: *const c_char) -> Result<Option<PathBuf>> {
    // SAFETY: handed on.
    Ok(unsafe { optional_name(from, "base_dir")? }.map(PathBuf::from))
}

/// Where a result goes.
pub(super) fn target<T>(to: *mut T, what: &str) -> Result<()> {
    if to.is_null() {
        return Err(Error::argument(format!("{what} is NULL")));
    }
    Ok(())
}

/// Refuses a count that is not what the object has.
pub(super) fn same_count(count: usize, expected: usize, what: &str) -> Result<()> {
    if count == expected {
        return Ok(());
    }
    Err(Error::new(
        Status::Argument,
        format!("{what}: a count of {count}, where the object has {expected}"),
    ))
}
