//! `bbz sim`: its output, its files and its exit status.

use crate::support;
use crate::support::Folder;
use serde_json::Value;

const SCRIPT: &str =
    "n = 0\nfunction step() { n = n + 1 led(n % 8) if(n == 5 and id == 1) log(\"five \", n) }\n";

const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 2\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 3\n\
    [output]\nplot = [\"global.n\"]\n\
    [[expect]]\nat = 2\nvalue = \"global.n\"\nequals = 19\n";

fn folder(test: &str) -> Folder {
    let folder = Folder::with(test, "s.bzz", SCRIPT);
    folder.write("s.toml", SCENARIO);
    folder
}

/// The scenario with exact clocks, for which the expectation holds with every seed.
fn exact() -> String {
    SCENARIO.replace("count = 3", "count = 3\nclock_skew = 0")
}

#[test]
fn a_scenario_that_holds_succeeds() {
    let outcome = folder("sim_holds").bbz(&["sim", "s.toml"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert_eq!(lines[0], "     0.5     1  five 5");
    assert!(lines[1].starts_with("3 robots, 2.0 s, seed 1: "), "{}", lines[1]);
    assert_eq!(
        lines[2],
        "held    s.toml:10: all: global.n equals 19, at 2 s; true for good since 2.0 s"
    );
    assert!(lines[3].starts_with("frames "), "{}", lines[3]);
}

#[test]
fn comments_that_the_page_cannot_use_are_warnings() {
    for (comment, message, help) in [
        ("# try: Robot 1 fails: fail 1", "no command to try", "`# try: Robot 15 fails: fail = 15`"),
        ("# try: Robot 7 fails: fail = 7", "no command to try", "help"),
        ("# try.fr: En panne : fails = 1", "no command to try", "help"),
        ("# try.french: En panne : fail = 1", "no command to try", "`# try.fr: …`"),
        ("# led: 1 = on", "no led of the page", "in the script"),
        ("# text.fr: Un essai.", "does not show this text", "`# text.fr: Une horloge.`"),
    ] {
        let folder = folder("sim_page_comments");
        folder.write("s.toml", format!("{SCENARIO}{comment}\n"));
        let outcome = folder.bbz(&["sim", "s.toml", "--headless"]);
        assert_eq!(outcome.status, Some(0), "{comment}");
        for part in ["warning", "s.toml:14:1", message, help] {
            assert!(outcome.stderr.contains(part), "{comment}: {}", outcome.stderr);
        }
    }
    let folder = folder("sim_good_page_comments");
    let head = "# A test.\n#\n# text.fr: Un essai.\n#\n# try: It fails: fail = 1\n\
        # try.fr: En panne : fail = 1\n";
    folder.write("s.toml", [head, SCENARIO].concat());
    let outcome = folder.bbz(&["sim", "s.toml", "--headless"]);
    assert_eq!((outcome.status, &*outcome.stderr), (Some(0), ""));
}

/// Three Kilobots send at most two frames of 4.41 ms per second each: 2.6 % of a second. With one table in 100 steps, which
/// are 10 s, a robot sends 0.4 frames per second: 0.53 % in all.
#[test]
fn long_messages_are_listed_with_their_share_of_the_air() {
    let folder = folder("sim_messages");
    folder.write(
        "s.bzz",
        "n = 0\nfunction step() { n = n + 1\n neighbors.broadcast(\"p\", {.x = 1, .y = 2})\n \
         if(n % 100 == 0) neighbors.broadcast(\"q\", {.x = 1, .y = 2})\n \
         neighbors.broadcast(\"r\", n) }\n",
    );
    let outcome = folder.bbz(&["sim", "s.toml", "--headless"]);
    let lines = outcome.stdout.lines().filter(|line| line.starts_with("message "));
    let expected = [
        "message s.bzz:3 broadcast \"p\": 4 frames; 3 robots take at most 3 % of the air",
        "message s.bzz:4 broadcast \"q\": 4 frames; 3 robots take at most 1 % of the air",
    ];
    assert!(lines.eq(expected), "{}", outcome.stdout);
}

#[test]
fn an_expectation_that_fails_is_status_1() {
    let folder = folder("sim_fails");
    folder.write("s.toml", SCENARIO.replace("equals = 19", "equals = 20"));
    let outcome = folder.bbz(&["sim", "s.toml", "--headless"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(1), ""));
    assert!(outcome.stdout.contains("FAILED  s.toml:10:"), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("  robot 0 had 19\n"), "{}", outcome.stdout);
    assert!(
        outcome.stdout.contains("global.n at the end: 19 to 19, mean 19\n"),
        "{}",
        outcome.stdout
    );
    assert!(!outcome.stdout.contains("five"), "{}", outcome.stdout);
}

/// What a robot has no room for is lost, and the summary names the key of the robot file.
#[test]
fn lost_messages_are_shown_with_the_key_that_gives_more_room() {
    let folder = folder("sim_lost");
    let listen = "function init() { neighbors.listen(\"t\", function(t, v, r) { }) }\n";
    let step = "function step() { neighbors.broadcast(\"t\", {.a = id, .b = 2}) }\n";
    folder.write("s.bzz", [listen, step].concat());
    folder.write(
        "s.toml",
        "[world]\nsize = [900, 900]\nduration = 20\n\
         [[robots]]\nrobot = \"zooids\"\nscript = \"s.bzz\"\ncount = 16\n",
    );
    let outcome = folder.bbz(&["sim", "s.toml", "--headless"]);
    let shown = outcome.stdout;
    assert!(shown.contains(" incomplete (more room: `in_long` of the robot file)\n"), "{shown}");
    assert!(shown.contains(", 0 before they were read\n"), "{shown}");
}

#[test]
fn a_fault_is_status_1_with_file_and_line() {
    let folder = folder("sim_fault");
    folder.write(
        "s.bzz",
        "n = 0\nfunction step() {\n  n = n + 1\n  if(n == 19) led(n / (id - 1))\n}\n",
    );
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(1));
    let stopped = "robot 1 stopped at 1.9 s, to start again after 1 s";
    outcome.reports(&["error[R0005]", "--> s.bzz:4:", stopped, "in `step`"]);
    let counted = "scripts stopped by an error: 1, started again: 0\n";
    assert!(outcome.stdout.contains(counted), "{}", outcome.stdout);
    // A program reads the same words.
    let json: Value =
        serde_json::from_str(&folder.bbz(&["sim", "s.toml", "--json"]).stdout).unwrap();
    let fault = &json["faults"][0];
    assert_eq!((&fault["code"], &fault["line"]), (&"R0005".into(), &4.into()));
    assert_eq!(fault["message"], "integer division by zero");
    assert_eq!(fault["help"], "test the divisor first, as in `if(n != 0)`");
    assert_eq!(fault["calls"][0]["function"], "step");
    // The same fault of many robots is printed once.
    folder.write("s.bzz", "n = 0\nfunction step() { n = n + 1 if(n == 9) led(1 / 0) }\n");
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.stderr.matches("error[").count(), 1, "{}", outcome.stderr);
    outcome.reports(&["robot 0 stopped at 0.9 s, to start again after 1 s, and 2 others"]);
    let seconds = ["--set", "world.duration=4"];
    let outcome = folder.bbz(&[&["sim", "s.toml"], &seconds[..]].concat());
    outcome.reports(&["and 2 others; 6 times in all"]);
    let counted = "scripts stopped by an error: 6, started again: 3\n";
    assert!(outcome.stdout.contains(counted), "{}", outcome.stdout);
    folder.write("s.bzz", "n = 0\nfunction step() { n = n + 1 assert(n < 9) }\n");
    let outcome = folder.bbz(&["sim", "s.toml"]);
    outcome.reports(&["robot 0 stopped at 0.9 s, and 2 others"]);
}

#[test]
fn a_script_that_an_event_loads_has_its_own_names_and_lines() {
    let folder = folder("sim_load");
    folder.write("s.bzz", "n = 0\nfunction step() { n = n + 1 if(n == 9) log(\"before\") }\n");
    folder.write(
        "other.bzz",
        "# Line 1\nm = 0\nfunction step() {\n  m = m + 1\n  if(m == 3) log(\"after\")\n  if(m == 4) led(m / 0)\n}\n",
    );
    let scenario = std::fs::read_to_string(folder.path("s.toml")).unwrap();
    folder.write("s.toml", &(scenario + "\n[[event]]\nat = 1\nload = 1\nscript = \"other.bzz\"\n"));
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(1));
    outcome.reports(&["--> other.bzz:6:", "robot 1 stopped at 1.4 s"]);
    for line in ["     0.9     1  before\n", "     1.3     1  after\n"] {
        assert!(outcome.stdout.contains(line), "{line}: {}", outcome.stdout);
    }
    // The script is compiled before the run begins.
    folder.write("other.bzz", "function step() { fly() }\n");
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(2));
    outcome.reports(&["error[E0401]", "--> other.bzz:1:"]);
}

