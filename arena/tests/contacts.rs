//! Bodies do not stay inside of each other, nor of walls.

use crate::common::robots::{RobotKind, Settings, World};
use crate::common::*;
use bittybuzz_arena::engine::{Area, Obstacle, Pose, RobotId, Stream};

/// mm of overlap that is no contact.
const OVERLAP_TOLERANCE_MM: f32 = 0.05;

/// The greatest overlap of any two robots at one height, mm: every pair is looked at.
fn deepest(world: &World<Probe>) -> f32 {
    let views: Vec<_> = world.robots().collect();
    let mut deepest: f32 = 0.0;
    for (i, a) in views.iter().enumerate() {
        for b in &views[..i] {
            let distance = (a.pose.x - b.pose.x).hypot(a.pose.y - b.pose.y);
            deepest = deepest.max(a.radius_mm + b.radius_mm - distance);
        }
    }
    deepest
}

fn middle(world: &World<Probe>) -> (f64, f64) {
    let count = world.len() as f64;
    let sum = world.robots().fold((0.0, 0.0), |sum, view| {
        (sum.0 + f64::from(view.pose.x), sum.1 + f64::from(view.pose.y))
    });
    (sum.0 / count, sum.1 / count)
}

#[test]
fn overlapping_robots_move_apart_equally() {
    let mut world = World::new(exact()).unwrap();
    let a = kilobot(&mut world, -10.0, 0.0, 0.0, Probe::default());
    let b = kilobot(&mut world, 10.0, 0.0, 0.0, Probe::default());
    world.tick();
    close(pose(&world, a).x, -16.5, 0.02);
    close(pose(&world, b).x, 16.5, 0.02);
    assert_eq!(world.statistics().contacts, 2);
    run(&mut world, 5);
    assert_eq!(world.statistics().contacts, 2, "they do not tremble");
}

/// Who pushes on is in contact all the time, but has begun once.
#[test]
fn a_lasting_contact_counts_once() {
    let mut world = World::new(exact()).unwrap();
    kilobot(&mut world, -20.0, 0.0, 0.0, Probe::driving(70, 70));
    kilobot(&mut world, 20.0, 0.0, std::f32::consts::PI, Probe::driving(70, 70));
    run(&mut world, 100);
    let statistics = world.statistics();
    assert_eq!(statistics.contacts, 2);
    // 7 mm between the rims, which both close with 2 mm per second times ten.
    close(statistics.contact_ticks as f32, 2.0 * (100.0 - 3.5), 4.0);
}

#[test]
fn a_heap_of_robots_spreads_around_its_middle() {
    let mut world = World::new(Settings { seed: 3, ..exact() }).unwrap();
    let mut stream = Stream::for_brain(3, 0);
    for _ in 0..300 {
        let (x, y) = (stream.unit() * 400.0 - 200.0, stream.unit() * 400.0 - 200.0);
        kilobot(&mut world, x, y, 0.0, Probe::default());
    }
    let before = middle(&world);
    assert!(deepest(&world) > 20.0);
    // They need nearly twice the room: the outer ones make place for the inner ones step by step.
    run(&mut world, 300);
    assert!(deepest(&world) < 0.1, "{} mm", deepest(&world));
    let after = middle(&world);
    assert!((after.0 - before.0).abs() < 0.01 && (after.1 - before.1).abs() < 0.01);
}

#[test]
fn robots_at_the_same_place_move_apart() {
    let mut world = World::new(exact()).unwrap();
    for _ in 0..20 {
        kilobot(&mut world, 1.0, 2.0, 0.0, Probe::default());
    }
    run(&mut world, 60);
    assert!(deepest(&world) < 0.1, "{} mm", deepest(&world));
}

