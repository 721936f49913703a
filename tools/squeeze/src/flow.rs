//! Finds the registers and flags that are still read after each instruction.
//!
//! All functions are analyzed together: a call reads the arguments of its callee, and the results
//! of a function are the registers that at least one of its callers reads. Functions outside the
//! listing are unknown, so a call of one reads everything.

use std::collections::{HashMap, HashSet};

use crate::effect::{InstructionEffect, Set};
use crate::listing::{AsmFunction, Listing, ListingLine};

/// The registers and flags that are read after each line of a listing.
pub struct RegisterFlow {
    after: Vec<Set>,
    /// The registers in which each function and its callers exchange values.
    contracts: HashMap<String, FunctionFacts>,
}

/// The knowledge about a function.
#[derive(Clone, Copy, Default)]
pub struct FunctionFacts {
    /// The registers of the caller that the function reads.
    pub arguments: Set,
    /// The registers of the function's result that callers read.
    pub results: Set,
}

impl RegisterFlow {
    /// Analyses all functions.
    pub fn of(listing: &Listing) -> RegisterFlow {
        let functions = listing.functions();
        let outside = known_outside(listing, &functions);
        let mut known: HashMap<&str, FunctionFacts> = HashMap::new();
        for function in &functions {
            let is_outside = outside.contains(function.symbol.as_str());
            let results = if is_outside { Set::RESULTS } else { Set::EMPTY };
            known.insert(&function.symbol, FunctionFacts { arguments: Set::EMPTY, results });
        }
        let mut flow = RegisterFlow {
            after: vec![Set::EMPTY; listing.lines.len()],
            contracts: HashMap::new(),
        };
        let bodies: Vec<FunctionFlow<'_>> =
            functions.iter().map(|function| FunctionFlow::of(listing, function)).collect();
        loop {
            let before = flow.after.clone();
            let mut changed = false;
            for body in &bodies {
                changed |= flow.pass(body, &mut known);
            }
            if !changed && before == flow.after {
                flow.contracts =
                    known.into_iter().map(|(symbol, known)| (symbol.to_owned(), known)).collect();
                return flow;
            }
        }
    }

    /// Returns the registers and flags that are read after that line before they are written.
    pub fn after(&self, line: usize) -> Set {
        self.after[line]
    }

    /// Returns the registers in which each function and its callers exchange values, by symbol.
    pub fn into_contracts(self) -> HashMap<String, FunctionFacts> {
        self.contracts
    }

    /// Traverses a function backwards. Returns true if it found something new about the function or
    /// its callees.
    fn pass<'a>(
        &mut self,
        body: &FunctionFlow<'a>,
        known: &mut HashMap<&'a str, FunctionFacts>,
    ) -> bool {
        let results = known.get(body.symbol).map_or(Set::RESULTS, |known| known.results);
        let mut changed = false;
        let mut before: HashMap<usize, Set> = HashMap::new();
        loop {
            let mut moved = false;
            for (number, step) in body.steps.iter().enumerate().rev() {
                let mut after = match step.end {
                    End::Return => results.or(Set::register(1)),
                    End::Unknown => Set::ALL,
                    End::None => Set::EMPTY,
                };
                for next in &step.next {
                    after = after.or(*before.get(next).unwrap_or(&Set::EMPTY));
                }
                self.after[step.line] = after;
                let here = match (step.called, step.effect) {
                    (Some(callee), _) => match known.get_mut(callee) {
                        Some(callee) => {
                            let read = callee.results.or(after.and(Set::RESULTS));
                            changed |= read != callee.results;
                            callee.results = read;
                            after.without(Set::CALL_USED).or(callee.arguments).or(Set::register(1))
                        }
                        None => Set::ALL,
                    },
                    (None, Some(effect)) if step.is_conditional => after.or(effect.reads),
                    (None, Some(effect)) => after.without(effect.writes).or(effect.reads),
                    (None, None) => Set::ALL,
                };
                if before.insert(number, here) != Some(here) {
                    moved = true;
                }
            }
            if !moved {
                break;
            }
        }
        if let (Some(at), Some(known)) = (before.get(&0), known.get_mut(body.symbol)) {
            changed |= known.arguments != *at;
            known.arguments = *at;
        }
        changed
    }
}

