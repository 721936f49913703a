//! Quantities of a robot, as written in scenario files.

use std::fmt;

use super::aggregate::Aggregate;

/// The written forms of quantities. [`aggregate::FORMS`](super::aggregate::FORMS) has those that
/// combine the values of several robots.
pub const FORMS: &[&str] = &[
    "x",
    "y",
    "z",
    "heading",
    "distance(X, Y)",
    "displacement",
    "displacement(TIME)",
    "inside(X, Y, RADIUS)",
    "inside(X, Y, WIDTH, HEIGHT)",
    "led",
    "neighbors",
    "free",
    "running",
    "steps",
    "faults",
    "restarts",
    "handler_faults",
    "overruns",
    "crashes",
    "global.NAME",
    "global.NAME.KEY",
    "stigmergy.NUMBER.KEY",
    "swarm.polarisation",
    "swarm.nearest",
    "swarm.spread",
    "swarm.contacts",
    "swarm.components",
    "swarm.cluster(DISTANCE)",
];

/// A value that every robot has at every time, or that all of them have together.
#[derive(Debug, Clone, PartialEq)]
pub enum Quantity {
    /// x in mm, from the middle of the world to the right.
    X,
    /// y in mm, from the middle of the world upwards.
    Y,
    /// Height in mm.
    Z,
    /// Degrees in (-180, 180], 0 along the x axis, anticlockwise.
    Heading,
    /// The distance on the ground to a point, in mm.
    Distance([f64; 2]),
    /// The distance on the ground, in mm, to the place where it was at a time in seconds, or where
    /// it entered the world.
    Displacement(Option<f64>),
    /// 1 while its center is in an area of the ground, else 0.
    Inside(GroundArea),
    /// The color that the LED shows, 0 to 7.
    Led,
    /// The number of robots whose frames it has received recently.
    Neighbors,
    /// The number of free slots in its script's memory.
    Free,
    /// 1 while its script runs, else 0.
    Running,
    /// The number of steps that its script has completed since the robot was switched on.
    Steps,
    /// The number of faults that stopped its script since the robot was switched on.
    Faults,
    /// The number of restarts of its script after such faults.
    Restarts,
    /// The number of faults that ended a listener or a handler of conflicts since the robot was
    /// switched on.
    HandlerFaults,
    /// The number of steps that were due while its script still executed the previous one, since
    /// the robot was switched on.
    Overruns,
    /// The number of crashes since the run began.
    Crashes,
    /// A global of its script, or a value in a table in it.
    Global {
        /// The name of the global.
        name: String,
        /// The keys into nested tables; empty for the global itself.
        keys: Vec<Key>,
    },
    /// An entry of a stigmergy, as this robot knows it.
    Stigmergy {
        /// The stigmergy's number in the script.
        number: u16,
        /// The key. Digits make an integer key.
        key: Key,
    },
    /// A measure of all selected robots.
    Swarm(Swarm),
    /// One number from the values of all selected robots.
    Aggregate(Box<Aggregate>),
}

/// An area of the ground around a center, with its edge. All lengths are in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GroundArea {
    Disc { at: [f64; 2], radius: f64 },
    Box { at: [f64; 2], size: [f64; 2] },
}

/// A quantity of a swarm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Swarm {
    /// The agreement of their headings: the length of the mean of unit vectors, 0 to 1.
    Polarisation,
    /// The mean distance from a robot to its nearest neighbor, in mm between the middles.
    Nearest,
    /// The root mean square of the distances to their center, in mm on the ground.
    Spread,
    /// The number of pairs that touch.
    Contacts,
    /// The number of connected components: groups of robots that receive each other, directly or
    /// through others.
    Components,
    /// The number of robots in the largest cluster. A cluster is a set of robots whose centers are
    /// at most this far apart, in mm on the ground, directly or through others.
    Cluster(f64),
}

