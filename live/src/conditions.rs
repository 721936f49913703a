//! The conditions of a run: the state of the world, other than robots, that events and commands
//! change.

use bittybuzz_arena::robot::PoseError;
use bittybuzz_arena::run::Simulation;

use crate::changes::Changes;
use crate::page_event::{
    CommandDescription, ConditionsEvent, LightDescription, PoseErrorDescription,
};

/// Describes the lamps that are lit.
pub fn lights(run: &Simulation) -> Vec<LightDescription> {
    let lit = run.lights().iter().filter(|light| light.intensity > 0.0);
    lit.map(|light| LightDescription {
        at: [light.x.into(), light.y.into()],
        brightness: light.intensity.into(),
    })
    .collect()
}

/// Describes the commands and the ticks before which they act. Commands that are pending because
/// the run was taken back are included.
pub fn commands(run: &Simulation) -> Vec<CommandDescription> {
    let describe = |(tick, text): (u64, &str)| CommandDescription { tick, text: text.to_owned() };
    run.command_list().map(describe).collect()
}

/// Describes the poses from outside that are wrong.
pub fn pose_errors(run: &Simulation) -> Vec<PoseErrorDescription> {
    let describe = |(robot, error): (usize, PoseError)| PoseErrorDescription {
        robot,
        displaced: error.displaced_mm.map(f64::from),
        // Labels are exchanged within a group, whose robots have successive numbers and ids.
        seen_as: error.seen_as.and_then(|offset| robot.checked_add_signed(offset as isize)),
    };
    run.pose_errors().map(describe).collect()
}

/// Describes lamps, poses and commands.
pub fn describe(run: &Simulation, changes: &Changes) -> ConditionsEvent {
    let (can_undo, can_redo) = (changes.can_undo(), changes.can_redo());
    let (lights, pose_errors) = (lights(run), pose_errors(run));
    ConditionsEvent { lights, pose_errors, commands: commands(run), can_undo, can_redo }
}

/// Returns the first tick at which two lists of commands differ: the runs go different ways after it.
/// Returns `None` if they have the same commands.
pub fn parting(one: &[CommandDescription], other: &[CommandDescription]) -> Option<u64> {
    let same = one.iter().zip(other).take_while(|(one, other)| one == other).count();
    let ticks = [one.get(same), other.get(same)].into_iter().flatten().map(|command| command.tick);
    ticks.min()
}
