//! `[[event]]`: changes to the world during a run.

use std::path::PathBuf;

use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_toml_reader::{Place, TomlError};
use toml::de::DeValue;

use crate::robot::ScriptNumber;

use super::adversary::{self, Adversary};
use super::error::ScenarioCause;
use super::expect::not_after_end;
use super::group::Group;
use super::load::groups_of;
use super::read::{Entry, Section};
use super::robots::heading;
use super::select::{RobotIndex, Selection};
use super::time::seconds;
use super::world::{WorldSection, light, point_inside};
use super::{LampSection, LossSetting};
use crate::engine::{BLOCK_ROBOTS_MAX, Medium};

/// A change to the world at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct ScheduledEvent {
    /// Seconds from the start. The change takes effect before the robots act at that time.
    pub at: f64,
    /// The change.
    pub action: WorldChange,
}

/// A change to the world.
#[derive(Debug, Clone, PartialEq)]
pub enum WorldChange {
    /// The robots fail: no motor, no frame, no step, until they are restarted.
    Fail(Selection),
    /// The robots stop: no motor, no frame, no step, until they resume.
    Stop(Selection),
    /// Stopped robots continue from their state.
    Resume(Selection),
    /// The robots are switched off and on.
    Restart(Selection),
    /// The power supply of the running robots fails for a moment.
    BrownOut(Selection),
    /// The robots get another script, and are switched off and on.
    Load {
        /// The robots that the event is for.
        robots: Selection,
        /// The script, image or object file.
        script: PathBuf,
        /// True if globals that hold numbers keep them, where the new script has the same globals.
        keep: bool,
    },
    /// A global of the robots' scripts is set.
    Set {
        /// The robots that the event is for.
        robots: Selection,
        /// The name of the global.
        global: String,
        numbers: NewNumbers,
        /// The place of the name in the file.
        place: Place,
    },
    /// A function of the robots' scripts is called before their next step.
    Call {
        /// The robots that the event is for.
        robots: Selection,
        /// The name of the function.
        function: String,
        /// The place of the name in the file.
        place: Place,
    },
    /// The robots' scripts evaluate an expression between two steps.
    Ask {
        /// The robots that the event is for.
        robots: Selection,
        /// The expression, or statements.
        question: String,
        /// The place of the question in the file.
        place: Place,
    },
    /// Robots that were absent at the start join.
    Join(Selection),
    /// The robots are moved.
    Move {
        /// The robots that the event is for.
        robots: Selection,
        /// The destination.
        to: MoveTarget,
        /// The new heading in degrees; `None` keeps it.
        heading: Option<f64>,
    },
    /// The voltage of the robots' batteries is set.
    Battery {
        /// The robots that the event is for.
        robots: Selection,
        /// The voltage in mV.
        millivolts: u16,
    },
    /// The poses from outside of the robots are displaced from now on.
    Displace {
        /// The robots that the event is for.
        robots: Selection,
        /// The displacement in mm.
        by: [f64; 2],
    },
    /// The source of poses takes each of these robots for the other one, or no longer.
    Relabel(Selection, Selection),
    /// The lights of the world are replaced.
    Light(Vec<LampSection>),
    /// The share of frames that a medium loses is set.
    Loss(Medium, LossSetting),
    /// Links between robots of the first and of the second selection are blocked in both
    /// directions.
    Block(Selection, Selection),
    /// Blocked links work again.
    Restore(Selection, Selection),
    /// Links work only within each part. Robots in no part form one more part.
    Partition(Vec<Selection>),
    /// The partition ends.
    Heal,
    /// An adversary appears.
    Adversary(Box<Adversary>),
}

