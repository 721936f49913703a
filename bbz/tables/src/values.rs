//! The values of a column in a piece of a table.

use crate::read_error::{TEXT_BYTES_MAX, TableReadError};

/// The most rows of a piece.
pub(crate) const PIECE: usize = 1 << 14;

/// The form in which a column is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// Numbers. Texts that are numbers are read as such.
    Numbers,
    /// Texts. Numbers have as many digits as they need.
    Texts,
}

/// The values of a column in a piece.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers. NaN stands for a missing value.
    Numbers(Vec<f64>),
    /// Texts, or nothing.
    Texts(Vec<Option<String>>),
}

impl Values {
    pub(crate) fn new(wanted: Wanted) -> Self {
        match wanted {
            Wanted::Numbers => Values::Numbers(Vec::new()),
            Wanted::Texts => Values::Texts(Vec::new()),
        }
    }

    /// Returns the number of rows.
    #[expect(clippy::len_without_is_empty, reason = "a piece has rows")]
    pub fn len(&self) -> usize {
        match self {
            Values::Numbers(values) => values.len(),
            Values::Texts(values) => values.len(),
        }
    }

    pub(crate) fn clear(&mut self) {
        match self {
            Values::Numbers(values) => values.clear(),
            Values::Texts(values) => values.clear(),
        }
    }

    /// Adds a text. `column` names the column in the error.
    pub(crate) fn push_text(
        &mut self,
        text: Option<&str>,
        column: &str,
    ) -> Result<(), TableReadError> {
        match self {
            Values::Numbers(values) => values.push(match text {
                None => f64::NAN,
                Some(text) => text.trim().parse().map_err(|_| TableReadError::Text {
                    column: column.to_owned(),
                    text: text.to_owned(),
                })?,
            }),
            Values::Texts(values) => match text.map(str::len) {
                Some(bytes) if bytes > TEXT_BYTES_MAX => {
                    return Err(TableReadError::LongText { column: column.to_owned(), bytes });
                }
                _ => values.push(text.map(str::to_owned)),
            },
        }
        Ok(())
    }

    /// Adds a number.
    pub(crate) fn push_number(&mut self, number: Option<f64>) {
        match self {
            Values::Numbers(values) => values.push(number.unwrap_or(f64::NAN)),
            Values::Texts(values) => values.push(number.map(|number| number.to_string())),
        }
    }
}
