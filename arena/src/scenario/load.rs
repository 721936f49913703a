//! Scripts that events load into robots, and the programs of a run.

use std::collections::HashSet;
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

/// Returns the names that events and groups use in scripts. They are the same for all groups: robots that run one
/// script send each other numbers of its functions, which must agree.
pub fn outside_uses(events: &[ScheduledEvent], groups: &[Group]) -> OutsideUses {
    let mut uses = OutsideUses::default();
    let globals = groups.iter().flat_map(|group| &group.globals);
    uses.assigned.extend(globals.map(|global| global.name.clone()));
    for event in events {
        match &event.action {
            WorldChange::Call { function, .. } => uses.called.insert(function.clone()),
            WorldChange::Set { global, .. } => uses.assigned.insert(global.clone()),
            _ => continue,
        };
    }
    uses
}

/// Returns the groups that contain some of these robots, in ascending order.
pub fn groups_of(groups: &[Group], robots: &Selection) -> Vec<GroupId> {
    each_group_of(groups, robots).collect()
}

/// Returns the groups of [`groups_of`] one by one, for callers that stop at the first.
pub fn each_group_of(groups: &[Group], robots: &Selection) -> impl Iterator<Item = GroupId> {
    let mut next = 0;
    robots.ranges().flat_map(move |range| {
        let first = groups.partition_point(|group| group.end() <= range.start);
        let end = groups.partition_point(|group| group.first_robot < range.end);
        // A group may contain the end of one range and the beginning of the next.
        let first = first.max(next);
        next = next.max(end);
        (first..end).map(GroupId)
    })
}

/// Returns the scripts that events load and that groups do not run from the start, each once, in
/// the order of the events.
pub fn loads(events: &[ScheduledEvent], groups: &[Group]) -> Vec<Load> {
    let mut loads: Vec<Load> = Vec::new();
    let mut known = HashSet::new();
    for event in events {
        // Only these events name a script.
        let WorldChange::Load { robots, script, .. } = &event.action else { continue };
        for group in groups_of(groups, robots) {
            let is_new = groups[group.0].script.as_ref() != Some(script);
            if is_new && known.insert((group, script)) {
                loads.push(Load { group, script: script.clone() });
            }
        }
    }
    loads
}
