//! Tests of a session from its client's view.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use bittybuzz_arena::output::recording::{RecordingReader, RecordingSample};
use bittybuzz_arena::run::{Program, Session, Setup, Simulation};
use bittybuzz_arena::scenario::{Group, Scenario};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{Files, IncludeLoader, MemoryFiles};
use bittybuzz_live::{Live, Source};
use serde_json::{Value, json};

use crate::{go_to, taken};

/// In step 5 robot 7 logs, in step 8 it divides by zero.
const SCRIPT: &str = "n = 0 t = {.a = 1, .b = {.c = 2}}\n\
    function step() {\n  n = n + 1\n  if(id == 7 and n == 5) log(\"n is \", n)\n  if(id == 7 and n == 8) led(n / 0)\n  led(n % 8)\n  forward()\n  neighbors.broadcast(\"n\", n)\n}\n";

pub const SCENARIO: &str = "[world]\nsize = [800, 600]\nduration = 10\n\
    obstacles = [{ at = [300, 200], radius = 20 }, { at = [300, -200], size = [20, 10], heading = -45 }]\n\
    ground = [{ at = [-100, 0], size = [50, 20], heading = 30 }, { at = [0, 0], radius = 5, brightness = 0.5 }]\n\
    lights = [[100, 100]]\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\nname = \"pair\"\ncount = 2\nfirst_id = 6\n\n\
    [[expect]]\nat = 2\nrobots = 6\nvalue = \"global.n\"\nequals = 19\n\n\
    [[expect]]\nwithin = 3\nvalue = \"x\"\nbelow = -1000\n\n\
    [output]\nplot = [\"global.n\"]\n\n\
    [medium.ir]\nclock_error = 0\n";

fn files() -> MemoryFiles {
    MemoryFiles::default()
        .with("s.toml", SCENARIO)
        .with("s.bzz", SCRIPT)
        .with("idle.bzz", "function step() { }\n")
        .with("still.bzz", "function step() { led(7) }\n")
        .with("other.bzz", "only_here = 5\nfunction step() { }\n")
}

fn program(files: &MemoryFiles, script: &Path, group: &Group) -> Result<Program, String> {
    let robots = bittybuzz_robot_files::all_shipped();
    let options = Options { robot: Some((*group.robot).clone()), robots, ..Options::default() };
    let text = files.read(script, 10_000).map_err(|error| error.to_string())?;
    let text = String::from_utf8(text).unwrap();
    let compiled = compile(script, text, &IncludeLoader::new(files), &options);
    let (symbols, sources) = (compiled.symbols, Arc::new(compiled.sources));
    let program = compiled.image.map(|image| Program::new(image, symbols, sources));
    program.ok_or_else(|| compiled.diagnostics[0].message.clone())
}

fn live() -> Live {
    live_of(SCENARIO)
}

pub fn live_of(text: &str) -> Live {
    live_in(files(), text)
}

fn live_in(files: MemoryFiles, text: &str) -> Live {
    let (files, models) = (files.with("s.toml", text), bittybuzz_robot_models::all());
    let scenario = Scenario::open_in(&files, "s.toml".as_ref(), &[], &models).unwrap();
    let own = scenario.scripts().map(|(group, script)| program(&files, script, group));
    let programs: Vec<Program> = own.collect::<Result<_, _>>().unwrap();
    let compiler = Arc::new(move |script: &Path, group: &Group| program(&files, script, group));
    let setup = Setup::new(scenario, programs).unwrap().with_compiler(compiler);
    let session = Session::new(Simulation::new(Arc::new(setup), 1, 1).unwrap(), 10);
    Live::new(session, text.to_owned())
}

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// Simulates at most `most` ticks. Returns true if some are still due.
fn advance(live: &mut Live, most: u64, now: Duration) -> bool {
    let mut ticks = 0..most;
    live.advance(now, &mut || ticks.next().is_some())
}

fn now(live: &Live) -> u64 {
    live.session().run().now()
}

/// Takes all events and returns those of a kind.
fn events(live: &mut Live, kind: &str) -> Vec<Value> {
    let of_kind = |event: &Value| event["event"] == kind;
    taken(live).into_iter().filter(of_kind).collect()
}

/// Takes all events and returns the reason of the only refusal.
fn refusal(live: &mut Live) -> String {
    let events = events(live, "refused");
    assert_eq!(events.len(), 1, "{events:?}");
    events[0]["text"].as_str().unwrap().to_owned()
}