/// A box that is just large enough: 49 robots, a lattice of 34 mm pitch in 240 mm.
#[test]
fn a_full_box_stays_within_its_walls() {
    let area = Area { width: 240.0, height: 240.0 };
    let mut world = World::new(Settings { area, ..exact() }).unwrap();
    let mut stream = Stream::for_brain(4, 0);
    for i in 0..49 {
        let jitter = (stream.unit() * 10.0, stream.unit() * 10.0);
        let (x, y) = ((i % 7) as f32 * 30.0 - 95.0, (i / 7) as f32 * 30.0 - 95.0);
        kilobot(
            &mut world,
            x + jitter.0,
            y + jitter.1,
            stream.unit() * 6.0,
            Probe::driving(70, 70),
        );
    }
    for _ in 0..100 {
        world.tick();
        for view in world.robots() {
            assert!(view.pose.x.abs() <= 103.5 && view.pose.y.abs() <= 103.5);
        }
    }
    // All push on, rows of seven against a wall: less than a tenth of a diameter is left.
    assert!(deepest(&world) < 3.3, "{} mm", deepest(&world));
    for id in world.ids() {
        world.brain_mut(id).unwrap().motors = (0, 0);
    }
    run(&mut world, 300);
    assert!(deepest(&world) < 0.1, "{} mm", deepest(&world));
}

/// Whoever overlaps with somebody, by all pairs, is in contact, and nobody else.
#[test]
fn the_grid_finds_the_same_contacts_as_all_pairs() {
    for seed in 0..20 {
        let area = Area { width: 1500.0, height: 700.0 };
        let mut world = World::new(Settings { seed, area, ..exact() }).unwrap();
        let mut stream = Stream::for_brain(seed, 7);
        for i in 0..200 {
            let kind = match i % 7 {
                0 if seed % 2 == 0 => RobotKind::Crazyflie,
                1 | 2 => RobotKind::Zooid,
                _ => RobotKind::Kilobot,
            };
            let pose = Pose::new(
                (stream.unit() - 0.5) * 1300.0,
                (stream.unit() - 0.5) * 500.0,
                stream.unit(),
            );
            world.add(kind, pose, Probe::default()).unwrap();
        }
        let views: Vec<_> = world.robots().collect();
        let touching = views.iter().enumerate().filter(|(i, a)| {
            views.iter().enumerate().any(|(j, b)| {
                let distance = (a.pose.x - b.pose.x).hypot(a.pose.y - b.pose.y);
                *i != j && distance < a.radius_mm + b.radius_mm - OVERLAP_TOLERANCE_MM
            })
        });
        let expected = touching.count() as u64;
        world.tick();
        // More than one substep: those that were pushed together count, too.
        let found = world.statistics().contact_ticks;
        assert!(found >= expected, "seed {seed}: {found} of {expected}");
    }
    let mut world = World::new(exact()).unwrap();
    let mut stream = Stream::for_brain(1, 8);
    for _ in 0..400 {
        let (x, y) = (stream.unit() * 1200.0, stream.unit() * 1200.0);
        kilobot(&mut world, x, y, 0.0, Probe::default());
    }
    let views: Vec<_> = world.robots().collect();
    let expected = views.iter().enumerate().filter(|(i, a)| {
        views.iter().enumerate().any(|(j, b)| {
            *i != j
                && (a.pose.x - b.pose.x).hypot(a.pose.y - b.pose.y) < 33.0 - OVERLAP_TOLERANCE_MM
        })
    });
    let expected = expected.count() as u64;
    world.tick();
    // Kilobots have one substep, and the first look of a substep counts.
    assert!(expected > 50);
    assert_eq!(world.statistics().contact_ticks, expected);
}

#[test]
fn walls_of_the_world_stop_robots() {
    let mut world = World::new(exact()).unwrap();
    let id = kilobot(&mut world, 1900.0, 0.0, 0.0, Probe::driving(70, 70));
    run(&mut world, 200);
    close(pose(&world, id).x, 2000.0 - 16.5, 0.02);
    assert!(world.statistics().wall_ticks > 50);
    assert_eq!(world.statistics().contacts, 0);
}

