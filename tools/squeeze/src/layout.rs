//! Orders blocks so that they need fewer jumps.
//!
//! A jump is not needed if its target follows it directly. A block can be moved there if no other
//! code falls through into it.

use crate::branch;
use crate::listing::{Listing, ListingLine};

/// Moves code after the jump that leads to it, if all conditional branches still reach their
/// targets.
pub fn arrange(listing: &mut Listing) {
    // The last function comes first, so that the line numbers of the others stay valid.
    for function in listing.functions().into_iter().rev() {
        let body = &listing.lines[function.start..function.end];
        if let Some(arranged) = arrange_function(body) {
            listing.lines.splice(function.start..function.end, arranged);
        }
    }
}

/// The lines up to an instruction that ends the flow.
type Chain = Vec<ListingLine>;

fn arrange_function(body: &[ListingLine]) -> Option<Vec<ListingLine>> {
    let mut chains = chains(body)?;
    // The target of a chain's last jump is moved after the chain, if it begins a chain other than
    // the first.
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

/// Splits a function into chains; returns `None` if its last instruction does not end the flow.
fn chains(body: &[ListingLine]) -> Option<Vec<Chain>> {
    let mut chains = vec![Chain::new()];
    let mut after_skip = false;
    let mut by_hand = false;
    for line in body {
        line.enters_assembly(&mut by_hand);
        chains.last_mut()?.push(line.clone());
        if let ListingLine::Code(code) = line {
            let skipped = std::mem::replace(&mut after_skip, code.skips());
            // The programmer's assembly stays together.
            if code.ends_flow() && !skipped && !by_hand {
                chains.push(Chain::new());
            }
        }
    }
    // The lines after the last chain must not be code.
    let rest = chains.pop()?;
    if rest.iter().any(|line| matches!(line, ListingLine::Code(_))) {
        return None;
    }
    chains.last_mut()?.extend(rest);
    Some(chains)
}

fn jump_target(line: &ListingLine) -> Option<&str> {
    match line {
        ListingLine::Code(code) if code.name == "rjmp" => Some(&code.operands),
        _ => None,
    }
}

fn begins_with(chain: &Chain, wanted: &str) -> bool {
    chain
        .iter()
        .take_while(|line| !matches!(line, ListingLine::Code(_)))
        .any(|line| matches!(line, ListingLine::Label(label) if label == wanted))
}
