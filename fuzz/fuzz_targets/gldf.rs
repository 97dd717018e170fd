#![no_main]

#[path = "../../tests/it/common/hostile.rs"]
mod hostile;

libfuzzer_sys::fuzz_target!(init: hostile::begin("gldf"), |input: &[u8]| drop(hostile::gldf(input)));
