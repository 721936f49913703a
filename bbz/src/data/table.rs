//! Rows of a table in memory, and the files to which they go.

use std::path::{Path, PathBuf};

use bittybuzz_tables::{Block, Cells, Column, Form, Kind, Schema, TableError, TableWriter};

use crate::file_error::FileError;
use crate::whole_file;

/// A value of a row.
#[derive(Debug, Clone)]
pub enum Cell {
    Integer(i32),
    OptionalInteger(Option<i32>),
    OptionalNumber(Option<f64>),
    OptionalText(Option<String>),
}

/// A table of a run, whose rows wait to be written.
pub struct RunData {
    /// The name of the folder of the table's files.
    pub name: &'static str,
    schema: Schema,
    cells: Vec<Cells>,
    /// The next file, if it has rows.
    file: Option<PartFile>,
    /// The number of files that were written.
    parts: usize,
}

impl RunData {
    /// Returns a table without rows.
    pub fn new(name: &'static str, columns: Vec<Column>) -> Self {
        let schema = Schema::new(columns).expect("the columns of a table have different names");
        let cells = schema.columns().iter().map(|column| Cells::of(column.kind)).collect();
        RunData { name, schema, cells, file: None, parts: 0 }
    }

    /// Returns the number of rows that wait.
    pub fn rows(&self) -> usize {
        self.cells.first().map_or(0, Cells::len)
    }

    /// Adds a row.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) {
        for (cells, cell) in self.cells.iter_mut().zip(row) {
            match (cells, cell) {
                (Cells::Integers(values), Cell::Integer(value)) => values.push(value),
                (Cells::OptionalIntegers(values), Cell::OptionalInteger(value)) => {
                    values.push(value);
                }
                (Cells::OptionalNumbers(values), Cell::OptionalNumber(value)) => values.push(value),
                (Cells::OptionalTexts(values), Cell::OptionalText(value)) => values.push(value),
                (cells, cell) => unreachable!("{cell:?} in a column of {cells:?}"),
            }
        }
    }

    /// Returns the cells of all columns, for rows that are added column by column. The caller adds the same
    /// number of cells to each.
    pub fn cells(&mut self) -> &mut [Cells] {
        &mut self.cells
    }

    /// Sorts the rows that wait by a column of integers. Rows with the same number stay in their
    /// order.
    pub fn sort_by(&mut self, column: usize) {
        let Some(Cells::Integers(keys)) = self.cells.get(column) else { return };
        let order = order(keys);
        for cells in &mut self.cells {
            match cells {
                Cells::Integers(values) => put_in_order(values, &order),
                Cells::OptionalIntegers(values) => put_in_order(values, &order),
                Cells::OptionalNumbers(values) => put_in_order(values, &order),
                Cells::OptionalTexts(values) => put_in_order(values, &order),
            }
        }
    }

    /// Discards the rows that wait.
    pub fn forget(&mut self) {
        self.take();
    }

    /// Returns the rows that wait, of which none is left.
    fn take(&mut self) -> Block {
        let columns = self.schema.columns().iter();
        let empty = columns.map(|column| Cells::of(column.kind)).collect();
        let cells = std::mem::replace(&mut self.cells, empty);
        Block::new(&self.schema, cells).expect("each row has a cell in each column")
    }

    /// Compresses the rows that wait into the next file, in memory.
    pub fn compress(&mut self) {
        if self.rows() > 0 {
            let mut file = self.file.take().unwrap_or_else(|| PartFile::begin(self));
            file.add(self);
            self.file = Some(file);
        }
    }

    /// Writes all rows to the next file of the table's folder. Does nothing if there are none, unless
    /// `is_last` is true and no file has been written: readers find the columns then.
    pub fn write_part(&mut self, data: &Path, is_last: bool) -> Result<(), FileError> {
        self.compress();
        let is_needed = is_last && self.parts == 0;
        let file = self.file.take().or_else(|| is_needed.then(|| PartFile::begin(self)));
        let Some(file) = file else { return Ok(()) };
        file.write(data, self.parts)?;
        self.parts += 1;
        Ok(())
    }

    /// Begins a CSV file of this table.
    pub fn begin_csv<W: std::io::Write + Send>(
        &self,
        output: W,
    ) -> Result<TableWriter<W>, TableError> {
        TableWriter::new(output, Form::Csv, &self.schema)
    }

    /// Writes the rows that wait to a CSV file of this table.
    pub fn write_csv<W: std::io::Write + Send>(
        &mut self,
        file: &mut TableWriter<W>,
    ) -> Result<(), TableError> {
        file.write(&self.take())
    }
}

