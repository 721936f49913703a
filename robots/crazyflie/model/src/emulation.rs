//! The Crazyflie in an emulator: one process per robot, with a positioning system.

use std::time::Duration;

use bittybuzz_arena::engine::{LinkStatistics, Pose, RobotView};
use bittybuzz_arena::robot::Emulation;
use bittybuzz_emulation::message::{BoardStatistics, Command, Deck, RobotStatistics};
use bittybuzz_emulation::{F405, MemoryMap};
use bittybuzz_robot_spec::{NumberProfile, Robot};

use crate::{CrazyflieModel, Positioning};

/// Time between two positions that the robot receives, as with Lighthouse or Loco.
const EXCHANGE_PERIOD: Duration = Duration::from_millis(100);

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
        EXCHANGE_PERIOD
    }

    fn sense(&self, view: &RobotView, _: u16) -> Option<Command> {
        let Pose { x, y, z, heading } = view.estimate?;
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