impl WorldChange {
    /// Returns the key of the change in a scenario, such as `brown_out`.
    pub fn key(&self) -> &'static str {
        match self {
            WorldChange::Fail(_) => "fail",
            WorldChange::Stop(_) => "stop",
            WorldChange::Resume(_) => "resume",
            WorldChange::Restart(_) => "restart",
            WorldChange::BrownOut(_) => "brown_out",
            WorldChange::Load { .. } => "load",
            WorldChange::Set { .. } => "set",
            WorldChange::Call { .. } => "call",
            WorldChange::Ask { .. } => "ask",
            WorldChange::Join(_) => "join",
            WorldChange::Move { .. } => "move",
            WorldChange::Battery { .. } => "battery",
            WorldChange::Displace { .. } => "displace",
            WorldChange::Relabel(..) => "relabel",
            WorldChange::Light(_) => "light",
            WorldChange::Loss(..) => "loss",
            WorldChange::Block(..) => "block",
            WorldChange::Restore(..) => "restore",
            WorldChange::Partition(_) => "partition",
            WorldChange::Heal => "heal",
            WorldChange::Adversary(_) => "adversary",
        }
    }
}

/// The numbers that robots get in a global.
#[derive(Debug, Clone, PartialEq)]
pub enum NewNumbers {
    /// All robots get this number.
    Same(ScriptNumber),
    /// Each robot gets its own number, in ascending order of the robots' numbers. `None` leaves the
    /// value of a robot as it is.
    Each(Vec<Option<ScriptNumber>>),
}

impl NewNumbers {
    /// Returns the number for the robot at a position in the selection, if it gets one.
    pub fn at(&self, position: usize) -> Option<ScriptNumber> {
        match self {
            NewNumbers::Same(number) => Some(*number),
            NewNumbers::Each(numbers) => numbers.get(position).copied().flatten(),
        }
    }
}

/// The destination of robots that are moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MoveTarget {
    /// The mean of their positions moves to this point, in mm. Their relative positions stay.
    To([f64; 2]),
    /// Each robot moves by this displacement in mm.
    By([f64; 2]),
}

const ACTIONS: &[&str] = &[
    "fail",
    "stop",
    "resume",
    "restart",
    "brown_out",
    "load",
    "set",
    "call",
    "ask",
    "join",
    "move",
    "battery",
    "displace",
    "relabel",
    "light",
    "loss",
    "block",
    "restore",
    "partition",
    "heal",
    "adversary",
];

