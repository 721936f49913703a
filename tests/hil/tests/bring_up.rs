//! The traces in docs/bring-up.md are lines that the image prints. An emulator carries out each step that
//! shows a trace; the expected lines are those of the document.

use std::collections::BTreeMap;

use bittybuzz_hil::{
    Command, Core, Deck, EmulatorEvent, RADIO_RAW, Robot, TimedEvent, TraceLog, compiled_for,
};
use bittybuzz_tests::files;

/// The commands of a ground station: port 9, channel 1 (cflib, supervisor.py).
const ARM: [u8; 3] = [0x9d, 1, 1];
const DISARM: [u8; 3] = [0x9d, 1, 0];

/// A step of the section about the first flight.
struct Step {
    text: String,
    /// The lines of each of its traces.
    traces: Vec<Vec<String>>,
}

/// The steps by their numbers.
fn steps() -> BTreeMap<u32, Step> {
    let text = files::read("docs/bring-up.md");
    let (_, section) = text.split_once("### The first flight, step by step\n").unwrap();
    let (section, _) = section.split_once("\n### ").unwrap();
    let step = |text: &str| {
        let (number, text) = text.split_once(". ").unwrap();
        let blocks = text.split("```text\n").skip(1);
        let traces = blocks.map(|block| {
            let (lines, _) = block.split_once("```").unwrap();
            lines.lines().map(str::to_owned).collect()
        });
        (number.parse().unwrap(), Step { text: text.to_owned(), traces: traces.collect() })
    };
    section.split("\n**").skip(1).map(step).collect()
}

/// Replaces each number by N, since a robot has other numbers.
fn without_numbers(line: &str) -> String {
    let mut text = String::new();
    let mut rest = line;
    while let Some(start) = rest.find(|letter: char| letter.is_ascii_digit()) {
        let (before, number) = rest.split_at(start);
        text.push_str(before.strip_suffix('-').unwrap_or(before));
        text.push('N');
        let end = |letter: char| !letter.is_ascii_digit() && letter != '.';
        rest = &number[number.find(end).unwrap_or(number.len())..];
    }
    text + rest
}

/// A robot with a script.
struct Bench {
    robot: Robot,
    script: String,
}

impl Bench {
    fn new(path: &str, setup: &[Command]) -> Self {
        let script = files::read(path);
        let mut robot = Robot::crazyflie(Core::Unicorn, &script);
        for command in setup {
            robot.execute(command);
        }
        Bench { robot, script }
    }

    /// Lets a ground station send a command at a time since power-on.
    fn send_at(&mut self, ms: u64, command: &[u8]) {
        self.run_until(ms);
        self.robot.send(RADIO_RAW, command);
    }

    fn run_until(&mut self, ms: u64) {
        self.robot.run_ms(ms - u64::try_from(self.robot.now().as_millis()).unwrap());
    }

    /// The lines of the firmware, and those of the script.
    fn printed(&self) -> [Vec<String>; 2] {
        let symbols = compiled_for("crazyflie", &self.script).symbols.unwrap();
        let TraceLog { firmware, log, .. } = TraceLog::of_script(&self.robot.events, &symbols);
        [firmware, log.into_iter().map(|(_, values)| values.concat()).collect()]
    }
}

/// A robot on a table with a Multi-ranger, whose motors a script turns.
fn on_a_table() -> Bench {
    let decks = Command::Decks { decks: vec![Deck::MultiRanger] };
    let mut bench = Bench::new("examples/flight/motors.bzz", &[decks]);
    bench.run_until(10_500);
    bench
}

/// A robot that a person arms too early and then in time, and disarms.
fn armed() -> Bench {
    let mut bench = Bench::new("examples/blink.bzz", &[]);
    bench.send_at(500, &ARM);
    bench.send_at(3_000, &ARM);
    bench.send_at(3_500, &DISARM);
    bench.run_until(4_000);
    bench
}

/// A robot that hovers with poses from outside, armed after two and a half seconds, and lands.
fn flown() -> Bench {
    let body = Command::Body {
        seed: 1,
        x_mm: 0.0,
        y_mm: 0.0,
        yaw_degrees: 0.0,
        pose_ms: 10,
        pose_noise_mm: 0.5,
        pose_noise_degrees: 0.3,
    };
    let mut bench = Bench::new("examples/flight/hover.bzz", &[body]);
    bench.send_at(2_500, &ARM);
    bench.run_until(14_000);
    bench
}

/// Checks that the lines of a trace were printed in its order, with other lines between them.
fn assert_printed(number: u32, trace: &[String], printed: &[Vec<String>]) {
    let is_whole = |lines: &Vec<String>| {
        let mut lines = lines.iter().map(|line| without_numbers(line));
        trace.iter().all(|line| lines.any(|printed| printed == without_numbers(line)))
    };
    assert!(printed.iter().any(is_whole), "step {number}: no {trace:#?} in {printed:#?}");
}

#[test]
fn the_image_prints_the_traces_of_the_first_flight() {
    let steps = steps();
    let has_trace = |(number, step): (&u32, &Step)| (!step.traces.is_empty()).then_some(*number);
    let with_traces: Vec<u32> = steps.iter().filter_map(has_trace).collect();
    assert_eq!(with_traces, [1, 2, 3, 4, 5, 6, 8], "the steps of the robots below");

    let [table, armed, flown] = [on_a_table(), armed(), flown()].map(|bench| bench.printed());
    for (number, step) in &steps {
        let printed = match number {
            1..=4 => &table,
            6 => &armed,
            _ => &flown,
        };
        for trace in &step.traces {
            assert_printed(*number, trace, printed);
        }
    }
    // Numbers of motors are no measurements.
    assert_eq!(steps[&4].traces, [table[1].clone()]);
    assert!(steps[&2].text.contains("without a deck the line is `no decks`"));
    assert_printed(2, &["no decks".to_owned()], &armed);
}

/// Each motor turns alone, in the order of the table.
#[test]
fn motors_turn_in_the_order_of_the_table() {
    let steps = steps();
    let rows = steps[&4].text.lines().filter_map(|line| line.strip_prefix("| `motor "));
    let expected: Vec<(u8, bool)> = rows
        .enumerate()
        .flat_map(|(index, row)| {
            let (motor, board) = row.split_once("` | M").unwrap();
            assert_eq!(motor, index.to_string());
            let number: u8 = board[..1].parse().unwrap();
            [(number, true), (number, false)]
        })
        .collect();
    assert_eq!(expected.len(), 8);
    let turned = |event: &TimedEvent| match event.event {
        EmulatorEvent::Motor { number, duty, .. } => Some((number, duty > 0.0)),
        _ => None,
    };
    let mut bench = Bench::new("examples/flight/motors.bzz", &[]);
    bench.run_until(6_000);
    let turned: Vec<(u8, bool)> = bench.robot.events.iter().filter_map(turned).collect();
    assert_eq!(turned, expected);
}

#[test]
fn numbers_of_all_forms_are_replaced() {
    assert_eq!(without_numbers("counts 5 -7 -2 and 1 6 1362"), "counts N N N and N N N");
    assert_eq!(
        without_numbers("trim 0.0 and -10.25 degrees, data rate 2"),
        "trim N and N degrees, data rate N"
    );
}
