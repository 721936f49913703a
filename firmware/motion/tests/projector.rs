//! Frames of the projector, whole and damaged.

mod common;

use std::ops::RangeInclusive;

use bittybuzz_motion::projector::{Decoder, FRAME_US, PATTERN_US, Pixel, READABLE_US};
use bittybuzz_motion::track::Pose;
use common::{Noise, pattern};

/// The edges of frames at a pixel, from the first one's last white patterns on: time in µs and level.
fn edges(column: u32, row: u32, frames: usize) -> Vec<(u32, bool)> {
    let mut edges = vec![(0, true)];
    let mut level = true;
    for count in 0..frames * 41 {
        let next = pattern(count % 41, column, row);
        if next != level {
            // 20 patterns of white came before.
            edges.push(((20 + count as u32) * PATTERN_US, next));
            level = next;
        }
    }
    edges
}

/// The pixels that are read if a decoder is asked half a pattern after the row.
fn read(edges: &[(u32, bool)]) -> Vec<Option<Pixel>> {
    let (mut decoder, mut pixels, mut level) = (Decoder::new(), Vec::new(), false);
    let last = edges.last().map_or(0, |edge| edge.0) + FRAME_US;
    let mut edges = edges.iter().peekable();
    for now in 0..last {
        while let Some((at, is_lit)) = edges.next_if(|edge| edge.0 <= now) {
            decoder.edge(*at as u16);
            level = *is_lit;
        }
        let age = decoder.begun().map(|start| (now as u16).wrapping_sub(start));
        if age.is_some_and(|age| u32::from(age) >= READABLE_US) {
            pixels.push(decoder.pixel(level));
        }
    }
    pixels
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

/// All that are projected. In none of these patterns it is dark for as long as white frames end.
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

/// An edge that is up to a third of a pattern early or late does no harm, and neither does a clock that is half a percent off.
#[test]
fn jitter_and_a_wrong_clock() {
    let mut noise = Noise(1);
    for number in 0..500_u32 {
        let (column, row) = (number * 2 + 13, 1023 - number);
        let scale = 0.995 + 0.01 * noise.uniform();
        let edges: Vec<_> = edges(column, row, 3)
            .into_iter()
            .map(|(at, level)| {
                let late = (2.0 * noise.uniform() - 1.0) * 55.0;
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

/// A frame is read once: light that stays on does not bring it back when the clock has wrapped around.
#[test]
fn a_frame_is_read_once() {
    let mut decoder = Decoder::new();
    edges(700, 300, 1).iter().for_each(|(at, _)| decoder.edge(*at as u16));
    assert!(decoder.pixel(true).is_some());
    assert_eq!((decoder.begun(), decoder.pixel(true)), (None, None));
}

/// Nobody tells which edges are those of light that goes on: what is black where a frame is white is no frame.
#[test]
fn the_opposite_of_a_frame_is_none() {
    let inverse: Vec<_> = edges(700, 300, 3).iter().map(|(at, is_lit)| (*at, !is_lit)).collect();
    assert_eq!(read(&inverse), [None; 3]);
    // Also if it is light by chance when it is asked.
    let mut decoder = Decoder::new();
    inverse.iter().for_each(|(at, _)| decoder.edge(*at as u16));
    decoder.edge((20 * PATTERN_US + 2 * FRAME_US + 21 * PATTERN_US + 10) as u16);
    assert_eq!(decoder.pixel(true), None);
}

/// A comparator that wavers when the light changes: any number of edges within half a pattern, as long as the last is right.
#[test]
fn an_edge_that_bounces_is_one() {
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

/// Whatever edge is missing or made up, the next whole frame is read.
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
    // A lamp that flickers: twice as many edges at any time.
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

/// Constant light, darkness, and lamps that flicker tell no position. One that is on for 20 patterns and off for as many
/// looks like a frame, but both photodiodes cannot be in the same pixel.
#[test]
fn other_light_is_none() {
    for edges in
        [&[(0, true)][..], &[(0, true), (9000, false)], &[(0, true), (9000, false), (20_000, true)]]
    {
        assert!(read(edges).iter().all(Option::is_none), "{edges:?}");
    }
    for half in (20..14_000).step_by(20) {
        let edges: Vec<_> = (1..20).map(|n| (n * half, n % 2 == 0)).collect();
        for pixel in read(&edges).into_iter().flatten() {
            assert_eq!(Pose::of(pixel, pixel), None, "{half} us of light");
        }
    }
}
