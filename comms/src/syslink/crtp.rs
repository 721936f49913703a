//! The packets of the ground station (CRTP) that a robot without decks needs. Source: Bitcraze,
//! "CRTP - Communication with the Crazyflie" and "Localization CRTP port".

/// Masks the two reserved bits between port and channel.
const HEADER_MASK: u8 = 0xf3;
/// Port 15, channel 0.
const ECHO: u8 = 0xf0;
/// Port 6, channel 1.
const GENERIC_LOCALIZATION: u8 = 0x61;
/// The type byte of an external pose among the packets of generic localization.
const EXTERNAL_POSE: u8 = 8;

/// The limit of plausible coordinates, in m. A pose with a larger one is rejected as an error.
const COORDINATE_MAX_M: f32 = 1000.0;

/// A packet of the ground station.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Crtp {
    /// A packet to be sent back unchanged.
    Echo,
    /// The robot's pose, measured by a positioning system.
    ExternalPose(ExternalPose),
}

/// The robot's pose, measured by a positioning system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExternalPose {
    /// The position x, y and z (up) in m, at most 1 km from the origin in each direction.
    pub position_m: [f32; 3],
    /// The rotation from the robot's frame (x ahead, y to the left) to the world's, as x, y, z, w.
    /// Its length is 1, or nearly.
    pub quaternion: [f32; 4],
}

impl Crtp {
    /// Parses the data of a raw frame; `None` if the packet is invalid or not needed here.
    pub fn parse(packet: &[u8]) -> Option<Self> {
        let (header, data) = packet.split_first()?;
        match (header & HEADER_MASK, data) {
            (ECHO, _) => Some(Crtp::Echo),
            (GENERIC_LOCALIZATION, [EXTERNAL_POSE, numbers @ ..]) => {
                ExternalPose::parse(numbers).map(Crtp::ExternalPose)
            }
            _ => None,
        }
    }
}

impl ExternalPose {
    /// Parses seven binary32 numbers, least significant byte first.
    fn parse(bytes: &[u8]) -> Option<Self> {
        let (numbers, []) = bytes.as_chunks::<4>() else { return None };
        let numbers: &[[u8; 4]; 7] = numbers.try_into().ok()?;
        let [x, y, z, quaternion @ ..] = numbers.map(f32::from_le_bytes);
        let position_m = [x, y, z];
        // A range contains no NaN, so this check rejects NaN as well.
        let is_near = position_m.iter().all(|m| (-COORDINATE_MAX_M..=COORDINATE_MAX_M).contains(m));
        let square: f32 = quaternion.iter().map(|part| part * part).sum();
        (is_near && (0.9..=1.1).contains(&square))
            .then_some(ExternalPose { position_m, quaternion })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    fn packet(numbers: &[f32]) -> Vec<u8> {
        let numbers: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        [&[0x6d, 8][..], &numbers].concat()
    }

    /// Bitcraze's library packs it as `<Bfffffff` on port 6, channel 1.
    #[test]
    fn an_external_pose() {
        let bytes = [
            0x6d, 8, 0, 0, 0xc0, 0x3f, 0, 0, 0x80, 0xbe, 0, 0, 0x80, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0,
            0, 0, 0, 0, 0, 0, 0x80, 0x3f,
        ];
        let pose = ExternalPose { position_m: [1.5, -0.25, 1.0], quaternion: [0.0, 0.0, 0.0, 1.0] };
        assert_eq!(Crtp::parse(&bytes), Some(Crtp::ExternalPose(pose)));
        assert_eq!(packet(&[1.5, -0.25, 1.0, 0.0, 0.0, 0.0, 1.0]), bytes);
        // The reserved bits may be anything.
        let other = [&[0x61], &bytes[1..]].concat();
        assert_eq!(Crtp::parse(&other), Some(Crtp::ExternalPose(pose)));
    }

    #[test]
    fn a_pose_has_its_limits() {
        let pose = |at: usize, value: f32| {
            let mut numbers = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            numbers[at] = value;
            Crtp::parse(&packet(&numbers))
        };
        for at in 0..3 {
            for limit in [1000.0_f32, -1000.0] {
                assert!(pose(at, limit).is_some());
                let beyond = if limit > 0.0 { limit.next_up() } else { limit.next_down() };
                assert_eq!(pose(at, beyond), None);
            }
        }
        // The square of the quaternion's length is 0.9 to 1.1.
        for (part, is_accepted) in
            [(0.9486, false), (0.9488, true), (1.0488, true), (1.0489, false)]
        {
            assert_eq!(pose(6, part).is_some(), is_accepted, "{part}");
        }
    }

    #[test]
    fn implausible_poses_are_rejected() {
        let good = [1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8];
        assert!(Crtp::parse(&packet(&good)).is_some());
        for (at, wrong) in
            [(0, f32::NAN), (1, f32::INFINITY), (2, -1000.5), (5, 0.0), (6, f32::NAN), (3, 0.5)]
        {
            let mut numbers = good;
            numbers[at] = wrong;
            assert_eq!(Crtp::parse(&packet(&numbers)), None, "{numbers:?}");
        }
        assert_eq!(Crtp::parse(&packet(&good)[..29]), None, "cut off");
        assert_eq!(Crtp::parse(&[&packet(&good)[..], &[0]].concat()), None, "too long");
        // Position only, on channel 0: without a direction it is of no use here.
        assert_eq!(Crtp::parse(&[&[0x6c][..], &packet(&good)[2..14]].concat()), None);
        assert_eq!(Crtp::parse(&[]), None);
        assert_eq!(Crtp::parse(&[0x6d]), None);
    }

    #[test]
    fn an_echo() {
        assert_eq!(Crtp::parse(&[0xfc, 1, 2]), Some(Crtp::Echo));
        assert_eq!(Crtp::parse(&[0xf0]), Some(Crtp::Echo));
        assert_eq!(Crtp::parse(&[0xf1]), None);
    }
}
