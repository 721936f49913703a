//! The proof that squeezed assembly does what the original does: translation validation.
//!
//! Each function of both texts is executed with the same inputs, from its beginning to its end, by an AVR core of our own. The inputs
//! are searched until every outcome of every branch was seen. Loads, stores, accesses of I/O registers and calls have to come in the
//! same order with the same addresses and values; arguments have to be the same at each call, results and saved registers at each
//! return; and where interrupts are off, nothing may come later than before.
//!
//! # Why this covers calls
//! A function is compared from states that agree in its arguments only and differ in every other register. What it calls is taken to
//! do the same in both texts if it gets the same arguments, to return the same results, and to leave garbage everywhere else. So each
//! function relies only on what the proof of the others establishes, and the contracts (which registers are arguments and results)
//! need not be trusted: they come from the pass that removes dead code, and if one were wrong, either the caller or the
//! callee would be refused.
//!
//! # What it does not show
//! It executes finitely many inputs, so it is a test of each image and no proof in logic. Other kinds of time than that of
//! regions without interrupts may change. Code outside of functions has to be the same, word for word.

pub mod cpu;
pub mod decode;
mod program;
mod run;
mod search;

use std::collections::{HashMap, HashSet};
use std::fmt;

use crate::listing::is_mark;
use decode::{Op, Pair, flag};
use program::{Place, Program, ReadError, Routine};
use run::{
    ARGUMENTS, Event, Frame, RESULTS, Run, SAVED, Snapshot, Start, Tape, Timed, is_conditional,
    mix, run,
};
use search::search;

/// Instructions of an execution, at most.
const LIMIT: u32 = 1500;
/// Executions of each function that follow the search, for each input that the search has found.
const AGAIN: u64 = 3;

/// Registers by which a function and its callers exchange values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contract {
    /// Registers that the function reads, one bit each.
    pub arguments: u32,
    /// Registers that callers read when it has returned.
    pub results: u32,
    /// It reads arguments on the stack.
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

/// A proof that was done.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Functions that were compared.
    pub functions: usize,
    /// Pairs of executions.
    pub executions: usize,
    /// Instructions of the original, of which each was executed.
    pub instructions: usize,
    /// Labels at which functions were entered because no input was found that leads there.
    pub entered: usize,
    /// Outcomes of branches of the original that no input has reached.
    pub outcomes_missing: usize,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} functions with {} instructions are the same in {} executions.",
            self.functions, self.instructions, self.executions
        )?;
        writeln!(
            f,
            "Every instruction that can be reached was executed, after {} entries in the middle of a function; {} outcomes of branches were never seen.",
            self.entered, self.outcomes_missing
        )
    }
}

/// A reason to refuse what squeeze has made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The original cannot be read.
    Original(ReadError),
    /// The squeezed text cannot be read.
    Squeezed(ReadError),
    /// A section has other data, or other code outside of functions.
    Section(String),
    /// A function is missing, or there is another one.
    Functions(String),
    /// An asm! block is not as it was.
    Assembly(String),
    /// The variables of a function have less room, or more.
    Room(String),
    /// A function reads its arguments from the stack and this is not known to its callers, or they have moved.
    StackArguments {
        /// The function.
        function: String,
        /// The line of the original.
        line: usize,
    },
    /// Two executions of a function differ.
    Difference(Box<Difference>),
    /// An instruction is never executed, so nothing is known of it.
    Unreached {
        /// The function.
        function: String,
        /// The line.
        line: usize,
        /// It stands in the squeezed text.
        is_squeezed: bool,
    },
}

/// A difference between two executions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The function.
    pub function: String,
    /// The line of the original.
    pub line: usize,
    /// The line of the squeezed text.
    pub squeezed_line: usize,
    /// What is not the same.
    pub cause: Cause,
}

