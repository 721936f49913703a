//! Many runs: every combination of the values of `--set`, with every seed.

use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use bittybuzz_arena::output::{Row, Table, metrics, quartiles};
use bittybuzz_arena::run::{self, Setup, Summary};
use bittybuzz_arena::scenario::Scenario;
use serde_json::{Map, Value, json};

use crate::Ending;
use crate::output;
use crate::problem::Problem;
use crate::report;
use crate::whole_file;

use super::open;
use super::progress::Progress;
use super::{Arguments, MOST_RUNS, summary};

/// Returns the combinations of the values of `--set`, each a list of `KEY=VALUE`. With `runs` of each there are at most
/// [`MOST_RUNS`].
pub fn variants(set: &[String], runs: u32) -> Result<Vec<Vec<String>>, Problem> {
    let mut variants = vec![Vec::new()];
    for argument in set {
        let Some((key, values)) =
            argument.split_once('=').filter(|(key, _)| !key.trim().is_empty())
        else {
            return Err(Problem::Setting(argument.clone()));
        };
        let values = split(values);
        let count = variants.len().saturating_mul(values.len());
        if count.saturating_mul(runs as usize) > MOST_RUNS as usize {
            return Err(Problem::TooManyRuns { runs, variants: count });
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

/// The parts between commas that are in no brackets, braces or quotes.
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

/// Runs every variant with every seed, and tells what is usual.
pub fn run(arguments: &Arguments, variants: &[Vec<String>]) -> Result<Ending, Problem> {
    let mut opened = Vec::new();
    for set in variants {
        let Some(variant) = open::open(arguments, set)? else {
            return Ok(Ending::CompileError);
        };
        opened.push(variant);
    }
    let setups: Option<Vec<(Arc<Setup>, u32)>> = opened
        .iter()
        .map(|variant| {
            // A variant may set the seed.
            let seed = arguments.seed.unwrap_or(variant.scenario.world.seed);
            Some((Arc::new(variant.setup()?), seed))
        })
        .collect();
    let Some(setups) = setups else { return Ok(Ending::CompileError) };
    let Some(first) = opened.first() else { return Ok(Ending::Success) };
    if let Some(path) = &arguments.csv {
        opened.iter().try_for_each(|variant| variant.inputs().refuse(path))?;
    }
    let runs = arguments.runs.unwrap_or(1);
    let total = setups.len() as u64 * u64::from(runs);
    let progress = Mutex::new(Progress::new(total, arguments.headless || arguments.json));
    let done = AtomicU64::new(0);
    let result = run::batch(&setups, runs, || {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Ok(mut progress) = progress.lock() {
            progress.set(done, |_| format!("{done} of {total} runs"));
        }
    });
    if let Ok(progress) = progress.into_inner() {
        progress.finish();
    }
    let summaries = match result {
        Ok(summaries) => summaries,
        Err(run::BatchError::Scenario(error)) => {
            open::print(&[error]);
            return Ok(Ending::CompileError);
        }
        Err(run::BatchError::Firmware { seed, error }) => {
            report::mistake(&format!("the run with seed {seed} has ended: {error}"), None, None);
            return Ok(Ending::RuntimeError);
        }
    };
    let is_success = summaries.iter().flatten().all(Summary::is_success);
    let table = table(&first.scenario, variants, &summaries);
    if let Some(path) = &arguments.csv {
        whole_file::write(path, table.to_csv().as_bytes())?;
    }
    let mut text = String::new();
    if arguments.json {
        text = json(&table).to_string() + "\n";
    } else {
        for (variant, settings) in variants.iter().enumerate() {
            let of_variant = summaries.get(variant).into_iter().flatten();
            let with_fault = of_variant.into_iter().find(|summary| !summary.faults.is_empty());
            if let (Some(run), Some(opened), Some((setup, _))) =
                (with_fault, opened.get(variant), setups.get(variant))
            {
                summary::faults(setup, &opened.programs, run);
            }
            describe(&table, variant, settings, runs as usize, &mut text);
        }
    }
    output::write(&text)?;
    Ok(if is_success { Ending::Success } else { Ending::RuntimeError })
}

/// `medium.ir.loss=0.1` to its key and value.
fn parts(setting: &str) -> (String, String) {
    let (key, value) = setting.split_once('=').unwrap_or((setting, ""));
    (key.to_owned(), value.to_owned())
}

fn table(scenario: &Scenario, variants: &[Vec<String>], summaries: &[Vec<Summary>]) -> Table {
    let keys = variants.first().into_iter().flatten().map(|setting| parts(setting).0).collect();
    let mut table = Table { parameters: keys, metrics: metrics::names(scenario), rows: Vec::new() };
    for (variant, runs) in variants.iter().zip(summaries) {
        let parameters: Vec<String> = variant.iter().map(|setting| parts(setting).1).collect();
        table.rows.extend(runs.iter().map(|summary| Row {
            seed: summary.seed,
            parameters: parameters.clone(),
            metrics: metrics::values(scenario, summary),
        }));
    }
    table
}

/// What is usual among the runs of a variant: how many succeeded, and of each metric that is not always the same median
/// and quartiles.
fn describe(table: &Table, variant: usize, settings: &[String], runs: usize, text: &mut String) {
    let rows = &table.rows[variant * runs..(variant + 1) * runs];
    let column = |index: usize| -> Vec<f64> {
        rows.iter().filter_map(|row| *row.metrics.get(index)?).collect()
    };
    let succeeded: f64 = column(0).iter().sum();
    let name = if settings.is_empty() { "as in the file".to_owned() } else { settings.join(" ") };
    let _ = writeln!(text, "{name}: {succeeded} of {runs} runs succeeded");
    for (index, metric) in table.metrics.iter().enumerate().skip(1) {
        let numbers = column(index);
        let Some([least, lower, median, upper, most]) = quartiles(&numbers) else {
            let _ = writeln!(text, "  {metric:<24} never");
            continue;
        };
        let count = match numbers.len() {
            all if all == runs => String::new(),
            some => format!(", in {some} runs"),
        };
        let _ = if least == most {
            writeln!(text, "  {metric:<24} {}{count}", round(median))
        } else {
            writeln!(
                text,
                "  {metric:<24} median {}, quartiles {} and {}, from {} to {}{count}",
                round(median),
                round(lower),
                round(upper),
                round(least),
                round(most)
            )
        };
    }
}

/// Four digits are enough to compare.
fn round(number: f64) -> f64 {
    if number.abs() >= 1000.0 { number.round() } else { (number * 1000.0).round() / 1000.0 }
}

fn json(table: &Table) -> Value {
    let rows: Vec<Value> = table
        .rows
        .iter()
        .map(|row| {
            let parameters = table.parameters.iter().cloned().zip(row.parameters.iter());
            let metrics = table.metrics.iter().cloned().zip(row.metrics.iter());
            json!({
                "seed": row.seed,
                "parameters": parameters.map(|(key, value)| (key, json!(value))).collect::<Map<_, _>>(),
                "metrics": metrics.map(|(key, value)| (key, json!(value))).collect::<Map<_, _>>(),
            })
        })
        .collect();
    json!({ "runs": rows })
}
