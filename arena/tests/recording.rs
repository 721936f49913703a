//! Recordings are what docs/recording.md says, come back as they were, and damage is noticed.

use bittybuzz_arena::output::recording::{
    RecordedBody, RecordedMovable, RecordedObstacle, RecordedOutline, RecordedPatch, RecordedRobot,
    RecordedShape, RecordingError, RecordingHeader, RecordingReader, RecordingSample,
    RecordingWriter, RobotStatus,
};
use proptest::collection::{hash_map, vec};
use proptest::prelude::*;

fn write(header: &RecordingHeader, samples: &[RecordingSample]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut writer = RecordingWriter::new(&mut file, header).unwrap();
    for sample in samples {
        writer.write(sample.tick, &sample.robots, &sample.movables).unwrap();
    }
    writer.finish().unwrap();
    file
}

fn read(file: &[u8]) -> Result<(RecordingHeader, Vec<RecordingSample>), RecordingError> {
    let mut reader = RecordingReader::new(file)?;
    let samples = reader.by_ref().collect::<Result<Vec<RecordingSample>, RecordingError>>()?;
    Ok((reader.header().clone(), samples))
}

/// The header and the samples of the test vector.
fn documented() -> (RecordingHeader, Vec<RecordingSample>) {
    let bodies = vec![RecordedBody { id: 0, radius: 165 }, RecordedBody { id: 7, radius: 165 }];
    let ground = vec![
        RecordedPatch { shape: RecordedShape::Block([-1000, 0, 1000, 400, 0x4000]), brightness: 0 },
        RecordedPatch { shape: RecordedShape::Disc([-1000, 0, 100]), brightness: 500 },
    ];
    let disc = RecordedOutline::Shape(RecordedShape::Disc([3000, 0, 800]));
    let obstacles = vec![
        RecordedObstacle { outline: disc, height: None },
        RecordedObstacle { outline: RecordedOutline::Wall([0, -500, 0, 500]), height: Some(1000) },
    ];
    let movables = vec![
        RecordedMovable { at: [5000, 0], radius: 1500, height: None },
        RecordedMovable { at: [-5000, 1000], radius: 200, height: Some(500) },
    ];
    let header =
        RecordingHeader { size: [2000, 1000], tick_ms: 100, bodies, ground, obstacles, movables };
    let robot =
        RecordedRobot { x: -120, y: 5, z: 0, heading: 0x4000, led: 4, state: RobotStatus::Running };
    let moved = RecordedRobot { x: -110, ..robot };
    let samples = vec![
        RecordingSample {
            tick: 0,
            robots: vec![None, Some(robot)],
            movables: vec![[5000, 0], [-5000, 1000]],
        },
        RecordingSample {
            tick: 10,
            robots: vec![None, Some(moved)],
            movables: vec![[5000, 0], [-5010, 1000]],
        },
    ];
    (header, samples)
}

#[test]
fn the_documented_test_vector_is_read() {
    let document = include_str!("../../docs/recording.md");
    let vector = document.split("```text\n").nth(1).and_then(|rest| rest.split("```").next());
    let bytes: Vec<u8> = vector
        .unwrap()
        .split_whitespace()
        .map(|byte| u8::from_str_radix(byte, 16).unwrap())
        .collect();
    let (header, samples) = documented();
    assert_eq!(write(&header, &samples), bytes);
    assert_eq!(read(&bytes), Ok((header, samples)));
}

#[test]
fn a_truncated_recording_is_an_error() {
    let (header, samples) = documented();
    let file = write(&header, &samples);
    for length in 0..file.len() {
        assert!(read(&file[..length]).is_err(), "{length}");
    }
    let longer = [file.as_slice(), &[0]].concat();
    assert!(matches!(read(&longer), Err(RecordingError::Malformed(_))));
}

#[test]
fn other_files_and_versions_are_refused() {
    let (header, samples) = documented();
    let mut file = write(&header, &samples);
    assert_eq!(read(b"[world]").unwrap_err(), RecordingError::NotARecording);
    assert_eq!(read(b"bbzrec").unwrap_err(), RecordingError::Truncated);
    for (version, age) in [(3, "older"), (9, "newer")] {
        file[6] = version;
        let error = read(&file).unwrap_err();
        assert_eq!(error, RecordingError::Version(version));
        let text = error.to_string();
        assert!(text.contains(&format!("version {version}, {age} than version 4")), "{text}");
        assert!(text.ends_with("record the run again"), "{text}");
    }
}

