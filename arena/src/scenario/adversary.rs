//! `[[adversary]]`: senders that disturb a swarm, or send frames that no robot of it would send.

use bittybuzz_toml_reader::Place;
use toml::de::DeValue;

use super::backend::Backend;
use super::error::ScenarioCause;
use super::expect::not_after_end;
use super::group::{Group, GroupId};
use super::keys::ADVERSARY;
use super::read::{Entry, Section};
use super::select::RobotIndex;
use super::time::seconds;
use super::world::{WorldSection, point_inside};

/// A sender that stands in the world without a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Adversary {
    /// The kind of its frames.
    pub kind: AdversaryKind,
    /// Its position in mm.
    pub at: [f64; 2],
    /// Its height over the ground in mm.
    pub height: f64,
    /// The group whose link it uses and whose script it knows.
    pub group: GroupId,
    /// The largest distance in mm at which its frames are received; `None`: that of the group.
    pub range: Option<f64>,
    /// Frames per second; `None`: each frame follows the previous one without a pause.
    pub rate: Option<f64>,
    /// The time in seconds at which it stops sending.
    pub until: f64,
}

/// The kind of frames that an adversary sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AdversaryKind {
    /// Noise, which collides with other frames.
    Jam,
    /// Random bytes.
    Babble,
    /// Copies of frames that it received.
    Replay,
    /// Entries of stigmergies with clocks far ahead.
    ForgedClock,
    /// Values of all types, on topics and under keys that the script uses.
    Poison,
    /// Beacons of robots that do not exist.
    InventedIds,
    /// First fragments of messages that never end.
    HeldFragments,
    /// Messages with the robot of this id as their sender.
    SameId(u16),
}

/// The most adversaries that send at one time. Jammers send without a pause and receive each other,
/// so their cost grows with the third power of their number: 32 next to each other take a hundredth
/// of real time and 128 half of it (2026-11-29). They would gain nothing: one jammer leaves no gap on
/// its channel for a second one.
pub const ADVERSARIES_MAX: usize = 32;

/// Returns the index of the first adversary that begins while [`ADVERSARIES_MAX`] others send.
/// `times` are the beginnings, ascending, and the ends.
pub fn first_too_many(times: impl Iterator<Item = (f64, f64)>) -> Option<usize> {
    let mut ends: Vec<f64> = Vec::new();
    for (index, (from, until)) in times.enumerate() {
        ends.retain(|end| *end > from);
        if ends.len() == ADVERSARIES_MAX {
            return Some(index);
        }
        ends.push(until);
    }
    None
}

/// Reports the first of too many adversaries. `begun` are the beginnings and the ends of all, with
/// their places.
pub fn check_count(root: &Section<'_>, mut begun: Vec<(f64, f64, Place)>) {
    begun.sort_by(|(one, ..), (other, ..)| one.total_cmp(other));
    if let Some(index) = first_too_many(begun.iter().map(|(from, until, _)| (*from, *until))) {
        let (from, _, place) = &begun[index];
        let (at, max) = (from.to_string(), ADVERSARIES_MAX);
        root.reader.fail_at(place, ScenarioCause::TooManyAdversaries { at, max });
    }
}

/// Frames per second, unless the file sets a rate. The frames of a jammer follow each other without
/// a pause.
const DEFAULT_RATE: f64 = 10.0;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Word {
    Of(AdversaryKind),
    SameId,
}

const WORDS: [(&str, Word); 8] = [
    ("jam", Word::Of(AdversaryKind::Jam)),
    ("babble", Word::Of(AdversaryKind::Babble)),
    ("replay", Word::Of(AdversaryKind::Replay)),
    ("forged-clock", Word::Of(AdversaryKind::ForgedClock)),
    ("poison", Word::Of(AdversaryKind::Poison)),
    ("invented-ids", Word::Of(AdversaryKind::InventedIds)),
    ("held-fragments", Word::Of(AdversaryKind::HeldFragments)),
    ("same-id", Word::SameId),
];

