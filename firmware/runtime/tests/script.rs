//! The script's task together with the motors' task, on a clock that the tests control.

use crate::common;
use crate::common::{Events, run, run_hearing, run_image};
use bittybuzz_vm_core::{Sighting, Value};

fn with<'a>(events: &'a Events, what: &str) -> Vec<(u64, &'a str)> {
    let wanted = events.iter().filter(|(_, text)| text.starts_with(what));
    wanted.map(|(ms, text)| (*ms, text.as_str())).collect()
}

#[test]
fn steps_come_ten_times_a_second() {
    let events = run(
        "log(0)\nfunction init() { log(1) n = 0 }\nfunction step() { n = n + 1 log(2, n) }",
        450,
    );
    let expected = [
        (0, "log 0: 0"),
        (0, "log 0: 1"),
        (100, "log 0: 2 1"),
        (200, "log 1: 2 2"),
        (300, "log 2: 2 3"),
        (400, "log 3: 2 4"),
    ];
    assert_eq!(with(&events, "log"), expected);
}

#[test]
fn motors_turn_while_steps_complete() {
    let events = run("function init() { motor(40) }\nfunction step() { }", 2000);
    let motor = with(&events, "motor");
    assert_eq!(motor[..2], [(0, "motor stop"), (0, "motor 40")]);
    assert!(motor[2..].iter().all(|(_, text)| *text == "motor 40"), "{motor:?}");
    assert!(motor.last().unwrap().0 >= 1900);
}

/// A step never ends: half a second after the last completed step the motors stop, and the trace
/// reports it.
#[test]
fn a_step_without_end_stops_the_motors() {
    let script = "function init() { n = 0 }\nfunction step() { n = n + 1 motor(n) if(n == 4) while(1) work(100) }";
    let events = run(script, 3000);
    // The steps at 100, 200 and 300 are completed; that of 400 is not.
    let motor = with(&events, "motor");
    let last = motor.last().unwrap();
    assert_eq!(last.1, "motor stop");
    assert!((800..=802).contains(&last.0), "{motor:?}");
    assert_eq!(with(&events, "Expired").len(), 1);
    let overruns = with(&events, "Overrun");
    assert!((500..=502).contains(&overruns[0].0), "{overruns:?}");
    assert!((3..=4).contains(&overruns.len()), "{overruns:?}");
}

/// No tick is missed even if the wait ends with a tick.
#[test]
fn a_wait_that_ends_with_a_tick_misses_none() {
    for ms in [99, 100, 101, 300] {
        let events = run(&format!("function step() {{ delay({ms}) log(1) }}"), 2000);
        assert!(with(&events, "Overrun").is_empty(), "delay({ms}): {events:?}");
    }
}

#[test]
fn waiting_on_purpose_counts_as_a_step() {
    let events = run("function step() { motor(9) delay(1250) log(1) }", 3000);
    assert_eq!(with(&events, "log"), [(1350, "log 0: 1"), (2650, "log 1: 1")]);
    assert!(with(&events, "Overrun").is_empty() && with(&events, "Expired").is_empty());
    assert_eq!(with(&events, "motor stop"), [(0, "motor stop")]);
}

#[test]
fn missed_ticks_are_skipped_not_queued() {
    // The step of 100 works for 250 ms and ends at 350; the next one begins at 400.
    let events = run("function step() { work(125000) work(125000) log(1) }", 1000);
    assert_eq!(with(&events, "log"), [(350, "log 0: 1"), (650, "log 1: 1"), (950, "log 2: 1")]);
}

#[test]
fn a_fault_stops_the_motors_before_it_is_reported() {
    let script = "function bad() { return 1 + nil }\nfunction init() { n = 0 }\n\
        function step() { motor(5) n = n + 1 if(n == 3) bad() }";
    let events = run(script, 1000);
    let from = events.iter().position(|(_, text)| text.starts_with("stop")).unwrap();
    assert_eq!(events[from], (300, "stop Fault(1)".to_owned()));
    assert_eq!(events[from + 1], (300, "fault 2: WrongType in 2 calls".to_owned()));
    assert_eq!(events[from + 2], (300, "restart 2: 10".to_owned()));
    assert_eq!(events[from + 3], (300, "motor stop".to_owned()));
    // This script uses no messages, so the robot rests until the restart.
    assert!(events[from + 4..].iter().all(|(_, text)| text == "begin step"), "{events:?}");
}

