#![no_main]

#[path = "../../tests/it/common/hostile.rs"]
mod hostile;

libfuzzer_sys::fuzz_target!(init: hostile::begin("scene"), |input: &[u8]| drop(hostile::scene(input)));
