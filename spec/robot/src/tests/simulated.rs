//! Bodies, sensors and effects of functions: their meaning, and every error with its place.

use super::{Expected, errors_of, expect_errors, lines_of, spoiled};
use crate::*;

/// A robot that only a description defines, and in which each case below spoils one place. The fuzz
/// target of robot files starts from it, too.
const RIGHT: &str = include_str!("rover.toml");

fn right() -> Robot {
    Robot::parse(RIGHT, "rover.toml").unwrap()
}

#[test]
fn a_description_needs_no_sizes() {
    let robot = right();
    assert_eq!((robot.title.as_str(), robot.profile), ("rover", NumberProfile::Full));
    assert_eq!((robot.tick_hz, robot.message_bytes), (10, 48));
    assert_eq!(robot.vm.memory, robot.least_memory());
    assert!(robot.vm.slots >= 400 && robot.vm.neighbors > 0);
    // A robot with a chip has no defaults for these keys.
    let errors = errors_of(&RIGHT.replacen("\n\n", "\nchip = \"STM32F051C8\"\n\n", 1));
    let missing: Vec<String> = errors.0.iter().map(ToString::to_string).collect();
    let keys = ["title", "profile", "tick_hz", "message_bytes", "vm"];
    assert_eq!(missing, keys.map(|key| format!("the file has no `{key}`")));
}

#[test]
fn a_body_and_its_sensors_are_read() {
    let robot = right();
    let body = robot.body.unwrap();
    let drive =
        DriveSpec::Differential { wheel_distance_mm: 60.0, speed_mm_s: 150.0, steering: None };
    assert_eq!((body.drive, body.radius_mm, body.height_mm), (drive, 40.0, 80.0));
    assert_eq!((body.gain_error, body.noise), (0.0, 0.05));
    let most_turn = drive.most(ActuatorQuantity::Turn).unwrap();
    assert!((most_turn - 286.478_9).abs() < 0.001, "{most_turn}");
    let [ring, radio, cell] = robot.sensors.as_slice() else { panic!("{:?}", robot.sensors) };
    let directions_deg = vec![0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0];
    let kind = SensorKind::Proximity { directions_deg, range_mm: 300.0, nothing: 300.0 };
    assert_eq!((&ring.kind, ring.noise, ring.rate_hz), (&kind, 5.0, None));
    let unit = DistanceUnit::Millimeter;
    let link = SensorKind::RangeAndBearing { range_mm: 2000.0, bearing_noise_deg: 0.0, unit };
    assert_eq!(radio.kind, link);
    let battery = SensorKind::Battery { full_mv: 4200.0, empty_mv: 3300.0, minutes: 30.0 };
    assert_eq!(cell.kind, battery);
}

#[test]
fn neighbors_are_measured_in_the_unit_of_the_link() {
    assert_eq!(right().neighbor_unit().name(), "mm");
    for (unit, mm) in [("mm", 1.0), ("cm", 10.0), ("m", 1000.0)] {
        let range = "range_mm = 2000";
        let text = spoiled(RIGHT, range, &format!("{range}\nunit = \"{unit}\""));
        let found = Robot::parse(&text, "rover.toml").unwrap().neighbor_unit();
        assert_eq!((found.name(), found.mm()), (unit, mm));
    }
    let cases = [(
        "range_mm = 2000",
        "range_mm = 2000\nunit = \"km\"",
        Expected("UnknownWord", 21, 8, "mm"),
    )];
    expect_errors(RIGHT, &cases);
}

