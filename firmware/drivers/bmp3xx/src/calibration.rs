//! The calibration of a chip, and the conversion of counts by it.

/// The number of bytes of the calibration.
pub const CALIBRATION_BYTES: usize = 21;

/// A count of 24 bits for the pressure, and one for the temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BarometerCounts {
    pub pressure: u32,
    pub temperature: u32,
}

/// The pressure and the temperature of the air, as the chip measures them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    pub pressure_pa: f32,
    pub temperature_celsius: f32,
}

/// The coefficients of polynomials, with the scales of the data sheet's appendix. An
/// array holds the factors of the powers of the temperature from the zeroth on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// The temperature count of about 0 °C. It has 24 bits.
    temperature_zero: u32,
    temperature: [f32; 2],
    /// The pressure in pascals, as the sum of these polynomials of the temperature times the powers
    /// of the pressure count from the zeroth on.
    pressure: [[f32; 4]; 2],
    pressure_squared: [f32; 2],
    pressure_cubed: f32,
}

impl Calibration {
    /// Reads the calibration as it stands in the chip: little-endian numbers T1 to T3 and P1 to
    /// P11.
    #[rustfmt::skip]
    pub fn new(bytes: [u8; CALIBRATION_BYTES]) -> Calibration {
        let [
            t1_low, t1_high, t2_low, t2_high, t3,
            p1_low, p1_high, p2_low, p2_high, p3, p4,
            p5_low, p5_high, p6_low, p6_high, p7, p8,
            p9_low, p9_high, p10, p11,
        ] = bytes;
        let unsigned = |low, high| f32::from(u16::from_le_bytes([low, high]));
        let signed = |low, high| f32::from(i16::from_le_bytes([low, high]));
        let short = |byte: u8| f32::from(i8::from_le_bytes([byte]));
        Calibration {
            temperature_zero: u32::from(u16::from_le_bytes([t1_low, t1_high])) << 8,
            temperature: [unsigned(t2_low, t2_high) / TWO_30, short(t3) / TWO_48],
            pressure: [
                [
                    unsigned(p5_low, p5_high) * 8.0,
                    unsigned(p6_low, p6_high) / 64.0,
                    short(p7) / 256.0,
                    short(p8) / 32_768.0,
                ],
                [
                    (signed(p1_low, p1_high) - 16_384.0) / TWO_20,
                    (signed(p2_low, p2_high) - 16_384.0) / TWO_29,
                    short(p3) / TWO_32,
                    short(p4) / TWO_37,
                ],
            ],
            pressure_squared: [signed(p9_low, p9_high) / TWO_48, short(p10) / TWO_48],
            pressure_cubed: short(p11) / TWO_65,
        }
    }

    /// Converts counts.
    pub fn air(&self, counts: BarometerCounts) -> Air {
        // Both counts have 24 bits, so single precision holds them and their difference.
        let difference = counts.temperature as f32 - self.temperature_zero as f32;
        let [linear, squared] = self.temperature;
        let celsius = difference * linear + difference * difference * squared;
        let count = counts.pressure as f32;
        let [offset, slope] = self.pressure.map(|[zeroth, first, second, third]| {
            zeroth + celsius * (first + celsius * (second + celsius * third))
        });
        let [zeroth, first] = self.pressure_squared;
        let square = zeroth + celsius * first;
        let pressure_pa = offset + count * (slope + count * (square + count * self.pressure_cubed));
        Air { pressure_pa, temperature_celsius: celsius }
    }
}

// Powers of two, exact in single precision.
const TWO_20: f32 = 1_048_576.0;
const TWO_29: f32 = 536_870_912.0;
const TWO_30: f32 = 1_073_741_824.0;
const TWO_32: f32 = 4_294_967_296.0;
const TWO_37: f32 = 137_438_953_472.0;
const TWO_48: f32 = 281_474_976_710_656.0;
const TWO_65: f32 = TWO_48 * 131_072.0;

/// Returns the checksum of the calibration: CRC-8 with the polynomial 0x1D, from all ones and
/// inverted (bmp3_selftest.c of Bosch's API), which is CRC-8/SAE-J1850.
pub fn checksum(bytes: &[u8]) -> u8 {
    const POLYNOMIAL: u8 = 0x1d;
    let crc = bytes.iter().fold(0xff, |crc: u8, byte| {
        (0..8).fold(crc ^ byte, |crc, _| {
            let shifted = crc << 1;
            if crc & 0x80 == 0 { shifted } else { shifted ^ POLYNOMIAL }
        })
    });
    !crc
}
