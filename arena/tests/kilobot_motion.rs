//! Kilobots that should drive straight ahead: differences between robots, and noise within a robot.

use std::sync::LazyLock;

use crate::common::robots::{RobotKind, Settings, World};
use crate::common::{close, moments};
use bittybuzz_arena::engine::{Area, Brain, Io, Pose, RobotId, wrap};
use bittybuzz_kilobot_model::{KilobotMotors, Preset};

/// Duties of the left and the right motor; it has nothing else to do.
struct Driver(u8, u8);

impl Brain for Driver {
    fn tick(&mut self, io: &mut Io<'_>) {
        if let Some(motors) = io.controls() {
            *motors = KilobotMotors { left: self.0, right: self.1 };
        }
    }
}

fn kilobot(world: &mut World<Driver>, x: f32, y: f32, duty: u8) -> RobotId {
    world.add(RobotKind::Kilobot, Pose::new(x, y, 0.0), Driver(duty, duty)).unwrap()
}

fn pose(world: &World<Driver>, id: RobotId) -> Pose {
    world.robot(id).unwrap().pose
}

fn run(world: &mut World<Driver>, ticks: u64) {
    for _ in 0..ticks {
        world.tick();
    }
}

/// Robots whose turns are measured.
const ROBOTS: usize = 400;

/// Seconds that they drive.
const SECONDS: usize = 300;

/// Degrees by which each robot turns in each second in which it should drive straight ahead. Contacts push bodies, but do not
/// turn them.
static TURNS: LazyLock<Vec<Vec<f32>>> = LazyLock::new(|| turns(Driver(70, 70)));

/// Degrees by which each robot turns in each second with these duties.
fn turns(driver: Driver) -> Vec<Vec<f32>> {
    let mut world = World::new(settings(3)).unwrap();
    let ids: Vec<_> = (0..ROBOTS)
        .map(|i| {
            let (x, y) = ((i % 20) as f32 * 180.0 - 1710.0, (i / 20) as f32 * 180.0 - 1710.0);
            let id = kilobot(&mut world, x, y, 0);
            *world.brain_mut(id).unwrap() = Driver(driver.0, driver.1);
            id
        })
        .collect();
    let mut turns = vec![Vec::new(); ROBOTS];
    for _ in 0..SECONDS {
        let before: Vec<_> = ids.iter().map(|&id| pose(&world, id).heading).collect();
        run(&mut world, 10);
        for ((turns, &id), before) in turns.iter_mut().zip(&ids).zip(before) {
            turns.push(wrap(pose(&world, id).heading - before).to_degrees());
        }
    }
    turns
}

fn settings(seed: u64) -> Settings {
    Settings { seed, area: Area { width: 4000.0, height: 4000.0 }, ..Settings::default() }
}

/// Root of the mean variance of the robots' turns, each around the mean of its robot.
fn within(turns: &[Vec<f32>]) -> f32 {
    let variances = turns.iter().map(|turns| moments(turns).1.powi(2));
    (variances.sum::<f32>() / turns.len() as f32).sqrt()
}

/// Robots that are not calibrated for each motor: a bias of 6 degrees per second (motor noise of the Sheffield plugin of ARGoS:
/// 1.86 mm/s at each of two pins 25 mm apart, 1.414 * 1.86 / 25 rad/s). The bias of a robot varies by a sixth of the spread
/// between robots (Raoufi, Romanczuk, Hamann, ALIFE 2023, figure 2).
///
/// The deviation of 400 robots is known to 1 / sqrt(2 * 400) = 3.5 %; three times that is 0.64 degrees per second.
/// Noise with a time constant of 10 s, averaged over 1 s, has 0.967 of its variance, and 0.064 of it goes into the mean of
/// 300 s: expected is sqrt(0.903) = 0.95 degrees per second. 400 * 300 s / 10 s = 12,000 independent samples know it to
/// 0.65 %; three times that is 0.02.
#[test]
fn heading_bias_differs_between_robots_six_times_more_than_within_one() {
    let turns = &*TURNS;
    let means: Vec<_> = turns.iter().map(|turns| moments(turns).0).collect();
    let (mean, between) = moments(&means);
    // The mean of 400 robots is known to 0.3 degrees per second.
    close(mean, 0.0, 0.9);
    close(between, 6.0, 0.64);
    let within = within(turns);
    close(within, 0.95, 0.02);
    // 6 / 0.95 with the 10.6 % of the spread between robots.
    close(between / within, 6.32, 0.7);
}

