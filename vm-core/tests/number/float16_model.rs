//! An exact model of the 16-bit float in integers: what each operation would give if it were
//! computed without any rounding, and then rounded once.

use std::cmp::Ordering;

use bittybuzz_vm_core::number::{F16, operation};

const NAN: u16 = 0x7F00;
const INFINITY: u16 = 0x7E00;

/// What the bits of a 16-bit float mean. A number is `significand * 2^exponent`.
#[derive(Clone, Copy, PartialEq)]
enum Class {
    NotANumber,
    Infinite,
    Zero,
    Number { significand: i128, exponent: i32 },
}

fn classify(bits: u16) -> Class {
    let fraction = i128::from(bits & 511);
    match i32::from(bits >> 9 & 63) {
        0 => Class::Zero,
        63 if fraction == 0 => Class::Infinite,
        63 => Class::NotANumber,
        field => Class::Number { significand: 512 + fraction, exponent: field - 31 - 9 },
    }
}

fn is_negative(bits: u16) -> bool {
    bits & 0x8000 != 0
}

fn with_sign(negative: bool, bits: u16) -> u16 {
    if negative { bits | 0x8000 } else { bits }
}

/// Rounds `significand * 2^exponent`, plus something positive and smaller than the last bit if
/// `more`, to the nearest 16-bit float without a sign.
pub fn round(significand: u128, exponent: i32, more: bool) -> u16 {
    if significand == 0 {
        assert!(!more);
        return 0;
    }
    let excess = 128 - significand.leading_zeros() as i32 - 10;
    let (mut kept, mut exponent) = (significand, exponent);
    if excess <= 0 {
        assert!(!more, "not enough bits to round");
        kept <<= -excess;
    } else {
        kept >>= excess;
        let rest = significand - (kept << excess);
        let up = match rest.cmp(&(1 << (excess - 1))) {
            Ordering::Less => false,
            Ordering::Equal => more || kept % 2 == 1,
            Ordering::Greater => true,
        };
        kept += u128::from(up);
    }
    exponent += excess;
    if kept == 1024 {
        kept = 512;
        exponent += 1;
    }
    match exponent + 9 {
        small if small < -30 => 0,
        large if large > 31 => INFINITY,
        usual => (((usual + 31) as u16) << 9) | (kept - 512) as u16,
    }
}

/// The nearest 16-bit float of a binary32.
pub fn from_f32(value: f32) -> u16 {
    let bits = value.to_bits();
    let fraction = u128::from(bits & 0x7F_FFFF);
    let magnitude = match (bits >> 23 & 255) as i32 {
        0 => round(fraction, -126 - 23, false),
        255 if fraction == 0 => INFINITY,
        255 => return NAN,
        field => round(0x80_0000 + fraction, field - 127 - 23, false),
    };
    with_sign(value.is_sign_negative(), magnitude)
}

fn add(a: u16, b: u16) -> u16 {
    match (classify(a), classify(b)) {
        (Class::NotANumber, _) | (_, Class::NotANumber) => NAN,
        (Class::Infinite, Class::Infinite) if is_negative(a) != is_negative(b) => NAN,
        (Class::Infinite, _) => a,
        (_, Class::Infinite) => b,
        (Class::Zero, Class::Zero) => with_sign(is_negative(a) && is_negative(b), 0),
        (Class::Zero, _) => b,
        (_, Class::Zero) => a,
        (
            Class::Number { significand: p, exponent: e },
            Class::Number { significand: q, exponent: f },
        ) => {
            let low = e.min(f);
            let p = (if is_negative(a) { -p } else { p }) << (e - low);
            let q = (if is_negative(b) { -q } else { q }) << (f - low);
            with_sign(p + q < 0, round((p + q).unsigned_abs(), low, false))
        }
    }
}

fn mul(a: u16, b: u16) -> u16 {
    let magnitude = match (classify(a), classify(b)) {
        (Class::NotANumber, _) | (_, Class::NotANumber) => return NAN,
        (Class::Infinite, Class::Zero) | (Class::Zero, Class::Infinite) => return NAN,
        (Class::Infinite, _) | (_, Class::Infinite) => INFINITY,
        (Class::Zero, _) | (_, Class::Zero) => 0,
        (
            Class::Number { significand: p, exponent: e },
            Class::Number { significand: q, exponent: f },
        ) => round((p * q) as u128, e + f, false),
    };
    with_sign(is_negative(a) != is_negative(b), magnitude)
}

fn div(a: u16, b: u16) -> u16 {
    let magnitude = match (classify(a), classify(b)) {
        (Class::NotANumber, _) | (_, Class::NotANumber) => return NAN,
        (Class::Infinite, Class::Infinite) | (Class::Zero, Class::Zero) => return NAN,
        (Class::Infinite, _) | (_, Class::Zero) => INFINITY,
        (Class::Zero, _) | (_, Class::Infinite) => 0,
        (
            Class::Number { significand: p, exponent: e },
            Class::Number { significand: q, exponent: f },
        ) => {
            let p = p << 20;
            round((p / q) as u128, e - f - 20, p % q != 0)
        }
    };
    with_sign(is_negative(a) != is_negative(b), magnitude)
}

/// The correctly rounded sum, difference, product and quotient.
pub fn expected(a: u16, b: u16) -> [u16; 4] {
    let minus_b = if classify(b) == Class::NotANumber { b } else { b ^ 0x8000 };
    [add(a, b), add(a, minus_b), mul(a, b), div(a, b)]
}

/// The same four as the virtual machine computes them.
pub fn computed(a: u16, b: u16) -> [u16; 4] {
    let (x, y) = (F16(a).unpack(), F16(b).unpack());
    [operation::ADD, operation::SUB, operation::MUL, operation::DIV].map(|operation| {
        let mut result = x;
        result.operate(operation, &y);
        F16::pack(&result).0
    })
}

/// The order of the two numbers; `None` if one is NaN.
pub fn expected_order(a: u16, b: u16) -> Option<Ordering> {
    // Numbers are ordered like their magnitudes' bits.
    let key = |bits: u16| match classify(bits) {
        Class::NotANumber => None,
        Class::Zero => Some(0),
        _ if is_negative(bits) => Some(-i32::from(bits & 0x7FFF)),
        _ => Some(i32::from(bits)),
    };
    Some(key(a)?.cmp(&key(b)?))
}

/// The same as the virtual machine computes it.
pub fn computed_order(a: u16, b: u16) -> Option<Ordering> {
    F16(a).unpack().compare(&F16(b).unpack())
}
