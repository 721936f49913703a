//! A picture of medians and quartiles in panels, for results of many robots or runs.

use super::axes::{self, Axes};
use super::svg::{Svg, escape, path, shortened};

/// The largest number of curves that a reader can distinguish, by color and dashes.
pub const CURVES_MAX: usize = COLORS.len() * 2;

/// The colors of Okabe and Ito (Color Universal Design, 2008) for dark lines, which differ for people
/// with any color vision. Their yellow is too light for a line on white.
const COLORS: [&str; 7] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#e69f00", "#56b4e9"];

/// Dashes of the curves, for prints without colors.
const DASHES: [&str; 7] = ["none", "8 4", "2 3", "10 3 2 3", "16 4", "6 2 2 2 2 2", "4 2"];

/// The shift between the dashes of two curves with one color.
const DASHES_SHIFT: usize = 3;

/// The largest number of points of a curve. If there are more, an even selection is drawn.
const POINTS_MAX: usize = 2000;

/// The width and height of the area of the curves in each panel.
const AREA_WIDTH: f64 = 600.0;
const AREA_HEIGHT: f64 = 250.0;
/// The place of this area in the first panel.
const LEFT: f64 = 82.0;
const TOP: f64 = 32.0;
/// The height from the top of a panel to that of the next one.
const PANEL: f64 = AREA_HEIGHT + 60.0;
/// The space at the right without a legend.
const MARGIN: f64 = 20.0;
/// The space below the last panel, for the numbers and the name of the axis.
const BOTTOM: f64 = 50.0;
/// The width of a line in the legend with its distances.
const KEY: f64 = 52.0;
/// The distance of two names in the legend.
const LINE: f64 = 20.0;
/// A little more than the mean width of a letter.
const LETTER: f64 = 7.0;
/// The largest number of letters of a name in the legend.
const NAME_MAX: usize = 40;

/// A picture of medians and quartiles.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Name of the horizontal axis, which all panels have.
    pub x_label: String,
    /// Name of the parameter by which the curves differ; `None` for a single curve.
    pub parameter: Option<String>,
    /// Names of the curves, which each panel has in this order; at most [`CURVES_MAX`].
    pub curves: Vec<String>,
    pub panels: Vec<Panel>,
    /// True to mark each point, as is useful for a few.
    pub has_marks: bool,
}

/// The curves of a quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Name of the vertical axis.
    pub y_label: String,
    /// Sentence over the curves that counts the robots or runs of the quartiles.
    pub caption: String,
    /// The points of each curve, from left to right.
    pub curves: Vec<Vec<CurvePoint>>,
}

/// A point of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    pub x: f64,
    /// Lower quartile, median and upper quartile; `None` leaves a gap in the curve.
    pub quartiles: Option<[f64; 3]>,
}

/// The look of a curve.
struct Style {
    color: &'static str,
    dashes: &'static str,
}

impl Style {
    fn of(curve: usize) -> Self {
        let again = curve / COLORS.len() * DASHES_SHIFT;
        let place = curve % COLORS.len();
        Style { color: COLORS[place], dashes: DASHES[(place + again) % DASHES.len()] }
    }

    /// Draws a curve with this path.
    fn line(&self, svg: &mut Svg, path: &str) {
        let Style { color, dashes } = self;
        svg.put(format_args!(
            "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\" \
             stroke-dasharray=\"{dashes}\"/>\n"
        ));
    }
}

impl Figure {
    /// Draws the picture as SVG.
    pub fn draw(&self) -> String {
        let names = self.curves.iter().chain(&self.parameter);
        let longest =
            names.map(|name| shortened(name, NAME_MAX).chars().count()).max().unwrap_or(0);
        let right = match self.parameter {
            Some(_) => KEY + longest as f64 * LETTER,
            None => MARGIN,
        };
        let legend = TOP + LINE * (self.curves.len() + 1) as f64;
        let panels = PANEL * self.panels.len() as f64 - (PANEL - AREA_HEIGHT) + TOP + BOTTOM;
        let mut svg = Svg::new(LEFT + AREA_WIDTH + right, panels.max(legend));
        let points = || self.panels.iter().flat_map(|panel| panel.curves.iter().flatten());
        let mut x = axes::range(points().map(|point| point.x));
        if self.has_marks {
            let margin = (x[1] - x[0]) * 0.04;
            x = [x[0] - margin, x[1] + margin];
        }
        for (number, panel) in self.panels.iter().enumerate() {
            let top = TOP + PANEL * number as f64;
            let area = [LEFT, LEFT + AREA_WIDTH, top, top + AREA_HEIGHT];
            self.draw_panel(&mut svg, panel, area, x, number + 1 == self.panels.len());
        }
        if let Some(parameter) = &self.parameter {
            self.draw_legend(&mut svg, parameter);
        }
        svg.finish()
    }

