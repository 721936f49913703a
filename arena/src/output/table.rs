//! A table with a row for each of many runs, and its form as CSV.

use std::sync::Arc;

/// The results of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunRow {
    /// Seed of the run.
    pub seed: u32,
    /// The values of the parameters, in the order of [`RunTable::parameters`].
    pub parameters: Arc<[String]>,
    /// The metrics, in the order of [`RunTable::metrics`]; `None` where the run has none.
    pub metrics: Vec<Option<f64>>,
    /// The digest of the world at the end; `None` for a run without an end.
    pub digest: Option<u64>,
    /// The reason why the run has no metrics but `success`, which is 0 then.
    pub error: Option<String>,
}

/// The results of many runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunTable {
    /// Names of the parameters, in the form of `--set`.
    pub parameters: Vec<String>,
    /// Names of the metrics.
    pub metrics: Vec<String>,
    /// A row for each run.
    pub rows: Vec<RunRow>,
}

impl RunTable {
    /// Returns the table as CSV (RFC 4180), with a line of names first. Numbers have as many digits
    /// as they need. A metric or error that is missing is empty.
    pub fn to_csv(&self) -> String {
        let names = ["seed".to_owned()].into_iter().chain(self.parameters.iter().cloned());
        let last = ["digest", "error"].map(str::to_owned);
        let mut text = csv_line(names.chain(self.metrics.iter().cloned()).chain(last));
        for row in &self.rows {
            let metrics = row.metrics.iter();
            let metrics = metrics.map(|metric| metric.map_or(String::new(), |m| m.to_string()));
            let digest = row.digest.map_or(String::new(), |digest| format!("{digest:016x}"));
            let error = row.error.clone().unwrap_or_default();
            let cells = [row.seed.to_string()].into_iter().chain(row.parameters.iter().cloned());
            text.push_str(&csv_line(cells.chain(metrics).chain([digest, error])));
        }
        text
    }
}

/// Returns a line of CSV (RFC 4180) with these cells.
pub fn csv_line(cells: impl Iterator<Item = String>) -> String {
    let quoted = cells.map(|cell| match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell,
    });
    let mut line = quoted.collect::<Vec<String>>().join(",");
    line.push_str("\r\n");
    line
}
