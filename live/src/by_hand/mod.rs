//! A world that is built by hand: robots, obstacles, lamps and painted ground are added, changed,
//! copied and deleted in the text of the scenario.
//!
//! A change replaces only the parts of the text that it has to; comments and layout of all else stay.
//! The caller reads the new text as a scenario, which finds places that are not free.

mod robots;
#[cfg(test)]
mod tests;
mod text;

use bittybuzz_arena::scenario::{Scenario, ScenarioError};
use serde::{Deserialize, Serialize};
use toml::de::{DeTable, DeValue};

use text::{Item, TextChanges, TextTable};

/// The kinds of things in a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum ThingKind {
    Robot,
    /// An obstacle that never moves.
    Obstacle,
    /// A disc that robots push.
    Movable,
    Lamp,
    /// A painted part of the ground.
    Patch,
}

/// A thing in the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct Thing {
    pub kind: ThingKind,
    /// The number among the things of its kind, in the order of the `begin` event.
    pub number: usize,
}

/// Values of a thing, in the units of the scenario. Values that are not given stay as they are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[cfg_attr(test, ts(optional_fields))]
#[serde(deny_unknown_fields, default)]
pub struct ThingValues {
    /// The center.
    pub at: Option<[f64; 2]>,
    /// The ends of a wall.
    pub from: Option<[f64; 2]>,
    pub to: Option<[f64; 2]>,
    /// The radius of a disc.
    pub radius: Option<f64>,
    /// Width and height of a box.
    pub size: Option<[f64; 2]>,
    /// The heading of a robot or a box, in degrees.
    pub heading: Option<f64>,
    /// The brightness of a lamp or of paint.
    pub brightness: Option<f64>,
}

impl ThingValues {
    /// Returns the keys and values of the scenario, in their usual order.
    fn entries(&self) -> impl Iterator<Item = (&'static str, Vec<f64>)> {
        let points = [("from", self.from), ("to", self.to), ("at", self.at), ("size", self.size)];
        let numbers =
            [("radius", self.radius), ("heading", self.heading), ("brightness", self.brightness)];
        let points = points.into_iter().filter_map(|(key, value)| Some((key, value?.to_vec())));
        let numbers = numbers.into_iter().filter_map(|(key, value)| Some((key, vec![value?])));
        points.chain(numbers)
    }
}

/// A change of the world by hand.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum WorldEdit {
    /// Adds a thing.
    Add {
        kind: ThingKind,
        /// The number of the group of a robot.
        #[cfg_attr(test, ts(optional))]
        group: Option<usize>,
        values: ThingValues,
    },
    /// Changes values of a thing.
    Change { thing: Thing, values: ThingValues },
    /// Adds a thing that differs from another one in these values.
    Copy { thing: Thing, values: ThingValues },
    /// Deletes a thing.
    Delete { thing: Thing },
}

/// A reason why a world cannot be changed by hand.
#[derive(Debug)]
pub enum BuildError {
    /// The new text is not a valid scenario. The first mistake is the reason.
    Scenario(Vec<ScenarioError>),
    NoSuchThing,
    /// A robot needs a place, and one of the groups.
    NoPlace,
    /// Every scenario has a robot.
    LastRobot,
    /// The table has no place for a new key.
    NoSection(&'static str),
}

impl std::fmt::Display for BuildError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            BuildError::Scenario(errors) => match errors.first() {
                Some(error) => error.fmt(f),
                None => f.write_str("the scenario has a mistake"),
            },
            BuildError::NoSuchThing => f.write_str("the world has no such thing"),
            BuildError::NoPlace => f.write_str("a robot needs a place and a group"),
            BuildError::LastRobot => f.write_str("a world needs at least one robot"),
            BuildError::NoSection(name) => {
                write!(
                    f,
                    "the text of the scenario has no section `{name}` to which this can be added"
                )
            }
        }
    }
}

impl BuildError {
    /// Returns advice for the user.
    pub fn help(&self) -> Option<String> {
        match self {
            BuildError::Scenario(errors) => errors.first().and_then(ScenarioError::help),
            _ => None,
        }
    }
}

