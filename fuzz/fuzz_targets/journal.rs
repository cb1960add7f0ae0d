//! A report's journal, and the report made of it, by libFuzzer.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| afterlight_fuzz::read("journal", bytes));
