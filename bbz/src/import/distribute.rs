//! `<distribute>`: groups of robots, and obstacles and lamps at random places.
//!
//! A scenario draws the places of robots for each run. Its obstacles and lamps are fixed, so those
//! that ARGoS distributes are drawn here, once.

use bittybuzz_random::Random;

use super::arena::{
    self, Arena, Entity, Pose, degrees, id, omit_other, omit_start_height, omit_tilt, shines, stand,
};
use super::document::Element;
use super::generator::Generator;
use super::group::{Group, Heading, Lamp, Placement};
use super::mistake::{Allowed, FIXED_MAX, Mistake, ROBOTS_MAX};
use super::obstacle::Obstacle;
use super::robots::{RobotKind, buzz_id};

/// The number of places that are tried for an obstacle, and the number of comparisons of two bodies
/// for a whole file, which bounds the time.
const TRIES_MAX: usize = 100;
const CHECKS_MAX: usize = 20_000_000;

/// The standard deviation in degrees from which on headings count as evenly distribution: the mean of their
/// unit vectors has a length of exp(-pi^2 / 2) = 0.007 then.
const EVEN_SPREAD: f64 = 180.0;

/// The random numbers of obstacles, and the amounts that are left of each limit.
pub struct Drawing {
    random: Random,
    checks: usize,
    robots: u32,
    fixed: u32,
}

impl Drawing {
    pub fn new(seed: u32) -> Self {
        Drawing {
            random: Random::new(seed.into()),
            checks: CHECKS_MAX,
            robots: ROBOTS_MAX,
            fixed: FIXED_MAX,
        }
    }

    /// Takes comparisons of bodies from the limit. Returns false at its end.
    pub fn check(&mut self, count: usize) -> bool {
        let left = self.checks.checked_sub(count);
        self.checks = left.unwrap_or(0);
        left.is_some()
    }
}

/// The generators of an element.
struct Distribution {
    position: Generator,
    orientation: Generator,
    quantity: u32,
    /// The number after the id of the first entity.
    first: u64,
}

/// Returns true if an element distributes obstacles or lamps.
pub fn is_fixed(arena: &Arena<'_>, element: Element<'_>) -> bool {
    let thing = element.first("entity").and_then(|entity| entity.elements().next());
    thing.is_some_and(|thing| matches!(arena.entity(thing), Entity::Obstacle | Entity::Lamp))
}

/// Reads an element. Returns `None` after a mistake.
pub fn read<'a>(arena: &mut Arena<'a>, element: Element<'a>, drawing: &mut Drawing) -> Option<()> {
    let position = element.required("position").and_then(Generator::read);
    let orientation = element.required("orientation").and_then(Generator::read);
    let entity = element.required("entity")?;
    let mut things = entity.elements();
    let Some(thing) = things.next() else {
        entity.fail(Mistake::NothingToDistribute);
        return None;
    };
    if let Some(second) = things.next() {
        second.omit("further elements in <entity>", "ARGoS distributes only the first, too");
    }
    let kind = arena.entity(thing);
    let quantity = entity.required_number("quantity", Allowed::Whole(u32::MAX));
    let first = entity.number_or("base_num", Allowed::Whole(u32::MAX), 0.0);
    // The allowed numbers are whole.
    let (quantity, first) = (quantity? as u32, first? as u64);
    let distribution =
        Distribution { position: position?, orientation: orientation?, quantity, first };
    let places = distribution.position.places();
    if u64::from(quantity) > places {
        entity.fail_at("quantity", Mistake::SmallGrid { quantity, places });
        return None;
    }
    let left = match kind {
        Entity::Obstacle | Entity::Lamp => &mut drawing.fixed,
        Entity::Robot(_) | Entity::Other => &mut drawing.robots,
    };
    let Some(rest) = left.checked_sub(quantity) else {
        entity.fail_at("quantity", Mistake::TooMany { quantity });
        return None;
    };
    *left = rest;
    if quantity == 0 {
        return Some(());
    }
    match kind {
        Entity::Obstacle => obstacles(arena, thing, &distribution, drawing),
        Entity::Lamp => lamps(arena, thing, &distribution, drawing),
        Entity::Robot(kind) => robots(arena, element, thing, kind, &distribution),
        Entity::Other => {
            omit_other(thing);
            Some(())
        }
    }
}

