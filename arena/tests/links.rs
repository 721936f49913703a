//! Frames on the air: range, pace, collisions, carrier sense, loss, noise.

use crate::common::robots::{RobotKind, Settings, World};
use crate::common::*;
use bittybuzz_arena::engine::{Area, Loss, Medium, Pose, RobotId, SendAttempt, Stream};

#[test]
fn infrared_ends_70_mm_from_rim_to_rim() {
    let mut world = World::new(exact()).unwrap();
    let speaker = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::talking());
    let inside = kilobot(&mut world, 33.0 + 69.9, 0.0, 0.0, Probe::default());
    let outside = kilobot(&mut world, -33.0 - 70.1, 0.0, 0.0, Probe::default());
    run(&mut world, 100);
    assert!(probe(&world, inside).received_from(speaker) >= 18);
    assert_eq!(probe(&world, outside).received.len(), 0);
}

/// In random worlds of all shapes, who hears whom is who is in range by all pairs.
#[test]
fn the_grid_delivers_the_same_frames_as_all_pairs() {
    for seed in 0..6 {
        let mut stream = Stream::for_brain(seed, 3);
        let (width, height) = (500.0 + 1500.0 * stream.unit(), 400.0 + 600.0 * stream.unit());
        let mut settings = Settings { seed, area: Area { width, height }, ..exact() };
        // Two hidden terminals with equal clocks could miss a common neighbor for ever.
        settings.infrared.clock_sigma = 0.05;
        settings.infrared.link.range = Some(20.0 + 150.0 * stream.unit());
        let mut world = World::new(settings).unwrap();
        for _ in 0..60 {
            let (x, y) = ((stream.unit() - 0.5) * width, (stream.unit() - 0.5) * height);
            kilobot(&mut world, x, y, 0.0, Probe::default());
        }
        // First they push each other apart and stand still.
        run(&mut world, 100);
        let poses: Vec<_> = world.robots().map(|view| view.pose).collect();
        for id in world.ids() {
            world.brain_mut(id).unwrap().talks = true;
        }
        run(&mut world, 600);
        for by in world.ids() {
            for of in world.ids().filter(|of| *of != by) {
                let (a, b) = (poses[usize::from(by.0)], poses[usize::from(of.0)]);
                let gap = (a.x - b.x).hypot(a.y - b.y) - 33.0;
                let past = gap - settings.infrared.link.range.unwrap();
                if past.abs() > 0.1 {
                    let received = probe(&world, by).received_from(of) > 0;
                    assert_eq!(received, past < 0.0, "seed {seed}: {gap} mm");
                }
            }
        }
    }
}

#[test]
fn a_kilobot_sends_at_the_set_rate() {
    for (period, interrupts) in [(3906, 16.0), (781, 4.0), (0, 1.0)] {
        let mut settings = exact();
        settings.infrared.tx_period = period;
        let mut world = World::new(settings).unwrap();
        let speaker = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::talking());
        let listener = kilobot(&mut world, 50.0, 0.0, 0.0, Probe::default());
        run(&mut world, 600);
        // The link asks the script at most once per tick.
        let expected = 60.0 / f32::max(0.032_768 * interrupts, 0.1);
        close(probe(&world, listener).received_from(speaker) as f32, expected, 2.0);
    }
}

#[test]
fn frames_arrive_whole_in_order_and_padded() {
    let mut world = World::new(exact()).unwrap();
    let speaker = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::talking());
    let listener = kilobot(&mut world, 50.0, 0.0, 0.0, Probe::default());
    run(&mut world, 200);
    let received = &probe(&world, listener).received;
    for (number, frame) in received.iter().enumerate() {
        assert_eq!(frame.bytes.len(), 10);
        assert_eq!((frame.bytes[0], frame.from(), frame.bytes[9]), (5, speaker.0, 0));
        assert_eq!(frame.number(), number as u32);
        assert_eq!(frame.sighting.robot, None, "infrared does not tell who sends");
    }
}

