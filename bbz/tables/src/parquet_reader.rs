//! Reads Parquet: of each row group only the columns that are wanted, some thousand rows at a time.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use bytes::Bytes;
use parquet::basic::{Compression, LogicalType, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, FileReader, Length, SerializedFileReader};
use parquet::schema::types::ColumnDescPtr;

use crate::read_error::TableReadError;
use crate::values::{PIECE, Values, Wanted};

/// A file that is asked for no more bytes than it has: the library reserves memory for all bytes
/// that a damaged file names.
struct BoundedFile {
    file: File,
    length: u64,
}

impl Length for BoundedFile {
    fn len(&self) -> u64 {
        self.length
    }
}

impl ChunkReader for BoundedFile {
    type T = BufReader<File>;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        let mut file = self.file.try_clone()?;
        file.seek(SeekFrom::Start(start))?;
        Ok(BufReader::new(file))
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        if start.checked_add(length as u64).is_none_or(|end| end > self.length) {
            return Err(ParquetError::EOF("it names bytes after its end".to_owned()));
        }
        let mut bytes = vec![0; length];
        let mut file = self.file.try_clone()?;
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut bytes)?;
        Ok(bytes.into())
    }
}

/// A table of Parquet.
pub struct ParquetTable {
    reader: SerializedFileReader<BoundedFile>,
    columns: Vec<String>,
    /// The number of the next row group.
    next: usize,
    /// The wanted columns of the current row group.
    group: Vec<Column>,
}

impl ParquetTable {
    pub fn open(file: File) -> Result<Self, TableReadError> {
        let length = file.metadata()?.len();
        let reader = SerializedFileReader::new(BoundedFile { file, length })?;
        let columns = reader.metadata().file_metadata().schema_descr().columns();
        let columns = columns.iter().map(|column| column.path().string()).collect();
        Ok(ParquetTable { reader, columns, next: 0, group: Vec::new() })
    }

    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Adds the next rows to a piece without any, except at the end of the table.
    pub fn read(
        &mut self,
        wanted: &[(usize, Wanted)],
        piece: &mut [Values],
    ) -> Result<(), TableReadError> {
        loop {
            for (column, values) in self.group.iter_mut().zip(&mut *piece) {
                column.read(values)?;
            }
            let rows = piece.first().map_or(0, Values::len);
            if piece.iter().any(|values| values.len() != rows) {
                return Err(TableReadError::Lengths);
            }
            if rows > 0 || self.next == self.reader.num_row_groups() {
                return Ok(());
            }
            self.begin_group(wanted)?;
        }
    }

    fn begin_group(&mut self, wanted: &[(usize, Wanted)]) -> Result<(), TableReadError> {
        let group = self.reader.get_row_group(self.next)?;
        self.group.clear();
        for (place, _) in wanted {
            let chunk = group.metadata().column(*place);
            let name = self.columns[*place].clone();
            if !matches!(chunk.compression(), Compression::UNCOMPRESSED | Compression::SNAPPY) {
                let method = chunk.compression().to_string();
                return Err(TableReadError::Compression { column: name, method });
            }
            let descriptor = chunk.column_descr_ptr();
            let reader = group.get_column_reader(*place)?;
            self.group.push(Column { reader, name, descriptor });
        }
        self.next += 1;
        Ok(())
    }
}

/// A column of a row group.
struct Column {
    reader: ColumnReader,
    name: String,
    descriptor: ColumnDescPtr,
}

impl Column {
    /// Adds the values of the next piece.
    fn read(&mut self, values: &mut Values) -> Result<(), TableReadError> {
        let other = || TableReadError::Column(self.name.clone());
        // Lists have more than one value in a row, groups more than one level.
        if self.descriptor.max_rep_level() > 0 || self.descriptor.max_def_level() > 1 {
            return Err(other());
        }
        let logical = self.descriptor.logical_type_ref();
        let is_number = matches!(logical, None | Some(LogicalType::Integer(_)));
        if !is_number && self.descriptor.physical_type() != Type::BYTE_ARRAY {
            return Err(other());
        }
        let is_unsigned = matches!(logical, Some(LogicalType::Integer(of)) if !of.is_signed);
        match &mut self.reader {
            ColumnReader::BoolColumnReader(reader) => {
                numbers(reader, values, |value| f64::from(u8::from(*value)))
            }
            ColumnReader::Int32ColumnReader(reader) => {
                numbers(reader, values, |value| match is_unsigned {
                    true => f64::from(value.cast_unsigned()),
                    false => f64::from(*value),
                })
            }
            ColumnReader::Int64ColumnReader(reader) => {
                numbers(reader, values, |value| match is_unsigned {
                    true => value.cast_unsigned() as f64,
                    false => *value as f64,
                })
            }
            ColumnReader::FloatColumnReader(reader) => {
                numbers(reader, values, |value| f64::from(*value))
            }
            ColumnReader::DoubleColumnReader(reader) => numbers(reader, values, |value| *value),
            ColumnReader::ByteArrayColumnReader(reader) => {
                let name = &self.name;
                next(reader, |text: Option<&ByteArray>| {
                    let text = text.map(|text| String::from_utf8_lossy(text.data()));
                    values.push_text(text.as_deref(), name)
                })
            }
            ColumnReader::Int96ColumnReader(_) | ColumnReader::FixedLenByteArrayColumnReader(_) => {
                Err(other())
            }
        }
    }
}

/// Adds the numbers of the next piece.
fn numbers<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    values: &mut Values,
    number: impl Fn(&T::T) -> f64,
) -> Result<(), TableReadError> {
    next(reader, |value| {
        values.push_number(value.map(&number));
        Ok(())
    })
}

/// Calls `add` for each row of the next piece.
fn next<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    mut add: impl FnMut(Option<&T::T>) -> Result<(), TableReadError>,
) -> Result<(), TableReadError> {
    let (mut levels, mut found) = (Vec::new(), Vec::new());
    let (rows, ..) = reader.read_records(PIECE, Some(&mut levels), None, &mut found)?;
    if levels.is_empty() {
        // Each row has a value.
        return found.iter().try_for_each(|value| add(Some(value)));
    }
    let mut found = found.iter();
    for level in levels.iter().take(rows) {
        match level {
            0 => add(None)?,
            _ => add(Some(found.next().ok_or(TableReadError::Lengths)?))?,
        }
    }
    Ok(())
}