#[test]
fn questions_of_events_are_logged_and_their_errors_reported() {
    let folder = folder("sim_questions");
    folder.write(
        "s.bzz",
        "n = 0\nfunction add(x) { return n + x }\nfunction step() { n = add(1) }\n",
    );
    let scenario = std::fs::read_to_string(folder.path("s.toml")).unwrap();
    let question =
        |at, robots, text| format!("\n[[event]]\nat = {at}\nrobots = {robots}\nask = '{text}'\n");
    let questions = question(1.0, "[0, 2]", "add(1) * 2") + &question(1.5, "1", "add({})");
    folder.write("s.toml", &(scenario.clone() + &questions));
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(1));
    for line in ["     1.0     0  add(1) * 2 = 20\n", "     1.0     2  add(1) * 2 = 20\n"] {
        assert!(outcome.stdout.contains(line), "{line}: {}", outcome.stdout);
    }
    assert!(outcome.stdout.contains("     1.5     1  add({}): ended by an error\n"));
    outcome.reports(&[
        "error[R0001]",
        "--> s.bzz:2:",
        "a question to robot 1, or its listener or handler, ended at 1.5 s",
    ]);
    folder.write("s.toml", &(scenario + &question(1.0, "[0, 2]", "ad(1)")));
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(2));
    outcome.reports(&["there is no function `ad`; did you mean `add`?", "ask = 'ad(1)'"]);
}

