//! Sensors of a robot and the motion capture of its room.
//!
//! The caller passes the state of a robot to each sensor after **every** step of a millisecond.
//! A sensor returns a measurement when one is due, and nothing otherwise. Each sensor owns its random
//! numbers, so adding one does not change the others.

mod barometer;
mod delay;
mod fault;
mod flow;
mod height;
mod imu;
mod motion_capture;
mod vibration;

pub use barometer::Barometer;
pub use fault::SensorFault;
pub use flow::{FloorSurface, FlowCounts, FlowSensor, FlowSettings, QuantizationRemainder};
pub use height::{HeightReading, HeightSensor};
pub use imu::{Imu, ImuCounts, ImuSettings};
pub use motion_capture::{CapturedPose, MotionCapture, MotionCaptureSettings};
pub use vibration::RotorVibration;

use crate::Airframe;

/// All sensors of a robot with a Flow deck in a room with motion capture, with usual settings.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorSuite {
    /// Gyroscope and accelerometer.
    pub imu: Imu,
    /// Optical flow.
    pub flow: FlowSensor,
    /// Height above the ground.
    pub height: HeightSensor,
    /// Motion capture.
    pub motion_capture: MotionCapture,
}

impl SensorSuite {
    /// Returns the sensors of one build.
    ///
    /// # Parameters
    /// `seed`: the build and the noise of its sensors.
    #[must_use]
    pub fn new(airframe: &Airframe, seed: u64) -> Self {
        SensorSuite {
            imu: Imu::new(airframe, ImuSettings::BMI088, seed),
            flow: FlowSensor::new(FlowSettings::PMW3901, seed),
            height: HeightSensor::new(seed),
            motion_capture: MotionCapture::new(MotionCaptureSettings::ROOM, seed),
        }
    }
}
