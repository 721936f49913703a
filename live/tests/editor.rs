//! Tests of scripts that a client edits.

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bittybuzz_arena::run::{Compiler, Program, Session, Setup, Simulation};
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError};
use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::include::{Files, IncludeLoader, MemoryFiles};
use bittybuzz_live::{KeptText, Live, Source, UnsavedStore, Workshop, sha256};
use serde_json::{Value, json};

use crate::taken;

const SCRIPT: &str = "n = 0\nfunction step() { n = n + 1 led(n % 8) }\n";
const RED: &str = "r = 1\nfunction step() { led(r) }\n";

/// Kilobots and Zooids share a script. Another Kilobot has its own script, and loads a third one
/// later.
const SCENARIO: &str = "[world]\nsize = [800, 600]\nduration = 10\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\ncount = 2\nfirst_id = 6\n\n\
    [[robots]]\nrobot = \"zooids\"\nscript = \"walk.bzz\"\ncount = 1\nfirst_id = 20\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"sub/own.bzz\"\ncount = 1\nfirst_id = 30\n\n\
    [[event]]\nat = 9\nload = 30\nscript = \"late.bzz\"\n";

type Shared = Arc<Mutex<MemoryFiles>>;

fn options(group: &Group) -> Options {
    let robots = bittybuzz_robot_files::all_shipped();
    Options { robot: Some((*group.robot).clone()), robots, ..Options::default() }
}

fn read(files: &MemoryFiles, script: &Path) -> Result<String, String> {
    let bytes = files.read(script, 10_000).map_err(|error| error.to_string())?;
    Ok(String::from_utf8(bytes).unwrap())
}

fn program(files: &MemoryFiles, script: &Path, group: &Group) -> Result<Program, String> {
    let text = group.embedded.text(script).map_or_else(|| read(files, script), Ok)?;
    let files = group.embedded.over(files);
    let compiled = compile(script, text, &IncludeLoader::new(&files), &options(group));
    let (symbols, sources) = (compiled.symbols, Arc::new(compiled.sources));
    let program = compiled.image.map(|image| Program::new(image, symbols, sources));
    program.ok_or_else(|| compiled.diagnostics[0].message.clone())
}

/// Returns a compiler for drafts, or else for files.
fn compiler(drafts: &Shared, files: &Shared) -> Compiler {
    let (drafts, files) = (drafts.clone(), files.clone());
    Arc::new(move |script: &Path, group: &Group| {
        let drafted = program(&drafts.lock().unwrap(), script, group);
        drafted.or_else(|_| program(&files.lock().unwrap(), script, group))
    })
}

/// Files in memory, and the paths that were written.
struct Folder {
    files: Shared,
    /// Drafts are not among the files, as on disk.
    drafts: Shared,
    may_write: bool,
    written: Rc<RefCell<Vec<String>>>,
}

impl Workshop for Folder {
    fn scenario(&self) -> &Path {
        "x/s.toml".as_ref()
    }

    fn parse(&self, text: &str, values: &[String]) -> Result<Scenario, Vec<ScenarioError>> {
        let (files, models) = (self.files.lock().unwrap(), bittybuzz_robot_models::all());
        Scenario::parse_in(&*files, text, self.scenario(), values, &models)
    }

    fn compiler(&self) -> Compiler {
        compiler(&self.drafts, &self.files)
    }

    fn read(&self, script: &Path) -> Result<String, String> {
        read(&self.files.lock().unwrap(), script)
    }

    fn compile(&self, script: &Path, text: &str, group: &Group) -> Compiled {
        let files = self.files.lock().unwrap();
        compile(script, text.to_owned(), &IncludeLoader::new(&*files), &options(group))
    }

    fn keep(&mut self, script: &Path, text: &str) {
        let mut drafts = self.drafts.lock().unwrap();
        *drafts = drafts.clone().with(script, text);
    }

    fn may_write(&self, _: &Path) -> bool {
        self.may_write
    }

    fn write(&self, script: &Path, text: &str) -> Result<(), String> {
        if !self.may_write {
            return Err("it is not allowed".to_owned());
        }
        self.written.borrow_mut().push(script.display().to_string());
        let mut files = self.files.lock().unwrap();
        *files = files.clone().with(script, text);
        Ok(())
    }
}

