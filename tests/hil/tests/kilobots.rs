//! The Kilobot's image in simavr: what it does with scripts, with the overhead controller, and with light.

use std::time::Duration;

use bittybuzz_comms::infrared::FaultReport;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_hil::kilobots::{behavior, kind};
use bittybuzz_hil::{Command, Kilobots};
use bittybuzz_vm_core::FaultCode;

const DARK: [u8; 3] = [0; 3];
const RED: [u8; 3] = [3, 0, 0];
const GREEN: [u8; 3] = [0, 3, 0];
const BLUE: [u8; 3] = [0, 0, 3];

/// Counts steps with the LED: red and green in turn.
const COUNTS: &str = "n = 0\nfunction step() {\n  n = n + 1\n  led(n % 2 + 1)\n}\n";

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

#[test]
fn it_waits_for_the_controller_and_then_steps_ten_times_a_second() {
    let mut robots = Kilobots::new(COUNTS, 1);
    robots.run_ms(1005);
    let flashes = robots.colors(0, Duration::ZERO);
    // A ms of green, 200 ms of nothing (kilolib.c).
    assert_eq!(flashes.iter().filter(|(_, color)| *color == GREEN).count(), 5);
    assert!(flashes.iter().all(|(_, color)| [GREEN, DARK].contains(color)));
    robots.command(kind::RUN, [0; 9]);
    let start = robots.now();
    robots.run_ms(30_000);
    let steps = robots.colors(0, start + ms(50));
    // Between green and red both are on, or both off, for a moment.
    let times: Vec<Duration> =
        steps.iter().filter(|(_, color)| [RED, GREEN].contains(color)).map(|(at, _)| *at).collect();
    assert!((299..=301).contains(&times.len()), "{} steps in 30 s", times.len());
    for pair in times.windows(2) {
        let period = pair[1] - pair[0];
        assert!((ms(98)..=ms(102)).contains(&period), "{period:?}");
    }
}

#[test]
fn functions_of_the_robot() {
    let mut robots = Kilobots::new(
        "n = 0
function step() {
  n = n + 1
  if(n == 1) led(3, 1, 2)
  if(n == 5) led(6)
  if(n == 10) forward()
  if(n == 20) left()
  if(n == 30) right()
  if(n == 40) stop()
  if(n == 50) set_motor(100, 50)
  if(n == 60) { l = light() if(l > 580 and l < 620) led(1) }
  if(n == 65 and battery() > 600) led(2)
  if(n == 70) { delay(400) led(4) }
}",
        1,
    );
    robots.execute_on(0, &Command::Surroundings { light: 600, celsius: 20.0 });
    robots.start();
    let seen = |robots: &mut Kilobots, until: u64| {
        robots.run_ms(until - (robots.now().as_millis() as u64 - 110));
        (robots.color(0), robots.motors(0))
    };
    assert_eq!(seen(&mut robots, 250), ([3, 1, 2], [0, 0]));
    assert_eq!(seen(&mut robots, 750), ([0, 3, 3], [0, 0]));
    // The duties of the EEPROM, after 15 ms of full ones.
    let duties = robots.memory(0, 0x81_0000, 0x15);
    let [left, right, straight_left, straight_right] = [5, 9, 12, 20].map(|at| duties[at]);
    assert_eq!(seen(&mut robots, 1250).1, [straight_left, straight_right]);
    assert_eq!(seen(&mut robots, 2250).1, [left, 0]);
    assert_eq!(seen(&mut robots, 3250).1, [0, right]);
    assert_eq!(seen(&mut robots, 4250).1, [0, 0]);
    assert_eq!(seen(&mut robots, 5250).1, [100, 50]);
    assert_eq!(seen(&mut robots, 6250).0, RED, "light");
    assert_eq!(seen(&mut robots, 6750).0, GREEN, "battery");
    assert_eq!(seen(&mut robots, 7200).0, GREEN, "waits");
    assert_eq!(seen(&mut robots, 7500).0, BLUE, "has waited");
}

