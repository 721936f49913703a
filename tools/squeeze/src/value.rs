//! Tracks registers with equal values, and removes copies, constants and comparisons that are not
//! needed.
//!
//! LLVM allocates the registers of each function separately and moves values to the registers that
//! calls require. Redundant code is found within each block, and across its end if no other code
//! leads there.

use std::collections::HashMap;

use crate::effect::{InstructionEffect, Set, register};
use crate::flow::RegisterFlow;
use crate::listing::{AsmFunction, AsmInstruction, Listing, ListingLine, is_mark};

/// Simplifies until nothing changes any more.
pub fn simplify(listing: &mut Listing) {
    loop {
        let mut changed = false;
        let flow = RegisterFlow::of(listing);
        for function in listing.functions() {
            changed |= reuse(listing, &function, &flow);
        }
        let flow = RegisterFlow::of(listing);
        for function in listing.functions() {
            changed |= remove_dead(listing, &function, &flow);
        }
        listing.compact();
        if !changed {
            return;
        }
    }
}

/// Removes instructions whose results are not read.
fn remove_dead(listing: &mut Listing, function: &AsmFunction, flow: &RegisterFlow) -> bool {
    let mut changed = false;
    let mut after_skip = false;
    let mut by_hand = false;
    for line in function.start..function.end {
        listing.lines[line].enters_assembly(&mut by_hand);
        let Some(code) = listing.code(line) else { continue };
        let skipped = std::mem::replace(&mut after_skip, code.skips());
        let is_dead = InstructionEffect::of(code)
            .is_some_and(|effect| !effect.acts && effect.writes.is_apart(flow.after(line)));
        if is_dead && !skipped && !by_hand {
            listing.remove(line);
            changed = true;
        }
    }
    changed
}

/// Reads from the registers that held a value first, and removes moves of values that are already
/// there.
fn reuse(listing: &mut Listing, function: &AsmFunction, flow: &RegisterFlow) -> bool {
    let mut changed = false;
    let has_zero = !is_interrupt(listing, function);
    let mut values = Values::unknown(has_zero);
    let mut after_skip = false;
    // True after a comparison, while no later instruction has changed the flags.
    let mut compared = false;
    let mut by_hand = false;
    for line in function.start..function.end {
        listing.lines[line].enters_assembly(&mut by_hand);
        let code = match &listing.lines[line] {
            ListingLine::Label(label) => {
                if !is_mark(label) {
                    values = Values::unknown(has_zero);
                    compared = false;
                }
                continue;
            }
            ListingLine::Code(code) => code.clone(),
            ListingLine::Other(_) => continue,
        };
        let skipped = std::mem::replace(&mut after_skip, code.skips());
        let Some(effect) = InstructionEffect::of(&code) else {
            values.forget(if is_call(&code) { Set::CALL_USED } else { Set::ALL });
            compared = false;
            continue;
        };
        if skipped || by_hand {
            values.forget(effect.writes);
            compared = false;
            continue;
        }
        let after = flow.after(line);
        if values.has_done(&code)
            || compared && code.name == "cpc" && values.are_zero(&code) && after.is_apart(Set::REST)
        {
            listing.remove(line);
            changed = true;
            continue;
        }
        let better = values.better(&code, after);
        if better != code {
            changed = true;
            listing.lines[line] = ListingLine::Code(better.clone());
        }
        values.follow(&better);
        match better.name.as_str() {
            "cp" | "cpi" => compared = true,
            _ if !effect.writes.is_apart(Set::FLAGS) => compared = false,
            _ => {}
        }
    }
    changed
}

fn is_call(code: &AsmInstruction) -> bool {
    matches!(code.name.as_str(), "call" | "rcall")
}

/// Returns true for the handler of an interrupt, which finds any value in r1.
fn is_interrupt(listing: &Listing, function: &AsmFunction) -> bool {
    let mut code = (function.start..function.end).filter_map(|line| listing.code(line));
    code.any(|code| code.name == "reti")
}

/// The values of the registers. Registers with the same number hold the same value; numbers below
/// 256 are constants.
struct Values {
    of: [u32; 32],
    /// The time at which each register got its value.
    since: [u32; 32],
    next: u32,
    texts: HashMap<String, u32>,
}

impl Values {
    /// Starts with unknown values, except that r1 is zero if `has_zero` is true.
    fn unknown(has_zero: bool) -> Self {
        let mut of = std::array::from_fn(|number| 256 + number as u32);
        if has_zero {
            of[1] = 0;
        }
        Values { of, since: [0; 32], next: 256 + 32, texts: HashMap::new() }
    }

    fn forget(&mut self, registers: Set) {
        for register in registers.registers() {
            let value = self.next;
            self.next += 1;
            self.set(register, value);
        }
    }

    fn set(&mut self, register: u8, value: u32) {
        self.next += 1;
        self.of[usize::from(register)] = value;
        self.since[usize::from(register)] = self.next;
    }

    fn at(&self, register: u8) -> u32 {
        self.of[usize::from(register)]
    }

