//! The proof that squeezed assembly does the same as the original: translation validation.
//!
//! An AVR core of this crate executes each function of both texts with the same inputs, from its
//! beginning to its end, until every outcome of every branch and skip was seen. Loads, stores,
//! accesses of I/O registers and calls must come in the same order with the same addresses and
//! values. Arguments must be equal at each call, and results and saved registers at each return.
//! While interrupts are off, no event may come later than before.
//!
//! # Why this covers calls
//! A function is compared from states that agree only in its arguments and differ in every other
//! register. Its callees are assumed to do the same in both texts if they get the same arguments,
//! to return the same results, and to leave garbage everywhere else. Each function therefore relies
//! only on facts that the proof of the others establishes. The contracts (the registers of
//! arguments and results) need not be trusted: they come from the pass that removes dead code, and
//! if one were wrong, either the caller or the callee would be refused.
//!
//! # Why nothing is left out
//! A branch whose condition no input meets is steered: in the original it gets the outcome that was
//! not seen yet, and the branch of the same number in the squeezed text gets the opposite of its
//! condition. Squeeze moves and inverts branches, but executes the same number in the same order.
//! An execution therefore follows every branch, and the result of a build does not depend on
//! chance.
//!
//! # Limits
//! The proof executes finitely many inputs, so it is a test of each image and not a proof in logic.
//! Timing may change outside of regions without interrupts. Code outside of functions has to be the
//! same, word for word.

mod compare;
pub mod cpu;
pub mod decode;
mod frame;
mod program;
mod refusal;
mod run;
mod search;
mod trail;

use std::cell::OnceCell;
use std::collections::HashMap;
use std::fmt;

use compare::Comparison;
use decode::AsmOperation;
use frame::{StackAccesses, frame};
use program::{AssemblyProgram, CodeLocation, Routine};
pub use refusal::{Difference, DifferenceKind, SqueezeRefusal};
use run::{ARGUMENTS, Execution, Garbage, InitialState, RESULTS, SAVED, Steer, mix, run};
use search::{Input, search};

/// The most instructions of an execution after the last steered one.
const LIMIT: u32 = 1500;
/// Additional executions of each function for each input that the search has found.
const AGAIN: u64 = 4;
/// Executions of the original that show if a value depends on registers that were never set. The
/// first one has the inverse bits; fewer than one in 30,000 of such values is the same in all.
const OTHERS: u64 = 16;

/// The registers in which a function and its callers exchange values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contract {
    /// Registers that the function reads, one bit each.
    pub arguments: u32,
    /// Registers that callers read when it has returned.
    pub results: u32,
    /// The function reads arguments on the stack.
    pub takes_stack: bool,
}

/// Functions of libgcc and libc that LLVM calls, and the registers of their arguments (libgcc's lib1funcs.S, "AVR-GCC ABI").
const LIBRARY: &[(&str, u32)] = &[
    ("memcpy", 0x03f0_0000),
    ("memmove", 0x03f0_0000),
    ("memset", 0x0370_0000),
    ("memcmp", 0x03f0_0000),
    ("__mulqi3", 0x0140_0000),
    ("__mulhi3", 0x03c0_0000),
    ("__mulsi3", 0x03fc_0000),
    ("__divmodqi4", 0x0140_0000),
    ("__udivmodqi4", 0x0140_0000),
    ("__divmodhi4", 0x03c0_0000),
    ("__udivmodhi4", 0x03c0_0000),
    ("__divmodsi4", 0x03fc_0000),
    ("__udivmodsi4", 0x03fc_0000),
    ("exit", 0),
    ("abort", 0),
];

/// The figures of a completed proof.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProofReport {
    /// Functions that were compared.
    pub functions: usize,
    /// Pairs of executions.
    pub executions: usize,
    /// Instructions of the original, all of which were executed.
    pub instructions: usize,
    /// Outcomes of conditional instructions of the original, all of which were seen.
    pub outcomes: usize,
    /// Outcomes for which no input was found, so that they were only seen by steering.
    pub steered: usize,
}

impl fmt::Display for ProofReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} functions with {} instructions are the same in {} executions.",
            self.functions, self.instructions, self.executions
        )?;
        writeln!(
            f,
            "Every instruction that can be reached was executed, with {} outcomes of branches and skips, {} of them by steering alone.",
            self.outcomes, self.steered
        )
    }
}

