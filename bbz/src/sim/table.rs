//! The table of a batch, for people and for programs.

use bittybuzz_arena::output::{RunRow, RunTable, quartiles};
use serde_json::{Map, Value, json};

/// Describes the runs of a variant: the number that succeeded, and the median and quartiles of each metric that varies.
pub fn describe(metrics: &[String], rows: &[&RunRow], settings: &[String], text: &mut String) {
    let runs = rows.len();
    let column =
        |index: usize| -> Vec<f64> { rows.iter().filter_map(|row| row.metrics[index]).collect() };
    let succeeded: f64 = column(0).iter().sum();
    let name = if settings.is_empty() { "as in the file".to_owned() } else { settings.join(" ") };
    *text += &format!("{name}: {succeeded} of {runs} runs succeeded\n");
    for (index, metric) in metrics.iter().enumerate().skip(1) {
        let numbers = column(index);
        let Some([least, lower, median, upper, most]) = quartiles(&numbers) else {
            *text += &format!("  {metric:<24} never\n");
            continue;
        };
        let count = match numbers.len() {
            all if all == runs => String::new(),
            some => format!(", in {some} runs"),
        };
        *text += &if least == most {
            format!("  {metric:<24} {}{count}\n", round(median))
        } else {
            format!(
                "  {metric:<24} median {}, quartiles {} and {}, from {} to {}{count}\n",
                round(median),
                round(lower),
                round(upper),
                round(least),
                round(most)
            )
        };
    }
}

/// Rounds a number to three decimals, or to an integer from 1000 on: enough to compare.
fn round(number: f64) -> f64 {
    if number.abs() >= 1000.0 { number.round() } else { (number * 1000.0).round() / 1000.0 }
}

/// Returns the table as a JSON object.
pub fn json(table: &RunTable) -> Value {
    let rows: Vec<Value> = table
        .rows
        .iter()
        .map(|row| {
            let parameters = table.parameters.iter().cloned().zip(row.parameters.iter());
            let metrics = table.metrics.iter().cloned().zip(row.metrics.iter());
            json!({
                "seed": row.seed,
                "parameters": parameters.map(|(key, value)| (key, json!(value))).collect::<Map<_, _>>(),
                "error": row.error,
                "metrics": metrics.map(|(key, value)| (key, json!(value))).collect::<Map<_, _>>(),
            })
        })
        .collect();
    json!({ "runs": rows })
}
