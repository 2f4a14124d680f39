//! The host's log callback.

use super::guard::c_text;
use std::ffi::{c_char, c_void};

/// Something does not work.
pub const TOILE_LOG_ERROR: u32 = 0;
/// Something works otherwise than asked for.
pub const TOILE_LOG_WARNING: u32 = 1;
/// What was built and how calls ended.
pub const TOILE_LOG_INFO: u32 = 2;

/// Takes a line of log: level (TOILE_LOG_...), UTF-8 text that ends with NUL, valid during the
/// callback. May come from any thread, several at once. Must not throw, jump out, or change the
/// object that the log belongs to.
pub type toile_log_fn =
    Option<extern "C" fn(user: *mut c_void, level: u32, message: *const c_char)>;

/// Where an object's log goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Log {
    callback: toile_log_fn,
    user: *mut c_void,
}

// SAFETY: the header tells the host that its callback runs on any thread, several at once; `user`
// is only handed on.
unsafe impl Send for Log {}
// SAFETY: as above.
unsafe impl Sync for Log {}

impl Log {
    pub(super) fn new(callback: toile_log_fn, user: *mut c_void) -> Self {
        Self { callback, user }
    }

    pub(super) fn none() -> Self {
        Self::new(None, std::ptr::null_mut())
    }

    pub(super) fn say(&self, level: u32, text: impl FnOnce() -> String) {
        if let Some(callback) = self.callback {
            callback(self.user, level, c_text(&text()).as_ptr());
        }
    }
}
