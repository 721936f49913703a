#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    bittybuzz_fuzz_bodies::social(data);
});
