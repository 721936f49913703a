//! Crazyflie: follows a velocity, and believes to be where its positioning system says.

/// What the flight controller is told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Flight {
    /// Propellers off: stands, or falls.
    #[default]
    Off,
    /// Fly.
    Velocity(Velocity),
}

/// A velocity in the robot's own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Velocity {
    /// mm/s ahead.
    pub forward: f32,
    /// mm/s to the left.
    pub left: f32,
    /// mm/s up.
    pub up: f32,
    /// Radians per second, anticlockwise.
    pub turn: f32,
}

/// What tells a Crazyflie where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Positioning {
    /// Nothing: it knows no position, and neighbours have no place.
    None,
    /// It counts what it flew (Flow deck): the errors add up.
    Flow {
        /// Deviation of the horizontal error after a second of flight, mm; it grows with the root of the time.
        walk: f32,
        /// Deviation of the yaw's error after a second of flight, radians.
        yaw_walk: f32,
    },
    /// It measures where it is (Lighthouse, Loco): errors of one moment are independent of the last.
    Absolute {
        /// Deviation of each coordinate, mm.
        sigma: f32,
        /// Deviation of the yaw, radians.
        yaw_sigma: f32,
    },
}

impl Positioning {
    /// Flow deck. The growth is a choice: some centimetres in a minute.
    pub const FLOW: Self = Positioning::Flow { walk: 5.0, yaw_walk: 0.002 };
    /// Lighthouse deck: 1 to 2 cm.
    pub const LIGHTHOUSE: Self = Positioning::Absolute { sigma: 10.0, yaw_sigma: 0.01 };
    /// Loco positioning deck: 10 cm.
    pub const LOCO: Self = Positioning::Absolute { sigma: 100.0, yaw_sigma: 0.05 };
}

/// Numbers of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrazyflieModel {
    /// mm
    pub radius: f32,
    /// Time in which the velocity comes to 63 % of what was asked, seconds.
    pub lag: f32,
    /// Greatest speed, mm/s.
    pub speed: f32,
    /// Greatest acceleration, mm/s².
    pub acceleration: f32,
    /// What tells it where it is.
    pub positioning: Positioning,
}

impl CrazyflieModel {
    /// Collision cylinder of gym-pybullet-drones; 1 m/s and 20 degrees of tilt, hence 3.6 m/s², as Bitcraze's position
    /// controller allows; the lag is a choice.
    pub const STANDARD: Self = CrazyflieModel {
        radius: 60.0,
        lag: 0.3,
        speed: 1000.0,
        acceleration: 3600.0,
        positioning: Positioning::LIGHTHOUSE,
    };
}
