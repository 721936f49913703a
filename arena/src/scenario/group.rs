//! Groups of robots: their models, start places and scripts.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use bittybuzz_compiler::check::outside::OutsideUses;
use bittybuzz_robot_spec::Robot;
use bittybuzz_toml_reader::Place;

use crate::engine::Medium;
use crate::robot::RobotModel;

use super::backend::Backend;
use super::files::EmbeddedFiles;
use super::globals::InitialGlobal;
use super::medium::MediumSettings;

/// The number of a group in its scenario, from 0 in the order of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GroupId(pub(crate) usize);

/// Robots of one kind that run one script.
#[derive(Debug, Clone)]
pub struct Group {
    /// The unique name by which events and expectations refer to the group.
    pub name: String,
    /// The content of the robot file. Groups with one file share it.
    pub robot: Arc<Robot>,
    /// The robot files of all groups, each once. A script for several of them may ask for functions
    /// that one of them lacks.
    pub robots_of_scenario: Arc<[Robot]>,
    /// The names that the scenario's events use in the scripts of all groups.
    pub outside: Arc<OutsideUses>,
    /// The files that stand in the scenario itself. Scripts and includes are read there first.
    pub embedded: Arc<EmbeddedFiles>,
    /// The path of the robot file, for a robot that does not ship.
    pub robot_file: Option<PathBuf>,
    /// The model of the robots, with the settings of this group.
    pub model: Arc<dyn RobotModel>,
    /// The script, image or object file that they run; `None` exactly for robots that run a foreign
    /// image ([`Backend::Image`]).
    pub script: Option<PathBuf>,
    /// The program that runs the script.
    pub backend: Backend,
    /// The number of the first robot in the scenario: the robots of the groups before.
    pub(crate) first_robot: u32,
    /// The number of robots.
    pub count: u32,
    /// The id of the first robot; the others follow.
    pub first_id: u16,
    /// The places where they start.
    pub placement: Placement,
    /// Their headings at the start.
    pub heading: Heading,
    /// True if the robots are present at the start; otherwise an event lets them join.
    pub present: bool,
    /// The range of the percentage by which the clock of a robot is fast; a negative clock skew is
    /// slow. Without it a robot has the error of its medium's clocks.
    pub clock_skew: Option<[f64; 2]>,
    /// The mean time in seconds between two brown-outs of a robot; `None` if there are none.
    pub brown_out_every: Option<f64>,
    /// The settings of the robots' frames that differ from those of the medium.
    pub link: MediumSettings,
    /// The settings in the robots' flash, in the order of the robot file; none if the scenario has no
    /// `settings`.
    pub settings: Vec<Option<u16>>,
    /// The numbers with which the robots' script begins.
    pub globals: Vec<InitialGlobal>,
    /// The place of the group in the file.
    pub place: Place,
}

/// The places where robots start. All points are in mm.
#[derive(Debug, Clone, PartialEq)]
pub enum Placement {
    /// Rows around a center.
    Grid {
        at: [f64; 2],
        /// The distance between neighboring robots in mm.
        spacing: f64,
        /// The number of robots in a row.
        columns: u32,
    },
    /// Rows around a center, with every second row shifted by half the spacing: each robot has up
    /// to six neighbors at the same distance.
    Hexagonal {
        at: [f64; 2],
        /// The distance between neighboring robots in mm.
        spacing: f64,
        /// The number of robots in a row.
        columns: u32,
    },
    /// A row that begins at a point.
    Line {
        /// The position of the first robot.
        at: [f64; 2],
        /// The distance between neighboring robots in mm.
        spacing: f64,
        /// The direction of the row in degrees, 0 along the x axis, anticlockwise.
        direction: f64,
    },
    /// Evenly on a circle.
    Circle {
        at: [f64; 2],
        /// The radius in mm.
        radius: f64,
    },
    /// Random places in a rectangle, without overlap.
    Random {
        /// Center of the rectangle.
        at: [f64; 2],
        /// Width and height of the rectangle in mm.
        area: [f64; 2],
    },
    /// The places that the file lists.
    List(Vec<ListedPlace>),
}

