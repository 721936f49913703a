//! Generates sizes and functions of the robot under test from robots/bench.toml, and the slots of the robots' machines.

use std::fmt::Write;
use std::path::PathBuf;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let find = |name| bittybuzz_robot_files::find(name).unwrap_or_else(|error| panic!("{error}"));
    let mut slots = String::new();
    for name in ["kilobot", "zooids", "crazyflie"] {
        let robot = find(name);
        let count = robot.vm.slots as usize + robot.sizes().slots();
        writeln!(
            slots,
            "/// Those of {name}.\npub const {}: usize = {count};",
            name.to_uppercase()
        )
        .expect("a string takes everything");
    }
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    for (file, text) in
        [("robot.rs", bittybuzz_robot_spec::generate_rust(&find("bench"))), ("slots.rs", slots)]
    {
        std::fs::write(out.join(file), text).expect("the output folder is writable");
    }
}
