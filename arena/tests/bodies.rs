//! Bodies move as the formulas say.

use crate::common::robots::{RobotKind, Settings, World};
use bittybuzz_crazyflie_model::{Positioning, Velocity};
use bittybuzz_kilobot_model::{KilobotModel, Preset};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use crate::common::*;
use bittybuzz_arena::engine::{Area, Pose, RobotId, wrap};

/// Where a leg of a standard Kilobot stands: 25 mm between the pins, the middle 9.2 mm before them (ARGoS' plugin).
fn leg(pose: &Pose, side: f32) -> (f32, f32) {
    let (sin, cos) = pose.heading.sin_cos();
    let (back, out) = (-9.2, 12.5 * side);
    (pose.x + back * cos - out * sin, pose.y + back * sin + out * cos)
}

#[test]
fn a_kilobot_goes_straight_at_10_mm_per_second() {
    let mut world = World::new(exact()).unwrap();
    let id = kilobot(&mut world, 0.0, 0.0, 0.7, Probe::driving(70, 70));
    run(&mut world, 100);
    let after = pose(&world, id);
    close(after.x, 100.0 * 0.7_f32.cos(), 0.05);
    close(after.y, 100.0 * 0.7_f32.sin(), 0.05);
    close(after.heading, 0.7, 1e-4);
}

#[test]
fn a_kilobot_turns_about_one_leg() {
    for (motors, side) in [((70, 0), 1.0), ((0, 70), -1.0)] {
        let mut world = World::new(exact()).unwrap();
        let id = kilobot(&mut world, 5.0, -3.0, 0.3, Probe::driving(motors.0, motors.1));
        let before = pose(&world, id);
        let pivot = leg(&before, side);
        for _ in 0..80 {
            world.tick();
            let (x, y) = leg(&pose(&world, id), side);
            close(x, pivot.0, 0.1);
            close(y, pivot.1, 0.1);
        }
        // 8 s of 45 degrees per second: a whole turn.
        let after = pose(&world, id);
        close(after.x, before.x, 0.1);
        close(after.heading, before.heading, 1e-3);
    }
}

#[test]
fn left_is_anticlockwise() {
    let mut world = World::new(exact()).unwrap();
    let left = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::driving(70, 0));
    let right = kilobot(&mut world, 500.0, 0.0, 0.0, Probe::driving(0, 70));
    run(&mut world, 20);
    close(pose(&world, left).heading, FRAC_PI_2, 1e-3);
    close(pose(&world, right).heading, -FRAC_PI_2, 1e-3);
}

/// Up to duty 60 nothing moves; the calibrated duty is 70.
#[test]
fn the_effect_is_linear_above_the_dead_zone() {
    let mut world = World::new(exact()).unwrap();
    let half = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::driving(65, 65));
    let twice = kilobot(&mut world, 0.0, 500.0, 0.0, Probe::driving(80, 0));
    run(&mut world, 10);
    close(pose(&world, half).x, 5.0, 0.01);
    close(pose(&world, twice).heading, 2.0 * FRAC_PI_4, 1e-3);
}

/// What both motors have in common drives, what the left has more turns left.
#[test]
fn different_motor_gains_make_a_curve() {
    let mut world = World::new(exact()).unwrap();
    let id = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::driving(71, 70));
    run(&mut world, 10);
    close(pose(&world, id).heading, 0.1 * FRAC_PI_4, 1e-3);
}

#[test]
fn kilobot_turn_rates_differ_by_10_percent() {
    let mut settings =
        Settings { seed: 5, area: Area { width: 10_000.0, height: 10_000.0 }, ..exact() };
    settings.kilobot.turn_sigma = 0.1;
    let mut world = World::new(settings).unwrap();
    let ids: Vec<_> = (0..4000)
        .map(|i| {
            let (x, y) = ((i % 80) as f32 * 100.0 - 4000.0, (i / 80) as f32 * 100.0 - 3000.0);
            let motors = if i % 2 == 0 { (70, 0) } else { (0, 70) };
            kilobot(&mut world, x, y, 0.0, Probe::driving(motors.0, motors.1))
        })
        .collect();
    run(&mut world, 10);
    for side in 0..2 {
        let gains: Vec<_> = ids
            .iter()
            .filter(|id| id.0 % 2 == side)
            .map(|&id| pose(&world, id).heading.abs() / FRAC_PI_4)
            .collect();
        let (mean, sigma) = moments(&gains);
        // 2,000 samples: the mean is known to 0.0022, the deviation to 1.6 %.
        close(mean, 1.0, 0.008);
        close(sigma, 0.1, 0.006);
    }
}

