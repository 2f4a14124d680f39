//! The C ABI: what `libtoile` exports and `include/toile.h` declares.
//!
//! How it is built, from the inside out:
//!
//! * [`handle`]: a handle is a token (kind, generation, slot) that is looked up in a table and
//!   never dereferenced. NULL, freed, foreign and invented handles are found out by the look-up.
//!   Every entry of the table carries a readers-or-one-writer state, so that two threads that break
//!   the thread rule get `TOILE_E_BUSY` instead of a data race.
//! * [`guard`]: every exported function is one guard. A panic stops there, becomes
//!   `TOILE_E_PANIC` and poisons the handle it happened in. The text of the last error is kept for
//!   each thread.
//! * [`desc`]: structs carry their own size; both sides copy the smaller of the two sizes, so old
//!   hosts run with new libraries and new hosts with old ones.
//! * [`input`], [`output`]: what the caller passes is measured (NULL, alignment, count, NaN) before
//!   a slice is made of it, and copied before an object is locked for writing, because it may point
//!   into that very object (a view).
//! * one file for each object: [`garment`] (with `panel` and [`garment_readout`]), [`body`], [`sim`]
//!   (with [`motion`], [`readout`], [`region`] and [`suggest`]).
//!
//! The comments of exported items are the header's text: they are written for C readers, and name
//! the unit and the shape of every array.

#![allow(
    unsafe_code,
    reason = "the boundary to C: pointers of the caller are read and written here and nowhere else"
)]
#![allow(
    non_camel_case_types,
    reason = "types carry the names that C sees, so that the header needs no renaming"
)]
#![allow(
    clippy::missing_safety_doc,
    reason = "the comments are the C header's text; what a pointer must satisfy stands in its preamble"
)]

mod desc;
mod guard;
mod handle;
mod input;
mod log;
mod output;
mod panel;

pub mod array;
pub mod body;
pub mod garment;
pub mod garment_readout;
pub mod motion;
pub mod readout;
pub mod region;
pub mod sim;
pub mod status;
pub mod suggest;
pub mod types;
pub mod yarns;

pub use array::*;
pub use body::*;
pub use garment::*;
pub use garment_readout::*;
pub use motion::*;
pub use readout::*;
pub use region::*;
pub use sim::*;
pub use status::*;
pub use suggest::*;
pub use types::*;
pub use yarns::*;
