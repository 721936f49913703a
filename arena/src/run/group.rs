//! The mapping from a robot's number in the scenario to its id and group.

use crate::scenario::{Scenario, WorldChange};

/// Returns the id of a robot.
pub fn id(scenario: &Scenario, number: usize) -> u16 {
    let (group, within) = group_of(scenario, number);
    scenario.groups.get(group).map_or(0, |group| group.first_id + within as u16)
}

/// Returns the group of a robot, and the robot's number within it.
pub fn group_of(scenario: &Scenario, number: usize) -> (usize, usize) {
    let mut within = number;
    for (index, group) in scenario.groups.iter().enumerate() {
        if within < group.count as usize {
            return (index, within);
        }
        within -= group.count as usize;
    }
    (scenario.groups.len(), within)
}

/// Returns the robots' numbers in the order in which they enter the world: those present at the
/// start, then those that join.
pub fn joining_order(scenario: &Scenario) -> Vec<usize> {
    let mut order = Vec::new();
    let mut is_there = Vec::new();
    for group in &scenario.groups {
        for _ in 0..group.count {
            if group.present {
                order.push(is_there.len());
            }
            is_there.push(group.present);
        }
    }
    for event in &scenario.events {
        let WorldChange::Join(robots) = &event.action else { continue };
        for number in robots.iter() {
            if let Some(is_there) = is_there.get_mut(number).filter(|is_there| !**is_there) {
                *is_there = true;
                order.push(number);
            }
        }
    }
    order
}
