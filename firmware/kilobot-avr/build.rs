//! Builds the script (`BBZ_SCRIPT`, else `hello.bzz`) and the robot file's constants.
//! `bittybuzz_squeeze` describes the rest.

use bittybuzz_board_build::behind_program;

fn main() {
    // A program that is too large for the chip is linked nevertheless: `cargo xtask build` tells its size and those of its parts.
    println!("cargo::rustc-link-arg=-Wl,--defsym=__TEXT_REGION_LENGTH__=0x20000");
    // The build saves flash at the cost of time: a step with eight messages takes 4 ms of 100.
    bittybuzz_squeeze::build_script(bittybuzz_squeeze::LOOP);
    if let Err(error) = behind_program("kilobot", "hello.bzz") {
        eprintln!("error: {error}");
        std::process::exit(1);
    }
}
