//! Space on the ground: placed bodies, obstacles and walls, and the check for robots that would
//! start inside one of them.

use std::collections::HashMap;

use crate::engine::OVERLAP_TOLERANCE_MM;

use super::error::ScenarioCause;
use super::event::{MoveTarget, ScheduledEvent, WorldChange};
use super::group::{Group, Placement, Standing};
use super::read::{Entry, Section};
use super::select::Selection;
use super::world::{MovableSection, ObstacleSection, Outline, Shape, WorldSection};

/// Placed bodies by the square cell of the ground, so that only near ones are compared. Empty cells
/// take no memory, however large the world is.
pub struct Space<'a> {
    world: &'a WorldSection,
    /// The side of a cell in mm. A body reaches at most into the adjacent cells.
    side: f64,
    cells: HashMap<[i32; 2], Vec<Standing>>,
}

impl<'a> Space<'a> {
    /// Returns the ground of a world without robots. `widest_mm` is the largest radius of the
    /// robots that will be added.
    pub fn new(world: &'a WorldSection, widest_mm: f64) -> Self {
        Space { world, side: 2.0 * widest_mm.max(1.0), cells: HashMap::new() }
    }

    fn cell_of(&self, point: [f64; 2]) -> [i32; 2] {
        point.map(|axis| (axis / self.side).floor() as i32)
    }

    /// Adds a robot at its position.
    pub fn add(&mut self, robot: Standing) {
        self.cells.entry(self.cell_of(robot.at)).or_default().push(robot);
    }

    /// Returns a robot that a body at that place would overlap by more than `slack_mm`.
    pub fn robot_at(&self, at: [f64; 2], radius_mm: f64, slack_mm: f64) -> Option<Standing> {
        let [column, row] = self.cell_of(at);
        let around = |middle: i32| middle.saturating_sub(1)..=middle.saturating_add(1);
        let mut near = around(row).flat_map(|row| around(column).map(move |column| [column, row]));
        near.find_map(|cell| {
            let mut robots = self.cells.get(&cell)?.iter();
            let touches =
                |other: &&Standing| distance(other.at, at) < radius_mm + other.radius_mm - slack_mm;
            robots.find(touches).copied()
        })
    }

    /// Returns true if a body at that place would overlap nothing.
    pub fn is_free(&self, at: [f64; 2], radius_mm: f64) -> bool {
        self.robot_at(at, radius_mm, 0.0).is_none()
            && stands_in(self.world, at, radius_mm, 0.0).is_none()
    }
}

/// A thing other than a robot that a body can overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Barrier {
    Wall,
    Obstacle,
}

/// Returns the barrier that a body at that place would overlap. For an obstacle, an overlap of up
/// to `slack_mm` is allowed.
fn stands_in(world: &WorldSection, at: [f64; 2], radius_mm: f64, slack_mm: f64) -> Option<Barrier> {
    let is_in = |disc: &MovableSection| gap(disc.outline(), at) < radius_mm - slack_mm;
    let in_movable = || world.movables.iter().any(is_in).then_some(Barrier::Obstacle);
    stands_in_fixed(world, at, radius_mm, slack_mm).or_else(in_movable)
}

/// Returns the barrier that never moves and that a body at that place would overlap.
fn stands_in_fixed(
    world: &WorldSection,
    at: [f64; 2],
    radius_mm: f64,
    slack_mm: f64,
) -> Option<Barrier> {
    let is_beyond = |axis: usize| at[axis].abs() + radius_mm - SLACK_MM > world.size[axis] / 2.0;
    if is_beyond(0) || is_beyond(1) {
        return Some(Barrier::Wall);
    }
    let is_in = |obstacle: &ObstacleSection| gap(obstacle.outline, at) < radius_mm - slack_mm;
    world.obstacles.iter().any(is_in).then_some(Barrier::Obstacle)
}

/// The overlap of bodies in contact in mm, which the engine does not correct.
const SLACK_MM: f64 = OVERLAP_TOLERANCE_MM as f64;

