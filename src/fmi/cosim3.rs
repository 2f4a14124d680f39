//! FMI 3.0: the functions that an FMU for co-simulation answers. Signatures are those of
//! `fmi3FunctionTypes.h`; a test compiles C against that header. `cosim3_refused` has the others.
//!
//! Booleans come in as bytes: a C `bool` that is neither 0 nor 1 is undefined in Rust.
#![allow(
    unsafe_code,
    non_snake_case,
    reason = "the boundary to C, with the names that FMI gives"
)]
#![allow(
    clippy::missing_safety_doc,
    reason = "FMI 3.0 says what pointers must satisfy; counts, NULL and alignment are checked"
)]

use super::host;
use super::instance::Instance;
use super::log::{Log, Sink, Status};
use super::pointers::{input, output, put, text, texts};
use super::variables::Kind;
use crate::error::Error;
use std::ffi::{CString, c_char, c_void};
use std::path::Path;

/// `fmi3Instance`: a token, never dereferenced.
pub type Instance3 = *mut c_void;
/// `fmi3FMUState`: a token, never dereferenced.
pub type State3 = *mut c_void;
/// `fmi3LogMessageCallback`.
pub type LogMessage = unsafe extern "C" fn(*mut c_void, i32, *const c_char, *const c_char);

/// Text for C: ends at its first NUL.
pub(super) fn c_text(text: &str) -> CString {
    let bytes = text.as_bytes();
    let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
    CString::new(&bytes[..end]).unwrap_or_default()
}

/// A log that speaks through the master's callback, on the thread of the call that has something to
/// say.
pub(super) fn log3(callback: Option<LogMessage>, environment: *mut c_void, on: bool) -> Log {
    let environment = environment as usize;
    let sink = callback.map(|callback| {
        let sink: Sink = Box::new(move |status, category, message| {
            let (category, message) = (c_text(category), c_text(message));
            // SAFETY: the callback and its environment are the master's, good for the instance's life.
            unsafe {
                callback(
                    environment as *mut c_void,
                    status as i32,
                    category.as_ptr(),
                    message.as_ptr(),
                );
            }
        });
        sink
    });
    Log::new(sink, on)
}

/// `fmi3GetVersion`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// `fmi3SetDebugLogging`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetDebugLogging(
    instance: Instance3,
    loggingOn: u8,
    nCategories: usize,
    categories: *const *const c_char,
) -> i32 {
    host::with(instance.addr(), "fmi3SetDebugLogging", |i| {
        // SAFETY: the master's list of texts.
        let categories = unsafe { texts(categories, nCategories, "categories")? };
        i.log()
            .set(loggingOn != 0, &categories)
            .map_err(|c| Error::argument(format!("there is no log category '{c}'")))?;
        Ok(Status::Ok)
    }) as i32
}

/// `fmi3InstantiateCoSimulation`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    instanceName: *const c_char,
    instantiationToken: *const c_char,
    resourcePath: *const c_char,
    _visible: u8,
    loggingOn: u8,
    eventModeUsed: u8,
    _earlyReturnAllowed: u8,
    _requiredIntermediateVariables: *const u32,
    nRequiredIntermediateVariables: usize,
    instanceEnvironment: *mut c_void,
    logMessage: Option<LogMessage>,
    _intermediateUpdate: Option<unsafe extern "C" fn()>,
) -> Instance3 {
    let log = log3(logMessage, instanceEnvironment, loggingOn != 0);
    let asked = || {
        // SAFETY: three texts of the master.
        let (name, token, path) = unsafe {
            (
                text(instanceName, "instanceName")?,
                text(instantiationToken, "instantiationToken")?,
                text(resourcePath, "resourcePath")?,
            )
        };
        if eventModeUsed != 0 {
            return Err(Error::unsupported("this FMU has no Event Mode"));
        }
        if nRequiredIntermediateVariables > 0 {
            return Err(Error::unsupported("this FMU gives no intermediate updates"));
        }
        if path.is_empty() {
            return Err(Error::argument("resourcePath is empty"));
        }
        Ok((name, token, path))
    };
    let token = match asked() {
        Ok((name, token, path)) => host::instantiate(&name, &token, Path::new(&path), log),
        Err(e) => {
            log.say(Status::Error, || {
                format!("fmi3InstantiateCoSimulation: {e}")
            });
            0
        }
    };
    std::ptr::without_provenance_mut(token)
}

/// `fmi3FreeInstance`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3FreeInstance(instance: Instance3) {
    host::free(instance.addr());
}

