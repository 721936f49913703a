//! Faults: contained ones, the pause after other faults, and the restart, on a clock that the tests
//! control.

use crate::common::{Events, Frames, image, run, run_hearing, run_robot};
use bittybuzz_vm_core::builtin::string;
use bittybuzz_vm_core::message::{FULL_FRAME, Message, ScriptIdentity};
use bittybuzz_vm_core::number::Full;
use bittybuzz_vm_core::{Image, Sighting, Value};

fn with<'a>(events: &'a Events, starts: &[&str]) -> Vec<(u64, &'a str)> {
    let texts = events.iter().map(|(ms, text)| (*ms, text.as_str()));
    texts.filter(|(_, text)| starts.iter().any(|start| text.starts_with(start))).collect()
}

/// A script that fails in its second step after each start.
const FRAGILE: &str = "function init() { n = 0 motor(7) log(n) }\n\
    function step() { n = n + 1 if(n == 2) n = nil + 1 }";

#[test]
fn a_script_restarts_after_a_pause_that_doubles() {
    let events = run(FRAGILE, 8000);
    let seen = with(&events, &["fault", "restart", "start again", "log", "Overrun", "Lost"]);
    let expected = [
        (0, "log 0: 0"),
        (200, "fault 1: WrongType in 1 calls"),
        (200, "restart 1: 10"),
        (1200, "start again"),
        (1200, "restart 1: 0"),
        (1200, "log 1: 0"),
        (1400, "fault 2: WrongType in 1 calls"),
        (1400, "restart 2: 20"),
        (3400, "start again"),
        (3400, "restart 2: 0"),
        (3400, "log 2: 0"),
        (3600, "fault 3: WrongType in 1 calls"),
        (3600, "restart 3: 40"),
        (7600, "start again"),
        (7600, "restart 3: 0"),
        (7600, "log 3: 0"),
        (7800, "fault 4: WrongType in 1 calls"),
        (7800, "restart 4: 80"),
    ];
    assert_eq!(seen, expected);
}

#[test]
fn motors_stay_stopped_in_the_pause_and_turn_after_it() {
    let events = run(FRAGILE, 1390);
    let motor = with(&events, &["motor"]);
    let fault = motor.iter().position(|(ms, text)| *ms == 200 && *text == "motor stop").unwrap();
    let start = motor.iter().position(|(ms, _)| *ms >= 1200).unwrap();
    assert!(motor[fault..start].iter().all(|(_, text)| *text == "motor stop"), "{motor:?}");
    assert_eq!(motor[start], (1200, "motor 7"));
    assert!(motor[start..].iter().all(|(_, text)| *text == "motor 7"), "{motor:?}");
}

#[test]
fn a_fault_before_the_first_step_starts_again_too() {
    for script in ["log(1)\nx = nil + 1", "log(1)\nfunction init() { x = nil + 1 }"] {
        let events = run(script, 3500);
        assert_eq!(
            with(&events, &["log"]),
            [(0, "log 0: 1"), (1000, "log 0: 1"), (3000, "log 0: 1")]
        );
    }
}

/// A step that fails later than its tick does not shorten the pause by the ticks that it took.
#[test]
fn ticks_of_the_step_that_failed_are_skipped() {
    let script = "function init() { n = 0 log(1) }\n\
        function step() { while(n < 2500) { work(100) n = n + 1 } n = nil + 1 }";
    let events = run(script, 1500);
    let fault = with(&events, &["fault"])[0].0;
    assert!((350..400).contains(&fault), "{fault}");
    assert_eq!(with(&events, &["log"]), [(0, "log 0: 1"), (1300, "log 0: 1")]);
}

#[test]
fn a_minute_of_steps_makes_the_pause_short_again() {
    let script =
        "function init() { n = 0 }\nfunction step() { n = n + 1 if(n == 603) n = nil + 1 }";
    let events = run(script, 124_000);
    let restarts: Vec<&str> =
        with(&events, &["restart"]).into_iter().map(|(_, text)| text).collect();
    assert_eq!(
        restarts,
        ["restart 602: 10", "restart 602: 0", "restart 1204: 10", "restart 1204: 0"]
    );
}

