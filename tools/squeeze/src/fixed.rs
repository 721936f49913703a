//! Code with fixed timing: no pass may insert anything between its instructions.
//!
//! * Programmer's assembly, between `;APP` and `;NO_APP`: its author may count cycles. Blocks that
//!   only compute with registers and read flash are treated like other code: they have no effect
//!   outside of the registers, so their timing does not matter.
//! * Code that runs while interrupts are off, from `cli` to the restore of SREG, because it delays
//!   interrupts.
//! * Two writes within four cycles to a register that the chip protects in this way, such as WDTCSR.

use std::collections::{HashMap, HashSet};

use crate::effect::{InstructionEffect, number};
use crate::listing::{AsmFunction, AsmInstruction, Listing, ListingLine, is_mark};

/// Addresses of EECR, MCUCR, SPMCSR, WDTCSR and CLKPR. The second of two writes must follow within
/// four cycles (data sheet of the ATmega328P, 8.6.3, 13.4.1, 26.3.1, 10.9.2, 8.12.2).
pub const TIMED: [u16; 5] = [0x3f, 0x55, 0x57, 0x60, 0x61];
/// The cycles within which the second write must come.
const WINDOW: usize = 4;

/// Lines with fixed timing, one mark for each line of the listing.
pub struct Fixed {
    marks: Vec<bool>,
}

impl Fixed {
    /// Finds the fixed lines of all functions.
    pub fn of(listing: &Listing) -> Fixed {
        let mut marks = vec![false; listing.lines.len()];
        let functions = listing.functions();
        // Functions that return with interrupts off, as `critical_section::acquire` does.
        let mut leave_off: HashSet<String> = HashSet::new();
        loop {
            let before = leave_off.len();
            for function in &functions {
                if mark_off(listing, function, &leave_off, &mut marks) {
                    leave_off.insert(function.symbol.clone());
                }
            }
            if leave_off.len() == before {
                break;
            }
        }
        for function in &functions {
            mark_by_hand(listing, function, &mut marks);
            mark_timed(listing, function, &mut marks);
        }
        Fixed { marks }
    }

    /// Updates the marks for a label that is inserted before that line.
    pub fn insert(&mut self, line: usize) {
        self.marks.insert(line, false);
    }

    /// Returns true if nothing may be inserted between that line and its neighbors.
    pub fn is_fixed(&self, line: usize) -> bool {
        self.marks.get(line).copied().unwrap_or(false)
    }
}

/// Removes `;APP` and `;NO_APP` around assembly that touches only registers, flags and flash, so
/// that it becomes a part of the code around it.
pub fn release_assembly(listing: &mut Listing) {
    let mut block = None;
    for line in 0..listing.lines.len() {
        let mut by_hand = block.is_some();
        listing.lines[line].enters_assembly(&mut by_hand);
        match (block, by_hand) {
            (None, true) => block = Some(line),
            (Some(start), false) => {
                if listing.lines[start + 1..line].iter().all(is_inward) {
                    listing.remove(start);
                    listing.remove(line);
                }
                block = None;
            }
            _ => {}
        }
    }
    listing.compact();
}

/// Returns true if a line affects only registers and flags. `lpm` reads flash, which never changes.
fn is_inward(line: &ListingLine) -> bool {
    match line {
        ListingLine::Code(code) => {
            code.name == "lpm" || InstructionEffect::of(code).is_some_and(|effect| !effect.acts)
        }
        ListingLine::Label(label) => is_mark(label),
        ListingLine::Other(text) => text.trim_start().starts_with(".loc") || text.trim().is_empty(),
    }
}

fn mark_by_hand(listing: &Listing, function: &AsmFunction, marks: &mut [bool]) {
    let mut by_hand = false;
    let lines = &listing.lines[function.start..function.end];
    for (line, mark) in lines.iter().zip(&mut marks[function.start..]) {
        line.enters_assembly(&mut by_hand);
        *mark |= by_hand;
    }
}

/// Marks instructions that may run with interrupts off. Returns true if the function may return
/// with interrupts off.
fn mark_off(
    listing: &Listing,
    function: &AsmFunction,
    leave_off: &HashSet<String>,
    marks: &mut [bool],
) -> bool {
    // Lines before which interrupts may be off.
    let mut is_off = vec![false; function.end - function.start + 1];
    let mut leaves = false;
    let mut open = Vec::new();
    for (line, mark) in marks.iter_mut().enumerate().take(function.end).skip(function.start) {
        let starts = listing.code(line).is_some_and(|code| {
            code.name == "cli" || code.name == "call" && leave_off.contains(&code.operands)
        });
        if starts {
            *mark = true;
            open.push(line + 1);
        }
    }
    if open.is_empty() {
        return false;
    }
    let mut labels: HashMap<&str, usize> = HashMap::new();
    for line in function.start..function.end {
        if let ListingLine::Label(label) = &listing.lines[line] {
            labels.insert(label, line);
        }
    }
    while let Some(line) = open.pop() {
        if line >= function.end || std::mem::replace(&mut is_off[line - function.start], true) {
            continue;
        }
        let Some(code) = listing.code(line) else {
            open.push(line + 1);
            continue;
        };
        marks[line] = true;
        if is_restore(code) {
            continue;
        }
        if code.name == "ret" {
            leaves = true;
        }
        let target = labels.get(code.operands.as_str());
        if code.name == "rjmp" || code.name.starts_with("br") {
            open.extend(target);
        }
        let is_skipped =
            listing.code_before(line, function.start).is_some_and(AsmInstruction::skips);
        if !code.ends_flow() || is_skipped {
            open.push(line + 1);
        }
    }
    leaves
}

/// Returns true for an instruction that turns interrupts on or sets SREG as it was.
fn is_restore(code: &AsmInstruction) -> bool {
    let sets_status = code.name == "out"
        && code.operands.split(',').next().and_then(|to| number(to.trim())) == Some(0x3f);
    sets_status || matches!(code.name.as_str(), "sei" | "reti")
}

fn mark_timed(listing: &Listing, function: &AsmFunction, marks: &mut [bool]) {
    let code: Vec<usize> =
        (function.start..function.end).filter(|line| listing.code(*line).is_some()).collect();
    for (number, line) in code.iter().enumerate() {
        let Some(register) = listing.code(*line).and_then(timed_register) else { continue };
        // Each instruction takes at least one cycle.
        let behind = code[number + 1..].iter().take(WINDOW);
        let second = behind
            .rev()
            .find(|line| listing.code(**line).and_then(timed_register) == Some(register));
        if let Some(second) = second {
            marks[*line..=*second].fill(true);
        }
    }
}

/// Returns the protected register that an instruction writes.
fn timed_register(code: &AsmInstruction) -> Option<u16> {
    let address = code.operands.split(',').next().and_then(|operand| number(operand.trim()))?;
    let address = match code.name.as_str() {
        "sts" => address,
        "out" | "sbi" | "cbi" => address + 0x20,
        _ => return None,
    };
    TIMED.contains(&address).then_some(address)
}
