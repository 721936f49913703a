//! Questions: expressions that robots evaluate between two steps.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::script::{folder, program, read, setup_errors};
use bittybuzz_arena::robot::LineKind;
use bittybuzz_arena::run::{Session, Setup, Simulation};
use bittybuzz_random::Random;

const SCRIPT: &str = r#"n = 0 color = "red" t = {.a = 1, .b = {.c = 2}} got = nil
v = stigmergy.create(1)
function double(x) { return 2 * x }
function fill() { t.filled = n return t }
function count(x) { n = n + x log("counting ", x) return n }
function fails(x) { n = n + 100 return t.b + x }
function init() { v.put("key", 7) }
function step() { n = n + 1 fill() count(double(0)) if(n > 30000) fails(1) neighbors.broadcast("n", n) }
"#;

const WORLD: &str = "[world]\nsize = [1000, 1000]\nduration = 20\n\n\
    [[robots]]\nrobot = \"crazyflie\"\nname = \"big\"\nscript = \"s.bzz\"\ncount = 3\nplacement = \"line\"\nspacing = 200\n\n\
    [[robots]]\nrobot = \"kilobot\"\nname = \"small\"\nscript = \"s.bzz\"\nclock_skew = 0\ncount = 3\nplacement = \"line\"\nspacing = 50\nat = [0, 300]\n\n";

fn setup_of(folder: &Path, text: &str) -> Arc<Setup> {
    let (scenario, programs) = read(folder, text);
    Arc::new(Setup::new(scenario, programs).unwrap().with_compiler(Arc::new(program)))
}

fn simulation(test: &str, events: &str) -> Simulation {
    let folder = folder(test, &[("s.bzz", SCRIPT), ("next.bzz", "function step() { m = 5 }\n")]);
    Simulation::new(setup_of(&folder, &[WORLD, events].concat()), 1, 1).unwrap()
}

/// Returns the answers in the log since the last call, in the order of robots.
fn answers(simulation: &mut Simulation) -> Vec<(usize, u64, String)> {
    let lines = simulation.take_log();
    let lines = lines.into_iter().filter(|(_, line)| line.kind != LineKind::Logged);
    let setup = simulation.setup().clone();
    let text = |(robot, line): (usize, bittybuzz_arena::robot::LogLine)| {
        let symbols = setup.program(line.program).unwrap().symbols.as_deref();
        let mut text = Vec::new();
        line.pieces.iter().for_each(|piece| piece.append_to(symbols, &mut text));
        (robot, line.tick, String::from_utf8(text).unwrap())
    };
    lines.map(text).collect()
}

fn tick(simulation: &mut Simulation, ticks: u64) {
    (0..ticks).for_each(|_| simulation.tick().unwrap());
}

/// Asks a robot at the present tick and returns the answer.
fn ask(simulation: &mut Simulation, robot: usize, question: &str) -> String {
    simulation.command(&command(robot, question)).unwrap_or_else(|errors| panic!("{errors:?}"));
    simulation.take_log();
    simulation.tick().unwrap();
    let [(answering, _, text)] = &answers(simulation)[..] else { panic!("one answer") };
    assert_eq!(*answering, robot);
    text.clone()
}

fn command(robot: usize, question: &str) -> String {
    format!("robots = {robot}\nask = '''{question}'''")
}

fn refusal(simulation: &mut Simulation, robot: usize, question: &str) -> String {
    simulation.command(&command(robot, question)).unwrap_err()[0].to_string()
}

#[test]
fn robots_of_both_profiles_answer() {
    let mut simulation = simulation("questions_answers", "");
    tick(&mut simulation, 10);
    for robot in [1, 4] {
        let mut ask = |question| ask(&mut simulation, robot, question);
        assert_eq!(ask("1 + 2 * 3"), "1 + 2 * 3 = 7");
        assert_eq!(ask("color"), "color = red");
        assert_eq!(ask("t.b.c + 1"), "t.b.c + 1 = 3");
        assert_eq!(ask("t"), "t = [table with 3 elems]");
        assert_eq!(ask("v.get(\"key\")"), "v.get(\"key\") = 7");
        assert_eq!(ask("got"), "got = [nil]");
        assert_eq!(ask("double(20) + 2"), "double(20) + 2 = 42");
        assert_eq!(ask("n > 5 and 1"), "n > 5 and 1 = 1");
        assert_eq!(ask("neighbors.count() > 0"), "neighbors.count() > 0 = 1");
        assert_eq!(ask("  double(\n 4 )  # eight\n"), "double( 4 ) # eight = 8");
        assert_eq!(ask("math.abs(-3)"), "math.abs(-3) = 3");
    }
    assert_eq!(ask(&mut simulation, 1, "id"), "id = 1");
}

