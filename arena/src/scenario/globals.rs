//! `globals` of a group of robots: numbers with which their scripts begin.

use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_toml_reader::Place;

use crate::robot::ScriptNumber;

use super::error::ScenarioCause;
use super::event::script_number;
use super::read::Section;

/// A number that a global of a script has after the global code, before `init`, at each start of
/// the script.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialGlobal {
    /// The name of the global.
    pub name: String,
    /// The number. An integer becomes a float if the global code assigns a float.
    pub number: ScriptNumber,
    /// The place of the number in the file.
    pub place: Place,
}

/// Reads the globals of a group, in the order of the file. Robots whose profile is unknown because
/// of another mistake get those that fit the larger numbers.
pub fn read(section: &Section<'_>, profile: Option<NumberProfile>) -> Vec<InitialGlobal> {
    let entries = section.free_table("globals");
    // The firmware itself may have a mistake, too.
    let backend = section.get("backend");
    let is_emulated = section.get("image").is_some()
        || backend.is_some_and(|entry| entry.value.as_str() == Some("firmware"));
    if let Some(first) = entries.first().filter(|_| is_emulated) {
        first.fail(ScenarioCause::NotEmulated { key: "globals" });
        return Vec::new();
    }
    let is_tiny = profile == Some(NumberProfile::Tiny);
    let globals = entries.iter().filter_map(|entry| {
        let number = script_number(entry, is_tiny)?;
        Some(InitialGlobal { name: entry.key.clone(), number, place: entry.place() })
    });
    globals.collect()
}
