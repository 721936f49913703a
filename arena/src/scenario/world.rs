//! `[world]`: the ground, its paint, the obstacles on it, light and time.

use bittybuzz_toml_reader::{TomlError, number_text};
use toml::de::DeValue;

use super::error::ScenarioCause;
use super::keys::{LIGHT, OBSTACLE, PATCH, WORLD};
use super::read::{Entry, Section};
use super::time::seconds;

/// The ground under the robots: a rectangle with walls around it and (0, 0) in its middle.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldSection {
    /// Width and height in mm.
    pub size: [f64; 2],
    /// The painted parts of the ground, later ones over earlier ones. The rest is white.
    pub ground: Vec<PatchSection>,
    /// The obstacles that never move.
    pub obstacles: Vec<ObstacleSection>,
    /// The obstacles that robots push, where they are at the start.
    pub movables: Vec<MovableSection>,
    /// The lights at the start.
    pub lights: Vec<LampSection>,
    /// Ambient light, 0 to 1023 in the units of a robot's sensor.
    pub ambient: f64,
    /// The seed of all random numbers.
    pub seed: u32,
    /// The duration of the run in seconds.
    pub duration: f64,
}

/// An obstacle, which robots cannot pass through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObstacleSection {
    /// The place and size on the ground.
    pub outline: Outline,
    /// The height in mm at and above which robots pass over it; `None` if they cannot.
    pub height: Option<f64>,
}

/// The outline of an obstacle, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outline {
    Shape(Shape),
    /// A thin wall between two points.
    Wall([f64; 2], [f64; 2]),
}

/// A disc that robots push.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovableSection {
    /// The center in mm.
    pub at: [f64; 2],
    /// The radius in mm.
    pub radius: f64,
    /// The height in mm at and above which robots pass over it; `None` if they cannot.
    pub height: Option<f64>,
}

/// A shape on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A disc.
    Disc {
        /// The center in mm.
        at: [f64; 2],
        /// The radius in mm.
        radius: f64,
    },
    /// A rectangle.
    Block {
        /// The center in mm.
        at: [f64; 2],
        /// Width and height in mm.
        size: [f64; 2],
        /// The direction of the width in degrees, 0 along x, anticlockwise.
        heading: f64,
    },
}

/// A painted part of the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchSection {
    pub shape: Shape,
    /// 0 (black) to 1 (white).
    pub brightness: f64,
}

/// A lamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LampSection {
    /// The position in mm.
    pub at: [f64; 2],
    /// The reading of a sensor next to the lamp that faces it, 0 to 1023.
    pub brightness: f64,
}

/// The valid sides of the world in mm: from 10 mm to 1 km.
const EXTENT: std::ops::RangeInclusive<f64> = 10.0..=1e6;

/// The valid brightnesses: the readings of a 10-bit sensor.
const BRIGHTNESS: std::ops::RangeInclusive<f64> = 0.0..=1023.0;

/// The valid durations in seconds: at most four weeks.
const DURATION: std::ops::RangeInclusive<f64> = 0.1..=2_419_200.0;

/// Reads the world. Returns with it the places of its movable discs in the file, in their order.
pub fn read<'a>(root: &Section<'a>) -> Option<(WorldSection, Vec<Entry<'a>>)> {
    let Some(section) = root.section("world", WORLD) else {
        if root.get("world").is_none() {
            root.fail(TomlError::MissingKey { key: "world", section: root.name });
        }
        return None;
    };
    let size = section.required("size").and_then(|entry| entry.numbers(SIZE, EXTENT));
    let duration = section.required("duration").and_then(|entry| seconds(&entry, DURATION));
    let mut world = WorldSection {
        size: size.unwrap_or([1e6; 2]),
        ground: Vec::new(),
        obstacles: Vec::new(),
        movables: Vec::new(),
        lights: Vec::new(),
        ambient: section.number("ambient", BRIGHTNESS).unwrap_or(0.0),
        seed: section.integer("seed", 0..=u32::MAX).unwrap_or(1),
        // Without a valid duration, no time in the file is after the end.
        duration: duration.unwrap_or(*DURATION.end()),
    };
    for item in section.get("ground").and_then(|entry| entry.list()).unwrap_or_default() {
        world.ground.extend(patch(&item, &world));
    }
    let mut movables = Vec::new();
    for item in section.get("obstacles").and_then(|entry| entry.list()).unwrap_or_default() {
        match obstacle(&item, &world) {
            Some(Obstacle::Fixed(obstacle)) => world.obstacles.push(obstacle),
            Some(Obstacle::Movable(movable)) => {
                world.movables.push(movable);
                movables.push(item);
            }
            // The reader has reported the mistake.
            None => {}
        }
    }
    for item in section.get("lights").and_then(|entry| entry.list()).unwrap_or_default() {
        world.lights.extend(light(&item, &world));
    }
    Some((world, movables))
}

