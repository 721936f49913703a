//! Values in tables: their readings, units and curves, and every error with its place.

use super::{Expected, expect_errors};
use crate::*;

const RIGHT: &str = r#"name = "rover"

[body]
drive = "differential"
radius_mm = 40
wheel_distance_mm = 60
speed_mm_s = 150

[[sensor]]
name = "ring"
kind = "proximity"
directions_deg = [0, 90, 180]
range_mm = 100

[[sensor]]
name = "gps"
kind = "positioning"
noise = 2
heading_noise_deg = 1

[[sensor]]
name = "cell"
kind = "battery"
full_mv = 4000
empty_mv = 3000
minutes = 30

[[function]]
name = "debug.print"
accepts = ["values: any..."]
logs = true
help = "write to the log"

[[value]]
name = "pose.position.x"
reads = "gps.x cm"
help = "cm"

[[value]]
name = "pose.yaw"
reads = "gps.heading rad"
help = "rad"

[[value]]
name = "proximity[].value"
reads = "ring"
curve = [[0, 1.0], [100, 0]]
help = "0 to 1"

[[value]]
name = "proximity[].angle"
is = [0.0, 1.55, 3.05]
help = "rad"

[[value]]
name = "cells[]"
reads = ["cell V", "cell V"]
returns = "number"
help = "V"

[[value]]
name = "debug.queue.total"
is = 0
help = "messages"

[[value]]
name = "spots[].size"
is = 2.5
count = 4
help = "cm"
"#;

fn right() -> Robot {
    Robot::parse(RIGHT, "rover.toml").unwrap()
}

fn reading<'a>(robot: &'a Robot, name: &str) -> &'a ValueReading {
    let function = robot.function(name).unwrap();
    assert!(function.is_reader());
    function.effect.as_ref().unwrap().fills.as_ref().unwrap()
}

#[test]
fn values_are_read() {
    let robot = right();
    let elements: Vec<_> =
        robot.values.iter().map(|value| (value.path.text(), value.elements)).collect();
    assert_eq!(
        elements,
        [
            ("pose.position.x", None),
            ("pose.yaw", None),
            ("proximity[].value", Some(3)),
            ("proximity[].angle", Some(3)),
            ("cells[]", Some(2)),
            ("debug.queue.total", None),
            ("spots[].size", Some(4)),
        ]
    );
    let angles = [0.0, 1.55, 3.05].map(ValueConstant::Float).to_vec();
    assert_eq!(robot.values[3].source, ValueSource::Constant(angles));
    assert_eq!(robot.values[5].source, ValueSource::Constant(vec![ValueConstant::Int(0)]));
    // 12 mm are 1.2 cm, and 180 degrees are pi.
    let scaled = |name: &str, value: f64| reading(&robot, name).scale.value(value);
    assert!((scaled("pose.position.x", 12.0) - 1.2).abs() < 1e-12);
    assert!((scaled("pose.yaw", 180.0) - std::f64::consts::PI).abs() < 1e-12);
    assert!((scaled("proximity[].value", 25.0) - 0.75).abs() < 1e-12);
    assert!((scaled("cells[]", 3500.0) - 3.5).abs() < 1e-12);
}

/// A value that changes is a function, which takes the number of an element of a list.
#[test]
fn values_that_change_have_a_function() {
    let robot = right();
    let forms = |name: &str| robot.function(name).unwrap().forms().collect::<Vec<_>>();
    assert_eq!(forms("pose.position.x"), ["pose.position.x(): number"]);
    assert_eq!(forms("proximity[].value"), ["proximity[].value(element: int): number"]);
    assert!(robot.function("proximity[].angle").is_none());
    assert!(!robot.function("debug.print").unwrap().is_reader());
    let x = SensorReading { sensor: 1, value: SensorValue::Coordinate(0) };
    assert_eq!(reading(&robot, "pose.position.x").readings, [x]);
    let beam = SensorReading { sensor: 0, value: SensorValue::BeamOfArgument };
    assert_eq!(reading(&robot, "proximity[].value").readings, [beam]);
    assert_eq!(reading(&robot, "cells[]").readings.len(), 2);
}

