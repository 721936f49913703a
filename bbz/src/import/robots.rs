//! The kinds of robots: those of ARGoS, and the robots of `bbz` that take their place.

use std::collections::BTreeMap;
use std::path::Path;

use bittybuzz_robot_files::find;
use bittybuzz_robot_spec::{Medium, Robot};

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::world;

/// The kinds of ARGoS and the robots that stand for them. [docs/argos.md] lists them, too.
pub const KINDS: [(&str, &str); 4] =
    [("foot-bot", "footbot"), ("e-puck", "epuck"), ("kheperaiv", "khepera"), (KILOBOT, "kilobot")];

pub const KILOBOT: &str = "kilobot";

/// A robot of a scenario.
#[derive(Debug)]
pub struct RobotKind {
    /// The name, or the path of the file from the folder of the scenario.
    pub reference: String,
    /// The content of the robot file.
    pub robot: Robot,
    /// True for the Kilobot of ARGoS, if no other robot takes its place.
    pub is_kilobot: bool,
}

impl RobotKind {
    /// Returns the medium that carries its messages.
    pub fn medium(&self) -> Medium {
        self.robot.link.unwrap_or(Medium::RangeAndBearing)
    }

    /// Returns the radius of its body in mm; 0 if it has none.
    pub fn radius_mm(&self) -> f64 {
        world::body_radius_mm(&self.robot).unwrap_or(0.0)
    }
}

/// The kinds that can be imported, by their names in ARGoS.
pub struct RobotKinds(BTreeMap<String, RobotKind>);

impl RobotKinds {
    /// Reads the robots of the table and of `--robot`, which has precedence. `folder` is that of the
    /// scenario.
    pub fn new(choices: &[(String, String)], folder: &Path) -> Result<Self, Box<dyn Problem>> {
        let mut kinds = BTreeMap::new();
        for (kind, name) in KINDS {
            let robot = RobotKind {
                reference: name.to_owned(),
                robot: find(name)?,
                is_kilobot: kind == KILOBOT,
            };
            kinds.insert(kind.to_owned(), robot);
        }
        for (kind, name) in choices {
            let robot = find(name)?;
            let reference = world::reference(name, folder)
                .map_err(|error| FileError::reading(Path::new(name), error))?;
            let is_kilobot = kind == KILOBOT && reference == KILOBOT;
            kinds.insert(kind.clone(), RobotKind { reference, robot, is_kilobot });
        }
        Ok(RobotKinds(kinds))
    }

    pub fn get(&self, kind: &str) -> Option<&RobotKind> {
        self.0.get(kind)
    }

    pub fn all(&self) -> impl Iterator<Item = &RobotKind> {
        self.0.values()
    }
}

/// Returns the id that a Buzz controller derives from the id of its entity: the number after the last
/// `_`, or if that is 0 the first number (CBuzzController::Init).
pub fn buzz_id(entity: &str) -> Option<u16> {
    let number = |text: &str| {
        let digits = text.bytes().take_while(u8::is_ascii_digit).count();
        // A number that is too large becomes the largest one, as in the streams of C++.
        (digits > 0).then(|| text[..digits].parse().unwrap_or(u16::MAX))
    };
    let after = entity.rsplit_once('_').map(|(_, after)| number(after).unwrap_or(0));
    match after {
        Some(id) if id != 0 => Some(id),
        after => {
            let first = entity.find(|c: char| c.is_ascii_digit());
            first.and_then(|first| number(&entity[first..])).or(after)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_those_of_the_buzz_controller() {
        for (entity, id) in [
            ("fb0", Some(0)),
            ("kiv12", Some(12)),
            ("footbot_group3_10", Some(10)),
            ("footbot_simulated10", Some(10)),
            // The number after `_` is 0, so the first number counts.
            ("robot2_0", Some(2)),
            ("sp_master", Some(0)),
            ("fb99999", Some(65535)),
            ("leader", None),
        ] {
            assert_eq!(buzz_id(entity), id, "{entity}");
        }
    }
}
