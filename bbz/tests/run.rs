//! `bbz run`: the output of a script and the end of a run.

use crate::support;
use crate::support::Folder;

fn run(test: &str, script: &str, arguments: &[&str]) -> support::Outcome {
    let folder = Folder::with(test, "s.bzz", script);
    folder.bbz(&[&["run", "s.bzz"], arguments].concat())
}

#[test]
fn log_prints_every_type() {
    let script = "t = {.a = 1, .b = 2}\nlog(nil, 1, 2.5, \"x\", t, log, {})\nlog()\n";
    let expected = "[nil]12.500000x[table with 2 elems][closure][table with 0 elems]\n\n";
    run("log_full", script, &["--profile", "full"]).succeeds_with(expected);
    run("log_tiny", script, &["--profile", "tiny"]).succeeds_with(expected);
}

#[test]
fn robot_functions_print_their_call() {
    let script =
        "led(3)\nshow(\"a\\\"\\n\")\nshow({})\nshow({.a=1})\nshow(show)\nshow(nil)\nhover(-0.5)\n";
    let expected = "led(3)\nshow(\"a\\\"\\n\")\nshow({})\nshow({...})\nshow([closure])\nshow(nil)\nhover(-0.500000)\n";
    run("calls", script, &["--robot", "crazyflie"]).succeeds_with(expected);
    run("calls_of_all", script, &[]).succeeds_with(expected);
}

#[test]
fn robot_functions_return_the_type_of_the_robot_file_at_once() {
    let script = "log(takeoff(500), goTo(1, 2, 3), land())\n";
    let expected = "takeoff(500)\ngoTo(1, 2, 3)\nland()\n00[nil]\n";
    run("returns", script, &["--robot", "crazyflie"]).succeeds_with(expected);
}

#[test]
fn arguments_that_the_robot_would_refuse_are_refused() {
    let wrong = run("refused_type", "f = led\nf(1)\nf(\"red\")\n", &["--robot", "kilobot"]);
    assert_eq!((wrong.status, wrong.stdout.as_str()), (Some(1), "led(1)\n"));
    wrong.reports(&["error[R0001]", "a string", "s.bzz:3:1", "led takes (color: int 0..7)"]);
    let count = run("refused_count", "f = led\nf(1, 2)\n", &["--robot", "kilobot"]);
    count.fails_with(1, &["error[R0012]", "s.bzz:2:1", "led takes (color: int 0..7)"]);
    // The Crazyflie's led takes two arguments as well, so without --robot they are fine.
    run("refused_by_no_robot", "f = led\nf(1, 2)\n", &[]).succeeds_with("led(1, 2)\n");
}

#[test]
fn a_position_is_known_where_a_robot_knows_it() {
    run("pos", "log(pos.x, pos.orientation)\n", &["--robot", "zooids"])
        .succeeds_with("0.0000000.000000\n");
}

#[test]
fn steps_are_calls_of_step() {
    let script = "log(\"global\")\nfunction init() { log(\"init\") }\nfunction step() { log(\"step\") }\nfunction destroy() { log(\"destroy\") }\n";
    run("steps_2", script, &["--steps", "2"]).succeeds_with("global\ninit\nstep\nstep\n");
    run("steps_0", script, &["--steps", "0"]).succeeds_with("global\ninit\n");
}

#[test]
fn a_delay_takes_no_time_at_full_speed() {
    // Each delay is an hour: in real time the test would hang.
    let script = "delay(3600000)\nlog(1)\nfunction step() { delay(3600000) log(2) }\n";
    run("delays", script, &["--steps", "2"]).succeeds_with("1\n2\n2\n");
}

