//! The surroundings of Crazyflies with `fidelity = "flight"`: wind, downwash, floors, the radio of poses,
//! walls and obstacles.

use std::sync::Arc;

use crate::flight_fidelity::{distance, fly};
use crate::script::{folder, read};
use bittybuzz_arena::run::{Setup, Simulation};
use bittybuzz_arena::scenario::Scenario;

/// A robot that hovers at 500 mm.
const HOVER: &str = "function init() { takeoff(500) }";
const ALONE: &str = "[[robots]]\npositions = [[0, 0]]\nheading = 0";

/// Returns the poses of robot 0 in a hover of 12 s with these keys of its model.
fn hover(name: &str, model: &str) -> Vec<[f32; 4]> {
    let more = format!("duration = 12\n{ALONE}");
    let (summary, poses) = fly(name, "flight", model, HOVER, &more);
    assert_eq!(summary.statistics.crashes, 0, "{name}");
    poses
}

/// Returns the largest distance in mm from the place 500 mm above the start, from 5 s on.
fn largest_error(poses: &[[f32; 4]]) -> f32 {
    let errors = poses[50..].iter().map(|pose| distance(pose, &[0.0, 0.0, 500.0, 0.0]));
    errors.fold(0.0, f32::max)
}

/// A steady wind pushes until the controller's integral has learned it; gusts push always. The wind
/// along y does not move the robot along x.
#[test]
fn wind_pushes_a_robot() {
    let calm = hover("calm", "");
    let steady = hover("steady", ", wind = 2000, wind_direction = 90");
    let gusts = hover("gusts", ", wind = 1000, gusts = 1000, gust_time = 0.5");
    let most = |axis: usize, poses: &[[f32; 4]]| {
        poses.iter().map(|pose| pose[axis].abs()).fold(0.0, f32::max)
    };
    assert!(most(1, &steady) > 2.0 * most(1, &calm), "{} {}", most(1, &steady), most(1, &calm));
    assert!(most(1, &steady) > 2.0 * most(0, &steady));
    let [calm, gusts] = [calm, gusts].map(|poses| largest_error(&poses));
    assert!(gusts > 1.5 * calm && gusts < 200.0, "{gusts} {calm}");
}

/// A robot that comes to a place above another one pushes it down for a moment; without it, the other one
/// keeps its height.
#[test]
fn a_robot_above_pushes_the_one_below_down() {
    let lowest = |goal: &str| {
        let script = format!(
            "function init() {{ if (id == 0) {{ takeoff(400) }} else {{ takeoff(900) }} }} \
             function step() {{ if (id == 1) {{ goto({goal}, 0) }} }}"
        );
        let more = "duration = 15\n[[robots]]\npositions = [[0, 0], [1000, 0]]\nheading = 0";
        let keys = ", positioning = \"capture\"";
        let (summary, poses) = fly("downwash", "flight", keys, &script, more);
        assert_eq!(summary.statistics.crashes, 0);
        poses[50..].iter().map(|pose| pose[2]).fold(f32::INFINITY, f32::min)
    };
    let (alone, below) = (lowest("2000"), lowest("0"));
    assert!(alone > 390.0, "{alone}");
    assert!(below < alone - 15.0 && below > 250.0, "{below} {alone}");
}

/// A robot with a Flow deck flies over a table of 300 mm, keeps its height, lands on the table and stands
/// there.
#[test]
fn a_robot_lands_on_a_table() {
    let script = "tick = 0
        function init() { takeoff(700) }
        function step() {
            tick = tick + 1
            if (tick < 60) { goto(1000, 0) } else { if (tick == 60) { land() } }
        }";
    let more = format!(
        "duration = 25\nobstacles = [{{ at = [1000, 0], size = [800, 800], height = 300 }}]\n{ALONE}"
    );
    let (summary, poses) = fly("table", "flight", ", positioning = \"flow\"", script, &more);
    assert_eq!(summary.statistics.crashes, 0);
    let above = poses.iter().filter(|pose| pose[0] > 700.0 && pose[0] < 900.0);
    assert!(above.clone().count() > 3);
    assert!(above.into_iter().all(|pose| pose[2] > 600.0 || pose[2] < 310.0));
    let [x, y, z, _] = poses[poses.len() - 1];
    assert!((x - 1000.0).hypot(y) < 300.0, "{x} {y}");
    assert!((z - 300.0).abs() < 2.0, "{z}");
}

