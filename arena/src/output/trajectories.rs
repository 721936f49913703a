//! A picture of the trajectories of robots.

use crate::scenario::{Outline, Shape, WorldSection};

use super::history::History;
use super::svg::{Svg, color};

/// Longer side of the world in the picture.
const SIDE: f64 = 900.0;
const MARGIN: f64 = 10.0;

/// The largest number of trajectories that are drawn. If there are more robots, an even selection
/// is drawn.
const WAYS_MAX: usize = 500;

/// The gray of black paint, light enough that trajectories are visible on it.
const BLACK: f64 = 80.0;

/// The color of movable discs, other than that of obstacles.
const MOVABLE: &str = "sienna";

/// Draws the world with its paint, obstacles and lights, and the trajectory of each robot, with a ring at its
/// start and a dot at its end. A movable disc has a thin outline at its start, its path, and a thick
/// outline at its end.
pub fn trajectories(world: &WorldSection, history: &History) -> String {
    let [width, height] = world.size;
    let scale = SIDE / width.max(height);
    let place = |[x, y]: [f64; 2]| {
        [MARGIN + (x + width / 2.0) * scale, MARGIN + (height / 2.0 - y) * scale]
    };
    let mut svg = Svg::new(width * scale + 2.0 * MARGIN, height * scale + 2.0 * MARGIN);
    if !world.ground.is_empty() {
        // Paint may reach beyond the world.
        svg.put(format_args!(
            "<clipPath id=\"world\"><rect x=\"{MARGIN}\" y=\"{MARGIN}\" width=\"{:.1}\" height=\"{:.1}\"/></clipPath>\n\
             <g clip-path=\"url(#world)\">\n",
            width * scale,
            height * scale
        ));
    }
    for patch in &world.ground {
        let gray = BLACK + (255.0 - BLACK) * patch.brightness;
        fill(&mut svg, patch.shape, place, scale, &format!("rgb({gray:.0},{gray:.0},{gray:.0})"));
    }
    if !world.ground.is_empty() {
        svg.put(format_args!("</g>\n"));
    }
    svg.put(format_args!(
        "<rect x=\"{MARGIN}\" y=\"{MARGIN}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"black\"/>\n",
        width * scale,
        height * scale
    ));
    for light in &world.lights {
        let [x, y] = place(light.at);
        svg.put(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\" fill=\"gold\"/>\n"));
    }
    for obstacle in &world.obstacles {
        match obstacle.outline {
            Outline::Shape(shape) => fill(&mut svg, shape, place, scale, "silver"),
            Outline::Wall(from, to) => svg.line([place(from), place(to)].into_iter(), "black", 2.0),
        }
    }
    for (number, movable) in world.movables.iter().enumerate() {
        let centers = history.movables.iter().filter_map(|sample| sample.get(number));
        let points: Vec<[f64; 2]> = centers.map(|at| place(at.map(f64::from))).collect();
        let radius = movable.radius * scale;
        let start = place(movable.at);
        for ([x, y], width) in [(start, 0.5), (points.last().copied().unwrap_or(start), 2.0)] {
            svg.put(format_args!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"none\" stroke=\"{MOVABLE}\" \
                 stroke-width=\"{width}\"/>\n"
            ));
        }
        svg.line(thinned(&points), MOVABLE, 1.0);
    }
    let robots = history.places.first().map_or(0, Vec::len);
    let step = robots.div_ceil(WAYS_MAX).max(1);
    for robot in 0..robots {
        let places = history.places.iter().filter_map(|sample| *sample.get(robot)?);
        let points: Vec<[f64; 2]> =
            places.map(|[x, y]| place([f64::from(x), f64::from(y)])).collect();
        let (Some([x, y]), Some([from_x, from_y])) = (points.last(), points.first()) else {
            continue;
        };
        let color = color(robot);
        svg.put(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{color}\"/>\n"));
        if robot % step == 0 {
            svg.put(format_args!(
                "<circle cx=\"{from_x:.1}\" cy=\"{from_y:.1}\" r=\"3\" fill=\"none\" stroke=\"{color}\"/>\n"
            ));
            svg.line(thinned(&points), &color, 1.0);
        }
    }
    svg.finish()
}

/// Fills a shape with a color. `place` and `scale` convert places and lengths to those of the
/// picture.
fn fill(
    svg: &mut Svg,
    shape: Shape,
    place: impl Fn([f64; 2]) -> [f64; 2],
    scale: f64,
    color: &str,
) {
    match shape {
        Shape::Disc { at, radius } => {
            let ([x, y], radius) = (place(at), radius * scale);
            svg.put(format_args!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{color}\"/>\n"
            ));
        }
        Shape::Block { at, size, heading } => {
            let ([x, y], [width, height]) = (place(at), size.map(|side| side * scale));
            let (left, top) = (x - width / 2.0, y - height / 2.0);
            // A positive angle is clockwise in SVG.
            let turn = match heading {
                0.0 => String::new(),
                _ => format!(" transform=\"rotate({} {x:.1} {y:.1})\"", -heading),
            };
            svg.put(format_args!(
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" \
                 fill=\"{color}\"{turn}/>\n"
            ));
        }
    }
}

/// Leaves out points that are too near to the one before to be distinguished.
fn thinned(points: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> {
    let mut last: Option<[f64; 2]> = None;
    points.iter().copied().filter(move |[x, y]| {
        let is_new = last.is_none_or(|last| (x - last[0]).hypot(y - last[1]) > 0.5);
        if is_new {
            last = Some([*x, *y]);
        }
        is_new
    })
}
