//! What arrives: who is seen where, who is cut off, what is copied or late, and who does not work.

use crate::common::robots::{RobotKind, Settings, World};
use crate::common::*;
use bittybuzz_arena::engine::{Infrared, Loss, Medium, Pose, RobotId, RobotState};

/// Azimuth and elevation as the receiver sees them, in all quadrants.
#[test]
fn flying_robots_receive_the_direction_of_senders() {
    let mut world = World::new(exact()).unwrap();
    let at = |x, y, z, heading| Pose { z, ..Pose::new(x, y, heading) };
    let hover = || Probe { talks: true, ..Probe::flying(0.0, 0.0, 0.0) };
    let poses = [
        at(0.0, 0.0, 500.0, 0.0),
        at(600.0, 600.0, 800.0, 2.0),
        at(-700.0, 200.0, 300.0, -1.0),
        at(-100.0, -900.0, 1200.0, 3.0),
    ];
    for pose in poses {
        world.add(RobotKind::Crazyflie, pose, hover()).unwrap();
    }
    run(&mut world, 30);
    for (own, id) in poses.iter().zip(world.ids().collect::<Vec<_>>()) {
        for (other, other_pose) in
            poses.iter().enumerate().filter(|(other, _)| *other != usize::from(id.0))
        {
            let frame =
                probe(&world, id).received.iter().rfind(|frame| usize::from(frame.from()) == other);
            let sighting = frame.unwrap().sighting;
            assert_eq!(sighting.robot, Some(RobotId(other as u16)));
            let [distance, azimuth, elevation] = sighting.place().unwrap();
            // Back from the receiver's frame to the world.
            let bearing = azimuth + own.heading;
            let flat = distance * elevation.cos();
            close(own.x + flat * bearing.cos(), other_pose.x, 0.5);
            close(own.y + flat * bearing.sin(), other_pose.y, 0.5);
            close(own.z + distance * elevation.sin(), other_pose.z, 0.5);
            assert!(azimuth > -std::f32::consts::PI && azimuth <= std::f32::consts::PI);
        }
    }
}

#[test]
fn a_robot_on_the_left_has_a_positive_azimuth() {
    let mut world = World::new(exact()).unwrap();
    let looks_up = Pose::new(0.0, 0.0, std::f32::consts::FRAC_PI_2);
    let id = world.add(RobotKind::Zooid, looks_up, Probe::default()).unwrap();
    world.add(RobotKind::Zooid, Pose::new(-300.0, 0.0, 0.0), Probe::talking()).unwrap();
    run(&mut world, 5);
    let [distance, azimuth, elevation] = probe(&world, id).received[0].sighting.place().unwrap();
    close(distance, 300.0, 1.0);
    close(azimuth, std::f32::consts::FRAC_PI_2, 0.05);
    assert_eq!(elevation, 0.0);
}

#[test]
fn frames_of_a_sender_without_estimate_have_no_position() {
    let mut settings = exact();
    settings.crazyflie.positioning = bittybuzz_crazyflie_model::Positioning::None;
    let mut world = World::new(settings).unwrap();
    crazyflie(&mut world, 0.0, 0.0, Probe::talking());
    let id = crazyflie(&mut world, 500.0, 0.0, Probe::default());
    run(&mut world, 5);
    let sighting = probe(&world, id).received[0].sighting;
    assert_eq!((sighting.robot, sighting.place()), (Some(RobotId(0)), None));
}

#[test]
fn partitions_and_blocked_links() {
    let mut world = World::new(exact()).unwrap();
    let a = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::talking());
    let b = kilobot(&mut world, 60.0, 0.0, 0.0, Probe::talking());
    let c = kilobot(&mut world, 0.0, 60.0, 0.0, Probe::talking());
    let received = |world: &World<Probe>| {
        [(a, b), (b, a), (a, c), (c, a), (b, c)].map(|(by, of)| probe(world, by).received_from(of))
    };
    let mut before = [0; 5];
    let mut passed = |world: &mut World<Probe>| {
        // What is on its way arrives.
        run(world, 1);
        before = received(world);
        run(world, 100);
        let now = received(world);
        [0, 1, 2, 3, 4].map(|i| now[i] > before[i])
    };
    assert_eq!(passed(&mut world), [true; 5]);
    world.block(b, a).unwrap();
    assert_eq!(passed(&mut world), [false, false, true, true, true]);
    world.unblock(a, b).unwrap();
    world.partition(|id| u8::from(id == c));
    assert_eq!(passed(&mut world), [true, true, false, false, false]);
    world.heal();
    assert_eq!(passed(&mut world), [true; 5]);
}

/// Frames from another partition are neither received nor sensed, and do not disturb.
#[test]
fn a_partition_is_like_distance() {
    let mut world = World::new(busy(3)).unwrap();
    for i in 0..6 {
        kilobot(&mut world, (i % 3) as f32 * 34.0, (i / 3) as f32 * 34.0, 0.0, Probe::talking());
    }
    world.partition(|id| id.0 as u8);
    run(&mut world, 300);
    let link = world.statistics().link(Medium::Infrared);
    assert_eq!((link.received, link.collided, link.postponed, link.deaf), (0, 0, 0, 0));
    assert!(link.sent > 6 * 220);
}

