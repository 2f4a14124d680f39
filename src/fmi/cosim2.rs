//! FMI 2.0: all functions of its header over the same instances as FMI 3. Arrays and bytes have no
//! place in FMI 2; masters reach them through the C interface.
#![allow(
    unsafe_code,
    non_snake_case,
    reason = "the boundary to C, with the names that FMI gives"
)]
#![allow(
    clippy::missing_safety_doc,
    reason = "FMI 2.0 says what pointers must satisfy; counts, NULL and alignment are checked"
)]

use super::exchange::{
    self, Call, Instance as Instance2, State as State2, c_text, refused, transitions,
};
use super::host::{self, Asked};
use super::log::{Log, Sink, Status};
use super::pointers::{input, output, text};
use super::uri;
use super::variables::Kind;
use crate::error::Error;
use std::ffi::{c_char, c_void};

/// `fmi2CallbackLogger`.
pub type Logger =
    unsafe extern "C" fn(*mut c_void, *const c_char, i32, *const c_char, *const c_char, ...);

/// `fmi2CallbackFunctions`; memory is the library's own.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Callbacks {
    /// Takes messages.
    pub logger: Option<Logger>,
    /// Not called.
    pub allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// Not called.
    pub free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Not called: steps end when they return.
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, i32)>,
    /// Handed to the logger.
    pub environment: *mut c_void,
}

/// `fmi2CoSimulation` of `fmi2Type`.
const CO_SIMULATION: i32 = 1;
/// `fmi2LastSuccessfulTime` and `fmi2Terminated` of `fmi2StatusKind`.
const LAST_SUCCESSFUL_TIME: i32 = 2;
const TERMINATED: i32 = 3;

const EXCHANGE: &str = "this FMU is for co-simulation, not for model exchange";
const DERIVATIVES: &str = "this FMU provides no derivatives";
const PENDING: &str = "steps of this FMU end when they return: none is ever pending";

/// A call of FMI 2.
fn call(c: Instance2, function: &str) -> Call<'_> {
    Call {
        token: c.addr(),
        function,
        fmi2: true,
    }
}

/// `fmi2GetTypesPlatform`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// `fmi2GetVersion`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

fn log2(callbacks: Option<&Callbacks>, name: &str, on: bool) -> Log {
    let Some(Callbacks {
        logger: Some(logger),
        environment,
        ..
    }) = callbacks.copied()
    else {
        return Log::new(None, on);
    };
    let (environment, name) = (environment.addr(), c_text(name));
    let sink: Sink = Box::new(move |status, category, message| {
        // the message is a format: a lone per cent sign would ask for arguments that are not there
        let (category, message) = (c_text(category), c_text(&message.replace('%', "%%")));
        // SAFETY: the logger and its environment are the master's, good for the instance's life.
        unsafe {
            logger(
                std::ptr::without_provenance_mut(environment),
                name.as_ptr(),
                status as i32,
                category.as_ptr(),
                message.as_ptr(),
            );
        }
    });
    Log::new(Some(sink), on)
}

/// `fmi2Instantiate`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    instanceName: *const c_char,
    fmuType: i32,
    fmuGUID: *const c_char,
    fmuResourceLocation: *const c_char,
    functions: *const Callbacks,
    _visible: i32,
    loggingOn: i32,
) -> Instance2 {
    // SAFETY: one struct of the master, or NULL.
    let callbacks = unsafe { input(functions, usize::from(!functions.is_null()), "functions") };
    let callbacks = callbacks.ok().and_then(|c| c.first());
    // SAFETY: a text of the master.
    let name = unsafe { text(instanceName, "instanceName") };
    let log = log2(
        callbacks,
        name.as_deref().unwrap_or_default(),
        loggingOn != 0,
    );
    let asked = || {
        // SAFETY: two texts of the master.
        let (token, location) = unsafe {
            (
                text(fmuGUID, "fmuGUID")?,
                text(fmuResourceLocation, "fmuResourceLocation")?,
            )
        };
        if fmuType != CO_SIMULATION {
            return Err(Error::unsupported(EXCHANGE));
        }
        Ok(Asked {
            name: name?,
            token,
            resources: uri::path(&location)?,
        })
    };
    let token = host::instantiate("fmi2Instantiate", log, asked);
    std::ptr::without_provenance_mut(token)
}

