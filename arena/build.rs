//! The sizes of the robots' machines and queues as constants, from their files.

use std::fmt::Write;
use std::path::Path;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    let mut text = String::new();
    for robot in bittybuzz_robot_files::all_shipped() {
        let vm = &robot.vm;
        for (name, value) in [
            ("SLOTS", vm.slots as usize + robot.sizes().slots()),
            ("IN_QUEUE", vm.in_queue as usize),
            ("OUT_QUEUE", vm.out_queue as usize),
        ] {
            let robot = robot.name.to_uppercase();
            let _ = writeln!(text, "pub const {robot}_{name}: usize = {value};");
        }
    }
    let out = env::var_os("OUT_DIR").ok_or_else(|| io::Error::other("cargo sets OUT_DIR"))?;
    fs::write(Path::new(&out).join("sizes.rs"), text)
}
