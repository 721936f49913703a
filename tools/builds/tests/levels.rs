//! The flight controller is compiled for the robot at the levels at which its cost is counted
//! (`cargo xtask bench flight`).

use std::fs;

use bittybuzz_builds::shell::root;
use toml::{Table, Value};

const PACKAGES: [&str; 3] = ["bittybuzz-flight", "glam", "libm"];

fn release(workspace: &str) -> Table {
    let text = fs::read_to_string(root().join(workspace).join("Cargo.toml")).unwrap();
    let manifest: Table = text.parse().unwrap();
    manifest["profile"]["release"].as_table().unwrap().clone()
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
