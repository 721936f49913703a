//! The scenario of a script that has none: robots of one kind, in rows on a square.

use std::io;
use std::path::{Component, Path, PathBuf};

use bittybuzz_robot_spec::{Medium, Robot, SensorKind};

/// Robots of such a scenario, if their number is not given.
pub const COUNT: u32 = 10;

/// Simulated seconds of such a scenario.
pub const SECONDS: u32 = 60;

/// The distance between two robots, in radii of their body. Light reaches only the next robots, so
/// those that use it stand closer.
const SPACING_RADII: f64 = 12.0;
const SPACING_RADII_OF_LIGHT: f64 = 3.0;

/// The shortest side of a square in mm.
const SIDE_MIN_MM: f64 = 300.0;

/// Returns the text of a scenario. `reference` is the name of the robot, or the path of its file, and
/// `script` the path of the script, both from the folder of the scenario.
pub fn scenario(robot: &Robot, reference: &str, script: &str, count: u32) -> String {
    let spacing = spacing_mm(robot);
    let rows = f64::from(count).sqrt().ceil();
    let side = (spacing * (rows + 1.0)).max(SIDE_MIN_MM);
    // Robots that a person arms would not take off.
    let armed = if has_key(robot, "armed") { "model = { armed = true }\n" } else { "" };
    format!(
        "\
[world]
size = [{side}, {side}]
duration = {SECONDS}

[[robots]]
robot = {}
script = {}
count = {count}
placement = \"grid\"
spacing = {spacing}
{armed}",
        quoted(reference),
        quoted(script),
    )
}

/// Returns true if the robots of such a scenario hear the next ones.
pub fn has_neighbors(robot: &Robot) -> bool {
    let reaches = |kind: &SensorKind| match kind {
        SensorKind::RangeAndBearing { range_mm, .. } => *range_mm >= spacing_mm(robot),
        _ => false,
    };
    robot.vm.neighbors > 0
        && (robot.body.is_none() || robot.sensors.iter().any(|sensor| reaches(&sensor.kind)))
}

/// Returns true if the robot's `model` in scenarios has this key.
fn has_key(robot: &Robot, key: &str) -> bool {
    let models = bittybuzz_robot_models::all();
    let model = models.iter().find(|model| model.robots().contains(&robot.name.as_str()));
    model.is_some_and(|model| model.keys().body.keys.iter().any(|known| known.name == key))
}

fn spacing_mm(robot: &Robot) -> f64 {
    let is_light = robot.link == Some(Medium::Infrared);
    let radii = if is_light { SPACING_RADII_OF_LIGHT } else { SPACING_RADII };
    (radii * radius_mm(robot)).ceil()
}

/// Returns the radius of the robot's body. That of a robot without one does not matter: the scenario
/// is refused.
fn radius_mm(robot: &Robot) -> f64 {
    body_radius_mm(robot).unwrap_or(1.0)
}

/// Returns true if the simulator has a body for the robot.
pub fn is_simulated(robot: &Robot) -> bool {
    body_radius_mm(robot).is_some()
}

/// Returns the radius of the robot's body in mm; `None` if the simulator has no body for it.
pub fn body_radius_mm(robot: &Robot) -> Option<f64> {
    let models = bittybuzz_robot_models::all();
    let model = models.iter().find(|model| model.robots().contains(&robot.name.as_str()));
    let of_model = model.map(|model| f64::from(model.shape().radius_mm));
    robot.body.as_ref().map(|body| body.radius_mm).or(of_model)
}

/// Returns the name of a robot, or the path of its file from `folder`. The command line has the path
/// from the current folder.
pub fn reference(robot: &str, folder: &Path) -> io::Result<String> {
    let path = Path::new(robot);
    if path.extension().is_none_or(|kind| kind != "toml") {
        return Ok(robot.to_owned());
    }
    let is_below = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    let path = if path.is_relative() && folder.components().all(is_below) {
        let names = folder.components().filter(|part| matches!(part, Component::Normal(_)));
        names.map(|_| PathBuf::from("..")).chain([path.to_owned()]).collect()
    } else {
        std::path::absolute(path)?
    };
    Ok(path.to_string_lossy().into_owned())
}

/// Returns a string of TOML.
pub fn quoted(text: &str) -> String {
    let escape = |c: char| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04x}", u32::from(c)),
        c => c.to_string(),
    };
    format!("\"{}\"", text.chars().map(escape).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_robot_files::find;

    /// Kilobots have a radius of 16.5 mm, and Crazyflies one of 60 mm.
    #[test]
    fn robots_stand_in_rows_with_room_around() {
        for (name, count, side, spacing) in [
            ("kilobot", 1, 300, 50),
            // Ten rows, and half a distance on each side.
            ("kilobot", 100, 550, 50),
            ("crazyflie", 4, 2160, 720),
        ] {
            let text = scenario(&find(name).unwrap(), name, "s.bzz", count);
            assert!(text.contains(&format!("size = [{side}, {side}]\n")), "{text}");
            assert!(text.contains(&format!("spacing = {spacing}\n")), "{text}");
        }
    }

    #[test]
    fn a_robot_file_is_named_from_the_folder_of_the_scenario() {
        // The tests run in the folder of this package.
        let from = |folder: &str| reference("Cargo.toml", Path::new(folder)).unwrap();
        assert_eq!(from(""), "Cargo.toml");
        assert_eq!(from("."), "Cargo.toml");
        assert_eq!(from("a/b"), "../../Cargo.toml");
        assert!(Path::new(&from("../a")).is_absolute());
        assert_eq!(reference("kilobot", Path::new("a")).unwrap(), "kilobot");
    }

    #[test]
    fn paths_are_quoted() {
        assert_eq!(quoted("a \"b\"\\c\n"), "\"a \\\"b\\\"\\\\c\\u000a\"");
    }
}
