//! Names of a script that are used from outside of it, by the events of a scenario.

use std::collections::BTreeSet;

/// The names of a script that something outside of it uses.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct OutsideUses {
    /// Functions that are called. They run before the next step after [`called_flag`] was set.
    pub called: BTreeSet<String>,
    /// Globals that are set to a number.
    pub assigned: BTreeSet<String>,
}

/// Returns the name of the global that makes the script call a function before its next step, when it
/// holds something other than nil and 0. No script can write this name.
pub fn called_flag(function: &str) -> String {
    format!("call {function}")
}