/// Ids are differences; the second one of this header is larger than any number of 64 bits.
#[test]
fn ids_that_overflow_are_malformed() {
    let rest = [100, 100, 100, 2, 2, 0xfe, 255, 255, 255, 255, 255, 255, 255, 255, 1];
    let file = [b"bbzrec\x04".as_slice(), &rest].concat();
    assert_eq!(read(&file).unwrap_err(), RecordingError::Malformed(12));
}

/// A damaged count of robots, patches, obstacles or movable discs ends at the end of the file, without memory for all of them.
#[test]
fn counts_beyond_the_file_are_cut_off() {
    let most = [0xff, 0xff, 0xff, 0xff, 0x0f];
    let robots = b"bbzrec\x04\x01\x01\x64\x80\x80\x04".to_vec();
    let ground = [b"bbzrec\x04\x01\x01\x64\x00".as_slice(), &most].concat();
    let obstacles = [b"bbzrec\x04\x01\x01\x64\x00\x00".as_slice(), &most].concat();
    let movables = [b"bbzrec\x04\x01\x01\x64\x00\x00\x00".as_slice(), &most].concat();
    for file in [robots, ground, obstacles, movables] {
        assert_eq!(read(&file).unwrap_err(), RecordingError::Truncated);
    }
}

/// 65,537 robots in a header of 4 KB: no memory is reserved for them.
#[test]
fn more_robots_than_ids_are_refused() {
    let file = [b"bbzrec\x04\x01\x01\x64\x81\x80\x04".as_slice(), &[0; 4096]].concat();
    let error = read(&file).unwrap_err();
    assert!(error.to_string().contains("65537 robots"), "{error}");
}

/// Robots 7, 3 and 7 again: the differences 7, -4, 4 are 0e 07 08.
#[test]
fn equal_ids_are_refused() {
    let robots = [3, 0x0e, 7, 8, 2, 0, 0, 0, 0, 0, 1, 0, 0, 1];
    let error = read(&[b"bbzrec\x04\x01\x01\x64".as_slice(), &robots].concat()).unwrap_err();
    assert!(error.to_string().contains("two of its robots have the id 7"), "{error}");
}

/// The fourth form of an obstacle does not exist, and the ground has no walls.
#[test]
fn unknown_outlines_are_malformed() {
    let obstacle = b"bbzrec\x04\x01\x01\x64\x00\x00\x01\x03\x00\x00\x00\x00";
    assert_eq!(read(obstacle).unwrap_err(), RecordingError::Malformed(13));
    let patch = b"bbzrec\x04\x01\x01\x64\x00\x01\x02\x00\x00\x00\x00";
    assert_eq!(read(patch).unwrap_err(), RecordingError::Malformed(12));
}

/// White is 1000; 1001 is e9 07.
#[test]
fn paint_is_not_brighter_than_white() {
    let patch = b"bbzrec\x04\x01\x01\x64\x00\x01\x00\x00\x00\x00\xe9\x07";
    assert_eq!(read(patch).unwrap_err(), RecordingError::Malformed(16));
}

/// A world of 1 mm by 1 mm with one movable disc at (0, 0) and a radius of 1 mm, and one change of it. In byte 21 are its
/// fields: it has a place only. Neither a second disc exists, nor a place beyond 32 bits.
#[test]
fn changes_of_movable_discs_are_checked() {
    let file = |change: &[u8]| {
        let start = b"bbzrec\x04\x01\x01\x64\x00\x00\x00\x01\x00\x00\x0a\x00";
        let length = 1 + change.len() as u8;
        [start.as_slice(), &[length, 0], change, &[0, 1]].concat()
    };
    let (header, samples) = read(&file(&[0, 1, 2, 4])).unwrap();
    assert_eq!(header.movables, [RecordedMovable { at: [0, 0], radius: 10, height: None }]);
    assert_eq!(samples[0].movables, [[1, 2]]);
    for fields in [0, 2, 3, 9] {
        assert_eq!(read(&file(&[0, fields, 2, 4])).unwrap_err(), RecordingError::Malformed(21));
    }
    assert_eq!(read(&file(&[1, 1, 2, 4])).unwrap_err(), RecordingError::Malformed(20));
    let far = [0, 1, 0, 0x80, 0x80, 0x80, 0x80, 0x10];
    assert_eq!(read(&file(&far)).unwrap_err(), RecordingError::Malformed(23));
}