/// Above a floor without features a Flow deck reports that it sees nothing, and the robot comes down
/// instead of drifting; above a usual one it stays.
#[test]
fn a_floor_without_features_ends_a_flight_with_a_deck() {
    let usual = hover("usual", ", positioning = \"flow\"");
    let bare = hover("bare", ", positioning = \"flow\", texture = 0.1");
    assert!(usual[usual.len() - 1][2] > 450.0);
    assert!(bare[bare.len() - 1][2] < 20.0, "{:?}", bare[bare.len() - 1]);
}

/// Poses that are later than the robot assumes, and sway, cost accuracy and not the flight.
#[test]
fn late_poses_are_followed() {
    let script = "tick = 0
        function init() { takeoff(500) }
        function step() { tick = tick + 1 if (tick % 60 < 30) { goto(600, 0) } else { goto(0, 0) } }";
    let more = format!("duration = 25\n{ALONE}");
    let keys = ", positioning = \"capture\", latency = 50, latency_sway = 0.4";
    let (summary, poses) = fly("late", "flight", keys, script, &more);
    assert_eq!(summary.statistics.crashes, 0);
    assert!(poses[50..].iter().all(|pose| pose[2] > 400.0 && pose[2] < 600.0));
    assert!(poses.iter().any(|pose| pose[0] > 550.0));
}

/// Two robots change places past a pillar, in a room that has just space for it. Without avoidance both
/// crash; with it they reach their goals.
#[test]
fn avoidance_knows_walls_and_obstacles() {
    let script = "function init() { takeoff(500); x = -pos.x; y = -pos.y } \
                  function step() { neighbors.broadcast(\"here\", 1) goto(x, y) }";
    for fidelity in ["kinematic", "flight"] {
        let more = "size = [3000, 2200]\nduration = 60\n\
                    obstacles = [{ at = [0, 0], radius = 150 }]\n\
                    [[robots]]\npositions = [[-1200, 0], [1200, 0]]\nheading = 0";
        let fly = |model: &str| fly("pillar", fidelity, model, script, more);
        let (summary, _) = fly("");
        assert_eq!(summary.statistics.crashes, 2, "{fidelity} without avoidance");
        let (summary, poses) = fly(", avoidance = 200");
        assert_eq!(summary.statistics.crashes, 0, "{fidelity}");
        let [x, y, ..] = poses[poses.len() - 1];
        assert!((x - 1200.0).hypot(y) < 200.0, "{fidelity}: {x} {y}");
        let nearest = poses.iter().map(|[x, y, ..]| x.hypot(*y)).fold(f32::INFINITY, f32::min);
        assert!(nearest > 300.0, "{fidelity}: {nearest} mm from the middle of the pillar");
        assert!(poses.iter().all(|[x, y, ..]| x.abs() < 1340.0 && y.abs() < 940.0), "{fidelity}");
    }
}

/// Keys that only a flight controller's world has are refused without one.
#[test]
fn surroundings_need_a_flight_controller() {
    for key in ["wind = 500", "gusts = 100", "texture = 0.5", "latency = 20"] {
        let folder = folder("kinematic-wind", &[("script.bzz", "function step() { }")]);
        let text = format!(
            "[world]\nsize = [2000, 2000]\nduration = 1\n[body.crazyflie]\n{key}\n[[robots]]\n\
             robot = \"crazyflie\"\nscript = \"script.bzz\"\n"
        );
        let (scenario, programs) = read(&folder, &text);
        let setup = Arc::new(Setup::new(scenario, programs).unwrap());
        let refused = Simulation::new(setup, 1, 1).err().map(|error| error.to_string());
        let name = key.split(' ').next().unwrap();
        assert!(refused.as_ref().is_some_and(|text| text.contains(name)), "{key}: {refused:?}");
    }
}

