//! A debugger that halts the core: the watchdog stands still meanwhile (DBGMCU_APB1_FZ), else it would reset the robot, which then
//! stays locked until power-on.

use std::time::Duration;

use bittybuzz_chips::Random;
use bittybuzz_hil::{Command, Core, EmulatorEvent, Place, Robot, Table, TimedEvent, resets};

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
