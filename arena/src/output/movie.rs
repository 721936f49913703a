//! Pictures of robots at a time, and over time as a picture that moves.

use std::fmt::Write;

use crate::run::{Simulation, TICKS_PER_SECOND};
use crate::scenario::WorldSection;

use super::backdrop::Backdrop;
use super::svg::{LEDS, Svg};

/// The color of movable discs.
const MOVABLE: &str = "sienna";

/// The least radius of a robot in the picture, so that it is visible in a large world.
const RADIUS_MIN: f64 = 2.0;

/// A robot in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FrameRobot {
    /// The place in mm.
    at: [f32; 2],
    /// The heading in degrees, counter-clockwise.
    heading_degrees: f32,
    led: u8,
}

/// Robots and movable discs at a time.
#[derive(Clone, Debug, PartialEq)]
struct Frame {
    /// The time in seconds.
    time: f64,
    /// `None` for a robot that has not joined.
    robots: Vec<Option<FrameRobot>>,
    /// The centers of the discs in mm.
    movables: Vec<[f32; 2]>,
}

/// The states of a run at some times, as a picture in SVG. With one state it stands still; with
/// several ones it moves in every program that animates SVG, such as a browser.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Movie {
    frames: Vec<Frame>,
    /// The radius of each robot in mm; `None` for one that has not joined yet.
    radii: Vec<Option<f32>>,
}

impl Movie {
    /// Adds the current state of a run.
    pub fn add(&mut self, simulation: &Simulation) {
        let views = (0..simulation.robot_count()).map(|robot| simulation.view(robot));
        self.radii.resize(simulation.robot_count(), None);
        let mut robots = Vec::with_capacity(simulation.robot_count());
        for (view, radius) in views.zip(&mut self.radii) {
            *radius = radius.or(view.as_ref().map(|view| view.radius_mm));
            robots.push(view.map(|view| FrameRobot {
                at: [view.pose.x, view.pose.y],
                heading_degrees: view.pose.heading.to_degrees(),
                led: view.led,
            }));
        }
        let time = simulation.now() as f64 / TICKS_PER_SECOND;
        let movables = simulation.movables().map(|disc| [disc.x, disc.y]).collect();
        self.frames.push(Frame { time, robots, movables });
    }

    /// Draws the world with its robots, which are filled with the color of their LEDs and have a
    /// line to their front. The movie lasts as long as the run that it shows, divided by `speed`,
    /// and begins again at its end.
    pub fn draw(&self, world: &WorldSection, speed: f64) -> String {
        let (mut svg, backdrop) = Backdrop::draw(world);
        let times = self.frames.first().zip(self.frames.last());
        let seconds = times.map_or(0.0, |(first, last)| (last.time - first.time) / speed);
        for (number, movable) in world.movables.iter().enumerate() {
            let centers = self.frames.iter().filter_map(|frame| frame.movables.get(number));
            let places: Vec<[f64; 2]> =
                centers.map(|at| backdrop.place(at.map(f64::from))).collect();
            let Some([x, y]) = places.first() else { continue };
            svg.put(format_args!(
                "<g transform=\"translate({x:.1} {y:.1})\"><circle r=\"{:.1}\" fill=\"none\" stroke=\"{MOVABLE}\" \
                 stroke-width=\"2\"/>",
                movable.radius * backdrop.scale
            ));
            put_ways(&mut svg, places.iter().map(|place| Some(*place)), seconds);
            svg.put(format_args!("</g>\n"));
        }
        for (number, radius) in self.radii.iter().enumerate() {
            let Some(radius) = radius else { continue };
            let radius = (f64::from(*radius) * backdrop.scale).max(RADIUS_MIN);
            let robots =
                self.frames.iter().map(|frame| frame.robots.get(number).copied().flatten());
            put_robot(&mut svg, &backdrop, radius, &robots.collect::<Vec<_>>(), seconds);
        }
        svg.finish()
    }
}