/// A start place that the file lists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListedPlace {
    /// The position in mm.
    pub at: [f64; 2],
    /// The heading of this robot in degrees; `None` if it has the heading of its group.
    pub heading: Option<f64>,
}

impl From<[f64; 2]> for ListedPlace {
    fn from(at: [f64; 2]) -> Self {
        ListedPlace { at, heading: None }
    }
}

/// The headings of robots at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Heading {
    /// Degrees, 0 along the x axis, anticlockwise.
    Degrees(f64),
    /// A random heading for each robot.
    Random,
}

/// A robot at a position.
#[derive(Debug, Clone, Copy)]
pub struct Standing {
    /// The middle of the robot, in mm.
    pub at: [f64; 2],
    /// The radius of the body in mm.
    pub radius_mm: f64,
    /// The id of the robot.
    pub id: u32,
}

impl Group {
    /// Returns the number after that of its last robot. Damaged scenarios have more robots than
    /// there are numbers.
    pub(crate) fn end(&self) -> u32 {
        self.first_robot.saturating_add(self.count)
    }

    /// Returns the radius of a robot's body in mm.
    pub fn radius_mm(&self) -> f64 {
        f64::from(self.model.shape().radius_mm)
    }

    /// Returns the medium that carries the robots' frames.
    pub fn medium(&self) -> Medium {
        self.model.medium()
    }

    /// Returns the robots at their start places; none for random placement.
    pub(crate) fn standing(&self) -> impl Iterator<Item = Standing> {
        self.standing_in(0..self.count)
    }

    /// Returns the robots with these numbers in the group, at their start places; none for random
    /// placement.
    pub(crate) fn standing_in(&self, numbers: Range<u32>) -> impl Iterator<Item = Standing> {
        let radius_mm = self.radius_mm();
        let is_random = matches!(self.placement, Placement::Random { .. });
        let numbers = if is_random { 0..0 } else { numbers };
        numbers.map(move |number| Standing {
            at: self.placement.point(number, self.count),
            radius_mm,
            id: u32::from(self.first_id) + number,
        })
    }
}

impl Placement {
    /// Returns the start positions of a group of `count` robots; none for [`Placement::Random`],
    /// where they are drawn for each run.
    pub fn points(&self, count: u32) -> impl Iterator<Item = [f64; 2]> {
        let count = match self {
            Placement::Random { .. } => 0,
            _ => count,
        };
        (0..count).map(move |index| self.point(index, count))
    }

    fn point(&self, index: u32, count: u32) -> [f64; 2] {
        match self {
            Placement::Grid { at, spacing, columns }
            | Placement::Hexagonal { at, spacing, columns } => {
                let columns = (*columns).min(count);
                let rows = count.div_ceil(columns);
                let offset =
                    |place: u32, of: u32| (f64::from(place) - f64::from(of - 1) / 2.0) * spacing;
                let (column, row) = (index % columns, index / columns);
                let [x, y] = [offset(column, columns), offset(row, rows)];
                if let Placement::Grid { .. } = self {
                    return [at[0] + x, at[1] + y];
                }
                // The distance between rows is the height of an equilateral triangle.
                let shift = if row % 2 == 0 { -spacing / 4.0 } else { spacing / 4.0 };
                let shift = if rows > 1 { shift } else { 0.0 };
                [at[0] + x + shift, at[1] + y * 0.75_f64.sqrt()]
            }
            Placement::Line { at, spacing, direction } => {
                let (sine, cosine) = libm::sincos(direction.to_radians());
                let distance = spacing * f64::from(index);
                [at[0] + distance * cosine, at[1] + distance * sine]
            }
            Placement::Circle { at, radius } => {
                let turn = f64::from(index) / f64::from(count) * std::f64::consts::TAU;
                let (sine, cosine) = libm::sincos(turn);
                [at[0] + radius * cosine, at[1] + radius * sine]
            }
            Placement::Random { at, .. } => *at,
            // The reader accepts a list with a place for each robot only.
            Placement::List(places) => places[index as usize].at,
        }
    }

    /// Returns the heading that the file gives to one robot, which replaces that of its group.
    pub(crate) fn heading_of(&self, index: usize) -> Option<f64> {
        match self {
            Placement::List(places) => places[index].heading,
            _ => None,
        }
    }
}
