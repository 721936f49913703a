//! Line by line: statements of a robot's script while the world waits, and breakpoints.

use std::time::Duration;

use bittybuzz_live::{Live, Source};
use serde_json::{Value, json};

use crate::{go_to, session, taken};

/// In each step, robot 3 calls `double` once more than robot 2, and logs.
const SCRIPT: &str = "\
n = 0
sum = 0
function double(x) {
  var twice = x + x
  return twice
}
function step() {
  n = n + 1
  for(i = 2, i <= id, i = i + 1) {
    sum = sum + double(n)
  }
  log(sum)
}
";

const SCENARIO: &str = "[world]\nsize = [800, 600]\nduration = 3\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\ncount = 2\nfirst_id = 2\n";

fn start_with(script: &str) -> Live {
    let mut live = session(SCENARIO, ("walk.bzz", script));
    live.take_events();
    live
}

/// A session at the tick before the first step.
fn start() -> Live {
    let mut live = start_with(SCRIPT);
    go_to(&mut live, 1);
    live.take_events();
    live
}

fn ask(live: &mut Live, request: Value) -> Vec<Value> {
    live.request(&request.to_string(), Duration::ZERO);
    while live.advance(Duration::ZERO, &mut || true) {}
    taken(live)
}

fn of_kind<'a>(events: &'a [Value], kind: &str) -> Vec<&'a Value> {
    events.iter().filter(|event| event["event"] == kind).collect()
}

fn step_of(live: &mut Live, robot: usize, to: Value) -> Value {
    let events = ask(live, json!({ "debug": { "robot": robot, "to": to } }));
    let [stepped] = of_kind(&events, "stepped")[..] else { panic!("{events:?}") };
    stepped["at"].clone()
}

/// Steps, and returns the tick, the number of the statement and its line.
fn step(live: &mut Live, to: &str) -> [u64; 3] {
    place(&step_of(live, 1, json!(to)))
}

fn place(at: &Value) -> [u64; 3] {
    [&at["tick"], &at["number"], &at["place"]["line"]].map(|number| number.as_u64().unwrap())
}

fn global<'a>(at: &'a Value, name: &str) -> &'a Value {
    let globals = at["memory"]["globals"].as_array().unwrap();
    &globals.iter().find(|pair| pair[0] == name).unwrap()[1]
}

fn refused(events: &[Value]) -> String {
    let [refused] = of_kind(events, "refused")[..] else { panic!("{events:?}") };
    refused["text"].as_str().unwrap().to_owned()
}

fn digest(live: &mut Live) -> Value {
    of_kind(&ask(live, json!("digest")), "digest")[0]["digest"].clone()
}

fn now(live: &Live) -> u64 {
    live.session().run().now()
}

#[test]
fn steps_show_a_statement_and_the_memory_before_it() {
    let mut live = start();
    let before = digest(&mut live);
    let first = step_of(&mut live, 1, json!("next"));
    assert_eq!((place(&first), &first["count"]), ([1, 0, 8], &json!(14)));
    assert_eq!(first["place"]["script"], "walk.bzz");
    assert_eq!(first["place"]["text"], "  n = n + 1");
    assert_eq!(global(&first, "n"), 0);
    let second = step_of(&mut live, 1, json!("next"));
    assert_eq!((place(&second), global(&second, "n")), ([1, 1, 9], &json!(1)));
    assert_eq!([(); 3].map(|()| step(&mut live, "next")), [[1, 2, 9], [1, 3, 10], [1, 4, 4]]);
    let inner = step_of(&mut live, 1, json!("next"));
    assert_eq!(place(&inner), [1, 5, 5]);
    let frames = inner["memory"]["frames"].as_array().unwrap();
    assert_eq!(frames[0]["function"], "double");
    assert_eq!(frames[0]["locals"], json!([["x", 1], ["twice", 2]]));
    assert_eq!(frames[1]["function"], "step");
    // The world waits.
    assert_eq!((digest(&mut live), now(&live)), (before, 1));
}

#[test]
fn steps_go_over_a_call_out_of_it_and_back() {
    let mut live = start();
    assert_eq!(place(&step_of(&mut live, 1, json!({ "at": 3 }))), [1, 3, 10]);
    assert_eq!(step(&mut live, "over"), [1, 6, 9]);
    assert_eq!(step(&mut live, "back"), [1, 5, 5]);
    assert_eq!(step(&mut live, "out"), [1, 6, 9]);
    assert_eq!(step(&mut live, "last"), [1, 13, 12]);
    assert_eq!(step(&mut live, "first"), [1, 0, 8]);
}

