//! The Crazyflie in an emulator: one process per robot, with a positioning system.

use std::time::Duration;

use bittybuzz_arena::engine::{LinkStatistics, Pose, RobotView};
use bittybuzz_arena::robot::Emulation;
use bittybuzz_emulation::message::{BoardStatistics, Command, RobotStatistics};
use bittybuzz_robot_spec::{NumberProfile, Robot};

use crate::CrazyflieModel;

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

    fn count(&self, statistics: &RobotStatistics, links: &mut LinkStatistics) -> u64 {
        // The caller names the emulator's program, which may be that of another robot.
        let BoardStatistics::Crazyflie(board) = &statistics.board else { return 0 };
        let air = &statistics.air;
        links.deaf += board.radio_unheard;
        links.received = air.carried - air.lost - air.collided;
        board.radio_overflown
    }
}