/// `fmi3EnterInitializationMode`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterInitializationMode(
    instance: Instance3,
    toleranceDefined: u8,
    tolerance: f64,
    startTime: f64,
    stopTimeDefined: u8,
    stopTime: f64,
) -> i32 {
    host::with(instance.addr(), "fmi3EnterInitializationMode", |i| {
        i.set_up(
            (toleranceDefined != 0).then_some(tolerance),
            startTime,
            (stopTimeDefined != 0).then_some(stopTime),
        )?;
        i.enter_initialization()
    }) as i32
}

macro_rules! transitions {
    ($($name:ident => $method:ident;)*) => {$(
        #[doc = concat!("`", stringify!($name), "`")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(instance: Instance3) -> i32 {
            host::with(instance.addr(), stringify!($name), Instance::$method) as i32
        }
    )*};
}

transitions! {
    fmi3EnterConfigurationMode => enter_configuration;
    fmi3ExitConfigurationMode => exit_configuration;
    fmi3ExitInitializationMode => exit_initialization;
    fmi3Terminate => terminate;
}

/// `fmi3Reset`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3Reset(instance: Instance3) -> i32 {
    host::reset(instance.addr(), "fmi3Reset") as i32
}

/// `fmi3DoStep`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: Instance3,
    currentCommunicationPoint: f64,
    communicationStepSize: f64,
    _noSetFMUStatePriorToCurrentPoint: u8,
    eventHandlingNeeded: *mut u8,
    terminateSimulation: *mut u8,
    earlyReturn: *mut u8,
    lastSuccessfulTime: *mut f64,
) -> i32 {
    // SAFETY: places for one value each, or NULL.
    unsafe {
        put(eventHandlingNeeded, 0);
        put(terminateSimulation, 0);
        put(earlyReturn, 0);
    }
    host::with(instance.addr(), "fmi3DoStep", |i| {
        let answer = i.do_step(currentCommunicationPoint, communicationStepSize);
        // SAFETY: a place for one number, or NULL.
        unsafe { put(lastSuccessfulTime, i.time()) };
        answer
    }) as i32
}

macro_rules! numbers {
    ($($get:ident $set:ident $type:ty, $kind:ident;)*) => {$(
        #[doc = concat!("`", stringify!($get), "`")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            instance: Instance3,
            valueReferences: *const u32,
            nValueReferences: usize,
            values: *mut $type,
            nValues: usize,
        ) -> i32 {
            host::with(instance.addr(), stringify!($get), |i| {
                let (vr, n) = (valueReferences, nValueReferences);
                // SAFETY: the master's list of references.
                let references = unsafe { input(vr, n, "valueReferences")? };
                let read = i.read(Kind::$kind, references, nValues, false)?;
                let read = read.into_iter().map(|v| v as $type);
                // SAFETY: room for `nValues`, which is as many as were read.
                unsafe { output(values, read, "values")? };
                Ok(Status::Ok)
            }) as i32
        }

        #[doc = concat!("`", stringify!($set), "`")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            instance: Instance3,
            valueReferences: *const u32,
            nValueReferences: usize,
            values: *const $type,
            nValues: usize,
        ) -> i32 {
            host::with(instance.addr(), stringify!($set), |i| {
                // SAFETY: the master's lists.
                let (references, values) = unsafe {
                    (
                        input(valueReferences, nValueReferences, "valueReferences")?,
                        input(values, nValues, "values")?,
                    )
                };
                let values: Vec<f64> = values.iter().map(|&v| v as f64).collect();
                i.write(Kind::$kind, references, &values, false)
            }) as i32
        }
    )*};
}

numbers! {
    fmi3GetFloat64 fmi3SetFloat64 f64, Float64;
    fmi3GetInt32 fmi3SetInt32 i32, Int32;
    fmi3GetUInt32 fmi3SetUInt32 u32, UInt32;
    fmi3GetUInt64 fmi3SetUInt64 u64, UInt64;
}

/// `fmi3GetBoolean`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetBoolean(
    instance: Instance3,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *mut u8,
    nValues: usize,
) -> i32 {
    host::with(instance.addr(), "fmi3GetBoolean", |i| {
        // SAFETY: the master's list of references.
        let references = unsafe { input(valueReferences, nValueReferences, "valueReferences")? };
        let read = i.read(Kind::Boolean, references, nValues, false)?;
        let read = read.into_iter().map(|v| u8::from(v > 0.5));
        // SAFETY: room for `nValues`, which is as many as were read.
        unsafe { output(values, read, "values")? };
        Ok(Status::Ok)
    }) as i32
}

