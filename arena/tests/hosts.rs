//! Robots of other hosts: each moves, senses and talks by the figures of its file.

use std::f32::consts::PI;
use std::sync::Arc;

use crate::script::{folder, read, run, run_with};
use bittybuzz_arena::engine::Pose;
use bittybuzz_arena::robot::LogLine;
use bittybuzz_arena::run::{Setup, Simulation, Verdict};
use bittybuzz_robot_files::{find, shipped};

/// The robots that drive, and the distance of their wheels in mm.
const WHEELED: [(&str, f32); 3] = [("footbot", 140.0), ("epuck", 53.0), ("khepera", 105.4)];

/// Seconds in which a robot moves: the first tick is that of `init`.
const MOVING: f32 = 5.0;

fn world(robot: &str, more: &str) -> String {
    format!(
        "[world]\nsize = [4000, 4000]\nduration = 5.1\n{more}\n\
         [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\npositions = [[0, 0]]\nheading = 0\n"
    )
}

/// Runs a step again and again on a robot at (0, 0) that looks along x; its pose and LED at the end.
fn end(robot: &str, step: &str) -> (Pose, u8) {
    let script = format!("function init() {{}}\nfunction step() {{ {step} }}\n");
    let folder = folder(&format!("hosts_{robot}"), &[("s.bzz", &script)]);
    let mut end = (Pose::default(), 0);
    let summary = run_with(&folder, &world(robot, ""), 1, |simulation| {
        let view = simulation.view(0).unwrap();
        end = (view.pose, view.led);
    });
    assert!(summary.faults.is_empty(), "{robot}: {:?}", summary.faults);
    end
}

#[track_caller]
fn close(found: f32, expected: f32, tolerance: f32) {
    assert!((found - expected).abs() <= tolerance, "{found} instead of {expected}");
}

/// Wheels at 10 cm/s for 5 s are 500 mm. On the spot, wheels at -1 and 1 cm/s turn the robot by 20 mm per second over the distance
/// of its wheels.
#[test]
fn wheels_are_set_in_cm_per_second() {
    for (robot, wheel_distance_mm) in WHEELED {
        let (pose, _) = end(robot, "set_wheels(10.0, 10.0)");
        close(pose.x, 500.0, 0.1);
        close(pose.y, 0.0, 0.001);
        let (pose, _) = end(robot, "set_wheels(-1, 1)");
        close(pose.heading, 20.0 / wheel_distance_mm * MOVING, 0.001);
        close(pose.x.hypot(pose.y), 0.0, 0.001);
    }
}

/// `goto` and `gotoc` take a vector in cm/s, `gotop` its length and its angle in radians.
#[test]
fn vectors_steer_the_wheels() {
    for (robot, wheel_distance_mm) in WHEELED {
        // Straight on, at most at 10 cm/s, also if the vector is up to 10 degrees aside: 0.17 rad are 9.7 degrees.
        for step in ["goto(3, 0.3)", "gotoc(3, 0.3)", "gotop(3.0149627, 0.1)"] {
            let (pose, _) = end(robot, step);
            close(pose.x, 10.0 * 9.09_f32.sqrt() * MOVING, 0.1);
            close(pose.heading, 0.0, 0.0001);
        }
        close(end(robot, "gotop(50, 0.17)").0.x, 500.0, 0.1);
        // 45 degrees to the left are half of 90: the wheels have half and one and a half times the length of the vector, which is the
        // speed v in the middle. It turns by v over the distance of the wheels.
        let speed = 10.0 * 2.0_f32.sqrt();
        let angle = speed / wheel_distance_mm * MOVING;
        let radius = wheel_distance_mm;
        for (step, side) in [("goto(1, 1)", 1.0), ("gotoc(1, -1)", -1.0)] {
            let (pose, _) = end(robot, step);
            close(pose.heading, angle * side, 0.001);
            close(pose.x, radius * angle.sin(), 0.1);
            close(pose.y, radius * (1.0 - angle.cos()) * side, 0.1);
        }
        // Behind it: on the spot with wheels at 10 cm/s, whatever the length of the vector.
        let (pose, _) = end(robot, "gotop(1, 3)");
        let turned = 200.0 / wheel_distance_mm * MOVING;
        let missing = (turned - pose.heading).rem_euclid(2.0 * PI);
        assert!(!(0.01..=2.0 * PI - 0.01).contains(&missing), "{robot}: {missing}");
        close(pose.x.hypot(pose.y), 0.0, 0.01);
    }
}

/// A call sets the wheels, which keep their speeds while the robot turns: a vector is no place to go to.
#[test]
fn a_vector_lasts_until_the_next_call() {
    let script = "function init() { gotop(5, 0) }\nfunction step() { if(t == nil) t = 0 t = t + 1 if(t == 20) set_wheels(0, 0) }\n";
    let folder = folder("hosts_lasting", &[("s.bzz", script)]);
    let mut x = 0.0;
    run_with(&folder, &world("footbot", ""), 1, |run| x = run.view(0).unwrap().pose.x);
    // From the end of the first tick to the twentieth step: 2 s at 50 mm/s.
    close(x, 100.0, 5.1);
}

