//! The conversion of lengths and angles, compared with floating-point arithmetic.

use std::f64::consts::PI;

use bittybuzz_motion::units::{degrees, from_mm, mm, radians};
use bittybuzz_motion::{Angle, Length, MM};

#[test]
fn every_angle() {
    for angle in i16::MIN..=i16::MAX {
        let turn = match angle {
            i16::MIN => 0.5,
            _ => f64::from(angle) / 65_536.0,
        };
        assert_eq!(f64::from(degrees(Angle(angle))), 360.0 * turn);
        let off = (f64::from(radians(Angle(angle))) - 2.0 * PI * turn).abs();
        assert!(off <= 1e-5, "{angle}: {off}");
    }
}

#[test]
fn lengths_survive_conversion_and_back() {
    for length in (-524_287..524_287).step_by(7) {
        let length: Length = length;
        assert_eq!(f64::from(mm(length)), f64::from(length) / f64::from(MM));
        assert_eq!(from_mm(mm(length)), Some(length));
    }
}

#[test]
fn invalid_lengths_are_rejected() {
    assert_eq!(from_mm(0.0), Some(0));
    assert_eq!(from_mm(-0.0), Some(0));
    assert_eq!(from_mm(1e-30), Some(0));
    assert_eq!(from_mm(0.07), Some(1));
    assert_eq!(from_mm(32_767.9), Some(524_286));
    for far in [32_768.0, -32_768.0, 4e9, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
        assert_eq!(from_mm(far), None, "{far}");
    }
}
