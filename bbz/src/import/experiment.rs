//! An experiment as a whole: its arena, time and seed, the media, and the parts in C++.

use std::collections::{BTreeMap, HashSet};

use bittybuzz_robot_spec::Medium;
use bittybuzz_toml_reader::number_text;

use crate::world;

use super::arena::{Arena, mm};
use super::controllers::Controllers;
use super::distribute::{self, Drawing};
use super::document::Element;
use super::group::{Group, Placement, World};
use super::mistake::{Allowed, Mistake};
use super::robots::RobotKinds;
use super::script::ScriptFolders;
use super::separate::{fasten, separate};

/// The sides of a world in mm.
const SIDE: std::ops::RangeInclusive<f64> = 10.0..=1e6;

/// The longest duration of a scenario in seconds.
const DURATION_MAX: f64 = 2_419_200.0;

/// Time and chance of an experiment.
struct Timing {
    /// Seconds.
    duration: f64,
    seed: u32,
    /// Control steps per second.
    rate: u32,
}

/// Reads an experiment. Returns `None` after a mistake.
pub fn read<'a>(
    root: Element<'a>,
    kinds: &'a RobotKinds,
    folders: &'a ScriptFolders,
) -> Option<World> {
    let timing = timing(root);
    omit_code(root);
    let kilobot_loss = media(root);
    let section = only_arena(root)?;
    let size = section.required_vector("size", Allowed::Positive).and_then(|[x, y, _]| {
        let size = [mm(x * 1000.0), mm(y * 1000.0)];
        let fits = size.iter().all(|side| SIDE.contains(side));
        if !fits {
            section.fail_at("size", Mistake::BeyondWorld { attribute: "size" });
        }
        fits.then_some(size)
    });
    let center = section.vector_or_zero("center");
    // After a mistake in the arena itself, its entities are still read.
    let [x, y, _] = center.unwrap_or_default();
    let mut arena = Arena {
        kinds,
        controllers: Controllers::read(root, folders),
        center: [x, y],
        size: size.unwrap_or([*SIDE.end(); 2]),
        kilobot_loss: kilobot_loss.flatten(),
        obstacles: Vec::new(),
        lamps: Vec::new(),
        groups: Vec::new(),
    };
    let (distributed, own): (Vec<_>, Vec<_>) =
        section.elements().partition(|element| element.name() == "distribute");
    for element in own {
        arena.read(element);
    }
    let mut drawing = Drawing::new(timing.as_ref().map_or(1, |timing| timing.seed));
    // Drawn obstacles avoid the robots that have given places.
    let (fixed, robots): (Vec<_>, Vec<_>) =
        distributed.into_iter().partition(|element| distribute::is_fixed(&arena, *element));
    for element in robots {
        distribute::read(&mut arena, element, &mut drawing);
    }
    separate(section, &mut arena, &mut drawing);
    for element in fixed {
        distribute::read(&mut arena, element, &mut drawing);
    }
    fasten(section, &mut arena, &mut drawing);
    let timing = timing?;
    arena.controllers.omit_unused();
    number(section, &mut arena.groups);
    omit_rates(root, &arena, timing.rate);
    omit_shadows(root, &arena);
    let size = grown(section, &arena)?;
    let Arena { obstacles, lamps, groups, .. } = arena;
    Some(World { size, duration: timing.duration, seed: timing.seed, obstacles, lamps, groups })
}

