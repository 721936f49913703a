//! The effect of the bridge's inputs on the motor, as the makers' firmware uses them.

use bittybuzz_motion::bridge::{COAST, PERIOD, inputs};

/// Returns the percentages of time in which the motor is driven forwards (only the second input is
/// high), driven backwards, braked, and without power.
fn shares([first, second]: [u16; 2]) -> [u16; 4] {
    let mut shares = [0; 4];
    for count in 0..PERIOD {
        shares[match (count < first, count < second) {
            (false, true) => 0,
            (true, false) => 1,
            (true, true) => 2,
            (false, false) => 3,
        }] += 1;
    }
    shares
}

#[test]
fn a_duty_is_the_share_in_which_the_motor_is_driven() {
    for duty in -100..=100_i8 {
        let driven = u16::from(duty.unsigned_abs());
        let expected =
            if duty < 0 { [0, driven, 100 - driven, 0] } else { [driven, 0, 100 - driven, 0] };
        assert_eq!(shares(inputs(duty)), expected, "{duty}");
    }
}

#[test]
fn a_duty_above_100_percent_is_full_power() {
    assert_eq!(inputs(127), inputs(100));
    assert_eq!(inputs(-128), inputs(-100));
}

#[test]
fn without_power_nothing_is_driven_or_braked() {
    assert_eq!(shares(COAST), [0, 0, 0, 100]);
}