#[test]
fn drives_and_their_quantities() {
    for (keys, drive, quantities) in [
        (
            "drive = \"unicycle\"\nturn_deg_s = 90",
            DriveSpec::Unicycle { speed_mm_s: 150.0, turn_deg_s: 90.0 },
            "forward turn",
        ),
        (
            "drive = \"slip-stick\"\nturn_deg_s = 45",
            DriveSpec::SlipStick { speed_mm_s: 150.0, turn_deg_s: 45.0 },
            "left_motor right_motor",
        ),
        (
            "drive = \"quadrotor\"\nturn_deg_s = 90\nclimb_mm_s = 500",
            DriveSpec::Quadrotor {
                speed_mm_s: 150.0,
                climb_mm_s: 500.0,
                turn_deg_s: 90.0,
                lag_s: 0.2,
                crash_speed_mm_s: 0.0,
            },
            "forward leftward upward turn height",
        ),
    ] {
        let (head, _) = RIGHT.split_once("\n[[function]]").unwrap();
        let head = head.replacen("drive = \"differential\"", keys, 1);
        let text = head.replacen("wheel_distance_mm = 60\n", "", 1);
        let robot = Robot::parse(&text, "rover.toml").unwrap();
        let name = drive.name();
        assert_eq!(robot.body.unwrap().drive, drive, "{name}");
        let names: Vec<&str> = drive.quantities().iter().map(|quantity| quantity.name()).collect();
        assert_eq!(names.join(" "), quantities, "{name}");
        for quantity in drive.quantities() {
            let is_limited = *quantity != ActuatorQuantity::Height;
            assert_eq!(drive.most(*quantity).is_some(), is_limited, "{name} {quantity:?}");
        }
    }
}

#[test]
fn calls_set_quantities() {
    let robot = right();
    let values = |name: &str, list: usize, arguments: &[f64]| -> Vec<(ActuatorQuantity, f64)> {
        let function = robot.function(name).unwrap();
        let effect = function.effect.as_ref().unwrap();
        effect.values(&function.accepts[list], arguments).collect()
    };
    let wheels = [(ActuatorQuantity::LeftWheel, 70.0), (ActuatorQuantity::RightWheel, 75.0)];
    assert_eq!(values("wheels", 0, &[7.0, 127.5]), wheels);
    assert_eq!(
        values("stop", 0, &[]),
        [(ActuatorQuantity::Forward, 0.0), (ActuatorQuantity::Turn, 0.0)]
    );
    assert_eq!(values("led", 0, &[5.0]), [(ActuatorQuantity::Color, 5.0)]);
    assert_eq!(
        values("led", 1, &[50.0, 10.0]),
        [(ActuatorQuantity::Red, 0.5), (ActuatorQuantity::Green, -0.1)]
    );
    assert_eq!(values("print", 0, &[1.0]), []);
    let shown = |name: &str| -> Vec<String> {
        let effect = robot.function(name).unwrap().effect.as_ref().unwrap();
        effect.sets.iter().map(ToString::to_string).collect()
    };
    let right = format!("right_wheel = {} * right mm/s", 150.0 / 255.0);
    assert_eq!(shown("wheels"), ["left_wheel = 10 * left mm/s", &right]);
    assert_eq!(shown("stop"), ["forward = 0 mm/s", "turn = 0 deg/s"]);
    assert_eq!(shown("led"), ["color = color", "red = 0.01 * red", "green = -0.01 * green"]);
}

#[test]
fn functions_read_sensors() {
    let robot = right();
    let reading = |name: &str| {
        let effect = robot.function(name).unwrap().effect.as_ref().unwrap();
        effect.reads.map(|reading| (robot.sensors[reading.sensor].name.as_str(), reading.value))
    };
    assert_eq!(reading("distance"), Some(("ring", SensorValue::BeamOfArgument)));
    assert_eq!(reading("ahead"), Some(("ring", SensorValue::Beam(0))));
    assert_eq!(reading("nearest"), Some(("radio", SensorValue::NearestBearing)));
    assert_eq!(reading("volts"), Some(("cell", SensorValue::Only)));
    assert_eq!(reading("print"), None);
    assert!(robot.function("print").unwrap().effect.as_ref().unwrap().logs);
}

