//! The mapping from a robot's number in the scenario to its id and group.

use crate::scenario::{GroupId, Scenario, WorldChange};

/// Returns the id of a robot.
pub fn id(scenario: &Scenario, number: usize) -> u16 {
    let (group, within) = group_of(scenario, number);
    scenario.group(group).first_id + within as u16
}

/// Returns the group of a robot of the scenario, and the robot's number within the group.
pub fn group_of(scenario: &Scenario, number: usize) -> (GroupId, usize) {
    assert!(number < scenario.robot_count(), "the scenario has no robot of number {number}");
    let after = scenario.groups.partition_point(|group| group.first_robot as usize <= number);
    let index = after - 1;
    (GroupId(index), number - scenario.groups[index].first_robot as usize)
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
        // No other event lets robots join.
        let WorldChange::Join(robots) = &event.action else { continue };
        for number in robots.iter().filter(|number| !is_there[*number]).collect::<Vec<_>>() {
            is_there[number] = true;
            order.push(number);
        }
    }
    order
}
