//! The strength of a neighbor's light at a distance, and the decoder of pulses.

/// The diameter of a Kilobot in mm.
pub const DIAMETER_MM: f64 = 33.0;
/// The distance between entries of a calibration table in mm; the first entry is for two robots in
/// contact.
const TABLE_STEP_MM: f64 = 5.0;
const TABLE_LENGTH: usize = 14;
/// The converter's largest reading.
const READING_MAX: u16 = 1023;

// Neither a factory table nor the distance that light travels from the table's surface was found in
// the sources. This model is a choice. The light falls with the square of the distance from a point
// below the sender. At the low gain, contact gives nearly the converter's full range; the high gain
// is seven times as much, so that both gains overlap where kilolib switches between them (readings
// of 700 to 900 at the high gain).
const DEPTH_MM: f64 = 25.0;
const LOW_AT_TOUCH: f64 = 900.0;
const HIGH_BY_LOW: f64 = 7.0;

/// The converter's readings during a pulse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Amplitude {
    /// Reading of ADC0, at the high gain.
    pub high: u16,
    /// Reading of ADC1, at the low gain.
    pub low: u16,
}

impl Amplitude {
    /// Returns the amplitude of a sender whose center is `distance_mm` away.
    pub fn at(distance_mm: f64) -> Self {
        let gap = (distance_mm - DIAMETER_MM).max(-DIAMETER_MM / 2.0);
        let low = LOW_AT_TOUCH / (1.0 + gap / DEPTH_MM).powi(2);
        let reading = |value: f64| (value.round() as u16).min(READING_MAX);
        Amplitude { high: reading(HIGH_BY_LOW * low), low: reading(low) }
    }

    /// Returns the amplitude of two lights that are on at once.
    pub fn plus(self, other: Self) -> Self {
        Amplitude {
            high: (self.high + other.high).min(READING_MAX),
            low: (self.low + other.low).min(READING_MAX),
        }
    }
}

/// Returns the tables that calibration writes to the EEPROM, for the low and for the high gain. The
/// entries are big-endian.
pub fn tables() -> [[u8; 2 * TABLE_LENGTH]; 2] {
    let entry = |n: usize| Amplitude::at(DIAMETER_MM + TABLE_STEP_MM * n as f64);
    [|a: Amplitude| a.low, |a: Amplitude| a.high]
        .map(|gain| std::array::from_fn(|byte| gain(entry(byte / 2)).to_be_bytes()[byte % 2]))
}

/// Nominal number of cycles per bit (kilolib, message_send.S; measured).
const BIT: u64 = 269;
/// Position of the stop bit, in bits after the start bit. The data bits are at 1 to 8.
const STOP: u64 = 9;
/// Bytes of a frame after the leading one: 9 of data, the type, and 2 of the checksum.
const BYTES: usize = 12;
/// Cycles without a pulse that end a burst: longer than from a start bit to its stop bit.
const SILENCE: u64 = 12 * BIT;

/// An event that a pulse completes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PulseOutcome {
    /// A burst begins.
    Begin,
    /// A frame: data, type and checksum, and the cycle at which its burst began.
    Frame([u8; BYTES], u64),
    /// The burst is no frame.
    Broken,
}

/// A decoder that reads frames from the times of pulses.
#[derive(Clone, Debug, Default)]
pub struct PulseDecoder {
    /// The cycles of the first and of the last pulse of the burst.
    burst: Option<[u64; 2]>,
    /// The cycle of the current byte's start bit; `None` between bytes.
    start: Option<u64>,
    byte: u8,
    bytes: [u8; BYTES],
    /// Bytes received after the leading one.
    count: Option<usize>,
    is_broken: bool,
}

impl PulseDecoder {
    /// Handles a pulse that begins at `cycle`.
    pub fn pulse(&mut self, cycle: u64) -> Option<PulseOutcome> {
        let Some([begin, _]) = self.burst.filter(|[_, last]| cycle - last <= SILENCE) else {
            *self = PulseDecoder {
                burst: Some([cycle, cycle]),
                start: Some(cycle),
                ..PulseDecoder::default()
            };
            return Some(PulseOutcome::Begin);
        };
        self.burst = Some([begin, cycle]);
        if self.is_broken {
            return None;
        }
        let Some(start) = self.start else {
            (self.start, self.byte) = (Some(cycle), 0);
            return None;
        };
        match (cycle - start + BIT / 2) / BIT {
            bit @ 1..STOP => self.byte |= 1 << (bit - 1),
            STOP => {
                self.start = None;
                let Some(count) = self.count else {
                    self.count = Some(0);
                    if self.byte == 0 {
                        return None;
                    }
                    self.is_broken = true;
                    return Some(PulseOutcome::Broken);
                };
                self.bytes[count] = self.byte;
                self.count = Some(count + 1);
                if count + 1 == BYTES {
                    self.burst = None;
                    return Some(PulseOutcome::Frame(self.bytes, begin));
                }
            }
            _ => {
                self.is_broken = true;
                return Some(PulseOutcome::Broken);
            }
        }
        None
    }

