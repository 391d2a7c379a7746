//! Recordings: the bytes of a file.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::recording::check(data));
