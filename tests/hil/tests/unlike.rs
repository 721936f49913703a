//! Unlike robots in one world, each kind with its own image, and the bridge between them.

#![allow(clippy::unwrap_used, reason = "a test may")]

use std::path::Path;

use bittybuzz_arena::run::{Program, Setup, Simulation, Summary};
use bittybuzz_arena::scenario::{Body, Cause, Scenario, ScenarioError};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, Loader};
use bittybuzz_hil::{Core, ScriptFile, crazyflie_tiny, table};
use bittybuzz_tests::bbz;

/// Three Zooids and two Crazyflies, of which robot 31 has measured most.
fn scenario(script: &Path, bridge: &str, rest: &str) -> Result<Scenario, Vec<ScenarioError>> {
    let text = format!(
        "[world]\nsize = [800, 500]\nduration = 6\n{bridge}\n\
         [[robots]]\nrobot = \"zooids\"\nscript = '{script}'\nbackend = \"firmware\"\nfirmware = '{zooids}'\n\
         count = 3\nfirst_id = 16\nplacement = \"line\"\nat = [0, -150]\nspacing = 80\n\
         [[robots]]\nrobot = \"crazyflie\"\nprofile = \"tiny\"\nscript = '{script}'\nbackend = \"firmware\"\n\
         firmware = '{crazyflie}'\ncount = 2\nfirst_id = 30\nplacement = \"line\"\nat = [0, 150]\nspacing = 200\n{rest}",
        script = script.display(),
        zooids = table::zooids().display(),
        crazyflie = crazyflie_tiny().display(),
    );
    Scenario::parse(&text, "test.toml", Path::new(""), &[])
}

fn programs(scenario: &Scenario) -> Vec<Program> {
    let compiled = |group: &bittybuzz_arena::scenario::Group| {
        let text = std::fs::read_to_string(&group.script).unwrap();
        let loader = Loader { folders: vec![bbz::root().join("lib")], ..Loader::new(&DiskFiles) };
        let robots = bittybuzz_robots::all_shipped();
        let options = Options { profile: None, robot: Some(group.robot.clone()), robots };
        let compiled = compile(&group.script, text, &loader, &options);
        Program { image: compiled.image.unwrap(), symbols: compiled.symbols }
    };
    scenario.groups.iter().map(compiled).collect()
}

/// Runs to the end; the robots' colours then.
fn leds(scenario: &Scenario) -> (Vec<u8>, Summary) {
    let programs = programs(scenario);
    let setup = Setup::new(scenario, &programs).unwrap();
    let setup = setup
        .emulated_by(Body::Zooid, Core::Own.program().to_owned())
        .emulated_by(Body::Crazyflie, Core::Unicorn.program().to_owned());
    let casts = setup.casts();
    let mut simulation = Simulation::new(&setup, &casts, 1, 1).unwrap();
    while !simulation.is_over() {
        simulation.tick().unwrap_or_else(|error| panic!("{error}"));
    }
    let leds = (0..simulation.robot_count()).map(|number| simulation.view(number).unwrap().led);
    (leds.collect(), simulation.summary())
}

/// The same numbers, the same hash, the same messages: what one kind writes the other one reads, both ways.
#[test]
fn zooids_and_crazyflies_agree_over_a_bridge() {
    let script = bbz::root().join("examples/swarm/consensus.bzz");
    // 100 of robot 30, a Crazyflie; of the Zooids robot 16 has measured 87.
    let (bridged, summary) = leds(&scenario(&script, "[bridge]", "").unwrap());
    assert_eq!(bridged, [100 % 8; 5]);
    assert_eq!(summary.unusable.counts().iter().map(|(_, count)| count).sum::<u64>(), 0);
    // The greatest value in the other direction: least, with the order turned around.
    let text = std::fs::read_to_string(&script).unwrap();
    let turned = text.replace("(id * 37) % 101", "100 - (id * 37) % 101");
    assert_ne!(text, turned);
    let turned = ScriptFile::new("unlike", &turned);
    // 77 of robot 17, a Zooid; 0 and 64 of the Crazyflies, 13 and 40 of the others.
    let (bridged, _) = leds(&scenario(Path::new(turned.path()), "[bridge]", "").unwrap());
    assert_eq!(bridged, [77 % 8; 5]);
}

/// Without a bridge each kind stays among itself.
#[test]
fn unlike_media_do_not_mix() {
    let script = bbz::root().join("examples/swarm/consensus.bzz");
    let (alone, _) = leds(&scenario(&script, "", "").unwrap());
    assert_eq!(alone, [87 % 8, 87 % 8, 87 % 8, 100 % 8, 100 % 8]);
}

#[test]
fn a_bridge_reaches_only_robots_with_firmware() {
    let script = bbz::root().join("examples/swarm/consensus.bzz");
    let vm = format!(
        "[[robots]]\nrobot = \"kilobot\"\nscript = '{}'\ncount = 2\nfirmware = ''\n",
        script.display()
    );
    let errors = scenario(&script, "[bridge]\nfirmware = '/nowhere'", &vm).unwrap_err();
    assert!(errors.iter().any(|error| error.cause == Cause::NotBridged), "{errors:#?}");
    assert!(errors.iter().any(|error| matches!(error.cause, Cause::NoFirmware { .. })));
}
