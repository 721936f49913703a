//! Robots of several kinds in one world, each kind with its own image, and the bridge between them.

use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::run::{Program, Setup, Simulation, Summary};
use bittybuzz_arena::scenario::{Scenario, ScenarioCause, ScenarioError};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_hil::kilobots::behavior;
use bittybuzz_hil::{Core, ScriptFile, crazyflie_tiny, ear, table};
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
    Scenario::parse(&text, "test.toml", Path::new(""), &[], &bittybuzz_robot_models::all())
}

fn programs(scenario: &Scenario) -> Vec<Program> {
    let compiled = |group: &bittybuzz_arena::scenario::Group| {
        let script = group.script.as_ref().unwrap();
        let text = std::fs::read_to_string(script).unwrap();
        let loader = IncludeLoader {
            folders: vec![bbz::root().join("lib")],
            ..IncludeLoader::new(&DiskFiles)
        };
        let robots = bittybuzz_robot_files::all_shipped();
        let options = Options { robot: Some((*group.robot).clone()), robots, ..Options::default() };
        let compiled = compile(script, text, &loader, &options);
        let (symbols, sources) = (compiled.symbols, Arc::new(compiled.sources));
        Program::new(compiled.image.unwrap(), symbols, sources)
    };
    scenario.groups.iter().map(compiled).collect()
}

/// Runs to the end; the robots' colors then.
fn leds(scenario: &Scenario) -> (Vec<u8>, Summary) {
    let programs = programs(scenario);
    let setup = Setup::new(scenario.clone(), programs).unwrap();
    let setup = setup
        .emulated_by("zooid", Core::Own.program().to_owned())
        .emulated_by("crazyflie", Core::Unicorn.program().to_owned())
        .emulated_by("kilobot", Core::Avr.program().to_owned());
    let mut simulation = Simulation::new(Arc::new(setup), 1, 1).unwrap();
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
    let turned = ScriptFile::new("mixed-swarm", &turned);
    // 77 of robot 17, a Zooid; 0 and 64 of the Crazyflies, 13 and 40 of the others.
    let (bridged, _) = leds(&scenario(Path::new(turned.path()), "[bridge]", "").unwrap());
    assert_eq!(bridged, [77 % 8; 5]);
}

/// Three kinds, whoever of them writes: three Kilobots, two Zooids and a Crazyflie. `cargo xtask demo --robots` shows more of them.
fn three_kinds_share_a_number(writers: &[u16]) {
    let text = std::fs::read_to_string(bbz::root().join("examples/kilobot/stigmergy.bzz")).unwrap();
    for writer in writers {
        let writes = text.replace("WRITER = 0 ", &format!("WRITER = {writer} "));
        assert_ne!(writes, text);
        let script = ScriptFile::new(&format!("mixed-swarm-{writer}"), &writes);
        let group = |robot: &str, firmware: &Path, id: u16, count: u16, rest: &str| {
            format!(
                "[[robots]]\nrobot = \"{robot}\"\nscript = '{}'\nbackend = \"firmware\"\nfirmware = '{}'\n\
                 first_id = {id}\ncount = {count}\n{rest}\n",
                script.path(),
                firmware.display()
            )
        };
        let line = "placement = \"line\"\nspacing = 60\nat = ";
        let text = format!(
            "[world]\nsize = [800, 500]\nduration = 8\n[bridge]\nat = [-200, 60]\nfirmware = '{}'\n{}{}{}",
            ear().display(),
            group("kilobot", &behavior("stigmergy"), 1, 3, &format!("{line}[-260, 0]")),
            group("zooids", &table::zooids(), 16, 2, &format!("{line}[0, -100]")),
            group(
                "crazyflie",
                &crazyflie_tiny(),
                30,
                1,
                &format!("profile = \"tiny\"\n{line}[100, 150]")
            ),
        );
        let scenario =
            Scenario::parse(&text, "test.toml", Path::new(""), &[], &bittybuzz_robot_models::all());
        let (leds, _) = leds(&scenario.unwrap_or_else(|errors| panic!("{errors:#?}")));
        // Whoever writes has written 1.
        assert_eq!(leds, [1; 6], "written by {writer}");
    }
}

/// The bridge brings it to both other kinds.
#[test]
fn the_number_of_a_kilobot_reaches_the_other_kinds() {
    three_kinds_share_a_number(&[1]);
}

#[test]
#[ignore = "soak"]
fn the_number_of_a_zooid_and_of_a_crazyflie_reach_the_other_kinds() {
    three_kinds_share_a_number(&[16, 30]);
}

/// Twelve robots of three kinds agree on what one of the Zooids has measured.
#[test]
fn the_shipped_scenario_meets_its_expectations() {
    let path = bbz::root().join("examples/unlike/consensus.toml");
    let images = [behavior("stigmergy"), table::zooids(), crazyflie_tiny()];
    let mut set: Vec<String> = images
        .iter()
        .enumerate()
        .map(|(group, image)| format!("robots.{group}.firmware={}", image.display()))
        .collect();
    set.push(format!("bridge.firmware={}", ear().display()));
    set.extend(["world.duration=5", "expect.0.within=5"].map(str::to_owned));
    let scenario = Scenario::open(&path, &set, &bittybuzz_robot_models::all())
        .unwrap_or_else(|errors| panic!("{errors:#?}"));
    let (leds, summary) = leds(&scenario);
    assert_eq!(leds, [1; 12]);
    assert!(summary.is_success());
}

/// Without a bridge each kind stays among itself.
#[test]
fn robots_on_different_links_do_not_receive_each_other() {
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
    assert!(errors.iter().any(|error| error.cause == ScenarioCause::NotBridged), "{errors:#?}");
    assert!(errors.iter().any(|error| matches!(error.cause, ScenarioCause::NoFirmware { .. })));
}