#[test]
fn effects_are_real_and_the_script_goes_on() {
    let mut simulation = simulation("questions_effects", "");
    tick(&mut simulation, 10);
    for robot in [2, 5] {
        let n = ask(&mut simulation, robot, "n");
        let n: u32 = n.strip_prefix("n = ").unwrap().parse().unwrap();
        assert_eq!(ask(&mut simulation, robot, "count(100)"), format!("count(100) = {}", n + 101));
        assert_eq!(ask(&mut simulation, robot, "n"), format!("n = {}", n + 102));
        assert_eq!(ask(&mut simulation, robot, "n = 5000"), "n = 5000: done");
        assert_eq!(ask(&mut simulation, robot, "n"), "n = 5001");
        assert_eq!(
            ask(&mut simulation, robot, "led(3) n = 1 double(n)"),
            "led(3) n = 1 double(n) = 2"
        );
        assert_eq!(simulation.view(robot).unwrap().led, 3);
        assert_eq!(ask(&mut simulation, robot, "led(5)"), "led(5) = [nil]");
        assert_eq!(simulation.view(robot).unwrap().led, 5);
    }
}

/// Values that name strings and functions of a question stay valid.
#[test]
fn what_a_question_stores_remains() {
    let mut simulation = simulation("questions_stores", "");
    tick(&mut simulation, 10);
    let mut ask = |question| ask(&mut simulation, 1, question);
    assert_eq!(ask("color = \"green\""), "color = \"green\": done");
    assert_eq!(ask("color"), "color = green");
    assert_eq!(
        ask("got = function(x) { return string.concat(\"got \", x) }"),
        "got = function(x) { return string.concat(\"got \", x) }: done"
    );
    assert_eq!(ask("got(\"it\")"), "got(\"it\") = got it");
    assert_eq!(ask("color"), "color = green");
    assert_eq!(ask("v.put(\"other\", \"blue\")"), "v.put(\"other\", \"blue\") = [nil]");
    assert_eq!(ask("v.get(\"other\")"), "v.get(\"other\") = blue");
    assert_eq!(ask("t.new = color"), "t.new = color: done");
    assert_eq!(ask("t.new"), "t.new = green");
    let text = format!("{:?}", simulation.inspect(1, bittybuzz_inspect::Limits::NONE));
    assert!(text.contains("green") && text.contains("\"other\""), "{text}");
    // The script begins again without them.
    simulation.command("restart = 1").unwrap();
    tick(&mut simulation, 2);
    assert_eq!(self::ask(&mut simulation, 1, "color"), "color = red");
}

#[test]
fn errors_end_a_question_and_nothing_else() {
    let mut simulation = simulation("questions_errors", "");
    tick(&mut simulation, 10);
    for robot in [0, 3] {
        let mut ask = |question| ask(&mut simulation, robot, question);
        assert_eq!(ask("fails(1)"), "fails(1): ended by an error");
        assert_eq!(ask("n > 100"), "n > 100 = 1");
        let endless = ask("while(1) { n = 3 }");
        assert!(
            endless.starts_with("while(1) { n = 3 }: ended, because it takes more than"),
            "{endless}"
        );
        assert_eq!(ask("n"), "n = 4");
        let waits =
            "delay(500): ended, because it calls a function that waits, which only the script can";
        assert_eq!(ask("delay(500)"), waits);
        assert_eq!(ask("n"), "n = 6");
        assert_eq!(simulation.post_mortem(robot).map(|_| ()), None);
    }
    let summary = simulation.summary();
    assert_eq!((summary.faults.len(), summary.fault_counts.faults), (2, 0));
    assert_eq!(summary.fault_counts.handler_faults, 2);
}

