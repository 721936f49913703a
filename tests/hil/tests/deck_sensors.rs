//! The sensors of a Crazyflie's decks: distances and optical flow, through the functions of a script and the log.

use bittybuzz_emulation::message::ResetCause;
use bittybuzz_hil::{Command, Core, Deck, EmulatorEvent, Robot, TraceLog, resets};

/// Logs the six distances.
const RANGES: &str = "\
function step() { log(get_z(), get_front(), get_back(), get_left(), get_right(), get_up()) }
";
/// The range finders run from here on: each takes 0.1 s to start. A script that asks before has a fault, and starts again
/// after a second.
const STARTED_MS: u64 = 6_000;

/// Returns a robot with these decks.
fn robot(script: &str, decks: Vec<Deck>) -> Robot {
    let mut robot = Robot::crazyflie(Core::Unicorn, script);
    robot.execute(&Command::Decks { decks });
    robot
}

fn log(robot: &Robot) -> TraceLog {
    TraceLog::of_events(&robot.events)
}

/// Returns the last values that the script logged.
fn last_logged(robot: &Robot) -> Vec<String> {
    log(robot).log.pop().expect("a line").1
}

/// Neither a reset nor a mistake that the chip would not forgive.
fn assert_healthy(robot: &Robot) {
    assert_eq!(resets(&robot.events), []);
    let errors = robot.events.iter();
    let errors = errors.filter(|event| matches!(event.event, EmulatorEvent::HardwareError { .. }));
    assert_eq!(errors.collect::<Vec<_>>(), Vec::<&_>::new());
}

#[test]
fn a_multi_ranger_and_a_z_ranger_measure_in_six_directions() {
    let mut robot = robot(RANGES, vec![Deck::MultiRanger, Deck::ZRangerV2]);
    robot.execute(&Command::Ranges {
        down_mm: Some(100),
        front_mm: Some(1_000),
        back_mm: Some(2_000),
        left_mm: Some(300),
        right_mm: Some(3_500),
        up_mm: None,
    });
    robot.run_ms(STARTED_MS);
    assert_eq!(last_logged(&robot), ["100", "1000", "2000", "300", "3500", "32767"]);
    // A measurement of 33 ms begins after the change at the latest, and the script reads its result in the next step.
    robot.execute(&Command::Ranges {
        down_mm: Some(15),
        front_mm: None,
        back_mm: None,
        left_mm: None,
        right_mm: None,
        up_mm: Some(700),
    });
    robot.run_ms(200);
    assert_eq!(last_logged(&robot), ["15", "32767", "32767", "32767", "32767", "700"]);
    let lines = log(&robot).firmware;
    assert!(lines.iter().any(|line| line == "range finders run"), "{lines:?}");
    assert_healthy(&robot);
}

/// The range finder that looks down keeps its address when only the robot restarts.
#[test]
fn range_finders_start_again_after_a_reset_of_the_robot() {
    let mut robot = robot(RANGES, vec![Deck::FlowV2, Deck::MultiRanger]);
    robot.run_ms(STARTED_MS);
    robot.execute(&Command::Reset { cause: ResetCause::Pin });
    robot.run_ms(STARTED_MS);
    let lines = log(&robot).firmware;
    let runs = lines.iter().filter(|line| *line == "range finders run");
    assert_eq!(runs.count(), 2, "{lines:?}");
    assert_eq!(last_logged(&robot)[0], "15");
}

/// A deck is on the port, but its chips do not answer.
#[test]
fn missing_chips_are_named_and_keep_the_robot_from_arming() {
    let memory = |digits: &str| {
        let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).expect("hexadecimal");
        Deck::Memory((0..digits.len()).step_by(2).map(byte).collect())
    };
    for (digits, reasons) in [
        (
            "eb00000000bc0e20000f010a62635a52616e676572320201418c",
            &["range finder Down does not answer: NoAcknowledge"][..],
        ),
        (
            "eb00000000bc0c0c0012010d62634d756c746972616e67657202014387",
            &["the expander of the Multi-ranger does not answer: NoAcknowledge"],
        ),
        (
            "eb00000000bc0fb6000c01076263466c6f773202014378",
            &[
                "range finder Down does not answer: NoAcknowledge",
                "the flow sensor is another chip, with id 0x0",
            ],
        ),
    ] {
        let mut robot = robot("function step() { }", vec![memory(digits)]);
        robot.run_ms(5_000);
        let lines = log(&robot).firmware;
        for reason in reasons {
            assert_eq!(lines.iter().filter(|line| line == reason).count(), 1, "{lines:?}");
        }
        let arming = format!("the robot does not arm: {}", reasons[0]);
        assert!(lines.contains(&arming), "{lines:?}");
        assert_healthy(&robot);
    }
}

/// A robot without range finders refuses the functions as it refuses those that it does not have.
#[test]
fn a_robot_without_decks_has_no_distances() {
    let mut robot = robot("function step() { get_front() }", vec![]);
    robot.run_ms(1_000);
    let records = log(&robot).records;
    // The detail is the number of `Refusal::NotBuiltIn`.
    let refusal = "RobotRefused";
    let is_refusal = |record: &String| record.contains(refusal) && record.contains("detail: 3");
    assert!(records.iter().any(is_refusal), "{records:?}");
}

#[test]
fn the_flow_sensor_starts_and_measures() {
    let mut robot = robot("function step() { }", vec![Deck::FlowV2]);
    robot.run_ms(STARTED_MS);
    robot.run_ms(4_000);
    let lines = log(&robot).firmware;
    assert_eq!(lines.iter().filter(|line| *line == "the flow sensor runs").count(), 1, "{lines:?}");
    assert!(lines.iter().any(|line| line.starts_with("flow of ")), "{lines:?}");
    assert!(!lines.iter().any(|line| line.starts_with("the robot does not arm")), "{lines:?}");
    assert_healthy(&robot);
}
