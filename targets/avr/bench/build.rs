//! See `bittybuzz_squeeze`.

fn main() {
    // The section .mmcu is for simavr alone: nothing refers to it, and it lies beyond all memory.
    println!("cargo::rustc-link-arg=-Wl,--undefined=_mmcu,--section-start=.mmcu=0x910000");
    // Everything together is more than the chip has; bench/harness/src/avr.rs runs it on its larger sister.
    println!("cargo::rustc-link-arg=-Wl,--defsym=__TEXT_REGION_LENGTH__=0x20000");
    bittybuzz_squeeze::build_script(bittybuzz_squeeze::PATHS);
}