    /// Returns true if a burst is under way at `cycle`.
    pub fn is_busy(&self, cycle: u64) -> bool {
        self.burst.is_some_and(|[_, last]| cycle - last <= SILENCE)
    }
}

/// Returns the checksum at the end of a frame: CRC-16/MCRF4XX of data and type, low byte first.
pub fn infrared_checksum(frame: &[u8; BYTES]) -> [u8; 2] {
    let bit = |crc: u16, _| crc >> 1 ^ if crc & 1 != 0 { 0x8408 } else { 0 };
    let byte = |crc: u16, byte: &u8| (0..8).fold(crc ^ u16::from(*byte), bit);
    frame[..10].iter().fold(0xffff_u16, byte).to_le_bytes()
}

/// Returns true if a frame's checksum is right.
pub fn is_intact(frame: &[u8; BYTES]) -> bool {
    frame[10..] == infrared_checksum(frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_fall_and_the_gains_overlap() {
        let [low, high] = tables().map(|table| {
            let entries = table.chunks_exact(2).map(|e| u16::from_be_bytes([e[0], e[1]]));
            entries.collect::<Vec<_>>()
        });
        assert!(low.windows(2).all(|pair| pair[0] > pair[1]), "{low:?}");
        assert!(high.windows(2).all(|pair| pair[0] >= pair[1]), "{high:?}");
        assert_eq!((low[0], high[0]), (900, 1023));
        assert!(high[13] > 400 && high.iter().any(|e| (700..900).contains(e)), "{high:?}");
    }

    #[test]
    fn checksums_agree_with_kilolib() {
        // "9 x FF, type 0" and "9 x 00, type 0x88".
        for (data, kind, crc) in [(0xff, 0, 0x881d_u16), (0, 0x88, 0x94c7)] {
            let mut frame = [data; 12];
            frame[9] = kind;
            frame[10..].copy_from_slice(&crc.to_le_bytes());
            assert!(is_intact(&frame));
            frame[3] ^= 1;
            assert!(!is_intact(&frame));
        }
    }

    /// Returns the pulses of a frame with the intervals that were measured on kilolib.
    fn pulses(frame: &[u8; 12]) -> Vec<u64> {
        let mut pulses = vec![1000, 1000 + 2420];
        let mut start = 1000 + 2420 + 286;
        for byte in frame {
            pulses.push(start);
            pulses.extend(
                (0..8).filter(|bit| byte >> bit & 1 != 0).map(|bit| start + 270 * (bit + 1)),
            );
            pulses.push(start + 270 * 9);
            start += 270 * 9 + 282;
        }
        pulses
    }

    #[test]
    fn frames_are_read_from_pulses() {
        let frame = [0, 1, 0x80, 0xff, 0x55, 0xaa, 7, 8, 9, 0, 0x12, 0x34];
        let mut decoder = PulseDecoder::default();
        for _ in 0..2 {
            let received: Vec<_> =
                pulses(&frame).into_iter().filter_map(|cycle| decoder.pulse(cycle)).collect();
            assert_eq!(received, [PulseOutcome::Begin, PulseOutcome::Frame(frame, 1000)]);
            decoder = PulseDecoder::default();
        }
        // A clock error of half a bit over a byte, 5.6 %, is too much.
        let mut slow = PulseDecoder::default();
        let stretched = pulses(&frame).into_iter().map(|cycle| cycle * 1070 / 1000);
        let received: Vec<_> = stretched.filter_map(|cycle| slow.pulse(cycle)).collect();
        assert_ne!(received.last(), Some(&PulseOutcome::Frame(frame, 1070)));
    }

    #[test]
    fn overlapping_senders_give_no_frame() {
        let frame = [0x55; 12];
        let mut both = pulses(&frame);
        both.extend(pulses(&frame).into_iter().map(|cycle| cycle + 700));
        both.sort_unstable();
        let mut decoder = PulseDecoder::default();
        let received: Vec<_> = both.into_iter().filter_map(|cycle| decoder.pulse(cycle)).collect();
        assert_eq!(received, [PulseOutcome::Begin, PulseOutcome::Broken]);
    }
}
