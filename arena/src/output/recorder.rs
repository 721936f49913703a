//! From a run to the samples of a recording.

use crate::engine::RobotState;
use crate::run::Simulation;

use super::recording::{Header, Robot, State};

/// The header of a recording of this run.
pub fn header(simulation: &Simulation) -> Header {
    let setup = simulation.setup();
    let ids = (0..simulation.robot_count()).map(|number| setup.id(number)).collect();
    let size = setup.scenario.world.size.map(|side| side as u32);
    Header { size, tick_ms: crate::engine::TICK_US / 1000, ids }
}

/// Every robot as it is now.
pub fn robots(simulation: &Simulation) -> Vec<Option<Robot>> {
    let robot = |number: usize| {
        let view = simulation.view(number)?;
        let tenths = |mm: f32| (mm * 10.0).round() as i32;
        let turn = f64::from(view.pose.heading) / std::f64::consts::TAU;
        let state = match view.state {
            RobotState::Running if simulation.is_faulted(number) => State::Faulted,
            RobotState::Running => State::Running,
            RobotState::Stopped => State::Stopped,
            RobotState::Failed => State::Failed,
        };
        Some(Robot {
            x: tenths(view.pose.x),
            y: tenths(view.pose.y),
            z: tenths(view.pose.z),
            heading: (turn * 65_536.0).round() as i32 as u16,
            led: view.led,
            state,
        })
    };
    (0..simulation.robot_count()).map(robot).collect()
}
