//! The Kilobot's image on its board: motors, clock, watchdog, boot loader.

use std::time::Duration;

use bittybuzz_hil::kilobots::kind;
use bittybuzz_hil::{Command, EmulatorEvent, Kilobots, resets};

const RED: [u8; 3] = [3, 0, 0];
const BLUE: [u8; 3] = [0, 0, 3];

/// Drives all the time.
const DRIVES: &str = "function step() { forward() }";

/// The section of the boot loader (kilolib, `bootldr.c`).
const BOOT: u32 = 0x7000;
/// `rjmp .-2`
const STANDS_STILL: [u8; 2] = [0xff, 0xcf];

/// The motors' pulses: 8 MHz / 8 / 510 (kilolib, `macros.h`; data sheet 18.7.4).
#[test]
fn motors_get_pulses_of_kilolibs_frequency() {
    let mut robots = Kilobots::new("function step() { set_motor(70, 90) }", 1);
    robots.start();
    robots.run_ms(1000);
    assert_eq!(robots.motors(0), [70, 90]);
    let frequencies: Vec<f64> = robots.events[0]
        .iter()
        .filter_map(|event| match event.event {
            EmulatorEvent::Motor { duty, frequency_hz, .. } if duty > 0.0 && duty < 1.0 => {
                Some(frequency_hz)
            }
            _ => None,
        })
        .collect();
    assert_eq!(frequencies.len(), 2, "{frequencies:?}");
    assert!(frequencies.iter().all(|hz| (1960.0..1962.0).contains(hz)), "{frequencies:?}");
}

/// The time never goes back nor leaps ahead by the 33 ms between two overflows of its timer, wherever an overflow comes while it is
/// read. A time before the last step looks like half a second without one, so the motors stop; a later one lets a step begin early.
///
/// A pulse of light wakes the robot, which then reads the time. Every three overflows the pulses come two cycles earlier, until
/// they were everywhere between two bytes. Of three overflows, one comes in the first third of a step's 100 ms, and one in the last.
#[test]
fn time_does_not_leap() {
    const OVERFLOW: Duration = Duration::from_micros(32_768);
    const TWO_CYCLES: Duration = Duration::from_nanos(250);
    // From start bit to start bit (kilolib, message_send.S).
    const BYTE: Duration = Duration::from_nanos(339_000);
    // A pulse every three bits. The checksum is wrong.
    const MESSAGE: [u8; 12] = [0b0010_0100; 12];
    let mut robots =
        Kilobots::new("n = 0 function step() { n = n + 1 led(n % 2) set_motor(100, 100) }", 1);
    robots.start();
    robots.run_ms(200);
    assert_eq!(robots.motors(0), [100, 100]);
    let start = robots.now();
    // The timer begins to count just before the LED's first flash. Half of a message, which takes 4.4 ms, comes before an overflow.
    let (lit, _) = robots.colors(0, Duration::ZERO)[0];
    let first = lit + 10 * OVERFLOW - Duration::from_millis(2);
    let mut earlier = Duration::ZERO;
    let mut overflows = 0;
    while earlier < BYTE {
        let at = first + overflows * OVERFLOW - earlier;
        robots.execute_on(0, &Command::Radio { at, payload: MESSAGE.to_vec() });
        robots.run_for(at + OVERFLOW / 2 - robots.now());
        overflows += 1;
        if overflows % 3 == 0 {
            earlier += TWO_CYCLES;
        }
    }
    let later = robots.events[0].iter().filter(|event| event.at > start);
    let stops = later.filter(|event| matches!(event.event, EmulatorEvent::Motor { .. })).count();
    let steps = robots.colors(0, start);
    let early = steps.windows(2).filter(|pair| pair[1].0 - pair[0].0 < Duration::from_millis(95));
    assert_eq!((stops, early.count()), (0, 0));
}

/// A robot that is stuck stops after two seconds, and runs no script until the controller resets it.
#[test]
fn the_watchdog_ends_a_program_that_is_stuck_within_two_seconds() {
    // The vector of timer 0's overflow, every 32.8 ms (data sheet, table 12-6), and `jmp 0x7000`.
    const VECTOR: u32 = 16 * 4;
    const JUMP: [u8; 4] = [0x0c, 0x94, 0x00, 0x38];
    let mut robots = Kilobots::new(DRIVES, 1);
    robots.start();
    robots.run_ms(500);
    let duties = robots.motors(0);
    assert_ne!(duties, [0, 0]);
    let vector = robots.memory(0, VECTOR, 4);
    robots.execute_on(0, &Command::Write { address: BOOT, bytes: STANDS_STILL.to_vec() });
    robots.execute_on(0, &Command::Write { address: VECTOR, bytes: JUMP.to_vec() });
    let since = robots.now();
    robots.run_ms(100);
    robots.execute_on(0, &Command::Write { address: VECTOR, bytes: vector });
    robots.run_ms(5_000);
    let resets: Vec<Duration> =
        resets(&robots.events[0]).into_iter().map(|(at, _)| at - since).collect();
    let [at] = resets[..] else { panic!("{resets:?}") };
    // 2.0 s (data sheet, table 10-3), and until the overflow.
    assert!((1_950..2_200).contains(&at.as_millis()), "{at:?}");
    assert_eq!(robots.motors(0), [0, 0]);
    robots.command(kind::RUN, [0; 9]);
    robots.run_ms(500);
    assert_eq!((robots.color(0), robots.motors(0)), (RED, [0, 0]));
    robots.command(kind::RESET, [0; 9]);
    robots.run_ms(100);
    robots.command(kind::RUN, [0; 9]);
    robots.run_ms(500);
    assert_eq!((robots.color(0), robots.motors(0)), ([0; 3], duties));
}

/// The boot loader begins where kilolib has it, and nothing that the program turned on disturbs it: the motors stand, and the
/// watchdog is off.
#[test]
fn the_controller_starts_the_boot_loader() {
    // Blue: pins C4 and C5 are outputs. `ldi r16, 0x30`, `out DDRC, r16`
    const SHINES: [u8; 4] = [0x00, 0xe3, 0x07, 0xb9];
    let mut robots = Kilobots::new(DRIVES, 1);
    let bytes = [&SHINES[..], &STANDS_STILL].concat();
    robots.execute_on(0, &Command::Write { address: BOOT, bytes });
    robots.start();
    robots.run_ms(500);
    assert_ne!(robots.motors(0), [0, 0]);
    robots.command(kind::BOOT, [0; 9]);
    let since = robots.now();
    assert_eq!((robots.color(0), robots.motors(0)), (BLUE, [0, 0]));
    // Twice as long as the watchdog's longest time.
    robots.run_ms(16_000);
    assert_eq!(robots.colors(0, since), []);
    assert_eq!(resets(&robots.events[0]), []);
}