#[test]
fn a_ground_sensor_has_a_place() {
    let with = |keys: &str| {
        let text =
            RIGHT.replacen("[[function]]", &format!("[[sensor]]\n{keys}\n\n[[function]]"), 1);
        Robot::parse(&text, "rover.toml").map(|robot| robot.sensors.last().unwrap().kind.clone())
    };
    let floor = "name = \"floor\"\nkind = \"ground\"";
    for (place, at_mm) in [("", [0.0, 0.0]), ("at_mm = [30.5, -10]", [30.5, -10.0])] {
        assert_eq!(with(&format!("{floor}\n{place}")).unwrap(), SensorKind::Ground { at_mm });
    }
    for (keys, part) in [
        (format!("{floor}\nat_mm = 30"), "two numbers as [ahead, left]"),
        (format!("{floor}\nat_mm = [30]"), "two numbers as [ahead, left]"),
        (format!("{floor}\nat_mm = [30, 10001]"), "from -10000 to 10000"),
        (
            "name = \"eye\"\nkind = \"light\"\nat_mm = [30, 0]".to_owned(),
            "\"light\" has no `at_mm`",
        ),
    ] {
        let errors = with(&keys).unwrap_err().to_string();
        assert!(errors.contains(part), "{errors}");
    }
}

#[test]
fn every_error_has_its_place() {
    // The replaced text (its first occurrence), the new text, and the error.
    let cases = [
        ("\"differential\"", "\"diferential\"", Expected("UnknownWord", 4, 9, "did you mean")),
        ("radius_mm", "radius", Expected("UnknownKey", 5, 1, "did you mean `radius_mm`?")),
        ("radius_mm = 40\n", "", Expected("MissingKey", 3, 1, "[body] has no `radius_mm`")),
        ("drive = \"differential\"\n", "", Expected("MissingKey", 3, 1, "[body] has no `drive`")),
        ("speed_mm_s = 150\n", "", Expected("MissingKey", 3, 1, "has no `speed_mm_s`")),
        ("radius_mm = 40", "radius_mm = 0", Expected("OutOfRange", 5, 13, "from 1 to 10000")),
        ("speed_mm_s = 150", "speed_mm_s = -1", Expected("OutOfRange", 7, 14, "from 0")),
        ("noise = 0.05", "noise = 5", Expected("OutOfRange", 8, 9, "from 0 to 1")),
        (
            "noise = 0.05",
            "lag_s = 1",
            Expected("KeyOfAnother", 8, 9, "it has drive, radius_mm, height_mm"),
        ),
        ("\"proximity\"", "\"proximty\"", Expected("UnknownWord", 12, 8, "did you mean")),
        ("\"proximity\"", "\"sonar\"", Expected("UnknownWord", 12, 8, "one of proximity, light")),
        ("count = 8", "count = 0", Expected("OutOfRange", 13, 9, "from 1 to 360")),
        ("count = 8", "directions_deg = []", Expected("NumberOfBeams", 13, 18, "1 to 360 beams")),
        (
            "count = 8",
            "count = 2\ndirections_deg = [0, 90]",
            Expected("Both", 13, 9, "`count` and `directions_deg` cannot stand together"),
        ),
        ("count = 8", "directions_deg = [999]", Expected("OutOfRange", 13, 19, "360")),
        ("range_mm = 300\n", "", Expected("MissingKey", 10, 1, "[[sensor]] has no `range_mm`")),
        (
            "noise = 5",
            "minutes = 5",
            Expected("KeyOfAnother", 15, 11, "\"proximity\" has no `minutes`"),
        ),
        ("noise = 5", "noise = -5", Expected("OutOfRange", 15, 9, "cannot be -5")),
        ("noise = 5", "rate_hz = 0", Expected("OutOfRange", 15, 11, "from 0.01")),
        ("noise = 5", "nothing = 40000", Expected("OutOfRange", 15, 11, "to 32767")),
        ("\"ring\"", "\"the ring\"", Expected("BadIdentifier", 11, 8, "cannot be a name")),
        ("\"cell\"", "\"ring\"", Expected("DuplicateName", 23, 8, "first defined in line 11")),
        (
            "name = \"cell\"",
            "name = \"spare\"\nkind = \"range-and-bearing\"\nrange_mm = 9\n[[sensor]]\nname = \"cell\"",
            Expected("SecondLink", 24, 8, "the other one is in line 17"),
        ),
        ("empty_mv = 3300", "empty_mv = 4300", Expected("OutOfRange", 26, 12, "from 0 to 4200")),
        (
            "sets = { forward = 0, turn = 0 }\n",
            "",
            Expected("NoEffect", 35, 1, "`stop` has no effect in the simulator"),
        ),
        ("{ forward = 0, turn = 0 }", "{}", Expected("SetsNothing", 38, 8, "names no quantity")),
        ("{ forward = 0, turn = 0 }", "1", Expected("WrongType", 38, 8, "must be a table")),
        ("forward = 0", "foward = 0", Expected("UnknownKey", 38, 10, "did you mean `forward`?")),
        ("forward = 0", "forward = []", Expected("WrongType", 38, 20, "must be a number")),
        (
            "forward = 0",
            "height = 0",
            Expected("NotOfDrive", 38, 19, "one of left_wheel, right_wheel, forward, turn, color"),
        ),
        ("forward = 0", "forward = \"*\"", Expected("UnknownUnit", 38, 20, "has no unit `*`")),
        ("forward = 0", "forward = \"8up\"", Expected("BadAmount", 38, 20, "write 80, \"speed\"")),
        (
            "forward = 0",
            "forward = \"speed\"",
            Expected("UnknownParameter", 38, 20, "it takes no argument: write a number"),
        ),
        ("\"left cm/s\"", "\"lef cm/s\"", Expected("UnknownParameter", 32, 23, "mean `left`?")),
        ("\"left cm/s\"", "\"left km/s\"", Expected("UnknownUnit", 32, 23, "did you mean")),
        ("\"left cm/s\"", "\"left of 0\"", Expected("UnknownUnit", 32, 23, "one of mm/s, cm/s")),
        ("\"color\"", "\"color %\"", Expected("UnknownUnit", 44, 18, "write the value alone")),
        (
            "right: number",
            "right: number...",
            Expected("NoNumber", 32, 50, "`right: number...` is"),
        ),
        ("left: number", "left: any", Expected("NoNumber", 32, 23, "must be int or number")),
        (
            "green: int\"",
            "gren: int\"",
            Expected("UnknownParameter", 44, 50, "did you mean `gren`?"),
        ),
        (
            "accepts = [\"left: number, right: number\"]",
            "accepts = [\"left: number, right: number\", \"\"]",
            Expected("ListSetsNothing", 32, 8, "a call with the arguments () sets nothing"),
        ),
        (
            "reads = \"ring\"\n",
            "",
            Expected("NoEffect", 47, 1, "add `sets = { QUANTITY = \"PARAMETER\" }`"),
        ),
        (
            "sets = { forward = 0, turn = 0 }",
            "sets = { forward = 0 }\nreturns = \"int\"",
            Expected("ReturnsNothingRead", 39, 11, "or remove `returns`"),
        ),
        ("returns = \"int\"\n", "", Expected("ReadsWithoutResult", 50, 9, "add `returns")),
        ("\"int\"\nreads", "\"string\"\nreads", Expected("ReadsWithoutResult", 51, 9, "no number")),
        ("reads = \"ring\"", "reads = \"rng\"", Expected("UnknownSensor", 51, 9, "mean `ring`?")),
        ("reads = \"ring\"", "reads = 3", Expected("WrongType", 51, 9, "must be a string")),
        ("\"ring.0\"", "\"ring.8\"", Expected("UnknownSensorValue", 58, 9, "\"ring.7\"")),
        ("\"radio.bearing\"", "\"radio\"", Expected("UnknownSensorValue", 65, 9, "several values")),
        (
            "\"radio.bearing\"",
            "\"radio.angle\"",
            Expected("UnknownSensorValue", 65, 9, "one of \"radio.distance\", \"radio.bearing\""),
        ),
        ("\"cell\"\nhelp", "\"cell.x\"\nhelp", Expected("UnknownSensorValue", 72, 9, "\"cell\"")),
        (
            "\"beam: int\"",
            "\"\"",
            Expected("WhichBeam", 51, 9, "a beam from \"ring.0\" to \"ring.7\""),
        ),
        ("logs = true", "logs = 1", Expected("WrongType", 78, 8, "must be true or false")),
        (
            "logs = true",
            "logs = false\nreturns = \"int\"",
            Expected("ReturnsNothingRead", 79, 11, ""),
        ),
    ];
    expect_errors(RIGHT, &cases);
}

