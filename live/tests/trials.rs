//! Tests of trials next to a session: sweeps, and results that are handed in.

use std::collections::BTreeMap;
use std::time::Duration;

use bittybuzz_arena::run::Session;
use bittybuzz_live::{HandIn, Live, SharedFiles, Shelf, Source, TextFile};
use serde_json::{Value, json};

use crate::{go_to, taken};

/// Each robot adopts the greatest number that it receives.
const SCRIPT: &str = "SEND = 1\nbest = id\nfunction step() {\n  neighbors.listen(\"best\", function(vid, value, rid) {\n    \
    if(value > best) { best = value }\n  })\n  if(SEND > 0) { neighbors.broadcast(\"best\", best) }\n}\n";

const SCENARIO: &str = "[world]\nsize = [400, 400]\nduration = 20\nseed = 5\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"best.bzz\"\ncount = 9\nplacement = \"grid\"\nspacing = 45\n\n\
    [[expect]]\nwithin = 19\nvalue = \"global.best\"\nequals = 8\n\n\
    [assignment]\ntitle = \"The best\"\ntext = \"Agree on it.\"\n";

fn start() -> Live {
    let files = SharedFiles::default();
    files.add("x/s.toml", SCENARIO);
    files.add("x/best.bzz", SCRIPT);
    let shelf = Shelf::new(files, "x/s.toml".into());
    let (run, text) = shelf.open(1).unwrap();
    Live::new(Session::new(run, 10), text).with_workshop(shelf)
}

/// Returns a `goes_on` that allows one more tick per turn.
fn once() -> impl FnMut() -> bool {
    let mut times = 0..1;
    move || times.next().is_some()
}

/// Sends a request and returns the events until its trials have ended, or until it is refused.
fn finish(live: &mut Live, request: Value) -> Vec<Value> {
    live.take_events();
    live.request(&request.to_string(), Duration::ZERO);
    let mut turns = 0;
    while live.advance(Duration::ZERO, &mut once()) {
        turns += 1;
        assert!(turns < 100_000, "the trials do not end");
    }
    taken(live)
}

fn of_kind<'a>(events: &'a [Value], kind: &str) -> Vec<&'a Value> {
    events.iter().filter(|event| event["event"] == kind).collect()
}

fn refusal(events: &[Value]) -> &str {
    of_kind(events, "refused")[0]["text"].as_str().unwrap()
}

#[test]
fn a_key_of_the_scenario_is_varied() {
    let mut live = start();
    let request = json!({ "sweep": {
        "key": "medium.ir.loss", "values": ["0", "1"], "seeds": 3, "quantity": "global.best",
    } });
    let events = finish(&mut live, request);
    let trials = of_kind(&events, "trial");
    let keys =
        trials.iter().map(|one| (one["value"].as_str().unwrap(), one["seed"].as_u64().unwrap()));
    let expected = ["0", "1"].map(|value| [5, 6, 7].map(|seed| (value, seed))).concat();
    assert_eq!(keys.collect::<Vec<_>>(), expected);
    for trial in trials {
        // With a loss of 1, no robot receives anything.
        let (verdict, best) = match trial["value"].as_str() {
            Some("0") => ("held", json!(vec![8.0; 9])),
            _ => ("failed", json!([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])),
        };
        assert_eq!((&trial["verdicts"], &trial["numbers"]), (&json!([verdict]), &best), "{trial}");
        assert_eq!(trial["since"][0].is_null(), verdict == "failed");
    }
    let percents = of_kind(&events, "trials");
    let percents: Vec<u64> =
        percents.iter().map(|event| event["percent"].as_u64().unwrap()).collect();
    assert_eq!((percents.is_sorted(), percents.last()), (true, Some(&100)), "{percents:?}");
    // The session has not moved.
    assert_eq!(live.session().run().now(), 0);
}

#[test]
fn a_global_is_varied_and_the_last_draft_runs() {
    let mut live = start();
    let request = json!({ "sweep": { "key": "global.SEND", "values": ["1", "0"], "seeds": 1 } });
    let verdicts = |events: &[Value]| -> Vec<Value> {
        of_kind(events, "trial").iter().map(|one| one["verdicts"][0].clone()).collect()
    };
    assert_eq!(verdicts(&finish(&mut live, request.clone())), ["held", "failed"]);
    // With this draft, robots do not send their number.
    let silent = SCRIPT.replace("SEND > 0", "SEND > 9");
    live.request(
        &json!({ "load": { "name": "best.bzz", "text": silent } }).to_string(),
        Duration::ZERO,
    );
    assert_eq!(verdicts(&finish(&mut live, request)), ["failed", "failed"]);
}

