//! The behaviors of `examples/kilobot`, each on its own image in simavr: what their scenarios expect, memory, and time.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use bittybuzz_arena::run::{Program, Setup, Simulation};
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_comms::infrared::message_of;
use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_emulation::ElfSymbol;
use bittybuzz_hil::kilobots::behavior;
use bittybuzz_hil::{Command, Core, Kilobots};
use bittybuzz_robot_spec::Robot;
use bittybuzz_tests::bbz;
use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::builtin::string;
use bittybuzz_vm_core::message::{Message, ScriptIdentity, TINY_FRAME};
use bittybuzz_vm_core::number::Tiny;

/// The examples for Kilobots, and a script that needs long messages.
const BEHAVIORS: [&str; 8] =
    ["gradient", "broadcast", "distance", "random_walk", "foreach", "stigmergy", "swarm", "tables"];

/// The RAM of the chip: 2 kB from here on, in addresses of the emulator.
const RAM: u32 = 0x80_0100;
const RAM_END: u32 = 0x80_0900;

fn file(name: &str, extension: &str) -> PathBuf {
    bbz::root().join("examples/kilobot").join(name).with_extension(extension)
}

fn compiled(script: &Path, robot: &Robot) -> Compiled {
    let options = Options {
        robot: Some(robot.clone()),
        robots: bittybuzz_robot_files::all_shipped(),
        ..Options::default()
    };
    let text = std::fs::read_to_string(script).unwrap();
    compile(script, text, &IncludeLoader::new(&DiskFiles), &options)
}

/// Runs the scenario of a behavior, and shows each tick; until there is nothing more to see.
fn play(name: &str, backend: &str, seed: u32, mut look: impl FnMut(&Simulation) -> bool) -> bool {
    let path = file(name, "toml");
    let groups =
        0..Scenario::open(&path, &[], &bittybuzz_robot_models::all()).unwrap().groups.len();
    let set = groups.flat_map(|group| {
        let firmware = behavior(name);
        [
            format!("robots.{group}.backend={backend}"),
            format!("robots.{group}.firmware={}", firmware.display()),
        ]
    });
    let scenario =
        Scenario::open(&path, &set.collect::<Vec<_>>(), &bittybuzz_robot_models::all()).unwrap();
    let group = &scenario.groups[0];
    let Compiled { image, symbols, sources, .. } =
        compiled(group.script.as_ref().unwrap(), &group.robot);
    let program = Program::new(image.unwrap(), symbols, Arc::new(sources));
    let programs = vec![program; scenario.groups.len()];
    let setup = Setup::new(scenario.clone(), programs).unwrap();
    let setup = setup.emulated_by("kilobot", Core::Avr.program().to_owned());
    let mut simulation = Simulation::new(Arc::new(setup), seed, 2).unwrap();
    while !simulation.is_over() {
        simulation.tick().unwrap_or_else(|error| panic!("{error}"));
        if !look(&simulation) {
            return false;
        }
    }
    simulation.summary().is_success()
}

fn comes_true(name: &str) {
    assert!(play(name, "firmware", 1, |_| true), "{name}");
}

#[test]
fn broadcast_comes_true() {
    comes_true("broadcast");
}

#[test]
fn distance_comes_true() {
    comes_true("distance");
}

#[test]
fn swarm_comes_true() {
    comes_true("swarm");
}

/// They take minutes, as the medians below: `cargo test --locked -p bittybuzz-hil --test hil behaviors:: -- --ignored`.
#[test]
#[ignore = "minutes"]
fn the_longer_scenarios_meet_their_expectations() {
    for name in ["gradient", "random_walk", "foreach", "stigmergy"] {
        comes_true(name);
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) / 2.0 }
}

/// Ticks until everybody knows a distance.
fn gradient(backend: &str, seed: u32) -> f64 {
    let mut ticks = None;
    play("gradient", backend, seed, |simulation| {
        let mut leds = (0..12).map(|number| simulation.view(number).unwrap().led);
        ticks = leds.all(|led| led != 0).then(|| simulation.now() as f64);
        ticks.is_none()
    });
    ticks.unwrap()
}

/// Mean distance from the middle after so many ticks, in mm.
fn dispersion(backend: &str, seed: u32, ticks: u64) -> f64 {
    let mut mean = 0.0;
    play("random_walk", backend, seed, |simulation| {
        let poses = (0..16).map(|number| simulation.view(number).unwrap().pose);
        mean = poses.map(|pose| f64::from(pose.x.hypot(pose.y))).sum::<f64>() / 16.0;
        simulation.now() < ticks
    });
    mean
}

/// Whether image and virtual machine have medians within 10 % of each other; those of the latter are of 60 seeds.
fn compare(seeds: u32, of: impl Fn(&str, u32) -> f64) {
    let of = |backend, seeds| median((1..=seeds).map(|seed| of(backend, seed)).collect());
    let (vm, firmware) = (of("vm", 60), of("firmware", seeds));
    println!("virtual machines {vm:.1}, images {firmware:.1} of {seeds} seeds");
    assert!((firmware / vm - 1.0).abs() <= 0.1, "{vm} {firmware}");
}

#[test]
fn dispersion_is_that_of_virtual_machines() {
    compare(2, |backend, seed| dispersion(backend, seed, 100));
}

#[test]
#[ignore = "minutes"]
fn the_gradient_takes_as_long_as_in_virtual_machines() {
    compare(20, gradient);
}

