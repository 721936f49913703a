//! Converts a run to the samples of a recording.

use crate::engine::RobotState;
use crate::run::Simulation;
use crate::scenario::{self, Scenario};

use super::recording::{
    RecordedBody, RecordedObstacle, RecordedOutline, RecordedRobot, RecordingHeader, RobotStatus,
};

/// Returns the header of a recording of this run.
pub fn header(simulation: &Simulation) -> RecordingHeader {
    let setup = simulation.setup();
    let Scenario { world, .. } = &*setup.scenario;
    let body = |number| RecordedBody {
        id: setup.id(number),
        radius: tenths(setup.scenario.group(setup.group(number)).radius_mm()).unsigned_abs(),
    };
    RecordingHeader {
        size: world.size.map(|side| side as u32),
        tick_ms: crate::engine::TICK_US / 1000,
        bodies: (0..simulation.robot_count()).map(body).collect(),
        obstacles: world.obstacles.iter().map(obstacle).collect(),
    }
}

fn obstacle(obstacle: &scenario::ObstacleSection) -> RecordedObstacle {
    let outline = match obstacle.outline {
        scenario::Outline::Disc { at: [x, y], radius } => {
            RecordedOutline::Disc([x, y, radius].map(tenths))
        }
        scenario::Outline::Block { at: [x, y], size: [width, height] } => {
            RecordedOutline::Block([x, y, width, height].map(tenths))
        }
        scenario::Outline::Wall([x, y], [to_x, to_y]) => {
            RecordedOutline::Wall([x, y, to_x, to_y].map(tenths))
        }
    };
    RecordedObstacle {
        outline,
        height: obstacle.height.map(|height| tenths(height).unsigned_abs()),
    }
}

/// Rounds a length in mm to tenths of mm.
fn tenths(mm: f64) -> i32 {
    (mm * 10.0).round() as i32
}

/// Returns the current state of every robot; `None` for a robot that has not joined.
pub fn robots(simulation: &Simulation) -> Vec<Option<RecordedRobot>> {
    let robot = |number: usize| {
        let view = simulation.view(number)?;
        let place = |mm: f32| (mm * 10.0).round() as i32;
        let turn = f64::from(view.pose.heading) / std::f64::consts::TAU;
        let state = match view.state {
            RobotState::Running if simulation.is_faulted(number) => RobotStatus::Faulted,
            RobotState::Running => RobotStatus::Running,
            RobotState::Stopped => RobotStatus::Stopped,
            RobotState::Failed => RobotStatus::Failed,
        };
        Some(RecordedRobot {
            x: place(view.pose.x),
            y: place(view.pose.y),
            z: place(view.pose.z),
            heading: (turn * 65_536.0).round() as i32 as u16,
            led: view.led,
            state,
        })
    };
    (0..simulation.robot_count()).map(robot).collect()
}
