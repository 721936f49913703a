//! Files of rows.
//!
//! A file has a line for its head, a line for each row, and a last line with the SHA-256 of all bytes
//! before it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::plan::{Experiment, hash};
use crate::row::Row;

/// A reason why a file gives no rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum FileFault {
    /// Its bytes are not those that were written.
    #[error("its checksum is wrong")]
    Damaged,
    /// Its bytes are those that were written, by a program that writes other files.
    #[error("another version of bbz has written it")]
    Foreign,
}

/// The first line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Head {
    pub experiment: Experiment,
    /// SHA-256 of the files that the runs have read, by their paths from the scenario's folder.
    pub files: BTreeMap<String, String>,
}

/// The word before the checksum.
const SUM: &str = "sha256 ";

/// Returns the bytes of a file.
pub(crate) fn to_bytes<'a>(head: &Head, rows: impl IntoIterator<Item = &'a Row>) -> Vec<u8> {
    let mut text = serde_json::to_string(head).expect("strings are valid JSON") + "\n";
    for row in rows {
        text += &row.to_line();
        text.push('\n');
    }
    let sum = hash(text.as_bytes());
    text += &format!("{SUM}{sum}\n");
    text.into_bytes()
}

/// Reads a file.
pub(crate) fn parse(bytes: &[u8]) -> Result<(Head, Vec<Row>), FileFault> {
    let text = str::from_utf8(bytes).map_err(|_| FileFault::Damaged)?;
    let (content, sum) = text.rsplit_once(SUM).ok_or(FileFault::Damaged)?;
    if sum.strip_suffix('\n') != Some(&hash(content.as_bytes())) {
        return Err(FileFault::Damaged);
    }
    let mut lines = content.lines();
    let head = lines.next().and_then(|line| serde_json::from_str::<Head>(line).ok());
    let head = head.ok_or(FileFault::Foreign)?;
    let count = head.experiment.metrics.len();
    let rows = lines.map(|line| Row::parse(line, count).ok_or(FileFault::Foreign));
    Ok((head, rows.collect::<Result<_, FileFault>>()?))
}