/// 13 %: 1.3 mm/s of 10 mm/s.
#[test]
fn kilobot_speeds_differ_by_13_percent() {
    let mut settings =
        Settings { seed: 6, area: Area { width: 10_000.0, height: 10_000.0 }, ..exact() };
    settings.kilobot.speed_sigma = KilobotModel::STANDARD.speed_sigma;
    let mut world = World::new(settings).unwrap();
    let start = |i: u16| (f32::from(i % 50) * 190.0 - 4900.0, f32::from(i / 50) * 100.0 - 2000.0);
    let ids: Vec<_> = (0..2000)
        .map(|i| kilobot(&mut world, start(i).0, start(i).1, 0.0, Probe::driving(70, 70)))
        .collect();
    run(&mut world, 100);
    let ways: Vec<_> = ids.iter().map(|&id| pose(&world, id).x - start(id.0).0).collect();
    let (mean, sigma) = moments(&ways);
    // 2,000 robots for 10 s: the mean is known to 0.3 mm, the deviation to 1.6 %.
    close(mean, 100.0, 0.9);
    close(sigma, 13.0, 0.63);
}

/// Speeds and turn rates that the other simulators have, at the duties of their calibration.
#[test]
fn presets_have_the_numbers_of_other_simulators() {
    let mut presets = [exact(); 3];
    presets[0].preset(Preset::Kilombo);
    presets[1].preset(Preset::Argos);
    presets[2].preset(Preset::Kilosim);
    let numbers = [
        (7.0, 13.0_f32.to_radians(), 75, 75),
        (60.0 * 48.0 / 255.0, 60.0 * 77.0 / 255.0 / 25.0, 48, 77),
        (24.0, 0.5, 70, 70),
    ];
    for (mut settings, (speed, rate, straight, turn)) in presets.into_iter().zip(numbers) {
        // Only Kilosim's robots differ; nobody's path is noisy.
        settings.kilobot.speed_sigma = 0.0;
        settings.kilobot.turn_sigma = 0.0;
        let mut world = World::new(settings).unwrap();
        let ahead = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::driving(straight, straight));
        let round = kilobot(&mut world, 0.0, 500.0, 0.0, Probe::driving(turn, 0));
        run(&mut world, 10);
        close(pose(&world, ahead).x, speed, 0.01);
        assert_eq!(pose(&world, ahead).heading, 0.0);
        close(pose(&world, round).heading, rate, 1e-3);
    }
}

fn zooid(world: &mut World<Probe>, x: f32, y: f32, left: i16, right: i16) -> RobotId {
    world.add(RobotKind::Zooid, Pose::new(x, y, 0.0), Probe::driving(left, right)).unwrap()
}

#[test]
fn a_zooid_has_a_dead_band_and_a_top_speed() {
    let mut world = World::new(exact()).unwrap();
    let cases = [(22, 0.0), (41, 250.0), (60, 500.0), (100, 500.0), (-41, -250.0)];
    let ids = cases.map(|(duty, _)| zooid(&mut world, 0.0, f32::from(duty) * 15.0, duty, duty));
    run(&mut world, 10);
    for ((_, moved), id) in cases.into_iter().zip(ids) {
        close(pose(&world, id).x, moved, 0.1);
    }
}