fn start(may_write: bool) -> (Live, Rc<RefCell<Vec<String>>>) {
    let files = MemoryFiles::default()
        .with("x/s.toml", SCENARIO)
        .with("x/walk.bzz", SCRIPT)
        .with("x/walk.1.bzz", "# Somebody's own.\n")
        .with("x/sub/own.bzz", SCRIPT)
        .with("x/late.bzz", RED)
        .with("x/secret.bzz", "# Of no robot.\n");
    let models = bittybuzz_robot_models::all();
    let scenario = Scenario::open_in(&files, "x/s.toml".as_ref(), &[], &models).unwrap();
    let own = scenario.scripts().map(|(group, script)| program(&files, script, group));
    let programs: Vec<Program> = own.collect::<Result<_, _>>().unwrap();
    let files = Shared::new(files.into());
    let drafts = Shared::default();
    let setup = Setup::new(scenario, programs).unwrap();
    let setup = setup.with_compiler(compiler(&drafts, &files));
    let session = Session::new(Simulation::new(Arc::new(setup), 1, 1).unwrap(), 10);
    let written = Rc::new(RefCell::default());
    let folder = Folder { files, drafts, may_write, written: Rc::clone(&written) };
    (Live::new(session, SCENARIO.to_owned()).with_workshop(folder), written)
}

/// Sends a request and returns the events that answer it.
fn ask(live: &mut Live, request: Value) -> Vec<Value> {
    live.take_events();
    live.request(&request.to_string(), Duration::ZERO);
    taken(live)
}

/// Sends a request and returns the only event that answers it.
fn answer(live: &mut Live, request: Value) -> Value {
    let events = ask(live, request);
    assert_eq!(events.len(), 1, "{events:?}");
    events[0].clone()
}

fn steps(live: &mut Live, ticks: u32) {
    live.request(&json!({ "step": { "ticks": ticks } }).to_string(), Duration::ZERO);
    live.advance(Duration::ZERO, &mut || true);
}

/// Returns true if a robot with that number has the global of [`RED`].
fn is_red(live: &Live, robot: usize) -> bool {
    live.session().run().program(robot).global("r").is_some()
}

#[test]
fn scripts_are_named_from_the_folder_of_the_scenario() {
    let (mut live, _) = start(false);
    let names = ["walk.bzz", "sub/own.bzz", "late.bzz"];
    let scripts = json!({
        "names": names, "scenario": "s.toml", "file": "x/s.toml", "writable": [], "unsaved": [],
        "begun": { "walk.bzz": SCRIPT, "sub/own.bzz": SCRIPT, "late.bzz": RED, "s.toml": SCENARIO },
    });
    assert_eq!(taken(&mut live)[0]["scripts"], scripts);
    let script = answer(&mut live, json!({ "script": { "name": "sub/own.bzz" } }));
    assert_eq!((&script["event"], &script["text"]), (&json!("script"), &json!(SCRIPT)));
    for name in ["secret.bzz", "x/walk.bzz", "../x/walk.bzz", "/etc/passwd", "x/s.toml", ""] {
        let refused = answer(&mut live, json!({ "script": { "name": name } }));
        assert_eq!(refused["text"], format!("no robot has the script `{name}`"));
    }
}

#[test]
fn names_are_those_of_all_robots_with_the_script() {
    let (mut live, _) = start(false);
    let names = |live: &mut Live, name: &str| -> Vec<String> {
        let script = answer(live, json!({ "script": { "name": name } }));
        let words = script["words"].as_array().unwrap();
        let full = |word: &Value| format!("{}|{}", word["of"], word["name"]).replace('"', "");
        words.iter().map(full).collect()
    };
    let both = names(&mut live, "walk.bzz");
    for name in ["|set_motor", "|goto", "neighbors|broadcast", "*|put", "math.rng|uniform", "pos|x"]
    {
        assert!(both.iter().any(|other| other == name), "{name}: {both:?}");
    }
    let kilobots = names(&mut live, "sub/own.bzz");
    assert!(!kilobots.contains(&"|goto".to_owned()), "a Zooid's function");
}