/// What is not the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Something else happens.
    Event {
        /// What happens in the original.
        original: String,
        /// What happens in the squeezed text.
        squeezed: String,
    },
    /// A register has another value.
    Register {
        /// Its number.
        number: u8,
        /// Its use.
        what: &'static str,
    },
    /// SREG has another value.
    Flags,
    /// The stack pointer is elsewhere.
    Stack,
    /// What was pushed is not the same.
    Pushed,
    /// It takes more cycles, where interrupts are off or the chip expects the next write within four.
    Later {
        /// Cycles in the original.
        original: u32,
        /// Cycles in the squeezed text.
        squeezed: u32,
    },
    /// The squeezed text goes on without doing anything.
    Hangs,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::Event { original, squeezed } => {
                write!(f, "the original does {original}, the squeezed text {squeezed}")
            }
            Cause::Register { number, what } => {
                write!(f, "r{number}, {what}, has another value")
            }
            Cause::Flags => write!(f, "SREG has another value"),
            Cause::Stack => write!(f, "the stack pointer has another value"),
            Cause::Pushed => write!(f, "other bytes are on the stack"),
            Cause::Later { original, squeezed } => write!(
                f,
                "it comes {squeezed} cycles after what was before, in the original {original}"
            ),
            Cause::Hangs => write!(f, "the squeezed text goes on without doing anything"),
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const CURE: &str = "this is a mistake of firmware/squeeze; build with BBZ_SQUEEZE=off, and report it with this message";
        match self {
            Refusal::Original(error) => write!(f, "the assembly cannot be squeezed: {error}"),
            Refusal::Squeezed(error) => {
                write!(f, "the squeezed assembly cannot be read: {error}; {CURE}")
            }
            Refusal::Section(name) => {
                write!(f, "section `{name}` has changed outside of functions; {CURE}")
            }
            Refusal::Functions(symbol) => {
                write!(f, "function `{symbol}` is not in both texts; {CURE}")
            }
            Refusal::Assembly(symbol) => {
                write!(f, "an asm! block in function `{symbol}` has changed; {CURE}")
            }
            Refusal::Room(symbol) => {
                write!(f, "function `{symbol}` has another room for its variables; {CURE}")
            }
            Refusal::StackArguments { function, line } => write!(
                f,
                "function `{function}`, line {line}: an argument on the stack is not where it was; {CURE}"
            ),
            Refusal::Difference(difference) => {
                let Difference { function, line, squeezed_line, cause } = &**difference;
                write!(
                    f,
                    "function `{function}`, line {line} (squeezed: line {squeezed_line}): {cause}; {CURE}"
                )
            }
            Refusal::Unreached { function, line, is_squeezed } => write!(
                f,
                "function `{function}`, line {line}{}: no input was found that leads there, so nothing is known of it; build with BBZ_SQUEEZE=off, and report it with this message",
                if *is_squeezed { " of the squeezed text" } else { "" }
            ),
        }
    }
}

/// Compares two texts.
pub fn prove(
    original: &str,
    squeezed: &str,
    contracts: &HashMap<String, Contract>,
) -> Result<Report, Refusal> {
    let original = Program::read(original).map_err(Refusal::Original)?;
    let squeezed = Program::read(squeezed).map_err(Refusal::Squeezed)?;
    same_rest(&original, &squeezed)?;
    let mut reached = [vec![false; original.steps.len()], vec![false; squeezed.steps.len()]];
    let mut report = Report::default();
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
            .ok_or_else(|| Refusal::Functions(routine.symbol.clone()))?;
        proof.function(routine, other, &mut reached, &mut report)?;
    }
    proof.all_reached(&reached, &mut report)?;
    Ok(report)
}

/// Everything outside of functions has to be the same, and the functions of the same names.
fn same_rest(original: &Program, squeezed: &Program) -> Result<(), Refusal> {
    for name in original.rest.keys().chain(squeezed.rest.keys()) {
        if original.rest.get(name) != squeezed.rest.get(name) {
            return Err(Refusal::Section(name.clone()));
        }
    }
    let known = |program: &Program, symbol: &str| {
        program.routines.iter().filter(|routine| routine.symbol == symbol).count() == 1
    };
    for routine in original.routines.iter().chain(&squeezed.routines) {
        if !known(original, &routine.symbol) || !known(squeezed, &routine.symbol) {
            return Err(Refusal::Functions(routine.symbol.clone()));
        }
    }
    Ok(())
}