/// Reads a text as the scenario.
pub type Parse<'a> = &'a dyn Fn(&str) -> Result<Scenario, Vec<ScenarioError>>;

/// A text that was changed by hand.
#[derive(Debug)]
pub struct BuiltText {
    pub text: String,
    /// The thing that was added or changed.
    pub thing: Option<Thing>,
}

/// Changes the text of a scenario.
pub fn apply(text: &str, edit: &WorldEdit, parse: Parse<'_>) -> Result<BuiltText, BuildError> {
    let scenario = parse(text).map_err(BuildError::Scenario)?;
    let built = match *edit {
        WorldEdit::Add { kind: ThingKind::Robot, group, values } => {
            let group = group.ok_or(BuildError::NoPlace)?;
            robots::edit(text, &scenario, &robots::RobotEdit::Add { group, values }, parse)?
        }
        WorldEdit::Change { thing, values } if thing.kind == ThingKind::Robot => {
            let edit = robots::RobotEdit::Change { robot: thing.number, values };
            robots::edit(text, &scenario, &edit, parse)?
        }
        WorldEdit::Copy { thing, values } if thing.kind == ThingKind::Robot => {
            let group = robots::group_of(&scenario, thing.number).ok_or(BuildError::NoSuchThing)?;
            robots::edit(text, &scenario, &robots::RobotEdit::Add { group, values }, parse)?
        }
        WorldEdit::Delete { thing } if thing.kind == ThingKind::Robot => {
            let edit = robots::RobotEdit::Delete { robot: thing.number };
            robots::edit(text, &scenario, &edit, parse)?
        }
        WorldEdit::Add { kind, values, .. } => add(text, kind, None, &values)?,
        WorldEdit::Change { thing, values } => {
            BuiltText { text: change(text, thing, &values)?, thing: Some(thing) }
        }
        WorldEdit::Copy { thing, values } => {
            let copied = with_thing(text, thing, |list, number| {
                text::element_text(text, &text::elements(list)[number])
            })?;
            let built = add(text, thing.kind, Some(copied), &values)?;
            let copy = built.thing.expect("an addition adds a thing");
            BuiltText { text: change(&built.text, copy, &values)?, ..built }
        }
        WorldEdit::Delete { thing } => {
            let mut changes = TextChanges::default();
            with_thing(text, thing, |list, number| text::remove(&mut changes, text, list, number))?;
            BuiltText { text: changes.apply(text), thing: None }
        }
    };
    parse(&built.text).map_err(BuildError::Scenario)?;
    Ok(built)
}

/// Returns the key of `[world]` with the things of a kind.
fn key_of(kind: ThingKind) -> &'static str {
    match kind {
        ThingKind::Robot => "robots",
        ThingKind::Obstacle | ThingKind::Movable => "obstacles",
        ThingKind::Lamp => "lights",
        ThingKind::Patch => "ground",
    }
}

/// Returns true if an element of the list of a kind is a thing of this kind: obstacles and movable
/// discs share one list.
fn is_of(kind: ThingKind, element: &Item<'_>) -> bool {
    let is_movable = match element.get_ref() {
        DeValue::Table(table) => {
            table.get("movable").is_some_and(|item| item.get_ref().as_bool() == Some(true))
        }
        _ => false,
    };
    match kind {
        ThingKind::Obstacle => !is_movable,
        ThingKind::Movable => is_movable,
        ThingKind::Robot | ThingKind::Lamp | ThingKind::Patch => true,
    }
}