#[test]
fn each_message_is_listed_once_for_all_robot_types() {
    let (mut live, _) = start(false);
    // Both robots have `led`, a Kilobot has no `goto`, and the last name is wrong for both.
    let text = "function step() {\n  led(1)\n  goto(1, 2)\n  nonsense()\n}\n";
    let request = json!({ "check": { "name": "walk.bzz", "text": text } });
    let event = answer(&mut live, request);
    let found = event["diagnostics"].as_array().unwrap();
    let lines: Vec<_> = found.iter().map(|one| (&one["severity"], &one["line"])).collect();
    let error = json!("error");
    assert_eq!(lines.iter().filter(|one| **one == (&error, &json!(4))).count(), 1, "{found:#?}");
    assert_eq!(lines.iter().filter(|one| **one == (&error, &json!(3))).count(), 1, "{found:#?}");
    assert!(found.iter().all(|one| one["file"] == "x/walk.bzz"));
    assert_eq!(live.session().run().now(), 0);
}

#[test]
fn all_robots_with_the_script_get_the_draft() {
    let (mut live, _) = start(false);
    steps(&mut live, 3);
    let events = ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": RED } }));
    let ran = events.iter().find(|event| event["event"] == "ran").unwrap();
    // A file with the first name exists already.
    assert_eq!(ran["draft"], "walk.2.bzz");
    assert!(ran["quantities"]["global"].as_array().unwrap().contains(&json!("global.r")));
    steps(&mut live, 1);
    assert_eq!([0, 1, 2, 3].map(|robot| is_red(&live, robot)), [true, true, true, false]);
    // The editor shows the draft, also after a reload of the page.
    let script = answer(&mut live, json!({ "script": { "name": "walk.bzz" } }));
    assert_eq!(script["text"], RED);
    // An equal text is the same draft, and a different text is a new one.
    for (text, draft) in [(RED, "walk.2.bzz"), (SCRIPT, "walk.3.bzz"), (RED, "walk.2.bzz")] {
        let events = ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": text } }));
        assert!(events.iter().any(|event| event["draft"] == draft), "{draft}: {events:?}");
    }
}

#[test]
fn selected_robots_run_the_draft_instead_of_any_script() {
    let (mut live, _) = start(false);
    let request = json!({ "load": { "name": "walk.bzz", "text": RED, "robots": [7, 30] } });
    ask(&mut live, request);
    steps(&mut live, 1);
    assert_eq!([0, 1, 2, 3].map(|robot| is_red(&live, robot)), [false, true, false, true]);
    // No robot has this id.
    let request = json!({ "load": { "name": "walk.bzz", "text": RED, "robots": [99] } });
    let events = ask(&mut live, request);
    assert!(events.iter().any(|event| event["event"] == "refused"), "{events:?}");
}

