//! Tests with several robots: pulses between them.

use std::time::Duration;

use bittybuzz_emulation::message::{Command, EmulatorEvent};
use bittybuzz_kilobot_board::Amplitude;

use crate::robots::{RAM, Robots, assemble};

const COUNT: u32 = RAM + 0x100;
const HIGH: u32 = RAM + 0x102;
const LOW: u32 = RAM + 0x104;
const CAPTURES: u32 = RAM + 0x110;

/// Returns robots of which the first sends, at 0 mm; the others are at `places`.
fn around_a_sender(places: &[f64]) -> Robots {
    let mut robots = Robots::new(1 + places.len(), &assemble("infrared", &[]));
    robots.place(0, 0.0);
    for (robot, x) in (1..).zip(places) {
        robots.place(robot, *x);
        robots.set_id(robot, robot as u8);
    }
    robots
}

fn intervals(robots: &mut Robots, robot: usize) -> Vec<u16> {
    let count = u32::from(robots.byte(robot, COUNT));
    let captures = robots.words(robot, CAPTURES, count);
    captures.windows(2).map(|pair| pair[1].wrapping_sub(pair[0])).collect()
}

#[test]
fn pulses_are_captured_when_they_come_and_as_strong_as_far_away() {
    // The third has its receiver switched off; the last is too far away.
    let mut robots = around_a_sender(&[60.0, 60.0, 95.0, 35.0, 101.0]);
    robots.run(14_000);
    for robot in [1, 3, 4] {
        assert_eq!(intervals(&mut robots, robot), [1000; 9], "robot {robot}");
    }
    assert_eq!((robots.byte(2, COUNT), robots.byte(5, COUNT)), (0, 0));
    assert_eq!(robots.counted(2).pulses_unheard, 10);
    for (robot, distance) in [(1, 60.0), (3, 95.0), (4, 35.0)] {
        let Amplitude { high, low } = Amplitude::at(distance);
        assert_eq!((robots.word(robot, HIGH), robots.word(robot, LOW)), (high, low), "{robot}");
    }
    assert_eq!(robots.word(4, HIGH), 1023, "that near the high gain is saturated");
}

#[test]
fn a_slow_oscillator_counts_less_and_sends_slower() {
    let mut robots = around_a_sender(&[60.0, 60.0, 60.0]);
    robots.execute(1, &Command::Clock { error_ppm: -20_000.0 });
    robots.execute(0, &Command::Clock { error_ppm: 10_000.0 });
    robots.run(14_000);
    // 1000 cycles of the sender are this number of cycles of the receiver.
    for interval in intervals(&mut robots, 1) {
        assert!((970..=971).contains(&interval), "{interval}");
    }
    for interval in intervals(&mut robots, 3) {
        assert!((990..=991).contains(&interval), "{interval}");
    }
}

#[test]
fn light_may_be_noisy_lost_or_short() {
    let mut robots = around_a_sender(&[60.0, 60.0, 60.0]);
    robots.execute(0, &Command::Infrared { range_mm: 70.0, edge_mm: 0.0, noise_mm: 2.0, seed: 4 });
    robots.run(14_000);
    let readings = [robots.word(1, LOW), robots.word(3, LOW)];
    let range = Amplitude::at(68.0).low..Amplitude::at(52.0).low;
    assert!(readings[0] != readings[1] && readings.iter().all(|r| range.contains(r)));
    for (range, lose, heard) in [(59.0, 0.0, 0), (61.0, 1.0, 0), (61.0, 0.0, 10)] {
        let mut robots = around_a_sender(&[60.0]);
        robots.execute(
            0,
            &Command::Infrared { range_mm: range, edge_mm: 0.0, noise_mm: 0.0, seed: 4 },
        );
        robots.execute(0, &Command::Air { lose, seed: 9 });
        robots.run(14_000);
        assert_eq!(robots.byte(1, COUNT), heard, "{range} {lose}");
    }
    let mut robots = around_a_sender(&[60.0]);
    robots.emulator.execute_on(1, &Command::Remove).unwrap();
    robots.run(14_000);
    assert_eq!(robots.byte(1, COUNT), 0);
}

