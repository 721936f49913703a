//! Compares the low-pass filter with recorded output of Bitcraze's firmware.
//!
//! `flight/tests/vectors/README.md` describes the files. The limit is 1e-4 of the range of each output.

use crate::common::{ColumnErrors, Vectors};
use bittybuzz_flight::filter::Butterworth;

const ERROR_MAX: f64 = 1e-4;

/// All rows are comparable. Sequences carry the state on.
#[test]
fn low_pass_filter_agrees() {
    let vectors = Vectors::read("lowpass").unwrap();
    let mut errors = ColumnErrors::default();
    let mut filter = None;
    for row in vectors.rows() {
        if row.f64("step") == 0.0 {
            filter = Butterworth::new(row.f32("cutoff_hz"), row.f32("rate_hz"), 0.0);
        }
        let filter = filter.as_mut().unwrap();
        let input = row.f32("input");
        let output = if row.bool("reset") {
            filter.reset(input);
            filter.output()
        } else {
            filter.update(input)
        };
        errors.compare(&row, "output", output);
    }
    errors.assert_below("lowpass", ERROR_MAX);
}
