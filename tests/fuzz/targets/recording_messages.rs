//! The messages of recordings, in a file whose framing is valid.
#![no_main]

use fuzz::mcap_file;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| fuzz::recording::check(&mcap_file::with_messages(data)));
