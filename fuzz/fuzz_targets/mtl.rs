#![no_main]

#[path = "../../tests/it/common/hostile.rs"]
mod hostile;

libfuzzer_sys::fuzz_target!(init: hostile::begin("mtl"), |input: &[u8]| drop(hostile::mtl(input)));