#[test]
fn a_motor_that_starts_is_pushed_and_one_whose_script_hangs_stops() {
    let mut robots = Kilobots::new(
        "function init() { set_motor(70, 0) }
function step() { while(1) { x = 1 } }",
        1,
    );
    robots.start();
    robots.run_ms(2000);
    let duties: Vec<(Duration, u8, f64)> = robots.events[0]
        .iter()
        .filter_map(|event| match event.event {
            bittybuzz_hil::EmulatorEvent::Motor { number, duty, .. } => {
                Some((event.at, number, duty))
            }
            _ => None,
        })
        .collect();
    let [(push, 1, 1.0), (run, 1, duty), (stop, 1, 0.0)] = duties[..] else { panic!("{duties:?}") };
    assert_eq!((duty * 255.0).round(), 70.0);
    assert!((ms(15)..ms(18)).contains(&(run - push)), "{:?}", run - push);
    // 500 ms after the last step that was completed, here none but `init`.
    assert!((ms(495)..ms(520)).contains(&(stop - push)), "{:?}", stop - push);
}

#[test]
fn a_fault_stops_the_motors_and_is_reported_by_led_and_light() {
    let script = "function init() {
  forward()
}
n = 0
function step() {
  n = n + 1
  if(n == 5) {
    n = n / 0
  }
}
";
    let mut robots = Kilobots::new(script, 1);
    robots.start();
    // Into the fourth pause, of 8 s, which begins 9.0 s after the start.
    robots.run_ms(16_500);
    assert_eq!(robots.motors(0), [0, 0]);
    // Rounds of five blinks of 200 ms: division by zero.
    let red: Vec<Duration> = robots
        .colors(0, robots.now() - ms(7_700))
        .iter()
        .filter(|(_, color)| *color == RED)
        .map(|(at, _)| *at)
        .collect();
    let rounds: Vec<usize> =
        red.chunk_by(|a, b| *b - *a < ms(600)).map(<[Duration]>::len).collect();
    assert_eq!(rounds[..2], [5, 5], "{rounds:?}");
    // Twice a second.
    let sent = robots.sent(0);
    let in_pause = sent.iter().filter(|(at, _)| *at > robots.now() - ms(7_000)).count();
    assert!((12..=14).contains(&in_pause), "{in_pause}");
    let symbols = Symbols::from_json(&robots.symbols()).unwrap();
    let report = FaultReport::of(&sent[0].1).unwrap();
    assert_eq!((report.robot, u32::from(report.script)), (0, symbols.script_hash & 0xffff));
    let fault = report.fault.unwrap();
    assert_eq!(fault.code, FaultCode::DivisionByZero);
    let place = symbols.position(fault.position.into()).unwrap();
    assert_eq!(place.line, 8);
}

#[test]
fn the_controller_pauses_resumes_and_resets() {
    let mut robots = Kilobots::new(
        "function init() { forward() } n = 0 function step() { n = n + 1 forward() led(n / 10) }",
        1,
    );
    robots.start();
    robots.run_ms(1500);
    assert_eq!(robots.color(0), RED, "after ten steps");
    robots.command(kind::WAKEUP, [0; 9]);
    robots.run_ms(3000);
    assert_eq!(robots.motors(0), [0, 0]);
    let flashes = robots.colors(0, robots.now() - ms(2000));
    assert!(flashes.iter().all(|(_, color)| [GREEN, DARK].contains(color)), "{flashes:?}");
    robots.command(kind::RUN, [0; 9]);
    robots.run_ms(200);
    assert_eq!(robots.color(0), RED, "it goes on where it was");
    robots.run_ms(500);
    assert_eq!(robots.color(0), GREEN, "after twenty steps");
    assert_ne!(robots.motors(0), [0, 0]);
    robots.command(kind::RESET, [0; 9]);
    robots.run_ms(100);
    assert_eq!(robots.motors(0), [0, 0]);
    robots.command(kind::RUN, [0; 9]);
    robots.run_ms(300);
    assert_eq!(robots.color(0), DARK, "it began anew");
}

