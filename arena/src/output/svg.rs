//! The few elements of SVG that the pictures need.

use std::fmt::Write;

/// The reason why writing to a string succeeds.
const WRITTEN: &str = "a string accepts all text";

/// The colors of LEDs, by the sum of 1 for red, 2 for green and 4 for blue.
pub const LEDS: [&str; 8] = ["#ddd", "#e33", "#2a2", "#ec0", "#36f", "#d3d", "#0bc", "white"];

/// A picture that grows element by element.
pub struct Svg {
    text: String,
}

impl Svg {
    /// Returns an empty white picture of that size.
    pub fn new(width: f64, height: f64) -> Self {
        let mut svg = Svg { text: String::new() };
        svg.put(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
             height=\"{height:.0}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        ));
        svg
    }

    /// Adds an element. The caller [`escape`]s all text that comes from outside.
    pub fn put(&mut self, element: std::fmt::Arguments<'_>) {
        self.text.write_fmt(element).expect(WRITTEN);
    }

    /// Adds a line through points, in a color.
    pub fn line(&mut self, points: impl Iterator<Item = [f64; 2]>, color: &str, width: f64) {
        let path = path(points);
        if !path.is_empty() {
            self.put(format_args!(
                "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\"/>\n"
            ));
        }
    }

    /// Returns the whole text.
    pub fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

/// Returns the commands of a path through points, which is empty without points.
pub fn path(points: impl Iterator<Item = [f64; 2]>) -> String {
    let mut path = String::new();
    for (number, [x, y]) in points.enumerate() {
        let letter = if number == 0 { "M" } else { "L" };
        write!(path, "{letter}{x:.1} {y:.1}").expect(WRITTEN);
    }
    path
}

/// Returns text with escapes, for use between elements and in attributes.
pub fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // XML allows no other control characters than these.
            c if c.is_control() && !matches!(c, '\t' | '\n' | '\r') => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Returns a name of at most `most` letters: the end of a longer one is left out.
pub fn shortened(name: &str, most: usize) -> String {
    match name.chars().count() <= most {
        true => name.to_owned(),
        false => name.chars().take(most - 1).chain(['…']).collect(),
    }
}

/// Returns a color for each of many numbers. Steps of the golden angle give neighboring numbers
/// different hues.
pub fn color(number: usize) -> String {
    format!("hsl({:.0},70%,42%)", (number as f64 * 137.508) % 360.0)
}
