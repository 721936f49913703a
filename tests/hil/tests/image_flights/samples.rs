//! The times of the sensors' samples in a long flight, and in a long wait on the ground.

use bittybuzz_hil::{Command, EmulatorEvent, Robot, captured_body};

use super::course::Course;
use super::fresh::{print_count, print_worst};
use crate::flight::{arm, control_times_us, numbers};

/// Times in s of the flight, and of the wait of an armed robot.
const FLIGHT_S: u64 = 300;
const WAIT_S: u64 = 1_000;
/// Time in s after which events of motors are evaluated and dropped: those of a flight are a million.
const SLICE_S: u64 = 10;
/// Largest times in µs from a pulse to the compare registers: of 99.9 % of the samples, and of all.
const USUAL_US: f64 = 700.0;
const MOST_US: f64 = 950.0;

/// Each pulse was answered before the next one, and each sample was read.
fn assert_all_answered(robot: &Robot) {
    let [samples, late, missed, failed, ..] = numbers(robot, "wake-ups")[..] else { panic!() };
    print_count("samples", samples as usize);
    print_count("late pulses", late as usize);
    print_count("pulses unanswered before the next", missed as usize);
    assert_eq!((missed, failed), (0.0, 0.0));
}

#[test]
#[ignore = "`cargo xtask soak image_flights` runs it"]
fn a_flight_of_five_minutes_answers_each_pulse() {
    let course = Course { height_mm: 500, goals_mm: vec![[500.0, 0.0], [-500.0, 300.0]] };
    let mut flight = course.take_off(|robot| robot.execute(&captured_body(20)));
    let mut times: Vec<f64> = Vec::new();
    let mut fastest_us = None;
    for slice in 0..FLIGHT_S / SLICE_S {
        // The battery would be empty before the end.
        if slice == 0 {
            flight.robot.execute(&Command::Battery {
                volts: 3.7,
                charging: false,
                usb_powered: false,
            });
        }
        let from = flight.robot.now();
        let events = flight.robot.run_ms(1_000 * SLICE_S);
        let fastest_us = *fastest_us.get_or_insert_with(|| {
            let [_, fastest_us, ..] = numbers(&flight.robot, "over 700 us")[..] else { panic!() };
            fastest_us
        });
        times.extend(control_times_us(&events, fastest_us));
        assert_eq!(flight.early_end(), None, "after {from:?}");
        flight.robot.events.retain(|event| !matches!(event.event, EmulatorEvent::Motor { .. }));
    }
    flight.robot.run_ms(11_000);
    assert_all_answered(&flight.robot);
    assert!(times.len() > 800 * FLIGHT_S as usize, "{} ticks", times.len());
    times.sort_by(f64::total_cmp);
    let (usual, most) = (times[times.len() * 999 / 1000], times[times.len() - 1]);
    print_count("ticks in flight", times.len());
    print_worst("us to the compare registers, 99.9 %", [(0, Some(usual.ceil()))].into_iter());
    print_worst("us to the compare registers", [(0, Some(most.ceil()))].into_iter());
    assert!(usual <= USUAL_US && most <= MOST_US, "{usual} and {most} us");
}

#[test]
#[ignore = "`cargo xtask soak image_flights` runs it"]
fn an_armed_robot_answers_each_pulse() {
    let script = "function init() { n = 0 }\nfunction step() { n = n + 1 led(n % 8) }\n";
    let mut robot = Robot::crazyflie(bittybuzz_hil::Core::Unicorn, script);
    robot.execute(&captured_body(21));
    robot.run_ms(2_000);
    arm(&mut robot);
    robot.run_ms(1_000 * WAIT_S);
    assert_all_answered(&robot);
}
