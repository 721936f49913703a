//! The fields of a packet, in their order, least significant byte first.

use crate::refusal::Refusal;

/// The largest coordinate of a plausible position, in m.
const COORDINATE_MAX_M: f32 = 1000.0;
/// The largest plausible speed, in m/s.
const SPEED_MAX_M_S: f32 = 100.0;
/// The largest plausible angle, in radians: sixteen turns.
const ANGLE_MAX_RAD: f32 = 100.0;
/// The largest plausible rate of turn, in rad/s.
const RATE_MAX_RAD_S: f32 = 100.0;
/// The longest plausible duration, in s.
const DURATION_MAX_S: f32 = 3600.0;

/// The fields that were not read yet.
pub(crate) struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub fn new(data: &'a [u8]) -> Self {
        Fields { rest: data }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Refusal> {
        let (field, rest) = self.rest.split_first_chunk().ok_or(Refusal::Length)?;
        self.rest = rest;
        Ok(*field)
    }

    pub fn byte(&mut self) -> Result<u8, Refusal> {
        self.take().map(|[byte]| byte)
    }

    /// Returns true for each byte but 0, as C does.
    pub fn flag(&mut self) -> Result<bool, Refusal> {
        self.byte().map(|byte| byte != 0)
    }

    pub fn u16(&mut self) -> Result<u16, Refusal> {
        self.take().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Result<u32, Refusal> {
        self.take().map(u32::from_le_bytes)
    }

    /// Returns a whole number of thousandths, such as mm, in the unit itself.
    pub fn thousandths(&mut self) -> Result<f32, Refusal> {
        self.take().map(|bytes| f32::from(i16::from_le_bytes(bytes)) / 1000.0)
    }

    /// Returns a number that is finite.
    pub fn number(&mut self) -> Result<f32, Refusal> {
        let number = self.take().map(f32::from_le_bytes)?;
        if number.is_finite() { Ok(number) } else { Err(Refusal::NotFinite) }
    }

    fn up_to(&mut self, most: f32, convert: fn(f32) -> f32) -> Result<f32, Refusal> {
        let number = convert(self.number()?);
        if (-most..=most).contains(&number) { Ok(number) } else { Err(Refusal::OutOfRange) }
    }

    /// Returns a coordinate or a distance in m.
    pub fn meters(&mut self) -> Result<f32, Refusal> {
        self.up_to(COORDINATE_MAX_M, |number| number)
    }

    pub fn meters_per_second(&mut self) -> Result<f32, Refusal> {
        self.up_to(SPEED_MAX_M_S, |number| number)
    }

    pub fn radians(&mut self) -> Result<f32, Refusal> {
        self.up_to(ANGLE_MAX_RAD, |number| number)
    }

    /// Returns an angle in radians from one in degrees.
    pub fn degrees(&mut self) -> Result<f32, Refusal> {
        self.up_to(ANGLE_MAX_RAD, f32::to_radians)
    }

    /// Returns a rate in rad/s from one in degrees per second.
    pub fn degrees_per_second(&mut self) -> Result<f32, Refusal> {
        self.up_to(RATE_MAX_RAD_S, f32::to_radians)
    }

    /// Returns a duration in s, which is not negative.
    pub fn seconds(&mut self) -> Result<f32, Refusal> {
        let duration_s = self.up_to(DURATION_MAX_S, |number| number)?;
        if duration_s >= 0.0 { Ok(duration_s) } else { Err(Refusal::OutOfRange) }
    }

    /// Returns three fields of the same kind.
    pub fn three(
        &mut self,
        field: fn(&mut Self) -> Result<f32, Refusal>,
    ) -> Result<[f32; 3], Refusal> {
        Ok([field(self)?, field(self)?, field(self)?])
    }

    /// Returns the bytes after the fields that were read.
    pub fn rest(self) -> &'a [u8] {
        self.rest
    }

    /// Refuses data after the last field.
    pub fn end(self) -> Result<(), Refusal> {
        if self.rest.is_empty() { Ok(()) } else { Err(Refusal::Length) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a field of this kind from a number.
    macro_rules! read {
        ($kind:ident, $value:expr) => {
            Fields::new(&f32::to_le_bytes($value)).$kind()
        };
    }

    #[test]
    fn limits_of_numbers() {
        macro_rules! check {
            ($kind:ident, $most:literal) => {
                let most: f32 = $most;
                assert_eq!(read!($kind, most), Ok(most));
                assert_eq!(read!($kind, most.next_up()), Err(Refusal::OutOfRange));
                assert_eq!(read!($kind, f32::MIN), Err(Refusal::OutOfRange));
                for wrong in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                    assert_eq!(read!($kind, wrong), Err(Refusal::NotFinite));
                }
            };
        }
        check!(meters, 1000.0);
        check!(meters_per_second, 100.0);
        check!(radians, 100.0);
        check!(seconds, 3600.0);
        assert_eq!(read!(seconds, -1e-30), Err(Refusal::OutOfRange));
        assert_eq!(read!(degrees, f32::MAX), Err(Refusal::OutOfRange));
        assert_eq!(read!(degrees, 180.0), Ok(core::f32::consts::PI));
        assert_eq!(read!(degrees_per_second, 5730.0), Err(Refusal::OutOfRange));
    }

    #[test]
    fn lengths_are_exact() {
        let mut fields = Fields::new(&[1, 2]);
        assert_eq!(fields.byte(), Ok(1));
        assert_eq!(fields.u16(), Err(Refusal::Length));
        assert_eq!(fields.end(), Err(Refusal::Length));
        assert_eq!(Fields::new(&[]).end(), Ok(()));
    }
}
