//! The columns of a table.

use std::collections::BTreeSet;

/// The values that a column can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// 32-bit integers; each row has one.
    Integer,
    /// 32-bit integers, or nothing.
    OptionalInteger,
    /// Floating-point numbers of 64 bits, or nothing.
    OptionalNumber,
    /// Texts, or nothing.
    OptionalText,
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// The name, which ends in the unit of integers that have one, such as `x_tenths_mm`.
    pub name: String,
    pub kind: Kind,
}

impl Column {
    /// Returns a column.
    pub fn new(name: impl Into<String>, kind: Kind) -> Self {
        Column { name: name.into(), kind }
    }
}

/// A reason why columns make no table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SchemaError {
    /// A file without columns has no rows.
    #[error("a table needs a column")]
    Empty,
    /// Readers find a column by its name.
    #[error("two columns have the name `{0}`")]
    SameName(String),
    /// Some readers take a column without a name for a row index.
    #[error("column {0} has no name")]
    NoName(usize),
}

/// The columns of a table, which have different names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schema {
    columns: Vec<Column>,
}

impl Schema {
    /// Returns a table's columns.
    pub fn new(columns: Vec<Column>) -> Result<Self, SchemaError> {
        if columns.is_empty() {
            return Err(SchemaError::Empty);
        }
        let mut names = BTreeSet::new();
        for (number, column) in columns.iter().enumerate() {
            if column.name.is_empty() {
                return Err(SchemaError::NoName(number));
            }
            if !names.insert(&column.name) {
                return Err(SchemaError::SameName(column.name.clone()));
            }
        }
        Ok(Schema { columns })
    }

    /// Returns the columns, in the order of the file.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }
}