#[test]
fn steps_cross_ticks_both_ways() {
    let mut live = start();
    let straight = {
        let mut live = start();
        go_to(&mut live, 2);
        digest(&mut live)
    };
    step(&mut live, "last");
    live.request(&json!({ "debug": { "robot": 1, "to": "over" } }).to_string(), Duration::ZERO);
    while live.advance(Duration::ZERO, &mut || true) {}
    let events = taken(&mut live);
    // The lines of the tick that has passed are shown.
    let lines = of_kind(&events, "logs")[0]["lines"].as_array().unwrap();
    assert_eq!(lines.iter().map(|line| &line["text"]).collect::<Vec<_>>(), ["2", "4"]);
    assert_eq!(place(&of_kind(&events, "stepped")[0]["at"]), [2, 0, 8]);
    assert_eq!(digest(&mut live), straight);
    let back = step_of(&mut live, 1, json!("back"));
    assert_eq!((place(&back), global(&back, "sum")), ([1, 13, 12], &json!(4)));
    // The global code and the definitions of functions run in the tick before.
    let mut first = [0; 3];
    for _ in 0..13 {
        first = step(&mut live, "back");
    }
    assert_eq!(first, [1, 0, 8]);
    let mut numbers = vec![step(&mut live, "back")];
    while numbers.last().unwrap()[1] > 0 {
        numbers.push(step(&mut live, "back"));
    }
    assert_eq!(numbers.last(), Some(&[0, 0, 1]));
    let events = ask(&mut live, json!({ "debug": { "robot": 1, "to": "back" } }));
    assert_eq!(refused(&events), "robot 3 has begun no statement before");
}

#[test]
fn steps_follow_one_robot() {
    let mut live = start();
    assert_eq!(place(&step_of(&mut live, 0, json!("last"))), [1, 8, 12]);
    assert_eq!(place(&step_of(&mut live, 1, json!("next"))), [1, 0, 8]);
    let events = ask(&mut live, json!({ "debug": { "robot": 2, "to": "next" } }));
    assert_eq!(refused(&events), "there is no robot with the number 2");
    let events = ask(&mut live, json!({ "debug": { "robot": 0, "to": { "at": 99 } } }));
    assert_eq!(refused(&events), "the tick has no statement with the number 99");
}

#[test]
fn a_statement_is_left_with_its_tick_and_with_a_command() {
    for (request, tick) in [
        (json!({ "step": { "ticks": 1 } }), 2),
        (json!({ "go_to": { "tick": 0 } }), 0),
        (json!({ "command": { "text": "stop = 2" } }), 1),
    ] {
        let mut live = start();
        step(&mut live, "next");
        let events = ask(&mut live, request);
        let stepped: Vec<&Value> = of_kind(&events, "stepped");
        assert_eq!(stepped, [&json!({ "event": "stepped", "at": null })]);
        assert_eq!(now(&live), tick);
        assert!(of_kind(&ask(&mut live, json!("commands")), "stepped").is_empty());
    }
}

#[test]
fn a_step_ends_at_the_end_of_the_run_and_without_statements() {
    let mut live = start();
    go_to(&mut live, 29);
    live.take_events();
    step(&mut live, "last");
    let events = ask(&mut live, json!({ "debug": { "robot": 1, "to": "next" } }));
    assert_eq!(of_kind(&events, "stepped"), [&json!({ "event": "stepped", "at": null })]);
    assert_eq!(now(&live), 30);
    let events = ask(&mut live, json!({ "debug": { "robot": 1, "to": "next" } }));
    assert_eq!(refused(&events), "the run is over: go back, or run it from the beginning");
    assert_eq!(step(&mut live, "back"), [29, 13, 12]);
    // A robot that has failed begins none.
    let mut live = start();
    ask(&mut live, json!({ "command": { "text": "fail = 3" } }));
    let events = ask(&mut live, json!({ "debug": { "robot": 1, "to": "next" } }));
    assert!(of_kind(&events, "stepped").is_empty(), "{events:?}");
    assert_eq!(now(&live), 30);
}

