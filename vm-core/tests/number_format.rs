//! Numbers as text against the standard library, which is exact.

use crate::number::random::Random;
use bittybuzz_vm_core::number::{format_float, format_int, parse_float, parse_int};

fn int_text(value: i32) -> String {
    let mut text = String::new();
    format_int(value, &mut |byte| text.push(byte.into()));
    text
}

fn float_text(value: f32) -> String {
    let mut text = String::new();
    format_float(value, &mut |byte| text.push(byte.into()));
    text
}

/// `%f` of C in the standard library's terms.
fn c_text(value: f32) -> String {
    if value.is_nan() { "nan".into() } else { format!("{value:.6}") }
}

#[test]
fn integers() {
    let mut random = Random(1);
    let mut check = |value: i32| assert_eq!(int_text(value), value.to_string());
    [0, 1, -1, 9, 10, -10, 99, 100, i32::MAX, i32::MIN].into_iter().for_each(&mut check);
    for shift in 0..32 {
        for _ in 0..100 {
            check(random.next() as i32 >> shift);
        }
    }
}

#[test]
fn floats() {
    let check = |value: f32| assert_eq!(float_text(value), c_text(value), "{value:e}");
    for value in [
        0.0,
        -0.0,
        1.0,
        -0.5,
        0.1 + 0.2,
        1.0 / 3.0,
        999_999.94,
        8_388_607.5,
        16_777_216.0,
        4_294_967_296.0,
        1e-7,
        -1e-7,
        5e-7,
        f32::MAX,
        f32::MIN,
        f32::MIN_POSITIVE,
        1e-45,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        -f32::NAN,
    ] {
        check(value);
    }
    // Ties at the seventh decimal: odd multiples of 2^-7 and smaller have a 5 there and nothing after.
    for numerator in 0..5_000 {
        for shift in 1..24 {
            let value = numerator as f32 / (1 << shift) as f32;
            check(value);
            check(-value);
        }
    }
    // A carry from the fraction into the integer.
    for whole in 0..1000_u32 {
        check((whole as f32).next_down());
    }
    let mut random = Random(2);
    for _ in 0..60_000 {
        check(f32::from_bits(random.next() as u32));
    }
    assert_eq!(float_text(-1e-9), "-0.000000");
    assert_eq!(float_text(f32::MAX), "340282346638528859811704183484516925440.000000");
}

#[test]
fn integers_at_the_start_of_a_text() {
    for (text, value) in [
        ("123", Some(123)),
        ("-5", Some(-5)),
        ("+7", Some(7)),
        (" \t\n\x0B\x0C\r42 rest", Some(42)),
        ("12.9", Some(12)),
        ("007", Some(7)),
        ("0x10", Some(0)),
        ("2147483647", Some(i32::MAX)),
        ("2147483648", Some(i32::MAX)),
        ("-2147483648", Some(i32::MIN)),
        ("-2147483649", Some(i32::MIN)),
        ("99999999999999999999", Some(i32::MAX)),
        ("", None),
        ("  ", None),
        ("-", None),
        ("+-1", None),
        ("- 1", None),
        ("abc", None),
        (".5", None),
    ] {
        assert_eq!(parse_int(text.bytes()), value, "{text:?}");
    }
    let mut random = Random(3);
    for _ in 0..10_000 {
        let value = random.next() as i32;
        assert_eq!(parse_int(value.to_string().bytes()), Some(value));
    }
}

fn bits(value: Option<f32>) -> Option<u32> {
    value.map(f32::to_bits)
}

#[test]
fn floats_at_the_start_of_a_text() {
    for (text, value) in [
        ("2.5", Some(2.5)),
        ("-2.5e2x", Some(-250.0)),
        (" +.5", Some(0.5)),
        ("5.", Some(5.0)),
        ("1.2.3", Some(1.2)),
        ("1e", Some(1.0)),
        ("1e+", Some(1.0)),
        ("1E3", Some(1000.0)),
        ("-0", Some(-0.0)),
        ("0x1F", Some(0.0)),
        ("1e39", Some(f32::INFINITY)),
        ("-1e99999999999", Some(f32::NEG_INFINITY)),
        ("1e-99999999999", Some(0.0)),
        ("0e99999999999", Some(0.0)),
        ("", None),
        (".", None),
        ("-.", None),
        ("e5", None),
        ("inf", None),
        ("nan", None),
    ] {
        assert_eq!(bits(parse_float(text.bytes())), bits(value), "{text:?}");
    }
    // An exponent that takes back what leading or trailing zeros did.
    let zeros = "0".repeat(200);
    let text = format!("0.{zeros}1e201");
    assert_eq!(parse_float(text.bytes()), Some(1.0));
    assert_eq!(parse_float(format!("7{zeros}e-200").bytes()), Some(7.0));
}

#[test]
fn parsed_floats_are_nearest() {
    let check = |text: &str| {
        let nearest: f32 = text.parse().expect("a float");
        assert_eq!(bits(parse_float(text.bytes())), Some(nearest.to_bits()), "{text}");
    };
    let mut random = Random(4);
    for _ in 0..15_000 {
        let digits = random.next();
        let exponent = (random.next() % 100) as i32 - 60;
        check(&format!("{digits}e{exponent}"));
        check(&format!("{}e{exponent}", digits % 1_000_000_000));
        check(&format!("-{}.{}", digits % 100_000, random.next() % 1000));
        let value = f32::from_bits(digits as u32);
        if value.is_finite() {
            check(&format!("{value}"));
            check(&format!("{value:e}"));
            check(&format!("{value:.6}"));
        }
    }
    // Midpoints between two floats, exact and next to them: what the last digits decide.
    for _ in 0..15_000 {
        let bits = random.next() as u32 & 0x00FF_FFFF;
        let lower = f32::from_bits(bits % 0x0080_0000 + 0x4B80_0000);
        let midpoint = u64::from(lower as u32) + 1;
        check(&format!("{midpoint}"));
        check(&format!("{midpoint}.00000000001"));
        check(&format!("{}.99999999999", midpoint - 1));
        let small = f64::midpoint(f32::from_bits(bits).into(), f32::from_bits(bits + 1).into());
        check(&format!("{small:.19e}"));
    }
}
