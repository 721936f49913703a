//! `[body.*]`: the models of the robots, and their differences from the default ones.

use std::sync::Arc;

use bittybuzz_robot_spec::Robot;

use crate::robot::{DescribedRobot, RobotModel};

use super::error::ScenarioCause;
use super::keys;
use super::read::Section;

/// Returns the models with the settings of the file.
pub fn read(root: &Section<'_>, models: &[Arc<dyn RobotModel>]) -> Vec<Arc<dyn RobotModel>> {
    let Some(body) = root.section("body", keys::BODY) else { return models.to_vec() };
    let with =
        |model: &Arc<dyn RobotModel>| match body.section(model.name(), model.keys().body.name) {
            Some(section) => model.read(&section),
            None => model.clone(),
        };
    models.iter().map(with).collect()
}

/// Returns the model of a group, with the group's own settings. It is the model that the group
/// names, the description in the robot's file, or the model of a robot that ships.
pub fn of_group(
    group: &Section<'_>,
    robot: &Robot,
    models: &[Arc<dyn RobotModel>],
) -> Option<Arc<dyn RobotModel>> {
    let model = if group.get("body").is_some() {
        let words: Vec<_> = models.iter().map(|model| (model.name(), model)).collect();
        group.word("body", &words)?.clone()
    } else if let Some(described) = DescribedRobot::new(robot) {
        Arc::new(described)
    } else {
        let shipped = models.iter().find(|model| model.robots().contains(&robot.name.as_str()));
        if shipped.is_none() {
            let known = models.iter().map(|model| model.name()).collect();
            group.fail(ScenarioCause::NoBody { robot: robot.name.clone(), known });
        }
        shipped?.clone()
    };
    Some(match group.section("model", model.keys().model) {
        Some(section) => model.read(&section),
        None => model,
    })
}
