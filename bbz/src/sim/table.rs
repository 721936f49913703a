//! The table of a batch, for people and for programs.

use bittybuzz_arena::output::metrics::{Metric, MetricKind};
use bittybuzz_arena::output::{RunRow, RunTable};
use bittybuzz_arena::statistics::{EventTime, kaplan_meier, quartiles};
use serde_json::{Map, Value, json};

/// Describes the runs of a variant, each of which lasts `duration` seconds: the number that
/// succeeded, the expectations that failed, and median and quartiles of each metric that varies.
/// Runs that could not go on have no metrics and are left out.
pub fn describe(
    metrics: &[Metric],
    rows: &[&RunRow],
    point: &str,
    duration: f64,
    text: &mut String,
) {
    let point = if point.is_empty() { "as in the file" } else { point };
    let ended: Vec<&RunRow> = rows.iter().filter(|row| row.error.is_none()).copied().collect();
    let succeeded = ended.iter().filter(|row| row.metrics.first() == Some(&Some(1.0))).count();
    *text += &format!("{point}: {succeeded} of {} runs succeeded\n", rows.len());
    for (index, Metric { name, kind }) in metrics.iter().enumerate() {
        let values = ended.iter().map(|row| row.metrics[index]);
        let line = match kind {
            MetricKind::Success => continue,
            MetricKind::Held | MetricKind::Truth => truths(values, *kind),
            MetricKind::Time => times(values, duration),
            MetricKind::Number => numbers(values),
        };
        *text += &format!("  {name:<24} {line}\n");
    }
}

/// Describes the truth of a condition in several runs.
fn truths(values: impl ExactSizeIterator<Item = Option<f64>>, kind: MetricKind) -> String {
    let count = values.len();
    let is_true = values.filter(|value| *value == Some(1.0)).count();
    let [yes, no] = match kind {
        MetricKind::Held => ["held", "failed"],
        _ => ["true", "false"],
    };
    match count - is_true {
        0 => format!("{yes} in {is_true} of {count} runs"),
        failed => format!("{yes} in {is_true} of {count} runs, {no} in {failed}"),
    }
}

/// Describes times to an event. Runs that ended before the event count as censored at their ends,
/// because the median of the others would be too short.
fn times(values: impl ExactSizeIterator<Item = Option<f64>>, duration: f64) -> String {
    let count = values.len();
    let observation = |value: Option<f64>| EventTime {
        time: value.unwrap_or(duration),
        is_reached: value.is_some(),
    };
    let observations: Vec<EventTime> = values.map(observation).collect();
    let reached: Vec<f64> =
        observations.iter().filter(|one| one.is_reached).map(|one| one.time).collect();
    let Some([first, .., last]) = quartiles(&reached) else {
        return match count {
            0 => "no runs".to_owned(),
            _ => "never".to_owned(),
        };
    };
    let quantile = |share: f64| kaplan_meier(&observations, 1.0 - share).map(round);
    let mut line = match (quantile(0.25), quantile(0.5), quantile(0.75)) {
        (.., None, _) => "no median".to_owned(),
        (Some(lower), Some(median), Some(upper)) if lower == upper && first == last => {
            format!("{median}")
        }
        (Some(lower), Some(median), Some(upper)) => {
            format!("median {median}, quartiles {lower} and {upper}")
        }
        (_, Some(median), _) => format!("median {median}"),
    };
    if first != last || reached.len() < count {
        line += &format!(", from {} to {}", round(first), round(last));
    }
    match count - reached.len() {
        0 => line,
        missing => format!("{line}, not reached in {missing} of {count} runs"),
    }
}

/// Describes the numbers of several runs.
fn numbers(values: impl ExactSizeIterator<Item = Option<f64>>) -> String {
    let count = values.len();
    let numbers: Vec<f64> = values.flatten().collect();
    let Some([least, lower, median, upper, most]) = quartiles(&numbers) else {
        return "none".to_owned();
    };
    let runs = match numbers.len() {
        all if all == count => String::new(),
        some => format!(", in {some} of {count} runs"),
    };
    if least == most {
        return format!("{}{runs}", round(median));
    }
    format!(
        "median {}, quartiles {} and {}, from {} to {}{runs}",
        round(median),
        round(lower),
        round(upper),
        round(least),
        round(most)
    )
}