#[test]
fn a_playing_session_continues_during_trials() {
    let mut live = start();
    live.request("{\"play\":{}}", Duration::ZERO);
    let request = json!({ "sweep": { "seeds": 2 } });
    let events = finish(&mut live, request);
    assert_eq!(of_kind(&events, "trial").len(), 2);
    assert!(live.session().run().is_over());
}

#[test]
fn invalid_trials_are_refused() {
    let mut live = start();
    let sweep = |key: &str, values: Value, seeds: u32| json!({ "sweep": { "key": key, "values": values, "seeds": seeds, "quantity": "led" } });
    for (request, reason) in [
        (sweep("medium.ir.loss", json!([]), 3), "at least one value"),
        (sweep("medium.ir.loss", json!(["0"]), 0), "at least one value"),
        (sweep("medium.ir.loss", json!(["0", "1"]), 501), "1002 trials are more than 1000"),
        (sweep("medium.ir.los", json!(["0"]), 1), "unknown key `los`"),
        (sweep("medium.ir.loss", json!(["2"]), 1), "0 to 1"),
        (sweep("global.NONE", json!(["2"]), 1), "`NONE`"),
        (sweep("global.SEND", json!(["\"a\""]), 1), "number"),
        (sweep("global.SEND", json!(["1\n[world]"]), 1), ""),
        (json!({ "sweep": { "seeds": 1, "quantity": "nonsense" } }), "nonsense"),
    ] {
        let events = finish(&mut live, request.clone());
        assert!(refusal(&events).contains(reason), "{request}: {}", refusal(&events));
        // The value is in a field of the page, and in no line of a file.
        assert!(!refusal(&events).contains(":1:"), "{request}: {}", refusal(&events));
        assert!(!refusal(&events).contains(".toml:"), "{request}: {}", refusal(&events));
        assert!(of_kind(&events, "trial").is_empty());
    }
}

#[test]
fn trials_are_canceled() {
    let mut live = start();
    live.request(&json!({ "sweep": { "seeds": 100 } }).to_string(), Duration::ZERO);
    assert!(live.advance(Duration::ZERO, &mut once()));
    let events = finish(&mut live, json!("stop_trials"));
    assert_eq!((of_kind(&events, "trial").len(), of_kind(&events, "trials").len()), (0, 1));
}

#[test]
fn a_hand_in_contains_all_that_a_second_run_needs() {
    let mut live = start();
    // Commands to the session do not count, but the text does.
    let text = SCRIPT.replace("SEND = 1", "SEND = 2");
    let texts = json!({ "best.bzz": text });
    live.request(&json!({ "run": { "texts": texts } }).to_string(), Duration::ZERO);
    live.request("{\"command\":{\"text\":\"fail = 8\"}}", Duration::ZERO);
    let request = json!({ "hand_in": { "by": "Ada / L.", "texts": texts } });
    let events = finish(&mut live, request);
    let result = of_kind(&events, "result")[0];
    assert_eq!(result["name"], "the-best-ada---l.json");
    let verdict = json!([result["held"], result["count"], result["success"]]);
    assert_eq!(verdict, json!([1, 1, true]));
    let read = HandIn::read(result["text"].as_str().unwrap()).unwrap();
    assert_eq!((read.by.as_str(), read.assignment.as_str()), ("Ada / L.", "The best"));
    assert_eq!((read.seed, read.seconds, read.success), (5, 20.0, true));
    assert_eq!(read.scenario.text, SCENARIO);
    assert_eq!(
        (read.scripts[0].name.as_str(), read.scripts[0].text.as_str()),
        ("best.bzz", text.as_str())
    );
    assert!(read.scripts[0].is_whole());
    assert_eq!(read.expectations[0].text, "all: global.best equals 8, within 19 s");
    // The same run from the start, in a new world, gives the same digest.
    let again = shelf_with(&text);
    let (mut run, _) = again.open(2).unwrap();
    while !run.is_over() {
        run.tick().unwrap();
    }
    assert_eq!(read.digest, format!("{:016x}", run.digest()));
}

