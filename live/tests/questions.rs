//! Tests of questions to robots and of their answers.

use std::time::Duration;

use bittybuzz_arena::run::Session;
use bittybuzz_live::{Live, SharedFiles, Shelf, Source};
use serde_json::{Value, json};

use crate::{go_to, session, taken};

const SCRIPT: &str = "n = 0 name = \"a\"\nfunction step() {\n  n = n + 1\n  log(n)\n}\n";

const SCENARIO: &str = "[world]\nsize = [800, 800]\nduration = 30\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"n.bzz\"\ncount = 4\nplacement = \"grid\"\nspacing = 60\n";

fn start() -> Live {
    session(SCENARIO, ("n.bzz", SCRIPT))
}

/// Sends a request, and goes the way that it begins.
fn request(live: &mut Live, request: &Value) {
    live.request(&request.to_string(), Duration::ZERO);
    while live.advance(Duration::ZERO, &mut || true) {}
}

fn ask(live: &mut Live, robot: usize, question: &str) {
    let text = format!("robots = {robot}\nask = '''{question}'''");
    request(live, &json!({ "command": { "text": text } }));
}

/// Takes all events and returns the lines of the last one of a kind that are answers.
fn answers(live: &mut Live, kind: &str) -> Vec<Value> {
    let events = taken(live);
    let last = events.iter().rfind(|event| event["event"] == kind).unwrap();
    let lines = last["lines"].as_array().unwrap().iter();
    lines.filter(|line| !line["answer"].is_null()).cloned().collect()
}

fn answer(tick: u64, robot: usize, text: &str) -> Value {
    json!({ "tick": tick, "robot": robot, "text": text, "answer": "value" })
}

#[test]
fn a_paused_run_answers_at_once_and_again_in_its_tick() {
    let mut live = start();
    go_to(&mut live, 20);
    ask(&mut live, 2, "n + 1");
    assert_eq!(answers(&mut live, "answers"), [answer(20, 2, "n + 1 = 20")]);
    ask(&mut live, 2, "name = \"new\"");
    ask(&mut live, 2, "name");
    let three = [
        answer(20, 2, "n + 1 = 20"),
        answer(20, 2, "name = \"new\": done"),
        answer(20, 2, "name = new"),
    ];
    assert_eq!(answers(&mut live, "answers"), three);
    // An event comes once.
    assert!(taken(&mut live).iter().all(|event| event["event"] != "answers"));
    assert_eq!(live.session().run().now(), 20);
    request(&mut live, &json!({ "step": { "ticks": 1 } }));
    assert_eq!(answers(&mut live, "logs"), three);
    // Back, the same questions wait again.
    go_to(&mut live, 10);
    assert!(taken(&mut live).iter().all(|event| event["event"] != "answers"));
    go_to(&mut live, 20);
    assert_eq!(answers(&mut live, "answers"), three);
}

#[test]
fn answers_go_with_their_question() {
    let mut live = start();
    go_to(&mut live, 5);
    let before = live.session().run().digest();
    ask(&mut live, 1, "id * 2");
    ask(&mut live, 3, "1 / (n - n)");
    let text = "1 / (n - n): ended by an error: integer division by zero";
    let missing = json!({ "tick": 5, "robot": 3, "text": text, "answer": "missing" });
    assert_eq!(answers(&mut live, "answers"), [answer(5, 1, "id * 2 = 2"), missing.clone()]);
    request(&mut live, &json!({ "delete_command": { "number": 0 } }));
    assert_eq!(answers(&mut live, "answers"), [missing]);
    request(&mut live, &json!("undo"));
    request(&mut live, &json!("undo"));
    request(&mut live, &json!("undo"));
    assert_eq!(answers(&mut live, "answers"), [] as [Value; 0]);
    assert_eq!(live.session().run().digest(), before);
    ask(&mut live, 1, "idd");
    let refused = taken(&mut live).into_iter().find(|event| event["event"] == "refused").unwrap();
    assert_eq!(
        refused["text"],
        "column 1: nothing ever assigns `idd`: it is nil; did you mean `id`?"
    );
}

/// The scenario of the session replays it, and the answers of the run belong to its text.
#[test]
fn a_saved_session_asks_again() {
    let mut live = start();
    go_to(&mut live, 7);
    ask(&mut live, 0, "n = 100 n + id");
    go_to(&mut live, 12);
    ask(&mut live, 0, "name = \"x\"");
    request(&mut live, &json!("scenario"));
    let events = taken(&mut live);
    let saved = events.iter().find(|event| event["event"] == "scenario").unwrap();
    let files = SharedFiles::default();
    files.add("x/s.toml", saved["text"].as_str().unwrap());
    let shelf = Shelf::new(files, "x/s.toml".into());
    let (run, text) = shelf.open(1).unwrap();
    let mut again = Live::new(Session::new(run, 5), text).with_workshop(shelf);
    for live in [&mut live, &mut again] {
        go_to(live, 100);
    }
    assert_eq!(live.session().run().digest(), again.session().run().digest());
}
