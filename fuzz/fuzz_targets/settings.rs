//! Settings, as text and as a file, by libFuzzer.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| afterlight_fuzz::read("settings", bytes));
