//! The compiler finds every class of value that a script sends: robots with one script never drop a message of each other.

use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_testkit::{Answer, Event, RecordedArgument, Recorder, SIZES, Swarm, TestRobot};
use bittybuzz_tests::generator::{self, Options};
use bittybuzz_tests::{compiler, files, report};
use bittybuzz_vm_core::image::{ALL_CLASSES, Image};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Entry as EntryPoint, class};

/// What a robot of a swarm measures, differs from robot to robot and from call to call.
fn measuring(id: i32) -> Recorder {
    let mut host = Recorder::answering(move |call| Answer::Int(id + call.number as i32 % 50));
    host.position = [Some(100.0 * id as f32), Some(50.0), Some(0.0), Some(90.0)];
    host
}

/// Runs a script on four robots. Returns the number of frames, or which robot has dropped one.
fn play<P: Profile>(path: &str) -> Result<usize, String> {
    let Some(image) = compiler::compile_file(path, P::FULL).image else { return Ok(0) };
    let image: &'static [u8] = Vec::leak(image);
    let robots = (0..4).map(|id| {
        let mut robot: TestRobot<P> = TestRobot::new(image, id, SIZES);
        robot.host = measuring(i32::from(id));
        robot
    });
    let mut swarm = Swarm::of(robots.collect());
    swarm.air.place = Box::new(|from, to| Some([40.0 + 10.0 * (from + to) as f32, 0.5, 0.0]));
    let mut frames = 0;
    for _ in 0..150 {
        swarm.try_step();
        for robot in &mut swarm.robots {
            frames += usize::from(!robot.host.events.is_empty());
            if robot.fault.is_some() {
                robot.rest();
                let _ = robot.start();
            }
        }
    }
    for robot in &mut swarm.robots {
        let counters = robot.counters();
        if counters.malformed != 0 {
            return Err(format!("{path}, {}: robot {}: {counters:?}\n", P::NAME, robot.id));
        }
    }
    Ok(frames)
}

/// The analysis of the compiler must not be wrong: robots with one script never drop a message of each other.
#[test]
fn no_script_drops_its_own_messages() {
    let folders = ["examples", "tests/scenarios", "tests/bzz/swarm", "tests/bzz/lib"];
    let mut paths: Vec<String> =
        folders.iter().flat_map(|folder| files::with_extension(folder, "bzz")).collect();
    paths.retain(|path| !path.starts_with("examples/errors/"));
    let results = files::in_parallel(&paths, |path| [play::<Tiny>(path), play::<Full>(path)]);
    let results: Vec<_> = results.into_iter().flatten().collect();
    let active = results.iter().filter(|result| !matches!(result, Ok(0))).count();
    assert!(active > 60, "{active} runs of {} did something", results.len());
    let failures: Vec<String> = results.into_iter().filter_map(Result::err).collect();
    report::conclude("classes", paths.len(), 50, &failures);
}

/// Inserts a probe after each assignment in a line of its own, and into each function for its parameters. Returns the program
/// with the probes that `probe` makes of a number and a variable.
fn with_probes(program: &str, probe: impl Fn(usize, &str) -> String) -> (String, usize) {
    let (mut text, mut count) = (String::new(), 0);
    for line in program.lines() {
        text.push_str(line);
        for variable in probed(line) {
            text.push(' ');
            text.push_str(&probe(count, variable));
            count += 1;
        }
        text.push('\n');
    }
    (text, count)
}

