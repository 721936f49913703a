//! Walls, obstacles and pucks block infrared and light. Radio passes them.

use crate::common::robots::{RobotKind, World};
use crate::common::*;
use bittybuzz_arena::engine::{Lamp, Medium, MovableDisc, Obstacle, Pose};

/// Things between (-30, 0) and (30, 0), and the same beside the line.
const BETWEEN: [(Obstacle, Obstacle); 4] = [
    (
        Obstacle::Segment { from: (0.0, -300.0), to: (0.0, 300.0) },
        Obstacle::Segment { from: (0.0, 10.0), to: (0.0, 300.0) },
    ),
    (
        Obstacle::Round { x: 0.0, y: 3.0, radius: 5.0 },
        Obstacle::Round { x: 0.0, y: 6.0, radius: 5.0 },
    ),
    (
        Obstacle::Box { x: 0.0, y: 0.0, width: 4.0, height: 100.0 },
        Obstacle::Box { x: 0.0, y: 60.0, width: 4.0, height: 100.0 },
    ),
    (
        Obstacle::TurnedBox { x: 0.0, y: 0.0, width: 4.0, height: 100.0, along: (1.0, 0.4) },
        Obstacle::TurnedBox { x: 0.0, y: 60.0, width: 4.0, height: 100.0, along: (1.0, 0.4) },
    ),
];

/// Two who talk, 60 mm apart: as many frames arrive as without a wall, or none.
#[test]
fn a_wall_blocks_every_frame() {
    for (between, beside) in BETWEEN {
        for (obstacle, is_between) in [(between, true), (beside, false)] {
            let mut world = World::new(exact()).unwrap();
            world.add_obstacle(obstacle);
            let ids = [-30.0, 30.0].map(|x| kilobot(&mut world, x, 0.0, 0.0, Probe::talking()));
            run(&mut world, 100);
            let link = *world.statistics().link(Medium::Infrared);
            let all = ids.map(|id| probe(&world, id).received.len());
            assert!(link.sent >= 36, "{obstacle:?}");
            if is_between {
                assert_eq!(all, [0, 0], "{obstacle:?}");
                // A frame behind the wall is neither sensed nor missed.
                assert_eq!((link.received, link.lost, link.collided, link.deaf), (0, 0, 0, 0));
                assert_eq!(link.postponed, 0);
            } else {
                assert!(all.into_iter().all(|count| count >= 17), "{obstacle:?}: {all:?}");
            }
            assert_eq!(world.connects(ids[0], ids[1]), !is_between, "{obstacle:?}");
            assert_eq!(world.can_receive(ids[0], ids[1]), !is_between, "{obstacle:?}");
        }
    }
}

/// A frame that a wall blocks does not collide with one that arrives.
#[test]
fn hidden_terminals_behind_a_wall_do_not_collide() {
    let mut collided = [0, 0];
    for seed in 0..10 {
        for (has_wall, collided) in [false, true].into_iter().zip(&mut collided) {
            let mut world = World::new(busy(seed)).unwrap();
            if has_wall {
                world.add_obstacle(Obstacle::Segment { from: (40.0, -300.0), to: (40.0, 300.0) });
            }
            kilobot(&mut world, -80.0, 0.0, 0.0, Probe::talking());
            kilobot(&mut world, 0.0, 0.0, 0.0, Probe::default());
            kilobot(&mut world, 80.0, 0.0, 0.0, Probe::talking());
            run(&mut world, 300);
            *collided += world.statistics().link(Medium::Infrared).collided;
        }
    }
    assert!(collided[0] > 50, "{collided:?}");
    assert_eq!(collided[1], 0);
}

/// A low wall blocks infrared, which is reflected by the ground, and casts no shadow on a sensor of 34 mm; a puck that leaves the
/// line lets both pass again.
#[test]
fn heights_and_pucks() {
    let mut world = World::new(exact()).unwrap();
    world.add_light(Lamp { x: 400.0, y: 0.0, intensity: 1000.0 });
    let left = kilobot(&mut world, -30.0, 0.0, 0.0, Probe::talking());
    let right = kilobot(&mut world, 30.0, 0.0, 0.0, Probe::default());
    world.tick();
    let bright = probe(&world, left).light;
    assert!(bright > 0);
    world.add_obstacle_of_height(Obstacle::Segment { from: (0.0, -9.0), to: (0.0, 9.0) }, 5.0);
    run(&mut world, 50);
    assert_eq!(probe(&world, right).received.len(), 0);
    assert_eq!(probe(&world, left).light, bright);

    let mut world = World::new(exact()).unwrap();
    world.add_light(Lamp { x: 400.0, y: 0.0, intensity: 1000.0 });
    let left = kilobot(&mut world, -80.0, 0.0, 0.0, Probe::default());
    world.add_movable(MovableDisc { x: 0.0, y: 0.0, radius_mm: 10.0, height_mm: 50.0 });
    run(&mut world, 2);
    assert_eq!(probe(&world, left).light, 0);
    // Someone pushes the puck away from the line.
    kilobot(&mut world, 0.0, -40.0, std::f32::consts::FRAC_PI_2, Probe::driving(70, 70));
    run(&mut world, 100);
    assert!(world.movables().next().unwrap().y > 12.0);
    assert_eq!(probe(&world, left).light, bright_at(480.0));
}

/// ARGoS' law for a sensor that faces the lamp.
fn bright_at(distance_mm: f32) -> u16 {
    (1000.0 * (-0.002 * distance_mm).exp()) as u16
}

/// At 500 mm a lamp of 1023 gives 1023 exp(-1) = 376, and in the shadow of a box nothing.
#[test]
fn a_box_casts_a_shadow() {
    let mut world = World::new(exact()).unwrap();
    world.add_light(Lamp { x: 0.0, y: 0.0, intensity: 1023.0 });
    let id = kilobot(&mut world, 500.0, 0.0, std::f32::consts::PI, Probe::default());
    world.tick();
    assert_eq!(probe(&world, id).light, 376);
    assert_eq!(world.light(id).unwrap(), 376);
    world.add_obstacle(Obstacle::Box { x: 300.0, y: 0.0, width: 50.0, height: 600.0 });
    run(&mut world, 2);
    assert_eq!(probe(&world, id).light, 0);
    assert_eq!(world.light(id).unwrap(), 0);
    world.set_ambient_light(20.0);
    run(&mut world, 2);
    assert_eq!(probe(&world, id).light, 20);
}

#[test]
fn radio_passes_walls() {
    for kind in [RobotKind::Zooid, RobotKind::Crazyflie] {
        let mut world = World::new(exact()).unwrap();
        world.add_obstacle(Obstacle::Segment { from: (0.0, -300.0), to: (0.0, 300.0) });
        let ids = [-100.0, 100.0]
            .map(|x| world.add(kind, Pose::new(x, 0.0, 0.0), Probe::talking()).unwrap());
        run(&mut world, 20);
        assert!(probe(&world, ids[0]).received.len() > 15, "{kind:?}");
        assert!(world.connects(ids[0], ids[1]));
    }
}
