//! Values of log variables and parameters, and their types on the wire.

/// A number of a log variable or parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    Unsigned(u32),
    Signed(i32),
    Float(f32),
}

impl Value {
    /// Returns the value as a number with a fraction; whole numbers beyond 2^24 are rounded.
    pub fn as_f32(self) -> f32 {
        match self {
            Value::Unsigned(number) => number as f32,
            Value::Signed(number) => number as f32,
            Value::Float(number) => number,
        }
    }
}

impl From<bool> for Value {
    fn from(flag: bool) -> Self {
        Value::Unsigned(u32::from(flag))
    }
}

impl From<u8> for Value {
    fn from(number: u8) -> Self {
        Value::Unsigned(number.into())
    }
}

impl From<u16> for Value {
    fn from(number: u16) -> Self {
        Value::Unsigned(number.into())
    }
}

impl From<u32> for Value {
    fn from(number: u32) -> Self {
        Value::Unsigned(number)
    }
}

impl From<i8> for Value {
    fn from(number: i8) -> Self {
        Value::Signed(number.into())
    }
}

impl From<i16> for Value {
    fn from(number: i16) -> Self {
        Value::Signed(number.into())
    }
}

impl From<i32> for Value {
    fn from(number: i32) -> Self {
        Value::Signed(number)
    }
}

impl From<f32> for Value {
    fn from(number: f32) -> Self {
        Value::Float(number)
    }
}

/// A type of numbers on the wire. Ports of logs and of parameters number them differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WireType {
    U8,
    U16,
    U32,
    I8,
    I16,
    I32,
    F32,
    /// binary16, which only logs have.
    F16,
}

impl WireType {
    /// All types, in the order of their numbers in logs.
    pub const ALL: [WireType; 8] = [
        WireType::U8,
        WireType::U16,
        WireType::U32,
        WireType::I8,
        WireType::I16,
        WireType::I32,
        WireType::F32,
        WireType::F16,
    ];

    /// Returns the number of bytes.
    pub const fn bytes(self) -> usize {
        match self {
            WireType::U8 | WireType::I8 => 1,
            WireType::U16 | WireType::I16 | WireType::F16 => 2,
            WireType::U32 | WireType::I32 | WireType::F32 => 4,
        }
    }

    /// Returns the type's number in logs (log.h).
    pub const fn log_code(self) -> u8 {
        self as u8 + 1
    }

    /// Returns the type with this number in logs.
    pub fn of_log(code: u8) -> Option<Self> {
        WireType::ALL.into_iter().find(|wire| wire.log_code() == code)
    }

    /// Returns the type's bits in the table of parameters: size, float, unsigned (param.h).
    pub const fn parameter_code(self) -> u8 {
        match self {
            WireType::U8 => 0x08,
            WireType::U16 => 0x09,
            WireType::U32 => 0x0a,
            WireType::I8 => 0x00,
            WireType::I16 => 0x01,
            WireType::I32 => 0x02,
            WireType::F16 => 0x05,
            WireType::F32 => 0x06,
        }
    }

    /// Writes a value, least significant byte first; the first [`Self::bytes`] count. A number that
    /// the type cannot hold becomes the nearest one that it can.
    pub fn encode(self, value: Value) -> [u8; 4] {
        match self {
            WireType::U8 => wide(clamped(value, 0, u8::MAX.into())),
            WireType::U16 => wide(clamped(value, 0, u16::MAX.into())),
            WireType::U32 => wide(clamped(value, 0, u32::MAX.into())),
            WireType::I8 => wide(clamped(value, i8::MIN.into(), i8::MAX.into())),
            WireType::I16 => wide(clamped(value, i16::MIN.into(), i16::MAX.into())),
            WireType::I32 => wide(clamped(value, i32::MIN.into(), i32::MAX.into())),
            WireType::F32 => value.as_f32().to_le_bytes(),
            WireType::F16 => {
                let [low, high] = half(value.as_f32()).to_le_bytes();
                [low, high, 0, 0]
            }
        }
    }

    /// Reads a value from exactly [`Self::bytes`] bytes.
    pub fn decode(self, bytes: &[u8]) -> Option<Value> {
        Some(match (self, bytes) {
            (WireType::U8, [a]) => Value::from(*a),
            (WireType::U16, [a, b]) => Value::from(u16::from_le_bytes([*a, *b])),
            (WireType::U32, [a, b, c, d]) => Value::from(u32::from_le_bytes([*a, *b, *c, *d])),
            (WireType::I8, [a]) => Value::from(i8::from_le_bytes([*a])),
            (WireType::I16, [a, b]) => Value::from(i16::from_le_bytes([*a, *b])),
            (WireType::I32, [a, b, c, d]) => Value::from(i32::from_le_bytes([*a, *b, *c, *d])),
            (WireType::F32, [a, b, c, d]) => Value::from(f32::from_le_bytes([*a, *b, *c, *d])),
            _ => return None,
        })
    }
}

/// Returns the lowest bytes of a number in two's complement.
fn wide(number: i64) -> [u8; 4] {
    (number as u32).to_le_bytes()
}

