//! The sensors on the board of a Crazyflie: 1,000 samples per second by interrupts, their self-tests, and their faults.

use bittybuzz_hil::{
    BarometerFault, Command, Core, DeviceFault, EmulatorEvent, ImuFault, Robot, TraceLog, resets,
};

use crate::figures::{self, TOLERANCE};

/// Every step sets the LEDs, and computes for most of its time.
const BUSY: &str = "\
function init() { n = 0 }
function step() { n = n + 1 led(n % 8) i = 0 while(i < 3000) i = i + 1 }
";

/// The sensors run from here on: they start a second after power-on, and that takes 0.4 s with their self-tests.
const STARTED_MS: u64 = 1_600;
/// The line of the log when they run.
const RUN: &str = "gyroscope, accelerometer and barometer run";
/// The period of the lines with counters.
const STATUS_MS: u64 = 10_000;

/// The numbers of a line with counters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Counters {
    samples: u64,
    late: u64,
    missed: u64,
    failed: u64,
    slowest_us: u64,
    wake_ups: u64,
}

/// Returns the lines of the firmware's log.
fn log(robot: &Robot) -> Vec<String> {
    TraceLog::of_events(&robot.events).firmware
}

/// Returns the lines with counters.
fn counters(robot: &Robot) -> Vec<Counters> {
    let lines = log(robot).into_iter().filter(|line| line.contains("wake-ups"));
    let counters = lines.map(|line| {
        let number = |part: &str| part.split(' ').find_map(|word| word.parse().ok());
        let numbers: Vec<u64> = line.split(", ").filter_map(number).collect();
        let [samples, late, missed, failed, slowest_us, wake_ups] = numbers[..] else {
            panic!("{line}");
        };
        Counters { samples, late, missed, failed, slowest_us, wake_ups }
    });
    counters.collect()
}

/// Returns a robot whose sensors run.
fn started() -> Robot {
    let mut robot = Robot::crazyflie(Core::Unicorn, BUSY);
    robot.run_ms(STARTED_MS);
    let log = log(&robot);
    assert!(log.iter().any(|line| line == RUN), "{log:?}");
    robot
}

fn set_barometer_fault(robot: &mut Robot, fault: Option<BarometerFault>) {
    robot.execute(&Command::DeviceFault { fault: DeviceFault::Barometer(fault) });
}

/// Asserts that the log has this line once.
fn assert_once(robot: &Robot, line: &str) {
    let lines = log(robot);
    assert_eq!(lines.iter().filter(|found| *found == line).count(), 1, "{line}: {lines:?}");
}

fn set_fault(robot: &mut Robot, fault: Option<ImuFault>) {
    robot.execute(&Command::DeviceFault { fault: DeviceFault::Imu(fault) });
}

/// Neither a reset nor a mistake that the chip would not forgive.
fn assert_healthy(robot: &Robot) {
    assert_eq!(resets(&robot.events), []);
    let errors = robot.events.iter();
    let errors = errors.filter(|event| matches!(event.event, EmulatorEvent::HardwareError { .. }));
    assert_eq!(errors.collect::<Vec<_>>(), Vec::<&_>::new());
}

/// A robot whose sensors are disturbed again and again reports its counters as often as any other.
#[test]
fn events_of_the_sensors_do_not_delay_the_counters() {
    let mut robot = started();
    robot.run_ms(3_000);
    assert_eq!(counters(&robot).len(), 1);
    for _ in 0..3 {
        set_fault(&mut robot, Some(ImuFault::NoAcknowledge));
        robot.run_ms(1);
        set_fault(&mut robot, None);
        robot.run_ms(3_500);
    }
    assert!(log(&robot).iter().filter(|line| line.contains("disturbed")).count() >= 3);
    assert_eq!(counters(&robot).len(), 2, "{:?}", log(&robot));
}

