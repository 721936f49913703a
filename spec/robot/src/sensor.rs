//! The sensors of a robot that the simulator moves, as `[[sensor]]` of its file describes them.

/// A sensor of a body. Functions with the key `reads` return its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// The name by which functions refer to it.
    pub name: String,
    /// The kind of sensor and its limits.
    pub kind: SensorKind,
    /// Standard deviation of a value, in the unit of the value; 0 if left out. For a
    /// [`SensorKind::RangeAndBearing`] it applies to the distance.
    pub noise: f64,
    /// New values per second; `None`, if left out, stands for one in every tick of the world.
    pub rate_hz: Option<f64>,
}

/// The quantity that a sensor measures. Directions are in degrees relative to the robot's heading,
/// anticlockwise.
#[derive(Debug, Clone, PartialEq)]
pub enum SensorKind {
    /// Distances in mm from the rim of the robot to the nearest obstacle, wall or robot, along
    /// beams.
    Proximity {
        /// Direction of each beam; at least one.
        directions_deg: Vec<f64>,
        /// The largest distance that is measured, in mm.
        range_mm: f64,
        /// The value when nothing is in range; `range_mm` if left out.
        nothing: f64,
    },
    /// Brightness of lamps and ambient light, 0 (dark) to 1023.
    Light {
        /// Directions in which the sensor looks, with a value for each; with none, if left out, it
        /// has one value and is equally sensitive in all directions.
        directions_deg: Vec<f64>,
    },
    /// Brightness of the ground below the sensor, 0 (black) to 1023 (white).
    Ground {
        /// The place of the sensor: mm ahead of the middle of the robot, and to the left of it; the
        /// middle if left out.
        at_mm: [f64; 2],
    },
    /// The link over which robots exchange messages, and which measures distance and direction of
    /// the neighbors. A robot without such a sensor neither sends nor receives a message. A robot
    /// has at most one.
    RangeAndBearing {
        /// The largest distance between the middles of two robots that exchange messages, in mm.
        range_mm: f64,
        /// Standard deviation of a direction, in degrees; 0 if left out.
        bearing_noise_deg: f64,
        /// The unit in which scripts get the `distance` of a neighbor; mm if left out.
        unit: DistanceUnit,
    },
    /// Voltage of the battery in mV, which falls evenly from full to empty.
    /// Position in the world and heading, as a tracking system gives them.
    Positioning {
        /// Standard deviation of the heading, in degrees; 0 if left out. `noise` is that of each
        /// coordinate, in mm.
        heading_noise_deg: f64,
    },
    Battery {
        /// Voltage at the start, in mV.
        full_mv: f64,
        /// Voltage at the end, in mV.
        empty_mv: f64,
        /// Minutes from full to empty. The robot stops when the battery is empty.
        minutes: f64,
    },
}

/// A unit of distances.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum DistanceUnit {
    #[default]
    Millimeter,
    Centimeter,
    Meter,
}

impl DistanceUnit {
    /// The words of robot files.
    pub const WORDS: [(&str, DistanceUnit); 3] = [
        ("mm", DistanceUnit::Millimeter),
        ("cm", DistanceUnit::Centimeter),
        ("m", DistanceUnit::Meter),
    ];

    /// Returns the word in robot files.
    pub fn name(self) -> &'static str {
        let word = DistanceUnit::WORDS.into_iter().find(|(_, unit)| *unit == self);
        word.expect("every unit has a word").0
    }

    /// Returns the length of the unit in mm.
    pub const fn mm(self) -> f64 {
        match self {
            DistanceUnit::Millimeter => 1.0,
            DistanceUnit::Centimeter => 10.0,
            DistanceUnit::Meter => 1000.0,
        }
    }
}

/// A value of a sensor that a function returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorValue {
    /// The only value of light in one direction, ground and battery.
    Only,
    /// The value of a beam of a proximity sensor, or of a direction of a light sensor, by its
    /// number from 0.
    Beam(usize),
    /// The value of the beam whose number, from 0, is the only argument of the function. A call
    /// with another number fails as out of range.
    BeamOfArgument,
    /// Distance in mm to the nearest robot in range; the range if there is none.
    NearestDistance,
    /// Direction of the nearest robot in range, in degrees in (-180, 180]; 0 if there is none.
    NearestBearing,
    /// The number of robots in range.
    Count,
    /// A coordinate of the position in mm: 0 for x, 1 for y, 2 for z.
    Coordinate(usize),
    /// Heading in degrees in (-180, 180].
    Heading,
}

