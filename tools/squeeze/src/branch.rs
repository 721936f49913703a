//! Makes conditional branches go straight to their targets.
//!
//! LLVM writes `breq near; rjmp far; near:` wherever a target could be out of reach, although most
//! targets are within reach.

use std::collections::HashMap;

use crate::fixed::Fixed;
use crate::listing::{AsmFunction, Listing, ListingLine};

/// Bytes that a conditional branch reaches, counted from the instruction after it (AVR instruction
/// set manual, BRBS).
const REACH: std::ops::RangeInclusive<isize> = -128..=126;

/// Inverts the conditions of branches over a jump whose target the branch itself reaches, and
/// removes the jump.
pub fn straighten(listing: &mut Listing) {
    loop {
        let mut changed = false;
        for function in listing.functions() {
            changed |= straighten_function(listing, &function);
        }
        listing.compact();
        if !changed {
            return;
        }
    }
}

/// Leads branches over a jump to another jump with the same target, if that one is within reach:
/// `breq near; rjmp far; near:` becomes `brne other`, and elsewhere the code has `other: rjmp far`.
pub fn chain(listing: &mut Listing) {
    let mut number = 0;
    let mut fixed = Fixed::of(listing);
    // The last function comes first, so that the line numbers of the others stay valid.
    for function in listing.functions().into_iter().rev() {
        let mut end = function.end;
        let mut from = function.start;
        while let Some((branch, jump, other)) = chained(listing, &fixed, from, function.start, end)
        {
            let label = format!(".Lchain_{number}");
            number += 1;
            if let ListingLine::Code(code) = &mut listing.lines[branch] {
                code.name = opposite(&code.name).unwrap_or_default().into();
                code.operands.clone_from(&label);
            }
            listing.remove(jump);
            listing.lines.insert(other, ListingLine::Label(label));
            fixed.insert(other);
            end += 1;
            // A label that was inserted before the branch has moved the branch by one line.
            from = branch + 1;
        }
    }
    listing.compact();
}

/// Finds the next branch over a jump, from line `from` on, that reaches another jump with the same
/// target. Returns the lines of all three.
fn chained(
    listing: &Listing,
    fixed: &Fixed,
    from: usize,
    start: usize,
    end: usize,
) -> Option<(usize, usize, usize)> {
    let mut at = 0_isize;
    let mut code = Vec::new();
    for line in start..end {
        if let Some(instruction) = listing.code(line) {
            code.push((line, at, instruction));
            at += instruction.bytes() as isize;
        }
    }
    for (number, pair) in code.windows(2).enumerate() {
        let [(branch_at, place, branch), (jump_at, _, jump)] = pair else { continue };
        let is_skipped = number > 0 && code[number - 1].2.skips();
        if *branch_at < from
            || is_skipped
            || fixed.is_fixed(*branch_at)
            || jump.name != "rjmp"
            || opposite(&branch.name).is_none()
            || !leads_to(listing, jump_at + 1, end, &branch.operands)
            || listing.next_code(branch_at + 1, end) != Some(*jump_at)
        {
            continue;
        }
        let other = code.iter().find(|(line, other, code)| {
            let ahead = if other > place { jump.bytes() as isize } else { 0 };
            line != jump_at
                && !fixed.is_fixed(*line)
                && *code == *jump
                && REACH.contains(&(other - place - 2 - ahead))
        });
        if let Some((other, ..)) = other {
            return Some((*branch_at, *jump_at, *other));
        }
    }
    None
}

/// Returns true if all conditional branches of a function reach their targets.
pub fn all_reach(lines: &[ListingLine]) -> bool {
    let places = places(lines);
    let mut at = 0;
    lines.iter().all(|line| {
        let ListingLine::Code(code) = line else { return true };
        at += code.bytes() as isize;
        !code.name.starts_with("br")
            || places.get(&code.operands).is_some_and(|target| REACH.contains(&(target - at)))
    })
}

fn straighten_function(listing: &mut Listing, function: &AsmFunction) -> bool {
    let places = places(&listing.lines[function.start..function.end]);
    let mut changed = false;
    let mut at = 0_isize;
    let mut after_skip = false;
    let mut by_hand = false;
    for number in function.start..function.end {
        listing.lines[number].enters_assembly(&mut by_hand);
        let Some(branch) = listing.code(number).cloned() else { continue };
        at += branch.bytes() as isize;
        let skipped = std::mem::replace(&mut after_skip, branch.skips());
        if skipped || by_hand {
            continue;
        }
        let Some(jump_at) = listing.next_code(number + 1, function.end) else { continue };
        let Some(jump) = listing.code(jump_at).cloned() else { continue };
        let jump_bytes = jump.bytes() as isize;
        let Some(opposite) = opposite(&branch.name) else { continue };
        if jump.name != "rjmp" || !leads_to(listing, jump_at + 1, function.end, &branch.operands) {
            continue;
        }
        let reached = places.get(jump.operands.as_str()).is_some_and(|target| {
            // The jump itself will be removed.
            let ahead = if *target > at { jump_bytes } else { 0 };
            REACH.contains(&(target - at - ahead))
        });
        if reached {
            if let ListingLine::Code(code) = &mut listing.lines[number] {
                code.name = opposite.into();
                code.operands = jump.operands;
            }
            listing.remove(jump_at);
            // The positions of labels still include the jump.
            at += jump_bytes;
            changed = true;
        }
    }
    changed
}

/// Returns true if that label comes before the next instruction.
fn leads_to(listing: &Listing, from: usize, end: usize, wanted: &str) -> bool {
    listing.lines[from..end]
        .iter()
        .take_while(|line| !matches!(line, ListingLine::Code(_)))
        .any(|line| matches!(line, ListingLine::Label(label) if label == wanted))
}

/// Returns the number of bytes before each label.
fn places(lines: &[ListingLine]) -> HashMap<String, isize> {
    let mut places = HashMap::new();
    let mut at = 0;
    for line in lines {
        match line {
            ListingLine::Label(label) => {
                places.insert(label.clone(), at);
            }
            ListingLine::Code(code) => at += code.bytes() as isize,
            ListingLine::Other(_) => {}
        }
    }
    places
}

fn opposite(name: &str) -> Option<&'static str> {
    const PAIRS: [(&str, &str); 7] = [
        ("breq", "brne"),
        ("brcs", "brcc"),
        ("brlo", "brsh"),
        ("brlt", "brge"),
        ("brmi", "brpl"),
        ("brvs", "brvc"),
        ("brts", "brtc"),
    ];
    PAIRS.iter().find_map(|(one, other)| {
        if name == *one {
            Some(*other)
        } else if name == *other {
            Some(*one)
        } else {
            None
        }
    })
}