#[test]
fn a_sample_comes_every_millisecond() {
    let mut robot = started();
    robot.run_ms(STATUS_MS);
    let before = robot.statistics().core;
    robot.run_ms(STATUS_MS);
    let after = robot.statistics().core;
    let [first, second] = counters(&robot)[..] else { panic!("{:?}", log(&robot)) };
    println!("{first:?} {second:?}");
    let samples = second.samples - first.samples;
    // The lines themselves are written at a time of the robot's clock.
    assert!(samples.abs_diff(STATUS_MS) <= 1, "{samples}");
    assert_eq!((second.late, second.missed, second.failed), (0, 0, 0));
    // The pulse and the end of each of two reads. The limit of a read's time expires every 3 ms.
    let wake_ups = 1000 * (second.wake_ups - first.wake_ups) / samples;
    assert!((3_000..=3_400).contains(&wake_ups), "{wake_ups} per 1000 samples");
    // Two reads of 86 bits at 400 kHz take 430 µs.
    assert!((430..=500).contains(&second.slowest_us), "{second:?}");
    let figures = [
        ("slowest_us", second.slowest_us),
        ("wake_ups_per_1000", wake_ups),
        ("exceptions_per_s", (after.exceptions - before.exceptions) / 10),
    ];
    figures::check("crazyflie", "sensors", &figures, TOLERANCE);
    println!("{figures:?}");
    assert_healthy(&robot);
    // The robot stands: 1 g upwards, a gyroscope with a small offset, and the noise of the data sheets.
    let log = log(&robot);
    let counts = log.iter().filter_map(|line| line.strip_prefix("counts "));
    for line in counts {
        let counts: Vec<i32> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
        let at_rest = [(5, 16), (-3, 16), (2, 16), (0, 19), (0, 19), (1365, 19)];
        let mut near = counts.iter().zip(at_rest);
        assert!(near.all(|(count, (rest, most))| (count - rest).abs() <= most), "{line}");
        assert_eq!(counts.len(), 6, "{line}");
    }
    let gravity = log.iter().filter_map(|line| line.strip_suffix(" m/s2"));
    let mut gravity = gravity.filter_map(|line| line.rsplit(' ').next()?.parse::<f32>().ok());
    assert!(gravity.next_back().is_some_and(|z| (z - 9.8).abs() < 0.15), "{log:?}");
}

/// A fault that lasts for `us` costs at most `lost` samples. The log has one line about it, with one of
/// these ends.
fn a_short_fault_costs(fault: ImuFault, us: u64, lost: u64, ends: &[&str]) {
    let mut robot = started();
    // Between two samples, within one, and at other places.
    for place_us in [0, 130, 290, 350, 410, 700] {
        robot.run_us(5_000 + place_us);
        set_fault(&mut robot, Some(fault));
        robot.run_us(us);
        set_fault(&mut robot, None);
        robot.run_us(15_000 - place_us - us);
    }
    robot.run_ms(2 * STATUS_MS);
    let log = log(&robot);
    let lines = log.iter().filter(|line| line.contains("disturbed"));
    let lines: Vec<_> = lines.collect();
    println!("{fault:?}: {lines:?}");
    assert!((1..=6).contains(&lines.len()), "{lines:?}");
    let is_known = |line: &str| ends.iter().any(|end| line.ends_with(end));
    assert!(lines.iter().all(|line| is_known(line)), "{lines:?}");
    let last = *counters(&robot).last().unwrap();
    println!("{last:?}");
    assert!(last.failed + last.missed <= 6 * lost, "{last:?}");
    assert!(!log.iter().any(|line| line.contains("again")), "{log:?}");
    assert_healthy(&robot);
}

#[test]
fn a_missing_acknowledgement_costs_a_sample() {
    a_short_fault_costs(ImuFault::NoAcknowledge, 500, 2, &["Bus(NoAcknowledge)"]);
}

#[test]
fn clock_pulses_free_a_bus_that_a_sensor_holds() {
    // The chip that seizes the line during its address does not acknowledge it.
    a_short_fault_costs(ImuFault::SdaLow(9), 2_500, 2, &["BusHeld", "Bus(NoAcknowledge)"]);
}

/// SDA stays low after nine pulses: the firmware says so, and tries again until the chip lets go.
#[test]
fn a_bus_that_stays_held_is_reported_and_used_again() {
    let mut robot = started();
    set_fault(&mut robot, Some(ImuFault::SdaLow(u32::MAX)));
    robot.run_ms(2_000);
    let lines = log(&robot);
    for line in [
        "a sample of the sensors was disturbed: Bus(SdaLow)",
        "the sensors are started again after Bus(SdaLow)",
        "Gyroscope does not answer: SdaLow",
    ] {
        assert_eq!(lines.iter().filter(|found| *found == line).count(), 1, "{lines:?}");
    }
    // The link and the script do not notice.
    assert!(robot.ping(1, 10).is_some());
    set_fault(&mut robot, None);
    robot.run_ms(700);
    let runs = log(&robot).into_iter().filter(|line| line == RUN);
    assert_eq!(runs.count(), 2);
    assert_healthy(&robot);
}

/// The start is repeated until the right chips answer.
#[test]
fn sensors_that_are_wrong_or_missing_are_named() {
    let faults = [
        (ImuFault::GyroscopeId(7), "Gyroscope is another chip, with id 0x7"),
        (ImuFault::AccelerometerId(0x1f), "Accelerometer is another chip, with id 0x1f"),
        (ImuFault::NoAcknowledge, "Gyroscope does not answer: NoAcknowledge"),
        (ImuFault::SdaLow(u32::MAX), "Gyroscope does not answer: SdaLow"),
        (ImuFault::FailedSelfTest, "Gyroscope fails its self-test"),
    ];
    for (fault, line) in faults {
        let mut robot = Robot::crazyflie(Core::Unicorn, BUSY);
        set_fault(&mut robot, Some(fault));
        robot.run_ms(3_000);
        let lines = log(&robot);
        assert_eq!(lines.iter().filter(|found| *found == line).count(), 1, "{lines:?}");
        set_fault(&mut robot, None);
        robot.run_ms(1_500);
        let lines = log(&robot);
        assert!(lines.iter().any(|line| line == RUN), "{lines:?}");
        assert_healthy(&robot);
    }
}

