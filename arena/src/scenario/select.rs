//! The selection of the robots that an event or an expectation refers to.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use bittybuzz_toml_reader::{Place, TomlError};
use toml::de::DeValue;

use super::error::ScenarioCause;
use super::group::Group;
use super::read::{Entry, Section};
use super::value::Quantity;

/// Robots of a scenario, as ranges of their numbers in the order of the file, from 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Selection(Vec<Range<u32>>);

impl Selection {
    /// Returns all robots of a scenario with `count` robots.
    pub fn all(count: u32) -> Self {
        Selection(std::iter::once(0..count).collect())
    }

    /// Returns the robots of a group.
    pub(crate) fn of_group(group: &Group) -> Self {
        Selection(std::iter::once(group.first_robot..group.end()).collect())
    }

    /// Returns the robots' numbers, ascending and without duplicates.
    pub fn iter(&self) -> impl Iterator<Item = usize> + Clone {
        self.0.iter().flat_map(|range| range.start as usize..range.end as usize)
    }

    /// Returns the number of robots.
    pub fn count(&self) -> usize {
        self.0.iter().map(|range| range.len()).sum()
    }

    /// Returns true if the selection contains that robot.
    pub fn contains(&self, robot: usize) -> bool {
        let next = self.0.partition_point(|range| range.end as usize <= robot);
        self.0.get(next).is_some_and(|range| range.start as usize <= robot)
    }

    /// Returns the ranges of the robots' numbers, ascending, with gaps between them.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = Range<u32>> {
        self.0.iter().cloned()
    }

    fn from_ranges(mut ranges: Vec<Range<u32>>) -> Self {
        ranges.sort_by_key(|range| range.start);
        let mut joined: Vec<Range<u32>> = Vec::new();
        for range in ranges {
            match joined.last_mut() {
                Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
                _ => joined.push(range),
            }
        }
        Selection(joined)
    }
}

/// Returns true if a text selects robots even if no group has it as its name.
pub fn means_others(text: &str) -> bool {
    let is_id = |text: &str| text.trim().parse::<u16>().is_ok();
    text == "all" || is_id(text) || text.split_once("..").is_some_and(|(a, b)| is_id(a) && is_id(b))
}

/// The largest number of groups that a message describes.
const DESCRIBED_MAX: usize = 24;

/// The largest number of groups and ids that the description of a selection names.
const WORDS_MAX: usize = 8;

/// The index of a scenario's robots by name and id.
#[derive(Debug, Default)]
pub struct RobotIndex {
    groups: Vec<Known>,
    /// The index of the first group of each name.
    by_name: HashMap<String, usize>,
    /// The number for the next group's name, by the name of the robot.
    numbers: HashMap<String, u32>,
    count: u32,
    next_id: u32,
    /// The ids of all groups: the first id of a range, the id after its last one, and the index of
    /// the group. No two ranges overlap: of equal ids, the first group has them.
    ids: BTreeMap<u32, (u32, usize)>,
    /// The robots of groups with the same limits, in ascending order. There are at most nine
    /// different limits.
    by_limits: Vec<(Option<EmulatorLimits>, Vec<Range<u32>>)>,
    /// True if the count or the ids of a group are wrong, so that the ids of all groups are
    /// uncertain.
    is_unsure: bool,
}

#[derive(Debug)]
struct Known {
    name: String,
    first_id: u32,
    /// The numbers of the group's robots.
    robots: Range<u32>,
    line: usize,
}

/// The limits of an emulator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EmulatorLimits {
    pub counts_steps: bool,
    pub has_switch: bool,
    /// True if the world, and not the emulator, places the bodies.
    pub can_be_moved: bool,
}

/// Returns true if a quantity can be read from robots with these limits.
fn provide(limits: Option<EmulatorLimits>, quantity: &Quantity) -> bool {
    limits.is_none_or(|limits| quantity.is_seen_on_firmware(limits.counts_steps))
}

impl Known {
    fn ids(&self) -> Range<u32> {
        self.first_id..self.first_id.saturating_add(self.robots.len() as u32)
    }

    /// Returns the numbers of the group's robots with these ids.
    fn with_ids(&self, ids: &Range<u32>) -> Option<Range<u32>> {
        let own = self.ids();
        let (start, end) = (ids.start.max(own.start), ids.end.min(own.end));
        let number = |id: u32| id - self.first_id + self.robots.start;
        (start < end).then(|| number(start)..number(end))
    }
}

impl RobotIndex {
    /// Returns the number of robots.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Returns the id after the highest known one.
    pub fn next_id(&self) -> u32 {
        self.next_id
    }

    /// Returns the first of these ids that a group already has, and the line of the group.
    pub fn taken(&self, ids: &Range<u32>) -> Option<(u32, usize)> {
        let before = self.ids.range(..=ids.start).next_back();
        let holds_first = before.filter(|(_, (end, _))| *end > ids.start);
        let next = || self.ids.range(ids.clone()).next();
        let (first, (_, group)) = holds_first.or_else(next)?;
        Some(((*first).max(ids.start), self.groups[*group].line))
    }

