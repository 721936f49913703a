//! Builds the script (`BBZ_SCRIPT`, else `hello.bzz`) and the robot file's constants.
//! `bittybuzz_squeeze` describes the rest.

use bittybuzz_board_build::behind_program;

fn main() {
    // The build saves flash at the cost of time: a step with eight messages takes 4 ms of 100.
    bittybuzz_squeeze::build_script(bittybuzz_squeeze::LOOP);
    if let Err(error) = behind_program("kilobot", "hello.bzz") {
        eprintln!("error: {error}");
        std::process::exit(1);
    }
}
