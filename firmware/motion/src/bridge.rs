//! From a wheel's duty to the two inputs of its bridge.
//!
//! Driven with brake between the pulses (slow decay), as the makers' firmware does: one input stays high, the other is low
//! for the duty (SwarmUI, motors.c). A bridge with both inputs high brakes, one with both low lets the wheel coast and,
//! after 1 ms, sleeps (data sheet of the A3909, the A3901's sister).

/// The timer's period in steps: a compare value of this size is always high, 0 always low.
pub const PERIOD: u16 = 100;

/// Compare values of a bridge's inputs.
pub type Inputs = [u16; 2];

/// No power.
pub const COAST: Inputs = [0, 0];

/// For a duty in percent, -100 (backwards) to 100; more is as much as 100. 0 brakes.
pub const fn inputs(duty: i8) -> Inputs {
    let low = match duty.unsigned_abs() as u16 {
        duty if duty < PERIOD => PERIOD - duty,
        _ => 0,
    };
    if duty < 0 { [PERIOD, low] } else { [low, PERIOD] }
}
