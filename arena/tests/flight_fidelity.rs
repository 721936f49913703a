//! Crazyflies with `fidelity = "flight"`: the flight controller flies them in the physics. Scenarios
//! have the same outcome as with the kinematic body, within a bound.

use std::sync::Arc;

use crate::script::{folder, read, run_with};
use bittybuzz_arena::run::{Setup, Simulation, Summary};
use bittybuzz_arena::scenario::Scenario;

/// The two values of `fidelity`.
const FIDELITIES: [&str; 2] = ["kinematic", "flight"];

/// A tour: take-off, three places at two heights, a turn, a velocity and the landing.
const TOUR: &str = "
tick = 0
function init() { takeoff(500) }
function step() {
    tick = tick + 1
    if (tick < 40) { goto(1000, 0) }
    else { if (tick < 80) { goto(1000, 800, 900) }
    else { if (tick < 100) { left() }
    else { if (tick < 120) { move_toward(300, 0) }
    else { if (tick < 170) { goto(0, 0, 500) }
    else { land() } } } } }
}
";

/// Runs a script in `[robots]` with these keys, and returns the poses of robot 0 after each tick.
pub fn fly(
    name: &str,
    fidelity: &str,
    body: &str,
    script: &str,
    more: &str,
) -> (Summary, Vec<[f32; 4]>) {
    let folder = folder(name, &[("script.bzz", script)]);
    let size = if more.starts_with("size") { "" } else { "size = [6000, 6000]\n" };
    let text = format!(
        "[world]\n{size}{more}\nrobot = \"crazyflie\"\nscript = \"script.bzz\"\n\
         model = {{ armed = true, fidelity = \"{fidelity}\"{body} }}\n"
    );
    let mut poses = Vec::new();
    let summary = run_with(&folder, &text, 1, |simulation| {
        let pose = simulation.view(0).unwrap().pose;
        poses.push([pose.x, pose.y, pose.z, pose.heading]);
    });
    (summary, poses)
}

/// Distance in mm between two places.
pub fn distance(a: &[f32; 4], b: &[f32; 4]) -> f32 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f32>().sqrt()
}

/// Both bodies fly the tour; the flight controller begins later, because it calibrates its sensors and
/// arms first. At the tour's 500 mm/s, 50 mm are a tenth of a second, one tick of the script.
#[test]
fn the_difference_of_the_fidelities_is_bounded() {
    let more = "duration = 22\n[[robots]]\npositions = [[0, 0]]\nheading = 0";
    let [kinematic, flight] = FIDELITIES.map(|fidelity| fly("tour", fidelity, "", TOUR, more).1);
    let late = |ticks: usize| kinematic.iter().zip(&flight[ticks..]).map(|(a, b)| distance(a, b));
    let mean = |ticks: usize| late(ticks).sum::<f32>() / late(ticks).count() as f32;
    let ticks = (0..=15).min_by(|a, b| mean(*a).total_cmp(&mean(*b))).unwrap();
    let (mean, most) = (mean(ticks), late(ticks).fold(0.0, f32::max));
    println!("{ticks} ticks later, {mean} mm on average, {most} mm at most");
    assert!(ticks <= 10, "{ticks} ticks later");
    assert!(mean < 50.0, "{mean} mm on average");
    assert!(most < 150.0, "{most} mm at most");
}

/// A robot flies over a box of 300 mm and crashes into one of 600 mm, in both fidelities. It falls,
/// and lies there.
#[test]
fn obstacles_have_a_height_in_both_fidelities() {
    let script = "function init() { takeoff(450) } function step() { move_toward(400, 0) }";
    for fidelity in FIDELITIES {
        let more = "duration = 20\n\
                    obstacles = [{ at = [1000, 0], size = [200, 400], height = 300 }, \
                    { at = [2200, 0], size = [200, 400], height = 600 }]\n\
                    [[robots]]\npositions = [[0, 0]]\nheading = 0";
        let (summary, poses) = fly("boxes", fidelity, "", script, more);
        assert_eq!(summary.statistics.crashes, 1, "{fidelity}");
        let [x, _, z, _] = poses[poses.len() - 1];
        assert!((1900.0..2101.0).contains(&x), "{fidelity}: {x}");
        assert!(z < 40.0, "{fidelity}: {z}");
        let over = poses.iter().filter(|[x, ..]| (900.0..1100.0).contains(x));
        assert!(over.clone().count() > 2 && over.clone().all(|[_, _, z, _]| *z > 300.0));
    }
}

/// Two robots on one line meet: both crash, in both fidelities.
#[test]
fn robots_that_meet_crash_in_both_fidelities() {
    let script = "function init() { takeoff(500) } function step() { move_toward(300, 0) }";
    for fidelity in FIDELITIES {
        let more = "duration = 15\n\
                    [[event]]\nat = 0\nmove = 1\nto = [1500, 0]\nheading = 180\n\
                    [[robots]]\npositions = [[0, 0], [1500, 0]]\nheading = 0";
        let (summary, poses) = fly("meet", fidelity, "", script, more);
        assert_eq!(summary.statistics.crashes, 2, "{fidelity}");
        assert!(poses[poses.len() - 1][2] < 40.0, "{fidelity}");
    }
}

