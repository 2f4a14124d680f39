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

use super::exchange::{self, Call, Instance as Instance3, State as State3, c_text, transitions};
use super::host::{self, Asked};
use super::log::{Log, Sink, Status};
use super::pointers::{input, output, put, text};
use super::variables::Kind;
use crate::error::Error;
use std::ffi::{c_char, c_void};

/// `fmi3LogMessageCallback`.
pub type LogMessage = unsafe extern "C" fn(*mut c_void, i32, *const c_char, *const c_char);

/// A call of FMI 3.
pub(super) fn call(instance: Instance3, function: &str) -> Call<'_> {
    Call {
        token: instance.addr(),
        function,
        fmi2: false,
    }
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
    let call = call(instance, "fmi3SetDebugLogging");
    // SAFETY: the master's list of texts.
    unsafe { exchange::log_categories(call, loggingOn != 0, nCategories, categories) }
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
        let resources = path.into();
        Ok(Asked {
            name,
            token,
            resources,
        })
    };
    let token = host::instantiate("fmi3InstantiateCoSimulation", log, asked);
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

macro_rules! values {
    ($($get:ident $set:ident $type:ty, $kind:ident, $from:expr, $into:expr;)*) => {$(
        #[doc = concat!("`", stringify!($get), "`")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            instance: Instance3,
            valueReferences: *const u32,
            nValueReferences: usize,
            values: *mut $type,
            nValues: usize,
        ) -> i32 {
            let references = (valueReferences, nValueReferences);
            let call = call(instance, stringify!($get));
            // SAFETY: the master's lists.
            unsafe { exchange::get(call, Kind::$kind, references, (values, nValues), $from) }
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
            let references = (valueReferences, nValueReferences);
            let call = call(instance, stringify!($set));
            // SAFETY: the master's lists.
            unsafe { exchange::set(call, Kind::$kind, references, (values, nValues), $into) }
        }
    )*};
}

values! {
    fmi3GetFloat64 fmi3SetFloat64 f64, Float64, |v| v, |v| v;
    fmi3GetInt32 fmi3SetInt32 i32, Int32, |v| v as i32, f64::from;
    fmi3GetUInt32 fmi3SetUInt32 u32, UInt32, |v| v as u32, f64::from;
    fmi3GetUInt64 fmi3SetUInt64 u64, UInt64, |v| v as u64, |v| v as f64;
    fmi3GetBoolean fmi3SetBoolean u8, Boolean, |v| u8::from(v > 0.5), |v| f64::from(u8::from(v != 0));
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
pub extern "C" fn fmi3GetFMUState(instance: Instance3, FMUState: *mut State3) -> i32 {
    exchange::get_state(call(instance, "fmi3GetFMUState"), FMUState)
}

/// `fmi3SetFMUState`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetFMUState(instance: Instance3, FMUState: State3) -> i32 {
    host::set_state(instance.addr(), "fmi3SetFMUState", FMUState.addr()) as i32
}

/// `fmi3FreeFMUState`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3FreeFMUState(instance: Instance3, FMUState: *mut State3) -> i32 {
    exchange::free_state(call(instance, "fmi3FreeFMUState"), FMUState)
}

/// `fmi3SerializedFMUStateSize`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SerializedFMUStateSize(
    instance: Instance3,
    FMUState: State3,
    size: *mut usize,
) -> i32 {
    let call = call(instance, "fmi3SerializedFMUStateSize");
    exchange::state_size(call, FMUState, size)
}

/// `fmi3SerializeFMUState`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SerializeFMUState(
    instance: Instance3,
    FMUState: State3,
    serializedState: *mut u8,
    size: usize,
) -> i32 {
    let call = call(instance, "fmi3SerializeFMUState");
    exchange::serialize(call, FMUState, serializedState, size)
}

/// `fmi3DeserializeFMUState`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3DeserializeFMUState(
    instance: Instance3,
    serializedState: *const u8,
    size: usize,
    FMUState: *mut State3,
) -> i32 {
    let call = call(instance, "fmi3DeserializeFMUState");
    exchange::deserialize(call, serializedState, size, FMUState)
}
