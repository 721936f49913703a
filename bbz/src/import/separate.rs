//! Robots with given places that would start in each other or in an obstacle.
//!
//! ARGoS accepts such robots, and its physics pushes them apart; a scenario with them is refused.
//! They get the nearest free places. Movable discs, which a scenario also refuses in each other and in
//! obstacles, stand still.

use std::collections::HashMap;

use super::arena::{Arena, mm};
use super::distribute::Drawing;
use super::document::Element;
use super::group::Placement;
use super::obstacle::Obstacle;

/// The overlap in mm that the simulator tolerates.
const SLACK: f64 = 0.05;

/// Rings around a place on which a free one is searched, half a radius apart, and places on each.
const RINGS: u32 = 200;
const DIRECTIONS: u32 = 24;

/// The robots that have a place, by square cells of the ground.
struct Ground<'a> {
    obstacles: &'a [Obstacle],
    /// The side of a cell in mm: a robot reaches at most into the adjacent cells.
    side: f64,
    cells: HashMap<[i64; 2], Vec<([f64; 2], f64)>>,
}

impl Ground<'_> {
    fn cell(&self, place: [f64; 2]) -> [i64; 2] {
        place.map(|axis| (axis / self.side).floor() as i64)
    }

    fn is_free(&self, place: [f64; 2], radius: f64) -> bool {
        let [column, row] = self.cell(place);
        let near = (-1..=1).flat_map(|x| (-1..=1).map(move |y| [column + x, row + y]));
        let mut robots = near.filter_map(|cell| self.cells.get(&cell)).flatten();
        let is_apart = |([x, y], other): &([f64; 2], f64)| {
            (x - place[0]).hypot(y - place[1]) >= radius + other
        };
        robots.all(is_apart) && self.obstacles.iter().all(|one| one.gap(place) >= radius)
    }

    /// Returns the nearest free place, or `None` if the search has found none.
    fn nearest(&self, place: [f64; 2], radius: f64, drawing: &mut Drawing) -> Option<[f64; 2]> {
        let places = (1..=RINGS).flat_map(|ring| {
            (0..DIRECTIONS).map(move |direction| {
                let turn = f64::from(direction) / f64::from(DIRECTIONS) * std::f64::consts::TAU;
                let distance = f64::from(ring) * radius / 2.0;
                [mm(place[0] + distance * turn.cos()), mm(place[1] + distance * turn.sin())]
            })
        });
        let mut places = places.take_while(|_| drawing.check(1 + self.obstacles.len()));
        places.find(|place| self.is_free(*place, radius))
    }
}

/// Moves robots apart, and lists the moved ones.
pub fn separate(section: Element<'_>, arena: &mut Arena<'_>, drawing: &mut Drawing) {
    let Arena { obstacles, groups, .. } = arena;
    let widest = groups.iter().map(|group| group.radius).fold(0.0, f64::max);
    let mut ground = Ground { obstacles, side: 2.0 * widest.max(1.0), cells: HashMap::new() };
    for group in groups {
        let (mut is_moved, radius) = (false, group.radius);
        let Placement::List(places) = &mut group.placement else { continue };
        for place in places {
            let is_known = radius > 0.0 && drawing.check(1 + ground.obstacles.len());
            if is_known && !ground.is_free(*place, radius - SLACK) {
                let free = ground.nearest(*place, radius, drawing);
                is_moved |= free.is_some();
                *place = free.unwrap_or(*place);
            }
            ground.cells.entry(ground.cell(*place)).or_default().push((*place, radius));
        }
        if is_moved {
            section.omit_in(
                group.line,
                "start places in other robots or in obstacles",
                "`positions` has the nearest free places; ARGoS pushes bodies apart",
            );
        }
    }
}

/// Fastens movable discs that start in another obstacle, and lists them.
pub fn fasten(section: Element<'_>, arena: &mut Arena<'_>, drawing: &mut Drawing) {
    let obstacles = &mut arena.obstacles;
    for number in 0..obstacles.len() {
        let Obstacle { at, shape, is_movable: true, line, .. } = obstacles[number] else {
            continue;
        };
        let is_apart = |other: &Obstacle| other.gap(at) >= shape.radius() - SLACK;
        let (before, rest) = obstacles.split_at(number);
        let is_free =
            drawing.check(obstacles.len()) && before.iter().chain(&rest[1..]).all(is_apart);
        if !is_free {
            obstacles[number].is_movable = false;
            section.omit_in(
                line,
                "cylinders that robots can push, in each other or in obstacles",
                "they stand still here; move them apart, and add `movable = true`",
            );
        }
    }
}
