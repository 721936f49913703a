//! A picture of a number for each pair of values of two parameters.

use super::axes;
use super::svg::{Svg, escape, shortened};

/// The most columns and the most rows, so that a cell has room for its number.
pub const CELLS_MAX: usize = 24;

/// Colors from the lowest number to the highest: six of viridis (Smith and van der Walt, 2015), whose lightness
/// grows evenly for people with any color vision, and in prints without colors.
const COLORS: [[f64; 3]; 6] = [
    [68.0, 1.0, 84.0],
    [65.0, 68.0, 135.0],
    [42.0, 120.0, 142.0],
    [34.0, 168.0, 132.0],
    [122.0, 209.0, 81.0],
    [253.0, 231.0, 37.0],
];

/// The share of the scale above which black writing is easier to read than white.
const LIGHT: f64 = 0.55;

const CELL_WIDTH: f64 = 58.0;
const CELL_HEIGHT: f64 = 28.0;
/// The space over the cells, for the caption.
const TOP: f64 = 32.0;
/// The space below the cells, for the values and the name of the columns' parameter.
const BOTTOM: f64 = 50.0;
/// The space at the left for the name of the rows' parameter, without that of their values.
const LEFT: f64 = 40.0;
/// The distance of the scale from the cells, its width, and the space for its numbers.
const SCALE: [f64; 3] = [16.0, 14.0, 70.0];
/// A little more than the mean width of a letter.
const LETTER: f64 = 7.0;
/// The height of a letter's middle over the line of writing.
const MIDDLE: f64 = 4.0;
/// The most letters of the value of a column, and of a row.
const NAME_MAX: [usize; 2] = [8, 24];

/// A picture of a number for each pair of values of two parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Sentence over the cells, which names their numbers.
    pub caption: String,
    /// Name and values of the parameter of the columns, from left to right; at most [`CELLS_MAX`].
    pub x: (String, Vec<String>),
    /// Name and values of the parameter of the rows, from the bottom to the top; at most [`CELLS_MAX`].
    pub y: (String, Vec<String>),
    /// The number of each column of each row; `None` where there is none.
    pub cells: Vec<Vec<Option<f64>>>,
}

impl HeatMap {
    /// Draws the picture as SVG.
    pub fn draw(&self) -> String {
        let [columns, rows] = [&self.x.1, &self.y.1].map(|values| values.len() as f64);
        let longest = self.y.1.iter().map(|name| shortened(name, NAME_MAX[1]).chars().count());
        let left = LEFT + longest.max().unwrap_or(0) as f64 * LETTER;
        let (right, bottom) = (left + columns * CELL_WIDTH, TOP + rows * CELL_HEIGHT);
        let caption = left + self.caption.chars().count() as f64 * LETTER;
        let width = (right + SCALE.iter().sum::<f64>()).max(caption);
        let mut svg = Svg::new(width, bottom + BOTTOM);
        let numbers = || self.cells.iter().flatten().flatten().copied();
        let [low, high] = axes::range(numbers());
        svg.put(format_args!(
            "<text x=\"{left}\" y=\"{:.0}\" fill=\"#444\">{}</text>\n",
            TOP - 10.0,
            escape(&self.caption)
        ));
        for (row, cells) in self.cells.iter().enumerate() {
            let y = bottom - (row + 1) as f64 * CELL_HEIGHT;
            for (column, number) in cells.iter().enumerate() {
                draw_cell(&mut svg, [left + column as f64 * CELL_WIDTH, y], *number, [low, high]);
            }
            svg.put(format_args!(
                "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\">{}</text>\n",
                left - 6.0,
                y + CELL_HEIGHT / 2.0 + MIDDLE,
                escape(&shortened(&self.y.1[row], NAME_MAX[1]))
            ));
        }
        for (column, name) in self.x.1.iter().enumerate() {
            svg.put(format_args!(
                "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>\n",
                left + (column as f64 + 0.5) * CELL_WIDTH,
                bottom + 18.0,
                escape(&shortened(name, NAME_MAX[0]))
            ));
        }
        let middle = (TOP + bottom) / 2.0;
        svg.put(format_args!(
            "<text x=\"{:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"rotate(-90 18 {middle:.0})\" x=\"18\" y=\"{middle:.0}\" \
             text-anchor=\"middle\">{}</text>\n",
            (left + right) / 2.0,
            bottom + 38.0,
            escape(&self.x.0),
            escape(&self.y.0)
        ));
        if numbers().any(axes::is_drawable) {
            draw_scale(&mut svg, [right + SCALE[0], TOP, bottom], [low, high]);
        }
        svg.finish()
    }
}

