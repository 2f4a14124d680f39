//! toile as an FMU for co-simulation, FMI 3.0 and FMI 2.0: a scene packed into an archive that any
//! master loads.
//!
//! From the inside out:
//!
//! * [`variables`], [`table`]: what a master sees of a scene, as one list made by a pure function.
//!   The packer and the library make the same list; a fingerprint in the archive tells if they do
//!   not.
//! * [`model`]: the scene of an unpacked archive, and simulations of it for given parameters.
//! * [`instance`]: values, modes, steps, saved states, without C. FMI 2 and 3 both go through it.
//! * `registry`, `host`: the master's pointers are tokens that are looked up; threads are kept
//!   apart; panics stop here.
//! * [`cosim3`], [`cosim3_refused`], [`cosim2`]: the C functions, thin. What both versions do alike
//!   stands in `exchange`. Only these and `pointers` have `unsafe` code.
//! * [`package`] and what it calls: the archive with its model description.
//!
//! No state of the process is touched: no working folder, locale, signal handler, panic hook or
//! floating-point mode. Threads belong to an instance and are joined when it is freed.

mod describe;
mod drive;
mod exchange;
mod fabric_numbers;
mod handbook;
mod host;
mod names;
mod pointers;
mod registry;
mod results;
mod saved;
mod units;
mod uri;
mod xml;

pub mod collect;
pub mod cosim2;
pub mod cosim3;
pub mod cosim3_refused;
pub mod instance;
pub mod log;
pub mod model;
pub mod package;
pub mod platform;
pub mod table;
pub mod variables;

pub use fabric_numbers::FabricNumber;
