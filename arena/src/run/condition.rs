//! The evaluation of conditions on robots, and of numbers that are computed from their values.

use crate::scenario::{AggregateRule, Condition, ExpectedValue, Of, Reduction, Test};
use crate::statistics::quantile;

use super::quantity::QuantityReading;

/// Returns the first of these robots whose value does not pass the test, and the value, if every
/// robot has to pass.
pub fn against<'p>(
    condition: &Condition,
    mut readings: impl Iterator<Item = (usize, QuantityReading<'p>)>,
) -> Option<(usize, f64)> {
    let Condition { of: Of::All, test: Some(test), tolerance, .. } = condition else {
        return None;
    };
    let (robot, reading) = readings.find(|(_, reading)| !passes(test, reading, *tolerance))?;
    Some((robot, reading.number()?))
}

/// Returns true if a condition is true of these readings. nil passes only the test for existence,
/// and agrees with nothing.
pub fn is_true<'p>(
    condition: &Condition,
    readings: impl Iterator<Item = QuantityReading<'p>> + Clone,
) -> bool {
    let Condition { of, test, tolerance, .. } = condition;
    let mut readings = readings;
    let passes = |reading: QuantityReading<'p>| match test {
        Some(test) => passes(test, &reading, *tolerance),
        None => true,
    };
    match of {
        Of::All => readings.all(passes),
        Of::Any => readings.any(passes),
        Of::None if matches!(test, Some(Test::Exists(_))) => !readings.any(passes),
        Of::None => !readings.any(|reading| reading == QuantityReading::Nil || passes(reading)),
        Of::One => readings.filter(|reading| passes(*reading)).take(2).count() == 1,
        Of::AtLeast(count) => {
            let count = *count as usize;
            readings.filter(|reading| passes(*reading)).take(count).count() == count
        }
        Of::Agree => {
            // No robots agree.
            let Some(first) = readings.clone().next() else { return true };
            readings.all(|reading| reading.is_like(&first, *tolerance) && passes(reading))
        }
        Of::Reduced(reduction) => reduce(*reduction, readings)
            .is_some_and(|number| passes(QuantityReading::Number(number))),
    }
}

/// Returns true if a reading passes a test.
pub fn passes(test: &Test, reading: &QuantityReading<'_>, tolerance: f64) -> bool {
    let is_like = |wanted: &ExpectedValue| match wanted {
        ExpectedValue::Number(number) => {
            reading.is_like(&QuantityReading::Number(*number), tolerance)
        }
        ExpectedValue::Text(text) => reading.is_like(&QuantityReading::Text(text), 0.0),
    };
    let number = reading.number();
    match test {
        Test::Equals(wanted) => is_like(wanted),
        Test::Differs(wanted) => *reading != QuantityReading::Nil && !is_like(wanted),
        Test::Below(limit) => number.is_some_and(|number| number < *limit),
        Test::Above(limit) => number.is_some_and(|number| number > *limit),
        Test::Between(low, high) => number.is_some_and(|number| (*low..=*high).contains(&number)),
        Test::Exists(exists) => (*reading != QuantityReading::Nil) == *exists,
    }
}

/// Returns the number of an aggregate of the readings of some robots; `None` if they have none.
/// Robots whose value is nil are left out.
pub fn aggregate<'p>(
    rule: &AggregateRule,
    readings: impl Iterator<Item = QuantityReading<'p>>,
) -> Option<f64> {
    let test = match rule {
        AggregateRule::Reduced(reduction) => return reduce(*reduction, readings),
        AggregateRule::Share(test) | AggregateRule::Count(test) => test,
    };
    let (mut all, mut passed) = (0u32, 0u32);
    for reading in readings.filter(|reading| *reading != QuantityReading::Nil) {
        all += 1;
        passed += u32::from(passes(test, &reading, 0.0));
    }
    match rule {
        AggregateRule::Count(_) => Some(f64::from(passed)),
        _ => (all > 0).then(|| f64::from(passed) / f64::from(all)),
    }
}

/// Reduces many readings to one number; `None` if too few readings are numbers. NaN is no number.
pub fn reduce<'p>(
    reduction: Reduction,
    readings: impl Iterator<Item = QuantityReading<'p>>,
) -> Option<f64> {
    if reduction == Reduction::Different {
        let mut seen: Vec<QuantityReading<'p>> = Vec::new();
        for reading in readings {
            if reading != QuantityReading::Nil && !seen.contains(&reading) {
                seen.push(reading);
            }
        }
        return (!seen.is_empty()).then_some(seen.len() as f64);
    }
    let numbers = readings.filter_map(|reading| reading.number());
    let numbers = numbers.filter(|number| !number.is_nan());
    match reduction {
        Reduction::Quantile(share) => {
            let mut sorted: Vec<f64> = numbers.collect();
            sorted.sort_unstable_by(f64::total_cmp);
            return quantile(&sorted, share);
        }
        Reduction::Sd => return deviation(&numbers.collect::<Vec<f64>>()),
        _ => {}
    }
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
    for number in numbers {
        count += 1.0;
        sum += number;
        squares += number * number;
        min = min.min(number);
        max = max.max(number);
    }
    (count > 0.0).then_some(match reduction {
        Reduction::Mean => sum / count,
        Reduction::MeanSquare => squares / count,
        Reduction::Sum => sum,
        Reduction::Min => min,
        Reduction::Max => max,
        Reduction::Spread | Reduction::Different | Reduction::Quantile(_) | Reduction::Sd => {
            max - min
        }
    })
}

/// Returns the standard deviation of a sample; `None` for fewer than two numbers.
fn deviation(numbers: &[f64]) -> Option<f64> {
    let count = numbers.len() as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    // The sum of squared deviations is exact where the difference of two large sums is not.
    let squared: f64 = numbers.iter().map(|number| (number - mean) * (number - mean)).sum();
    (numbers.len() > 1).then(|| (squared / (count - 1.0)).sqrt())
}
