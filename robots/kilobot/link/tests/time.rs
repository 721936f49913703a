//! Ticks, delays, motors, pacing and blinking, over hours of a clock that wraps around every 8.4 seconds.

use bittybuzz_kilobot::clock::{Delay, Ticks, units};
use bittybuzz_kilobot::light::Blinker;
use bittybuzz_kilobot::motors::MotorDuties;
use bittybuzz_kilobot::sender::Sender;

/// The length of a unit in ms.
const UNIT: f64 = 0.128;

#[test]
fn units_of_milliseconds() {
    for ms in 0..=4000 {
        let exact = f64::from(ms) / UNIT;
        let is = f64::from(units(ms));
        assert!(is >= exact && is < exact + 1.0, "{ms} ms: {is}, {exact}");
    }
}

#[test]
fn ten_ticks_a_second_for_an_hour() {
    let mut ticks = Ticks::start(7);
    let mut count = 0;
    for unit in 0..(3600.0 * 1000.0 / UNIT) as u64 {
        count += u32::from(ticks.take((unit + 7) as u16));
    }
    assert!((35_999..=36_001).contains(&count), "{count}");
}

#[test]
fn missed_ticks_are_skipped() {
    let mut ticks = Ticks::start(0);
    assert!(ticks.take(0));
    assert!(!ticks.take(780));
    assert!(ticks.take(3 * 782));
    assert!(!ticks.take(3 * 782 + 1));
}

#[test]
fn delays_are_accurate_to_one_unit() {
    for ms in [0, 1, 15, 100, 1023, 1024, 1025, 5000, 32_767, 65_535] {
        let mut delay = Delay::start(60_000, ms);
        let waited = (0..).find(|unit| delay.is_over(60_000_u16.wrapping_add(*unit as u16)));
        let exact = f64::from(ms) / UNIT;
        let is = f64::from(waited.unwrap());
        assert!(is >= exact && is <= exact + 1.0 + f64::from(ms / 1024), "{ms} ms: {is}, {exact}");
    }
}

#[test]
fn a_standing_motor_gets_full_power_for_15_ms() {
    let mut motors = MotorDuties::new();
    let now = 65_500;
    motors.set([70, 0], now);
    let pushed =
        (0..1000).filter(|unit| motors.duties(now.wrapping_add(*unit)) == [255, 0]).count();
    assert!((118..=119).contains(&pushed), "{pushed} units");
    assert_eq!(motors.duties(now.wrapping_add(1000)), [70, 0]);
    // The other motor starts, and this one keeps running.
    let now = now.wrapping_add(1000);
    motors.set([60, 65], now);
    assert_eq!(motors.duties(now), [60, 255]);
    assert_eq!(motors.duties(now.wrapping_add(200)), [60, 65]);
    // A motor that is stopped during its push stops.
    motors.set([0, 0], now);
    motors.set([70, 70], now);
    motors.set([0, 70], now);
    assert_eq!(motors.duties(now), [0, 255]);
    // A motor whose duty is set repeatedly is not pushed again or for longer.
    let mut motors = MotorDuties::new();
    let pushed = (0..2000)
        .filter(|now| {
            motors.set([70, 70], *now);
            motors.duties(*now) == [255, 255]
        })
        .count();
    assert!((118..=119).contains(&pushed), "{pushed} units");
}

#[test]
fn two_messages_a_second() {
    let mut sender = Sender::<true>::start(0, 200);
    let mut sent = 0;
    for unit in 0..(60_000.0 / UNIT) as u32 {
        let now = unit as u16;
        if sender.is_due(now) {
            sender.sent(now, false);
            sent += 1;
        }
    }
    assert_eq!(sent, 120);
}

/// Fragments of a message follow each other closely. The pause after the message makes up for up to
/// six of them, and is short enough that neighbors do not forget the robot, which takes 3 s.
#[test]
fn long_messages_keep_the_mean_rate() {
    for fragments in 1..=8 {
        let mut sender = Sender::<true>::start(0, 0);
        let mut times = Vec::new();
        for unit in 0..(60_000.0 / UNIT) as u32 {
            if sender.is_due(unit as u16) {
                times.push(unit);
                sender.sent(unit as u16, !times.len().is_multiple_of(fragments));
            }
        }
        let gaps = times.windows(2).map(|pair| pair[1] - pair[0]);
        let (most, least) = (gaps.clone().max().unwrap(), gaps.min().unwrap());
        assert!(f64::from(most) * UNIT < 2850.0, "{fragments} fragments: {most}");
        assert_eq!(f64::from(least) * UNIT < 100.0, fragments > 1, "{fragments} fragments");
        let sent = if fragments <= 6 { 118..=126 } else { 126..=160 };
        assert!(sent.contains(&times.len()), "{fragments} fragments: {}", times.len());
    }
}

/// A robot that had no message for longer than the clock's period sends as soon as there is one.
#[test]
fn a_message_after_a_long_silence_is_sent_at_once() {
    let mut sender = Sender::<true>::start(0, 0);
    for unit in 0..200_000_u32 {
        let is_due = sender.is_due(unit as u16);
        assert!(is_due, "{unit}");
    }
    sender.wait(1000);
    assert!(!sender.is_due(1254));
    assert!(sender.is_due(1255));
    sender.collided(1255, 10);
    assert!(!sender.is_due(1264));
    assert!(sender.is_due(1265));
}

/// After a fragment of another robot's message it waits for the next one and for a random time. Robots that begin messages
/// without end delay it for a second at most.
#[test]
fn a_robot_lets_others_finish_their_messages() {
    let mut sender = Sender::<true>::start(0, 0);
    sender.defer(0, 200);
    assert!(!sender.is_due(455));
    assert!(sender.is_due(456));
    // The next message is planned for later.
    sender.sent(456, false);
    sender.defer(500, 255);
    assert!(!sender.is_due(456 + 3905));
    assert!(sender.is_due(456 + 3906));

    let mut sender = Sender::<true>::start(0, 0);
    let mut times = vec![0];
    for unit in 0..200_000_u32 {
        if unit % 256 == 0 {
            sender.defer(unit as u16, (unit / 256 * 37) as u8);
        }
        if sender.is_due(unit as u16) {
            times.push(unit);
            sender.sent(unit as u16, false);
        }
    }
    let longest = times.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap();
    let ms = f64::from(longest - 3906) * UNIT;
    assert!((400.0..1000.0).contains(&ms), "{ms} ms");
}

#[test]
fn a_fault_blinks_as_often_as_its_number() {
    for number in 1..=17 {
        let mut blinker = Blinker::start(0);
        let lit: Vec<bool> =
            (0..200_000_u32).map(|unit| blinker.blink(number, unit as u16)).collect();
        // A round begins after the long dark phase.
        let dark = 5 * usize::from(units(200));
        let rounds: Vec<usize> = lit
            .chunk_by(|a, b| a == b)
            .collect::<Vec<_>>()
            .split(|run| !run[0] && run.len() > dark)
            .map(|round| round.iter().filter(|run| run[0]).count())
            .collect();
        assert_eq!(rounds.first(), Some(&usize::from(number)));
        assert!(rounds[..rounds.len() - 1].iter().all(|count| *count == usize::from(number)));
    }
}

#[test]
fn a_robot_that_waits_flashes_five_times_a_second() {
    let mut blinker = Blinker::start(0);
    let lit = (0..78_125_u32).filter(|unit| blinker.flash(*unit as u16)).count();
    // Ten seconds have 49.75 flashes of 8 units.
    assert!((390..=408).contains(&lit), "{lit}");
}
