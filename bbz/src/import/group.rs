//! Groups of robots in the scenario, and the world around them. Lengths are in mm.

use bittybuzz_robot_spec::Medium;

use super::obstacle::Obstacle;

/// The content of a scenario.
#[derive(Debug)]
pub struct World {
    pub size: [f64; 2],
    /// Seconds.
    pub duration: f64,
    pub seed: u32,
    pub obstacles: Vec<Obstacle>,
    pub lamps: Vec<Lamp>,
    pub groups: Vec<Group>,
}

/// A lamp at full brightness.
#[derive(Debug, Clone, PartialEq)]
pub struct Lamp {
    /// The id in the experiment.
    pub name: String,
    pub at: [f64; 2],
    /// False for a lamp of intensity 0.
    pub shines: bool,
}

#[derive(Debug)]
pub struct Group {
    /// The id in the experiment.
    pub name: String,
    /// The name or file of the robot, see [`super::robots::RobotKind`].
    pub robot: String,
    pub is_kilobot: bool,
    pub radius: f64,
    pub script: String,
    /// True if ARGoS runs Buzz.
    pub is_buzz: bool,
    /// The id of the first robot, if it does not follow from the groups before.
    pub first_id: Option<u32>,
    /// The ids that Buzz gives to the robots in ARGoS, if it runs there.
    pub buzz_ids: Vec<Option<u16>>,
    pub placement: Placement,
    pub heading: Heading,
    pub medium: Medium,
    pub link: Link,
    /// The line of the experiment.
    pub line: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Placement {
    /// Random places in a rectangle.
    Area {
        count: u32,
        center: [f64; 2],
        size: [f64; 2],
    },
    List(Vec<[f64; 2]>),
}

/// The headings at the start in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Heading {
    Degrees(f64),
    Random,
}

/// Properties of messages that differ from those of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Link {
    pub range: Option<f64>,
    pub loss: Option<f64>,
}

impl Group {
    pub fn count(&self) -> usize {
        match &self.placement {
            Placement::Area { count, .. } => *count as usize,
            Placement::List(places) => places.len(),
        }
    }
}
