//! The tiny profile's float against an exact integer model.

#[cfg(feature = "maths")]
#[path = "number/binary32.rs"]
mod binary32;
#[path = "number/float16_model.rs"]
mod model;
#[path = "number/random.rs"]
mod random;

use bittybuzz_vm_core::number::F16;
use random::Random;

/// Every sign and kind of exponent with the fractions where rounding changes, and random ones.
fn operands(count: usize) -> Vec<u16> {
    let mut all = Vec::new();
    for sign in [0, 0x8000] {
        for exponent in [0, 1, 2, 3, 15, 16, 21, 22, 30, 31, 32, 33, 40, 41, 47, 60, 61, 62, 63] {
            for fraction in [0, 1, 2, 3, 127, 170, 255, 256, 257, 341, 384, 509, 510, 511] {
                all.push(sign | exponent << 9 | fraction);
            }
        }
    }
    let mut random = Random(16);
    while all.len() < count {
        all.push(random.next() as u16);
    }
    all
}

#[test]
fn arithmetic_is_correctly_rounded() {
    let operands = operands(1600);
    for &a in &operands {
        for &b in &operands {
            let (expected, computed) = (model::expected(a, b), model::computed(a, b));
            assert_eq!(expected, computed, "{a:#06x} {b:#06x}");
            assert_eq!(
                model::expected_order(a, b),
                model::computed_order(a, b),
                "{a:#06x} {b:#06x}"
            );
        }
    }
}

#[test]
fn conversion_to_binary32_is_exact() {
    for bits in 0..=u16::MAX {
        let value = f64::from(F16(bits).to_f32());
        let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
        let fraction = f64::from(bits & 511);
        match i32::from(bits >> 9 & 63) {
            0 => assert!(value == 0.0 && value.is_sign_negative() == (sign < 0.0)),
            63 if fraction == 0.0 => assert_eq!(value, sign * f64::INFINITY),
            63 => assert_eq!(F16(bits).to_f32().to_bits(), 0x7FC0_0000),
            exponent => {
                assert_eq!(value, sign * (1.0 + fraction / 512.0) * 2f64.powi(exponent - 31));
                assert_eq!(F16::from_f32(value as f32), F16(bits), "there and back");
            }
        }
    }
}

#[test]
fn conversion_from_binary32_rounds_to_nearest_even() {
    let check = |bits: u32| {
        let value = f32::from_bits(bits);
        assert_eq!(F16::from_f32(value).0, model::from_f32(value), "{value:e} {bits:#010x}");
    };
    // Each number, each midpoint, and the binary32 numbers next to them.
    for half in 0..(255u32 << 10) {
        for sign in [0, 1 << 31] {
            let bits = sign | half << 13;
            for near in [bits.wrapping_sub(1), bits, bits + 1] {
                check(near);
            }
        }
    }
    let mut random = Random(32);
    for _ in 0..1_000_000 {
        check(random.next() as u32);
    }
}

#[test]
fn values_known_from_the_c_implementation() {
    // Those of its recorded conversions where truncation, which it does, is nearest.
    for (value, bits) in [
        (2.5, 0x4080),
        (1.0, 0x3E00),
        (-1.0, 0xBE00),
        (100.0, 0x4B20),
        (std::f32::consts::PI, 0x4124),
        (0.1, 0x3733),
        (-0.0, 0x8000),
        (-3.5, 0xC180),
        (1024.0, 0x5200),
        (2048.0, 0x5400),
        (1e-38, 0),
    ] {
        assert_eq!(F16::from_f32(value).0, bits, "{value}");
    }
}

#[test]
fn the_ends_of_the_range() {
    let smallest = 2f32.powi(-30);
    assert_eq!(F16::from_f32(smallest), F16::MIN_POSITIVE);
    assert_eq!(F16::MIN_POSITIVE.to_f32(), smallest);
    assert_eq!(F16::from_f32(smallest / 2.0).0, 0, "no subnormals");
    assert_eq!(F16::from_f32(smallest * (1.0 - 2f32.powi(-11))), F16::MIN_POSITIVE, "rounds up");
    assert_eq!(F16::from_f32(smallest * (1.0 - 2f32.powi(-10))).0, 0);
    assert_eq!(F16::from_f32(-smallest / 2.0).0, 0x8000);
    assert_eq!(F16::MAX.to_f32(), 2f32.powi(32) - 2f32.powi(22));
    assert_eq!(F16::from_f32(4294967296.0), F16::INFINITY);
    assert_eq!(F16::from_f32(4294967296.0 - 2f32.powi(21)), F16::INFINITY, "midpoint, to even");
    assert_eq!(F16::from_f32(4294967296.0 - 2f32.powi(21) - 256.0), F16::MAX);
    assert_eq!(F16::from_f32(-f32::NAN), F16::NAN, "the sign of NaN is no difference");
}

