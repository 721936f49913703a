//! The part of a curve's plane in which an expectation wants the curve to be.

use bittybuzz_arena::scenario::{Condition, Expect, ExpectedValue, Of, Reduction, Test, When};

use crate::page_event::BandDescription;

/// Returns the band of an expectation; `None` if its values are not those of the curve, as a sum is
/// not, or if it does not compare numbers with a range.
pub fn describe(expect: &Expect) -> Option<BandDescription> {
    let Condition { value, of, test, tolerance, .. } = &expect.condition;
    let is_of_curve = match of {
        Of::All | Of::Any | Of::One | Of::AtLeast(_) | Of::Agree => true,
        Of::Reduced(of) => matches!(of, Reduction::Mean | Reduction::Min | Reduction::Max),
        Of::None => false,
    };
    let (low, high) = match test.as_ref().filter(|_| is_of_curve)? {
        Test::Equals(ExpectedValue::Number(number)) => {
            (Some(number - tolerance), Some(number + tolerance))
        }
        Test::Below(number) => (None, Some(*number)),
        Test::Above(number) => (Some(*number), None),
        Test::Between(low, high) => (Some(*low), Some(*high)),
        Test::Equals(_) | Test::Differs(_) | Test::Exists(_) => return None,
    };
    let (from, to) = match expect.when {
        When::At(time) => (time, time),
        When::Within(time) => (0.0, time),
        When::Always(from, to) => (from, to),
    };
    Some(BandDescription { quantity: value.to_string(), from, to, low, high })
}
