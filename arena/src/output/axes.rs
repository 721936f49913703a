//! The axes of a picture of curves: ranges, round ticks and labels.

use super::svg::{Svg, escape};

/// Numbers beyond this size are left out of pictures: a range of larger ones may be infinite.
const MAGNITUDE_MAX: f64 = 1e300;

/// A range of numbers that differ by a smaller share counts as one number.
const SHARE_MIN: f64 = 1e-12;

/// Numbers from this size on, and steps below [`STEP_MIN`], are written with an exponent.
const PLAIN_MAX: f64 = 1e6;
const STEP_MIN: f64 = 1e-5;

/// The height of a letter's middle over the line of writing.
const MIDDLE: f64 = 4.0;

/// Returns true for a number that a picture can show.
pub fn is_drawable(number: f64) -> bool {
    number.abs() <= MAGNITUDE_MAX
}

/// Returns the smallest and the largest of the numbers that a picture can show, or a range around
/// them if they are one number; 0 and 1 without numbers.
pub fn range(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let empty = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = numbers
        .filter(|number| is_drawable(*number))
        .fold(empty, |[low, high], number| [low.min(number), high.max(number)]);
    if low > high {
        return [0.0, 1.0];
    }
    let magnitude = low.abs().max(high.abs());
    if high - low > SHARE_MIN * magnitude {
        return [low, high];
    }
    let margin = (magnitude * 1e-3).max(1.0);
    [low - margin, high + margin]
}

/// The numbers at which an axis has ticks: multiples of a step of 1, 2 or 5 times a power of ten.
#[derive(Debug, Clone, Copy)]
struct Ticks {
    step: f64,
    /// The first and the last multiple.
    multiples: [f64; 2],
}

impl Ticks {
    /// Returns four to ten ticks in a range.
    fn within([low, high]: [f64; 2]) -> Self {
        let rough = (high - low) / 5.0;
        let power = 10f64.powf(rough.log10().floor());
        let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|factor| factor * power >= rough);
        let step = factor.unwrap_or(10.0) * power;
        // A bound that is a multiple but for rounding keeps its tick.
        let multiples = [(low / step - 1e-9).ceil(), (high / step + 1e-9).floor()];
        Ticks { step, multiples }
    }

    fn values(self) -> impl Iterator<Item = f64> {
        let [first, last] = self.multiples;
        let count = (last - first).clamp(-1.0, 10.0) as i32;
        (0..=count).map(move |number| (first + f64::from(number)) * self.step)
    }

    /// Returns a tick as text, with as many digits as its neighbors.
    fn label(self, value: f64) -> String {
        if value.abs() < self.step / 2.0 {
            return "0".to_owned();
        }
        let place = |number: f64| (number.abs().log10() + 1e-9).floor() as i32;
        let largest = self.multiples.map(|multiple| (multiple * self.step).abs());
        if largest[0].max(largest[1]) < PLAIN_MAX && self.step > STEP_MIN {
            return format!("{value:.0$}", (-place(self.step)).max(0) as usize);
        }
        format!("{value:.0$e}", (place(value) - place(self.step)).clamp(0, 15) as usize)
    }
}

/// The area of a picture in which curves are drawn, and the numbers at its edges.
#[derive(Debug, Clone, Copy)]
pub struct Axes {
    /// Left, right, top and bottom of the area.
    pub area: [f64; 4],
    /// The numbers at the left and at the right.
    pub x: [f64; 2],
    /// The numbers at the bottom and at the top.
    pub y: [f64; 2],
}

impl Axes {
    /// Returns the place of a point in the picture.
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [left, right, top, bottom] = self.area;
        let share = |number: f64, [low, high]: [f64; 2]| (number - low) / (high - low);
        [left + (right - left) * share(x, self.x), bottom - (bottom - top) * share(y, self.y)]
    }

    /// Draws lines across the area at round numbers of the vertical axis, and the numbers of both.
    pub fn draw_ticks(&self, svg: &mut Svg) {
        let [left, right, _, bottom] = self.area;
        let ticks = Ticks::within(self.y);
        for value in ticks.values() {
            let [_, y] = self.place([self.x[0], value]);
            svg.put(format_args!(
                "<path d=\"M{left} {y:.1}H{right}\" stroke=\"#ddd\"/>\n\
                 <text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\n",
                left - 6.0,
                y + MIDDLE,
                ticks.label(value)
            ));
        }
        let ticks = Ticks::within(self.x);
        for value in ticks.values() {
            let [x, _] = self.place([value, self.y[0]]);
            svg.put(format_args!(
                "<path d=\"M{x:.1} {bottom}v5\" stroke=\"black\"/>\n\
                 <text x=\"{x:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>\n",
                bottom + 18.0,
                ticks.label(value)
            ));
        }
    }

    /// Draws the axes over the curves, and the name of the horizontal one.
    pub fn draw_frame(&self, svg: &mut Svg, x_label: &str) {
        let [left, right, top, bottom] = self.area;
        svg.put(format_args!(
            "<path d=\"M{left} {top}V{bottom}H{right}\" fill=\"none\" stroke=\"black\"/>\n\
             <text x=\"{:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>\n",
            (left + right) / 2.0,
            bottom + 36.0,
            escape(x_label)
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64) -> Vec<String> {
        let ticks = Ticks::within([low, high]);
        ticks.values().map(|value| ticks.label(value)).collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(labels(0.0, 1.0), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(-7.0, 13.0), ["-5", "0", "5", "10"]);
        assert_eq!(labels(0.0, 900.0), ["0", "200", "400", "600", "800"]);
        assert_eq!(labels(0.29, 0.31), ["0.290", "0.295", "0.300", "0.305", "0.310"]);
        assert_eq!(labels(0.0, 5e6), ["0", "1e6", "2e6", "3e6", "4e6", "5e6"]);
        assert_eq!(labels(0.0, 4e-7), ["0", "1e-7", "2e-7", "3e-7", "4e-7"]);
        assert_eq!(labels(1e9, 1e9 + 4.0)[1], "1.000000001e9");
    }

    #[test]
    fn ranges_of_odd_numbers_have_a_width() {
        assert_eq!(range([].into_iter()), [0.0, 1.0]);
        assert_eq!(range([7.0, 7.0].into_iter()), [6.0, 8.0]);
        assert_eq!(range([f64::NAN, f64::INFINITY, 2.0, 3.0].into_iter()), [2.0, 3.0]);
        for number in [0.0, 1e-300, 1e300, -1e300] {
            let [low, high] = range([number].into_iter());
            assert!(low < high && (high - low).is_finite(), "{number}");
            assert!(!labels(low, high).is_empty());
        }
        assert!(labels(-1e300, 1e300).len() > 2);
    }
}
