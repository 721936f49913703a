//! Rows of a table, column by column.

use crate::schema::{Kind, Schema};

/// The values of a column in some rows.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// Values of [`Kind::Integer`].
    Integers(Vec<i32>),
    /// Values of [`Kind::OptionalInteger`].
    OptionalIntegers(Vec<Option<i32>>),
    /// Values of [`Kind::OptionalNumber`].
    OptionalNumbers(Vec<Option<f64>>),
    /// Values of [`Kind::OptionalText`].
    OptionalTexts(Vec<Option<String>>),
}

impl Cells {
    /// Returns no values for a column.
    pub fn of(kind: Kind) -> Self {
        match kind {
            Kind::Integer => Cells::Integers(Vec::new()),
            Kind::OptionalInteger => Cells::OptionalIntegers(Vec::new()),
            Kind::OptionalNumber => Cells::OptionalNumbers(Vec::new()),
            Kind::OptionalText => Cells::OptionalTexts(Vec::new()),
        }
    }

    /// Returns the number of values.
    pub fn len(&self) -> usize {
        match self {
            Cells::Integers(values) => values.len(),
            Cells::OptionalIntegers(values) => values.len(),
            Cells::OptionalNumbers(values) => values.len(),
            Cells::OptionalTexts(values) => values.len(),
        }
    }

    /// Returns true if there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn kind(&self) -> Kind {
        match self {
            Cells::Integers(_) => Kind::Integer,
            Cells::OptionalIntegers(_) => Kind::OptionalInteger,
            Cells::OptionalNumbers(_) => Kind::OptionalNumber,
            Cells::OptionalTexts(_) => Kind::OptionalText,
        }
    }
}

/// A reason why values are no rows of a table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BlockError {
    /// The table has another number of columns.
    #[error("the rows have {given} columns, the table {expected}")]
    Columns { given: usize, expected: usize },
    /// A column has values of another kind.
    #[error("column `{name}` has values of another kind")]
    Kind { name: String },
    /// The columns have different numbers of values.
    #[error("column `{name}` has {given} values, the first column {expected}")]
    Length { name: String, given: usize, expected: usize },
}

/// Rows that fit a table. All columns have the same number of values.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    cells: Vec<Cells>,
}

impl Block {
    /// Returns rows with these values, one entry for each column.
    pub fn new(schema: &Schema, cells: Vec<Cells>) -> Result<Self, BlockError> {
        let columns = schema.columns();
        if cells.len() != columns.len() {
            return Err(BlockError::Columns { given: cells.len(), expected: columns.len() });
        }
        let expected = cells.first().map_or(0, Cells::len);
        for (column, values) in columns.iter().zip(&cells) {
            let name = || column.name.clone();
            if values.kind() != column.kind {
                return Err(BlockError::Kind { name: name() });
            }
            if values.len() != expected {
                return Err(BlockError::Length { name: name(), given: values.len(), expected });
            }
        }
        Ok(Block { cells })
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.cells.first().map_or(0, Cells::len)
    }

    /// Returns the values of each column.
    pub(crate) fn cells(&self) -> &[Cells] {
        &self.cells
    }
}
