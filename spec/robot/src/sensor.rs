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
        /// The direction in which the sensor looks; with `None`, if left out, it is equally
        /// sensitive in all directions.
        direction_deg: Option<f64>,
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
    },
    /// Voltage of the battery in mV, which falls evenly from full to empty.
    Battery {
        /// Voltage at the start, in mV.
        full_mv: f64,
        /// Voltage at the end, in mV.
        empty_mv: f64,
        /// Minutes from full to empty. The robot stops when the battery is empty.
        minutes: f64,
    },
}

/// A value of a sensor that a function returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorValue {
    /// The only value of light, ground and battery.
    Only,
    /// The distance along a beam of a proximity sensor, by its number from 0.
    Beam(usize),
    /// The distance along the beam whose number, from 0, is the only argument of the function. A
    /// call with another number fails as out of range.
    BeamOfArgument,
    /// Distance in mm to the nearest robot in range; the range if there is none.
    NearestDistance,
    /// Direction of the nearest robot in range, in degrees in (-180, 180]; 0 if there is none.
    NearestBearing,
    /// The number of robots in range.
    Count,
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
            SensorValue::Beam(beam) => format!(".{beam}"),
            SensorValue::NearestDistance => ".distance".to_owned(),
            SensorValue::NearestBearing => ".bearing".to_owned(),
            SensorValue::Count => ".count".to_owned(),
        }
    }

    /// Returns the unit of the value for a sensor of that kind.
    pub const fn unit(self, kind: &SensorKind) -> &'static str {
        match (self, kind) {
            (SensorValue::NearestBearing, _) => "degrees",
            (SensorValue::Count, _) => "robots",
            (_, SensorKind::Light { .. } | SensorKind::Ground { .. }) => "0 to 1023",
            (_, SensorKind::Battery { .. }) => "mV",
            _ => "mm",
        }
    }
}

impl SensorKind {
    /// Returns the word in robot files.
    pub const fn name(&self) -> &'static str {
        match self {
            SensorKind::Proximity { .. } => "proximity",
            SensorKind::Light { .. } => "light",
            SensorKind::Ground { .. } => "ground",
            SensorKind::RangeAndBearing { .. } => "range-and-bearing",
            SensorKind::Battery { .. } => "battery",
        }
    }
}