    /// Returns the id of a robot by its number.
    pub fn id(&self, robot: usize) -> u32 {
        let number = robot as u32;
        let after = self.groups.partition_point(|group| group.robots.start <= number);
        let group = self.groups[..after].last();
        let group = group.expect("selections have only numbers of known robots");
        group.first_id + (number - group.robots.start)
    }

    /// Returns the line of the group with that name.
    pub fn line_of(&self, name: &str) -> Option<usize> {
        self.named(name).map(|group| group.line)
    }

    fn named(&self, name: &str) -> Option<&Known> {
        Some(&self.groups[*self.by_name.get(name)?])
    }

    /// Returns a name for an unnamed group: that of the robot, with a number if it is taken.
    pub fn unused_name(&mut self, robot: &str) -> String {
        let next = self.numbers.entry(robot.to_owned()).or_insert(1);
        loop {
            let name = match *next {
                1 => robot.to_owned(),
                number => format!("{robot}-{number}"),
            };
            *next += 1;
            if !self.by_name.contains_key(&name) {
                return name;
            }
        }
    }

    /// Adds a group, with the limits of its emulator if its robots run their firmware. `is_right`
    /// is false if its count or ids have a mistake.
    pub fn add(
        &mut self,
        name: String,
        (first_id, count): (u32, u32),
        is_right: bool,
        limits: Option<EmulatorLimits>,
        place: &Place,
    ) {
        self.is_unsure |= !is_right;
        let robots = self.count..self.count.saturating_add(count);
        self.count = robots.end;
        let ids = first_id..first_id.saturating_add(count);
        match self.taken(&ids) {
            Some(_) => self.is_unsure = true,
            None => drop(self.ids.insert(ids.start, (ids.end, self.groups.len()))),
        }
        match self.by_limits.iter_mut().find(|(known, _)| *known == limits) {
            Some((_, of_kind)) => of_kind.push(robots.clone()),
            None => self.by_limits.push((limits, vec![robots.clone()])),
        }
        self.next_id = self.next_id.max(ids.end);
        self.by_name.entry(name.clone()).or_insert(self.groups.len());
        self.groups.push(Known { name, first_id, robots, line: place.line });
    }

    /// Returns true if one of these robots is emulated.
    pub fn is_emulated(&self, robots: &Selection) -> bool {
        self.any_of(robots, |limits| limits.is_some())
    }

    /// Returns true if all of these robots can be switched off and on, which not every emulator
    /// supports.
    pub fn have_switches(&self, robots: &Selection) -> bool {
        !self.any_of(robots, |limits| limits.is_some_and(|emulated| !emulated.has_switch))
    }

    /// Returns true if events can move all of these robots.
    pub fn can_be_moved(&self, robots: &Selection) -> bool {
        !self.any_of(robots, |limits| limits.is_some_and(|emulated| !emulated.can_be_moved))
    }

    /// Returns true if a quantity can be read from all of these robots.
    pub fn all_provide(&self, quantity: &Quantity, robots: &Selection) -> bool {
        !self.any_of(robots, |limits| !provide(limits, quantity))
    }

    /// Returns true if there are robots, and a quantity can be read from none of them.
    pub fn none_provides(&self, quantity: &Quantity) -> bool {
        !self.groups.is_empty()
            && !self.by_limits.iter().any(|(limits, _)| provide(*limits, quantity))
    }

    /// Returns true if one of these robots has limits of a kind.
    fn any_of(
        &self,
        robots: &Selection,
        is_wanted: impl Fn(Option<EmulatorLimits>) -> bool,
    ) -> bool {
        let mut kinds = self.by_limits.iter().filter(|(limits, _)| is_wanted(*limits));
        kinds.any(|(_, own)| {
            robots.ranges().any(|some| {
                let next = own.partition_point(|range| range.end <= some.start);
                own.get(next).is_some_and(|range| range.start < some.end)
            })
        })
    }

    /// Returns true if any robot is emulated.
    pub fn any_is_emulated(&self) -> bool {
        self.by_limits.iter().any(|(limits, _)| limits.is_some())
    }

    /// Describes the groups for messages, as "`workers` with ids 0 to 19". If there are more than
    /// [`DESCRIBED_MAX`] groups, only the first are described.
    fn described(&self) -> Vec<String> {
        let describe = |group: &Known| {
            let ids = group.ids();
            format!("`{}` with ids {} to {}", group.name, ids.start, ids.end.saturating_sub(1))
        };
        let mut described: Vec<String> =
            self.groups.iter().take(DESCRIBED_MAX).map(describe).collect();
        if let Some(more) = self.groups.len().checked_sub(DESCRIBED_MAX + 1) {
            described.push(format!("{} more groups", more + 1));
        }
        described
    }

