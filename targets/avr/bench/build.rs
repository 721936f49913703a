//! Links through `bittybuzz_squeeze`.

fn main() {
    // The section .mmcu is only for simavr: no code refers to it, and it lies beyond all memory.
    println!("cargo::rustc-link-arg=-Wl,--undefined=_mmcu,--section-start=.mmcu=0x910000");
    // The complete program is larger than the flash of the chip; bench/harness/src/avr.rs runs it
    // on a chip with more flash.
    println!("cargo::rustc-link-arg=-Wl,--defsym=__TEXT_REGION_LENGTH__=0x20000");
    bittybuzz_squeeze::build_script(bittybuzz_squeeze::PATHS);
}
