//! Robots that are described by their file alone: motion by formula, sensors against a known world, and errors.

use std::f64::consts::FRAC_PI_2;
use std::fs;

use crate::script::{folder, run_with};
use bittybuzz_arena::engine::Pose;
use bittybuzz_arena::run::Summary;
use bittybuzz_arena::scenario::Scenario;

/// A robot file: a body, sensors, and functions that set all that the drive has.
fn robot(body: &str, functions: &str) -> String {
    format!("name = \"mine\"\n\n[body]\nradius_mm = 30\n{body}\n\n{functions}")
}

fn function(name: &str, accepts: &str, effect: &str) -> String {
    format!(
        "[[function]]\nname = \"{name}\"\naccepts = [\"{accepts}\"]\n{effect}\nhelp = \"a test\"\n\n"
    )
}

const WORLD: &str = "[world]\nsize = [4000, 4000]\nduration = 5\n\
                     [[robots]]\nrobot = \"mine.toml\"\nscript = \"s.bzz\"\npositions = [[0, 0]]\nheading = 0\n";

/// Seconds in which a robot moves: the first of 50 ticks is that of `init`.
const MOVING: f32 = 4.9;

/// Runs a script in a robot at (0, 0) that looks along x, for five seconds; its pose at the end.
fn end(name: &str, robot: &str, step: &str, more: &str) -> (Pose, Summary) {
    let script = format!("function init() {{}}\nfunction step() {{ {step} }}\n");
    let folder = folder(name, &[("s.bzz", &script), ("mine.toml", robot)]);
    let mut pose = Pose::default();
    let text = format!("{WORLD}{more}");
    let summary = run_with(&folder, &text, 1, |simulation| {
        pose = simulation.view(0).unwrap().pose;
    });
    assert!(summary.faults.is_empty(), "{:?}", summary.faults);
    (pose, summary)
}

#[track_caller]
fn close(found: f32, expected: f32, tolerance: f32) {
    assert!((found - expected).abs() <= tolerance, "{found} instead of {expected}");
}

/// Wheels at 50 and 80 mm/s, 60 mm apart: 65 mm/s on a circle, 0.5 rad/s.
#[test]
fn a_differential_drive_goes_round_a_circle() {
    let body = "drive = \"differential\"\nwheel_distance_mm = 60\nspeed_mm_s = 100";
    let sets = "sets = { left_wheel = \"left cm/s\", right_wheel = \"right cm/s\" }";
    let file = robot(body, &function("wheels", "left: number, right: number", sets));
    let (pose, _) = end("differential", &file, "wheels(5, 8)", "");
    let (radius, angle) = (65.0 / 0.5_f32, 0.5 * MOVING);
    close(pose.x, radius * angle.sin(), 0.2);
    close(pose.y, radius * (1.0 - angle.cos()), 0.2);
    close(pose.heading, angle, 0.001);
    // A speed beyond the limit is the limit.
    let (pose, _) = end("differential_limit", &file, "wheels(50, 50)", "");
    close(pose.x, 100.0 * MOVING, 0.1);
}

/// `forward` and `turn` of a differential drive keep each other: 40 mm/s, then 0.5 rad/s as well.
#[test]
fn speed_and_turn_of_wheels_are_set_one_after_the_other() {
    let body = "drive = \"differential\"\nwheel_distance_mm = 60\nspeed_mm_s = 100";
    let functions = function("go", "speed: number", "sets = { forward = \"speed\" }")
        + &function("turn", "rate: number", "sets = { turn = \"rate rad/s\" }");
    let (pose, _) = end("forward_turn", &robot(body, &functions), "go(40) turn(0.5)", "");
    let (radius, angle) = (40.0 / 0.5_f32, 0.5 * MOVING);
    close(pose.x, radius * angle.sin(), 0.2);
    close(pose.y, radius * (1.0 - angle.cos()), 0.2);
}

/// A unicycle at 60 mm/s and 30 degrees per second.
#[test]
fn a_unicycle_goes_round_a_circle() {
    let body = "drive = \"unicycle\"\nspeed_mm_s = 100\nturn_deg_s = 90";
    let file = robot(
        body,
        &function("go", "v: number, w: number", "sets = { forward = \"v\", turn = \"w\" }"),
    );
    let (pose, _) = end("unicycle", &file, "go(60, 30)", "");
    let rate = 30.0_f32.to_radians();
    let angle = rate * MOVING;
    close(pose.x, 60.0 / rate * angle.sin(), 0.2);
    close(pose.y, 60.0 / rate * (1.0 - angle.cos()), 0.2);
    close(pose.heading, angle, 0.001);
}