/// Returns the whole number of a value, without its fraction, in these limits; 0 if it is none.
fn clamped(value: Value, least: i64, most: i64) -> i64 {
    let number = match value {
        Value::Unsigned(number) => number.into(),
        Value::Signed(number) => number.into(),
        // `as` saturates, and converts NaN to 0.
        Value::Float(number) => number as i64,
    };
    number.max(least).min(most)
}

/// Returns the nearest binary16, of two equally near ones the even one.
fn half(number: f32) -> u16 {
    let bits = number.to_bits();
    let sign = (bits >> 16) as u16 & 0x8000;
    let magnitude = bits & 0x7fff_ffff;
    let rounded = if magnitude > 0x7f80_0000 {
        0x7e00
    } else if magnitude >= 0x4780_0000 {
        // 65,536 and more.
        0x7c00
    } else if magnitude >= 0x3880_0000 {
        // Normal numbers: the exponent's bias falls from 127 to 15, and 13 bits of the fraction go.
        rounded_shift(magnitude - (112 << 23), 13)
    } else if magnitude >= 0x3300_0000 {
        // Below 2^-14 the last bit is worth 2^-24.
        let fraction = magnitude & 0x007f_ffff | 0x0080_0000;
        rounded_shift(fraction, 126 - (magnitude >> 23))
    } else {
        0
    };
    sign | rounded as u16
}

/// Shifts right by 1 to 31 bits and rounds half to even.
fn rounded_shift(number: u32, shift: u32) -> u32 {
    let kept = number >> shift;
    let rest = number & ((1 << shift) - 1);
    let middle = 1 << (shift - 1);
    let is_up = rest > middle || rest == middle && kept & 1 == 1;
    kept + u32::from(is_up)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the value of a binary16 by its definition (IEEE 754, 3.4).
    fn of_half(bits: u16) -> f64 {
        let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
        let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
        sign * match exponent {
            0 => fraction * libm::exp2(-24.0),
            31 if fraction == 0.0 => f64::INFINITY,
            31 => f64::NAN,
            _ => (1024.0 + fraction) * libm::exp2(f64::from(exponent - 25)),
        }
    }

    #[test]
    fn each_binary16_stays() {
        for bits in 0..=u16::MAX {
            let number = of_half(bits) as f32;
            if number.is_nan() {
                assert_eq!(half(number) & 0x7fff, 0x7e00);
            } else {
                assert_eq!(half(number), bits, "{number}");
            }
        }
    }

    #[test]
    fn numbers_between_two_binary16_become_the_nearer() {
        for bits in 0..0x7bff {
            let (below, above) = (of_half(bits), of_half(bits + 1));
            let middle = (below + above) / 2.0;
            let even = if bits & 1 == 0 { bits } else { bits + 1 };
            // The middle has one bit more than a binary16, so a binary32 holds it.
            assert_eq!(half(middle as f32), even);
            assert_eq!(half((middle as f32).next_down()), bits);
            assert_eq!(half((middle as f32).next_up()), bits + 1);
        }
        assert_eq!(half(65_519.0), 0x7bff);
        assert_eq!(half(65_520.0), 0x7c00);
        assert_eq!(half(f32::MIN), 0xfc00);
        assert_eq!(half(1e-30), 0);
    }

    #[test]
    fn whole_numbers_saturate() {
        let number = |wire: WireType, value: f32| wire.encode(value.into());
        assert_eq!(number(WireType::U8, 300.9), [255, 0, 0, 0]);
        assert_eq!(number(WireType::U8, -1.0), [0; 4]);
        assert_eq!(number(WireType::U8, f32::NAN), [0; 4]);
        assert_eq!(number(WireType::I8, -300.0)[0], 0x80);
        assert_eq!(number(WireType::I16, -1.9)[..2], [0xff, 0xff]);
        assert_eq!(number(WireType::I16, f32::INFINITY)[..2], [0xff, 0x7f]);
        assert_eq!(number(WireType::U32, 1e20), [0xff; 4]);
        assert_eq!(number(WireType::I32, -1e20), [0, 0, 0, 0x80]);
        assert_eq!(WireType::I32.encode(Value::Unsigned(u32::MAX)), [0xff, 0xff, 0xff, 0x7f]);
        assert_eq!(WireType::U32.encode(Value::Signed(-1)), [0; 4]);
    }

    #[test]
    fn what_was_written_can_be_read() {
        let values = [
            (WireType::U8, Value::from(200_u8)),
            (WireType::U16, Value::from(60_000_u16)),
            (WireType::U32, Value::from(4_000_000_000_u32)),
            (WireType::I8, Value::from(-100_i8)),
            (WireType::I16, Value::from(-30_000_i16)),
            (WireType::I32, Value::from(-2_000_000_000)),
            (WireType::F32, Value::from(-1.5_f32)),
        ];
        for (wire, value) in values {
            let bytes = wire.encode(value);
            assert_eq!(wire.decode(&bytes[..wire.bytes()]), Some(value));
            assert_eq!(wire.decode(&bytes[1..wire.bytes()]), None);
            assert_eq!(WireType::of_log(wire.log_code()), Some(wire));
        }
        assert_eq!((WireType::of_log(0), WireType::of_log(9)), (None, None));
    }
}
