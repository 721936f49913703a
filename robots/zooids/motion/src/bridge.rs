//! The conversion from a wheel's duty to the two inputs of its bridge.
//!
//! The bridge brakes between the pulses (slow decay), as in the makers' firmware: one input stays
//! high, and the other is low for the duty (SwarmUI, motors.c). A bridge with both inputs high
//! brakes. With both low, the wheel coasts, and the bridge sleeps after 1 ms (data sheet of the
//! A3909, the A3901's sister).

/// The timer's period in steps. The input is always high with a compare value of this size, and
/// always low with 0.
pub const PERIOD: u16 = 100;

/// The compare values of a bridge's two inputs.
pub type Inputs = [u16; 2];

/// The inputs of a motor without power.
pub const COAST: Inputs = [0, 0];

/// Returns the inputs for a duty in percent, -100 (backwards) to 100. Larger values count as 100,
/// and 0 brakes.
pub const fn inputs(duty: i8) -> Inputs {
    let low = match duty.unsigned_abs() as u16 {
        duty if duty < PERIOD => PERIOD - duty,
        _ => 0,
    };
    if duty < 0 { [PERIOD, low] } else { [low, PERIOD] }
}
