//! The fuzzer's bytes read as a scene; a small one that can be read is built and stepped.
#![no_main]

#[path = "../../tests/capi_support/calls/mod.rs"]
#[allow(dead_code, reason = "shared with the other targets")]
mod calls;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    calls::read_scene(bytes);
});