/// The contracts that are relied on: of functions whose callers are not all known, those of the ABI.
fn contracts_of(
    original: &Program,
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
            arguments: known.arguments & ARGUMENTS,
            results: if is_outside { RESULTS } else { known.results & RESULTS },
            takes_stack: known.takes_stack,
        };
        all.insert(routine.symbol.clone(), contract);
    }
    all
}

struct Proof<'a> {
    original: &'a Program,
    squeezed: &'a Program,
    contracts: HashMap<String, Contract>,
}

impl Proof<'_> {
    /// The contract of what is called; of what is not known, everything is read.
    fn contract(&self, place: Option<&Place>) -> Contract {
        let known = match place {
            Some(Place::Symbol(symbol)) => self.contracts.get(symbol).copied(),
            _ => None,
        };
        let unknown = Contract { arguments: ARGUMENTS, results: RESULTS, takes_stack: true };
        known.unwrap_or(unknown)
    }

    fn function(
        &self,
        routine: &Routine,
        other: &Routine,
        reached: &mut [Vec<bool>; 2],
        report: &mut Report,
    ) -> Result<(), Refusal> {
        if routine.by_hand != other.by_hand {
            return Err(Refusal::Assembly(routine.symbol.clone()));
        }
        let has = |op: Op| {
            self.original.steps[routine.start..routine.end]
                .iter()
                .any(|step| step.op.as_ref() == Some(&op))
        };
        let is_interrupt = has(Op::ReturnFromInterrupt);
        let frames = [
            frame(self.original, routine, is_interrupt),
            frame(self.squeezed, other, is_interrupt),
        ];
        if frames[0].room != frames[1].room {
            return Err(Refusal::Room(routine.symbol.clone()));
        }
        let seed = routine.symbol.bytes().fold(1, |seed, byte| mix(seed ^ u64::from(byte)));
        let contract = self.contract(Some(&Place::Symbol(routine.symbol.clone())));
        let results = |place: &Place| self.contract(Some(place)).results;
        // Registers that the function may change, but for the pointer to its variables.
        let changed = match (is_interrupt, has(Op::Return)) {
            (true, _) => frames[0].registers,
            (false, true) => frames[0].registers | !SAVED,
            (false, false) => u32::MAX,
        };
        let free = changed & !(1 << 1) & if frames[0].has_pointer { !(3 << 28) } else { u32::MAX };
        let original = Start {
            program: self.original,
            entry: routine.start,
            frame: frames[0],
            free,
            enter: None,
            shift: 0,
            arguments: if is_interrupt { 0 } else { contract.arguments },
            is_interrupt,
            results: &results,
            garbage: mix(seed ^ 1),
            limit: LIMIT,
        };
        let squeezed = Start {
            program: self.squeezed,
            entry: other.start,
            frame: frames[1],
            shift: frames[1].saved.wrapping_sub(frames[0].saved),
            garbage: mix(seed ^ 2),
            ..original
        };
        let mut stack = StackAccesses::default();
        let mut executions = 0;
        let mut seen = HashSet::new();
        let expected = self.original.reachable([routine.start].into_iter());
        let mut tried = HashSet::new();
        let mut enter = None;
        loop {
            let original = Start { enter: enter.map(|(at, _)| at), results: &results, ..original };
            let squeezed = Start { enter: enter.map(|(_, at)| at), results: &results, ..squeezed };
            let found = search(&original, seed, &mut reached[0]);
            seen.extend(found.seen);
            for tape in variations(&found.tapes) {
                let one = run(&original, &tape, &mut reached[0], false);
                let limit = one.steps * 4 + 400;
                let two = Start { limit, results: &results, ..squeezed };
                let two = run(&two, &tape, &mut reached[1], false);
                stack.take(&one, frames[0]);
                executions += 1;
                self.compare(&one, &two, contract, is_interrupt).map_err(|(at, cause)| {
                    let line = |run: &Run, program: &Program| {
                        let event = run.events.get(at).or(run.events.last());
                        event.map_or(0, |event| program.steps[event.step].line)
                    };
                    Refusal::Difference(Box::new(Difference {
                        function: routine.symbol.clone(),
                        line: line(&one, self.original),
                        squeezed_line: line(&two, self.squeezed),
                        cause,
                    }))
                })?;
            }
            // What the inputs do not reach is entered at the label before it.
            let missing = (routine.start..routine.end).filter(|step| {
                let has_outcomes =
                    self.original.steps[*step].op.as_ref().is_some_and(is_conditional);
                let lacks = |is_taken: bool| !seen.contains(&(*step, is_taken));
                expected[*step]
                    && (!reached[0][*step] || has_outcomes && (lacks(true) || lacks(false)))
            });
            let places = |step: usize| self.label_before(routine, other, step, &tried);
            let Some((at, squeezed_at)) = missing.filter_map(places).next() else { break };
            tried.insert(at);
            enter = Some((at, squeezed_at));
        }
        let has_both = |step: &usize| {
            [true, false].iter().filter(|taken| !seen.contains(&(*step, **taken))).count()
        };
        let missing: usize = (routine.start..routine.end)
            .filter(|step| {
                expected[*step]
                    && self.original.steps[*step].op.as_ref().is_some_and(is_conditional)
            })
            .map(|step| has_both(&step))
            .sum();
        if let Some(step) = stack.found()
            && (frames[0].saved != frames[1].saved || !contract.takes_stack)
        {
            return Err(Refusal::StackArguments {
                function: routine.symbol.clone(),
                line: self.original.steps[step].line,
            });
        }
        report.functions += 1;
        report.executions += executions;
        report.entered += tried.len();
        report.outcomes_missing += missing;
        Ok(())
    }

    /// The nearest label before a step that both texts have and that has not been tried: its places.
    fn label_before(
        &self,
        routine: &Routine,
        other: &Routine,
        step: usize,
        tried: &HashSet<usize>,
    ) -> Option<(usize, usize)> {
        let both = |(label, at): (&String, &usize)| {
            // Labels for the debugger are no places where the texts have to agree.
            let squeezed_at = *self.squeezed.labels.get(label).filter(|_| !is_mark(label))?;
            let is_before = (routine.start..=step).contains(at);
            let is_inside = (other.start..other.end).contains(&squeezed_at);
            (is_before && is_inside && !tried.contains(at)).then_some((*at, squeezed_at))
        };
        self.original.labels.iter().filter_map(both).max()
    }

    /// Compares two executions; the number of the event that differs, and how.
    fn compare(
        &self,
        one: &Run,
        two: &Run,
        contract: Contract,
        is_interrupt: bool,
    ) -> Result<(), (usize, Cause)> {
        for (number, event) in one.events.iter().enumerate() {
            let Some(other) = two.events.get(number) else {
                return Err((number, Cause::Hangs));
            };
            self.same_event(one, two, event, other, contract, is_interrupt)
                .map_err(|cause| (number, cause))?;
            timed(&one.events[..=number], &two.events[..=number])
                .map_err(|cause| (number, cause))?;
        }
        if !one.is_cut && two.events.len() > one.events.len() {
            return Err((one.events.len(), Cause::Hangs));
        }
        Ok(())
    }

    fn same_event(
        &self,
        one: &Run,
        two: &Run,
        event: &Timed,
        other: &Timed,
        contract: Contract,
        is_interrupt: bool,
    ) -> Result<(), Cause> {
        let differs =
            || Cause::Event { original: describe(&event.event), squeezed: describe(&other.event) };
        match (&event.event, &other.event) {
            (Event::Call(to, first), Event::Call(other_to, second)) => {
                if to != other_to {
                    return Err(differs());
                }
                let callee = self.contract(to.as_ref());
                same_arguments(one, first, second, callee.arguments, is_interrupt)?;
                if to.is_none() && first.cpu.pair(30) != second.cpu.pair(30) {
                    return Err(Cause::Register { number: 30, what: "the callee's address" });
                }
                if callee.takes_stack {
                    if first.cpu.stack != second.cpu.stack {
                        return Err(Cause::Stack);
                    }
                    if first.pushed != second.pushed {
                        return Err(Cause::Pushed);
                    }
                }
                Ok(())
            }
            (Event::Leave(to, first), Event::Leave(other_to, second)) => {
                if to != other_to {
                    return Err(differs());
                }
                let arguments = self.contract(Some(to)).arguments;
                same_arguments(one, first, second, arguments, is_interrupt)?;
                self.same_saved(one, two, first, second)
            }
            (Event::Return(first), Event::Return(second)) if !is_interrupt => {
                for number in (0..32).filter(|number| contract.results >> number & 1 != 0) {
                    let at = usize::from(number);
                    if first.cpu.registers[at] != second.cpu.registers[at] {
                        return Err(Cause::Register { number, what: "a result" });
                    }
                }
                self.same_saved(one, two, first, second)
            }
            (Event::ReturnFromInterrupt(first), Event::ReturnFromInterrupt(second)) => {
                for number in 0..32 {
                    let at = usize::from(number);
                    let is_kept = |run: &Run, end: &Snapshot| {
                        run.before.registers[at] == end.cpu.registers[at]
                    };
                    if is_kept(one, first) && !is_kept(two, second) {
                        return Err(Cause::Register { number, what: "of the interrupted program" });
                    }
                }
                let flags = |run: &Run, end: &Snapshot| (run.before.flags ^ end.cpu.flags) & 0x7f;
                if flags(one, first) == 0 && flags(two, second) != 0 {
                    return Err(Cause::Flags);
                }
                same_stack(one, two, first, second)
            }
            (event, other) if event == other => Ok(()),
            _ => Err(differs()),
        }
    }

    /// Registers that a caller wants back, r1, and the stack pointer.
    fn same_saved(
        &self,
        one: &Run,
        two: &Run,
        first: &Snapshot,
        second: &Snapshot,
    ) -> Result<(), Cause> {
        for number in (1..32_u8).filter(|number| *number == 1 || SAVED >> number & 1 != 0) {
            let at = usize::from(number);
            let kept = one.before.registers[at] == first.cpu.registers[at];
            let is_same = if kept {
                two.before.registers[at] == second.cpu.registers[at]
            } else {
                first.cpu.registers[at] == second.cpu.registers[at]
            };
            if !is_same {
                return Err(Cause::Register { number, what: "which the caller wants back" });
            }
        }
        if (first.cpu.flags ^ second.cpu.flags) & 1 << flag::I != 0 {
            return Err(Cause::Flags);
        }
        same_stack(one, two, first, second)
    }

    /// Every instruction of both texts has to be executed at least once.
    fn all_reached(&self, reached: &[Vec<bool>; 2], report: &mut Report) -> Result<(), Refusal> {
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
                    return Err(Refusal::Unreached { function, line: step.line, is_squeezed });
                }
            }
        }
        Ok(())
    }
}