    /// Returns the register that an instruction writes and its new value, if that is known.
    fn made(&mut self, code: &AsmInstruction) -> Option<(u8, u32)> {
        let (first, second) = operands(code);
        let to = register(first)?;
        let held = self.at(to);
        let number = || second.parse::<i32>().ok().map(|number| u32::from(number as u8));
        let value = match code.name.as_str() {
            "mov" => self.at(register(second)?),
            "ldi" => match number() {
                Some(number) => number,
                None => {
                    let next = &mut self.next;
                    *self.texts.entry(second.to_owned()).or_insert_with(|| {
                        *next += 1;
                        *next
                    })
                }
            },
            "clr" => 0,
            "eor" | "sub" if first == second => 0,
            "andi" if number() == Some(0) || held == 0 => 0,
            "andi" if held < 256 => held & number()?,
            "ori" if held < 256 => held | number()?,
            "ori" if number() == Some(0) => held,
            "and" if held == 0 || self.at(register(second)?) == 0 => 0,
            "or" if held == 0 => self.at(register(second)?),
            "or" | "eor" if self.at(register(second)?) == 0 => held,
            "swap" if held == 0 => 0,
            _ => return None,
        };
        Some((to, value))
    }

    /// Returns true if the instruction would change no register.
    fn has_done(&self, code: &AsmInstruction) -> bool {
        let (first, second) = operands(code);
        let (Some(to), from) = (register(first), register(second)) else { return false };
        match (code.name.as_str(), from) {
            ("mov", Some(from)) => self.at(to) == self.at(from),
            ("movw", Some(from)) => {
                self.at(to) == self.at(from) && self.at(to + 1) == self.at(from + 1)
            }
            ("ldi", _) => match second.parse::<i32>() {
                Ok(number) => self.at(to) == u32::from(number as u8),
                Err(_) => self.texts.get(second).is_some_and(|value| self.at(to) == *value),
            },
            _ => false,
        }
    }

    /// Returns true if the instruction compares zero with zero.
    fn are_zero(&self, code: &AsmInstruction) -> bool {
        let (first, second) = operands(code);
        let zero = |operand| register(operand).is_some_and(|register| self.at(register) == 0);
        zero(first) && zero(second)
    }

    /// Returns the same instruction with operands in registers that held the values earlier.
    fn better(&mut self, code: &AsmInstruction, after: Set) -> AsmInstruction {
        let (first, second) = operands(code);
        let (mut first, mut second) = (first.to_owned(), second.to_owned());
        let writes = InstructionEffect::of(code).map_or(Set::ALL, |effect| effect.writes);
        // A known result is loaded or copied instead, if no flag is needed. All zeros thereby get
        // the same form.
        if writes.and(Set::FLAGS).is_apart(after)
            && code.name != "ldi"
            && let Some((to, value)) = self.made(code)
        {
            let held = (0..32).filter(|other| *other != to && self.at(*other) == value);
            if value < 256 && to >= 16 {
                return AsmInstruction::new("ldi", &format!("r{to}, {value}"));
            } else if let Some(from) = held.min_by_key(|other| self.since[usize::from(*other)]) {
                return AsmInstruction::new("mov", &format!("r{to}, r{from}"));
            }
        }
        match code.name.as_str() {
            "mov" | "add" | "adc" | "sub" | "sbc" | "and" | "or" | "eor" | "st" | "std" | "sts"
            | "out"
                if first != second =>
            {
                second = self.oldest(&second, 0);
            }
            "movw" => second = self.oldest_pair(&second),
            "cp" | "cpc" => {
                first = self.oldest(&first, 0);
                second = self.oldest(&second, 0);
            }
            "tst" | "push" | "sbrc" | "sbrs" => first = self.oldest(&first, 0),
            "cpi" => first = self.oldest(&first, 16),
            _ => {}
        }
        let operands = if second.is_empty() { first } else { format!("{first}, {second}") };
        AsmInstruction::new(&code.name, &operands)
    }

    /// Returns the register, from `least` on, that has held the value of the operand longest.
    fn oldest(&self, operand: &str, least: u8) -> String {
        let Some(number) = register(operand) else { return operand.to_owned() };
        let value = self.at(number);
        let same = (least..32).filter(|other| self.at(*other) == value);
        let oldest = same.min_by_key(|other| (self.since[usize::from(*other)], *other != number));
        format!("r{}", oldest.unwrap_or(number))
    }

    fn oldest_pair(&self, operand: &str) -> String {
        let Some(number) = register(operand) else { return operand.to_owned() };
        let values = [self.at(number), self.at(number + 1)];
        let same =
            (0..32).step_by(2).filter(|other| [self.at(*other), self.at(*other + 1)] == values);
        let since =
            |other: u8| self.since[usize::from(other)].max(self.since[usize::from(other + 1)]);
        let oldest = same.min_by_key(|other| (since(*other), *other != number));
        format!("r{}", oldest.unwrap_or(number))
    }

    /// Updates the values after an instruction.
    fn follow(&mut self, code: &AsmInstruction) {
        let (first, second) = operands(code);
        if code.name == "movw" {
            if let (Some(to), Some(from)) = (register(first), register(second)) {
                let [low, high] = [self.at(from), self.at(from + 1)];
                self.set(to, low);
                self.set(to + 1, high);
            }
            return;
        }
        if let Some((to, value)) = self.made(code) {
            if self.at(to) != value {
                self.set(to, value);
            }
            return;
        }
        if let Some(effect) = InstructionEffect::of(code) {
            self.forget(effect.writes);
        }
    }
}

fn operands(code: &AsmInstruction) -> (&str, &str) {
    match code.operands.split_once(',') {
        Some((first, second)) => (first.trim(), second.trim()),
        None => (code.operands.trim(), ""),
    }
}