#[test]
#[ignore = "minutes"]
fn dispersion_after_a_minute_is_that_of_virtual_machines() {
    compare(5, |backend, seed| dispersion(backend, seed, 600));
}

/// Returns the first address of RAM that no variable has.
fn end_of_variables(program: &Path) -> u32 {
    address(program, |name| name == "__bss_end")
}

fn address(program: &Path, is_wanted: impl Fn(&str) -> bool) -> u32 {
    ElfSymbol::find(&std::fs::read(program).unwrap(), is_wanted).unwrap().address
}

/// Eight robots that hear each other; what the stack has not touched after that time is still painted.
#[test]
fn variables_and_stack_leave_memory() {
    const PAINT: u8 = 0xa5;
    for name in BEHAVIORS {
        let program = behavior(name);
        let end = end_of_variables(&program);
        let variables = end - RAM;
        let mut robots = Kilobots::with_program(&program, 8);
        for robot in 0..8 {
            let (x_mm, y_mm) = (35.0 * (robot % 3) as f64, 35.0 * (robot / 3) as f64);
            let here = Command::Place {
                x_mm,
                y_mm,
                heading_degrees: 0.0,
                vx_mm_s: 0.0,
                vy_mm_s: 0.0,
                turn_degrees_s: 0.0,
            };
            robots.execute_on(robot, &here);
            let bytes = vec![PAINT; (RAM_END - end) as usize];
            robots.execute_on(robot, &Command::Write { address: end, bytes });
        }
        robots.start();
        robots.run_ms(6_000);
        let used = |robot: usize| {
            let left = robots.memory(robot, end, RAM_END - end);
            RAM_END - RAM - left.iter().take_while(|byte| **byte == PAINT).count() as u32
        };
        let most = (0..8).map(used).max().unwrap();
        println!("{name}: {variables} bytes of variables, with the stack {most}");
        assert!(variables <= 1800 && most <= 1984, "{name}: {variables} {most}");
    }
}

/// The second of two robots hears eight neighbors between two steps: how long a step takes without messages, and with these, with
/// everything that happens meanwhile. Neighbor number n says `value(n)`.
fn step_times(mut robots: Kilobots, topic: &str, value: impl Fn(i32) -> i32) -> [Duration; 2] {
    let symbols = Symbols::from_json(&robots.symbols()).unwrap();
    let strings = string::COUNT + symbols.strings.len() as u16;
    let script = ScriptIdentity { hash: symbols.script_hash, strings };
    let topic = (0..strings).find(|n| symbols.string(*n) == Some(topic)).unwrap();
    let message = |number: u16| {
        let value = Value::<Tiny>::int(value(number.into()));
        let mut frame = [0; TINY_FRAME];
        let said = Message::Broadcast { robot: 100 + number, topic, value };
        let length = said.encode(script, &mut frame).unwrap();
        message_of(&frame[..length]).unwrap().to_vec()
    };
    robots.start();
    let vm = address(&behavior("gradient"), |name| name.ends_with("main2VM"));
    // Behind four registers of the machine and its random numbers (vm-core/src/machine/mod.rs).
    const STATE: u32 = 16;
    const RUNNING: u8 = 2;
    let until = |robots: &mut Kilobots, runs: bool| {
        for _ in 0..4000 {
            if (robots.memory(1, vm + STATE, 1) == [RUNNING]) == runs {
                return;
            }
            robots.run_for(Duration::from_micros(50));
        }
        panic!("no steps");
    };
    let [mut without, mut with] = [Duration::ZERO; 2];
    for round in 0..12 {
        // Up to the end of a step.
        until(&mut robots, true);
        until(&mut robots, false);
        let sent = robots.sent(1).len();
        // The first rounds are without messages.
        if round >= 4 {
            for number in 0..8 {
                let at = robots.now();
                robots.execute_on(1, &Command::Radio { at, payload: message(number) });
                robots.run_ms(8);
            }
        }
        until(&mut robots, true);
        let begin = robots.now();
        until(&mut robots, false);
        let took = robots.now() - begin;
        if round < 4 {
            without = without.max(took);
        } else if robots.sent(1).len() == sent {
            // While it sends it hears nothing.
            with = with.max(took);
        }
    }
    println!("a step without messages takes {without:?}, with eight {with:?}");
    assert!(with > without + Duration::from_millis(1), "they were heard: {without:?} {with:?}");
    [without, with]
}

/// The gradient of the benchmarks, which counts hops: 48,000 cycles at most.
#[test]
fn a_step_of_the_benchmarks_gradient_with_eight_messages() {
    let text = std::fs::read_to_string(bbz::root().join("bench/scripts/gradient.bzz")).unwrap();
    let robots = Kilobots::in_image(&text, &behavior("gradient"), 2);
    let [_, with] = step_times(robots, "hop", |number| number);
    assert!(with <= Duration::from_millis(6), "{with:?}");
}

/// That of the example adds distances, and makes a table of each neighbor that it asks for.
#[test]
fn a_step_of_the_gradient_of_distances_with_eight_messages() {
    let text = std::fs::read_to_string(file("gradient", "bzz")).unwrap();
    let robots = Kilobots::in_image(&text, &behavior("gradient"), 2);
    let [_, with] = step_times(robots, "distance", |number| 1000 - 10 * number);
    assert!(with <= Duration::from_millis(15), "{with:?}");
}