fn distance_to(obstacle: &Obstacle, x: f32, y: f32) -> f32 {
    match *obstacle {
        Obstacle::Segment { from, to } => {
            let (ax, ay) = (to.0 - from.0, to.1 - from.1);
            let along = ((x - from.0) * ax + (y - from.1) * ay) / (ax * ax + ay * ay);
            let along = along.clamp(0.0, 1.0);
            (x - from.0 - along * ax).hypot(y - from.1 - along * ay)
        }
        Obstacle::Round { x: cx, y: cy, radius } => (x - cx).hypot(y - cy) - radius,
        Obstacle::Box { x: cx, y: cy, width, height } => {
            let (dx, dy) = ((x - cx).abs() - width / 2.0, (y - cy).abs() - height / 2.0);
            if dx < 0.0 && dy < 0.0 { dx.max(dy) } else { dx.max(0.0).hypot(dy.max(0.0)) }
        }
        Obstacle::TurnedBox { x: cx, y: cy, width, height, along } => {
            // Turned back by polar coordinates.
            let (far, angle) = ((x - cx).hypot(y - cy), (y - cy).atan2(x - cx));
            let (sin, cos) = (angle - along.1.atan2(along.0)).sin_cos();
            let straight = Obstacle::Box { x: 0.0, y: 0.0, width, height };
            distance_to(&straight, far * cos, far * sin)
        }
    }
}

fn turned_box(x: f32, y: f32, width: f32, height: f32, heading: f32) -> Obstacle {
    Obstacle::TurnedBox { x, y, width, height, along: (heading.cos(), heading.sin()) }
}

/// Robots of all speeds wander among obstacles of all kinds and never get into one.
#[test]
fn robots_cannot_enter_obstacles() {
    let area = Area { width: 1500.0, height: 1500.0 };
    let mut world = World::new(Settings { area, ..exact() }).unwrap();
    let obstacles = [
        Obstacle::Segment { from: (-600.0, -500.0), to: (600.0, 500.0) },
        Obstacle::Segment { from: (0.0, 700.0), to: (0.0, 300.0) },
        Obstacle::Round { x: 400.0, y: -300.0, radius: 120.0 },
        Obstacle::Box { x: -400.0, y: 300.0, width: 300.0, height: 80.0 },
        turned_box(500.0, 200.0, 400.0, 60.0, 0.6),
    ];
    for obstacle in obstacles {
        world.add_obstacle(obstacle);
    }
    let mut stream = Stream::for_brain(11, 0);
    while world.len() < 60 {
        let pose = Pose::new(
            (stream.unit() - 0.5) * 1400.0,
            (stream.unit() - 0.5) * 1400.0,
            stream.unit() * 6.0,
        );
        let free = obstacles.iter().all(|obstacle| distance_to(obstacle, pose.x, pose.y) > 20.0);
        if !free {
            continue;
        }
        let zooid = world.len() % 2 == 0;
        let kind = if zooid { RobotKind::Zooid } else { RobotKind::Kilobot };
        let motors = if zooid { (60, 59) } else { (255, 250) };
        world.add(kind, pose, Probe::driving(motors.0, motors.1)).unwrap();
    }
    let side = |x: f32, y: f32| 500.0 * x - 600.0 * y > 0.0;
    for _ in 0..300 {
        let before: Vec<_> = world.robots().collect();
        world.tick();
        for (old, view) in before.iter().zip(world.robots()) {
            for obstacle in &obstacles {
                let clear = distance_to(obstacle, view.pose.x, view.pose.y) - view.radius_mm;
                assert!(clear > -0.1 * view.radius_mm, "{clear} mm in {obstacle:?}");
            }
            // Nobody gets through the long wall: its ends are far from those near its middle.
            if old.pose.x.abs() < 400.0 && view.pose.x.abs() < 400.0 {
                assert_eq!(side(old.pose.x, old.pose.y), side(view.pose.x, view.pose.y));
            }
        }
    }
    assert!(world.statistics().wall_ticks > 100);
}

#[test]
fn a_robot_placed_in_an_obstacle_is_pushed_out() {
    let mut world = World::new(exact()).unwrap();
    world.add_obstacle(Obstacle::Box { x: 0.0, y: 0.0, width: 200.0, height: 100.0 });
    let id = kilobot(&mut world, 20.0, 30.0, 0.0, Probe::default());
    run(&mut world, 1);
    close(pose(&world, id).y, 50.0 + 16.5, 0.02);
    close(pose(&world, id).x, 20.0, 0.02);
}

