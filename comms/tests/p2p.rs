//! Swarm messages in P2P frames and packets of the ground station, with arbitrary input.

use bittybuzz_comms::syslink::{Crtp, P2P_MAX, Position, SWARM_MESSAGE_MAX, SwarmFrame};
use proptest::collection::vec;
use proptest::prelude::*;

proptest! {
    #[test]
    fn written_frames_are_parsed(
        robot: u16,
        position: Option<[i16; 3]>,
        message in vec(any::<u8>(), 1..=SWARM_MESSAGE_MAX),
    ) {
        let frame = SwarmFrame { robot, position: position.map(Position), message: &message };
        let mut buffer = [0; P2P_MAX];
        let data = frame.write(&mut buffer).expect("it fits");
        prop_assert_eq!(SwarmFrame::parse(data), Some(frame));
    }

    /// A parsed frame has exactly one serialization.
    #[test]
    fn a_parsed_frame_has_one_serialization(
        tag in prop_oneof![Just(0xb0_u8), Just(0xb1), any::<u8>()],
        rest in vec(any::<u8>(), 0..=70),
    ) {
        let data = [&[tag][..], &rest].concat();
        if let Some(frame) = SwarmFrame::parse(&data) {
            let mut buffer = [0; P2P_MAX];
            prop_assert_eq!(frame.write(&mut buffer), Some(&data[..]));
        }
    }

    /// An accepted pose has finite numbers only.
    #[test]
    fn accepted_poses_are_finite(
        header in prop_oneof![Just(0x6d_u8), any::<u8>()],
        data in vec(any::<u8>(), 0..=32),
        numbers: [f32; 7],
        is_pose: bool,
    ) {
        let pose: Vec<u8> = numbers.into_iter().flat_map(f32::to_le_bytes).collect();
        let data = if is_pose { [&[8][..], &pose].concat() } else { data };
        if let Some(Crtp::ExternalPose(pose)) = Crtp::parse(&[&[header][..], &data].concat()) {
            prop_assert!(pose.position_m.iter().all(|m| m.abs() <= 1000.0));
            prop_assert!(pose.quaternion.iter().all(|part| part.abs() <= 1.1));
        }
    }

    #[test]
    fn positions_are_nearest(mm: [f32; 3]) {
        match Position::from_mm(mm) {
            Some(position) => {
                let near = |(whole, exact): (f32, f32)| (whole - exact).abs() <= 0.5;
                prop_assert!(position.mm().into_iter().zip(mm).all(near));
            }
            None => prop_assert!(mm.iter().any(|mm| mm.is_nan() || mm.abs() > 32767.0)),
        }
    }
}