/// The rover with a rule for vectors, a function for each form of a vector, and a ring of light
/// sensors.
fn steered() -> String {
    let rule = "\n[body.steering]\nno_turn_deg = 10\nsoft_turn_deg = 70\nhard_turn_deg = 90\nspeed_mm_s = 100\n";
    let light = "[[sensor]]\nname = \"eyes\"\nkind = \"light\"\ndirection_deg = 45\ncount = 4\n\n";
    let function = |name: &str, accepts: &str, effect: &str| {
        format!(
            "\n[[function]]\nname = \"{name}\"\naccepts = [\"{accepts}\"]\n{effect}\nhelp = \"a test\"\n"
        )
    };
    let parts = "steers = { forward = \"x cm/s\", leftward = \"-y m/s\" }";
    let polar = "steers = { speed = 80, direction = \"a rad\" }";
    [
        light.to_owned(),
        function("toward", "x: number, y: number", parts),
        function("turn", "a: number", polar),
        function("bright", "eye: int", "returns = \"int\"\nreads = \"eyes\""),
        function("left", "", "returns = \"int\"\nreads = \"eyes.1\""),
        rule.to_owned(),
    ]
    .iter()
    .fold(RIGHT.to_owned() + "\n", |text, part| text + part)
}

#[test]
fn functions_steer_along_a_vector() {
    let robot = Robot::parse(&steered(), "rover.toml").unwrap();
    let rule =
        Steering { hard_turn_deg: 90.0, soft_turn_deg: 70.0, no_turn_deg: 10.0, speed_mm_s: 100.0 };
    assert_eq!(robot.body.as_ref().unwrap().drive.steering(), Some(rule));
    let vector = |name: &str, arguments: &[f64]| {
        let function = robot.function(name).unwrap();
        let steers = function.effect.as_ref().unwrap().steers.as_ref().unwrap();
        let parts = steers.amounts().map(|part| part.value(&function.accepts[0], arguments));
        (parts.map(Option::unwrap), steers.to_string())
    };
    let toward = "forward = 10 * x mm/s, leftward = -1000 * y mm/s";
    assert_eq!(vector("toward", &[3.0, 0.5]), ([30.0, -500.0], toward.to_owned()));
    // Half a turn is 180 degrees.
    let ([speed, direction], shown) = vector("turn", &[std::f64::consts::PI]);
    assert_eq!((speed, direction.round()), (80.0, 180.0));
    assert!(shown.starts_with("speed = 80 mm/s, direction = 57.29"), "{shown}");
}

