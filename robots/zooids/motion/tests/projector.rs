//! Frames of the projector, whole and damaged.

use std::ops::RangeInclusive;

use crate::common::pattern;
use bittybuzz_motion::MM;
use bittybuzz_motion::projector::{Decoder, FRAME_US, PATTERN_US, Pixel, READABLE_US};
use bittybuzz_motion::track::TrackedPose;
use bittybuzz_random::Random;

/// Returns the edges of frames at a pixel, from the last white patterns of a first frame on, as
/// time in µs and level.
fn edges(column: u32, row: u32, frames: usize) -> Vec<(u32, bool)> {
    let mut edges = vec![(0, true)];
    let mut level = true;
    for count in 0..frames * 41 {
        let next = pattern(count % 41, column, row);
        if next != level {
            // The edges are offset by 20 white patterns, which came before.
            edges.push(((20 + count as u32) * PATTERN_US, next));
            level = next;
        }
    }
    edges
}

/// Returns the pixels from a decoder that is read half a pattern after the row.
fn read(edges: &[(u32, bool)]) -> Vec<Option<Pixel>> {
    let (mut decoder, mut pixels, mut level) = (Decoder::new(), Vec::new(), false);
    let last = edges.last().map_or(0, |edge| edge.0) + FRAME_US;
    for (at, is_lit) in edges.iter().copied().chain([(last, false)]) {
        let age = decoder.begun().map(|start| (at as u16).wrapping_sub(start));
        if age.is_some_and(|age| u32::from(age) > READABLE_US) {
            pixels.push(decoder.pixel(level));
        }
        if at != last {
            decoder.edge(at as u16);
            level = is_lit;
        }
    }
    pixels
}

/// Adds a pulse of the opposite level at `at` for `width` µs. An added edge at the time of a change
/// cancels the change.
fn with_pulse(edges: &[(u32, bool)], at: u32, width: u32) -> Vec<(u32, bool)> {
    let mut times: Vec<u32> = edges.iter().map(|edge| edge.0).chain([at, at + width]).collect();
    times.sort_unstable();
    times.into_iter().enumerate().map(|(index, time)| (time, index % 2 == 0)).collect()
}

/// The makers' bitmaps: 512 is 1100000000, 56 is 0000100100, 796 is 1010010010.
#[test]
fn known_codes() {
    let row = |text: &str| text.bytes().map(|bit| bit == b'1').collect::<Vec<_>>();
    for (number, code) in [(512, "1100000000"), (56, "0000100100"), (796, "1010010010")] {
        let shown: Vec<bool> = (1..=10).map(|k| pattern(k, number, 0)).collect();
        assert_eq!(shown, row(code));
        let shown: Vec<bool> = (11..=20).map(|k| pattern(k, 0, number)).collect();
        assert_eq!(shown, row(code));
    }
}

/// Every projected pixel is tested. None of these patterns is dark for the length of the white at
/// the end of a frame.
#[test]
fn every_column_and_every_row() {
    let (columns, rows) = (56..=967_u32, 227..=796_u32);
    for number in 0..1024 {
        let other = |range: &RangeInclusive<u32>| {
            range.start() + number * 7 % (range.end() + 1 - range.start())
        };
        for (column, row) in [(number, other(&rows)), (other(&columns), number)] {
            if !columns.contains(&column) || !rows.contains(&row) {
                continue;
            }
            let expected = Some(Pixel { column: column as u16, row: row as u16 });
            assert_eq!(read(&edges(column, row, 2)), [expected; 2], "{column}, {row}");
        }
    }
}

/// Frames are read correctly with edges up to a third of a pattern early or late, and with a clock
/// error of half a percent.
#[test]
fn jitter_and_a_wrong_clock() {
    let mut noise = Random::new(1);
    for number in 0..500_u32 {
        let (column, row) = (number * 2 + 13, 1023 - number);
        let scale = 0.995 + 0.01 * noise.unit();
        let edges: Vec<_> = edges(column, row, 3)
            .into_iter()
            .map(|(at, level)| {
                let late = (2.0 * noise.unit() - 1.0) * 55.0;
                ((f64::from(at) * scale + late + 100.0) as u32, level)
            })
            .collect();
        let expected = Some(Pixel { column: column as u16, row: row as u16 });
        assert_eq!(read(&edges), [expected; 3], "{column}, {row}");
    }
}

