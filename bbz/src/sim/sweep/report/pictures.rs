//! The pictures of a metric: curves against a parameter, and a map of two parameters.

use bittybuzz_arena::output::metrics::Metric;
use bittybuzz_arena::output::{CurvePoint, Figure, HeatMap, Panel};

use super::classes::Classes;
use super::estimate::{Estimate, Observation, estimate, words};
use super::results::Results;

/// The most curves whose bands a reader can distinguish.
const CURVES_MAX: usize = 7;

/// Draws a metric against each parameter of numbers. With one other parameter of few values, each of these
/// has a curve.
pub fn curves(results: &Results, metric: usize, parameters: &[Classes]) -> Vec<String> {
    let of_numbers = parameters.iter().filter(|parameter| parameter.places.is_some());
    let draw = |x: &Classes| {
        let others: Vec<&Classes> = parameters.iter().filter(|other| *other != x).collect();
        let by = match others[..] {
            [by] if by.names.len() <= CURVES_MAX => Some(by),
            _ => None,
        };
        figure(results, metric, x, by)
    };
    of_numbers.filter_map(draw).collect()
}

fn figure(results: &Results, metric: usize, x: &Classes, by: Option<&Classes>) -> Option<String> {
    let Metric { name, kind } = results.metric(metric);
    let sorted = results.of_classes(metric, x, by);
    let places = x.places.as_ref()?;
    let curve = |inner: usize| -> Vec<CurvePoint> {
        let points = places.iter().zip(&sorted).filter(|(_, of_class)| !of_class[inner].is_empty());
        let point = |(place, of_class): (&f64, &Vec<Vec<Observation>>)| CurvePoint {
            x: *place,
            quartiles: estimate(*kind, &of_class[inner]).interval,
        };
        points.map(point).collect()
    };
    let curves: Vec<Vec<CurvePoint>> = (0..by.map_or(1, |by| by.names.len())).map(curve).collect();
    curves.iter().flatten().find(|point| point.quartiles.is_some())?;
    let estimates = sorted.iter().flatten().map(|runs| estimate(*kind, runs));
    let panel = Panel {
        y_label: name.clone(),
        caption: caption(results, &words(*kind).concat(), estimates),
        curves,
    };
    let figure = Figure {
        x_label: x.name.clone(),
        parameter: by.map(|by| by.name.clone()),
        curves: by.map_or(Vec::new(), |by| by.names.clone()),
        panels: vec![panel],
        has_marks: true,
    };
    Some(figure.draw())
}

/// Draws a map of a metric for each pair of parameters.
pub fn maps(results: &Results, metric: usize, parameters: &[Classes]) -> Vec<String> {
    let pairs = parameters
        .iter()
        .enumerate()
        .flat_map(|(number, x)| parameters[number + 1..].iter().map(move |y| (x, y)));
    pairs.filter_map(|(x, y)| map(results, metric, x, y)).collect()
}

fn map(results: &Results, metric: usize, x: &Classes, y: &Classes) -> Option<String> {
    let kind = results.metric(metric).kind;
    let sorted = results.of_classes(metric, y, Some(x));
    let estimates: Vec<Vec<Estimate>> =
        sorted.iter().map(|row| row.iter().map(|runs| estimate(kind, runs)).collect()).collect();
    let cells: Vec<Vec<Option<f64>>> = estimates
        .iter()
        .map(|row| row.iter().map(|estimate| Some(estimate.interval?[1])).collect())
        .collect();
    cells.iter().flatten().find(|cell| cell.is_some())?;
    let caption = caption(results, words(kind)[0], estimates.into_iter().flatten());
    let map = HeatMap {
        caption: format!("{}: {caption}", results.metric(metric).name),
        x: (x.name.clone(), x.names.clone()),
        y: (y.name.clone(), y.names.clone()),
        cells,
    };
    Some(map.draw())
}

/// Returns the sentence over a picture, which names its numbers and the number of runs.
fn caption(results: &Results, numbers: &str, estimates: impl Iterator<Item = Estimate>) -> String {
    let used: Vec<Estimate> = estimates.filter(|estimate| estimate.runs > 0).collect();
    let counts = used.iter().map(|estimate| estimate.runs);
    let [least, most] = [counts.clone().min().unwrap_or(0), counts.max().unwrap_or(0)];
    let runs = if least == most { most.to_string() } else { format!("{least} to {most}") };
    let noun = if most == 1 { "run" } else { "runs" };
    let missing: usize = used.iter().map(|estimate| estimate.missing).sum();
    let missing = match missing {
        0 => String::new(),
        count => format!("; no value in {count} of {} runs", results.ended_count()),
    };
    format!("{numbers} of {runs} {noun} each{missing}")
}