/// The scenario with which the session was opened decides, whatever the page runs meanwhile.
#[test]
fn results_are_graded_next_to_the_session() {
    let mut live = start();
    let hand_in = json!({ "hand_in": { "by": "Ada", "texts": { "best.bzz": SCRIPT } } });
    let events = finish(&mut live, hand_in);
    let ada = of_kind(&events, "result")[0]["text"].as_str().unwrap().to_owned();
    let mut broken = HandIn::read(&ada).unwrap();
    broken.scripts = vec![TextFile::new("best.bzz".to_owned(), "x = )\n".to_owned())];
    let easier = SCENARIO.replace("equals = 8", "equals = 80");
    live.request(&json!({ "run": { "texts": { "s.toml": easier } } }).to_string(), Duration::ZERO);
    let files = json!({ "a.json": broken.text(), "b.json": ada, "c.json": "{}", "d.json": ada });
    let events = finish(&mut live, json!({ "grade": { "files": files } }));
    let marks = of_kind(&events, "marks")[0]["marks"].as_array().unwrap();
    let ran: Vec<&Value> = marks.iter().map(|mark| &mark["runs"]).collect();
    assert_eq!(ran, [false, true, false, true]);
    assert!(marks[0]["reason"].as_str().unwrap().contains("best.bzz:1:5: "), "{}", marks[0]);
    let mark = &marks[1]["ran"];
    let expected = (&json!("Ada"), &json!(true), &json!(["d.json"]));
    assert_eq!((&mark["by"], &mark["as_handed_in"], &mark["same_scripts"]), expected);
    // Without a result that compiles there is no trial.
    let events = finish(&mut live, json!({ "grade": { "files": { "c.json": "{}" } } }));
    assert_eq!(of_kind(&events, "marks")[0]["marks"][0]["runs"], false);
    let many: BTreeMap<String, &str> =
        (0..=1000).map(|number| (number.to_string(), "{}")).collect();
    let events = finish(&mut live, json!({ "grade": { "files": many } }));
    let reason = "1001 results are more than 1000: `bbz grade` has no such limit";
    assert_eq!(refusal(&events), reason);
}

/// A text is handed in only if the run began with it.
#[test]
fn a_text_that_has_not_run_is_not_handed_in() {
    let mut live = start();
    let text = SCRIPT.replace("SEND = 1", "SEND = 0");
    let hand_in = |text: &str| json!({ "hand_in": { "by": "Ada", "texts": { "best.bzz": text, "s.toml": SCENARIO } } });
    let events = finish(&mut live, hand_in(&text));
    let reason = "`best.bzz` has not run as it is shown: press Run, then hand in what has run";
    assert_eq!((refusal(&events), of_kind(&events, "result").len()), (reason, 0));
    // The text that has run is handed in with its verdict, although it solves nothing.
    let run = json!({ "run": { "texts": { "best.bzz": text } } });
    live.request(&run.to_string(), Duration::ZERO);
    let events = finish(&mut live, hand_in(&text));
    let result = of_kind(&events, "result")[0];
    let verdict = json!([result["held"], result["count"], result["success"]]);
    assert_eq!(verdict, json!([0, 1, false]));
    // A text that was loaded in the middle of a run has not run from the start.
    live.request(&json!({ "step": { "ticks": 5 } }).to_string(), Duration::ZERO);
    live.advance(Duration::ZERO, &mut || true);
    let load = json!({ "load": { "name": "best.bzz", "text": SCRIPT } });
    live.request(&load.to_string(), Duration::ZERO);
    for shown in [SCRIPT, &text] {
        let events = finish(&mut live, hand_in(shown));
        assert!(refusal(&events).contains("press Run"), "{}", refusal(&events));
        assert!(of_kind(&events, "result").is_empty());
    }
    // A text that was loaded, and is no longer part of the run, is not handed in in its place.
    go_to(&mut live, 2);
    live.request("{\"command\":{\"text\":\"fail = 8\"}}", Duration::ZERO);
    let events = finish(&mut live, hand_in(&text));
    let read = HandIn::read(of_kind(&events, "result")[0]["text"].as_str().unwrap()).unwrap();
    assert_eq!((&*read.scripts[0].text, read.success), (&*text, false));
}

fn shelf_with(script: &str) -> Shelf {
    let files = SharedFiles::default();
    files.add("s.toml", SCENARIO);
    files.add("best.bzz", script);
    Shelf::new(files, "s.toml".into())
}

#[test]
fn hashes_are_those_of_other_programs() {
    // FIPS 180-4, and `sha256sum`.
    let file = bittybuzz_live::TextFile::new("a.bzz".to_owned(), "abc".to_owned());
    assert_eq!(file.sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

#[test]
fn files_are_named_after_assignment_and_person() {
    let name = |by: &str, title: &str| {
        let text = || bittybuzz_live::TextFile::new(String::new(), String::new());
        let hand_in = HandIn::new(by.to_owned(), title.to_owned(), text(), Vec::new());
        hand_in.file_name().display().to_string()
    };
    assert_eq!(name("Ada", "Hops"), "hops-ada.json");
    assert_eq!(name("", ""), "result.json");
    assert_eq!(name("../../etc/passwd", "Zählen"), "zählen-etc-passwd.json");
    assert_eq!(name(&"x".repeat(1000), "a\u{0}b"), format!("a-b-{}.json", "x".repeat(40)));
}