/// Reports the first robot of each group that would start in another robot, in an obstacle or in a
/// wall. Robots with a random placement always get a free place. Absent robots need their place
/// when they join.
pub fn check_starts(
    root: &Section<'_>,
    world: &WorldSection,
    groups: &[Group],
    events: &[ScheduledEvent],
) {
    let is_barred = |group: &Group| {
        let mut robots = group.standing();
        let barred = robots.find_map(|robot| {
            Some((robot, stands_in(world, robot.at, robot.radius_mm, SLACK_MM)?))
        });
        if let Some((robot, barrier)) = barred {
            root.reader.fail_at(&group.place, barred_by(barrier, robot, world));
        }
        barred.is_some()
    };
    let mut is_told: Vec<bool> = groups.iter().map(is_barred).collect();
    let widest_mm = groups.iter().map(Group::radius_mm).fold(0.0, f64::max);
    // Checks the robots in these ranges of their numbers, in groups that are present at the start
    // or not.
    let mut check = |robots: &Selection, is_present: bool| {
        let mut space = Space::new(world, widest_mm);
        for range in robots.ranges() {
            let first = groups.partition_point(|group| group.first_robot <= range.start);
            let groups = groups.iter().enumerate().skip(first.saturating_sub(1));
            let groups = groups.take_while(|(_, group)| group.first_robot < range.end);
            for (number, group) in groups.filter(|(_, group)| group.present == is_present) {
                let own = range.start.saturating_sub(group.first_robot)
                    ..(range.end - group.first_robot).min(group.count);
                for robot in group.standing_in(own) {
                    let other = space.robot_at(robot.at, robot.radius_mm, SLACK_MM);
                    if let Some(other) = other.filter(|_| !is_told[number]) {
                        is_told[number] = true;
                        root.reader.fail_at(&group.place, overlap(group, robot, other));
                    }
                    space.add(robot);
                }
            }
        }
    };
    let count = groups.last().map_or(0, Group::end);
    check(&Selection::all(count), true);
    for event in events {
        if let WorldChange::Join(robots) = &event.action {
            check(robots, false);
        }
    }
}

