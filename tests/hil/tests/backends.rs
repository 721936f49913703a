//! One scenario, in virtual machines of this process and on the robots' own image: it comes to the same.

use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::engine::RobotView;
use bittybuzz_arena::robot::Piece;
use bittybuzz_arena::run::{Program, Setup, Simulation, Summary};
use bittybuzz_arena::scenario::{Backend, Placement, Scenario};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_hil::kilobots::behavior;
use bittybuzz_hil::{Core, ScriptFile, table};
use bittybuzz_robot_spec::Robot;
use bittybuzz_tests::bbz;

/// Where a robot is in the end, and which color it shows.
type End = ([f64; 2], u8);

/// Runs the shipped scenario with a backend for so many ticks at most, and shows each.
fn run_with(backend: &str, seed: u32, ticks: u64, look: impl FnMut(&mut Simulation)) -> Summary {
    let path = bbz::root().join("tests/scenarios/backends.toml");
    let set = [
        format!("robots.0.backend={backend}"),
        format!("robots.0.firmware={}", table::zooids().display()),
    ];
    let scenario = Scenario::open(&path, &set, &bittybuzz_robot_models::all())
        .unwrap_or_else(|errors| panic!("{errors:#?}"));
    run(&scenario, seed, ticks, look)
}

/// Runs a scenario for so many ticks at most, and shows each.
fn run(
    scenario: &Scenario,
    seed: u32,
    ticks: u64,
    mut look: impl FnMut(&mut Simulation),
) -> Summary {
    let programs: Vec<Program> = scenario
        .groups
        .iter()
        .map(|group| program(group.script.as_ref().unwrap(), &group.robot))
        .collect();
    let setup = Setup::new(scenario.clone(), programs).unwrap();
    let setup = setup.emulated_by("zooid", Core::Own.program().to_owned());
    let mut simulation = Simulation::new(Arc::new(setup), seed, 1).unwrap();
    while simulation.now() < ticks && !simulation.is_over() {
        simulation.tick().unwrap_or_else(|error| panic!("{error}"));
        look(&mut simulation);
    }
    simulation.summary()
}

/// A scenario with Zooids that run their firmware and this script, and its file, which is read when the run begins; what the group says beside, then other sections.
fn scenario(test: &str, script: &str, group: &str, rest: &str) -> (Scenario, ScriptFile) {
    let script = ScriptFile::new(test, script);
    let text = format!(
        "[world]\nsize = [800, 500]\nduration = 3\n[[robots]]\nrobot = \"zooids\"\nscript = '{}'\n\
         backend = \"firmware\"\nfirmware = '{}'\n{group}\n{rest}",
        script.path(),
        table::zooids().display()
    );
    let read =
        Scenario::parse(&text, "test.toml", Path::new(""), &[], &bittybuzz_robot_models::all());
    let scenario = read.unwrap_or_else(|errors| panic!("{errors:#?}\n{text}"));
    (scenario, script)
}

/// The numbers that a robot logs in each tick, by tick.
fn logged(simulation: &mut Simulation) -> Vec<(usize, Vec<f64>)> {
    let number = |piece: &Piece| match piece {
        Piece::Int(value) => f64::from(*value),
        Piece::Float(value) => f64::from(*value),
        _ => f64::NAN,
    };
    let lines = simulation.take_log().into_iter();
    lines.map(|(robot, line)| (robot, line.pieces.iter().map(number).collect())).collect()
}