#[test]
fn leds_have_eight_colors() {
    for (robot, _) in WHEELED {
        let color = |step| end(robot, step).1;
        assert_eq!(color("set_leds(255, 0, 255)"), 1 + 4, "{robot}");
        assert_eq!(color("set_leds(255, 0, 255) set_leds(0, 10, 0)"), 2, "{robot}");
    }
    for robot in ["footbot", "epuck"] {
        assert_eq!(end(robot, "set_led(3, 0, 255, 255)").1, 2 + 4, "{robot}");
    }
}

/// Each sensor by the figures of its file: functions that read them are added to the file.
#[test]
fn sensors_measure_from_their_places() {
    // A wall 50 mm before the rim, and a lamp 1 m behind in a world without daylight.
    for (name, radius_mm, beams, lights) in [
        // Beams at 7.5 and 22.5 degrees, and behind: the way along the beam is longer than that straight ahead.
        ("footbot", 85.036_758, [(0, 7.5), (1, 22.5), (12, 187.5)], [(0, 7.5), (12, 187.5)]),
        ("epuck", 35.0, [(0, 17.0), (1, 50.0), (7, 343.0)], [(0, 22.5), (3, 157.5)]),
        ("khepera", 70.4, [(0, 0.0), (1, 45.0), (4, 180.0)], [(0, 0.0), (2, 90.0)]),
    ] {
        let file = shipped().iter().find(|file| file.name == name).unwrap().text;
        let functions: String = ["proximity", "light", "battery"]
            .into_iter()
            .map(|sensor| {
                let list = if sensor == "battery" { "" } else { "beam: int" };
                format!(
                    "\n[[function]]\nname = \"read_{sensor}\"\naccepts = [\"{list}\"]\n\
                     returns = \"number\"\nreads = \"{sensor}\"\nhelp = \"a test\"\n"
                )
            })
            .collect();
        let range_mm = if name == "khepera" { 120.0_f64 } else { 100.0 };
        let mut script = "function step() {\n  b = read_battery()\n".to_owned();
        // 5 s of 10,000 s.
        let mut expectations = expect("b", 1000.0 * (1.0 - 5.0 / 10_000.0), 0.02);
        for (beam, direction_deg) in beams {
            let along = (radius_mm + 50.0) / f64::to_radians(direction_deg).cos() - radius_mm;
            // Nothing is near: one more than the range, where the curve of the table ends.
            let way = if (0.0..=range_mm).contains(&along) { along } else { range_mm + 1.0 };
            script += &format!("  p{beam} = read_proximity({beam})\n");
            expectations += &expect(&format!("p{beam}"), way, 0.1);
        }
        for (beam, direction_deg) in lights {
            // 1023 e^(-2 m), times 1 - angle / 180 degrees.
            // The lamp is behind the robot, because the wall in front of it casts a shadow.
            let off_deg = 180.0 - f64::min(direction_deg, 360.0 - direction_deg);
            let value = 1023.0 * f64::exp(-2.0) * (1.0 - off_deg / 180.0);
            script += &format!("  l{beam} = read_light({beam})\n");
            expectations += &expect(&format!("l{beam}"), value, 0.1);
        }
        let files =
            [("s.bzz", &*(script + "}\n")), ("mine.toml", &*(file.to_owned() + &functions))];
        let folder = folder(&format!("hosts_senses_{name}"), &files);
        let wall = radius_mm + 50.0;
        let things = format!(
            "ambient = 0\nlights = [[-1000, 0]]\nobstacles = [{{ from = [{wall}, -900], to = [{wall}, 900] }}]"
        );
        let summary = run(&folder, &(world("mine.toml", &things) + &expectations));
        assert!(summary.faults.is_empty(), "{name}: {:?}", summary.faults);
        for convergence in &summary.convergences {
            assert_eq!(convergence.verdict, Verdict::Held, "{name}: {convergence:?}");
        }
    }
}

fn expect(global: &str, value: f64, tolerance: f64) -> String {
    format!(
        "\n[[expect]]\nat = 5\nvalue = \"global.{global}\"\nequals = {value}\ntolerance = {tolerance}\n"
    )
}