/// Compares two texts.
pub fn prove(
    original: &str,
    squeezed: &str,
    contracts: &HashMap<String, Contract>,
) -> Result<ProofReport, SqueezeRefusal> {
    let original = AssemblyProgram::read(original).map_err(SqueezeRefusal::Original)?;
    let squeezed = AssemblyProgram::read(squeezed).map_err(SqueezeRefusal::Squeezed)?;
    same_rest(&original, &squeezed)?;
    let mut reached = [vec![false; original.steps.len()], vec![false; squeezed.steps.len()]];
    let mut report = ProofReport::default();
    let proof = Proof {
        contracts: contracts_of(&original, contracts),
        original: &original,
        squeezed: &squeezed,
    };
    let by_symbol: HashMap<&str, &Routine> =
        squeezed.routines.iter().map(|routine| (routine.symbol.as_str(), routine)).collect();
    for routine in &original.routines {
        let other = by_symbol
            .get(routine.symbol.as_str())
            .ok_or_else(|| SqueezeRefusal::Functions(routine.symbol.clone()))?;
        proof.function(routine, other, &mut reached, &mut report)?;
    }
    proof.all_reached(&reached, &mut report)?;
    Ok(report)
}

/// Checks that both texts have the same functions, and the same text outside of functions.
fn same_rest(original: &AssemblyProgram, squeezed: &AssemblyProgram) -> Result<(), SqueezeRefusal> {
    for name in original.rest.keys().chain(squeezed.rest.keys()) {
        if original.rest.get(name) != squeezed.rest.get(name) {
            return Err(SqueezeRefusal::Section(name.clone()));
        }
    }
    let known = |program: &AssemblyProgram, symbol: &str| {
        program.routines.iter().filter(|routine| routine.symbol == symbol).count() == 1
    };
    for routine in original.routines.iter().chain(&squeezed.routines) {
        if !known(original, &routine.symbol) || !known(squeezed, &routine.symbol) {
            return Err(SqueezeRefusal::Functions(routine.symbol.clone()));
        }
    }
    Ok(())
}

/// Returns the contracts that the proof relies on; functions with unknown callers return all
/// results of the ABI.
fn contracts_of(
    original: &AssemblyProgram,
    contracts: &HashMap<String, Contract>,
) -> HashMap<String, Contract> {
    let mut all: HashMap<String, Contract> = LIBRARY
        .iter()
        .map(|(name, arguments)| {
            let contract = Contract { arguments: *arguments, results: RESULTS, takes_stack: false };
            ((*name).to_owned(), contract)
        })
        .collect();
    for routine in &original.routines {
        let known = contracts.get(&routine.symbol).copied().unwrap_or_default();
        let is_outside = original.outside.contains(&routine.symbol);
        let contract = Contract {
            // Saved registers are those that assembly reads, such as r2 with the boot loader's
            // cause of the reset.
            arguments: known.arguments & (ARGUMENTS | SAVED),
            results: if is_outside { RESULTS } else { known.results & RESULTS },
            takes_stack: known.takes_stack,
        };
        all.insert(routine.symbol.clone(), contract);
    }
    all
}

struct Proof<'a> {
    original: &'a AssemblyProgram,
    squeezed: &'a AssemblyProgram,
    contracts: HashMap<String, Contract>,
}

