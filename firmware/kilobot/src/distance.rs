//! The distance to the sender of a message, from the two amplitudes of its first pulses.

/// Entries of a table: the reading at 0, 5, ... 65 mm between two robots' rims.
pub const ENTRIES: u8 = 14;

/// From one entry to the next, mm.
const STEP: i16 = 5;

/// From middle to middle of two robots that touch, mm.
const TOUCHING: u8 = 33;

/// The converter has ten bits.
const READING_MAX: u16 = 1023;

/// Above this reading the high gain says nothing; above [`LOUD`] the low one says something.
const TOO_LOUD: u16 = 900;
const LOUD: u16 = 700;
/// The number of readings for which both gains give a distance.
const BOTH: u8 = (TOO_LOUD - LOUD) as u8;

/// The gap that a receiver assumes without a smaller reading in its table for the low gain, mm.
const FAR: u8 = 90;

/// Readings of the analog converter, 0 to 1023.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Amplitudes {
    /// The amplitude of the first pulse.
    pub high_gain: u16,
    /// The amplitude of the second pulse.
    pub low_gain: u16,
}

/// Which of the receiver's amplifiers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gain {
    /// The gain for far robots.
    High,
    /// The gain for near robots.
    Low,
}

/// The distance between the middles of two robots in mm. The function gives the entries of the robot's two tables. `None` if the
/// tables do not fall: the robot was never calibrated.
///
/// As kilolib's `estimate_distance`, but with signed numbers: between two entries along the line through them, beyond
/// the last along the last two.
pub fn distance(heard: Amplitudes, entry: impl Fn(Gain, u8) -> u16) -> Option<u8> {
    let Amplitudes { high_gain: high, low_gain: low } = heard;
    let (mut between, mut weight) = (0, 0);
    if high < TOO_LOUD {
        between = gap(Gain::High, high, &entry)?;
        weight = (TOO_LOUD - high) as u8;
    }
    if high > LOUD {
        let by_low = gap(Gain::Low, low, &entry)?;
        // Where both gains give a distance, the result blends from one to the other.
        let sum =
            u16::from(between) * u16::from(weight) + u16::from(by_low) * u16::from(BOTH - weight);
        between = (sum / u16::from(BOTH)) as u8;
    }
    Some(TOUCHING + between)
}

/// The gap between the rims by one table, at most 222 mm.
#[inline(never)]
fn gap(gain: Gain, reading: u16, entry: &impl Fn(Gain, u8) -> u16) -> Option<u8> {
    let reading = reading.min(READING_MAX);
    let mut before = entry(gain, 0);
    if reading > before {
        return Some(0);
    }
    if before > READING_MAX {
        return None;
    }
    let mut index = 1;
    let mut at = entry(gain, index);
    while reading <= at {
        if index == ENTRIES - 1 {
            if gain == Gain::Low {
                return Some(FAR);
            }
            break;
        }
        before = at;
        index += 1;
        at = entry(gain, index);
    }
    if at >= before || before > READING_MAX {
        return None;
    }
    // Readings have 10 bits: the products stay within 16.
    let fall = before as i16 - at as i16;
    let along = (10 * (at as i16 - reading as i16)).checked_div(2 * fall)?;
    let gap = STEP * i16::from(index) + along;
    Some(gap.clamp(0, i16::from(u8::MAX - TOUCHING)) as u8)
}
