//! Tests of undo, redo and deletion of the session's own changes.

use std::time::Duration;

use bittybuzz_live::{Live, Source};
use serde_json::{Value, json};

use crate::{go_to, session, taken};

const SCRIPT: &str = "n = 0\nfunction step() {\n  n = n + 1\n  forward()\n  led(n % 8)\n}\n";

const SCENARIO: &str = "[world]\nsize = [800, 800]\nduration = 30\nseed = 5\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"n.bzz\"\ncount = 4\nplacement = \"grid\"\nspacing = 60\n";

const MOVE: &str = "move = 0\nto = [300, 300]";

fn start() -> Live {
    session(SCENARIO, ("n.bzz", SCRIPT))
}

/// Sends a request, and goes the way that it begins.
fn ask(live: &mut Live, request: &Value) {
    live.request(&request.to_string(), Duration::ZERO);
    while live.advance(Duration::ZERO, &mut || true) {}
}

fn command(live: &mut Live, tick: u64, text: &str) {
    go_to(live, tick);
    ask(live, &json!({ "command": { "text": text } }));
}

fn load(live: &mut Live, tick: u64, text: &str) {
    go_to(live, tick);
    ask(live, &json!({ "load": { "name": "n.bzz", "text": text } }));
}

/// The digest at a tick of a run to which only these commands were given.
fn digest_of(act: impl FnOnce(&mut Live), tick: u64) -> u64 {
    let mut live = start();
    act(&mut live);
    go_to(&mut live, tick);
    live.session().run().digest()
}

fn texts(live: &Live) -> Vec<String> {
    live.session().run().command_list().map(|(_, text)| text.to_owned()).collect()
}

/// The last event about what can be undone and done again.
fn can(events: &[Value]) -> (bool, bool) {
    let event = events.iter().rfind(|event| event["event"] == "conditions").unwrap();
    (event["can_undo"].as_bool().unwrap(), event["can_redo"].as_bool().unwrap())
}

#[test]
fn changes_are_undone_and_done_again() {
    let mut live = start();
    command(&mut live, 20, "fail = 1");
    command(&mut live, 40, MOVE);
    go_to(&mut live, 90);
    assert_eq!(can(&taken(&mut live)), (true, false));
    let all = live.session().run().digest();
    ask(&mut live, &json!("undo"));
    assert_eq!((texts(&live), live.session().run().now()), (vec!["fail = 1".to_owned()], 90));
    let one = digest_of(|live| command(live, 20, "fail = 1"), 90);
    assert_eq!(live.session().run().digest(), one);
    assert_eq!(can(&taken(&mut live)), (true, true));
    ask(&mut live, &json!("undo"));
    assert_eq!(live.session().run().digest(), digest_of(|_| (), 90));
    assert_eq!(can(&taken(&mut live)), (false, true));
    ask(&mut live, &json!("redo"));
    ask(&mut live, &json!("redo"));
    assert_eq!((live.session().run().digest(), texts(&live).len()), (all, 2));
    assert_eq!(can(&taken(&mut live)), (true, false));
    // Nothing is left to be done again.
    ask(&mut live, &json!("redo"));
    let events = taken(&mut live);
    let refused = events.iter().find(|event| event["event"] == "refused").unwrap();
    assert_eq!(refused["text"], "there is no change that can be done again");
}

#[test]
fn a_deleted_change_is_as_if_it_had_never_been_made() {
    let mut live = start();
    command(&mut live, 20, "fail = 1");
    command(&mut live, 40, MOVE);
    go_to(&mut live, 90);
    ask(&mut live, &json!({ "delete_command": { "number": 0 } }));
    assert_eq!(texts(&live), [MOVE]);
    let expected = digest_of(|live| command(live, 40, MOVE), 90);
    assert_eq!((live.session().run().digest(), live.session().run().now()), (expected, 90));
    ask(&mut live, &json!("undo"));
    assert_eq!(texts(&live), ["fail = 1", MOVE]);
    ask(&mut live, &json!({ "delete_command": { "number": 2 } }));
    let events = taken(&mut live);
    let refused = events.iter().find(|event| event["event"] == "refused").unwrap();
    assert_eq!(refused["text"], "there is no change with the number 2");
}

/// A command at an earlier tick removes the later ones, which are changes, too.
#[test]
fn undo_brings_back_the_commands_of_another_way() {
    let mut live = start();
    command(&mut live, 20, "fail = 1");
    command(&mut live, 60, "fail = 2");
    let all = digest_of(
        |live| {
            command(live, 20, "fail = 1");
            command(live, 60, "fail = 2");
        },
        40,
    );
    command(&mut live, 40, MOVE);
    assert_eq!(texts(&live), ["fail = 1", MOVE]);
    ask(&mut live, &json!("undo"));
    assert_eq!(
        (texts(&live), live.session().run().now()),
        (vec!["fail = 1".into(), "fail = 2".into()], 40)
    );
    assert_eq!(live.session().run().digest(), all);
    // A new change leaves nothing to be done again.
    ask(&mut live, &json!({ "command": { "text": "fail = 3" } }));
    ask(&mut live, &json!("redo"));
    assert_eq!(texts(&live), ["fail = 1", "fail = 3"]);
}

