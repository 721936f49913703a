//! The results of `--checks` for each program of a scenario.

use std::path::Path;

use bittybuzz_arena::robot::ProgramId;
use bittybuzz_arena::run::{Summary, TICKS_PER_SECOND};
use bittybuzz_arena::scenario::{Backend, Group};
use serde_json::{Value, json};

use crate::checks::CheckFindings;
use crate::costs;

use super::open::Opened;

/// Returns the lines of the report.
pub fn text(opened: &Opened, summary: &Summary) -> Vec<String> {
    let mut lines = Vec::new();
    each(opened, summary, |group, script, checked| {
        let title = match script {
            None => format!("checks of group `{}`", group.name),
            Some(script) => format!("checks of group `{}` with `{}`", group.name, script.display()),
        };
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

/// Returns the report as an array, with an object for each program: those of the groups, then those
/// that events load.
pub fn json(opened: &Opened, summary: &Summary) -> Value {
    let mut groups = Vec::new();
    each(opened, summary, |group, script, checked| {
        groups.push(json!({
            "group": group.name,
            "robot": group.robot.name,
            "loaded": script.map(|script| script.display().to_string()),
            "emulated": is_emulated(group),
            "checks": checked.map(|checked| checked.json()),
        }));
    });
    groups.into()
}

/// Calls `take` for each program, with its group, its script if an event loads it, and its
/// findings. A program that was not checked has no findings.
fn each(
    opened: &Opened,
    summary: &Summary,
    mut take: impl FnMut(&Group, Option<&Path>, Option<CheckFindings<'_>>),
) {
    let own = opened.scenario.groups.len();
    for (number, ((group, script), program)) in
        opened.scenario.programs().zip(&opened.programs).enumerate()
    {
        let costs = costs::of(&group.robot, group.robot.profile);
        let checked = summary.findings.get(&ProgramId(number)).map(|findings| CheckFindings {
            findings,
            program,
            slots: group.robot.vm.slots as usize,
            entries: group.robot.sizes().entries.into(),
            costs: costs.as_deref(),
            ticks_per_second: TICKS_PER_SECOND,
            has_robots: true,
        });
        take(group, script.filter(|_| number >= own), checked);
    }
}

fn is_emulated(group: &Group) -> bool {
    group.backend != Backend::Vm
}