/// The voltage that an event sets is that of both bodies, and an empty battery ends a flight without a
/// crash.
#[test]
fn an_empty_battery_ends_a_flight_in_both_fidelities() {
    let script = "mv = 0\nfunction init() { takeoff(500) } function step() { mv = battery() }";
    for fidelity in FIDELITIES {
        let more = "duration = 20\n\
                    [[event]]\nat = 8\nbattery = 0\nvolts = 3.05\n\
                    [[expect]]\nat = 9\nvalue = \"global.mv\"\nequals = 3050\n\
                    [[expect]]\nalways = [6, 12.5]\nvalue = \"z\"\nabove = 400\n\
                    [[expect]]\nalways = [17, 20]\nvalue = \"z\"\nbelow = 10\n\
                    [[robots]]\npositions = [[0, 0]]\nheading = 0";
        let (summary, _) = fly("empty-battery", fidelity, "", script, more);
        assert!(summary.is_success(), "{fidelity}: {:?}", summary.convergences);
        assert_eq!(summary.statistics.crashes, 0, "{fidelity}");
    }
}

/// Six robots on a circle fly to the opposite places. Without avoidance they crash in the middle; with
/// it all arrive, in both fidelities.
#[test]
fn avoidance_keeps_robots_apart_in_both_fidelities() {
    let script = "function init() { takeoff(500); x = -pos.x; y = -pos.y } \
                  function step() { neighbors.broadcast(\"here\", 1) goto(x, y) }";
    let more = "duration = 50\n[[robots]]\ncount = 6\nplacement = \"circle\"\nradius = 1200";
    for fidelity in FIDELITIES {
        let (summary, _) = fly("swap", fidelity, "", script, more);
        assert!(summary.statistics.crashes >= 2, "{fidelity} without avoidance");
        let (summary, poses) = fly("swap", fidelity, ", avoidance = 250", script, more);
        assert_eq!(summary.statistics.crashes, 0, "{fidelity}");
        let [from, to] = [poses[0], poses[poses.len() - 1]];
        let missed = (from[0] + to[0]).hypot(from[1] + to[1]);
        assert!(missed < 150.0, "{fidelity}: {missed} mm from the goal");
    }
}

/// A flight controller needs a position. An error at the key says which ones there are; if the key
/// belongs to another section than `fidelity`, the world refuses the model.
#[test]
fn flight_without_a_position_is_refused() {
    let folder = folder("no-position", &[("script.bzz", "function step() { }")]);
    let text = |body: &str, model: &str| {
        format!(
            "[world]\nsize = [2000, 2000]\nduration = 1\n{body}[[robots]]\nrobot = \"crazyflie\"\n\
             script = \"script.bzz\"\nmodel = {{ fidelity = \"flight\"{model} }}\n"
        )
    };
    let wrong = text("", ", positioning = \"none\"");
    let models = bittybuzz_robot_models::all();
    let errors = Scenario::parse(&wrong, "test.toml", &folder, &[], &models).unwrap_err();
    let report = errors[0].to_string();
    assert!(report.contains("`positioning` cannot be \"none\""), "{report}");
    assert_eq!(errors[0].place.as_ref().map(|place| place.line), Some(7));

    let wrong = text("[body.crazyflie]\npositioning = \"none\"\n", "");
    let (scenario, programs) = read(&folder, &wrong);
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let error = Simulation::new(setup, 1, 1).err().unwrap().to_string();
    assert!(error.contains("crazyflie.positioning"), "{error}");
    assert!(error.contains("flow, loco, lighthouse or capture"), "{error}");
}

/// The limits that people write to a robot's flash hold in the simulated flight as on the image.
#[test]
fn a_robot_stays_within_the_settings_in_its_flash() {
    let script = "
n = 0
function step() {
    n = n + 1
    if(n == 1) takeoff(1000)
    if(n > 60) goto(2000, -1000, 1500)
}
";
    let more = "duration = 30\n[[robots]]\npositions = [[0, 0]]\nheading = 0\n\
                settings = [\"height_mm=700\", \"speed_mm_s=400\", \"fence_front_mm=600\", \
                \"fence_right_mm=100\"]";
    let (_, poses) = fly("settings", "flight", "", script, more);
    let end = poses.last().unwrap();
    assert!(distance(end, &[600.0, -100.0, 700.0, 0.0]) < 60.0, "{end:?}");
    let steps = poses.windows(2).map(|pair| distance(&pair[0], &pair[1]));
    let speed_mm_s = 10.0 * steps.fold(0.0, f32::max);
    assert!(speed_mm_s < 700.0, "{speed_mm_s}");
    let highest = poses.iter().map(|pose| pose[2]).fold(0.0, f32::max);
    assert!(highest < 750.0, "{highest}");
}