/// Wheels at 125 and 375 mm/s on a track of 20 mm: 12.5 rad/s on a circle of 20 mm.
#[test]
fn a_zooid_drives_arcs() {
    let mut world = World::new(exact()).unwrap();
    // Duties 31.5 and 50.5 do not exist: 32 and 50 give 500 * 10/38 and 500 * 28/38.
    let id = zooid(&mut world, 0.0, 0.0, 32, 50);
    let (left, right) = (500.0 * 10.0 / 38.0, 500.0 * 28.0 / 38.0);
    let (speed, rate): (f32, f32) = ((left + right) / 2.0, (right - left) / 20.0);
    for tick in 1..=20 {
        world.tick();
        let (angle, radius) = (rate * 0.1 * tick as f32, speed / rate);
        let now = pose(&world, id);
        close(now.x, radius * angle.sin(), 0.1);
        close(now.y, radius * (1.0 - angle.cos()), 0.1);
        close(wrap(now.heading - angle), 0.0, 1e-3);
    }
}

/// The projector's stripes are 0.92 mm wide, the diodes 19.6 mm apart.
#[test]
fn a_zooid_estimates_its_position_to_one_stripe() {
    let mut world = World::new(exact()).unwrap();
    let ids: Vec<_> = (0..200)
        .map(|i| {
            let pose = Pose::new((i % 20) as f32 * 37.3, (i / 20) as f32 * 41.7, i as f32 * 0.37);
            world.add(RobotKind::Zooid, pose, Probe::default()).unwrap()
        })
        .collect();
    run(&mut world, 1);
    let mut off = Vec::new();
    for id in ids {
        let view = world.robot(id).unwrap();
        let estimate = view.estimate.unwrap();
        close(estimate.x, view.pose.x, 0.47);
        close(estimate.y, view.pose.y, 0.47);
        off.push(wrap(estimate.heading - view.pose.heading));
    }
    // Both ends of the line are off by up to half a stripe in each coordinate.
    assert!(off.iter().all(|angle| angle.abs() < 0.92 * 1.5 / 19.6));
    assert!(off.iter().any(|angle| angle.abs() > 0.01));
}

/// What the robot knows is one frame of the projector (13.65 ms) old.
#[test]
fn a_moving_zooid_has_a_late_position_estimate() {
    let mut world = World::new(exact()).unwrap();
    let id = zooid(&mut world, 0.0, 0.0, 60, 60);
    for _ in 0..10 {
        world.tick();
        let view = world.robot(id).unwrap();
        close(view.pose.x - view.estimate.unwrap().x, 500.0 * 0.013_65, 0.47);
    }
}

fn hovering(world: &mut World<Probe>, x: f32, z: f32, brain: Probe) -> RobotId {
    let pose = Pose { z, ..Pose::new(x, 0.0, 0.0) };
    world.add(RobotKind::Crazyflie, pose, brain).unwrap()
}

/// First-order lag: x(t) = v (t - T (1 - e^(-t/T))).
#[test]
fn a_crazyflie_follows_with_a_lag() {
    let mut settings = exact();
    settings.crazyflie.acceleration = 1e6;
    let mut world = World::new(settings).unwrap();
    let id = hovering(&mut world, 0.0, 500.0, Probe::flying(500.0, 0.0, 0.0));
    for tick in 1..=20 {
        world.tick();
        let t = tick as f32 * 0.1;
        let lag = settings.crazyflie.lag;
        // The integration's substeps of 25 ms run ahead by up to half a substep.
        close(
            pose(&world, id).x,
            500.0 * (t - lag * (1.0 - (-t / lag).exp())),
            500.0 * 0.0125 + 0.1,
        );
    }
}

#[test]
fn a_crazyflie_respects_its_limits() {
    let settings = exact();
    let mut world = World::new(settings).unwrap();
    let id = hovering(&mut world, -1500.0, 500.0, Probe::flying(5000.0, 0.0, 0.0));
    let (mut place, mut speed) = (pose(&world, id).x, 0.0);
    for _ in 0..20 {
        world.tick();
        let now = pose(&world, id).x;
        let fast = (now - place) / 0.1;
        assert!(fast <= 1000.1, "{fast} mm/s");
        // Mean speeds of neighboring ticks differ by at most what 0.1 s of acceleration give.
        assert!(fast - speed <= 360.1, "{} mm/s2", (fast - speed) / 0.1);
        (place, speed) = (now, fast);
    }
    close(speed, 1000.0, 5.0);
}