pub fn program(script: &Path, robot: &Robot) -> Program {
    let options = Options {
        robot: Some(robot.clone()),
        robots: bittybuzz_robot_files::all_shipped(),
        ..Options::default()
    };
    let text = std::fs::read_to_string(script).unwrap();
    let compiled = compile(script, text, &IncludeLoader::new(&DiskFiles), &options);
    let image = compiled.image.unwrap_or_else(|| panic!("{:#?}", compiled.diagnostics));
    Program::new(image, compiled.symbols, Arc::new(compiled.sources))
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
        for ((one, color), (other, other_color)) in vm.into_iter().zip(firmware) {
            assert_eq!(color, other_color, "seed {seed}");
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

/// Runs a scenario of Kilobots to its end, and returns where they are and what they show.
fn kilobot_ends(text: &str) -> Vec<RobotView> {
    let read =
        Scenario::parse(text, "test.toml", Path::new(""), &[], &bittybuzz_robot_models::all());
    let scenario = read.unwrap_or_else(|errors| panic!("{errors:#?}"));
    let group = &scenario.groups[0];
    let programs = [program(group.script.as_ref().unwrap(), &group.robot)];
    let setup = Setup::new(scenario.clone(), programs).unwrap();
    let setup = setup.emulated_by("kilobot", Core::Avr.program().to_owned());
    let mut simulation = Simulation::new(Arc::new(setup), 1, 1).unwrap();
    while !simulation.is_over() {
        simulation.tick().unwrap_or_else(|error| panic!("{error}"));
    }
    (0..scenario.robot_count()).map(|number| simulation.view(number).unwrap()).collect()
}

/// Six Kilobots go straight on, turn and stop. Their firmware is started by the controller, 20 ms late, and pushes a motor that starts.
#[test]
fn kilobots_come_to_the_same_end() {
    let script = ScriptFile::new(
        "kilobots",
        "t = 0\nfunction step() {\n t = t + 1\n if(t < 30) { forward() }\n else if(t < 60) { left() }\n \
         else { stop() led(5) }\n}\n",
    );
    let ends = |backend: &str| {
        kilobot_ends(&format!(
            "[world]\nsize = [800, 500]\nduration = 7\n[[robots]]\nrobot = \"kilobot\"\nscript = '{}'\ncount = 6\n\
             placement = \"grid\"\nspacing = 80\nbackend = \"{backend}\"\nfirmware = '{}'\n",
            script.path(),
            bittybuzz_hil::kilobot().display()
        ))
    };
    for (vm, firmware) in ends("vm").into_iter().zip(ends("firmware")) {
        let distance = (vm.pose.x - firmware.pose.x).hypot(vm.pose.y - firmware.pose.y);
        // 31 mm were gone in 3 s.
        assert!(distance < 2.0, "{distance} mm");
        assert_eq!((vm.led, firmware.led), (5, 5));
    }
}

/// The speaker of the example stands between two others, and a wall between it and one of them.
#[test]
fn a_wall_blocks_infrared_with_both_backends() {
    let example = bbz::root().join("examples/kilobot/broadcast.bzz");
    let leds = |backend: &str, wall: &str| {
        let ends = kilobot_ends(&format!(
            "[world]\nsize = [800, 500]\nduration = 5\n{wall}\n[[robots]]\nrobot = \"kilobot\"\nscript = '{}'\n\
             first_id = 7\npositions = [[0, 0], [80, 0], [-80, 0]]\nbackend = \"{backend}\"\nfirmware = '{}'\n",
            example.display(),
            behavior("broadcast").display()
        ));
        ends.iter().map(|robot| robot.led).collect::<Vec<u8>>()
    };
    let wall = "obstacles = [{ from = [40, -250], to = [40, 250] }]";
    // 7: speaks, 0: has heard nothing, 2: has heard the number of the fourth to the eighth second.
    assert_eq!(leds("vm", ""), [7, 2, 2]);
    for backend in ["vm", "firmware"] {
        assert_eq!(leds(backend, wall), [7, 0, 2], "{backend}");
    }
}

/// Wheels that turn for so many steps, whatever comes of it: nothing corrects what one of them does differently.
#[test]
fn wheels_turn_for_as_long_with_both_backends() {
    let script = "\
function init() { n = 0 }
function step() {
  n = n + 1
  if(n < 10) set_motor(40, 40)
  else if(n < 13) set_motor(30, -30)
  else if(n < 23) set_motor(45, 40)
  else if(n < 26) set_motor(-30, 30)
  else stop()
}
";
    let group = "positions = [[-100, 0], [-100, 150]]\nheading = 0";
    let (mut scenario, _script) = scenario("wheels", script, group, "");
    let ends = |scenario: &Scenario| {
        let mut ends = Vec::new();
        for seed in 1..=3 {
            run(scenario, seed, 30, |simulation| {
                if simulation.now() == 30 {
                    ends.extend([0, 1].map(|number| simulation.view(number).unwrap().pose));
                }
            });
        }
        ends
    };
    let firmware = ends(&scenario);
    scenario.groups[0].backend = Backend::Vm;
    let vm = ends(&scenario);
    for (one, other) in vm.iter().zip(&firmware) {
        let apart = (one.x - other.x).hypot(one.y - other.y);
        // At 0.3 m/s a millisecond is 0.3 mm.
        assert!(apart < 0.3, "{one:?} {other:?}");
        let moved = [0.0, 150.0].map(|y| (one.x + 100.0).hypot(one.y - y));
        assert!(moved.iter().all(|moved| *moved > 20.0), "{one:?}");
    }
}

/// `cargo xtask soak zooids` runs it.
#[test]
#[ignore = "soak"]
fn both_backends_come_to_the_same_end_with_thirty_seeds() {
    compare(30);
}

/// Ten robots agree though half of their packets are lost: `cargo xtask soak zooids` does it with a hundred seeds.
#[test]
fn ten_robots_with_firmware_agree_at_a_loss_of_one_half() {
    let path = bbz::root().join("examples/zooids/consensus.toml");
    let firmware = format!("robots.0.firmware={}", table::zooids().display());
    let set = ["robots.0.backend=firmware".to_owned(), firmware];
    let scenario = Scenario::open(&path, &set, &bittybuzz_robot_models::all())
        .unwrap_or_else(|errors| panic!("{errors:#?}"));
    for seed in 1..=2 {
        let mut since = None;
        // What is agreed once does not change any more.
        let summary = run(&scenario, seed, 150, |simulation| {
            let mut leds = (0..10).map(|number| simulation.view(number).unwrap().led);
            let agrees = leds.all(|led| led == 1);
            since = since.filter(|_| agrees).or_else(|| agrees.then(|| simulation.now()));
        });
        let links = summary.statistics.all_links();
        assert!(links.lost * 10 > links.received * 8, "half is lost: {links:?}");
        assert!(since.is_some(), "seed {seed}");
    }
}

/// Links are cut and mended, robots fail and are restarted: what the file expects comes true either way.
#[test]
fn outages_are_the_same_with_both_backends() {
    let path = bbz::root().join("tests/scenarios/outages.toml");
    for backend in ["vm", "firmware"] {
        let set = [
            format!("robots.0.backend={backend}"),
            format!("robots.0.firmware={}", table::zooids().display()),
        ];
        let scenario = Scenario::open(&path, &set, &bittybuzz_robot_models::all())
            .unwrap_or_else(|errors| panic!("{errors:#?}"));
        for seed in 1..=2 {
            let summary = run(&scenario, seed, u64::MAX, |_| {});
            assert!(summary.is_success(), "{backend}, seed {seed}: {:#?}", summary.convergences);
        }
    }
}

/// In virtual machines it is one of the examples' tests.
#[test]
fn robots_with_firmware_queue_for_the_charger() {
    let path = bbz::root().join("examples/zooids/recharge.toml");
    let firmware = format!("robots.0.firmware={}", table::zooids().display());
    let set = ["robots.0.backend=firmware".to_owned(), firmware];
    let scenario = Scenario::open(&path, &set, &bittybuzz_robot_models::all())
        .unwrap_or_else(|errors| panic!("{errors:#?}"));
    let summary = run(&scenario, 1, u64::MAX, |_| {});
    assert!(summary.is_success(), "{:#?}", summary.convergences);
}

/// Every place and color on the way, bit for bit.
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

/// Against a wall at 0.3 m/s and more: it stops where the wall is, and its firmware knows.
#[test]
fn walls_hold_robots_that_run_firmware() {
    let script = "function step() { set_motor(60, 60)  log(pos.x, pos.y) }";
    let group = "positions = [[100, 20]]\nheading = 0";
    let (scenario, _script) = scenario("wall", script, group, "[body.zooid]\ngain_error = 0\n");
    let mut ends = Vec::new();
    let summary = run(&scenario, 1, 30, |simulation| {
        let pose = simulation.view(0).unwrap().pose;
        ends.push((pose.x, logged(simulation).last().map_or(f64::NAN, |(_, seen)| seen[0])));
    });
    let (x, seen) = *ends.last().unwrap();
    assert!((x - (WALL - 13.0)).abs() < 0.1, "{x}: a body has a radius of 13 mm");
    // A pixel, and how far it would have come in a substep of the world.
    assert!((seen - f64::from(x)).abs() < 8.0, "{seen}");
    assert!(summary.statistics.wall_ticks > 10);
}

/// From the middle to the wall, mm.
const WALL: f32 = 400.0;

#[test]
fn a_moved_robot_knows_its_position() {
    let script = "function step() { log(pos.x, pos.y, pos.orientation) }";
    let group = "positions = [[100, 20], [-200, 100]]\nheading = 30";
    let event = "[[event]]\nat = 1\nmove = 1\nto = [300, -150]\nheading = -90\n";
    let (scenario, _script) = scenario("moved", script, group, event);
    let mut seen = Vec::new();
    run(&scenario, 1, 20, |simulation| {
        let lines = logged(simulation);
        // Before the robot is moved, and a second after.
        if [10, 20].contains(&simulation.now()) {
            seen.extend(lines);
        }
    });
    let expected = [
        (0, [100.0, 20.0, 30.0]),
        (1, [-200.0, 100.0, 30.0]),
        (0, [100.0, 20.0, 30.0]),
        (1, [300.0, -150.0, -90.0]),
    ];
    assert_eq!(seen.len(), expected.len(), "{seen:?}");
    for ((robot, seen), (number, expected)) in seen.iter().zip(expected) {
        assert_eq!(*robot, number);
        // Half a pixel, and a pixel between the diodes.
        for (index, within) in [0.75, 0.75, 3.0].into_iter().enumerate() {
            assert!((seen[index] - expected[index]).abs() < within, "{seen:?}: {expected:?}");
        }
    }
}

/// What robots hear of each other: their own range and the loss decide.
#[test]
fn range_and_loss_are_those_of_the_medium() {
    let script = "\
function init() { heard = 0  neighbors.listen(\"a\", function(t, v, r) { heard = heard + 1 }) }
function step() { neighbors.broadcast(\"a\", id)  log(heard) }
";
    let group = "positions = [[-100, 0], [0, 0], [300, 0]]\nheading = 0";
    let heard_with = |backend: Option<Backend>, test: &str, rest: &str| {
        let mut last = [0.0; 3];
        let (mut scenario, _script) = scenario(test, script, group, rest);
        if let Some(backend) = backend {
            scenario.groups[0].backend = backend;
        }
        let summary = run(&scenario, 1, 30, |simulation| {
            for (robot, seen) in logged(simulation) {
                last[robot] = seen[0];
            }
        });
        (last, summary.statistics.all_links())
    };
    let heard = |test: &str, rest: &str| heard_with(None, test, rest);
    let (all, links) = heard("all", "[medium.nrf24]\nloss = 0\n");
    assert!(all.iter().all(|heard| *heard > 30.0), "{all:?}");
    assert_eq!((links.lost, links.collided > links.sent), (0, false));
    assert!(links.sent >= 3 * 25 && links.received <= 2 * links.sent, "{links:?}");
    // As far as a robot hears, it is heard: 100 and 300 mm lie between them.
    for (range, hears) in [(97, [0, 0, 0]), (103, [1, 1, 0]), (296, [1, 1, 0]), (304, [1, 2, 1])] {
        for backend in [Some(Backend::Vm), None] {
            let range = format!("[medium.nrf24]\nloss = 0\nrange = {range}\n");
            let (near, _) = heard_with(backend, "near", &range);
            for (heard, robots) in near.iter().zip(hears) {
                // With every step, but for the first ones and what collides.
                let all = 29.0 * f64::from(robots);
                assert!((0.8 * all..=all).contains(heard), "{range}: {near:?}");
            }
        }
    }
    let (none, links) = heard("none", "[medium.nrf24]\nloss = 1\n");
    assert_eq!(none, [0.0; 3]);
    assert!(links.lost > 0 && links.received == 0, "{links:?}");
    let event = "[medium.nrf24]\nloss = 0\n[[event]]\nat = 1\nloss = 1\n";
    let (some, _) = heard("some", event);
    assert!(some.iter().all(|heard| (8.0..=20.0).contains(heard)), "{some:?}");
}

/// More messages than queues hold: with both backends each packet was heard by a script or is counted.
#[test]
fn frames_that_find_full_queues_are_counted() {
    let script = "\
function init() {
  heard = 0
  count = function(topic, value, robot) { heard = heard + 1 }
  neighbors.listen(\"a\", count)
  neighbors.listen(\"b\", count)
  neighbors.listen(\"c\", count)
}
function step() {
  neighbors.broadcast(\"a\", id)
  neighbors.broadcast(\"b\", id)
  neighbors.broadcast(\"c\", id)
  log(heard)
}
";
    let group = "count = 10\nplacement = \"grid\"\nspacing = 60\nheading = 0";
    let (mut scenario, _script) = scenario("full", script, group, "[medium.nrf24]\nloss = 0\n");
    for backend in [None, Some(Backend::Vm)] {
        if let Some(backend) = backend {
            scenario.groups[0].backend = backend;
        }
        let mut last = [0.0; 10];
        let summary = run(&scenario, 1, 30, |simulation| {
            for (robot, seen) in logged(simulation) {
                last[robot] = seen[0];
            }
        });
        let heard = last.iter().sum::<f64>() as u64;
        let [unread, _] = summary.dropped;
        let received = summary.statistics.all_links().received;
        assert!(unread > 1000, "{:?}: {heard}, {unread}", scenario.groups[0].backend);
        // What came after the last step is not heard any more: at most what nine others send in a tick, and wait with.
        let rest = received - heard - unread;
        assert!(rest <= 10 * 2 * 27, "{received} received, {heard} heard, {unread} counted");
    }
}

/// Frames that are not seen, and edges at wrong times: the firmware bridges what it can.
#[test]
fn the_projectors_light_may_be_bad() {
    let script = "function step() { log(pos.x) }";
    let blind = |test: &str, light: &str| {
        let rest = format!("[body.zooid]\n{light}\n");
        let (scenario, _script) =
            scenario(test, script, "positions = [[50, 0]]\nheading = 0", &rest);
        let mut seen = Vec::new();
        run(&scenario, 1, 30, |simulation| {
            seen.extend(logged(simulation).into_iter().map(|(_, numbers)| numbers[0]));
        });
        // Its eyes open with the first step.
        seen[1..].iter().filter(|x| x.is_nan()).count()
    };
    assert_eq!(blind("good", "frame_loss = 0"), 0);
    assert_eq!(blind("some_light", "frame_loss = 0.1\nedge_jitter = 20"), 0);
    assert_eq!(blind("dark", "frame_loss = 1"), 28);
}

#[test]
fn errors_of_scripts_are_found_in_their_source() {
    let script = "function init() { n = 0 }\nfunction step() {\n  n = n + 1\n  if(n == 5) { t = nil  t.x = 3 }\n}";
    let (scenario, _script) = scenario("fault", script, "positions = [[50, 0], [0, 0]]", "");
    let group = &scenario.groups[0];
    let programs = [program(group.script.as_ref().unwrap(), &group.robot)];
    let summary = run(&scenario, 1, 30, |_| {});
    assert!(!summary.is_success());
    assert_eq!(summary.faults.len(), 2);
    for fault in summary.faults {
        assert_eq!(fault.record.tick, 5, "{fault:?}");
        let symbols = programs[0].symbols.as_ref().unwrap();
        let place = symbols.position(u32::from(fault.record.positions[0])).unwrap();
        assert_eq!(place.line, 4);
    }
}

/// A faster robot that joins makes the world's substeps shorter: for the others time goes on as before.
#[test]
fn time_is_that_of_the_world_whoever_joins() {
    let walk = ScriptFile::new("join-fly", "function step() { }");
    let rest = format!(
        "[[robots]]\nrobot = \"crazyflie\"\nscript = '{}'\npresent = false\nplacement = \"grid\"\nspacing = 10\n\
         [body.crazyflie]\nspeed = 9000\n[[event]]\nat = 1.5\njoin = \"crazyflie\"\n",
        walk.path()
    );
    let group = "positions = [[0, 100]]\nheading = 0";
    let script = "function init() { n = 0 }\nfunction step() { n = n + 1  log(n) }";
    let (scenario, _script) = scenario("join", script, group, &rest);
    let mut ticks = Vec::new();
    run(&scenario, 1, 30, |simulation| {
        let lines = simulation.take_log();
        ticks.extend(lines.into_iter().map(|(_, line)| (line.tick, line.pieces)));
    });
    let expected: Vec<_> = (1..30).map(|n| (n as u64, vec![Piece::Int(n)])).collect();
    assert_eq!(ticks, expected);
}

#[test]
fn robots_start_where_the_projector_shines() {
    let group = "positions = [[0, 0], [10, 200]]\nheading = 0";
    let (mut scenario, _script) = scenario("dark", "function step() { }", group, "");
    scenario.world.size = [2000.0, 1000.0];
    let group = &scenario.groups[0];
    let programs = [program(group.script.as_ref().unwrap(), &group.robot)];
    for (at, is_lit) in [([415.0, -250.0], true), ([430.0, 0.0], false), ([0.0, 270.0], false)] {
        scenario.groups[0].placement = Placement::List(vec![[0.0, 0.0].into(), at.into()]);
        let setup = Setup::new(scenario.clone(), programs.clone()).unwrap();
        let setup = setup.emulated_by("zooid", Core::Own.program().to_owned());
        match Simulation::new(Arc::new(setup), 1, 1) {
            Ok(_) => assert!(is_lit, "{at:?}"),
            Err(error) => {
                assert!(!is_lit, "{error}");
                assert!(error.to_string().contains("robot 1 would start where"), "{error}");
                assert_eq!(error.place.as_ref().unwrap().line, 7);
            }
        }
    }
}

#[test]
fn a_missing_emulator_is_reported_with_its_installation() {
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
    for part in ["no-such-emulator", "cargo build --locked --release -p bittybuzz-emulate-m0"] {
        assert!(outcome.stderr.contains(part), "{outcome:?}");
    }
}
