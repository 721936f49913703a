//! The times until fifty robots agree, for several losses of their radio:
//! `tests/scenarios/convergence.toml` with a thousand seeds for each loss. Draws
//! docs/convergence.svg when the times of all losses are known.

use std::fmt::Write;
use std::path::PathBuf;

use crate::Verdict;
use crate::simulator::Build;
use crate::sources::{clear_table, write};
use anyhow::{Result, bail};
use bittybuzz_builds::shell::{Invocation, root, target};
use fs_err as fs;

const SCENARIO: &str = "tests/scenarios/convergence.toml";

/// Frames lost on each link, in percent.
const LOSSES: [u32; 6] = [0, 10, 30, 50, 70, 90];

const RUNS: usize = 1000;
/// In CI.
const SAMPLE: usize = 6;

/// The entries that robots write, each with the time in seconds from which it can spread, in the
/// order of the scenario's expectations.
const PUTS: [(&str, f64); 3] = [
    ("all put the same key", 1.0),
    ("both sides of a partition put, after it heals", 80.0),
    ("one robot puts", 200.0),
];

/// The largest quotient of the medians at a loss of 90 % and without loss.
const SLOWDOWN_MAX: f64 = 20.0;

/// Median and 95 % in seconds, for each put.
type Times = [(f64, f64); PUTS.len()];

pub fn items() -> Vec<String> {
    LOSSES.iter().map(|loss| format!("{loss} %")).collect()
}

pub fn run(item: &str) -> Result<Verdict> {
    let Some(loss) = LOSSES.into_iter().find(|loss| format!("{loss} %") == item) else {
        return Ok(Verdict::Missing("no such loss".to_owned()));
    };
    let path = record(loss)?;
    let times = measure(Build::Optimized, loss, RUNS, &path)?;
    let all: Option<Vec<Times>> = LOSSES
        .iter()
        .map(|loss| times_of(&fs::read_to_string(&record(*loss).ok()?).ok()?, RUNS))
        .collect();
    if let Some(all) = all {
        write(&root().join("docs/convergence.svg"), plot(&all).as_bytes())?;
    }
    Ok(match times {
        Some(times) => Verdict::Shown(describe(&times)),
        None => Verdict::Missing("not all robots agree in the end".to_owned()),
    })
}

/// Some seeds of each loss, for CI.
pub fn sample() -> Result<()> {
    let mut all = Vec::new();
    for loss in LOSSES {
        let path = target()?.join("convergence").join(format!("{loss}.csv"));
        let Some(times) = measure(Build::Checked, loss, SAMPLE, &path)? else {
            bail!("not shown: convergence at {loss} %");
        };
        println!("convergence at {loss} % loss: {}", describe(&times));
        all.push(times);
    }
    let (first, last) = (all.first(), all.last());
    let slow = first.zip(last).is_none_or(|(without, most)| {
        without.iter().zip(most).any(|((before, _), (after, _))| *after > SLOWDOWN_MAX * before)
    });
    if slow { bail!("not shown: 90 % within {SLOWDOWN_MAX} times") } else { Ok(()) }
}

fn record(loss: u32) -> Result<PathBuf> {
    Ok(target()?.join("soak").join("convergence").join(format!("{loss}.csv")))
}

/// `None` if some run did not end as it should.
fn measure(build: Build, loss: u32, runs: usize, csv: &std::path::Path) -> Result<Option<Times>> {
    let bbz = build.simulator()?;
    clear_table(csv)?;
    let (runs_text, csv_text) = (runs.to_string(), csv.display().to_string());
    let set = format!("medium.nrf24.loss={}", f64::from(loss) / 100.0);
    let arguments =
        ["sim", SCENARIO, "--headless", "--runs", &runs_text, "--set", &set, "--csv", &csv_text];
    // The status is 1 if a run could not go on, which the table reports as well.
    Invocation::named("bbz", &bbz, &arguments)
        .output_if(|output| matches!(output.status.code(), Some(0 | 1)))?;
    Ok(times_of(&fs::read_to_string(csv)?, runs))
}