/// Inputs, and others that differ in what comes behind or in one byte.
fn variations(tapes: &[Tape]) -> Vec<Tape> {
    let vary = |tape: &Tape, number: u64| {
        let mut tape = tape.clone();
        tape.seed = mix(tape.seed ^ mix(number));
        if number > 1 {
            let at = mix(tape.seed) as usize % (tape.bytes.len() + 1);
            tape.put(at, mix(tape.seed ^ 1) as u8);
        }
        tape
    };
    let each = |tape: &Tape| {
        let tape = tape.clone();
        (0..=AGAIN).map(move |number| if number == 0 { tape.clone() } else { vary(&tape, number) })
    };
    tapes.iter().flat_map(each).collect()
}

fn same_arguments(
    one: &Run,
    first: &Snapshot,
    second: &Snapshot,
    arguments: u32,
    is_interrupt: bool,
) -> Result<(), Cause> {
    for number in (0..32_u8).filter(|number| arguments >> number & 1 != 0 || *number == 1) {
        let at = usize::from(number);
        // A saved register that still holds what the caller left there is no argument. The interrupted program has left something
        // everywhere.
        let is_kept = (SAVED >> number & 1 != 0 || is_interrupt && number != 1)
            && one.before.registers[at] == first.cpu.registers[at];
        if !is_kept && first.cpu.registers[at] != second.cpu.registers[at] {
            return Err(Cause::Register { number, what: "an argument" });
        }
    }
    Ok(())
}

