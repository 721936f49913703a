//! A table of results of mathematical functions, on computers.
//!
//! The tiny profile has 65,536 floats, so each function of one number has at most as many results.
//! A computer remembers them, which takes a tenth of the time of computing them again. The results
//! are the same for all machines of the process, so the order in which threads write them makes no
//! difference.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use super::maths::MathFunction;

/// The number of functions that have one argument; they come first.
const FUNCTIONS: usize = MathFunction::Atan2 as usize;

/// The bit that marks a place with a known result, which is in the lower half.
const IS_KNOWN: u32 = 1 << 16;

/// For each function and each float, [`IS_KNOWN`] and the result, or 0. Pages of memory that are
/// never accessed are never occupied.
static RESULTS: [AtomicU32; FUNCTIONS << 16] = [const { AtomicU32::new(0) }; FUNCTIONS << 16];

/// Returns the result of a function, given by its number in [`MathFunction`]. Computes the result if it
/// is not known.
pub(crate) fn remember(function: u8, argument: u16, compute: impl FnOnce() -> u16) -> u16 {
    let Some(place) = RESULTS.get(usize::from(function) << 16 | usize::from(argument)) else {
        return compute();
    };
    let known = place.load(Relaxed);
    if known & IS_KNOWN != 0 {
        return known as u16;
    }
    let result = compute();
    place.store(IS_KNOWN | u32::from(result), Relaxed);
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_result_is_computed_once() {
        // No machine computes the logarithm of this NaN.
        let (function, argument) = (MathFunction::Log10 as u8, 0x7FFF);
        assert_eq!(remember(function, argument, || 0), 0);
        assert_eq!(remember(function, argument, || 5), 0);
        assert_eq!(remember(function, argument - 1, || 6), 6);
    }

    #[test]
    fn functions_of_two_numbers_are_not_remembered() {
        let function = MathFunction::Atan2 as u8;
        assert_eq!([1, 2].map(|result| remember(function, 7, || result)), [1, 2]);
    }
}
