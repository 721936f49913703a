//! Reads recorded vectors, and compares results with them column by column.
//!
//! `flight/tests/vectors/README.md` describes the files. The environment variable
//! `BITTYBUZZ_FLIGHT_VECTORS` names another folder with files of the same names.

// Each test binary has its own copy of this module and uses a part of it.

use std::fmt;
use std::path::{Path, PathBuf};

use bittybuzz_flight::{Quat, Vec3};

/// The variable that names another folder of vectors.
const FOLDER_VARIABLE: &str = "BITTYBUZZ_FLIGHT_VECTORS";

/// A place in a file of vectors that cannot be read, and the reason.
#[derive(Debug)]
pub struct VectorsError {
    pub path: PathBuf,
    /// Line from 1; 0 if the whole file is meant.
    pub line: usize,
    pub reason: String,
}

impl fmt::Display for VectorsError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}: {}", self.path.display(), self.line, self.reason)
    }
}

impl std::error::Error for VectorsError {}

/// The cases of one file.
#[derive(Debug)]
pub struct Vectors {
    path: PathBuf,
    columns: Vec<String>,
    /// Each row with the number of its line.
    rows: Vec<(usize, Vec<f64>)>,
}

impl Vectors {
    /// Reads `NAME.csv` from the folder of vectors.
    pub fn read(name: &str) -> Result<Self, VectorsError> {
        let folder = match std::env::var_os(FOLDER_VARIABLE) {
            Some(folder) => PathBuf::from(folder),
            None => Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join("vectors"),
        };
        Self::read_file(&folder.join(name).with_extension("csv"))
    }

    /// Reads one file.
    pub fn read_file(path: &Path) -> Result<Self, VectorsError> {
        let text = std::fs::read_to_string(path).map_err(|error| VectorsError {
            path: path.into(),
            line: 0,
            reason: error.to_string(),
        })?;
        Self::parse(path, &text)
    }

    /// Reads the text of a file; `path` only serves for messages.
    pub fn parse(path: &Path, text: &str) -> Result<Self, VectorsError> {
        let fail = |line: usize, reason: String| VectorsError { path: path.into(), line, reason };
        let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.starts_with('#'));
        let Some((number, header)) = lines.next() else {
            return Err(fail(0, "no line names the columns".into()));
        };
        let columns: Vec<String> = header.split(',').map(|column| column.trim().into()).collect();
        if columns.iter().any(|column| column.parse::<f64>().is_ok()) {
            return Err(fail(number, "numbers in place of names of columns".into()));
        }
        let mut rows = Vec::new();
        for (number, line) in lines {
            let row = line
                .split(',')
                .map(|field| match field.trim().parse::<f64>() {
                    Ok(value) if value.is_finite() => Ok(value),
                    _ => Err(fail(number, format!("`{field}` is not a finite number"))),
                })
                .collect::<Result<Vec<f64>, _>>()?;
            if row.len() != columns.len() {
                let reason = format!("{} fields, but {} columns", row.len(), columns.len());
                return Err(fail(number, reason));
            }
            rows.push((number, row));
        }
        if rows.is_empty() {
            return Err(fail(0, "no case".into()));
        }
        Ok(Vectors { path: path.into(), columns, rows })
    }

    /// Returns the names of the columns.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Returns the cases in the order of the file.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = VectorRow<'_>> {
        self.rows.iter().map(|(line, values)| VectorRow { vectors: self, line: *line, values })
    }
}

/// One case. A method panics with the file and the line if the file lacks a column.
#[derive(Clone, Copy)]
pub struct VectorRow<'a> {
    vectors: &'a Vectors,
    line: usize,
    values: &'a [f64],
}

impl VectorRow<'_> {
    /// Returns the value in a column.
    #[track_caller]
    pub fn f64(&self, column: &str) -> f64 {
        match self.vectors.columns.iter().position(|name| name == column) {
            Some(index) => self.values[index],
            None => panic!("{self}: no column `{column}`"),
        }
    }

    /// Returns the value in a column; the text gives the recorded `f32` exactly.
    #[track_caller]
    pub fn f32(&self, column: &str) -> f32 {
        self.f64(column) as f32
    }

    /// Returns true if the column holds 1, false if it holds 0.
    #[track_caller]
    pub fn bool(&self, column: &str) -> bool {
        match self.f64(column) {
            0.0 => false,
            1.0 => true,
            value => panic!("{self}: `{column}` is {value}, neither 0 nor 1"),
        }
    }

    /// Returns the columns `PREFIX_x`, `PREFIX_y` and `PREFIX_z`, or with a suffix
    /// `PREFIX_x_SUFFIX` and so on. An empty prefix or suffix takes its underscore with it.
    #[track_caller]
    pub fn vec3(&self, prefix: &str, suffix: &str) -> Vec3 {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.f32(&joined(prefix, axis, suffix)));
        Vec3::new(x, y, z)
    }

    /// Returns the quaternion in `qw`, `qx`, `qy` and `qz`, each with `_SUFFIX`, as it was recorded.
    #[track_caller]
    pub fn quat(&self, suffix: &str) -> Quat {
        let [x, y, z, w] = ["qx", "qy", "qz", "qw"].map(|part| self.f32(&joined("", part, suffix)));
        Quat::from_xyzw(x, y, z, w)
    }

    /// Returns the symmetric matrix in `p00_SUFFIX` to `p88_SUFFIX`.
    #[track_caller]
    pub fn covariance(&self, suffix: &str) -> [[f32; 9]; 9] {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let element = format!("p{}{}", i.min(j), i.max(j));
                self.f32(&joined("", &element, suffix))
            })
        })
    }
}

