//! The projector's picture: from the edges of a photodiode's signal to the pixel that it is in.
//!
//! A frame is 41 black or white patterns of 333 µs each: a black one; the column in Gray code and the row in Gray code, ten
//! patterns each, most significant bit first; 20 white ones. Gray code of neighbouring pixels differs in one pattern, so that
//! a photodiode which moves during a frame is off by a pixel at most, and one between two pixels is in one of them.
//! (SwarmUI: config.h, sensors.c, the projector's bitmaps.)

use core::sync::atomic::{AtomicU16, Ordering};

/// µs of a pattern.
pub const PATTERN_US: u32 = 333;
/// Patterns of a frame.
pub const PATTERNS: u32 = 41;
/// µs of a frame.
pub const FRAME_US: u32 = PATTERNS * PATTERN_US;

/// White patterns at the end of a frame.
const WHITE: u32 = 20;
/// µs of white before a frame: half a pattern less than all of it.
const SHORTEST_WHITE: u16 = (WHITE * PATTERN_US - PATTERN_US / 2) as u16;
/// Patterns of column and row.
const CODE: u32 = 20;
const COORDINATE: u32 = CODE / 2;

/// µs from the beginning of a frame until column and row have been shown, and a white pattern more.
pub const READABLE_US: u32 = (1 + CODE + 1) * PATTERN_US;

/// µs from the beginning of a frame to the middle of column and row: the time at which the robot was there.
pub const MIDDLE_US: u32 = (1 + CODE / 2) * PATTERN_US;
/// µs by which the column's own middle is before that, and the row's after.
pub const ASIDE_US: u32 = COORDINATE / 2 * PATTERN_US;

/// A pixel: column and row as they are projected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixel {
    /// 0 to 1023, to the right.
    pub column: u16,
    /// 0 to 1023, downwards.
    pub row: u16,
}

/// What a photodiode has seen, of which only the times of its edges are asked for, in µs modulo 2^16: a timer captures them without
/// a program's doing. When it was light and when dark follows from that: a frame ends with light.
#[derive(Clone, Copy, Debug, Default)]
pub struct Decoder {
    /// The last edge.
    edge: u16,
    /// When the frame began.
    start: u16,
    /// Whether the light changes with pattern `n` of the frame: bit `31 - n`.
    changes: u32,
}

/// The first pattern is black.
const FIRST: u32 = 1 << 31;
/// Bits of [`Decoder`] below those of the code, and the first of them: white patterns.
const AFTER: u32 = 31 - CODE;
const FIRST_WHITE: u32 = 1 << (AFTER - 1);

impl Decoder {
    /// Nothing seen.
    pub const fn new() -> Self {
        Decoder { edge: 0, start: 0, changes: 0 }
    }

    /// The light has gone on or off at these times, in order.
    pub fn edges(&mut self, times: &[AtomicU16]) {
        let mut decoder = *self;
        for time in times {
            decoder.edge(time.load(Ordering::Relaxed));
        }
        *self = decoder;
    }

    /// The light has gone on or off. After so much white, and only there, a black pattern is the first.
    pub fn edge(&mut self, at: u16) {
        let run = at.wrapping_sub(self.edge);
        self.edge = at;
        if run >= SHORTEST_WHITE {
            self.start = at;
            self.changes = 0;
        }
        // Counted from the beginning of the frame, so that deviations of single edges do not add up. What changes twice does not.
        self.changes ^= FIRST.unbounded_shr(patterns(at.wrapping_sub(self.start)));
    }

    /// When the frame began that was not read yet.
    pub fn begun(&self) -> Option<u16> {
        (self.changes & FIRST != 0).then_some(self.start)
    }

    /// Reads the frame, once it is [readable](READABLE_US) and until the next one begins. `is_lit` tells whether there is light now.
    /// `None` if it was not seen whole.
    pub fn pixel(&mut self, is_lit: bool) -> Option<Pixel> {
        let changes = core::mem::take(&mut self.changes);
        let dark = from_gray(changes);
        // Whatever was before, a frame ends with light, which does not change any more.
        if !is_lit || changes & FIRST == 0 || changes & (FIRST_WHITE - 1) != 0 || dark & 1 != 0 {
            return None;
        }
        let code = from_gray(!(dark >> AFTER) & ((1 << CODE) - 1));
        let column = code >> COORDINATE;
        // The row's code goes on from the column's last bit.
        let row = if column & 1 == 0 { code } else { !code } & ((1 << COORDINATE) - 1);
        Some(Pixel { column: column as u16, row: row as u16 })
    }
}

/// The nearest number of patterns.
fn patterns(us: u16) -> u32 {
    // 12595 / 2^22 = 1 / 333.013. The chip has no division.
    ((u32::from(us) + PATTERN_US / 2) * 12_595) >> 22
}

/// The number whose Gray code is `code`: each bit tells whether those up to it are an odd number.
fn from_gray(code: u32) -> u32 {
    let code = code ^ code >> 16;
    let code = code ^ code >> 8;
    let code = code ^ code >> 4;
    let code = code ^ code >> 2;
    code ^ code >> 1
}