/// The stack has to be as far from its beginning as in the original.
fn same_stack(one: &Run, two: &Run, first: &Snapshot, second: &Snapshot) -> Result<(), Cause> {
    let distance = |run: &Run, end: &Snapshot| end.cpu.stack.wrapping_sub(run.before.stack);
    if distance(one, first) == distance(two, second) { Ok(()) } else { Err(Cause::Stack) }
}

/// Data-space addresses of registers that want a second write within four cycles: EECR, MCUCR, SPMCSR, WDTCSR, CLKPR (data sheet
/// of the ATmega328P, 8.6.3, 13.4.1, 26.3.1, 10.9.2, 8.12.2).
pub const TIMED: [u16; 5] = [0x3f, 0x55, 0x57, 0x60, 0x61];

/// Whether the last event comes in time.
fn timed(one: &[Timed], two: &[Timed]) -> Result<(), Cause> {
    let (Some(event), Some(other)) = (one.last(), two.last()) else { return Ok(()) };
    if let Some(original) = event.gap {
        let squeezed = other.gap.unwrap_or(u32::MAX);
        if squeezed > original {
            return Err(Cause::Later { original, squeezed });
        }
    }
    let Event::Store(address, _) = event.event else { return Ok(()) };
    if !TIMED.contains(&address) {
        return Ok(());
    }
    let before = one[..one.len() - 1]
        .iter()
        .rposition(|event| matches!(event.event, Event::Store(other, _) if other == address));
    if let Some(before) = before {
        let original = event.cycle - one[before].cycle;
        let squeezed = other.cycle - two[before].cycle;
        if original <= 4 && squeezed > 4 {
            return Err(Cause::Later { original, squeezed });
        }
    }
    Ok(())
}

