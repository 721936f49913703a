//! The functions of `math` against binary64.

use crate::number::binary32::{maths, power};
use crate::number::random::Random;

type Unary = (&'static str, fn(f32) -> f32, fn(f64) -> f64, f64);

/// Name, function, the same in binary64, and the error that the documentation promises.
const UNARY: [Unary; 11] = [
    ("sqrt", maths::sqrt, f64::sqrt, 0.5),
    ("exp", maths::exp, f64::exp, 0.7),
    ("log", maths::log, f64::ln, 0.6),
    ("log2", maths::log2, f64::log2, 0.6),
    ("log10", maths::log10, f64::log10, 0.6),
    ("sin", maths::sin, f64::sin, 0.6),
    ("cos", maths::cos, f64::cos, 0.6),
    ("tan", maths::tan, f64::tan, 0.6),
    ("asin", maths::asin, f64::asin, 0.6),
    ("acos", maths::acos, f64::acos, 0.6),
    ("atan", |x| maths::atan2(x, 1.0), f64::atan, 0.6),
];

/// How far `result` is from `exact`, in units in the last place of the binary32 nearest to `exact`.
fn error(result: f32, exact: f64) -> f64 {
    let nearest = exact as f32;
    if result.is_nan() || nearest.is_nan() {
        return if result.is_nan() && nearest.is_nan() { 0.0 } else { f64::INFINITY };
    }
    if result.is_infinite() || nearest.is_infinite() {
        // Beside the largest float, infinity is 2^128.
        let finite = |x: f32| {
            if x.is_infinite() { 2f64.powi(128).copysign(x.into()) } else { x.into() }
        };
        return (finite(result) - finite(nearest)).abs() / 2f64.powi(104);
    }
    let exponent = (exact.abs().to_bits() >> 52) as i32 - 1023;
    let unit = 2f64.powi(exponent.clamp(-126, 127) - 23);
    (f64::from(result) - exact).abs() / unit
}

/// The largest error of a function over `arguments`.
fn worst((_, function, exact, _): Unary, arguments: impl Iterator<Item = u32>) -> (f64, f32) {
    let mut worst = (0.0, 0.0);
    for bits in arguments {
        let x = f32::from_bits(bits);
        let error = error(function(x), exact(x.into()));
        if error > worst.0 {
            worst = (error, x);
        }
    }
    worst
}

#[test]
fn errors_are_as_documented() {
    for unary in UNARY {
        let (error, x) = worst(unary, (0..=u32::MAX).step_by(40_009));
        assert!(error <= unary.3, "{} is {error} units off for {x:e}", unary.0);
    }
}

#[test]
#[ignore = "every float: half an hour of processor time in a release build"]
fn errors_of_every_float() {
    std::thread::scope(|scope| {
        for unary in UNARY {
            scope.spawn(move || {
                let (error, x) = worst(unary, 0..=u32::MAX);
                println!("{}: {error:.4} units off for {x:e}", unary.0);
                assert!(error <= unary.3, "{} is {error} units off for {x:e}", unary.0);
            });
        }
    });
}

#[test]
fn square_roots_are_correctly_rounded() {
    // The square root of the standard library is, by IEEE 754.
    for bits in (0..=u32::MAX).step_by(16_411) {
        let x = f32::from_bits(bits);
        let (root, exact) = (maths::sqrt(x), x.sqrt());
        assert!(root.to_bits() == exact.to_bits() || root.is_nan() && exact.is_nan(), "{x:e}");
    }
}

/// Angles that lie as near to a multiple of pi/2 as floats can, where reduction loses most.
#[test]
fn angles_next_to_quarter_turns() {
    let sines: [Unary; 3] = [UNARY[5], UNARY[6], UNARY[7]];
    for quarters in 1..60_000_u32 {
        let near = (f64::from(quarters) * std::f64::consts::FRAC_PI_2) as f32;
        for bits in near.to_bits() - 1..=near.to_bits() + 1 {
            for (name, function, exact, _) in sines {
                let x = f32::from_bits(bits);
                let error = error(function(x), exact(x.into()));
                assert!(error <= 0.6, "{name} is {error} units off for {x:e}");
            }
        }
    }
    // The nearest of all: 1.6e-9 from an odd multiple.
    let worst = 16_367_173.0 * 2f32.powi(72);
    assert!(error(maths::cos(worst), f64::from(worst).cos()) <= 0.6, "{}", maths::cos(worst));
}

#[test]
fn angles_of_points() {
    let mut random = Random(7);
    for round in 0..100_000 {
        let mut coordinate = || {
            let bits = random.next();
            match round % 3 {
                0 => f32::from_bits(bits as u32),
                1 => (bits as i16) as f32,
                _ => f32::from_bits(bits as u32 & 0x81FF_FFFF | 0x3E00_0000),
            }
        };
        let (y, x) = (coordinate(), coordinate());
        let error = error(maths::atan2(y, x), f64::from(y).atan2(x.into()));
        assert!(error <= 0.6, "atan2({y:e}, {x:e}) is {error} units off");
    }
}

/// 2^exponent; the standard library's power of a binary32 loses the subnormal ones.
fn two_to(exponent: i32) -> f32 {
    2f64.powi(exponent) as f32
}

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

const SPECIAL: [f32; 24] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    2.0,
    -2.0,
    3.0,
    -3.0,
    4.0,
    -7.5,
    1e-45,
    -1e-45,
    1.175_494_4e-38,
    f32::MAX,
    f32::MIN,
    1.000_000_1,
    0.999_999_94,
    16_777_216.0,
    16_777_215.0,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
];

