//! Reads CSV (RFC 4180), with a line of names first.

use std::fs::File;
use std::io::{self, Read};

use csv::{ErrorKind, Reader, ReaderBuilder, StringRecord};

use crate::read_error::TableReadError;
use crate::values::{PIECE, Values, Wanted};

/// A file that remembers its last byte.
struct Source {
    file: File,
    last: Option<u8>,
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.last = buffer[..count].last().copied().or(self.last);
        Ok(count)
    }
}

/// A table of CSV.
pub struct CsvTable {
    reader: Reader<Source>,
    columns: Vec<String>,
}

impl CsvTable {
    pub fn open(file: File) -> Result<Self, TableReadError> {
        let mut reader = ReaderBuilder::new().from_reader(Source { file, last: None });
        let names = reader.headers();
        let columns: Vec<String> = match names {
            Ok(names) => names.iter().map(str::to_owned).collect(),
            Err(error) => return Err(cause(error, &mut reader)),
        };
        if columns.is_empty() {
            Err(TableReadError::Empty)
        } else {
            Ok(CsvTable { reader, columns })
        }
    }

    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Replaces the piece by the next one, which has no rows at the end of the table.
    pub fn read(
        &mut self,
        wanted: &[(usize, Wanted)],
        piece: &mut [Values],
    ) -> Result<(), TableReadError> {
        let mut record = StringRecord::new();
        for _ in 0..PIECE {
            match self.reader.read_record(&mut record) {
                Ok(true) => {}
                // A number that lost its last digits would look like another number.
                Ok(false) if is_cut(&self.reader) => return Err(TableReadError::Cut),
                Ok(false) => break,
                Err(error) => return Err(cause(error, &mut self.reader)),
            }
            for ((column, _), values) in wanted.iter().zip(&mut *piece) {
                let text = record.get(*column).filter(|text| !text.is_empty());
                values.push_text(text, &self.columns[*column])?;
            }
        }
        Ok(())
    }
}

/// Returns true if the bytes that were read end within a line.
fn is_cut(reader: &Reader<Source>) -> bool {
    reader.get_ref().last.is_some_and(|last| last != b'\n')
}

fn cause(error: csv::Error, reader: &mut Reader<Source>) -> TableReadError {
    let line = error.position().map_or(0, csv::Position::line);
    match error.into_kind() {
        ErrorKind::Io(error) => TableReadError::Input(error),
        ErrorKind::UnequalLengths { len, expected_len, .. } => {
            let is_last = matches!(reader.read_record(&mut StringRecord::new()), Ok(false));
            if is_last && is_cut(reader) {
                return TableReadError::Cut;
            }
            TableReadError::Cells { line, cells: len, expected: expected_len }
        }
        // The reader serializes nothing and seeks nowhere, so that texts are the only other errors.
        _ => TableReadError::NotText { line },
    }
}
