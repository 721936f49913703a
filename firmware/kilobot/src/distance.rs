//! How far away the sender of a message is, by the two amplitudes of its first pulses.

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

/// What a receiver without a smaller reading in its table for the low gain takes for the gap, mm.
const FAR: u8 = 90;

/// Readings of the analog converter, 0 to 1023.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Amplitudes {
    /// Of the first pulse.
    pub high_gain: u16,
    /// Of the second.
    pub low_gain: u16,
}

/// The distance between the middles of two robots in mm. The functions give the entries of the robot's two tables. `None` if the
/// tables do not fall: the robot was never calibrated.
///
/// As kilolib's `estimate_distance`, but with signed numbers: between two entries along the line through them, beyond
/// the last along the last two.
pub fn distance(
    heard: Amplitudes,
    high_gain: impl Fn(u8) -> u16,
    low_gain: impl Fn(u8) -> u16,
) -> Option<u8> {
    let Amplitudes { high_gain: high, low_gain: low } = heard;
    let by_high = match high < TOO_LOUD {
        true => Some(gap(high, &high_gain, None)?),
        false => None,
    };
    let by_low = match high > LOUD {
        true => Some(gap(low, &low_gain, Some(FAR))?),
        false => None,
    };
    let gap = match (by_high, by_low) {
        (Some(by_high), Some(by_low)) => {
            let weight = high - LOUD;
            let sum = u16::from(by_high) * (TOO_LOUD - LOUD - weight) + u16::from(by_low) * weight;
            (sum / (TOO_LOUD - LOUD)) as u8
        }
        (Some(gap), None) | (None, Some(gap)) => gap,
        // At least one of the ranges holds.
        (None, None) => return None,
    };
    Some(TOUCHING + gap)
}

/// The gap between the rims by one table, at most 222 mm. `beyond` is the answer where no entry is below.
fn gap(reading: u16, entry: &impl Fn(u8) -> u16, beyond: Option<u8>) -> Option<u8> {
    let reading = reading.min(READING_MAX);
    if reading > entry(0) {
        return Some(0);
    }
    if entry(0) > READING_MAX {
        return None;
    }
    let below = (1..ENTRIES).find(|index| reading > entry(*index));
    let index = match (below, beyond) {
        (Some(index), _) => index,
        (None, Some(gap)) => return Some(gap),
        (None, None) => ENTRIES - 1,
    };
    let (at, before) = (entry(index), entry(index - 1));
    if at >= before || before > READING_MAX {
        return None;
    }
    // Readings have 10 bits: the products stay within 16.
    let (at, before) = (at as i16, before as i16);
    let fall = at - before;
    let along = (10 * (reading as i16 - at)).checked_div(2 * fall)?;
    let gap = STEP * i16::from(index) + along;
    Some(gap.clamp(0, i16::from(u8::MAX - TOUCHING)) as u8)
}
