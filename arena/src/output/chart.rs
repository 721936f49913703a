//! A picture of a value over time.

use super::axes::{self, Axes};
use super::svg::{Svg, color, escape};
use crate::statistics::quartiles;

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 405.0;
/// Left, right, top and bottom of the area of the curves.
const AREA: [f64; 4] = [70.0, 885.0, 30.0, 360.0];

/// The largest number of samples of a curve. If there are more, an even selection is drawn.
const SAMPLES_MAX: usize = 2000;

/// The largest number of robots with a curve of their own. More robots are shown by their median,
/// quartiles and extremes.
const ROBOTS_MAX: usize = 50;

/// Draws a curve for each robot, or the median, quartiles and extremes of many robots. `values` has
/// an optional number for each robot of each sample.
pub fn chart(title: &str, times: &[f64], values: &[Vec<Option<f64>>]) -> String {
    let mut svg = Svg::new(WIDTH, HEIGHT);
    let end = times.last().copied().unwrap_or(1.0).max(1e-9);
    let y = axes::range(values.iter().flatten().flatten().copied());
    let axes = Axes { area: AREA, x: [0.0, end], y };
    svg.put(format_args!("<text x=\"{}\" y=\"18\">{}</text>\n", AREA[0], escape(title)));
    axes.draw_ticks(&mut svg);
    let robots = values.first().map_or(0, Vec::len);
    let step = times.len().div_ceil(SAMPLES_MAX).max(1);
    let samples = times.iter().zip(values).step_by(step);
    if robots <= ROBOTS_MAX {
        for robot in 0..robots {
            let points = samples.clone().filter_map(|(time, sample)| {
                let value = (*sample.get(robot)?)?;
                axes::is_drawable(value).then(|| axes.place([*time, value]))
            });
            svg.line(points, &color(robot), 1.2);
        }
    } else {
        let spread: Vec<(f64, [f64; 5])> = samples
            .filter_map(|(time, sample)| {
                let numbers: Vec<f64> = sample
                    .iter()
                    .flatten()
                    .copied()
                    .filter(|number| axes::is_drawable(*number))
                    .collect();
                Some((*time, quartiles(&numbers)?))
            })
            .collect();
        for (index, (color, width)) in
            [("#bbb", 1.0), ("#47a", 1.0), ("#036", 2.0), ("#47a", 1.0), ("#bbb", 1.0)]
                .into_iter()
                .enumerate()
        {
            svg.line(spread.iter().map(|(time, of)| axes.place([*time, of[index]])), color, width);
        }
    }
    axes.draw_frame(&mut svg, "time in s");
    svg.finish()
}