/// The script restarts without the wait that was under way.
#[test]
fn a_wait_that_was_under_way_is_over() {
    let script = "function init() { log(1) }\n\
        function step() { var i = 0 while(i < 3) { delay(100) i = i + 1 } delay(nil + 1) }";
    let events = run(script, 3100);
    let logs = with(&events, &["log", "fault"]);
    assert_eq!(logs[..2], [(0, "log 0: 1"), (400, "fault 0: WrongType in 1 calls")]);
    assert_eq!(logs[2], (1400, "log 0: 1"));
}

const SOCIAL: &str = "function init() {\n\
    n = 0\n\
    neighbors.listen(\"x\", function(topic, value, robot) { log(value) })\n\
    }\n\
    function step() { n = n + 1 if(n == 2) n = nil + 1 }";

/// Returns broadcasts of robot 9 on a topic of a script.
fn broadcasts(image: &[u8], values: &[(u64, Value<Full>)]) -> Frames {
    let header = Image::new(image).header().unwrap();
    let script = ScriptIdentity { hash: header.hash(), strings: header.strings() + string::COUNT };
    // The topic is the last string of these scripts.
    let topic = script.strings - 1;
    let frame = |value: Value<Full>| {
        let mut frame = [0; FULL_FRAME];
        let message = Message::Broadcast { robot: 9, topic, value };
        let length = message.encode(script, &mut frame).unwrap();
        frame[..length].to_vec()
    };
    let sighting = Sighting { robot: Some(9), place: None };
    values.iter().map(|(ms, value)| (*ms, frame(*value), sighting)).collect()
}

#[test]
fn beacons_go_on_in_the_pause() {
    let events = run(SOCIAL, 7000);
    let beacons: Vec<u64> =
        with(&events, &["send [8, 7, 0, "]).into_iter().map(|(ms, _)| ms).collect();
    for pause in [200..1200, 1400..3400, 3600..7000] {
        assert!(beacons.iter().any(|ms| pause.contains(ms)), "{pause:?}: {beacons:?}");
    }
    // Beacons are one second apart, counted in steps or in ticks of the pause. A start takes an
    // additional tick.
    let gaps: Vec<u64> = beacons.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(gaps.iter().all(|gap| *gap <= 1200), "{beacons:?}");
}

#[test]
fn listeners_are_silent_in_the_pause() {
    let image = image(SOCIAL);
    let values = [(150, 1), (250, 2), (1050, 3), (1250, 4), (1450, 5)];
    let values = values.map(|(ms, value)| (ms, Value::int(value)));
    let events = run_hearing(&image, broadcasts(&image, &values), 3000);
    // The second step processes the message before it fails.
    assert_eq!(with(&events, &["log"]), [(200, "log 1: 1"), (1300, "log 1: 4")]);
    assert_eq!(with(&events, &["fault"]).len(), 2);
}

/// A listener that fails unless it receives a number.
const LISTENER: &str = "n = 0\n\
    function init() { neighbors.listen(\"x\", function(topic, value, robot) { n = n + value }) }\n\
    function step() { log(n) }";

#[test]
fn a_contained_fault_is_reported_once_and_the_script_goes_on() {
    let image = image(LISTENER);
    let values =
        [(150, Value::nil()), (160, Value::int(5)), (250, Value::nil()), (350, Value::nil())];
    let events = run_hearing(&image, broadcasts(&image, &values), 450);
    let seen = with(&events, &["contained", "fault", "restart", "stop", "log", "Unused"]);
    let texts: Vec<&str> = seen.iter().map(|(_, text)| *text).collect();
    let failed: Vec<&&str> = texts.iter().filter(|text| text.starts_with("Unused")).collect();
    assert_eq!(failed.len(), 3, "each is counted: {texts:?}");
    assert!(failed[2].contains("failed: 3"), "{failed:?}");
    let rest: Vec<&str> = texts.into_iter().filter(|text| !text.starts_with("Unused")).collect();
    let expected =
        ["log 0: 0", "contained 1: WrongType in 1 calls", "log 1: 5", "log 2: 5", "log 3: 5"];
    assert_eq!(rest, expected);
}

