//! How much a script can hold on each robot: at least twice what the C BittyBuzz holds in the same memory on robots
//! with little memory, and more on a Crazyflie, which has 128 kB and takes eight bytes for a slot, to be fast.
//!
//! Each capacity is measured alone, on this computer with the slots of the robot's file: a slot holds the same
//! everywhere. That the machine with so many slots has the bytes that the file says is checked where it is built for the
//! chip.

use std::fmt::Write;

use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_robot_spec::NumberProfile as Numbers;
use bittybuzz_tests::compiler;
use bittybuzz_tests::machine::{self, End, Settings};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Sizes, Torture, Vm};

/// More than any robot has.
const SLOTS: usize = 2000;

/// What the C BittyBuzz holds with its shipped configuration, measured (commit d093626).
struct Reference {
    robot: &'static str,
    /// The virtual machine object.
    memory: u32,
    /// The received messages that can wait.
    messages: u32,
    entries: usize,
    depth: usize,
    globals: usize,
    /// A script holds at least this many times as much.
    times: usize,
}

const REFERENCES: [Reference; 3] = [
    // Its object has 1682 bytes.
    Reference {
        robot: "kilobot",
        memory: 1676,
        messages: 8,
        entries: 54,
        depth: 14,
        globals: 55,
        times: 2,
    },
    Reference {
        robot: "zooids",
        memory: 2664,
        messages: 15,
        entries: 90,
        depth: 26,
        globals: 91,
        times: 2,
    },
    Reference {
        robot: "crazyflie",
        memory: 4116,
        messages: 10,
        entries: 190,
        depth: 29,
        globals: 192,
        times: 1,
    },
];

/// A table of `count` entries.
fn entries(count: usize) -> String {
    format!(
        "t = {{}}
        function init() {{ for(i = 0, i < {count}, i = i + 1) t[i] = i * 2 }}
        function step() {{
          assert(size(t) == {count})
          for(i = 0, i < {count}, i = i + 1) assert(t[i] == i * 2)
        }}"
    )
}

/// A recursion of that depth, from `step()`.
fn depth(count: usize) -> String {
    format!(
        "function d(n) {{ if(n == 0) return 0  return 1 + d(n - 1) }}
        function step() {{ assert(d({count}) == {count}) }}"
    )
}

/// So many global integers more than an empty script.
fn globals(count: usize) -> String {
    let mut script = String::new();
    for number in 0..count {
        let _ = writeln!(script, "g{number} = {number}");
    }
    script.push_str("function step() {\n");
    for number in 0..count {
        // Of the first one, which every step changes too.
        let _ = writeln!(script, "g{number} = g{number} + 1  assert(g{number} - g0 == {number})");
    }
    script.push_str("}\n");
    script
}

fn runs<P: Profile>(script: String, slots: usize) -> bool {
    let compiled = compiler::compile(script, P::FULL, &MemoryFiles::default());
    let Some(image) = compiled.image else { panic!("{:#?}", compiled.diagnostics) };
    let settings =
        Settings { slots, budget: 1000, torture: Torture::default(), audit: true, most: 1_000_000 };
    let mut vm: Box<Vm<P, &[u8], SLOTS>> = Box::new(Vm::new());
    let trace = machine::run(&mut vm, &image, &settings);
    trace.end == End::Complete
}

/// The most for which the script runs. What holds more needs more memory.
fn most<P: Profile>(script: fn(usize) -> String, slots: usize) -> usize {
    let (mut fits, mut too_much) = (0, SLOTS);
    assert!(runs::<P>(script(fits), slots));
    while fits + 1 < too_much {
        let middle = usize::midpoint(fits, too_much);
        if runs::<P>(script(middle), slots) { fits = middle } else { too_much = middle }
    }
    fits
}

#[test]
fn more_data_than_in_the_reference_fits_the_same_memory() {
    for reference in REFERENCES {
        let mut robot = bittybuzz_robot_files::find(reference.robot).expect("it ships");
        // A Crazyflie has more memory than the reference uses, for more waiting messages and for scripts.
        let queues = robot.queue_memory();
        robot.vm.in_queue = reference.messages;
        robot.vm.memory -= queues - robot.queue_memory();
        // The reference sends no values that need fragments, so it has no room for them.
        let fragments = robot.long_memory();
        // It does not store the place of the sender of a waiting message either; a Kilobot measures no places.
        let sightings = match robot.vm.bearings {
            true => robot.vm.in_queue * robot.sighting_bytes(),
            false => 0,
        };
        // Nor room for more than four entries of a stigmergy.
        let sizes = robot.sizes();
        let four = Sizes { entries: 4, ..sizes };
        let entries_beyond = (sizes.slots() - four.slots()) as u32 * robot.slot_bytes();
        let memory = robot.vm.memory - fragments - sightings - entries_beyond;
        let beyond = memory.saturating_sub(reference.memory).div_ceil(robot.slot_bytes());
        let slots = (robot.vm.slots - beyond) as usize;
        let most = match robot.profile {
            Numbers::Tiny => most::<Tiny>,
            Numbers::Full => most::<Full>,
        };
        for (what, script, before) in [
            ("table entries", entries as fn(usize) -> String, reference.entries),
            ("calls deep", depth, reference.depth),
            ("globals", globals, reference.globals),
        ] {
            let now = most(script, slots);
            println!("{}, {slots} slots: {now} {what}, reference {before}", robot.name);
            let enough = now > before && now >= reference.times * before;
            assert!(enough, "{}: {now} {what} in {slots} slots", robot.name);
        }
    }
}
