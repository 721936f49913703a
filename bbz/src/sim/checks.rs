//! The results of `--checks` for each group of a scenario.

use bittybuzz_arena::run::{Summary, TICKS_PER_SECOND};
use bittybuzz_arena::scenario::{Backend, Group};
use serde_json::{Value, json};

use crate::checks::Checked;
use crate::costs;

use super::open::Opened;

/// The lines of the report.
pub fn text(opened: &Opened, summary: &Summary) -> Vec<String> {
    let mut lines = Vec::new();
    each(opened, summary, |group, checked| {
        let title = format!("checks of group `{}`", group.name);
        match checked {
            Some(checked) => {
                lines.push(title + ":");
                lines.extend(checked.text().into_iter().map(|line| format!("  {line}")));
            }
            None if is_emulated(group) => {
                lines.push(title + ": none, an emulator runs the firmware of its robots");
            }
            None => lines.push(title + ": none of its robots was in the world"),
        }
    });
    lines
}

/// The report as an array, with an object for each group.
pub fn json(opened: &Opened, summary: &Summary) -> Value {
    let mut groups = Vec::new();
    each(opened, summary, |group, checked| {
        groups.push(json!({
            "group": group.name,
            "robot": group.robot.name,
            "emulated": is_emulated(group),
            "checks": checked.map(|checked| checked.json()),
        }));
    });
    groups.into()
}

/// Hands each group over with its findings; a group that was not checked has none.
fn each(opened: &Opened, summary: &Summary, mut take: impl FnMut(&Group, Option<Checked<'_>>)) {
    for (number, (group, program)) in
        opened.scenario.groups.iter().zip(&opened.programs).enumerate()
    {
        let costs = costs::of(&group.robot, group.robot.profile);
        let checked = summary.findings.get(&number).map(|findings| Checked {
            findings,
            program,
            slots: group.robot.vm.slots as usize,
            entries: group.robot.sizes().entries.into(),
            costs: costs.as_deref(),
            ticks_per_second: TICKS_PER_SECOND,
            has_robots: true,
        });
        take(group, checked);
    }
}

fn is_emulated(group: &Group) -> bool {
    group.backend != Backend::Vm
}
