//! What robots sense: light and distances.

use crate::common::robots::{RobotKind, Settings, World};
use std::f32::consts::FRAC_PI_2;

use crate::common::*;
use bittybuzz_arena::engine::{Area, Lamp, Obstacle, Pose, RobotId, Stream};

/// ARGoS' law: 1024 exp(-2 d) (1 - angle / pi), here with its intensity as a parameter.
#[test]
fn light_falls_with_distance_and_angle() {
    let mut world = World::new(exact()).unwrap();
    world.add_light(Lamp { x: 500.0, y: 0.0, intensity: 1000.0 });
    let cases = [(0.0, 1.0), (FRAC_PI_2, 0.5), (-FRAC_PI_2, 0.5), (std::f32::consts::PI, 0.0)];
    let ids = cases.map(|(heading, _)| kilobot(&mut world, 0.0, 0.0, heading, Probe::default()));
    // They stand at one place, but the first thing they do is to look.
    world.tick();
    for ((_, part), id) in cases.into_iter().zip(ids) {
        close(f32::from(probe(&world, id).light), 1000.0 * (-1.0_f32).exp() * part, 1.0);
    }
}

#[test]
fn ambient_light_adds_up_to_the_converter_limit() {
    let mut world = World::new(Settings { ambient_light: 300.0, ..exact() }).unwrap();
    let id = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::default());
    world.tick();
    assert_eq!(probe(&world, id).light, 300);
    let lamp = world.add_light(Lamp { x: 1.0, y: 0.0, intensity: 900.0 });
    world.tick();
    assert_eq!(probe(&world, id).light, 1023);
    world.set_light(lamp, Lamp { x: 1.0, y: 0.0, intensity: 0.0 });
    world.set_ambient_light(20.0);
    world.tick();
    assert_eq!(probe(&world, id).light, 20);
    // Beyond 2.5 m a lamp adds nothing.
    world.set_light(lamp, Lamp { x: -1900.0, y: 1900.0, intensity: 900.0 });
    world.tick();
    assert_eq!(probe(&world, id).light, 20);
}

fn hovering(world: &mut World<Probe>, pose: Pose) -> RobotId {
    world.add(RobotKind::Crazyflie, pose, Probe::flying(0.0, 0.0, 0.0)).unwrap()
}

#[test]
fn ranges_to_walls_obstacles_and_robots() {
    let area = Area { width: 8000.0, height: 3000.0 };
    let mut world = World::new(Settings { area, ..exact() }).unwrap();
    let at = |x, y, z, heading| Pose { z, ..Pose::new(x, y, heading) };
    // It looks up the y axis: left is -x.
    let id = hovering(&mut world, at(100.0, 0.0, 500.0, FRAC_PI_2));
    run(&mut world, 2);
    // Walls at y = 1500 and -1500; those at x = 4000 and -4000 are out of reach.
    let [front, left, back, right] = probe(&world, id).ranges;
    close(front.unwrap(), 1500.0, 0.1);
    close(back.unwrap(), 1500.0, 0.1);
    assert_eq!((left, right), (None, None));

    world.add_obstacle(Obstacle::Round { x: 100.0, y: 900.0, radius: 100.0 });
    world.add_obstacle(Obstacle::Segment { from: (-500.0, -100.0), to: (-600.0, 100.0) });
    world.add_obstacle(Obstacle::Box { x: 1000.0, y: 50.0, width: 400.0, height: 200.0 });
    hovering(&mut world, at(100.0, -700.0, 500.0, 0.0));
    // Too low to be seen.
    kilobot(&mut world, 100.0, -300.0, 0.0, Probe::default());
    run(&mut world, 2);
    let [front, left, back, right] = probe(&world, id).ranges.map(Option::unwrap);
    close(front, 800.0, 0.1);
    close(left, 100.0 + 550.0, 0.1);
    close(back, 700.0 - 60.0, 0.1);
    close(right, 800.0 - 100.0, 0.1);
}

/// A square of 200 mm that stands on a corner at (1000, 0): its corners are 141.42 mm from its middle. A wall of 400 mm by 20 mm
/// at (0, 1000) rises by 30 degrees, so that its lower side is at 1000 - 10 / cos 30 degrees above the middle.
#[test]
fn ranges_to_turned_boxes() {
    let area = Area { width: 8000.0, height: 6000.0 };
    let mut world = World::new(Settings { area, ..exact() }).unwrap();
    let turned = |x, y, width, height, degrees: f32| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Obstacle::TurnedBox { x, y, width, height, along: (cos, sin) }
    };
    world.add_obstacle(turned(1000.0, 0.0, 200.0, 200.0, 45.0));
    world.add_obstacle(turned(0.0, 1000.0, 400.0, 20.0, 30.0));
    let at = |y| Pose { z: 500.0, ..Pose::new(0.0, y, 0.0) };
    let ids = [at(0.0), at(-500.0), at(50.0 - 400.0)].map(|pose| hovering(&mut world, pose));
    run(&mut world, 2);
    let [corner, beside, _] = ids.map(|id| probe(&world, id).ranges);
    // Along the diagonal of the square, exactly at its corner.
    close(corner[0].unwrap(), 1000.0 - 141.42, 0.02);
    close(corner[1].unwrap(), 1000.0 - 11.547, 0.02);
    assert_eq!(beside[0], None);
    // 50 mm beside the corner, a side of 45 degrees is 50 mm further away.
    world.move_to(ids[2], at(-50.0)).unwrap();
    world.move_to(ids[0], at(400.0)).unwrap();
    run(&mut world, 2);
    close(probe(&world, ids[2]).ranges[0].unwrap(), 1000.0 - 91.42, 0.02);
}

/// Marching through the grid finds the robot that all robots' circles give.
#[test]
fn the_grid_gives_the_same_ranges_as_all_pairs() {
    let mut settings = exact();
    // Some begin in each other, and shall hover all the same.
    settings.crazyflie.crash_speed = 1e5;
    let mut world = World::new(settings).unwrap();
    let mut stream = Stream::for_brain(2, 2);
    for _ in 0..150 {
        let (x, y) = ((stream.unit() - 0.5) * 3900.0, (stream.unit() - 0.5) * 3900.0);
        hovering(&mut world, Pose { z: 100.0, ..Pose::new(x, y, stream.unit() * 6.0) });
    }
    run(&mut world, 40);
    let poses: Vec<_> = world.robots().map(|view| view.pose).collect();
    run(&mut world, 1);
    let mut seen = 0;
    for id in world.ids() {
        let own = poses[usize::from(id.0)];
        for (quarter, range) in probe(&world, id).ranges.into_iter().enumerate() {
            let (sin, cos) = (own.heading + quarter as f32 * FRAC_PI_2).sin_cos();
            let walls =
                [(2000.0 * cos.signum() - own.x) / cos, (2000.0 * sin.signum() - own.y) / sin];
            let mut nearest = walls[0].min(walls[1]);
            let others = poses.iter().enumerate().filter(|(other, _)| *other != usize::from(id.0));
            for (_, pose) in others {
                let (dx, dy) = (pose.x - own.x, pose.y - own.y);
                let (ahead, beside) = (dx * cos + dy * sin, dx * sin - dy * cos);
                if ahead > 0.0 && beside.abs() < 60.0 {
                    let hit = ahead - (60.0 * 60.0 - beside * beside).sqrt();
                    seen += u32::from(hit < nearest);
                    nearest = nearest.min(hit);
                }
            }
            close(range.unwrap_or(3490.0), nearest.min(3490.0), 1.0);
        }
    }
    assert!(seen > 100);
}