#[test]
fn a_script_with_errors_does_not_run() {
    let (mut live, _) = start(false);
    let events =
        ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": "function step( {" } }));
    let kinds: Vec<_> = events.iter().map(|event| event["event"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["diagnostics", "refused"]);
    assert_eq!(live.session().run().commands(), "");
}

/// Checks that the saved session has the same course without any other file.
fn assert_replays(live: &mut Live) {
    let saved = answer(live, json!("scenario"));
    assert_eq!(saved["missing"], json!([]));
    let files = MemoryFiles::default().with("session.toml", saved["text"].as_str().unwrap());
    let models = bittybuzz_robot_models::all();
    let scenario = Scenario::open_in(&files, "session.toml".as_ref(), &[], &models).unwrap();
    let own = scenario.scripts().map(|(group, script)| program(&files, script, group));
    let programs: Vec<Program> = own.collect::<Result<_, _>>().unwrap();
    let setup = Setup::new(scenario, programs).unwrap();
    let mut run = Simulation::new(Arc::new(setup), 1, 1).unwrap();
    while run.now() < live.session().run().now() {
        run.tick().unwrap();
    }
    assert_eq!(run.digest(), live.session().run().digest());
}

/// Returns the paths of the files in a saved session.
fn saved_files(live: &mut Live) -> Vec<String> {
    let saved = answer(live, json!("scenario"));
    let text = saved["text"].as_str().unwrap();
    assert!(text.starts_with("[world]"), "{text}");
    let paths = text.lines().filter_map(|line| line.strip_prefix("path = "));
    paths.map(|path| path.trim_matches('"').to_owned()).collect()
}

#[test]
fn a_saved_session_has_its_drafts() {
    let (mut live, _) = start(false);
    steps(&mut live, 4);
    ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": RED, "robots": [6] } }));
    steps(&mut live, 4);
    ask(&mut live, json!({ "load": { "name": "sub/own.bzz", "text": format!("{RED}# other\n") } }));
    steps(&mut live, 92);
    let names = ["late.bzz", "sub/own.1.bzz", "sub/own.bzz", "walk.2.bzz", "walk.bzz"];
    assert_eq!(saved_files(&mut live), names);
    assert_replays(&mut live);
}

#[test]
fn a_saved_session_has_the_first_text_of_a_script_that_was_written() {
    let (mut live, written) = start(true);
    steps(&mut live, 4);
    for text in [RED, "function step() { }\n"] {
        let event = answer(&mut live, json!({ "write": { "name": "walk.bzz", "text": text } }));
        let written = json!({ "event": "written", "name": "walk.bzz", "sha256": sha256(text) });
        assert_eq!(event, written);
    }
    assert_eq!(*written.borrow(), ["x/walk.bzz", "x/walk.bzz"]);
    assert_eq!(saved_files(&mut live), ["late.bzz", "sub/own.bzz", "walk.bzz"]);
    assert_replays(&mut live);
    // The robots still run the first text; a draft of the written one is another script.
    let events = ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": RED } }));
    assert!(events.iter().any(|event| event["event"] == "ran"), "{events:?}");
    steps(&mut live, 4);
    assert_replays(&mut live);
}

#[test]
fn controls_are_those_of_the_last_texts() {
    let (mut live, _) = start(false);
    assert_eq!(taken(&mut live)[0]["controls"], json!([]));
    let text = format!("# slider: r 1..9\n{RED}# button: 9\n");
    let events =
        ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": text, "keep": true } }));
    let found = &events[0]["diagnostics"][0];
    assert_eq!((&found["code"], &found["line"]), (&json!("W0113"), &json!(4)));
    let ran = events.iter().find(|event| event["event"] == "ran").unwrap();
    assert_eq!(
        (&ran["controls"][0]["name"], &ran["controls"][0]["value"]),
        (&json!("r"), &json!(1.0))
    );
    assert_eq!(ran["controls"].as_array().unwrap().len(), 1);
    assert!(live.session().run().commands().contains("keep = true"));
    let command = "set = \"all\"\nglobal = \"r\"\nnumber = 5";
    let events = ask(&mut live, json!({ "command": { "text": command } }));
    assert!(events.iter().all(|event| event["event"] != "refused"), "{events:?}");
    steps(&mut live, 3);
    assert_replays(&mut live);
}

#[test]
fn writing_without_permission_is_refused() {
    let (mut live, written) = start(false);
    let refused = answer(&mut live, json!({ "write": { "name": "walk.bzz", "text": RED } }));
    assert_eq!(refused["text"], "it is not allowed");
    let (mut live, also_written) = start(true);
    let refused = answer(&mut live, json!({ "write": { "name": "secret.bzz", "text": RED } }));
    assert_eq!(refused["text"], "no robot has the script `secret.bzz`");
    assert!(written.borrow().is_empty() && also_written.borrow().is_empty());
}

/// Returns the first event of a kind.
fn of_kind(events: &[Value], kind: &str) -> Value {
    let found = events.iter().find(|event| event["event"] == kind);
    found.unwrap_or_else(|| panic!("no {kind}: {events:#?}")).clone()
}

/// A run that starts again has all texts that are shown, and nothing of the run before.
#[test]
fn a_run_starts_from_the_beginning_with_the_shown_texts() {
    let (mut live, _) = start(false);
    steps(&mut live, 5);
    live.request(r#"{"command":{"text":"fail = 6"}}"#, Duration::ZERO);
    ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": format!("{RED}# 2\n") } }));
    steps(&mut live, 5);
    let longer = SCENARIO.replace("duration = 10", "duration = 12");
    // No robot has the last script, which is therefore left alone.
    let texts =
        json!({ "walk.bzz": RED, "sub/own.bzz": RED, "s.toml": longer, "secret.bzz": "wrong" });
    let events = ask(&mut live, json!({ "run": { "texts": texts } }));
    let kinds: Vec<_> = events.iter().map(|event| event["event"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["begin", "state", "diagnostics", "diagnostics", "began"]);
    let begun = json!({ "walk.bzz": RED, "sub/own.bzz": RED, "late.bzz": RED, "s.toml": longer });
    assert_eq!((&events[0]["scripts"]["begun"], &events[0]["end"]), (&begun, &json!(120)));
    assert_eq!((live.session().run().now(), &*live.session().run().commands()), (0, ""));
    steps(&mut live, 1);
    assert_eq!([0, 1, 2, 3].map(|robot| is_red(&live, robot)), [true; 4]);
    assert_replays(&mut live);
    // The next run has the same texts without being told, and the first text of a script comes back.
    steps(&mut live, 5);
    ask(&mut live, json!({ "run": { "texts": { "sub/own.bzz": SCRIPT } } }));
    steps(&mut live, 3);
    assert_eq!([0, 1, 2, 3].map(|robot| is_red(&live, robot)), [true, true, true, false]);
    assert_replays(&mut live);
}

/// At the end of a run, a learner presses Run with the right answer.
#[test]
fn a_run_starts_again_at_its_end() {
    let (mut live, _) = start(false);
    steps(&mut live, 1000);
    let events = ask(&mut live, json!({ "run": { "texts": { "walk.bzz": RED } } }));
    of_kind(&events, "began");
    steps(&mut live, 1);
    assert!(is_red(&live, 0));
}

#[test]
fn changes_are_kept_if_asked_but_not_the_texts_that_were_loaded() {
    let (mut live, _) = start(false);
    let commands =
        "[[event]]\nat = 0.3\nfail = 6\n\n[[event]]\nat = 0.7\nmove = 7\nto = [300, 200]\n\n";
    steps(&mut live, 3);
    live.request(r#"{"command":{"text":"fail = 6"}}"#, Duration::ZERO);
    ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": format!("{RED}# 2\n") } }));
    steps(&mut live, 4);
    live.request(r#"{"command":{"text":"move = 7\nto = [300, 200]"}}"#, Duration::ZERO);
    let run = json!({ "run": { "texts": { "walk.bzz": RED }, "keep_changes": true } });
    let events = ask(&mut live, run);
    of_kind(&events, "began");
    let run = live.session().run();
    assert_eq!((run.now(), &*run.commands()), (0, commands));
    steps(&mut live, 3);
    assert!(is_red(&live, 0));
    steps(&mut live, 17);
    assert_replays(&mut live);
    // They do not fit a world without these robots, or one that ends before.
    for (old, new, reason) in [
        ("first_id = 6", "first_id = 8", "your change `fail = 6` at 0.3 s does not fit: "),
        ("duration = 10", "duration = 0.5", "your change `move = 7, to = [300, 200]` at 0.7 s"),
    ] {
        let text = SCENARIO.replace(old, new).replace("\nat = 9\n", "\nat = 0\n");
        let run = json!({ "run": { "texts": { "s.toml": text }, "keep_changes": true } });
        let refused = of_kind(&ask(&mut live, run), "refused");
        assert!(refused["text"].as_str().unwrap().starts_with(reason), "{refused}");
        assert_eq!(live.session().run().now(), 20, "the run goes on");
    }
}

#[test]
fn a_run_with_errors_changes_nothing() {
    let (mut live, _) = start(false);
    steps(&mut live, 3);
    let texts = json!({ "walk.bzz": RED, "sub/own.bzz": "function step( {", "late.bzz": "x = )" });
    let events = ask(&mut live, json!({ "run": { "texts": texts } }));
    let refused = of_kind(&events, "refused");
    let reason = "`sub/own.bzz` and `late.bzz` have errors: the robots go on with what they have";
    assert_eq!(refused["text"], reason);
    let wrong = events.iter().filter(|event| event["event"] == "diagnostics");
    let wrong = wrong.map(|event| event["diagnostics"].as_array().unwrap().is_empty());
    assert_eq!(wrong.collect::<Vec<_>>(), [true, false, false]);
    // An expectation about a global that no script has. The editor may show a script.
    let demanding = format!(
        "{SCENARIO}\n[[expect]]\nat = 5\nrobots = 30\nvalue = \"global.hops\"\nequals = 1\n"
    );
    let texts = json!({ "walk.bzz": RED, "s.toml": demanding });
    let refused = of_kind(&ask(&mut live, json!({ "run": { "texts": texts } })), "refused");
    let reason = refused["text"].as_str().unwrap();
    assert!(reason.starts_with("`s.toml` does not fit the scripts: "), "{reason}");
    assert!(reason.contains("`hops`"), "{reason}");
    // A world without room for its robots.
    let crowded = SCENARIO.replace("[800, 600]", "[40, 40]");
    let texts = json!({ "walk.bzz": RED, "s.toml": crowded });
    of_kind(&ask(&mut live, json!({ "run": { "texts": texts } })), "refused");
    assert_eq!(live.session().run().now(), 3);
    for (name, text) in [("walk.bzz", SCRIPT), ("sub/own.bzz", SCRIPT), ("s.toml", SCENARIO)] {
        let shown = answer(&mut live, json!({ "script": { "name": name } }));
        assert_eq!(shown["text"], text);
    }
    steps(&mut live, 20);
    assert_replays(&mut live);
}

#[test]
fn a_text_that_no_robot_got_is_no_draft() {
    let (mut live, _) = start(false);
    steps(&mut live, 1000);
    let events = ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": RED } }));
    let refused = of_kind(&events, "refused");
    assert_eq!(refused["text"], "the run is over");
    let shown = answer(&mut live, json!({ "script": { "name": "walk.bzz" } }));
    assert_eq!(shown["text"], SCRIPT);
}

/// An equal text is the same draft, also if another one was loaded in between.
#[test]
fn the_text_that_was_loaded_last_is_the_last_draft() {
    let (mut live, _) = start(false);
    for text in [RED, SCRIPT, RED] {
        ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": text } }));
        let shown = answer(&mut live, json!({ "script": { "name": "walk.bzz" } }));
        assert_eq!(shown["text"], text);
    }
}

#[test]
fn an_edited_scenario_restarts_the_session() {
    let (mut live, _) = start(false);
    let shown = answer(&mut live, json!({ "script": { "name": "s.toml" } }));
    assert_eq!((&shown["text"], &shown["file"]), (&json!(SCENARIO), &json!("x/s.toml")));
    let wrong = SCENARIO.replace("count = 2", "cuont = 2");
    let event = answer(&mut live, json!({ "check": { "name": "s.toml", "text": wrong } }));
    let found = &event["diagnostics"][0];
    assert_eq!((&found["file"], &found["line"]), (&json!("x/s.toml"), &json!(8)), "{event}");
    assert_eq!((&found["column"], &found["end_column"]), (&json!(1), &json!(6)));
    // The wrong scenario does not run, and the session goes on.
    steps(&mut live, 3);
    let events = ask(&mut live, json!({ "run": { "texts": { "s.toml": wrong } } }));
    of_kind(&events, "refused");
    assert_eq!(live.session().run().now(), 3);
    // A draft that robots run is the script of the next session from its start.
    ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": RED } }));
    let more = SCENARIO.replace("count = 2", "count = 3").replace("duration = 10", "duration = 20");
    let events = ask(&mut live, json!({ "run": { "texts": { "s.toml": more } } }));
    assert_eq!(events[0]["event"], "begin");
    assert_eq!((&events[0]["end"], &events[0]["groups"][0]["count"]), (&json!(200), &json!(3)));
    of_kind(&events, "began");
    assert_eq!(live.session().run().now(), 0);
    assert_eq!([0, 3, 4].map(|robot| is_red(&live, robot)), [true, true, false]);
    assert_eq!(live.session().run().commands(), "");
    let shown = answer(&mut live, json!({ "script": { "name": "s.toml" } }));
    assert_eq!(shown["text"], more);
    // The saved session contains that draft under the name of the script, and has the same course.
    steps(&mut live, 20);
    assert_eq!(saved_files(&mut live), ["late.bzz", "sub/own.bzz", "walk.bzz"]);
    assert_replays(&mut live);
    ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": format!("{RED}# 2\n") } }));
    steps(&mut live, 20);
    assert_replays(&mut live);
}

#[test]
fn the_text_of_a_file_is_shown_next_to_its_draft() {
    let (mut live, _) = start(true);
    let show = json!({ "script": { "name": "walk.bzz" } });
    let script = answer(&mut live, show.clone());
    assert_eq!([&script["text"], &script["saved"]], [SCRIPT, SCRIPT]);
    assert_eq!(script["sha256"], sha256(SCRIPT));
    ask(&mut live, json!({ "load": { "name": "walk.bzz", "text": RED } }));
    let script = answer(&mut live, show.clone());
    assert_eq!([&script["text"], &script["saved"]], [RED, SCRIPT]);
    // The file is not the one that the client has read.
    let over = sha256(RED);
    let request = json!({ "write": { "name": "walk.bzz", "text": RED, "over": over } });
    let changed = json!({
        "event": "changed", "name": "walk.bzz", "saved": SCRIPT, "sha256": sha256(SCRIPT),
    });
    assert_eq!(answer(&mut live, request), changed);
    let over = sha256(SCRIPT);
    let request = json!({ "write": { "name": "walk.bzz", "text": RED, "over": over } });
    assert_eq!(answer(&mut live, request)["event"], "written");
    let script = answer(&mut live, show);
    assert_eq!([&script["text"], &script["saved"]], [RED, RED]);
    // The text of the scenario's file is the one with which the session was opened.
    let more = SCENARIO.replace("count = 2", "count = 3");
    ask(&mut live, json!({ "run": { "texts": { "s.toml": more } } }));
    let script = answer(&mut live, json!({ "script": { "name": "s.toml" } }));
    assert_eq!([&script["text"], &script["saved"]], [more.as_str(), SCENARIO]);
}

/// Notes the texts that it is given, and offers one.
#[derive(Clone, Default)]
struct Notes(Rc<RefCell<Vec<String>>>);

impl UnsavedStore for Notes {
    fn begin(&mut self) {
        self.0.borrow_mut().push("begin".to_owned());
    }

    fn offers(&mut self, file: &Path, saved: &str) -> Vec<KeptText> {
        let offer = || KeptText {
            id: "1".to_owned(),
            seconds: 5,
            over: sha256(saved) + "0",
            text: RED.to_owned(),
        };
        (file == Path::new("x/s.toml")).then(offer).into_iter().collect()
    }

    fn keep(&mut self, file: &Path, _: &str, text: Option<&str>) -> Result<(), String> {
        self.0.borrow_mut().push(format!("{}: {}", file.display(), text.unwrap_or("nothing")));
        if text == Some("") { Err("no room".to_owned()) } else { Ok(()) }
    }

    fn discard(&mut self, id: &str) {
        self.0.borrow_mut().push(format!("discard {id}"));
    }
}

#[test]
fn unsaved_texts_are_kept_and_offered() {
    let notes = Notes::default();
    let mut live = start(false).0.with_unsaved(notes.clone());
    let begin = taken(&mut live)[0].clone();
    let offered = json!([{
        "id": "1", "name": "s.toml", "file": "x/s.toml", "seconds": 5, "changed": true, "text": RED,
    }]);
    assert_eq!(begin["scripts"]["unsaved"], offered);
    let unsaved = |name: &str, text: Option<&str>| json!({ "unsaved": { "name": name, "text": text, "over": "" } });
    for (name, text) in [("sub/own.bzz", Some("a")), ("s.toml", Some("b")), ("walk.bzz", None)] {
        assert!(ask(&mut live, unsaved(name, text)).is_empty());
    }
    let refused = answer(&mut live, unsaved("secret.bzz", Some("c")));
    assert_eq!(refused["text"], "no robot has the script `secret.bzz`");
    // Each text fails in the same way: one report is enough.
    assert_eq!(answer(&mut live, unsaved("walk.bzz", Some("")))["text"], "no room");
    assert!(ask(&mut live, unsaved("walk.bzz", Some(""))).is_empty());
    assert!(ask(&mut live, json!({ "discard": { "id": "1" } })).is_empty());
    let done = ["begin", "x/sub/own.bzz: a", "x/s.toml: b", "x/walk.bzz: nothing"];
    let done = done.into_iter().chain(["x/walk.bzz: ", "x/walk.bzz: ", "discard 1"]);
    assert_eq!(*notes.0.borrow(), done.collect::<Vec<_>>());
}

#[test]
fn messages_are_explained() {
    let (mut live, _) = start(false);
    for code in ["E0201", "W0302", "R0005", "e0201"] {
        let event = answer(&mut live, json!({ "explain": { "code": code } }));
        let text = event["text"].as_str().unwrap();
        assert!(text.starts_with(&format!("## {}", code.to_uppercase())), "{text}");
    }
    let refused = answer(&mut live, json!({ "explain": { "code": "E9999" } }));
    assert_eq!(refused["text"], "there is no message `E9999`");
}
