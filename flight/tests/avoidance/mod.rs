//! Collision avoidance: properties of the cells, and flights of simulated swarms.

mod cells;
mod swarm;

use bittybuzz_flight::Vec3;
use bittybuzz_flight::avoidance::{AvoidanceSettings, Obstacle};
use bittybuzz_random::Random;
use glam::Vec2;
use swarm::{FlightConditions, SwarmFlight, between, fly, gap_m};

/// Distance in m at which the bodies of two Crazyflies touch (radius 6 cm).
const COLLISION_M: f32 = 0.12;

/// The sum of many flights of one kind.
struct FlightSummary {
    robots: usize,
    flights: Vec<SwarmFlight>,
}

impl FlightSummary {
    fn new(name: &str, robots: usize, flights: impl Iterator<Item = SwarmFlight>) -> Self {
        let mut summary = FlightSummary { robots, flights: flights.collect() };
        summary.flights.sort_by(|a, b| a.finished_s.total_cmp(&b.finished_s));
        let count = summary.flights.len();
        let crowded: f32 = summary.flights.iter().map(|flight| flight.crowded).sum();
        println!(
            "{name} of {robots}: at least {:.3} m and {:.2} half-axes apart, {:.2} % arrived, \
             median {:.1} s, last {:.1} s, {:.3} % of the commands crowded",
            summary.nearest_m(),
            summary.flights.iter().map(|flight| flight.nearest_scaled).fold(9.0, f32::min),
            100.0 * summary.arrived_share(),
            summary.flights[count / 2].finished_s,
            summary.flights[count - 1].finished_s,
            100.0 * crowded / count as f32,
        );
        summary
    }

    fn nearest_m(&self) -> f32 {
        self.flights.iter().map(|flight| flight.nearest_m).fold(f32::INFINITY, f32::min)
    }

    /// Asserts that all robots kept the half-axis from obstacles and stayed in the space, but for the
    /// noise of positions.
    fn assert_apart_from_obstacles(&self) {
        let nearest_m = self.flights.iter().map(|flight| flight.nearest_column_m);
        let nearest_m = nearest_m.fold(f32::INFINITY, f32::min);
        let outside_m = self.flights.iter().map(|flight| flight.outside_m).fold(0.0, f32::max);
        println!("{nearest_m:.3} m from obstacles, {outside_m:.3} m outside");
        assert!(nearest_m > AvoidanceSettings::CRAZYFLIE.radius_m - 0.04, "{nearest_m}");
        assert!(outside_m < 0.04, "{outside_m}");
    }

    fn arrived_share(&self) -> f32 {
        let arrived: usize = self.flights.iter().map(|flight| flight.arrived).sum();
        arrived as f32 / (self.robots * self.flights.len()) as f32
    }
}

/// Flies robots from points of a circle to the opposite points.
fn swap(conditions: FlightConditions, robots: usize, radius_m: f32, seeds: u64) -> FlightSummary {
    let center = Vec3::new(0.0, 0.0, 1.0);
    let on_circle = |index: usize, side: f32| {
        let (sine, cosine) = (index as f32 * core::f32::consts::TAU / robots as f32).sin_cos();
        center + side * radius_m * Vec3::new(cosine, sine, 0.0)
    };
    let starts: Vec<Vec3> = (0..robots).map(|index| on_circle(index, 1.0)).collect();
    let goals: Vec<Vec3> = (0..robots).map(|index| on_circle(index, -1.0)).collect();
    let flights = (0..seeds).map(|seed| fly(conditions, seed, &starts, &goals));
    FlightSummary::new(&format!("swap on {radius_m} m"), robots, flights)
}

/// Flies robots from random points to random points in 3 m × 3 m × 1.5 m.
fn wander(conditions: FlightConditions, robots: usize, seeds: u64) -> FlightSummary {
    let flights = (0..seeds).map(|seed| {
        let mut random = Random::new(1000 + seed);
        let starts = places(&mut random, robots);
        let goals = places(&mut random, robots);
        fly(conditions, seed, &starts, &goals)
    });
    FlightSummary::new("random goals", robots, flights)
}

/// Returns random places whose ellipsoids keep a gap of 10 cm at one height.
fn places(random: &mut Random, count: usize) -> Vec<Vec3> {
    let scale = Vec3::new(1.0, 1.0, 1.0 / 3.0);
    let (low, high) = (Vec3::new(0.0, 0.0, 0.3), Vec3::new(3.0, 3.0, 1.8));
    loop {
        let mut places: Vec<Vec3> = Vec::new();
        for _ in 0..200 * count {
            let place = between(random, low, high);
            if places.iter().all(|other| ((place - *other) * scale).length() > 0.7) {
                places.push(place);
            }
            if places.len() == count {
                return places;
            }
        }
    }
}

#[test]
fn robots_on_a_circle_swap_their_places() {
    for (robots, radius_m) in [(2, 1.5), (4, 1.5), (8, 1.5), (8, 2.0), (10, 1.5), (10, 2.0)] {
        let summary = swap(FlightConditions::USUAL, robots, radius_m, 10);
        assert!(summary.nearest_m() > 0.5);
        assert!(summary.arrived_share() == 1.0);
    }
}

#[test]
fn robots_reach_random_goals() {
    let few = wander(FlightConditions::USUAL, 6, 10);
    assert!(few.nearest_m() > 0.5);
    assert!(few.arrived_share() == 1.0);
    let many = wander(FlightConditions::USUAL, 10, 10);
    assert!(many.nearest_m() > 0.5);
    assert!(many.arrived_share() > 0.95);
}