/// Reads an event with its time. `script` reads the path of a script.
pub fn read(
    section: &Section<'_>,
    robot_index: &RobotIndex,
    world: &WorldSection,
    groups: &[Group],
    used: &[Medium],
    script: &dyn Fn(&Entry<'_>) -> Option<PathBuf>,
) -> Option<ScheduledEvent> {
    let at = section.required("at").and_then(|entry| {
        let at = seconds(&entry, 0.0..=f64::MAX)?;
        not_after_end(&entry, "at", at, world.duration)?;
        // No action takes effect at the very end of the run.
        if at >= world.duration {
            entry.fail(ScenarioCause::AfterEnd { key: "at", duration: world.duration.to_string() });
            return None;
        }
        Some(at)
    });
    let action = action(section, robot_index, world, groups, used, script);
    Some(ScheduledEvent { at: at?, action: action? })
}

/// Reads the action of an event or a command. `script` reads the path of a script.
pub fn action(
    section: &Section<'_>,
    robot_index: &RobotIndex,
    world: &WorldSection,
    groups: &[Group],
    used: &[Medium],
    script: &dyn Fn(&Entry<'_>) -> Option<PathBuf>,
) -> Option<WorldChange> {
    let (key, entry) = section.one_of(ACTIONS)?;
    for (other, needs) in [
        ("to", "move"),
        ("heading", "move"),
        ("script", "load"),
        ("keep", "load"),
        ("global", "set"),
        ("number", "set"),
        ("numbers", "set"),
        ("function", "call"),
        ("robots", "ask"),
        ("volts", "battery"),
        ("medium", "loss"),
    ] {
        if let Some(stray) = section.get(other).filter(|_| key != needs) {
            stray.fail(ScenarioCause::Without { key: other, needs });
        }
    }
    if let Some(stray) = section.get("by").filter(|_| key != "move" && key != "displace") {
        stray.fail(ScenarioCause::Without { key: "by", needs: "move" });
    }
    let action = match key {
        "fail" => WorldChange::Fail(robot_index.select(&entry)?),
        "stop" => WorldChange::Stop(robot_index.select(&entry)?),
        "resume" => WorldChange::Resume(robot_index.select(&entry)?),
        "restart" => WorldChange::Restart(robot_index.select(&entry)?),
        "brown_out" => WorldChange::BrownOut(robot_index.select(&entry)?),
        "load" => {
            let robots = robot_index.select(&entry);
            let script = section.required("script").and_then(|entry| script(&entry));
            let keep = match section.get("keep") {
                None => Some(false),
                Some(entry) => entry.boolean(),
            };
            WorldChange::Load { robots: robots?, script: script?, keep: keep? }
        }
        "set" => set(section, robot_index.select(&entry), groups)?,
        "call" => {
            let robots = robot_index.select(&entry);
            let name = section.required("function")?;
            let (function, place) = (name.string()?.to_owned(), name.place());
            WorldChange::Call { robots: robots?, function, place }
        }
        "ask" => {
            let robots = section.required("robots").and_then(|entry| robot_index.select(&entry));
            let (question, place) = (entry.string()?.to_owned(), entry.place());
            WorldChange::Ask { robots: robots?, question, place }
        }
        "join" => WorldChange::Join(robot_index.select(&entry)?),
        "move" => moved(section, robot_index.select(&entry), world)?,
        "battery" => {
            let robots = robot_index.select(&entry);
            let volts = section.required("volts").and_then(|entry| entry.number(0.0..=5.0));
            WorldChange::Battery { robots: robots?, millivolts: (volts? * 1000.0).round() as u16 }
        }
        "displace" => {
            let robots = robot_index
                .select(&entry)
                .filter(|robots| has_poses(&entry, "displace", robots, groups));
            let by =
                section.required("by").and_then(|entry| entry.numbers(TWO_NUMBERS, -1e6..=1e6));
            WorldChange::Displace { robots: robots?, by: by? }
        }
        "relabel" => relabel(&entry, robot_index, groups)?,
        "light" => WorldChange::Light(lights(&entry, world)?),
        "loss" => loss(section, &entry, used)?,
        "block" => {
            let [one, other] = pair(&entry, robot_index)?;
            WorldChange::Block(one, other)
        }
        "restore" => {
            let [one, other] = pair(&entry, robot_index)?;
            WorldChange::Restore(one, other)
        }
        "partition" => WorldChange::Partition(parts(&entry, robot_index)?),
        "adversary" => WorldChange::Adversary(Box::new(adversary::of_event(
            &entry,
            robot_index,
            world,
            groups,
        )?)),
        _ => {
            let DeValue::Boolean(true) = entry.value else {
                entry.wrong_type("true");
                return None;
            };
            WorldChange::Heal
        }
    };
    if let WorldChange::Loss(Medium::Nrf24, loss) = &action
        && robot_index.any_is_emulated()
    {
        loss.check_emulated(&entry);
    }
    // The emulator loads the flash only at its start, and has no access to the memory later.
    if let WorldChange::Load { robots, .. }
    | WorldChange::Set { robots, .. }
    | WorldChange::Call { robots, .. }
    | WorldChange::Ask { robots, .. } = &action
        && robot_index.is_emulated(robots)
    {
        entry.fail(ScenarioCause::NotEmulated { key });
        return None;
    }
    // Real robots cannot be paused.
    if let WorldChange::Stop(robots) | WorldChange::Resume(robots) = &action
        && robot_index.is_emulated(robots)
    {
        entry.fail(ScenarioCause::NotEmulated { key });
        return None;
    }
    if let WorldChange::Fail(robots) | WorldChange::Restart(robots) | WorldChange::BrownOut(robots) =
        &action
        && !robot_index.have_switches(robots)
    {
        entry.fail(ScenarioCause::NotEmulated { key });
        return None;
    }
    if let WorldChange::Move { robots, .. } = &action
        && !robot_index.can_be_moved(robots)
    {
        entry.fail(ScenarioCause::NotMoved { key });
        return None;
    }
    Some(action)
}

/// Reads a global and its numbers, which must fit the smallest number range of the robots.
fn set(section: &Section<'_>, robots: Option<Selection>, groups: &[Group]) -> Option<WorldChange> {
    let global = section.required("global").and_then(|entry| {
        let name = entry.string()?.to_owned();
        Some((name, entry.place()))
    });
    let robots = robots?;
    let of_robots = groups_of(groups, &robots);
    let profiles = of_robots.iter().map(|group| groups[group.0].robot.profile);
    let is_tiny = profiles.into_iter().any(|profile| profile == NumberProfile::Tiny);
    let numbers = match section.get("numbers") {
        None => NewNumbers::Same(script_number(&section.required("number")?, is_tiny)?),
        Some(entry) => {
            if section.get("number").is_some() {
                entry.fail(TomlError::Both { key: "numbers", other: "number" });
                return None;
            }
            NewNumbers::Each(number_of_each(&entry, &robots, is_tiny)?)
        }
    };
    let (global, place) = global?;
    Some(WorldChange::Set { robots, global, numbers, place })
}

/// Reads a list with a number for each robot. `nan` stands for a robot that keeps its value.
fn number_of_each(
    entry: &Entry<'_>,
    robots: &Selection,
    is_tiny: bool,
) -> Option<Vec<Option<ScriptNumber>>> {
    let items = entry.list()?;
    if items.len() != robots.count() {
        let expected = "a list with one number for each robot";
        entry.fail(TomlError::Length { key: entry.key.clone(), expected, found: items.len() });
        return None;
    }
    let is_nan = |item: &Entry<'_>| match item.value {
        DeValue::Float(float) => float.as_str().ends_with("nan"),
        _ => false,
    };
    let number = |item: &Entry<'_>| match is_nan(item) {
        true => Some(None),
        false => script_number(item, is_tiny).map(Some),
    };
    items.iter().map(number).collect()
}

