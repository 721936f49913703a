//! Builds the script (`BBZ_SCRIPT`, else `hello.bzz`), the robot file's constants and the memory
//! layout.

use bittybuzz_board_build::{Start, board};

fn main() {
    if std::env::var_os("CARGO_FEATURE_DEFMT").is_some() {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    if let Err(error) = board("zooids", "hello.bzz", Start::AsInRobotFile) {
        eprintln!("error: {error}");
        std::process::exit(1);
    }
}