/// A room of 4 m × 4 m × 2 m, whose walls are 0.3 m behind the least and largest coordinates.
const ROOM: AvoidanceSettings = AvoidanceSettings {
    lowest_m: Vec3::new(-2.0, -2.0, 0.2),
    highest_m: Vec3::new(2.0, 2.0, 2.0),
    ..AvoidanceSettings::CRAZYFLIE
};

const fn column(x: f32, y: f32, half: Vec2, rim_m: f32, top_m: f32) -> Obstacle {
    Obstacle { center_m: Vec2::new(x, y), along: Vec2::X, half_m: half, rim_m, top_m }
}

/// Two pillars, a low box, and a wall from the side of the room.
const FURNITURE: &[Obstacle] = &[
    column(-0.6, 0.5, Vec2::ZERO, 0.15, 3.0),
    column(0.7, -0.6, Vec2::ZERO, 0.2, 3.0),
    column(0.9, 0.9, Vec2::new(0.3, 0.2), 0.0, 0.5),
    column(-1.5, -0.7, Vec2::new(0.5, 0.0), 0.0, 3.0),
];

/// Positions have noise of 1 cm, and each robot chooses at its own moment: 4 cm of 30 are lost.
#[test]
fn robots_keep_away_from_walls_and_obstacles() {
    let conditions =
        FlightConditions { settings: ROOM, obstacles: FURNITURE, ..FlightConditions::USUAL };
    let (low, high) = (Vec3::new(-1.8, -1.8, 0.5), Vec3::new(1.8, 1.8, 1.7));
    let flights = (0..30).map(|seed| {
        let mut random = Random::new(5000 + seed);
        let mut free = |from: &[Vec3]| loop {
            let place = between(&mut random, low, high);
            let is_apart = from.iter().all(|other| other.distance(place) > 0.8);
            if is_apart && FURNITURE.iter().all(|column| gap_m(column, place) > 0.35) {
                return place;
            }
        };
        let mut choose = |count: usize| {
            (0..count).fold(Vec::new(), |mut places, _| {
                places.push(free(&places));
                places
            })
        };
        let (starts, goals) = (choose(3), choose(3));
        fly(conditions, seed, &starts, &goals)
    });
    let summary = FlightSummary::new("furnished room", 3, flights);
    assert!(summary.nearest_m() > 0.5);
    summary.assert_apart_from_obstacles();
    assert!(summary.arrived_share() > 0.95, "{}", summary.arrived_share());
}

/// A robot between two columns and a wall hovers and has no way; another one wants its place.
#[test]
fn a_robot_that_cannot_move_away_is_not_touched() {
    const NICHE: &[Obstacle] = &[
        column(-0.7, 1.2, Vec2::new(0.0, 0.6), 0.0, 3.0),
        column(0.7, 1.2, Vec2::new(0.0, 0.6), 0.0, 3.0),
    ];
    let conditions =
        FlightConditions { settings: ROOM, obstacles: NICHE, ..FlightConditions::USUAL };
    let flights = (0..30).map(|seed| {
        let inside = Vec3::new(0.0, 1.7, 1.0);
        let starts = [inside, Vec3::new(0.0, -1.0, 1.0), Vec3::new(1.5, -1.5, 1.2)];
        fly(conditions, seed, &starts, &[inside, inside, inside])
    });
    let summary = FlightSummary::new("niche", 3, flights);
    assert!(summary.nearest_m() > 0.5, "{}", summary.nearest_m());
    summary.assert_apart_from_obstacles();
}

#[test]
fn robots_stay_apart_with_a_bad_radio() {
    let bad = FlightConditions { loss: 0.3, delay_ms: 200, ..FlightConditions::USUAL };
    for conditions in [bad, FlightConditions { reports_velocity: false, ..bad }] {
        assert!(swap(conditions, 10, 2.0, 10).nearest_m() > 3.0 * COLLISION_M);
        assert!(wander(conditions, 10, 10).nearest_m() > 3.0 * COLLISION_M);
    }
}

#[test]
fn robots_that_do_not_avoid_collide() {
    let careless = FlightConditions { is_avoiding: false, ..FlightConditions::USUAL };
    assert!(swap(careless, 2, 1.5, 10).nearest_m() < COLLISION_M);
    assert!(wander(careless, 10, 10).nearest_m() < COLLISION_M);
}

/// Measures the figures of the report; `cargo test --release -- --ignored --nocapture` prints them.
#[test]
#[ignore = "takes a minute; run it after a change of the avoidance"]
fn measure_a_hundred_seeds() {
    let usual = FlightConditions::USUAL;
    let silent = FlightConditions { reports_velocity: false, ..usual };
    let bad = FlightConditions { loss: 0.3, delay_ms: 200, ..usual };
    let worst = FlightConditions { noise_m: 0.02, ..bad };
    let careless = FlightConditions { is_avoiding: false, ..usual };
    for (name, conditions) in [
        ("usual", usual),
        ("positions only", silent),
        ("30 % loss, 0.2 s delay", bad),
        ("30 % loss, 0.2 s delay, 2 cm noise", worst),
        ("no avoidance", careless),
    ] {
        println!("--- {name}");
        for (robots, radius_m) in [(2, 1.5), (4, 1.5), (8, 1.5), (8, 2.0), (10, 1.5), (10, 2.0)] {
            let summary = swap(conditions, robots, radius_m, 100);
            assert!(!conditions.is_avoiding || summary.nearest_m() > COLLISION_M);
        }
        for robots in [6, 10] {
            let summary = wander(conditions, robots, 100);
            assert!(!conditions.is_avoiding || summary.nearest_m() > COLLISION_M);
        }
    }
}