#[test]
fn light_in_several_directions_has_a_value_for_each() {
    let robot = Robot::parse(&steered(), "rover.toml").unwrap();
    let eyes = robot.sensors.iter().find(|sensor| sensor.name == "eyes").unwrap();
    assert_eq!(eyes.kind.beams_deg(), [45.0, 135.0, 225.0, 315.0]);
    let reads = |name: &str| robot.function(name).unwrap().effect.as_ref().unwrap().reads;
    let values = ["bright", "left"].map(|name| reads(name).unwrap().value);
    assert_eq!(values, [SensorValue::BeamOfArgument, SensorValue::Beam(1)]);
}

#[test]
fn every_error_of_steering_has_its_place() {
    let text = steered();
    // The lines of the functions, and of the rule, follow those of the rover.
    let line = |wanted: &str| text.lines().position(|line| line.contains(wanted)).unwrap() + 1;
    let (parts, polar) = (line("forward = \"x"), line("direction = \"a"));
    let (no, soft, hard) = (line("no_turn"), line("soft_turn"), line("hard_turn"));
    let cases = [
        ("no_turn_deg = 10\n", "", Expected("MissingKey", no - 1, 1, "has no `no_turn_deg`")),
        (
            "no_turn_deg = 10",
            "no_turn_deg = 80",
            Expected("OutOfRange", soft, 17, "from 80 to 180"),
        ),
        ("hard_turn_deg = 90", "hard_turn_deg = 60", Expected("OutOfRange", hard, 17, "from 70")),
        (
            "hard_turn_deg = 90",
            "hard_turn_dg = 90",
            Expected("UnknownKey", hard, 1, "did you mean `hard_turn_deg`?"),
        ),
        ("forward = \"x cm/s\", ", "", Expected("MissingKey", parts, 10, "no `forward`")),
        (
            "leftward = \"-y m/s\"",
            "leftward = \"-y rad\"",
            Expected("UnknownUnit", parts, 43, "one of mm/s, cm/s, m/s"),
        ),
        (
            "forward = \"x cm/s\"",
            "speed = 1, direction = 2",
            Expected("Both", parts, 49, "`leftward` and `direction` cannot stand together"),
        ),
        ("speed = 80, ", "", Expected("MissingKey", polar, 10, "no `speed`")),
        (
            "accepts = [\"a: number\"]",
            "accepts = [\"a: number\", \"\"]",
            Expected("ListSetsNothing", polar, 10, "the arguments () sets nothing"),
        ),
        ("\"eyes.1\"", "\"eyes.4\"", Expected("UnknownSensorValue", line("eyes.1"), 9, "eyes.3")),
    ];
    expect_errors(&text, &cases);
    let unruled = spoiled(&text, &text[text.find("\n[body.steering]").unwrap()..], "");
    let errors = errors_of(&unruled);
    assert_eq!(lines_of(&errors), [parts, polar], "{errors}");
    assert!(errors.to_string().contains("`steers` has no meaning without a [body.steering]"));
    let unicycle = text
        .replacen("drive = \"differential\"", "drive = \"unicycle\"\nturn_deg_s = 90", 1)
        .replacen("wheel_distance_mm = 60\n", "", 1);
    let errors = errors_of(&unicycle).to_string();
    assert!(errors.contains("\"unicycle\" has no `steering`"), "{errors}");
}

