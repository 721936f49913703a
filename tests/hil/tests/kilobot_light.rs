//! The Kilobot's infrared light, pulse by pulse: two senders at once, a robot's own light, loudness, oscillators.

use std::time::Duration;

use bittybuzz_hil::kilobots::{behavior, kind};
use bittybuzz_hil::{Command, EmulatorEvent, Kilobots};

const DARK: [u8; 3] = [0; 3];
const GREEN: [u8; 3] = [0, 3, 0];

/// It has something to send whenever it may.
const TALKS: &str = "n = 0\nfunction step() { n = n + 1 neighbors.broadcast(\"count\", n) }\n";

/// Robots whose image has what the script uses.
fn talkers(script: &str, count: usize) -> Kilobots {
    Kilobots::in_image(script, &behavior("gradient"), count)
}

/// A message on the air.
struct Sent {
    /// The first pulse begins.
    begin: Duration,
    /// The last pulse begins.
    last: Duration,
    payload: Vec<u8>,
}

/// The messages that a robot has sent.
fn sent(robots: &Kilobots, robot: usize) -> Vec<Sent> {
    let messages = robots.events[robot].iter().filter_map(|event| match &event.event {
        EmulatorEvent::Infrared { payload, air } => {
            Some(Sent { begin: event.at - *air, last: event.at, payload: payload.clone() })
        }
        _ => None,
    });
    messages.collect()
}

/// The controller sends at a time to come.
fn announce(robots: &mut Kilobots, at: Duration, kind: u8) {
    let payload = [&[0; 9][..], &[kind]].concat();
    robots.execute_on(0, &Command::Radio { at, payload });
}

/// Another robot begins while one looks for others, between its first two pulses: this one gives up and tries again later.
///
/// The other's first pulse is the only one in that time, and as short as any: 9 cycles of 8 MHz. The sixteen places of it are
/// a cycle apart, so that no look at the receiver fits between them by chance.
#[test]
fn a_robot_that_sees_another_begin_gives_up_and_tries_again() {
    // The same program does the same each time.
    let mut robots = talkers(TALKS, 1);
    robots.start();
    robots.run_ms(1500);
    let second = sent(&robots, 0).swap_remove(1);
    for cycle in 0..16 {
        let mut robots = talkers(TALKS, 1);
        robots.start();
        // In the middle of the seven bits that kilolib looks for, from two bits after its pulse on (message_send.S).
        let other = second.begin + Duration::from_nanos(180_000 + 125 * cycle);
        announce(&mut robots, other, kind::RUN);
        robots.run_for(second.begin + Duration::from_millis(100) - robots.now());
        let again = sent(&robots, 0).swap_remove(1);
        // It sends when the other one, who takes 4.4 ms, is done; it waits for 32.6 ms at most, and once more if it is disturbed.
        let later = again.begin.checked_sub(other);
        let range = Duration::from_micros(4_400)..Duration::from_millis(80);
        assert!(
            later.is_some_and(|later| range.contains(&later)),
            "cycle {cycle}: after {later:?}"
        );
        assert_eq!(again.payload, second.payload, "cycle {cycle}");
    }
}

/// A robot does not take its own light for a message: right after its last pulse it receives the first one of another.
#[test]
fn a_robot_that_has_just_sent_receives_at_once() {
    let mut robots = talkers(TALKS, 1);
    robots.execute_on(0, &Command::Battery { volts: 4.1, charging: false, usb_powered: false });
    robots.start();
    // A byte takes 370 us at most, after which a receiver that was misled has given up.
    for after in [60, 120, 180, 240, 300, 360] {
        let count = sent(&robots, 0).len();
        // It sends twice a second.
        let until = robots.now() + Duration::from_millis(700);
        while sent(&robots, 0).len() == count {
            assert!(robots.now() < until, "it does not send");
            robots.run_for(Duration::from_micros(50));
        }
        let last = sent(&robots, 0).pop().unwrap().last;
        announce(&mut robots, last + Duration::from_micros(after), kind::VOLTAGE);
        robots.run_ms(15);
        assert_eq!(robots.color(0), GREEN, "{after} us after its last pulse");
        robots.command(kind::RUN, [0; 9]);
        robots.run_ms(5);
        assert_eq!(robots.color(0), DARK);
    }
}

/// The power of the left motor is the distance in mm of the robot that was received last.
const MEASURES: &str = "
n = 0
function init() {
  neighbors.listen(\"count\", function(topic, value, robot) {
    var sender = neighbors.get(robot)
    if(sender != nil) {
      if(sender.distance != nil) set_motor(int(sender.distance), 0)
    }
  })
}
function step() {
  n = n + 1
  neighbors.broadcast(\"count\", n)
  SENSOR
}
";

/// Near neighbors are measured by the low gain, far ones by the high gain, and between 74 and 83 mm both count. A sensor that is read
/// between two messages, on the same converter, makes no difference.
#[test]
fn loudness_gives_the_distance() {
    for sensor in ["", "x = light()", "x = battery()"] {
        for distance in [36, 50, 65, 78, 90, 98] {
            let mut robots = talkers(&MEASURES.replace("SENSOR", sensor), 2);
            for (robot, x_mm) in [(0, 0.0), (1, f64::from(distance))] {
                robots.execute_on(robot, &place(x_mm));
            }
            // Half a step of OSCCAL: no two oscillators are alike, or both would send at the same moment each time.
            robots.execute_on(1, &Command::Clock { error_ppm: 2_000.0 });
            robots.start();
            robots.run_ms(3000);
            for robot in [0, 1] {
                let [measured, _] = robots.motors(robot);
                // Accurate to 2 mm (Rubenstein, Ahler, Nagpal, ICRA 2012).
                let range = distance - 2..=distance + 2;
                let found = i32::from(measured);
                assert!(range.contains(&found), "{sensor} {distance} mm: {measured} on {robot}");
            }
        }
    }
}

fn place(x_mm: f64) -> Command {
    Command::Place {
        x_mm,
        y_mm: 0.0,
        heading_degrees: 0.0,
        vx_mm_s: 0.0,
        vy_mm_s: 0.0,
        turn_degrees_s: 0.0,
    }
}

/// An oscillator may be off by 10 % (data sheet, table 29-10), and a message is lost if those of sender and receiver differ by 5 %. The
/// byte for OSCCAL that the robot was calibrated with stands in its EEPROM (kilolib).
#[test]
fn the_oscillator_is_corrected_as_the_robot_was_calibrated() {
    // Half an octave in the 128 steps of a range (data sheet, typical characteristics): 20 steps are 8 %.
    for (error_ppm, osccal) in [(80_000.0, 0x88), (-80_000.0, 0xb0)] {
        let script = MEASURES.replace("SENSOR", "led(n % 2)");
        let mut robots = talkers(&script, 2);
        for (robot, x_mm) in [(0, 0.0), (1, 60.0)] {
            robots.execute_on(robot, &place(x_mm));
        }
        robots.execute_on(0, &Command::Clock { error_ppm });
        robots.execute_on(0, &Command::Write { address: 0x81_0001, bytes: vec![osccal] });
        let start = robots.start();
        robots.run_ms(10_000);
        let steps = robots.colors(0, start).len();
        assert!((99..=101).contains(&steps), "{steps} steps in 10 s");
        for robot in [0, 1] {
            assert!((58..=62).contains(&robots.motors(robot)[0]), "{robot} receives nothing");
        }
    }
}
