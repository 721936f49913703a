//! Nothing that a script, a scenario or chance does panics the engine or takes a robot out of the world.

use crate::common;
use crate::common::robots::{RobotKind, Settings, World};
use bittybuzz_arena::engine::{
    Area, Brain, Io, Lamp, Loss, Medium, Obstacle, Pose, RobotId, Stream,
};
use bittybuzz_crazyflie_model::{Flight, Positioning, Velocity};
use bittybuzz_kilobot_model::KilobotMotors;
use bittybuzz_motion::drive::Wheels;
use bittybuzz_zooids_model::Drive;

/// Pushes every button at random, and every number a float can be.
struct Mad(Stream);

fn number(stream: &mut Stream) -> f32 {
    const ODD: [f32; 8] =
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30, 0.0, -0.0, f32::MIN_POSITIVE];
    match stream.below(3) {
        0 => ODD[stream.below(8) as usize],
        1 => f32::from_bits(stream.below(u32::MAX)),
        _ => (stream.unit() - 0.5) * 4000.0,
    }
}

impl Brain for Mad {
    fn tick(&mut self, io: &mut Io<'_>) {
        let stream = &mut self.0;
        let longest = io.inbox.iter().map(|frame| frame.bytes.len()).max();
        assert!(longest.unwrap_or(0) <= 49);
        assert!(io.sensors.light() <= 1023);
        *io.led = stream.below(256) as u8;
        if let Some(motors) = io.controls::<KilobotMotors>() {
            (motors.left, motors.right) = (stream.below(256) as u8, stream.below(256) as u8);
        } else if let Some(drive) = io.controls::<Drive>() {
            let [left, right] = [(); 2].map(|()| stream.below(256) as i8);
            *drive = Drive::Wheels(Wheels { left, right });
        } else if let Some(flight) = io.controls::<Flight>() {
            *flight = match stream.below(4) {
                0 => Flight::Off,
                _ => Flight::Velocity(Velocity {
                    forward: number(stream),
                    left: number(stream),
                    up: number(stream),
                    turn: number(stream),
                }),
            };
        }
    }

    fn has_frame(&self) -> bool {
        !self.0.clone().chance(0.2)
    }

    /// Up to twice as long as any frame.
    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        frame.fill(self.0.below(256) as u8);
        self.0.below(99) as usize
    }
}

/// Settings at the edges of what is allowed.
fn settings(seed: u64, stream: &mut Stream) -> Settings {
    let mut settings = Settings { seed, ..Settings::default() };
    let side = |stream: &mut Stream| [1.0, 30.0, 400.0, 1500.0, 1e6][stream.below(5) as usize];
    settings.area = Area { width: side(stream), height: side(stream) };
    settings.kilobot.speed = stream.unit() * 1e4;
    settings.kilobot.turn_rate = stream.unit() * 100.0;
    settings.kilobot.speed_sigma = stream.unit();
    settings.kilobot.turn_sigma = stream.unit();
    settings.kilobot.bias_sigma = stream.unit() * 100.0;
    settings.kilobot.noise_sigma = stream.unit() * 100.0;
    settings.kilobot.noise_time = stream.unit() * 10.0;
    settings.kilobot.dead_duty = stream.below(70) as u8;
    settings.crazyflie.lag = stream.unit() - 0.5;
    settings.crazyflie.lag = settings.crazyflie.lag.max(0.0);
    settings.crazyflie.positioning =
        [Positioning::None, Positioning::FLOW, Positioning::LOCO][stream.below(3) as usize];
    for link in common::links(&mut settings) {
        link.range = [None, Some(0.0), Some(50.0), Some(1e6)][stream.below(4) as usize];
        link.loss = Loss { near: stream.unit(), far: stream.unit() };
        link.duplicate = stream.unit();
        link.reorder = stream.unit();
    }
    settings.infrared.tx_period = [0, 1, 781, u16::MAX][stream.below(4) as usize];
    settings.infrared.clock_sigma = 0.1 * stream.unit();
    settings.nrf24.backoff_us = [1, 100_000][stream.below(2) as usize];
    settings.p2p.pause_us = [[0, 0], [0, 100_000], [100_000; 2]][stream.below(3) as usize];
    settings
}

fn disturb(world: &mut World<Mad>, stream: &mut Stream) {
    let id = RobotId(stream.below(50) as u16);
    let other = RobotId(stream.below(50) as u16);
    // Ids may be unknown: refusals are part of the game.
    match stream.below(14) {
        0 => world.fail(id).unwrap_or(()),
        1 => world.stop(id).unwrap_or(()),
        2 => world.resume(id).unwrap_or(()),
        3 => {
            let (x, y, z, heading) =
                (number(stream), number(stream), number(stream), number(stream));
            world.move_to(id, Pose { x, y, z, heading }).unwrap_or(());
        }
        4 => world.block(id, other).unwrap_or(()),
        5 => world.unblock(id, other).unwrap_or(()),
        6 => {
            let parts = stream.below(4) + 1;
            world.partition(|id| (u32::from(id.0) % parts) as u8);
        }
        7 => world.heal(),
        8 => world.set_loss(Medium::ALL[stream.below(3) as usize], Loss::even(number(stream))),
        9 => world.set_ambient_light(number(stream)),
        10 => {
            let (x, y, intensity) = (number(stream), number(stream), number(stream));
            world.add_light(Lamp { x, y, intensity });
        }
        11 => {
            let mut two = || (number(stream), number(stream));
            let (from, to) = (two(), two());
            world.add_obstacle(Obstacle::Segment { from, to });
        }
        12 => {
            let (x, y, radius) = (number(stream), number(stream), number(stream) / 100.0);
            world.add_obstacle(Obstacle::Round { x, y, radius });
        }
        _ => {
            let (x, y) = (number(stream), number(stream));
            let (width, height) = (number(stream) / 20.0, number(stream) / 20.0);
            world.add_obstacle(Obstacle::Box { x, y, width, height });
        }
    }
}

#[test]
fn random_scenarios_run_without_a_panic() {
    for seed in 0..100 {
        let mut stream = Stream::for_brain(seed, 99);
        let settings = settings(seed, &mut stream);
        let mut world = World::new(settings).unwrap();
        for tick in 0..40 {
            if tick % 10 == 0 {
                for _ in 0..10 {
                    let kinds = [RobotKind::Kilobot, RobotKind::Zooid, RobotKind::Crazyflie];
                    let place = |stream: &mut Stream, side: f32| (stream.unit() - 0.5) * side;
                    let pose = Pose {
                        z: 300.0 * stream.unit(),
                        ..Pose::new(
                            place(&mut stream, settings.area.width),
                            place(&mut stream, settings.area.height),
                            number(&mut stream),
                        )
                    };
                    let brain = Mad(Stream::for_brain(seed, world.len() as u16));
                    // A heading that is no number is refused.
                    let _ = world.add(kinds[stream.below(3) as usize], pose, brain);
                }
            }
            disturb(&mut world, &mut stream);
            world.tick();
            for view in world.robots() {
                let Pose { x, y, z, heading } = view.pose;
                assert!(settings.area.contains(x, y), "seed {seed}: {view:?}");
                assert!(z >= 0.0 && z.is_finite(), "seed {seed}: {view:?}");
                assert!(heading.abs() <= std::f32::consts::PI, "seed {seed}: {view:?}");
                if let Some(estimate) = view.estimate {
                    let Pose { x, y, z, heading } = estimate;
                    assert!([x, y, z, heading].iter().all(|part| part.is_finite()));
                }
            }
        }
    }
}