/// A and C do not hear each other, B hears both. Each sends 4.41 ms at every fourth interrupt, and as their clocks differ,
/// the time between two frames takes all values of one period: they overlap for 2 * 4.41 of 4 * 32.768 ms.
#[test]
fn hidden_terminals_collide() {
    let (mut received, mut collided) = (0, 0);
    for seed in 0..30 {
        let mut world = World::new(busy(seed)).unwrap();
        kilobot(&mut world, -90.0, 0.0, 0.0, Probe::talking());
        let middle = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::default());
        kilobot(&mut world, 90.0, 0.0, 0.0, Probe::talking());
        run(&mut world, 300);
        let link = world.statistics().link(Medium::Infrared);
        assert_eq!(link.postponed, 0, "they do not sense each other");
        assert_eq!(link.received as usize, probe(&world, middle).received.len());
        assert!(link.collided % 2 == 0, "both frames are lost");
        received += link.received;
        collided += link.collided;
    }
    let part = collided as f32 / (collided + received) as f32;
    close(part, 2.0 * 4.41 / (4.0 * 32.768), 0.015);
}

/// A script's frames wander through the ticks with the robot's clock. Robots with a fixed phase would always send at the same
/// part of a tick; a clock that is fast by 1 % is ready at all parts within 10 s. A timer of 32.768 ms adds to that.
#[test]
fn phases_drift_with_the_clock() {
    let spread = |error_ppm| {
        let mut world = World::new(Settings { seed: 3, ..exact() }).unwrap();
        let id = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::default());
        let listener = kilobot(&mut world, 50.0, 0.0, 0.0, Probe::default());
        world.set_clock_error(id, error_ppm).unwrap();
        world.set_clock_error(listener, 0).unwrap();
        let mut starts = Vec::new();
        for tick in 0..6000 {
            // A frame every 5 s, long after the link has become ready again.
            world.brain_mut(id).unwrap().waiting = u32::from(tick % 50 == 0);
            world.watch();
            world.tick();
            let log = world.take_frame_log();
            starts.extend(log.attempts.iter().filter_map(|attempt| match attempt {
                SendAttempt::Sent(frame) => Some((frame.start_us % 100_000) as f32 / 1e3),
                SendAttempt::Postponed { .. } => None,
            }));
        }
        assert!((118..=121).contains(&starts.len()), "{}", starts.len());
        moments(&starts).1
    };
    // Only the timer moves the frames of an exact clock, by up to 32.768 ms after the script: a deviation of 9.5 ms. Times that are
    // spread over a tick of 100 ms have one of 28.9 ms.
    assert!(spread(0) < 12.0);
    close(spread(10_000), 28.9, 4.0);
    close(spread(-10_000), 28.9, 4.0);
}

/// Robots whose phases stay send at the same time again and again, so that runs differ in the share of the frames that collide by
/// five times what independent frames would (0.0148 to 0.003). Clocks that differ by up to 1 % move each phase through the
/// tick six times in a minute.
#[test]
fn runs_differ_less_if_phases_drift() {
    let shares = |drift: bool| -> Vec<f32> {
        let of_seed = |seed| {
            let mut world = World::new(Settings { seed, ..exact() }).unwrap();
            let mut stream = Stream::for_brain(seed, 77);
            for i in 0..20 {
                let (x, y) = ((i % 5) as f32 * 500.0 - 1000.0, (i / 5) as f32 * 500.0 - 1000.0);
                let id = crazyflie(&mut world, x, y, Probe::default());
                let error_ppm = (2e4 * (stream.unit() - 0.5)) as i32;
                world.set_clock_error(id, if drift { error_ppm } else { 0 }).unwrap();
            }
            for _ in 0..600 {
                world.brains_mut().for_each(|probe| probe.waiting = 1);
                world.tick();
            }
            let link = world.statistics().link(Medium::P2p);
            link.collided as f32 / (link.collided + link.received) as f32
        };
        (0..24).map(of_seed).collect()
    };
    let [(mean, fixed), (mean_of_drift, drifting)] =
        [false, true].map(|drift| moments(&shares(drift)));
    // ALOHA: frames of 0.4 ms, one each of 19 others in 100 ms. Fixed phases use 82 ms of the tick.
    close(mean, 1.0 - (-19.0 * 0.8 / 82.0_f32).exp(), 0.03);
    close(mean_of_drift, 1.0 - (-19.0 * 0.8 / 100.0_f32).exp(), 0.02);
    assert!(drifting < 0.6 * fixed && drifting < 0.007, "{drifting}, fixed {fixed}");
}