#[test]
fn robots_on_different_media_receive_nothing_from_each_other() {
    let mut world = World::new(exact()).unwrap();
    let kinds = [RobotKind::Kilobot, RobotKind::Zooid, RobotKind::Crazyflie];
    for (i, kind) in kinds.into_iter().enumerate() {
        world.add(kind, Pose::new(i as f32 * 100.0, 0.0, 0.0), Probe::talking()).unwrap();
    }
    run(&mut world, 50);
    assert!(world.ids().all(|id| probe(&world, id).received.is_empty()));
    assert_eq!(world.statistics().all_links().received, 0);
}

#[test]
fn copies_and_delays_are_counted_and_nothing_is_lost() {
    let mut settings = Settings { seed: 12, ..exact() };
    settings.nrf24.link.duplicate = 0.2;
    settings.nrf24.link.reorder = 0.3;
    let mut world = World::new(settings).unwrap();
    let speaker = world.add(RobotKind::Zooid, Pose::default(), Probe::talking()).unwrap();
    let listener =
        world.add(RobotKind::Zooid, Pose::new(200.0, 0.0, 0.0), Probe::default()).unwrap();
    run(&mut world, 400);
    drain(&mut world);
    let link = *world.statistics().link(Medium::Nrf24);
    let received = &probe(&world, listener).received;
    let mut numbers: Vec<_> = received.iter().map(|frame| frame.number()).collect();
    let overtaken = numbers.windows(2).filter(|pair| pair[1] < pair[0]).count() as u64;
    assert!(overtaken > 0 && overtaken <= link.delayed);
    numbers.sort_unstable();
    numbers.dedup();
    let given = probe(&world, speaker).given;
    assert_eq!(numbers, (0..given).collect::<Vec<_>>());
    assert_eq!(received.len() as u64, u64::from(given) + link.duplicated);
    close(link.duplicated as f32 / link.received as f32, 0.2, 0.04);
}

#[test]
fn stopped_and_failed_robots_neither_send_nor_receive() {
    let mut world = World::new(exact()).unwrap();
    let brain = Probe { motors: (70, 70), ..Probe::talking() };
    let a = kilobot(&mut world, 0.0, 0.0, 0.0, brain.clone());
    let b = kilobot(&mut world, 60.0, 0.0, 0.0, Probe::talking());
    run(&mut world, 20);
    world.stop(a).unwrap();
    run(&mut world, 2);
    let (stopped, received) = (pose(&world, a), probe(&world, b).received_from(a));
    let ticks = probe(&world, a).ticks;
    run(&mut world, 50);
    assert_eq!((pose(&world, a), probe(&world, b).received_from(a)), (stopped, received));
    assert_eq!(probe(&world, a).ticks, ticks);
    world.resume(a).unwrap();
    run(&mut world, 20);
    assert!(probe(&world, b).received_from(a) > received && pose(&world, a) != stopped);
    // What it was about to send when it was stopped it sends when it goes on.
    run(&mut world, 5);
    world.stop(a).unwrap();
    world.brain_mut(a).unwrap().talks = false;
    run(&mut world, 2);
    let received = probe(&world, b).received_from(a);
    world.resume(a).unwrap();
    run(&mut world, 20);
    assert_eq!(probe(&world, b).received_from(a), received + 1);
    world.fail(b).unwrap();
    world.resume(b).unwrap();
    assert_eq!(world.robot(b).unwrap().state, RobotState::Failed);
    let ticks = probe(&world, b).ticks;
    run(&mut world, 20);
    assert_eq!(probe(&world, b).ticks, ticks);
}

#[test]
fn robots_join_while_others_run() {
    let mut world = World::new(exact()).unwrap();
    let a = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::talking());
    run(&mut world, 50);
    let b = kilobot(&mut world, 60.0, 0.0, 0.0, Probe::talking());
    assert_eq!((a, b, world.len()), (RobotId(0), RobotId(1), 2));
    run(&mut world, 50);
    assert!(probe(&world, a).received_from(b) > 0 && probe(&world, b).received_from(a) > 0);
    assert!(world.add(RobotKind::Kilobot, Pose::new(3000.0, 0.0, 0.0), Probe::default()).is_err());
    let nowhere = Pose { x: f32::NAN, ..Pose::default() };
    assert!(world.add(RobotKind::Kilobot, nowhere, Probe::default()).is_err());
}

#[test]
fn loss_can_change_while_the_world_runs() {
    let mut world = World::new(exact()).unwrap();
    let a = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::talking());
    let b = kilobot(&mut world, 60.0, 0.0, 0.0, Probe::default());
    world.set_loss(Medium::Infrared, Loss::even(1.0));
    run(&mut world, 100);
    assert_eq!(probe(&world, b).received_from(a), 0);
    world.set_loss(Medium::Infrared, Loss::even(0.0));
    run(&mut world, 100);
    assert!(probe(&world, b).received_from(a) >= 18);
}

