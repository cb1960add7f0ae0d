//! Skies in Radiance HDR, by libFuzzer.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| afterlight_fuzz::read("sky_hdr", bytes));