/// The noise lasts: after its time constant of 10 s it is correlated by 1 / e. 12,000 independent samples know a correlation to
/// 0.01; means of 300 s, which take 0.064 of the variance along, lower it to (0.968 * 0.368 - 0.064) / 0.903 = 0.323.
#[test]
fn heading_noise_has_a_time_constant_of_10_s() {
    let mut product = 0.0;
    for turns in TURNS.iter() {
        let mean = moments(turns).0;
        let pairs = turns.iter().zip(&turns[10..]);
        product += pairs.map(|(now, later)| (now - mean) * (later - mean)).sum::<f32>();
    }
    let covariance = product / (ROBOTS * (SECONDS - 10)) as f32;
    close(covariance / within(&TURNS).powi(2), 0.323, 0.03);
}

/// A turn is as noisy as its motor. Noise is drawn for each motor (ARGoS; the simulation of Raoufi et al.), so that of a robot
/// that drives straight, 1 degree per second, is the difference of two, and a motor alone has 1 / sqrt(2) of it. Over 1 s and
/// around the mean of 300 s, 0.95 of it are left, as above: 0.672.
#[test]
fn a_turn_with_one_motor_has_the_noise_of_one_motor() {
    for driver in [Driver(70, 0), Driver(0, 70)] {
        let side = if driver.0 > 0 { 1.0 } else { -1.0 };
        let turns = turns(driver);
        let means: Vec<_> = turns.iter().map(|turns| side * moments(turns).0).collect();
        let (mean, between) = moments(&means);
        // 45 degrees per second (ICRA 2012), with 10 % between robots; 400 robots know both to 0.22 and 0.16.
        close(mean, 45.0, 0.7);
        close(between, 4.5, 0.5);
        close(within(&turns), 0.672, 0.015);
    }
}

/// Kilombo's `skilobot.c`: the effect of a motor is (duty - 60) / 15 of that at duty 75, and at most twice it.
#[test]
fn motors_have_a_dead_zone_and_a_limit() {
    let mut settings = settings(4);
    settings.preset(Preset::Kilombo);
    let duties = [0, 1, 20, 59, 60, 61, 67, 75, 90, 91, 255];
    let mut world = World::new(settings).unwrap();
    let mut lane = -600.0;
    let ids = duties.map(|duty| {
        lane += 100.0;
        kilobot(&mut world, 0.0, lane, duty)
    });
    run(&mut world, 100);
    for (duty, id) in duties.into_iter().zip(ids) {
        let expected = ((f32::from(duty) - 60.0) / 15.0).clamp(0.0, 2.0) * 7.0 * 10.0;
        close(pose(&world, id).x, expected, 0.1);
    }
}

/// A standard Kilobot stands below 60 as well: the calibration of ARK starts there and goes up while the robot stands.
#[test]
fn a_kilobot_stands_below_duty_60() {
    let mut world = World::new(settings(4)).unwrap();
    let duties = [5, 20, 40, 60];
    let ids = duties.map(|duty| kilobot(&mut world, f32::from(duty) * 20.0, 0.0, 0));
    for (duty, id) in duties.into_iter().zip(ids) {
        *world.brain_mut(id).unwrap() = Driver(duty, if duty == 40 { 0 } else { duty });
    }
    let before = ids.map(|id| pose(&world, id));
    run(&mut world, 100);
    assert_eq!(ids.map(|id| pose(&world, id)), before);
}