#[test]
fn carrier_sense_keeps_neighbors_from_colliding() {
    let (mut postponed, mut sent) = (0, 0);
    for seed in 0..20 {
        let mut world = World::new(busy(seed)).unwrap();
        kilobot(&mut world, -40.0, 0.0, 0.0, Probe::talking());
        kilobot(&mut world, 0.0, 0.0, 0.0, Probe::default());
        kilobot(&mut world, 40.0, 0.0, 0.0, Probe::talking());
        run(&mut world, 300);
        let link = world.statistics().link(Medium::Infrared);
        assert_eq!((link.collided, link.deaf), (0, 0));
        postponed += link.postponed;
        sent += link.sent;
    }
    // 3.4 % of the frames would begin while the other sends, and as many the other way round.
    assert!(postponed > sent / 60, "{postponed} of {sent}");
    assert!(sent > 20 * 2 * 220, "a postponed frame is not a lost one");
}

/// 20 Kilobots in one place, all in range: the channel is shared, hardly anything collides.
#[test]
fn a_crowd_shares_the_channel() {
    let mut settings = busy(2);
    settings.infrared.tx_period = 0;
    settings.infrared.link.range = Some(400.0);
    let mut world = World::new(settings).unwrap();
    for i in 0..20 {
        kilobot(&mut world, (i % 5) as f32 * 40.0, (i / 5) as f32 * 40.0, 0.0, Probe::talking());
    }
    run(&mut world, 200);
    let link = *world.statistics().link(Medium::Infrared);
    // 4.41 ms per frame: at most 227 frames per second, of which back-off leaves a good part.
    assert!(link.sent > 20 * 60 && link.sent < 20 * 227, "{} frames", link.sent);
    assert!(link.collided + link.deaf < link.received / 100);
}

/// Whatever is sent ends at every robot in range in one way or another.
#[test]
fn every_frame_is_accounted_for() {
    for medium in [RobotKind::Zooid, RobotKind::Crazyflie, RobotKind::Kilobot] {
        let mut settings = Settings { seed: 4, ..exact() };
        for link in links(&mut settings) {
            link.range = None;
            link.loss = Loss::even(0.3);
        }
        settings.infrared.tx_period = 0;
        let mut world = World::new(settings).unwrap();
        for i in 0..20 {
            let pose = Pose::new((i % 5) as f32 * 150.0, (i / 5) as f32 * 150.0, 0.0);
            world.add(medium, pose, Probe::talking()).unwrap();
        }
        run(&mut world, 100);
        drain(&mut world);
        let link = world.statistics().link(medium.medium());
        let given: u64 = world.ids().map(|id| u64::from(probe(&world, id).given)).sum();
        assert_eq!(link.sent, given, "nothing stays in a link");
        assert_eq!(link.received + link.collided + link.deaf + link.lost, 19 * link.sent);
        let received: usize = world.ids().map(|id| probe(&world, id).received.len()).sum();
        assert_eq!(received as u64, link.received);
        let arrived = link.received + link.lost;
        close(link.lost as f32 / arrived as f32, 0.3, 0.02);
    }
}

/// Without carrier sense, frames that overlap are missed by the one who sends, and nothing else happens with two.
#[test]
fn p2p_receives_nothing_while_sending() {
    let mut settings = exact();
    settings.p2p.pause_us = [0, 1000];
    let (mut deaf, mut sent) = (0, 0);
    for seed in 0..300 {
        let mut world = World::new(Settings { seed, ..settings }).unwrap();
        let a = crazyflie(&mut world, 0.0, 0.0, Probe::talking());
        let b = crazyflie(&mut world, 1000.0, 0.0, Probe::talking());
        run(&mut world, 50);
        drain(&mut world);
        let link = world.statistics().link(Medium::P2p);
        assert_eq!((link.collided, link.postponed), (0, 0));
        // If one is deaf to a frame, so is the other to the frame that it sent meanwhile.
        let missed =
            |by, of| probe(&world, of).given as usize - probe(&world, by).received_from(of);
        assert_eq!(missed(a, b) + missed(b, a), link.deaf as usize);
        assert_eq!(missed(a, b) == 0, missed(b, a) == 0);
        deaf += link.deaf;
        sent += link.sent;
    }
    // Three frames of 0.4 ms in 100 ms each: a frame overlaps with one of the other's in 3 * 0.8 of 100 cases.
    close(deaf as f32 / sent as f32, 0.024, 0.012);
}