/// Reads a number of a script: an integer, or a float with a decimal point.
pub fn script_number(entry: &Entry<'_>, is_tiny: bool) -> Option<ScriptNumber> {
    Some(match (entry.value, is_tiny) {
        (DeValue::Integer(_), true) => int(entry.number(i16::MIN.into()..=i16::MAX.into())?),
        (DeValue::Integer(_), false) => int(entry.number(i32::MIN.into()..=i32::MAX.into())?),
        (_, true) => float(entry.number(-TINY_FLOAT_MAX..=TINY_FLOAT_MAX)?),
        (_, false) => float(entry.number(f32::MIN.into()..=f32::MAX.into())?),
    })
}

/// The greatest float of the profile `tiny`: 10 bits, and the greatest exponent is 31.
const TINY_FLOAT_MAX: f64 = 1023.0 * (1u64 << 22) as f64;

fn int(number: f64) -> ScriptNumber {
    ScriptNumber::Int(number as i32)
}

fn float(number: f64) -> ScriptNumber {
    ScriptNumber::Float(number as f32)
}

/// A displacement in messages.
const TWO_NUMBERS: &str = "two numbers as [x, y]";

/// Returns true if all robots of a selection get poses from outside; else fails at the entry.
fn has_poses(entry: &Entry<'_>, key: &'static str, robots: &Selection, groups: &[Group]) -> bool {
    let of_robots = groups_of(groups, robots).into_iter().map(|id| &groups[id.0]);
    let without = of_robots.into_iter().find(|group| !group.model.has_outside_poses());
    if let Some(group) = without {
        entry.fail(ScenarioCause::NoPoses { key, group: group.name.clone() });
    }
    without.is_none()
}

fn relabel(entry: &Entry<'_>, robot_index: &RobotIndex, groups: &[Group]) -> Option<WorldChange> {
    let [one, other] = pair(entry, robot_index)?;
    if !is_pair_of_a_block(&one, &other, groups) {
        entry.fail(ScenarioCause::NotTwoOfAGroup);
        return None;
    }
    has_poses(entry, "relabel", &one, groups).then_some(WorldChange::Relabel(one, other))
}

