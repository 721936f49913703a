//! `[body.*]`: the models of the robots, and in what they differ from the real ones.

use std::sync::Arc;

use bittybuzz_robot_spec::Robot;
use bittybuzz_toml_reader::TomlError;

use crate::robot::RobotModel;

use super::keys;
use super::read::Section;

/// Returns the models with the numbers of the file.
pub fn read(root: &Section<'_>, models: &[Arc<dyn RobotModel>]) -> Vec<Arc<dyn RobotModel>> {
    let Some(body) = root.section("body", keys::BODY) else { return models.to_vec() };
    let with =
        |model: &Arc<dyn RobotModel>| match body.section(model.name(), model.keys().body.name) {
            Some(section) => model.read(&section),
            None => model.clone(),
        };
    models.iter().map(with).collect()
}

/// Returns the model of a group: that of a robot that ships, or the one that the group names; with the group's own numbers.
pub fn of_group(
    group: &Section<'_>,
    robot: &Robot,
    models: &[Arc<dyn RobotModel>],
) -> Option<Arc<dyn RobotModel>> {
    let model = if group.get("body").is_some() {
        let words: Vec<_> = models.iter().map(|model| (model.name(), model)).collect();
        group.word("body", &words)?
    } else {
        let found = models.iter().find(|model| model.robots().contains(&robot.name.as_str()));
        if found.is_none() {
            group.fail(TomlError::MissingKey { key: "body", section: group.name });
        }
        found?
    };
    Some(match group.section("model", model.keys().model) {
        Some(section) => model.read(&section),
        None => model.clone(),
    })
}