/// A sensor and the one of its values that a function returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SensorReading {
    /// Index of the sensor in [`Robot::sensors`](crate::Robot::sensors).
    pub sensor: usize,
    /// The value of the sensor that is read.
    pub value: SensorValue,
}

impl SensorValue {
    /// Returns the text after the sensor's name in robot files: empty, or a point and the value.
    pub fn suffix(self) -> String {
        match self {
            SensorValue::Only | SensorValue::BeamOfArgument => String::new(),
            other => format!(".{}", other.name()),
        }
    }

    /// Returns the word for the value in robot files; empty if the name of the sensor is enough.
    pub fn name(self) -> String {
        match self {
            SensorValue::Only | SensorValue::BeamOfArgument => String::new(),
            SensorValue::Beam(beam) => beam.to_string(),
            SensorValue::NearestDistance => "distance".to_owned(),
            SensorValue::NearestBearing => "bearing".to_owned(),
            SensorValue::Count => "count".to_owned(),
            SensorValue::Coordinate(axis) => AXES[axis].to_owned(),
            SensorValue::Heading => "heading".to_owned(),
        }
    }

    /// Returns the unit of the value for a sensor of that kind.
    pub const fn unit(self, kind: &SensorKind) -> &'static str {
        match (self, kind) {
            (SensorValue::NearestBearing | SensorValue::Heading, _) => "degrees",
            (SensorValue::Count, _) => "robots",
            (_, SensorKind::Light { .. } | SensorKind::Ground { .. }) => "0 to 1023",
            (_, SensorKind::Battery { .. }) => "mV",
            _ => "mm",
        }
    }
}

impl SensorKind {
    /// Returns the directions of a sensor whose values are numbered; empty for other sensors.
    pub fn beams_deg(&self) -> &[f64] {
        match self {
            SensorKind::Proximity { directions_deg, .. } => directions_deg,
            SensorKind::Light { directions_deg } if directions_deg.len() > 1 => directions_deg,
            _ => &[],
        }
    }

    /// Returns the word in robot files.
    pub const fn name(&self) -> &'static str {
        match self {
            SensorKind::Proximity { .. } => "proximity",
            SensorKind::Light { .. } => "light",
            SensorKind::Ground { .. } => "ground",
            SensorKind::RangeAndBearing { .. } => "range-and-bearing",
            SensorKind::Positioning { .. } => "positioning",
            SensorKind::Battery { .. } => "battery",
        }
    }

    /// Returns the values of the sensor.
    pub fn values(&self) -> Vec<SensorValue> {
        match self {
            kind if !kind.beams_deg().is_empty() => {
                (0..kind.beams_deg().len()).map(SensorValue::Beam).collect()
            }
            SensorKind::Proximity { .. }
            | SensorKind::Light { .. }
            | SensorKind::Ground { .. }
            | SensorKind::Battery { .. } => vec![SensorValue::Only],
            SensorKind::RangeAndBearing { .. } => {
                vec![SensorValue::NearestDistance, SensorValue::NearestBearing, SensorValue::Count]
            }
            SensorKind::Positioning { .. } => {
                let axes = (0..AXES.len()).map(SensorValue::Coordinate);
                axes.chain([SensorValue::Heading]).collect()
            }
        }
    }
}

/// The coordinates of a position.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The units in which values can be given to scripts, and their factors from the unit of the sensor.
const LENGTHS: &[(&str, f64)] = &[("mm", 1.0), ("cm", 0.1), ("m", 0.001)];
const ANGLES: &[(&str, f64)] = &[("deg", 1.0), ("rad", std::f64::consts::PI / 180.0)];
const VOLTAGES: &[(&str, f64)] = &[("mV", 1.0), ("V", 0.001)];

/// Returns the factor from a sensor's unit to another one, or else the units that exist for it.
pub fn unit_factor(own: &str, unit: &str) -> Result<f64, Vec<&'static str>> {
    let units = match own {
        "mm" => LENGTHS,
        "degrees" => ANGLES,
        "mV" => VOLTAGES,
        _ => &[],
    };
    let found = units.iter().find(|(name, _)| *name == unit);
    found.map(|(_, factor)| *factor).ok_or_else(|| units.iter().map(|(name, _)| *name).collect())
}
