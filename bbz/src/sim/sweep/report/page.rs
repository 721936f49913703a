//! The report as one HTML file, without scripts and without other files.

use std::ffi::OsStr;
use std::fmt::Write;
use std::path::Path;

use bittybuzz_arena::output::escape;
use bittybuzz_arena::output::metrics::{Metric, MetricKind};
use bittybuzz_arena::statistics::quartiles;

use crate::launch;

use super::classes::Classes;
use super::estimate::{Estimate, Observation, estimate};
use super::pictures;
use super::results::Results;

/// Runs at each end of a metric that are listed.
const ENDS: usize = 3;

/// Runs that could not go on that are listed.
const FAILED_MAX: usize = 20;

const STYLE: &str = "\
:root { color-scheme: light; }
body { font: 15px/1.5 sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222; background: #fff; }
h1, h2, h3 { line-height: 1.2; } h2 { border-top: 1px solid #ccc; padding-top: 1rem; }
table { border-collapse: collapse; margin: 1rem 0; display: block; overflow-x: auto; }
th, td { padding: .2rem .7rem; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
code { background: #f2f2f2; padding: 0 .2rem; } svg { max-width: 100%; height: auto; }";

/// The way from a line of the report to its run.
pub enum RunLink<'a> {
    /// A server opens the run for a link.
    Served,
    /// A command opens the run of this folder.
    Command(&'a Path),
}

/// The reason why writing to a string succeeds.
const WRITTEN: &str = "a string accepts all text";

/// A report.
pub struct Report<'a> {
    pub results: &'a Results<'a>,
    /// The metrics, by their places.
    pub metrics: &'a [usize],
    pub parameters: &'a [Classes],
    /// The names of parameters that no picture shows.
    pub pooled: &'a [String],
    /// The number of runs of the plan.
    pub planned: usize,
    /// The version of the program that carried out the runs.
    pub program: &'a str,
    pub link: RunLink<'a>,
}

impl Report<'_> {
    /// Writes the report as HTML.
    pub fn to_html(&self) -> String {
        let study = self.results.study;
        let path = &study.arguments.scenario;
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let name = escape(&name);
        let mut html = format!(
            "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n\
             <title>Runs of {name}</title>\n<style>\n{STYLE}\n</style>\n<h1>Runs of {name}</h1>\n"
        );
        self.write_counts(&mut html);
        self.write_numbers(&mut html);
        for metric in self.metrics {
            self.write_metric(&mut html, *metric);
        }
        self.write_failed(&mut html);
        html + "</html>\n"
    }

    /// Writes the numbers of points and runs.
    fn write_counts(&self, html: &mut String) {
        let (results, plan) = (self.results, &self.results.study.runs.plan);
        let ended = results.ended_count() + results.failed.len();
        let mut counts = format!("{ended} of {} runs are finished", self.planned);
        for (count, words) in [
            (self.planned - ended, "are not finished"),
            (results.failed.len(), "of them could not go on"),
        ] {
            if count > 0 {
                write!(counts, ", {count} {words}").expect(WRITTEN);
            }
        }
        write!(
            html,
            "<p>{} points with {} runs of each: {counts}.\n<br>Version <code>{}</code></p>\n",
            plan.points.len(),
            plan.replicates,
            escape(self.program)
        )
        .expect(WRITTEN);
        if !self.pooled.is_empty() {
            let names: Vec<String> =
                self.pooled.iter().map(|name| format!("<code>{}</code>", escape(name))).collect();
            let names = names.join(", ");
            writeln!(html, "<p>Pictures have runs of all values of {names}.</p>").expect(WRITTEN);
        }
    }

    /// Writes a line for each metric.
    fn write_numbers(&self, html: &mut String) {
        if self.metrics.is_empty() {
            html.push_str("<p>No measure or expectation differs between the runs.</p>\n");
            return;
        }
        html.push_str(
            "<table>\n<tr><th>Metric<th>Runs<th>No value<th>Lower quartile<th>Median<th>Upper quartile\
             <th>Least<th>Most</tr>\n",
        );
        for place in self.metrics {
            let Metric { name, kind } = self.results.metric(*place);
            let observations: Vec<Observation> =
                self.results.of_runs(*place).map(|(_, observation)| observation).collect();
            let Estimate { runs, missing, interval } = estimate(*kind, &observations);
            let values: Vec<f64> = observations.iter().filter_map(|one| one.value).collect();
            let name = escape(name);
            write!(html, "<tr><td><a href=\"#metric-{place}\">{name}</a><td>{runs}<td>{missing}")
                .expect(WRITTEN);
            let cells = match (is_truth(*kind), interval) {
                (true, Some([_, share, _])) => {
                    let share = format!("{:.1} % true", 100.0 * share);
                    vec![String::new(), share, String::new()]
                }
                (false, Some(interval)) => interval.map(number).to_vec(),
                (_, None) => vec!["none".to_owned(); 3],
            };
            let extremes = match quartiles(&values).filter(|_| !is_truth(*kind)) {
                Some([least, .., most]) => [least, most].map(number),
                None => Default::default(),
            };
            for cell in cells.iter().chain(&extremes) {
                write!(html, "<td>{cell}").expect(WRITTEN);
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</table>\n");
    }

    /// Writes the pictures of a metric, and the runs at its ends.
    fn write_metric(&self, html: &mut String, place: usize) {
        let Metric { name, kind } = self.results.metric(place);
        writeln!(html, "<h2 id=\"metric-{place}\">{}</h2>", escape(name)).expect(WRITTEN);
        let curves = pictures::curves(self.results, place, self.parameters);
        let maps = pictures::maps(self.results, place, self.parameters);
        html.extend(curves.iter().chain(&maps).map(String::as_str));
        for parameter in self.parameters.iter().filter(|one| one.places.is_none()) {
            self.write_texts(html, place, parameter);
        }
        let mut values: Vec<(usize, f64)> = self
            .results
            .of_runs(place)
            .filter_map(|(run, observation)| Some((run, observation.value?)))
            .collect();
        values.sort_by(|(_, one), (_, other)| one.total_cmp(other));
        let ends = match is_truth(*kind) {
            true => ["False", "True"],
            false => ["Lowest", "Highest"],
        };
        let highest = values.iter().rev().take(ENDS);
        let mut rows: Vec<(&str, usize, String)> = Vec::new();
        let lowest = values.iter().take(ENDS);
        // Of two truths, each end has its own.
        let lowest = lowest.filter(|(_, value)| !is_truth(*kind) || *value == 0.0);
        let highest = highest.filter(|(_, value)| !is_truth(*kind) || *value != 0.0);
        rows.extend(lowest.map(|(run, value)| (ends[0], *run, number(*value))));
        rows.extend(highest.map(|(run, value)| (ends[1], *run, number(*value))));
        let missing = self.results.of_runs(place).filter(|(_, one)| one.value.is_none());
        rows.extend(missing.take(ENDS).map(|(run, _)| ("No value", run, String::new())));
        self.write_runs(html, name, &rows);
    }

    /// Writes the numbers of a parameter whose values are texts.
    fn write_texts(&self, html: &mut String, place: usize, parameter: &Classes) {
        let kind = self.results.metric(place).kind;
        let [lower, middle, upper] = match is_truth(kind) {
            true => ["Lower limit", "Share", "Upper limit"],
            false => ["Lower quartile", "Median", "Upper quartile"],
        };
        writeln!(
            html,
            "<table>\n<tr><th>{}<th>Runs<th>No value<th>{lower}<th>{middle}<th>{upper}</tr>",
            escape(&parameter.name)
        )
        .expect(WRITTEN);
        let sorted = self.results.of_classes(place, parameter, None);
        for (name, of_class) in parameter.names.iter().zip(&sorted) {
            let Estimate { runs, missing, interval } = estimate(kind, &of_class[0]);
            let cells = interval
                .map_or(["none".to_owned(), String::new(), String::new()], |interval| {
                    interval.map(number)
                });
            let cells = cells.join("<td>");
            writeln!(html, "<tr><td>{}<td>{runs}<td>{missing}<td>{cells}</tr>", escape(name))
                .expect(WRITTEN);
        }
        html.push_str("</table>\n");
    }

    /// Writes a table of runs, each with a word, its number and its value of a metric.
    fn write_runs(&self, html: &mut String, metric: &str, rows: &[(&str, usize, String)]) {
        let runs = &self.results.study.runs;
        let columns = runs.columns();
        html.push_str("<table>\n<tr><th>Runs<th>");
        html.push_str(&escape(metric));
        for column in ["Seed"].into_iter().chain(columns.iter().map(String::as_str)) {
            write!(html, "<th>{}", escape(column)).expect(WRITTEN);
        }
        html.push_str("<th>In the page</tr>\n");
        for (word, run, value) in rows {
            write!(html, "<tr><td>{word}<td>{value}<td>{}", runs.seed(*run)).expect(WRITTEN);
            for cell in runs.cells(runs.point_of(*run)).iter() {
                write!(html, "<td>{}", escape(cell)).expect(WRITTEN);
            }
            writeln!(html, "<td>{}</tr>", self.way(*run)).expect(WRITTEN);
        }
        html.push_str("</table>\n");
    }

    /// Writes the runs that could not go on.
    fn write_failed(&self, html: &mut String) {
        let failed = &self.results.failed;
        if failed.is_empty() {
            return;
        }
        html.push_str("<h2>Runs that could not go on</h2>\n<ul>\n");
        for (run, reason) in failed.iter().take(FAILED_MAX) {
            let (seed, reason) = (self.results.study.runs.seed(*run), escape(reason));
            writeln!(html, "<li>Seed {seed}: {reason} {}", self.way(*run)).expect(WRITTEN);
        }
        if failed.len() > FAILED_MAX {
            writeln!(html, "<li>and {} more", failed.len() - FAILED_MAX).expect(WRITTEN);
        }
        html.push_str("</ul>\n");
    }

    /// Returns the link or the command that opens a run.
    fn way(&self, run: usize) -> String {
        match self.link {
            RunLink::Served => {
                format!(
                    "<a href=\"run/{run}\" target=\"_blank\" rel=\"noreferrer\">open run {run}</a>"
                )
            }
            RunLink::Command(folder) => {
                let run = run.to_string();
                let words = ["sweep", "view"].map(OsStr::new).into_iter();
                let words = words.chain([folder.as_os_str(), OsStr::new(&run)]);
                format!("<code>{}</code>", escape(&launch::command(words)))
            }
        }
    }
}

fn is_truth(kind: MetricKind) -> bool {
    matches!(kind, MetricKind::Success | MetricKind::Held | MetricKind::Truth)
}

/// Returns a number with at most four decimals.
fn number(number: f64) -> String {
    match number.abs() {
        size if size != 0.0 && !(1e-3..1e9).contains(&size) => format!("{number:.3e}"),
        _ => format!("{}", (number * 1e4).round() / 1e4),
    }
}