/// Reports movable discs that would start in a wall, in an obstacle or in another movable disc.
/// `entries` are their places in the file.
pub fn check_movables(world: &WorldSection, entries: &[Entry<'_>]) {
    let widest_mm = world.movables.iter().map(|disc| disc.radius).fold(0.0, f64::max);
    let mut space = Space::new(world, widest_mm);
    let discs = world.movables.iter().zip(entries);
    for (id, (&MovableSection { at, radius, .. }, entry)) in (0..).zip(discs) {
        let barrier = match stands_in_fixed(world, at, radius, SLACK_MM) {
            Some(Barrier::Wall) => Some("the wall of the world".to_owned()),
            Some(Barrier::Obstacle) => Some("an obstacle".to_owned()),
            None => {
                let other = space.robot_at(at, radius, SLACK_MM);
                other.map(|other| format!("the one at {}", place_text(other.at)))
            }
        };
        if let Some(barrier) = barrier {
            let (at, radius) = (place_text(at), short(radius));
            entry.fail(ScenarioCause::MovableBarred { at, radius, barrier });
        }
        space.add(Standing { at, radius_mm: radius, id });
    }
}

/// Reports a move of one robot to a place in an obstacle or in a wall. The destinations of several
/// robots, and of all moves with `by`, depend on the run and are not checked.
pub fn check_move(
    section: &Section<'_>,
    world: &WorldSection,
    groups: &[Group],
    action: &WorldChange,
) {
    // Other changes name no place, and the places of several robots depend on the run.
    let WorldChange::Move { robots, to: MoveTarget::To(at), .. } = action else { return };
    let (1, Some(number)) = (robots.count(), robots.iter().next()) else { return };
    let after = groups.partition_point(|group| group.first_robot as usize <= number);
    let Some(group) = groups[..after].last() else { return };
    let id = u32::from(group.first_id) + (number as u32 - group.first_robot);
    let robot = Standing { at: *at, radius_mm: group.radius_mm(), id };
    if let (Some(barrier), Some(entry)) =
        (stands_in(world, *at, robot.radius_mm, SLACK_MM), section.get("to"))
    {
        entry.fail(barred_by(barrier, robot, world));
    }
}

fn barred_by(barrier: Barrier, robot: Standing, world: &WorldSection) -> ScenarioCause {
    let Standing { at, radius_mm, id } = robot;
    let (at, radius) = (place_text(at), short(radius_mm));
    match barrier {
        Barrier::Wall => {
            let most = world.size.map(|side| short((side / 2.0 - robot.radius_mm).max(0.0)));
            ScenarioCause::InWall { id, at, radius, most }
        }
        Barrier::Obstacle => ScenarioCause::InObstacle { id, at, radius },
    }
}

fn overlap(group: &Group, robot: Standing, other: Standing) -> ScenarioCause {
    let ids = u32::from(group.first_id)..u32::from(group.first_id) + group.count;
    let apart = robot.radius_mm + other.radius_mm;
    // The spacing of this group does not affect overlaps with robots of other groups.
    let key = match group.placement {
        _ if !ids.contains(&other.id) => None,
        Placement::Grid { .. } | Placement::Hexagonal { .. } | Placement::Line { .. } => {
            Some(("spacing", apart))
        }
        Placement::Circle { .. } => {
            let half_turn = std::f64::consts::PI / f64::from(group.count);
            Some(("radius", apart / 2.0 / libm::sin(half_turn)))
        }
        Placement::Random { .. } | Placement::List(_) => None,
    };
    ScenarioCause::Overlap {
        robots: Box::new([(other.id, place_text(other.at)), (robot.id, place_text(robot.at))]),
        apart: length_up(apart),
        least: key.map(|(key, least)| (key, length_up(least))),
    }
}

fn place_text(at: [f64; 2]) -> String {
    let [x, y] = at.map(short);
    format!("({x}, {y})")
}

/// Formats a length in mm with at most two decimals.
fn short(length: f64) -> String {
    let rounded = (length * 100.0).round() / 100.0;
    // The sum turns -0 into 0.
    (rounded + 0.0).to_string()
}

/// Formats a length in mm with at most one decimal, rounded up.
pub fn length_up(length: f64) -> String {
    // Radii are binary32 numbers, so 25.4 mm may be a little more.
    ((length * 10.0 - 1e-3).ceil() / 10.0).to_string()
}

fn distance(one: [f64; 2], other: [f64; 2]) -> f64 {
    libm::hypot(one[0] - other[0], one[1] - other[1])
}

/// Returns the distance from a point to an obstacle; at most 0 inside.
fn gap(outline: Outline, point: [f64; 2]) -> f64 {
    match outline {
        Outline::Shape(Shape::Disc { at, radius }) => distance(at, point) - radius,
        Outline::Shape(Shape::Block { at, size, heading }) => {
            let (sin, cos) = libm::sincos(heading.to_radians());
            let [dx, dy] = [point[0] - at[0], point[1] - at[1]];
            let here = [dx * cos + dy * sin, dy * cos - dx * sin];
            let beyond = |axis: usize| (here[axis].abs() - size[axis] / 2.0).max(0.0);
            libm::hypot(beyond(0), beyond(1))
        }
        Outline::Wall(from, to) => {
            let along = [to[0] - from[0], to[1] - from[1]];
            let length = along[0] * along[0] + along[1] * along[1];
            let dot = (point[0] - from[0]) * along[0] + (point[1] - from[1]) * along[1];
            let part = if length > 0.0 { (dot / length).clamp(0.0, 1.0) } else { 0.0 };
            distance([from[0] + part * along[0], from[1] + part * along[1]], point)
        }
    }
}
