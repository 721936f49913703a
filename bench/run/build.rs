//! Generates the sizes and functions of the machine under test from robots/bench.toml.

use std::path::PathBuf;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let robot = bittybuzz_robot_files::find("bench").unwrap_or_else(|error| panic!("{error}"));
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    std::fs::write(out.join("robot.rs"), bittybuzz_robot_spec::generate_rust(&robot))
        .expect("the output folder is writable");
}