#[test]
fn mistakes_are_refused_before_the_command_is_given() {
    let mut simulation = simulation("questions_mistakes", "");
    tick(&mut simulation, 3);
    let digest = simulation.digest();
    let nested = "(".repeat(700) + "1" + &")".repeat(700);
    let long = format!("1{}", " + 1".repeat(20_000));
    let rejected = [
        ("", "an expression or a call is needed, such as `id` or `f(2)`"),
        (" # only a comment", "an expression or a call is needed, such as `id` or `f(2)`"),
        ("doubl(2)", "column 1: there is no function `doubl`; did you mean `double`?"),
        ("2 + colr", "column 5: nothing ever assigns `colr`: it is nil; did you mean `color`?"),
        ("1 +", "column 4: "),
        ("(1", "column "),
        ("1)", "column 2: "),
        ("0 } n = 5 function g() { n = 6", "column 3: "),
        ("return", "`return` belongs into a function: write the expression without it"),
        ("return n", "`return` belongs into a function: write the expression without it"),
        ("if(n) { return n }", "`return` belongs into a function: write the expression without it"),
        (
            "function g() { }",
            "a function can only be defined in the script: write the function there",
        ),
        (
            "unknown = 3",
            "`unknown` cannot be assigned: it is no global variable that the script assigns",
        ),
        (
            "double = 3",
            "`double` cannot be assigned: it is no global variable that the script assigns",
        ),
        ("log of the question(3)", "column 5: "),
        ("call count = 3", "column 6: "),
        ("the question", "column 5: "),
        ("include \"s.bzz\"", "column 1: only a script can include a file"),
        ("\"open", "column 1: "),
        ("é", "column 1: "),
        ("n é", "column 3: "),
        ("math", "a library can only be asked for one of its members, such as `math.pi`"),
        (
            "swarm.create(2).id()",
            "the script does not use neighbors, a swarm or a stigmergy in this way",
        ),
        (&nested, "column 201: this is nested more than 200 levels deep"),
        (&long, "at most 2000 bytes can be asked at once"),
    ];
    for (question, reason) in rejected {
        let refused = refusal(&mut simulation, 0, question);
        assert!(refused.starts_with(reason), "{question:.50}: {refused}");
    }
    assert_eq!((simulation.digest(), simulation.command_list().count()), (digest, 0));
    let errors = setup_errors(
        &folder("questions_mistakes", &[("s.bzz", SCRIPT)]),
        &(WORLD.to_owned() + "[[event]]\nat = 1\nrobots = [1, 4]\nask = \"1 + colr\"\n"),
    );
    assert_eq!(errors.len(), 1);
    assert!(errors[0].to_string().contains("did you mean `color`?"), "{errors:?}");
    assert!(errors[0].place.is_some());
}

#[test]
fn robots_that_cannot_answer_give_the_reason() {
    let mut simulation = simulation(
        "questions_reasons",
        "[[event]]\nat = 1\nload = 2\nscript = \"next.bzz\"\n\n[[event]]\nat = 1.5\nrobots = \"big\"\nask = \"n\"\n",
    );
    simulation.command("fail = 0").unwrap();
    simulation.command("stop = 1").unwrap();
    tick(&mut simulation, 16);
    let texts: Vec<String> = answers(&mut simulation).into_iter().map(|(.., text)| text).collect();
    let unknown = "n: no answer: column 1: nothing ever assigns `n`: it is nil";
    assert_eq!(
        texts[..2],
        ["n: no answer: the robot has failed", "n: no answer: the robot is stopped"]
    );
    assert!(texts[2].starts_with(unknown), "{texts:?}");
}

/// A question may find the program of one that was asked in the same tick.
#[test]
fn questions_of_one_tick_follow_each_other() {
    let mut simulation = simulation("questions_of_a_tick", "");
    tick(&mut simulation, 3);
    let questions = ["n", "color = \"green\"", "v.put(\"x\", color)", "color", "v.get(\"x\")", "n"];
    for question in questions {
        simulation.command(&command(1, question)).unwrap();
    }
    tick(&mut simulation, 1);
    let texts: Vec<String> = answers(&mut simulation).into_iter().map(|(.., text)| text).collect();
    assert_eq!(
        texts,
        [
            "n = 2",
            "color = \"green\": done",
            "v.put(\"x\", color) = [nil]",
            "color = green",
            "v.get(\"x\") = green",
            "n = 2",
        ]
    );
}

/// The step that runs is completed first.
#[test]
fn a_question_waits_for_the_step() {
    let script = "n = 0 function step() { n = n + 1 delay(450) n = n + 1 }\n";
    let folder = folder("questions_waiting", &[("s.bzz", script)]);
    let mut simulation = Simulation::new(setup_of(&folder, WORLD), 1, 1).unwrap();
    tick(&mut simulation, 2);
    simulation.command(&command(0, "n")).unwrap();
    tick(&mut simulation, 8);
    let [(0, tick_of_answer, text)] = &answers(&mut simulation)[..] else { panic!("one answer") };
    assert_eq!(text, "n = 2");
    assert!((5..=8).contains(tick_of_answer), "{tick_of_answer}");
}

