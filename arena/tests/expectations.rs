//! An expectation of each kind holds and fails when it should.

use crate::script::{folder, read, run, setup_errors};
use bittybuzz_arena::run::Verdict;

/// Robot n has n in `number`, a word in `word`, shows its number, and never assigns `nothing`. `steps` grows.
const SCRIPT: &str = "\
number = 0
word = \"even\"
nothing = nil
steps = 0
state = { .count = 7, .0 = { .x = 1.5 }, .name = \"deep\" }
function init() {
  number = id
  if(id % 2 == 1) word = \"odd\"
  s = stigmergy.create(3)
  if(id < 2) s.put(\"key\", id + 10)
  led(id)
}
function step() { steps = steps + 1 assert(nothing == nil) neighbors.count() }
";

/// What is expected of five robots, ids 0 to 4, for ten seconds, and whether it holds.
const CASES: &[(&str, bool)] = &[
    // Times.
    ("at = 5\nvalue = \"global.steps\"\nequals = 49", true),
    ("at = 5\nvalue = \"global.steps\"\nequals = 50", false),
    ("at = 0\nvalue = \"global.number\"\nexists = false", true),
    ("at = 10\nvalue = \"global.steps\"\nequals = 99", true),
    ("within = 5\nvalue = \"global.steps\"\nequals = 30", true),
    ("within = 2\nvalue = \"global.steps\"\nequals = 30", false),
    ("always = 1\nvalue = \"global.steps\"\nabove = 5", true),
    ("always = 0\nvalue = \"global.steps\"\nabove = 5", false),
    ("always = [0, 5]\nvalue = \"global.steps\"\nbelow = 50", false),
    ("always = [0.1, 5]\nvalue = \"global.steps\"\nbelow = 50", true),
    // Comparisons.
    ("at = 1\nvalue = \"global.number\"\nrobots = 3\nequals = 3", true),
    ("at = 1\nvalue = \"global.number\"\nrobots = 3\nequals = 3.5", false),
    ("at = 1\nvalue = \"global.number\"\nrobots = 3\nequals = 3.5\ntolerance = 0.5", true),
    ("at = 1\nvalue = \"global.number\"\nrobots = 3\ndiffers = 3", false),
    ("at = 1\nvalue = \"global.number\"\nrobots = 3\ndiffers = 2", true),
    ("at = 1\nvalue = \"global.word\"\nrobots = [1, 3]\nequals = \"odd\"", true),
    ("at = 1\nvalue = \"global.word\"\nrobots = [1, 2]\nequals = \"odd\"", false),
    ("at = 1\nvalue = \"global.word\"\nrobots = 1\nequals = 3", false),
    ("at = 1\nvalue = \"global.number\"\nbelow = 5", true),
    ("at = 1\nvalue = \"global.number\"\nbelow = 4", false),
    ("at = 1\nvalue = \"global.number\"\nrobots = \"1..4\"\nabove = 0", true),
    ("at = 1\nvalue = \"global.number\"\nabove = 0", false),
    ("at = 1\nvalue = \"global.number\"\nbetween = [0, 4]", true),
    ("at = 1\nvalue = \"global.number\"\nbetween = [1, 4]", false),
    ("at = 1\nvalue = \"global.nothing\"\nexists = false", true),
    ("at = 1\nvalue = \"global.nothing\"\nexists = true", false),
    ("at = 1\nvalue = \"global.nothing\"\nbelow = 5", false),
    ("at = 1\nvalue = \"global.word\"\nexists = true", true),
    ("at = 1\nvalue = \"global.state.count\"\nequals = 7", true),
    ("at = 1\nvalue = \"global.state.count\"\nequals = 8", false),
    ("at = 1\nvalue = \"global.state.0.x\"\nequals = 1.5", true),
    ("at = 1\nvalue = \"global.state.name\"\nequals = \"deep\"", true),
    ("at = 1\nvalue = \"global.state.1\"\nexists = false", true),
    ("at = 1\nvalue = \"global.number.count\"\nexists = true", false),
    ("at = 1\nvalue = \"global.state\"\nexists = true", true),
    ("at = 1\nvalue = \"global.state\"\nequals = 7", false),
    // How values count together.
    ("at = 1\nvalue = \"global.number\"\nof = \"any\"\nequals = 4", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"any\"\nequals = 5", false),
    ("at = 1\nvalue = \"global.number\"\nof = \"none\"\nequals = 5", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"none\"\nequals = 4", false),
    ("at = 1\nvalue = \"global.number\"\nof = \"one\"\nequals = 4", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"one\"\nabove = 2", false),
    ("at = 1\nvalue = \"global.number\"\nof = 2\nabove = 2", true),
    ("at = 1\nvalue = \"global.number\"\nof = 3\nabove = 2", false),
    ("at = 1\nvalue = \"global.steps\"\nof = \"agree\"", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"agree\"", false),
    ("at = 1\nvalue = \"global.number\"\nof = \"agree\"\ntolerance = 4", true),
    ("at = 1\nvalue = \"global.word\"\nof = \"agree\"", false),
    (
        "at = 1\nvalue = \"global.word\"\nof = \"agree\"\nrobots = [0, 2, 4]\nequals = \"even\"",
        true,
    ),
    (
        "at = 1\nvalue = \"global.word\"\nof = \"agree\"\nrobots = [0, 2, 4]\nequals = \"odd\"",
        false,
    ),
    ("at = 1\nvalue = \"global.number\"\nof = \"mean\"\nequals = 2", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"mean\"\nequals = 3", false),
    ("at = 1\nvalue = \"global.number\"\nof = \"sum\"\nequals = 10", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"sum\"\nabove = 10", false),
    ("at = 1\nvalue = \"global.number\"\nof = \"min\"\nequals = 0", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"min\"\nequals = 1", false),
    ("at = 1\nvalue = \"global.number\"\nof = \"max\"\nequals = 4", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"max\"\nbelow = 4", false),
    ("at = 1\nvalue = \"global.number\"\nof = \"spread\"\nequals = 4", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"spread\"\nequals = 0", false),
    ("at = 1\nvalue = \"global.word\"\nof = \"different\"\nequals = 2", true),
    ("at = 1\nvalue = \"global.word\"\nof = \"different\"\nequals = 1", false),
    ("at = 1\nvalue = \"global.word\"\nof = \"mean\"\nequals = 0", false),
    // nil satisfies nothing but `exists`: before the first tick, and where a robot has no value.
    ("at = 0\nvalue = \"global.number\"\nof = \"agree\"", false),
    ("within = 10\nvalue = \"global.number\"\nof = \"agree\"", false),
    ("at = 0\nvalue = \"global.number\"\nrobots = 2\nof = \"agree\"", false),
    ("at = 0\nvalue = \"global.number\"\nof = \"agree\"\nexists = false", false),
    ("at = 0\nvalue = \"global.number\"\ndiffers = 9", false),
    ("within = 10\nvalue = \"global.number\"\nrobots = 3\ndiffers = 3", false),
    ("at = 0\nvalue = \"global.number\"\nof = \"none\"\nequals = 9", false),
    ("within = 10\nvalue = \"global.number\"\nof = \"none\"\nequals = 3", false),
    ("at = 0\nvalue = \"global.number\"\nof = \"none\"\nabove = 9", false),
    ("at = 0\nvalue = \"global.number\"\nof = \"different\"\nequals = 1", false),
    ("at = 0\nvalue = \"global.number\"\nof = \"different\"\nbelow = 1", false),
    ("at = 0\nvalue = \"global.number\"\nof = \"none\"\nexists = true", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"none\"\nexists = false", true),
    ("at = 1\nvalue = \"global.number\"\nof = \"none\"\nexists = true", false),
    ("at = 1\nvalue = \"global.nothing\"\ndiffers = 3", false),
    ("at = 1\nvalue = \"global.nothing\"\nof = \"agree\"", false),
    // Only robots 0 and 1 have the entry yet.
    ("at = 0.1\nvalue = \"stigmergy.3.key\"\nof = \"none\"\nequals = 7", false),
    ("at = 0.1\nvalue = \"stigmergy.3.key\"\nrobots = [0, 1]\nof = \"none\"\nequals = 7", true),
    ("at = 0.1\nvalue = \"stigmergy.3.key\"\nof = \"different\"\nequals = 2", true),
    ("at = 0.1\nvalue = \"stigmergy.3.key\"\nof = 2\nabove = 9", true),
    // Quantities.
    ("at = 10\nvalue = \"steps\"\nequals = 99", true),
    ("at = 0.1\nvalue = \"steps\"\nequals = 0", true),
    ("at = 1\nvalue = \"x\"\nrobots = 2\nequals = 0\ntolerance = 0.01", true),
    ("at = 1\nvalue = \"x\"\nrobots = 3\nequals = 0\ntolerance = 0.01", false),
    ("at = 1\nvalue = \"y\"\nequals = 100\ntolerance = 0.01", true),
    ("at = 1\nvalue = \"z\"\nequals = 0", true),
    ("at = 1\nvalue = \"heading\"\nequals = 90\ntolerance = 0.01", true),
    ("at = 1\nvalue = \"heading\"\nequals = 0", false),
    ("at = 1\nvalue = \"distance(0, 70)\"\nrobots = 3\nequals = 50\ntolerance = 0.01", true),
    ("at = 1\nvalue = \"distance(0, 70)\"\nrobots = 3\nequals = 40", false),
    ("at = 1\nvalue = \"led\"\nof = \"sum\"\nequals = 10", true),
    ("at = 1\nvalue = \"led\"\nequals = 1", false),
    ("at = 1\nvalue = \"running\"\nequals = 1", true),
    ("at = 10\nvalue = \"neighbors\"\nrobots = 2\nequals = 4", true),
    ("at = 0\nvalue = \"neighbors\"\nrobots = 2\nequals = 4", false),
    ("at = 0.1\nvalue = \"stigmergy.3.key\"\nrobots = 1\nequals = 11", true),
    ("at = 0.1\nvalue = \"stigmergy.3.key\"\nrobots = 4\nexists = false", true),
    // At equal clocks the higher robot wins.
    ("at = 10\nvalue = \"stigmergy.3.key\"\nof = \"agree\"\nequals = 11", true),
    ("at = 10\nvalue = \"stigmergy.3.other\"\nexists = true", false),
    ("at = 10\nvalue = \"stigmergy.2.key\"\nexists = true", false),
    ("at = 10\nvalue = \"stigmergy.3.7\"\nexists = true", false),
];

const WORLD: &str = "[world]\nsize = [1000, 1000]\nduration = 10\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 5\nplacement = \"line\"\nat = [-80, 100]\nspacing = 40\nheading = 90\nclock_skew = 0\n\
    [medium.ir]\nloss = 0\n";

#[test]
fn each_kind_of_expectation_can_hold_and_fail() {
    let folder = folder("expectations", &[("s.bzz", SCRIPT)]);
    let mut text = WORLD.to_owned();
    for (case, _) in CASES {
        text += &format!("[[expect]]\n{case}\n");
    }
    let summary = run(&folder, &text);
    assert!(summary.faults.is_empty(), "{:?}", summary.faults);
    for ((case, holds), found) in CASES.iter().zip(&summary.convergences) {
        let verdict = if *holds { Verdict::Held } else { Verdict::Failed };
        assert_eq!(found.verdict, verdict, "{case}\n{found:?}");
    }
    assert!(!summary.is_success());
}

#[test]
fn the_time_of_lasting_convergence_is_reported() {
    let folder = folder("since", &[("s.bzz", SCRIPT)]);
    let text = format!(
        "{WORLD}[[expect]]\nat = 10\nvalue = \"global.steps\"\nabove = 49\n\
         [[expect]]\nwithin = 10\nvalue = \"global.steps\"\nbetween = [10, 20]\n"
    );
    let summary = run(&folder, &text);
    // Step 50 ends in the tick that ends at 5.1 s.
    assert_eq!(
        (summary.convergences[0].first, summary.convergences[0].since),
        (Some(51), Some(51))
    );
    assert_eq!((summary.convergences[1].first, summary.convergences[1].since), (Some(11), None));
    assert!(summary.is_success());
}

#[test]
fn a_run_with_a_fault_does_not_succeed() {
    let script = "n = 0\nfunction step() { n = n + 1 if(n == 10 and id == 1) set_motor(300, 0) }\n";
    let folder = folder("fault", &[("s.bzz", script)]);
    let text =
        format!("{WORLD}[[expect]]\nat = 10\nvalue = \"running\"\nof = \"sum\"\nequals = 4\n");
    let summary = run(&folder, &text);
    assert_eq!(summary.convergences[0].verdict, Verdict::Held);
    assert_eq!(summary.faults.len(), 1);
    assert_eq!((summary.faults[0].robot, summary.faults[0].record.tick), (1, 10));
    assert!(!summary.is_success());
}

#[test]
fn unknown_names_are_reported_with_their_place() {
    let folder = folder("names", &[("s.bzz", SCRIPT), ("other.bzz", "other = 1\n")]);
    let text = format!(
        "{WORLD}[[robots]]\nrobot = \"kilobot\"\nname = \"others\"\nscript = \"other.bzz\"\n\
         [[expect]]\nat = 1\nvalue = \"global.numbr\"\nequals = 1\n\
         [[expect]]\nat = 1\nvalue = \"global.number\"\nrobots = \"others\"\nequals = 1\n\
         [output]\nplot = [\"global.other\", \"global.none\", \"global.state.nokey\"]\n"
    );
    let errors = setup_errors(&folder, &text);
    let printed: Vec<String> = errors
        .iter()
        .map(|error| {
            let place = error.place.as_ref().map_or((0, 0), |place| (place.line, place.column));
            format!("{place:?} {error} | {}", error.help().unwrap_or_default())
        })
        .collect();
    assert_eq!(printed.len(), 4, "{printed:#?}");
    assert!(printed[0].contains("`numbr`") && printed[0].contains("`number`?"), "{}", printed[0]);
    assert!(printed[1].contains("`number`") && printed[1].contains("other"), "{}", printed[1]);
    assert!(printed[2].contains("`none`"), "{}", printed[2]);
    assert!(printed[3].contains("`state.nokey`"), "{}", printed[3]);
}

#[test]
fn a_robot_without_a_model_is_refused() {
    let kilobot = bittybuzz_robot_files::shipped()[0].text;
    let large = kilobot.replace("memory = 1765", "memory = 262144");
    let slots = kilobot.lines().find(|line| line.starts_with("slots")).unwrap_or_default();
    let large = large.replace(slots, "slots = 65520");
    let folder = folder("misfit", &[("s.bzz", SCRIPT), ("large.toml", &large)]);
    let text = WORLD.replace("\"kilobot\"", "\"large.toml\"\nbody = \"kilobot\"");
    let errors = setup_errors(&folder, &text);
    assert_eq!(errors.len(), 1);
    assert!(errors[0].to_string().contains("slots for the script"), "{}", errors[0]);
}

#[test]
fn an_expectation_names_its_robots() {
    let texts = |robots: &str, of: &str| {
        let robots = if robots.is_empty() { String::new() } else { format!("robots = {robots}\n") };
        let text = format!(
            "[world]\nsize = [900, 900]\nduration = 2\n\
             [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\nname = \"workers\"\ncount = 20\n\
             [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\nname = \"lamps\"\ncount = 2\n\
             [[expect]]\nat = 1\nvalue = \"led\"\n{robots}{of}equals = 4\n"
        );
        let folder = folder("named", &[("s.bzz", "")]);
        read(&folder, &text).0.expects[0].to_string()
    };
    for (robots, of, expected) in [
        ("", "", "all: led"),
        ("\"all\"", "of = \"any\"\n", "any: led"),
        ("3", "", "robot 3: led"),
        ("[3]", "of = \"one\"\n", "robot 3: led"),
        ("3", "of = \"none\"\n", "none of robot 3: led"),
        ("[0, 2]", "", "all of robots 0, 2: led"),
        ("[0x10, \"3 .. 5\"]", "of = 2\n", "2 or more of robots 16, 3 to 5: led"),
        ("\"lamps\"", "of = \"any\"\n", "any of lamps: led"),
        ("[7, \"lamps\", 9]", "of = \"agree\"\n", "agree, lamps, robots 7, 9: led"),
        ("[7, \"lamps\"]", "of = \"mean\"\n", "mean of led of lamps, robot 7"),
        (
            "[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]",
            "",
            "all of robots 0, 1, 2, 3, 4, 5, 6, 7 and 2 more: led",
        ),
    ] {
        assert_eq!(texts(robots, of), format!("{expected} equals 4, at 1 s"), "{robots} {of}");
    }
}
