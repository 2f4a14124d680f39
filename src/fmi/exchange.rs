//! What FMI 2 and FMI 3 exchange with the master alike: values, log categories, saved states. The C
//! functions of `cosim3` and `cosim2` hand their pointers on to these, each with its own name and
//! types.
#![allow(
    unsafe_code,
    reason = "the boundary to C: what the master points to is read and written here"
)]

use super::host;
use super::log::Status;
use super::pointers::{input, output, put, texts};
use super::variables::Kind;
use crate::error::Error;
use std::ffi::{CString, c_char, c_void};

/// `fmi3Instance`, `fmi2Component`: a token, never dereferenced.
pub(super) type Instance = *mut c_void;
/// `fmi3FMUState`, `fmi2FMUstate`: a token, never dereferenced.
pub(super) type State = *mut c_void;

/// A call: the instance's token, the function's name for the log, and whether FMI 2 is spoken.
#[derive(Clone, Copy)]
pub(super) struct Call<'a> {
    pub(super) token: usize,
    pub(super) function: &'a str,
    pub(super) fmi2: bool,
}

/// Text for C: ends at its first NUL.
pub(super) fn c_text(text: &str) -> CString {
    let bytes = text.as_bytes();
    let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
    CString::new(&bytes[..end]).unwrap_or_default()
}

/// Values of variables of a kind, made of numbers by `from`.
///
/// # Safety
///
/// Lists must be NULL or good for the stated counts.
pub(super) unsafe fn get<T>(
    call: Call<'_>,
    kind: Kind,
    references: (*const u32, usize),
    values: (*mut T, usize),
    from: impl Fn(f64) -> T,
) -> i32 {
    host::with(call.token, call.function, |i| {
        // SAFETY: the master's list of references.
        let references = unsafe { input(references.0, references.1, "value references")? };
        let read = i.read(kind, references, values.1, call.fmi2)?;
        // SAFETY: room for as many values as were read, which is what the master announced.
        unsafe { output(values.0, read.into_iter().map(from), "values")? };
        Ok(Status::Ok)
    }) as i32
}

/// Sets variables of a kind to numbers that `into` makes of the values.
///
/// # Safety
///
/// As for [`get`].
pub(super) unsafe fn set<T: Copy>(
    call: Call<'_>,
    kind: Kind,
    references: (*const u32, usize),
    values: (*const T, usize),
    into: impl Fn(T) -> f64,
) -> i32 {
    host::with(call.token, call.function, |i| {
        // SAFETY: the master's lists.
        let (references, values) = unsafe {
            (
                input(references.0, references.1, "value references")?,
                input(values.0, values.1, "values")?,
            )
        };
        let values: Vec<f64> = values.iter().map(|&v| into(v)).collect();
        i.write(kind, references, &values, call.fmi2)
    }) as i32
}

/// Chooses what the log tells.
///
/// # Safety
///
/// The list must be NULL or good for `count` texts.
pub(super) unsafe fn log_categories(
    call: Call<'_>,
    on: bool,
    count: usize,
    categories: *const *const c_char,
) -> i32 {
    host::with(call.token, call.function, |i| {
        // SAFETY: the master's list of texts.
        let categories = unsafe { texts(categories, count, "categories")? };
        i.log()
            .set(on, &categories)
            .map_err(|c| Error::argument(format!("there is no log category '{c}'")))?;
        Ok(Status::Ok)
    }) as i32
}

/// Hands a call the token behind the master's pointer to a state, and puts it back.
fn with_slot(
    call: Call<'_>,
    slot: *mut State,
    body: impl FnOnce(usize, &str, &mut usize) -> Status,
) -> i32 {
    // SAFETY: the master's place for one pointer.
    let given = match unsafe { input(slot, 1, "the pointer to a state") } {
        Ok(given) => given[0],
        Err(e) => return host::refuse(call.token, call.function, e) as i32,
    };
    let mut token = given.addr();
    let status = body(call.token, call.function, &mut token);
    // SAFETY: the same place, checked above.
    unsafe { put(slot, std::ptr::without_provenance_mut(token)) };
    status as i32
}

/// Saves the state into a slot of the master.
pub(super) fn get_state(call: Call<'_>, slot: *mut State) -> i32 {
    with_slot(call, slot, host::get_state)
}

/// Frees the state in a slot of the master; no slot is no harm.
pub(super) fn free_state(call: Call<'_>, slot: *mut State) -> i32 {
    if slot.is_null() {
        return Status::Ok as i32;
    }
    with_slot(call, slot, host::free_state)
}

/// Bytes that a state takes.
pub(super) fn state_size(call: Call<'_>, state: State, size: *mut usize) -> i32 {
    host::state_bytes(call.token, call.function, state.addr(), |bytes| {
        // SAFETY: the master's place for one number.
        unsafe { output(size, std::iter::once(bytes.len()), "size") }
    }) as i32
}

/// A state as bytes.
pub(super) fn serialize(call: Call<'_>, state: State, buffer: *mut u8, size: usize) -> i32 {
    host::state_bytes(call.token, call.function, state.addr(), |bytes| {
        if size != bytes.len() {
            return Err(Error::argument(format!(
                "room for {size} bytes, the state has {}",
                bytes.len()
            )));
        }
        // SAFETY: the master's room for `size` bytes.
        unsafe { output(buffer, bytes.iter().copied(), "serializedState") }
    }) as i32
}

/// A state from bytes.
pub(super) fn deserialize(call: Call<'_>, bytes: *const u8, size: usize, slot: *mut State) -> i32 {
    with_slot(call, slot, |token, function, state| {
        // SAFETY: `size` bytes of the master.
        match unsafe { input(bytes, size, "serializedState") } {
            Ok(bytes) => host::deserialize(token, function, bytes, state),
            Err(e) => host::refuse(token, function, e),
        }
    })
}

/// Answers a call about variables of a type that none has: asking for none of them is no error.
pub(super) fn none_of(call: Call<'_>, kind: &str, references: usize, values: usize) -> i32 {
    if references == 0 && values == 0 && host::exists(call.token) {
        return Status::Ok as i32;
    }
    let why = format!("{references} variables, {values} values: no variable is a {kind}");
    host::refuse(call.token, call.function, Error::unsupported(why)) as i32
}

/// Functions that this FMU does not offer: each is an error with a log line.
macro_rules! refused {
    ($($name:ident($($arg:ident: $type:ty),*) $why:expr;)*) => {$(
        #[doc = concat!("`", stringify!($name), "`: refused.")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(
            instance: $crate::fmi::exchange::Instance $(, $arg: $type)*
        ) -> i32 {
            let why = $crate::error::Error::unsupported($why);
            $crate::fmi::host::refuse(instance.addr(), stringify!($name), why) as i32
        }
    )*};
}
pub(super) use refused;

/// Functions that only change an instance's mode.
macro_rules! transitions {
    ($($name:ident => $method:ident;)*) => {$(
        #[doc = concat!("`", stringify!($name), "`")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(instance: $crate::fmi::exchange::Instance) -> i32 {
            let change = $crate::fmi::instance::Instance::$method;
            $crate::fmi::host::with(instance.addr(), stringify!($name), change) as i32
        }
    )*};
}
pub(super) use transitions;
