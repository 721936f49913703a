//! Robots that are placed by hand.
//!
//! A robot that is added, moved, turned or deleted turns the placement of its group into the list of
//! all start positions, so that the other robots stay where they are. In a list, only the entry of
//! the robot changes. The places of other groups are random numbers that may depend on it; a group
//! that would start elsewhere becomes a list, too.

use std::ops::Range;

use bittybuzz_arena::engine::Pose;
use bittybuzz_arena::run::start_poses;
use bittybuzz_arena::scenario::{Group, Heading, Placement, Scenario};
use toml::de::DeTable;

use super::text::{self, LINE_MAX, TextChanges, TextTable};
use super::{BuildError, BuiltText, Parse, Thing, ThingKind, ThingValues};

/// The keys of a group that a list of positions replaces.
const PLACEMENT_KEYS: [&str; 8] =
    ["placement", "count", "at", "spacing", "columns", "direction", "radius", "area"];

/// The largest differences of a start that is the same: positions in mm and headings in degrees have
/// two decimals in the text.
const SAME: f32 = 0.02;

/// A change of a robot. Robots have their numbers in the scenario.
pub enum RobotEdit {
    Add { group: usize, values: ThingValues },
    Change { robot: usize, values: ThingValues },
    Delete { robot: usize },
}

/// Returns the numbers of the robots of each group.
fn ranges(scenario: &Scenario) -> Vec<Range<usize>> {
    let mut first = 0;
    let range = |group: &Group| {
        let own = first..first + group.count as usize;
        first = own.end;
        own
    };
    scenario.groups.iter().map(range).collect()
}

/// Returns the number of the group of a robot.
pub fn group_of(scenario: &Scenario, robot: usize) -> Option<usize> {
    ranges(scenario).iter().position(|own| own.contains(&robot))
}

/// Changes a robot in the text of a scenario.
pub fn edit(
    text: &str,
    scenario: &Scenario,
    edit: &RobotEdit,
    parse: Parse<'_>,
) -> Result<BuiltText, BuildError> {
    let starts = |scenario: &Scenario| {
        start_poses(scenario, scenario.world.seed.into())
            .map_err(|error| BuildError::Scenario(vec![error]))
    };
    let (before, own) = (starts(scenario)?, ranges(scenario));
    let (group, robot) = match *edit {
        RobotEdit::Add { group, .. } => (group, None),
        RobotEdit::Change { robot, .. } | RobotEdit::Delete { robot } => {
            (group_of(scenario, robot).ok_or(BuildError::NoSuchThing)?, Some(robot))
        }
    };
    let robots = own.get(group).ok_or(BuildError::NoSuchThing)?.clone();
    let is_deletion = matches!(edit, RobotEdit::Delete { .. });
    if is_deletion && before.len() == 1 {
        return Err(BuildError::LastRobot);
    }
    let is_group_deleted = is_deletion && robots.len() == 1;
    // The groups whose robots get the places at which they start.
    let mut listed = vec![false; own.len()];
    listed[group] = !is_group_deleted && !is_list(scenario, group);
    loop {
        let mut built = text.to_owned();
        for (group, _) in listed.iter().enumerate().filter(|(_, is_listed)| **is_listed) {
            built = list(&built, scenario, group, &before[own[group].clone()])?;
        }
        built = match edit {
            RobotEdit::Delete { .. } if is_group_deleted => delete_group(&built, group)?,
            _ => change_list(&built, group, robot.map(|robot| robot - robots.start), edit)?,
        };
        let after = parse(&built).map_err(BuildError::Scenario)?;
        let after = starts(&after)?;
        let others = unlike(&before, &after, &own, edit, robots.end);
        let mut is_done = true;
        for (group, is_unlike) in others.into_iter().enumerate() {
            if is_unlike && !listed[group] {
                (listed[group], is_done) = (true, false);
            }
        }
        if is_done {
            let number = robot.unwrap_or(robots.end);
            let thing = (!is_deletion).then_some(Thing { kind: ThingKind::Robot, number });
            return Ok(BuiltText { text: built, thing });
        }
    }
}

/// Returns, for each group, true if one of its robots that are not changed would start elsewhere.
fn unlike(
    before: &[Pose],
    after: &[Pose],
    groups: &[Range<usize>],
    edit: &RobotEdit,
    end: usize,
) -> Vec<bool> {
    let is_unlike = |robot: usize| {
        let now = match *edit {
            RobotEdit::Add { .. } => robot + usize::from(robot >= end),
            RobotEdit::Change { robot: changed, .. } if changed == robot => return false,
            RobotEdit::Change { .. } => robot,
            RobotEdit::Delete { robot: deleted } if deleted == robot => return false,
            RobotEdit::Delete { robot: deleted } => robot - usize::from(robot > deleted),
        };
        let (old, new) = (before[robot], after[now]);
        let turn = (old.heading - new.heading).to_degrees().rem_euclid(360.0);
        let is_turned = turn.min(360.0 - turn) > SAME;
        (old.x - new.x).abs() > SAME || (old.y - new.y).abs() > SAME || is_turned
    };
    groups.iter().map(|own| own.clone().any(is_unlike)).collect()
}

