//! Files that users write or programs keep: scenarios, robot files, symbols, recordings.

use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

use allocation_counter::measure;
use bittybuzz_arena::output::recording::{
    RecordedBody, RecordedMovable, RecordedObstacle, RecordedOutline, RecordedPatch, RecordedShape,
    RecordingHeader, RecordingReader, RecordingSample, RecordingWriter,
};
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_compiler::disasm::disassemble;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_live::{Replay, Source};
use bittybuzz_robot_files::shipped;
use bittybuzz_robot_spec::Robot;

use crate::choices::Choices;
use crate::{seeds, words};

/// Scenarios with different bodies, links, events and expectations.
const SCENARIOS: [&str; 7] = [
    include_str!("../../scenarios/adversaries.toml"),
    include_str!("../../scenarios/backends.toml"),
    include_str!("../../scenarios/convergence.toml"),
    include_str!("../../scenarios/day.toml"),
    include_str!("../../scenarios/images.toml"),
    include_str!("../../scenarios/outages.toml"),
    include_str!("../../scenarios/speed.toml"),
];
/// The folder of their scripts, which must be there but are not read.
const SCENARIO_FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios");

/// A robot with a body for the simulator.
const ROVER: &str = include_str!("../../../spec/robot/src/tests/rover.toml");

/// Samples of a recording that are read; more would only take time.
const SAMPLES: usize = 200;

/// Returns text for a reader: after a byte of 0 the bytes themselves, else a known text of which
/// every three bytes change a word.
fn text(data: &[u8], known: &[&str]) -> Option<String> {
    let (choice, changes) = data.split_first()?;
    let Some(choice) = usize::from(*choice).checked_sub(1) else {
        return String::from_utf8(changes.to_vec()).ok();
    };
    let mut changed = words::split(known.get(choice % known.len())?);
    for change in changes.chunks_exact(3).take(12) {
        let [kind, at, value] = *change else { return None };
        words::change(&mut changed, words::FILES, kind, at, value);
    }
    Some(changed.concat())
}

/// Reads a scenario, and prints its mistakes. Returns true if it has none.
pub fn scenario(data: &[u8]) -> bool {
    let Some(text) = text(data, &SCENARIOS) else { return false };
    match Scenario::parse(
        &text,
        "fuzz.toml",
        Path::new(SCENARIO_FOLDER),
        &[],
        &bittybuzz_robot_models::all(),
    ) {
        Ok(scenario) => {
            assert!(scenario.robot_count() > 0, "a world without robots");
            true
        }
        Err(errors) => {
            assert!(!errors.is_empty(), "it is refused without a reason");
            errors.iter().for_each(|error| assert!(!error.to_string().is_empty()));
            false
        }
    }
}

