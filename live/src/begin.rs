//! The description of the world, which a client needs before the first sample.

use bittybuzz_arena::engine::Medium;
use bittybuzz_arena::robot::{Glyph, SurroundingsKey};
use bittybuzz_arena::run::{Program, Setup, Simulation, TICKS_PER_SECOND};
use bittybuzz_arena::scenario::{
    Group, MeasureTime, MovableSection, ObstacleSection, Outline, PatchSection, QUANTITIES, Shape,
    Task,
};

use crate::band;
use crate::conditions;
use crate::page_event::{
    AssignmentDescription, BeginEvent, ExpectationDescription, FenceDescription, GlyphName,
    GroupDescription, LinkDescription, MeasureDescription, MediumDescription, MovableDescription,
    ObstacleDescription, PatchDescription, QuantityNames, SurroundingsDescription, TaskDescription,
};
use crate::relative::relative;

/// Describes the world of a run.
pub fn describe(run: &Simulation) -> BeginEvent {
    let setup = run.setup();
    let scenario = &setup.scenario;
    let groups = scenario.groups.iter().map(|group| GroupDescription {
        name: Some(group.name.clone()),
        robot: Some(group.robot.name.clone()),
        script: group.script.as_ref().map(|script| relative(&scenario.folder, script)),
        glyph: glyph(group.model.glyph()),
        count: group.count,
        first_id: group.first_id,
        radius: group.radius_mm(),
        link: Some(link(setup, group)),
        slots: Some(group.robot.vm.slots),
        wind: group.model.wind_mm_s().map(|wind| wind.map(|part| f64::from(part.round()))),
        surroundings: group.model.unusual_surroundings().into_iter().map(surroundings).collect(),
        fence: group.model.fence_mm().map(fence),
    });
    let expects = setup.expects().iter().map(|bound| {
        let expect = &bound.expect;
        let (name, text) = (expect.name.clone(), expect.to_string());
        let line = expect.condition.place.line;
        ExpectationDescription { name, text, line, band: band::describe(expect) }
    });
    let measures = scenario.measures.iter().map(|measure| MeasureDescription {
        name: measure.name.clone(),
        text: measure.to_string(),
        is_time: measure.time == MeasureTime::First,
    });
    let assignment = scenario.assignment.as_ref().map(|assignment| AssignmentDescription {
        task: task(&assignment.task),
        translations: assignment.french.iter().map(|french| ("fr", task(french))).collect(),
    });
    BeginEvent {
        recording: None,
        watched: None,
        size: scenario.world.size,
        ticks_per_second: TICKS_PER_SECOND,
        end: run.end(),
        seed: Some(run.seed()),
        groups: groups.collect(),
        ground: scenario.world.ground.iter().map(patch).collect(),
        obstacles: scenario.world.obstacles.iter().map(obstacle).collect(),
        movables: scenario.world.movables.iter().map(movable).collect(),
        lights: conditions::lights(run),
        pose_errors: conditions::pose_errors(run),
        media: media(run),
        events: scenario.events.iter().map(|event| event.at).collect(),
        commands: conditions::commands(run),
        quantities: quantities(setup),
        expectations: expects.collect(),
        measures: measures.collect(),
        assignment,
        scripts: None,
        controls: None,
        about: None,
        stops_on_error: None,
    }
}

fn fence([least, most]: [[f32; 3]; 2]) -> FenceDescription {
    let limit = |mm: f32| mm.is_finite().then(|| f64::from(mm.round()));
    FenceDescription {
        least: [limit(least[0]), limit(least[1])],
        most: [limit(most[0]), limit(most[1])],
        height: limit(most[2]),
    }
}

fn task(task: &Task) -> TaskDescription {
    TaskDescription { title: task.title.clone(), text: task.text.clone() }
}

fn glyph(glyph: Glyph) -> GlyphName {
    match glyph {
        Glyph::Disc => GlyphName::Disc,
        Glyph::Legs => GlyphName::Legs,
        Glyph::Wheels => GlyphName::Wheels,
        Glyph::Rotors => GlyphName::Rotors,
    }
}

fn link(setup: &Setup, group: &Group) -> LinkDescription {
    LinkDescription {
        medium: group.medium().word(),
        range: setup.link(group).range.map(f64::from),
        is_between_rims: group.medium() == Medium::Infrared,
    }
}

fn surroundings(key: SurroundingsKey) -> SurroundingsDescription {
    // The digits that a single-precision number has.
    let value = (f64::from(key.value) * 1e4).round() / 1e4;
    SurroundingsDescription { key: key.name, value, unit: key.unit }
}

/// Returns the quantities that a client can choose from.
pub fn quantities(setup: &Setup) -> QuantityNames {
    let plot = setup.scenario.output.plot.iter().map(|(of, _)| of.to_string()).collect();
    // Capitals in a form are placeholders, so it is not a complete name.
    let simple = QUANTITIES.iter().filter(|form| !form.contains(char::is_uppercase));
    let simple = simple.map(|form| (*form).to_owned());
    let (swarm, robot) = simple.partition(|form| form.starts_with("swarm."));
    let mut global: Vec<String> = setup.programs().flat_map(globals).collect();
    global.sort();
    global.dedup();
    QuantityNames { plot, robot, swarm, global }
}

/// Returns the globals of a script that can hold a number, which excludes its functions. Names with
/// a blank are internal to the compiler.
fn globals(program: &Program) -> Vec<String> {
    let functions = program.symbols.iter().flat_map(|symbols| &symbols.functions);
    let functions: Vec<&str> = functions.map(|function| function.name.as_str()).collect();
    let is_shown = |name: &&String| !name.contains(' ') && !functions.contains(&name.as_str());
    program.globals().iter().filter(is_shown).map(|name| format!("global.{name}")).collect()
}

fn patch(patch: &PatchSection) -> PatchDescription {
    let brightness = patch.brightness;
    match patch.shape {
        Shape::Disc { at, radius } => PatchDescription::Disc { at, radius, brightness },
        Shape::Block { at, size, heading } => {
            PatchDescription::Block { at, size, heading, brightness }
        }
    }
}

fn obstacle(obstacle: &ObstacleSection) -> ObstacleDescription {
    let height = obstacle.height;
    match obstacle.outline {
        Outline::Shape(Shape::Disc { at, radius }) => {
            ObstacleDescription::Disc { at, radius, height }
        }
        Outline::Shape(Shape::Block { at, size, heading }) => {
            ObstacleDescription::Block { at, size, heading, height }
        }
        Outline::Wall(from, to) => ObstacleDescription::Wall { from, to, height },
    }
}

fn movable(&MovableSection { radius, height, .. }: &MovableSection) -> MovableDescription {
    MovableDescription { radius, height }
}

/// Describes the media of the groups.
fn media(run: &Simulation) -> Vec<MediumDescription> {
    let scenario = &run.setup().scenario;
    let mut media: Vec<Medium> = scenario.groups.iter().map(Group::medium).collect();
    media.sort_by_key(|medium| medium.word());
    media.dedup();
    let describe = |medium: Medium| {
        let loss = scenario.media.settings(medium).loss;
        let loss = loss.map(|loss| [loss.near, loss.far]);
        MediumDescription { name: medium.word().to_owned(), loss }
    };
    media.into_iter().map(describe).collect()
}
