//! The packets of a ground station, which the nRF51 passes to the STM32 unchanged.

use super::LinkFrame;

/// Type of the link frames that carry these packets.
const RADIO_RAW: u8 = 0x00;
/// Port 6, localization; channel 1, generic. The two bits between the fields are always set
/// (Bitcraze, "CRTP - Communication with the Crazyflie" and "Localization CRTP port").
const GENERIC_LOCALIZATION: u8 = 6 << 4 | 3 << 2 | 1;
/// The external pose: x, y, z in m and a quaternion x, y, z, w, each a binary32, least significant
/// byte first.
const EXTERNAL_POSE: u8 = 8;

/// The robot's pose, measured by a positioning system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExternalPose {
    /// x, y and z (up) in m.
    pub position_m: [f32; 3],
    /// Rotation from the body frame to the world frame: x, y, z and w of a quaternion.
    pub attitude: [f32; 4],
}

impl ExternalPose {
    /// Returns the pose of an upright robot.
    ///
    /// # Parameters
    /// `yaw_degrees`: direction of the robot's nose in degrees, from x towards y.
    pub fn upright(position_mm: [f32; 3], yaw_degrees: f32) -> Self {
        let half = f64::from(yaw_degrees).to_radians() / 2.0;
        ExternalPose {
            position_m: position_mm.map(|mm| mm / 1000.0),
            attitude: [0.0, 0.0, half.sin() as f32, half.cos() as f32],
        }
    }

    /// Returns the packet that a ground station sends.
    pub fn frame(&self) -> LinkFrame {
        let mut payload = vec![GENERIC_LOCALIZATION, EXTERNAL_POSE];
        let numbers = self.position_m.into_iter().chain(self.attitude);
        payload.extend(numbers.flat_map(f32::to_le_bytes));
        LinkFrame { kind: RADIO_RAW, payload }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn to the left is (0, 0, sin 45°, cos 45°).
    #[test]
    fn a_packet_of_thirty_bytes() {
        let pose = ExternalPose::upright([1500.0, -250.0, 1000.0], 90.0);
        let frame = pose.frame();
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let numbers: Vec<u8> = [1.5, -0.25, 1.0, 0.0, 0.0, half, half]
            .into_iter()
            .flat_map(f32::to_le_bytes)
            .collect();
        assert_eq!((frame.kind(), frame.payload().len()), (0x00, 30));
        assert_eq!(frame.payload(), [&[0x6d, 0x08][..], &numbers].concat());
    }
}
