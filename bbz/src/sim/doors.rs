//! The doors of emulated robots, as a note for people who want to connect.

use annotate_snippets::{Group, Level};
use bittybuzz_arena::scenario::Scenario;

use crate::report;

/// Returns true if a robot of the scenario has a door for ground stations.
pub fn exist(scenario: &Scenario) -> bool {
    scenario.groups.iter().any(|group| group.backend.image().is_some_and(|of| of.door.is_some()))
}

/// Prints the address of each robot with a door.
pub fn print(scenario: &Scenario) {
    for group in &scenario.groups {
        let Some(door) = group.backend.image().and_then(|image| image.door.as_ref()) else {
            continue;
        };
        for within in 0..group.count as u16 {
            let (robot, port) = (group.first_id + within, door.port(within));
            let title = format!("robot {robot} has its door at udp://127.0.0.1:{port}");
            report::print(Group::with_title(Level::NOTE.primary_title(title)));
        }
    }
}
