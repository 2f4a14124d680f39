//! Pointers of the master, measured before anything is read or written: NULL, alignment, counts.
#![allow(
    unsafe_code,
    reason = "the boundary to C: what the master points to is read and written through these"
)]

use crate::error::{Error, Result};
use std::ffi::{CStr, c_char};

fn check<T>(pointer: *const T, count: usize, what: &str) -> Result<()> {
    if pointer.is_null() {
        return Err(Error::argument(format!("{what} is NULL")));
    }
    if !pointer.is_aligned() {
        return Err(Error::argument(format!(
            "{what} = {pointer:p} is not aligned for its type"
        )));
    }
    let bytes = count.checked_mul(size_of::<T>());
    if bytes.is_none_or(|b| b > isize::MAX as usize) {
        return Err(Error::argument(format!(
            "{what} cannot have {count} elements"
        )));
    }
    Ok(())
}

/// What the master hands in; nothing is looked at where `count` is 0.
///
/// # Safety
///
/// A pointer that is neither NULL nor misaligned must be good for `count` elements while `'a` lasts.
pub(super) unsafe fn input<'a, T>(pointer: *const T, count: usize, what: &str) -> Result<&'a [T]> {
    if count == 0 {
        return Ok(&[]);
    }
    check(pointer, count, what)?;
    // SAFETY: not NULL, aligned, of a size that can be; the rest is the caller's word.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// Copies results out.
///
/// # Safety
///
/// A pointer that is neither NULL nor misaligned must be good for as many elements as there are.
pub(super) unsafe fn output<T>(
    pointer: *mut T,
    values: impl ExactSizeIterator<Item = T>,
    what: &str,
) -> Result<()> {
    let count = values.len();
    if count == 0 {
        return Ok(());
    }
    check(pointer, count, what)?;
    for (i, value) in values.enumerate() {
        // SAFETY: not NULL, aligned, and `i` is below `count`, for which the caller answers.
        unsafe { pointer.add(i).write(value) };
    }
    Ok(())
}

/// One value out; NULL means that nobody asks for it.
///
/// # Safety
///
/// A pointer that is neither NULL nor misaligned must be good for one element.
pub(super) unsafe fn put<T>(pointer: *mut T, value: T) {
    if !pointer.is_null() && pointer.is_aligned() {
        // SAFETY: checked above, for the rest the caller answers.
        unsafe { pointer.write(value) };
    }
}

/// A text of the master.
///
/// # Safety
///
/// A pointer that is not NULL must be to bytes that end with NUL.
pub(super) unsafe fn text(pointer: *const c_char, what: &str) -> Result<String> {
    if pointer.is_null() {
        return Err(Error::argument(format!("{what} is NULL")));
    }
    // SAFETY: not NULL; the NUL is the caller's word.
    let bytes = unsafe { CStr::from_ptr(pointer) };
    match bytes.to_str() {
        Ok(text) => Ok(text.to_owned()),
        Err(e) => Err(Error::argument(format!(
            "{what} is not UTF-8: byte {}",
            e.valid_up_to()
        ))),
    }
}

/// Several texts of the master.
///
/// # Safety
///
/// As for [`input`] and [`text`].
pub(super) unsafe fn texts(
    pointers: *const *const c_char,
    count: usize,
    what: &str,
) -> Result<Vec<String>> {
    // SAFETY: the caller answers for the list and for every text in it.
    unsafe {
        input(pointers, count, what)?
            .iter()
            .map(|p| text(*p, what))
            .collect()
    }
}