#[test]
fn a_crazyflie_flies_in_its_own_frame_and_falls_when_off() {
    let mut world = World::new(exact()).unwrap();
    let brain = Probe::flying(0.0, 300.0, 0.0);
    let pose_up = Pose { z: 1000.0, ..Pose::new(0.0, 0.0, FRAC_PI_2) };
    let id = world.add(RobotKind::Crazyflie, pose_up, brain).unwrap();
    run(&mut world, 20);
    // Left of a robot that looks up the y axis is along -x.
    assert!(pose(&world, id).x < -400.0);
    close(pose(&world, id).y, 0.0, 1.0);
    world.brain_mut(id).unwrap().fly = None;
    run(&mut world, 10);
    let fallen = pose(&world, id);
    close(fallen.z, 0.0, 0.0);
    run(&mut world, 10);
    assert_eq!(pose(&world, id), fallen, "it lies still");
}

#[test]
fn a_crazyflie_on_the_ground_rises_only_upwards() {
    let mut world = World::new(exact()).unwrap();
    let stays = hovering(&mut world, 0.0, 0.0, Probe::flying(500.0, 0.0, 0.0));
    let rises = hovering(&mut world, 500.0, 0.0, Probe::flying(0.0, 0.0, 300.0));
    run(&mut world, 20);
    assert_eq!(pose(&world, stays).x, 0.0);
    close(pose(&world, rises).z, 300.0 * (2.0 - 0.3), 10.0);
}

/// 400 robots: the deviation of what they believe is known to 3.5 %.
fn drift(positioning: Positioning, ticks: u64) -> (f32, f32) {
    let mut settings =
        Settings { seed: 9, area: Area { width: 20_000.0, height: 20_000.0 }, ..exact() };
    settings.crazyflie.positioning = positioning;
    let mut world = World::new(settings).unwrap();
    let hover = Probe { fly: Some(Velocity::default()), ..Probe::default() };
    for i in 0..400 {
        let (x, y) = ((i % 20) as f32 * 500.0 - 5000.0, (i / 20) as f32 * 500.0 - 5000.0);
        let pose = Pose { z: 500.0, ..Pose::new(x, y, 0.0) };
        world.add(RobotKind::Crazyflie, pose, hover.clone()).unwrap();
    }
    run(&mut world, ticks);
    let (mut place, mut yaw) = (Vec::new(), Vec::new());
    for view in world.robots() {
        let estimate = view.estimate.unwrap();
        place.extend([estimate.x - view.pose.x, estimate.y - view.pose.y]);
        yaw.push(wrap(estimate.heading - view.pose.heading));
    }
    (moments(&place).1, moments(&yaw).1)
}

#[test]
fn flow_drifts_with_the_root_of_time() {
    let flow = Positioning::Flow { walk: 5.0, yaw_walk: 0.002 };
    let (place, yaw) = drift(flow, 40);
    close(place, 5.0 * 2.0, 1.0);
    close(yaw, 0.002 * 2.0, 0.000_6);
    let (place, _) = drift(flow, 640);
    close(place, 5.0 * 8.0, 4.0);
}

#[test]
fn lighthouse_does_not_drift() {
    for ticks in [10, 300] {
        let (place, yaw) = drift(Positioning::LIGHTHOUSE, ticks);
        close(place, 10.0, 1.0);
        close(yaw, 0.01, 0.0015);
    }
}

#[test]
fn a_robot_without_positioning_has_no_estimate() {
    let mut settings = exact();
    settings.crazyflie.positioning = Positioning::None;
    let mut world = World::new(settings).unwrap();
    let id = hovering(&mut world, 0.0, 100.0, Probe::default());
    run(&mut world, 3);
    assert_eq!(world.robot(id).unwrap().estimate, None);
}

#[test]
fn angles_are_wrapped() {
    for turns in -3..=3 {
        close(wrap(0.5 + turns as f32 * 2.0 * PI), 0.5, 1e-5);
    }
    assert_eq!(wrap(-PI), PI);
    assert_eq!(wrap(PI), PI);
}
