//! A Kilobot whose supply falls for a moment: whatever it does then, it stands still and waits for the controller, as after
//! power-on, and of its EEPROM only the byte that was being written may be damaged.
//!
//! The chip notes a brown-out only while its brown-out detector is on, which a fuse decides (DS40002061B 11.5). No source tells the
//! fuses of Kilobots; here it is on. The firmware does the same after both.

use std::time::Duration;

use bittybuzz_chips::Random;
use bittybuzz_emulation::message::{Memory, ResetCause};
use bittybuzz_hil::kilobots::{behavior, kind};
use bittybuzz_hil::{Command, EmulatorEvent, Kilobots, resets};
use bittybuzz_kilobot::calibration::{DUTIES, ID};
use bittybuzz_kilobot::controller::{SAVE, SET_ID, STRAIGHT, TURN_LEFT, TURN_RIGHT};

const SCRIPT: &str = "\
n = 0
function step() {
  n = n + 1
  led(n % 2 + 1)
  forward()
}
";
/// For another image, which has the part of the machine for that.
const BROADCASTS: &str = "\
n = 0
function step() {
  n = n + 1
  led(n % 2 + 1)
  forward()
  neighbors.broadcast(\"x\", n)
}
";

const RED: [u8; 3] = [3, 0, 0];
const GREEN: [u8; 3] = [0, 3, 0];
const DARK: [u8; 3] = [0; 3];

/// First address of the EEPROM, as tools for the chip have it, and its bytes.
const EEPROM: u32 = 0x81_0000;
const EEPROM_BYTES: u32 = 1024;

const NEW_ID: u16 = 0x3258;
const NEW_DUTIES: [u8; 4] = [81, 82, 83, 84];

/// Duration of a frame: 12 bytes, their start bits, and the first bit, of 269 cycles at 8 MHz each (kilolib, message_send.S).
const FRAME: Duration = Duration::from_micros(4_400);

/// The activity of the robot when its supply falls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Doing {
    Starting,
    RunningTheScript,
    Sending,
    Receiving,
    ShowingItsCalibration,
    Saving,
    Sleeping,
}

const ALL: [Doing; 7] = [
    Doing::Starting,
    Doing::RunningTheScript,
    Doing::Sending,
    Doing::Receiving,
    Doing::ShowingItsCalibration,
    Doing::Saving,
    Doing::Sleeping,
];

fn run_us(robots: &mut Kilobots, us: u64) {
    robots.run_for(Duration::from_micros(us));
}

/// Lets the supply fall for a moment, and returns when.
fn brown_out(robots: &mut Kilobots) -> Duration {
    let at = robots.now();
    robots.execute_on(0, &Command::Reset { cause: ResetCause::BrownOut });
    at
}

fn eeprom(robots: &mut Kilobots) -> Vec<u8> {
    robots.memory(0, EEPROM, EEPROM_BYTES)
}

fn calibrate(robots: &mut Kilobots, data: [u8; 7]) {
    let [a, b, c, d, e, f, g] = data;
    robots.command(kind::CALIB, [a, b, c, d, e, f, g, 0, 0]);
}

/// The id that the robot uses: it turns for each bit that is set.
fn shown_id(robots: &mut Kilobots) -> u16 {
    let mut id = 0;
    for bit in 0..16 {
        robots.command(kind::READUID, [bit, 0, 0, 0, 0, 0, 0, 0, 0]);
        id |= u16::from(robots.motors(0)[0] > 0) << bit;
    }
    id
}

/// A robot that runs a script and has sent a frame.
fn broadcasting() -> Kilobots {
    let mut robots = Kilobots::in_image(BROADCASTS, &behavior("gradient"), 1);
    robots.start();
    robots.run_ms(600);
    assert!(!robots.sent(0).is_empty());
    robots
}

