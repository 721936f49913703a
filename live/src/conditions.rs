//! The conditions of a run: the state of the world, other than robots, that events and commands
//! change.

use bittybuzz_arena::run::Simulation;

use crate::page_event::{CommandDescription, ConditionsEvent, LightDescription};

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

/// Describes lamps and commands.
pub fn describe(run: &Simulation) -> ConditionsEvent {
    ConditionsEvent { lights: lights(run), commands: commands(run) }
}
