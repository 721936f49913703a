//! The results of `--checks`, for people and for programs.

use std::cmp::Reverse;

use bittybuzz_arena::robot::checks::{
    Anomaly, Costs, Exact, FailedOperation, Findings, Occurrences, Peak, RobotMoment,
};
use bittybuzz_compiler::symbols::SourceSpan;
use bittybuzz_vm_core::number::Number;
use serde_json::{Value, json};

use crate::program::LoadedProgram;
use crate::report::printable;

/// The most places that are printed; JSON has all.
const PLACES_MAX: usize = 20;

/// The findings of robots with the same script and the same machine.
pub struct CheckFindings<'a> {
    pub findings: &'a Findings,
    pub program: &'a LoadedProgram,
    /// Slots of the machine.
    pub slots: usize,
    /// Entries of stigmergies for which the machine has room.
    pub entries: usize,
    /// Costs of instructions, if they are known.
    pub costs: Option<&'a Costs>,
    /// Ticks per second, to convert the moments of the findings.
    pub ticks_per_second: f64,
    /// True to print the robot of each finding, for runs of several robots.
    pub has_robots: bool,
}

impl CheckFindings<'_> {
    /// Returns the lines of the report.
    pub fn text(&self) -> Vec<String> {
        let places = self.places();
        let mut lines: Vec<String> = places.iter().take(PLACES_MAX).map(|p| self.line(p)).collect();
        let others = &places[places.len().min(PLACES_MAX)..];
        if !others.is_empty() {
            let count = others.iter().map(|(.., found)| found.count).sum();
            let noun = if others.len() == 1 { "place" } else { "places" };
            lines.push(format!("{} other {noun}: {}", others.len(), times(count)));
        }
        if places.is_empty() {
            lines.push(
                "no number wrapped, saturated, was flushed to zero, or became infinite or NaN; each sum had an effect"
                    .to_owned(),
            );
        }
        let Findings { slots, calls, entries, steps, .. } = self.findings;
        if let Some(Peak { value, at }) = slots {
            lines.push(format!("memory     {value} of {} slots{}", self.slots, self.at(*at)));
        }
        if let Some(Peak { value, at }) = calls {
            let noun = if *value == 1 { "function" } else { "functions" };
            lines.push(format!("calls      {value} {noun} deep{}", self.at(*at)));
        }
        if let Some(Peak { value, at }) = entries.filter(|peak| peak.value > 0) {
            lines.push(format!("stigmergy  {value} of {} entries{}", self.entries, self.at(at)));
        }
        match (steps.longest, self.costs) {
            (Some((most, at)), Some(costs)) => {
                let share = 100.0 * most as f64 / costs.step_period.max(1) as f64;
                lines.push(format!(
                    "step       about {} cycles on average, at most {most}{}: {share:.1} % of the time until the next",
                    steps.cycles / steps.steps.max(1),
                    self.at(at)
                ));
            }
            (None, Some(_)) => lines.push("step       none was completed".to_owned()),
            (_, None) => lines.push(
                "step       the cycles of instructions were not counted on this chip".to_owned(),
            ),
        }
        lines
    }

    /// Returns the report as a JSON object.
    pub fn json(&self) -> Value {
        let places: Vec<Value> = self
            .places()
            .into_iter()
            .map(|(position, anomaly, Occurrences { count, first })| {
                let place = self.source(position);
                let FailedOperation { operation, exact, result, at } = first;
                json!({
                    "kind": kind(anomaly),
                    "count": count,
                    "position": position,
                    "file": place.and_then(|place| self.file(place)),
                    "line": place.map(|place| place.line),
                    "column": place.map(|place| place.column),
                    "first": {
                        "operation": operation.to_string(),
                        "exact": match exact {
                            Exact::Int(value) => json!(value),
                            Exact::Real(value) => json!(value),
                            Exact::Unknown => Value::Null,
                        },
                        // JSON has no infinity and no NaN: these are null.
                        "result": match result {
                            Number::Int(value) => json!(value),
                            Number::Float(value) => json!(value),
                        },
                        "time": self.seconds(*at),
                        "robot": at.robot,
                    },
                })
            })
            .collect();
        let peak = |peak: Option<Peak>, of: Option<usize>| {
            peak.map(|Peak { value, at }| {
                json!({ "most": value, "of": of, "time": self.seconds(at), "robot": at.robot })
            })
        };
        let Findings { slots, calls, entries, steps, .. } = self.findings;
        let steps = steps.longest.zip(self.costs).map(|((most, at), costs)| {
            json!({
                "count": steps.steps,
                "mean": steps.cycles as f64 / steps.steps.max(1) as f64,
                "most": most,
                "of": costs.step_period,
                "time": self.seconds(at),
                "robot": at.robot,
            })
        });
        json!({
            "places": places,
            "slots": peak(*slots, Some(self.slots)),
            "calls": peak(*calls, None),
            "entries": peak(*entries, Some(self.entries)),
            "cycles": steps,
        })
    }

    /// Returns the anomalies, the most frequent first.
    fn places(&self) -> Vec<(u16, Anomaly, &Occurrences)> {
        let places = self.findings.places.iter();
        let mut places: Vec<_> =
            places.map(|((position, anomaly), found)| (*position, *anomaly, found)).collect();
        places
            .sort_by_key(|(position, anomaly, found)| (Reverse(found.count), *position, *anomaly));
        places
    }

    fn line(&self, (position, anomaly, found): &(u16, Anomaly, &Occurrences)) -> String {
        let place = match self.source(*position) {
            Some(place) => {
                let file = self.file(place).map_or("<unknown>".to_owned(), printable);
                format!("{file}:{}:{}", place.line, place.column)
            }
            None => format!("position {position} of the code"),
        };
        let verb = match anomaly {
            Anomaly::Wrapped => "wrapped",
            Anomaly::Infinite => "became infinite",
            Anomaly::NotANumber => "became NaN",
            Anomaly::Flushed => "flushed to zero",
            Anomaly::Saturated => "saturated",
            Anomaly::NoEffect => "had no effect",
        };
        let FailedOperation { operation, exact, result, at } = found.first;
        let exact = match exact {
            Exact::Int(value) => format!(" = {value}"),
            Exact::Real(value) => real(value),
            Exact::Unknown => String::new(),
        };
        let result = match result {
            Number::Int(value) => format!(" became {value}"),
            Number::Float(_) => String::new(),
        };
        let times = times(found.count);
        format!("{place}: {verb} {times}, first {operation}{exact}{result}{}", self.at(at))
    }

    fn source(&self, position: u16) -> Option<SourceSpan> {
        self.program.symbols.as_ref()?.position(u32::from(position))
    }

    fn file(&self, place: SourceSpan) -> Option<&str> {
        self.program.symbols.as_ref()?.file(place.file)
    }

    fn seconds(&self, at: RobotMoment) -> f64 {
        at.tick as f64 / self.ticks_per_second
    }

    fn at(&self, at: RobotMoment) -> String {
        let robot = if self.has_robots { format!(", robot {}", at.robot) } else { String::new() };
        format!(" at {:.1} s{robot}", self.seconds(at))
    }
}

/// Returns the name of an anomaly in JSON.
fn kind(anomaly: Anomaly) -> &'static str {
    match anomaly {
        Anomaly::Wrapped => "wrapped",
        Anomaly::Infinite => "infinite",
        Anomaly::NotANumber => "nan",
        Anomaly::Flushed => "flushed",
        Anomaly::Saturated => "saturated",
        Anomaly::NoEffect => "no_effect",
    }
}

fn times(count: u64) -> String {
    match count {
        1 => "once".to_owned(),
        count => format!("{count} times"),
    }
}

/// Returns ` = 1.5e10` with the digits of binary32; an empty text for 0, infinity and NaN.
fn real(value: f64) -> String {
    let near = value as f32;
    if !value.is_finite() || value == 0.0 {
        String::new()
    } else if near.is_normal() {
        format!(" = {near:?}")
    } else {
        format!(" = {value:.6e}")
    }
}