impl fmt::Display for VectorRow<'_> {
    /// Writes the file and the line.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}", self.vectors.path.display(), self.line)
    }
}

/// Returns the parts with underscores between those that are not empty.
fn joined(prefix: &str, middle: &str, suffix: &str) -> String {
    let parts = [prefix, middle, suffix];
    parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("_")
}

/// The largest error of each output over many cases, relative to the range of that output.
#[derive(Default)]
pub struct ColumnErrors(Vec<ColumnError>);

struct ColumnError {
    column: String,
    largest: f64,
    /// The case with the largest error.
    place: String,
    least: f64,
    most: f64,
}

impl ColumnErrors {
    /// Compares a result with a column of the case. A result that is not finite is infinitely wrong.
    #[track_caller]
    pub fn compare(&mut self, row: &VectorRow<'_>, column: &str, result: f32) {
        self.add(row, column, f64::from(result), row.f64(column));
    }

    /// Compares a vector with the columns that [`VectorRow::vec3`] reads.
    #[track_caller]
    pub fn compare_vec3(&mut self, row: &VectorRow<'_>, prefix: &str, suffix: &str, result: Vec3) {
        for (axis, value) in ["x", "y", "z"].into_iter().zip(result.to_array()) {
            self.compare(row, &joined(prefix, axis, suffix), value);
        }
    }

    /// Compares a rotation with the columns that [`VectorRow::quat`] reads; q and -q are the same.
    #[track_caller]
    pub fn compare_quat(&mut self, row: &VectorRow<'_>, suffix: &str, result: Quat) {
        let result = if result.dot(row.quat(suffix)) < 0.0 { -result } else { result };
        for (part, value) in ["qx", "qy", "qz", "qw"].into_iter().zip(result.to_array()) {
            self.compare(row, &joined("", part, suffix), value);
        }
    }

    /// Adds one pair of values under a name.
    pub fn add(&mut self, place: impl fmt::Display, column: &str, result: f64, expected: f64) {
        let error = (result - expected).abs();
        let error = if error.is_nan() { f64::INFINITY } else { error };
        let index = match self.0.iter().position(|entry| entry.column == column) {
            Some(index) => index,
            None => {
                self.0.push(ColumnError {
                    column: column.into(),
                    largest: 0.0,
                    place: String::new(),
                    least: expected,
                    most: expected,
                });
                self.0.len() - 1
            }
        };
        let entry = &mut self.0[index];
        (entry.least, entry.most) = (entry.least.min(expected), entry.most.max(expected));
        if error > entry.largest {
            (entry.largest, entry.place) = (error, place.to_string());
        }
    }

    /// Returns each column with its largest error divided by the range of its expected values; by
    /// the largest of them, or by 1, if they are all alike.
    pub fn relative(&self) -> Vec<(&str, f64)> {
        self.0.iter().map(|entry| (entry.column.as_str(), entry.relative())).collect()
    }

    /// Panics with all columns whose relative error exceeds the limit, and if nothing was compared.
    /// Prints the largest errors under a title.
    #[track_caller]
    pub fn assert_below(&self, title: &str, limit: f64) {
        assert!(!self.0.is_empty(), "{title}: nothing was compared");
        let mut columns = self.relative();
        columns.sort_by(|a, b| b.1.total_cmp(&a.1));
        let worst: Vec<String> =
            columns.iter().take(6).map(|(column, error)| format!("{column} {error:.1e}")).collect();
        println!("{title}: {}", worst.join(", "));
        let failures: Vec<String> = self
            .0
            .iter()
            .filter(|entry| entry.relative() > limit)
            .map(|entry| format!("{}: {:.2e} at {}", entry.column, entry.relative(), entry.place))
            .collect();
        assert!(failures.is_empty(), "{title}: errors above {limit:.2e}:\n{}", failures.join("\n"));
    }
}

impl ColumnError {
    fn relative(&self) -> f64 {
        let range = self.most - self.least;
        let scale = if range > 0.0 { range } else { self.most.abs() };
        self.largest / if scale > 0.0 { scale } else { 1.0 }
    }
}