/// Two senders whose clocks differ by 0.1 % send 10 pulses each: the receiver sees both, and the
/// sum of overlapping pulses.
#[test]
fn simultaneous_senders_are_both_received() {
    let mut robots = around_a_sender(&[60.0, 60.0]);
    robots.place(2, 30.0);
    robots.set_id(2, 9);
    robots.execute(2, &Command::Clock { error_ppm: -1000.0 });
    robots.run(14_000);
    // The second sender begins a thousandth later, and the delay grows with each pulse: 10 us,
    // which is longer than a pulse.
    assert_eq!(robots.byte(1, COUNT), 20);
    let intervals = intervals(&mut robots, 1);
    assert!(intervals.iter().step_by(2).all(|pair| (70..110).contains(pair)), "{intervals:?}");
    assert!(robots.counted(1).infrared_collided > 0);
}

/// A robot that is cut off or has no power sees nothing. Flash and EEPROM keep their content
/// without power, and the program restarts.
#[test]
fn robots_are_cut_off_and_switched_off() {
    let mut robots = around_a_sender(&[60.0, 60.0, 60.0]);
    robots.execute(1, &Command::Deaf { to: [0].into() });
    robots.run(5_000);
    robots.execute(3, &Command::Power { on: false });
    robots.run(9_000);
    assert_eq!((robots.byte(1, COUNT), robots.byte(3, COUNT)), (0, 0));
    robots.execute(1, &Command::Deaf { to: [].into() });
    robots.execute(3, &Command::Power { on: true });
    robots.run(5_000);
    // The sender's next ten pulses arrived.
    assert_eq!((robots.byte(1, COUNT), robots.byte(3, COUNT)), (10, 10));
    let refusal = robots.refusal(&Command::Deaf { to: [4].into() });
    assert!(refusal.contains("there is no robot 4"), "{refusal}");
    robots.execute(0, &Command::Power { on: false });
    let events = robots.events.len();
    robots.run(30_000);
    assert_eq!((robots.byte(3, COUNT), robots.events.len()), (10, events));
}

/// The controller's frame arrives with kilolib's intervals.
#[test]
fn all_robots_receive_the_controller() {
    let mut robots = around_a_sender(&[500.0, 60.0]);
    let at = Duration::from_millis(2);
    let payload = vec![0xff, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    robots.execute(0, &Command::Radio { at, payload });
    let refusal = robots.refusal(&Command::Radio { at, payload: vec![0; 11] });
    assert!(refusal.contains("10 or 12, not 11"), "{refusal}");
    robots.run(8_000);
    let counted = robots.counted(1);
    assert_eq!((counted.infrared_arrived, counted.infrared_damaged), (1, 0));
    // The second pulse comes 2420 cycles after the first, then the start bit and eight ones. Pulses
    // are not aligned to the beginning of a cycle.
    let intervals = intervals(&mut robots, 1);
    for (interval, cycles) in intervals.iter().zip([2420, 286, 270, 270, 270]) {
        assert!(interval.abs_diff(cycles) <= 1, "{intervals:?}");
    }
    let statistics = robots.emulator.statistics().unwrap();
    assert_eq!(statistics.air.carried, 3);
}

/// Results depend neither on the threads nor on the division of time by commands.
#[test]
fn the_same_commands_give_the_same_answers() {
    let run = |threads, slices: u64| {
        let mut robots = Robots::on_threads(6, &assemble("infrared", &[]), threads);
        for robot in 0..6 {
            robots.place(robot, 30.0 * robot as f64);
            robots.set_id(robot, if robot == 4 { 9 } else { robot as u8 });
            robots.execute(robot, &Command::Clock { error_ppm: 700.0 * robot as f64 });
        }
        robots.execute(
            0,
            &Command::Infrared { range_mm: 100.0, edge_mm: 0.0, noise_mm: 2.0, seed: 4 },
        );
        for _ in 0..slices {
            robots.run(40_000 / slices);
        }
        (0..6).map(|robot| robots.bytes(robot, RAM + 0x100, 0x90)).collect::<Vec<_>>()
    };
    let once = run(1, 1);
    assert_eq!(once, run(2, 1));
    assert_eq!(once, run(2, 16));
    assert!(once[1][0] > 20);
}

/// The program sends pulses with kilolib's figures, 9 cycles long and 270 apart, that form no
/// frame, so the sender has no event.
#[test]
fn a_program_that_sends_no_frame_makes_no_event() {
    let mut robots = around_a_sender(&[]);
    robots.run(30_000);
    assert!(robots.seen().iter().all(|event| !matches!(event, EmulatorEvent::Infrared { .. })));
    assert_eq!(robots.counted(0).infrared_sent, 0);
    assert!(robots.counted(0).infrared_aborted > 0);
}
