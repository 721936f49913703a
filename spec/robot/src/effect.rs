//! The effect of a robot function in the simulator: the actuators that it sets and the sensor that
//! it reads.

use std::fmt;

use bittybuzz_toml_reader::number_text;

use crate::Parameter;
use crate::sensor::SensorReading;
use crate::value::ValueReading;

/// An effect of a function. All of it happens in each call, in the order of the fields. If `reads`
/// is `None`, a function with a result returns 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FunctionEffect {
    /// The quantities that the function sets, each at most once.
    pub sets: Vec<EffectAssignment>,
    /// The vector along which the body drives from now on, by its [`Steering`](crate::Steering).
    pub steers: Option<SteeringVector>,
    /// True if the call is written to the log of the run: as `log` prints its arguments if it takes
    /// any number of them, else as a call, such as `turret_set(0.5)`.
    pub logs: bool,
    /// The value that the function returns.
    pub reads: Option<SensorReading>,
    /// The value with which the function fills a table of the script. No script calls such a
    /// function by its name.
    pub fills: Option<ValueReading>,
}

/// A quantity and the value that a call gives to it.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectAssignment {
    pub quantity: ActuatorQuantity,
    pub amount: Amount,
}

/// A vector in the frame of the robot, which a call gives to the body.
#[derive(Debug, Clone, PartialEq)]
pub enum SteeringVector {
    /// Its parts.
    Cartesian {
        /// Speed ahead, in mm/s.
        forward: Amount,
        /// Speed to the left, in mm/s.
        leftward: Amount,
    },
    /// Its length and direction.
    Polar {
        /// Speed in mm/s.
        speed: Amount,
        /// Direction in degrees, anticlockwise from straight ahead.
        direction: Amount,
    },
}

/// A value of a quantity, in the quantity's unit.
#[derive(Debug, Clone, PartialEq)]
pub enum Amount {
    /// A number that is the same in every call.
    Constant(f64),
    /// An argument, times a factor. A call whose argument list does not have this parameter does
    /// not change the quantity.
    Parameter {
        /// The name of the parameter.
        name: String,
        /// The factor from the unit of the argument to the unit of the quantity.
        factor: f64,
    },
}

/// A quantity of an actuator. It keeps its value until a call sets it again. At the start all
/// quantities are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ActuatorQuantity {
    /// Speed of the left wheel over the ground, in mm/s.
    LeftWheel,
    /// Speed of the right wheel over the ground, in mm/s.
    RightWheel,
    /// Speed ahead, in mm/s. A robot with two wheels changes both and keeps `Turn`.
    Forward,
    /// Turning rate in degrees per second, anticlockwise. A robot with two wheels changes both and
    /// keeps `Forward`.
    Turn,
    /// Duty of the left vibration motor, 0 to 1.
    LeftMotor,
    /// Duty of the right vibration motor, 0 to 1.
    RightMotor,
    /// Speed to the left, in mm/s.
    Leftward,
    /// Speed upward, in mm/s. It replaces the last `Height`.
    Upward,
    /// Target height over the ground, in mm. It replaces the last `Upward`.
    Height,
    /// Color of the LED: the sum of 1 red, 2 green, 4 blue. Higher bits are ignored.
    Color,
    /// Brightness of the red LED, 0 to 1.
    Red,
    /// Brightness of the green LED, 0 to 1.
    Green,
    /// Brightness of the blue LED, 0 to 1.
    Blue,
}

/// A dimension, which determines the units that a quantity can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dimension {
    Speed,
    TurningRate,
    Length,
    Angle,
    Share,
    Color,
}

impl ActuatorQuantity {
    /// Every quantity.
    pub const ALL: [ActuatorQuantity; 13] = [
        ActuatorQuantity::LeftWheel,
        ActuatorQuantity::RightWheel,
        ActuatorQuantity::Forward,
        ActuatorQuantity::Turn,
        ActuatorQuantity::LeftMotor,
        ActuatorQuantity::RightMotor,
        ActuatorQuantity::Leftward,
        ActuatorQuantity::Upward,
        ActuatorQuantity::Height,
        ActuatorQuantity::Color,
        ActuatorQuantity::Red,
        ActuatorQuantity::Green,
        ActuatorQuantity::Blue,
    ];

    /// The quantities that every body has.
    pub const OF_EVERY_BODY: [ActuatorQuantity; 4] = [
        ActuatorQuantity::Color,
        ActuatorQuantity::Red,
        ActuatorQuantity::Green,
        ActuatorQuantity::Blue,
    ];

