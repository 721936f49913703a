//! Removes unused labels and comparisons.

use std::collections::HashSet;

use crate::listing::{AsmFunction, Listing, ListingLine, is_mark};

/// Removes labels to which nothing leads, so that the code around them becomes one block.
pub fn remove_labels(listing: &mut Listing) {
    for function in listing.functions() {
        let used = used_labels(listing, &function);
        let mut by_hand = false;
        for line in function.start..function.end {
            listing.lines[line].enters_assembly(&mut by_hand);
            let is_unused = !by_hand
                && matches!(&listing.lines[line],
                ListingLine::Label(label) if !is_mark(label) && !used.contains(label));
            if is_unused {
                listing.remove(line);
            }
        }
    }
    listing.compact();
}

fn used_labels(listing: &Listing, function: &AsmFunction) -> HashSet<String> {
    let mut used = HashSet::new();
    for line in &listing.lines[function.start..function.end] {
        let text = match line {
            ListingLine::Code(code) => &code.operands,
            ListingLine::Other(text) => text,
            ListingLine::Label(_) => continue,
        };
        let words = text.split(|c: char| !(c.is_alphanumeric() || c == '.' || c == '_'));
        used.extend(words.filter(|word| word.starts_with(".L")).map(String::from));
    }
    used
}

/// Removes comparisons whose result is already in the flags.
pub fn remove_comparisons(listing: &mut Listing) {
    for function in listing.functions() {
        // The instructions since the last label, the last of them last.
        let mut before: Vec<usize> = Vec::new();
        let mut after_skip = false;
        let mut by_hand = false;
        for line in function.start..function.end {
            listing.lines[line].enters_assembly(&mut by_hand);
            let code = match &listing.lines[line] {
                ListingLine::Label(label) if !is_mark(label) => {
                    before.clear();
                    continue;
                }
                ListingLine::Code(code) => code.clone(),
                _ => continue,
            };
            // A skipped instruction may not have set the flags.
            let skipped = std::mem::replace(&mut after_skip, code.skips());
            if skipped || by_hand {
                before.clear();
                continue;
            }
            let behind =
                listing.next_code(line + 1, function.end).and_then(|next| listing.code(next));
            let is_known = match before.as_slice() {
                _ if code.name != "cpi" => false,
                // The comparison before a branch that was not taken was the same.
                [.., compared, branch] if listing.code(*compared) == Some(&code) => {
                    listing.code(*branch).is_some_and(|branch| branch.name.starts_with("br"))
                }
                // The instruction before has set Z by the same register.
                [.., made] => {
                    let zero = code.operands.strip_suffix(", 0");
                    let made = listing.code(*made);
                    matches!((zero, made), (Some(register), Some(made))
                        if sets_zero(&made.name) && made.operands.split(',').next() == Some(register))
                        && behind.is_some_and(|next| matches!(next.name.as_str(), "breq" | "brne"))
                        && !listing.is_branch_behind_branch(line, function.end)
                }
                [] => false,
            };
            if is_known {
                listing.remove(line);
            } else {
                before.push(line);
            }
        }
    }
    listing.compact();
}

/// Returns true if the instruction sets Z if and only if its first register becomes 0 (AVR
/// instruction set manual).
fn sets_zero(name: &str) -> bool {
    matches!(
        name,
        "and"
            | "andi"
            | "or"
            | "ori"
            | "eor"
            | "com"
            | "neg"
            | "inc"
            | "dec"
            | "sub"
            | "subi"
            | "add"
            | "lsr"
            | "lsl"
    )
}