#[test]
fn integers_are_rounded_once() {
    let check = |value: i32| {
        let magnitude = model::round(value.unsigned_abs().into(), 0, false);
        let expected = if value < 0 { magnitude | 0x8000 } else { magnitude };
        assert_eq!(F16::from_i32(value).0, expected, "{value}");
        if let Ok(value) = i16::try_from(value) {
            assert_eq!(F16::from_i16(value).0, expected, "{value}");
        }
    };
    (i32::from(i16::MIN)..=i32::from(i16::MAX)).for_each(check);
    // Just beside the midpoints, where rounding to binary32 first would lose the difference.
    for shift in 0..21 {
        for significand in 1024..2048i32 {
            let Some(midpoint) = significand.checked_mul(1 << shift) else { continue };
            for value in [midpoint - 1, midpoint, midpoint + 1] {
                check(value);
                check(-value);
            }
        }
    }
    check(i32::MIN);
    check(i32::MAX);
}

#[test]
fn truncation_saturates() {
    for bits in 0..=u16::MAX {
        let value = F16(bits);
        let exact = f64::from(value.to_f32());
        assert_eq!(value.to_i16(), exact as i16);
        assert_eq!(value.to_i32(), exact as i32);
    }
    assert_eq!(F16::from_f32(-3.9).to_i16(), -3);
    assert_eq!(F16::INFINITY.to_i16(), i16::MAX);
    assert_eq!(F16::NAN.to_i32(), 0);
}

/// The 16-bit float nearest to a binary64.
#[cfg(feature = "maths")]
fn nearest(value: f64) -> u16 {
    let sign = u16::from(value.is_sign_negative()) << 15;
    if value.is_nan() {
        return F16::NAN.0;
    }
    if value.is_infinite() {
        return sign | F16::INFINITY.0;
    }
    let bits = value.to_bits();
    let exponent = (bits >> 52 & 0x7FF) as i32;
    // Subnormal numbers of binary64 are zero in any case.
    let significand = if exponent == 0 { 0 } else { bits & ((1 << 52) - 1) | 1 << 52 };
    sign | model::round(significand.into(), exponent - 1075, false)
}

/// Rounding to binary32 in between can make a midpoint where none was: of 65,536 arguments, less than
/// one in ten thousand may give a neighbour of the nearest float.
#[cfg(feature = "maths")]
#[test]
fn functions_of_every_number_are_nearest() {
    use binary32::{maths, power};
    type Unary = (&'static str, fn(f32) -> f32, fn(f64) -> f64);
    let functions: [Unary; 16] = [
        ("sqrt", maths::sqrt, f64::sqrt),
        ("exp", maths::exp, f64::exp),
        ("log", maths::log, f64::ln),
        ("log2", maths::log2, f64::log2),
        ("log10", maths::log10, f64::log10),
        ("sin", maths::sin, f64::sin),
        ("cos", maths::cos, f64::cos),
        ("tan", maths::tan, f64::tan),
        ("asin", maths::asin, f64::asin),
        ("acos", maths::acos, f64::acos),
        ("atan", |x| maths::atan2(x, 1.0), f64::atan),
        ("atan to the left", |x| maths::atan2(x, -3.0), |x| x.atan2(-3.0)),
        ("square", |x| power(x, 2.0), |x| x * x),
        ("reciprocal cube", |x| power(x, -3.0), |x| 1.0 / (x * x * x)),
        ("power", |x| power(x, 1.7), |x| x.powf(f64::from(1.7_f32))),
        ("power of three", |x| power(3.0, x), |x| 3f64.powf(x)),
    ];
    for (name, function, exact) in functions {
        let wrong = (0..=u16::MAX)
            .filter(|&bits| {
                let x = F16(bits).to_f32();
                F16::from_f32(function(x)).0 != nearest(exact(x.into()))
            })
            .count();
        assert!(wrong <= 6, "{name}: {wrong}");
    }
}
