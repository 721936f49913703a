//! The results of a run, for people and for programs.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::time::Duration;

use bittybuzz_arena::engine::LinkStatistics;
use bittybuzz_arena::robot::{Consequence, FaultCounts, ProgramId};
use bittybuzz_arena::run::{
    self, Convergence, FaultOf, OverrunSummary, Setup, Summary, TICKS_PER_SECOND, Verdict,
};
use bittybuzz_arena::scenario::MeasureTime;
use bittybuzz_compiler::symbols::SourceSpan;
use bittybuzz_fault::{Backtrace, FaultReport, KnownProgram, accepted};
use serde_json::{Map, Value, json};

use crate::program::LoadedProgram;
use crate::report;
use crate::sim::table::rounded;

/// Returns the lines of a summary.
pub fn text(setup: &Setup, summary: &Summary, elapsed: Duration) -> Vec<String> {
    let seconds = seconds(summary.ticks);
    let rate = summary.robots as f64 * seconds / elapsed.as_secs_f64().max(1e-9);
    let mut lines = vec![format!(
        "{} robots, {seconds:.1} s, seed {}: {rate:.0} robot-seconds per second",
        summary.robots, summary.seed
    )];
    for (expect, convergence) in setup.scenario.expects.iter().zip(&summary.convergences) {
        let verdict = match convergence.verdict {
            Verdict::Held => "held",
            Verdict::Failed => "FAILED",
            Verdict::Open => "OPEN",
        };
        let place = &expect.condition.place;
        let name = expect.name.as_ref().map_or(String::new(), |name| format!("{name}: "));
        lines.push(format!(
            "{verdict:<7} {}:{}: {name}{expect}; {}",
            place.path,
            place.line,
            since(convergence)
        ));
        if let Some((robot, number)) = convergence.against {
            lines.push(format!("        robot {} had {number}", setup.id(robot)));
        }
    }
    for (measure, value) in setup.scenario.measures.iter().zip(&summary.measures) {
        let value = match (value, measure.time) {
            (Some(value), MeasureTime::First) => format!("at {value:.1} s"),
            (Some(value), _) => rounded(*value).to_string(),
            (None, MeasureTime::First) => "not reached".to_owned(),
            (None, _) => "none".to_owned(),
        };
        lines.push(format!("measure {}: {value}; {measure}", measure.name));
    }
    let LinkStatistics { sent, received, lost, collided, deaf, .. } =
        summary.statistics.all_links();
    let [unread, unsent] = summary.dropped;
    lines.push(format!(
        "frames  {sent} sent, {received} received, {lost} lost, {collided} collided, {deaf} missed while sending"
    ));
    lines.push(format!(
        "queues  {unsent} frames dropped before they were sent{}, {unread} before they were read{}",
        more_room(unsent, "`out_queue`, `out_long`"),
        more_room(unread, "`in_queue`")
    ));
    let unusable = summary.unusable.counts().into_iter().filter(|(_, count)| *count > 0);
    let unusable: Vec<String> = unusable
        .map(|(name, count)| {
            // Other causes are no matter of room.
            let room =
                if name == "incomplete" { more_room(count, "`in_long`") } else { String::new() };
            format!("{count} {}{room}", name.replace('_', " "))
        })
        .collect();
    if !unusable.is_empty() {
        lines.push(format!("messages that were of no use: {}", unusable.join(", ")));
    }
    lines.push(format!("contacts {}", summary.statistics.contacts));
    if let Some((tick, robot)) = summary.first_crash {
        lines.push(format!(
            "crashes {}, the first of robot {} at {:.1} s",
            summary.statistics.crashes,
            setup.id(robot),
            self::seconds(tick)
        ));
    }
    for ((quantity, _), values) in setup.scenario.output.plot.iter().zip(&summary.values) {
        if let Some([mean, min, max]) = values {
            let [mean, min, max] = [*mean, *min, *max].map(rounded);
            lines.push(format!("{quantity} at the end: {min} to {max}, mean {mean}"));
        }
    }
    let FaultCounts { faults, restarts, handler_faults } = summary.fault_counts;
    if faults > 0 {
        lines.push(format!("scripts stopped by an error: {faults}, started again: {restarts}"));
    }
    if handler_faults > 0 {
        lines.push(format!("listeners and handlers ended by an error: {handler_faults}"));
    }
    lines.extend(overruns(setup, &summary.overruns));
    lines
}