fn robots<'a>(
    arena: &mut Arena<'a>,
    element: Element<'a>,
    thing: Element<'a>,
    kind: &RobotKind,
    distribution: &Distribution,
) -> Option<()> {
    let mut group = arena.group(thing, kind)?;
    group.placement = placement(arena, element, distribution)?;
    group.heading = heading(element, &distribution.orientation);
    if group.is_buzz {
        let ids = (0..group.count() as u64).map(|number| number + distribution.first);
        let ids: Vec<_> = ids.map(|number| buzz_id(&format!("{}{number}", group.name))).collect();
        group.buzz_ids = ids;
    }
    arena.groups.push(group);
    Some(())
}

fn placement(
    arena: &Arena<'_>,
    element: Element<'_>,
    distribution: &Distribution,
) -> Option<Placement> {
    let (middle, sides, top) = match &distribution.position {
        Generator::Uniform { min, max } => {
            let axes = [0, 1, 2];
            (
                axes.map(|axis| (min[axis] + max[axis]) / 2.0),
                axes.map(|axis| max[axis] - min[axis]),
                max[2],
            )
        }
        // A uniform distribution has the standard deviation of its width divided by the root of 12.
        Generator::Gaussian { mean, deviation } => {
            (*mean, deviation.map(|deviation| deviation * 12.0_f64.sqrt()), mean[2])
        }
        Generator::Constant(_) | Generator::Grid { .. } => {
            return listed(arena, element, distribution);
        }
    };
    if top > arena::GROUND {
        omit_start_height(element);
    }
    let center = arena.place(element, middle)?;
    if sides[..2] == [0.0; 2] {
        return Some(Placement::List(vec![center; distribution.quantity as usize]));
    }
    if let Generator::Gaussian { .. } = distribution.position {
        element.omit(
            "Gaussian start positions",
            "they are uniform in a rectangle with the same mean and standard deviations here",
        );
    }
    let size = [sides[0], sides[1]].map(|side| arena::mm(side * 1000.0).max(arena::LENGTH_MIN));
    // The farthest corner must also be in a world.
    arena.place(element, [0, 1, 2].map(|axis| middle[axis] + sides[axis] / 2.0))?;
    arena.place(element, [0, 1, 2].map(|axis| middle[axis] - sides[axis] / 2.0))?;
    Some(Placement::Area { count: distribution.quantity, center, size })
}

/// Returns the places of a generator without chance.
fn listed(
    arena: &Arena<'_>,
    element: Element<'_>,
    distribution: &Distribution,
) -> Option<Placement> {
    let mut quantity = distribution.quantity;
    if let Generator::Grid { layout: [columns, rows, _], .. } = distribution.position {
        let layer = columns.saturating_mul(rows);
        if quantity > layer {
            element.omit(
                format!("{} robots in upper layers of a grid", quantity - layer),
                "robots start on the ground; enlarge the first two numbers of `layout`",
            );
            quantity = layer;
        }
    }
    // Nothing is drawn.
    let mut random = Random::new(0);
    let mut place = |number| {
        let position = distribution.position.draw(number, &mut random);
        if position[2] > arena::GROUND {
            omit_start_height(element);
        }
        arena.place(element, position)
    };
    (0..quantity).map(&mut place).collect::<Option<_>>().map(Placement::List)
}

fn heading(element: Element<'_>, orientation: &Generator) -> Heading {
    let even = |text: String| {
        element.omit(text, "they are random in all directions here; `heading` sets one for all");
        Heading::Random
    };
    match orientation {
        Generator::Constant(values) => {
            omit_tilt(element, *values);
            Heading::Degrees(degrees(values[0]))
        }
        Generator::Uniform { min, max } => {
            omit_tilt(element, [0.0, max[1].abs() + min[1].abs(), max[2].abs() + min[2].abs()]);
            match max[0] - min[0] {
                0.0 => Heading::Degrees(degrees(min[0])),
                spread if spread >= 360.0 => Heading::Random,
                _ => even(format!("headings from {} to {} degrees", min[0], max[0])),
            }
        }
        Generator::Gaussian { mean, deviation } => {
            let tilt = [1, 2].map(|axis| mean[axis].abs() + deviation[axis]);
            omit_tilt(element, [0.0, tilt[0], tilt[1]]);
            match deviation[0] {
                0.0 => Heading::Degrees(degrees(mean[0])),
                deviation if deviation >= EVEN_SPREAD => Heading::Random,
                deviation => even(format!(
                    "headings around {} with a deviation of {deviation} degrees",
                    mean[0]
                )),
            }
        }
        Generator::Grid { .. } => even("headings in a grid".to_owned()),
    }
}