#[test]
fn zeros_infinities_and_nan() {
    for x in SPECIAL {
        for (name, function, exact, allowed) in UNARY {
            let (result, exact) = (function(x), exact(x.into()));
            assert!(error(result, exact) <= allowed, "{name}({x}) = {result}");
            let sign = result.is_nan() || result.is_sign_negative() == exact.is_sign_negative();
            assert!(sign, "{name}({x}) = {result}");
        }
        for y in SPECIAL {
            let (result, exact) = (maths::atan2(x, y), f64::from(x).atan2(y.into()));
            assert!(error(result, exact) <= 0.6, "atan2({x}, {y}) = {result}");
            assert!(result.is_nan() || result.is_sign_negative() == exact.is_sign_negative());
            let (result, exact) = (power(x, y), f64::from(x).powf(y.into()));
            assert!(error(result, exact) <= 1.5, "{x} ^ {y} = {result}, not {exact}");
            let sign = result.is_nan() || result.is_sign_negative() == exact.is_sign_negative();
            assert!(sign, "{x} ^ {y} = {result}");
        }
    }
}

#[test]
fn powers() {
    let mut random = Random(11);
    let mut worst = (0.0, 0.0, 0.0);
    let mut check = |x: f32, y: f32| {
        let error = error(power(x, y), f64::from(x).powf(y.into()));
        if error > worst.0 {
            worst = (error, x, y);
        }
    };
    for _ in 0..100_000 {
        let bits = random.next();
        // A base and an exponent for which the result is about 2^-160 to 2^160.
        let x = f32::from_bits(bits as u32 & 0x7FFF_FFFF);
        let scale = (bits >> 32) as i32 as f32 / 2f32.powi(31);
        check(x, 160.0 * scale / x.log2());
        let x = f32::from_bits(0x3F00_0000 + (bits as u32 & 0xFF_FFFF));
        check(x, 160.0 * scale / x.log2());
        check(x, (bits >> 32 & 31) as f32 - 16.0);
        check((bits & 0xFFFF) as f32, (bits >> 32 & 1023) as f32 / 64.0 - 8.0);
        check(f32::from_bits(bits as u32), f32::from_bits((bits >> 32) as u32));
    }
    assert!(worst.0 <= 1.5, "{worst:?}");
}

#[test]
fn integer_powers_are_exact() {
    // Every power of an integer, and of a fraction of a power of two, that is a float.
    for base in -4100..=4100_i64 {
        for exponent in 0..40_u32 {
            let Some(exact) = base.checked_pow(exponent) else { break };
            if exact as f32 as i64 != exact {
                continue;
            }
            assert_eq!(power(base as f32, exponent as f32) as i64, exact, "{base} ^ {exponent}");
            let scaled = power(base as f32 / 8.0, exponent as f32);
            assert_eq!(f64::from(scaled), exact as f64 * 0.125f64.powi(exponent as i32));
        }
    }
    for exponent in -149..=127 {
        let exact = two_to(exponent);
        assert!(same(power(2.0, exponent as f32), exact), "2 ^ {exponent}");
        assert!(same(power(0.5, -exponent as f32), exact), "0.5 ^ -{exponent}");
        let signed = if exponent % 2 != 0 { -exact } else { exact };
        assert!(same(power(-2.0, exponent as f32), signed), "-2 ^ {exponent}");
    }
    for (x, y, result) in [
        (2.0, 3.0, 8.0),
        (-2.0, 3.0, -8.0),
        (10.0, 5.0, 100_000.0),
        (10.0, 10.0, 1e10),
        (2.0, -1.0, 0.5),
        (10.0, -1.0, 0.1),
        (10.0, -3.0, 0.001),
        (0.0, 0.0, 1.0),
        (-1.0, -2.0, 1.0),
        (2.0, 0.5, std::f32::consts::SQRT_2),
    ] {
        assert_eq!(power(x, y), result, "{x} ^ {y}");
    }
    assert!(power(-8.0, 0.5).is_nan());
}

#[test]
fn logarithms_of_powers_are_exact() {
    for exponent in -149..=127 {
        assert_eq!(maths::log2(two_to(exponent)), exponent as f32);
    }
    for exponent in 0..=10 {
        assert_eq!(maths::log10(10f32.powi(exponent)), exponent as f32);
    }
}
