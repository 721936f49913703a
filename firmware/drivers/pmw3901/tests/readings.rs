//! Bursts and their conversion.

use bittybuzz_pmw3901::MotionCounts;
use bittybuzz_testbus::{Wires, run};

use crate::chip::{Bench, Defect};

fn reading(burst: [u8; 12]) -> MotionCounts {
    let mut bench = Bench::new(&Wires::new(), Defect::None);
    let sensor = bench.start().unwrap();
    bench.chip.borrow_mut().burst = burst;
    run(sensor.read(&mut bench.spi, &mut bench.delay)).unwrap()
}

/// The layout is that of motionBurst_t in crazyflie-firmware (pmw3901.h).
#[test]
fn a_burst_has_the_layout_of_bitcrazes_firmware() {
    let found = reading([0xb0, 0x11, 0x34, 0x12, 0xfe, 0xff, 80, 81, 82, 83, 0x0a, 0x0b]);
    let expected = MotionCounts {
        motion: 0xb0,
        observation: 0x11,
        delta_x: 0x1234,
        delta_y: -2,
        surface_quality: 80,
        raw_sum: 81,
        raw_max: 82,
        raw_min: 83,
        shutter: 0x0a0b,
    };
    assert_eq!(found, expected);
}

#[test]
fn only_one_state_is_a_valid_motion() {
    // At rest, moved, and moved with an unknown bit.
    for (motion, has_moved, is_valid) in
        [(0x30, false, false), (0xb0, true, true), (0xb1, true, false), (0x00, false, false)]
    {
        let mut burst = [0; 12];
        burst[0] = motion;
        let found = reading(burst);
        assert_eq!((found.has_moved(), found.has_valid_motion()), (has_moved, is_valid));
    }
}

#[test]
fn angles_agree_with_two_other_sources() {
    let found = reading([0xb0, 0, 0xf4, 0x01, 0x0c, 0xfe, 0, 0, 0, 0, 0, 0]).angles();
    // 500 counts are 50 pixels of 35 in a field of view of 42° (data sheet): 60°, if the lens had
    // no distortion.
    let flat = 60f32.to_radians();
    assert!((found.x_rad / flat - 1.0).abs() < 0.03, "{found:?}");
    // 500 counts are 1 rad in PX4.
    assert!((found.x_rad - 1.0).abs() < 0.03, "{found:?}");
    assert_eq!(found.y_rad, -found.x_rad);
    // The arithmetic of crazyflie-firmware: 0.1 · 500 · 0.71674 / 35.
    assert!((found.x_rad - 1.023_914).abs() < 1e-5, "{found:?}");
}
