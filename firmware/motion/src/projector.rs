//! The projector's picture: from the edges of a photodiode's signal to the pixel that it is in.
//!
//! A frame is 41 black or white patterns of 333 µs each: a black one; the column in Gray code and the row in Gray code, ten
//! patterns each, most significant bit first; 20 white ones. Gray code of neighbouring pixels differs in one pattern, so that
//! a photodiode which moves during a frame is off by a pixel at most, and one between two pixels is in one of them.
//! (SwarmUI: config.h, sensors.c, the projector's bitmaps.)
//!
//! Lamps and the resets of the projector's mirrors add glitches: pulses of the opposite level, far shorter than a pattern. A pulse
//! shorter than [`GLITCH_US`] does not exist for the decoder, wherever it is. A frame with a pulse that is longer, and yet too short
//! for a pattern, is not read: which of its edges are the projector's is unknown.

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
/// µs: two edges that are closer are no change of the light. A glitch beside an edge of the code moves that edge by less than twice
/// as much, a third of a pattern: it stays nearer to its own pattern than to the next.
pub const GLITCH_US: u16 = (PATTERN_US / 6) as u16;
/// µs: the projector's own edges are farther apart, even if each is a quarter of a pattern early or late.
const SHORTEST_PULSE: u16 = (PATTERN_US / 2) as u16;

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
    /// The last edge, and the one before: a glitch takes the last one back.
    edge: u16,
    before: u16,
    /// The time at which the frame began.
    start: u16,
    /// Bit `31 - n` is set if the light changes with pattern `n` of the frame.
    changes: u32,
    /// Start and changes of the frame before: where the code ends with light, a glitch has as much white before it as a frame.
    replaced_start: u16,
    replaced_changes: u32,
}

/// The first pattern is black.
const FIRST: u32 = 1 << 31;
/// A bit of [`Decoder`] that no frame may have: it is damaged.
const DAMAGED: u32 = 1;
/// Bits of [`Decoder`] below those of the code, and the first of them: white patterns.
const AFTER: u32 = 31 - CODE;
const FIRST_WHITE: u32 = 1 << (AFTER - 1);

impl Decoder {
    /// Nothing seen.
    pub const fn new() -> Self {
        Decoder { edge: 0, before: 0, start: 0, changes: 0, replaced_start: 0, replaced_changes: 0 }
    }

    /// The light has gone on or off at these times, in order.
    pub fn edges(&mut self, times: &[AtomicU16]) {
        let mut decoder = *self;
        for time in times {
            decoder.edge(time.load(Ordering::Relaxed));
        }
        *self = decoder;
    }

    /// Takes an edge of the light. After this much white, and only there, a black pattern is the
    /// first.
    pub fn edge(&mut self, at: u16) {
        let run = at.wrapping_sub(self.edge);
        if run < GLITCH_US {
            if self.edge == self.start {
                (self.start, self.changes) = (self.replaced_start, self.replaced_changes);
            } else {
                self.changes ^= self.last_change();
            }
            self.edge = self.before;
            // The pulse before that edge was long enough, or has been noted.
            self.before = self.edge.wrapping_sub(SHORTEST_PULSE);
            return;
        }
        self.note_pulse();
        if run >= SHORTEST_WHITE {
            (self.replaced_start, self.replaced_changes) = (self.start, self.changes);
            self.start = at;
            self.changes = 0;
        }
        (self.before, self.edge) = (self.edge, at);
        self.changes ^= self.last_change();
    }

    /// The change at the last edge. Patterns are counted from the beginning of the frame, so that deviations of single edges do not
    /// add up. Two changes in one pattern cancel each other.
    fn last_change(&self) -> u32 {
        FIRST.unbounded_shr(patterns(self.edge.wrapping_sub(self.start)))
    }

    /// The pulse that ended with the last edge is no glitch any more.
    fn note_pulse(&mut self) {
        if self.edge.wrapping_sub(self.before) < SHORTEST_PULSE {
            self.changes |= DAMAGED;
        }
    }

    /// Returns the time at which the unread frame began.
    pub fn begun(&self) -> Option<u16> {
        (self.changes & FIRST != 0).then_some(self.start)
    }

    /// Reads the frame, once it is [readable](READABLE_US) and until the next one begins. `is_lit`
    /// is true if there is light now.
    /// `None` if it was not seen whole.
    pub fn pixel(&mut self, is_lit: bool) -> Option<Pixel> {
        self.note_pulse();
        let mut changes = core::mem::take(&mut self.changes);
        if !is_lit {
            // A glitch in the white patterns, which is not over; else the frame does not end with light.
            let last = self.last_change();
            if last > FIRST_WHITE {
                return None;
            }
            changes ^= last;
        }
        let dark = from_gray(changes);
        // Whatever was before, a frame ends with light, which does not change any more.
        if changes & FIRST == 0 || changes & (FIRST_WHITE - 1) != 0 || dark & 1 != 0 {
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

/// The number whose Gray code is `code`: each bit is the parity of those up to it.
fn from_gray(code: u32) -> u32 {
    let code = code ^ code >> 16;
    let code = code ^ code >> 8;
    let code = code ^ code >> 4;
    let code = code ^ code >> 2;
    code ^ code >> 1
}
