//! The description of the world, which a client needs before the first sample.

use bittybuzz_arena::run::{Program, Setup, Simulation, TICKS_PER_SECOND};
use bittybuzz_arena::scenario::{Group, Medium, ObstacleSection, Outline, QUANTITIES};
use serde_json::{Value, json};

use crate::conditions;

/// Describes the world of a run. Lengths are in mm, times in seconds.
pub fn describe(run: &Simulation) -> Value {
    let setup = run.setup();
    let scenario = &setup.scenario;
    let groups = scenario.groups.iter().map(|group| {
        json!({
            "name": group.name,
            "robot": group.robot.name,
            "script": group.script.display().to_string(),
            "count": group.count,
            "first_id": group.first_id,
            "radius": group.radius_mm(),
            "slots": group.robot.vm.slots,
        })
    });
    let events = scenario.events.iter().map(|event| event.at);
    let expects = setup.expects().iter().map(|bound| {
        let expect = &bound.expect;
        json!({ "name": expect.name, "text": expect.to_string(), "line": expect.place.line })
    });
    json!({
        "event": "begin",
        "size": scenario.world.size,
        "ticks_per_second": TICKS_PER_SECOND,
        "end": run.end(),
        "seed": run.seed(),
        "groups": groups.collect::<Vec<_>>(),
        "obstacles": scenario.world.obstacles.iter().map(obstacle).collect::<Vec<_>>(),
        "lights": conditions::lights(run),
        "media": media(run),
        "events": events.collect::<Vec<_>>(),
        "commands": conditions::commands(run),
        "quantities": quantities(setup),
        "expectations": expects.collect::<Vec<_>>(),
        "assignment": scenario.assignment.as_ref().map(|one| json!({ "title": one.title, "text": one.text })),
    })
}

/// Returns the quantities that a client can choose from: those of `plot`, those of every robot,
/// those of the swarm, and globals.
pub fn quantities(setup: &Setup) -> Value {
    let plot: Vec<String> =
        setup.scenario.output.plot.iter().map(|(of, _)| of.to_string()).collect();
    // Capitals in a form are placeholders, so it is not a complete name.
    let simple = QUANTITIES.iter().filter(|form| !form.contains(char::is_uppercase));
    let (swarm, robot): (Vec<&str>, Vec<&str>) =
        simple.copied().partition(|form| form.starts_with("swarm."));
    let mut globals: Vec<String> = setup.programs().flat_map(globals).collect();
    globals.sort();
    globals.dedup();
    json!({ "plot": plot, "robot": robot, "swarm": swarm, "global": globals })
}

/// Returns the globals of a script that can hold a number, which excludes its functions. Names with
/// a blank are internal to the compiler.
fn globals(program: &Program) -> Vec<String> {
    let functions = program.symbols.iter().flat_map(|symbols| &symbols.functions);
    let functions: Vec<&str> = functions.map(|function| function.name.as_str()).collect();
    let is_shown = |name: &&String| !name.contains(' ') && !functions.contains(&name.as_str());
    program.globals().iter().filter(is_shown).map(|name| format!("global.{name}")).collect()
}

/// Describes an obstacle with the keys of a scenario.
fn obstacle(obstacle: &ObstacleSection) -> Value {
    let height = obstacle.height;
    match obstacle.outline {
        Outline::Disc { at, radius } => json!({ "at": at, "radius": radius, "height": height }),
        Outline::Block { at, size } => json!({ "at": at, "size": size, "height": height }),
        Outline::Wall(from, to) => json!({ "from": from, "to": to, "height": height }),
    }
}

/// Describes the media of the groups. `loss` is the share of frames that the scenario lets the
/// medium lose; `null` stands for the physical model's.
fn media(run: &Simulation) -> Vec<Value> {
    let scenario = &run.setup().scenario;
    let mut media: Vec<Medium> = scenario.groups.iter().map(Group::medium).collect();
    media.sort_by_key(|medium| medium.name());
    media.dedup();
    let describe = |medium: Medium| {
        let loss = scenario.media.settings(medium).loss;
        json!({ "name": medium.name(), "loss": loss.map(|loss| [loss.near, loss.far]) })
    };
    media.into_iter().map(describe).collect()
}
