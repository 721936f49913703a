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
    }
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
