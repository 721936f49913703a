//! The sizes of the robots' machines.

use std::fmt::Write;
use std::path::PathBuf;

/// A machine with more slots stops its collections at the end of a slice, which one on a computer does not.
const SLOTS_MAX: u32 = 2048;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let mut text = String::new();
    for name in ["kilobot", "zooids", "crazyflie"] {
        let robot = bittybuzz_robot_files::find(name).unwrap_or_else(|error| panic!("{error}"));
        let (constant, slots) = (name.to_uppercase(), robot.vm.slots.min(SLOTS_MAX));
        let _ = writeln!(
            text,
            "/// Slots of {name}, at most {SLOTS_MAX}.\npub const {constant}: usize = {slots};"
        );
    }
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    std::fs::write(out.join("slots.rs"), text).expect("the output folder is writable");
}
