//! Bounds of a number, as comparisons.
//!
//! A Cortex-M4F has no instruction for `f32::max` and `f32::min`, which return the other number if
//! one is NaN, so each of them is a call. A comparison takes four instructions. NaN as the
//! value gives the bound; a bound is never NaN.

/// Returns the value, or `least` if it is smaller.
pub const fn at_least(value: f32, least: f32) -> f32 {
    if value > least { value } else { least }
}

/// Returns the value, or `most` if it is larger.
pub const fn at_most(value: f32, most: f32) -> f32 {
    if value < most { value } else { most }
}

/// Returns the value between two bounds; `most` wins over a `least` that is larger.
pub const fn within(value: f32, least: f32, most: f32) -> f32 {
    at_most(at_least(value, least), most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bounds_are_those_of_the_core_library(value: f32, least: f32, most: f32) {
            prop_assert_eq!(at_least(value, least), value.max(least));
            prop_assert_eq!(at_most(value, most), value.min(most));
            prop_assert_eq!(within(value, least, most), value.max(least).min(most));
        }
    }

    #[test]
    fn a_value_that_is_no_number_becomes_the_bound() {
        assert_eq!(at_least(f32::NAN, 1.0), 1.0);
        assert_eq!(at_most(f32::NAN, 1.0), 1.0);
        assert_eq!(within(f32::NAN, -1.0, 1.0), -1.0);
    }
}
