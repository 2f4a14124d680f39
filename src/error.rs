//! One error type for the whole library: a fixed status code, a text that says what and where.
//!
//! The codes are the ones of the C ABI and never change their value: `-1..` use of the API,
//! `-20..` data, `-40..` numerics, `-60..` GPU, `-100` a panic caught at the boundary.

use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What went wrong, as a number that is fixed for ever.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(i32)]
pub enum Status {
    /// No error.
    Ok = 0,
    /// An argument is NULL, not finite, out of range, or contradicts another.
    Argument = -1,
    /// A handle is NULL, stale, freed, or of another kind.
    Handle = -2,
    /// The handle is in use by another thread.
    Busy = -3,
    /// The caller's buffer is too small, or a count does not fit.
    Size = -4,
    /// The object's present state does not allow the call.
    State = -5,
    /// The library does not offer this for the object at hand.
    Unsupported = -6,
    /// The host's progress callback asked to stop.
    Cancelled = -7,
    /// Text that is not the expected format (JSON, OBJ, snapshot).
    Parse = -20,
    /// A pattern, mesh or body whose geometry cannot be.
    Geometry = -21,
    /// A fabric whose numbers cannot be.
    Material = -22,
    /// More memory or elements asked for than the limit.
    Limit = -23,
    /// A file could not be read or written.
    Io = -24,
    /// No admissible state was found (the step was cut down to the smallest size).
    NoAdmissibleState = -40,
    /// A linear system could not be solved.
    LinearSolve = -41,
    /// A panic was caught; the handle it happened in is poisoned.
    Panic = -100,
}

/// An error: status, and a text that names what, where, the limit and the value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// The fixed code.
    pub status: Status,
    /// What, where (panel, seam, vertex), the limit and the value.
    pub message: String,
}

/// Result with the library's error.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An error with this status and text.
    pub fn new(status: Status, message: impl Into<String>) -> Self {
        Self {
            status,
            message: short_numbers(message.into()),
        }
    }

    /// The same error with its place put before the text: `place: text`.
    #[must_use]
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.message = format!("{place}: {}", self.message);
        self
    }
}

/// Longest number that is told digit by digit; none that a text shows for its digits is longer.
const MOST_DIGITS: usize = 24;

/// The text with its very long numbers as powers of ten: `1e300`, not a one and 300 zeros.
fn short_numbers(text: String) -> String {
    let part_of_number = |c: char| c.is_ascii_digit() || c == '.';
    let long = |run: &str| run.len() > MOST_DIGITS && run.parse::<f64>().is_ok();
    let runs = || text.split(|c: char| !part_of_number(c));
    if !runs().any(long) {
        return text;
    }
    let mut short = String::new();
    let mut rest = &*text;
    for run in runs() {
        match run.parse::<f64>() {
            Ok(value) if long(run) => short.push_str(&format!("{value:e}")),
            _ => short.push_str(run),
        }
        rest = &rest[run.len()..];
        let between = rest.chars().next();
        short.extend(between);
        rest = &rest[between.map_or(0, char::len_utf8)..];
    }
    short
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

/// Runs `body`; a panic becomes an error of status `Panic`. What the panic may have left
/// half-changed must not be looked at again: callers give it up or build it anew.
pub fn catch<T>(body: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|payload| {
        let text = panic_text(&*payload);
        // a payload whose own drop panics must not get out either
        let _ = catch_unwind(AssertUnwindSafe(move || drop(payload)));
        Err(Error::new(
            Status::Panic,
            format!("internal error, please report it: {text}"),
        ))
    })
}

fn panic_text(payload: &(dyn Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no text".to_owned())
}

macro_rules! constructors {
    ($($name:ident => $status:ident),* $(,)?) => {
        impl Error {
            $(
                #[doc = concat!("An error of status `", stringify!($status), "`.")]
                pub fn $name(message: impl Into<String>) -> Self {
                    Self::new(Status::$status, message)
                }
            )*
        }
    };
}

constructors! {
    argument => Argument,
    state => State,
    unsupported => Unsupported,
    parse => Parse,
    geometry => Geometry,
    material => Material,
    limit => Limit,
    io => Io,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn very_long_numbers_are_told_as_powers_of_ten() {
        for (text, told) in [
            (
                format!("dt = {} s: too long", 1e300),
                "dt = 1e300 s: too long",
            ),
            (format!("-{}, {}", 1e-300, 2.5e40), "-1e-300, 2.5e40"),
            (
                format!("0.0008275868534480223 of {}", u64::MAX),
                "0.0008275868534480223 of 18446744073709551615",
            ),
            ("Länge 1".to_owned(), "Länge 1"),
            (format!("ä{}ö", 1e30), "ä1e30ö"),
        ] {
            assert_eq!(Error::argument(text).message, told);
        }
    }
}
