//! A debugger that halts the core. With its motors off a robot continues afterwards, because the watchdog stands still meanwhile
//! (DBGMCU_APB1_FZ). While a motor turns the watchdog counts, because the timers of the motors do not stop: it resets the robot, which
//! then stays locked until power-on.

use std::time::Duration;

use bittybuzz_chips::Random;
use bittybuzz_emulation::message::{Memory, ResetCause};
use bittybuzz_hil::safety::{assert_locked, reset};
use bittybuzz_hil::{
    Command, Core, EmulatorEvent, Place, Robot, Table, TimedEvent, motors, resets,
};

/// Changes an LED in each step.
const SCRIPT: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  led(n % 2)
}
";

/// A halt takes from half a second to one and a half: longer than the watchdog's time with any LSI, 470 ms on the Crazyflie, 450 ms
/// on the Zooid.
const HALT_MIN_US: u64 = 500_000;
const SPREAD_US: u64 = 1_000_000;
const HALTS: u32 = 5;

/// The motors turn for a second, and rest for two.
const TURN_AND_REST: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  led(n % 2)
  power = 0
  if(n % 30 < 10) power = 76
  MOTORS
}
";
const OF_CRAZYFLIE: &str =
    "set_motor(0, power) set_motor(1, power) set_motor(2, power) set_motor(3, power)";
const OF_ZOOID: &str = "set_motor(power / 2, power / 2)";

/// A core that is halted for longer than a motor may turn without control.
const MOTORS_OFF_MS: u64 = 500;

fn chip(lsi_hz: u64) -> Command {
    Command::Chip { lsi_hz, crystal: true, memory: Memory::Kept, seed: 0, debugger: false }
}

/// Steps since `from`: each changes the one LED of the script.
fn steps_in(events: &[TimedEvent], from: Duration) -> usize {
    let is_step =
        |event: &&TimedEvent| event.at >= from && matches!(event.event, EmulatorEvent::Led { .. });
    events.iter().filter(is_step).count()
}

#[test]
fn a_crazyflie_whose_core_is_halted_goes_on_afterwards() {
    let mut robot = Robot::crazyflie(Core::Unicorn, SCRIPT);
    robot.run_ms(1000);
    let mut random = Random::new(1);
    for _ in 0..HALTS {
        robot.run_us(1 + random.bits() % 300_000);
        robot.execute(&Command::Halt { halted: true });
        robot.run_us(HALT_MIN_US + random.bits() % SPREAD_US);
        robot.execute(&Command::Halt { halted: false });
        let at = robot.now();
        robot.run_ms(1000);
        assert_eq!(resets(&robot.events), [], "halted until {at:?}");
        let steps = steps_in(&robot.events, at);
        assert!(steps >= 9, "{steps} changes of LEDs in the second after {at:?}");
    }
}

#[test]
fn a_zooid_whose_core_is_halted_goes_on_afterwards() {
    let mut table = Table::new(SCRIPT, &[7]);
    table.put(0, Place::at(0.0, 0.0, 0.0));
    table.run_ms(1000);
    let mut random = Random::new(2);
    for _ in 0..HALTS {
        table.run(Duration::from_micros(1 + random.bits() % 300_000));
        table.execute_on(0, &Command::Halt { halted: true });
        table.run(Duration::from_micros(HALT_MIN_US + random.bits() % SPREAD_US));
        table.execute_on(0, &Command::Halt { halted: false });
        let at = table.now();
        table.run_ms(1000);
        let events = &table.zooids()[0].events;
        assert_eq!(resets(events), [], "halted until {at:?}");
        let steps = steps_in(events, at);
        assert!(steps >= 9, "{steps} changes of LEDs in the second after {at:?}");
    }
}

