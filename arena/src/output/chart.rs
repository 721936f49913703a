//! A picture of a value over time.

use super::svg::{Svg, color, escape};
use crate::statistics::quartiles;

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 400.0;
/// Left, right, top and bottom of the area of the curves.
const AREA: [f64; 4] = [70.0, 885.0, 30.0, 360.0];

/// The largest number of samples of a curve. If there are more, an even selection is drawn.
const SAMPLES_MAX: usize = 2000;

/// The largest number of robots with a curve of their own. More robots are shown by their median,
/// quartiles and extremes.
const CURVES_MAX: usize = 50;

/// Draws a curve for each robot, or the median, quartiles and extremes of many robots. `values` has
/// an optional number for each robot of each sample.
pub fn chart(title: &str, times: &[f64], values: &[Vec<Option<f64>>]) -> String {
    let mut svg = Svg::new(WIDTH, HEIGHT);
    let numbers = || values.iter().flatten().flatten().copied().filter(|number| number.is_finite());
    let (mut low, mut high) =
        (numbers().fold(f64::INFINITY, f64::min), numbers().fold(f64::NEG_INFINITY, f64::max));
    if low > high {
        (low, high) = (0.0, 1.0);
    }
    if high - low < 1e-9 {
        (low, high) = (low - 1.0, high + 1.0);
    }
    let end = times.last().copied().unwrap_or(1.0).max(1e-9);
    let [left, right, top, bottom] = AREA;
    let x = |time: f64| left + (right - left) * time / end;
    let y = |value: f64| bottom - (bottom - top) * (value - low) / (high - low);
    svg.put(format_args!("<text x=\"{left}\" y=\"18\">{}</text>\n", escape(title)));
    for value in ticks(low, high) {
        let at = y(value);
        svg.put(format_args!(
            "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#ddd\"/>\n\
             <text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{value}</text>\n",
            left - 6.0,
            at + 4.0
        ));
    }
    for time in ticks(0.0, end) {
        svg.put(format_args!(
            "<text x=\"{:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{time} s</text>\n",
            x(time),
            bottom + 18.0
        ));
    }
    let robots = values.first().map_or(0, Vec::len);
    let step = times.len().div_ceil(SAMPLES_MAX).max(1);
    let samples = times.iter().zip(values).step_by(step);
    if robots <= CURVES_MAX {
        for robot in 0..robots {
            let points = samples.clone().filter_map(|(time, sample)| {
                let value = (*sample.get(robot)?)?;
                Some([x(*time), y(value)])
            });
            svg.line(points, &color(robot), 1.2);
        }
    } else {
        let spread: Vec<(f64, [f64; 5])> = samples
            .filter_map(|(time, sample)| {
                let numbers: Vec<f64> = sample.iter().flatten().copied().collect();
                Some((*time, quartiles(&numbers)?))
            })
            .collect();
        for (index, (color, width)) in
            [("#bbb", 1.0), ("#47a", 1.0), ("#036", 2.0), ("#47a", 1.0), ("#bbb", 1.0)]
                .into_iter()
                .enumerate()
        {
            svg.line(spread.iter().map(|(time, of)| [x(*time), y(of[index])]), color, width);
        }
    }
    svg.put(format_args!(
        "<path d=\"M{left} {top}V{bottom}H{right}\" fill=\"none\" stroke=\"black\"/>\n"
    ));
    svg.finish()
}

/// Returns about four to ten round numbers in a range.
fn ticks(low: f64, high: f64) -> impl Iterator<Item = f64> {
    let rough = (high - low) / 5.0;
    let power = 10f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|factor| factor * power >= rough);
    let step = factor.unwrap_or(10.0) * power;
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    // Rounded, so that 0.1 * 3 is printed as 0.3.
    (first..=last).map(move |number| (number as f64 * step * 1e9).round() / 1e9)
}
