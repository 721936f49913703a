//! Tests of curves: the past of quantities.

use std::time::Duration;

use bittybuzz_arena::run::Session;
use bittybuzz_live::{Live, SharedFiles, Shelf, Source};
use serde_json::{Value, json};

use crate::{go_to, taken};

/// Robots drive and count; robot 0 counts twice as fast.
const SCRIPT: &str = "n = 0\nfunction step() {\n  n = n + 1\n  if(id == 0) { n = n + 1 }\n  forward()\n  neighbors.broadcast(\"n\", n)\n}\n";

const SCENARIO: &str = "[world]\nsize = [800, 800]\nduration = 30\nseed = 5\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"n.bzz\"\ncount = 4\nplacement = \"grid\"\nspacing = 60\n";

fn start_of(scenario: &str, copies: usize) -> Live {
    let files = SharedFiles::default();
    files.add("x/s.toml", scenario);
    files.add("x/n.bzz", SCRIPT);
    let shelf = Shelf::new(files, "x/s.toml".into());
    let (run, text) = shelf.open(1).unwrap();
    Live::new(Session::new(run, copies), text).with_workshop(shelf)
}

fn start() -> Live {
    start_of(SCENARIO, 5)
}

fn ask(live: &mut Live, request: Value) {
    live.request(&request.to_string(), Duration::ZERO);
}

fn subscribe(live: &mut Live, quantities: &[&str], robots: &[usize]) {
    ask(live, json!({ "series": { "quantities": quantities, "robots": robots } }));
}

/// The points of a curve that a client has: tick, five numbers, values of robots.
type Points = std::collections::BTreeMap<u64, (Value, Value)>;

/// Computes what is missing, and applies the events to the points of one curve.
fn settle(live: &mut Live, name: &str, points: &mut Points) {
    while live.advance(Duration::ZERO, &mut || true) {}
    take(live, name, points);
}

fn take(live: &mut Live, name: &str, points: &mut Points) {
    for event in taken(live) {
        match event["event"].as_str().unwrap() {
            "series_cut" => points.retain(|tick, _| *tick <= event["tick"].as_u64().unwrap()),
            "series" if event["name"] == name => {
                for (index, tick) in event["ticks"].as_array().unwrap().iter().enumerate() {
                    let point = points.entry(tick.as_u64().unwrap()).or_default();
                    if let Some(five) = event["five"].get(index) {
                        point.0 = five.clone();
                    }
                    point.1 = event["own"].get(index).cloned().unwrap_or(Value::Null);
                }
            }
            _ => {}
        }
    }
}

/// Returns the whole curve of a run that the client watches from the start, up to a tick.
fn expected(commands: &[(u64, &str)], name: &str, robots: &[usize], to: u64) -> Points {
    let (mut live, mut points) = (start(), Points::new());
    subscribe(&mut live, &[name], robots);
    for (tick, command) in commands {
        go_to(&mut live, *tick);
        ask(&mut live, json!({ "command": { "text": command } }));
    }
    go_to(&mut live, to);
    settle(&mut live, name, &mut points);
    assert_eq!(points.len() as u64, to + 1);
    points
}

#[test]
fn a_curve_that_is_asked_for_late_has_its_past() {
    let aggregate = "share(global.n >= 3 where running)";
    for name in ["x", "global.n", "swarm.spread", aggregate, "mean_square(displacement)"] {
        let (mut live, mut points) = (start(), Points::new());
        go_to(&mut live, 200);
        subscribe(&mut live, &["led", name], &[2, 0]);
        settle(&mut live, name, &mut points);
        assert_eq!(points, expected(&[], name, &[2, 0], 200), "{name}");
        // The session has not moved.
        assert_eq!(live.session().run().now(), 200);
    }
}

#[test]
fn a_curve_has_the_quartiles_and_the_values_of_single_robots() {
    let mut points = expected(&[], "global.n", &[0, 3], 10);
    let (five, own) = points.remove(&10).unwrap();
    // Robots 1 to 3 have completed as many steps, and robot 0 has counted twice as far.
    let own: Vec<f64> = serde_json::from_value(own).unwrap();
    assert!(own[1] > 0.0);
    assert_eq!(own[0], 2.0 * own[1]);
    assert_eq!(five, json!([own[1], own[1], own[1], 1.25 * own[1], own[0]]));
}

