//! The sizes of the robots' machines.

use std::fmt::Write;
use std::path::PathBuf;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let mut text = String::new();
    for name in ["kilobot", "zooids", "crazyflie"] {
        let robot = bittybuzz_robot_files::find(name).unwrap_or_else(|error| panic!("{error}"));
        let (constant, slots) = (name.to_uppercase(), robot.vm.slots);
        let _ = writeln!(text, "/// Slots of {name}.\npub const {constant}: usize = {slots};");
    }
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    std::fs::write(out.join("slots.rs"), text).expect("the output folder is writable");
}