fn robot() -> impl Strategy<Value = RecordedRobot> {
    let states =
        [RobotStatus::Running, RobotStatus::Stopped, RobotStatus::Failed, RobotStatus::Faulted];
    (any::<[i32; 3]>(), any::<u16>(), 0u8..8, 0usize..4).prop_map(
        move |([x, y, z], heading, led, state)| RecordedRobot {
            x,
            y,
            z,
            heading,
            led,
            state: states[state],
        },
    )
}

fn shape() -> impl Strategy<Value = RecordedShape> {
    let disc = any::<[i32; 3]>().prop_map(RecordedShape::Disc);
    disc.boxed().prop_union(any::<[i32; 5]>().prop_map(RecordedShape::Block).boxed())
}

fn patch() -> impl Strategy<Value = RecordedPatch> {
    (shape(), 0..=1000u32).prop_map(|(shape, brightness)| RecordedPatch { shape, brightness })
}

fn obstacle() -> impl Strategy<Value = RecordedObstacle> {
    let wall = any::<[i32; 4]>().prop_map(RecordedOutline::Wall);
    let outline = shape().prop_map(RecordedOutline::Shape).boxed().prop_union(wall.boxed());
    (outline, any::<Option<u32>>())
        .prop_map(|(outline, height)| RecordedObstacle { outline, height })
}

fn movable() -> impl Strategy<Value = RecordedMovable> {
    let numbers = (any::<[i32; 2]>(), any::<u32>(), any::<Option<u32>>());
    numbers.prop_map(|(at, radius, height)| RecordedMovable { at, radius, height })
}

/// A recording of some robots and movable discs: who has joined stays, and may move or not.
fn recording() -> impl Strategy<Value = (RecordingHeader, Vec<RecordingSample>)> {
    let bodies = hash_map(any::<u16>(), any::<u32>(), 0..6);
    let outlines = (vec(patch(), 0..4), vec(obstacle(), 0..4), vec(movable(), 0..4));
    (bodies, outlines, any::<[u32; 2]>(), any::<u32>()).prop_flat_map(
        |(bodies, (ground, obstacles, movables), size, tick_ms)| {
            let (count, discs) = (bodies.len(), movables.len());
            let starts: Vec<[i32; 2]> = movables.iter().map(|movable| movable.at).collect();
            let body = |(id, radius)| RecordedBody { id, radius };
            let bodies = bodies.into_iter().map(body).collect();
            let header = RecordingHeader { size, tick_ms, bodies, ground, obstacles, movables };
            let places = vec(proptest::option::of(any::<[i32; 2]>()), discs);
            let step = (1u64..1 << 40, vec(proptest::option::of(robot()), count), places);
            vec(step, 0..8).prop_map(move |steps| {
                let mut robots = vec![None; count];
                let mut movables = starts.clone();
                let mut tick = 0;
                let mut samples = Vec::new();
                for (later, changes, places) in steps {
                    tick += later;
                    for (movable, place) in movables.iter_mut().zip(places) {
                        *movable = place.unwrap_or(*movable);
                    }
                    for (robot, change) in robots.iter_mut().zip(changes) {
                        *robot = change.or(*robot);
                    }
                    let (robots, movables) = (robots.clone(), movables.clone());
                    samples.push(RecordingSample { tick, robots, movables });
                }
                (header.clone(), samples)
            })
        },
    )
}

proptest! {
    #[test]
    fn a_written_recording_is_read_back((header, samples) in recording()) {
        let file = write(&header, &samples);
        prop_assert_eq!(read(&file), Ok((header, samples)));
    }

    #[test]
    fn a_damaged_recording_causes_no_panic((header, samples) in recording(), at in any::<prop::sample::Index>(), byte in any::<u8>()) {
        let mut file = write(&header, &samples);
        let at = at.index(file.len());
        file[at] = byte;
        let _ = read(&file);
    }

    #[test]
    fn arbitrary_bytes_cause_no_panic(rest in vec(any::<u8>(), 0..64)) {
        let file = [b"bbzrec\x04".as_slice(), &rest].concat();
        let _ = read(&file);
    }
}
