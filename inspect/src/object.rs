//! Tables and closures, each with an identity.

use std::collections::BTreeMap;

use crate::value::{Named, ObjectId, ScriptValue};

/// The expanded objects by their identity.
pub type Objects = BTreeMap<ObjectId, Object>;

/// The contents of a table or closure.
#[derive(Debug, Clone, PartialEq)]
pub enum Object {
    /// A table.
    Table {
        /// Keys and values, in the order in which scripts iterate over them.
        entries: Vec<(ScriptValue, ScriptValue)>,
        /// The number of further entries, which the limits exclude.
        left_out: usize,
    },
    /// A function with captured values.
    Closure {
        /// The name of the function.
        function: String,
        /// The value of `self`, or nil.
        self_value: ScriptValue,
        /// The captured values.
        captures: Vec<Named>,
    },
    /// A function that was read from a table, which becomes its `self`.
    Bound {
        function: ScriptValue,
        /// The table.
        self_value: ScriptValue,
    },
}

/// The limits of the expansion. Values refer to objects outside the limits only by their identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// The greatest number of steps from a root, such as a global or a local, to an object: 0
    /// expands no object, 1 expands those that roots refer to.
    pub depth: usize,
    /// The greatest number of entries and captured values of all objects together. The nearest
    /// objects are expanded first.
    pub values: usize,
}

impl Limits {
    /// No limits.
    pub const NONE: Limits = Limits { depth: usize::MAX, values: usize::MAX };
}
