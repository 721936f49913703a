//! Tests of a world that is built by hand during a session.

use std::time::Duration;

use bittybuzz_arena::run::Session;
use bittybuzz_live::{Live, SharedFiles, Shelf, Source};
use serde_json::{Value, json};

use crate::{go_to, taken};

const SCRIPT: &str = "n = 0\nfunction step() {\n  n = n + 1\n  forward()\n}\n";

const SCENARIO: &str = "[world]\nsize = [800, 800] # mm\nduration = 30\nseed = 5\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"n.bzz\"\npositions = [[0, 0], [100, 0]]\n";

fn start(scenario: &str) -> Live {
    let files = SharedFiles::default();
    files.add("x/s.toml", scenario);
    files.add("x/n.bzz", SCRIPT);
    let shelf = Shelf::new(files, "x/s.toml".into());
    let (run, text) = shelf.open(1).unwrap();
    Live::new(Session::new(run, 5), text).with_workshop(shelf)
}

fn build(live: &mut Live, edit: Value, texts: Value) -> Vec<Value> {
    taken(live);
    let request = json!({ "build": { "edit": edit, "texts": texts } });
    live.request(&request.to_string(), Duration::ZERO);
    taken(live)
}

fn move_robot(at: [f64; 2]) -> Value {
    json!({ "change": { "thing": { "kind": "robot", "number": 1 }, "values": { "at": at } } })
}

fn named<'a>(events: &'a [Value], name: &str) -> Option<&'a Value> {
    events.iter().find(|event| event["event"] == name)
}

#[test]
fn the_run_starts_again_with_the_world_that_was_built() {
    let mut live = start(SCENARIO);
    go_to(&mut live, 50);
    let events = build(&mut live, move_robot([200.0, 50.0]), json!({}));
    let text = SCENARIO.replace("[100, 0]", "[200, 50]");
    let begin = named(&events, "begin").unwrap();
    assert_eq!(begin["scripts"]["begun"]["s.toml"], text);
    let built = named(&events, "built").unwrap();
    assert_eq!((&built["text"], &built["before"]), (&json!(text), &json!(SCENARIO)));
    assert_eq!(built["thing"], json!({ "kind": "robot", "number": 1 }));
    assert_eq!((live.tick(), live.session().run().view(1).unwrap().pose.x), (0, 200.0));
    // The run is that of the new text.
    go_to(&mut live, 100);
    let mut other = start(&text);
    go_to(&mut other, 100);
    assert_eq!(live.session().run().digest(), other.session().run().digest());
}

#[test]
fn a_refusal_changes_neither_text_nor_run() {
    let mut live = start(SCENARIO);
    go_to(&mut live, 50);
    for (edit, texts, reason) in [
        (move_robot([0.0, 10.0]), json!({}), "overlap"),
        (move_robot([0.0, 1000.0]), json!({}), "outside the world"),
        (move_robot([0.0, 100.0]), json!({ "s.toml": format!("{SCENARIO}# typed") }), "press Run"),
        (move_robot([0.0, 100.0]), json!({ "n.bzz": "function step() {" }), "errors"),
    ] {
        let events = build(&mut live, edit, texts);
        let refused = named(&events, "refused").unwrap();
        assert!(refused["text"].as_str().unwrap().contains(reason), "{refused}");
        assert!(named(&events, "begin").is_none() && live.tick() == 50, "{events:?}");
    }
    // A text that is not typed is the one of the run.
    let texts = json!({ "s.toml": SCENARIO });
    assert!(named(&build(&mut live, move_robot([0.0, 100.0]), texts), "built").is_some());
}

#[test]
fn a_session_without_files_is_not_built() {
    let files = SharedFiles::default();
    files.add("x/s.toml", SCENARIO);
    files.add("x/n.bzz", SCRIPT);
    let (run, text) = Shelf::new(files, "x/s.toml".into()).open(1).unwrap();
    let mut live = Live::new(Session::new(run, 5), text);
    let events = build(&mut live, move_robot([0.0, 100.0]), json!({}));
    assert!(named(&events, "refused").is_some() && named(&events, "built").is_none());
}
