//! Shares ends that several pieces of code have in common: all but one jump there.
//!
//! Sharing costs the two cycles of a jump and no stack, so hot functions take part. Between
//! functions, only ends that leave the function are shared, and only if they do not refer to places
//! in it.

use std::collections::{HashMap, HashSet};

use crate::fixed::Fixed;
use crate::listing::{AsmInstruction, Listing, ListingLine, is_mark};

/// The end of a piece of code: its instructions, from the last to the first.
struct FunctionTail {
    lines: Vec<usize>,
    /// The number of instructions into which no other code leads.
    whole: usize,
    /// The numbers of the instructions that the one before may skip.
    skipped: Vec<usize>,
    /// The last instruction does not jump: the next code follows it.
    falls: bool,
}

/// Shares ends within each function, then between them.
pub fn share(listing: &mut Listing) {
    let mut number = 0;
    while share_once(listing, &mut number) {
        listing.compact();
    }
}

fn share_once(listing: &mut Listing, number: &mut usize) -> bool {
    let mut changed = false;
    let ends = ends(listing, &Fixed::of(listing));
    let mut best: Vec<(usize, &FunctionTail, &FunctionTail, usize)> = Vec::new();
    for group in ends.values() {
        for (at, kept) in group.iter().enumerate() {
            for (other, left) in group.iter().enumerate() {
                if other == at || left.falls {
                    continue;
                }
                let common = common(listing, kept, left);
                // The last instruction becomes the jump, so that it saves nothing.
                let won =
                    left.lines[..common].iter().skip(1).filter_map(|line| listing.code(*line));
                let won: usize = won.map(AsmInstruction::bytes).sum();
                if won > 0 {
                    best.push((won, kept, left, common));
                }
            }
        }
    }
    best.sort_by_key(|(won, kept, left, _)| {
        (std::cmp::Reverse(*won), kept.lines.get(1).copied(), left.lines[0])
    });
    let functions = listing.functions();
    let function_of = |line: usize| {
        functions.iter().position(|function| (function.start..function.end).contains(&line))
    };
    // Each line takes part once; the next round reads everything again.
    let mut touched = HashSet::new();
    let mut edits: Vec<(usize, usize, Vec<usize>)> = Vec::new();
    for (_, kept, left, common) in best {
        let kept_lines = &kept.lines[usize::from(kept.falls)..common];
        let (Some(first), left_lines) = (kept_lines.last(), &left.lines[..common]) else {
            continue;
        };
        if kept_lines.iter().chain(left_lines).any(|line| touched.contains(line)) {
            continue;
        }
        touched.extend(kept_lines.iter().chain(left_lines).copied());
        edits.push((*first, left_lines[0], left_lines.to_vec()));
    }
    // Labels are inserted afterwards, the last one first, so that the line numbers stay valid.
    let mut labels: Vec<(usize, String)> = Vec::new();
    for (first, jump, lines) in edits {
        let is_local = function_of(first) == function_of(jump);
        let (name, label) = if is_local {
            ("rjmp", format!(".Ltail_{number}"))
        } else {
            ("jmp", format!("__tail_{number}"))
        };
        *number += 1;
        for line in &lines {
            listing.remove(*line);
        }
        listing.lines[jump] = ListingLine::Code(AsmInstruction::new(name, &label));
        labels.push((first, label));
        changed = true;
    }
    labels.sort();
    for (first, label) in labels.into_iter().rev() {
        listing.lines.insert(first, ListingLine::Label(label));
    }
    changed
}

/// Returns the number of common instructions that can be removed from `left`.
fn common(listing: &Listing, kept: &FunctionTail, left: &FunctionTail) -> usize {
    let same = |(kept, left): &(&usize, &usize)| listing.code(**kept) == listing.code(**left);
    let from = usize::from(kept.falls);
    let pairs = kept.lines.iter().zip(&left.lines).skip(from).take_while(same).count();
    let mut common = (from + pairs).min(left.whole);
    // The first removed instruction must not be one that may be skipped.
    while common > 1 && left.skipped.contains(&(common - 1)) {
        common -= 1;
    }
    common
}

/// Returns the ends, grouped by their last instruction.
fn ends(listing: &Listing, fixed: &Fixed) -> HashMap<(usize, String), Vec<FunctionTail>> {
    let mut ends: HashMap<(usize, String), Vec<FunctionTail>> = HashMap::new();
    for (number, function) in listing.functions().into_iter().enumerate() {
        for line in function.start..function.end {
            let (key, falls) = match &listing.lines[line] {
                ListingLine::Label(label) if !is_mark(label) => {
                    ((number, format!("rjmp {label}")), true)
                }
                ListingLine::Code(code) if code.name == "rjmp" => {
                    ((number, format!("rjmp {}", code.operands)), false)
                }
                ListingLine::Code(code) if matches!(code.name.as_str(), "ret" | "jmp") => {
                    ((usize::MAX, format!("{} {}", code.name, code.operands)), false)
                }
                _ => continue,
            };
            if fixed.is_fixed(line) {
                continue;
            }
            let leaves = key.0 == usize::MAX;
            if let Some(end) = end(listing, fixed, function.start, line, falls, leaves) {
                ends.entry(key).or_default().push(end);
            }
        }
    }
    ends
}

/// Returns the end whose last line is `last`.
fn end(
    listing: &Listing,
    fixed: &Fixed,
    start: usize,
    last: usize,
    falls: bool,
    leaves: bool,
) -> Option<FunctionTail> {
    const LENGTH_MAX: usize = 40;
    let mut lines = vec![last];
    let mut whole = None;
    for line in (start..last).rev() {
        match &listing.lines[line] {
            ListingLine::Label(label) if !is_mark(label) => {
                whole.get_or_insert(lines.len());
            }
            ListingLine::Code(code) => {
                let is_placed = leaves && code.operands.contains(".L");
                if code.ends_flow() || is_placed || fixed.is_fixed(line) {
                    break;
                }
                if lines.len() == LENGTH_MAX {
                    // The instruction before the first one must be known, because it may skip the
                    // first.
                    lines.pop();
                    break;
                }
                lines.push(line);
            }
            _ => {}
        }
    }
    let skipped: Vec<usize> = (0..lines.len() - 1)
        .filter(|number| listing.code(lines[number + 1]).is_some_and(AsmInstruction::skips))
        .collect();
    if !falls && skipped.contains(&0) {
        return None;
    }
    let whole = whole.unwrap_or(lines.len());
    (lines.len() > 1).then_some(FunctionTail { lines, whole, skipped, falls })
}
