//! The files of `--data`: tables of a run, for programs that evaluate it.
//!
//! docs/data.md describes the tables. Rows wait in memory and are written at least once a minute, each
//! time to a file of its own, so that a run that is killed loses no more than the last minute. They are
//! compressed before that, a group at a time.

mod table;

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bittybuzz_tables::{TableError, TableWriter};

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::whole_file::Inputs;

pub use table::{Cell, PartFile, RunData, integer, optional_integer, part_path, text};

/// The longest time for which rows wait.
const WAIT_MAX: Duration = Duration::from_secs(60);

/// The rows that wait before they are compressed, about 6 MB. The next ones take their memory, which saves the
/// time of new memory: 0.06 of 0.38 s for 600,000 rows (2026-11-30).
const GROUP_ROWS: usize = 1 << 17;

/// The compressed rows that wait before they are written, about 4 MB.
const FILE_ROWS: usize = 1 << 20;

/// The column of the robots' ids in the table of robots, by which it is sorted.
const ROBOT: usize = 2;

/// A destination that cannot take the tables.
#[derive(Debug, thiserror::Error)]
enum DataError {
    /// A folder with tables of another run would mix with these.
    #[error("`{0}` holds files already")]
    NotEmpty(PathBuf),
    /// A single file would be readable only after the end of the run.
    #[error("`{0}` would be a single file of Parquet")]
    SingleParquet(PathBuf),
    /// The runs of a batch end in any order.
    #[error("`{0}` would be a single file for several runs")]
    CsvOfMany(PathBuf),
    #[error("cannot write `{path}`: {error}")]
    Csv { path: PathBuf, error: TableError },
}

impl Problem for DataError {
    fn help(&self) -> Option<String> {
        Some(match self {
            DataError::NotEmpty(_) => "name another folder, or remove them".to_owned(),
            DataError::CsvOfMany(path) => {
                format!("name a folder, such as `{}`", path.with_extension("").display())
            }
            DataError::SingleParquet(path) => {
                let folder = path.with_extension("");
                format!(
                    "name a folder, such as `{}`, or a file that ends in .csv",
                    folder.display()
                )
            }
            DataError::Csv { .. } => return None,
        })
    }
}

/// The files of tables.
pub struct DataFiles {
    destination: Destination,
    /// The rows that are compressed and wait.
    compressed: usize,
    /// The time at which rows were last written.
    written: Instant,
}

enum Destination {
    /// A folder for all tables, with a folder for each.
    Folder(PathBuf),
    /// A file for the robots.
    Csv { path: PathBuf, file: TableWriter<BufWriter<File>> },
}

impl DataFiles {
    /// Creates the folder, or the file of the robots, which must not be an input.
    pub fn create(
        path: &Path,
        robots: &RunData,
        inputs: &Inputs,
    ) -> Result<Self, Box<dyn Problem>> {
        let destination = match path.extension().and_then(OsStr::to_str) {
            Some("csv") => {
                inputs.refuse(path)?;
                let file = File::create(path).map_err(|error| FileError::writing(path, error))?;
                let file = robots.begin_csv(BufWriter::new(file));
                let file = file.map_err(|error| csv_error(path, error))?;
                Destination::Csv { path: path.to_owned(), file }
            }
            Some("parquet") => return Err(DataError::SingleParquet(path.to_owned()).into()),
            _ => Destination::Folder(empty_folder(path)?),
        };
        Ok(DataFiles { destination, compressed: 0, written: Instant::now() })
    }

    /// Returns true if there are files for other tables than that of robots.
    pub fn has_all_tables(&self) -> bool {
        matches!(self.destination, Destination::Folder(_))
    }

    /// Returns true if the rows that wait are many, or wait for long: [`Self::take`] should take them.
    pub fn is_due(&self, rows: usize) -> bool {
        rows >= GROUP_ROWS || self.written.elapsed() >= WAIT_MAX
    }

    /// Compresses the rows that wait, and writes all compressed rows if they are many or wait for long. The
    /// last call writes all rows, and tables that never had any, so that readers find their columns.
    pub fn take<'a>(
        &mut self,
        robots: &'a mut RunData,
        others: impl Iterator<Item = &'a mut RunData>,
        is_last: bool,
    ) -> Result<(), Box<dyn Problem>> {
        sort_robots(robots);
        match &mut self.destination {
            Destination::Folder(folder) => {
                let tables: Vec<&mut RunData> = [robots].into_iter().chain(others).collect();
                self.compressed += tables.iter().map(|table| table.rows()).sum::<usize>();
                let is_waiting = self.written.elapsed() < WAIT_MAX;
                if self.compressed < FILE_ROWS && is_waiting && !is_last {
                    tables.into_iter().for_each(RunData::compress);
                    return Ok(());
                }
                for table in tables {
                    table.write_part(folder, is_last)?;
                }
                self.compressed = 0;
            }
            Destination::Csv { path, file } => {
                let written = robots.write_csv(file).and_then(|()| file.flush());
                written.map_err(|error| csv_error(path, error))?;
                others.for_each(RunData::forget);
            }
        }
        self.written = Instant::now();
        Ok(())
    }
}

/// Sorts the rows of robots that wait: neighboring rows then differ least.
pub fn sort_robots(robots: &mut RunData) {
    robots.sort_by(ROBOT);
}

fn csv_error(path: &Path, error: TableError) -> DataError {
    DataError::Csv { path: path.to_owned(), error }
}

/// Creates the folder for the tables of a batch. A batch that goes on has files there already.
pub fn batch_folder(path: &Path, goes_on: bool) -> Result<PathBuf, Box<dyn Problem>> {
    match path.extension().and_then(OsStr::to_str) {
        Some("csv") => return Err(DataError::CsvOfMany(path.to_owned()).into()),
        Some("parquet") => return Err(DataError::SingleParquet(path.to_owned()).into()),
        _ => {}
    }
    if !goes_on {
        return empty_folder(path);
    }
    fs::create_dir_all(path).map_err(|error| FileError::writing(path, error))?;
    Ok(path.to_owned())
}

/// Creates a folder, or takes one that is empty.
fn empty_folder(path: &Path) -> Result<PathBuf, Box<dyn Problem>> {
    let unwritable = |error: io::Error| FileError::writing(path, error);
    fs::create_dir_all(path).map_err(unwritable)?;
    if fs::read_dir(path).map_err(unwritable)?.next().is_some() {
        return Err(DataError::NotEmpty(path.to_owned()).into());
    }
    Ok(path.to_owned())
}

/// Converts a count to a cell. Counts are smaller than 2^31 in any run that ends within a lifetime.
pub fn count(value: u64) -> i32 {
    i32::try_from(value).unwrap_or(i32::MAX)
}
