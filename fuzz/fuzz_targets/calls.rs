//! Call sequences of the C interface made from the fuzzer's bytes.
#![no_main]

#[path = "../../tests/capi_support/calls.rs"]
mod calls;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    calls::run(bytes);
});