#[test]
fn barometers_that_are_wrong_or_missing_are_named() {
    let faults = [
        (BarometerFault::WrongId(0x55), "Barometer is another chip, with id 0x55"),
        (BarometerFault::NoAcknowledge, "Barometer does not answer: NoAcknowledge"),
        (BarometerFault::NoMeasurement, "Barometer does not start"),
        (BarometerFault::CommandNotReady, "Barometer does not start"),
        (BarometerFault::FatalError, "Barometer fails its self-test"),
    ];
    for (fault, line) in faults {
        let mut robot = Robot::crazyflie(Core::Unicorn, BUSY);
        set_barometer_fault(&mut robot, Some(fault));
        robot.run_ms(3_000);
        assert_once(&robot, line);
        set_barometer_fault(&mut robot, None);
        robot.run_ms(1_500);
        assert_once(&robot, RUN);
        assert_healthy(&robot);
    }
}

/// A robot with such a fault does not arm, and its log says so.
#[test]
fn sensors_that_repeat_their_values_are_reported() {
    let mut robot = started();
    set_fault(&mut robot, Some(ImuFault::FrozenData));
    robot.run_ms(100);
    assert_once(&robot, "Gyroscope repeats its values");
    robot.run_ms(2 * STATUS_MS);
    let lines = log(&robot);
    let line = "the robot does not arm: Gyroscope repeats its values";
    assert!(lines.iter().any(|found| found == line), "{lines:?}");
    set_fault(&mut robot, None);
    robot.run_ms(100);
    assert_once(&robot, "the values of the sensors change again");

    set_barometer_fault(&mut robot, Some(BarometerFault::FrozenData));
    robot.run_ms(700);
    assert_once(&robot, "Barometer repeats its values");
    assert_healthy(&robot);
}

/// The inertial sensors lose nothing without the barometer.
#[test]
fn a_barometer_that_fails_in_flight_is_reported() {
    let mut robot = started();
    set_barometer_fault(&mut robot, Some(BarometerFault::NoAcknowledge));
    robot.run_ms(2 * STATUS_MS);
    assert_once(&robot, "Barometer repeats its values");
    let last = *counters(&robot).last().unwrap();
    assert_eq!((last.late, last.failed), (0, 0), "{last:?}");
    assert!(!log(&robot).iter().any(|line| line.contains("again")));
    assert_healthy(&robot);
}

/// A chip stops the bus after the start. The sensors start again without self-tests, which would fail in the air.
#[test]
fn sensors_start_again_without_self_tests() {
    let mut robot = started();
    set_fault(&mut robot, Some(ImuFault::FailedSelfTest));
    set_barometer_fault(&mut robot, Some(BarometerFault::SdaLow(u32::MAX)));
    robot.run_ms(200);
    assert_once(&robot, "the sensors are started again after Bus(SdaLow)");
    set_barometer_fault(&mut robot, None);
    robot.run_ms(700);
    let runs = log(&robot).into_iter().filter(|line| line == RUN);
    assert_eq!(runs.count(), 2);
    assert_healthy(&robot);
}

#[test]
fn a_gyroscope_without_pulses_is_reported() {
    let mut robot = started();
    set_fault(&mut robot, Some(ImuFault::NoDataReady));
    robot.run_ms(1_000);
    let lines = log(&robot);
    let line = "the sensors are started again after NoPulse";
    assert!(lines.iter().any(|found| found == line), "{lines:?}");
    assert!(lines.len() < 20, "{lines:?}");
    assert_healthy(&robot);
}

/// One pulse comes 1.7 ms after the one before, and then one 0.3 ms after that.
#[test]
fn late_pulses_are_counted() {
    let mut robot = started();
    set_fault(&mut robot, Some(ImuFault::LateDataReadyUs(700)));
    robot.run_ms(100);
    set_fault(&mut robot, None);
    robot.run_ms(STATUS_MS);
    let last = *counters(&robot).last().unwrap();
    assert_eq!((last.late, last.failed), (1, 0), "{last:?}");
    assert!(last.missed <= 1, "{last:?}");
}

/// The end of a transaction never reaches the task. The limits of time end each wait, and nothing else suffers.
#[test]
fn transactions_that_do_not_end_are_given_up() {
    let mut robot = started();
    robot.execute(&Command::Skip { symbol: "Transfer>::conclude".into() });
    robot.run_ms(1_000);
    let lines = log(&robot);
    for line in [
        "a sample of the sensors was disturbed: BusSilent",
        "the sensors are started again after BusSilent",
        "Gyroscope does not start",
    ] {
        assert_eq!(lines.iter().filter(|found| *found == line).count(), 1, "{lines:?}");
    }
    assert!(robot.ping(1, 10).is_some());
    assert_healthy(&robot);
}