/// Returns the line about steps that took too long; `None` if there were none.
fn overruns(setup: &Setup, overruns: &OverrunSummary) -> Option<String> {
    let OverrunSummary { missed, robots, first } = overruns;
    let (robot, first) = first.as_ref()?;
    let place = first.position.and_then(|position| source_place(setup, first.program, position));
    let place = place.map(|(file, place)| format!(" in {}:{}", file.unwrap_or("?"), place.line));
    Some(format!(
        "steps left out because one before took too long: {missed}, by {robots} {}; first by robot {} at {:.1} s{}",
        if *robots == 1 { "robot" } else { "robots" },
        setup.id(*robot),
        seconds(first.tick),
        place.unwrap_or_default()
    ))
}

/// Returns file and place of a position in the code of a program, if there are symbols.
fn source_place(
    setup: &Setup,
    program: ProgramId,
    position: u16,
) -> Option<(Option<&str>, SourceSpan)> {
    let symbols = setup.program(program)?.symbols.as_ref()?;
    let place = symbols.position(u32::from(position))?;
    Some((symbols.file(place.file), place))
}

fn since(convergence: &Convergence) -> String {
    let Convergence { verdict, first, since, held_at, failed_at, .. } = convergence;
    match (since, first, failed_at) {
        (Some(since), ..) if let Some(held) = held_at.filter(|held| held < since) => {
            later(seconds(held), seconds(*since))
        }
        (Some(tick), ..) => format!("true for good since {:.1} s", seconds(*tick)),
        (None, _, Some(tick)) => format!("not true at {:.1} s, nor at the end", seconds(*tick)),
        (None, Some(tick), None) => {
            format!("first true at {:.1} s, not at the end", seconds(*tick))
        }
        (None, None, None) if *verdict == Verdict::Open => "not true so far".to_owned(),
        (None, None, None) => "never true".to_owned(),
    }
}

/// Describes a condition that was true when it had to be, and false for some time after that.
pub fn later(held: f64, since: f64) -> String {
    format!("true at {held:.1} s, and for good since {since:.1} s")
}

/// Returns the summary as a JSON object.
pub fn json(setup: &Setup, programs: &[Arc<LoadedProgram>], summary: &Summary) -> Value {
    let expects = setup.scenario.expects.iter().zip(&summary.convergences);
    let expects: Vec<Value> = expects
        .map(|(expect, convergence)| {
            json!({
                "line": expect.condition.place.line,
                "name": expect.name,
                "text": expect.to_string(),
                "held": convergence.verdict == Verdict::Held,
                "first": convergence.first.map(seconds),
                "since": convergence.since.map(seconds),
                "against": convergence.against.map(|(robot, number)| {
                    json!({ "robot": setup.id(robot), "value": number })
                }),
            })
        })
        .collect();
    let measures = setup.scenario.measures.iter().zip(&summary.measures);
    let measures: Map<String, Value> =
        measures.map(|(measure, value)| (measure.name.clone(), json!(value))).collect();
    let faults: Vec<Value> = summary
        .faults
        .iter()
        .map(|fault| {
            let position = fault.record.positions.first();
            let place = position.and_then(|at| source_place(setup, fault.record.program, *at));
            let (consequence, pause) = match fault.record.consequence {
                Consequence::Contained => ("contained", None),
                Consequence::Pause(ticks) => ("restart", Some(seconds(ticks.into()))),
                Consequence::Stop => ("stop", None),
            };
            let mut object = described(setup, programs, fault).json();
            object["robot"] = setup.id(fault.robot).into();
            object["time"] = seconds(fault.record.tick).into();
            object["count"] = fault.record.count.into();
            object["consequence"] = consequence.into();
            object["pause"] = pause.into();
            object["file"] = place.and_then(|(file, _)| file).into();
            object["line"] = place.map(|(_, place)| place.line).into();
            object["column"] = place.map(|(_, place)| place.column).into();
            object
        })
        .collect();
    let plot = setup.scenario.output.plot.iter().zip(&summary.values);
    let plot: BTreeMap<String, Value> = plot
        .map(|((quantity, _), values)| {
            let value =
                values.map(|[mean, min, max]| json!({ "mean": mean, "min": min, "max": max }));
            (quantity.to_string(), value.into())
        })
        .collect();
    let first_overrun = summary.overruns.first.as_ref().map(|(robot, first)| {
        let place = first.position.and_then(|at| source_place(setup, first.program, at));
        json!({
            "robot": setup.id(*robot),
            "time": seconds(first.tick),
            "file": place.and_then(|(file, _)| file),
            "line": place.map(|(_, place)| place.line),
            "column": place.map(|(_, place)| place.column),
        })
    });
    let links = summary.statistics.all_links();
    json!({
        "success": summary.is_success(),
        "seed": summary.seed,
        "robots": summary.robots,
        "seconds": seconds(summary.ticks),
        "expects": expects,
        "measures": measures,
        "plot": plot,
        "frames": {
            "sent": links.sent, "received": links.received, "lost": links.lost, "collided": links.collided,
            "deaf": links.deaf, "dropped_unread": summary.dropped[0], "dropped_unsent": summary.dropped[1],
        },
        "unusable": summary.unusable.counts().into_iter().collect::<BTreeMap<_, _>>(),
        "contacts": summary.statistics.contacts,
        "crashes": summary.statistics.crashes,
        "first_crash": summary.first_crash.map(|(tick, robot)| {
            json!({ "time": seconds(tick), "robot": setup.id(robot) })
        }),
        "faults": faults,
        "errors": {
            "faults": summary.fault_counts.faults, "restarts": summary.fault_counts.restarts,
            "handler_faults": summary.fault_counts.handler_faults,
        },
        "overruns": {
            "missed": summary.overruns.missed,
            "robots": summary.overruns.robots,
            "first": first_overrun,
        },
    })
}