const SWARM: [(&str, Swarm); 5] = [
    ("polarisation", Swarm::Polarisation),
    ("nearest", Swarm::Nearest),
    ("spread", Swarm::Spread),
    ("contacts", Swarm::Contacts),
    ("components", Swarm::Components),
];

/// A key of a stigmergy or a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Key {
    /// An integer.
    Number(i32),
    /// A string of the script.
    Text(String),
}

impl Quantity {
    /// Returns true if the quantity can be read from a robot that runs its firmware. An emulator
    /// exposes at most the completed steps of the script's state; `counts_steps` is true if it
    /// does.
    pub fn is_seen_on_firmware(&self, counts_steps: bool) -> bool {
        match self {
            Quantity::Neighbors
            | Quantity::Free
            | Quantity::Overruns
            | Quantity::Global { .. }
            | Quantity::Stigmergy { .. } => false,
            Quantity::Steps => counts_steps,
            Quantity::Aggregate(_) => {
                self.parts().into_iter().all(|part| part.is_seen_on_firmware(counts_steps))
            }
            _ => true,
        }
    }

    /// Returns true if all selected robots have one value together.
    pub fn is_of_swarm(&self) -> bool {
        matches!(self, Quantity::Swarm(_) | Quantity::Aggregate(_))
    }

    /// Returns the quantities of single robots that it is read from: itself, or those of an
    /// aggregate.
    pub fn parts(&self) -> Vec<&Quantity> {
        match self {
            Quantity::Aggregate(of) => {
                let among = of.among.iter().map(|filter| &filter.value);
                [&of.value].into_iter().chain(among).collect()
            }
            other => vec![other],
        }
    }

    /// Returns the times in seconds at which its robots' places have to be kept.
    pub fn times_of_places(&self) -> impl Iterator<Item = f64> {
        self.parts().into_iter().filter_map(|part| match part {
            Quantity::Displacement(time) => *time,
            _ => None,
        })
    }

    /// Returns the unit; `None` for numbers without one.
    pub fn unit(&self) -> Option<&'static str> {
        match self {
            Quantity::X | Quantity::Y | Quantity::Z => Some("mm"),
            Quantity::Distance(_) | Quantity::Displacement(_) => Some("mm"),
            Quantity::Swarm(Swarm::Nearest | Swarm::Spread) => Some("mm"),
            Quantity::Heading => Some("°"),
            Quantity::Aggregate(of) => of.unit(),
            _ => None,
        }
    }

    /// Parses a quantity; `None` if the text is not one.
    pub fn parse(text: &str) -> Option<Quantity> {
        if let Some(path) = text.strip_prefix("global.") {
            let mut words = path.split('.');
            let name = words.next().filter(|name| is_identifier(name))?.to_owned();
            return Some(Quantity::Global { name, keys: words.map(key).collect::<Option<_>>()? });
        }
        if let Some(word) = text.strip_prefix("swarm.") {
            if let Some([distance]) = arguments(word, "cluster") {
                return (distance >= 0.0).then_some(Quantity::Swarm(Swarm::Cluster(distance)));
            }
            let found = SWARM.iter().find(|(known, _)| *known == word);
            return found.map(|(_, of)| Quantity::Swarm(*of));
        }
        if let Some(rest) = text.strip_prefix("stigmergy.") {
            let (number, key) = rest.split_once('.')?;
            return Some(Quantity::Stigmergy {
                number: number.parse().ok()?,
                key: self::key(key)?,
            });
        }
        if let Some(point) = arguments(text, "distance") {
            return Some(Quantity::Distance(point));
        }
        if let Some([time]) = arguments(text, "displacement") {
            return (time >= 0.0).then_some(Quantity::Displacement(Some(time)));
        }
        if let Some([x, y, radius]) = arguments(text, "inside") {
            let area = GroundArea::Disc { at: [x, y], radius };
            return (radius >= 0.0).then_some(Quantity::Inside(area));
        }
        if let Some([x, y, width, height]) = arguments(text, "inside") {
            let area = GroundArea::Box { at: [x, y], size: [width, height] };
            return (width >= 0.0 && height >= 0.0).then_some(Quantity::Inside(area));
        }
        if let Some(aggregate) = Aggregate::parse(text) {
            return Some(Quantity::Aggregate(Box::new(aggregate)));
        }
        Some(match text {
            "x" => Quantity::X,
            "y" => Quantity::Y,
            "z" => Quantity::Z,
            "heading" => Quantity::Heading,
            "displacement" => Quantity::Displacement(None),
            "led" => Quantity::Led,
            "neighbors" => Quantity::Neighbors,
            "free" => Quantity::Free,
            "running" => Quantity::Running,
            "steps" => Quantity::Steps,
            "faults" => Quantity::Faults,
            "restarts" => Quantity::Restarts,
            "handler_faults" => Quantity::HandlerFaults,
            "overruns" => Quantity::Overruns,
            "crashes" => Quantity::Crashes,
            _ => return None,
        })
    }
}