/// Faults at eight places are reported, and faults at further places are only counted.
#[test]
fn places_of_contained_faults_have_a_limit() {
    let branches: String = (1..=9).map(|n| format!("if(value == {n}) n = nil + {n}\n")).collect();
    let script = format!(
        "function init() {{ neighbors.listen(\"x\", function(topic, value, robot) {{\n{branches}}}) }}\n\
         function step() {{ }}"
    );
    let image = image(&script);
    let values: Vec<(u64, Value<Full>)> = (1..=9)
        .chain(1..=9)
        .zip(0..)
        .map(|(value, n)| (150 + 100 * n, Value::int(value)))
        .collect();
    let events = run_hearing(&image, broadcasts(&image, &values), 2100);
    assert_eq!(with(&events, &["contained"]).len(), 8);
    assert!(with(&events, &["Unused"]).last().unwrap().1.contains("failed: 18"));
}

#[test]
fn a_failed_assert_stops_the_script_for_good() {
    let script = "function step() { motor(5) log(1) assert(1 == 2) }";
    let events = run(script, 3000);
    assert_eq!(with(&events, &["log", "restart"]), [(100, "log 0: 1")]);
    assert_eq!(with(&events, &["stop", "fault"]).len(), 2);
    assert_eq!(with(&events, &["motor"]).last().unwrap().1, "motor stop");
}

#[test]
fn a_failed_assert_in_a_listener_stops_the_script_for_good() {
    let image = image(
        "function init() { neighbors.listen(\"x\", function(topic, value, robot) { assert(value) }) }\n\
         function step() { log(1) }",
    );
    let events = run_hearing(&image, broadcasts(&image, &[(150, Value::nil())]), 3000);
    assert_eq!(with(&events, &["log", "restart", "contained"]), [(100, "log 0: 1")]);
    assert_eq!(with(&events, &["stop"]), [(200, "stop Fault(11)")]);
}

#[test]
fn every_fault_stops_a_robot_whose_file_says_so() {
    let fragile = image(FRAGILE);
    let events = run_robot::<true>(&fragile, Vec::new(), 3000);
    let seen = with(&events, &["log", "fault", "restart", "stop", "start again"]);
    let expected =
        [(0, "log 0: 0"), (200, "stop Fault(1)"), (200, "fault 1: WrongType in 1 calls")];
    assert_eq!(seen, expected);

    let listener = image(LISTENER);
    let frames = broadcasts(&listener, &[(150, Value::nil())]);
    let events = run_robot::<true>(&listener, frames, 3000);
    let seen = with(&events, &["log", "fault", "restart", "stop", "contained"]);
    let expected =
        [(100, "log 0: 0"), (200, "stop Fault(1)"), (200, "fault 1: WrongType in 1 calls")];
    assert_eq!(seen, expected);
}

/// The log lines of the step that fails, the fault, the pause and the start are reported in order.
#[test]
fn no_record_is_lost_around_a_restart() {
    let script = "k = 0\nwhile(k < 30) { log(\"global\", k) k = k + 1 }\n\
        function step() { var i = 0 while(i < 30) { log(\"step\", i) i = i + 1 } i = nil + 1 }";
    let events = run(script, 1400);
    assert_eq!(with(&events, &["Lost"]), []);
    let kinds: Vec<&str> = with(&events, &["log", "fault", "restart"])
        .into_iter()
        .map(|(_, text)| text.split(' ').next().unwrap())
        .collect();
    let mut expected = vec!["log"; 60];
    expected.extend(["fault", "restart", "restart"]);
    expected.extend(["log"; 60]);
    expected.extend(["fault", "restart"]);
    assert_eq!(kinds, expected);
}