#[test]
fn keys_for_the_simulator_need_a_body() {
    let (head, rest) = RIGHT.split_once("[body]").unwrap();
    let (_, sensors) = rest.split_once("[[sensor]]").unwrap();
    let errors = errors_of(&format!("{head}[[sensor]]{sensors}"));
    let is_cause = |error: &RobotError| matches!(error.cause, RobotFileCause::NoBody { .. });
    assert!(errors.0.iter().all(is_cause), "{errors}");
    // The first sensor and every function.
    assert_eq!(errors.0.len(), 9, "{errors}");
    assert!(errors.to_string().contains("`sensor` has no meaning without a [body]"));
}

#[test]
fn all_mistakes_are_reported_in_one_pass() {
    let mut text = RIGHT.to_owned();
    for (from, to) in [
        ("wheel_distance_mm = 60", "wheel_distance_mm = true"),
        ("count = 8", "count = \"8\""),
        ("returns = \"int\"\nreads = \"cell\"", "returns = \"int\"\nreads = \"cel\""),
        ("full_mv", "ful_mv"),
        ("logs = true", "log = true"),
    ] {
        text = spoiled(&text, from, to);
    }
    let errors = errors_of(&text);
    assert_eq!(lines_of(&errors), [6, 13, 25, 75, 78], "{errors}");
}

#[test]
fn every_prefix_of_a_file_is_read_without_panic() {
    for end in 0..RIGHT.trim_end().len() {
        if let Err(error) = Robot::parse(&RIGHT[..end], "rover.toml") {
            assert!(error.to_string().starts_with("rover.toml:"), "{error}");
        }
    }
}

/// The reference for people names every key, every quantity and every value of a sensor.
#[test]
fn the_guide_names_all_keys() {
    const GUIDE: &str = include_str!("../../../../docs/own-robot.md");
    let (_, reference) = GUIDE.split_once("\n## Reference\n").unwrap();
    let names = read::simulator_keys();
    assert!(names.len() > 30, "{names:?}");
    for name in names {
        assert!(reference.contains(&format!("`{name}`")), "docs/own-robot.md lacks `{name}`");
    }
}