/// From the table that `bbz sim --csv` writes; `None` if a run failed or is missing.
fn times_of(csv: &str, runs: usize) -> Option<Times> {
    let mut lines = csv.lines();
    let names: Vec<&str> = lines.next()?.split(',').collect();
    let success = names.iter().position(|name| *name == "success")?;
    let since: Vec<usize> =
        (0..names.len()).filter(|column| names[*column].starts_with("since.")).collect();
    let mut columns = [const { Vec::new() }; PUTS.len()];
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        if *fields.get(success)? != "1" || since.len() != PUTS.len() {
            return None;
        }
        for ((column, place), (_, put)) in columns.iter_mut().zip(&since).zip(PUTS) {
            column.push(fields.get(*place)?.parse::<f64>().ok()? - put);
        }
    }
    let mut times = [(0.0, 0.0); PUTS.len()];
    for (time, column) in times.iter_mut().zip(&mut columns) {
        if column.len() != runs {
            return None;
        }
        column.sort_by(f64::total_cmp);
        *time = (*column.get(runs / 2)?, *column.get(runs * 95 / 100)?);
    }
    Some(times)
}

fn describe(times: &Times) -> String {
    let parts = PUTS.iter().zip(times);
    let parts =
        parts.map(|((what, _), (median, most))| format!("{what} {median:.1} s ({most:.1})"));
    parts.collect::<Vec<_>>().join(", ")
}

/// Time over loss, on a logarithmic scale from 0.5 to 100 s: a full line for each median, a broken one for 95 %.
fn plot(all: &[Times]) -> String {
    const COLORS: [&str; PUTS.len()] = ["#1b6ca8", "#c23b22", "#2e8b57"];
    let x = |loss: u32| 60.0 + 5.0 * f64::from(loss);
    let y = |seconds: f64| 300.0 - 270.0 * (seconds.max(0.5) / 0.5).log10() / 200.0_f64.log10();
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 560 400\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"560\" height=\"400\" fill=\"white\"/>\n",
    );
    // Writing to a String cannot fail.
    for seconds in [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0] {
        let at = y(seconds);
        let _ = writeln!(
            svg,
            "<path d=\"M60 {at:.1}H510\" stroke=\"#ddd\"/><text x=\"54\" y=\"{:.1}\" text-anchor=\"end\">{seconds}</text>",
            at + 4.0
        );
    }
    for loss in LOSSES {
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"318\" text-anchor=\"middle\">{loss}</text>",
            x(loss)
        );
    }
    let _ = writeln!(svg, "<text x=\"285\" y=\"336\" text-anchor=\"middle\">frames lost, %</text>");
    let _ = writeln!(
        svg,
        "<text x=\"60\" y=\"20\">seconds until all 50 robots agree: median, and 95 % of the runs (broken)</text>"
    );
    for (put, ((what, _), color)) in PUTS.iter().zip(COLORS).enumerate() {
        for (most, dash) in [(false, ""), (true, " stroke-dasharray=\"4 3\"")] {
            let points = LOSSES.iter().zip(all).filter_map(|(loss, times)| {
                let (median, late) = times.get(put)?;
                Some(format!("{:.1},{:.1}", x(*loss), y(if most { *late } else { *median })))
            });
            let points = points.collect::<Vec<_>>().join(" ");
            let _ = writeln!(
                svg,
                "<polyline points=\"{points}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"{dash}/>"
            );
        }
        let at = 358 + 14 * put;
        let _ = writeln!(svg, "<text x=\"60\" y=\"{at}\" fill=\"{color}\">{what}</text>");
    }
    svg.push_str("</svg>\n");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    const CSV: &str = "seed,medium.nrf24.loss,success,held.0,since.0,since.1,since.2\n\
        1,0,1,1,2.5,81,203\n2,0,1,1,1.5,82,202\n";

    #[test]
    fn times_count_from_the_put() {
        let times = times_of(CSV, 2).unwrap();
        assert_eq!(times.map(|(median, _)| median), [1.5, 2.0, 3.0]);
    }

    #[test]
    fn a_run_that_failed_or_is_missing_shows_nothing() {
        assert_eq!(times_of(CSV, 3), None);
        assert_eq!(times_of(&CSV.replace("2,0,1", "2,0,0"), 2), None);
        assert_eq!(times_of("", 2), None);
    }
}
