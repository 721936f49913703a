//! Scripts that events load into robots, and the programs of a run.

use std::path::{Path, PathBuf};

use bittybuzz_compiler::check::outside::OutsideUses;

use super::{Group, GroupId, Scenario, ScheduledEvent, Selection, WorldChange};

/// A script that an event or a command loads into the robots of a group. Each group has its own
/// image of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Load {
    pub group: GroupId,
    /// The script, image or object file.
    pub script: PathBuf,
}

impl Scenario {
    /// Returns the group and the script of each program of a run: those of the groups, then those
    /// that events load, in the order of the file. Programs are numbered in this order. A group that
    /// runs an image has a program without a script ([`Program::empty`](crate::run::Program::empty)).
    pub fn programs(&self) -> impl Iterator<Item = (&Group, Option<&Path>)> {
        let own = self.groups.iter().map(|group| (group, group.script.as_deref()));
        let loaded = self.loads.iter();
        own.chain(loaded.map(|load| (self.group(load.group), Some(&*load.script))))
    }

    /// Returns the scripts of [`programs`](Self::programs).
    pub fn scripts(&self) -> impl Iterator<Item = (&Group, &Path)> {
        self.programs().filter_map(|(group, script)| Some((group, script?)))
    }
}

/// Returns the names that events use in scripts. They are the same for all groups: robots that run one
/// script send each other numbers of its functions, which must agree.
pub fn outside_uses(events: &[ScheduledEvent]) -> OutsideUses {
    let mut uses = OutsideUses::default();
    for event in events {
        match &event.action {
            WorldChange::Call { function, .. } => uses.called.insert(function.clone()),
            WorldChange::Set { global, .. } => uses.assigned.insert(global.clone()),
            _ => continue,
        };
    }
    uses
}

/// Returns the groups that contain some of these robots.
pub fn groups_of(groups: &[Group], robots: &Selection) -> Vec<GroupId> {
    let mut first = 0;
    let ranges = groups.iter().map(|group| {
        let range = first..first + group.count as usize;
        first = range.end;
        range
    });
    let has_some = |range: &std::ops::Range<usize>| robots.overlaps(range);
    let of_robots = ranges.enumerate().filter(|(_, range)| has_some(range));
    of_robots.map(|(number, _)| GroupId(number)).collect()
}

/// Returns the scripts that events load and that groups do not run from the start, each once, in
/// the order of the events.
pub fn loads(events: &[ScheduledEvent], groups: &[Group]) -> Vec<Load> {
    let mut loads: Vec<Load> = Vec::new();
    for event in events {
        // Only these events name a script.
        let WorldChange::Load { robots, script, .. } = &event.action else { continue };
        for group in groups_of(groups, robots) {
            let load = Load { group, script: script.clone() };
            if groups[group.0].script.as_ref() != Some(script) && !loads.contains(&load) {
                loads.push(load);
            }
        }
    }
    loads
}
