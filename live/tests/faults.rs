//! Faults of scripts from a client's view: their message, their values, the pause of the run, and the
//! memory at that moment.

use std::time::Duration;

use bittybuzz_arena::run::Session;
use bittybuzz_live::{Live, SharedFiles, Shelf, Source};
use serde_json::{Value, json};

use crate::{go_to, taken};

/// Robot 4 reads past the end of its table in its tenth step, in tick 10.
const SCRIPT: &str = "\
include \"part.bzz\"
values = {.0 = 10, .1 = 20}
n = 0
function step() {
  n = n + 1
  if(id == 4 and n == 10) led(average(2))
  if(id == 5 and n == 10) led(n / 0)
  if(id == 5 and n == 15) outside(nil)
}
function average(last) {
  var total = 0
  for(i = 0, i <= last, i = i + 1) total = total + values[i]
  return total / last
}
";

const PART: &str = "function outside(x) { return x + 1 }\n";

const SCENARIO: &str = "[world]\nsize = [800, 600]\nduration = 10\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\nclock_skew = 0\ncount = 6\n";

const ASSIGNMENT: &str = "\n[assignment]\ntitle = \"Walk\"\ntext = \"Walk.\"\n";

/// A session whose files have absolute paths.
fn start(scenario: &str) -> Live {
    let files = SharedFiles::default();
    files.add("/home/ada/class/s.toml", scenario);
    files.add("/home/ada/class/walk.bzz", SCRIPT);
    files.add("/home/ada/class/part.bzz", PART);
    let shelf = Shelf::new(files, "/home/ada/class/s.toml".into());
    let (run, text) = shelf.open(1).unwrap();
    let mut live = Live::new(Session::new(run, 10), text).with_workshop(shelf);
    live.take_events();
    live
}

fn ask(live: &mut Live, request: Value) -> Vec<Value> {
    live.request(&request.to_string(), Duration::ZERO);
    let mut ticks = 0..60;
    live.advance(Duration::ZERO, &mut || ticks.next().is_some());
    taken(live)
}

fn of_kind<'a>(events: &'a [Value], kind: &str) -> Vec<&'a Value> {
    events.iter().filter(|event| event["event"] == kind).collect()
}

fn now(live: &Live) -> u64 {
    live.session().run().now()
}

#[test]
fn a_fault_has_its_message_values_help_and_place() {
    let mut live = start(SCENARIO);
    let events = ask(&mut live, json!({ "step": { "ticks": 20 } }));
    let fault = of_kind(&events, "fault")[0];
    assert_eq!((&fault["robot"], &fault["tick"]), (&json!(4), &json!(10)));
    assert_eq!(fault["message"], "cannot add an integer and nil: `values[i]` is nil");
    assert!(fault["help"].as_str().unwrap().contains("never assigned"));
    let values = json!([
        { "name": "total", "value": "30" },
        { "name": "values[i]", "value": "nil" },
        { "name": "i", "value": "2" },
        { "name": "values", "value": "{.0 = 10, .1 = 20}" },
    ]);
    assert_eq!(fault["values"], values);
    let [inner, outer] = fault["places"].as_array().unwrap().as_slice() else { panic!("{fault}") };
    assert_eq!((&inner["file"], &inner["script"]), (&json!("walk.bzz"), &json!("walk.bzz")));
    assert_eq!((&inner["line"], &inner["function"]), (&json!(12), &json!("average")));
    assert!(inner["text"].as_str().unwrap().ends_with("total = total + values[i]"));
    assert_eq!((&outer["line"], &outer["function"]), (&json!(6), &json!("step")));
}

/// The client can edit the script, but not what it includes.
#[test]
fn a_place_in_an_included_file_names_no_script() {
    let mut live = start(SCENARIO);
    let draft = SCRIPT.replace("if(id == 5 and n == 10) led(n / 0)", "");
    let draft = json!({ "load": { "name": "walk.bzz", "text": draft } });
    live.request(&draft.to_string(), Duration::ZERO);
    let events = ask(&mut live, json!({ "step": { "ticks": 17 } }));
    let last = of_kind(&events, "fault").pop().unwrap();
    let places = &last["places"];
    assert_eq!((&places[0]["file"], &places[0]["script"]), (&json!("part.bzz"), &Value::Null));
    // The caller is in a draft, which the editor shows as the script.
    assert_eq!(places[1]["script"], "walk.bzz", "{last}");
    assert!(!last.to_string().contains("/home/ada"), "{last}");
}

