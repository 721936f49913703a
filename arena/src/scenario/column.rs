//! Names of columns in the table of runs.

use std::collections::{BTreeMap, btree_map};

use super::error::ScenarioCause;
use super::read::Section;
use super::value::is_identifier;

/// The columns that every table of runs has, as CSV or as a table of `--data`. Neither a measure nor a parameter has such a name.
pub const OWN_COLUMNS: [&str; 29] = [
    "run",
    "seed",
    "ticks",
    "robots",
    "digest",
    "success",
    "failed",
    "sent",
    "received",
    "lost",
    "collided",
    "deaf",
    "unsent",
    "unread",
    "foreign",
    "malformed",
    "own_id",
    "not_kept",
    "incomplete",
    "undecided",
    "unwanted",
    "contacts",
    "crashes",
    "first_crash",
    "faults",
    "restarts",
    "handler_faults",
    "overruns",
    "error",
];

/// The names of the sections of one kind, which become columns.
pub struct ColumnNames {
    /// The kind with its article: "an expectation".
    of: &'static str,
    /// The line of each name.
    lines: BTreeMap<String, usize>,
}

impl ColumnNames {
    /// Returns no names yet.
    pub fn new(of: &'static str) -> Self {
        ColumnNames { of, lines: BTreeMap::new() }
    }

    /// Returns the name of a section, if it has one. A name that another section has is a mistake.
    pub fn read(&mut self, section: &Section<'_>) -> Option<String> {
        let of = self.of;
        let entry = section.get("name")?;
        let name = entry.string()?.to_owned();
        if !is_identifier(&name) {
            entry.fail(ScenarioCause::BadColumnName { of, name });
            return None;
        }
        match self.lines.entry(name.clone()) {
            btree_map::Entry::Occupied(line) => {
                let (name, line) = (name.clone(), *line.get());
                entry.fail(ScenarioCause::DuplicateColumn { of, name, line });
            }
            btree_map::Entry::Vacant(free) => {
                free.insert(entry.place().line);
            }
        }
        Some(name)
    }
}