/// Lets the supply fall at a random moment and looks at the robot.
fn survives(number: u64) {
    let doing = ALL[(number % 7) as usize];
    let memory = [Memory::Kept, Memory::Zeroed, Memory::Noise][(number / 7 % 3) as usize];
    let mut random = Random::for_item(2029, number);
    let seed = random.bits();
    println!("number {number}, {doing:?}, {memory:?}");
    let mut below = |bound: u64| random.bits() % bound;

    let mut robots;
    let mut wanted = None;
    match doing {
        Doing::Starting => {
            robots = Kilobots::new(SCRIPT, 1);
            run_us(&mut robots, below(3_000));
        }
        Doing::RunningTheScript => {
            robots = Kilobots::new(SCRIPT, 1);
            robots.start();
            run_us(&mut robots, 400_000 + below(200_000));
            assert!(robots.motors(0)[0] > 0);
        }
        Doing::Sending => {
            // When it sends next is known from one that goes on.
            let mut other = broadcasting();
            let sent = other.sent(0).len();
            while other.sent(0).len() == sent {
                other.run_ms(10);
            }
            let (end, _) = other.sent(0)[sent];
            robots = broadcasting();
            let before = Duration::from_micros(1 + below(FRAME.as_micros() as u64));
            robots.run_for(end - before - robots.now());
        }
        Doing::Receiving => {
            robots = Kilobots::new(SCRIPT, 1);
            robots.run_ms(100);
            let at = robots.now();
            let payload = vec![0, 0, 0, 0, 0, 0, 0, 0, 0, kind::RUN];
            robots.execute_on(0, &Command::Radio { at, payload });
            run_us(&mut robots, below(5_500));
        }
        Doing::ShowingItsCalibration => {
            robots = Kilobots::new(SCRIPT, 1);
            robots.run_ms(100);
            calibrate(&mut robots, [STRAIGHT, 0, 0, 0, 0, 70, 71]);
            run_us(&mut robots, below(100_000));
            assert!(robots.motors(0)[0] > 0);
        }
        Doing::Saving => {
            robots = Kilobots::new(SCRIPT, 1);
            robots.run_ms(100);
            let [low, high] = NEW_ID.to_le_bytes();
            let [left, right, straight_left, straight_right] = NEW_DUTIES;
            calibrate(&mut robots, [SET_ID, low, high, 0, 0, 0, 0]);
            calibrate(&mut robots, [TURN_LEFT, 0, 0, left, 0, 0, 0]);
            calibrate(&mut robots, [TURN_RIGHT, 0, 0, 0, right, 0, 0]);
            calibrate(&mut robots, [STRAIGHT, 0, 0, 0, 0, straight_left, straight_right]);
            let old = eeprom(&mut robots);
            let payload = vec![SAVE, 0, 0, 0, 0, 0, 0, 0, 0, kind::CALIB];
            let at = robots.now();
            robots.execute_on(0, &Command::Radio { at, payload });
            // The frame, and six bytes of 3.3 ms.
            run_us(&mut robots, 4_500 + below(21_000));
            wanted = Some(old);
        }
        Doing::Sleeping => {
            robots = Kilobots::new(SCRIPT, 1);
            robots.run_ms(100);
            robots.command(kind::SLEEP, [0; 9]);
            run_us(&mut robots, below(9_000_000));
        }
    }
    let before = wanted.unwrap_or_else(|| eeprom(&mut robots));
    robots.execute_on(
        0,
        &Command::Chip { lsi_hz: 128_000, crystal: true, memory, seed, debugger: false },
    );

    let first = brown_out(&mut robots);
    // A supply that is too weak falls again and again.
    run_us(&mut robots, below(5_000));
    let second = brown_out(&mut robots);
    robots.run_ms(1_000);
    let later: Vec<_> =
        robots.events[0].iter().filter(|event| event.at >= first).cloned().collect();
    let causes: Vec<&str> = resets(&later).iter().map(|(_, cause)| *cause).collect();
    assert_eq!(causes, ["brown_out"; 2]);
    for event in &later {
        let turns = matches!(event.event, EmulatorEvent::Motor { duty, .. } if duty > 0.0);
        assert!(!turns, "a motor turns: {event:?}");
        let wrong = matches!(
            event.event,
            EmulatorEvent::HardwareError { .. } | EmulatorEvent::Lockup { .. }
        );
        assert!(!wrong, "{event:?}");
    }
    assert_eq!(robots.motors(0), [0; 2]);
    // It waits: a flash every fifth of a second, and no light.
    let colors = robots.colors(0, second + Duration::from_millis(5));
    assert!(colors.iter().all(|(_, color)| [GREEN, DARK].contains(color)), "{colors:?}");
    let flashes = colors.iter().filter(|(_, color)| *color == GREEN).count();
    assert!((4..=6).contains(&flashes), "{colors:?}");
    assert!(robots.sent(0).iter().all(|(at, _)| *at < first));

    let cells = eeprom(&mut robots);
    assert_eeprom(&before, &cells, doing == Doing::Saving, memory);
    let [low, high] = [ID, ID + 1].map(|at| cells[usize::from(at)]);
    assert_eq!(shown_id(&mut robots), u16::from_le_bytes([low, high]));

    let start = robots.start();
    robots.run_ms(1_000);
    let steps = robots.colors(0, start + Duration::from_millis(50));
    let steps = steps.iter().filter(|(_, color)| [RED, GREEN].contains(color)).count();
    assert!((9..=11).contains(&steps), "{steps} steps");
    assert!(robots.motors(0).iter().all(|duty| *duty > 0));
    if doing == Doing::Sending {
        assert!(robots.sent(0).iter().any(|(at, _)| *at > start));
    }
}

/// Only what was being saved has changed, and of that at most one byte is neither old nor new: the one that was being written, if
/// the supply was too low to finish it (8.4.2).
fn assert_eeprom(before: &[u8], after: &[u8], is_saving: bool, memory: Memory) {
    let [low, high] = NEW_ID.to_le_bytes();
    let [left, right, straight_left, straight_right] = DUTIES;
    let saved = [(ID, low), (ID + 1, high)]
        .into_iter()
        .chain([left, right, straight_left, straight_right].into_iter().zip(NEW_DUTIES));
    let (mut expected, mut damaged) = (before.to_vec(), 0);
    if is_saving {
        for (at, new) in saved {
            let at = usize::from(at);
            damaged += usize::from(after[at] != before[at] && after[at] != new);
            expected[at] = after[at];
        }
    }
    assert_eq!(after, expected);
    assert!(damaged <= usize::from(memory != Memory::Kept), "{damaged} bytes");
}

#[test]
fn after_a_brown_out_at_any_moment_the_robot_waits_for_the_controller() {
    for number in 0..42 {
        survives(number);
    }
}

#[test]
#[ignore = "soak"]
fn after_a_brown_out_at_a_thousand_moments_the_robot_waits_for_the_controller() {
    for number in 0..1_000 {
        survives(number);
    }
}