/// Takes a sample as a client would that has the bytes `known` already.
fn sample(live: &mut Live, known: &mut Vec<u8>) -> RecordingSample {
    let bytes = live.take_sample();
    if bytes.starts_with(b"bbzrec") {
        known.clear();
    }
    known.extend(bytes);
    let mut reader = RecordingReader::new(known).unwrap();
    let mut last = None;
    // A stream has no end mark, so after the last sample the reader reports a truncated recording.
    while let Some(Ok(sample)) = reader.next() {
        last = Some(sample);
    }
    last.unwrap()
}

/// The disc is in front of robot 6, which pushes it to the right. Back at the start, the disc is where it was.
#[test]
fn samples_have_the_places_of_movable_discs() {
    let text = SCENARIO
        .replace(
            "obstacles = [",
            "obstacles = [{ at = [50, 0], radius = 30, height = 40, movable = true }, ",
        )
        .replace("count = 2", "positions = [[0, 0], [-200, 0]]\nheading = 0");
    let mut live = live_of(&text);
    let begin = &taken(&mut live)[0];
    assert_eq!(begin["movables"], json!([{ "radius": 30.0, "height": 40.0 }]));
    assert_eq!(begin["obstacles"].as_array().unwrap().len(), 2);
    let mut known = Vec::new();
    assert_eq!(sample(&mut live, &mut known).movables, [[500, 0]]);
    go_to(&mut live, 90);
    advance(&mut live, 200, ms(0));
    let pushed = sample(&mut live, &mut known).movables[0];
    // 3.5 mm of room, then half of the way: about 10 mm/s.
    assert!(pushed[0] > 700 && pushed[0] < 1100, "{pushed:?}");
    go_to(&mut live, 0);
    advance(&mut live, 200, ms(0));
    assert_eq!(sample(&mut live, &mut known).movables, [[500, 0]]);
}

#[test]
fn the_first_event_is_the_world() {
    let mut live = live();
    let events = taken(&mut live);
    let begin = &events[0];
    assert_eq!((&begin["event"], &begin["size"]), (&json!("begin"), &json!([800.0, 600.0])));
    assert_eq!((&begin["end"], &begin["seed"]), (&json!(100), &json!(1)));
    let group = &begin["groups"][0];
    assert_eq!((&group["name"], &group["count"]), (&json!("pair"), &json!(2)));
    // kilobot_measures.h of argos3-kilobot: 16.5 mm.
    assert_eq!((&group["first_id"], &group["radius"]), (&json!(6), &json!(16.5)));
    assert_eq!(
        begin["obstacles"],
        json!([
            { "at": [300.0, 200.0], "radius": 20.0, "height": null },
            { "at": [300.0, -200.0], "size": [20.0, 10.0], "heading": -45.0, "height": null },
        ])
    );
    assert_eq!(
        begin["ground"],
        json!([
            { "at": [-100.0, 0.0], "size": [50.0, 20.0], "heading": 30.0, "brightness": 0.0 },
            { "at": [0.0, 0.0], "radius": 5.0, "brightness": 0.5 },
        ])
    );
    assert_eq!(begin["lights"][0]["at"], json!([100.0, 100.0]));
    assert_eq!(begin["media"], json!([{ "name": "ir", "loss": null }]));
    assert_eq!(begin["commands"], json!([]));
    assert_eq!(begin["expectations"].as_array().unwrap().len(), 2);
    let state = json!({ "event": "state", "tick": 0, "plays": false, "rate": null, "over": false });
    assert_eq!(events[1], state);
    assert_eq!(events.len(), 2);
}

