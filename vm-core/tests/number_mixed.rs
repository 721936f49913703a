//! Comparison, table keys, rounding to integers and the remainder, against wider types.

use std::cmp::Ordering;

use crate::number::binary32::{
    abs, ceil, compare, float_modulo, floor, normalize_key, round, to_int, unpack,
};
use crate::number::random::Random;
use bittybuzz_vm_core::number::{F16, Full, Number, Profile, Tiny, operation};

fn floats() -> Vec<f32> {
    let mut all = vec![
        0.0,
        0.1,
        0.49999997,
        0.5,
        0.500_000_06,
        0.999_999_94,
        1.0,
        1.5,
        2.4,
        2.5,
        2.7,
        3.5,
        1e-45,
        3.424e-40,
        1e-30,
        32767.0,
        32767.5,
        32768.0,
        32769.0,
        65536.0,
        8_388_607.5,
        8_388_608.0,
        16_777_216.0,
        16_777_218.0,
        2_147_483_520.0,
        2_147_483_648.0,
        2_147_483_904.0,
        3e9,
        4.3e9,
        3.216_532e38,
        f32::MAX,
        f32::INFINITY,
    ];
    let mut random = Random(3);
    for _ in 0..200 {
        all.push(f32::from_bits(random.next() as u32 & 0x7FFF_FFFF));
        all.push((random.next() as u32 >> 16) as f32 / 256.0);
        all.push(random.next() as u32 as f32);
    }
    let negative: Vec<_> = all.iter().map(|x| -x).collect();
    all.extend(negative);
    all.push(f32::NAN);
    all
}

#[test]
fn comparison_is_by_exact_value() {
    let mut ints = vec![0, 1, -1, 16_777_216, 16_777_217, 32767, 32768, i32::MAX, i32::MIN];
    ints.extend([i32::MAX - 1, i32::MAX - 127, i32::MIN + 1]);
    let mut random = Random(5);
    ints.extend((0..200).map(|_| random.next() as i32));
    let floats = floats();
    for &int in &ints {
        let close =
            [int as f32, int as f32 + 0.5, (int as f32).next_up(), (int as f32).next_down()];
        for &float in floats.iter().chain(&close) {
            // Binary64 holds both exactly.
            let order = f64::from(int).partial_cmp(&f64::from(float));
            assert_eq!(compare(Number::Int(int), Number::Float(float)), order, "{int} {float}");
            let reverse = order.map(Ordering::reverse);
            assert_eq!(compare(Number::Float(float), Number::Int(int)), reverse);
        }
        for &other in &ints {
            assert_eq!(compare(Number::Int(int), Number::Int(other)), Some(int.cmp(&other)));
        }
    }
    for &a in &floats {
        for &b in &floats {
            assert_eq!(compare(Number::Float(a), Number::Float(b)), a.partial_cmp(&b));
        }
    }
    let equal = compare(Number::Int(16_777_217), Number::Float(16_777_216.0));
    assert_eq!(equal, Some(Ordering::Greater));
}

fn check_keys<P: Profile>() {
    for float in floats() {
        let float = P::float_to_f32(P::float_from_f32(float));
        let exact = f64::from(float);
        let integer = exact == exact.trunc()
            && (f64::from(P::INT_MIN)..=f64::from(P::INT_MAX)).contains(&exact);
        match normalize_key::<P>(float) {
            Number::Int(int) => assert!(integer && f64::from(int) == exact, "{float} {int}"),
            Number::Float(kept) => {
                assert!(!integer && kept.to_bits() == float.to_bits(), "{float}");
            }
        }
    }
    assert_eq!(normalize_key::<P>(-0.0), Number::Int(0));
    assert_eq!(normalize_key::<P>(P::INT_MIN as f32), Number::Int(P::INT_MIN));
}

#[test]
fn an_integral_float_is_the_key_of_its_integer() {
    check_keys::<Tiny>();
    check_keys::<Full>();
    assert_eq!(normalize_key::<Tiny>(32768.0), Number::Float(32768.0));
    assert_eq!(normalize_key::<Full>(32768.0), Number::Int(32768));
    assert_eq!(normalize_key::<Full>(2_147_483_648.0), Number::Float(2_147_483_648.0));
}

#[test]
fn rounding_to_integers() {
    for x in floats() {
        let exact = f64::from(x);
        assert_eq!(to_int(Number::Float(x)), exact.trunc() as i32, "{x}");
        assert_eq!(floor(x), exact.floor() as i32, "{x}");
        assert_eq!(ceil(x), exact.ceil() as i32, "{x}");
        assert_eq!(round(x), exact.round() as i32, "{x}");
        assert!(
            f64::from(abs(x)).to_bits() == exact.abs().to_bits() || x.is_nan() && abs(x).is_nan()
        );
    }
    // The reference's results.
    assert_eq!((floor(2.7), floor(-2.7), ceil(2.1), ceil(-2.1)), (2, -3, 3, -2));
    assert_eq!((round(2.5), round(2.4), round(-2.5)), (3, 2, -3));
    assert_eq!(to_int(Number::Int(-5)), -5);
}

