//! The conditions of a run: the state of the world, other than robots, that events and commands
//! change.

use bittybuzz_arena::run::Simulation;
use serde_json::{Value, json};

/// Describes the lamps that are lit. Positions are in mm.
pub fn lights(run: &Simulation) -> Value {
    let lit = run.lights().iter().filter(|light| light.intensity > 0.0);
    lit.map(|light| json!({ "at": [light.x, light.y], "brightness": light.intensity })).collect()
}

/// Describes the commands and the ticks before which they act. Commands that are pending because
/// the run was taken back are included.
pub fn commands(run: &Simulation) -> Value {
    run.command_list().map(|(tick, text)| json!({ "tick": tick, "text": text })).collect()
}

/// Describes lamps and commands.
pub fn describe(run: &Simulation) -> Value {
    json!({ "event": "conditions", "lights": lights(run), "commands": commands(run) })
}
