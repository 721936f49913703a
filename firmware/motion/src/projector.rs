//! The projector's picture: from the edges of a photodiode's signal to the pixel that it is in.
//!
//! A frame is 41 black or white patterns of 333 µs each: a black one; the column in Gray code and the row in Gray code, ten
//! patterns each, most significant bit first; 20 white ones. Gray code of neighbouring pixels differs in one pattern, so that
//! a photodiode which moves during a frame is off by a pixel at most, and one between two pixels is in one of them.
//! (SwarmUI: config.h, sensors.c, the projector's bitmaps.)

/// µs of a pattern.
pub const PATTERN_US: u32 = 333;
/// Patterns of a frame.
pub const PATTERNS: u32 = 41;
/// µs of a frame.
pub const FRAME_US: u32 = PATTERNS * PATTERN_US;

/// White patterns at the end of a frame.
const WHITE: u32 = 20;
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

/// What a photodiode has seen.
#[derive(Clone, Copy, Debug, Default)]
pub struct Decoder {
    /// When the frame began, if one has.
    start: Option<u32>,
    /// The last edge, and whether there has been light since.
    edge: u32,
    is_lit: bool,
    /// How many patterns of the frame have been seen, and the last of them, the latest in bit 0.
    seen: u32,
    patterns: u32,
}

impl Decoder {
    /// Nothing seen.
    pub const fn new() -> Self {
        Decoder { start: None, edge: 0, is_lit: false, seen: 0, patterns: 0 }
    }

    /// The light has gone on (`is_lit`) or off at `now` µs. Tells whether a frame has begun with that: after so much
    /// white, and only there, a black pattern is the first.
    pub fn edge(&mut self, now: u32, is_lit: bool) -> bool {
        let run = patterns(now.wrapping_sub(self.edge));
        self.edge = now;
        self.is_lit = is_lit;
        if !is_lit && (WHITE..PATTERNS).contains(&run) {
            *self = Decoder { start: Some(now), edge: now, ..Decoder::new() };
            return true;
        }
        if let Some(start) = self.start {
            // Counted from the beginning of the frame, so that deviations of single edges do not add up.
            let until = patterns(now.wrapping_sub(start));
            let count = until.saturating_sub(self.seen);
            if until > 1 + CODE {
                // The rest is white: the frame is damaged.
                self.start = None;
            } else if !is_lit {
                self.patterns = (self.patterns << count) | ((1 << count) - 1);
            } else {
                self.patterns <<= count;
            }
            self.seen = until;
        }
        false
    }

    /// The pixel in the frame that has begun at `start`, or within half a pattern of that, once it is
    /// [readable](READABLE_US). `None` if it was not seen whole.
    pub fn pixel(&self, start: u32) -> Option<Pixel> {
        let own = self.start?;
        let late = own.wrapping_sub(start).wrapping_add(PATTERN_US / 2);
        if late > PATTERN_US || !self.is_lit {
            return None;
        }
        let rest = (1 + CODE).checked_sub(self.seen)?;
        let code = (self.patterns << rest) | ((1 << rest) - 1);
        let column = from_gray((code >> COORDINATE) & ((1 << COORDINATE) - 1));
        let row = from_gray(code & ((1 << COORDINATE) - 1));
        Some(Pixel { column, row })
    }
}

/// The nearest number of patterns, of less than a second; a time that is too long for that is as long as two frames.
fn patterns(us: u32) -> u32 {
    const TOO_LONG: u32 = 2 * FRAME_US;
    // 12595 / 2^22 = 1 / 333.013. The chip has no division.
    ((us.min(TOO_LONG) + PATTERN_US / 2) * 12_595) >> 22
}

/// The number whose Gray code of at most 16 bits is `code`.
fn from_gray(code: u32) -> u16 {
    let mut number = code;
    for shift in [8, 4, 2, 1] {
        number ^= number >> shift;
    }
    number as u16
}
