//! Tables that a robot fills: the numbers of strings and functions, names of the script, fields that no robot has.

use bittybuzz_compiler::check::outside::OutsideUses;
use bittybuzz_compiler::compile::{Compiled, Options};
use bittybuzz_compiler::profile::NumberProfile;
use bittybuzz_robot_spec::Robot;

use crate::back::machine::{build_with, listing};

const BODY: &str = "\
name = \"bot\"
[body]
drive = \"unicycle\"
radius_mm = 40
speed_mm_s = 100
turn_deg_s = 90
[[function]]
name = \"go\"
accepts = [\"v: number\"]
sets = { forward = \"v\" }
help = \"go\"
";

const TABLES: &str = "
[[sensor]]
name = \"gps\"
kind = \"positioning\"
[[sensor]]
name = \"ring\"
kind = \"proximity\"
range_mm = 100
count = 3
[[function]]
name = \"debug.print\"
accepts = [\"values: any...\"]
logs = true
help = \"print\"
[[function]]
name = \"where_am_i\"
accepts = [\"\"]
returns = \"string\"
logs = true
help = \"cell\"
[[value]]
name = \"pose.position.x\"
reads = \"gps.x m\"
help = \"m\"
[[value]]
name = \"pose.position.y\"
reads = \"gps.y m\"
help = \"m\"
[[value]]
name = \"proximity[].value\"
reads = \"ring\"
help = \"mm\"
[[value]]
name = \"proximity[].angle\"
is = [0.0, 1.0, 2.0]
help = \"rad\"
[[value]]
name = \"debug.queue.total\"
is = 7
help = \"messages\"
[[value]]
name = \"debug.queue.age\"
reads = \"gps.z\"
help = \"mm\"
";

fn robot(tables: bool) -> Robot {
    let text = if tables { format!("{BODY}{TABLES}") } else { BODY.to_owned() };
    Robot::parse(&text, "bot.toml").unwrap()
}

fn build(script: &str, tables: bool) -> Compiled {
    let options = Options { robot: Some(robot(tables)), ..Options::default() };
    build_with(script, &options)
}

fn codes(script: &str) -> Vec<&'static str> {
    build(script, true).diagnostics.iter().map(|diagnostic| diagnostic.code.text()).collect()
}

/// The functions of an image by number, and its strings.
fn numbers(compiled: &Compiled) -> (Vec<String>, Vec<String>) {
    let symbols = compiled.symbols.as_ref().unwrap();
    let functions = symbols.functions.iter().map(|function| function.name.clone());
    (functions.collect(), symbols.strings.clone())
}

/// Robots of different kinds send each other numbers of strings and functions.
#[test]
fn strings_and_functions_keep_their_numbers() {
    let script = "\
        function far(p) { return p.x > 2 }\n\
        function init() { foreach(proximity, function(i, beam) { log(i, beam.value) }) }\n\
        function step() { neighbors.broadcast(\"far\", far) if(pose) log(far(pose.position)) }\n\
        function destroy() { log(\"end\") }\n";
    let (functions, strings) = numbers(&build(script, true));
    let (without, same) = numbers(&build(script, false));
    assert_eq!(strings, same);
    assert_eq!(functions[..without.len()], without);
    assert_eq!(functions[without.len()..], ["before step"]);
    // The keys `y` and `angle`, which the script does not name, are left out.
    assert!(!strings.iter().any(|text| text == "y" || text == "angle"), "{strings:?}");
}

#[test]
fn images_without_these_tables_stay_the_same() {
    for script in [
        "function step() { go(1) }",
        "pose = { .position = { .x = 1 } } function step() { log(pose.position.x) }",
        "function pose() { return 1 } function step() { log(pose()) }",
        "function step() { var pose = { .position = 3 } log(pose.position) }",
        "function step(debug) { debug.print(1) }",
        "t = { .pose = 1 } function step() { log(t.pose, t.proximity) }",
    ] {
        let [with, without] = [true, false].map(|tables| build(script, tables).image);
        assert!(with.is_some() && with == without, "{script}");
    }
}

/// The robot functions that an image calls, in order.
fn calls(script: &str) -> Vec<String> {
    let compiled = build(script, true);
    let Some(image) = &compiled.image else { panic!("{:#?}", compiled.diagnostics) };
    let text = listing(image, compiled.symbols.as_ref().unwrap());
    let calls = text.lines().filter(|line| line.contains("CALL_ROBOT"));
    let name = |line: &str| line.split_once("; ").map(|(_, name)| name.trim().to_owned());
    calls.filter_map(name).map(|name| name.split("  ").next().unwrap_or("").to_owned()).collect()
}

#[test]
fn functions_in_tables_are_called_directly() {
    assert_eq!(calls("function step() { debug.print(1) }"), ["debug.print"]);
    // As a value it stands in a table, which is filled once: nothing there changes in what is named.
    assert_eq!(calls("f = debug.print function step() { f(1) }"), [""; 0]);
    assert_eq!(calls("function step() { log(debug.queue.total) }"), [""; 0]);
    // Only the table with a value that changes is filled, in the global code and before each step.
    assert_eq!(
        calls("function step() { log(debug.queue.age) debug.print(1) }"),
        ["debug.queue.age", "debug.print", "debug.queue.age"]
    );
}

#[test]
fn each_element_is_read() {
    let read = ["proximity[].value"; 3];
    assert_eq!(calls("log(proximity[1].value)"), read);
    assert_eq!(calls("function step() { log(proximity[1].value) }"), [read, read].concat());
    // A script that only asks for angles reads nothing.
    assert_eq!(calls("function step() { log(proximity[1].angle) }"), [""; 0]);
}

#[test]
fn fields_that_no_robot_has_are_reported() {
    assert_eq!(codes("function step() { log(pose.position.z) }"), ["W0208"]);
    assert_eq!(codes("function step() { log(pose.orientation) }"), ["W0208"]);
    assert_eq!(codes("function step() { debug.prnt(1) }"), ["E0410"]);
    assert_eq!(codes("function step() { pose.print(1) }"), ["E0410"]);
    // The script may put a field there, or something else may.
    for script in [
        "function step() { pose.speed = 1 log(pose.speed) }",
        "function set(t) { t.speed = 1 } function step() { set(pose) log(pose.speed) }",
        "p = pose p.speed = 1 function step() { log(pose.speed, p.speed) }",
        "function step() { log(proximity[0].other) }",
        "function step() { if(pose) log(pose.position.x) }",
    ] {
        assert_eq!(codes(script), [""; 0], "{script}");
    }
    let misspelled = build("function step() { debug.prnt(1) }", true);
    let help = misspelled.diagnostics[0].help.as_deref();
    assert_eq!(help, Some("did you mean `print`?"));
}

/// Other robots lack the tables, and the message says so.
#[test]
fn robots_that_lack_a_table_are_named() {
    let options =
        Options { robot: Some(robot(false)), robots: vec![robot(true)], ..Options::default() };
    let codes = |script: &str| -> Vec<_> {
        let compiled = build_with(script, &options);
        compiled.diagnostics.iter().map(|found| found.code.text()).collect()
    };
    assert_eq!(codes("function step() { log(pose.position.x) }"), ["W0201"]);
    assert_eq!(codes("function step() { if(pose) log(pose.position.x) }"), [""; 0]);
}

#[test]
fn small_numbers_have_tables_too() {
    let options = Options {
        robot: Some(robot(true)),
        profile: Some(NumberProfile::Tiny),
        ..Options::default()
    };
    let script = "function step() { log(pose.position.x, proximity[2].angle) debug.print(1) }";
    let compiled = build_with(script, &options);
    assert!(compiled.image.is_some(), "{:#?}", compiled.diagnostics);
}

/// The entry of the steps is the script's function or a variable; without either, nothing is filled.
#[test]
fn steps_in_any_form_have_tables() {
    let fills = |script: &str| numbers(&build(script, true)).0.contains(&"before step".to_owned());
    assert!(fills("function step() { log(pose.position.x) }"));
    assert!(fills("step = function() { log(pose.position.x) }"));
    assert!(fills("function go() { log(pose.position.x) } function init() { step = go }"));
    assert!(fills("function step() { log(pose.position.x) step = nil }"));
    assert!(!fills("function init() { log(pose.position.x) }"));
    assert!(!fills("log(pose.position.x)"));
}

/// What events of a scenario use is there although the script does not use it.
#[test]
fn functions_and_names_are_used_from_outside() {
    let uses = OutsideUses {
        called: ["alarm", "none"].map(str::to_owned).into(),
        assigned: ["goal", "none"].map(str::to_owned).into(),
    };
    let build = |script: &str, outside: &OutsideUses| {
        let robot = Some(robot(true));
        build_with(script, &Options { robot, outside: outside.clone(), ..Options::default() })
    };
    let script = "function alarm() { log(goal) }\nfunction step() { go(1) }";
    let codes = |compiled: &Compiled| -> Vec<_> {
        compiled.diagnostics.iter().map(|found| found.code.text()).collect()
    };
    // Nothing calls `alarm`, and nothing assigns `goal`.
    assert_eq!(codes(&build(script, &OutsideUses::default())), ["W0201"]);
    let used = build(script, &uses);
    assert_eq!(codes(&used), [""; 0]);
    let mut globals = used.symbols.unwrap().globals;
    globals.sort();
    assert_eq!(globals, ["call alarm", "goal"]);
    // A script without steps has calls, too.
    let without = build("function alarm() { log(1) }", &uses);
    let symbols = without.symbols.unwrap();
    assert_eq!(symbols.globals, ["call alarm"]);
    assert!(symbols.functions.iter().any(|function| function.name == "before step"));
    // Nothing of it is in a script without these names.
    let plain = "function step() { go(1) }";
    assert_eq!(build(plain, &uses).image, build(plain, &OutsideUses::default()).image);
}