/// Times wrap around after 65.5 ms, also within a frame.
#[test]
fn the_clock_wraps_around() {
    for shift in (0..FRAME_US).step_by(97) {
        let mut decoder = Decoder::new();
        for (at, _) in edges(700, 300, 1) {
            decoder.edge(at.wrapping_sub(20 * PATTERN_US + shift) as u16);
        }
        assert_eq!(decoder.begun(), Some(shift.wrapping_neg() as u16));
        assert_eq!(decoder.pixel(true), Some(Pixel { column: 700, row: 300 }));
    }
}

/// A frame is read only once, even if the light stays on until the clock has wrapped around.
#[test]
fn a_frame_is_read_once() {
    let mut decoder = Decoder::new();
    edges(700, 300, 1).iter().for_each(|(at, _)| decoder.edge(*at as u16));
    assert!(decoder.pixel(true).is_some());
    assert_eq!((decoder.begun(), decoder.pixel(true)), (None, None));
}

/// The levels of edges are not captured. A frame with black in place of white is rejected
/// nevertheless.
#[test]
fn an_inverted_frame_is_rejected() {
    let inverse: Vec<_> = edges(700, 300, 3).iter().map(|(at, is_lit)| (*at, !is_lit)).collect();
    assert_eq!(read(&inverse), [None; 3]);
    // The frame is rejected even if there is light at the moment of reading.
    let mut decoder = Decoder::new();
    inverse.iter().for_each(|(at, _)| decoder.edge(*at as u16));
    decoder.edge((20 * PATTERN_US + 2 * FRAME_US + 21 * PATTERN_US + 10) as u16);
    assert_eq!(decoder.pixel(true), None);
}

/// A comparator may produce several edges when the light changes: any number within half a pattern,
/// as long as the last one is correct.
#[test]
fn a_bouncing_edge_counts_once() {
    for bounces in 1..6_u32 {
        let edges: Vec<_> = edges(700, 300, 3)
            .into_iter()
            .flat_map(|(at, level)| {
                (0..=2 * bounces).map(move |n| (at + 10 * n, level == (n % 2 == 0)))
            })
            .collect();
        assert_eq!(read(&edges), [Some(Pixel { column: 700, row: 300 }); 3], "{bounces}");
    }
}

/// After any missing or additional edge, the next complete frame is read.
#[test]
fn one_damaged_frame_does_not_damage_the_next() {
    let whole = edges(700, 300, 4);
    let expected = Some(Pixel { column: 700, row: 300 });
    let second = whole.iter().position(|edge| edge.0 >= 20 * PATTERN_US + FRAME_US).unwrap();
    for missing in second..whole.len() {
        let mut edges = whole.clone();
        edges.remove(missing);
        if edges[missing.min(edges.len() - 1)].0 > 20 * PATTERN_US + 2 * FRAME_US {
            break;
        }
        let pixels = read(&edges);
        assert_eq!((pixels.first(), pixels.last()), (Some(&expected), Some(&expected)));
    }
    // A flickering lamp adds two edges at any time.
    for extra in (0..FRAME_US).step_by(41) {
        let mut edges = whole.clone();
        let at = 20 * PATTERN_US + FRAME_US + extra;
        let next = edges.iter().position(|edge| edge.0 > at).unwrap();
        let level = edges[next].1;
        edges.insert(next, (at + 1, !level));
        edges.insert(next, (at, level));
        let pixels = read(&edges);
        assert_eq!((pixels.first(), pixels.last()), (Some(&expected), Some(&expected)), "{extra}");
    }
}

/// A pulse of the opposite level, at every µs of a frame, loses no frame: in the code, next to and
/// across its edges, in the white before the frame, and while the frame is read.
#[test]
fn a_glitch_does_not_lose_a_frame() {
    for (column, row) in [(700, 300), (341, 682), (512, 512), (967, 796)] {
        let whole = edges(column, row, 4);
        let expected = Some(Pixel { column: column as u16, row: row as u16 });
        for width in [1, 20, 50] {
            for after in 0..FRAME_US {
                let at = 20 * PATTERN_US + FRAME_US + after;
                let pixels = read(&with_pulse(&whole, at, width));
                assert_eq!(pixels, [expected; 4], "{width} us of glitch at {after} us");
            }
        }
    }
}

