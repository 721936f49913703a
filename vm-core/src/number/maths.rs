//! The functions of the library `math`, on binary32.
//!
//! Largest errors in units in the last place of binary32, measured against binary64 (the test
//! `number_maths` does it again):
//!
//! | Function | Error |
//! |---|---|
//! | `sqrt` | 0.5: correctly rounded |
//! | `log`, `log2`, `log10` | 0.6 |
//! | `exp` | 0.7 |
//! | `sin`, `cos`, `tan`, for every finite angle | 0.6 |
//! | `asin`, `acos`, `atan2` | 0.6 |
//! | `^` ([`super::power`]) | 1.5; none where an integer power is a float |
//!
//! In the tiny profile the results of all its 65,536 arguments are the nearest 16-bit floats, but for
//! less than one in ten thousand.

#[cfg(feature = "maths")]
pub use super::exponential::{exp, log, log2, log10};
#[cfg(feature = "maths")]
pub use super::trigonometry::{acos, asin, atan2, cos, sin, tan};
#[cfg(feature = "maths")]
use super::wide::Wide;

/// `math.pi`
pub const PI: f32 = core::f32::consts::PI;

/// The square root, correctly rounded; NaN for negative numbers.
#[cfg(feature = "maths")]
pub fn sqrt(x: f32) -> f32 {
    // Written so that NaN fails.
    let valid = x >= 0.0;
    if !valid {
        f32::NAN
    } else if x == f32::INFINITY {
        x
    } else {
        Wide::from_f32(x).sqrt().to_f32(x.is_sign_negative())
    }
}