/// Both motors at half duty: half of the speed. The right motor alone turns it to the left, and it never goes backward.
#[test]
fn slip_stick_motors_drive_and_turn() {
    let body = "drive = \"slip-stick\"\nspeed_mm_s = 20\nturn_deg_s = 40";
    let sets = "sets = { left_motor = \"left of 255\", right_motor = \"right of 255\" }";
    let file = robot(body, &function("motors", "left: int, right: int", sets));
    let (pose, _) = end("slip_stick", &file, "motors(128, 128)", "");
    close(pose.x, 20.0 * 128.0 / 255.0 * MOVING, 0.1);
    let (pose, _) = end("slip_stick_left", &file, "motors(0, 51)", "");
    close(pose.heading, (40.0 * 0.2 * MOVING).to_radians(), 0.001);
    close(pose.x, 0.0, 0.001);
    let (pose, _) = end("slip_stick_back", &file, "motors(-255, -255)", "");
    assert_eq!((pose.x, pose.heading), (0.0, 0.0));
}

/// A velocity v that is reached with a lag of 0.5 s: after t seconds the way is v (t - 0.5 (1 - e^(-t / 0.5))).
#[test]
fn a_quadrotor_follows_with_its_lag_and_keeps_its_height() {
    let body =
        "drive = \"quadrotor\"\nspeed_mm_s = 1000\nclimb_mm_s = 400\nturn_deg_s = 90\nlag_s = 0.5";
    let sets = "sets = { forward = \"v\", leftward = \"v\", height = \"h cm\" }";
    let file = robot(body, &function("fly", "v: number, h: number", sets));
    let (pose, _) = end("quadrotor", &file, "fly(100, 50)", "");
    let way = 100.0 * (MOVING - 0.5 * (1.0 - (-MOVING / 0.5).exp()));
    // It moves in substeps of 20 ms or more, with the velocity at the end of each: at most 100 mm/s for one of them.
    close(pose.x, way, 4.0);
    close(pose.y, way, 4.0);
    close(pose.z, 500.0, 5.0);
}

/// A wall at x = 1000 and a robot at (0, 300): beams ahead, to the left and to the right.
#[test]
fn sensors_measure_the_world() {
    let body = "drive = \"unicycle\"\nspeed_mm_s = 100\nturn_deg_s = 90\n\n\
                [[sensor]]\nname = \"ring\"\nkind = \"proximity\"\ndirections_deg = [0, 90, -90]\nrange_mm = 1500\n\n\
                [[sensor]]\nname = \"eye\"\nkind = \"light\"\n\n\
                [[sensor]]\nname = \"floor\"\nkind = \"ground\"\n\n\
                [[sensor]]\nname = \"cell\"\nkind = \"battery\"\nfull_mv = 4000\nempty_mv = 3000\nminutes = 1\n\n\
                [[sensor]]\nname = \"radio\"\nkind = \"range-and-bearing\"\nrange_mm = 800";
    let read =
        |name: &str, of: &str| function(name, "", &format!("returns = \"int\"\nreads = \"{of}\""));
    let functions = read("ahead", "ring.0")
        + &read("left", "ring.1")
        + &function("beam", "index: int", "returns = \"int\"\nreads = \"ring\"")
        + &read("bright", "eye")
        + &read("ground", "floor")
        + &read("battery", "cell")
        + &read("near", "radio.distance")
        + &read("side", "radio.bearing")
        + &read("count", "radio.count");
    let step = "a = ahead() l = left() r = beam(2) b = bright() g = ground() m = battery() n = near() s = side() c = count()";
    let expect = |global: &str, value: f64, tolerance: f64| {
        format!(
            "[[expect]]\nat = 5\nrobots = 0\nvalue = \"global.{global}\"\nequals = {value}\ntolerance = {tolerance}\n"
        )
    };
    let script = format!(
        "a = 0 l = 0 r = 0 b = 0 g = 0 m = 0 n = 0 s = 0 c = 0\nfunction step() {{ {step} }}\n"
    );
    let folder = folder("sensors", &[("s.bzz", &script), ("mine.toml", &robot(body, &functions))]);
    let world = WORLD.replace(
        "duration = 5\n",
        "duration = 5.1\nambient = 100\nobstacles = [{ from = [1000, -500], to = [1000, 500] }]\nlights = [[0, 1000]]\n",
    );
    let world = world.replace("positions = [[0, 0]]", "positions = [[0, 0], [0, 300], [0, -1900]]");
    let text = [
        world,
        // From the rim, of radius 30 mm; the robot on the left is as wide.
        expect("a", 970.0, 1.0),
        expect("l", 300.0 - 60.0, 1.0),
        // Nothing within range: the range.
        expect("r", 1500.0, 0.0),
        // 1023 e^(-2 m) in all directions, and the daylight.
        expect("b", 100.0 + 1023.0 * (-2.0_f64).exp(), 1.0),
        expect("g", 1023.0, 0.0),
        // 5 s of a minute: a twelfth of 1000 mV.
        expect("m", 4000.0 - 1000.0 / 12.0, 2.0),
        expect("n", 300.0, 1.0),
        expect("s", 90.0, 1.0),
        expect("c", 1.0, 0.0),
    ];
    let mut battery = None;
    let summary = run_with(&folder, &text.concat(), 1, |run| battery = run.battery(0));
    assert!(summary.is_success(), "{:?}\n{:?}", summary.convergences, summary.faults);
    let battery = battery.unwrap();
    close(battery.millivolts.into(), 4000.0 - 5.1 * 1000.0 / 60.0, 1.0);
    close(battery.charge.unwrap(), 1.0 - 5.1 / 60.0, 0.001);
}

