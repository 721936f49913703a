//! Turns sequences that occur several times into routines.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;

use crate::fixed::Fixed;
use crate::listing::{AsmInstruction, Listing, ListingLine, is_mark};

/// The most instructions of a sequence.
const LENGTH_MAX: usize = 16;
/// Bytes of a short call.
const CALL: usize = 2;
/// The bytes that a routine must save at least.
const WORTH: usize = 2;

/// A function with this number of calls is assumed to run often.
const BUSY: usize = 8;

/// Moves repeated sequences into routines, those that save most first, and returns the routines.
/// The sequences may contain calls of functions that are not `on_stack`.
pub fn outline(
    listing: &mut Listing,
    is_hot: &dyn Fn(&str) -> bool,
    on_stack: &HashSet<String>,
) -> String {
    let busy = busy(listing);
    let stays = |symbol: &str| is_hot(symbol) || busy.contains(symbol);
    let mut text = String::new();
    let mut number = 0;
    loop {
        let runs = runs(listing, &stays, on_stack);
        let Some(best) = best(listing, &runs) else { break };
        let _ = writeln!(text, "\t.section\t.text.sequence_{number},\"ax\",@progbits");
        let _ = writeln!(text, "__sequence_{number}:");
        for line in &best[0] {
            if let Some(code) = listing.code(*line) {
                let _ = writeln!(text, "{code}");
            }
        }
        text.push_str("\tret\n");
        for place in &best {
            for line in place {
                listing.remove(*line);
            }
            let call = AsmInstruction::new("call", &format!("__sequence_{number}"));
            listing.lines[place[0]] = ListingLine::Code(call);
        }
        listing.compact();
        number += 1;
    }
    text
}

/// Returns the functions that are called from many places.
fn busy(listing: &Listing) -> HashSet<String> {
    let mut calls: HashMap<&str, usize> = HashMap::new();
    for line in &listing.lines {
        if let ListingLine::Code(code) = line
            && code.name == "call"
        {
            *calls.entry(&code.operands).or_default() += 1;
        }
    }
    calls.retain(|_, calls| *calls >= BUSY);
    calls.into_keys().map(String::from).collect()
}

/// Returns runs of successive instructions that may be moved, by their lines.
fn runs(
    listing: &Listing,
    is_hot: &dyn Fn(&str) -> bool,
    on_stack: &HashSet<String>,
) -> Vec<Vec<usize>> {
    let mut runs = Vec::new();
    let fixed = Fixed::of(listing);
    for function in listing.functions() {
        if is_hot(&function.symbol) {
            continue;
        }
        let mut run = Vec::new();
        let mut after_skip = false;
        for line in function.start..function.end {
            let ends = match &listing.lines[line] {
                ListingLine::Code(code) => {
                    let skipped = std::mem::replace(&mut after_skip, code.skips());
                    let moves = is_movable(code, on_stack) && !skipped && !fixed.is_fixed(line);
                    if moves {
                        run.push(line);
                    }
                    !moves
                }
                ListingLine::Label(label) => !is_mark(label),
                ListingLine::Other(_) => false,
            };
            if ends {
                runs.push(std::mem::take(&mut run));
            }
        }
        runs.push(run);
    }
    runs.retain(|run| run.len() > 1);
    runs
}

/// Returns true if an instruction has the same effect in a routine.
fn is_movable(code: &AsmInstruction, on_stack: &HashSet<String>) -> bool {
    let uses_stack = matches!(code.name.as_str(), "push" | "pop")
        || matches!(code.name.as_str(), "in" | "out")
            && (code.operands.contains("61")
                || code.operands.contains("62")
                || code.operands.contains("63"));
    let is_call = code.name == "call"
        && !code.operands.starts_with("__save")
        && !on_stack.contains(&code.operands);
    (is_call || !code.branches())
        && !code.skips()
        && !uses_stack
        && !matches!(code.name.as_str(), "cli" | "sei" | "sleep" | "wdr" | "break")
}

/// Returns the places of the sequence that saves most.
fn best(listing: &Listing, runs: &[Vec<usize>]) -> Option<Vec<Vec<usize>>> {
    let mut most = WORTH;
    let mut best = None;
    // Numbers of the instructions, which take less time to compare than their texts.
    let mut numbers: HashMap<&AsmInstruction, usize> = HashMap::new();
    let mut number = |line: &usize| {
        let next = numbers.len();
        listing.code(*line).map(|code| *numbers.entry(code).or_insert(next))
    };
    let numbered: Vec<Vec<usize>> =
        runs.iter().map(|run| run.iter().filter_map(&mut number).collect()).collect();
    for length in 2..=LENGTH_MAX {
        let mut places: HashMap<&[usize], Vec<&[usize]>> = HashMap::new();
        for (run, numbered) in runs.iter().zip(&numbered) {
            for (window, key) in run.windows(length).zip(numbered.windows(length)) {
                let known = places.entry(key).or_default();
                // Only the first of overlapping places counts.
                let overlaps = known
                    .last()
                    .is_some_and(|last| last[length - 1] >= window[0] && last[0] <= window[0]);
                if !overlaps {
                    known.push(window);
                }
            }
        }
        for at in places.values() {
            let sequence = at[0].iter().filter_map(|line| listing.code(*line));
            let bytes: usize = sequence.map(AsmInstruction::bytes).sum();
            let won = (at.len() * bytes.saturating_sub(CALL)).saturating_sub(bytes + 2);
            // The first of equally good sequences is taken, so that the result is reproducible.
            let is_better = won > most
                || won == most
                    && best.as_ref().is_some_and(|(line, _): &(usize, _)| at[0][0] < *line);
            if is_better {
                most = won;
                let all: Vec<Vec<usize>> = at.iter().map(|place| place.to_vec()).collect();
                best = Some((at[0][0], all));
            }
        }
    }
    best.map(|(_, places)| places)
}
