//! The functions of the library `math`. Each sets its first argument to the result.
//!
//! The largest errors in units in the last place, measured against binary64. The test
//! `number_maths` measures those of the full profile; `number_float16` measures those of the tiny
//! one for every float.
//!
//! | Function | Full | Tiny |
//! |---|---|---|
//! | `sqrt` | 0.5: correctly rounded | 0.5: correctly rounded |
//! | `log`, `log2`, `log10` | 0.6 | 0.54 |
//! | `exp` | 0.7 | 0.61 |
//! | `sin`, `cos`, `tan`, for every finite angle | 0.6 | 0.55 |
//! | `asin`, `acos`, `atan2` | 0.6 | 0.53 |
//! | `power` | 1.5 | 1.5 |
//!
//! Powers with integer exponents are exact if a float can hold them. In the tiny profile one result
//! in a hundred is not the nearest float but the one next to it; of powers, one in forty.

use super::calculator::calculate;
use super::float::Float;
use super::profile::Profile;
use super::tables::start;
use super::trigonometry::sine_quickly;
use super::wide::IS_WIDE;
use crate::bytecode::ByteCode;

/// `math.pi`
pub const PI: f32 = core::f32::consts::PI;

/// The functions, in the order of the built-ins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum MathFunction {
    /// The square root, correctly rounded; NaN for negative numbers.
    Sqrt,
    /// `e^x`
    Exp,
    /// The natural logarithm. -infinity for 0, NaN for negative numbers.
    Log,
    /// The logarithm with base 2. -infinity for 0, NaN for negative numbers.
    Log2,
    /// The logarithm with base 10. -infinity for 0, NaN for negative numbers.
    Log10,
    /// The sine of an angle in radians; NaN for infinity.
    Sin,
    /// The cosine of an angle in radians; NaN for infinity.
    Cos,
    /// The tangent of an angle in radians; NaN for infinity.
    Tan,
    /// The angle in `-pi/2..=pi/2` whose sine is `x`; NaN beyond -1 and 1.
    Asin,
    /// The angle in `0..=pi` whose cosine is `x`; NaN beyond -1 and 1.
    Acos,
    /// The angle of the point `(y, x)` from -pi to pi, like `atan2(x, y)` of C.
    Atan2,
    /// `x^y`, the operator `^`: like `pow` of C.
    ///
    /// The result is exact if `y` is an integer and the power is a float; else it is within 1.5
    /// units in the last place. It is NaN for a negative `x` and a `y` that is not an integer;
    /// `x^0` and `1^y` are 1 even for NaN.
    Power,
}

/// Sets `x` to the result of a function, given by its number in [`MathFunction`]. The arguments are `x`
/// and, if the function has two, `y`.
pub fn function<P: Profile, C: ByteCode>(function: u8, x: &mut Float<P>, y: &Float<P>) {
    let quarters = function.wrapping_sub(MathFunction::Sin as u8);
    if IS_WIDE && P::FULL && quarters < 2 && sine_quickly::<P, C>(x, quarters) {
        return;
    }
    if function == MathFunction::Power as u8 || !x.is_nan() {
        calculate::<P, C>(start::<P, C>(function), x, y);
    }
}