/// Two robots hear each other up to the range of their link and not beyond, and get the distance in the unit of their host: cm in
/// ARGoS, m in HiveMind.
#[test]
fn robots_talk_within_their_range() {
    for (robot, range_mm, unit_mm) in [
        ("footbot", 3000, 10.0),
        ("epuck", 800, 10.0),
        ("khepera", 3000, 10.0),
        ("hiveboard", 10_000, 1000.0),
    ] {
        let script = "n = 0 d = 0\n\
                      function init() { neighbors.listen(\"x\", function(t, v, i) {\n\
                      n = n + v d = neighbors.get(i).distance }) }\n\
                      function step() { neighbors.broadcast(\"x\", 1) }\n";
        let folder = folder(&format!("hosts_talk_{robot}"), &[("s.bzz", script)]);
        for (apart, heard) in [(range_mm - 50, "above = 30"), (range_mm + 50, "equals = 0")] {
            // Floats of 16 bits have 10 bits of fraction: an error of less than 1 in 1000.
            let distance = if apart < range_mm { f64::from(apart) / unit_mm } else { 0.0 };
            let tolerance = 0.001 * distance;
            let text = format!(
                "[world]\nsize = [25000, 25000]\nduration = 5\n\
                 [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\npositions = [[0, 0], [{apart}, 0]]\n\
                 [[expect]]\nat = 5\nvalue = \"global.n\"\nof = \"min\"\n{heard}\n\
                 [[expect]]\nat = 5\nvalue = \"global.d\"\nof = \"min\"\nequals = {distance}\ntolerance = {tolerance}\n"
            );
            let summary = run(&folder, &text);
            assert!(summary.faults.is_empty(), "{robot}: {:?}", summary.faults);
            for convergence in &summary.convergences {
                assert_eq!(convergence.verdict, Verdict::Held, "{robot} {apart}: {convergence:?}");
            }
        }
    }
}

/// Scripts of the form that users of these hosts publish, which call the functions of the host and read none of its tables.
#[test]
fn scripts_with_the_functions_of_a_host_start() {
    let wheeled = "
        function flee(rid, data, sum) {
          return { .x = sum.x - math.cos(data.azimuth) / data.distance, .y = sum.y - math.sin(data.azimuth) / data.distance }
        }
        function init() { set_leds(0, 0, 255) if(camera_enable) { camera_enable() } }
        function step() {
          var away = neighbors.reduce(flee, { .x = 0.0, .y = 0.0 })
          if(neighbors.count() > 0) { gotoc(1000.0 * away.x, 1000.0 * away.y) }
          else { gotop(5.0, math.pi / 8.0) }
        }\n";
    let gripping = "
        function init() { turret_enable() turret_set(0.5) gripper_unlock() }
        function step() { set_wheels(5.0, 4.5) set_led(0, 255, 0, 0) }
        function reset() { turret_disable() camera_disable() gripper_lock() }\n";
    let board = "
        function move(x, y) { call_host_function(id, \"moveBy\", { .0 = x, .1 = y }) }
        function init() { register_closure(\"halt\", function() { move(0.0, 0.0) }, {}, nil) }
        function step() { move(1.0, -0.5) call_buzz_function(2, \"halt\", {}) }\n";
    for (robot, script, lines) in [
        ("footbot", wheeled, &["camera_enable()"][..]),
        ("epuck", wheeled, &[]),
        ("khepera", wheeled, &[]),
        ("footbot", gripping, &["turret_enable()", "turret_set(0.500000)", "gripper_unlock()"]),
        (
            "hiveboard",
            board,
            &[
                "register_closure(\"halt\", [closure], [table with 0 elems], [nil])",
                "call_host_function(0, \"moveBy\", [table with 2 elems])",
                "call_buzz_function(2, \"halt\", [table with 0 elems])",
            ],
        ),
    ] {
        let folder = folder(&format!("hosts_script_{robot}"), &[("s.bzz", script)]);
        let text =
            world(robot, "").replace("positions = [[0, 0]]", "positions = [[0, 0], [300, 0]]");
        let (scenario, programs) = read(&folder, &text);
        let setup = Arc::new(Setup::new(scenario, programs).unwrap());
        let mut run = Simulation::new(setup.clone(), 1, 1).unwrap();
        while !run.is_over() {
            run.tick().unwrap();
        }
        assert!(run.summary().faults.is_empty(), "{robot}: {:?}", run.summary().faults);
        let shown = |line: &LogLine| {
            let mut text = Vec::new();
            let symbols = setup.program(line.program).unwrap().symbols.as_deref();
            for piece in &line.pieces {
                piece.append_to(symbols, &mut text);
            }
            String::from_utf8(text).unwrap()
        };
        let log = run.take_log();
        let of_first = log.iter().filter(|(robot, _)| *robot == 0).map(|(_, line)| shown(line));
        assert_eq!(of_first.take(lines.len()).collect::<Vec<_>>(), lines, "{robot}");
    }
}

/// A board without motors stays where it is, whatever it asks its host.
#[test]
fn a_hiveboard_stays() {
    let (pose, led) = end("hiveboard", "call_host_function(id, \"moveBy\", { .0 = 1.0 })");
    assert_eq!((pose, led), (Pose::default(), 0));
    assert_eq!(find("hiveboard").unwrap().tick_hz, 10);
}