#[test]
fn the_controller_asks_for_battery_charge_and_id() {
    let mut robots = Kilobots::new(COUNTS, 3);
    robots.run_ms(100);
    for (volts, color) in [(4.1, GREEN), (3.0, RED)] {
        robots.execute_on(0, &Command::Battery { volts, charging: false, usb_powered: false });
        robots.command(kind::VOLTAGE, [0; 9]);
        robots.run_ms(100);
        assert_eq!(robots.color(0), color, "{volts} V");
    }
    robots.command(kind::CHARGE, [0; 9]);
    robots.run_ms(400);
    assert_eq!(robots.color(0), DARK);
    let since = robots.now();
    robots.execute_on(0, &Command::Battery { volts: 3.7, charging: true, usb_powered: false });
    robots.run_ms(1000);
    let flashes = robots.colors(0, since);
    assert!(flashes.iter().filter(|(_, color)| *color == [1, 0, 0]).count() >= 4, "{flashes:?}");
    // Bit 1 of the ids 0, 1, 2: those that have it turn left.
    robots.command(kind::READUID, [1, 0, 0, 0, 0, 0, 0, 0, 0]);
    robots.run_ms(100);
    let turns = [0, 1, 2].map(|robot| robots.motors(robot)[0] > 0);
    assert_eq!(turns, [false, false, true]);
}

#[test]
fn calibration_is_tried_and_kept() {
    let mut robots = Kilobots::new(COUNTS, 1);
    robots.run_ms(100);
    robots.command(kind::CALIB, [1, 0x34, 0x12, 0, 0, 0, 0, 0, 0]);
    robots.command(kind::CALIB, [2, 0, 0, 81, 0, 0, 0, 0, 0]);
    robots.run_ms(50);
    assert_eq!(robots.motors(0), [81, 0]);
    robots.command(kind::CALIB, [3, 0, 0, 0, 82, 0, 0, 0, 0]);
    robots.run_ms(50);
    assert_eq!(robots.motors(0), [0, 82]);
    robots.command(kind::CALIB, [4, 0, 0, 0, 0, 83, 84, 0, 0]);
    robots.run_ms(50);
    assert_eq!(robots.motors(0), [83, 84]);
    robots.command(kind::CALIB, [0; 9]);
    robots.run_ms(100);
    assert_eq!(robots.motors(0), [0, 0]);
    let memory = robots.memory(0, 0x81_0000, 0xb2);
    assert_eq!([5, 9, 12, 20].map(|at| memory[at]), [81, 82, 83, 84]);
    assert_eq!(memory[0xb0..0xb2], [0x34, 0x12]);
}

#[test]
fn it_sleeps_and_wakes_every_eight_seconds() {
    let mut robots = Kilobots::new(COUNTS, 1);
    robots.run_ms(100);
    robots.command(kind::SLEEP, [0; 9]);
    let since = robots.now();
    robots.run_ms(30_000);
    let white: Vec<Duration> = robots
        .colors(0, since)
        .iter()
        .filter(|(_, color)| *color == [3, 3, 3])
        .map(|(at, _)| *at)
        .collect();
    assert_eq!(white.len(), 3, "{white:?}");
    for pair in white.windows(2) {
        let period = pair[1] - pair[0];
        // The watchdog's oscillator: 8.0 s (data sheet, table 11-2), and the time awake.
        assert!((ms(7_500)..ms(8_800)).contains(&period), "{period:?}");
    }
    // The controller repeats its message until it is heard.
    for _ in 0..1000 {
        robots.command(kind::WAKEUP, [0; 9]);
    }
    let flashes = robots.colors(0, robots.now() - ms(1000));
    assert!(flashes.iter().any(|(_, color)| *color == GREEN), "{flashes:?}");
}

