//! What came of a run, for people and for programs.

use std::collections::BTreeMap;
use std::time::Duration;

use bittybuzz_arena::engine::LinkStatistics;
use bittybuzz_arena::run::{Convergence, Setup, Summary, Verdict};
use serde_json::{Value, json};

use crate::backtrace::Backtrace;
use crate::fault;
use crate::program::Program;

/// The lines of a summary.
pub fn text(setup: &Setup<'_>, summary: &Summary, elapsed: Duration) -> Vec<String> {
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
        let place = &expect.place;
        lines.push(format!(
            "{verdict:<7} {}:{}: {expect}; {}",
            place.path,
            place.line,
            since(convergence)
        ));
        if let Some((robot, number)) = convergence.against {
            lines.push(format!("        robot {} had {number}", setup.id(robot)));
        }
    }
    let LinkStatistics { sent, received, lost, collided, deaf, .. } =
        summary.statistics.all_links();
    let [unread, unsent] = summary.dropped;
    lines.push(format!(
        "frames  {sent} sent, {received} received, {lost} lost, {collided} collided, {deaf} missed while sending"
    ));
    lines.push(format!(
        "queues  {unsent} frames dropped before they were sent, {unread} before they were read"
    ));
    let unusable = summary.unusable.counts().into_iter().filter(|(_, count)| *count > 0);
    let unusable: Vec<String> =
        unusable.map(|(name, count)| format!("{count} {}", name.replace('_', " "))).collect();
    if !unusable.is_empty() {
        lines.push(format!("messages that were of no use: {}", unusable.join(", ")));
    }
    lines.push(format!("contacts {}", summary.statistics.contacts));
    for ((quantity, _), values) in setup.scenario.output.plot.iter().zip(&summary.values) {
        if let Some([mean, min, max]) = values {
            let [mean, min, max] = [mean, min, max].map(|number| (number * 1e3).round() / 1e3);
            lines.push(format!("{quantity} at the end: {min} to {max}, mean {mean}"));
        }
    }
    let faults = summary.faults.len();
    if faults > 0 {
        lines.push(format!("scripts stopped by an error: {faults}"));
    }
    lines
}

fn since(convergence: &Convergence) -> String {
    let Convergence { verdict, first, since, failed_at, .. } = convergence;
    match (since, first, failed_at) {
        (Some(tick), ..) => format!("true for good since {:.1} s", seconds(*tick)),
        (None, _, Some(tick)) => format!("not true at {:.1} s, nor at the end", seconds(*tick)),
        (None, Some(tick), None) => {
            format!("first true at {:.1} s, not at the end", seconds(*tick))
        }
        (None, None, None) if *verdict == Verdict::Open => "not true so far".to_owned(),
        (None, None, None) => "never true".to_owned(),
    }
}

/// The summary as an object.
pub fn json(setup: &Setup<'_>, summary: &Summary) -> Value {
    let expects = setup.scenario.expects.iter().zip(&summary.convergences);
    let expects: Vec<Value> = expects
        .map(|(expect, convergence)| {
            json!({
                "line": expect.place.line,
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
    let faults: Vec<Value> = summary
        .faults
        .iter()
        .map(|fault| {
            let program = setup.programs.get(setup.group(fault.robot));
            let symbols = program.and_then(|program| program.symbols.as_ref());
            let position = fault.record.positions.first().copied();
            let place = symbols.zip(position).and_then(|(symbols, position)| {
                Some((symbols, symbols.position(u32::from(position))?))
            });
            json!({
                "robot": setup.id(fault.robot),
                "time": seconds(fault.record.tick),
                "code": crate::fault::code(fault.record.fault.code),
                "file": place.and_then(|(symbols, place)| symbols.file(place.file)),
                "line": place.map(|(_, place)| place.line),
                "column": place.map(|(_, place)| place.column),
            })
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
    let links = summary.statistics.all_links();
    json!({
        "success": summary.is_success(),
        "seed": summary.seed,
        "robots": summary.robots,
        "seconds": seconds(summary.ticks),
        "expects": expects,
        "plot": plot,
        "frames": {
            "sent": links.sent, "received": links.received, "lost": links.lost, "collided": links.collided,
            "deaf": links.deaf, "dropped_unread": summary.dropped[0], "dropped_unsent": summary.dropped[1],
        },
        "unusable": summary.unusable.counts().into_iter().collect::<BTreeMap<_, _>>(),
        "contacts": summary.statistics.contacts,
        "faults": faults,
    })
}

/// Prints what stopped scripts: one message for all robots with the same fault at the same place.
pub fn faults(setup: &Setup<'_>, programs: &[Program], summary: &Summary) {
    let mut told: Vec<(usize, u16, u8)> = Vec::new();
    let key = |fault: &bittybuzz_arena::run::FaultOf| {
        let fault_code = fault.record.fault.code as u8;
        (setup.group(fault.robot), fault.record.fault.position, fault_code)
    };
    for fault in &summary.faults {
        if told.contains(&key(fault)) {
            continue;
        }
        told.push(key(fault));
        let Some(program) = programs.get(setup.group(fault.robot)) else { continue };
        let record = &fault.record;
        let others = summary.faults.iter().filter(|other| key(other) == key(fault)).count() - 1;
        let (id, time) = (setup.id(fault.robot), seconds(record.tick));
        let note = match others {
            0 => format!("robot {id} stopped at {time:.1} s"),
            1 => format!("robot {id} stopped at {time:.1} s, and another one later"),
            _ => format!("robot {id} stopped at {time:.1} s, and {others} others"),
        };
        let backtrace = Backtrace::new(program, record.positions.clone(), record.entry);
        // Firmware tells only the fault.
        let robot = setup.scenario.groups.get(setup.group(fault.robot)).map(|group| &group.robot);
        let refusal =
            record.refusal.clone().or_else(|| fault::accepted(&record.fault, program, robot));
        fault::report(&record.fault, program, &backtrace, refusal.as_deref(), Some(&note));
    }
}

fn seconds(ticks: u64) -> f64 {
    ticks as f64 / 10.0
}
