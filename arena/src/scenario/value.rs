//! Quantities of a robot, as scenario files write them.

use std::fmt;

/// The ways to write a quantity.
pub const FORMS: &[&str] = &[
    "x",
    "y",
    "z",
    "heading",
    "distance(X, Y)",
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
];

/// Something that every robot has at every time, or that all of them have together.
#[derive(Debug, Clone, PartialEq)]
pub enum Quantity {
    /// mm from the left edge of the world.
    X,
    /// mm from the lower edge of the world.
    Y,
    /// Height in mm.
    Z,
    /// Degrees in (-180, 180], 0 along the x axis, anticlockwise.
    Heading,
    /// mm on the ground to a point.
    Distance([f64; 2]),
    /// The colour that the LED shows, 0 to 7.
    Led,
    /// Robots that it has heard of late.
    Neighbors,
    /// Slots of its script's memory that are free.
    Free,
    /// 1 while its script runs, else 0.
    Running,
    /// Steps that its script has completed since it was switched on.
    Steps,
    /// Faults that stopped its script since it was switched on.
    Faults,
    /// Starts of its script after such a fault.
    Restarts,
    /// Faults that ended a listener or a handler of conflicts since it was switched on.
    HandlerFaults,
    /// Steps that were due while its script still executed the one before, since it was switched on.
    Overruns,
    /// Crashes since the run began.
    Crashes,
    /// A global of its script, or a value in a table there.
    Global {
        /// Its name.
        name: String,
        /// The keys that lead into tables; none for the global itself.
        keys: Vec<Key>,
    },
    /// An entry of a stigmergy, as this robot knows it.
    Stigmergy {
        /// The stigmergy's number in the script.
        number: u16,
        /// The key; digits are an integer.
        key: Key,
    },
    /// One number of all robots that are meant.
    Swarm(Swarm),
}

/// A quantity of a swarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Swarm {
    /// The agreement of their headings: the length of the mean of unit vectors, 0 to 1.
    Polarisation,
    /// Mean distance to the nearest other one, in mm between the middles.
    Nearest,
    /// Root mean square of the distances to their centre, in mm on the ground.
    Spread,
    /// Pairs that touch.
    Contacts,
    /// Parts into which they fall that hear each other, directly or through others.
    Components,
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
    /// Returns true if it is known of a robot that runs its firmware. Of its memory an emulator knows at most when the script
    /// completes a step.
    pub fn is_seen_on_firmware(&self, counts_steps: bool) -> bool {
        match self {
            Quantity::Neighbors
            | Quantity::Free
            | Quantity::Overruns
            | Quantity::Global { .. }
            | Quantity::Stigmergy { .. } => false,
            Quantity::Steps => counts_steps,
            _ => true,
        }
    }

    /// Reads a quantity; `None` if it is none.
    pub fn parse(text: &str) -> Option<Quantity> {
        if let Some(path) = text.strip_prefix("global.") {
            let mut words = path.split('.');
            let name = words.next().filter(|name| is_identifier(name))?.to_owned();
            return Some(Quantity::Global { name, keys: words.map(key).collect::<Option<_>>()? });
        }
        if let Some(word) = text.strip_prefix("swarm.") {
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
        if let Some(point) = text.strip_prefix("distance(") {
            let (x, y) = point.strip_suffix(')')?.split_once(',')?;
            let point = [x.trim().parse::<f64>().ok()?, y.trim().parse::<f64>().ok()?];
            return point.iter().all(|axis| axis.is_finite()).then_some(Quantity::Distance(point));
        }
        Some(match text {
            "x" => Quantity::X,
            "y" => Quantity::Y,
            "z" => Quantity::Z,
            "heading" => Quantity::Heading,
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

/// Digits are an integer.
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
            Quantity::Swarm(of) => {
                let word = SWARM.iter().find(|(_, known)| known == of).map_or("", |(word, _)| word);
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
