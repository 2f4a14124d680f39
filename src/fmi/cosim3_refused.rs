//! FMI 3.0: the functions that this FMU does not offer: model exchange, scheduled execution, events,
//! clocks, derivatives, and data types that no variable has. Masters look all of them up when they
//! load an FMU, so all are there; each is an error with a log line.
#![allow(
    unsafe_code,
    non_snake_case,
    reason = "the boundary to C, with the names that FMI gives"
)]
#![allow(
    clippy::missing_safety_doc,
    reason = "no pointer is looked at, but for the texts that the log takes"
)]

use super::cosim3::{LogMessage, call, log3};
use super::exchange::{Instance as Instance3, none_of, refused};
use super::log::Status;
use std::ffi::{c_char, c_void};

const EVENTS: &str = "this FMU has no Event Mode";
const CLOCKS: &str = "this FMU has no clocks";
const EXCHANGE: &str = "this FMU is for co-simulation, not for model exchange";
const DERIVATIVES: &str = "this FMU provides no derivatives";
const DEPENDENCIES: &str = "this FMU provides no dependencies per element";

/// `fmi3InstantiateModelExchange`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange(
    _instanceName: *const c_char,
    _instantiationToken: *const c_char,
    _resourcePath: *const c_char,
    _visible: u8,
    loggingOn: u8,
    instanceEnvironment: *mut c_void,
    logMessage: Option<LogMessage>,
) -> Instance3 {
    log3(logMessage, instanceEnvironment, loggingOn != 0).say(Status::Error, || {
        format!("fmi3InstantiateModelExchange: {EXCHANGE}")
    });
    std::ptr::null_mut()
}

/// `fmi3InstantiateScheduledExecution`
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateScheduledExecution(
    _instanceName: *const c_char,
    _instantiationToken: *const c_char,
    _resourcePath: *const c_char,
    _visible: u8,
    loggingOn: u8,
    instanceEnvironment: *mut c_void,
    logMessage: Option<LogMessage>,
    _clockUpdate: *const c_void,
    _lockPreemption: *const c_void,
    _unlockPreemption: *const c_void,
) -> Instance3 {
    log3(logMessage, instanceEnvironment, loggingOn != 0).say(Status::Error, || {
        "fmi3InstantiateScheduledExecution: this FMU is for co-simulation only".into()
    });
    std::ptr::null_mut()
}