impl Proof<'_> {
    /// Returns the contract of a callee. An unknown callee reads everything.
    fn contract(&self, place: Option<&CodeLocation>) -> Contract {
        let known = match place {
            Some(CodeLocation::Symbol(symbol)) => self.contracts.get(symbol).copied(),
            _ => None,
        };
        let unknown = Contract { arguments: ARGUMENTS, results: RESULTS, takes_stack: true };
        known.unwrap_or(unknown)
    }

    /// Returns true if the contract of a callee comes from squeeze or from a library.
    fn is_known(&self, callee: Option<&CodeLocation>) -> bool {
        matches!(callee, Some(CodeLocation::Symbol(symbol)) if self.contracts.contains_key(symbol))
    }

    fn function(
        &self,
        routine: &Routine,
        other: &Routine,
        reached: &mut [Vec<bool>; 2],
        report: &mut ProofReport,
    ) -> Result<(), SqueezeRefusal> {
        if routine.by_hand != other.by_hand {
            return Err(SqueezeRefusal::Assembly(routine.symbol.clone()));
        }
        let has = |op: AsmOperation| {
            self.original.steps[routine.start..routine.end]
                .iter()
                .any(|step| step.op.as_ref() == Some(&op))
        };
        let is_interrupt = has(AsmOperation::ReturnFromInterrupt);
        let frames = [
            frame(self.original, routine, is_interrupt),
            frame(self.squeezed, other, is_interrupt),
        ];
        if frames[0].room != frames[1].room {
            return Err(SqueezeRefusal::Room(routine.symbol.clone()));
        }
        let seed = routine.symbol.bytes().fold(1, |seed, byte| mix(seed ^ u64::from(byte)));
        let contract = self.contract(Some(&CodeLocation::Symbol(routine.symbol.clone())));
        let results = |place: &CodeLocation| self.contract(Some(place)).results;
        let garbage = [1, 2].map(|number| Garbage::new(mix(seed ^ number)));
        let original = InitialState {
            program: self.original,
            entry: routine.start,
            frame: frames[0],
            shift: 0,
            arguments: if is_interrupt { 0 } else { contract.arguments },
            is_interrupt,
            results: &results,
            garbage: &garbage[0],
            unset: 0,
            limit: LIMIT,
        };
        let squeezed = InitialState {
            program: self.squeezed,
            entry: other.start,
            frame: frames[1],
            shift: frames[1].saved.wrapping_sub(frames[0].saved),
            garbage: &garbage[1],
            ..original
        };
        let mut stack = StackAccesses::default();
        let found = search(&original, seed, &mut reached[0]);
        for Input { tape, outcomes } in variations(&found.inputs) {
            let one = run(&original, &tape, Steer::Outcomes(&outcomes), &mut reached[0], false);
            let limit = one.steps * 4 + 400;
            let two = InitialState { limit, results: &results, ..squeezed };
            let two = run(&two, &tape, Steer::Opposite(&one.turned), &mut reached[1], false);
            stack.take(&one, frames[0]);
            report.executions += 1;
            let comparison = Comparison {
                proof: self,
                original: &one,
                squeezed: &two,
                contract,
                is_interrupt,
                again: &|| {
                    let again = |unset| {
                        let start = InitialState { unset, results: &results, ..original };
                        let steer = Steer::Outcomes(&outcomes);
                        run(
                            &start,
                            &tape,
                            steer,
                            &mut vec![false; self.original.steps.len()],
                            false,
                        )
                    };
                    (1..=OTHERS).map(again).collect()
                },
                others: OnceCell::new(),
            };
            comparison.check().map_err(|(at, cause)| {
                let line = |run: &Execution, program: &AssemblyProgram| {
                    let event = run.events.get(at).or(run.events.last());
                    event.map_or(0, |event| program.steps[event.step].line)
                };
                SqueezeRefusal::Difference(Box::new(Difference {
                    function: routine.symbol.clone(),
                    line: line(&one, self.original),
                    squeezed_line: line(&two, self.squeezed),
                    cause,
                }))
            })?;
        }
        if let Some(step) = stack.found()
            && (frames[0].saved != frames[1].saved || !contract.takes_stack)
        {
            return Err(SqueezeRefusal::StackArguments {
                function: routine.symbol.clone(),
                line: self.original.steps[step].line,
            });
        }
        report.functions += 1;
        report.outcomes += found.outcomes;
        report.steered += found.steered;
        Ok(())
    }

    /// Checks that every reachable instruction of both texts was executed at least once.
    fn all_reached(
        &self,
        reached: &[Vec<bool>; 2],
        report: &mut ProofReport,
    ) -> Result<(), SqueezeRefusal> {
        for (is_squeezed, program) in [(false, self.original), (true, self.squeezed)] {
            let reachable = program.reachable(program.routines.iter().map(|routine| routine.start));
            for (number, step) in program.steps.iter().enumerate() {
                if step.op.is_none() || !reachable[number] {
                    continue;
                }
                if !is_squeezed {
                    report.instructions += 1;
                }
                if !reached[usize::from(is_squeezed)][number] {
                    let routine = program.routine_at(number);
                    let function = routine.map_or("(shared)", |routine| &routine.symbol);
                    let function = function.to_owned();
                    return Err(SqueezeRefusal::Unreached {
                        function,
                        line: step.line,
                        is_squeezed,
                    });
                }
            }
        }
        Ok(())
    }
}

/// Returns the inputs and variations of them. Most variations follow the same path with other
/// values; the last one follows its own values.
fn variations(inputs: &[Input]) -> Vec<Input> {
    let vary = |input: &Input, number: u64| {
        let mut input = input.clone();
        let seed = mix(input.tape.seed ^ mix(number));
        input.tape.seed = seed;
        match number {
            // Drops the values that were found.
            1 => input.tape.bytes.clear(),
            AGAIN => input.outcomes.clear(),
            _ => {}
        }
        if number > 1 {
            let at = mix(seed) as usize % (input.tape.bytes.len() + 1);
            input.tape.put(at, mix(seed ^ 1) as u8);
        }
        input
    };
    let each = |input: &Input| {
        let input = input.clone();
        (0..=AGAIN)
            .map(move |number| if number == 0 { input.clone() } else { vary(&input, number) })
    };
    inputs.iter().flat_map(each).collect()
}
