//! The costs of scripts: measured, or committed in bench/baseline.json, in the same form.

use crate::error::BenchError;
use crate::target::BenchTarget;
use anyhow::Result;
use bittybuzz_builds::shell::root;
use fs_err as fs;
use serde::{Deserialize, Serialize};
use serde_json::Number;
use std::collections::BTreeMap;

const FILE: &str = "bench/baseline.json";

/// The largest increase of a cost that is allowed, in percent.
const TOLERANCE: u64 = 2;

/// The cost of a script on a target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Cycles or instructions of a step.
    pub count: u64,
    /// The value of the global `r`.
    pub result: Number,
}

/// Figures by the name of the script.
pub type Scripts = BTreeMap<String, Figure>;
/// Figures by the name of the target.
pub type Counts = BTreeMap<String, Scripts>;

/// Reads the committed costs.
pub fn load() -> Result<Counts> {
    let path = root().join(FILE);
    let bytes = fs::read(&path)?;
    serde_json::from_slice(&bytes)
        .map_err(|error| BenchError::Table { path: FILE.into(), reason: error.to_string() }.into())
}

/// Replaces the committed costs.
pub fn save(counts: Counts) -> Result<()> {
    let path = root().join(FILE);
    let text = format!("{}\n", to_json(&counts));
    Ok(fs::write(&path, text)?)
}

pub fn to_json(counts: &Counts) -> String {
    // Each script has a line of its own, so that a difference shows the script.
    let scripts = |scripts: &Scripts| {
        let lines = scripts.iter().map(|(name, Figure { count, result })| {
            format!("    {name:?}: {{ \"count\": {count}, \"result\": {result} }}")
        });
        lines.collect::<Vec<_>>().join(",\n")
    };
    let targets = counts
        .iter()
        .map(|(target, counts)| format!("  {target:?}: {{\n{}\n  }}", scripts(counts)));
    format!("{{\n{}\n}}", targets.collect::<Vec<_>>().join(",\n"))
}

/// Returns true if the cost has grown by more than is allowed.
pub fn is_more(now: u64, before: u64) -> bool {
    now * 100 > before * (100 + TOLERANCE)
}

/// Returns the costs that have grown beyond the tolerance.
pub fn grown(target: BenchTarget, now: &Scripts, before: Option<&Scripts>) -> Vec<String> {
    let rows = now.iter().filter_map(|(name, figure)| {
        let (now, before) = (figure.count, before?.get(name)?.count);
        is_more(now, before).then(|| format!("{name} on {} {before} -> {now}", target.name()))
    });
    rows.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scripts(rows: &[(&str, u64)]) -> Scripts {
        let figure = |count| Figure { count, result: 1.into() };
        rows.iter().map(|(name, count)| ((*name).to_owned(), figure(*count))).collect()
    }

    #[test]
    fn two_percent_are_allowed() {
        let before = scripts(&[("a", 1000), ("b", 1000), ("c", 1000)]);
        let now = scripts(&[("a", 1020), ("b", 1021), ("c", 500), ("new", 7)]);
        let grown = grown(BenchTarget::Avr, &now, Some(&before));
        assert_eq!(grown, ["b on avr 1000 -> 1021"]);
    }

    #[test]
    fn json_reads_back() {
        let mut counts = Counts::from([("avr".to_owned(), scripts(&[("a", 1), ("b", 2)]))]);
        let float = Figure { count: 3, result: Number::from_f64(2.0).unwrap() };
        counts.insert("host".to_owned(), Scripts::from([("float".to_owned(), float)]));
        let text = to_json(&counts);
        assert!(text.contains(r#""a": { "count": 1, "result": 1 },"#), "{text}");
        assert_eq!(serde_json::from_str::<Counts>(&text).unwrap(), counts);
    }
}
