#![no_main]

#[path = "../../tests/it/common/hostile.rs"]
mod hostile;

libfuzzer_sys::fuzz_target!(init: hostile::begin("checkpoint"), |input: &[u8]| drop(hostile::checkpoint(input)));