/// Whatever the robot does but sending, a pulse of light is served within 201 cycles of 8 MHz, before the next one comes.
#[test]
fn interrupts_do_not_wait_for_long() {
    let busy = "function step() { t = {} i = 0 while(1) { i = (i + 1) % 8 t[i] = {.a = i} } }";
    for script in [busy, COUNTS, "function step() { led(1) forward() delay(30) x = light() }"] {
        let mut robots = Kilobots::new(script, 1);
        robots.start();
        for _ in 0..100 {
            robots.command(kind::RUN, [0; 9]);
            robots.run_ms(13);
        }
        let cycles = robots.longest_wait(0).as_nanos() / 125;
        println!("{cycles} cycles");
        assert!((1..=201).contains(&cycles), "{cycles} cycles");
    }
}

/// The controller's messages come while a step never ends, a thousand of them, and while the receiver's clock differs, so that the
/// sender's is 5 % slower or 4.2 % faster.
#[test]
fn messages_are_received_while_the_script_computes() {
    let busy = "function step() { t = {} i = 0 while(1) { i = (i + 1) % 8 t[i] = {.a = i} } }";
    for (error_ppm, rounds) in [(0.0, 500), (-40_000.0, 100), (52_700.0, 100)] {
        let mut robots = Kilobots::new(busy, 1);
        robots.execute_on(0, &Command::Clock { error_ppm });
        robots.execute_on(0, &Command::Battery { volts: 4.1, charging: false, usb_powered: false });
        robots.start();
        for round in 0..rounds {
            robots.command(kind::VOLTAGE, [0; 9]);
            robots.run_ms(15);
            assert_eq!(robots.color(0), GREEN, "round {round}, {error_ppm} ppm");
            robots.command(kind::RUN, [0; 9]);
            robots.run_ms(15);
            assert_eq!(robots.color(0), DARK, "round {round}, {error_ppm} ppm");
        }
    }
}

/// Robots that share the erased id would be one robot to all others, and erased duties are full power. Such a robot shows magenta
/// and sends nothing until the controller has calibrated it.
#[test]
fn a_robot_with_erased_id_or_duties_does_not_join() {
    const MAGENTA: [u8; 3] = [3, 0, 3];
    let script = "function step() { led(2)  forward()  neighbors.broadcast(\"n\", 1) }";
    for (address, length) in [(0xb0, 2), (0x05, 1), (0x09, 1), (0x0c, 1), (0x14, 1)] {
        let mut robots = Kilobots::in_image(script, &behavior("broadcast"), 2);
        let bytes = vec![0xff; length];
        robots.execute_on(1, &Command::Write { address: 0x81_0000 + address, bytes });
        robots.start();
        robots.run_ms(3000);
        assert_eq!((robots.color(0), robots.color(1)), (GREEN, MAGENTA), "{address:#x}");
        assert_eq!(robots.motors(1), [0, 0], "{address:#x}");
        assert_eq!((robots.sent(0).is_empty(), robots.sent(1)), (false, [].into()), "{address:#x}");
        robots.command(kind::CALIB, [1, 9, 0, 0, 0, 0, 0, 0, 0]);
        robots.command(kind::CALIB, [2, 0, 0, 61, 0, 0, 0, 0, 0]);
        robots.command(kind::CALIB, [3, 0, 0, 0, 62, 0, 0, 0, 0]);
        robots.command(kind::CALIB, [4, 0, 0, 0, 0, 63, 64, 0, 0]);
        robots.command(kind::CALIB, [0; 9]);
        robots.run_ms(100);
        robots.start();
        robots.run_ms(3000);
        assert_eq!(robots.color(1), GREEN, "{address:#x}");
        assert_eq!(robots.motors(1), [63, 64], "{address:#x}");
        assert!(!robots.sent(1).is_empty(), "{address:#x}");
    }
}
