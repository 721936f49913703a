//! The combinations of the values of `--set`.

use crate::problem::Problem;

/// The most runs of one command. Their results, some kilobytes each, are kept until the last run
/// ends.
pub const RUNS_MAX: u32 = 100_000;

/// A reason why the values of `--set` give no runs.
#[derive(Debug, thiserror::Error)]
pub enum VariantsError {
    /// A `--set` that is not `KEY=VALUE`.
    #[error("`--set {0}` gives no value")]
    Setting(String),
    /// There are more than [`RUNS_MAX`] runs.
    #[error("{runs} runs of {variants} combinations of values are too many")]
    TooManyRuns {
        /// Runs of each combination of values.
        runs: u32,
        /// Combinations of values, at most the largest `usize`.
        variants: usize,
    },
}

impl Problem for VariantsError {
    fn help(&self) -> Option<String> {
        Some(match self {
            VariantsError::Setting(_) => "write it as `--set medium.ir.loss=0.1`".to_owned(),
            VariantsError::TooManyRuns { .. } => {
                format!("all runs together can be {RUNS_MAX}; use `bbz sim` several times")
            }
        })
    }
}

/// Returns the combinations of the values of `--set`, each a list of `KEY=VALUE`. Fails if they
/// have more than [`RUNS_MAX`] runs together.
pub fn variants(set: &[String], runs: u32) -> Result<Vec<Vec<String>>, VariantsError> {
    let mut variants = vec![Vec::new()];
    for argument in set {
        let Some((key, values)) =
            argument.split_once('=').filter(|(key, _)| !key.trim().is_empty())
        else {
            return Err(VariantsError::Setting(argument.clone()));
        };
        let values = split(values);
        let count = variants.len().saturating_mul(values.len());
        if count.saturating_mul(runs as usize) > RUNS_MAX as usize {
            return Err(VariantsError::TooManyRuns { runs, variants: count });
        }
        variants = variants
            .iter()
            .flat_map(|variant: &Vec<String>| {
                values.iter().map(move |value| {
                    let mut longer = variant.clone();
                    longer.push(format!("{}={value}", key.trim()));
                    longer
                })
            })
            .collect();
    }
    Ok(variants)
}

/// Splits at commas that are outside brackets, braces and quotes.
fn split(values: &str) -> Vec<&str> {
    let (mut parts, mut start, mut depth, mut quote) = (Vec::new(), 0, 0, None);
    for (at, c) in values.char_indices() {
        match (c, quote) {
            (_, Some(open)) if c == open => quote = None,
            (_, Some(_)) => {}
            ('"' | '\'', None) => quote = Some(c),
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth -= 1,
            (',', None) if depth == 0 => {
                parts.push(&values[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&values[start..]);
    parts.into_iter().map(str::trim).collect()
}

/// Splits a setting of a variant, such as `medium.ir.loss=0.1`, into its key and value.
pub fn parts(setting: &str) -> (String, String) {
    let (key, value) = setting.split_once('=').expect("`variants` returns only `KEY=VALUE`");
    (key.to_owned(), value.to_owned())
}