fn only_arena(root: Element<'_>) -> Option<Element<'_>> {
    let mut arenas = root.all("arena");
    let Some(first) = arenas.next() else {
        root.fail(Mistake::NoArena);
        return None;
    };
    if let Some(second) = arenas.next() {
        second.fail(Mistake::SecondArena { first: first.line() });
    }
    Some(first)
}

fn timing(root: Element<'_>) -> Option<Timing> {
    let experiment = root.required("framework")?.required("experiment")?;
    let length = experiment.number_or("length", Allowed::NotNegative, 0.0);
    let rate = experiment.required_number("ticks_per_second", Allowed::Count(u32::MAX));
    let seed = experiment.number_or("random_seed", Allowed::Whole(u32::MAX), 0.0);
    // The allowed numbers are those of 32 bits.
    let (length, rate, seed) = (length?, rate? as u32, seed? as u32);
    let duration = if length == 0.0 {
        experiment.omit(
            "a run without an end (`length` = 0)",
            format!("`duration` = {} is a choice", world::SECONDS),
        );
        world::SECONDS.into()
    } else {
        // The simulator has a tick each 0.1 s.
        let duration = ((length * 10.0).round() / 10.0).clamp(0.1, DURATION_MAX);
        if duration != length {
            experiment.omit(
                format!("`length` = {}", number_text(length)),
                format!(
                    "`duration` = {} is the nearest that a scenario can have",
                    number_text(duration)
                ),
            );
        }
        duration
    };
    if seed == 0 {
        experiment.omit(
            "a seed from the clock (`random_seed` = 0)",
            "`seed` = 1 is a choice; `bbz sim --seed N` sets another, and --runs tries many",
        );
    }
    Some(Timing { duration, seed: seed.max(1), rate })
}

/// Lists code of the experiment that is not a controller.
fn omit_code(root: Element<'_>) {
    for element in root.all("loop_functions") {
        let name = element.text("label").or(element.text("library")).unwrap_or("?");
        element.omit(
            format!("loop functions `{name}`"),
            "write [[event]] and [[expect]] for their actions, and [[robots]] for robots that they place",
        );
    }
    let visualizations = root.all("visualization").flat_map(Element::elements);
    for element in visualizations.flat_map(|view| view.all("user_functions")) {
        element.omit(
            format!("drawing functions `{}`", element.text("label").unwrap_or("?")),
            "`bbz sim --view` colors robots by any quantity of a scenario",
        );
    }
}

/// Returns the share of messages that Kilobots lose, if the experiment states it; `None` after a
/// mistake. Lists media without a place in a scenario.
fn media(root: Element<'_>) -> Option<Option<f64>> {
    let mut loss = Some(None);
    for medium in root.all("media").flat_map(Element::elements) {
        match medium.name() {
            "range_and_bearing" | "led" => {}
            "kilobot_communication" => {
                loss = medium.optional_number("message_drop_prob", Allowed::Share);
            }
            name => medium.omit(format!("the medium <{name}>"), "no robot has it here"),
        }
    }
    loss
}

/// Gives the groups ids where those of Buzz do not follow from the order, and lists other ids.
fn number(section: Element<'_>, groups: &mut [Group]) {
    let (mut next, mut taken) = (0, BTreeMap::<u32, u32>::new());
    let mut names = HashSet::new();
    for group in groups {
        let count = group.count() as u32;
        let is_free = |first: &u32| {
            let before = taken.range(..first + count).next_back();
            before.is_none_or(|(_, end)| end <= first)
        };
        let wanted = first_of(&group.buzz_ids).filter(is_free);
        if wanted.is_none() && group.is_buzz {
            let name = if group.name.is_empty() { &group.robot } else { &group.name };
            section.omit_in(
                group.line,
                format!("ids of the robots `{name}` that are not consecutive, or that others have"),
                "they count up here; `first_id` changes them",
            );
        }
        let first = wanted.unwrap_or(next);
        group.first_id = (first != next).then_some(first);
        taken.insert(first, first + count);
        next = next.max(first + count);
        // Names are words, and those of scenarios are unique.
        let is_word = group.name.starts_with(char::is_alphabetic) && group.name != "all";
        if !is_word || !names.insert(group.name.clone()) {
            group.name.clear();
        }
    }
}

/// Returns the first of ids that count up.
fn first_of(ids: &[Option<u16>]) -> Option<u32> {
    let first = u32::from((*ids.first()?)?);
    let is_next = |(id, place): (&Option<u16>, u32)| *id == u16::try_from(place).ok();
    ids.iter().zip(first..).all(is_next).then_some(first)
}

/// Lists robots that make another number of steps per second than in ARGoS.
fn omit_rates(root: Element<'_>, arena: &Arena<'_>, rate: u32) {
    let experiment = root.first("framework").and_then(|framework| framework.first("experiment"));
    let Some(experiment) = experiment else { return };
    let used: HashSet<&str> = arena.groups.iter().map(|group| group.robot.as_str()).collect();
    for kind in arena.kinds.all().filter(|kind| used.contains(kind.reference.as_str())) {
        let steps = kind.robot.tick_hz;
        if steps != rate {
            experiment.omit(
                format!("`ticks_per_second` = {rate}: `{}` makes {steps} steps", kind.reference),
                format!(
                    "times that its script counts in steps last {} times as long",
                    number_text((f64::from(rate) / f64::from(steps) * 100.0).round() / 100.0)
                ),
            );
        }
    }
}

/// Lists media whose messages obstacles and robots block in ARGoS.
fn omit_shadows(root: Element<'_>, arena: &Arena<'_>) {
    let robots = arena.groups.iter().filter(|group| group.medium == Medium::RangeAndBearing);
    if robots.map(Group::count).sum::<usize>() < 2 {
        return;
    }
    for medium in root.all("media").flat_map(|media| media.all("range_and_bearing")) {
        if medium.text("check_occlusions") != Some("false") {
            medium.omit(
                "obstacles and robots that block messages",
                "messages pass through them here, as with check_occlusions=\"false\"",
            );
        }
    }
}

/// Returns the size of a world that has room for everything. ARGoS allows entities outside of its
/// arena, and has no wall there.
fn grown(section: Element<'_>, arena: &Arena<'_>) -> Option<[f64; 2]> {
    let mut size = arena.size;
    let mut include = |at: [f64; 2], margin: [f64; 2]| {
        for axis in [0, 1] {
            let needed = 2.0 * (at[axis].abs() + margin[axis]);
            if needed > size[axis] {
                size[axis] = needed.ceil();
            }
        }
    };
    for group in &arena.groups {
        match &group.placement {
            Placement::List(places) => {
                places.iter().for_each(|at| include(*at, [group.radius; 2]));
            }
            Placement::Area { center, size, .. } => include(*center, size.map(|side| side / 2.0)),
        }
    }
    for obstacle in &arena.obstacles {
        // An obstacle may reach into the wall of the world, but not a movable disc.
        let margin = if obstacle.is_movable { obstacle.shape.radius() } else { 0.0 };
        include(obstacle.at, [margin; 2]);
    }
    arena.lamps.iter().for_each(|lamp| include(lamp.at, [0.0; 2]));
    if size.iter().any(|side| !SIDE.contains(side)) {
        section.fail_at("size", Mistake::BeyondWorld { attribute: "size" });
        return None;
    }
    if size != arena.size {
        let [x, y] = size.map(number_text);
        section.omit(
            "robots, obstacles or lamps outside of the arena or at its edge",
            format!("the world has {x} mm by {y} mm, because a wall surrounds it"),
        );
    }
    Some(size)
}