fn draw_cell(svg: &mut Svg, [x, y]: [f64; 2], number: Option<f64>, [low, high]: [f64; 2]) {
    let share = number.filter(|number| axes::is_drawable(*number));
    let share = share.map(|number| ((number - low) / (high - low)).clamp(0.0, 1.0));
    let fill = share.map_or("white".to_owned(), color);
    let ink = if share.is_none_or(|share| share > LIGHT) { "black" } else { "white" };
    svg.put(format_args!(
        "<rect x=\"{x:.0}\" y=\"{y:.0}\" width=\"{CELL_WIDTH}\" height=\"{CELL_HEIGHT}\" \
         fill=\"{fill}\" stroke=\"#888\"/>\n\
         <text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\" fill=\"{ink}\">{}</text>\n",
        x + CELL_WIDTH / 2.0,
        y + CELL_HEIGHT / 2.0 + MIDDLE,
        number.map_or("–".to_owned(), digits)
    ));
}

/// Draws the colors from the bottom to the top, with the numbers at both ends.
fn draw_scale(svg: &mut Svg, [x, top, bottom]: [f64; 3], [low, high]: [f64; 2]) {
    const STEPS: u32 = 32;
    let height = (bottom - top) / f64::from(STEPS);
    for step in 0..STEPS {
        svg.put(format_args!(
            "<rect x=\"{x:.0}\" y=\"{:.2}\" width=\"{}\" height=\"{:.2}\" fill=\"{}\"/>\n",
            bottom - f64::from(step + 1) * height,
            SCALE[1],
            // Without a gap where a browser rounds.
            height + 0.5,
            color((f64::from(step) + 0.5) / f64::from(STEPS))
        ));
    }
    for (number, y) in [(low, bottom), (high, top + 9.0)] {
        svg.put(format_args!(
            "<text x=\"{:.0}\" y=\"{y:.0}\">{}</text>\n",
            x + SCALE[1] + 4.0,
            digits(number)
        ));
    }
}

/// Returns the color of a share of the scale, from 0 to 1.
fn color(share: f64) -> String {
    let place = share * (COLORS.len() - 1) as f64;
    let below = (place as usize).min(COLORS.len() - 2);
    let part = place - below as f64;
    let mix = |channel: usize| {
        let [from, to] = [below, below + 1].map(|color| COLORS[color][channel]);
        (from + (to - from) * part).round()
    };
    format!("rgb({:.0},{:.0},{:.0})", mix(0), mix(1), mix(2))
}

/// Returns a number with three digits, or all of its integer part below a million.
fn digits(number: f64) -> String {
    let size = number.abs();
    if size != 0.0 && !(1e-3..1e6).contains(&size) {
        return format!("{number:.2e}");
    }
    let places = match size {
        _ if number.fract() == 0.0 || size >= 100.0 => 0,
        size if size >= 10.0 => 1,
        size if size >= 1.0 => 2,
        _ => 3,
    };
    format!("{number:.places$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(cells: Vec<Vec<Option<f64>>>) -> HeatMap {
        let values = |count: usize| (0..count).map(|value| value.to_string()).collect();
        HeatMap {
            caption: "Median".to_owned(),
            x: ("a<b".to_owned(), values(cells[0].len())),
            y: ("loss".to_owned(), values(cells.len())),
            cells,
        }
    }

    #[test]
    fn each_cell_has_the_color_of_its_number() {
        let text = map(vec![vec![Some(0.0), Some(5.0)], vec![None, Some(10.0)]]).draw();
        for expected in ["rgb(68,1,84)", "rgb(253,231,37)", ">5<", ">10<", ">–<", "a&lt;b"] {
            assert!(text.contains(expected), "{expected}: {text}");
        }
        // Five is in the middle of the third and the fourth color.
        assert!(text.contains("rgb(38,144,137)"), "{text}");
    }

    #[test]
    fn odd_numbers_are_drawn() {
        let odd = [f64::INFINITY, f64::NAN, 1e300, -1e-300, 0.0].map(Some).to_vec();
        let text = map(vec![odd]).draw();
        assert!(!text.contains("rgb(NaN") && text.contains(">inf<"), "{text}");
        assert!(map(vec![vec![None]]).draw().contains("–"));
    }

    #[test]
    fn numbers_have_three_digits() {
        let numbers = [0.0, 7.0, 0.12345, 1.2345, 12.345, 123.45, 12345.6, 2e7, -0.00002];
        let texts = numbers.map(digits);
        let expected = ["0", "7", "0.123", "1.23", "12.3", "123", "12346", "2.00e7", "-2.00e-5"];
        assert_eq!(texts, expected);
    }
}