#[test]
fn id_and_seed_are_the_scripts() {
    run("id", "log(id)\n", &[]).succeeds_with("1\n");
    run("id_65535", "log(id)\n", &["--id", "65535"]).succeeds_with("65535\n");
    let random = |test, arguments: &[&str]| {
        run(test, "log(rand(), \" \", rand(), \" \", rand())\n", arguments).stdout
    };
    assert_eq!(random("seed_0", &[]), random("seed_0_again", &["--seed", "0"]));
    assert_ne!(random("seed_1", &["--seed", "1"]), random("seed_2", &["--seed", "2"]));
    assert_ne!(random("of_id_1", &["--id", "1"]), random("of_id_2", &["--id", "2"]));
}

#[test]
fn the_profile_is_the_robots_unless_it_is_chosen() {
    let script = "log(32767 + id)\n";
    run("profile_host", script, &[]).succeeds_with("32768\n");
    run("profile_robot", script, &["--robot", "kilobot"]).succeeds_with("-32768\n");
    run("profile_chosen", script, &["--robot", "kilobot", "--profile", "full"])
        .succeeds_with("32768\n");
}

#[test]
fn memory_is_the_robots() {
    // A table of 5000 entries fits the host, not the 400 slots of a Kilobot.
    let script = "t = {}\ni = 0\nwhile(i < 5000) { t[i] = i  i = i + 1 }\nlog(size(t))\n";
    run("memory_host", script, &[]).succeeds_with("5000\n");
    run("memory_robot", script, &["--robot", "kilobot"]).fails_with(1, &["R0010", "s.bzz:3:"]);
}

#[test]
fn a_robot_file_of_the_user_is_read() {
    let folder = Folder::with("own_robot", "s.bzz", "honk(2)\nlog(honk(1))\n");
    folder.write(
        "car.toml",
        "name = \"car\"\ntitle = \"Car\"\nprofile = \"tiny\"\ntick_hz = 20\nmessage_bytes = 9\n\
         [vm]\nmemory = 2000\nslots = 300\nneighbors = 4\nin_queue = 4\nout_queue = 4\n\
         stigmergy_entries = 2\nswarms = 2\n\
         [[function]]\nname = \"honk\"\naccepts = [\"times: int\"]\nreturns = \"number\"\nhelp = \"honks\"\n",
    );
    folder
        .bbz(&["run", "s.bzz", "--robot", "car.toml"])
        .succeeds_with("honk(2)\nhonk(1)\n0.000000\n");
    folder.bbz(&["run", "s.bzz"]).fails_with(2, &["honk", "s.bzz:1:1"]);
}

#[test]
fn a_fault_shows_place_line_and_calls() {
    let script = "function half(x) {\n  return 10 / x\n}\nfunction outer(x) { return half(x) + 1 }\nlog(\"before\")\nfunction step() { log(outer(2 - 2)) }\n";
    let outcome = run("fault", script, &["--steps", "3"]);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(1), "before\n"));
    outcome.reports(&[
        "error[R0005]: integer division by zero",
        "--> s.bzz:2:10",
        "2 |   return 10 / x",
        "^^^^^^",
    ]);
    let calls =
        ["in `half`, called at s.bzz:4:28", "in `outer`, called at s.bzz:6:23", "in `step`"];
    let places: Vec<Option<usize>> = calls.iter().map(|call| outcome.stderr.find(call)).collect();
    assert!(places.iter().all(Option::is_some), "{}", outcome.stderr);
    assert!(places.is_sorted(), "innermost first:\n{}", outcome.stderr);
}

#[test]
fn a_long_line_is_cut_around_the_fault() {
    let fields: String = (0..200).map(|number| format!(".a{number} = 1, ")).collect();
    let script = format!("x = nil\nt = {{ {fields}.z = x + 1 }}\n");
    let column = "t = { ".len() + fields.len() + ".z = ".len() + 1;
    let place = format!("s.bzz:2:{column}\n");
    run("long_line", &script, &[]).fails_with(1, &["R0001", &place, ".z = x + 1 }", "^^^^^"]);
}