/// Returns the symbols of functions that may have unknown callers: they are visible outside, or
/// their address is taken.
fn known_outside<'a>(listing: &'a Listing, functions: &'a [AsmFunction]) -> HashSet<&'a str> {
    let symbols: HashSet<&str> =
        functions.iter().map(|function| function.symbol.as_str()).collect();
    let mut outside = HashSet::new();
    let mut called = HashSet::new();
    for line in &listing.lines {
        let text = match line {
            ListingLine::Code(code) if matches!(code.name.as_str(), "call" | "rcall") => {
                called.insert(code.operands.as_str());
                continue;
            }
            ListingLine::Code(code) => &code.operands,
            ListingLine::Other(text) => text,
            ListingLine::Label(_) => continue,
        };
        let directive = text.trim_start();
        let is_plain = [".type", ".size", ".section", ".p2align", ".loc", ".asciz"];
        if is_plain.iter().any(|plain| directive.starts_with(plain)) {
            continue;
        }
        let words = text.split(|c: char| !(c.is_alphanumeric() || matches!(c, '.' | '_' | '$')));
        outside.extend(words.filter_map(|word| symbols.get(word)));
    }
    outside.extend(symbols.difference(&called));
    outside
}

/// The instructions of a function and their successors.
struct FunctionFlow<'a> {
    symbol: &'a str,
    steps: Vec<FlowStep<'a>>,
}

struct FlowStep<'a> {
    line: usize,
    effect: Option<InstructionEffect>,
    /// The numbers of the instructions that may be executed next.
    next: Vec<usize>,
    end: End,
    called: Option<&'a str>,
    /// The instruction before may skip this one.
    is_conditional: bool,
}

enum End {
    None,
    Return,
    Unknown,
}

impl<'a> FunctionFlow<'a> {
    fn of(listing: &'a Listing, function: &'a AsmFunction) -> Self {
        let mut labels = HashMap::new();
        let mut lines = Vec::new();
        for line in function.start..function.end {
            match &listing.lines[line] {
                ListingLine::Label(label) => {
                    labels.insert(label.as_str(), lines.len());
                }
                ListingLine::Code(code) => lines.push((line, code)),
                ListingLine::Other(_) => {}
            }
        }
        let mut steps: Vec<FlowStep<'_>> = Vec::new();
        let mut saves = true;
        for (number, (line, code)) in lines.iter().enumerate() {
            let is_conditional = number > 0 && lines[number - 1].1.skips();
            let mut effect = InstructionEffect::of(code);
            // Pushing another register does not save it: it may pass an argument on the stack.
            saves &= code.name == "push"
                && effect.is_some_and(|effect| effect.reads.is_apart(Set::CALL_USED));
            if saves {
                // Saving a register of the caller does not depend on its value.
                effect = effect.map(|effect| InstructionEffect { reads: Set::EMPTY, ..effect });
            }
            let mut next = Vec::new();
            let mut end = End::None;
            let mut called = None;
            match code.name.as_str() {
                "ret" => end = End::Return,
                "call" | "rcall" => called = Some(code.operands.as_str()),
                _ => {}
            }
            if code.name == "rjmp" || code.name.starts_with("br") {
                match target(&code.operands, &labels, number) {
                    Some(target) => next.push(target),
                    None => end = End::Unknown,
                }
            }
            if effect.is_none() && called.is_none() && !matches!(end, End::Return) {
                end = End::Unknown;
            }
            if !code.ends_flow() || is_conditional {
                next.push(number + 1);
            }
            if code.skips() {
                next.push(number + 2);
            }
            if next.iter().any(|next| *next >= lines.len()) {
                end = End::Unknown;
            }
            if code.name == "ret" {
                effect = Some(InstructionEffect::default());
            }
            steps.push(FlowStep { line: *line, effect, next, end, called, is_conditional });
        }
        FunctionFlow { symbol: &function.symbol, steps }
    }
}

/// Returns the number of the instruction to which the branch `number` leads.
fn target(operand: &str, labels: &HashMap<&str, usize>, number: usize) -> Option<usize> {
    match operand.split_once('+') {
        None => labels.get(operand).copied(),
        // LLVM writes this for `rjmp .+0` in an asm! block, which takes two cycles and leads to the
        // next instruction.
        Some((label, "0+2")) if labels.get(label) == Some(&number) => Some(number + 1),
        Some(_) => None,
    }
}