/// Returns true for two robots whose bodies see each other: those of one group that start together, in
/// blocks of the engine.
fn is_pair_of_a_block(one: &Selection, other: &Selection, groups: &[Group]) -> bool {
    let (of_one, of_other) = (groups_of(groups, one), groups_of(groups, other));
    let ([group], true) = (of_one.as_slice(), of_one == of_other) else { return false };
    let before: u32 = groups[..group.0].iter().map(|group| group.count).sum();
    let block = |robots: &Selection| {
        let number = robots.iter().next().filter(|_| robots.count() == 1)?;
        Some((number, (number - before as usize) / BLOCK_ROBOTS_MAX))
    };
    let (Some((one, first)), Some((other, second))) = (block(one), block(other)) else {
        return false;
    };
    groups[group.0].present && one != other && first == second
}

fn moved(
    section: &Section<'_>,
    robots: Option<Selection>,
    world: &WorldSection,
) -> Option<WorldChange> {
    let heading = section.get("heading").map(|entry| heading(&entry));
    let (key, entry) = section.one_of(&["to", "by"])?;
    let target = match key {
        "to" => MoveTarget::To(point_inside(&entry, world)?),
        _ => MoveTarget::By(entry.numbers(TWO_NUMBERS, -1e6..=1e6)?),
    };
    let heading = match heading {
        None => None,
        Some(heading) => Some(heading?),
    };
    Some(WorldChange::Move { robots: robots?, to: target, heading })
}

/// Reads the lights of an event: one, or a list of them.
fn lights(entry: &Entry<'_>, world: &WorldSection) -> Option<Vec<LampSection>> {
    match entry.value {
        DeValue::Array(_) => {
            Some(entry.list()?.iter().filter_map(|item| light(item, world)).collect())
        }
        _ => Some(vec![light(entry, world)?]),
    }
}

fn loss(section: &Section<'_>, entry: &Entry<'_>, used: &[Medium]) -> Option<WorldChange> {
    let loss = super::medium::loss(entry);
    let medium = match (section.get("medium"), used) {
        // The scenario has a single medium, so the key can be absent.
        (None, [only]) => Some(*only),
        // The media are unknown because of another error, so no error is added.
        (None, []) => None,
        (None, _) => section.required("medium").and(None),
        (Some(entry), _) => {
            let medium = section.word("medium", &Medium::WORDS)?;
            if !used.contains(&medium) && !used.is_empty() {
                entry.fail(ScenarioCause::NoSuchMedium { medium: medium.word() });
                return None;
            }
            Some(medium)
        }
    };
    Some(WorldChange::Loss(medium?, loss?))
}

fn pair(entry: &Entry<'_>, robot_index: &RobotIndex) -> Option<[Selection; 2]> {
    let items = entry.list()?;
    let [one, other] = items.as_slice() else {
        let expected = "two lists of robots";
        entry.fail(TomlError::Length { key: entry.key.clone(), expected, found: items.len() });
        return None;
    };
    let (one, other) = (robot_index.select(one), robot_index.select(other));
    Some([one?, other?])
}

/// The largest number of parts. The number of a part is one byte, and 0 is that of robots in no
/// part.
const PARTS_MAX: usize = 255;

fn parts(entry: &Entry<'_>, robot_index: &RobotIndex) -> Option<Vec<Selection>> {
    let items = entry.list()?;
    if items.is_empty() || items.len() > PARTS_MAX {
        let expected = "a list of 1 to 255 parts";
        entry.fail(TomlError::Length { key: entry.key.clone(), expected, found: items.len() });
        return None;
    }
    let mut parts: Vec<Selection> = Vec::new();
    for item in &items {
        let part = robot_index.select(item)?;
        let is_taken = |robot: &usize| parts.iter().any(|other| other.contains(*robot));
        if let Some(robot) = part.iter().find(is_taken) {
            item.fail(ScenarioCause::TwoParts { id: robot_index.id(robot) });
            return None;
        }
        parts.push(part);
    }
    Some(parts)
}