#[test]
fn p2p_frames_that_overlap_are_lost_to_third_parties() {
    let mut collided = 0;
    for seed in 0..200 {
        let mut world = World::new(Settings { seed, ..exact() }).unwrap();
        crazyflie(&mut world, 0.0, 0.0, Probe::talking());
        crazyflie(&mut world, 500.0, 0.0, Probe::talking());
        let third = crazyflie(&mut world, 0.0, 500.0, Probe::default());
        run(&mut world, 30);
        drain(&mut world);
        let link = world.statistics().link(Medium::P2p);
        // The senders are deaf to what collides at the third.
        assert_eq!(link.collided, link.sent - probe(&world, third).received.len() as u64);
        assert_eq!(link.collided, link.deaf);
        collided += link.collided;
    }
    assert!(collided > 0);
}

/// Carrier sense leaves the 130 µs in which the nRF24 goes from listening to sending.
#[test]
fn nrf24_senses_the_channel_except_in_the_first_130_us() {
    let mut settings = Settings { seed: 6, ..exact() };
    settings.nrf24.backoff_us = 20_000;
    let mut world = World::new(settings).unwrap();
    for i in 0..40 {
        let pose = Pose::new((i % 8) as f32 * 60.0, (i / 8) as f32 * 60.0, 0.0);
        world.add(RobotKind::Zooid, pose, Probe::talking()).unwrap();
    }
    run(&mut world, 200);
    let link = world.statistics().link(Medium::Nrf24);
    let received = link.received + link.collided;
    // Up to 3 frames of each of 40 in 100 ms: 39 others begin 1.2 frames per ms; within 130 µs before or after, 26 %
    // if they were spread evenly. Without carrier sense it would be 400 µs, 38 %.
    let part = link.collided as f32 / received as f32;
    assert!(part > 0.05 && part < 0.32, "{part}");
    assert!(link.postponed > 0);
}

/// The loss grows with the square of the part of the range: 10 % to 70 %.
#[test]
fn loss_rises_with_distance() {
    let mut settings =
        Settings { seed: 8, area: Area { width: 9000.0, height: 4000.0 }, ..exact() };
    settings.infrared.link.loss = Loss { near: 0.1, far: 0.7 };
    let mut world = World::new(settings).unwrap();
    let gaps = [0.5, 20.0, 35.0, 50.0, 69.9];
    let mut pairs = Vec::new();
    for row in 0..20 {
        for (column, gap) in gaps.into_iter().enumerate() {
            let (x, y) = (column as f32 * 400.0 - 1000.0, row as f32 * 150.0 - 1500.0);
            let speaker = kilobot(&mut world, x, y, 0.0, Probe::talking());
            let listener = kilobot(&mut world, x + 33.0 + gap, y, 0.0, Probe::default());
            pairs.push((column, speaker, listener));
        }
    }
    run(&mut world, 1000);
    for (column, gap) in gaps.into_iter().enumerate() {
        let mine = || pairs.iter().filter(|pair| pair.0 == column);
        let received: usize = mine().map(|pair| probe(&world, pair.2).received_from(pair.1)).sum();
        let sent: u32 = mine().map(|pair| probe(&world, pair.1).given - 1).sum();
        let expected = 0.1 + 0.6 * (gap / 70.0) * (gap / 70.0);
        // About 3,800 frames: three deviations are 2.4 %.
        close(1.0 - received as f32 / sent as f32, expected, 0.03);
    }
}

#[test]
fn distances_have_a_deviation_of_2_mm() {
    let mut settings = Settings { seed: 10, ..exact() };
    settings.infrared.distance_sigma = 2.0;
    let mut world = World::new(settings).unwrap();
    let speaker = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::talking());
    for (gap, at) in [(15.0, (1.0, 0.0)), (30.0, (0.0, 1.0)), (55.0, (-1.0, 0.0))] {
        let reach = 33.0 + gap;
        kilobot(&mut world, at.0 * reach, at.1 * reach, 0.0, Probe::default());
    }
    run(&mut world, 8000);
    for (id, gap) in [(1, 15.0), (2, 30.0), (3, 55.0)] {
        let received = &probe(&world, RobotId(id)).received;
        let measured: Vec<_> = received.iter().map(|frame| frame.distance()).collect();
        assert!(measured.len() > 1400 && measured.iter().all(|mm| mm.fract() == 0.0));
        let (mean, sigma) = moments(&measured);
        // Whole millimeters, truncated: up to 1 mm off, and a deviation of 0.3 mm more.
        close(mean, 33.0 + gap, 1.3);
        close(sigma, 2.0, 0.35);
        assert!(received.iter().all(|frame| frame.from() == speaker.0));
        assert!(received.iter().all(|frame| frame.sighting.place().unwrap()[1..] == [0.0, 0.0]));
    }
}
