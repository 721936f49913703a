//! The distance to the sender of a message, from the two amplitudes of its first pulses.

/// The number of entries of a table: the readings at 0, 5, ... 65 mm between the rims of two
/// robots.
pub const ENTRIES: u8 = 14;

/// The distance from one entry to the next, in mm.
const STEP: i16 = 5;

/// The distance between the middles of two touching robots, in mm.
const TOUCHING: u8 = 33;

/// The highest reading of the converter, which has ten bits.
const READING_MAX: u16 = 1023;

/// The high gain is useless for readings above `TOO_LOUD`, and the low gain is useful for high-gain
/// readings above [`LOUD`].
const TOO_LOUD: u16 = 900;
const LOUD: u16 = 700;
/// The number of readings for which both gains give a distance.
const BOTH: u8 = (TOO_LOUD - LOUD) as u8;

/// The gap in mm that a reading means if it is smaller than all entries of the low gain's table.
const FAR: u8 = 90;

/// Readings of the analog converter, 0 to 1023.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Amplitudes {
    /// The amplitude of the first pulse.
    pub high_gain: u16,
    /// The amplitude of the second pulse.
    pub low_gain: u16,
}

/// One of the receiver's two amplifiers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gain {
    /// The gain for far robots.
    High,
    /// The gain for near robots.
    Low,
}

/// Returns the distance between the middles of two robots in mm. `entry` reads the robot's two
/// tables. Returns `None` if a table does not decrease, since the robot was never calibrated.
///
/// The calculation is that of kilolib's `estimate_distance`, but with signed numbers. It
/// interpolates linearly between two entries, and extrapolates from the last two.
pub fn distance(amplitudes: Amplitudes, entry: impl Fn(Gain, u8) -> u16) -> Option<u8> {
    let Amplitudes { high_gain: high, low_gain: low } = amplitudes;
    let (mut between, mut weight) = (0, 0);
    if high < TOO_LOUD {
        between = gap(Gain::High, high, &entry)?;
        weight = (TOO_LOUD - high) as u8;
    }
    if high > LOUD {
        let by_low = gap(Gain::Low, low, &entry)?;
        // In the range of both gains, the result blends from one to the other.
        let sum =
            u16::from(between) * u16::from(weight) + u16::from(by_low) * u16::from(BOTH - weight);
        between = (sum / u16::from(BOTH)) as u8;
    }
    Some(TOUCHING + between)
}

/// Returns the gap between the rims from one table, at most 222 mm.
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
    // Readings have 10 bits, so the products stay within 16.
    let fall = before as i16 - at as i16;
    let along = (10 * (at as i16 - reading as i16)).checked_div(2 * fall)?;
    let gap = STEP * i16::from(index) + along;
    Some(gap.clamp(0, i16::from(u8::MAX - TOUCHING)) as u8)
}
