//! Motion of single Kilobots.

use std::fmt::Write;

use super::check;
use crate::common::robots::{Settings, World};
use crate::common::*;
use bittybuzz_arena::engine::{Area, Pose, RobotId, wrap};

const ROBOTS: usize = 400;

/// Speeds in mm/s and turn rates in degrees per second of 400 robots, in each of 60 s.
fn drive(motors: (i16, i16)) -> Vec<(Vec<f32>, Vec<f32>)> {
    let area = Area { width: 30_000.0, height: 30_000.0 };
    let mut world = World::new(Settings { seed: 1, area, ..Settings::default() }).unwrap();
    let ids: Vec<RobotId> = (0..ROBOTS)
        .map(|i| {
            let (x, y) = ((i % 20) as f32 * 1400.0, (i / 20) as f32 * 1400.0);
            kilobot(&mut world, x - 13_300.0, y - 13_300.0, 0.0, Probe::driving(motors.0, motors.1))
        })
        .collect();
    let mut found = vec![(Vec::new(), Vec::new()); ROBOTS];
    for _ in 0..60 {
        let before: Vec<Pose> = ids.iter().map(|id| pose(&world, *id)).collect();
        run(&mut world, 10);
        for ((id, before), (speeds, turns)) in ids.iter().zip(before).zip(&mut found) {
            let now = pose(&world, *id);
            speeds.push((now.x - before.x).hypot(now.y - before.y));
            turns.push(wrap(now.heading - before.heading).to_degrees());
        }
    }
    found
}

/// Mean of all, deviation between the robots' means, and root of the mean variance within a robot.
fn spread(values: &[Vec<f32>]) -> (f32, f32, f32) {
    let means: Vec<f32> = values.iter().map(|values| moments(values).0).collect();
    let variances = values.iter().map(|values| moments(values).1.powi(2));
    let (mean, between) = moments(&means);
    (mean, between, (variances.sum::<f32>() / values.len() as f32).sqrt())
}

#[test]
#[ignore = "takes a minute"]
fn motion_of_single_robots() {
    let (speeds, turns): (Vec<_>, Vec<_>) = drive((70, 70)).into_iter().unzip();
    let (speed, speed_sd, _) = spread(&speeds);
    let (_, bias_sd, noise) = spread(&turns);
    let (_, rounds): (Vec<_>, Vec<_>) = drive((70, 0)).into_iter().unzip();
    let (turn, turn_sd, turn_noise) = spread(&rounds);
    let duties = [20, 60, 65, 70, 90, 255].map(|duty| {
        let (speeds, _): (Vec<_>, Vec<_>) = drive((duty, duty)).into_iter().unzip();
        format!("{:.1}", spread(&speeds).0)
    });

    let mut settings = Settings { seed: 1, ..Settings::default() };
    settings.infrared.link.loss = bittybuzz_arena::engine::Loss::even(0.0);
    let mut world = World::new(settings).unwrap();
    kilobot(&mut world, 0.0, 0.0, 0.0, Probe::talking());
    let ids = [20.0, 40.0, 60.0].map(|gap: f32| {
        let angle = gap;
        let (x, y) = ((33.0 + gap) * angle.cos(), (33.0 + gap) * angle.sin());
        (gap, kilobot(&mut world, x, y, 0.0, Probe::default()))
    });
    run(&mut world, 5000);
    let distances = ids.map(|(gap, id)| {
        let measured: Vec<f32> =
            probe(&world, id).received.iter().map(|frame| frame.distance()).collect();
        let (mean, deviation) = moments(&measured);
        format!("{:+.1} ({deviation:.1})", mean - gap - 33.0)
    });

    let mut table = "| Figure | Published | Simulator |\n|---|---|---|\n".to_owned();
    let mut row = |figure: &str, published: &str, found: String| {
        writeln!(table, "| {figure} | {published} | {found} |").unwrap();
    };
    row("speed straight on, mm/s", "about 10 (ICRA 2012)", format!("{speed:.1}"));
    row(
        "its deviation between robots",
        "13 % (AdaptationStudy)",
        format!("{:.0} %", 100.0 * speed_sd / speed),
    );
    row("turn, degrees per second", "about 45 (ICRA 2012)", format!("{turn:.1}"));
    row("time of a full turn, s", "8 to 15 (calibration of ARK)", format!("{:.1}", 360.0 / turn));
    row(
        "bias between robots, degrees per second",
        "6.0 (AdaptationStudy)",
        format!("{bias_sd:.1}"),
    );
    row(
        "bias between robots by noise within one",
        "about 6; 2 to 20 by robot (Raoufi et al.)",
        format!("{:.1}", bias_sd / noise),
    );
    row("turn between robots, degrees per second", "not found", format!("{turn_sd:.1}"));
    row(
        "noise within a robot that turns, degrees per second",
        "not found; per motor in the simulation of Raoufi et al.",
        format!("{turn_noise:.2}"),
    );
    row(
        "speed at duties 20, 60, 65, 70, 90, 255, mm/s",
        "stands below about 60 (Kilombo; calibration of ARK)",
        duties.join(", "),
    );
    row(
        "error (deviation) of distances of 53, 73, 93 mm, mm",
        "accuracy 2, precision below 1 (ICRA 2012)",
        distances.join(", "),
    );
    check("motion", &table);
}
