//! Generates the number of slots from the robot file.

use std::path::PathBuf;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let robot = bittybuzz_robot_files::find("crazyflie").unwrap_or_else(|error| panic!("{error}"));
    let slots = robot.vm.slots as usize + robot.sizes().slots();
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    std::fs::write(out.join("slots.rs"), format!("{slots}"))
        .expect("the output folder is writable");
}
