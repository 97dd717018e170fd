#![no_main]

#[path = "../../tests/it/common/hostile.rs"]
mod hostile;

libfuzzer_sys::fuzz_target!(init: hostile::begin("obj"), |input: &[u8]| drop(hostile::obj(input)));