fn obstacles(
    arena: &mut Arena<'_>,
    thing: Element<'_>,
    distribution: &Distribution,
    drawing: &mut Drawing,
) -> Option<()> {
    let shape = arena::shape(thing)?;
    let is_random = distribution.position.is_random();
    let tries = if is_random { TRIES_MAX } else { 1 };
    let mut placed = 0;
    for number in 0..distribution.quantity {
        let found = (0..tries).find_map(|_| {
            let pose = pose(distribution, number, drawing);
            let at = arena.offset(pose.position);
            let is_placed = match is_random {
                true => is_free(arena, at, shape.0.radius(), drawing),
                false => arena.place(thing, pose.position).is_some(),
            };
            is_placed.then_some((at, pose))
        });
        let Some((at, pose)) = found else { break };
        let name = format!("{}{}", id(thing), distribution.first + u64::from(number));
        arena.obstacles.extend(stand(thing, name, shape, at, pose));
        placed += 1;
    }
    let (quantity, name, kind) = (distribution.quantity, id(thing), thing.name());
    omit_chance(thing, distribution);
    if placed < quantity {
        thing.omit(
            format!(
                "{} of {quantity} <{kind}> `{name}`: no free place was found",
                quantity - placed
            ),
            "add them to `obstacles`, or enlarge the arena",
        );
    }
    Some(())
}

fn lamps(
    arena: &mut Arena<'_>,
    thing: Element<'_>,
    distribution: &Distribution,
    drawing: &mut Drawing,
) -> Option<()> {
    let shines = shines(thing)?;
    for number in 0..distribution.quantity {
        let at = arena.place(thing, pose(distribution, number, drawing).position)?;
        let name = format!("{}{}", id(thing), distribution.first + u64::from(number));
        arena.lamps.push(Lamp { name, at, shines });
    }
    omit_chance(thing, distribution);
    Some(())
}

fn omit_chance(thing: Element<'_>, distribution: &Distribution) {
    if distribution.position.is_random() {
        thing.omit(
            format!("<{}> `{}` at places that ARGoS draws for each seed", thing.name(), id(thing)),
            "the places were drawn once, and are the same for all seeds of the scenario",
        );
    }
}

fn pose(distribution: &Distribution, number: u32, drawing: &mut Drawing) -> Pose {
    let position = distribution.position.draw(number, &mut drawing.random);
    let orientation = distribution.orientation.draw(number, &mut drawing.random);
    Pose { position, orientation }
}

/// Returns true if a circle in the arena touches neither an obstacle nor a robot with a given place.
fn is_free(arena: &Arena<'_>, at: [f64; 2], radius: f64, drawing: &mut Drawing) -> bool {
    let robots: usize = arena.groups.iter().map(|group| 1 + places(group).len()).sum();
    if !drawing.check(arena.obstacles.len() + robots) {
        return false;
    }
    let is_inside = (0..2).all(|axis| 2.0 * at[axis].abs() <= arena.size[axis]);
    let is_beside = |obstacle: &Obstacle| obstacle.gap(at) >= radius;
    let is_apart = |group: &Group| {
        let apart = radius + group.radius;
        places(group).iter().all(|[x, y]| (x - at[0]).hypot(y - at[1]) >= apart)
    };
    is_inside && arena.obstacles.iter().all(is_beside) && arena.groups.iter().all(is_apart)
}

fn places(group: &Group) -> &[[f64; 2]] {
    match &group.placement {
        Placement::List(places) => places,
        Placement::Area { .. } => &[],
    }
}