#[test]
fn an_error_in_a_listener_is_status_1_unless_it_is_expected() {
    let folder = folder("sim_contained");
    folder.write(
        "s.bzz",
        "n = 0\nfunction init() {\n  neighbors.listen(\"x\", function(topic, value, robot) { n = n + value })\n}\n\
         function step() { if(id == 0) neighbors.broadcast(\"x\", nil) }\n",
    );
    let near = SCENARIO.replace("count = 3", "count = 3\nplacement = \"grid\"\nspacing = 60");
    let near = near.replace("equals = 19", "equals = 0");
    folder.write("s.toml", &near);
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!(outcome.status, Some(1));
    let note = "a listener or handler of robot 1 ended at ";
    outcome.reports(&[
        "error[R0001]",
        "--> s.bzz:3:",
        note,
        "s, its script went on, and another one",
    ]);
    assert!(
        outcome.stdout.contains("listeners and handlers ended by an error: "),
        "{}",
        outcome.stdout
    );
    let outcome = folder.bbz(&["sim", "s.toml", "--json"]);
    let json: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(json["faults"][0]["consequence"], "contained");
    assert_eq!(json["errors"]["faults"], 0);
    assert!(json["errors"]["handler_faults"].as_u64() >= Some(2), "{json}");
    let expect = "[[expect]]\nat = 2\nvalue = \"handler_faults\"\nof = 2\nabove = 0\n";
    folder.write("s.toml", near + expect);
    assert_eq!(folder.bbz(&["sim", "s.toml"]).status, Some(0));
}

/// The third step of robot 1 begins in tick 3 and never ends; the steps of ticks 4 to 19 are
/// skipped.
#[test]
fn an_endless_step_is_reported() {
    let folder = folder("sim_endless");
    folder.write(
        "s.bzz",
        "n = 0\nfunction step() {\n  n = n + 1\n  if(n == 3 and id == 1)\n    while(1) n = 4 # bbz: allow(W0313)\n}\n",
    );
    let scenario = SCENARIO.split("[[expect]]").next().unwrap_or_default();
    let expect = "[[expect]]\nat = 2\nvalue = \"overruns\"\nof = \"sum\"\nequals = 16\n";
    folder.write("s.toml", scenario.to_owned() + expect);
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let line = "steps left out because one before took too long: 16, by 1 robot; first by robot 1 at 0.4 s in s.bzz:5\n";
    assert!(outcome.stdout.contains(line), "{}", outcome.stdout);
    let outcome = folder.bbz(&["sim", "s.toml", "--json"]);
    let json: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(
        (json["overruns"]["missed"].as_u64(), json["overruns"]["robots"].as_u64()),
        (Some(16), Some(1))
    );
    let first = &json["overruns"]["first"];
    assert_eq!((first["robot"].as_u64(), first["time"].as_f64()), (Some(1), Some(0.4)));
    assert_eq!((first["file"].as_str(), first["line"].as_u64()), (Some("s.bzz"), Some(5)));
    folder.bbz(&["sim", "s.toml", "--runs", "2", "--csv", "runs.csv"]);
    let table = String::from_utf8(folder.read("runs.csv")).unwrap();
    let mut rows = table.split_terminator("\r\n").map(|row| row.split(',').collect::<Vec<_>>());
    let column = rows.next().unwrap().iter().position(|name| *name == "overruns").unwrap();
    assert_eq!(rows.map(|row| row[column].to_owned()).collect::<Vec<_>>(), ["16", "16"]);
    // Scripts without overruns have no line.
    folder.write("s.bzz", SCRIPT);
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert!(!outcome.stdout.contains("left out"), "{}", outcome.stdout);
}

