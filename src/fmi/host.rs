//! What both versions of FMI do with instances and saved states, without pointers: look them up,
//! keep threads apart, answer with a status.

use super::instance::{Answer, Instance};
use super::log::{Log, Status};
use super::registry::Registry;
use crate::error::{self, Error};
use std::path::PathBuf;
use std::sync::{Mutex, TryLockError};

static INSTANCES: Registry<Mutex<Instance>> = Registry::new(0x51);
static STATES: Registry<State> = Registry::new(0x52);

/// A saved state and the instance that it goes with.
#[derive(Debug)]
struct State {
    owner: usize,
    bytes: Vec<u8>,
}

/// What a master asks to be made.
#[derive(Debug)]
pub(super) struct Asked {
    /// The instance's name.
    pub(super) name: String,
    /// Instantiation token, GUID.
    pub(super) token: String,
    /// Folder of the resources.
    pub(super) resources: PathBuf,
}

/// Makes an instance of what `asked` reads; its token, or 0 after telling `log` why not.
pub(super) fn instantiate(
    function: &str,
    mut log: Log,
    asked: impl FnOnce() -> Result<Asked, Error>,
) -> usize {
    let made = error::catch(|| {
        let asked = asked()?;
        // errors are told through the log, which the instance takes only if there is one
        let quiet = Log::new(None, false);
        let mut instance = Instance::new(&asked.name, &asked.token, &asked.resources, quiet)?;
        std::mem::swap(instance.log(), &mut log);
        Ok(INSTANCES.insert(Mutex::new(instance)))
    });
    made.unwrap_or_else(|e| {
        log.say(Status::Error, || format!("{function}: {e}"));
        0
    })
}

/// Runs a call on an instance. A token that is no instance's, or one that another thread is using,
/// is an error without a log line, since there is nobody to tell.
pub(super) fn with(
    token: usize,
    function: &str,
    body: impl FnOnce(&mut Instance) -> Answer,
) -> Status {
    run(token, |instance| instance.call(function, body))
}

/// [`with`] for calls that make the simulation anew.
fn with_any(token: usize, function: &str, body: impl FnOnce(&mut Instance) -> Answer) -> Status {
    run(token, |instance| instance.call_anyway(function, body))
}

fn run(token: usize, body: impl FnOnce(&mut Instance) -> Status) -> Status {
    let done = error::catch(|| {
        let Some(instance) = INSTANCES.get(token) else {
            return Ok(Status::Error);
        };
        match instance.try_lock() {
            Ok(mut instance) => Ok(body(&mut instance)),
            Err(TryLockError::Poisoned(instance)) => Ok(body(&mut instance.into_inner())),
            Err(TryLockError::WouldBlock) => Ok(Status::Error),
        }
    });
    done.unwrap_or(Status::Error)
}

/// Destroys an instance with its threads and saved states; a token of none is no harm.
pub(super) fn free(token: usize) {
    // a panic has nobody to be told to, and must not get out
    let _ = error::catch(|| {
        drop(INSTANCES.remove(token));
        STATES.remove_all(|state| state.owner == token);
        Ok(())
    });
}

/// As it was when it was made.
pub(super) fn reset(token: usize, function: &str) -> Status {
    with_any(token, function, Instance::reset)
}

/// Whether a token is an instance's.
pub(super) fn exists(token: usize) -> bool {
    INSTANCES.get(token).is_some()
}

fn no_state(token: usize) -> Error {
    Error::argument(format!("{token:#x} is not a saved state of this library"))
}

/// Puts bytes behind a state's token, or behind a new one.
fn keep(owner: usize, bytes: Vec<u8>, slot: &mut usize) -> Result<(), Error> {
    let state = State { owner, bytes };
    if *slot == 0 {
        *slot = STATES.insert(state);
    } else if !STATES.replace(*slot, state) {
        return Err(no_state(*slot));
    }
    Ok(())
}

/// Saves the state; overwrites the one in `slot` unless that is 0.
pub(super) fn get_state(token: usize, function: &str, slot: &mut usize) -> Status {
    with(token, function, |instance| {
        let bytes = instance.save()?;
        keep(token, bytes, slot)?;
        Ok(Status::Ok)
    })
}

/// Goes to a saved state of this or another instance.
pub(super) fn set_state(token: usize, function: &str, state: usize) -> Status {
    with_any(token, function, |instance| {
        let state = STATES.get(state).ok_or_else(|| no_state(state))?;
        instance.load(&state.bytes)
    })
}

/// Frees a saved state; 0 is no harm.
pub(super) fn free_state(token: usize, function: &str, slot: &mut usize) -> Status {
    with(token, function, |_| {
        if *slot != 0 && STATES.remove(*slot).is_none() {
            return Err(no_state(*slot).into());
        }
        *slot = 0;
        Ok(Status::Ok)
    })
}

/// Runs `body` on the bytes of a saved state.
pub(super) fn state_bytes(
    token: usize,
    function: &str,
    state: usize,
    body: impl FnOnce(&[u8]) -> Result<(), Error>,
) -> Status {
    with(token, function, |_| {
        let state = STATES.get(state).ok_or_else(|| no_state(state))?;
        body(&state.bytes)?;
        Ok(Status::Ok)
    })
}

/// Makes a saved state of bytes.
pub(super) fn deserialize(token: usize, function: &str, bytes: &[u8], slot: &mut usize) -> Status {
    with(token, function, |instance| {
        instance.check_saved(bytes)?;
        keep(token, bytes.to_vec(), slot)?;
        Ok(Status::Ok)
    })
}

/// Refuses a call.
pub(super) fn refuse(token: usize, function: &str, why: Error) -> Status {
    with(token, function, |_| Err(why.into()))
}
