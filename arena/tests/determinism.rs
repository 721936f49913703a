//! One seed, one trace, on any number of threads.

use crate::common::robots::{RobotKind, Settings, Variant, World};
use crate::common::*;
use bittybuzz_arena::engine::{Area, Brain, Io, Lamp, Obstacle, Pose, RobotId, Stream};
use bittybuzz_crazyflie_model::{Flight, Positioning, Velocity};
use bittybuzz_kilobot_model::KilobotMotors;
use bittybuzz_motion::drive::Wheels;
use bittybuzz_zooids_model::Drive;

/// What it does depends on everything it was ever told.
struct Wanderer {
    stream: Stream,
    memory: u64,
    unsent: u8,
}

impl Wanderer {
    fn remember(&mut self, value: u64) {
        self.memory = (self.memory ^ value).wrapping_mul(0x0100_0000_01b3);
    }
}

impl Brain for Wanderer {
    fn tick(&mut self, io: &mut Io<'_>) {
        for frame in io.inbox.iter() {
            for &byte in frame.bytes {
                self.remember(u64::from(byte));
            }
            for part in frame.sighting.place().into_iter().flatten() {
                self.remember(u64::from(part.to_bits()));
            }
        }
        self.remember(u64::from(io.sensors.light()));
        if let Some(pose) = io.sensors.estimate() {
            self.remember(u64::from(pose.x.to_bits()));
        }
        let word = self.memory.to_le_bytes();
        self.unsent = 3;
        *io.led = word[3] & 7;
        let now = io.now;
        if let Some(motors) = io.controls::<KilobotMotors>() {
            (motors.left, motors.right) = (word[4] / 2, self.stream.below(128) as u8);
        } else if let Some(drive) = io.controls::<Drive>() {
            let [left, right] = [word[4], word[5]].map(|byte| byte as i8 / 2);
            *drive = Drive::Wheels(Wheels { left, right });
        } else if let Some(flight) = io.controls::<Flight>() {
            let part = |byte: u8| f32::from(byte) * 4.0 - 510.0;
            let up = if now < 5 { 500.0 } else { 0.0 };
            let turn = f32::from(word[6]) / 128.0 - 1.0;
            let velocity = Velocity { forward: part(word[4]), left: part(word[5]), up, turn };
            *flight = Flight::Velocity(velocity);
        }
    }

    fn has_frame(&self) -> bool {
        self.unsent > 0
    }

    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        self.unsent -= 1;
        // When it is asked is part of the trace.
        self.remember(u64::from(self.unsent));
        frame[0] = 5;
        frame[1..4].copy_from_slice(&self.memory.to_le_bytes()[..3]);
        4
    }
}

/// The digests of 40 ticks in which everything happens.
fn trace(seed: u64, threads: usize) -> Vec<u64> {
    let mut settings = Settings {
        seed,
        threads,
        area: Area { width: 3000.0, height: 2500.0 },
        ambient_light: 50.0,
        ..Settings::default()
    };
    settings.crazyflie.positioning = Positioning::FLOW;
    for link in links(&mut settings) {
        link.duplicate = 0.1;
        link.reorder = 0.2;
    }
    settings.infrared.tx_period = 500;
    settings.nrf24.link.range = Some(300.0);
    settings.p2p.link.range = Some(1000.0);
    let mut world = World::new(settings).unwrap();
    settings.kilobot.speed *= 4.0;
    settings.infrared.link.range = Some(40.0);
    let variants = [Variant::STANDARD, world.add_variant(settings).unwrap()];
    world.add_obstacle(Obstacle::Segment { from: (-900.0, -900.0), to: (500.0, 900.0) });
    world.add_obstacle(Obstacle::Round { x: 600.0, y: 0.0, radius: 150.0 });
    let lamp = world.add_light(Lamp { x: 0.0, y: 0.0, intensity: 900.0 });
    let mut stream = Stream::for_brain(seed, u16::MAX);
    let mut place = || {
        let (x, y) = (stream.unit() - 0.5, stream.unit() - 0.5);
        Pose::new(x * 2900.0, y * 2400.0, stream.unit() * 6.0)
    };
    for i in 0..1300_u16 {
        let kind = match i % 13 {
            0 => RobotKind::Zooid,
            1 => RobotKind::Crazyflie,
            _ => RobotKind::Kilobot,
        };
        let brain =
            Wanderer { stream: Stream::for_brain(seed, i), memory: u64::from(i), unsent: 0 };
        world.add_as(variants[usize::from(i % 4 == 0)], kind, place(), brain).unwrap();
    }
    (0..40)
        .map(|tick| {
            match tick {
                5 => world.fail(RobotId(7)).unwrap(),
                6 => world.stop(RobotId(8)).unwrap(),
                8 => world.partition(|id| (id.0 % 3) as u8),
                10 => world.block(RobotId(20), RobotId(40)).unwrap(),
                12 => world.move_to(RobotId(9), Pose::new(0.0, 0.0, 1.0)).unwrap(),
                15 => world.resume(RobotId(8)).unwrap(),
                16 => {
                    let brain = Wanderer { stream: stream.clone(), memory: 7, unsent: 0 };
                    world.restart(RobotId(7), brain).unwrap();
                }
                18 => world.heal(),
                20 => world.set_light(lamp, Lamp { x: 500.0, y: 500.0, intensity: 400.0 }),
                _ => {}
            }
            world.tick();
            let memory = world.ids().map(|id| world.brain(id).unwrap().memory);
            memory.fold(world.digest(), |sum, memory| sum.rotate_left(5) ^ memory)
        })
        .collect()
}

#[test]
fn the_number_of_threads_does_not_change_a_run() {
    let alone = trace(1, 1);
    for threads in [2, 3, 8] {
        assert_eq!(trace(1, threads), alone, "{threads} threads");
    }
}

#[test]
fn different_seeds_give_different_runs() {
    let (one, two) = (trace(1, 1), trace(2, 1));
    assert!(one.iter().zip(&two).all(|(one, two)| one != two));
}

/// Whether others are far away or not there at all makes no difference to a robot: nobody draws from anybody's chance.
#[test]
fn distant_robots_do_not_change_a_run() {
    let near = |with_others: bool| {
        let mut world = World::new(Settings { seed: 4, ..Settings::default() }).unwrap();
        let ids = [0.0, 60.0].map(|x| {
            let brain = Probe { motors: (70, 65), ..Probe::talking() };
            kilobot(&mut world, x - 800.0, -800.0, 0.0, brain)
        });
        if with_others {
            for i in 0..50 {
                let brain = Probe { motors: (60, 70), ..Probe::talking() };
                kilobot(
                    &mut world,
                    500.0 + (i % 7) as f32 * 40.0,
                    (i / 7) as f32 * 40.0,
                    0.0,
                    brain,
                );
            }
        }
        run(&mut world, 300);
        ids.map(|id| (pose(&world, id), probe(&world, id).received.clone()))
    };
    assert_eq!(near(true), near(false));
}