    /// Returns the key in robot files.
    pub const fn name(self) -> &'static str {
        match self {
            ActuatorQuantity::LeftWheel => "left_wheel",
            ActuatorQuantity::RightWheel => "right_wheel",
            ActuatorQuantity::Forward => "forward",
            ActuatorQuantity::Turn => "turn",
            ActuatorQuantity::LeftMotor => "left_motor",
            ActuatorQuantity::RightMotor => "right_motor",
            ActuatorQuantity::Leftward => "leftward",
            ActuatorQuantity::Upward => "upward",
            ActuatorQuantity::Height => "height",
            ActuatorQuantity::Color => "color",
            ActuatorQuantity::Red => "red",
            ActuatorQuantity::Green => "green",
            ActuatorQuantity::Blue => "blue",
        }
    }

    pub(crate) const fn dimension(self) -> Dimension {
        match self {
            ActuatorQuantity::LeftWheel
            | ActuatorQuantity::RightWheel
            | ActuatorQuantity::Forward
            | ActuatorQuantity::Leftward
            | ActuatorQuantity::Upward => Dimension::Speed,
            ActuatorQuantity::Turn => Dimension::TurningRate,
            ActuatorQuantity::Height => Dimension::Length,
            ActuatorQuantity::LeftMotor
            | ActuatorQuantity::RightMotor
            | ActuatorQuantity::Red
            | ActuatorQuantity::Green
            | ActuatorQuantity::Blue => Dimension::Share,
            ActuatorQuantity::Color => Dimension::Color,
        }
    }

    /// Returns the unit of the values.
    pub const fn unit(self) -> &'static str {
        match self.dimension() {
            Dimension::Speed => "mm/s",
            Dimension::TurningRate => "deg/s",
            Dimension::Length => "mm",
            Dimension::Angle => "deg",
            Dimension::Share => "0 to 1",
            Dimension::Color => "0 to 7",
        }
    }
}

impl Dimension {
    /// Returns the units that can be written after a value, and their factors to the unit of the
    /// quantity.
    pub(crate) const fn units(self) -> &'static [(&'static str, f64)] {
        match self {
            Dimension::Speed => &[("mm/s", 1.0), ("cm/s", 10.0), ("m/s", 1000.0)],
            Dimension::TurningRate => &[("deg/s", 1.0), ("rad/s", 180.0 / std::f64::consts::PI)],
            Dimension::Length => &[("mm", 1.0), ("cm", 10.0), ("m", 1000.0)],
            Dimension::Angle => &[("deg", 1.0), ("rad", 180.0 / std::f64::consts::PI)],
            Dimension::Share | Dimension::Color => &[],
        }
    }
}

impl Amount {
    /// Returns the value in a call; `None` if the argument list does not have the parameter. `list`
    /// is the argument list that accepts the call, and `arguments` are its arguments.
    pub fn value(&self, list: &[Parameter], arguments: &[f64]) -> Option<f64> {
        match self {
            Amount::Constant(value) => Some(*value),
            Amount::Parameter { name, factor } => {
                let place = list.iter().position(|parameter| parameter.name == *name)?;
                Some(arguments.get(place)? * factor)
            }
        }
    }

    /// Returns true if calls with the argument list have a value.
    pub(crate) fn has_value(&self, list: &[Parameter]) -> bool {
        match self {
            Amount::Constant(_) => true,
            Amount::Parameter { name, .. } => list.iter().any(|parameter| parameter.name == *name),
        }
    }
}

/// Writes the amount as in `10 * left`.
impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Amount::Constant(value) => write!(f, "{}", number_text(*value)),
            Amount::Parameter { name, factor: 1.0 } => write!(f, "{name}"),
            Amount::Parameter { name, factor } => write!(f, "{} * {name}", number_text(*factor)),
        }
    }
}

/// Writes the vector as in `forward = 10 * x mm/s, leftward = 10 * y mm/s`.
impl fmt::Display for SteeringVector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SteeringVector::Cartesian { forward, leftward } => {
                write!(f, "forward = {forward} mm/s, leftward = {leftward} mm/s")
            }
            SteeringVector::Polar { speed, direction } => {
                write!(f, "speed = {speed} mm/s, direction = {direction} deg")
            }
        }
    }
}

impl SteeringVector {
    /// Returns both amounts, in the order of the fields.
    pub const fn amounts(&self) -> [&Amount; 2] {
        match self {
            SteeringVector::Cartesian { forward, leftward } => [forward, leftward],
            SteeringVector::Polar { speed, direction } => [speed, direction],
        }
    }
}

/// Writes the assignment as in `left_wheel = 10 * left mm/s`.
impl fmt::Display for EffectAssignment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}", self.quantity.name(), self.amount)?;
        match self.quantity.dimension() {
            Dimension::Share | Dimension::Color => Ok(()),
            _ => write!(f, " {}", self.quantity.unit()),
        }
    }
}

impl FunctionEffect {
    /// Returns the quantities that a call sets, with their values before any limit. `list` is the
    /// argument list that accepts the call, and `arguments` are its arguments.
    pub fn values<'a>(
        &'a self,
        list: &'a [Parameter],
        arguments: &'a [f64],
    ) -> impl Iterator<Item = (ActuatorQuantity, f64)> + 'a {
        self.sets.iter().filter_map(move |EffectAssignment { quantity, amount }| {
            Some((*quantity, amount.value(list, arguments)?))
        })
    }
}
