//! The start poses of the robots of a run.

use crate::engine::{Pose, Stream};
use crate::scenario::{
    Group, Heading, Placement, Scenario, ScenarioCause, ScenarioError, Space, Standing, length_up,
};

/// The number of places that are tried for one robot before the world counts as full.
const TRIES_MAX: usize = 2000;

/// Separates the random numbers of the placement from all other streams of a run's seed.
const PLACEMENT: u64 = 0x706c_6163_656d_656e;

/// Returns the poses of all robots, in the order of the scenario.
pub fn poses(scenario: &Scenario, seed: u64) -> Result<Vec<Pose>, ScenarioError> {
    let widest_mm = scenario.groups.iter().map(Group::radius_mm).fold(0.0, f64::max);
    let mut space = Space::new(&scenario.world, widest_mm);
    // Robots with a given place keep it; the others are placed at random.
    for group in &scenario.groups {
        group.standing().for_each(|robot| space.add(robot));
    }
    let mut poses = Vec::new();
    for (number, group) in scenario.groups.iter().enumerate() {
        let mut chance = Stream::for_brain(seed ^ PLACEMENT, number as u16);
        let points: Vec<[f64; 2]> = match group.placement {
            Placement::Random { at, area } => {
                scatter(scenario, &mut space, group, (at, area), &mut chance)?
            }
            _ => group.placement.points(group.count).collect(),
        };
        poses.extend(points.into_iter().enumerate().map(|(index, [x, y])| {
            let of_group = match group.heading {
                Heading::Degrees(degrees) => degrees.to_radians() as f32,
                // Also drawn for a robot with a heading of its own, so that the others keep theirs.
                Heading::Random => (chance.unit() * 2.0 - 1.0) * std::f32::consts::PI,
            };
            let own = group.placement.heading_of(index);
            let heading = own.map_or(of_group, |degrees| degrees.to_radians() as f32);
            Pose::new(x as f32, y as f32, heading)
        }));
    }
    Ok(poses)
}

/// Returns random places for a group, in the part of the area that is within the world.
fn scatter(
    scenario: &Scenario,
    space: &mut Space<'_>,
    group: &Group,
    (at, area): ([f64; 2], [f64; 2]),
    chance: &mut Stream,
) -> Result<Vec<[f64; 2]>, ScenarioError> {
    let radius_mm = group.radius_mm();
    let side = |axis: usize| {
        let half = (scenario.world.size[axis] / 2.0 - radius_mm).max(0.0);
        let low = (at[axis] - area[axis] / 2.0).clamp(-half, half);
        let high = (at[axis] + area[axis] / 2.0).clamp(-half, half);
        (low, high - low)
    };
    let (x, y) = (side(0), side(1));
    let mut points = Vec::new();
    for id in (group.first_id.into()..).take(group.count as usize) {
        let mut tries = (0..TRIES_MAX)
            .map(|_| [x.0 + x.1 * f64::from(chance.unit()), y.0 + y.1 * f64::from(chance.unit())]);
        let Some(at) = tries.find(|point| space.is_free(*point, radius_mm)) else {
            let (count, placed) = (group.count as usize, points.len());
            // The tolerance counts a robot that fits exactly: bodies in contact may overlap by less
            // than the engine sees.
            let places = |side: f64| (side / (2.0 * radius_mm) + 1e-6) as usize + 1;
            let has_room = scenario.world.size.iter().all(|side| *side >= 2.0 * radius_mm);
            let grid = if has_room { places(x.1) * places(y.1) } else { 0 };
            let cause =
                ScenarioCause::NoRoom { count, placed, grid, spacing: length_up(2.0 * radius_mm) };
            return Err(ScenarioError { cause, place: Some(Box::new(group.place.clone())) });
        };
        space.add(Standing { at, radius_mm, id });
        points.push(at);
    }
    Ok(points)
}
