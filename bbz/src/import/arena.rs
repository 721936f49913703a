//! `<arena>`: robots, obstacles and lamps that the experiment places itself.

use super::controllers::Controllers;
use super::document::{Element, shown};
use super::group::{Group, Heading, Lamp, Link, Placement};
use super::mistake::{Allowed, Mistake};
use super::obstacle::{Obstacle, Shape};
use super::robots::{RobotKind, RobotKinds, buzz_id};

/// The greatest distance from the center of a world, and the longest side of an obstacle, in mm.
const DISTANCE_MAX: f64 = 500e3;
const SIDE_MAX: f64 = 1e6;

/// The least length and the longest range of a scenario in mm.
pub const LENGTH_MIN: f64 = 1.0;
const RANGE_MAX: f64 = 1e6;

/// The height in meters up to which an obstacle counts as standing on the ground.
pub const GROUND: f64 = 0.001;

/// The content of the arena as far as it was read.
pub struct Arena<'a> {
    pub kinds: &'a RobotKinds,
    pub controllers: Controllers<'a>,
    /// The center of the arena in meters, which is (0, 0) in the scenario.
    pub center: [f64; 2],
    /// The sides of the arena in mm.
    pub size: [f64; 2],
    /// The share of messages that Kilobots lose.
    pub kilobot_loss: Option<f64>,
    pub obstacles: Vec<Obstacle>,
    pub lamps: Vec<Lamp>,
    pub groups: Vec<Group>,
}

/// A position in meters and an orientation in degrees: around z, y and x.
#[derive(Debug, Clone, Copy)]
pub struct Pose {
    pub position: [f64; 3],
    pub orientation: [f64; 3],
}

/// A kind of entity, as far as this module has a place for it.
pub enum Entity<'a> {
    Obstacle,
    Lamp,
    Robot(&'a RobotKind),
    Other,
}