/// Reads a robot file, and prints its mistakes. Returns true if it has none.
pub fn robot_file(data: &[u8]) -> bool {
    let shipped = shipped().iter().map(|file| file.text);
    let known: Vec<&str> = shipped.chain([ROVER]).collect();
    let Some(text) = text(data, &known) else { return false };
    match Robot::parse(&text, "fuzz.toml") {
        Ok(robot) => {
            assert!(robot.functions.iter().all(|known| robot.function(&known.name).is_some()));
            // The sizes that a machine of this robot is built with.
            let _ = robot.sizes().slots();
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

/// Reads symbols, and looks up strings, places and functions. Returns true if they can be read.
pub fn symbols(data: &[u8]) -> bool {
    static KNOWN: OnceLock<Vec<(Vec<u8>, String)>> = OnceLock::new();
    let known = KNOWN.get_or_init(seeds::symbols);
    let texts: Vec<&str> = known.iter().map(|(_, text)| text.as_str()).collect();
    let Some(text) = text(data, &texts) else { return false };
    let symbols = match Symbols::from_json(&text) {
        Ok(symbols) => symbols,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return false;
        }
    };
    let kept = Symbols::from_json(&symbols.to_json());
    assert_eq!(kept.ok().as_ref(), Some(&symbols), "symbols change when they are kept");
    for number in [0, 1, 2, 16, 100, 1000, 65535] {
        let _ = symbols.string(number);
        let place = symbols.position(number.into());
        let _ = place.map(|place| symbols.file(place.file));
        let _ = symbols.function(number.into());
        let _ = symbols.locals(number.into());
    }
    // Of some inputs, as it takes more time than reading. The symbols may be those of another
    // image, or damaged.
    if data.len().is_multiple_of(4) {
        let image = &known[usize::from(data[0]) % known.len()].0;
        let _ = disassemble(image, Some(&symbols));
    }
    true
}

/// Reads a recording: the bytes themselves after a byte of 0, after the head of a recording after
/// 1, else a recording that the bytes decide, which is damaged after an odd byte. A recording that
/// can be read is written as it was read. Returns true if it was read to its end.
pub fn recording(data: &[u8]) -> bool {
    let Some((first, rest)) = data.split_first() else { return false };
    match first {
        0 => return read(rest).is_some(),
        1 => return read(&[b"bbzrec\x04", rest].concat()).is_some(),
        _ => {}
    }
    let mut choices = Choices::new(rest);
    let mut bytes = written(&mut choices);
    let is_whole = first.is_multiple_of(2);
    if !is_whole {
        for _ in 0..1 + choices.below(4) {
            let at = choices.below(256) * bytes.len() / 256;
            bytes[at] = choices.byte();
        }
        bytes.truncate(1 + choices.below(256) * bytes.len() / 255);
    }
    let read = read(&bytes);
    assert!(!is_whole || read.is_some(), "what was written cannot be read");
    read.is_some()
}

/// Returns a recording of some robots that move, stop and change their color.
fn written(choices: &mut Choices<'_>) -> Vec<u8> {
    use bittybuzz_arena::output::recording::{RecordedRobot, RobotStatus};
    let mut bytes = Vec::new();
    let mut bodies = Vec::new();
    for _ in 0..choices.below(6) {
        let id = u16::from(choices.byte()) * 257;
        // No two robots have one id.
        let id = (id..=u16::MAX)
            .chain(0..id)
            .find(|id| bodies.iter().all(|body: &RecordedBody| body.id != *id));
        let id = id.expect("there are more ids than robots");
        bodies.push(RecordedBody { id, radius: choices.byte().into() });
    }
    let size = [1000, u32::from(choices.byte())];
    let mut far = || i32::from_le_bytes([0; 4].map(|_: u8| choices.byte()));
    let mut robots: Vec<Option<RecordedRobot>> = Vec::new();
    for _ in &bodies {
        let [x, y, z] = [far(), far(), far()];
        robots.push(Some(RecordedRobot {
            x,
            y,
            z,
            heading: 0,
            led: 0,
            state: RobotStatus::Running,
        }));
    }
    let mut obstacles = Vec::new();
    for _ in 0..choices.below(4) {
        let numbers @ [x, y, radius, _] = [i32::MIN, -1, i32::from(choices.byte()), i32::MAX];
        let outline = match choices.below(3) {
            0 => RecordedOutline::Shape(RecordedShape::Disc([x, y, radius])),
            1 => RecordedOutline::Shape(RecordedShape::Block([x, y, radius, i32::MAX, i32::MIN])),
            _ => RecordedOutline::Wall(numbers),
        };
        let height = choices.flag().then_some(u32::MAX);
        obstacles.push(RecordedObstacle { outline, height });
    }
    let mut ground = Vec::new();
    if choices.flag() {
        let shape = RecordedShape::Disc([-1, i32::MIN, i32::MAX]);
        ground.push(RecordedPatch { shape, brightness: choices.byte().into() });
    }
    let mut movables = Vec::new();
    for _ in 0..choices.below(3) {
        let (radius, height) = (choices.byte().into(), choices.flag().then_some(u32::MAX));
        movables.push(RecordedMovable { at: [i32::MIN, i32::MAX], radius, height });
    }
    let mut centers: Vec<[i32; 2]> = movables.iter().map(|movable| movable.at).collect();
    let header = RecordingHeader { size, tick_ms: 100, bodies, ground, obstacles, movables };
    let mut writer = RecordingWriter::new(&mut bytes, &header).expect("memory takes everything");
    let mut tick = 0;
    for _ in 0..choices.below(8) {
        for robot in robots.iter_mut().flatten() {
            robot.x = robot.x.wrapping_add(i32::from(choices.byte()) << choices.below(24));
            robot.heading = robot.heading.wrapping_add(u16::from(choices.byte()) * 200);
            robot.led = choices.byte() & 7;
            robot.state = [
                RobotStatus::Running,
                RobotStatus::Stopped,
                RobotStatus::Failed,
                RobotStatus::Faulted,
            ][choices.below(4)];
        }
        for [x, _] in &mut centers {
            *x = x.wrapping_add(i32::from(choices.byte()) << choices.below(24));
        }
        writer.write(tick, &robots, &centers).expect("memory takes everything");
        tick += 1 + u64::from(choices.byte());
    }
    writer.finish().expect("memory takes everything");
    bytes
}

/// The most bytes of memory that a recording takes at once while it is played, and that playing it
/// reserves in total, which counts the work: for each byte of the recording, and for any recording.
/// The copies to step back to are a third of the first; they are made anew each time the samples double.
const MEMORY_PER_BYTE: u64 = 64;
const WORK_PER_BYTE: u64 = 1024;
const CONSTANT: u64 = 256 << 10;

/// Plays a recording forward and back as its page does, within budgets of memory and work.
fn play(bytes: &[u8]) {
    let mut end = None;
    let played = measure(|| {
        let Ok(mut replay) = Replay::new(bytes) else { return };
        for request in [
            r#"{"step":{"ticks":3}}"#,
            r#"{"go_to":{"tick":4294967295}}"#,
            r#"{"go_to":{"tick":50}}"#,
            r#"{"go_to":{"tick":0}}"#,
            r#"{"step":{"ticks":4294967295}}"#,
        ] {
            replay.request(request, Duration::ZERO);
            replay.take_events();
            replay.take_sample();
        }
        end = Some(replay.tick());
    });
    if let Some(end) = end {
        let mut reader = RecordingReader::new(bytes).expect("it was played");
        while matches!(reader.advance(), Ok(Some(_))) {}
        assert_eq!(reader.tick(), end, "the last step did not lead to the last sample");
    }
    let length = bytes.len() as u64;
    let [peak, work] = [played.bytes_max, played.bytes_total];
    assert!(peak <= MEMORY_PER_BYTE * length + CONSTANT, "{peak} bytes at once for {length}");
    assert!(work <= WORK_PER_BYTE * length + CONSTANT, "{work} bytes in total for {length}");
}

/// Returns the samples of a recording that can be read to its end.
fn read(bytes: &[u8]) -> Option<Vec<RecordingSample>> {
    play(bytes);
    let reader = match RecordingReader::new(bytes) {
        Ok(reader) => reader,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return None;
        }
    };
    let header = reader.header().clone();
    let samples: Vec<RecordingSample> = reader.take(SAMPLES).collect::<Result<_, _>>().ok()?;
    let mut again = Vec::new();
    let mut writer = RecordingWriter::new(&mut again, &header).expect("memory takes everything");
    for sample in &samples {
        writer
            .write(sample.tick, &sample.robots, &sample.movables)
            .expect("memory takes everything");
    }
    writer.finish().expect("memory takes everything");
    let reader = RecordingReader::new(&again).expect("a recording that was written");
    assert_eq!(reader.header(), &header);
    let read_again: Vec<RecordingSample> =
        reader.collect::<Result<_, _>>().expect("a recording that was written");
    assert_eq!(read_again.len(), samples.len());
    for (once, again) in samples.iter().zip(&read_again) {
        assert_eq!(once, again);
    }
    Some(samples)
}
