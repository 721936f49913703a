//! Converts a run to the samples of a recording.

use crate::engine::RobotState;
use crate::run::Simulation;
use crate::scenario::{self, Scenario};

use super::recording::{
    RecordedBody, RecordedMovable, RecordedObstacle, RecordedOutline, RecordedPatch, RecordedRobot,
    RecordedShape, RecordingHeader, RobotStatus,
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
        ground: world.ground.iter().map(patch).collect(),
        obstacles: world.obstacles.iter().map(obstacle).collect(),
        movables: world.movables.iter().map(movable).collect(),
    }
}

fn movable(movable: &scenario::MovableSection) -> RecordedMovable {
    RecordedMovable {
        at: movable.at.map(tenths),
        radius: tenths(movable.radius).unsigned_abs(),
        height: movable.height.map(|height| tenths(height).unsigned_abs()),
    }
}

fn patch(patch: &scenario::PatchSection) -> RecordedPatch {
    let brightness = (patch.brightness * 1000.0).round() as u32;
    RecordedPatch { shape: shape(patch.shape), brightness }
}

fn shape(shape: scenario::Shape) -> RecordedShape {
    match shape {
        scenario::Shape::Disc { at: [x, y], radius } => {
            RecordedShape::Disc([x, y, radius].map(tenths))
        }
        scenario::Shape::Block { at: [x, y], size: [width, height], heading } => {
            let [x, y, width, height] = [x, y, width, height].map(tenths);
            RecordedShape::Block([x, y, width, height, turn(heading / 360.0).into()])
        }
    }
}

fn obstacle(obstacle: &scenario::ObstacleSection) -> RecordedObstacle {
    let outline = match obstacle.outline {
        scenario::Outline::Shape(of) => RecordedOutline::Shape(shape(of)),
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

/// Rounds a coordinate in mm to tenths of mm.
fn place_tenths(mm: f32) -> i32 {
    (mm * 10.0).round() as i32
}

/// Converts full turns to 1/65536 of a turn.
fn turn(turns: f64) -> u16 {
    (turns * 65_536.0).round() as i32 as u16
}

/// Returns the current center of every movable disc.
pub fn movables(simulation: &Simulation) -> Vec<[i32; 2]> {
    simulation.movables().map(|disc| [disc.x, disc.y].map(place_tenths)).collect()
}

/// Returns the current state of every robot; `None` for a robot that has not joined.
pub fn robots(simulation: &Simulation) -> Vec<Option<RecordedRobot>> {
    let robot = |number: usize| {
        let view = simulation.view(number)?;
        let state = match view.state {
            RobotState::Running if simulation.is_faulted(number) => RobotStatus::Faulted,
            RobotState::Running => RobotStatus::Running,
            RobotState::Stopped => RobotStatus::Stopped,
            RobotState::Failed => RobotStatus::Failed,
        };
        Some(RecordedRobot {
            x: place_tenths(view.pose.x),
            y: place_tenths(view.pose.y),
            z: place_tenths(view.pose.z),
            heading: turn(f64::from(view.pose.heading) / std::f64::consts::TAU),
            led: view.led,
            state,
        })
    };
    (0..simulation.robot_count()).map(robot).collect()
}
