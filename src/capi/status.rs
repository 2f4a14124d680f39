//! Status codes, the text of the last error, the version.

use super::guard;
use crate::error::Status;
use std::ffi::{CStr, c_char};

/// Result of every call that can fail: 0 is success, errors are negative. The values are fixed for
/// ever: -1.. use of the library, -20.. data, -40.. numerics, -60.. GPU, -100 an internal error.
pub type toile_status = i32;

/// No error.
pub const TOILE_OK: i32 = 0;
/// An argument is NULL, not finite, out of range, or contradicts another.
pub const TOILE_E_ARGUMENT: i32 = -1;
/// A handle is NULL, freed, of another kind, or was never one.
pub const TOILE_E_HANDLE: i32 = -2;
/// The handle is in use by another thread, or by the call that this callback runs in.
pub const TOILE_E_BUSY: i32 = -3;
/// The buffer is too small and nothing was written to it, or the count of an array is not the one that is expected.
pub const TOILE_E_SIZE: i32 = -4;
/// The present state of the object does not allow the call.
pub const TOILE_E_STATE: i32 = -5;
/// The library does not offer this for the object at hand.
pub const TOILE_E_UNSUPPORTED: i32 = -6;
/// The host asked to stop before there was a result.
pub const TOILE_E_CANCELLED: i32 = -7;
/// Text or bytes that are not of the expected format.
pub const TOILE_E_PARSE: i32 = -20;
/// A pattern, mesh or body whose geometry cannot be.
pub const TOILE_E_GEOMETRY: i32 = -21;
/// A fabric whose numbers cannot be.
pub const TOILE_E_MATERIAL: i32 = -22;
/// More memory or more elements asked for than the limit.
pub const TOILE_E_LIMIT: i32 = -23;
/// A file could not be read or written.
pub const TOILE_E_IO: i32 = -24;
/// No admissible state was found; the simulation is as it was before the call.
pub const TOILE_E_NO_ADMISSIBLE_STATE: i32 = -40;
/// A linear system could not be solved; the simulation is as it was before the call.
pub const TOILE_E_LINEAR_SOLVE: i32 = -41;
/// An internal error was caught. The handle it happened in can only be freed.
pub const TOILE_E_PANIC: i32 = -100;

/// Version of this header: the same numbers as the library's package.
pub const TOILE_VERSION_MAJOR: u32 = 0;
/// Second number of the version.
pub const TOILE_VERSION_MINOR: u32 = 1;
/// Third number of the version.
pub const TOILE_VERSION_PATCH: u32 = 0;

/// An index that stands for "none".
pub const TOILE_NONE: u32 = u32::MAX;

/// The C number of a status.
pub(super) fn number(status: Status) -> toile_status {
    match status {
        Status::Ok => TOILE_OK,
        Status::Argument => TOILE_E_ARGUMENT,
        Status::Handle => TOILE_E_HANDLE,
        Status::Busy => TOILE_E_BUSY,
        Status::Size => TOILE_E_SIZE,
        Status::State => TOILE_E_STATE,
        Status::Unsupported => TOILE_E_UNSUPPORTED,
        Status::Cancelled => TOILE_E_CANCELLED,
        Status::Parse => TOILE_E_PARSE,
        Status::Geometry => TOILE_E_GEOMETRY,
        Status::Material => TOILE_E_MATERIAL,
        Status::Limit => TOILE_E_LIMIT,
        Status::Io => TOILE_E_IO,
        Status::NoAdmissibleState => TOILE_E_NO_ADMISSIBLE_STATE,
        Status::LinearSolve => TOILE_E_LINEAR_SOLVE,
        Status::Panic => TOILE_E_PANIC,
    }
}

fn name(status: toile_status) -> &'static CStr {
    match status {
        TOILE_OK => c"TOILE_OK",
        TOILE_E_ARGUMENT => c"TOILE_E_ARGUMENT",
        TOILE_E_HANDLE => c"TOILE_E_HANDLE",
        TOILE_E_BUSY => c"TOILE_E_BUSY",
        TOILE_E_SIZE => c"TOILE_E_SIZE",
        TOILE_E_STATE => c"TOILE_E_STATE",
        TOILE_E_UNSUPPORTED => c"TOILE_E_UNSUPPORTED",
        TOILE_E_CANCELLED => c"TOILE_E_CANCELLED",
        TOILE_E_PARSE => c"TOILE_E_PARSE",
        TOILE_E_GEOMETRY => c"TOILE_E_GEOMETRY",
        TOILE_E_MATERIAL => c"TOILE_E_MATERIAL",
        TOILE_E_LIMIT => c"TOILE_E_LIMIT",
        TOILE_E_IO => c"TOILE_E_IO",
        TOILE_E_NO_ADMISSIBLE_STATE => c"TOILE_E_NO_ADMISSIBLE_STATE",
        TOILE_E_LINEAR_SOLVE => c"TOILE_E_LINEAR_SOLVE",
        TOILE_E_PANIC => c"TOILE_E_PANIC",
        _ => c"unknown status",
    }
}

/// A decimal number of Cargo's version text, at compile time.
const fn decimal(text: &str) -> u32 {
    let bytes = text.as_bytes();
    let mut value = 0;
    let mut i = 0;
    while i < bytes.len() {
        assert!(bytes[i].is_ascii_digit());
        value = value * 10 + (bytes[i] - b'0') as u32;
        i += 1;
    }
    value
}

/// Version of the library that is running: 10000 major + 100 minor + patch. Compare it with the
/// header's TOILE_VERSION_MAJOR, _MINOR and _PATCH: before 1.0 a host needs the same minor version,
/// from 1.0 on the same major version.
#[unsafe(no_mangle)]
pub extern "C" fn toile_version() -> u32 {
    const {
        decimal(env!("CARGO_PKG_VERSION_MAJOR")) * 10_000
            + decimal(env!("CARGO_PKG_VERSION_MINOR")) * 100
            + decimal(env!("CARGO_PKG_VERSION_PATCH"))
    }
}

/// What went wrong in the last call of this thread that failed: what, where (panel, seam, vertex),
/// the limit and the value. Never NULL; empty before the first failure. Calls that succeed leave it.
/// Owned by the library, valid until the next call of this thread that fails, or the thread's end.
#[unsafe(no_mangle)]
pub extern "C" fn toile_last_error() -> *const c_char {
    guard::last_error()
}

/// Name of a status as in this header, "TOILE_E_HANDLE" for example. Never NULL; any number is
/// allowed. The text is constant.
#[unsafe(no_mangle)]
pub extern "C" fn toile_status_name(status: toile_status) -> *const c_char {
    name(status).as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_the_header_are_the_numbers_of_the_error_type() {
        use Status::*;
        for status in [
            Ok,
            Argument,
            Handle,
            Busy,
            Size,
            State,
            Unsupported,
            Cancelled,
            Parse,
            Geometry,
            Material,
            Limit,
            Io,
            NoAdmissibleState,
            LinearSolve,
            Panic,
        ] {
            assert_eq!(number(status), status as i32, "{status:?}");
            assert!(name(number(status)).to_bytes().starts_with(b"TOILE_"));
        }
        assert_eq!(name(7), c"unknown status");
        assert_eq!(name(i32::MIN), c"unknown status");
    }

    #[test]
    fn version_of_the_header_is_the_version_of_the_package() {
        assert_eq!(
            toile_version(),
            TOILE_VERSION_MAJOR * 10_000 + TOILE_VERSION_MINOR * 100 + TOILE_VERSION_PATCH
        );
    }
}