#[test]
fn the_run_pauses_at_a_breakpoint() {
    let mut live = start();
    let lines = json!({ "lines": { "walk.bzz": [3, 6, 13] }, "robot": null });
    let events = ask(&mut live, json!({ "breakpoints": lines }));
    // The definition of a function is no statement, and the end of one is none either.
    let expected = json!([
        { "script": "walk.bzz", "line": 3, "at": 4 },
        { "script": "walk.bzz", "line": 6, "at": 8 },
        { "script": "walk.bzz", "line": 13, "at": null },
    ]);
    assert_eq!(of_kind(&events, "breakpoints")[0]["lines"], expected);
    let lines = json!({ "lines": { "walk.bzz": [5] } });
    ask(&mut live, json!({ "breakpoints": lines }));
    // Robot 2 reaches the line once in a tick, robot 3 twice.
    let mut hits = Vec::new();
    for _ in 0..4 {
        let events = ask(&mut live, json!({ "play": {} }));
        let [stepped] = of_kind(&events, "stepped")[..] else { panic!("{events:?}") };
        hits.push((stepped["at"]["robot"].as_u64().unwrap(), place(&stepped["at"])));
        assert!(!of_kind(&events, "state").last().unwrap()["plays"].as_bool().unwrap());
    }
    let expected = [(0, [1, 5, 5]), (1, [1, 5, 5]), (1, [1, 10, 5]), (0, [2, 5, 5])];
    assert_eq!(hits, expected);
    // No line of the tick in which it pauses was shown.
    let events = ask(&mut live, json!({ "breakpoints": { "lines": {} } }));
    assert!(of_kind(&events, "logs").is_empty());
    let events = ask(&mut live, json!({ "step": { "ticks": 1 } }));
    let lines = of_kind(&events, "logs")[0]["lines"].as_array().unwrap().len();
    assert_eq!((lines, now(&live)), (2, 3));
}

#[test]
fn a_breakpoint_of_one_robot_lets_others_pass() {
    let mut live = start();
    let lines = json!({ "lines": { "walk.bzz": [4] }, "robot": 1 });
    ask(&mut live, json!({ "breakpoints": lines }));
    let events = ask(&mut live, json!({ "play": {} }));
    assert_eq!(of_kind(&events, "stepped")[0]["at"]["robot"], 1);
}

#[test]
fn breakpoints_change_nothing_of_the_run() {
    let mut live = start();
    ask(&mut live, json!({ "breakpoints": { "lines": { "walk.bzz": [4, 12] } } }));
    let mut pauses = 0;
    while !live.session().run().is_over() {
        ask(&mut live, json!({ "play": { "rate": 1000 } }));
        live.advance(Duration::from_secs(60), &mut || true);
        while live.advance(Duration::from_secs(60), &mut || true) {}
        taken(&mut live);
        pauses += 1;
        assert!(pauses < 500);
    }
    // Three calls and two logs in each of 29 ticks, and the end.
    assert_eq!(pauses, 29 * 5 + 1);
    let mut straight = start();
    go_to(&mut straight, 30);
    assert_eq!(digest(&mut live), digest(&mut straight));
}

#[test]
fn a_new_text_has_its_own_statements() {
    let mut live = start();
    let text = format!("# One line more.\n{SCRIPT}");
    let load = json!({ "load": { "name": "walk.bzz", "text": text } });
    ask(&mut live, load);
    // The command acts in the tick that follows, in which the new script begins.
    let first = step_of(&mut live, 1, json!("next"));
    assert_eq!((place(&first), &first["place"]["script"]), ([1, 0, 2], &json!("walk.bzz")));
    let lines = json!({ "lines": { "walk.bzz": [5] } });
    ask(&mut live, json!({ "breakpoints": lines }));
    let events = ask(&mut live, json!({ "play": {} }));
    let at = &of_kind(&events, "stepped").last().unwrap()["at"];
    assert_eq!(at["place"]["text"], "  var twice = x + x");
}

/// A robot keeps the longer program of a question that brings a function.
#[test]
fn a_function_of_a_question_has_its_lines() {
    let mut live = start_with("f = nil\nfunction step() {\n  if(f != nil) log(f(id))\n}\n");
    go_to(&mut live, 1);
    let question = "f = function(x) { return x + x }";
    let text = format!("robots = [3]\nask = \"{question}\"");
    ask(&mut live, json!({ "command": { "text": text } }));
    ask(&mut live, json!({ "step": { "ticks": 1 } }));
    assert_eq!(place(&step_of(&mut live, 1, json!("first"))), [2, 0, 3]);
    let inside = step_of(&mut live, 1, json!("last"));
    assert_eq!((place(&inside), &inside["place"]["file"]), ([2, 2, 1], &json!("<question>")));
    assert_eq!(inside["place"]["text"], question);
    assert_eq!(inside["place"]["script"], Value::Null);
    // The other robot has no function.
    assert_eq!(place(&step_of(&mut live, 0, json!("last"))), [2, 0, 3]);
}

#[test]
fn an_endless_loop_is_shown_as_far_as_it_gets() {
    let mut live = start_with("n = 0\nfunction step() {\n  while(1 == 1) n = n + 1\n}\n");
    go_to(&mut live, 5);
    live.take_events();
    let last = step_of(&mut live, 0, json!("last"));
    assert_eq!(last["place"]["line"], 3);
    assert!(last["number"].as_u64().unwrap() > 10, "{last}");
}
