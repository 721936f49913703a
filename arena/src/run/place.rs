//! Where the robots of a run start.

use crate::engine::{Pose, Stream};
use crate::scenario::{Cause, Group, Heading, Obstacle, Placement, Scenario, ScenarioError};

use super::settings::radius;

/// Places that are tried for one robot before the world counts as full.
const TRIES: usize = 2000;

/// Parts a run's seed for placement from all its other streams.
const PLACEMENT: u64 = 0x706c_6163_656d_656e;

/// The poses of all robots, in the order of the scenario.
pub fn poses(scenario: &Scenario, seed: u64) -> Result<Vec<Pose>, ScenarioError> {
    let mut taken = Taken::new(scenario);
    // Whoever has a place of its own keeps it; chance looks for the rest.
    for group in &scenario.groups {
        for point in group.placement.points(group.count) {
            taken.add(point, radius(group));
        }
    }
    let mut poses = Vec::new();
    for (number, group) in scenario.groups.iter().enumerate() {
        let mut chance = Stream::for_brain(seed ^ PLACEMENT, number as u16);
        let points: Vec<[f64; 2]> = match group.placement {
            Placement::Random { at, area } => taken.scatter(group, at, area, &mut chance)?,
            _ => group.placement.points(group.count).collect(),
        };
        poses.extend(points.into_iter().map(|[x, y]| {
            let heading = match group.heading {
                Heading::Degrees(degrees) => degrees.to_radians() as f32,
                Heading::Random => (chance.unit() * 2.0 - 1.0) * std::f32::consts::PI,
            };
            Pose::new(x as f32, y as f32, heading)
        }));
    }
    Ok(poses)
}

/// Bodies that have a place, in a grid, so that only near ones are looked at.
struct Taken<'a> {
    scenario: &'a Scenario,
    /// Side of a cell in mm; no body reaches beyond a neighbouring one.
    cell: f64,
    columns: usize,
    rows: usize,
    cells: Vec<Vec<([f64; 2], f64)>>,
}

impl<'a> Taken<'a> {
    fn new(scenario: &'a Scenario) -> Self {
        let radii = scenario.groups.iter().map(radius);
        let [width, height] = scenario.world.size;
        // Not more cells than a million, however large the world.
        let cell = (2.0 * radii.fold(1.0, f64::max)).max(width.max(height) / 1000.0);
        let columns = (width / cell) as usize + 1;
        let rows = (height / cell) as usize + 1;
        let cells = vec![Vec::new(); columns * rows];
        Taken { scenario, cell, columns, rows, cells }
    }

    fn cell_of(&self, point: [f64; 2]) -> (usize, usize) {
        let [width, height] = self.scenario.world.size;
        let column = ((point[0] + width / 2.0) / self.cell) as usize;
        let row = ((point[1] + height / 2.0) / self.cell) as usize;
        (column.min(self.columns - 1), row.min(self.rows - 1))
    }

    fn add(&mut self, point: [f64; 2], radius: f64) {
        let (column, row) = self.cell_of(point);
        self.cells[row * self.columns + column].push((point, radius));
    }

    fn is_free(&self, point: [f64; 2], radius: f64) -> bool {
        let (column, row) = self.cell_of(point);
        let columns = column.saturating_sub(1)..=(column + 1).min(self.columns - 1);
        let rows = row.saturating_sub(1)..=(row + 1).min(self.rows - 1);
        let mut near = rows.flat_map(|row| columns.clone().map(move |column| (column, row)));
        let touches = |(other, size): &([f64; 2], f64)| distance(*other, point) < radius + size;
        let is_taken =
            near.any(|(column, row)| self.cells[row * self.columns + column].iter().any(touches));
        let obstacles = &self.scenario.world.obstacles;
        !is_taken && obstacles.iter().all(|obstacle| gap(*obstacle, point) >= radius)
    }

    /// Places for a group, anywhere in the part of the area that is in the world.
    fn scatter(
        &mut self,
        group: &Group,
        at: [f64; 2],
        area: [f64; 2],
        chance: &mut Stream,
    ) -> Result<Vec<[f64; 2]>, ScenarioError> {
        let radius = radius(group);
        let side = |axis: usize| {
            let half = (self.scenario.world.size[axis] / 2.0 - radius).max(0.0);
            let low = (at[axis] - area[axis] / 2.0).clamp(-half, half);
            let high = (at[axis] + area[axis] / 2.0).clamp(-half, half);
            (low, high - low)
        };
        let (x, y) = (side(0), side(1));
        let mut points = Vec::new();
        while points.len() < group.count as usize {
            let mut tries = (0..TRIES).map(|_| {
                [x.0 + x.1 * f64::from(chance.unit()), y.0 + y.1 * f64::from(chance.unit())]
            });
            let Some(point) = tries.find(|point| self.is_free(*point, radius)) else {
                let cause = Cause::NoRoom { count: group.count as usize, placed: points.len() };
                return Err(ScenarioError { cause, place: Some(Box::new(group.place.clone())) });
            };
            self.add(point, radius);
            points.push(point);
        }
        Ok(points)
    }
}

fn distance(one: [f64; 2], other: [f64; 2]) -> f64 {
    libm::hypot(one[0] - other[0], one[1] - other[1])
}

/// From a point to an obstacle; negative inside.
fn gap(obstacle: Obstacle, point: [f64; 2]) -> f64 {
    match obstacle {
        Obstacle::Disc { at, radius } => distance(at, point) - radius,
        Obstacle::Block { at, size } => {
            let beyond = |axis: usize| ((point[axis] - at[axis]).abs() - size[axis] / 2.0).max(0.0);
            libm::hypot(beyond(0), beyond(1))
        }
        Obstacle::Wall(from, to) => {
            let along = [to[0] - from[0], to[1] - from[1]];
            let length = along[0] * along[0] + along[1] * along[1];
            let dot = (point[0] - from[0]) * along[0] + (point[1] - from[1]) * along[1];
            let part = if length > 0.0 { (dot / length).clamp(0.0, 1.0) } else { 0.0 };
            distance([from[0] + part * along[0], from[1] + part * along[1]], point)
        }
    }
}
