//! The Crazyflie in an emulator: one process per robot, with a positioning system.

use std::time::Duration;

use bittybuzz_arena::engine::{LinkStatistics, Pose, RobotView};
use bittybuzz_arena::robot::Emulation;
use bittybuzz_arena::robot::RobotModel;
use bittybuzz_emulation::message::{
    BoardStatistics, Command, Deck, EmulatorEvent, RobotStatistics,
};
use bittybuzz_emulation::{F405, MemoryMap};
use bittybuzz_flight::pilot::PilotSettings;
use bittybuzz_robot_spec::{NumberProfile, Robot};

use crate::{CrazyflieModel, Fidelity, Positioning};

/// Time between two positions that the robot receives, as with Lighthouse or Loco.
const EXCHANGE_PERIOD: Duration = Duration::from_millis(100);
/// Time between two exchanges of a robot that flies: its range finders measure about 30 times per
/// second.
const FLIGHT_EXCHANGE_PERIOD: Duration = Duration::from_millis(25);

/// The type of syslink frames that are packets of CRTP.
const RADIO_RAW: u8 = 0x00;
/// A ground station's command to arm, on port 9 and channel 1 of CRTP, and the answer of a robot
/// that accepts it (crazyflie-firmware, crtp_supervisor.h).
const ARM: [u8; 3] = [0x9d, 1, 1];
const ARMED: [u8; 4] = [0x9d, 0x81, 1, 1];