fn describe(event: &Event) -> String {
    let place = |place: &Place| match place {
        Place::Symbol(symbol) => format!("`{symbol}`"),
        Place::Address(address) => format!("address {address}"),
        Place::None | Place::Inside(_) => "a place of its own".to_owned(),
    };
    match event {
        Event::Load(address) => format!("a load from {address:#06x}"),
        Event::Store(address, value) => format!("a store of {value:#04x} to {address:#06x}"),
        Event::Flash(address) => format!("a load from flash at {address:#06x}"),
        Event::Special(name) => format!("`{name}`"),
        Event::Off => "an instruction that turns interrupts off".to_owned(),
        Event::On => "an instruction that turns interrupts on".to_owned(),
        Event::Call(Some(to), _) => format!("a call of {}", place(to)),
        Event::Call(None, _) => "a call by address".to_owned(),
        Event::Leave(to, _) => format!("a jump to {}", place(to)),
        Event::Return(_) => "a return".to_owned(),
        Event::ReturnFromInterrupt(_) => "a return from an interrupt".to_owned(),
        Event::End => "a step behind the last instruction".to_owned(),
        Event::Lost => "a return to nowhere".to_owned(),
    }
}

/// Instructions that access the part of the stack above a function's own variables, each time they are executed.
#[derive(Default)]
struct StackAccesses {
    /// Executions, and those of them that did.
    counts: HashMap<usize, (u32, u32)>,
}