const SIZE: &str = "two numbers as [width, height]";

fn patch(entry: &Entry<'_>, world: &WorldSection) -> Option<PatchSection> {
    let section = entry.section(PATCH)?;
    let brightness = section.number("brightness", 0.0..=1.0).unwrap_or(0.0);
    let (key, size) = section.one_of(&["radius", "size"])?;
    Some(PatchSection { shape: shape(&section, key, &size, world)?, brightness })
}

enum Obstacle {
    Fixed(ObstacleSection),
    Movable(MovableSection),
}

fn obstacle(entry: &Entry<'_>, world: &WorldSection) -> Option<Obstacle> {
    let section = entry.section(OBSTACLE)?;
    let height = section.number("height", 1.0..=1e6);
    let movable = section.get("movable").filter(|entry| entry.boolean() == Some(true));
    let outline = outline(&section, world);
    let Some(movable) = movable else {
        return Some(Obstacle::Fixed(ObstacleSection { outline: outline?, height }));
    };
    let Outline::Shape(Shape::Disc { at, radius }) = outline? else {
        movable.fail(ScenarioCause::MovableNotDisc);
        return None;
    };
    Some(Obstacle::Movable(MovableSection { at, radius, height }))
}

fn outline(section: &Section<'_>, world: &WorldSection) -> Option<Outline> {
    let (key, size) = section.one_of(&["radius", "size", "from"])?;
    for (other, needs) in [("at", "radius"), ("heading", "size")] {
        if let Some(stray) = section.get(other).filter(|_| key == "from") {
            stray.fail(ScenarioCause::Without { key: other, needs });
        }
    }
    if key == "from" {
        let to = section.required("to").and_then(|entry| point_inside(&entry, world));
        return Some(Outline::Wall(point_inside(&size, world)?, to?));
    }
    if let Some(stray) = section.get("to") {
        stray.fail(ScenarioCause::Without { key: "to", needs: "from" });
    }
    shape(section, key, &size, world).map(Outline::Shape)
}

/// Reads a disc or a box, whose `key` with the size is `radius` or `size`.
fn shape(
    section: &Section<'_>,
    key: &str,
    size: &Entry<'_>,
    world: &WorldSection,
) -> Option<Shape> {
    let at = section.required("at").and_then(|entry| point_inside(&entry, world));
    if key == "radius" {
        if let Some(stray) = section.get("heading") {
            stray.fail(ScenarioCause::Without { key: "heading", needs: "size" });
        }
        return Some(Shape::Disc { radius: size.number(1.0..=1e6)?, at: at? });
    }
    let heading = section.number("heading", -360.0..=360.0).unwrap_or(0.0);
    Some(Shape::Block { size: size.numbers(SIZE, 1.0..=1e6)?, at: at?, heading })
}

/// Reads a lamp: a table, or only its position.
pub fn light(entry: &Entry<'_>, world: &WorldSection) -> Option<LampSection> {
    if let DeValue::Array(_) = entry.value {
        return Some(LampSection {
            at: point_inside(entry, world)?,
            brightness: *BRIGHTNESS.end(),
        });
    }
    let section = entry.section(LIGHT)?;
    let at = section.required("at").and_then(|entry| point_inside(&entry, world));
    let brightness = section.number("brightness", BRIGHTNESS).unwrap_or(*BRIGHTNESS.end());
    Some(LampSection { at: at?, brightness })
}

impl MovableSection {
    /// Returns the outline at the start.
    pub fn outline(&self) -> Outline {
        Outline::Shape(Shape::Disc { at: self.at, radius: self.radius })
    }
}

/// Reads a point, which must be within the world.
pub fn point_inside(entry: &Entry<'_>, world: &WorldSection) -> Option<[f64; 2]> {
    let point = entry.numbers("two numbers as [x, y]", f64::MIN..=f64::MAX)?;
    inside(entry, point, world)
}

/// Returns a point of a value, which must be within the world.
pub fn inside(entry: &Entry<'_>, point: [f64; 2], world: &WorldSection) -> Option<[f64; 2]> {
    if !world.contains(point) {
        let [x, y] = point;
        entry.fail(world.outside(format!("({}, {})", number_text(x), number_text(y))));
        return None;
    }
    Some(point)
}

impl WorldSection {
    /// Returns true if a point is on the ground.
    pub fn contains(&self, [x, y]: [f64; 2]) -> bool {
        2.0 * x.abs() <= self.size[0] && 2.0 * y.abs() <= self.size[1]
    }

    pub(super) fn outside(&self, what: String) -> ScenarioCause {
        ScenarioCause::OutsideWorld { what, size: self.size.map(|side| side as u32) }
    }
}