/// Glitches in every frame lose no frame at other pixels either, with edges up to 20 µs early or
/// late.
#[test]
fn a_glitch_in_each_frame_of_a_jittery_picture() {
    let mut noise = Random::new(7);
    for number in 0..3000_u32 {
        let (column, row) = (56 + number * 7 % 912, 227 + number * 11 % 570);
        let late = edges(column, row, 4)
            .into_iter()
            .map(|(at, level)| ((f64::from(at) + 20.0 + 40.0 * noise.unit()) as u32, level));
        let mut edges: Vec<_> = late.collect();
        for frame in 0..4 {
            let after = noise.unit() * f64::from(FRAME_US - 50);
            let at = 20 * PATTERN_US + frame * FRAME_US + after as u32;
            edges = with_pulse(&edges, at, 1 + (49.0 * noise.unit()) as u32);
        }
        let expected = Some(Pixel { column: column as u16, row: row as u16 });
        assert_eq!(read(&edges), [expected; 4], "{column}, {row}");
    }
}

/// Pulses that are too long for a glitch, each somewhere in a frame: the frame is correct or
/// rejected. One in fifty of those between a third and a half of a pattern counts as an edge of the
/// code, since it lies next to one. The other photodiode rejects two in three of these frames. The
/// remaining ones move a robot that is seen for the first time by at most 21.6 mm, since both
/// photodiodes still seem to be 15.6 to 23.6 mm apart. The tracker rejects more than 12 mm for a
/// robot with a known position.
#[test]
fn a_damaged_frame_is_not_read() {
    let mut noise = Random::new(11);
    for (most, wrong_at_most) in [(110, 0), (166, 250)] {
        let (mut right, mut refused, mut wrong, mut believed) = (0, 0, 0, 0);
        let mut worst: f64 = 0.0;
        for number in 0..20_000_u32 {
            let (column, row) = (80 + number * 7 % 880, 227 + number * 11 % 570);
            let after = (noise.unit() * f64::from(FRAME_US)) as u32;
            let width = 56 + (f64::from(most - 56) * noise.unit()) as u32;
            let at = 20 * PATTERN_US + FRAME_US + after;
            let pixels = read(&with_pulse(&edges(column, row, 3), at, width));
            let expected = Pixel { column: column as u16, row: row as u16 };
            right += usize::from(pixels == [Some(expected); 3]);
            refused += 3 - pixels.iter().flatten().count();
            // The other photodiode is 19.6 mm to the left.
            let left = Pixel { column: column as u16 - 21, row: row as u16 };
            let truth = TrackedPose::of(expected, left).unwrap();
            for pixel in pixels.into_iter().flatten().filter(|pixel| *pixel != expected) {
                wrong += 1;
                let Some(pose) = TrackedPose::of(pixel, left) else { continue };
                believed += 1;
                let (x, y) = (pose.x - truth.x, pose.y - truth.y);
                worst = worst.max(f64::from(x).hypot(f64::from(y)) / f64::from(MM));
            }
        }
        println!(
            "56 to {most} us: {right} right, {refused} refused, {wrong} wrong of 20000, of which {believed} believed, {worst:.1} mm"
        );
        assert!(refused > 5_000, "{refused}");
        assert!(wrong <= wrong_at_most && believed * 2 <= wrong_at_most, "{wrong} {believed}");
        assert!(worst <= 21.6, "{worst} mm");
    }
}

/// Constant light, darkness and flickering lamps yield no position. A lamp that is on for 20
/// patterns and off for 20 looks like a frame, but both photodiodes cannot be in the same pixel.
#[test]
fn light_without_the_code_gives_no_frame() {
    for edges in
        [&[(0, true)][..], &[(0, true), (9000, false)], &[(0, true), (9000, false), (20_000, true)]]
    {
        assert!(read(edges).iter().all(Option::is_none), "{edges:?}");
    }
    for half in (20..14_000).step_by(20) {
        let edges: Vec<_> = (1..20).map(|n| (n * half, n % 2 == 0)).collect();
        for pixel in read(&edges).into_iter().flatten() {
            assert_eq!(TrackedPose::of(pixel, pixel), None, "{half} us of light");
        }
    }
}