/// A robot at (300, -200) that looks along y and drives ahead at 50 mm/s: its tables have the place in the step before it
/// moves, and are new in every step. A wall stands at y = 400.
#[test]
fn tables_are_filled_before_each_step() {
    let body = "drive = \"unicycle\"\nspeed_mm_s = 100\nturn_deg_s = 90\n\n\
                [[sensor]]\nname = \"gps\"\nkind = \"positioning\"\n\n\
                [[sensor]]\nname = \"ring\"\nkind = \"proximity\"\ndirections_deg = [0, 90]\nrange_mm = 1000\n\n\
                [[value]]\nname = \"pose.position.x\"\nreads = \"gps.x m\"\nhelp = \"m\"\n\n\
                [[value]]\nname = \"pose.position.y\"\nreads = \"gps.y m\"\nhelp = \"m\"\n\n\
                [[value]]\nname = \"pose.orientation.yaw\"\nreads = \"gps.heading rad\"\nhelp = \"rad\"\n\n\
                [[value]]\nname = \"proximity[].value\"\nreads = \"ring\"\ncurve = [[0, 1], [1000, 0]]\nhelp = \"1 in contact\"\n\n\
                [[value]]\nname = \"proximity[].angle\"\nis = [0.0, 1.55]\nhelp = \"rad\"";
    let functions = function("go", "v: number", "sets = { forward = \"v\" }")
        + &function("debug.print", "values: any...", "logs = true");
    // 48 steps after the first, each of which is 5 mm further than the one before.
    let script = "n = 0 sum = 0 first = pose.position.x same = 0\n\
                  function init() { old = pose.position }\n\
                  function step() {\n\
                    go(50)\n\
                    n = n + 1\n\
                    sum = sum + pose.position.y - old.y\n\
                    if(old == pose.position) same = same + 1\n\
                    old = pose.position\n\
                    x = pose.position.x y = pose.position.y yaw = pose.orientation.yaw\n\
                    ahead = proximity[0].value left = proximity[1].value angle = proximity[1].angle\n\
                    debug.print(n)\n\
                  }\n";
    let files = [("s.bzz", script), ("mine.toml", &robot(body, &functions))];
    let folder = folder("tables", &files);
    let world = WORLD
        .replace("positions = [[0, 0]]", "positions = [[300, -200]]")
        .replace("heading = 0", "heading = 90")
        .replace(
            "duration = 5\n",
            "duration = 5\nobstacles = [{ from = [-500, 400], to = [900, 400] }]\n",
        );
    let expect = |global: &str, value: f64| {
        format!(
            "[[expect]]\nat = 5\nvalue = \"global.{global}\"\nequals = {value}\ntolerance = 0.001\n"
        )
    };
    // The last step is the 49th, after 48 moves of 5 mm.
    let y = -0.2 + 48.0 * 0.005;
    let text = [
        world,
        expect("n", 49.0),
        expect("first", 0.3),
        expect("sum", 48.0 * 0.005),
        expect("same", 0.0),
        expect("x", 0.3),
        expect("y", y),
        expect("yaw", FRAC_PI_2),
        // From the rim, of radius 30 mm, to the wall.
        expect("ahead", 1.0 - (0.4 - y - 0.03)),
        // Nothing is near.
        expect("left", 0.0),
        expect("angle", 1.55),
    ];
    let summary = run_with(&folder, &text.concat(), 1, |_| ());
    assert!(summary.is_success(), "{:?}\n{:?}", summary.convergences, summary.faults);
}

