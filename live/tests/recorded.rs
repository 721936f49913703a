//! Tests of a recording from its client's view.

use std::time::Duration;

use bittybuzz_arena::output::recording::{
    RecordedBody, RecordedMovable, RecordedObstacle, RecordedOutline, RecordedPatch, RecordedRobot,
    RecordedShape, RecordingError, RecordingHeader, RecordingReader, RecordingSample,
    RecordingWriter, RobotStatus,
};
use bittybuzz_live::{Replay, Source};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::taken;

const ROBOT: RecordedRobot =
    RecordedRobot { x: 0, y: 0, z: 0, heading: 0, led: 0, state: RobotStatus::Running };

/// Robot 7 joins at the third sample. Samples are half a second apart: the ticks are 0, 5, 10 ...
fn recording(samples: u64) -> Vec<u8> {
    let disc = RecordedShape::Disc([3000, -2000, 200]);
    // An eighth of a turn is 8192 of 65536.
    let block = RecordedShape::Block([0, 5, 100, 40, 8192]);
    let header = RecordingHeader {
        size: [800, 600],
        tick_ms: 100,
        bodies: vec![RecordedBody { id: 3, radius: 165 }, RecordedBody { id: 7, radius: 460 }],
        ground: vec![
            RecordedPatch { shape: block, brightness: 0 },
            RecordedPatch { shape: disc, brightness: 500 },
        ],
        obstacles: vec![
            RecordedObstacle { outline: RecordedOutline::Shape(disc), height: None },
            RecordedObstacle { outline: RecordedOutline::Shape(block), height: Some(750) },
            RecordedObstacle { outline: RecordedOutline::Wall([-1, 0, 1, 0]), height: None },
        ],
        movables: vec![RecordedMovable { at: [-1000, 0], radius: 1500, height: Some(500) }],
    };
    let mut writer = RecordingWriter::new(Vec::new(), &header).unwrap();
    for number in 0..samples {
        writer.write(5 * number, &robots(number), &movables(number)).unwrap();
    }
    writer.finish().unwrap()
}

fn robots(number: u64) -> [Option<RecordedRobot>; 2] {
    let first = RecordedRobot { x: 10 * number as i32, led: (number % 8) as u8, ..ROBOT };
    [Some(first), (number >= 2).then_some(RecordedRobot { y: -5, ..ROBOT })]
}

/// The only movable disc goes to the right.
fn movables(number: u64) -> [[i32; 2]; 1] {
    [[7 * number as i32 - 1000, 0]]
}

fn expected_sample(number: u64) -> RecordingSample {
    let (robots, movables) = (robots(number).to_vec(), movables(number).to_vec());
    RecordingSample { tick: 5 * number, robots, movables }
}

/// Takes a sample as a client would that has the bytes `known` already.
fn shown_sample(replay: &mut Replay<'_>, known: &mut Vec<u8>) -> RecordingSample {
    let bytes = replay.take_sample();
    if bytes.starts_with(b"bbzrec") {
        known.clear();
    }
    known.extend(bytes);
    RecordingReader::new(known).unwrap().map_while(Result::ok).last().unwrap()
}

fn ask(replay: &mut Replay<'_>, request: Value) {
    replay.request(&request.to_string(), Duration::ZERO);
}

#[test]
fn the_first_event_is_the_world() {
    let bytes = recording(3);
    let mut replay = Replay::new(&bytes).unwrap();
    let events = taken(&mut replay);
    let begin = &events[0];
    assert_eq!((&begin["size"], &begin["end"]), (&json!([800.0, 600.0]), &json!(10)));
    assert_eq!(begin["ticks_per_second"], json!(10.0));
    assert_eq!(begin["recording"], json!({ "name": null, "cut": null }));
    let groups = begin["groups"].as_array().unwrap();
    let groups = groups.iter().map(|group| [&group["count"], &group["first_id"], &group["radius"]]);
    assert_eq!(
        groups.collect::<Vec<_>>(),
        [[&json!(1), &json!(3), &json!(16.5)], [&json!(1), &json!(7), &json!(46.0)]]
    );
    let obstacles = json!([
        { "at": [300.0, -200.0], "radius": 20.0, "height": null },
        { "at": [0.0, 0.5], "size": [10.0, 4.0], "heading": 45.0, "height": 75.0 },
        { "from": [-0.1, 0.0], "to": [0.1, 0.0], "height": null },
    ]);
    assert_eq!(begin["obstacles"], obstacles);
    assert_eq!(begin["movables"], json!([{ "radius": 150.0, "height": 50.0 }]));
    let ground = json!([
        { "at": [0.0, 0.5], "size": [10.0, 4.0], "heading": 45.0, "brightness": 0.0 },
        { "at": [300.0, -200.0], "radius": 20.0, "brightness": 0.5 },
    ]);
    assert_eq!(begin["ground"], ground);
    let state = json!({ "event": "state", "tick": 0, "plays": false, "rate": null, "over": false });
    assert_eq!(events[1..], [state]);
    let mut named = replay.with_name("swarm.bbr".to_owned());
    assert_eq!(taken(&mut named)[0]["recording"]["name"], json!("swarm.bbr"));
}

