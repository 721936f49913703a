//! The length and the direction of vectors, compared with the standard library's results.

use bittybuzz_motion::Angle;
use bittybuzz_motion::angle::polar;
use std::f64::consts::PI;

#[test]
fn every_direction_at_every_length() {
    for length in [16.0, 100.0, 1000.0, 16_000.0, 1_000_000.0_f64] {
        for step in 0..3600 {
            let direction = f64::from(step) * PI / 1800.0;
            let (x, y) = ((length * direction.cos()).round(), (length * direction.sin()).round());
            let (found, angle) = polar(x as i32, y as i32);
            let off = f64::from(angle.0) * PI / 32768.0 - y.atan2(x);
            let off = off.sin().atan2(off.cos()).abs().to_degrees();
            assert!(off < 0.1, "{off} degrees at {x}, {y}");
            let off = (f64::from(found) - x.hypot(y)).abs();
            assert!(off < 1.0 + length * 3e-4, "{found} at {x}, {y}");
        }
    }
}

#[test]
fn special_vectors() {
    assert_eq!(polar(0, 0), (0, Angle(0)));
    for (x, y, degrees) in
        [(1 << 19, 0, 0), (0, 1 << 19, 90), (-(1 << 19), 0, 180), (0, -(1 << 19), -90)]
    {
        let (length, angle) = polar(x, y);
        assert!((length - (1 << 19)).abs() < 200, "{length}");
        let off = angle.minus(Angle((degrees * 32_768 / 180) as i16));
        assert!(off.magnitude() <= 3, "{angle:?} instead of {degrees} degrees");
    }
}

#[test]
fn angles_wrap_around() {
    let most = Angle(i16::MAX);
    assert_eq!(most.plus(Angle(1)), Angle(i16::MIN));
    assert_eq!(Angle(i16::MIN).minus(Angle(1)), most);
    assert_eq!(Angle(i16::MIN).signed(), 32_768);
    assert_eq!(Angle(i16::MIN).magnitude(), 32_768);
    assert_eq!(Angle(-5).signed(), -5);
}
