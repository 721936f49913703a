//! The distance measurement of a Kilobot: two amplitudes of a frame's first pulses, and the tables
//! of its calibration.
//!
//! kilolib has two tables per robot, one for each gain of the receiver, with 14 converter readings
//! at gaps of 0, 5, ... 65 mm. No table of a real robot was found in the sources. The tables here
//! fall like the intensity of light that spreads out, saturate where the high gain does, and
//! overlap where kilolib blends the two gains (700 to 900). They affect a distance as on real
//! robots: the result is in whole millimeters, coarser far away, with no table entry beyond the
//! end.

/// Converter readings of the high gain at gaps of 0, 5, ... 65 mm.
const HIGH_GAIN_READINGS: [i32; 14] =
    [1020, 1015, 1008, 998, 975, 920, 850, 780, 710, 650, 600, 560, 530, 508];

/// Converter readings of the low gain at the same gaps.
const LOW_GAIN_READINGS: [i32; 14] =
    [880, 815, 755, 700, 650, 608, 572, 543, 520, 503, 490, 481, 474, 469];

/// Steps per mm in [`Calibration::distances`].
const STEPS_PER_MM: f32 = 8.0;

/// The distance between the middles of robots that touch, in mm, which kilolib adds to the gap.
const TOUCHING_DISTANCE_MM: i32 = 33;

/// A precomputed table from the gap to the measured distance between the middles.
#[derive(Clone, Debug)]
pub(crate) struct Calibration {
    distances: Vec<u8>,
}

impl Calibration {
    pub(crate) fn new() -> Self {
        let distances = (0..(120.0 * STEPS_PER_MM) as u16)
            .map(|step| {
                let gap_mm = f32::from(step) / STEPS_PER_MM;
                distance(reading(&HIGH_GAIN_READINGS, gap_mm), reading(&LOW_GAIN_READINGS, gap_mm))
            })
            .collect();
        Calibration { distances }
    }

    /// Returns the distance that a robot measures for a true gap (mm, errors included): between the
    /// middles, in whole mm.
    pub(crate) fn measure(&self, gap_mm: f32) -> f32 {
        let step = (gap_mm.max(0.0) * STEPS_PER_MM + 0.5) as usize;
        f32::from(self.distances[step.min(self.distances.len() - 1)])
    }
}

/// Returns the converter's reading at a gap. Beyond the table, the last slope continues.
fn reading(table: &[i32; 14], gap_mm: f32) -> i32 {
    let index = ((gap_mm / 5.0) as usize).min(12);
    let (low, high) = (table[index] as f32, table[index + 1] as f32);
    (low + (high - low) * (gap_mm / 5.0 - index as f32)) as i32
}

/// Returns kilolib's estimate of the distance. The gap comes from each gain's table, blended where
/// both are valid.
fn distance(high: i32, low: i32) -> u8 {
    let far = (high < 900).then(|| {
        if high > HIGH_GAIN_READINGS[0] {
            return 0;
        }
        between(
            &HIGH_GAIN_READINGS,
            high,
            HIGH_GAIN_READINGS.iter().skip(1).position(|&entry| high > entry).map_or(13, |i| i + 1),
        )
    });
    let near = (high > 700).then(|| {
        if low > LOW_GAIN_READINGS[0] {
            return 0;
        }
        match LOW_GAIN_READINGS.iter().skip(1).position(|&entry| low > entry) {
            Some(i) => between(&LOW_GAIN_READINGS, low, i + 1),
            None => 90,
        }
    });
    let gap = match (far, near) {
        (Some(far), Some(near)) => (near * (high - 700) + far * (900 - high)) / 200,
        (Some(far), None) => far,
        (None, Some(near)) => near,
        (None, None) => unreachable!("a reading below 900 or above 700 is each reading"),
    };
    (TOUCHING_DISTANCE_MM + gap).clamp(0, 255) as u8
}

/// Returns the gap for a reading between two entries in whole mm, truncated as in kilolib.
fn between(table: &[i32; 14], reading: i32, index: usize) -> i32 {
    5 * index as i32 + 10 * (reading - table[index]) / (2 * (table[index] - table[index - 1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_fall_with_the_distance() {
        for table in [HIGH_GAIN_READINGS, LOW_GAIN_READINGS] {
            assert!(table.windows(2).all(|pair| pair[0] > pair[1]));
        }
    }

    /// The measurement inverts the tables within the truncation of kilolib's whole millimeters and
    /// the converter's steps.
    #[test]
    fn measured_distances_are_close_to_the_true_ones() {
        let calibration = Calibration::new();
        for tenth in 0..700 {
            let gap = tenth as f32 / 10.0;
            let measured = calibration.measure(gap) - 33.0;
            assert!((measured - gap).abs() <= 2.0, "{gap} mm measured as {measured}");
        }
    }

    #[test]
    fn blends_both_gains() {
        // At 800, halfway between 700 and 900, the result is the mean of both tables.
        let (far, near) =
            (between(&HIGH_GAIN_READINGS, 800, 7), between(&LOW_GAIN_READINGS, 520, 9));
        assert_eq!(i32::from(distance(800, 520)), 33 + (far + near) / 2);
    }

    #[test]
    fn the_last_slope_continues_beyond_the_table() {
        assert!(Calibration::new().measure(80.0) > 33.0 + 70.0);
    }
}