#[test]
fn a_fault_in_an_included_file_names_that_file() {
    let folder = Folder::with("fault_included", "s.bzz", "include \"part.bzz\"\nf(nil)\n");
    folder.write("part.bzz", "function f(x) {\n  return x + 1\n}\n");
    folder.bbz(&["run", "s.bzz"]).fails_with(
        1,
        &["part.bzz:2:10", "return x + 1", "called at s.bzz:2:1", "nil and an integer"],
    );
}

#[test]
fn a_fault_names_its_step() {
    let script = "function step() {\n  n = n + 1\n  if(n == 57) { self.x = 1 }\n}\nn = 0\n";
    let outcome = run("fault_step", script, &["--steps", "100"]);
    outcome.fails_with(1, &["R0002", "`self` is nil", "in step 57", "in a call `t.f()`"]);
    // Before the first step there is no number of a step.
    let outcome = run("fault_init", "x = nil\nfunction init() { log(-x) }\n", &["--steps", "1"]);
    outcome.fails_with(1, &["`x` is nil"]);
    assert!(!outcome.stderr.contains("in step "), "{}", outcome.stderr);
}

#[test]
fn destroy_runs_after_the_last_step_where_it_is_wanted() {
    let script = "function step() { log(\"step\") }\nfunction destroy() { log(\"bye\") }\n";
    run("destroy", script, &["--steps", "2", "--destroy"]).succeeds_with("step\nstep\nbye\n");
    run("destroy", script, &["--steps", "0", "--destroy"]).succeeds_with("bye\n");
    run("destroy", script, &["--steps", "1"]).succeeds_with("step\n");
    run("destroy", script, &["--destroy"]).fails_with(3, &["--steps"]);
    let wrong = "function destroy() { log(nil + id) }\n";
    let outcome = run("destroy_fault", wrong, &["--steps", "1", "--destroy"]);
    outcome.fails_with(1, &["R0001", "`destroy`"]);
    assert!(!outcome.stderr.contains("in step 1"), "{}", outcome.stderr);
}

#[test]
fn json_has_an_object_for_each_line() {
    let objects = |test: &str, script: &str, status: i32| -> Vec<serde_json::Value> {
        let outcome = run(test, script, &["--steps", "3", "--json"]);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(status), ""));
        outcome.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let lines = objects("json", "n = 0\nfunction step() { n = n + 1  log(\"a\\\"\", n) }\n", 0);
    assert_eq!((&lines[0]["errors"], &lines[0]["warnings"]), (&0.into(), &0.into()));
    let printed: Vec<&str> = lines.iter().filter_map(|object| object["printed"].as_str()).collect();
    assert_eq!(printed, ["a\"1", "a\"2", "a\"3"]);
    let end = serde_json::json!({ "ended": "complete", "steps": 3, "fault": null });
    assert_eq!(lines.last(), Some(&end));
    let script =
        "n = 0\nfunction f(x) { return 1 / x }\nfunction step() { n = n + 1  log(f(n - 2)) }\n";
    let lines = objects("json_fault", script, 1);
    let end = lines.last().unwrap();
    assert_eq!((&end["ended"], &end["steps"]), (&"fault".into(), &2.into()));
    let (fault, calls) = (&end["fault"], &end["fault"]["calls"]);
    assert_eq!(
        (&fault["code"], &fault["message"]),
        (&"R0005".into(), &"integer division by zero".into())
    );
    assert_eq!(fault["values"], serde_json::json!([{ "name": "x", "value": "0" }]));
    assert_eq!(
        (&calls[0]["line"], &calls[0]["column"], &calls[0]["function"]),
        (&2.into(), &24.into(), &"f".into())
    );
    assert_eq!((&calls[1]["line"], &calls[1]["function"]), (&3.into(), &"step".into()));
    let lines = objects("json_error", "log(size())\n", 2);
    assert_eq!((lines.len(), &lines[0]["diagnostics"][0]["code"]), (1, &"E0403".into()));
}

