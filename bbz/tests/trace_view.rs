//! `bbz trace --view`: a page gets the log lines of a robot, and its faults with their lines.

#![cfg(feature = "view")]

use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;

use serde_json::Value;

use crate::support::client::Client;
use crate::support::{Folder, robot};

/// A script whose second step divides by zero.
const SCRIPT: &str = "n = 0\nfunction step() {\n  n = n + 1\n  log(\"n is \", n)\n  if(n == 2) half(n)\n}\n\
    function half(x) {\n  return x / (x - 2)\n}\n";

#[test]
fn a_page_gets_lines_and_faults() {
    let folder = Folder::with("trace_view", "s.bzz", SCRIPT);
    let built = folder.bbz(&["build", "s.bzz", "--robot", "crazyflie"]);
    assert_eq!(built.status, Some(0), "{}", built.stderr);
    let lines = robot::lines(&robot::records(&folder.read("s.bbi"), 5));
    let arguments =
        ["trace", "-", "--robot", "crazyflie", "--script", "s.bzz", "--view", "--no-browser"];
    let mut child = folder.command(&arguments).stdin(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let mut url = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut url).unwrap();
    let mut client = Client::connect(url.trim());
    // The page is open before the robot reports.
    stdin.write_all(lines.as_bytes()).unwrap();
    drop(stdin);
    let mut events = Vec::new();
    while events.last().is_none_or(|event: &Value| event["over"] != true) {
        events.push(client.next());
    }
    let robots = events.iter().rfind(|event| event["event"] == "begin").unwrap();
    assert_eq!(
        (&robots["groups"][0]["robot"], &robots["watched"]),
        (&"crazyflie".into(), &true.into())
    );
    let logged: Vec<&str> = events
        .iter()
        .filter(|event| event["event"] == "logs")
        .flat_map(|event| event["lines"].as_array().unwrap())
        .map(|line| line["text"].as_str().unwrap())
        .collect();
    assert_eq!((logged.len(), &logged[1..]), (3, &["n is 1", "n is 2"][..]));
    assert!(logged[0].ends_with("(`s.bzz`)"), "{}", logged[0]);
    let fault = events.iter().find(|event| event["event"] == "fault").unwrap();
    assert_eq!((&fault["code"], &fault["consequence"]), (&"R0005".into(), &"stop".into()));
    let places = fault["places"].as_array().unwrap().iter();
    let places: Vec<(u64, &str)> = places
        .map(|place| (place["line"].as_u64().unwrap(), place["function"].as_str().unwrap()))
        .collect();
    assert_eq!(places, [(8, "half"), (5, "step")]);
    // The command ends when its page is closed, with the status of the trace.
    drop(client);
    assert_eq!(child.wait().unwrap().code(), Some(1));
}
