//! The integer operations of both profiles against wide integers.

use crate::number::random::Random;
use bittybuzz_vm_core::number::{F16, Full, Profile, Tiny};

/// The low `INT_BITS` of a wide integer, as a value of the profile.
fn wrapped<P: Profile>(wide: i64) -> i32 {
    let unused = 64 - P::INT_BITS;
    (wide << unused >> unused) as i32
}

fn operands<P: Profile>() -> Vec<i32> {
    let mut all = Vec::new();
    for near in [0, P::INT_MIN, P::INT_MAX, 7, -7, 16, -16, 32, 256, 1000, -1000] {
        for offset in -2..=2 {
            all.push(wrapped::<P>(i64::from(near) + offset));
        }
    }
    let mut random = Random(u64::from(P::INT_BITS));
    for _ in 0..200 {
        all.push(wrapped::<P>(random.next() as i64));
        all.push(wrapped::<P>((random.next() & 0xFF) as i64));
    }
    all
}

fn check_pair<P: Profile>(x: i32, y: i32) {
    let (a, b) = (P::int_from_i32(x), P::int_from_i32(y));
    let (wide_x, wide_y) = (i64::from(x), i64::from(y));
    let value = P::int_to_i32;
    assert_eq!(value(a), x);
    assert_eq!(value(P::add(a, b)), wrapped::<P>(wide_x + wide_y));
    assert_eq!(value(P::sub(a, b)), wrapped::<P>(wide_x - wide_y));
    assert_eq!(value(P::mul(a, b)), wrapped::<P>(wide_x.wrapping_mul(wide_y)));
    assert_eq!(value(P::neg(a)), wrapped::<P>(-wide_x));
    assert_eq!(value(P::and(a, b)), x & y);
    assert_eq!(value(P::or(a, b)), x | y);
    assert_eq!(value(P::not(a)), -1 - x);
    assert_eq!(P::int_less(a, b), x < y);
    assert_eq!(P::is_zero(a), x == 0);

    let quotient = (y != 0).then(|| wrapped::<P>(wide_x / wide_y));
    assert_eq!(P::div(a, b).map(value), quotient, "{x} / {y}");
    let remainder = (y != 0).then(|| {
        // The one r in 0..|y| for which x - r is a multiple of y.
        let r = (wide_x % wide_y + wide_y.abs()) % wide_y.abs();
        wrapped::<P>(r)
    });
    assert_eq!(P::modulo(a, b).map(value), remainder, "{x} % {y}");

    let count = (0..i64::from(P::INT_BITS)).contains(&wide_y).then_some(wide_y as u32);
    assert_eq!(
        P::shl(a, b).map(value),
        count.map(|count| wrapped::<P>(wide_x << count)),
        "{x} << {y}"
    );
    let floor = count.map(|count| wide_x.div_euclid(1 << count) as i32);
    assert_eq!(P::shr(a, b).map(value), floor, "{x} >> {y}");
}

fn check_all<P: Profile>() {
    let operands = operands::<P>();
    for &x in &operands {
        for &y in &operands {
            check_pair::<P>(x, y);
        }
    }
}

#[test]
fn tiny_integers() {
    check_all::<Tiny>();
}

#[test]
fn full_integers() {
    check_all::<Full>();
}

#[test]
fn documented_results() {
    fn check<P: Profile>() {
        let int = P::int_from_i32;
        let value = |raw: Option<P::Raw>| raw.map(P::int_to_i32);
        assert_eq!(value(P::div(int(-7), int(2))), Some(-3));
        assert_eq!(value(P::modulo(int(-7), int(3))), Some(2));
        assert_eq!(value(P::modulo(int(7), int(-3))), Some(1));
        assert_eq!(value(P::div(int(P::INT_MIN), int(-1))), Some(P::INT_MIN));
        assert_eq!(value(P::modulo(int(P::INT_MIN), int(-1))), Some(0));
        assert_eq!(value(P::modulo(int(-1), int(P::INT_MIN))), Some(P::INT_MAX));
        assert_eq!(value(P::shr(int(-8), int(1))), Some(-4));
        assert_eq!(P::shl(int(1), int(P::INT_BITS as i32)), None);
        assert_eq!(P::shl(int(1), int(-1)), None);
        assert_eq!(value(P::shl(int(1), int(P::INT_BITS as i32 - 1))), Some(P::INT_MIN));
    }
    check::<Tiny>();
    check::<Full>();
    assert_eq!(Tiny::int_to_i32(Tiny::add(Tiny::int_from_i32(32767), 1)), -32768);
    assert_eq!(Full::int_to_i32(Full::add(32767, 1)), 32768);
}

#[test]
fn payloads() {
    assert_eq!((Tiny::WORD_BYTES, Full::WORD_BYTES), (2, 4));
    assert_eq!((Tiny::INT_BITS, Full::INT_BITS), (16, 32));
    assert_eq!(Tiny::literal_from_le([1, 2, 3, 4]), 0x0201);
    assert_eq!(Full::literal_from_le([1, 2, 3, 4]), 0x0403_0201);
    assert_eq!(Tiny::raw_from_u16(0xFFFF), 0xFFFF);
    assert_eq!(Full::raw_from_u16(0xFFFF), 0xFFFF);
    assert_eq!(Full::raw_to_u16(0x1234_5678), 0x5678);
    assert_eq!(Tiny::int_to_i32(Tiny::int_from_i32(65537)), 1);
    assert_ne!((Tiny::ID, Tiny::NAME), (Full::ID, Full::NAME));
}

#[test]
fn one_nan() {
    for bits in [0x7FC0_0000, 0xFFC0_0000, 0x7F80_0001, 0xFFFF_FFFF] {
        let nan = f32::from_bits(bits);
        assert_eq!(Full::float_from_f32(nan), 0x7FC0_0000);
        assert_eq!(Tiny::float_from_f32(nan), F16::NAN.0);
    }
    for bits in [0, 0x8000_0000, 1, 0x3F80_0000, 0x7F80_0000, 0xFF80_0000] {
        assert_eq!(Full::float_from_f32(f32::from_bits(bits)), bits);
        assert_eq!(Full::float_to_f32(bits).to_bits(), bits);
    }
}
