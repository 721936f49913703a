//! Links through `bittybuzz_squeeze`.

fn main() {
    // The program is only measured, never started, and the complete program is larger than the
    // flash of the chip.
    println!("cargo::rustc-link-arg=-Wl,--defsym=__TEXT_REGION_LENGTH__=0x20000");
    bittybuzz_squeeze::build_script(bittybuzz_squeeze::PATHS);
}
