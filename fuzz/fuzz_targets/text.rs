//! The fuzzer's bytes read as a garment; what can be read is made and stepped.
#![no_main]

#[path = "../../tests/capi_support/calls/mod.rs"]
#[allow(dead_code, reason = "shared with the other targets")]
mod calls;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    calls::read_text(bytes);
});