/// Where an obstacle pushes a Kilobot that is put at a place.
fn pushed(obstacle: Obstacle, x: f32, y: f32) -> (f32, f32) {
    let mut world = World::new(exact()).unwrap();
    world.add_obstacle(obstacle);
    let id = kilobot(&mut world, x, y, 0.0, Probe::default());
    let Pose { x, y, .. } = pose(&world, id);
    (x, y)
}

/// The middle is exactly on a side or a corner. It must not be pushed into the box.
#[test]
fn a_robot_on_the_rim_of_a_box_is_pushed_out() {
    let straight = Obstacle::Box { x: 0.0, y: 0.0, width: 200.0, height: 100.0 };
    for (at, to) in [
        ((-100.0, 10.0), (-116.5, 10.0)),
        ((100.0, 10.0), (116.5, 10.0)),
        ((10.0, -50.0), (10.0, -66.5)),
        ((10.0, 50.0), (10.0, 66.5)),
    ] {
        assert_eq!(pushed(straight, at.0, at.1), to);
    }
    for (x, y) in [(100.0, 50.0), (-100.0, 50.0), (-100.0, -50.0), (100.0, -50.0)] {
        let (far_x, far_y) = pushed(straight, x, y);
        close(distance_to(&straight, far_x, far_y), 16.5, 0.01);
        // The same corner of a box that is turned around its middle.
        let (sin, cos) = 0.7_f32.sin_cos();
        let turned = turned_box(30.0, -20.0, 200.0, 100.0, 0.7);
        let (to_x, to_y) = pushed(turned, 30.0 + x * cos - y * sin, -20.0 + x * sin + y * cos);
        close(distance_to(&turned, to_x, to_y), 16.5, 0.01);
    }
}

/// A box of 200 mm by 100 mm, turned by 45 degrees. With c = cos 45 degrees = 0.70711, (x, y) is ((x + y) c, (y - x) c) along
/// its sides.
#[test]
fn a_turned_box_pushes_through_its_nearest_side() {
    let turned = turned_box(0.0, 0.0, 200.0, 100.0, std::f32::consts::FRAC_PI_4);
    for (at, to) in [
        // (70.71, 70.71) along the sides is 20.71 mm from the longer side: free.
        ((0.0, 100.0), (0.0, 100.0)),
        // (63.64, 63.64) goes to (63.64, 66.5), which is ((63.64 - 66.5) c, (63.64 + 66.5) c).
        ((0.0, 90.0), (-2.02, 92.02)),
        // (7.07, -7.07), inside, goes to (7.07, -66.5).
        ((10.0, 0.0), (52.02, -42.02)),
        // (98.99, 14.14), inside, is nearer to the shorter side: (116.5, 14.14).
        ((60.0, 80.0), (72.38, 92.38)),
    ] {
        let (x, y) = pushed(turned, at.0, at.1);
        close(x, to.0, 0.02);
        close(y, to.1, 0.02);
    }
    // The sign of the sizes and the length of the direction do not matter; without a direction there is no box.
    let long =
        Obstacle::TurnedBox { x: 0.0, y: 0.0, width: -200.0, height: -100.0, along: (7.0, 7.0) };
    let (x, y) = pushed(long, 10.0, 0.0);
    close(x, 52.02, 0.02);
    close(y, -42.02, 0.02);
    for along in [(0.0, 0.0), (f32::NAN, 1.0), (f32::INFINITY, 1.0)] {
        let none = Obstacle::TurnedBox { x: 0.0, y: 0.0, width: 200.0, height: 100.0, along };
        assert_eq!(pushed(none, 10.0, 0.0), (10.0, 0.0));
    }
}

/// A quarter turn exchanges the sides.
#[test]
fn a_box_turned_by_90_degrees_has_exchanged_sides() {
    let exchanged = Obstacle::Box { x: 20.0, y: -10.0, width: 90.0, height: 240.0 };
    for quarters in [1.0, 3.0, -1.0] {
        let angle = quarters * std::f32::consts::FRAC_PI_2;
        let turned = turned_box(20.0, -10.0, 240.0, 90.0, angle);
        for place in 0..400 {
            let (x, y) = ((place % 20) as f32 * 13.1 - 100.0, (place / 20) as f32 * 17.3 - 180.0);
            let (found, expected) = (pushed(turned, x, y), pushed(exchanged, x, y));
            close(found.0, expected.0, 0.001);
            close(found.1, expected.1, 0.001);
        }
    }
}

