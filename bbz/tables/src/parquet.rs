//! Parquet. Each block is a row group, compressed by Snappy. Integers are stored as differences.

use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{ColumnPath, Type};

use crate::block::{Block, Cells};
use crate::schema::{Column, Kind, Schema};

/// The name of the whole row in the file, which readers do not show.
const ROW: &str = "row";

/// The program that files name as their writer. Its version is left out, so that the same rows give
/// the same bytes.
const WRITER: &str = "bittybuzz";

/// A file that is being written.
pub struct ParquetFile<W: Write + Send>(SerializedFileWriter<W>);

impl<W: Write + Send> ParquetFile<W> {
    /// Begins a file.
    pub fn new(output: W, schema: &Schema) -> Result<Self, ParquetError> {
        let fields = schema.columns().iter().map(|column| Ok(Arc::new(field(column)?)));
        let fields = fields.collect::<Result<Vec<_>, ParquetError>>()?;
        let row = Type::group_type_builder(ROW).with_fields(fields).build()?;
        let properties = Arc::new(properties(schema));
        SerializedFileWriter::new(output, Arc::new(row), properties).map(ParquetFile)
    }

    /// Writes a row group.
    pub fn write(&mut self, block: &Block) -> Result<(), ParquetError> {
        let mut group = self.0.next_row_group()?;
        for cells in block.cells() {
            let mut column = group.next_column()?.expect("a block has the columns of the schema");
            match cells {
                Cells::Integers(values) => {
                    column.typed::<Int32Type>().write_batch(values, None, None)?;
                }
                Cells::OptionalIntegers(values) => {
                    write::<Int32Type, _>(&mut column, values, |value| *value)?;
                }
                Cells::OptionalNumbers(values) => {
                    write::<DoubleType, _>(&mut column, values, |value| *value)?;
                }
                Cells::OptionalTexts(values) => {
                    // Neighboring rows often have one text, such as `running`, which is copied once.
                    let mut last: Option<(&str, ByteArray)> = None;
                    write::<ByteArrayType, _>(&mut column, values, |text| match &last {
                        Some((same, bytes)) if same == text => bytes.clone(),
                        _ => last.insert((text, ByteArray::from(text.as_str()))).1.clone(),
                    })?;
                }
            }
            column.close()?;
        }
        group.close().map(|_| ())
    }

    /// Writes the end of the file, by which readers find all else. Returns the output.
    pub fn finish(self) -> Result<W, ParquetError> {
        self.0.into_inner()
    }
}

/// Writes the values that are not missing, and for each row its level: 1 if it has a value.
fn write<'a, T: DataType, V>(
    column: &mut SerializedColumnWriter<'_>,
    cells: &'a [Option<V>],
    value: impl FnMut(&'a V) -> T::T,
) -> Result<(), ParquetError> {
    let levels: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    let values: Vec<T::T> = cells.iter().flatten().map(value).collect();
    column.typed::<T>().write_batch(&values, Some(&levels), None).map(|_| ())
}

fn field(column: &Column) -> Result<Type, ParquetError> {
    let (physical, logical) = match column.kind {
        Kind::Integer | Kind::OptionalInteger => (Physical::INT32, None),
        Kind::OptionalNumber => (Physical::DOUBLE, None),
        Kind::OptionalText => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let repetition = match column.kind {
        Kind::Integer => Repetition::REQUIRED,
        _ => Repetition::OPTIONAL,
    };
    Type::primitive_type_builder(&column.name, physical)
        .with_repetition(repetition)
        .with_logical_type(logical)
        .build()
}

fn properties(schema: &Schema) -> WriterProperties {
    let mut properties = WriterProperties::builder()
        .set_created_by(WRITER.to_owned())
        .set_compression(Compression::SNAPPY)
        // The range of each page is as long as a short page itself.
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true);
    for column in schema.columns() {
        if matches!(column.kind, Kind::Integer | Kind::OptionalInteger) {
            let path = ColumnPath::new(vec![column.name.clone()]);
            properties = properties
                .set_column_dictionary_enabled(path.clone(), false)
                .set_column_encoding(path, Encoding::DELTA_BINARY_PACKED);
        }
    }
    properties.build()
}