/// Prints the faults of scripts: one message for all robots with the same fault at the same place.
pub fn faults(setup: &Setup, programs: &[Arc<LoadedProgram>], summary: &Summary) {
    let key = |fault: &FaultOf| {
        let is_contained = fault.record.consequence == Consequence::Contained;
        let (code, position) = (fault.record.fault.code, fault.record.fault.position);
        (fault.record.program, position, code as u8, is_contained)
    };
    // The faults at each place, in the order of their first ones.
    let mut places: Vec<Vec<&FaultOf>> = Vec::new();
    let mut known = HashMap::new();
    for fault in &summary.faults {
        let place = *known.entry(key(fault)).or_insert(places.len());
        match places.get_mut(place) {
            Some(alike) => alike.push(fault),
            None => places.push(vec![fault]),
        }
    }
    for alike in places {
        let fault = alike[0];
        report::print(described(setup, programs, fault).message(&[note(setup, &alike)]));
    }
}

/// Describes a fault of a robot.
fn described<'a>(
    setup: &'a Setup,
    programs: &'a [Arc<LoadedProgram>],
    FaultOf { robot, record }: &FaultOf,
) -> FaultReport<'a> {
    let of = &*setup.scenario.group(setup.group(*robot)).robot;
    let program = match (programs.get(record.program.0), setup.program(record.program)) {
        (Some(program), _) => program.known(),
        // A program with a question at its end.
        (None, Some(run::Program { image, symbols, sources })) => {
            let (symbols, sources) = (symbols.as_deref(), &**sources);
            KnownProgram { image, profile: of.profile, symbols, sources }
        }
        (None, None) => KnownProgram::UNKNOWN,
    };
    let backtrace = Backtrace::new(program, record.positions.clone(), record.entry);
    // Firmware does not report the accepted arguments.
    let refusal = record.refusal.clone().or_else(|| accepted(&record.fault, program, Some(of)));
    let report = FaultReport::new(&record.fault, backtrace, refusal.as_deref());
    report.with_memory(record.memory.as_ref())
}

/// Describes the first of some faults at one place, and the number of the others.
fn note(setup: &Setup, alike: &[&FaultOf]) -> String {
    let first = alike.first().expect("a fault is like itself");
    let (id, time) = (setup.id(first.robot), seconds(first.record.tick));
    let mut note = match first.record.consequence {
        Consequence::Contained if first.record.program.asked_place().is_some() => {
            format!(
                "a question to robot {id}, or its listener or handler, ended at {time:.1} s, its script went on"
            )
        }
        Consequence::Contained => {
            format!("a listener or handler of robot {id} ended at {time:.1} s, its script went on")
        }
        Consequence::Pause(ticks) => {
            let pause = seconds(ticks.into());
            format!("robot {id} stopped at {time:.1} s, to start again after {pause} s")
        }
        Consequence::Stop => format!("robot {id} stopped at {time:.1} s"),
    };
    note += &match alike.len() - 1 {
        0 => String::new(),
        1 => ", and another one later".to_owned(),
        others => format!(", and {others} others"),
    };
    let total: u32 = alike.iter().map(|fault| fault.record.count).sum();
    if total as usize > alike.len() {
        note += &format!("; {total} times in all");
    }
    note
}

/// Returns the keys of the robot file that give more room, if something was lost.
fn more_room(lost: u64, keys: &str) -> String {
    if lost == 0 { String::new() } else { format!(" (more room: {keys} of the robot file)") }
}

fn seconds(ticks: u64) -> f64 {
    ticks as f64 / TICKS_PER_SECOND
}
