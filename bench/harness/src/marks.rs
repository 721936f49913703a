//! The marks that a program sends while it runs, and their meaning.

use crate::catalogue::BenchScript;
use crate::error::BenchError;
use crate::target::BenchTarget;
use bittybuzz_bench::Mark;
use serde_json::Number;

/// A mark with its value, and the number of cycles or instructions before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MarkRecord {
    pub at: u64,
    pub mark: Mark,
    pub value: u32,
}

/// The marks of a program that has ended.
#[derive(Debug, PartialEq, Eq)]
pub struct ReportedMark {
    /// Counts in the order of `bittybuzz_bench::run`: nothing, loading, two steps; fewer if the
    /// program failed.
    pub counts: Vec<u64>,
    /// The last mark; `value` belongs to it.
    pub mark: Mark,
    pub value: u32,
}

impl ReportedMark {
    /// Evaluates the marks of a run; `None` if they do not belong together.
    pub fn from_events(events: &[MarkRecord]) -> Option<ReportedMark> {
        let (last, pairs) = events.split_last()?;
        let counts = pairs.chunks(2).map(|pair| match pair {
            [begin, end] if (begin.mark, end.mark) == (Mark::Begin, Mark::End) => {
                end.at.checked_sub(begin.at)
            }
            _ => None,
        });
        Some(ReportedMark {
            counts: counts.collect::<Option<_>>()?,
            mark: last.mark,
            value: last.value,
        })
    }

    /// Returns the cost of loading the image.
    pub fn load(&self) -> u64 {
        self.count(1)
    }

    /// Returns the cost of each of the two steps.
    pub fn steps(&self) -> [u64; 2] {
        [self.count(2), self.count(3)]
    }

    /// Returns the cost of a step.
    pub fn step(&self) -> u64 {
        let [second, third] = self.steps();
        (second + third) / 2
    }

    /// Returns true if both steps cost the same, except for one instruction, by which QEMU may be
    /// wrong.
    pub fn is_steady(&self) -> bool {
        self.count(2).abs_diff(self.count(3)) <= 1
    }

    /// Returns a count without the cost of marking.
    fn count(&self, index: usize) -> u64 {
        let count = |index| self.counts.get(index).copied().unwrap_or(0);
        u64::saturating_sub(count(index), count(0))
    }

    /// Returns the result, or an error if it is not the expected one.
    pub fn result(&self, target: BenchTarget, script: &BenchScript) -> Result<Number, BenchError> {
        let (target_name, name) = (target.name(), script.name.clone());
        let result = match self.mark {
            Mark::Integer => Some(Number::from(self.value as i32)),
            Mark::Float => Number::from_f64(f64::from(f32::from_bits(self.value))),
            _ => None,
        };
        match result {
            Some(result) if result == script.result => Ok(result),
            Some(result) => Err(BenchError::WrongResult {
                target: target_name,
                name,
                result: result.to_string(),
                expected: script.result.to_string(),
            }),
            None => {
                let (mark, value) = (self.mark, self.value);
                Err(BenchError::NoResult { target: target_name, name, mark, value })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(at: u64, mark: Mark) -> MarkRecord {
        MarkRecord { at, mark, value: 7 }
    }

    #[test]
    fn marks_are_taken_off_and_steps_averaged() {
        let times = [(10, 14), (20, 124), (200, 304), (400, 506)];
        let mut events: Vec<MarkRecord> = times
            .iter()
            .flat_map(|(begin, end)| [event(*begin, Mark::Begin), event(*end, Mark::End)])
            .collect();
        events.push(event(600, Mark::Integer));
        let told = ReportedMark::from_events(&events).unwrap();
        assert_eq!((told.load(), told.step()), (100, 101));
        assert_eq!((told.mark, told.value), (Mark::Integer, 7));
    }

    #[test]
    fn marks_must_belong_together() {
        assert_eq!(ReportedMark::from_events(&[]), None);
        assert_eq!(
            ReportedMark::from_events(&[event(1, Mark::Begin), event(2, Mark::Fault)]),
            None
        );
        let wrong = [event(1, Mark::End), event(2, Mark::Begin), event(3, Mark::Integer)];
        assert_eq!(ReportedMark::from_events(&wrong), None);
    }
}