/// `|a| mod |b|` by repeated subtraction of the largest `|b| * 2^n`, exact in binary64.
fn remainder(a: f32, b: f32) -> f64 {
    f64::from(a).abs() % f64::from(b).abs()
}

fn check_modulo<P: Profile>(a: f32, b: f32) {
    let result = float_modulo::<P>(a, b);
    let what = format!("{} {a:e} % {b:e} = {result:e}", P::NAME);
    if a.is_nan() || b.is_nan() || a.is_infinite() || b == 0.0 {
        assert!(result.is_nan(), "{what}");
        return;
    }
    assert!(result >= 0.0 && result.is_sign_positive() && result < b.abs(), "{what}");
    assert_eq!(P::float_to_f32(P::float_from_f32(result)).to_bits(), result.to_bits(), "{what}");
    if b.is_infinite() {
        return;
    }
    // The exact remainder, to within the rounding of its complement in binary64.
    let rest = remainder(a, b);
    let exact = if a < 0.0 && rest != 0.0 { f64::from(b).abs() - rest } else { rest };
    let nearest = P::float_to_f32(P::float_from_f32(exact as f32));
    if nearest < b.abs() {
        assert_eq!(result, nearest, "{what}");
    } else {
        // The float before |b|: nothing of the profile is between.
        assert!(f64::from(result) <= exact || exact == 0.0, "{what}");
        let middle = f64::midpoint(f64::from(result), f64::from(b.abs()));
        let between = P::float_to_f32(P::float_from_f32(middle as f32));
        assert!(between == result || between == b.abs(), "{what}");
    }
}

#[test]
fn modulo_of_floats_is_euclidean_and_exact() {
    let floats = floats();
    for &a in &floats {
        for &b in &floats {
            check_modulo::<Full>(a, b);
        }
    }
    for a in (0..=u16::MAX).step_by(97) {
        for b in (0..=u16::MAX).step_by(61) {
            check_modulo::<Tiny>(F16(a).to_f32(), F16(b).to_f32());
        }
    }
    for (a, b, result) in [
        (7.5, 2.0, 1.5),
        (-5.5, 2.0, 0.5),
        (-5.5, -2.0, 0.5),
        (5.5, -2.0, 1.5),
        (-1.0, 2.0, 1.0),
        (-4.0, 2.0, 0.0),
        (-0.0, 2.0, 0.0),
        (1e30, 3.0, remainder(1e30, 3.0) as f32),
        (3.0, f32::INFINITY, 3.0),
        (-3.0, f32::INFINITY, f32::MAX),
        (-1e-30, 1.0, 0.999_999_94),
    ] {
        assert_eq!(float_modulo::<Full>(a, b), result, "{a} % {b}");
    }
    assert_eq!(float_modulo::<Tiny>(-1e-9, 1.0), 1.0 - 1.0 / 1024.0);
    assert_eq!(float_modulo::<Tiny>(-3.0, f32::INFINITY), F16::MAX.to_f32());
}

/// The operations of `full` are those of this processor, which rounds once, as IEEE 754 says. A product is rounded to
/// 32 bits first, as powers need it, and may be the next float instead. Most pairs are of numbers that are near each
/// other, so that bits of both are in the result.
#[test]
fn operations_of_full_are_those_of_ieee_754() {
    let mut random = Random(11);
    // A product that is rounded twice.
    let mut pairs = vec![(0x2FA1_CA34, 0x2FA1_CA35)];
    for number in 0..500_000_u32 {
        let (one, other) = (random.next() as u32, random.next() as u32);
        let is_near = number % 4 != 0;
        let exponent = if is_near { one & 0x7F00_0000 } else { other & 0x7F00_0000 };
        pairs.push((one, exponent | other & 0x80FF_FFFF));
    }
    let mut rounded_twice = 0;
    for (one, other) in pairs {
        let [a, b] = [one, other].map(f32::from_bits);
        for (operation, expected) in [
            (operation::ADD, a + b),
            (operation::SUB, a - b),
            (operation::MUL, a * b),
            (operation::DIV, a / b),
            (operation::ROOT, a.sqrt()),
        ] {
            let mut number = unpack(a);
            let second = if operation == operation::ROOT { number } else { unpack(b) };
            number.operate(operation, &second);
            let result = number.to_f32();
            if result.to_bits() == expected.to_bits() || result.is_nan() && expected.is_nan() {
                continue;
            }
            let is_next = result.to_bits().abs_diff(expected.to_bits()) == 1;
            let of = format!("operation {operation} of {one:#x} and {other:#x}");
            assert!(operation == operation::MUL && is_next, "{of}: {result:e}, not {expected:e}");
            rounded_twice += 1;
        }
    }
    assert!((1..2000).contains(&rounded_twice), "{rounded_twice}");
}