#[test]
fn every_error_has_its_place() {
    let cases = [
        ("\"pose.yaw\"", "\"pose\"", Expected("BadPath", 40, 8, "as in \"pose.position.x\"")),
        ("\"pose.yaw\"", "\"pose[0].yaw\"", Expected("BadPath", 40, 8, "not the place of a value")),
        ("\"pose.yaw\"", "\"math.yaw\"", Expected("Reserved", 40, 8, "choose another name")),
        (
            "\"pose.yaw\"",
            "\"pose.position.x\"",
            Expected("DuplicateName", 40, 8, "first defined in line 35"),
        ),
        (
            "\"pose.yaw\"",
            "\"pose.position\"",
            Expected("NameIsTable", 40, 8, "the other one is in line 35"),
        ),
        (
            "\"pose.yaw\"",
            "\"pose.position.x.y\"",
            Expected("NameIsTable", 40, 8, "the other one is in line 35"),
        ),
        (
            "\"pose.yaw\"",
            "\"debug.print.count\"",
            Expected("NameIsTable", 40, 8, "`debug.print` is a table"),
        ),
        (
            "\"debug.print\"",
            "\"debug..print\"",
            Expected("BadIdentifier", 29, 8, "cannot be a name"),
        ),
        ("\"gps.x cm\"", "\"gps cm\"", Expected("UnknownSensorValue", 36, 9, "\"gps.heading\"")),
        ("\"gps.x cm\"", "\"gps.w cm\"", Expected("UnknownSensorValue", 36, 9, "\"gps.x\"")),
        ("\"gps.x cm\"", "\"gsp.x\"", Expected("UnknownSensor", 36, 9, "did you mean `gps`?")),
        ("\"gps.x cm\"", "\"gps.x rad\"", Expected("UnknownUnit", 36, 9, "one of mm, cm, m")),
        ("\"gps.x cm\"", "\"ring\"", Expected("UnknownSensorValue", 36, 9, "\"ring.2\"")),
        ("reads = \"gps.x cm\"\n", "", Expected("NoValue", 34, 1, "add `is = 0.0`")),
        ("reads = \"gps.x cm\"", "reads = 1", Expected("WrongType", 36, 9, "must be a string")),
        (
            "reads = \"gps.x cm\"",
            "reads = \"gps.x cm\"\nis = 1",
            Expected("Both", 36, 9, "cannot stand together"),
        ),
        (
            "reads = \"gps.x cm\"",
            "is = [1, 2]",
            Expected("NotAList", 34, 1, "a list has `[]` in its name"),
        ),
        ("is = [0.0, 1.55, 3.05]", "is = [0.0, 1.5]", Expected("OtherCount", 50, 1, "line 44")),
        ("is = [0.0, 1.55, 3.05]", "is = []", Expected("NumberOfElements", 52, 6, "1024")),
        ("is = [0.0, 1.55, 3.05]", "is = [\"a\"]", Expected("WrongType", 52, 7, "a number")),
        ("count = 4\n", "", Expected("NoCount", 66, 1, "add `count = 8`")),
        ("count = 4", "count = 0", Expected("OutOfRange", 69, 9, "from 1 to 1024")),
        (
            "[\"cell V\", \"cell V\"]",
            "[\"cell V\", \"cell mV\"]",
            Expected("UnlikeUnits", 57, 20, "the same unit"),
        ),
        ("returns = \"number\"", "returns = \"table\"", Expected("UnknownWord", 58, 11, "int")),
        ("[100, 0]", "[0, 0]", Expected("BadCurve", 47, 9, "by rising readings")),
        ("[[0, 1.0], [100, 0]]", "[[0, 1.0]]", Expected("BadCurve", 47, 9, "at least two")),
        ("[100, 0]", "[100]", Expected("Length", 47, 20, "a reading and a value")),
        (
            "reads = \"ring\"",
            "reads = \"ring mm\"",
            Expected("CurveWithUnit", 46, 9, "in the unit of the sensor"),
        ),
        (
            "heading_noise_deg = 1",
            "minutes = 1",
            Expected("KeyOfAnother", 19, 11, "heading_noise_deg"),
        ),
    ];
    expect_errors(RIGHT, &cases);
}

#[test]
fn values_need_a_body() {
    let (head, rest) = RIGHT.split_once("[body]").unwrap();
    let (_, values) = rest.split_once("[[value]]").unwrap();
    let text = format!("{head}[[value]]{values}");
    let errors = Robot::parse(&text, "rover.toml").unwrap_err();
    assert!(errors.to_string().contains("`value` has no meaning without a [body]"), "{errors}");
}

#[test]
fn every_prefix_of_a_file_is_read_without_panic() {
    for end in 0..RIGHT.trim_end().len() {
        if let Err(error) = Robot::parse(&RIGHT[..end], "rover.toml") {
            assert!(error.to_string().starts_with("rover.toml:"), "{error}");
        }
    }
}