/// `fmi2FreeInstance`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2FreeInstance(c: Instance2) {
    host::free(c.addr());
}

/// `fmi2SetDebugLogging`
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(
    c: Instance2,
    loggingOn: i32,
    nCategories: usize,
    categories: *const *const c_char,
) -> i32 {
    let call = call(c, "fmi2SetDebugLogging");
    // SAFETY: the master's list of texts.
    unsafe { exchange::log_categories(call, loggingOn != 0, nCategories, categories) }
}

/// `fmi2SetupExperiment`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetupExperiment(
    c: Instance2,
    toleranceDefined: i32,
    tolerance: f64,
    startTime: f64,
    stopTimeDefined: i32,
    stopTime: f64,
) -> i32 {
    host::with(c.addr(), "fmi2SetupExperiment", |i| {
        i.set_up(
            (toleranceDefined != 0).then_some(tolerance),
            startTime,
            (stopTimeDefined != 0).then_some(stopTime),
        )
    }) as i32
}

transitions! {
    fmi2EnterInitializationMode => enter_initialization;
    fmi2ExitInitializationMode => exit_initialization;
    fmi2Terminate => terminate;
}

/// `fmi2Reset`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2Reset(c: Instance2) -> i32 {
    host::reset(c.addr(), "fmi2Reset") as i32
}

/// `fmi2DoStep`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2DoStep(
    c: Instance2,
    currentCommunicationPoint: f64,
    communicationStepSize: f64,
    _noSetFMUStatePriorToCurrentPoint: i32,
) -> i32 {
    host::with(c.addr(), "fmi2DoStep", |i| {
        i.do_step(currentCommunicationPoint, communicationStepSize)
    }) as i32
}

macro_rules! values {
    ($($get:ident $set:ident $type:ty, $kind:ident, $from:expr, $into:expr;)*) => {$(
        #[doc = concat!("`", stringify!($get), "`")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            c: Instance2, vr: *const u32, nvr: usize, value: *mut $type,
        ) -> i32 {
            let call = call(c, stringify!($get));
            // SAFETY: the master's lists.
            unsafe { exchange::get(call, Kind::$kind, (vr, nvr), (value, nvr), $from) }
        }

        #[doc = concat!("`", stringify!($set), "`")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            c: Instance2, vr: *const u32, nvr: usize, value: *const $type,
        ) -> i32 {
            let call = call(c, stringify!($set));
            // SAFETY: the master's lists.
            unsafe { exchange::set(call, Kind::$kind, (vr, nvr), (value, nvr), $into) }
        }
    )*};
}

values! {
    fmi2GetReal fmi2SetReal f64, Float64, |v| v, |v| v;
    fmi2GetInteger fmi2SetInteger i32, Int32, |v| v as i32, f64::from;
    fmi2GetBoolean fmi2SetBoolean i32, Boolean, |v| i32::from(v > 0.5), |v| f64::from(u8::from(v != 0));
}

/// `fmi2GetFMUstate`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetFMUstate(c: Instance2, FMUstate: *mut State2) -> i32 {
    exchange::get_state(call(c, "fmi2GetFMUstate"), FMUstate)
}

/// `fmi2SetFMUstate`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetFMUstate(c: Instance2, FMUstate: State2) -> i32 {
    host::set_state(c.addr(), "fmi2SetFMUstate", FMUstate.addr()) as i32
}

/// `fmi2FreeFMUstate`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2FreeFMUstate(c: Instance2, FMUstate: *mut State2) -> i32 {
    exchange::free_state(call(c, "fmi2FreeFMUstate"), FMUstate)
}

/// `fmi2SerializedFMUstateSize`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SerializedFMUstateSize(
    c: Instance2,
    FMUstate: State2,
    size: *mut usize,
) -> i32 {
    exchange::state_size(call(c, "fmi2SerializedFMUstateSize"), FMUstate, size)
}