/// Reads the adversaries of the file, each with the time in seconds at which it begins.
pub fn read_all(
    root: &Section<'_>,
    robot_index: &RobotIndex,
    world: &WorldSection,
    groups: &[Group],
) -> Vec<(f64, Adversary, Place)> {
    let sections = root.sections("adversary", ADVERSARY);
    let adversary = |section: &Section<'_>| {
        let at = match section.get("from") {
            None => Some(0.0),
            Some(entry) => within_the_run(&entry, "from", world),
        };
        let adversary = read(section, robot_index, world, groups);
        Some((at?, adversary?, section.place()))
    };
    sections.iter().filter_map(adversary).collect()
}

/// Reads the adversary of an event. The time of the event is its beginning, so `from` is an error.
pub fn of_event(
    entry: &Entry<'_>,
    robot_index: &RobotIndex,
    world: &WorldSection,
    groups: &[Group],
) -> Option<Adversary> {
    let section = entry.section(ADVERSARY)?;
    if let Some(from) = section.get("from") {
        from.fail(ScenarioCause::Without { key: "from", needs: "[[adversary]]" });
    }
    read(&section, robot_index, world, groups)
}

/// Reads a time that must lie before the end of the run.
fn within_the_run(entry: &Entry<'_>, key: &'static str, world: &WorldSection) -> Option<f64> {
    let at = seconds(entry, 0.0..=f64::MAX)?;
    if at >= world.duration {
        entry.fail(ScenarioCause::AfterEnd { key, duration: world.duration.to_string() });
        return None;
    }
    Some(at)
}

fn read(
    section: &Section<'_>,
    robot_index: &RobotIndex,
    world: &WorldSection,
    groups: &[Group],
) -> Option<Adversary> {
    let kind = kind(section, robot_index);
    let at = section.required("at").and_then(|entry| point_inside(&entry, world));
    let height = section.number("height", 0.0..=1e6).unwrap_or(0.0);
    let group = group(section, groups);
    let range = section.number("range", 1.0..=1e6);
    // Without a valid group, no rate is too high.
    let rate_max = group
        .map_or(f64::MAX, |group| 1e6 / f64::from(groups[group.0].model.medium().air_time_us()));
    let rate = section.number("rate", 0.01..=rate_max);
    let until = match section.get("until") {
        None => Some(world.duration),
        Some(entry) => seconds(&entry, 0.0..=f64::MAX).and_then(|until| {
            not_after_end(&entry, "until", until, world.duration)?;
            Some(until)
        }),
    };
    let kind = kind?;
    let rate = rate.or((kind != AdversaryKind::Jam).then_some(DEFAULT_RATE));
    Some(Adversary { kind, at: at?, height, group: group?, range, rate, until: until? })
}

fn kind(section: &Section<'_>, robot_index: &RobotIndex) -> Option<AdversaryKind> {
    section.required("kind")?;
    let word = section.word("kind", &WORDS)?;
    let id = section.get("id");
    match word {
        Word::Of(kind) => {
            if let Some(entry) = id {
                entry.fail(ScenarioCause::Without { key: "id", needs: "kind = \"same-id\"" });
            }
            Some(kind)
        }
        Word::SameId => {
            let entry = section.required("id")?;
            let DeValue::Integer(_) = entry.value else {
                entry.wrong_type("the id of a robot");
                return None;
            };
            let robots = robot_index.select(&entry)?;
            let robot = robots.iter().next().expect("a selection by id has the robot of that id");
            let id = u16::try_from(robot_index.id(robot));
            Some(AdversaryKind::SameId(id.expect("the reader of ids accepts 16 bits only")))
        }
    }
}

/// Returns the group that an adversary imitates.
fn group(section: &Section<'_>, groups: &[Group]) -> Option<GroupId> {
    let entry = section.get("group");
    let number = match &entry {
        None => 0,
        Some(entry) => {
            let name = entry.string()?;
            let named = groups.iter().position(|group| group.name == name);
            if named.is_none() && !groups.is_empty() {
                let groups = groups.iter().map(|group| group.name.clone()).collect();
                entry.fail(ScenarioCause::UnknownGroup { name: name.to_owned(), groups });
            }
            named?
        }
    };
    // All groups of the file may have mistakes, and none of them is known.
    if groups.get(number)?.backend != Backend::Vm {
        let cause = ScenarioCause::NotEmulated { key: "[[adversary]]" };
        match entry {
            Some(entry) => entry.fail(cause),
            None => section.fail(cause),
        }
        return None;
    }
    Some(GroupId(number))
}
