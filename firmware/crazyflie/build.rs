//! Builds the script (`BBZ_SCRIPT`, else `hello.bzz`), the robot file's constants and the memory
//! layout.

use bittybuzz_board_build::{Start, board};

fn main() {
    let start = if std::env::var_os("CARGO_FEATURE_NO_BOOTLOADER").is_some() {
        println!(
            "cargo:warning=no-bootloader: this image takes the place of Bitcraze's bootloader. Without a debug probe \
             nothing else can be loaded afterwards"
        );
        Start::BeginningOfFlash(0x0800_0000)
    } else {
        Start::AsInRobotFile
    };
    if let Err(error) = board("crazyflie", "hello.bzz", start) {
        eprintln!("error: {error}");
        std::process::exit(1);
    }
}