#[test]
fn mistakes_of_scenario_or_script_are_status_2() {
    let folder = folder("sim_wrong");
    folder.write("s.toml", SCENARIO.replace("count", "cuont").replace("size", "seize"));
    folder.bbz(&["sim", "s.toml"]).fails_with(
        2,
        &[
            "unknown key `cuont`",
            "s.toml:7:1",
            "did you mean `count`?",
            "unknown key `seize`",
            "s.toml:2:1",
        ],
    );
    folder.write("s.toml", SCENARIO.replace("global.n\"\nequals", "global.m\"\nequals"));
    folder.bbz(&["sim", "s.toml"]).fails_with(2, &["no script has a global `m`", "s.toml:12:9"]);
    folder.write("s.toml", SCENARIO);
    folder.write("s.bzz", "function step() { led(1, 2, 3, 4) }\n");
    folder.bbz(&["sim", "s.toml"]).fails_with(2, &["error[E", "s.bzz:1:", "led"]);
    folder.write("s.bzz", SCRIPT);
    folder
        .bbz(&["sim", "s.toml", "--set", "medium.ir.loss=2"])
        .fails_with(2, &["`loss` cannot be 2", "--set medium.ir.loss"]);
    folder.write("s.toml", SCENARIO.replace("[500, 500]", "[60, 60]"));
    folder.bbz(&["sim", "s.toml"]).fails_with(
        2,
        &[
            "random placement found no room for 3 robots",
            "s.toml:4:",
            "even a grid with spacing = 33 holds only 1",
        ],
    );
}

#[test]
fn a_wrong_command_line_is_status_3() {
    let folder = folder("sim_usage");
    folder.bbz(&["sim", "ss.toml"]).fails_with(3, &["there is no file `ss.toml`", "`s.toml`?"]);
    folder.bbz(&["sim", "."]).fails_with(3, &["folder"]);
    folder.bbz(&["sim"]).fails_with(3, &["<SCENARIO>"]);
    folder.bbz(&["sim", "s.toml", "--set", "world.seed"]).fails_with(3, &["gives no value"]);
    folder.bbz(&["sim", "s.toml", "--runs", "0"]).fails_with(3, &["--runs"]);
    folder.bbz(&["sim", "s.toml", "--record", "a", "--runs", "2"]).fails_with(3, &["--record"]);
    folder.bbz(&["sim", "s.toml", "--record", "no/such/file"]).fails_with(3, &["cannot write"]);
    folder.bbz(&["sim", "s.toml", "--csv", "no/such/file"]);
    let several = ["sim", "s.toml", "--view", "--set", "world.seed=1,2"];
    folder.bbz(&several).fails_with(3, &["`--view` shows one run", "one value"]);
    folder.bbz(&["sim", "s.toml", "--view", "--runs", "2"]).fails_with(3, &["--runs"]);
}

