//! Blocks in an order that needs fewer jumps.
//!
//! A jump to code that nothing else falls into is not needed if that code stands behind it.

use crate::branch;
use crate::listing::{Line, Listing};

/// Moves code to where it is jumped from, where all conditional branches still reach their targets.
pub fn arrange(listing: &mut Listing) {
    // From the last function to the first, so that the places of the others stay.
    for function in listing.functions().into_iter().rev() {
        let body = &listing.lines[function.start..function.end];
        if let Some(arranged) = arrange_function(body) {
            listing.lines.splice(function.start..function.end, arranged);
        }
    }
}

/// Lines up to an instruction that ends the flow.
type Chain = Vec<Line>;

fn arrange_function(body: &[Line]) -> Option<Vec<Line>> {
    let mut chains = chains(body)?;
    // Whatever a chain after the first jumps to comes behind it, if it begins a chain.
    let mut number = 0;
    let mut moved = false;
    while number < chains.len() {
        let target = chains[number].last().and_then(jump_target).and_then(|target| {
            (1..chains.len()).find(|other| *other != number && begins_with(&chains[*other], target))
        });
        let Some(target) = target else {
            number += 1;
            continue;
        };
        let mut tried = chains.clone();
        tried[number].pop();
        let rest = std::mem::take(&mut tried[target]);
        tried[number].extend(rest);
        tried.remove(target);
        let lines = tried.concat();
        if branch::all_reach(&lines) {
            chains = tried;
            moved = true;
            if target < number {
                number -= 1;
            }
        } else {
            number += 1;
        }
    }
    moved.then(|| chains.concat())
}

/// The chains of a function; `None` if its last instruction does not end the flow.
fn chains(body: &[Line]) -> Option<Vec<Chain>> {
    let mut chains = vec![Chain::new()];
    let mut after_skip = false;
    let mut by_hand = false;
    for line in body {
        line.enters_assembly(&mut by_hand);
        chains.last_mut()?.push(line.clone());
        if let Line::Code(code) = line {
            let skipped = std::mem::replace(&mut after_skip, code.skips());
            // The programmer's assembly stays together.
            if code.ends_flow() && !skipped && !by_hand {
                chains.push(Chain::new());
            }
        }
    }
    // What stands behind the last is no code.
    let rest = chains.pop()?;
    if rest.iter().any(|line| matches!(line, Line::Code(_))) {
        return None;
    }
    chains.last_mut()?.extend(rest);
    Some(chains)
}

fn jump_target(line: &Line) -> Option<&str> {
    match line {
        Line::Code(code) if code.name == "rjmp" => Some(&code.operands),
        _ => None,
    }
}

fn begins_with(chain: &Chain, wanted: &str) -> bool {
    chain
        .iter()
        .take_while(|line| !matches!(line, Line::Code(_)))
        .any(|line| matches!(line, Line::Label(label) if label == wanted))
}