impl StackAccesses {
    fn take(&mut self, run: &Run, frame: Frame) {
        /// Bytes of arguments that are looked at.
        const ABOVE: u16 = 64;
        let top = run.before.stack;
        let lowest = top - 1 - frame.saved;
        for event in &run.events {
            if let Event::Load(address) | Event::Store(address, _) = event.event {
                let (all, hits) = self.counts.entry(event.step).or_default();
                *all += 1;
                *hits += u32::from((lowest..=top + ABOVE).contains(&address));
            }
        }
    }

    /// An instruction that never accessed anything else.
    fn found(&self) -> Option<usize> {
        let always = |(_, (all, hits)): &(&usize, &(u32, u32))| all == hits && *all >= 3;
        self.counts.iter().filter(always).map(|(step, _)| *step).min()
    }
}

/// The frame that a function makes before anything else: registers that it pushes itself or by a shared routine, and room for its
/// variables.
fn frame(program: &Program, routine: &Routine, is_interrupt: bool) -> Frame {
    let mut at = routine.start;
    let mut saved = 0;
    let mut registers = 0;
    let mut size = 0;
    // Whether Y holds the stack pointer, and the size that a shared routine gets.
    let mut has_pointer = false;
    let mut shared_size = 0;
    // The frame as it was before a call, which may be one of another routine.
    let mut before_call = None;
    let mut frame = Frame::default();
    loop {
        let here = at;
        let step = &program.steps[at];
        at += 1;
        let made =
            |saved: u16, end: usize| Frame { saved, registers, room: 0, has_pointer: false, end };
        match step.op {
            Some(Op::Push(register)) if !has_pointer => {
                saved += 1;
                registers |= 1 << register;
            }
            Some(Op::In(0, 0x3f) | Op::Pair(Pair::Eor, 1, 1)) if is_interrupt => {}
            // A shared routine takes its return address from the stack first.
            Some(Op::Pop(30 | 31)) if before_call.is_some() => {}
            Some(Op::In(28, 0x3d)) => has_pointer = true,
            Some(Op::In(29, 0x3e) | Op::Out(0x3e, 29)) if has_pointer => {}
            Some(Op::In(0, 0x3f) | Op::Flag(flag::I, false) | Op::Out(0x3f, 0)) if has_pointer => {}
            Some(Op::Word(28, value, true)) if has_pointer => size = u16::from(value),
            Some(Op::Constant(Pair::Sub, 28, value)) if has_pointer => size = u16::from(value),
            Some(Op::Constant(Pair::Sbc, 29, value)) if has_pointer => {
                size |= u16::from(value) << 8;
            }
            Some(Op::Load(26, value)) if before_call.is_none() => shared_size = u16::from(value),
            Some(Op::Pair(Pair::Sub, 28, 26)) if before_call.is_some() => size = shared_size,
            Some(Op::Pair(Pair::Sbc, 29, 1)) if before_call.is_some() => {}
            Some(Op::Out(0x3d, 28)) if has_pointer => {
                frame = Frame { saved, registers, room: size, has_pointer: true, end: at };
                if before_call.is_none() {
                    return frame;
                }
            }
            Some(Op::Call(..)) if before_call.is_none() => match step.place {
                Place::Inside(target) => {
                    before_call = Some(made(saved, here));
                    at = target;
                }
                _ => return made(saved, here),
            },
            Some(Op::Jump(..)) if before_call.is_some() => match step.place {
                Place::Inside(target) => at = target,
                _ => return before_call.unwrap_or_default(),
            },
            // Back from a shared routine.
            Some(Op::JumpPointer) if before_call.is_some() => {
                let end = before_call.map_or(here, |before: Frame| before.end + 1);
                return if has_pointer { Frame { end, ..frame } } else { made(saved, end) };
            }
            _ => return before_call.unwrap_or(made(saved, here)),
        }
    }
}
