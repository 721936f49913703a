//! The decoder of the projector's picture, from the edges of a photodiode's signal to the pixel in
//! which it is.
//!
//! A frame is 41 black or white patterns of 333 µs each: a black one; ten for the column and ten
//! for the row, both in Gray code with the most significant bit first; 20 white ones. The Gray
//! codes of neighboring pixels differ in one pattern. A photodiode that moves during a frame is
//! therefore off by at most one pixel, and one between two pixels yields one of them. (SwarmUI:
//! config.h, sensors.c, the projector's bitmaps.)
//!
//! Lamps and the resets of the projector's mirrors add glitches: pulses of the opposite level, far
//! shorter than a pattern. The decoder ignores every pulse shorter than [`GLITCH_US`]. It discards
//! a frame with a longer pulse that is still too short for a pattern, because the projector's own
//! edges are unknown in such a frame.

use core::sync::atomic::{AtomicU16, Ordering};

/// The length of a pattern in µs.
pub const PATTERN_US: u32 = 333;
/// The number of patterns of a frame.
pub const PATTERNS: u32 = 41;
/// The length of a frame in µs.
pub const FRAME_US: u32 = PATTERNS * PATTERN_US;

/// The number of white patterns at the end of a frame.
const WHITE: u32 = 20;
/// The minimum length of the white before a frame, in µs: half a pattern less than the nominal
/// length.
const SHORTEST_WHITE: u16 = (WHITE * PATTERN_US - PATTERN_US / 2) as u16;
/// The length in µs below which a pulse is a glitch. A glitch next to an edge of the code moves
/// that edge by less than twice this length, a third of a pattern, so the edge stays nearer to its
/// own pattern than to the next.
pub const GLITCH_US: u16 = (PATTERN_US / 6) as u16;
/// The minimum distance of the projector's own edges in µs, even if each is a quarter of a pattern
/// early or late.
const SHORTEST_PULSE: u16 = (PATTERN_US / 2) as u16;

/// The numbers of patterns of column and row together, and of each.
const CODE: u32 = 20;
const COORDINATE: u32 = CODE / 2;

/// The time in µs from the beginning of a frame until column and row, and one more white pattern,
/// have been shown.
pub const READABLE_US: u32 = (1 + CODE + 1) * PATTERN_US;

/// The time in µs from the beginning of a frame to the middle of column and row. The decoded
/// position is that of this moment.
pub const MIDDLE_US: u32 = (1 + CODE / 2) * PATTERN_US;
/// The time in µs from the middle of the column to [`MIDDLE_US`], and from there to the middle of
/// the row.
pub const AXIS_OFFSET_US: u32 = COORDINATE / 2 * PATTERN_US;

/// The column and the row of a pixel, as they are projected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixel {
    /// The column, 0 to 1023, to the right.
    pub column: u16,
    /// The row, 0 to 1023, downwards.
    pub row: u16,
}

/// The decoder of a photodiode's signal. It only needs the times of the edges in µs modulo 2^16,
/// which a timer captures without the program. The levels follow from the end of the frame, which
/// is light.
#[derive(Clone, Copy, Debug, Default)]
pub struct Decoder {
    /// The last edge and the one before. A glitch removes the last edge.
    edge: u16,
    before: u16,
    /// The time at which the frame began, in µs.
    start: u16,
    /// Bit `31 - n` is set if the light changes with pattern `n` of the frame.
    changes: u32,
    /// The start and the changes of the previous frame. If the code ends with light, the white
    /// before a glitch may be as long as before a frame, so that the glitch looks like a start.
    replaced_start: u16,
    replaced_changes: u32,
}

/// The bit of the change to the first pattern, which is black.
const FIRST: u32 = 1 << 31;
/// A bit of the changes that no valid frame has: the frame is damaged.
const DAMAGED: u32 = 1;
/// The number of bits below those of the code, and the highest of them. They belong to white
/// patterns.
const AFTER: u32 = 31 - CODE;
const FIRST_WHITE: u32 = 1 << (AFTER - 1);

impl Decoder {
    /// Returns a decoder without edges.
    pub const fn new() -> Self {
        Decoder { edge: 0, before: 0, start: 0, changes: 0, replaced_start: 0, replaced_changes: 0 }
    }

    /// Processes edges at these times, in order.
    pub fn edges(&mut self, times: &[AtomicU16]) {
        let mut decoder = *self;
        for time in times {
            decoder.edge(time.load(Ordering::Relaxed));
        }
        *self = decoder;
    }

    /// Processes an edge at the time `at`. White of at least the minimum length comes only before
    /// the first pattern of a frame.
    pub fn edge(&mut self, at: u16) {
        let run = at.wrapping_sub(self.edge);
        if run < GLITCH_US {
            if self.edge == self.start {
                (self.start, self.changes) = (self.replaced_start, self.replaced_changes);
            } else {
                self.changes ^= self.last_change();
            }
            self.edge = self.before;
            // The pulse before that edge was long enough, or the frame is already marked as
            // damaged.
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

    /// Returns the bit of the change at the last edge. Patterns are counted from the beginning of
    /// the frame, so that deviations of single edges do not add up. Two changes in one pattern
    /// cancel each other.
    fn last_change(&self) -> u32 {
        FIRST.unbounded_shr(patterns(self.edge.wrapping_sub(self.start)))
    }

    /// Marks the frame as damaged if the pulse before the last edge was too short. That pulse can
    /// no longer be a glitch.
    fn note_pulse(&mut self) {
        if self.edge.wrapping_sub(self.before) < SHORTEST_PULSE {
            self.changes |= DAMAGED;
        }
    }

    /// Returns the time at which the unread frame began, if there is one.
    pub fn begun(&self) -> Option<u16> {
        (self.changes & FIRST != 0).then_some(self.start)
    }

    /// Reads the frame, once it is [readable](READABLE_US) and until the next one begins. `is_lit`
    /// is true if there is light now. Returns `None` if the frame was not received completely.
    pub fn pixel(&mut self, is_lit: bool) -> Option<Pixel> {
        self.note_pulse();
        let mut changes = core::mem::take(&mut self.changes);
        if !is_lit {
            // Either a glitch in the white patterns is not over, or the frame does not end with
            // light.
            let last = self.last_change();
            if last > FIRST_WHITE {
                return None;
            }
            changes ^= last;
        }
        let dark = from_gray(changes);
        // A valid frame ends with light that does not change any more.
        if changes & FIRST == 0 || changes & (FIRST_WHITE - 1) != 0 || dark & 1 != 0 {
            return None;
        }
        let code = from_gray(!(dark >> AFTER) & ((1 << CODE) - 1));
        let column = code >> COORDINATE;
        // The row's Gray code was decoded as a continuation of the column's, so the column's last
        // bit inverts it.
        let row = if column & 1 == 0 { code } else { !code } & ((1 << COORDINATE) - 1);
        Some(Pixel { column: column as u16, row: row as u16 })
    }
}

/// Returns the nearest number of patterns.
fn patterns(us: u16) -> u32 {
    // 12595 / 2^22 = 1 / 333.013. The chip has no division.
    ((u32::from(us) + PATTERN_US / 2) * 12_595) >> 22
}

/// Returns the number with the Gray code `code`: each bit is the parity of the bits up to it.
fn from_gray(code: u32) -> u32 {
    let code = code ^ code >> 16;
    let code = code ^ code >> 8;
    let code = code ^ code >> 4;
    let code = code ^ code >> 2;
    code ^ code >> 1
}