#[test]
fn json_is_one_object() {
    let folder = folder("sim_json");
    let outcome = folder.bbz(&["sim", "s.toml", "--json", "--seed", "9"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let result: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(result["success"], true);
    assert_eq!(result["seed"], 9);
    assert_eq!(result["expects"][0]["since"], 2.0);
    assert_eq!(result["expects"][0]["against"], Value::Null);
    assert_eq!(
        result["plot"],
        serde_json::json!({ "global.n": { "mean": 19.0, "min": 19.0, "max": 19.0 } })
    );
    assert_eq!(result["faults"], serde_json::json!([]));
    let digest = |seed: &str| {
        let outcome = folder.bbz(&["sim", "s.toml", "--json", "--seed", seed]);
        serde_json::from_str::<Value>(&outcome.stdout).unwrap()["digest"].clone()
    };
    assert_eq!(digest("9"), result["digest"]);
    assert_ne!(digest("10"), result["digest"]);
}

#[test]
fn recordings_and_pictures_are_written() {
    let folder = folder("sim_files");
    let outcome = folder.bbz(&["sim", "s.toml", "--record", "run.bbr", "--svg", "pictures"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    assert!(folder.read("run.bbr").starts_with(b"bbzrec\x04"));
    for picture in ["pictures/trajectories.svg", "pictures/global-n.svg"] {
        assert!(folder.read(picture).starts_with(b"<svg "), "{picture}");
    }
}

#[test]
fn every_combination_is_run_with_every_seed() {
    let folder = folder("sim_batch");
    folder.write("s.toml", exact());
    let arguments = ["sim", "s.toml", "--runs", "3", "--seed", "5", "--csv", "runs.csv"];
    let set = ["--set", "robots.0.count=2,4", "--set", "medium.ir.loss=0,[0.1,0.5]"];
    let outcome = folder.bbz(&[arguments.as_slice(), &set].concat());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let table = String::from_utf8(folder.read("runs.csv")).unwrap();
    let rows: Vec<&str> = table.split_terminator("\r\n").collect();
    assert_eq!(rows.len(), 1 + 2 * 2 * 3);
    assert!(
        rows[0].starts_with(
            "seed,kilobot.count,medium.ir.loss,success,failed,held.0,first.0,since.0,mean global.n,"
        ),
        "{}",
        rows[0]
    );
    for (row, start) in rows[1..].iter().zip([
        "5,2,0,1,0,1,2,2,19,19,19,",
        "6,2,0,",
        "7,2,0,",
        "5,2,\"[0.1,0.5]\",1,",
        "6,2,\"[0.1,0.5]\",",
        "7,2,\"[0.1,0.5]\",",
        "5,4,0,",
        "6,4,0,",
        "7,4,0,",
        "5,4,\"[0.1,0.5]\",",
        "6,4,\"[0.1,0.5]\",",
        "7,4,\"[0.1,0.5]\",",
    ]) {
        assert!(row.starts_with(start), "{row}");
    }
    assert!(
        outcome.stdout.contains("kilobot.count=4 medium.ir.loss=0: 3 of 3 runs succeeded"),
        "{}",
        outcome.stdout
    );
    // The same command gives the same table.
    let again = folder.bbz(&[arguments.as_slice(), &set].concat());
    assert_eq!(again.stdout, outcome.stdout);
    assert_eq!(folder.read("runs.csv"), table.as_bytes());

    folder.write("s.toml", SCENARIO.replace("equals = 19", "equals = 20"));
    // What failed is counted, and the batch has done its work.
    let failed = folder.bbz(&["sim", "s.toml", "--runs", "2"]);
    assert_eq!((failed.status, failed.stderr.as_str()), (Some(0), ""));
    let lines = ["0 of 2 runs succeeded\n", " held in 0 of 2 runs, failed in 2\n"];
    lines.iter().for_each(|line| assert!(failed.stdout.contains(line), "{}", failed.stdout));
    assert_eq!(folder.bbz(&["sim", "s.toml"]).status, Some(1));
    let json = folder.bbz(&["sim", "s.toml", "--runs", "2", "--json"]);
    let result: Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(result["runs"][1]["seed"], 2);
    assert_eq!(result["runs"][1]["metrics"]["success"], 0.0);
}

/// A variant has the seed that it sets, not that of the first one.
#[test]
fn a_variant_of_the_seed_runs_with_that_seed() {
    let folder = folder("sim_seeds");
    // Robots stand at random places.
    folder.write("s.toml", exact().replace("[\"global.n\"]", "[\"x\"]"));
    let rows = |arguments: &[&str]| -> Vec<String> {
        let outcome = folder.bbz(&[&["sim", "s.toml", "--csv", "runs.csv"], arguments].concat());
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        let table = String::from_utf8(folder.read("runs.csv")).unwrap();
        table.lines().skip(1).map(str::to_owned).collect()
    };
    let single = |seed: &str| rows(&["--seed", seed]).remove(0);
    let metrics = |row: &str| row.split_once(",").unwrap().1.to_owned();
    let [one, two, three] = ["1", "2", "3"].map(single);
    assert_ne!(metrics(&one), metrics(&two));
    let expected: Vec<String> = [(1, &one), (3, &three), (2, &two)]
        .iter()
        .map(|(seed, row)| format!("{seed},{seed},{}", metrics(row)))
        .collect();
    assert_eq!(rows(&["--set", "world.seed=1,3,2"]), expected);
    // With several runs, each variant counts up from its own seed.
    let seeds = rows(&["--set", "world.seed=1,7", "--runs", "2"]);
    let seeds: Vec<&str> = seeds.iter().filter_map(|row| row.split(',').next()).collect();
    assert_eq!(seeds, ["1", "2", "7", "8"]);
    for runs in [&["--csv", "runs.csv"][..], &[]] {
        let both = [&["sim", "s.toml", "--seed", "5", "--set", "world.seed=1"], runs].concat();
        folder.bbz(&both).fails_with(3, &["`--seed` and `--set world.seed`", "leave out"]);
    }
}

/// Column names are data: a comment in the scenario does not change them.
#[test]
fn columns_are_named_after_expectations_and_not_after_lines() {
    let folder = folder("sim_names");
    let named = "[[expect]]\nname = \"counted\"\nat = 1\nvalue = \"global.n\"\nabove = 3\n";
    let scenario = format!("{SCENARIO}{named}");
    let header = |text: &str| {
        folder.write("s.toml", text);
        let outcome = folder.bbz(&["sim", "s.toml", "--csv", "runs.csv"]);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        String::from_utf8(folder.read("runs.csv")).unwrap().lines().next().unwrap().to_owned()
    };
    let columns =
        "seed,success,failed,held.0,first.0,since.0,held.counted,first.counted,since.counted,";
    assert!(header(&scenario).starts_with(columns), "{}", header(&scenario));
    assert_eq!(header(&format!("# a comment\n\n{scenario}")), header(&scenario));
    folder.write("s.toml", &scenario);
    let outcome = folder.bbz(&["sim", "s.toml"]);
    let line = "held    s.toml:14: counted: all: global.n above 3, at 1 s; ";
    assert!(outcome.stdout.contains(line), "{}", outcome.stdout);
    let json = folder.bbz(&["sim", "s.toml", "--json"]);
    let result: Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(result["expects"][0]["name"], Value::Null);
    assert_eq!(result["expects"][1]["name"], "counted");
}

/// The world of each run differs, and so does the time of the event: two of the runs end before it.
#[test]
fn measures_are_columns_without_a_verdict() {
    let folder = folder("sim_measures");
    let script = "n = 0\nfunction step() { n = n + id }\n";
    folder.write("s.bzz", script);
    let measures = "[[measure]]\nname = \"ten\"\nvalue = \"sum(global.n)\"\nabove = 9\n\
        [[measure]]\nname = \"mean_n\"\nvalue = \"mean(global.n)\"\nat = 1\n";
    let text = "[world]\nsize = [900, 900]\nduration = 2\n\
        [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\n";
    folder.write("s.toml", format!("{text}{measures}"));
    let ids = "robots.0.first_id=0,0,1,2,5";
    let outcome = folder.bbz(&["sim", "s.toml", "--set", ids, "--csv", "runs.csv"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let table = String::from_utf8(folder.read("runs.csv")).unwrap();
    let rows: Vec<&str> = table.split_terminator("\r\n").collect();
    for (row, start) in rows.iter().zip([
        "seed,kilobot.first_id,success,failed,ten,mean_n,sent,",
        "1,0,1,0,,0,",
        "1,0,1,0,,0,",
        // More than 9 after 10, 5 and 2 steps, the first of which is in the second tick.
        "1,1,1,0,1.1,9,",
        "1,2,1,0,0.6,18,",
        "1,5,1,0,0.3,45,",
    ]) {
        assert!(row.starts_with(start), "{row}");
    }
    let one = folder.bbz(&["sim", "s.toml", "--set", "robots.0.first_id=2"]);
    let lines =
        ["measure ten: at 0.6 s; first time of sum(global.n) above 9\n", "measure mean_n: 18;"];
    lines.iter().for_each(|line| assert!(one.stdout.contains(line), "{}", one.stdout));
    let never = folder.bbz(&["sim", "s.toml", "--json"]);
    let result: Value = serde_json::from_str(&never.stdout).unwrap();
    assert_eq!(result["measures"]["ten"], Value::Null);
    assert_eq!(result["measures"]["mean_n"], 0.0);
}

/// A scenario with a global that decides, and the rows of the table of a batch of it without the
/// columns after those of the parameters and of the measure.
fn study(test: &str, more: &str, arguments: &[&str]) -> (Folder, String, Vec<String>) {
    let folder = folder(test);
    folder.write("s.bzz", "GROUP = 5\nn = 0\nfunction step() { n = n + GROUP }\n");
    let text = format!(
        "[world]\nsize = [900, 900]\nduration = 2\nseed = 7\n\
         [[robots]]\nname = \"walkers\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\nclock_skew = 0\n\
         [[measure]]\nname = \"n\"\nvalue = \"max(global.n)\"\n{more}"
    );
    folder.write("s.toml", text);
    let outcome = folder.bbz(&[&["sim", "s.toml", "--csv", "runs.csv"], arguments].concat());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let table = String::from_utf8(folder.read("runs.csv")).unwrap();
    let columns = table.lines().next().unwrap().split(',').position(|name| name == "n").unwrap();
    let row = |line: &str| line.split(',').take(columns + 1).collect::<Vec<&str>>().join(",");
    let rows = table.lines().map(row).collect();
    (folder, outcome.stdout, rows)
}

#[test]
fn a_range_of_a_global_has_its_column() {
    let set = ["--set", "robots.walkers.globals.GROUP=1:5:2"];
    let (folder, stdout, rows) = study("sim_range", "", &set);
    let expected = ["seed,GROUP,success,failed,n", "7,1,1,0,19", "7,3,1,0,57", "7,5,1,0,95"];
    assert_eq!(rows, expected);
    assert!(stdout.contains("GROUP=3: 1 of 1 runs succeeded\n"), "{stdout}");
    // The number of threads does not change the table.
    let table = folder.read("runs.csv");
    for threads in ["1", "3"] {
        let again = ["sim", "s.toml", "--csv", "runs.csv", "--threads", threads];
        assert_eq!(folder.bbz(&[&again[..], &set].concat()).status, Some(0));
        assert_eq!(folder.read("runs.csv"), table);
    }
    folder.bbz(&["sim", "s.toml", "--threads", "0"]).fails_with(3, &["0 is not in 1..=4096"]);
    assert_eq!(folder.bbz(&["sim", "s.toml", "--threads", "1"]).status, Some(0));
}

#[test]
fn keys_of_one_set_vary_together() {
    let set = "robots.walkers.globals.GROUP=1,4; world.duration=1,0.5";
    let (_, _, rows) = study("sim_pairs", "", &["--set", set, "--runs", "2"]);
    let expected = [
        "seed,GROUP,world.duration,success,failed,n",
        "7,1,1,1,0,9",
        "8,1,1,1,0,9",
        "7,4,0.5,1,0,16",
        "8,4,0.5,1,0,16",
    ];
    assert_eq!(rows, expected);
}

/// An event before it does not rename the data.
#[test]
fn the_number_of_an_event_has_the_name_of_its_global() {
    let event =
        |at: &str| format!("[[event]]\nat = {at}\nset = \"all\"\nglobal = \"GROUP\"\nnumber = 1\n");
    let other = "[[event]]\nat = 0.5\nfail = 0\n";
    let (.., rows) = study("sim_event", &event("0"), &["--set", "event.0.number=2,3"]);
    assert_eq!(rows, ["seed,GROUP,success,failed,n", "7,2,1,0,38", "7,3,1,0,57"]);
    let more = format!("{other}{}", event("0"));
    let (.., rows) = study("sim_event_later", &more, &["--set", "event.1.number=2,3"]);
    assert_eq!(rows[0], "seed,GROUP,success,failed,n");
}

const SWEEP: &str = "[sweep]\nseeds = 2\nchance = \"common\"\n\
    [[sweep.parameter]]\nkey = \"robots.walkers.globals.GROUP\"\nvalues = [2, 3]\n\
    [[sweep.parameter]]\nkey = \"world.duration\"\nname = \"seconds\"\nvalues = [1]\n";

#[test]
fn a_study_in_the_scenario_is_a_batch() {
    let (folder, stdout, rows) = study("sim_study", SWEEP, &[]);
    let expected = [
        "seed,GROUP,seconds,success,failed,n",
        "7,2,1,1,0,18",
        "8,2,1,1,0,18",
        "7,3,1,1,0,27",
        "8,3,1,1,0,27",
    ];
    assert_eq!(rows, expected);
    let line = "[sweep]: 2 points, 2 runs of each; all points have the same seeds (common random numbers)\n";
    assert!(stdout.starts_with(line), "{stdout}");
    // A single run is that of the file.
    let one = folder.bbz(&["sim", "s.toml"]);
    assert!(one.stdout.contains("measure n: 95; "), "{}", one.stdout);
    // The command adds a key, and says the number of runs.
    let more = ["--set", "medium.ir.loss=0,0.5", "--runs", "1"];
    let (.., rows) = study("sim_study_more", SWEEP, &more);
    assert_eq!(rows[0], "seed,GROUP,seconds,medium.ir.loss,success,failed,n");
    assert_eq!(rows.len(), 1 + 4);
    let twice = ["sim", "s.toml", "--csv", "runs.csv", "--set", "robots.0.globals.GROUP=1"];
    folder.bbz(&twice).fails_with(3, &["GROUP` has values in [sweep] (line 17) and in `--set`"]);
    let twice = ["--csv", "runs.csv", "--set", "world.seed=1", "--set", "world.seed=2"];
    let twice = [&["sim", "s.toml"], &twice[..]].concat();
    folder.bbz(&twice).fails_with(3, &["`world.seed` has values in two `--set`", "world.seed=1,2"]);
}

#[test]
fn independent_points_have_seeds_of_their_own() {
    let seeds = |test: &str, sweep: &str| -> Vec<String> {
        let (.., rows) = study(test, sweep, &[]);
        let point = |row: &String| row.split(',').take(2).collect::<Vec<&str>>().join(",");
        rows[1..].iter().map(point).collect()
    };
    let independent = SWEEP.replace("common", "independent");
    let few = seeds("sim_own_seeds", &independent);
    let more = seeds("sim_own_seeds_more", &independent.replace("[2, 3]", "[4, 3, 2]"));
    assert_eq!((few.len(), more.len()), (4, 6));
    assert!(few.iter().all(|run| more.contains(run)), "{few:?} {more:?}");
    let mut numbers: Vec<&str> = more.iter().filter_map(|run| run.split(',').next()).collect();
    numbers.sort_unstable();
    numbers.dedup();
    assert_eq!(numbers.len(), 6);
}

#[test]
fn a_mistake_of_a_study_is_at_its_parameter() {
    let (folder, ..) = study("sim_study_mistakes", SWEEP, &[]);
    let text = String::from_utf8(folder.read("s.toml")).unwrap();
    let refused = |from: &str, to: &str, parts: &[&str]| {
        folder.write("s.toml", text.replace(from, to));
        folder.bbz(&["sim", "s.toml", "--csv", "runs.csv"]).fails_with(2, parts);
    };
    refused(
        "globals.GROUP",
        "globals.GROPU",
        &["no script has a global `GROPU`", "s.toml:17:", "did you mean `GROUP`"],
    );
    refused(
        "[2, 3]",
        "[2, 3.5]",
        &["`GROUP` is an integer in line 1 of", "3.5 is a float", "s.toml:17:"],
    );
    refused(
        "walkers.globals",
        "talkers.globals",
        &["no group of robots is named `talkers`", "s.toml:17:"],
    );
    refused("\"world.duration\"", "\"world.duratoin\"", &["unknown key `duratoin`", "s.toml:20:"]);
    // A run that is shorter than a measure.
    let measure = "max(global.n)\"\nat = 2\n";
    refused(
        "max(global.n)\"\n",
        measure,
        &["`at` is not within the run", "`duration` in [world] is 1 s"],
    );
}

/// Runs are counted before anything is prepared for them.
#[test]
fn the_number_of_runs_is_limited() {
    let folder = folder("sim_many_runs");
    folder.bbz(&["sim", "s.toml", "--runs", "4000000000"]).fails_with(3, &["1..=1000000"]);
    let values = (0..1100).map(|n| n.to_string()).collect::<Vec<_>>().join(",");
    let set = [format!("world.seed={values}"), format!("robots.0.count={values}")];
    let set: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
    let words = "1 runs of 1210000 combinations of values are too many";
    folder.bbz(&[&["sim", "s.toml"], set.as_slice()].concat()).fails_with(3, &[words, "1000000"]);
    folder
        .bbz(&["sim", "s.toml", "--runs", "500001", "--set", "world.seed=1,2"])
        .fails_with(3, &["500001 runs of 2 combinations"]);
}

/// The run would take four weeks, and is interrupted.
#[cfg(unix)]
#[test]
fn a_signal_ends_a_run_with_a_summary_and_a_whole_recording() {
    use std::io::{BufRead, BufReader, Read};

    use bittybuzz_arena::output::recording::RecordingReader;

    for signal in ["-INT", "-TERM"] {
        let folder = folder(&format!("sim{signal}"));
        folder.write("s.toml", SCENARIO.replace("duration = 2", "duration = 2419200"));
        let set = ["--set", "expect.0.at=2419200"];
        let arguments = [&["sim", "s.toml", "--record", "run.bbr"], &set[..]].concat();
        let mut child = folder.command(&arguments).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut printed = String::new();
        stdout.read_line(&mut printed).unwrap();
        assert_eq!(printed, "     0.5     1  five 5\n");
        let kill = [signal, &child.id().to_string()];
        assert!(std::process::Command::new("kill").args(kill).status().unwrap().success());
        let outcome = support::finish(child);
        assert_eq!(outcome.status, Some(1), "{signal}");
        outcome.reports(&["stopped by Ctrl-C or SIGTERM at", "of 2419200 s"]);
        stdout.read_to_string(&mut printed).unwrap();
        assert!(printed.contains("OPEN    s.toml:10:"), "{printed}");
        let recording = folder.read("run.bbr");
        assert!(RecordingReader::new(&recording).unwrap().all(|sample| sample.is_ok()), "{signal}");
    }
}

#[test]
fn a_lack_of_memory_names_the_globals_that_hold_it() {
    let folder = folder("sim_memory");
    folder.write(
        "s.toml",
        "[world]\nsize = [500, 500]\nduration = 2\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\nplacement = \"line\"\nspacing = 40\ncount = 2\n",
    );
    let globals = "few = { .1 = 1 }\nmany = {}\nn = 0\n";
    let fill = "while(1) {\n  n = n + 1\n  many[n] = { .x = n }\n}\n";
    let step = format!("{globals}function step() {{\n{fill}}}\n");
    // The listener of a robot ends, and its script goes on.
    let listener = format!(
        "{globals}function f(topic, value, robot) {{\n{fill}}}\n\
         function init() {{ neighbors.listen(\"go\", f) }}\n\
         function step() {{ if(id == 0) neighbors.broadcast(\"go\", 1) }}\n"
    );
    for (script, robot) in [(step, "robot 0 stopped"), (listener, "a listener or handler")] {
        folder.write("s.bzz", script);
        let outcome = folder.bbz(&["sim", "s.toml"]);
        let all = &outcome.stderr;
        for words in ["R0010", robot, "globals and calls take ", "`many` holds ", "`few` holds 7"] {
            assert!(all.contains(words), "{words}: {all}");
        }
    }
}

/// One script for different robots can test for the functions that a robot may lack.
#[test]
fn a_script_knows_the_functions_of_all_robots_of_its_scenario() {
    let folder = folder("sim_unlike");
    let robot = |name: &str, function: &str| {
        format!(
            "name = \"{name}\"\n[body]\ndrive = \"unicycle\"\nradius_mm = 40\nspeed_mm_s = 50\n\
             turn_deg_s = 90\n[[function]]\nname = \"{function}\"\naccepts = [\"x: int\"]\n\
             sets = {{ color = \"x\" }}\nhelp = \"shines\"\n"
        )
    };
    folder.write("a.toml", robot("ant", "glow"));
    folder.write("b.toml", robot("bee", "flash"));
    folder.write("s.bzz", "function step() {\n  if(glow) glow(1)\n  if(flash) flash(2)\n}\n");
    folder.write(
        "s.toml",
        "[world]\nsize = [500, 500]\nduration = 1\n\
         [[robots]]\nrobot = \"a.toml\"\nscript = \"s.bzz\"\ncount = 2\n\
         [[robots]]\nrobot = \"b.toml\"\nscript = \"s.bzz\"\ncount = 2\n\
         [[expect]]\nat = 1\nrobots = \"ant\"\nvalue = \"led\"\nequals = 1\n\
         [[expect]]\nat = 1\nrobots = \"bee\"\nvalue = \"led\"\nequals = 2\n",
    );
    let outcome = folder.bbz(&["sim", "s.toml"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""), "{}", outcome.stdout);
}