#[test]
fn a_lack_of_memory_names_the_globals_that_hold_it() {
    let script = "few = { .1 = 1 }\nmany = {}\nn = 0\nfunction step() {\n  n = n + 1\n  many[n] = { .x = n }\n}\n";
    for (robot, slots) in [("kilobot", 0), ("zooids", 0)] {
        let outcome = run("memory", script, &["--robot", robot, "--steps", "10000"]);
        outcome
            .fails_with(1, &["R0010", "in step ", "tables, closures and strings", "`many` holds "]);
        // The other table has one entry.
        let held = |name: &str| -> usize {
            let (_, rest) = outcome.stderr.split_once(&format!("`{name}` holds ")).unwrap();
            rest.chars().take_while(char::is_ascii_digit).collect::<String>().parse().unwrap()
        };
        assert!(held("many") > 10 * held("few") && held("few") > slots, "{}", outcome.stderr);
    }
    let deep = "function f(n) { return f(n + 1) + 1 }\nfunction init() { f(0) }\n";
    let outcome = run("memory_calls", deep, &["--robot", "kilobot"]);
    outcome.fails_with(1, &["R0009", "globals and calls take ", "tables, closures and strings 0"]);
}

#[test]
fn every_kind_of_fault_has_its_message() {
    // The variables keep the compiler from seeing the mistake.
    let cases = [
        ("x + 1", "R0001", "cannot add nil and an integer: `x` is nil"),
        ("s - 1", "R0001", "cannot subtract an integer from a string"),
        ("1.5 * t", "R0001", "cannot multiply a float by a table"),
        ("s / 2", "R0001", "cannot divide a string by an integer"),
        ("f % 2", "R0001", "cannot take a closure modulo an integer"),
        ("x ^ 2", "R0001", "cannot raise nil to the power of an integer: `x` is nil"),
        ("-s", "R0001", "cannot negate a string"),
        ("!x", "R0001", "cannot invert the bits of nil: `x` is nil"),
        ("1.5 & n", "R0001", "cannot combine the bits of a float and an integer"),
        ("n << 1.5", "R0001", "cannot shift an integer by a float"),
        ("math.abs(s)", "R0001", "`math.abs` does not take a string"),
        ("math.rng.uniform(s)", "R0001", "`math.rng.uniform` does not take a string"),
        ("x.y", "R0002", "cannot read field `y` of nil: `x` is nil"),
        ("s[1]", "R0002", "cannot read an entry of a string"),
        ("size(n)", "R0002", "`size` needs a table, not an integer"),
        ("x()", "R0003", "cannot call nil: `x` is nil"),
        ("map(t, n)", "R0003", "`map` needs a function to call, not an integer"),
        ("t[x]", "R0004", "a table key must be a number or a string, not nil"),
        ("1 / n", "R0005", "integer division by zero"),
        ("1 % n", "R0005", "integer modulo by zero"),
        ("1 << (n - 1)", "R0006", "the shift count is outside the bits of an integer"),
        ("g()", "R0007", "argument `a` was not passed"),
        ("s < n", "R0008", "cannot order a string and an integer"),
        ("math.max(s, 1)", "R0008", "`math.max` cannot order a string and an integer"),
        ("assert(n)", "R0011", "assertion failed"),
        ("assert(n == 1, \"n is one\")", "R0011", "assertion failed: n is one"),
    ];
    let folder = Folder::new("kinds");
    for (expression, code, message) in cases {
        let script = format!(
            "x = nil\ns = \"text\"\nt = {{ .one = 1 }}\nn = 0\nf = function() {{ }}\nfunction g(a) {{ return a }}\nlog({expression})\n"
        );
        folder.write("s.bzz", script);
        for profile in ["full", "tiny"] {
            let outcome = folder.bbz(&["run", "s.bzz", "--profile", profile]);
            assert_eq!(outcome.status, Some(1), "{expression}: {}", outcome.stderr);
            outcome.reports(&[&format!("error[{code}]: {message}\n"), "--> s.bzz:"]);
        }
    }
}

