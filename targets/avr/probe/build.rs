//! See `bittybuzz_squeeze`.

fn main() {
    // The program is only measured, and everything together is more than the chip has.
    println!("cargo::rustc-link-arg=-Wl,--defsym=__TEXT_REGION_LENGTH__=0x20000");
    bittybuzz_squeeze::build_script(bittybuzz_squeeze::PATHS);
}
