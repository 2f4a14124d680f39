//! The one way in: runs a call, stops panics, turns the result into a status and keeps the text.
//!
//! The host's panic hook is left alone: what it prints, it prints.

use super::status::{TOILE_OK, number, toile_status};
use crate::error::Result;
pub(super) use crate::error::catch;
use std::cell::RefCell;
use std::ffi::{CString, c_char};

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::new(CString::default());
}

/// Runs the body of an exported function.
///
/// Unwind safety: whatever a panic may have left half-changed lies behind a handle, and the handle
/// is poisoned (see `handle`), so nobody looks at it again.
pub(super) fn guard(body: impl FnOnce() -> Result<()>) -> toile_status {
    match catch(body) {
        Ok(()) => TOILE_OK,
        Err(error) => {
            keep(&error.message);
            number(error.status)
        }
    }
}

/// Runs a call that answers with a value instead of a status; `otherwise` on error.
pub(super) fn value<T>(otherwise: T, body: impl FnOnce() -> Result<T>) -> T {
    let mut result = otherwise;
    guard(|| {
        result = body()?;
        Ok(())
    });
    result
}

/// Text for C: ends at its first NUL.
pub(super) fn c_text(text: &str) -> CString {
    let bytes = text.as_bytes();
    let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
    CString::new(&bytes[..end]).unwrap_or_default()
}

fn keep(text: &str) {
    let text = c_text(text);
    // at a thread's end the slot may be gone already; then nobody can ask for the text either
    let _ = LAST_ERROR.try_with(|slot| slot.replace(text));
}

/// Text of this thread's last error.
pub(super) fn last_error() -> *const c_char {
    LAST_ERROR
        .try_with(|slot| slot.borrow().as_ptr())
        .unwrap_or(c"".as_ptr())
}

/// Wraps the body of an exported function in the guard, as one block that may use the caller's
/// pointers.
macro_rules! entry {
    ($body:block) => {
        $crate::capi::guard::guard(|| {
            #[allow(unused_unsafe, reason = "a few bodies read no pointer")]
            // SAFETY: the header's preamble asks the caller for pointers that are NULL or valid for
            // the stated count; the helpers check everything about them that can be checked.
            unsafe {
                $body
            }
        })
    };
}
pub(super) use entry;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::{Error, Status};
    use std::ffi::CStr;

    fn text() -> String {
        // SAFETY: the pointer is to this thread's slot, which no call changes meanwhile.
        unsafe { CStr::from_ptr(last_error()) }
            .to_string_lossy()
            .into_owned()
    }

    #[test]
    fn a_panic_becomes_a_status_and_a_text() {
        let status = guard(|| panic!("number {}", 7));
        assert_eq!(status, number(Status::Panic));
        assert!(text().contains("number 7"), "{}", text());
    }

    #[test]
    fn the_text_belongs_to_the_thread_and_stays_after_success() {
        assert_eq!(guard(|| Err(Error::argument("here"))), -1);
        std::thread::spawn(|| assert_eq!(text(), ""))
            .join()
            .unwrap();
        assert_eq!(guard(|| Ok(())), 0);
        assert_eq!(text(), "here");
    }

    #[test]
    fn a_text_with_a_nul_inside_is_cut_there() {
        guard(|| Err(Error::argument("a\0b")));
        assert_eq!(text(), "a");
    }
}
