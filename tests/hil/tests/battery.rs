//! A Crazyflie whose battery runs down, step by step, and is charged.

use std::time::Duration;

use bittybuzz_hil::{
    Command, EmulatorEvent, Swarm, TimedEvent, flashes, frames, is_lit, motors, resets,
};

const SCRIPT: &str = "\
function step() {
  led(2)
  set_motor(0, 40) set_motor(1, 40) set_motor(2, 40) set_motor(3, 40)
  neighbors.broadcast(\"n\", 1)
  log(battery())
}
";

/// Syslink: all power is to be cut.
const SWITCH_OFF: u8 = 0x11;

struct Run {
    swarm: Swarm,
    now: Duration,
}

impl Run {
    fn begin() -> Self {
        Run { swarm: Swarm::crazyflies(SCRIPT, &[7]), now: Duration::ZERO }
    }

    fn battery(&mut self, volts: f32, usb_powered: bool) {
        let charging = usb_powered;
        self.swarm.members()[0].robot.execute(&Command::Battery { volts, charging, usb_powered });
    }

    fn ms(&mut self, ms: u64) {
        self.swarm.run_ms(ms);
        self.now += Duration::from_millis(ms);
    }

    fn events(&mut self) -> &[TimedEvent] {
        &self.swarm.members()[0].robot.events
    }

    fn duties(&mut self) -> [f64; 4] {
        motors(self.events())
    }

    /// Lets ten seconds pass: steps logged, and flashes of the right red LED, each 50 ms long and so far apart.
    fn ten_seconds(&mut self, apart: Duration) -> (usize, usize) {
        let (logged, since) = (self.swarm.members()[0].trace_log.log.len(), self.now);
        self.ms(10_000);
        let red = flashes(self.events(), "red_right", since);
        for (_, length) in &red {
            assert!(
                length.abs_diff(Duration::from_millis(50)) < Duration::from_millis(3),
                "{red:?}"
            );
        }
        for pair in red.windows(2) {
            let span = pair[1].0 - pair[0].0;
            assert!(span.abs_diff(apart) < Duration::from_millis(3), "{red:?}");
        }
        (self.swarm.members()[0].trace_log.log.len() - logged, red.len())
    }

    fn reported(&mut self, word: &str) -> usize {
        let firmware = &self.swarm.members()[0].trace_log.firmware;
        firmware.iter().filter(|line| line.contains(word)).count()
    }
}

/// CI has the flight that a low battery ends, and an empty battery from the start.
#[test]
#[ignore = "soak"]
fn a_battery_that_runs_down_warns_stops_and_switches_off() {
    let mut run = Run::begin();
    run.ms(2000);
    // Motors that start pull the voltage down for a moment.
    run.battery(2.8, false);
    run.ms(3500);
    run.battery(3.25, false);
    assert_eq!(run.ten_seconds(Duration::ZERO), (100, 0));
    assert!(run.duties().iter().all(|duty| *duty > 0.1));

    run.battery(3.15, false);
    run.ms(6500);
    let (steps, red) = run.ten_seconds(Duration::from_secs(2));
    assert!(steps == 100 && (4..=5).contains(&red), "{steps} {red}");
    assert!(run.duties().iter().all(|duty| *duty > 0.1));

    run.battery(3.05, false);
    run.ms(6500);
    let since = run.now;
    let (steps, red) = run.ten_seconds(Duration::from_millis(500));
    assert!(steps == 100 && (19..=20).contains(&red), "{steps} {red}");
    assert_eq!(run.duties(), [0.0; 4]);
    let turned = |event: &TimedEvent| {
        event.at >= since && matches!(event.event, EmulatorEvent::Motor { .. })
    };
    assert!(!run.events().iter().any(turned), "the script's set-points change nothing");
    assert!(is_lit(run.events(), "green_left"), "the script goes on");
    // Without its load the battery recovers.
    run.battery(3.5, false);
    run.ms(20_000);
    assert_eq!(run.duties(), [0.0; 4]);
    assert_eq!(frames(run.events(), SWITCH_OFF).count(), 0);

    run.battery(2.95, false);
    run.ms(6500);
    let off: Vec<Duration> = frames(run.events(), SWITCH_OFF).map(|(at, _)| at).collect();
    assert_eq!(off.len(), 1);
    let power_off = |event: &&TimedEvent| matches!(event.event, EmulatorEvent::PowerOff { .. });
    let at = run.events().iter().find(power_off).expect("the nRF51 cuts the power").at;
    assert!(at >= off[0] && at < off[0] + Duration::from_millis(1), "{at:?}, asked at {off:?}");
    assert_eq!(resets(run.events()), []);
    for word in ["battery low", "battery empty", "battery flat"] {
        assert_eq!(run.reported(word), 1, "{word}");
    }
}

/// The nRF51 may miss frames: here all of four seconds.
#[test]
fn a_robot_asks_again_until_its_power_is_cut() {
    let mut run = Run::begin();
    run.battery(2.8, false);
    run.ms(14_500);
    assert_eq!(run.duties(), [0.0; 4]);
    for (lose, ms, is_off) in [(1.0, 4000, false), (0.0, 1000, true)] {
        run.swarm.members()[0].robot.execute(&Command::Link { lose, corrupt: 0.0, seed: 3 });
        run.ms(ms);
        let power_off = |event: &TimedEvent| matches!(event.event, EmulatorEvent::PowerOff { .. });
        assert_eq!(run.events().iter().any(power_off), is_off);
    }
}

#[test]
#[ignore = "soak"]
fn a_charger_gives_the_motors_power_again() {
    let mut run = Run::begin();
    run.battery(2.8, false);
    run.ms(12_500);
    assert_eq!(run.duties(), [0.0; 4]);
    run.battery(3.3, true);
    run.ms(1500);
    assert!(run.duties().iter().all(|duty| *duty > 0.1), "{:?}", run.duties());
    // As long as it is there, the battery's voltage does not matter.
    run.battery(2.8, true);
    assert_eq!(run.ten_seconds(Duration::ZERO), (100, 0));
    run.battery(3.7, false);
    assert_eq!(run.ten_seconds(Duration::ZERO), (100, 0));
    assert!(run.duties().iter().all(|duty| *duty > 0.1));
    assert_eq!(run.reported("battery charging"), 1);
}