#[test]
fn examples_of_run_time_errors_give_the_code_that_they_explain() {
    let folder = Folder::new("explained");
    let text = include_str!("../../docs/run-time-errors.md");
    let mut examples = 0;
    for section in text.split("\n## ").skip(1) {
        let code = section.split_whitespace().next().unwrap();
        let (_, example) = section.split_once("```buzz\n").unwrap();
        let (example, _) = example.split_once("```").unwrap();
        folder.write("s.bzz", example);
        // Strings have a limit on a robot with a chip.
        let robot: &[&str] = if code == "R0018" { &["--robot", "crazyflie"] } else { &[] };
        let outcome = folder.bbz(&[&["run", "s.bzz"], robot].concat());
        assert_eq!(outcome.status, Some(1), "{code}");
        outcome.reports(&[&format!("error[{code}]"), "--> s.bzz:"]);
        examples += 1;
    }
    assert!(examples >= 12);
}

#[test]
fn an_entry_without_end_is_an_error_in_a_run_with_steps() {
    let folder = Folder::new("endless");
    let cases = [
        ("while(1) { }\n", "the global code", "s.bzz:1:"),
        ("function init() {\n  while(1) { }\n}\n", "`init()`", "s.bzz:2:"),
        (
            "n = 0\nfunction f() { while(n == 2) { } }\nfunction step() {\n  n = n + 1\n  f()\n}\n",
            "step 2",
            "s.bzz:5:",
        ),
    ];
    for (script, entry, place) in cases {
        folder.write("s.bzz", script);
        let outcome = folder.bbz(&["run", "s.bzz", "--steps", "5"]);
        outcome.fails_with(
            1,
            &[&format!("{entry} did not end within 100 million instructions"), place],
        );
    }
    let json = folder.bbz(&["run", "s.bzz", "--steps", "5", "--json"]);
    assert_eq!(json.status, Some(1));
    let last = json.stdout.lines().last().unwrap();
    let last: serde_json::Value = serde_json::from_str(last).unwrap();
    assert_eq!(last["ended"], "endless");
    assert_eq!(last["steps"], 2);
    assert_eq!(last["calls"][0]["line"], 2);
    // A long step that ends is no error, and a wait takes no instructions.
    folder.write(
        "s.bzz",
        "function step() { for(i = 0, i < 300000, i = i + 1) { } delay(1000000) log(i) }\n",
    );
    folder.bbz(&["run", "s.bzz", "--steps", "2"]).succeeds_with("300000\n300000\n");
}

#[test]
fn help_is_about_the_operand_that_is_wrong() {
    let with_nil = run("help_nil", "x = nil\nlog(1 + x)\n", &[]);
    with_nil.fails_with(1, &["never assigned is nil"]);
    let without = run("help_string", "s = \"x\"\ndelay(s)\n", &[]);
    without.fails_with(1, &["`delay` does not take a string", "`type(x)`"]);
    assert!(!without.stderr.contains("nil"), "{}", without.stderr);
}

#[test]
fn messages_cannot_control_the_terminal() {
    // Symbols can come from anywhere.
    let script = "function f(x) { return 1 / x }\ng = f\nlog(g(0))\n";
    let folder = Folder::with("control", "s.bzz", script);
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "kilobot"]).status, Some(0));
    let symbols = String::from_utf8(folder.read("s.sym")).unwrap();
    let evil = symbols.replace("\"f\"", "\"\\u001b[2J\"").replace("s.bzz", "\\u001b[2J.bzz");
    assert_ne!(evil, symbols);
    folder.write("s.sym", evil);
    let outcome = folder.bbz(&["run", "s.bbi"]);
    outcome.fails_with(1, &["R0005"]);
    let forced = folder.command(&["run", "s.bbi"]).env("CLICOLOR_FORCE", "1").spawn().unwrap();
    assert!(!support::finish(forced).stderr.contains("\u{1b}[2J"));
    folder.write("s.bzz", "message = \"\u{1b}[2J\"\nassert(0, message)\n");
    let forced = folder.command(&["run", "s.bzz"]).env("CLICOLOR_FORCE", "1").spawn().unwrap();
    let outcome = support::finish(forced);
    outcome.reports(&["R0011"]);
    let message = outcome.stderr.lines().next().unwrap_or_default();
    assert!(!message.contains("\u{1b}[2J"), "{message}");
}