refused! {
    fmi3EnterEventMode() EVENTS;
    fmi3EnterStepMode() EVENTS;
    fmi3EvaluateDiscreteStates() EVENTS;
    fmi3UpdateDiscreteStates(
        _discreteStatesNeedUpdate: *mut u8, _terminateSimulation: *mut u8,
        _nominalsChanged: *mut u8, _valuesChanged: *mut u8,
        _nextEventTimeDefined: *mut u8, _nextEventTime: *mut f64
    ) EVENTS;
    fmi3GetClock(_references: *const u32, _n: usize, _values: *mut u8) CLOCKS;
    fmi3SetClock(_references: *const u32, _n: usize, _values: *const u8) CLOCKS;
    fmi3GetIntervalDecimal(
        _references: *const u32, _n: usize, _intervals: *mut f64, _qualifiers: *mut i32
    ) CLOCKS;
    fmi3GetIntervalFraction(
        _references: *const u32, _n: usize, _counters: *mut u64, _resolutions: *mut u64,
        _qualifiers: *mut i32
    ) CLOCKS;
    fmi3GetShiftDecimal(_references: *const u32, _n: usize, _shifts: *mut f64) CLOCKS;
    fmi3GetShiftFraction(
        _references: *const u32, _n: usize, _counters: *mut u64, _resolutions: *mut u64
    ) CLOCKS;
    fmi3SetIntervalDecimal(_references: *const u32, _n: usize, _intervals: *const f64) CLOCKS;
    fmi3SetIntervalFraction(
        _references: *const u32, _n: usize, _counters: *const u64, _resolutions: *const u64
    ) CLOCKS;
    fmi3SetShiftDecimal(_references: *const u32, _n: usize, _shifts: *const f64) CLOCKS;
    fmi3SetShiftFraction(
        _references: *const u32, _n: usize, _counters: *const u64, _resolutions: *const u64
    ) CLOCKS;
    fmi3ActivateModelPartition(_clock: u32, _time: f64) CLOCKS;
    fmi3EnterContinuousTimeMode() EXCHANGE;
    fmi3CompletedIntegratorStep(
        _noSetFMUStatePriorToCurrentPoint: u8, _enterEventMode: *mut u8,
        _terminateSimulation: *mut u8
    ) EXCHANGE;
    fmi3SetTime(_time: f64) EXCHANGE;
    fmi3SetContinuousStates(_states: *const f64, _n: usize) EXCHANGE;
    fmi3GetContinuousStateDerivatives(_derivatives: *mut f64, _n: usize) EXCHANGE;
    fmi3GetEventIndicators(_indicators: *mut f64, _n: usize) EXCHANGE;
    fmi3GetContinuousStates(_states: *mut f64, _n: usize) EXCHANGE;
    fmi3GetNominalsOfContinuousStates(_nominals: *mut f64, _n: usize) EXCHANGE;
    fmi3GetNumberOfEventIndicators(_count: *mut usize) EXCHANGE;
    fmi3GetNumberOfContinuousStates(_count: *mut usize) EXCHANGE;
    fmi3GetOutputDerivatives(
        _references: *const u32, _n: usize, _orders: *const i32, _values: *mut f64, _count: usize
    ) DERIVATIVES;
    fmi3GetDirectionalDerivative(
        _unknowns: *const u32, _nUnknowns: usize, _knowns: *const u32, _nKnowns: usize,
        _seed: *const f64, _nSeed: usize, _sensitivity: *mut f64, _nSensitivity: usize
    ) DERIVATIVES;
    fmi3GetAdjointDerivative(
        _unknowns: *const u32, _nUnknowns: usize, _knowns: *const u32, _nKnowns: usize,
        _seed: *const f64, _nSeed: usize, _sensitivity: *mut f64, _nSensitivity: usize
    ) DERIVATIVES;
    fmi3GetNumberOfVariableDependencies(_reference: u32, _count: *mut usize) DEPENDENCIES;
    fmi3GetVariableDependencies(
        _dependent: u32, _elementsOfDependent: *mut usize, _independents: *mut u32,
        _elementsOfIndependents: *mut usize, _kinds: *mut i32, _n: usize
    ) DEPENDENCIES;
}

/// Types that no variable has: asking for none of them is no error.
macro_rules! no_such_type {
    ($($get:ident $set:ident $type:ty, $name:literal;)*) => {$(
        #[doc = concat!("`", stringify!($get), "`: no variable is of this type.")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $get(
            instance: Instance3, _references: *const u32, n: usize, _values: *mut $type, count: usize,
        ) -> i32 {
            none_of(call(instance, stringify!($get)), $name, n, count)
        }

        #[doc = concat!("`", stringify!($set), "`: no variable is of this type.")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $set(
            instance: Instance3, _references: *const u32, n: usize, _values: *const $type, count: usize,
        ) -> i32 {
            none_of(call(instance, stringify!($set)), $name, n, count)
        }
    )*};
}

no_such_type! {
    fmi3GetFloat32 fmi3SetFloat32 f32, "Float32";
    fmi3GetInt8 fmi3SetInt8 i8, "Int8";
    fmi3GetUInt8 fmi3SetUInt8 u8, "UInt8";
    fmi3GetInt16 fmi3SetInt16 i16, "Int16";
    fmi3GetUInt16 fmi3SetUInt16 u16, "UInt16";
    fmi3GetInt64 fmi3SetInt64 i64, "Int64";
    fmi3GetString fmi3SetString *const c_char, "String";
}

/// `fmi3SetBinary`: no binary variable can be set.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetBinary(
    instance: Instance3,
    _references: *const u32,
    n: usize,
    _sizes: *const usize,
    _values: *const *const u8,
    count: usize,
) -> i32 {
    let call = call(instance, "fmi3SetBinary");
    none_of(call, "Binary that can be set", n, count)
}