/// Returns the variables that have new values after a line.
fn probed(line: &str) -> Vec<&str> {
    let is_name = |text: &str| {
        !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let statement = line.trim();
    if let Some(head) = statement.strip_suffix(") {")
        && let Some((before, parameters)) = head.rsplit_once('(')
        && before.rsplit([' ', '=', '(', ',']).nth(usize::from(!before.ends_with("function")))
            == Some("function")
    {
        return parameters.split(", ").filter(|name| is_name(name)).collect();
    }
    let assignment = statement.strip_prefix("var ").unwrap_or(statement);
    match assignment.split_once(" = ") {
        Some((name, value)) if is_name(name) && is_whole(value) => vec![name],
        _ => vec![],
    }
}

/// Returns true if every bracket in the expression is closed.
fn is_whole(value: &str) -> bool {
    let (mut depth, mut is_text) = (0, false);
    for c in value.chars() {
        match c {
            '"' => is_text = !is_text,
            '(' | '[' | '{' if !is_text => depth += 1,
            ')' | ']' | '}' if !is_text => depth -= 1,
            _ => {}
        }
    }
    depth == 0 && !is_text && !value.ends_with([',', '=', '+', '-', '*', '/', '|', '&'])
}

fn class(value: &RecordedArgument) -> u8 {
    match value {
        RecordedArgument::Nil => class::NIL,
        RecordedArgument::Int(_) | RecordedArgument::Float(_) => class::NUMBER,
        RecordedArgument::String(_) => class::STRING,
        RecordedArgument::Text(_) => class::TEXT,
        RecordedArgument::Table(_) => class::TABLE,
        RecordedArgument::Function => class::FUNCTION,
    }
}

/// Slots of a machine that no random program fills.
const SLOTS: usize = 60_000;

/// Compiles a random program that sends the value of each probe, each on a topic of its own, and runs the same program
/// with `log` in place of `broadcast`. Returns how many values the class table would have let pass, and how many of them it
/// looked at.
fn probe_program<P: Profile>(seed: u64) -> Result<(usize, usize), String> {
    let program = generator::program(Options { seed, full: P::FULL, hide_literals: false });
    let (sends, _) = with_probes(&program, |number, variable| {
        format!("neighbors.broadcast(\"probe{number}\", {variable})")
    });
    let (logs, _) = with_probes(&program, |number, variable| {
        format!("log({number}, {variable}, {})", number + 10_000)
    });
    let compile = |text: &str| compiler::compile(text.to_owned(), P::FULL, &MemoryFiles::default());
    let (sender, logger) = (compile(&sends), compile(&logs));
    let (Some(sender), Some(symbols), Some(image)) = (sender.image, sender.symbols, logger.image)
    else {
        return Ok((0, 0));
    };
    let header = Image::new(sender.as_slice()).header().map_err(|error| format!("{error:?}"))?;
    let row = |number: i32| {
        let topic = format!("probe{number}");
        let string = symbols.strings.iter().position(|known| *known == topic);
        let at = header.classes_at().map(usize::from);
        let last = symbols.strings.len();
        at.zip(string).map_or(ALL_CLASSES, |(at, string)| sender[at + last - string])
    };
    let mut robot: TestRobot<P, &'static [u8], SLOTS> = TestRobot::new(Vec::leak(image), 1, SIZES);
    robot.host = measuring(1);
    // Some robot functions return what they get.
    robot.host.answer = Box::new(|call| match call.number % 3 {
        0 => Answer::First,
        1 => Answer::Nil,
        _ => Answer::Int(call.number as i32),
    });
    let _ = (0..3).try_for_each(|_| robot.step());
    let _ = robot.enter(EntryPoint::Reset).and_then(|()| robot.enter(EntryPoint::Destroy));
    let (mut passed, mut checked) = (0, 0);
    for event in &robot.host.events {
        let Event::Log(arguments) = event else { continue };
        let [RecordedArgument::Int(number), value, RecordedArgument::Int(end)] =
            arguments.as_slice()
        else {
            continue;
        };
        if *end != number + 10_000 {
            continue;
        }
        let row = row(*number);
        if row & class(value) == 0 {
            return Err(format!(
                "seed {seed}, {}: probe {number} is {:?}, but the row is {row:#b}\n{logs}",
                P::NAME,
                value.type_of()
            ));
        }
        passed += 1;
        checked += usize::from(row != ALL_CLASSES);
    }
    Ok((passed, checked))
}

#[test]
fn random_programs_send_only_values_of_the_class_table() {
    let seeds = 0..200;
    let runs: Vec<(u64, bool)> =
        seeds.clone().flat_map(|seed| [(seed, false), (seed, true)]).collect();
    let results = files::in_parallel(&runs, |(seed, full)| {
        if *full { probe_program::<Full>(*seed) } else { probe_program::<Tiny>(*seed) }
    });
    let done: Vec<&(usize, usize)> = results.iter().flatten().collect();
    let compiled = done.iter().filter(|(passed, _)| *passed > 0).count();
    let checked: usize = done.iter().map(|(_, checked)| checked).sum();
    println!("{compiled} of {} programs, {checked} values checked", runs.len());
    assert!(compiled * 2 > runs.len(), "{compiled} of {} programs have probes", runs.len());
    assert!(checked > 50_000, "{checked} values were looked at");
    let failures: Vec<String> = results.into_iter().filter_map(Result::err).collect();
    report::conclude("programs with probes", runs.len(), seeds.count(), &failures);
}
