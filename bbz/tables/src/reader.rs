//! A table that is read piece by piece, from some of its columns.

use std::fs::File;

use crate::csv_reader::CsvTable;
use crate::parquet_reader::ParquetTable;
use crate::read_error::TableReadError;
use crate::values::{Values, Wanted};
use crate::writer::Form;

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