/// A file of Parquet in memory, with the rows of one run after the other.
pub struct PartFile {
    /// The name of the folder of the table's files.
    name: &'static str,
    file: TableWriter<Vec<u8>>,
}

/// The reason why a file in memory takes all rows.
const IN_MEMORY: &str = "memory takes all bytes, and a table has blocks of its own columns";

impl PartFile {
    /// Begins a file for a table.
    pub fn begin(table: &RunData) -> Self {
        let file = TableWriter::new(Vec::new(), Form::Parquet, &table.schema).expect(IN_MEMORY);
        PartFile { name: table.name, file }
    }

    /// Takes the rows that wait, of a table with the same columns.
    pub fn add(&mut self, table: &mut RunData) {
        self.file.write(&table.take()).expect(IN_MEMORY);
    }

    /// Writes the file with that number to the folder of the table.
    pub fn write(self, data: &Path, number: usize) -> Result<(), FileError> {
        let bytes = self.file.finish().expect(IN_MEMORY);
        let folder = data.join(self.name);
        std::fs::create_dir_all(&folder).map_err(|error| FileError::writing(&folder, error))?;
        // Clears away the temporary file of a process that was killed while it wrote this part.
        whole_file::write(&part_path(&folder, number), &bytes)
    }
}

/// Returns the path of a file in the folder of a table.
pub fn part_path(folder: &Path, number: usize) -> PathBuf {
    folder.join(format!("{number:05}.parquet"))
}

/// Returns the rows by their keys; rows with the same key stay in their order.
fn order(keys: &[i32]) -> Vec<usize> {
    let range = keys.iter().min().zip(keys.iter().max());
    let Some((least, most)) = range.map(|(least, most)| (i64::from(*least), i64::from(*most)))
    else {
        return Vec::new();
    };
    let place = |key: i32| (i64::from(key) - least) as usize;
    // Robots have small ids, which need no comparisons: each key has the place after those of smaller ones.
    if (most - least) as usize <= keys.len() {
        let mut next = vec![0; (most - least) as usize + 2];
        keys.iter().for_each(|key| next[place(*key) + 1] += 1);
        (1..next.len()).for_each(|key| next[key] += next[key - 1]);
        let mut order = vec![0; keys.len()];
        for (row, key) in keys.iter().enumerate() {
            order[next[place(*key)]] = row;
            next[place(*key)] += 1;
        }
        return order;
    }
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_by_key(|row| keys[*row]);
    order
}

/// Puts values into an order that names each row once.
fn put_in_order<T: Default>(values: &mut Vec<T>, order: &[usize]) {
    let sorted = order.iter().map(|row| std::mem::take(&mut values[*row]));
    *values = sorted.collect();
}

/// Returns a column that has a value in each row.
pub fn integer(name: &str) -> Column {
    Column::new(name, Kind::Integer)
}

/// Returns a column of integers that may be missing.
pub fn optional_integer(name: impl Into<String>) -> Column {
    Column::new(name, Kind::OptionalInteger)
}

/// Returns a column of texts.
pub fn text(name: &str) -> Column {
    Column::new(name, Kind::OptionalText)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_with_the_same_key_stay_in_their_order() {
        let crowd: Vec<i32> = (0..1000).map(|row| (row * 37) % 13 - 6).collect();
        for keys in
            [vec![], vec![7], vec![i32::MAX, i32::MIN, 0, i32::MIN], vec![2, 0, 2, 1, 0], crowd]
        {
            let mut expected: Vec<usize> = (0..keys.len()).collect();
            expected.sort_by_key(|row| (keys[*row], *row));
            assert_eq!(order(&keys), expected, "{keys:?}");
        }
    }
}