/// Rounds a number to an integer from 1000 on, else as [`rounded`] does: enough to compare.
fn round(number: f64) -> f64 {
    if number.abs() >= 1000.0 { number.round() } else { rounded(number) }
}

/// Rounds a number to three decimals, or below 0.1 to three digits: a rate of 0.00042 is not 0.
pub fn rounded(number: f64) -> f64 {
    if number.abs() >= 0.1 {
        return (number * 1e3).round() / 1e3;
    }
    // The nearest number to the digits, which a quotient of powers of ten may not be.
    format!("{number:.2e}").parse().expect("a printed number is read again")
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
                "digest": row.digest.map(|digest| format!("{digest:016x}")),
                "error": row.error,
                "metrics": metrics.map(|(key, value)| (key, json!(value))).collect::<Map<_, _>>(),
            })
        })
        .collect();
    json!({ "runs": rows })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn line(kind: MetricKind, values: &[Option<f64>]) -> String {
        let rows = values.iter().map(|value| RunRow {
            seed: 1,
            parameters: Arc::default(),
            metrics: vec![Some(1.0), *value],
            digest: None,
            error: None,
        });
        let rows: Vec<RunRow> = rows.collect();
        let metric = |name: &str, kind| Metric { name: name.to_owned(), kind };
        let metrics = [metric("success", MetricKind::Success), metric("m", kind)];
        let mut text = String::new();
        describe(&metrics, &rows.iter().collect::<Vec<_>>(), "", 900.0, &mut text);
        let (_, line) = text.split_once("  m").unwrap();
        line.trim().to_owned()
    }

    fn reached(times: usize, runs: usize) -> Vec<Option<f64>> {
        let time = |run: usize| (run < times).then(|| 100.0 * (run + 1) as f64);
        (0..runs).map(time).collect()
    }

    #[test]
    fn a_median_counts_the_runs_that_did_not_reach_the_event() {
        let time = |reached: Vec<Option<f64>>| line(MetricKind::Time, &reached);
        assert_eq!(
            time(reached(8, 30)),
            "no median, from 100 to 800, not reached in 22 of 30 runs"
        );
        // The third of six falls to a half; the median of the four alone would be 250.
        assert_eq!(time(reached(4, 6)), "median 300, from 100 to 400, not reached in 2 of 6 runs");
        assert_eq!(time(reached(3, 6)), "median 300, from 100 to 300, not reached in 3 of 6 runs");
        assert_eq!(time(reached(2, 5)), "no median, from 100 to 200, not reached in 3 of 5 runs");
        assert_eq!(time(reached(4, 4)), "median 200, quartiles 100 and 300, from 100 to 400");
        assert_eq!(time(vec![Some(7.0); 3]), "7");
        assert_eq!(time(reached(0, 3)), "never");
    }

    #[test]
    fn small_numbers_keep_their_digits() {
        let number = |value: f64| line(MetricKind::Number, &[Some(value)]);
        let numbers = [
            (0.000_423_9, "0.000424"),
            (-3e-9, "-0.000000003"),
            (0.0, "0"),
            (0.099_96, "0.1"),
            (1.0 / 3.0, "0.333"),
            (12.345_6, "12.346"),
            (12_345.6, "12346"),
        ];
        numbers.iter().for_each(|(value, text)| assert_eq!(number(*value), *text));
    }

    #[test]
    fn truths_are_counted() {
        let values = [1.0, 0.0, 1.0].map(Some);
        assert_eq!(line(MetricKind::Held, &values), "held in 2 of 3 runs, failed in 1");
        assert_eq!(line(MetricKind::Truth, &values), "true in 2 of 3 runs, false in 1");
        assert_eq!(line(MetricKind::Held, &values[..1]), "held in 1 of 1 runs");
    }

    #[test]
    fn a_number_that_a_run_does_not_have_is_no_zero() {
        let number = |values: &[Option<f64>]| line(MetricKind::Number, values);
        assert_eq!(number(&[Some(2.0), None, Some(2.0)]), "2, in 2 of 3 runs");
        assert_eq!(number(&[None, None]), "none");
    }
}