#[test]
fn a_recording_plays_by_the_clock_and_steps_by_samples() {
    let bytes = recording(100);
    let mut replay = Replay::new(&bytes).unwrap();
    let mut known = Vec::new();
    assert_eq!(shown_sample(&mut replay, &mut known), expected_sample(0));
    let at = Duration::from_millis;
    replay.request(r#"{"play":{"rate":2}}"#, at(1000));
    // 1.2 s at twice the real time are 24 ticks. The last sample before that is at tick 20.
    assert!(!replay.advance(at(2200), &mut || true));
    assert_eq!(shown_sample(&mut replay, &mut known), expected_sample(4));
    assert!(!replay.advance(at(2250), &mut || true));
    assert_eq!(replay.tick(), 25);
    ask(&mut replay, json!("pause"));
    assert!(!replay.advance(at(9000), &mut || true));
    ask(&mut replay, json!({ "step": { "ticks": 2 } }));
    assert_eq!(replay.tick(), 35);
    ask(&mut replay, json!({ "play": {} }));
    let mut turns = 0..3;
    assert!(replay.advance(at(9000), &mut || turns.next().is_some()));
    assert_eq!(replay.tick(), 50);
    assert!(!replay.advance(at(9000), &mut || true));
    let last = taken(&mut replay).pop().unwrap();
    assert_eq!(
        (&last["tick"], &last["plays"], &last["over"]),
        (&json!(495), &json!(false), &json!(true))
    );
    ask(&mut replay, json!({ "step": { "ticks": 4_000_000_000_u32 } }));
    assert_eq!(replay.tick(), 495);
    // At its end it starts again.
    ask(&mut replay, json!({ "play": { "rate": 1 } }));
    assert_eq!(replay.tick(), 0);
}

#[test]
fn a_truncated_recording_is_shown_up_to_its_end() {
    let whole = recording(3);
    let mut replay = Replay::new(&whole[..whole.len() - 2]).unwrap();
    let begin = taken(&mut replay).remove(0);
    assert_eq!((&begin["end"], &begin["recording"]["cut"]), (&json!(10), &json!("it is cut off")));
    for length in 0..whole.len() {
        match Replay::new(&whole[..length]) {
            Ok(mut replay) => {
                assert!(shown_sample(&mut replay, &mut Vec::new()).robots[0].is_some())
            }
            Err(error) => assert!(
                matches!(error, RecordingError::NotARecording | RecordingError::Truncated),
                "{length}: {error}"
            ),
        }
    }
    assert_eq!(Replay::new(&recording(0)).err(), Some(RecordingError::Empty));
    assert_eq!(Replay::new(b"PNG").err(), Some(RecordingError::NotARecording));
}

#[test]
fn requests_that_a_recording_does_not_support_are_refused() {
    let bytes = recording(3);
    let mut replay = Replay::new(&bytes).unwrap();
    for request in [
        json!({ "command": { "text": "fail = 3" } }),
        json!({ "inspect": { "robot": 0 } }),
        json!("digest"),
        json!({ "play": { "rate": 0 } }),
        json!("fly"),
    ] {
        replay.take_events();
        ask(&mut replay, request.clone());
        let events = taken(&mut replay);
        assert_eq!((events.len(), &events[0]["event"]), (1, &json!("refused")), "{request}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The recording can have more samples than positions to read again from.
    #[test]
    fn any_sequence_of_jumps_shows_the_last_sample_before_the_tick(
        ticks in proptest::collection::vec(0u64..6000, 1..20),
        samples in 1u64..1100,
    ) {
        let bytes = recording(samples);
        let mut replay = Replay::new(&bytes).unwrap();
        let mut known = Vec::new();
        for tick in ticks {
            ask(&mut replay, json!({ "go_to": { "tick": tick } }));
            let number = (tick / 5).min(samples - 1);
            prop_assert_eq!(shown_sample(&mut replay, &mut known), expected_sample(number));
        }
    }

    #[test]
    fn no_bytes_make_it_panic(mut bytes in proptest::collection::vec(any::<u8>(), 0..40), at in 0usize..60) {
        let mut whole = recording(4);
        if let Some(byte) = whole.get_mut(at) {
            *byte = bytes.pop().unwrap_or(0xff);
        }
        for bytes in [whole, bytes] {
            if let Ok(mut replay) = Replay::new(&bytes) {
                ask(&mut replay, json!({ "go_to": { "tick": 10 } }));
                replay.take_sample();
            }
        }
    }
}
