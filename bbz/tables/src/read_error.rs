//! Reasons why a table cannot be read.

use std::io;

use ::parquet::errors::ParquetError;

/// A reason why a table cannot be read, without the name of its file.
#[derive(Debug, thiserror::Error)]
pub enum TableReadError {
    /// The file cannot be read.
    #[error(transparent)]
    Input(#[from] io::Error),
    /// The file is no whole file of Parquet.
    #[error("it is not a whole Parquet file: {0}")]
    Parquet(ParquetError),
    /// A column is compressed by a method that this program does not have.
    #[error("column `{column}` is compressed by {method}")]
    Compression { column: String, method: String },
    /// A column has lists, dates or other values that are neither numbers nor texts.
    #[error("column `{0}` has neither numbers nor texts")]
    Column(String),
    /// The columns have different numbers of rows.
    #[error("its columns have different lengths")]
    Lengths,
    /// A text where a number is needed.
    #[error("column `{column}` has the text `{}`", .text.chars().take(TEXT_MAX).collect::<String>())]
    Text { column: String, text: String },
    /// A text that may be repeated in many rows of a small file.
    #[error("column `{column}` has a text of {bytes} bytes, more than {TEXT_BYTES_MAX}")]
    LongText { column: String, bytes: usize },
    /// A file of CSV without a line of names.
    #[error("it has no line of names")]
    Empty,
    /// A line of CSV has more or fewer cells than the line of names.
    #[error("line {line} has {cells} cells, and the line of names {expected}")]
    Cells { line: u64, cells: u64, expected: u64 },
    /// The last line of CSV has no end, as while a program still writes it.
    #[error("it ends in the middle of a line")]
    Cut,
    /// A line of CSV is no text.
    #[error("line {line} is not a text in UTF-8")]
    NotText { line: u64 },
}

/// The most bytes of a text.
pub(crate) const TEXT_BYTES_MAX: usize = 1 << 12;

/// The most characters of a text in a message.
const TEXT_MAX: usize = 40;

impl From<ParquetError> for TableReadError {
    /// An error of the input passes through the library, which wraps it.
    fn from(error: ParquetError) -> Self {
        match error {
            ParquetError::External(cause) => match cause.downcast::<io::Error>() {
                Ok(error) => TableReadError::Input(*error),
                Err(cause) => TableReadError::Parquet(ParquetError::External(cause)),
            },
            other => TableReadError::Parquet(other),
        }
    }
}
