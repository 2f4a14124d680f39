//! Call sequences of the C interface made from the fuzzer's bytes.
#![no_main]

#[path = "../../tests/capi_support/calls/mod.rs"]
#[allow(dead_code, reason = "shared with the other targets")]
mod calls;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    calls::run(bytes);
});
