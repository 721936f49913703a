//! The text of the scenario.

use std::fmt::{self, Write};

use bittybuzz_robot_spec::Medium;
use bittybuzz_toml_reader::number_text;

use crate::world::quoted;

use super::group::{Group, Heading, Link, Placement, World};
use super::obstacle::{Obstacle, Shape};

/// Positions in a line.
const POSITIONS: usize = 6;

/// The numbers of the largest and of the lowest brightness.
const BRIGHT: &str = "1023";
const DARK: &str = "0";

/// Returns the scenario. `experiment` is the name of its source, and `omissions` are comments.
pub fn scenario(world: &World, experiment: &str, omissions: &[String]) -> String {
    let mut text = String::new();
    write(&mut text, world, experiment, omissions).expect("a string can always be written");
    text
}

fn write(text: &mut String, world: &World, experiment: &str, omissions: &[String]) -> fmt::Result {
    let experiment = experiment.replace(char::is_control, "?");
    writeln!(text, "# The experiment {experiment}, imported by `bbz import`.")?;
    writeln!(text, "# docs/argos.md describes the import, and docs/scenario.md all keys.")?;
    if !omissions.is_empty() {
        writeln!(text, "#\n# Left out or changed:")?;
    }
    omissions.iter().try_for_each(|line| writeln!(text, "# {line}"))?;
    let World { size, duration, seed, obstacles, lamps, groups } = world;
    writeln!(text, "\n[world]\nsize = {}", point(*size))?;
    writeln!(text, "duration = {}\nseed = {seed}", number_text(*duration))?;
    if !obstacles.is_empty() {
        writeln!(text, "obstacles = [")?;
        obstacles.iter().try_for_each(|one| writeln!(text, "    {}", obstacle(one)))?;
        writeln!(text, "]")?;
    }
    if !lamps.is_empty() {
        writeln!(text, "lights = [")?;
        for lamp in lamps {
            let (at, name) = (point(lamp.at), comment(&lamp.name));
            let brightness = if lamp.shines { BRIGHT } else { DARK };
            writeln!(text, "    {{ at = {at}, brightness = {brightness} }}, # {name}")?;
        }
        writeln!(text, "]")?;
    }
    if groups.iter().any(|group| group.is_kilobot) {
        writeln!(text, "\n# The speed, the turn rate and the range of ARGoS's Kilobot plugin.")?;
        writeln!(text, "[body.kilobot]\npreset = \"argos\"")?;
    }
    for medium in Medium::ALL {
        if let Some(keys) = shared(groups, medium).and_then(link) {
            writeln!(text, "\n[medium.{}]\n{}", medium.word(), keys.join("\n"))?;
        }
    }
    groups.iter().try_for_each(|group| robots(text, group, shared(groups, group.medium).is_none()))
}

/// Returns the properties of messages that all groups of a medium have.
fn shared(groups: &[Group], medium: Medium) -> Option<Link> {
    let mut links = groups.iter().filter(|group| group.medium == medium).map(|group| group.link);
    let first = links.next()?;
    links.all(|link| link == first).then_some(first)
}

/// Returns keys and values; `None` if there are none.
fn link(link: Link) -> Option<Vec<String>> {
    let keys = [("range", link.range), ("loss", link.loss)].into_iter();
    let keys = keys.filter_map(|(key, value)| Some(format!("{key} = {}", number_text(value?))));
    let keys: Vec<String> = keys.collect();
    (!keys.is_empty()).then_some(keys)
}

fn robots(text: &mut String, group: &Group, has_own_link: bool) -> fmt::Result {
    writeln!(text, "\n[[robots]]")?;
    if !group.name.is_empty() {
        writeln!(text, "name = {}", quoted(&group.name))?;
    }
    writeln!(text, "robot = {}\nscript = {}", quoted(&group.robot), quoted(&group.script))?;
    match &group.placement {
        Placement::Area { count, center, size } => {
            writeln!(text, "count = {count}\nat = {}\narea = {}", point(*center), point(*size))?;
        }
        Placement::List(places) => positions(text, places)?,
    }
    if let Heading::Degrees(degrees) = group.heading {
        writeln!(text, "heading = {}", number_text(degrees))?;
    }
    if let Some(first_id) = group.first_id {
        writeln!(text, "first_id = {first_id}")?;
    }
    match link(group.link).filter(|_| has_own_link) {
        Some(keys) => writeln!(text, "link = {{ {} }}", keys.join(", ")),
        None => Ok(()),
    }
}

fn positions(text: &mut String, places: &[[f64; 2]]) -> fmt::Result {
    let line = |places: &[[f64; 2]]| {
        places.iter().map(|place| point(*place)).collect::<Vec<_>>().join(", ")
    };
    if places.len() <= POSITIONS {
        return writeln!(text, "positions = [{}]", line(places));
    }
    writeln!(text, "positions = [")?;
    places.chunks(POSITIONS).try_for_each(|places| writeln!(text, "    {},", line(places)))?;
    writeln!(text, "]")
}

fn obstacle(obstacle: &Obstacle) -> String {
    let at = point(obstacle.at);
    let shape = match obstacle.shape {
        Shape::Disc { radius } => format!("radius = {}", number_text(radius)),
        Shape::Block { size, heading: 0.0 } => format!("size = {}", point(size)),
        Shape::Block { size, heading } => {
            format!("size = {}, heading = {}", point(size), number_text(heading))
        }
    };
    let height = number_text(obstacle.height);
    let movable = if obstacle.is_movable { ", movable = true" } else { "" };
    format!("{{ at = {at}, {shape}, height = {height}{movable} }}, # {}", comment(&obstacle.name))
}

fn point([x, y]: [f64; 2]) -> String {
    format!("[{}, {}]", number_text(x), number_text(y))
}

/// Returns a text that does not end a comment.
fn comment(text: &str) -> String {
    text.replace(char::is_control, "?")
}