    /// Returns the robots that a key selects; all robots if the key is absent.
    pub fn selection(&self, section: &Section<'_>, key: &str) -> Option<Selection> {
        match section.get(key) {
            Some(entry) => self.select(&entry),
            None => Some(Selection::all(self.count)),
        }
    }

    pub fn select(&self, entry: &Entry<'_>) -> Option<Selection> {
        let mut ranges = Vec::new();
        match entry.value {
            DeValue::Array(_) => {
                let items = entry.list()?;
                if items.is_empty() {
                    let expected = "a list of one robot or more";
                    entry.fail(TomlError::Length { key: entry.key.clone(), expected, found: 0 });
                    return None;
                }
                for item in items {
                    self.add_item(&item, &mut ranges)?;
                }
            }
            _ => self.add_item(entry, &mut ranges)?,
        }
        Some(Selection::from_ranges(ranges))
    }

    /// Returns the robots that a key selects in the words of the file, groups before ids: `workers`,
    /// or `robots 0, 3 to 7`. Returns `None` if these are all robots.
    pub fn words(&self, entry: &Entry<'_>) -> Option<String> {
        let items = match entry.value {
            DeValue::Array(_) => entry.list()?,
            _ => vec![entry.clone()],
        };
        let (mut groups, mut ids) = (Vec::new(), Vec::new());
        for item in &items {
            match item.value {
                DeValue::Integer(id) => {
                    ids.push(u32::from_str_radix(id.as_str(), id.radix()).ok()?.to_string());
                }
                DeValue::String(text) if text == "all" => return None,
                DeValue::String(text) if self.named(text).is_some() => {
                    groups.push(text.to_string())
                }
                DeValue::String(text) => {
                    let (first, last) = text.split_once("..")?;
                    let (first, last) = (first.trim(), last.trim());
                    ids.push(match first == last {
                        true => first.to_owned(),
                        false => format!("{first} to {last}"),
                    });
                }
                _ => return None,
            }
        }
        if let Some(first) = ids.first_mut() {
            let is_one = items.len() == groups.len() + 1 && !first.contains(' ');
            first.insert_str(0, if is_one { "robot " } else { "robots " });
        }
        groups.extend(ids);
        let more = groups.len().saturating_sub(WORDS_MAX);
        groups.truncate(WORDS_MAX);
        let mut text = groups.join(", ");
        if more > 0 {
            text.push_str(&format!(" and {more} more"));
        }
        Some(text)
    }

    fn add_item(&self, item: &Entry<'_>, ranges: &mut Vec<Range<u32>>) -> Option<()> {
        match item.value {
            DeValue::Integer(_) => {
                let id = item.integer(0..=0xffff)?;
                self.add_ids(item, &(id..id + 1), &id.to_string(), ranges)
            }
            DeValue::String(text) => self.add_text(item, text, ranges),
            _ => {
                item.wrong_type("robots: \"all\", a group, an id, \"3..7\" or a list of these");
                None
            }
        }
    }

    fn add_text(&self, item: &Entry<'_>, text: &str, ranges: &mut Vec<Range<u32>>) -> Option<()> {
        if text == "all" {
            ranges.push(0..self.count);
            return Some(());
        }
        if let Some(group) = self.named(text) {
            ranges.push(group.robots.clone());
            return Some(());
        }
        let ids = text.split_once("..").and_then(|(first, last)| {
            Some((first.trim().parse::<u16>().ok()?, last.trim().parse::<u16>().ok()?))
        });
        let Some((first, last)) = ids else {
            // Each cause lists all groups. The list is left out when the reader has enough errors
            // and shows no more.
            let listed = if item.reader.is_full() { &[] } else { self.groups.as_slice() };
            let groups = listed.iter().map(|group| group.name.clone()).collect();
            item.fail(ScenarioCause::UnknownRobots { text: text.to_owned(), groups });
            return None;
        };
        if last < first {
            item.fail(ScenarioCause::EmptyRange { text: text.to_owned() });
            return None;
        }
        self.add_ids(item, &(u32::from(first)..u32::from(last) + 1), text, ranges)
    }

    fn add_ids(
        &self,
        item: &Entry<'_>,
        ids: &Range<u32>,
        text: &str,
        ranges: &mut Vec<Range<u32>>,
    ) -> Option<()> {
        let before = self.ids.range(..ids.start).next_back();
        let groups = before.into_iter().chain(self.ids.range(ids.clone()));
        let groups = groups.map(|(_, (_, group))| &self.groups[*group]);
        let found: Vec<Range<u32>> = groups.filter_map(|group| group.with_ids(ids)).collect();
        let count: usize = found.iter().map(|range| range.len()).sum();
        if self.is_unsure {
            return None;
        }
        if count < ids.len() {
            let is_full = item.reader.is_full();
            let groups = if is_full { Vec::new() } else { self.described() };
            item.fail(ScenarioCause::UnknownId { id: text.to_owned(), groups });
            return None;
        }
        ranges.extend(found);
        Some(())
    }
}