/// `fmi3SetBoolean`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetBoolean(
    instance: Instance3,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *const u8,
    nValues: usize,
) -> i32 {
    host::with(instance.addr(), "fmi3SetBoolean", |i| {
        // SAFETY: the master's lists.
        let (references, values) = unsafe {
            (
                input(valueReferences, nValueReferences, "valueReferences")?,
                input(values, nValues, "values")?,
            )
        };
        let values: Vec<f64> = values
            .iter()
            .map(|&v| f64::from(u8::from(v != 0)))
            .collect();
        i.write(Kind::Boolean, references, &values, false)
    }) as i32
}

/// `fmi3GetBinary`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetBinary(
    instance: Instance3,
    valueReferences: *const u32,
    nValueReferences: usize,
    valueSizes: *mut usize,
    values: *mut *const u8,
    nValues: usize,
) -> i32 {
    host::with(instance.addr(), "fmi3GetBinary", |i| {
        // SAFETY: the master's list of references, and room for `nValues` sizes and pointers, which
        // is as many as were read.
        unsafe {
            let references = input(valueReferences, nValueReferences, "valueReferences")?;
            let read = i.read_binaries(references, nValues)?;
            output(valueSizes, read.iter().map(Vec::len), "valueSizes")?;
            output(values, read.iter().map(|b| b.as_ptr()), "values")?;
        }
        Ok(Status::Ok)
    }) as i32
}

/// `fmi3GetFMUState`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(instance: Instance3, FMUState: *mut State3) -> i32 {
    with_slot(instance, "fmi3GetFMUState", FMUState, host::get_state)
}

/// `fmi3SetFMUState`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetFMUState(instance: Instance3, FMUState: State3) -> i32 {
    host::set_state(instance.addr(), "fmi3SetFMUState", FMUState.addr()) as i32
}

/// `fmi3FreeFMUState`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(instance: Instance3, FMUState: *mut State3) -> i32 {
    if FMUState.is_null() {
        return Status::Ok as i32;
    }
    with_slot(instance, "fmi3FreeFMUState", FMUState, host::free_state)
}

/// `fmi3SerializedFMUStateSize`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializedFMUStateSize(
    instance: Instance3,
    FMUState: State3,
    size: *mut usize,
) -> i32 {
    state_size(instance, "fmi3SerializedFMUStateSize", FMUState, size)
}

/// `fmi3SerializeFMUState`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializeFMUState(
    instance: Instance3,
    FMUState: State3,
    serializedState: *mut u8,
    size: usize,
) -> i32 {
    serialize(
        instance,
        "fmi3SerializeFMUState",
        FMUState,
        serializedState,
        size,
    )
}

/// `fmi3DeserializeFMUState`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DeserializeFMUState(
    instance: Instance3,
    serializedState: *const u8,
    size: usize,
    FMUState: *mut State3,
) -> i32 {
    deserialize(
        instance,
        "fmi3DeserializeFMUState",
        serializedState,
        size,
        FMUState,
    )
}

/// Hands a call the token behind the master's pointer to a state, and puts it back.
pub(super) fn with_slot(
    instance: Instance3,
    function: &str,
    slot: *mut State3,
    body: impl FnOnce(usize, &str, &mut usize) -> Status,
) -> i32 {
    // SAFETY: the master's place for one pointer.
    let given = match unsafe { input(slot, 1, "FMUState") } {
        Ok(given) => given[0],
        Err(e) => return host::unsupported(instance.addr(), function, &e.message) as i32,
    };
    let mut token = given.addr();
    let status = body(instance.addr(), function, &mut token);
    // SAFETY: the same place, checked above.
    unsafe { put(slot, std::ptr::without_provenance_mut(token)) };
    status as i32
}

pub(super) fn state_size(
    instance: Instance3,
    function: &str,
    state: State3,
    size: *mut usize,
) -> i32 {
    host::state_bytes(instance.addr(), function, state.addr(), |bytes| {
        // SAFETY: the master's place for one number.
        unsafe { output(size, std::iter::once(bytes.len()), "size") }
    }) as i32
}

pub(super) fn serialize(
    instance: Instance3,
    function: &str,
    state: State3,
    buffer: *mut u8,
    size: usize,
) -> i32 {
    host::state_bytes(instance.addr(), function, state.addr(), |bytes| {
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

pub(super) fn deserialize(
    instance: Instance3,
    function: &str,
    bytes: *const u8,
    size: usize,
    slot: *mut State3,
) -> i32 {
    with_slot(instance, function, slot, |token, function, state| {
        // SAFETY: `size` bytes of the master.
        match unsafe { input(bytes, size, "serializedState") } {
            Ok(bytes) => host::deserialize(token, function, bytes, state),
            Err(e) => host::unsupported(token, function, &e.message),
        }
    })
}