#[test]
fn motors_of_a_crazyflie_whose_core_is_halted_stop() {
    for lsi_hz in [17_000, 47_000] {
        for lead_us in [0, 3_333, 50_000] {
            let script = TURN_AND_REST.replace("MOTORS", OF_CRAZYFLIE);
            let mut robot = Robot::crazyflie(Core::Unicorn, &script);
            robot.execute(&chip(lsi_hz));
            reset(&mut robot, ResetCause::PowerOn);
            robot.run_ms(600);
            robot.run_us(1 + lead_us);
            assert!(motors(&robot.events).iter().all(|duty| *duty > 0.05), "{lsi_hz} Hz");
            let halted = robot.now();
            robot.execute(&Command::Halt { halted: true });
            robot.run_ms(MOTORS_OFF_MS);
            assert_eq!(motors(&robot.events), [0.0; 4], "{lsi_hz} Hz");
            let (at, cause) = resets(&robot.events)[1];
            assert!(
                cause == "independent_watchdog" && at > halted,
                "{lsi_hz} Hz: {cause} at {at:?}"
            );
            robot.execute(&Command::Halt { halted: false });
            assert_locked(&mut robot, at);
        }
    }
}

/// The freeze of the watchdog returns with the last motor that stops.
#[test]
fn a_crazyflie_whose_motors_have_stopped_goes_on_after_a_halt() {
    let mut robot = Robot::crazyflie(Core::Unicorn, &TURN_AND_REST.replace("MOTORS", OF_CRAZYFLIE));
    for _ in 0..2 {
        robot.run_ms(600);
        assert!(motors(&robot.events).iter().all(|duty| *duty > 0.05));
        robot.run_ms(900);
        assert_eq!(motors(&robot.events), [0.0; 4]);
        robot.execute(&Command::Halt { halted: true });
        robot.run_ms(1_000);
        robot.execute(&Command::Halt { halted: false });
        let at = robot.now();
        robot.run_ms(1_500);
        assert_eq!(resets(&robot.events), []);
        assert!(steps_in(&robot.events, at) >= 14);
    }
}

#[test]
fn motors_of_a_zooid_whose_core_is_halted_stop() {
    for lsi_hz in [30_000, 50_000] {
        let mut table = Table::new(&TURN_AND_REST.replace("MOTORS", OF_ZOOID), &[7]);
        table.put(0, Place::at(0.0, 0.0, 0.0));
        table.execute_on(0, &chip(lsi_hz));
        table.execute_on(0, &Command::Power { on: false });
        table.execute_on(0, &Command::Power { on: true });
        table.run_ms(800);
        assert!(table.zooids()[0].motors()[0] > 0.3, "{lsi_hz} Hz");
        table.execute_on(0, &Command::Halt { halted: true });
        table.run_ms(MOTORS_OFF_MS);
        let zooid = &table.zooids()[0];
        assert_eq!(zooid.motors(), [0.0; 2], "{lsi_hz} Hz");
        let (_, cause) = *resets(&zooid.events).last().unwrap();
        assert_eq!(cause, "independent_watchdog", "{lsi_hz} Hz");
        table.execute_on(0, &Command::Halt { halted: false });
        table.run_ms(1_000);
        assert_eq!(table.zooids()[0].motors(), [0.0; 2], "{lsi_hz} Hz: it is locked");
    }
}

/// Wheels that brake have no power.
#[test]
fn a_zooid_whose_motors_have_stopped_goes_on_after_a_halt() {
    let mut table = Table::new(&TURN_AND_REST.replace("MOTORS", OF_ZOOID), &[7]);
    table.put(0, Place::at(0.0, 0.0, 0.0));
    for _ in 0..2 {
        table.run_ms(800);
        assert!(table.zooids()[0].motors()[0] > 0.3);
        table.run_ms(700);
        assert_eq!(table.zooids()[0].motors(), [0.0; 2]);
        table.execute_on(0, &Command::Halt { halted: true });
        table.run_ms(1_000);
        table.execute_on(0, &Command::Halt { halted: false });
        let at = table.now();
        table.run_ms(1_500);
        let events = &table.zooids()[0].events;
        assert_eq!(resets(events), []);
        assert!(steps_in(events, at) >= 14);
    }
}