#[test]
fn jumps_in_time_leave_no_gap() {
    let (mut live, mut points) = (start(), Points::new());
    subscribe(&mut live, &["x"], &[]);
    for tick in [150, 20, 260, 100] {
        go_to(&mut live, tick);
        take(&mut live, "x", &mut points);
    }
    settle(&mut live, "x", &mut points);
    assert_eq!(points, expected(&[], "x", &[], 260));
}

#[test]
fn another_robot_gets_its_own_curve_from_the_beginning() {
    let (mut live, mut points) = (start(), Points::new());
    go_to(&mut live, 100);
    subscribe(&mut live, &["x"], &[]);
    settle(&mut live, "x", &mut points);
    subscribe(&mut live, &["x"], &[3]);
    let events = taken(&mut live);
    let event = events.iter().find(|event| event["event"] == "series").unwrap();
    // The client has the other numbers.
    assert_eq!((&event["five"], event["own"].as_array().unwrap().len()), (&json!([]), 101));
    let expected = expected(&[], "x", &[3], 100);
    for (index, (_, own)) in expected.values().enumerate() {
        assert_eq!(&event["own"][index], own);
    }
}

#[test]
fn a_command_in_the_past_changes_the_curve_after_it() {
    let (mut live, mut points) = (start(), Points::new());
    subscribe(&mut live, &["x"], &[0]);
    go_to(&mut live, 120);
    settle(&mut live, "x", &mut points);
    go_to(&mut live, 50);
    ask(&mut live, json!({ "command": { "text": "move = 0\nto = [300, 300]" } }));
    settle(&mut live, "x", &mut points);
    assert_eq!(points.keys().last(), Some(&50));
    go_to(&mut live, 90);
    settle(&mut live, "x", &mut points);
    let expected = expected(&[(50, "move = 0\nto = [300, 300]")], "x", &[0], 90);
    assert_eq!(points, expected);
}

#[test]
fn a_run_with_the_same_texts_keeps_its_curves() {
    let (mut live, mut points) = (start(), Points::new());
    go_to(&mut live, 60);
    ask(&mut live, json!({ "command": { "text": "fail = 1" } }));
    go_to(&mut live, 120);
    let subscribed = |live: &mut Live, points: &mut Points| {
        points.clear();
        subscribe(live, &["x"], &[]);
        settle(live, "x", points);
        points.len()
    };
    assert_eq!(subscribed(&mut live, &mut points), 121);
    // The command is gone, and with it what came after it.
    ask(&mut live, json!({ "run": { "texts": { "n.bzz": SCRIPT } } }));
    assert_eq!(subscribed(&mut live, &mut points), 61);
    assert_eq!(points, expected(&[], "x", &[], 60));
    let other = SCRIPT.replace("forward()", "left()");
    ask(&mut live, json!({ "run": { "texts": { "n.bzz": other } } }));
    assert_eq!(subscribed(&mut live, &mut points), 1);
    // Another page gets all points again.
    go_to(&mut live, 30);
    settle(&mut live, "x", &mut points);
    live.begin();
    assert_eq!(subscribed(&mut live, &mut points), 31);
}

#[test]
fn a_long_run_has_two_thousand_points() {
    let (mut live, mut points) = (start_of(&SCENARIO.replace("= 30", "= 1000"), 5), Points::new());
    go_to(&mut live, 10_000);
    subscribe(&mut live, &["x"], &[]);
    settle(&mut live, "x", &mut points);
    assert_eq!((points.len(), points.keys().nth(1)), (1667, Some(&6)));
}

#[test]
fn the_computation_of_the_past_can_be_stopped() {
    let (mut live, mut points) = (start(), Points::new());
    go_to(&mut live, 250);
    subscribe(&mut live, &["x"], &[]);
    let mut turns = 0..20;
    live.advance(Duration::ZERO, &mut || turns.next().is_some());
    let percent = |events: &[Value]| {
        let found = events.iter().rfind(|event| event["event"] == "series_progress");
        found.map(|event| event["percent"].as_u64().unwrap())
    };
    assert!(percent(&taken(&mut live)).is_some_and(|percent| (1..20).contains(&percent)));
    ask(&mut live, json!("stop_series"));
    assert!(!live.advance(Duration::ZERO, &mut || true));
    assert_eq!(percent(&taken(&mut live)), None);
    // The client may want it after all.
    subscribe(&mut live, &["x"], &[]);
    while live.advance(Duration::ZERO, &mut || true) {}
    assert_eq!(percent(&taken(&mut live)), Some(100));
    subscribe(&mut live, &["x", "y"], &[]);
    settle(&mut live, "y", &mut points);
    assert_eq!(points, expected(&[], "y", &[], 250));
}