/// Cameras that take two hovering robots for each other end both flights, apart; after a restart and a
/// second event the robots fly again.
#[test]
fn exchanged_labels_end_both_flights() {
    let script =
        "function init() { takeoff(500) } function step() { neighbors.broadcast(\"here\", 1) }";
    let more = "duration = 30\n\
                [[event]]\nat = 6\nrelabel = [0, 1]\n\
                [[event]]\nat = 18\nrelabel = [0, 1]\n\
                [[event]]\nat = 18\nrestart = \"0..1\"\n\
                [[expect]]\nat = 5.9\nvalue = \"z\"\nabove = 450\n\
                [[expect]]\nalways = [14, 18]\nvalue = \"z\"\nbelow = 10\n\
                [[expect]]\nat = 29\nvalue = \"z\"\nabove = 450\n\
                [[robots]]\npositions = [[0, 0], [1000, 0]]\nheading = 0";
    let (summary, _) = fly("labels", "flight", ", positioning = \"capture\"", script, more);
    assert_eq!(summary.statistics.crashes, 0);
    assert!(summary.is_success(), "{:?}", summary.convergences);
}

/// Poses that jump by 200 mm are followed; a jump of 2 m ends in a landing.
#[test]
fn displaced_poses_are_followed_or_end_the_flight() {
    let script = "function init() { takeoff(500) } function step() { goto(0, 0) }";
    let fly = |by: u32| {
        let more =
            format!("duration = 20\n[[event]]\nat = 8\ndisplace = 0\nby = [{by}, 0]\n{ALONE}");
        let (summary, poses) = fly("jump", "flight", ", positioning = \"capture\"", script, &more);
        assert_eq!(summary.statistics.crashes, 0);
        poses[poses.len() - 1]
    };
    let [x, _, z, _] = fly(200);
    assert!((x - -200.0).abs() < 30.0 && z > 450.0, "{x} {z}");
    let [x, _, z, _] = fly(2000);
    assert!(x.abs() < 300.0 && z < 10.0, "{x} {z}");
}

/// The events name what they need.
#[test]
fn events_about_poses_need_poses() {
    let refused = |event: &str, model: &str| {
        let robots = "positions = [[0, 0], [900, 0]]";
        let many = "count = 300\nplacement = \"grid\"\nspacing = 300";
        let robots = if event.contains("299") { many } else { robots };
        let folder = folder("no-poses", &[("script.bzz", "function step() { }")]);
        let text = format!(
            "[world]\nsize = [9000, 9000]\nduration = 2\n[[event]]\nat = 1\n{event}\n[[robots]]\n\
             robot = \"crazyflie\"\nscript = \"script.bzz\"\n{robots}\n{model}\n"
        );
        let models = bittybuzz_robot_models::all();
        let errors = Scenario::parse(&text, "test.toml", &folder, &[], &models).unwrap_err();
        errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    };
    let deck = "model = { fidelity = \"flight\", positioning = \"flow\" }";
    let capture = "model = { fidelity = \"flight\", positioning = \"capture\" }";
    for (event, model, message) in [
        ("displace = 0\nby = [100, 0]", "", "`displace` is about poses from outside"),
        ("displace = 0\nby = [100, 0]", deck, "`displace` is about poses from outside"),
        ("relabel = [0, 1]", deck, "`relabel` is about poses from outside"),
        ("displace = 0", capture, "by"),
        ("relabel = [0, 0]", capture, "two robots of one group"),
        ("relabel = [\"0..1\", 1]", capture, "two robots of one group"),
        ("relabel = [0, 299]", capture, "present from the start"),
        ("relabel = [0, 1]", &format!("{capture}\npresent = false"), "present from the start"),
        ("fail = 0\nby = [1, 0]", capture, "`by`"),
    ] {
        let report = refused(event, model);
        assert!(report.contains(message), "{event} {model}: {report}");
    }
}