/// The circle through three places in the first half minute is left by 5 mm and more. Without noise the path stays on it within
/// the rounding of coordinates. A robot whose bias is small has a large circle, whose fit is poor: half of them will do.
#[test]
fn kilobots_do_not_drive_perfect_circles() {
    let area = Area { width: 20_000.0, height: 20_000.0 };
    let mut world = World::new(Settings { area, ..settings(5) }).unwrap();
    let place = |i: usize| ((i % 10) as f32 * 1500.0 - 6750.0, (i / 10) as f32 * 1500.0 - 6750.0);
    let ids: Vec<_> = (0..100)
        .map(|i| {
            let (x, y) = place(i);
            kilobot(&mut world, x, y, 70)
        })
        .collect();
    let mut paths = vec![Vec::new(); 100];
    for _ in 0..=60 {
        for (number, (path, &id)) in paths.iter_mut().zip(&ids).enumerate() {
            let (Pose { x, y, .. }, (x0, y0)) = (pose(&world, id), place(number));
            path.push([x - x0, y - y0].map(f64::from));
        }
        run(&mut world, 10);
    }
    let leave = |path: &&Vec<[f64; 2]>| {
        let ([x, y], radius) = circle(path[0], path[15], path[30]);
        let off = |place: &[f64; 2]| ((place[0] - x).hypot(place[1] - y) - radius).abs();
        path.iter().map(off).fold(0.0, f64::max) > 5.0
    };
    let left = paths.iter().filter(leave).count();
    assert!(left > 50, "{left} of 100 leave their circle");
}

/// Center and radius of the circle through three places.
fn circle([ax, ay]: [f64; 2], [bx, by]: [f64; 2], [cx, cy]: [f64; 2]) -> ([f64; 2], f64) {
    let (bx, by, cx, cy) = (bx - ax, by - ay, cx - ax, cy - ay);
    let double = 2.0 * (bx * cy - by * cx);
    let (b, c) = (bx * bx + by * by, cx * cx + cy * cy);
    let (x, y) = ((cy * b - by * c) / double, (bx * c - cx * b) / double);
    ([ax + x, ay + y], x.hypot(y))
}

/// Headings of ten robots after a minute straight ahead, in which `drive` moves what has no brain.
fn headings(world: &mut World<Driver>, drive: impl Fn(&mut World<Driver>, RobotId)) -> Vec<f32> {
    let ids: Vec<_> =
        (0..10_u8).map(|i| kilobot(world, f32::from(i) * 200.0 - 900.0, 0.0, 0)).collect();
    for _ in 0..600 {
        for &id in &ids {
            drive(world, id);
        }
        run(world, 1);
    }
    ids.iter().map(|&id| pose(world, id).heading).collect()
}

fn has_brain(world: &mut World<Driver>, id: RobotId) {
    *world.brain_mut(id).unwrap() = Driver(70, 70);
}

/// Another kind of robot makes the substeps of all shorter; a Kilobot moves as without it. 4 degrees are what its noise
/// would differ by in far less than a minute, and 0.01 degrees what rounding of 2,400 substeps comes to.
#[test]
fn noise_does_not_depend_on_substeps() {
    let alone = headings(&mut World::new(settings(6)).unwrap(), has_brain);
    let mut world = World::new(settings(6)).unwrap();
    let whole = world.substeps();
    let beside = headings(&mut world, |world, id| {
        if world.len() == 10 {
            world.add(RobotKind::Crazyflie, Pose::new(0.0, 1000.0, 0.0), Driver(0, 0)).unwrap();
            assert!(world.substeps() > whole);
        }
        has_brain(world, id);
    });
    for (alone, beside) in alone.into_iter().zip(beside) {
        close(wrap(alone - beside).to_degrees(), 0.0, 0.01);
    }
}

/// Firmware in an emulator drives the same body in spans of its own, by duties in percent: 70 of 255 are 27.5 %.
#[test]
fn firmware_drives_the_same_body() {
    let duty = 100.0 * 70.0 / 255.0;
    let alone = headings(&mut World::new(settings(6)).unwrap(), has_brain);
    let spread = moments(&alone).1.to_degrees();
    assert!(spread > 45.0, "{spread}");
    let firmware = headings(&mut World::new(settings(6)).unwrap(), |world, id| {
        for _ in 0..5 {
            world.roll(id, [duty, duty], 0.02).unwrap().unwrap();
        }
    });
    for (alone, firmware) in alone.into_iter().zip(firmware) {
        close(wrap(alone - firmware).to_degrees(), 0.0, 0.01);
    }
}