impl<'a> Arena<'a> {
    pub fn entity(&self, element: Element<'_>) -> Entity<'a> {
        match (element.name(), self.kinds.get(element.name())) {
            (_, Some(kind)) => Entity::Robot(kind),
            ("box" | "cylinder", _) => Entity::Obstacle,
            ("light", _) => Entity::Lamp,
            _ => Entity::Other,
        }
    }

    /// Reads an entity with a place of its own. Returns `None` after a mistake.
    pub fn read(&mut self, element: Element<'a>) -> Option<()> {
        match self.entity(element) {
            Entity::Obstacle => {
                let body = element.required("body").and_then(pose);
                let (shape, height) = shape(element)?;
                let pose = body?;
                let at = self.place(element, pose.position)?;
                self.obstacles.extend(stand(element, id(element), (shape, height), at, pose));
            }
            Entity::Lamp => {
                let at = element.vector_or_zero("position");
                let shines = shines(element)?;
                let at = self.place(element, at?)?;
                self.lamps.push(Lamp { name: id(element), at, shines });
            }
            Entity::Robot(kind) => self.robot(element, kind)?,
            Entity::Other => omit_other(element),
        }
        Some(())
    }

    fn robot(&mut self, element: Element<'a>, kind: &RobotKind) -> Option<()> {
        let pose = element.required("body").and_then(pose);
        let group = self.group(element, kind);
        let (pose, mut group) = (pose?, group?);
        omit_tilt(element, pose.orientation);
        if pose.position[2] > GROUND {
            omit_start_height(element);
        }
        let at = self.place(element, pose.position)?;
        group.heading = Heading::Degrees(degrees(pose.orientation[0]));
        group.placement = Placement::List(vec![at]);
        if group.is_buzz {
            group.buzz_ids.push(buzz_id(&group.name));
        }
        match self.groups.last_mut().filter(|last| is_continued(last, &group)) {
            Some(last) => {
                // A group of several robots has the name of its robot.
                last.name.clear();
                last.buzz_ids.append(&mut group.buzz_ids);
                if let Placement::List(places) = &mut last.placement {
                    places.push(at);
                }
            }
            None => self.groups.push(group),
        }
        Some(())
    }

    /// Returns a group of these robots without places.
    pub fn group(&self, element: Element<'a>, kind: &RobotKind) -> Option<Group> {
        let name = element.required_name("id");
        let program = self.controllers.program(element);
        let attribute = if kind.is_kilobot { "communication_range" } else { "rab_range" };
        let range = element.optional_number(attribute, Allowed::NotNegative);
        if let Some(size) = element.text("rab_data_size") {
            element.omit(
                format!("`rab_data_size` = {size} bytes in each step"),
                "long messages take several frames; `bbz sim` prints their share of the air",
            );
        }
        if element.first("battery").is_some() {
            element.omit("<battery>", "the file of a robot may have a sensor of kind `battery`");
        }
        let (program, range) = (program?, range?);
        // The attribute is a distance between the middles; the range of infrared light is one between
        // the rims.
        let rims = if kind.is_kilobot { 2.0 * kind.radius_mm() } else { 0.0 };
        let range = range.map(|range| mm(range * 1000.0 - rims).clamp(LENGTH_MIN, RANGE_MAX));
        let loss = if kind.is_kilobot { self.kilobot_loss } else { program.loss };
        Some(Group {
            name: name?.to_owned(),
            robot: kind.reference.clone(),
            is_kilobot: kind.is_kilobot,
            radius: kind.radius_mm(),
            script: program.script,
            is_buzz: program.is_buzz,
            first_id: None,
            buzz_ids: Vec::new(),
            placement: Placement::List(Vec::new()),
            heading: Heading::Random,
            medium: kind.medium(),
            link: Link { range, loss: loss.filter(|loss| *loss > 0.0) },
            line: element.line(),
        })
    }

    /// Returns the place of a position in the scenario.
    pub fn place(&self, element: Element<'_>, position: [f64; 3]) -> Option<[f64; 2]> {
        let place = self.offset(position);
        if place.iter().any(|axis| axis.abs() > DISTANCE_MAX) {
            element.fail(Mistake::BeyondWorld { attribute: "position" });
            return None;
        }
        Some(place)
    }

    /// Returns a position in mm from the center of the arena.
    pub fn offset(&self, [x, y, _]: [f64; 3]) -> [f64; 2] {
        [mm((x - self.center[0]) * 1000.0), mm((y - self.center[1]) * 1000.0)]
    }
}

/// Returns true if a robot belongs to the group before it.
fn is_continued(last: &Group, next: &Group) -> bool {
    let follows = || match (last.buzz_ids.last(), next.buzz_ids.first()) {
        (Some(Some(last)), Some(Some(next))) => last.checked_add(1) == Some(*next),
        (last, next) => last == next,
    };
    last.robot == next.robot
        && last.script == next.script
        && last.heading == next.heading
        && last.link == next.link
        && follows()
}

/// Returns the id of an entity for comments.
pub fn id(element: Element<'_>) -> String {
    shown(element.text("id").unwrap_or_else(|| element.name()))
}

/// Rounds a length to micrometers: products such as 1.255 * 1000 are not exact.
pub fn mm(length: f64) -> f64 {
    // The sum turns -0 into 0.
    (length * 1e3).round() / 1e3 + 0.0
}

/// Returns a direction from -180 to 180 degrees, rounded to a thousandth.
pub fn degrees(direction: f64) -> f64 {
    let direction = (direction * 1e3).round().rem_euclid(360e3) / 1e3;
    if direction > 180.0 { direction - 360.0 } else { direction }
}

fn pose(body: Element<'_>) -> Option<Pose> {
    let position = body.vector_or_zero("position");
    let orientation = body.vector_or_zero("orientation");
    Some(Pose { position: position?, orientation: orientation? })
}

/// Returns the shape of a box or a cylinder in mm, and its height in meters.
pub fn shape(element: Element<'_>) -> Option<(Shape, f64)> {
    match element.name() {
        "box" if is_pushed(element) => element.omit(
            "boxes that robots can push",
            "they stand still here; only a disc, with `at` and `radius`, can have `movable = true`",
        ),
        _ if is_pushed(element) => element.omit(
            "`mass` of cylinders that robots can push",
            "a robot pushes one as it pushes another robot",
        ),
        _ => {}
    }
    if element.first("leds").is_some() {
        element.omit("LEDs of boxes and cylinders", "add lamps to `lights` if robots need light");
    }
    let side = |length: f64| {
        let length = mm(length * 1000.0);
        if length < LENGTH_MIN {
            element.omit("sides below 1 mm", "they have 1 mm here");
        }
        length.max(LENGTH_MIN)
    };
    let is_box = element.name() == "box";
    let (shape, height) = if is_box {
        let [x, y, height] = element.required_vector("size", Allowed::Positive)?;
        (Shape::Block { size: [side(x), side(y)], heading: 0.0 }, height)
    } else {
        let radius = element.required_number("radius", Allowed::Positive);
        let height = element.required_number("height", Allowed::Positive);
        (Shape::Disc { radius: side(radius?) }, height?)
    };
    let longest = match shape {
        Shape::Block { size: [x, y], .. } => x.max(y),
        Shape::Disc { radius } => radius,
    };
    if longest.max(height * 1000.0) > SIDE_MAX {
        let attribute = if is_box { "size" } else { "radius" };
        element.fail_at(attribute, Mistake::BeyondWorld { attribute });
        return None;
    }
    Some((shape, height))
}

/// Returns true for a box or a cylinder that robots can push.
fn is_pushed(element: Element<'_>) -> bool {
    element.text("movable") == Some("true")
}

/// Returns the obstacle that stands on the ground; `None` if it does not.
pub fn stand(
    element: Element<'_>,
    name: String,
    (shape, height): (Shape, f64),
    at: [f64; 2],
    pose: Pose,
) -> Option<Obstacle> {
    omit_tilt(element, pose.orientation);
    let bottom = pose.position[2];
    let top = bottom + height;
    if bottom > GROUND || top <= 0.0 {
        let place = if top <= 0.0 { "below" } else { "above" };
        element.omit(
            format!("obstacles {place} the ground"),
            "write them into `obstacles` if robots can touch them",
        );
        return None;
    }
    Some(Obstacle {
        name,
        at,
        shape: shape.turned(pose.orientation[0]),
        height: mm(top * 1000.0).clamp(LENGTH_MIN, SIDE_MAX),
        is_movable: is_pushed(element) && matches!(shape, Shape::Disc { .. }),
        line: element.line(),
    })
}

/// Returns true if a lamp has an intensity above 0.
pub fn shines(element: Element<'_>) -> Option<bool> {
    let intensity = element.number_or("intensity", Allowed::NotNegative, 1.0)?;
    if intensity != 0.0 && intensity != 1.0 {
        element.omit(
            "`intensity` of lamps",
            "they have the greatest `brightness` here, the reading of a sensor next to the lamp",
        );
    }
    Some(intensity > 0.0)
}

pub fn omit_tilt(element: Element<'_>, [_, y, x]: [f64; 3]) {
    if y != 0.0 || x != 0.0 {
        element.omit("rotations around y and x", "only the one around z, the first number, counts");
    }
}

pub fn omit_start_height(element: Element<'_>) {
    element
        .omit("start positions above the ground", "robots start on the ground; let them take off");
}

/// Lists an entity without a place in a scenario, or a robot of an unknown kind.
pub fn omit_other(element: Element<'_>) {
    let (kind, name) = (element.name(), id(element));
    if element.first("controller").is_some() {
        element.omit(
            format!("robots of kind `{kind}`"),
            format!("import with --robot {kind}=FILE.toml; docs/own-robot.md describes the file"),
        );
        return;
    }
    match (kind, element.text("source"), element.text("path")) {
        ("floor", Some("image"), Some(path)) => element.omit(
            format!("the floor with the picture `{path}`"),
            "write its areas into `ground` of [world]",
        ),
        ("floor", ..) => element.omit(
            "the floor that loop functions paint",
            "write its areas into `ground` of [world]",
        ),
        _ => element.omit(format!("<{kind}> `{name}`"), "write an obstacle if robots can touch it"),
    }
}
