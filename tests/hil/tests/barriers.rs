//! Barriers on the images of all robots: a stigmergy with the number 101 takes no longer than one with the number 0, and values of
//! four frames at most six times as long as those of one; a Kilobot has no room for a stigmergy with such values. No frame is lost by
//! chance, because one loss more or less takes longer than all else.

use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::run::{Program, Setup, Simulation};
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_hil::kilobots::behavior;
use bittybuzz_hil::{Core, ScriptFile, crazyflie_tiny, table};

const ROBOTS: usize = 4;
/// Each robot puts its number in step 20, and shows green when it knows those of all.
const BARRIER: &str = "\
t = 0
wall = stigmergy.create(NUMBER)
function step() {
  t = t + 1
  if(t == 20) wall.put(id, VALUE)
  if(wall.size() == 4) led(2)
}
";
/// A value of four frames in the profile `tiny`.
const FOUR_FRAMES: &str = "{ .x = 1 }";
/// The first tick in which a robot may have put.
const PUT: u32 = 20;

/// Runs of each number. Robots that put at once may send at once, and then it takes some steps more.
const SEEDS: u32 = 11;
/// Runs of Crazyflies, each of which keeps a processor busy for five seconds.
const SEEDS_OF_CRAZYFLIES: u32 = 5;

/// Returns the ticks from the puts until the last robot has passed, the median of all seeds.
fn ticks(robot: &str, group: &str, firmware: &Path, core: Core, number: u16, value: &str) -> u32 {
    let script = BARRIER.replace("NUMBER", &number.to_string()).replace("VALUE", value);
    let file = ScriptFile::new(&format!("barrier-{robot}-{number}-{}", value.len()), &script);
    let text = format!(
        "[world]\nsize = [800, 500]\nduration = 60\n\
         [[robots]]\nrobot = \"{robot}\"\nscript = '{}'\nbackend = \"firmware\"\nfirmware = '{}'\n\
         count = {ROBOTS}\nfirst_id = 1\nplacement = \"circle\"\n{group}",
        file.path(),
        firmware.display()
    );
    let models = bittybuzz_robot_models::all();
    let scenario = Scenario::parse(&text, "test.toml", Path::new(""), &[], &models)
        .unwrap_or_else(|errors| panic!("{errors:#?}"));
    let robot = Some((*scenario.groups[0].robot).clone());
    let options =
        Options { robot, robots: bittybuzz_robot_files::all_shipped(), ..Options::default() };
    let compiled =
        compile(Path::new(file.path()), script, &IncludeLoader::new(&DiskFiles), &options);
    let (symbols, sources) = (compiled.symbols, Arc::new(compiled.sources));
    let program = Program::new(compiled.image.unwrap(), symbols, sources);
    let model = scenario.groups[0].model.name();
    let setup = Setup::new(scenario, vec![program]).unwrap();
    let setup = Arc::new(setup.emulated_by(model, core.program().to_owned()));
    let run = |seed: u32| {
        let mut simulation = Simulation::new(setup.clone(), seed, 1).unwrap();
        for tick in 0.. {
            assert!(!simulation.is_over(), "{model}, number {number}: a robot never passes");
            simulation.tick().unwrap_or_else(|error| panic!("{error}"));
            if (0..ROBOTS).all(|robot| simulation.view(robot).is_some_and(|view| view.led == 2)) {
                return tick - PUT;
            }
        }
        unreachable!("a simulation ends")
    };
    let seeds = if core == Core::Unicorn { SEEDS_OF_CRAZYFLIES } else { SEEDS };
    let mut runs: Vec<u32> = (1..=seeds).map(run).collect();
    runs.sort_unstable();
    println!("{model}, number {number}, {value}: {runs:?}");
    runs[runs.len() / 2]
}

fn compare(robot: &str, group: &str, firmware: &Path, core: Core) {
    let [zero, other] = [0, 101].map(|number| ticks(robot, group, firmware, core, number, "1"));
    println!("{robot}: {zero} ticks with number 0, {other} with 101");
    // A tick, because a frame may be just in time for a step or just too late.
    assert!(other <= zero + 1, "{robot}: {zero} ticks with number 0, {other} with 101");
    if robot != "kilobot" {
        let four = ticks(robot, group, firmware, core, 0, FOUR_FRAMES);
        assert!(four <= 6 * zero, "{robot}: {zero} ticks with one frame, {four} with four");
    }
}

#[test]
fn kilobots_pass_as_fast() {
    compare("kilobot", "radius = 45\n[medium.ir]\nloss = 0\n", &behavior("stigmergy"), Core::Avr);
}

#[test]
fn zooids_pass_as_fast() {
    compare("zooids", "radius = 100\n[medium.nrf24]\nloss = 0\n", &table::zooids(), Core::Own);
}

/// Keeps a processor busy for a minute and a half. CI has the same test of the other robots.
#[test]
#[ignore = "soak"]
fn crazyflies_pass_as_fast() {
    let group = "radius = 150\nprofile = \"tiny\"\n[medium.p2p]\nloss = 0\n";
    compare("crazyflie", group, &crazyflie_tiny(), Core::Unicorn);
}