/// Two robots 500 mm apart hear each other, with distance and direction; one 2 m away does not.
#[test]
fn messages_come_with_range_and_bearing() {
    let radio = "drive = \"unicycle\"\nspeed_mm_s = 100\nturn_deg_s = 90\n\n\
                 [[sensor]]\nname = \"radio\"\nkind = \"range-and-bearing\"\nrange_mm = 800";
    let stop = function("stop", "", "sets = { forward = 0 }");
    let script = "n = 0 d = 0 a = 0\n\
                  function init() { neighbors.listen(\"x\", function(t, v, i) {\n\
                  n = n + 1 d = neighbors.get(i).distance a = neighbors.get(i).azimuth }) }\n\
                  function step() { neighbors.broadcast(\"x\", 1) }\n";
    let expect = |robot: u8, global: &str, test: &str| {
        format!("[[expect]]\nat = 5\nrobots = {robot}\nvalue = \"global.{global}\"\n{test}\n")
    };
    let world = WORLD.replace("positions = [[0, 0]]", "positions = [[0, 0], [0, 500], [1900, 0]]");
    let text = [
        world,
        expect(0, "n", "above = 30"),
        expect(0, "d", "equals = 500\ntolerance = 1"),
        // Radians in the robot's own frame: the other robot is to the left of the first, which looks along x, and the first is to
        // the right of the other.
        expect(0, "a", &format!("equals = {}\ntolerance = 0.01", FRAC_PI_2)),
        expect(1, "a", &format!("equals = {}\ntolerance = 0.01", -FRAC_PI_2)),
        expect(2, "n", "equals = 0"),
    ];
    let folder = folder("radio", &[("s.bzz", script), ("mine.toml", &robot(radio, &stop))]);
    let summary = run_with(&folder, &text.concat(), 1, |_| ());
    assert!(summary.is_success(), "{:?}\n{:?}", summary.convergences, summary.faults);
    // Without the sensor nothing is sent to anybody.
    let silent = robot("drive = \"unicycle\"\nspeed_mm_s = 100\nturn_deg_s = 90", &stop);
    fs::write(folder.join("mine.toml"), silent).unwrap();
    let summary = run_with(&folder, &text[0], 1, |_| ());
    assert_eq!(summary.statistics.all_links().received, 0);
}

/// Mistakes name the file, the line and a cure.
#[test]
fn robots_that_cannot_be_simulated_are_refused() {
    let bodiless =
        "name = \"mine\"\n[[function]]\nname = \"hum\"\naccepts = [\"\"]\nhelp = \"hums\"\n";
    let folder = folder("refused", &[("s.bzz", "function step() {}\n"), ("mine.toml", bodiless)]);
    let errors = |text: &str| -> Vec<String> {
        let read = Scenario::parse(text, "w.toml", &folder, &[], &bittybuzz_robot_models::all());
        let shown = |error: &bittybuzz_arena::scenario::ScenarioError| {
            let place = error
                .place
                .as_ref()
                .map_or(String::new(), |place| format!("{}:{}", place.path, place.line));
            format!("{place}: {error} | {}", error.help().unwrap_or_default())
        };
        read.err().unwrap_or_default().iter().map(shown).collect()
    };
    let found = errors(WORLD);
    assert!(
        found[0].starts_with("w.toml:4: `mine` cannot be simulated") && found[0].contains("[body]"),
        "{found:?}"
    );
    let found = errors(&WORLD.replace("heading = 0\n", "heading = 0\nbody = \"kilobot\"\n"));
    assert!(
        found[0].starts_with("w.toml:5: `hum` of `mine` has no effect")
            && found[0].contains("leave `hum` out"),
        "{found:?}"
    );
    let described =
        robot("drive = \"unicycle\"\nspeed_mm_s = 1\nturn_deg_s = 9", &function("hum", "", ""));
    fs::write(folder.join("mine.toml"), described).unwrap();
    let found = errors(WORLD);
    assert!(found[0].contains("mine.toml:9: ") && found[0].contains("`hum`"), "{found:?}");
}