    fn draw_panel(&self, svg: &mut Svg, panel: &Panel, area: [f64; 4], x: [f64; 2], is_last: bool) {
        let [left, _, top, bottom] = area;
        let quartiles = || panel.curves.iter().flatten().filter_map(|point| point.quartiles);
        let [low, high] = axes::range(quartiles().flatten());
        // Curves at the limits of a quantity stay apart from the frame.
        let margin = (high - low) * 0.04;
        let axes = Axes { area, x, y: [low - margin, high + margin] };
        axes.draw_ticks(svg);
        let curves = (0..)
            .zip(&panel.curves)
            .map(|(number, points)| (Style::of(number), places(&axes, points)));
        let curves: Vec<(Style, CurvePlaces)> = curves.collect();
        // No band covers a line.
        for (style, places) in &curves {
            draw_band(svg, style, places);
        }
        for (style, places) in &curves {
            draw_line(svg, style, places, self.has_marks);
        }
        axes.draw_frame(svg, if is_last { &self.x_label } else { "" });
        let middle = (top + bottom) / 2.0;
        svg.put(format_args!(
            "<text transform=\"rotate(-90 18 {middle:.0})\" x=\"18\" y=\"{middle:.0}\" \
             text-anchor=\"middle\">{}</text>\n\
             <text x=\"{left}\" y=\"{:.0}\" fill=\"#444\">{}</text>\n",
            escape(&panel.y_label),
            top - 10.0,
            escape(&panel.caption)
        ));
    }

    /// Draws the names of the curves at the right.
    fn draw_legend(&self, svg: &mut Svg, parameter: &str) {
        let left = LEFT + AREA_WIDTH + 12.0;
        let mut y = TOP + 4.0;
        svg.put(format_args!(
            "<text x=\"{left}\" y=\"{y}\">{}</text>\n",
            escape(&shortened(parameter, NAME_MAX))
        ));
        for (number, name) in self.curves.iter().enumerate() {
            y += LINE;
            Style::of(number).line(svg, &format!("M{left} {:.0}h28", y - 4.0));
            svg.put(format_args!(
                "<text x=\"{}\" y=\"{y}\">{}</text>\n",
                left + 34.0,
                escape(&shortened(name, NAME_MAX))
            ));
        }
    }
}

/// The places of lower quartile, median and upper quartile of the points of a curve; `None` for a gap.
type CurvePlaces = Vec<Option<[[f64; 2]; 3]>>;

fn places(axes: &Axes, points: &[CurvePoint]) -> CurvePlaces {
    let step = points.len().div_ceil(POINTS_MAX).max(1);
    let drawn = points.iter().step_by(step).map(|point| {
        let quartiles = point.quartiles?;
        let is_drawable = quartiles.into_iter().chain([point.x]).all(axes::is_drawable);
        is_drawable.then(|| quartiles.map(|value| axes.place([point.x, value])))
    });
    drawn.collect()
}

/// Returns the parts of a curve between its gaps.
fn pieces(places: &CurvePlaces) -> impl Iterator<Item = Vec<[[f64; 2]; 3]>> {
    let pieces =
        places.split(Option::is_none).map(|piece| piece.iter().flatten().copied().collect());
    pieces.filter(|piece: &Vec<_>| !piece.is_empty())
}

/// Draws the band between the quartiles, or a bar for a point without neighbors.
fn draw_band(svg: &mut Svg, style: &Style, places: &CurvePlaces) {
    let color = style.color;
    for piece in pieces(places) {
        if let [[[x, lower], _, [_, upper]]] = piece[..] {
            svg.put(format_args!(
                "<path d=\"M{x:.1} {lower:.1}V{upper:.1}\" stroke=\"{color}\"/>\n"
            ));
            continue;
        }
        let lower = piece.iter().map(|[lower, ..]| *lower);
        let upper = piece.iter().rev().map(|[.., upper]| *upper);
        svg.put(format_args!(
            "<path d=\"{}Z\" fill=\"{color}\" fill-opacity=\"0.18\" stroke=\"{color}\" \
             stroke-opacity=\"0.5\" stroke-width=\"0.7\"/>\n",
            path(lower.chain(upper))
        ));
    }
}

/// Draws the line of the medians, and a dot at each point that stands alone or is to be marked.
fn draw_line(svg: &mut Svg, style: &Style, places: &CurvePlaces, has_marks: bool) {
    for piece in pieces(places) {
        if piece.len() > 1 {
            style.line(svg, &path(piece.iter().map(|[_, median, _]| *median)));
        }
        if piece.len() == 1 || has_marks {
            for [_, [x, median], _] in piece {
                svg.put(format_args!(
                    "<circle cx=\"{x:.1}\" cy=\"{median:.1}\" r=\"3.5\" fill=\"{}\"/>\n",
                    style.color
                ));
            }
        }
    }
}