/// Draws a robot with that radius. `frames` has it at equal intervals, which take `seconds`
/// together.
fn put_robot(
    svg: &mut Svg,
    backdrop: &Backdrop,
    radius: f64,
    frames: &[Option<FrameRobot>],
    seconds: f64,
) {
    // Before a robot joins it is hidden at its first place.
    let first = frames.iter().flatten().next().expect("a robot with a radius is in a frame");
    let [x, y] = backdrop.place(first.at.map(f64::from));
    // A positive angle is clockwise in SVG.
    let turns: Vec<f64> = unwound(
        frames.iter().map(|robot| -f64::from(robot.as_ref().unwrap_or(first).heading_degrees)),
    );
    let color = LEDS[usize::from(first.led) % LEDS.len()];
    let hidden = if frames[0].is_none() { " visibility=\"hidden\"" } else { "" };
    svg.put(format_args!("<g transform=\"translate({x:.1} {y:.1})\"{hidden}>"));
    let places = frames.iter().map(|robot| Some(backdrop.place(robot.as_ref()?.at.map(f64::from))));
    put_ways(svg, places, seconds);
    put_changes(
        svg,
        "visibility",
        frames.iter().map(|robot| match robot {
            Some(_) => "visible",
            None => "hidden",
        }),
        seconds,
    );
    svg.put(format_args!(
        "<circle r=\"{radius:.1}\" fill=\"{color}\" stroke=\"#444\" stroke-width=\"0.7\">"
    ));
    put_changes(
        svg,
        "fill",
        frames
            .iter()
            .map(|robot| LEDS[usize::from(robot.as_ref().unwrap_or(first).led) % LEDS.len()]),
        seconds,
    );
    svg.put(format_args!(
        "</circle><path d=\"M0 0H{radius:.1}\" stroke=\"#444\" transform=\"rotate({:.0})\">",
        turns[0]
    ));
    let values = turns.iter().map(|turn| format!("{turn:.0}"));
    put_transform(svg, "rotate", values, seconds);
    svg.put(format_args!("</path></g>\n"));
}

/// Lets an element move from place to place. It stays where it is without a place.
fn put_ways(svg: &mut Svg, places: impl Iterator<Item = Option<[f64; 2]>>, seconds: f64) {
    let places: Vec<_> = places.collect();
    let Some(mut last) = places.iter().flatten().next().copied() else { return };
    let values = places.iter().map(|place| {
        last = place.unwrap_or(last);
        format!("{:.1} {:.1}", last[0], last[1])
    });
    put_transform(svg, "translate", values, seconds);
}

/// Animates a transformation of an element, if it changes.
fn put_transform(svg: &mut Svg, kind: &str, values: impl Iterator<Item = String>, seconds: f64) {
    let values: Vec<String> = values.collect();
    if values.iter().any(|value| *value != values[0]) {
        svg.put(format_args!(
            "<animateTransform attributeName=\"transform\" type=\"{kind}\" values=\"{}\" dur=\"{seconds:.3}s\" \
             repeatCount=\"indefinite\"/>",
            values.join(";")
        ));
    }
}

/// Animates an attribute that jumps from value to value, if it changes.
fn put_changes<'a>(
    svg: &mut Svg,
    attribute: &str,
    values: impl Iterator<Item = &'a str>,
    seconds: f64,
) {
    let values: Vec<&str> = values.collect();
    let mut changes = String::new();
    let mut moments = String::new();
    for (number, value) in values.iter().enumerate() {
        if number == 0 || values[number - 1] != *value {
            let separator = if number == 0 { "" } else { ";" };
            let share = number as f64 / (values.len() - 1).max(1) as f64;
            write!(changes, "{separator}{value}").expect("a string accepts all text");
            write!(moments, "{separator}{share:.4}").expect("a string accepts all text");
        }
    }
    if changes.contains(';') {
        svg.put(format_args!(
            "<animate attributeName=\"{attribute}\" calcMode=\"discrete\" values=\"{changes}\" keyTimes=\"{moments}\" \
             dur=\"{seconds:.3}s\" repeatCount=\"indefinite\"/>"
        ));
    }
}

/// Returns angles in degrees, each less than half a turn from the one before.
fn unwound(angles: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut last: Option<f64> = None;
    let near = |angle: f64, last: f64| angle + ((last - angle) / 360.0).round() * 360.0;
    angles
        .map(|angle| {
            let angle = last.map_or(angle, |last| near(angle, last));
            last = Some(angle);
            angle
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_turns_the_short_way() {
        assert_eq!(unwound([170.0, -170.0, 175.0].into_iter()), [170.0, 190.0, 175.0]);
        assert_eq!(unwound([-170.0, 170.0].into_iter()), [-170.0, -190.0]);
        assert_eq!(unwound([0.0, 720.0].into_iter()), [0.0, 0.0]);
    }

    #[test]
    fn an_attribute_jumps_when_it_changes() {
        let text = |values: &[&str]| {
            let mut svg = Svg::new(1.0, 1.0);
            put_changes(&mut svg, "fill", values.iter().copied(), 4.0);
            svg.finish()
        };
        let changing = text(&["red", "red", "blue", "blue", "red"]);
        assert!(
            changing.contains(
                "values=\"red;blue;red\" keyTimes=\"0.0000;0.5000;1.0000\" dur=\"4.000s\""
            ),
            "{changing}"
        );
        assert!(!text(&["red", "red"]).contains("animate"));
        assert!(!text(&["red"]).contains("animate"));
    }
}
