#![no_main]

#[path = "../../tests/it/common/hostile.rs"]
mod hostile;

libfuzzer_sys::fuzz_target!(init: hostile::begin("tm33"), |input: &[u8]| drop(hostile::tm33(input)));
