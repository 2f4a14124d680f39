//! Structs that carry their own size.
//!
//! The caller says in `struct_size` how large the struct was when the host was compiled. Reading
//! copies the smaller of the two sizes over the defaults, writing copies the smaller of the two
//! sizes, so either side may be newer. Sizes are multiples of 8, and so are the places of 8-byte
//! fields: a size never cuts a pointer in two. No struct has hidden padding (a test counts the bytes):
//! otherwise a field appended later could lie in what an older host left uninitialised.

use crate::error::{Error, Result, Status};
use std::ptr;

/// Larger sizes are taken for an uninitialised struct.
const LARGEST: usize = 4096;

/// A struct of the header.
///
/// # Safety
///
/// `#[repr(C)]`, begins with a `usize` that holds its size, valid for any bit pattern.
pub(super) unsafe trait Versioned: Copy {
    /// Name in the header.
    const NAME: &'static str;
    /// Every field as if the caller had not said anything.
    fn defaults() -> Self;
}

fn check_size<T: Versioned>(size: usize) -> Result<()> {
    let is_whole = size.is_multiple_of(size_of::<usize>());
    if (size_of::<usize>()..=LARGEST).contains(&size) && is_whole {
        return Ok(());
    }
    Err(Error::new(
        Status::Size,
        format!(
            "{}.struct_size = {size} cannot be: set it to sizeof({0}), or call {0}_init",
            T::NAME
        ),
    ))
}

/// Reads a struct of the caller; what an older caller does not know has its default.
pub(super) unsafe fn read<T: Versioned>(from: *const T) -> Result<T> {
    if from.is_null() {
        return Err(Error::argument(format!("{} is NULL", T::NAME)));
    }
    let mut value = T::defaults();
    // SAFETY: not NULL; the struct begins with its size and has as many bytes; any bits are a T.
    unsafe {
        let size = from.cast::<usize>().read_unaligned();
        check_size::<T>(size)?;
        let count = size.min(size_of::<T>());
        ptr::copy(from.cast::<u8>(), (&raw mut value).cast::<u8>(), count);
    }
    Ok(value)
}

/// Reads a struct that the caller may leave out.
pub(super) unsafe fn read_or_default<T: Versioned>(from: *const T) -> Result<T> {
    if from.is_null() {
        return Ok(T::defaults());
    }
    // SAFETY: handed on.
    unsafe { read(from) }
}

/// Whether `write` would succeed: asked before the work is done, so that an error leaves everything
/// as it was.
pub(super) unsafe fn check_target<T: Versioned>(to: *mut T, optional: bool) -> Result<()> {
    if to.is_null() {
        if optional {
            return Ok(());
        }
        return Err(Error::argument(format!("{} is NULL", T::NAME)));
    }
    // SAFETY: not NULL; the struct begins with its size.
    check_size::<T>(unsafe { to.cast::<usize>().read_unaligned() })
}

/// Writes a struct of the caller, as much as it has room for; `struct_size` stays the caller's.
/// NULL is left alone.
pub(super) unsafe fn write<T: Versioned>(to: *mut T, value: &T) -> Result<()> {
    if to.is_null() {
        return Ok(());
    }
    // SAFETY: as in `read`.
    unsafe {
        let size = to.cast::<usize>().read_unaligned();
        check_size::<T>(size)?;
        let skip = size_of::<usize>();
        let count = size.min(size_of::<T>()) - skip;
        let from = ptr::from_ref(value).cast::<u8>().add(skip);
        ptr::copy(from, to.cast::<u8>().add(skip), count);
    }
    Ok(())
}

/// Fills a struct of `size` bytes with defaults; bytes that this library does not know become 0.
pub(super) unsafe fn init<T: Versioned>(to: *mut T, size: usize) -> Result<()> {
    if to.is_null() {
        return Err(Error::argument(format!("{} is NULL", T::NAME)));
    }
    check_size::<T>(size)?;
    let value = T::defaults();
    // SAFETY: not NULL; the caller says that `size` bytes are there, and `size` is plausible.
    unsafe {
        ptr::write_bytes(to.cast::<u8>(), 0, size);
        let count = size.min(size_of::<T>());
        ptr::copy((&raw const value).cast::<u8>(), to.cast::<u8>(), count);
        to.cast::<usize>().write_unaligned(size);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[repr(C)]
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Thing {
        struct_size: usize,
        a: f64,
        b: f64,
    }

    // SAFETY: repr(C), begins with its size, any bits are valid.
    unsafe impl Versioned for Thing {
        const NAME: &'static str = "thing";
        fn defaults() -> Self {
            Self {
                struct_size: size_of::<Self>(),
                a: 1.0,
                b: 2.0,
            }
        }
    }

    #[test]
    fn a_shorter_struct_means_defaults_for_the_rest() {
        let short = [16_usize, 7.0_f64.to_bits() as usize];
        // SAFETY: 16 bytes are there, as the size says.
        let read = unsafe { read(short.as_ptr().cast::<Thing>()) }.unwrap();
        assert_eq!((read.a, read.b), (7.0, 2.0));
    }

    #[test]
    fn a_shorter_struct_is_written_no_further_than_it_goes() {
        let mut short = [16_usize, 0, 12345];
        // SAFETY: 16 bytes and more are there.
        unsafe { write(short.as_mut_ptr().cast::<Thing>(), &Thing::defaults()) }.unwrap();
        assert_eq!(short, [16, 1.0_f64.to_bits() as usize, 12345]);
    }

    #[test]
    fn a_longer_struct_is_read_and_filled_as_far_as_known() {
        let mut long = [usize::MAX; 4];
        // SAFETY: 32 bytes are there.
        let thing = unsafe {
            init(long.as_mut_ptr().cast::<Thing>(), 32).unwrap();
            read(long.as_ptr().cast::<Thing>()).unwrap()
        };
        assert_eq!((long[0], long[3], thing.b), (32, 0, 2.0));
    }

    #[test]
    fn sizes_that_cannot_be_are_refused() {
        for size in [0, 1, 7, 12, 17, 4097, usize::MAX] {
            let mut bad = [size, 0, 0];
            let p = bad.as_mut_ptr().cast::<Thing>();
            // SAFETY: the size is looked at before anything else.
            unsafe {
                assert_eq!(read(p).unwrap_err().status, Status::Size);
                assert_eq!(init(p, size).unwrap_err().status, Status::Size);
                assert!(check_target(p, true).is_err());
            }
            assert_eq!(bad, [size, 0, 0]);
        }
    }
}
