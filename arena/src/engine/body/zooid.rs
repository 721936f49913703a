//! Zooid: two wheels, tracked by a projector.

/// Duties of the wheels in percent, -100 (backwards) to 100.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wheels {
    /// Left wheel.
    pub left: i8,
    /// Right wheel.
    pub right: i8,
}

/// Numbers of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZooidModel {
    /// mm
    pub radius: f32,
    /// Between the wheels, mm.
    pub track: f32,
    /// mm/s of a wheel at `full_duty`.
    pub speed: f32,
    /// Duty in percent at which a wheel has `speed`; from `dead_duty` the speed grows linearly.
    pub full_duty: u8,
    /// Duty in percent up to which a wheel stands still.
    pub dead_duty: u8,
    /// Deviation of each wheel's gain, as a part of 1.
    pub gain_sigma: f32,
    /// The size in mm of one step of the projector's code.
    pub unit: f32,
}

impl ZooidModel {
    /// Track and diameter from the makers' description; 0.5 m/s is the reported top speed, 60 the highest duty their
    /// firmware uses, 22 where its calibration begins. No curve of duty and speed is published: linear is a choice, and
    /// so is the deviation.
    pub const STANDARD: Self = ZooidModel {
        radius: 13.0,
        track: 20.0,
        speed: 500.0,
        full_duty: 60,
        dead_duty: 22,
        gain_sigma: 0.05,
        unit: 0.92,
    };
}