/// Robots that run into obstacles and into each other, in a world and in the same world turned by an angle.
#[test]
fn a_turned_world_gives_turned_ways() {
    let (angle, ticks) = (0.65_f32, 300);
    let (sin, cos) = angle.sin_cos();
    let turned = |x: f32, y: f32| (x * cos - y * sin, x * sin + y * cos);
    let mut worlds = [0, 1].map(|_| World::new(exact()).unwrap());
    let obstacles = [
        (Obstacle::Box { x: 0.0, y: 0.0, width: 300.0, height: 100.0 }, 0.0),
        (turned_box(250.0, 200.0, 150.0, 60.0, 1.1), 1.1),
        (Obstacle::Round { x: -250.0, y: 150.0, radius: 50.0 }, 0.0),
        (Obstacle::Segment { from: (-300.0, -150.0), to: (200.0, -200.0) }, 0.0),
    ];
    for (obstacle, heading) in obstacles {
        worlds[0].add_obstacle(obstacle);
        worlds[1].add_obstacle(match obstacle {
            Obstacle::Box { x, y, width, height }
            | Obstacle::TurnedBox { x, y, width, height, .. } => {
                let (x, y) = turned(x, y);
                turned_box(x, y, width, height, heading + angle)
            }
            Obstacle::Round { x, y, radius } => {
                let (x, y) = turned(x, y);
                Obstacle::Round { x, y, radius }
            }
            Obstacle::Segment { from, to } => {
                Obstacle::Segment { from: turned(from.0, from.1), to: turned(to.0, to.1) }
            }
        });
    }
    let mut stream = Stream::for_brain(5, 0);
    for _ in 0..25 {
        let (x, y) = (stream.unit() * 700.0 - 350.0, stream.unit() * 500.0 - 250.0);
        let heading = stream.unit() * 6.0;
        let motors = (65 + stream.below(10) as i16, 65 + stream.below(10) as i16);
        let brain = Probe::driving(motors.0, motors.1);
        kilobot(&mut worlds[0], x, y, heading, brain.clone());
        let (x, y) = turned(x, y);
        kilobot(&mut worlds[1], x, y, heading + angle, brain);
    }
    worlds.iter_mut().for_each(|world| run(world, ticks));
    let [straight, aslant] = worlds;
    for (one, other) in straight.robots().zip(aslant.robots()) {
        let (x, y) = turned(one.pose.x, one.pose.y);
        close(other.pose.x, x, 0.5);
        close(other.pose.y, y, 0.5);
    }
    assert!(straight.statistics().wall_ticks > 500, "{:?}", straight.statistics());
    assert_eq!(aslant.statistics().wall_ticks, straight.statistics().wall_ticks);
}

#[test]
fn a_robot_flying_over_others_has_no_contact() {
    let mut world = World::new(exact()).unwrap();
    kilobot(&mut world, 0.0, 0.0, 0.0, Probe::default());
    let over = Pose { z: 300.0, ..Pose::new(0.0, 0.0, 0.0) };
    let hover = Probe::flying(0.0, 0.0, 0.0);
    world.add(RobotKind::Crazyflie, over, hover).unwrap();
    run(&mut world, 10);
    assert_eq!(world.statistics().contacts, 0);
}

#[test]
fn a_moved_robot_arrives_at_its_new_place() {
    let mut world = World::new(exact()).unwrap();
    let id = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::default());
    world.move_to(id, Pose::new(300.0, -200.0, 1.0)).unwrap();
    run(&mut world, 1);
    assert_eq!(pose(&world, id), Pose::new(300.0, -200.0, 1.0));
    world.move_to(id, Pose::new(1e9, 0.0, 0.0)).unwrap();
    assert_eq!(pose(&world, id).x, 2000.0 - 16.5);
    assert!(world.move_to(RobotId(7), Pose::default()).is_err());
}