#[test]
fn a_run_follows_the_clock_at_its_rate() {
    let mut live = live();
    assert!(!advance(&mut live, 100, ms(500)), "it stands still");
    live.request(r#"{"play":{"rate":2}}"#, ms(1000));
    // 0.45 s at twice the real time are 0.9 s, at ten ticks per second.
    assert!(!advance(&mut live, 100, ms(1450)));
    assert_eq!(now(&live), 9);
    live.request(r#""pause""#, ms(1450));
    advance(&mut live, 100, ms(9000));
    assert_eq!(now(&live), 9);
    live.request(r#"{"step":{"ticks":3}}"#, ms(9000));
    assert!(advance(&mut live, 2, ms(9000)), "one is left");
    assert!(!advance(&mut live, 2, ms(9000)));
    assert_eq!(now(&live), 12);
    live.request(r#"{"play":{}}"#, ms(9000));
    assert!(advance(&mut live, 10, ms(9000)));
    assert_eq!(now(&live), 22);
    live.take_events();
    assert!(!advance(&mut live, 1000, ms(9000)));
    let state =
        json!({ "event": "state", "tick": 100, "plays": false, "rate": null, "over": true });
    assert_eq!(taken(&mut live).last(), Some(&state));
}

/// A computer that is too slow for a rate falls back, and does not catch up afterwards.
#[test]
fn a_run_that_is_late_skips_the_lost_time() {
    let mut live = live();
    live.request(r#"{"play":{"rate":1}}"#, ms(0));
    assert!(!advance(&mut live, 5, ms(2000)), "twenty were due, and are not any more");
    assert_eq!(now(&live), 5);
    advance(&mut live, 5, ms(2100));
    assert_eq!(now(&live), 6);
}

#[test]
fn samples_are_a_recording() {
    let (mut live, mut known) = (live(), Vec::new());
    let first = sample(&mut live, &mut known);
    live.request(r#"{"step":{"ticks":7}}"#, ms(0));
    advance(&mut live, 100, ms(0));
    let second = sample(&mut live, &mut known);
    assert_eq!((first.tick, second.tick), (0, 7));
    assert_eq!(second.robots[0].unwrap().led, 6);
    assert_ne!(first.robots[0].unwrap().x, second.robots[0].unwrap().x);
    // A step back starts a new recording.
    go_to(&mut live, 3);
    let third = sample(&mut live, &mut known);
    assert_eq!((third.tick, third.robots[1].unwrap().led), (3, 2));
    // So does a new client.
    live.begin();
    assert!(live.take_sample().starts_with(b"bbzrec"));
}

#[test]
fn faults_and_log_lines_are_queued_until_the_client_takes_them() {
    let mut live = live();
    live.take_events();
    live.request(r#"{"play":{}}"#, ms(0));
    advance(&mut live, 30, ms(0));
    let all = taken(&mut live);
    let of = |kind: &str| all.iter().find(|event| event["event"] == kind).unwrap();
    let line = json!({ "tick": 5, "robot": 1, "text": "n is 5" });
    let logs = json!({ "event": "logs", "lost": 0, "lines": [line] });
    assert_eq!(of("logs"), &logs);
    let fault = of("fault");
    assert_eq!((&fault["tick"], &fault["robot"]), (&json!(8), &json!(1)));
    assert_eq!((&fault["code"], &fault["consequence"]), (&json!("R0005"), &json!("pause")));
    let place = &fault["places"][0];
    assert_eq!((&place["file"], &place["line"]), (&json!("s.bzz"), &json!(5)));
    assert_eq!(place["function"], "step");
    let verdicts: Vec<&Value> = all.iter().filter(|e| e["event"] == "expectation").collect();
    assert_eq!((verdicts.len(), &verdicts[0]["verdict"]), (2, &json!("held")));
    // `at = 2`, and the end of `within = 3`.
    assert_eq!((&verdicts[0]["tick"], &verdicts[1]["tick"]), (&json!(20), &json!(30)));
    assert_eq!((&verdicts[1]["number"], &verdicts[1]["verdict"]), (&json!(1), &json!("failed")));
}

/// A client that takes nothing costs no memory: of 3,000 lines it gets the newest, and one state.
#[test]
fn lines_that_a_client_does_not_take_are_counted() {
    let script = "n = 0\nfunction step() { n = n + 1 log(n) log(0 - n) }\n";
    let text = SCENARIO.replace("duration = 10", "duration = 60");
    let mut live = live_in(files().with("s.bzz", script), &text);
    live.take_events();
    for tick in 0..300 {
        live.request(r#"{"step":{"ticks":1}}"#, ms(tick));
        advance(&mut live, 1, ms(tick));
    }
    assert_eq!(now(&live), 300);
    let all = taken(&mut live);
    let logs: Vec<&Value> = all.iter().filter(|event| event["event"] == "logs").collect();
    let count = |logs: &Value| logs["lines"].as_array().unwrap().len() as u64;
    let lost: u64 = logs.iter().map(|logs| logs["lost"].as_u64().unwrap()).sum();
    assert_eq!(logs.iter().copied().map(count).sum::<u64>(), 500);
    assert_eq!(lost + 500, 2 * 2 * (now(&live) - 1));
    let last = logs.last().unwrap()["lines"].as_array().unwrap().last().unwrap();
    assert_eq!(last["tick"], now(&live) - 1);
}

/// The ticks of the lines that events have, and those of faults.
fn reported(all: &[Value]) -> (Vec<u64>, Vec<u64>) {
    let of = |kind: &'static str| all.iter().filter(move |event| event["event"] == kind);
    let tick = |one: &Value| one["tick"].as_u64().unwrap();
    let lines = of("logs").flat_map(|logs| logs["lines"].as_array().unwrap());
    (lines.map(tick).collect(), of("fault").map(tick).collect())
}

fn way_to(live: &mut Live, tick: u64) -> Vec<Value> {
    live.request(&json!({ "go_to": { "tick": tick } }).to_string(), ms(0));
    while advance(live, 100, ms(0)) {}
    assert_eq!(now(live), tick);
    taken(live)
}

/// A client forgets what comes after the tick to which the run goes back.
#[test]
fn lines_and_faults_of_a_way_are_sent() {
    let mut live = live();
    live.take_events();
    // The line is of tick 5, the fault of tick 8.
    assert_eq!(reported(&way_to(&mut live, 7)), (vec![5], vec![]));
    assert_eq!(reported(&way_to(&mut live, 20)), (vec![], vec![8]));
    assert_eq!(reported(&way_to(&mut live, 6)), (vec![], vec![]));
    assert_eq!(reported(&way_to(&mut live, 20)), (vec![], vec![8]));
    assert_eq!(reported(&way_to(&mut live, 0)), (vec![], vec![]));
    // Ticks that the client sees once more, and others.
    live.request(r#"{"step":{"ticks":6}}"#, ms(0));
    advance(&mut live, 6, ms(0));
    assert_eq!(reported(&taken(&mut live)), (vec![5], vec![]));
    assert_eq!(reported(&way_to(&mut live, 22)), (vec![], vec![8]));
    // A client that comes later.
    live.begin();
    assert_eq!(reported(&taken(&mut live)), (vec![5], vec![8]));
    // A way that is ended.
    let mut live = self::live();
    live.take_events();
    live.request(r#"{"go_to":{"tick":20}}"#, ms(0));
    advance(&mut live, 6, ms(0));
    live.request("\"pause\"", ms(0));
    assert_eq!((now(&live), reported(&taken(&mut live))), (6, (vec![5], vec![])));
}

/// After a command, the run goes another way from its tick on.
#[test]
fn lines_of_another_way_are_not_sent() {
    let mut live = live();
    live.take_events();
    way_to(&mut live, 20);
    way_to(&mut live, 3);
    // The robot that logs and fails.
    live.request(r#"{"command":{"text":"stop = 7"}}"#, ms(0));
    assert_eq!(reported(&way_to(&mut live, 20)), (vec![], vec![]));
    live.request("\"undo\"", ms(0));
    while advance(&mut live, 100, ms(0)) {}
    assert_eq!((now(&live), reported(&taken(&mut live))), (20, (vec![5], vec![8])));
}

#[test]
fn the_last_lines_before_a_tick_are_sent() {
    let script = "n = 0\nfunction step() { n = n + 1 log(n) log(0 - n) }\n";
    let text = SCENARIO.replace("duration = 10", "duration = 60");
    let mut live = live_in(files().with("s.bzz", script), &text);
    live.take_events();
    let lost = |all: &[Value]| -> u64 {
        let logs = all.iter().filter(|event| event["event"] == "logs");
        logs.map(|logs| logs["lost"].as_u64().unwrap()).sum()
    };
    // Two robots log two lines in each tick from 1 on.
    let all = way_to(&mut live, 301);
    assert_eq!((lost(&all), reported(&all).0), (700, (176..301).flat_map(|t| [t; 4]).collect()));
    // The client has dropped those before tick 176.
    let all = way_to(&mut live, 101);
    let kinds: Vec<&Value> = all.iter().map(|event| &event["event"]).collect();
    let at = |kind: &str| kinds.iter().position(|one| *one == kind).unwrap();
    assert!(at("log_cleared") < at("logs"), "{kinds:?}");
    assert_eq!((lost(&all), reported(&all).0), (0, (1..101).flat_map(|t| [t; 4]).collect()));
    let all = way_to(&mut live, 111);
    assert_eq!((lost(&all), reported(&all).0), (0, (101..111).flat_map(|t| [t; 4]).collect()));
}

/// Of 48,000 lines the session keeps the last 20,000. The client is told that others are left out.
#[test]
fn lines_that_had_no_room_are_counted() {
    let script = "n = 0\nfunction step() { n = n + 1 i = 0 while(i < 40) { i = i + 1 log(i) } }\n";
    let text = SCENARIO.replace("duration = 10", "duration = 60");
    let mut live = live_in(files().with("s.bzz", script), &text);
    live.take_events();
    let all = way_to(&mut live, 600);
    let lost = |all: &[Value]| -> u64 {
        let logs = all.iter().filter(|event| event["event"] == "logs");
        logs.map(|logs| logs["lost"].as_u64().unwrap()).sum()
    };
    let (lines, _) = reported(&all);
    assert_eq!((lines.len(), lines.last()), (500, Some(&599)));
    let count = lost(&all) + 500;
    assert!(count > 40_000, "{count} lines");
    // The lines of this time are gone, and were not forgotten in silence.
    let all = way_to(&mut live, 20);
    assert_eq!((reported(&all).0.len(), lost(&all)), (0, count - 20_000));
    let all = way_to(&mut live, 30);
    assert_eq!((reported(&all).0.len(), lost(&all)), (0, count - 20_000));
    // A step shows its lines again.
    live.request(r#"{"step":{"ticks":1}}"#, ms(0));
    advance(&mut live, 1, ms(0));
    assert!(reported(&taken(&mut live)).0.iter().all(|tick| *tick == 30));
}

/// The way to a tick is made of turns, which say how long it takes, and which a client may end.
#[test]
fn a_long_way_to_a_tick_says_how_long_it_takes() {
    let mut live = live();
    live.take_events();
    live.request(r#"{"go_to":{"tick":40}}"#, ms(0));
    assert!(advance(&mut live, 10, ms(0)));
    assert!(events(&mut live, "seeking").is_empty(), "the way has just begun");
    assert!(advance(&mut live, 10, ms(1000)));
    let seeking = json!({ "event": "seeking", "tick": 40, "left": 1.0 });
    assert_eq!(events(&mut live, "seeking"), [seeking]);
    // Requests that are about no time are answered.
    live.request("{\"explain\":{\"code\":\"E0201\"}}", ms(1000));
    assert_eq!(events(&mut live, "explanation").len(), 1);
    // A command waits until the run is there, and acts nowhere if it does not get there.
    let fail = json!({ "command": { "text": "fail = 6" } }).to_string();
    live.request(&fail, ms(1000));
    live.request("\"pause\"", ms(1000));
    assert!(!advance(&mut live, 10, ms(1001)));
    let left = taken(&mut live);
    let kinds: Vec<&Value> = left.iter().map(|event| &event["event"]).collect();
    assert_eq!(
        (now(&live), &kinds[..]),
        (20, &["refused", "logs", "fault", "state"].map(Value::from).each_ref()[..])
    );
    assert_eq!(left[3]["tick"], 20);
    // Another way replaces the first, and the state follows its end.
    live.request(r#"{"go_to":{"tick":40}}"#, ms(2000));
    advance(&mut live, 1, ms(2000));
    live.request(r#"{"go_to":{"tick":30}}"#, ms(2000));
    assert!(!advance(&mut live, 100, ms(2000)));
    let states = events(&mut live, "state");
    assert_eq!(
        (states.len(), &states[0]["tick"], &states[0]["plays"]),
        (1, &json!(30), &json!(false))
    );
    // Requests that wait are carried out in their order.
    live.request(r#"{"go_to":{"tick":40}}"#, ms(3000));
    live.request(&fail, ms(3000));
    live.request(r#"{"go_to":{"tick":10}}"#, ms(3000));
    live.request(r#"{"step":{"ticks":2}}"#, ms(3000));
    while advance(&mut live, 5, ms(3000)) {}
    let commands: Vec<(u64, &str)> = live.session().run().command_list().collect();
    assert_eq!((now(&live), &commands[..]), (12, &[(40, "fail = 6")][..]));
    let all = taken(&mut live);
    let states: Vec<&Value> =
        all.iter().filter(|event| event["event"] == "state").map(|event| &event["tick"]).collect();
    assert_eq!(states, [&json!(40), &json!(12)]);
}

#[test]
fn an_inspection_names_the_memory_of_a_robot() {
    let mut live = live();
    live.request(r#"{"step":{"ticks":4}}"#, ms(0));
    advance(&mut live, 100, ms(0));
    live.request(r#"{"inspect":{"robot":1}}"#, ms(0));
    let answer = events(&mut live, "inspection");
    let memory = &answer[0]["memory"];
    let globals = memory["globals"].as_array().unwrap();
    let global = |name: &str| &globals.iter().find(|pair| pair[0] == name).unwrap()[1];
    assert_eq!(global("n"), 3);
    let table = &memory["objects"][global("t")["table"].to_string()]["entries"];
    assert_eq!(table[0], json!(["a", 1]));
    assert!(memory["slots"]["free"].as_u64().unwrap() > 0);
    // The event follows each sample until the client unsubscribes.
    live.take_sample();
    assert_eq!(events(&mut live, "inspection").len(), 1);
    live.request(r#"{"inspect":{"robot":null}}"#, ms(0));
    live.take_sample();
    assert!(events(&mut live, "inspection").is_empty());
}

#[test]
fn commands_are_listed() {
    let (mut live, mut known) = (live(), Vec::new());
    live.request(r#"{"command":{"text":"load = 6\nscript = \"still.bzz\""}}"#, ms(0));
    live.request(r#"{"step":{"ticks":5}}"#, ms(0));
    advance(&mut live, 100, ms(0));
    assert_eq!(sample(&mut live, &mut known).robots[0].unwrap().led, 7);
    live.take_events();
    live.request(r#""commands""#, ms(0));
    let answer = events(&mut live, "commands");
    let event = "[[event]]\nat = 0\nload = 6\nscript = \"still.bzz\"\n";
    assert_eq!(answer[0]["text"], format!("{event}\n"));
    live.request(r#""scenario""#, ms(0));
    let answer = events(&mut live, "scenario");
    assert_eq!(answer[0]["text"], format!("{SCENARIO}\n{event}"));
}

/// Two Crazyflies in the wind, whose cameras exchange their labels.
const FLIGHT: &str = "[world]\nsize = [4000, 4000]\nduration = 10\n\n\
    [body.crazyflie]\narmed = true\nfidelity = \"flight\"\npositioning = \"capture\"\n\
    wind = 1500\nwind_direction = 45\nlatency = 60\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"still.bzz\"\nname = \"ground\"\ncount = 1\nat = [900, 900]\n\n\
    [[robots]]\nrobot = \"crazyflie\"\nscript = \"idle.bzz\"\nname = \"air\"\ncount = 2\nplacement = \"line\"\nspacing = 1000\n\n\
    [[event]]\nat = 0.1\ndisplace = \"air\"\nby = [200, -50]\n\n\
    [[event]]\nat = 0.2\nrelabel = [1, 2]\n";

#[test]
fn wrong_poses_and_unusual_surroundings_reach_the_client() {
    let mut live = live_of(FLIGHT);
    let begin = events(&mut live, "begin");
    let groups = &begin[0]["groups"];
    assert_eq!(groups[0]["surroundings"], json!([]));
    let key = |key, value: f64, unit| json!({ "key": key, "value": value, "unit": unit });
    let keys = [
        key("wind", 1500.0, "mm/s"),
        key("wind_direction", 45.0, "degrees"),
        key("latency", 60.0, "ms"),
    ];
    assert_eq!(groups[1]["surroundings"], json!(keys));
    assert_eq!(begin[0]["pose_errors"], json!([]));
    live.request(r#"{"step":{"ticks":2}}"#, ms(0));
    advance(&mut live, 2, ms(0));
    let displaced = |robot, seen_as: Option<usize>| json!({ "robot": robot, "displaced": [200.0, -50.0], "seen_as": seen_as });
    let shown = events(&mut live, "conditions");
    let last = &shown.last().unwrap()["pose_errors"];
    assert_eq!(*last, json!([displaced(1, None), displaced(2, None)]));
    live.request(r#"{"step":{"ticks":1}}"#, ms(0));
    advance(&mut live, 1, ms(0));
    let shown = events(&mut live, "conditions");
    assert_eq!(shown[0]["pose_errors"], json!([displaced(1, Some(2)), displaced(2, Some(1))]));
}

#[test]
fn a_change_of_lamps_is_an_event() {
    let mut live = live();
    live.take_events();
    live.request(r#"{"command":{"text":"light = [{ at = [5, 6], brightness = 7 }]"}}"#, ms(0));
    let command = json!([{ "tick": 0, "text": "light = [{ at = [5, 6], brightness = 7 }]" }]);
    let changed = events(&mut live, "conditions");
    assert_eq!((changed.len(), &changed[0]["commands"]), (1, &command));
    assert_eq!(changed[0]["lights"][0]["at"], json!([100.0, 100.0]));
    live.request(r#"{"step":{"ticks":1}}"#, ms(0));
    advance(&mut live, 1, ms(0));
    let changed = events(&mut live, "conditions");
    assert_eq!(changed[0]["lights"], json!([{ "at": [5.0, 6.0], "brightness": 7.0 }]));
    go_to(&mut live, 0);
    assert_eq!(events(&mut live, "conditions")[0]["lights"][0]["at"], json!([100.0, 100.0]));
}

#[test]
fn the_digest_of_a_tick_is_equal_after_a_step_back() {
    let mut live = live();
    let mut digest_at = |tick: u64| {
        go_to(&mut live, tick);
        live.request(r#""digest""#, ms(0));
        let event = events(&mut live, "digest").pop().unwrap();
        assert_eq!(event["tick"], tick);
        event["digest"].as_str().unwrap().to_owned()
    };
    let (first, later) = (digest_at(30), digest_at(60));
    assert_ne!(first, later);
    assert_eq!((digest_at(30), digest_at(60)), (first, later));
}

#[test]
fn an_inspection_has_the_fault_of_the_robot() {
    let mut live = live();
    live.request(r#"{"inspect":{"robot":1}}"#, ms(0));
    assert_eq!(events(&mut live, "inspection")[0]["fault"], Value::Null);
    go_to(&mut live, 10);
    live.take_sample();
    let fault = &events(&mut live, "inspection")[0]["fault"];
    assert_eq!((&fault["code"], &fault["tick"]), (&json!("R0005"), &json!(8)));
    assert_eq!(fault["places"][0]["line"], 5);
}

#[test]
fn messages_and_quantities_follow_each_sample() {
    let mut live = live();
    // The robots are in range of each other, and move in parallel.
    for command in ["move = 6\nto = [0, 0]\nheading = 0", "move = 7\nto = [0, 50]\nheading = 0"] {
        live.request(&json!({ "command": { "text": command } }).to_string(), ms(0));
    }
    live.request(r#"{"watch":{"messages":true,"quantity":null}}"#, ms(0));
    live.request(r#"{"step":{"ticks":30}}"#, ms(0));
    advance(&mut live, 30, ms(0));
    live.take_sample();
    let messages = events(&mut live, "messages").remove(0);
    // There are only two robots, so each frame that arrives comes from the other one.
    let heard = messages["heard"].as_array().unwrap();
    assert!(heard.contains(&json!([0, 1])) && heard.contains(&json!([1, 0])), "{messages}");
    assert!(heard.iter().all(|pair| pair[0] != pair[1]));
    live.take_sample();
    assert_eq!(events(&mut live, "messages")[0]["heard"], json!([]), "each message is sent once");
    live.request(r#"{"watch":{"messages":false,"quantity":"global.n"}}"#, ms(0));
    live.take_sample();
    let last = taken(&mut live);
    let of = |kind: &str| last.iter().filter(|event| event["event"] == kind).count();
    assert_eq!((of("messages"), of("quantity")), (0, 1));
    let quantity = last.iter().find(|event| event["event"] == "quantity").unwrap();
    // Robot 7 had a fault in its step 8 and has restarted.
    assert_eq!(quantity["values"][0], 29.0);
    for (quantity, reason) in
        [("global.m", "no script has a global `m`"), ("sped", "there is no quantity `sped`")]
    {
        let watch = json!({ "watch": { "messages": false, "quantity": quantity } });
        live.request(&watch.to_string(), ms(0));
        assert_eq!(refusal(&mut live), reason);
    }
    live.take_sample();
    assert_eq!(events(&mut live, "quantity").len(), 1, "the wish before still holds");
}

#[test]
fn a_global_of_a_loaded_script_can_be_watched() {
    let mut live = live();
    let load = json!({ "command": { "text": "load = 6\nscript = \"other.bzz\"" } });
    live.request(&load.to_string(), ms(0));
    live.request(r#"{"step":{"ticks":10}}"#, ms(0));
    advance(&mut live, 10, ms(0));
    live.take_events();
    live.request(r#"{"watch":{"messages":false,"quantity":"global.only_here"}}"#, ms(0));
    live.take_sample();
    assert_eq!(events(&mut live, "quantity")[0]["values"], json!([5.0, null]));
}

#[test]
fn a_client_can_choose_from_quantities() {
    let begin = taken(&mut live()).remove(0);
    let quantities = &begin["quantities"];
    assert_eq!(quantities["plot"], json!(["global.n"]));
    assert_eq!(quantities["global"], json!(["global.n", "global.t"]), "no functions");
    let robot = quantities["robot"].as_array().unwrap();
    assert!(robot.contains(&json!("led")) && !robot.contains(&json!("global.NAME")), "{robot:?}");
    assert!(quantities["swarm"].as_array().unwrap().contains(&json!("swarm.spread")));
}

#[test]
fn a_run_that_is_played_at_its_end_starts_again() {
    let mut live = live();
    live.request(r#"{"command":{"text":"fail = 6"}}"#, ms(0));
    live.request(r#"{"play":{}}"#, ms(0));
    advance(&mut live, 1000, ms(0));
    assert_eq!(now(&live), 100);
    live.take_events();
    live.request(r#"{"play":{"rate":1}}"#, ms(5000));
    // The verdicts are open again, and the commands act again.
    let all = taken(&mut live);
    let open = |event: &&Value| event["event"] == "expectation" && event["verdict"] == "open";
    assert_eq!(all.iter().filter(open).count(), 2, "{all:?}");
    let state = json!({ "event": "state", "tick": 0, "plays": true, "rate": 1.0, "over": false });
    assert_eq!(all.last(), Some(&state));
    advance(&mut live, 1000, ms(5300));
    assert_eq!(now(&live), 3);
    assert!(live.session().run().commands().contains("fail = 6"));
}

/// Each command that the page can give is refused at the end with a sentence that says what to do.
#[test]
fn commands_at_the_end_are_refused_with_advice() {
    let mut live = live();
    go_to(&mut live, 100);
    let commands = [
        "fail = 6",
        "stop = 6",
        "resume = 6",
        "restart = 6",
        "block = [6, \"all\"]",
        "restore = [6, \"all\"]",
        "move = 6\nto = [0, 0]",
        "light = []",
        "loss = 0.5",
        "partition = [[6]]",
        "heal = true",
        "set = \"all\"\nglobal = \"n\"\nnumber = 3",
        "load = 6\nscript = \"still.bzz\"",
    ];
    for command in commands {
        live.take_events();
        live.request(&json!({ "command": { "text": command } }).to_string(), ms(0));
        let refused = events(&mut live, "refused");
        let [refused] = &refused[..] else { panic!("{command}: {refused:?}") };
        let text = "the run is over";
        let help = "go back, or start the run again";
        assert_eq!((&refused["text"], &refused["help"]), (&json!(text), &json!(help)));
    }
}

#[test]
fn an_invalid_request_is_refused_and_changes_nothing() {
    let mut live = live();
    live.take_events();
    let digest = live.session().run().digest();
    for (request, reason) in [
        ("", "the request makes no sense"),
        ("[]", "the request makes no sense"),
        (r#""dance""#, "unknown variant `dance`"),
        (r#"{"step":{}}"#, "missing field `ticks`"),
        (r#"{"pause":1,"commands":2}"#, "the request makes no sense"),
        (r#"{"step":{"ticks":-1}}"#, "the request makes no sense"),
        (r#"{"play":{"rate":0}}"#, "0 cannot be `rate`"),
        (r#"{"play":{"rate":1e9}}"#, "1000000000 cannot be `rate`"),
        (r#"{"play":{"speed":2}}"#, "unknown field `speed`"),
        (r#"{"inspect":{"robot":2}}"#, "there is no robot with the number 2"),
        (r#"{"command":{"text":"fail = 2"}}"#, "there is no robot 2"),
        (r#"{"command":{"text":"load = 6\nscript = \"none.bzz\""}}"#, "cannot be loaded"),
    ] {
        live.request(request, ms(0));
        let reason_given = refusal(&mut live);
        assert!(reason_given.contains(reason), "{request}: {reason_given}");
    }
    advance(&mut live, 100, ms(10_000));
    assert_eq!((now(&live), live.session().run().digest()), (0, digest));
    assert_eq!(live.session().run().commands(), "");
}
