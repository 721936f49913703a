//! Generates Rust source of a robot's configuration, for the build script of its firmware.

use crate::{Layout, OnFault, Robot, Setting};
use std::fmt::Write;

/// Returns Rust source with the sizes of the robot's virtual machine and the numbers of its
/// functions.
///
/// The build script writes it to `OUT_DIR` and the firmware includes it in a module:
/// ```text
/// mod robot { include!(concat!(env!("OUT_DIR"), "/robot.rs")); }
/// match hash { robot::function::LED => ..., robot::function::SET_MOTOR => ..., _ => ... }
/// ```
/// Sizes are `usize` constants named as in the robot file (`SLOTS`, ...), together with `PROFILE`
/// and `NAME`. If the robot file has a `[layout]`, its regions are `FLASH_ADDRESS`, `FLASH_SIZE`,
/// `SCRIPT_ADDRESS` and so on, named as in [`Layout::memory_x`]. The module `function` has one
/// `u16` constant per function, and `setting` has one `usize` per setting. `FUNCTIONS` lists the
/// numbers of all functions.
pub fn generate_rust(robot: &Robot) -> String {
    let mut out = String::new();
    write(robot, &mut out).expect("writing to a string cannot fail");
    out
}

fn write(robot: &Robot, out: &mut String) -> std::fmt::Result {
    writeln!(out, "// Generated from the robot file of {}.", robot.name)?;
    writeln!(out, "/// Name of the robot.\npub const NAME: &str = {:?};", robot.name)?;
    writeln!(out, "/// Number profile.\npub const PROFILE: &str = {:?};", robot.profile.name())?;
    let vm = robot.vm;
    for (name, value, help) in [
        ("TICK_HZ", robot.tick_hz, "Steps per second."),
        ("MESSAGE_BYTES", robot.message_bytes, "Bytes of a swarm message in one frame."),
        ("MEMORY", vm.memory, "Bytes that the machine object may take."),
        (
            "QUEUE_MEMORY",
            robot.queue_memory(),
            "Bytes of them for messages that wait, which are not in the machine.",
        ),
        ("SLOTS", vm.slots, "Slots of the arena."),
        ("NEIGHBORS", vm.neighbors, "Neighbors remembered at a time."),
        ("BEARINGS", u32::from(vm.bearings), "1 if it is known in which direction they are."),
        ("IN_QUEUE", vm.in_queue, "Messages that can wait to be read."),
        ("OUT_QUEUE", vm.out_queue, "Messages that can wait to be sent."),
        ("IN_LONG", vm.in_long, "Long messages that can be received at once."),
        ("OUT_LONG", vm.out_long, "Long messages that can wait to be sent."),
        ("STIGMERGY_ENTRIES", vm.stigmergy_entries, "Entries of all stigmergies together."),
        ("SWARMS", vm.swarms, "Swarms known at a time."),
        ("FRAME_BYTES", robot.frame_bytes(), "Bytes of a frame: its type and a message."),
        ("BEACON_STEPS", vm.beacon_steps, "Steps of silence before a beacon."),
        ("FORGET_STEPS", vm.forget_steps, "Steps after which a neighbor is forgotten."),
        ("ADVERTISE_STEPS", vm.advertise_steps, "Steps between two advertisements of entries."),
    ] {
        writeln!(out, "/// {help}\npub const {name}: usize = {value};")?;
    }
    writeln!(
        out,
        "/// The machine has floating-point functions.\npub const MATHS: bool = {};",
        vm.maths
    )?;
    writeln!(
        out,
        "/// Every fault stops the script for good.\npub const ON_FAULT_STOPS: bool = {};",
        robot.on_fault == OnFault::Stop
    )?;
    for (name, region) in robot.layout.iter().flat_map(Layout::regions) {
        let (address, size) = (region.address, region.size);
        writeln!(
            out,
            "/// First address of the region.\npub const {name}_ADDRESS: usize = {address:#010x};"
        )?;
        writeln!(out, "/// Bytes of the region.\npub const {name}_SIZE: usize = {size:#x};")?;
    }
    writeln!(out, "/// Numbers of the functions: hashes of their names.\npub mod function {{")?;
    for function in &robot.functions {
        writeln!(out, "    /// `{}`: {}", function.name, function.help)?;
        let (name, hash) = (constant(&function.name), function.hash());
        writeln!(
            out,
            "    pub const {name}: u16 = {hash:#06x}; // name_hash({:?})",
            function.name
        )?;
    }
    writeln!(out, "}}")?;
    writeln!(out, "/// Places of the settings in their region.\npub mod setting {{")?;
    for (place, Setting { name, help, .. }) in robot.settings.iter().enumerate() {
        let name = constant(name);
        writeln!(out, "    /// {help}\n    pub const {name}: usize = {place};")?;
    }
    writeln!(out, "}}")?;
    let numbers: Vec<String> = robot
        .functions
        .iter()
        .map(|function| format!("function::{}", constant(&function.name)))
        .collect();
    let numbers = numbers.join(", ");
    writeln!(out, "/// The number of every function.\npub const FUNCTIONS: &[u16] = &[{numbers}];")
}

/// Returns the name of the Rust constant for a function: `goTo` is `GO_TO`.
pub fn constant(name: &str) -> String {
    let mut constant = String::new();
    let mut previous_is_lower = false;
    for c in name.chars() {
        // Names in tables, such as `debug.print`.
        let c = if c.is_ascii_alphanumeric() { c } else { '_' };
        if c.is_ascii_uppercase() && previous_is_lower {
            constant.push('_');
        }
        previous_is_lower = c.is_ascii_lowercase() || c.is_ascii_digit();
        constant.push(c.to_ascii_uppercase());
    }
    constant
}

#[cfg(test)]
mod tests {
    use super::constant;

    #[test]
    fn constants() {
        for (name, expected) in [
            ("led", "LED"),
            ("set_motor", "SET_MOTOR"),
            ("goTo", "GO_TO"),
            ("goto", "GOTO"),
            ("greyCode", "GREY_CODE"),
            ("getXY2Z", "GET_XY2_Z"),
            ("_x", "_X"),
            ("debug.setColor", "DEBUG_SET_COLOR"),
        ] {
            assert_eq!(constant(name), expected);
        }
    }
}
