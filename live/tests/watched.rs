//! Tests of robots that report from outside the simulator.

use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

use bittybuzz_arena::output::recording::{RecordingReader, RobotStatus};
use bittybuzz_fault::{FaultDescription, FaultPlace};
use bittybuzz_live::{ReportContent, RobotReport, Source, Watched};
use serde_json::{Value, json};

use crate::taken;

fn start() -> (Sender<RobotReport>, Watched) {
    let (sender, reports) = channel();
    (sender, Watched::new(reports, "kilobot", "blink.bzz"))
}

fn report(robot: u16, seconds: f64, content: ReportContent) -> RobotReport {
    RobotReport { seconds: Some(seconds), robot, content }
}

fn events(watched: &mut Watched) -> Vec<Value> {
    while watched.advance(Duration::ZERO, &mut || true) {}
    taken(watched)
}

fn fault(is_contained: bool) -> ReportContent {
    let places = vec![Some(FaultPlace {
        file: "blink.bzz".to_owned(),
        line: 3,
        column: 5,
        end_line: 3,
        end_column: 10,
        function: Some("step".to_owned()),
        text: None,
        script: None,
    })];
    let description = FaultDescription {
        code: "R0001".to_owned(),
        message: "cannot add nil and an integer".to_owned(),
        help: None,
        notes: Vec::new(),
        values: Vec::new(),
        places,
        left_out: 0,
    };
    ReportContent::Fault { is_contained, description }
}

/// Returns the states of all robots in a sample that starts a new recording.
fn states(watched: &mut Watched) -> Vec<RobotStatus> {
    watched.begin();
    let bytes = watched.take_sample();
    let mut reader = RecordingReader::new(&bytes).unwrap();
    let sample = reader.next().unwrap().unwrap();
    sample.robots.iter().map(|robot| robot.unwrap().state).collect()
}

#[test]
fn a_robot_is_added_with_its_first_report() {
    let (sender, mut watched) = start();
    assert_eq!(events(&mut watched)[0]["groups"], json!([]));
    sender.send(report(7, 1.25, ReportContent::Began("it begins".to_owned()))).unwrap();
    sender.send(report(9, 1.5, ReportContent::Line("n is 5".to_owned()))).unwrap();
    let got = events(&mut watched);
    let kinds: Vec<&str> = got.iter().map(|event| event["event"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["begin", "logs", "state", "logs"]);
    let ids: Vec<&Value> =
        got[0]["groups"].as_array().unwrap().iter().map(|group| &group["first_id"]).collect();
    assert_eq!(ids, [&json!(7), &json!(9)]);
    assert_eq!(got[3]["lines"], json!([{ "robot": 1, "tick": 15, "text": "n is 5" }]));
}

#[test]
fn a_fault_stops_a_script_until_it_begins_again() {
    let (sender, mut watched) = start();
    sender.send(report(7, 1.0, fault(true))).unwrap();
    events(&mut watched);
    assert_eq!(states(&mut watched), [RobotStatus::Running]);
    let before = watched.tick();
    sender.send(report(7, 1.0, fault(false))).unwrap();
    let got = events(&mut watched);
    let got = got.iter().find(|event| event["event"] == "fault" && event["consequence"] == "stop");
    assert_eq!(got.unwrap()["places"][0]["line"], 3);
    assert!(watched.tick() > before, "another sample is due");
    assert_eq!(states(&mut watched), [RobotStatus::Faulted]);
    sender.send(report(7, 3.0, ReportContent::Began("again".to_owned()))).unwrap();
    events(&mut watched);
    assert_eq!(states(&mut watched), [RobotStatus::Running]);
}

#[test]
fn a_client_that_connects_later_receives_the_last_events() {
    let (sender, mut watched) = start();
    for number in 0..1500 {
        sender.send(report(7, 1.0, ReportContent::Line(number.to_string()))).unwrap();
    }
    events(&mut watched);
    watched.begin();
    let got = taken(&mut watched);
    let logs: Vec<&Value> = got.iter().filter(|event| event["event"] == "logs").collect();
    let [logs] = &logs[..] else { panic!("{logs:?}") };
    let lines = logs["lines"].as_array().unwrap();
    assert_eq!((lines.len(), &lines[0]["text"]), (500, &json!("1000")));
    assert_eq!(lines[499]["text"], "1499");
}

#[test]
fn requests_are_refused_and_the_end_is_an_event() {
    let (sender, mut watched) = start();
    for seconds in [f64::NAN, f64::INFINITY, -1.0, 1e300] {
        sender.send(report(u16::MAX, seconds, ReportContent::Line(String::new()))).unwrap();
    }
    watched.request("{\"play\":{}}", Duration::ZERO);
    assert!(events(&mut watched).iter().any(|event| event["event"] == "logs"));
    drop(sender);
    let got = events(&mut watched);
    assert_eq!((&got[0]["event"], &got[0]["over"]), (&json!("state"), &json!(true)));
    assert!(events(&mut watched).is_empty());
}