impl Emulation for CrazyflieModel {
    fn program(&self) -> &'static str {
        "bbz-emulate-stm32"
    }

    fn shared_program_robot(&self) -> Option<&'static str> {
        None
    }

    fn robots_max(&self) -> u32 {
        20
    }

    fn image(&self, robot: &Robot) -> Option<&'static str> {
        robot.layout.as_ref()?.id?;
        Some(match robot.profile {
            NumberProfile::Full => {
                "firmware/crazyflie/target/thumbv7em-none-eabihf/release/bittybuzz-crazyflie"
            }
            NumberProfile::Tiny => {
                "firmware/crazyflie/target/tiny/thumbv7em-none-eabihf/release/bittybuzz-crazyflie"
            }
        })
    }

    fn has_trace(&self) -> bool {
        true
    }

    fn has_switch(&self) -> bool {
        false
    }

    fn exchange_period(&self) -> Duration {
        if self.flies() { FLIGHT_EXCHANGE_PERIOD } else { EXCHANGE_PERIOD }
    }

    fn flies(&self) -> bool {
        self.fidelity == Fidelity::Flight
    }

    fn standing_mm(&self) -> f32 {
        PilotSettings::CRAZYFLIE.standing_m * 1000.0
    }

    fn unsupported_in_flight(&self) -> Vec<&'static str> {
        let avoidance = (self.avoidance > 0.0).then_some("avoidance");
        // By a Flow deck alone the image does not know at which place of the world it begins.
        let needs_poses = !matches!(self.positioning, Positioning::Absolute { .. });
        let positioning = needs_poses.then_some("positioning = \"flow\"");
        let surroundings = self.unusual_surroundings().into_iter().map(|key| key.name);
        surroundings.chain(avoidance).chain(positioning).collect()
    }

    fn range_finders(&self) -> Option<Command> {
        Some(Command::Decks { decks: vec![Deck::ZRangerV2, Deck::MultiRanger] })
    }

    fn permission(&self) -> Option<Command> {
        self.armed.then(|| Command::Send { kind: RADIO_RAW, payload: ARM.to_vec() })
    }

    fn is_permitted(&self, event: &EmulatorEvent) -> bool {
        matches!(event, EmulatorEvent::Syslink { kind: RADIO_RAW, payload, intact: true }
            if payload[..] == ARMED)
    }

    fn ranges(&self, distances_mm: [Option<f32>; 4]) -> Option<Command> {
        let [front_mm, left_mm, back_mm, right_mm] =
            distances_mm.map(|distance| distance.map(|mm| mm as u16));
        let (down_mm, up_mm) = (None, None);
        Some(Command::Ranges { down_mm, front_mm, back_mm, left_mm, right_mm, up_mm })
    }

    fn sense(&self, view: &RobotView, _: u16) -> Option<Command> {
        // The source of poses of a robot that flies is in its emulator.
        let Pose { x, y, z, heading } = view.estimate.filter(|_| !self.flies())?;
        Some(Command::Pose { x_mm: x, y_mm: y, z_mm: z, yaw_degrees: heading.to_degrees() })
    }

    fn image_memory(&self) -> Option<MemoryMap> {
        Some(F405::MEMORY)
    }

    /// Poses of any system outside of the robot come by radio, as those of cameras.
    fn body(&self, pose: &Pose, seed: u64) -> Vec<Command> {
        let (pose_ms, sigma_mm, sigma_rad) = match self.positioning {
            Positioning::Absolute { sigma, yaw_sigma, period_ms } => (period_ms, sigma, yaw_sigma),
            Positioning::Flow { .. } | Positioning::None => (0, 0.0, 0.0),
        };
        let body = Command::Body {
            seed,
            x_mm: pose.x.into(),
            y_mm: pose.y.into(),
            yaw_degrees: f64::from(pose.heading).to_degrees(),
            pose_ms: pose_ms.into(),
            pose_noise_mm: sigma_mm.into(),
            pose_noise_degrees: f64::from(sigma_rad).to_degrees(),
        };
        let has_deck = matches!(self.positioning, Positioning::Flow { .. });
        let deck = has_deck.then(|| Command::Decks { decks: vec![Deck::FlowV2] });
        deck.into_iter().chain([body]).collect()
    }

    fn count(&self, statistics: &RobotStatistics, links: &mut LinkStatistics) -> u64 {
        // The caller names the emulator's program, which may be that of another robot.
        let BoardStatistics::Crazyflie(board) = &statistics.board else { return 0 };
        let air = &statistics.air;
        links.deaf += board.radio_unheard;
        links.received = air.carried - air.lost - air.collided;
        board.radio_overflown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the commands for a robot with this positioning, and its body's period and noise.
    fn body(positioning: Positioning) -> (Vec<Command>, (u32, f64, f64)) {
        let model = CrazyflieModel { positioning, ..CrazyflieModel::STANDARD };
        let commands = model.body(&Pose::new(100.0, -50.0, 1.0), 3);
        let Some(Command::Body { x_mm, y_mm, pose_ms, pose_noise_mm, pose_noise_degrees, .. }) =
            commands.last()
        else {
            panic!("{commands:?}")
        };
        assert_eq!([*x_mm, *y_mm], [100.0, -50.0]);
        let poses = (*pose_ms, *pose_noise_mm, (*pose_noise_degrees).to_radians());
        (commands, poses)
    }

    #[test]
    fn a_person_permits_only_armed_robots() {
        let flying = CrazyflieModel { fidelity: Fidelity::Flight, ..CrazyflieModel::STANDARD };
        assert_eq!(flying.unsupported_in_flight(), Vec::<&str>::new());
        assert!(flying.permission().is_none());
        assert!(CrazyflieModel { armed: true, ..flying }.permission().is_some());
    }

    #[test]
    fn positioning_selects_the_deck_and_the_poses() {
        let (flow, poses) = body(Positioning::FLOW);
        assert_eq!(flow[0], Command::Decks { decks: vec![Deck::FlowV2] });
        assert_eq!((flow.len(), poses), (2, (0, 0.0, 0.0)));
        let (none, poses) = body(Positioning::None);
        assert_eq!((none.len(), poses), (1, (0, 0.0, 0.0)));
        let (capture, (period_ms, noise_mm, noise_rad)) = body(Positioning::CAPTURE);
        assert_eq!((capture.len(), period_ms, noise_mm), (1, 10, 0.5));
        assert!((noise_rad - 0.005).abs() < 1e-6);
        assert_eq!(body(Positioning::LOCO).1.0, 20);
    }
}