#[test]
fn the_session_plays_on_next_to_the_computation() {
    let (mut live, mut points) = (start(), Points::new());
    go_to(&mut live, 100);
    subscribe(&mut live, &["x"], &[]);
    ask(&mut live, json!({ "play": {} }));
    let mut turns = 0;
    // There is time for a tick of the session, and always for one of the copy.
    let once = || {
        let mut times = 0..1;
        move || times.next().is_some()
    };
    while live.advance(Duration::ZERO, &mut once()) {
        take(&mut live, "x", &mut points);
        turns += 1;
        assert!(turns < 5_000);
    }
    while live.advance(Duration::ZERO, &mut || true) {}
    settle(&mut live, "x", &mut points);
    let last = live.session().run().now();
    assert_eq!(points, expected(&[], "x", &[], last));
}

#[test]
fn invalid_curves_are_refused() {
    let mut live = start();
    let many: Vec<String> = (0..13).map(|number| format!("distance({number}, 0)")).collect();
    for (quantities, robots, reason) in [
        (json!(["led", "height"]), json!([]), "there is no quantity `height`"),
        (json!(["global.none"]), json!([]), "no script has a global `none`"),
        (json!(["led"]), json!([4]), "there is no robot with the number 4"),
        (json!(many), json!([]), "more than 12 curves"),
    ] {
        taken(&mut live);
        ask(&mut live, json!({ "series": { "quantities": quantities, "robots": robots } }));
        let events = taken(&mut live);
        let text = events.iter().find_map(|event| event["text"].as_str()).unwrap();
        assert!(text.contains(reason), "{text}");
    }
}

#[test]
fn a_session_that_began_later_says_that_the_past_is_unknown() {
    let files = SharedFiles::default();
    files.add("x/s.toml", SCENARIO);
    files.add("x/n.bzz", SCRIPT);
    let shelf = Shelf::new(files, "x/s.toml".into());
    let (mut run, text) = shelf.open(1).unwrap();
    (0..20).for_each(|_| run.tick().unwrap());
    let mut live = Live::new(Session::new(run, 5), text);
    subscribe(&mut live, &["x"], &[]);
    while live.advance(Duration::ZERO, &mut || true) {}
    let events = taken(&mut live);
    let event = events.iter().rfind(|event| event["event"] == "series_progress").unwrap();
    assert_eq!(event["problem"], "the session began at tick 20");
}

#[test]
fn expectations_have_the_range_that_they_want() {
    let expects = [
        ("at = 2\nvalue = \"x\"\nequals = 4\ntolerance = 1", json!(["x", 2.0, 2.0, 3.0, 5.0])),
        ("within = 9\nvalue = \"led\"\nbelow = 3", json!(["led", 0.0, 9.0, null, 3.0])),
        (
            "always = [1, 5]\nof = \"mean\"\nvalue = \"led\"\nabove = 3",
            json!(["led", 1.0, 5.0, 3.0, null]),
        ),
        (
            "always = 4\nvalue = \"swarm.spread\"\nbetween = [1, 2]",
            json!(["swarm.spread", 4.0, 30.0, 1.0, 2.0]),
        ),
        // A sum lies elsewhere, and these robots must not be in the range.
        ("at = 2\nof = \"sum\"\nvalue = \"led\"\nbelow = 3", Value::Null),
        ("at = 2\nof = \"none\"\nvalue = \"led\"\nequals = 3", Value::Null),
        ("at = 2\nvalue = \"led\"\ndiffers = 3", Value::Null),
    ];
    let text: String = expects.iter().map(|(text, _)| format!("\n[[expect]]\n{text}\n")).collect();
    let mut live = start_of(&format!("{SCENARIO}{text}"), 5);
    let begin = &taken(&mut live)[0];
    for (number, (text, expected)) in expects.iter().enumerate() {
        let band = &begin["expectations"][number]["band"];
        let keys = ["quantity", "from", "to", "low", "high"].map(|key| band[key].clone());
        let found = if band.is_null() { Value::Null } else { json!(keys) };
        assert_eq!(&found, expected, "{text}");
    }
}
