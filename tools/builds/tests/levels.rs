//! The flight controller and the virtual machine are compiled for the robots at the levels at which their costs
//! are counted (`cargo xtask bench flight`, `cargo xtask bench thumbv7em-full`).

use std::fs;

use bittybuzz_builds::shell::root;
use toml::{Table, Value};

const PACKAGES: [&str; 3] = ["bittybuzz-flight", "glam", "libm"];

fn release(workspace: &str) -> Table {
    let text = fs::read_to_string(root().join(workspace).join("Cargo.toml")).unwrap();
    let manifest: Table = text.parse().unwrap();
    manifest["profile"]["release"].as_table().unwrap().clone()
}

/// The machine is generic. The compiler makes its code in the crate of the program.
#[test]
fn the_machine_of_the_firmware_has_the_level_of_the_benchmark() {
    let counted = release("targets/cortex-m");
    for robot in ["firmware/crazyflie", "firmware/zooids"] {
        let flashed = release(robot);
        assert!(flashed.get("package").and_then(|all| all.get("bittybuzz-vm-core")).is_none());
        for package in ["bench-cortex-m", "bittybuzz-vm-core"] {
            let level = &counted["package"][package]["opt-level"];
            assert_eq!(level, &flashed["opt-level"], "{robot} and {package}");
        }
    }
}

#[test]
fn the_firmware_has_the_levels_of_the_benchmark() {
    let (counted, flown) = (release("targets/cortex-m"), release("firmware/crazyflie"));
    for package in PACKAGES {
        let level = |release: &Table| release["package"][package]["opt-level"].clone();
        assert_eq!(level(&counted), level(&flown), "{package}");
        assert_eq!(level(&flown), Value::from("s"), "{package}");
    }
    for key in ["lto", "codegen-units", "panic"] {
        assert_eq!(counted[key], flown[key], "{key}");
    }
}
