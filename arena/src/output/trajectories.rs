//! A picture of the trajectories of robots.

use crate::scenario::WorldSection;

use super::backdrop::Backdrop;
use super::history::History;
use super::svg::color;

/// The largest number of trajectories that are drawn. If there are more robots, an even selection
/// is drawn.
const WAYS_MAX: usize = 500;

/// The color of movable discs, other than that of obstacles.
const MOVABLE: &str = "sienna";

/// Draws the world with its paint, obstacles and lights, and the trajectory of each robot, with a ring at its
/// start and a dot at its end. A movable disc has a thin outline at its start, its path, and a thick
/// outline at its end.
pub fn trajectories(world: &WorldSection, history: &History) -> String {
    let (mut svg, backdrop) = Backdrop::draw(world);
    for (number, movable) in world.movables.iter().enumerate() {
        let centers = history.movables.iter().filter_map(|sample| sample.get(number));
        let points: Vec<[f64; 2]> = centers.map(|at| backdrop.place(at.map(f64::from))).collect();
        let radius = movable.radius * backdrop.scale;
        let start = backdrop.place(movable.at);
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
        let points: Vec<[f64; 2]> = places.map(|at| backdrop.place(at.map(f64::from))).collect();
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
