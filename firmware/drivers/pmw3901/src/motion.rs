//! The result of a burst.

/// The number of bytes of a burst.
pub const BURST_BYTES: usize = 12;

/// The bit of [`MotionCounts::motion`] that says that the picture has moved.
const MOVED: u8 = 1 << 7;
/// The only value of [`MotionCounts::motion`] with which crazyflie-firmware uses the counts: the
/// picture has moved, bits 5 and 4 have their fixed value of 1, and no other bit is set.
const VALID_MOTION: u8 = 0xb0;

/// The angle of a count: a tenth of a pixel, of which 35 are 0.71674 rad (crazyflie-firmware,
/// mm_flow.c: twice the sine of 21°, half the field of view). PX4 has 1/500 rad, which is 2 % less.
const RAD_PER_COUNT: f32 = 0.1 * 0.71674 / 35.0;

/// The motion of the picture since the last reading, with properties of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotionCounts {
    /// Bits of the state. See [`has_moved`](Self::has_moved) and
    /// [`has_valid_motion`](Self::has_valid_motion).
    pub motion: u8,
    /// Bits of the chip's health, which are not documented.
    pub observation: u8,
    /// The motion along the chip's axes. On the Flow deck, the motion along the robot's x axis is
    /// the negative of `delta_y`, and that along y is the negative of `delta_x`.
    pub delta_x: i16,
    pub delta_y: i16,
    /// The measure of the features in the picture: 0 without any.
    pub surface_quality: u8,
    /// The mean, the highest and the lowest brightness.
    pub raw_sum: u8,
    pub raw_max: u8,
    pub raw_min: u8,
    /// The time of exposure, which is long in the dark. crazyflie-firmware can derive the noise of
    /// the counts from it.
    pub shutter: u16,
}

/// Angles by which the picture has moved along the chip's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowAngles {
    pub x_rad: f32,
    pub y_rad: f32,
}

impl MotionCounts {
    /// Reads a burst. The counts come with their low byte first, the shutter with its high byte.
    pub(crate) fn new(bytes: [u8; BURST_BYTES]) -> MotionCounts {
        let [
            motion,
            observation,
            x_low,
            x_high,
            y_low,
            y_high,
            surface_quality,
            raw_sum,
            raw_max,
            raw_min,
            shutter_high,
            shutter_low,
        ] = bytes;
        MotionCounts {
            motion,
            observation,
            delta_x: i16::from_le_bytes([x_low, x_high]),
            delta_y: i16::from_le_bytes([y_low, y_high]),
            surface_quality,
            raw_sum,
            raw_max,
            raw_min,
            shutter: u16::from_be_bytes([shutter_high, shutter_low]),
        }
    }

    /// Returns true if the picture has moved since the last reading.
    pub fn has_moved(self) -> bool {
        self.motion & MOVED != 0
    }

    /// Returns true if the picture has moved and the chip reports nothing unusual, which is the
    /// condition of crazyflie-firmware for the use of the counts.
    pub fn has_valid_motion(self) -> bool {
        self.motion == VALID_MOTION
    }

    /// Converts the counts to radians.
    pub fn angles(self) -> FlowAngles {
        FlowAngles {
            x_rad: f32::from(self.delta_x) * RAD_PER_COUNT,
            y_rad: f32::from(self.delta_y) * RAD_PER_COUNT,
        }
    }
}