#[test]
fn storing_into_nil_is_a_fault() {
    let folder = Folder::new("storing");
    for (statement, message) in
        [("x.y = 1", "cannot set field `y` of nil"), ("x[1] = 1", "cannot set an entry of nil")]
    {
        folder.write("s.bzz", format!("x = nil\n{statement}\n"));
        folder.bbz(&["run", "s.bzz"]).fails_with(1, &["error[R0002]", message, "s.bzz:2:1"]);
    }
}

#[test]
fn a_recursion_without_end_shows_some_of_its_calls() {
    let script = "function f(n) { return f(n + 1) + 1 }\nf(0)\n";
    let outcome = run("recursion", script, &[]);
    outcome.fails_with(1, &["error[R0009]", "stack overflow", "more calls", "in global code"]);
    assert!(outcome.stderr.lines().count() < 25, "{}", outcome.stderr);
}

#[test]
fn step_that_is_no_function() {
    run("no_function", "step = 2.5\n", &["--steps", "1"])
        .fails_with(1, &["R0003", "cannot call a float", "the robot called `step`"]);
}

#[test]
fn a_line_may_hold_any_character() {
    // Columns count characters, the mark counts columns.
    let outcome = run("characters", "x = nil\nlog(\"\u{e9}\u{4e16}\", x + 1)\n", &[]);
    outcome.fails_with(1, &["s.bzz:2:11", "\u{e9}\u{4e16}"]);
}

#[test]
fn warnings_are_printed_and_change_nothing() {
    let outcome = run("warnings", "log(undefined_thing)\n", &[]);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(0), "[nil]\n"));
    outcome.reports(&["warning[W", "s.bzz:1:5"]);
}

#[test]
fn compile_errors_run_nothing() {
    let outcome = run("errors", "log(1)\nlog(2\n", &[]);
    outcome.fails_with(2, &["error[E", "s.bzz:2:"]);
    run("robot_lacks", "takeoff(100)\n", &["--robot", "kilobot"])
        .fails_with(2, &["takeoff", "Kilobot", "s.bzz:1:1"]);
}

#[test]
fn includes_are_searched_everywhere() {
    let folder = Folder::with("includes", "s.bzz", "include \"a.bzz\"\ninclude \"b.bzz\"\n");
    for (name, text) in [("one/a.bzz", "log(\"a\")\n"), ("two/b.bzz", "log(\"b\")\n")] {
        std::fs::create_dir_all(folder.path(name).parent().unwrap()).unwrap();
        folder.write(name, text);
    }
    folder.bbz(&["run", "s.bzz", "-I", "one"]).fails_with(2, &["b.bzz", "s.bzz:2:1"]);
    folder.bbz(&["run", "s.bzz", "-I", "one", "-I", "two"]).succeeds_with("a\nb\n");
    let child = folder.command(&["run", "s.bzz"]).env("BUZZ_INCLUDE_PATH", ":two::one:").spawn();
    support::finish(child.unwrap()).succeeds_with("a\nb\n");
}

#[test]
fn the_library_needs_no_folder() {
    let script = "include \"vec2.bzz\"\nlog(math.vec2.length(math.vec2.new(3.0, 4.0)))\n";
    run("library", script, &[]).succeeds_with("5.000000\n");
}

#[test]
fn a_fault_in_the_library_shows_the_librarys_source() {
    let script = "include \"vec2.bzz\"\nlog(math.vec2.length(nil))\n";
    run("library_fault", script, &[])
        .fails_with(1, &["R0002", "<library>/vec2.bzz:", "called at s.bzz:2:5"]);
}