/// Calls a function with the list of a thing, and its number there.
fn with_thing<T>(
    text: &str,
    thing: Thing,
    act: impl FnOnce(&Item<'_>, usize) -> T,
) -> Result<T, BuildError> {
    // The reader of scenarios has accepted the text.
    let document = DeTable::parse(text).map_err(|_| BuildError::NoSuchThing)?;
    let world = document.get_ref().get("world").and_then(|item| TextTable::new(text, item));
    let list = world.and_then(|world| world.table.get(key_of(thing.kind)));
    let list = list.ok_or(BuildError::NoSuchThing)?;
    let elements = text::elements(list).iter().enumerate();
    let mut own = elements.filter(|(_, element)| is_of(thing.kind, element));
    let (number, _) = own.nth(thing.number).ok_or(BuildError::NoSuchThing)?;
    Ok(act(list, number))
}

/// Appends a thing to the list of its kind. `copied` is the text of another element.
fn add(
    text: &str,
    kind: ThingKind,
    copied: Option<String>,
    values: &ThingValues,
) -> Result<BuiltText, BuildError> {
    let document = DeTable::parse(text).map_err(|_| BuildError::NoSection("[world]"))?;
    let world = document.get_ref().get("world").and_then(|item| TextTable::new(text, item));
    let world = world.ok_or(BuildError::NoSection("[world]"))?;
    let mut changes = TextChanges::default();
    let entries = values.entries().map(|(key, numbers)| match &*numbers {
        [number] => format!("{key} = {}", text::number_text(*number)),
        numbers => format!("{key} = {}", text::numbers_text(numbers)),
    });
    let movable = (kind == ThingKind::Movable).then(|| "movable = true".to_owned());
    let entries: Vec<String> = entries.chain(movable).collect();
    let inline = || format!("{{ {} }}", entries.join(", "));
    let list = world.table.get(key_of(kind));
    match list {
        Some(list) => {
            let added = copied.unwrap_or_else(|| match text::section_header(text, list) {
                Some(header) => {
                    let newline = text::newline(text);
                    [header]
                        .into_iter()
                        .chain(entries.iter().map(|one| &**one))
                        .collect::<Vec<_>>()
                        .join(newline)
                }
                None => inline(),
            });
            text::append(&mut changes, text, list, &added);
        }
        None => {
            let value = format!("[{}]", inline());
            if !world.set(&mut changes, key_of(kind), &value) {
                return Err(BuildError::NoSection("[world]"));
            }
        }
    }
    let number = list.map_or(0, |list| {
        text::elements(list).iter().filter(|element| is_of(kind, element)).count()
    });
    Ok(BuiltText { text: changes.apply(text), thing: Some(Thing { kind, number }) })
}

/// Changes values of a thing.
fn change(text: &str, thing: Thing, values: &ThingValues) -> Result<String, BuildError> {
    let mut changes = TextChanges::default();
    let is_set = with_thing(text, thing, |list, number| {
        let element = &text::elements(list)[number];
        match TextTable::new(text, element) {
            Some(table) => {
                values.entries().all(|(key, numbers)| set(&mut changes, &table, key, &numbers))
            }
            None => {
                set_lamp(&mut changes, text, element, values);
                true
            }
        }
    })?;
    match is_set {
        true => Ok(changes.apply(text)),
        false => Err(BuildError::NoSection("[world]")),
    }
}

/// Sets a number or a list of numbers of a table. Numbers that stay the same stay as they are
/// written. Returns false if the key cannot be added.
fn set(changes: &mut TextChanges, table: &TextTable<'_>, key: &str, numbers: &[f64]) -> bool {
    match (table.table.get(key), numbers) {
        (Some(item), [number]) => text::set_number(changes, item, *number),
        (Some(item), numbers) => text::set_numbers(changes, item, numbers),
        (None, [number]) => return table.set(changes, key, &text::number_text(*number)),
        (None, numbers) => return table.set(changes, key, &text::numbers_text(numbers)),
    }
    true
}

/// Changes a lamp that is written as its position alone.
fn set_lamp(changes: &mut TextChanges, text: &str, element: &Item<'_>, values: &ThingValues) {
    match (values.at, values.brightness) {
        (at, Some(brightness)) => {
            let at =
                at.map_or_else(|| text[element.span()].to_owned(), |at| text::numbers_text(&at));
            let brightness = text::number_text(brightness);
            changes.replace(element.span(), format!("{{ at = {at}, brightness = {brightness} }}"));
        }
        (Some(at), None) => text::set_numbers(changes, element, &at),
        (None, None) => {}
    }
}