/// An expired set-point is cleared: a step that is completed much later does not restart the
/// motors.
#[test]
fn an_expired_setpoint_does_not_come_back() {
    let script = "function init() { n = 0 motor(5) }\nfunction step() { n = n + 1 if(n == 2) {\n\
        var i = 0 while(i < 9000) { work(100) i = i + 1 } } }";
    let events = run(script, 3000);
    assert_eq!(with(&events, "Expired").len(), 1);
    let motor = with(&events, "motor");
    assert_eq!(motor.last().unwrap().1, "motor stop");
    assert!((600..=612).contains(&motor.last().unwrap().0), "{motor:?}");
}

#[test]
fn a_script_without_steps_ends() {
    let events = run("function init() { motor(5) log(1) }", 2000);
    assert_eq!(with(&events, "stop Ended").len(), 1);
    let motor = with(&events, "motor");
    assert_eq!(motor[..3], [(0, "motor stop"), (0, "motor 5"), (500, "motor stop")]);
    assert!(motor[3..].iter().all(|(_, text)| *text == "motor stop"), "{motor:?}");
}

/// A script that prints without end becomes slower, and no line is lost.
#[test]
fn long_output_is_sent_in_portions() {
    let events = run("function step() { var i = 0 while(i < 200) { log(i) i = i + 1 } }", 190);
    let logs = with(&events, "log");
    assert_eq!(logs.len(), 200);
    assert!(logs.iter().enumerate().all(|(n, (_, text))| *text == format!("log 0: {n}")));
    assert!((110..190).contains(&logs[199].0), "{:?}", logs[199]);
    assert_eq!(with(&events, "Lost"), []);
}

/// Long texts are printed without pause, and those that do not fit are counted.
#[test]
fn lines_printed_too_fast_are_counted() {
    let script = format!(
        "function init() {{ s = string.concat(\"{}\", \"b\") }}\nfunction step() {{ {} }}",
        "a".repeat(80),
        "log(s) ".repeat(30)
    );
    let events = run(&script, 150);
    let told = with(&events, "log").len();
    assert!((8..30).contains(&told), "{told}");
    assert_eq!(with(&events, "Lost"), [(100, format!("Lost({})", 30 - told).as_str())]);
}

#[test]
fn a_damaged_image_is_refused_and_reported() {
    let mut image = common::image("function step() { motor(1) }");
    image[0] ^= 1;
    let events = run_image(&image, 500);
    assert_eq!(with(&events, "Refused"), [(0, "Refused(NotAnImage)")]);
    assert_eq!(with(&events, "stop"), [(0, "stop Refused")]);
    assert!(with(&events, "motor").iter().all(|(_, text)| *text == "motor stop"));
}

/// The messages of a step are sent in that step, and the robot knows the step.
#[test]
fn messages_go_out_with_their_step() {
    let script = "function init() { n = 0 }\nfunction step() { n = n + 1 if(n < 3) neighbors.broadcast(\"topic\", n) }";
    let events = run(script, 350);
    let radio: Vec<(u64, bool)> = events
        .iter()
        .filter(|(_, text)| text == "begin step" || text.starts_with("send [5, 7, 0, "))
        .map(|(ms, text)| (*ms, text == "begin step"))
        .collect();
    assert_eq!(radio, [(100, true), (100, false), (200, true), (200, false), (300, true)]);
}

/// A beacon of robot 9 (type 8, robot, script hash), received between two steps.
#[test]
fn a_received_frame_is_processed_in_the_next_step() {
    let script =
        "function step() { neighbors.foreach(function(id, data) { log(id, data.distance) }) }";
    let image = common::image(script);
    // The script's hash follows magic, form and features.
    let beacon = [&[8, 9, 0][..], &image[3..7]].concat();
    let place = Some([1500.5, 0.0, 0.0].map(Value::float));
    let radio = vec![(150, beacon, Sighting { robot: Some(9), place })];
    let logs = run_hearing(&image, radio, 350);
    assert_eq!(
        with(&logs, "log"),
        [(200, "log 1: 9 Float(1500.5)"), (300, "log 2: 9 Float(1500.5)")]
    );
}