/// Returns the finite numbers of `NAME(NUMBER, NUMBER)`, if the text has this form and as many.
fn arguments<const N: usize>(text: &str, name: &str) -> Option<[f64; N]> {
    let inner = text.strip_prefix(name)?.strip_prefix('(')?.strip_suffix(')')?;
    let numbers = inner.split(',').map(|number| number.trim().parse::<f64>().ok());
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    let numbers: [f64; N] = numbers.try_into().ok()?;
    numbers.iter().all(|number| number.is_finite()).then_some(numbers)
}

/// Parses a key. Digits make an integer key.
fn key(text: &str) -> Option<Key> {
    match text.parse() {
        _ if text.is_empty() => None,
        Ok(number) => Some(Key::Number(number)),
        Err(_) => Some(Key::Text(text.to_owned())),
    }
}

/// Returns true for a word of ASCII letters, digits and `_` that does not begin with a digit.
pub(super) fn is_identifier(name: &str) -> bool {
    name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Quantity::X => f.write_str("x"),
            Quantity::Y => f.write_str("y"),
            Quantity::Z => f.write_str("z"),
            Quantity::Heading => f.write_str("heading"),
            Quantity::Distance([x, y]) => write!(f, "distance({x}, {y})"),
            Quantity::Displacement(None) => f.write_str("displacement"),
            Quantity::Displacement(Some(time)) => write!(f, "displacement({time})"),
            Quantity::Inside(GroundArea::Disc { at: [x, y], radius }) => {
                write!(f, "inside({x}, {y}, {radius})")
            }
            Quantity::Inside(GroundArea::Box { at: [x, y], size: [width, height] }) => {
                write!(f, "inside({x}, {y}, {width}, {height})")
            }
            Quantity::Led => f.write_str("led"),
            Quantity::Neighbors => f.write_str("neighbors"),
            Quantity::Free => f.write_str("free"),
            Quantity::Running => f.write_str("running"),
            Quantity::Steps => f.write_str("steps"),
            Quantity::Faults => f.write_str("faults"),
            Quantity::Restarts => f.write_str("restarts"),
            Quantity::HandlerFaults => f.write_str("handler_faults"),
            Quantity::Overruns => f.write_str("overruns"),
            Quantity::Crashes => f.write_str("crashes"),
            Quantity::Global { name, keys } => {
                write!(f, "global.{name}")?;
                keys.iter().try_for_each(|key| write!(f, ".{key}"))
            }
            Quantity::Stigmergy { number, key } => write!(f, "stigmergy.{number}.{key}"),
            Quantity::Aggregate(of) => of.fmt(f),
            Quantity::Swarm(Swarm::Cluster(distance)) => write!(f, "swarm.cluster({distance})"),
            Quantity::Swarm(of) => {
                let word = SWARM.iter().find(|(_, known)| known == of);
                let (word, _) = word.expect("each measure of a swarm has a word");
                write!(f, "swarm.{word}")
            }
        }
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Key::Number(number) => number.fmt(f),
            Key::Text(text) => f.write_str(text),
        }
    }
}
