//! Recordings, as `bbz view` reads and shows them.

use std::time::Duration;

use bittybuzz_arena::output::recording::{RecordingReader, VERSION};
use bittybuzz_live::{Replay, Source};

use super::{LIMITS, Limits};

/// Writes a number with seven bits per byte, the lowest first.
fn put(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// Returns a recording of robots at one place, and of movable discs. Each sample has `changes`.
fn recording(robots: u64, movables: u64, samples: u64, changes: &[u8]) -> Vec<u8> {
    let mut bytes = b"bbzrec".to_vec();
    bytes.extend([VERSION, 100, 100, 100]);
    put(&mut bytes, robots);
    // Ids are 0, 1, 2 ...; as differences with the sign in the lowest bit, 0, 2, 2 ...
    bytes.extend((0..robots).map(|number| if number == 0 { 0 } else { 2 }));
    bytes.extend((0..robots).map(|number| if number == 0 { 200 - 128 } else { 0 }));
    bytes.extend([0, 0]);
    put(&mut bytes, movables);
    (0..movables).for_each(|_| bytes.extend([0, 0, 10, 0]));
    for _ in 0..samples {
        put(&mut bytes, 1 + changes.len() as u64);
        bytes.push(1);
        bytes.extend(changes);
    }
    bytes.push(0);
    put(&mut bytes, samples);
    bytes
}

/// Reads a recording, and plays it forward and back.
fn play(bytes: &[u8]) {
    let Ok(mut replay) = Replay::new(bytes) else { return };
    replay.take_events();
    for request in [
        r#"{"go_to":{"tick":4000000000}}"#,
        r#"{"go_to":{"tick":0}}"#,
        r#"{"step":{"ticks":4000000000}}"#,
        r#"{"go_to":{"tick":100}}"#,
    ] {
        replay.request(request, Duration::ZERO);
        replay.take_events();
        replay.take_sample();
    }
}

#[test]
fn recordings_of_any_shape() {
    LIMITS.check("many robots, few samples", 5000, |n| recording(n as u64, 0, 257, &[]), play);
    LIMITS.check("many discs, few samples", 5000, |n| recording(1, n as u64, 257, &[]), play);
    LIMITS.check("many robots and samples", 2000, |n| recording(n as u64, 0, n as u64, &[]), play);
    LIMITS.check("many samples", 20_000, |n| recording(1, 0, n as u64, &[0, 1, 2, 4]), play);
    let many = |n| recording(50, 0, n as u64, &[0, 0].repeat(50));
    LIMITS.check("many changes", 1000, many, play);
}

/// 200,000 robots and 257 samples took 1.2 GB.
#[test]
fn recordings_with_too_many_robots() {
    let read = |bytes: &[u8]| {
        let error = RecordingReader::new(bytes).err();
        let text = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(text.contains("robots") || bytes.len() < 65_536, "{text}");
    };
    let limits = Limits { per_byte: 0, ..LIMITS };
    limits.check("too many robots", 70_000, |n| recording(n as u64, 0, 257, &[]), read);
}

/// Counts without the items that they announce.
#[test]
fn recordings_with_counts_beyond_the_file() {
    for zeros in 0..4 {
        let counted = |n: usize| {
            let mut bytes = b"bbzrec".to_vec();
            bytes.extend([VERSION, 100, 100, 100]);
            bytes.extend(vec![0; zeros]);
            put(&mut bytes, if zeros == 0 { 65_536 } else { u64::from(u32::MAX) });
            bytes.extend(vec![1; n]);
            bytes
        };
        LIMITS.check("counts beyond the file", 20_000, counted, play);
    }
}