/// A frame is a type byte and as much as the robot's file says, and travels on the medium of the file.
#[test]
fn media_and_frame_lengths_agree_with_robot_files() {
    let links =
        [("kilobot", Medium::Infrared), ("zooids", Medium::Nrf24), ("crazyflie", Medium::P2p)];
    for (name, medium) in links {
        let robot = bittybuzz_robot_files::find(name).unwrap();
        assert_eq!(robot.link, Some(medium), "{name}");
        assert_eq!(medium.frame_bytes(), 1 + robot.message_bytes as usize, "{name}");
    }
    let models = bittybuzz_robot_models::all();
    assert!(models.iter().map(|model| model.medium()).eq(links.map(|(_, medium)| medium)));
}

/// The times of data sheets and firmware: kilolib sends a frame in half a second, in units of 128 us.
#[test]
fn paces_of_links_are_those_of_the_firmware() {
    let periods = Medium::ALL.map(Medium::frame_period_us);
    assert_eq!(periods, [500_000, 10_200, 10_400, 10_400]);
    assert_eq!(Infrared::STANDARD.tx_period, 3906);
}

/// kilolib asks for a message when it begins to send: what a brain learns while it waits for its slot still goes out.
#[test]
fn a_frame_is_written_when_its_transmission_starts() {
    for kind in [RobotKind::Kilobot, RobotKind::Zooid, RobotKind::Crazyflie] {
        let mut world = World::new(exact()).unwrap();
        let a = world.add(kind, Pose::default(), Probe::talking()).unwrap();
        let b = world.add(kind, Pose::new(80.0, 0.0, 0.0), Probe::default()).unwrap();
        run(&mut world, 300);
        let received = &probe(&world, b).received;
        assert!(received.len() >= 55 && probe(&world, a).given as usize >= received.len());
        for frame in received {
            // Heard in the tick after the one in which it ended; a frame may last across the end of one.
            let age = frame.tick + 1 - frame.written();
            assert!((1..=2).contains(&age), "{kind:?}: {age} ticks old");
        }
    }
}

/// A busy channel takes no frame from a brain.
#[test]
fn a_robot_waiting_for_the_channel_keeps_its_frame() {
    let mut world = World::new(busy(5)).unwrap();
    for i in 0..12 {
        kilobot(&mut world, (i % 4) as f32 * 40.0, (i / 4) as f32 * 40.0, 0.0, Probe::talking());
    }
    run(&mut world, 200);
    let link = world.statistics().link(Medium::Infrared);
    let given: u64 = world.ids().map(|id| u64::from(probe(&world, id).given)).sum();
    assert!(link.postponed > 100 && link.sent == given);
}

/// A brain that writes too much or nothing.
#[test]
fn frames_are_cut_to_the_maximum_of_the_link() {
    use bittybuzz_arena::engine::{Brain, Io};
    struct Writes(usize, usize);
    impl Brain for Writes {
        fn tick(&mut self, io: &mut Io<'_>) {
            for frame in io.inbox.iter() {
                self.1 = frame.bytes.len();
            }
        }
        fn has_frame(&self) -> bool {
            true
        }
        fn next_frame(&mut self, frame: &mut [u8]) -> usize {
            frame.fill(7);
            self.0
        }
    }
    for (kind, length, received) in [
        (RobotKind::Zooid, 0, None),
        (RobotKind::Zooid, 3, Some(3)),
        (RobotKind::Zooid, 26, Some(25)),
        (RobotKind::Crazyflie, usize::MAX, Some(49)),
        (RobotKind::Kilobot, 3, Some(10)),
    ] {
        let mut world = World::new(exact()).unwrap();
        world.add(kind, Pose::default(), Writes(length, 0)).unwrap();
        let b = world.add(kind, Pose::new(80.0, 0.0, 0.0), Writes(0, 0)).unwrap();
        for _ in 0..20 {
            world.tick();
        }
        assert_eq!(world.brain(b).unwrap().1, received.unwrap_or(0), "{kind:?} {length}");
        assert_eq!(world.statistics().all_links().sent > 0, received.is_some());
    }
}

/// More than an hour without a word: times in microseconds do not overflow.
#[test]
fn a_robot_may_send_again_after_a_long_silence() {
    let mut world = World::new(exact()).unwrap();
    let a = kilobot(&mut world, 0.0, 0.0, 0.0, Probe::default());
    let b = kilobot(&mut world, 60.0, 0.0, 0.0, Probe::default());
    run(&mut world, 40_000);
    world.brain_mut(a).unwrap().talks = true;
    run(&mut world, 10);
    assert!(probe(&world, b).received_from(a) >= 1);
}

#[test]
fn an_error_names_the_invalid_setting() {
    let mut settings = exact();
    settings.infrared = Infrared { clock_sigma: f32::NAN, ..Infrared::STANDARD };
    let refused = World::<Probe>::new(settings).unwrap_err();
    assert_eq!(refused.field, "infrared.clock_sigma");
    let mut settings = exact();
    settings.p2p.link.loss.far = 1.5;
    let refused = World::<Probe>::new(settings).unwrap_err();
    assert_eq!(refused.to_string(), "p2p.link.loss.far must be a probability from 0 to 1");
}