/// All scripts of a folder and its folders.
fn scripts(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        folder.read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            scripts(&path, found);
        } else if path.extension().is_some_and(|end| end == "bzz") {
            found.push(path);
        }
    }
}

/// A question without effects changes nothing in the run of any script: the digests are equal in each
/// tick. The scripts come from the examples and from the tests of the language.
#[test]
fn a_question_without_effects_changes_no_run() {
    let mut found = Vec::new();
    for folder in ["../examples", "../tests/bzz"] {
        scripts(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), &mut found);
    }
    let (mut chance, mut answered) = (Random::new(7), 0);
    // Each kind of robot has a third of the scripts.
    let robots = ["kilobot", "zooids", "crazyflie"].into_iter().cycle();
    for (script, robot) in found.iter().zip(robots) {
        let text = format!(
            "[world]\nsize = [1000, 1000]\nduration = 4\n\n[[robots]]\nrobot = \"{robot}\"\nscript = '{}'\ncount = 2\nat = [-200, 0]\nplacement = \"line\"\nspacing = 250\n",
            script.display()
        );
        let Ok(scenario) = bittybuzz_arena::scenario::Scenario::parse(
            &text,
            "s.toml",
            Path::new(""),
            &[],
            &bittybuzz_robot_models::all(),
        ) else {
            continue;
        };
        let compiled: Result<Vec<_>, _> =
            scenario.scripts().map(|(group, script)| program(script, group)).collect();
        let Ok(programs) = compiled else { continue };
        let Ok(setup) = Setup::new(scenario, programs) else { continue };
        let setup = Arc::new(setup);
        let [mut plain, mut asked] = [0; 2].map(|_| Simulation::new(setup.clone(), 3, 1).unwrap());
        // A robot whose step takes long answers later.
        let mut waiting = 0;
        while !plain.is_over() {
            if chance.chance(0.4) {
                let question = ["0", "id * 2 + 1", "id == 3 or 4"][chance.below(3) as usize];
                let text = format!("robots = \"all\"\nask = \"{question}\"");
                asked.command(&text).unwrap_or_else(|errors| panic!("{script:?}: {errors:?}"));
                waiting += plain.robot_count();
            }
            plain.tick().unwrap();
            asked.tick().unwrap();
            let now = answers(&mut asked).len();
            (answered, waiting) = (answered + now, waiting - now);
            if waiting == 0 {
                let (plain, asked) = (plain.digest(), asked.digest());
                assert_eq!(plain, asked, "{script:?} {robot}");
            }
        }
    }
    assert!(answered > 1000, "{answered} answers");
}

/// A session with questions replays from its text, and after steps back and undone commands.
#[test]
fn sessions_with_questions_replay() {
    const QUESTIONS: [&str; 7] = [
        "n",
        "count(5)",
        "color = \"green\"",
        "got = function() { return color }",
        "v.put(\"other\", n)",
        "t.list = {.1 = \"new\", .2 = id}",
        "fails(2)",
    ];
    let mut chance = Random::new(3);
    let mut session = Session::new(simulation("questions_replay", ""), 5);
    let mut digests = Vec::new();
    while !session.run().is_over() {
        digests.push(session.run().digest());
        if chance.chance(0.2) {
            let question = QUESTIONS[chance.below(7) as usize];
            session.command(&command(chance.below(6) as usize, question)).unwrap();
        }
        if chance.chance(0.03) {
            session.command("restart = [1, 4]").unwrap();
        }
        session.tick().unwrap();
    }
    for _ in 0..20 {
        let tick = chance.below(200) as usize;
        session.go_to(tick as u64).unwrap();
        // The digest contains commands that wait.
        if session.run().command_list().all(|(at, _)| at != tick as u64) {
            assert_eq!(session.run().digest(), digests[tick]);
        }
    }
    let mut replayed = simulation("questions_replay", &session.run().commands());
    for digest in &digests {
        assert_eq!(replayed.digest(), *digest, "{}", replayed.now());
        replayed.tick().unwrap();
    }
    // Without the commands, the run is that of the scenario alone.
    session.replace_commands(&[]).unwrap();
    session.go_to(100).unwrap();
    let mut plain = simulation("questions_replay", "");
    tick(&mut plain, 100);
    assert_eq!(session.run().digest(), plain.digest());
}
