//! The tiny profile's float against an exact integer model.

use crate::number::float16_model as model;
use crate::number::random::Random;
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::number::{F16, Float, Rounding, operation};

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

/// Integers are as exact as floats, and have more bits.
#[test]
fn arithmetic_with_integers_is_correctly_rounded() {
    let check = |int: i16, bits: u16, int_first: bool| {
        // Both are an integer times a power of two.
        let significand = i128::from(bits & 511 | 512) * if bits >> 15 == 0 { 1 } else { -1 };
        let mut operands = [(i128::from(int), 0), (significand, i32::from(bits >> 9 & 63) - 40)];
        let mut numbers = [Float::from_int(int as u16), F16(bits).unpack()];
        if !int_first {
            operands.reverse();
            numbers.reverse();
        }
        let [(p, e), (q, f)] = operands;
        let low = e.min(f);
        let (left, right) = (p << (e - low), q << (f - low));
        for (operation, exact, exponent, more) in [
            (operation::ADD, left + right, low, false),
            (operation::SUB, left - right, low, false),
            (operation::MUL, p * q, e + f, false),
            (
                operation::DIV,
                if q == 0 { 0 } else { (p << 32) / q },
                e - f - 32,
                q != 0 && (p << 32) % q != 0,
            ),
        ] {
            if operation == operation::DIV && q == 0 {
                continue;
            }
            let mut result = numbers[0];
            result.operate(operation, &numbers[1]);
            let magnitude = model::round(exact.unsigned_abs(), exponent, more);
            let expected = if exact < 0 { magnitude | 0x8000 } else { magnitude };
            let packed = F16::pack(&result).0;
            let zeros = exact == 0 && packed & 0x7FFF == 0;
            assert!(packed == expected || zeros, "{operation} {int} {bits:#06x} {int_first}");
        }
        assert_eq!(numbers[0].compare(&numbers[1]), Some(left.cmp(&right)), "{int} {bits:#06x}");
        if q != 0 {
            let mut number = numbers[0];
            let result = number.modulo(&numbers[1]);
            let magnitude = model::round(left.rem_euclid(right).unsigned_abs(), low, false);
            // Where the nearest float is no remainder, it is the one before.
            let below =
                |bits: u16| f64::from(F16(bits).to_f32()) < right.abs() as f64 * 2f64.powi(low);
            let expected = if below(magnitude) { magnitude } else { magnitude - 1 };
            assert_eq!(result, expected, "{int} % {bits:#06x} {int_first}");
        }
    };
    let mut random = Random(61);
    for _ in 0..400_000 {
        let word = random.next();
        let field = 1 + (word >> 32) % 62;
        let near = 31 + (word >> 40) % 16;
        for field in [field, near] {
            let bits = word as u16 & 0x81FF | (field as u16) << 9;
            // Integers of every length.
            let int = (word >> 16) as i16 >> (word >> 48 & 15);
            check(int, bits, word >> 63 == 0);
        }
    }
    for int in [i16::MIN, i16::MAX, -1, 0, 1, 16385] {
        for bits in (1 << 9..63 << 9).step_by(7) {
            check(int, bits, true);
            check(int, bits | 0x8000, false);
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
    for value in i16::MIN..=i16::MAX {
        let magnitude = model::round(value.unsigned_abs().into(), 0, false);
        let expected = if value < 0 { magnitude | 0x8000 } else { magnitude };
        assert_eq!(F16::pack(&Float::<Tiny>::from_int(value as u16)).0, expected, "{value}");
    }
}

#[test]
fn truncation_saturates() {
    for bits in 0..=u16::MAX {
        let (value, exact) = (F16(bits).unpack(), f64::from(F16(bits).to_f32()));
        let int = |rounding| value.to_int(rounding) as i16;
        assert_eq!(value.to_i32(), exact as i32);
        assert_eq!(int(Rounding::Truncate), exact as i16);
        assert_eq!(int(Rounding::Floor), exact.floor() as i16);
        assert_eq!(int(Rounding::Ceil), exact.ceil() as i16);
        assert_eq!(int(Rounding::Nearest), exact.round() as i16);
    }
}

/// The 16-bit float nearest to a binary64.
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

/// How far a float is from `exact`, in units in the last place of the float nearest to `exact`.
fn error(result: u16, exact: f64) -> f64 {
    let nearest = F16(nearest(exact)).to_f32();
    let result = F16(result).to_f32();
    if result.is_nan() || nearest.is_nan() {
        return if result.is_nan() && nearest.is_nan() { 0.0 } else { f64::INFINITY };
    }
    if result == nearest && (nearest == 0.0 || nearest.is_infinite()) {
        return 0.0;
    }
    // Beside them, zero and infinity are a unit from the smallest and from the largest float.
    let unit = |x: f32| 2f64.powi(((x.to_bits() >> 23 & 255) as i32 - 127).clamp(-30, 31) - 9);
    let result = match result.abs() {
        0.0 => (2f64.powi(-30) - unit(0.0)).copysign(result.into()),
        f32::INFINITY => 2f64.powi(32).copysign(result.into()),
        _ => result.into(),
    };
    (result - exact).abs() / unit(nearest)
}

/// The functions of every 16-bit float: how far from the exact results they may be.
#[test]
fn functions_of_every_number_are_as_documented() {
    use crate::number::binary32::maths::{MathFunction, of};
    type Unary = (&'static str, fn(f32) -> f32, fn(f64) -> f64, f64);
    fn tiny(function: MathFunction, x: f32, y: f32) -> f32 {
        of::<Tiny>(function, x, y)
    }
    let functions: [Unary; 17] = [
        ("sqrt", |x| tiny(MathFunction::Sqrt, x, 0.0), f64::sqrt, 0.5),
        ("square", |x| tiny(MathFunction::Power, x, 2.0), |x| x * x, 0.5),
        ("exp", |x| tiny(MathFunction::Exp, x, 0.0), f64::exp, 0.61),
        ("log", |x| tiny(MathFunction::Log, x, 0.0), f64::ln, 0.54),
        ("log2", |x| tiny(MathFunction::Log2, x, 0.0), f64::log2, 0.54),
        ("log10", |x| tiny(MathFunction::Log10, x, 0.0), f64::log10, 0.54),
        ("sin", |x| tiny(MathFunction::Sin, x, 0.0), f64::sin, 0.55),
        ("cos", |x| tiny(MathFunction::Cos, x, 0.0), f64::cos, 0.55),
        ("tan", |x| tiny(MathFunction::Tan, x, 0.0), f64::tan, 0.55),
        ("asin", |x| tiny(MathFunction::Asin, x, 0.0), f64::asin, 0.53),
        ("acos", |x| tiny(MathFunction::Acos, x, 0.0), f64::acos, 0.53),
        ("atan", |x| tiny(MathFunction::Atan2, x, 1.0), f64::atan, 0.53),
        ("atan to the left", |x| tiny(MathFunction::Atan2, x, -3.0), |x| x.atan2(-3.0), 0.53),
        ("reciprocal cube", |x| tiny(MathFunction::Power, x, -3.0), |x| 1.0 / (x * x * x), 1.5),
        ("root", |x| tiny(MathFunction::Power, x, 0.5), |x| x.powf(0.5), 1.5),
        ("power", |x| tiny(MathFunction::Power, x, 1.75), |x| x.powf(1.75), 1.5),
        ("power of three", |x| tiny(MathFunction::Power, 3.0, x), |x| 3f64.powf(x), 1.5),
    ];
    for (name, function, exact, allowed) in functions {
        let (mut worst, mut neighbors) = ((0.0, 0.0), 0);
        for bits in 0..=u16::MAX {
            let x = F16(bits).to_f32();
            let (result, exact) = (F16::from_f32(function(x)), exact(x.into()));
            neighbors += usize::from(result != F16(nearest(exact)));
            let error = error(result.0, exact);
            if error > worst.0 {
                worst = (error, x);
            }
        }
        println!("{name}: {} units off for {:e}, {neighbors} not nearest", worst.0, worst.1);
        assert!(worst.0 <= allowed, "{name} is {} units off for {:e}", worst.0, worst.1);
        let allowed = match allowed {
            0.5 => 0,
            1.5 => 65536 / 40,
            _ => 65536 / 100,
        };
        assert!(neighbors <= allowed, "{name}: {neighbors}");
    }
}

/// Powers whose results are from 2^-30 to 2^32, and those of any two numbers.
#[test]
fn powers() {
    use crate::number::binary32::maths::{MathFunction, of};
    let mut random = Random(17);
    let mut worst = (0.0, 0.0, 0.0);
    for _ in 0..300_000 {
        let bits = random.next();
        let (x, y) = (F16(bits as u16).to_f32(), F16((bits >> 16) as u16).to_f32());
        let logarithm = (bits >> 32) as u32 as f32 / 2f32.powi(32) * 62.0 - 30.0;
        let near = F16::from_f32(logarithm / x.abs().log2()).to_f32();
        let whole = (bits >> 40 & 63) as f32 - 31.0;
        for (x, y) in [(x, y), (x.abs(), near), (x, whole)] {
            let result = F16::from_f32(of::<Tiny>(MathFunction::Power, x, y)).0;
            let error = error(result, f64::from(x).powf(y.into()));
            if error > worst.0 {
                worst = (error, x, y);
            }
        }
    }
    println!("{worst:?}");
    assert!(worst.0 <= 1.5, "{worst:?}");
}