#[test]
fn a_run_stops_at_an_error_if_it_is_asked_to() {
    let mut live = start(SCENARIO);
    let events = ask(&mut live, json!({ "play": {} }));
    assert_eq!((of_kind(&events, "stopped").len(), now(&live)), (0, 60));
    go_to(&mut live, 0);
    live.request(&json!({ "stop_on_error": { "on": true } }).to_string(), Duration::ZERO);
    live.take_events();
    let events = ask(&mut live, json!({ "play": {} }));
    // The fault is in the 100 ms after tick 10.
    assert_eq!(now(&live), 11);
    let stopped = of_kind(&events, "stopped");
    assert_eq!((stopped.len(), &stopped[0]["others"]), (1, &json!(1)));
    assert_eq!(stopped[0]["fault"]["robot"], 4);
    assert_eq!(stopped[0]["fault"]["places"][0]["line"], 12);
    // It comes after the event that the run stands still.
    let last: Vec<&Value> = events.iter().rev().take(2).collect();
    assert_eq!((&last[0]["event"], &last[1]["event"]), (&json!("stopped"), &json!("state")));
    assert_eq!(last[1]["plays"], false);
    // Both go on, until the next fault: the pause takes a second, and step 10 comes again.
    let events = ask(&mut live, json!({ "play": {} }));
    assert_eq!((of_kind(&events, "stopped").len(), now(&live)), (1, 31));
    live.request(&json!({ "stop_on_error": { "on": false } }).to_string(), Duration::ZERO);
    ask(&mut live, json!({ "play": {} }));
    assert_eq!(now(&live), 91);
}

#[test]
fn an_assignment_stops_at_an_error_from_the_start() {
    for (scenario, expected) in
        [(SCENARIO.to_owned(), false), (SCENARIO.to_owned() + ASSIGNMENT, true)]
    {
        let mut live = start(&scenario);
        live.begin();
        let begin = taken(&mut live).remove(0);
        assert_eq!(begin["stops_on_error"], expected);
        assert_eq!(begin["groups"][0]["script"], "walk.bzz", "the path of its file is no news");
        ask(&mut live, json!({ "play": {} }));
        assert_eq!(now(&live) == 11, expected);
        // The choice of the client stays when it connects again, or edits the scenario.
        live.request(&json!({ "stop_on_error": { "on": !expected } }).to_string(), Duration::ZERO);
        live.begin();
        assert_eq!(taken(&mut live)[0]["stops_on_error"], !expected);
        let edited = json!({ "run": { "texts": { "s.toml": scenario } } });
        let events = ask(&mut live, edited);
        let begin = of_kind(&events, "begin");
        assert_eq!(begin[0]["stops_on_error"], !expected);
    }
}

#[test]
fn an_inspection_has_the_memory_at_the_fault() {
    let mut live = start(SCENARIO);
    ask(&mut live, json!({ "inspect": { "robot": 4 } }));
    let inspected = |live: &mut Live, tick: u64| {
        go_to(live, tick);
        live.take_events();
        live.take_sample();
        of_kind(&taken(live), "inspection")[0].clone()
    };
    let before = inspected(&mut live, 10);
    assert_eq!((&before["fault"], &before["at_fault"]), (&Value::Null, &Value::Null));
    // In the pause the script has no variables, and then it starts again.
    for tick in [11, 25] {
        let found = inspected(&mut live, tick);
        assert_eq!(found["fault"]["tick"], 10);
        let memory = &found["at_fault"];
        let globals = memory["globals"].as_array().unwrap();
        assert!(globals.contains(&json!(["n", 10])), "{globals:?}");
        let frame = &memory["frames"][0];
        assert_eq!(
            (&frame["function"], &frame["source"]["file"]),
            (&json!("average"), &json!("walk.bzz"))
        );
        assert!(frame["locals"].as_array().unwrap().contains(&json!(["total", 30])), "{frame}");
        let now = found["memory"]["globals"].as_array().unwrap();
        assert!(!now.contains(&json!(["n", 10])), "{now:?}");
    }
    assert_eq!(inspected(&mut live, 5)["at_fault"], Value::Null);
}

/// A page of a large swarm whose scripts all fail at once.
#[test]
fn the_faults_of_many_robots_stop_the_run_once() {
    let scenario = SCENARIO.replace("size = [800, 600]", "size = [8000, 6000]");
    let scenario = scenario.replace("count = 6", "count = 300\nfirst_id = 1000");
    let mut live = start(&(scenario + ASSIGNMENT));
    let all = SCRIPT.replace("id == 4 and n == 10", "n == 10");
    live.request(&json!({ "run": { "texts": { "walk.bzz": all } } }).to_string(), Duration::ZERO);
    let events = ask(&mut live, json!({ "play": {} }));
    assert_eq!(of_kind(&events, "fault").len(), 300);
    let stopped = of_kind(&events, "stopped");
    assert_eq!((stopped.len(), &stopped[0]["others"]), (1, &json!(299)));
}