/// `fmi2SerializeFMUstate`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SerializeFMUstate(
    c: Instance2,
    FMUstate: State2,
    serializedState: *mut c_char,
    size: usize,
) -> i32 {
    let call = call(c, "fmi2SerializeFMUstate");
    exchange::serialize(call, FMUstate, serializedState.cast(), size)
}

/// `fmi2DeSerializeFMUstate`
#[unsafe(no_mangle)]
pub extern "C" fn fmi2DeSerializeFMUstate(
    c: Instance2,
    serializedState: *const c_char,
    size: usize,
    FMUstate: *mut State2,
) -> i32 {
    let call = call(c, "fmi2DeSerializeFMUstate");
    exchange::deserialize(call, serializedState.cast(), size, FMUstate)
}

/// `fmi2GetRealStatus`: the time that was reached.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(c: Instance2, s: i32, value: *mut f64) -> i32 {
    host::with(c.addr(), "fmi2GetRealStatus", |i| {
        if s != LAST_SUCCESSFUL_TIME {
            return Err(Error::argument(format!("status kind {s} is no real number")).into());
        }
        // SAFETY: the master's place for one number.
        unsafe { output(value, std::iter::once(i.time()), "value")? };
        Ok(Status::Ok)
    }) as i32
}

/// `fmi2GetBooleanStatus`: whether the FMU wants the run to end, which it never does, or has ended it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBooleanStatus(c: Instance2, s: i32, value: *mut i32) -> i32 {
    host::with(c.addr(), "fmi2GetBooleanStatus", |i| {
        if s != TERMINATED {
            return Err(Error::argument(format!("status kind {s} is no boolean")).into());
        }
        // SAFETY: the master's place for one number.
        unsafe {
            output(
                value,
                std::iter::once(i32::from(i.is_terminated())),
                "value",
            )?
        };
        Ok(Status::Ok)
    }) as i32
}

refused! {
    fmi2GetDirectionalDerivative(
        _unknowns: *const u32, _nUnknown: usize, _knowns: *const u32, _nKnown: usize,
        _dvKnown: *const f64, _dvUnknown: *mut f64
    ) DERIVATIVES;
    fmi2SetRealInputDerivatives(
        _vr: *const u32, _nvr: usize, _order: *const i32, _value: *const f64
    ) DERIVATIVES;
    fmi2GetRealOutputDerivatives(
        _vr: *const u32, _nvr: usize, _order: *const i32, _value: *mut f64
    ) DERIVATIVES;
    fmi2CancelStep() PENDING;
    fmi2GetStatus(_s: i32, _value: *mut i32) PENDING;
    fmi2GetIntegerStatus(_s: i32, _value: *mut i32) PENDING;
    fmi2GetStringStatus(_s: i32, _value: *mut *const c_char) PENDING;
    fmi2EnterEventMode() EXCHANGE;
    fmi2NewDiscreteStates(_eventInfo: *mut c_void) EXCHANGE;
    fmi2EnterContinuousTimeMode() EXCHANGE;
    fmi2CompletedIntegratorStep(
        _noSetFMUStatePriorToCurrentPoint: i32, _enterEventMode: *mut i32,
        _terminateSimulation: *mut i32
    ) EXCHANGE;
    fmi2SetTime(_time: f64) EXCHANGE;
    fmi2SetContinuousStates(_x: *const f64, _nx: usize) EXCHANGE;
    fmi2GetDerivatives(_derivatives: *mut f64, _nx: usize) EXCHANGE;
    fmi2GetEventIndicators(_indicators: *mut f64, _ni: usize) EXCHANGE;
    fmi2GetContinuousStates(_x: *mut f64, _nx: usize) EXCHANGE;
    fmi2GetNominalsOfContinuousStates(_nominals: *mut f64, _nx: usize) EXCHANGE;
}

macro_rules! no_strings {
    ($($name:ident $type:ty;)*) => {$(
        #[doc = concat!("`", stringify!($name), "`: no variable is a text.")]
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(c: Instance2, _vr: *const u32, nvr: usize, _value: $type) -> i32 {
            exchange::none_of(call(c, stringify!($name)), "String", nvr, nvr)
        }
    )*};
}

no_strings! {
    fmi2GetString *mut *const c_char;
    fmi2SetString *const *const c_char;
}
