//! The files of a table, which are read one after the other.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use bittybuzz_live::Defect;
use bittybuzz_tables::{Form, TableReadError, TableReader, Values, Wanted};
use bittybuzz_toml_reader::file;

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::whole_file::Inputs;

use super::problem::{PlotError, ROWS_MAX};

/// The files of a table.
pub struct TableFiles {
    /// The folder or file, as messages name it.
    pub path: PathBuf,
    form: Form,
    files: Vec<PathBuf>,
    /// The names of the columns of the first file.
    columns: Vec<String>,
}

impl TableFiles {
    /// Finds the table of that name in a folder of `--data`; `None` if there is none.
    pub fn find(data: &Path, name: &str) -> Result<Option<Self>, Box<dyn Problem>> {
        let path = data.join(name);
        if !path.is_dir() {
            return Ok(None);
        }
        let files = parquet_files(&path).map_err(|error| FileError::reading(&path, error))?;
        let Some(first) = files.first() else { return Err(PlotError::Unfinished(path).into()) };
        let columns = open(first, Form::Parquet)?.columns().to_vec();
        Ok(Some(TableFiles { path, form: Form::Parquet, files, columns }))
    }

    /// Returns the table of a CSV file.
    pub fn csv(path: &Path) -> Result<Self, Box<dyn Problem>> {
        let columns = open(path, Form::Csv)?.columns().to_vec();
        let path = path.to_owned();
        Ok(TableFiles { files: vec![path.clone()], path, form: Form::Csv, columns })
    }

    /// Returns the names of the columns.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Returns true if the table has a column of that name.
    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|known| known == column)
    }

    /// Adds the files to those that the command reads.
    pub fn add_to(&self, inputs: &mut Inputs) {
        self.files.iter().for_each(|file| inputs.add(file));
    }

    /// Reads columns, each by its name. `take` receives the values of each column, some thousand rows
    /// at a time.
    pub fn read(
        &self,
        wanted: &[(&str, Wanted)],
        mut take: impl FnMut(&[Values]) -> Result<(), PlotError>,
    ) -> Result<(), Box<dyn Problem>> {
        let mut rows = 0;
        for path in &self.files {
            let table = open(path, self.form)?;
            let place = |(name, wanted): &(&str, Wanted)| {
                let place = table.columns().iter().position(|column| column == name);
                place.map(|place| (place, *wanted)).ok_or_else(|| PlotError::OtherColumns {
                    path: path.clone(),
                    column: (*name).to_owned(),
                })
            };
            let places = wanted.iter().map(place).collect::<Result<_, _>>()?;
            let mut pieces = table.select(places);
            while let Some(piece) = whole(path, || pieces.next_piece())? {
                rows += piece.first().map_or(0, Values::len);
                if rows > ROWS_MAX {
                    return Err(PlotError::ManyRows(self.path.clone()).into());
                }
                take(piece)?;
            }
        }
        Ok(())
    }
}

/// Returns the complete files of a table. A file that is being written has another name.
pub fn parquet_files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|end| end == "parquet") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn open(path: &Path, form: Form) -> Result<TableReader, Box<dyn Problem>> {
    let file = file::open(path).map_err(|error| FileError::reading(path, error))?;
    Ok(whole(path, || TableReader::open(file, form))?)
}

/// Reads a part of a file. The library for Parquet panics at some damaged files, which is no defect of
/// this program.
fn whole<T>(path: &Path, read: impl FnOnce() -> Result<T, TableReadError>) -> Result<T, PlotError> {
    match Defect::catch(read) {
        Ok(result) => result.map_err(|error| PlotError::Table { path: path.to_owned(), error }),
        Err(_) => Err(PlotError::Damaged(path.to_owned())),
    }
}