#[test]
fn a_script_that_was_loaded_is_undone() {
    let (first, second) = (SCRIPT.replace("% 8", "% 4"), SCRIPT.replace("% 8", "% 2"));
    let mut live = start();
    load(&mut live, 20, &first);
    load(&mut live, 40, &second);
    command(&mut live, 60, MOVE);
    go_to(&mut live, 90);
    let all = live.session().run().digest();
    ask(&mut live, &json!({ "delete_command": { "number": 0 } }));
    let expected = digest_of(
        |live| {
            load(live, 40, &second);
            command(live, 60, MOVE);
        },
        90,
    );
    // The name of the draft is another one, but the run is the same.
    assert_eq!(live.session().run().digest(), expected);
    let script = |live: &mut Live| {
        taken(live);
        ask(live, &json!({ "script": { "name": "n.bzz" } }));
        let events = taken(live);
        let found = events.iter().find(|event| event["event"] == "script").unwrap();
        found["text"].as_str().unwrap().to_owned()
    };
    assert_eq!(script(&mut live), second);
    ask(&mut live, &json!("undo"));
    assert_eq!((live.session().run().digest(), script(&mut live)), (all, second.clone()));
    // Without both of them, the text is that of the file.
    ask(&mut live, &json!({ "delete_command": { "number": 1 } }));
    assert_eq!(script(&mut live), first);
    ask(&mut live, &json!({ "delete_command": { "number": 0 } }));
    assert_eq!(script(&mut live), SCRIPT);
    assert_eq!(live.session().run().digest(), digest_of(|live| command(live, 60, MOVE), 90));
    ask(&mut live, &json!("undo"));
    assert_eq!(script(&mut live), first);
    // The saved scenario has the script that runs, and no other.
    taken(&mut live);
    ask(&mut live, &json!("scenario"));
    let events = taken(&mut live);
    let saved = events.iter().find(|event| event["event"] == "scenario").unwrap();
    let text = saved["text"].as_str().unwrap();
    assert!(text.contains("% 4") && !text.contains("% 2"), "{text}");
}

#[test]
fn a_change_that_later_ones_need_cannot_be_deleted() {
    let mut live = start();
    load(&mut live, 20, &format!("{SCRIPT}extra = 1\n"));
    command(&mut live, 40, "set = \"all\"\nglobal = \"extra\"\nnumber = 2");
    go_to(&mut live, 60);
    let digest = live.session().run().digest();
    taken(&mut live);
    ask(&mut live, &json!({ "delete_command": { "number": 0 } }));
    let events = taken(&mut live);
    let refused = events.iter().find(|event| event["event"] == "refused").unwrap();
    let text = refused["text"].as_str().unwrap();
    assert!(
        text.starts_with("a later change does not fit any more: ") && text.contains("`extra`"),
        "{text}"
    );
    assert_eq!((live.session().run().digest(), texts(&live).len()), (digest, 2));
}

/// A curve goes the new way, and what the page has of the old one is void.
#[test]
fn a_curve_goes_the_way_without_a_deleted_change() {
    let mut live = start();
    ask(&mut live, &json!({ "series": { "quantities": ["x"] } }));
    command(&mut live, 30, MOVE);
    go_to(&mut live, 90);
    taken(&mut live);
    ask(&mut live, &json!({ "delete_command": { "number": 0 } }));
    let events = taken(&mut live);
    let cut = events.iter().position(|event| event["event"] == "series_cut").unwrap();
    let points = events.iter().position(|event| event["event"] == "series").unwrap();
    assert_eq!((cut < points, &events[cut]["tick"]), (true, &json!(30)));
    assert_eq!(events[points]["ticks"].as_array().unwrap().len(), 60);
    let mut other = start();
    go_to(&mut other, 90);
    ask(&mut other, &json!({ "series": { "quantities": ["x"] } }));
    let events = taken(&mut other);
    let expected = events.iter().find(|event| event["event"] == "series").unwrap();
    let last = |event: &Value| event["five"].as_array().unwrap().last().cloned();
    let found = taken(&mut live);
    assert_eq!(found.len(), 0);
    go_to(&mut live, 91);
    go_to(&mut other, 91);
    let next = |live: &mut Live| {
        let events = taken(live);
        last(events.iter().find(|event| event["event"] == "series").unwrap())
    };
    assert!(last(expected).is_some());
    assert_eq!(next(&mut live), next(&mut other));
}

#[test]
fn a_new_run_has_nothing_to_undo() {
    let mut live = start();
    command(&mut live, 20, "fail = 1");
    ask(&mut live, &json!({ "run": { "texts": {}, "keep_changes": true } }));
    taken(&mut live);
    ask(&mut live, &json!("undo"));
    assert_eq!(texts(&live), ["fail = 1"]);
    // It can be deleted.
    ask(&mut live, &json!({ "delete_command": { "number": 0 } }));
    assert_eq!(texts(&live), Vec::<String>::new());
    // Another page learns what can be undone.
    live.begin();
    assert_eq!(can(&taken(&mut live)), (true, false));
}
