//! A table that is read piece by piece, from some of its columns.

use std::fs::File;
use std::io;

use ::parquet::errors::ParquetError;

use crate::csv_reader::CsvTable;
use crate::parquet_reader::ParquetTable;
use crate::writer::Form;

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
const TEXT_BYTES_MAX: usize = 1 << 12;

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

/// A table that is read from a file.
pub struct TableReader(Input);

enum Input {
    Parquet(Box<ParquetTable>),
    Csv(Box<CsvTable>),
}

impl TableReader {
    /// Reads the names of the columns. A file of Parquet may come from any program, and is compressed by Snappy
    /// or not at all.
    ///
    /// # Panics
    /// The library for Parquet panics at some damaged files, here and when it reads rows: the caller stops
    /// the panic.
    pub fn open(file: File, form: Form) -> Result<Self, TableReadError> {
        Ok(TableReader(match form {
            Form::Parquet => Input::Parquet(Box::new(ParquetTable::open(file)?)),
            Form::Csv => Input::Csv(Box::new(CsvTable::open(file)?)),
        }))
    }

    /// Returns the names of the columns, in the order of the file.
    pub fn columns(&self) -> &[String] {
        match &self.0 {
            Input::Parquet(table) => table.columns(),
            Input::Csv(table) => table.columns(),
        }
    }

    /// Begins to read some columns, given by their places, and no other.
    pub fn select(self, wanted: Vec<(usize, Wanted)>) -> Pieces {
        let piece = wanted.iter().map(|(_, wanted)| Values::new(*wanted)).collect();
        Pieces { input: self.0, wanted, piece }
    }
}

/// The rows of some columns, some thousand at a time.
pub struct Pieces {
    input: Input,
    wanted: Vec<(usize, Wanted)>,
    piece: Vec<Values>,
}

impl Pieces {
    /// Reads the next rows: the values of each wanted column, in the order of [`TableReader::select`]. Returns
    /// `None` at the end of the table.
    ///
    /// # Panics
    /// As [`TableReader::open`] does, and if the table has no column at a wanted place.
    pub fn next_piece(&mut self) -> Result<Option<&[Values]>, TableReadError> {
        self.piece.iter_mut().for_each(Values::clear);
        match &mut self.input {
            Input::Parquet(table) => table.read(&self.wanted, &mut self.piece)?,
            Input::Csv(table) => table.read(&self.wanted, &mut self.piece)?,
        }
        let has_rows = self.piece.first().is_some_and(|values| values.len() > 0);
        Ok(has_rows.then_some(&self.piece))
    }
}
