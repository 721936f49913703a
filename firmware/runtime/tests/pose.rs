//! Poses, compared with geometry in every quadrant.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use crate::common::{advance_us, clock};
use bittybuzz_runtime::pose::{LatestPose, Pose};
use bittybuzz_vm_core::Axis;
use bittybuzz_vm_core::number::Full;

fn upright(position_m: [f32; 3], yaw: f32) -> Pose {
    Pose::new(position_m, [0.0, 0.0, (yaw / 2.0).sin(), (yaw / 2.0).cos()])
}

fn place(pose: Pose, other_mm: [f32; 3]) -> [f32; 3] {
    pose.place_of::<Full, &[u8]>(other_mm).map(|value| value.as_f32().expect("a float"))
}

fn assert_near(found: [f32; 3], expected: [f32; 3]) {
    let [distance, azimuth, elevation] = [0, 1, 2].map(|at| (found[at] - expected[at]).abs());
    // Numerically, angles near pi and near -pi are far apart.
    let near = distance <= expected[0] * 1e-5 && azimuth < 1e-5 && elevation < 1e-5;
    assert!(near, "{found:?} instead of {expected:?}");
}

#[test]
fn all_quadrants() {
    let here = upright([1.0, 2.0, 0.5], 0.0);
    let diagonal = 2000.0_f32.sqrt() * 10.0_f32.sqrt();
    for (x, y, azimuth) in [
        (100.0, 0.0, 0.0),
        (100.0, 100.0, FRAC_PI_4),
        (0.0, 100.0, FRAC_PI_2),
        (-100.0, 100.0, 3.0 * FRAC_PI_4),
        (-100.0, 0.0, PI),
        (-100.0, -100.0, -3.0 * FRAC_PI_4),
        (0.0, -100.0, -FRAC_PI_2),
        (100.0, -100.0, -FRAC_PI_4),
    ] {
        let distance = if x == 0.0 || y == 0.0 { 100.0 } else { diagonal };
        assert_near(place(here, [1000.0 + x, 2000.0 + y, 500.0]), [distance, azimuth, 0.0]);
    }
}

/// A robot that turns to the left sees the other robot more to the right.
#[test]
fn the_own_direction_counts() {
    for degrees in [-170.0_f32, -90.0, -30.0, 0.0, 45.0, 90.0, 135.0, 179.0] {
        let yaw = degrees.to_radians();
        let here = upright([0.0; 3], yaw);
        let orientation = here.along::<&[u8]>(Axis::Orientation);
        assert!((orientation - degrees).abs() < 1e-4, "{orientation} instead of {degrees}");
        for bearing in [-3.0_f32, -1.0, 0.0, 2.0] {
            let other = [1000.0 * bearing.cos(), 1000.0 * bearing.sin(), 0.0];
            let difference = bearing - yaw;
            let azimuth = difference - 2.0 * PI * (difference / (2.0 * PI)).round();
            assert_near(place(here, other), [1000.0, azimuth, 0.0]);
        }
    }
}

/// The triangle 3-4-5, upwards and downwards. Straight up there is a distance, but no direction.
#[test]
fn heights() {
    let here = upright([0.0, 0.0, 1.0], FRAC_PI_2);
    assert_near(place(here, [0.0, 400.0, 1300.0]), [500.0, 0.0, (0.75_f32).atan()]);
    assert_near(place(here, [0.0, 400.0, 700.0]), [500.0, 0.0, -(0.75_f32).atan()]);
    assert_near(place(here, [0.0, 0.0, 3000.0]), [2000.0, 0.0, FRAC_PI_2]);
    assert_near(place(here, [0.0, 0.0, 1000.0]), [0.0, 0.0, 0.0]);
}

/// A nose that points down and ahead still points ahead: pitch about y, then yaw about z.
#[test]
fn a_tilt_does_not_matter() {
    let ((sin_yaw, cos_yaw), (sin_pitch, cos_pitch)) = (0.5_f32.sin_cos(), 0.15_f32.sin_cos());
    let quaternion =
        [-sin_yaw * sin_pitch, cos_yaw * sin_pitch, sin_yaw * cos_pitch, cos_yaw * cos_pitch];
    let here = Pose::new([0.0; 3], quaternion);
    assert!((here.along::<&[u8]>(Axis::Orientation) - 1.0_f32.to_degrees()).abs() < 1e-4);
    let other = [1000.0 * 1.0_f32.cos(), 1000.0 * 1.0_f32.sin(), 0.0];
    assert_near(place(here, other), [1000.0, 0.0, 0.0]);
}

#[test]
fn a_pose_is_known_for_a_second() {
    let _turn = clock();
    let latest = LatestPose::new();
    assert_eq!(latest.get(), None);
    let pose = upright([1.5, -0.25, 1.0], 0.0);
    latest.set(pose);
    advance_us(1_000_000);
    assert_eq!(latest.get(), Some(pose));
    assert_eq!(pose.along::<&[u8]>(Axis::X), 1500.0);
    assert_eq!(pose.along::<&[u8]>(Axis::Y), -250.0);
    assert_eq!(pose.along::<&[u8]>(Axis::Z), 1000.0);
    advance_us(1);
    assert_eq!(latest.get(), None);
    latest.set(pose);
    assert_eq!(latest.get(), Some(pose));
}
