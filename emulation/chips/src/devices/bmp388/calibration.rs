//! The calibration of the sensor, and raw values from true ones.
//!
//! The polynomials and the scales of their coefficients are those of Bosch's BMP3-Sensor-API
//! (parse_calib_data, compensate_temperature, compensate_pressure).

/// Registers NVM_PAR_T1 to NVM_PAR_P11.
pub(super) const CALIBRATION_BYTES: usize = 21;
/// The largest raw value.
const RAW_MAX: u32 = 0x00ff_ffff;

/// The coefficients in physical units.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Calibration {
    t1: f64,
    t2: f64,
    t3: f64,
    /// Offset of the pressure, as a polynomial in the temperature.
    offset: [f64; 4],
    /// Sensitivity of the pressure, as a polynomial in the temperature.
    sensitivity: [f64; 4],
    /// Factor of the raw pressure's square, as a polynomial in the temperature.
    square: [f64; 2],
    /// Factor of the raw pressure's cube.
    cube: f64,
}

impl Calibration {
    pub(super) fn new(bytes: &[u8; CALIBRATION_BYTES]) -> Self {
        let byte = |at: usize| f64::from(bytes[at].cast_signed());
        let unsigned = |at: usize| f64::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
        let signed = |at: usize| f64::from(i16::from_le_bytes([bytes[at], bytes[at + 1]]));
        let power = |exponent: i32| 2.0_f64.powi(exponent);
        Calibration {
            t1: unsigned(0) * power(8),
            t2: unsigned(2) * power(-30),
            t3: byte(4) * power(-48),
            sensitivity: [
                (signed(5) - 16_384.0) * power(-20),
                (signed(7) - 16_384.0) * power(-29),
                byte(9) * power(-32),
                byte(10) * power(-37),
            ],
            offset: [
                unsigned(11) * power(3),
                unsigned(13) * power(-6),
                byte(15) * power(-8),
                byte(16) * power(-15),
            ],
            square: [signed(17) * power(-48), byte(19) * power(-48)],
            cube: byte(20) * power(-65),
        }
    }

    fn temperature_c(&self, raw: u32) -> f64 {
        let difference = f64::from(raw) - self.t1;
        difference * self.t2 + difference * difference * self.t3
    }

    fn pressure_pa(&self, raw: u32, temperature_c: f64) -> f64 {
        let raw = f64::from(raw);
        polynomial(&self.offset, temperature_c)
            + raw * polynomial(&self.sensitivity, temperature_c)
            + raw * raw * polynomial(&self.square, temperature_c)
            + raw * raw * raw * self.cube
    }

    /// Returns the raw temperature.
    pub(super) fn raw_temperature(&self, temperature_c: f64) -> u32 {
        inverse(temperature_c, |raw| self.temperature_c(raw))
    }

    /// Returns the raw pressure.
    pub(super) fn raw_pressure(&self, pressure_pa: f64, temperature_c: f64) -> u32 {
        inverse(pressure_pa, |raw| self.pressure_pa(raw, temperature_c))
    }
}

/// Returns the checksum of the calibration: CRC-8 with the polynomial 0x1d (bmp3_selftest.c of
/// Bosch's driver).
pub(super) fn crc(bytes: &[u8]) -> u8 {
    !bytes.iter().fold(0xff, |crc: u8, byte| {
        (0..8).fold(crc ^ *byte, |crc, _| crc << 1 ^ if crc & 0x80 != 0 { 0x1d } else { 0 })
    })
}

/// Returns the value of a polynomial, whose constant comes first.
fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

/// Returns the raw value at which a monotonic function has this value, by bisection.
fn inverse(value: f64, function: impl Fn(u32) -> f64) -> u32 {
    let is_rising = function(RAW_MAX) > function(0);
    let (mut low, mut high) = (0, RAW_MAX);
    while low < high {
        let middle = low.midpoint(high);
        if (function(middle) < value) == is_rising {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A raw measurement of a BMP390 with its calibration, and both quantities as computed by the
    /// crate bmp390 0.4.3, whose tests contain these figures.
    #[test]
    fn raw_values_are_those_of_a_real_chip() {
        let calibration = Calibration::new(&super::super::CALIBRATION_OF_A_BMP390);
        let raw_temperature = calibration.raw_temperature(25.770_746);
        assert!(raw_temperature.abs_diff(0x82_bad1) <= 1, "{raw_temperature:x}");
        let raw_pressure = calibration.raw_pressure(98_370.55, 25.770_746);
        assert!(raw_pressure.abs_diff(0x6b_b3cb) <= 2, "{raw_pressure:x}");
    }

    /// The check value of this algorithm in the catalog of CRCs (CRC-8/SAE-J1850).
    #[test]
    fn the_checksum_has_its_check_value() {
        assert_eq!(crc(b"123456789"), 0x4b);
    }

    #[test]
    fn values_beyond_the_range_of_the_converter_saturate() {
        let calibration = Calibration::new(&super::super::CALIBRATION_OF_A_BMP390);
        assert_eq!(calibration.raw_pressure(1e9, 20.0), 0);
        assert_eq!(calibration.raw_temperature(1e9), RAW_MAX);
    }
}
