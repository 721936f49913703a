//! One scenario, in virtual machines of this process and on the robots' own image: it comes to the same.

#![allow(clippy::unwrap_used, reason = "a test may")]

use std::path::Path;

use bittybuzz_arena::run::{Program, Setup, Simulation, Summary};
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, Loader};
use bittybuzz_hil::{Core, table};
use bittybuzz_tests::bbz;

/// Where a robot is in the end, and which colour it shows.
type End = ([f64; 2], u8);

/// Runs the scenario with a backend for so many ticks at most, and shows each.
fn run_with(
    backend: &str,
    seed: u32,
    ticks: u64,
    mut look: impl FnMut(&mut Simulation<'_>),
) -> Summary {
    let path = bbz::root().join("tests/scenarios/backends.toml");
    let set = [
        format!("robots.0.backend={backend}"),
        format!("robots.0.firmware={}", table::zooids().display()),
    ];
    let scenario = Scenario::open(&path, &set).unwrap_or_else(|errors| panic!("{errors:#?}"));
    let programs: Vec<Program> =
        scenario.groups.iter().map(|group| program(&group.script)).collect();
    let setup = Setup::new(&scenario, &programs).unwrap();
    let setup = setup.emulated_by(Core::Unicorn.program().to_owned());
    let casts = setup.casts();
    let mut simulation = Simulation::new(&setup, &casts, seed, 1).unwrap();
    while simulation.now() < ticks && !simulation.is_over() {
        simulation.tick().unwrap_or_else(|error| panic!("{error}"));
        look(&mut simulation);
    }
    simulation.summary()
}

fn program(script: &Path) -> Program {
    let options = Options {
        robot: Some(bittybuzz_robots::find("zooids").unwrap()),
        robots: bittybuzz_robots::all_shipped(),
        profile: None,
    };
    let text = std::fs::read_to_string(script).unwrap();
    let compiled = compile(script, text, &Loader::new(&DiskFiles), &options);
    let image = compiled.image.unwrap_or_else(|| panic!("{:#?}", compiled.diagnostics));
    Program { image, symbols: compiled.symbols }
}

/// Runs the scenario of both backends, and tells how it ends.
fn ends(backend: &str, seed: u32) -> (Vec<End>, Summary) {
    let mut ends = Vec::new();
    let summary = run_with(backend, seed, u64::MAX, |simulation| {
        if simulation.is_over() {
            let views =
                (0..simulation.robot_count()).map(|number| simulation.view(number).unwrap());
            ends =
                views.map(|view| ([view.pose.x, view.pose.y].map(f64::from), view.led)).collect();
        }
    });
    (ends, summary)
}

/// Distances in mm between the ends of the two backends, after so many seeds.
fn differences(seeds: u32) -> Vec<f64> {
    let mut differences = Vec::new();
    for seed in 1..=seeds {
        let ((vm, in_vm), (firmware, in_firmware)) = (ends("vm", seed), ends("firmware", seed));
        assert!(in_vm.is_success() && in_firmware.is_success(), "{in_firmware:#?}");
        assert_eq!(vm.len(), firmware.len());
        for ((one, colour), (other, other_colour)) in vm.into_iter().zip(firmware) {
            assert_eq!(colour, other_colour, "seed {seed}");
            differences.push((one[0] - other[0]).hypot(one[1] - other[1]));
        }
    }
    differences.sort_by(f64::total_cmp);
    differences
}

fn compare(seeds: u32) {
    let differences = differences(seeds);
    let median = differences[differences.len() / 2];
    println!(
        "{} ends: median {median:.2} mm, worst {:.2} mm",
        differences.len(),
        differences.last().unwrap()
    );
    assert!(median <= 5.0, "{differences:.2?}");
}

#[test]
fn both_backends_come_to_the_same_end() {
    compare(3);
}

/// The evidence.
#[test]
#[ignore = "takes a minute"]
fn both_backends_come_to_the_same_end_with_thirty_seeds() {
    compare(30);
}

/// Every place and colour on the way, bit for bit.
fn trace(seed: u32) -> Vec<[u32; 4]> {
    let mut trace = Vec::new();
    run_with("firmware", seed, 30, |simulation| {
        for number in 0..simulation.robot_count() {
            let view = simulation.view(number).unwrap();
            let pose = view.pose;
            let [x, y, heading] = [pose.x, pose.y, pose.heading].map(f32::to_bits);
            trace.push([x, y, heading, view.led.into()]);
        }
    });
    trace
}

#[test]
fn one_seed_gives_one_trace() {
    let runs: Vec<_> = std::thread::scope(|scope| {
        let threads = [7, 7, 8].map(|seed| scope.spawn(move || trace(seed)));
        threads.map(|thread| thread.join().unwrap()).into()
    });
    assert_eq!(runs[0], runs[1]);
    assert_ne!(runs[0], runs[2]);
}

#[test]
fn an_emulator_that_is_not_there_is_told_with_how_to_get_it() {
    let path = bbz::root().join("tests/scenarios/backends.toml");
    let firmware = format!("robots.0.firmware={}", table::zooids().display());
    let path = path.display().to_string();
    let outcome = bbz::run(
        &[
            "sim",
            &path,
            "--emulator",
            "no-such-emulator",
            "--set",
            "robots.0.backend=firmware",
            "--set",
            &firmware,
        ],
        &[],
    );
    assert_eq!(outcome.status, Some(2), "{outcome:?}");
    for part in ["no-such-emulator", "cargo build -p bittybuzz-emulate-stm32 --release"] {
        assert!(outcome.stderr.contains(part), "{outcome:?}");
    }
}
