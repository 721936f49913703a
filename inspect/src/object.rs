//! Tables and closures, each with an identity.

use std::collections::BTreeMap;

use crate::value::{Named, ScriptValue};

/// The identity of a table or closure: equal ids are the same object as long as the script can reach it. When it cannot any
/// more, another object may get its id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub u16);

/// The objects that were expanded.
pub type Objects = BTreeMap<ObjectId, Object>;

/// The contents of a table or closure.
#[derive(Debug, Clone, PartialEq)]
pub enum Object {
    /// A table.
    Table {
        /// Keys and values, in the order in which scripts iterate over them.
        entries: Vec<(ScriptValue, ScriptValue)>,
        /// Entries after these, which the limits left out.
        left_out: usize,
    },
    /// A function with captured values.
    Closure {
        /// Its function.
        function: String,
        /// Its `self`, or nil.
        self_value: ScriptValue,
        /// Captured values.
        captures: Vec<Named>,
    },
    /// A function that was read from a table.
    Bound {
        /// The function.
        function: ScriptValue,
        /// The table, its `self`.
        self_value: ScriptValue,
    },
}

/// Limits of the objects that are expanded. A value still names the others by their identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Steps from a global, a local or another root to an object: with 0 no object is expanded, with 1 those that roots
    /// refer to.
    pub depth: usize,
    /// Entries and captured values of all objects together. The nearest objects are expanded first.
    pub values: usize,
}

impl Limits {
    /// Nothing is left out.
    pub const NONE: Limits = Limits { depth: usize::MAX, values: usize::MAX };
}