fn is_list(scenario: &Scenario, group: usize) -> bool {
    matches!(scenario.groups[group].placement, Placement::List(_))
}

/// Calls a function with the table of a group.
fn with_group<T>(
    text: &str,
    group: usize,
    act: impl FnOnce(&TextTable<'_>) -> Option<T>,
) -> Result<T, BuildError> {
    let no_section = BuildError::NoSection("[[robots]]");
    let Ok(document) = DeTable::parse(text) else { return Err(no_section) };
    let robots = document.get_ref().get("robots").map(text::elements).unwrap_or_default();
    let table = robots.get(group).and_then(|item| TextTable::new(text, item));
    table.and_then(|table| act(&table)).ok_or(no_section)
}

/// Replaces the placement of a group by the list of its start positions. Random headings become those
/// of the list.
fn list(
    text: &str,
    scenario: &Scenario,
    group: usize,
    poses: &[Pose],
) -> Result<String, BuildError> {
    let is_random = scenario.groups[group].heading == Heading::Random;
    let mut changes = TextChanges::default();
    with_group(text, group, |table| {
        if let Some(positions) = table.table.get("positions") {
            for (place, pose) in text::elements(positions).iter().zip(poses) {
                if let ([_, y], true) = (text::elements(place), is_random) {
                    changes.insert(y.span().end, format!(", {}", heading_text(pose)));
                }
            }
            return Some(());
        }
        let places = poses.iter().map(|pose| {
            let [x, y] = [pose.x, pose.y].map(|axis| text::number_text(axis.into()));
            match is_random {
                true => format!("[{x}, {y}, {}]", heading_text(pose)),
                false => format!("[{x}, {y}]"),
            }
        });
        let value = positions_text(&places.collect::<Vec<_>>(), text::newline(text));
        let entry = ("positions", &*value);
        table.replace_keys(&mut changes, &PLACEMENT_KEYS, entry).then_some(())
    })?;
    Ok(changes.apply(text))
}

fn heading_text(pose: &Pose) -> String {
    text::number_text(pose.heading.to_degrees().into())
}

/// Formats a list of positions: on one line, if it fits.
fn positions_text(places: &[String], newline: &str) -> String {
    let line = format!("[{}]", places.join(", "));
    if line.len() + "positions = ".len() <= LINE_MAX {
        return line;
    }
    let mut text = "[".to_owned();
    let mut width = LINE_MAX;
    for place in places {
        if width + place.len() + 2 > LINE_MAX {
            text += newline;
            text += "  ";
            width = 2;
        } else {
            text += " ";
            width += 1;
        }
        text += place;
        text += ",";
        width += place.len() + 1;
    }
    text + newline + "]"
}

/// Changes the list of positions of a group. `index` is the robot's number in the group.
fn change_list(
    text: &str,
    group: usize,
    index: Option<usize>,
    edit: &RobotEdit,
) -> Result<String, BuildError> {
    let mut changes = TextChanges::default();
    let changed = with_group(text, group, |table| {
        let list = table.table.get("positions")?;
        let places = text::elements(list);
        let mut set_count = |count: usize| {
            if let Some(item) = table.table.get("count") {
                changes.replace(item.span(), count.to_string());
            }
        };
        match *edit {
            RobotEdit::Add { values, .. } => {
                let Some(at) = values.at else { return Some(Err(BuildError::NoPlace)) };
                set_count(places.len() + 1);
                let numbers: Vec<f64> = at.into_iter().chain(values.heading).collect();
                text::append(&mut changes, text, list, &text::numbers_text(&numbers));
            }
            RobotEdit::Change { values, .. } => {
                let place = places.get(index?)?;
                if let Some(at) = values.at {
                    text::set_numbers(&mut changes, place, &at);
                }
                match (values.heading, text::elements(place)) {
                    (Some(heading), [_, _, own]) => text::set_number(&mut changes, own, heading),
                    (Some(heading), [_, y]) => {
                        changes.insert(y.span().end, format!(", {}", text::number_text(heading)));
                    }
                    _ => {}
                }
            }
            RobotEdit::Delete { .. } => {
                set_count(places.len() - 1);
                text::remove(&mut changes, text, list, index?);
            }
        }
        Some(Ok(()))
    })?;
    changed.map(|()| changes.apply(text))
}

/// Deletes a group.
fn delete_group(text: &str, group: usize) -> Result<String, BuildError> {
    let mut changes = TextChanges::default();
    let document = DeTable::parse(text).map_err(|_| BuildError::NoSuchThing)?;
    let robots = document.get_ref().get("robots").ok_or(BuildError::NoSuchThing)?;
    text::remove(&mut changes, text, robots, group);
    Ok(changes.apply(text))
}
