//! The world, which a client has to know before the first sample.

use bittybuzz_arena::run::{Simulation, TICKS_PER_SECOND};
use bittybuzz_arena::scenario::{Light, Obstacle, Outline};
use serde_json::{Value, json};

/// Describes the world of a run: lengths in mm, times in seconds.
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
            "radius": group.radius(),
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
        "lights": scenario.world.lights.iter().map(light).collect::<Vec<_>>(),
        "events": events.collect::<Vec<_>>(),
        "expectations": expects.collect::<Vec<_>>(),
    })
}

/// The keys of an obstacle in a scenario.
fn obstacle(obstacle: &Obstacle) -> Value {
    let height = obstacle.height;
    match obstacle.outline {
        Outline::Disc { at, radius } => json!({ "at": at, "radius": radius, "height": height }),
        Outline::Block { at, size } => json!({ "at": at, "size": size, "height": height }),
        Outline::Wall(from, to) => json!({ "from": from, "to": to, "height": height }),
    }
}

fn light(light: &Light) -> Value {
    json!({ "at": light.at, "brightness": light.brightness })
}
