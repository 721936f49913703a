//! Executes a function, and records all effects that are visible to the rest of the program and to
//! the peripherals.
//!
//! Memory has no fixed content: each load takes the next byte of a [`Tape`], independent of the
//! address. Both texts of a function therefore have to load and store the same addresses in the
//! same order. Other functions are not executed: a call ends with new bytes of the tape as its
//! results, and with garbage in the other registers that it may change.

use super::cpu::{Cpu, DataSpace, Successor};
use super::decode::{AsmOperation, flag};
use super::frame::StackUse;
use super::program::{AssemblyProgram, CodeLocation};
use super::trail::{Hint, Trail};

/// Registers that a function leaves unchanged (AVR-GCC ABI, "Call-saved registers").
pub const SAVED: u32 = 0x3003_fffc;
/// The registers of arguments: r8 to r25.
pub const ARGUMENTS: u32 = 0x03ff_ff00;
/// The registers of results: r18 to r25.
pub const RESULTS: u32 = 0x03fc_0000;

/// Registers in which the ABI passes nothing: r0, X, Z.
const PASSES_NOTHING: u32 = 0xcc00_0001;

/// A return address that is not an instruction: the function returns to its caller.
const CALLER: u16 = 0xffff;
/// The addresses of the stack in an execution.
const STACK: std::ops::Range<u16> = 0x7c00..0x8000;
/// The lowest initial stack pointer.
const STACK_START: u16 = 0x7e00;
/// The place of SREG on the tape, after those of the registers.
pub const FLAGS_AT: usize = 32;

/// Bytes that an execution reads, in the order in which it reads them: registers, flags, memory, results of calls.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tape {
    /// The first bytes.
    pub bytes: Vec<u8>,
    /// The seed from which all further bytes are generated.
    pub seed: u64,
}

impl Tape {
    /// Returns the byte at a place.
    pub fn at(&self, place: usize) -> u8 {
        self.bytes.get(place).copied().unwrap_or_else(|| noise(self.seed, place as u64))
    }

    /// Changes the byte at a place.
    pub fn put(&mut self, place: usize, value: u8) {
        while self.bytes.len() <= place {
            self.bytes.push(self.at(self.bytes.len()));
        }
        self.bytes[place] = value;
    }
}

/// Returns a pseudo-random byte. One in four is a number that programs often compare with.
pub fn noise(seed: u64, place: u64) -> u8 {
    let bits = mix(seed ^ mix(place));
    let common = [0, 1, 0xff, 0x80, 2, 0x7f, 3, 4];
    if bits & 0x300 == 0 { common[(bits >> 16) as usize & 7] } else { bits as u8 }
}

/// Mixes the bits of a number: the finalizer of SplitMix64 (Steele, Lea, Flood 2014).
pub fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ value >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ value >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ value >> 31
}

/// A visible effect of an execution.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum VisibleEffect {
    /// A byte of memory or an I/O register is read.
    Load(u16),
    /// A byte is written.
    Store(u16, u8),
    /// A byte of flash is read.
    Flash(u16),
    /// `sleep`, `wdr` or `break`.
    Special(&'static str),
    /// Interrupts are off from here on.
    Off,
    /// Interrupts are on again.
    On,
    /// Another function is called; `None` for a call to the address in Z.
    Call(Option<CodeLocation>, Box<Snapshot>),
    /// The function jumps to another function.
    Leave(CodeLocation, Box<Snapshot>),
    /// The function returns.
    Return(Box<Snapshot>),
    /// The handler of an interrupt returns.
    ReturnFromInterrupt(Box<Snapshot>),
    /// Control runs past the last instruction of the function.
    End,
    /// The function returns to an invalid address.
    Lost,
}

impl VisibleEffect {
    /// Returns the core at a call or at the end.
    pub fn snapshot(&self) -> Option<&Snapshot> {
        match self {
            VisibleEffect::Call(_, end)
            | VisibleEffect::Leave(_, end)
            | VisibleEffect::Return(end)
            | VisibleEffect::ReturnFromInterrupt(end) => Some(end),
            _ => None,
        }
    }
}

/// The core at a call, or at the end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Snapshot {
    /// Registers and flags.
    pub cpu: Cpu,
    /// The bytes that the function has pushed on the stack below its frame.
    pub pushed: Vec<u8>,
}

/// An event with its time.
#[derive(Clone, Debug)]
pub struct Timed {
    pub event: VisibleEffect,
    /// Cycles since the function was entered.
    pub cycle: u32,
    /// Cycles since the last event, if interrupts are off.
    pub gap: Option<u32>,
    /// The number of the instruction.
    pub step: usize,
}

/// Forced outcomes of conditional instructions.
#[derive(Clone, Copy)]
pub enum Steer<'a> {
    /// The first conditional instructions have these outcomes, each true if it branches or skips.
    Outcomes(&'a [bool]),
    /// Those of the first conditional instructions that are marked have the opposite outcome.
    Opposite(&'a [bool]),
}

impl Steer<'_> {
    /// Returns the number of conditional instructions that are steered.
    fn len(self) -> usize {
        match self {
            Steer::Outcomes(outcomes) | Steer::Opposite(outcomes) => outcomes.len(),
        }
    }

    /// Returns true if the conditional instruction of that number gets another outcome than its
    /// condition demands.
    fn turns(self, number: usize, is_taken: bool) -> bool {
        match self {
            Steer::Outcomes(outcomes) => outcomes[number] != is_taken,
            Steer::Opposite(marks) => marks[number],
        }
    }
}

/// Values on which no result may depend: they differ between the two texts.
pub struct Garbage {
    seed: u64,
    /// The bytes of [`STACK`]. An execution takes less time than computing them.
    stack: Vec<u8>,
}

impl Garbage {
    /// Generates the values from a seed.
    pub fn new(seed: u64) -> Self {
        let mut garbage = Garbage { seed, stack: Vec::new() };
        let numbers = 0..u64::from(STACK.end - STACK.start);
        garbage.stack = numbers.map(|number| garbage.byte(number + 0x1000)).collect();
        garbage
    }

    fn byte(&self, number: u64) -> u8 {
        mix(self.seed ^ number.wrapping_mul(0x1_0001)) as u8
    }
}

/// The initial state and the settings of an execution.
pub struct InitialState<'a> {
    /// The text of the function.
    pub program: &'a AssemblyProgram,
    /// The function's first instruction.
    pub entry: usize,
    /// The function's frame.
    pub frame: StackUse,
    /// Bytes by which the stack pointer is higher, so that the variables are at the same addresses.
    pub shift: u16,
    /// The registers with equal values in both texts, which come from the tape.
    pub arguments: u32,
    /// True if the function is entered by an interrupt.
    pub is_interrupt: bool,
    /// Returns the registers with results, by the callee's symbol.
    pub results: &'a dyn Fn(&CodeLocation) -> u32,
    /// All values that differ between the two texts.
    pub garbage: &'a Garbage,
    /// Chooses values for registers in which nothing is passed: 0 for those of `garbage`, 1 for
    /// their inverted bits, other numbers for other values.
    pub unset: u64,
    /// The most instructions after the last steered one.
    pub limit: u32,
}

/// The result of an execution.
pub struct Execution {
    /// The events, in order.
    pub events: Vec<Timed>,
    /// The core at the beginning.
    pub before: Cpu,
    /// The number of instructions that were executed.
    pub steps: u32,
    /// The execution was stopped at the limit.
    pub is_cut: bool,
    /// The conditional instructions that were executed, in order.
    pub path: Vec<Passed>,
    /// The steered conditional instructions: true if the condition demanded the other outcome.
    pub turned: Vec<bool>,
}

/// A conditional instruction that was executed.
#[derive(Clone, Debug)]
pub struct Passed {
    /// The number of the instruction.
    pub step: usize,
    /// True if the instruction branched or skipped.
    pub is_taken: bool,
    /// The places on the tape on which the outcome depended, a bit for each of the first 128.
    pub tag: u128,
    /// The last comparisons before the instruction.
    pub hints: Vec<Hint>,
}

struct World<'a> {
    tape: &'a Tape,
    /// The place of the next byte on the tape.
    cursor: usize,
    stack: Vec<u8>,
    events: Vec<VisibleEffect>,
}

impl World<'_> {
    fn next(&mut self) -> u8 {
        let value = self.tape.at(self.cursor);
        self.cursor += 1;
        value
    }

    fn place(address: u16) -> usize {
        usize::from(address.wrapping_sub(STACK.start)) % usize::from(STACK.end - STACK.start)
    }
}

impl DataSpace for World<'_> {
    fn load(&mut self, address: u16) -> u8 {
        self.events.push(VisibleEffect::Load(address));
        self.next()
    }

    fn store(&mut self, address: u16, value: u8) {
        self.events.push(VisibleEffect::Store(address, value));
    }

    fn load_flash(&mut self, address: u16) -> u8 {
        self.events.push(VisibleEffect::Flash(address));
        self.next()
    }

    fn pop(&mut self, address: u16) -> u8 {
        self.stack[Self::place(address)]
    }

    fn push(&mut self, address: u16, value: u8) {
        self.stack[Self::place(address)] = value;
    }

    fn special(&mut self, name: &'static str) {
        self.events.push(VisibleEffect::Special(name));
    }
}

/// Executes a function. `reached` gets a mark for each executed instruction. If `follows` is true,
/// the origins of values are tracked.
pub fn run(
    start: &InitialState<'_>,
    tape: &Tape,
    steer: Steer<'_>,
    reached: &mut [bool],
    follows: bool,
) -> Execution {
    let garbage = |number| start.garbage.byte(number);
    let mut world = World {
        tape,
        cursor: FLAGS_AT + 1,
        stack: start.garbage.stack.clone(),
        events: Vec::new(),
    };
    let mut trail = Trail::new(start.arguments);
    // The value of a register that was never set, at the beginning or after a call.
    let unset = |call: u64, number: u64| {
        let number_of_all = call << 8 | number;
        let change = match start.unset {
            0 => 0,
            1 => 0xff,
            unset => mix(unset ^ number_of_all) as u8,
        };
        garbage(number_of_all) ^ if PASSES_NOTHING >> number & 1 != 0 { change } else { 0 }
    };
    let mut registers = [0; 32];
    for (number, register) in registers.iter_mut().enumerate() {
        let is_same = start.arguments & 1 << number != 0;
        *register = if is_same { tape.at(number) } else { unset(0, number as u64) };
    }
    let mut flags = tape.at(FLAGS_AT);
    if start.is_interrupt {
        flags = garbage(0x100) & !(1 << flag::I);
    } else {
        registers[1] = 0;
    }
    let top = (STACK_START + (mix(tape.seed) & 0x7e) as u16).wrapping_add(start.shift);
    let mut cpu = Cpu { registers, flags, stack: top, cycles: 0 };
    let before = cpu.clone();
    // The return address of the function itself.
    push_address(&mut cpu, &mut world, CALLER);
    let body = cpu.stack.wrapping_sub(start.frame.saved + start.frame.room);
    let mut at = start.entry;
    let mut run = Execution {
        events: Vec::new(),
        before,
        steps: 0,
        is_cut: false,
        path: Vec::new(),
        turned: Vec::new(),
    };
    let mut calls = 0;
    let mut off_since = None;
    let mut last_steered = 0;
    loop {
        if run.steps - last_steered >= start.limit {
            run.is_cut = true;
            return run;
        }
        run.steps += 1;
        let step = &start.program.steps[at];
        let Some(op) = &step.op else {
            world.events.push(VisibleEffect::End);
            note(&mut run, &mut world, &cpu, at, &mut off_since);
            return run;
        };
        reached[at] = true;
        let cursor = world.cursor;
        let old = if follows { Some(cpu.clone()) } else { None };
        let were_on = cpu.flags & 1 << flag::I != 0;
        let mut control = cpu.execute(op, &mut world);
        if is_conditional(op) && run.turned.len() < steer.len() {
            let turns = steer.turns(run.turned.len(), control != Successor::Next);
            if turns {
                control = opposite(op, control, &mut cpu);
            }
            run.turned.push(turns);
            last_steered = run.steps;
        }
        if let Some(old) = old {
            trail.follow(op, &old, tape, cursor);
            if is_conditional(op) {
                let is_taken = control != Successor::Next;
                let tag = trail.condition(op);
                let hints = trail.take_hints();
                run.path.push(Passed { step: at, is_taken, tag, hints });
            }
        }
        let are_on = cpu.flags & 1 << flag::I != 0;
        note(&mut run, &mut world, &cpu, at, &mut off_since);
        if were_on != are_on && control == Successor::Next {
            world.events.push(if are_on { VisibleEffect::On } else { VisibleEffect::Off });
            note(&mut run, &mut world, &cpu, at, &mut off_since);
            // A restore of SREG that leaves interrupts off ends the region that another `cli`
            // began.
            let begins = *op == AsmOperation::Flag(flag::I, false);
            off_since = begins.then_some(cpu.cycles);
        }
        let snapshot = |cpu: &Cpu, world: &World<'_>| {
            let below = (cpu.stack.wrapping_add(1)..=body).take(32);
            let pushed = below.map(|address| world.stack[World::place(address)]).collect();
            Box::new(Snapshot { cpu: cpu.clone(), pushed })
        };
        at = match (control, &step.place) {
            (Successor::Next, _) => at + 1,
            (Successor::Skip, _) => {
                if start.program.steps.get(at + 1).is_some_and(|next| next.is_long) {
                    cpu.cycles += 1;
                }
                at + 2
            }
            (Successor::Branch | Successor::Jump, CodeLocation::Inside(target)) => *target,
            (Successor::Call, CodeLocation::Inside(target)) => {
                push_address(&mut cpu, &mut world, (at + 1) as u16);
                *target
            }
            (Successor::Call | Successor::CallPointer, place) => {
                let callee = (control == Successor::Call).then(|| place.clone());
                world.events.push(VisibleEffect::Call(callee, snapshot(&cpu, &world)));
                note(&mut run, &mut world, &cpu, at, &mut off_since);
                calls += 1;
                let results =
                    if control == Successor::Call { (start.results)(place) } else { RESULTS };
                for number in (0..32_u8).filter(|number| *number != 1 && SAVED >> number & 1 == 0) {
                    let is_same = results & 1 << number != 0;
                    let place = world.cursor;
                    // Both texts take the same number of bytes from the tape.
                    let value = world.next();
                    cpu.registers[usize::from(number)] =
                        if is_same { value } else { unset(calls, number.into()) };
                    trail.set_register(number, is_same.then_some(place));
                }
                let place = world.cursor;
                cpu.flags = cpu.flags & 0x80 | world.next() & 0x7f;
                trail.set_flags(place);
                at + 1
            }
            (Successor::Return, _) => {
                let back = pop_address(&mut cpu, &world);
                if back == CALLER || usize::from(back) >= start.program.steps.len() {
                    let is_back = back == CALLER;
                    let event = VisibleEffect::Return(snapshot(&cpu, &world));
                    world.events.push(if is_back { event } else { VisibleEffect::Lost });
                    note(&mut run, &mut world, &cpu, at, &mut off_since);
                    return run;
                }
                back.into()
            }
            (Successor::ReturnFromInterrupt, _) => {
                let is_back = pop_address(&mut cpu, &world) == CALLER;
                let event = VisibleEffect::ReturnFromInterrupt(snapshot(&cpu, &world));
                world.events.push(if is_back { event } else { VisibleEffect::Lost });
                note(&mut run, &mut world, &cpu, at, &mut off_since);
                return run;
            }
            (Successor::JumpPointer, _) => {
                let target = cpu.pair(30);
                if usize::from(target) >= start.program.steps.len() {
                    world.events.push(VisibleEffect::Lost);
                    note(&mut run, &mut world, &cpu, at, &mut off_since);
                    return run;
                }
                target.into()
            }
            (Successor::Jump | Successor::Branch, place) => {
                world.events.push(VisibleEffect::Leave(place.clone(), snapshot(&cpu, &world)));
                note(&mut run, &mut world, &cpu, at, &mut off_since);
                return run;
            }
        };
    }
}

/// Records the events of the last instruction.
fn note(
    run: &mut Execution,
    world: &mut World<'_>,
    cpu: &Cpu,
    step: usize,
    off_since: &mut Option<u32>,
) {
    for event in world.events.drain(..) {
        let gap = off_since.map(|since| cpu.cycles - since);
        if off_since.is_some() {
            *off_since = Some(cpu.cycles);
        }
        run.events.push(Timed { event, cycle: cpu.cycles, gap, step });
    }
}

/// Pushes an address with its low byte first, as calls do.
fn push_address(cpu: &mut Cpu, world: &mut World<'_>, address: u16) {
    for byte in address.to_le_bytes() {
        world.push(cpu.stack, byte);
        cpu.stack = cpu.stack.wrapping_sub(1);
    }
}

fn pop_address(cpu: &mut Cpu, world: &World<'_>) -> u16 {
    let at = |back: u16| world.stack[World::place(cpu.stack.wrapping_add(back))];
    let address = u16::from_le_bytes([at(2), at(1)]);
    cpu.stack = cpu.stack.wrapping_add(2);
    address
}

/// Returns true for an instruction with two outcomes.
pub fn is_conditional(op: &AsmOperation) -> bool {
    matches!(
        op,
        AsmOperation::Branch(..)
            | AsmOperation::SkipBit(..)
            | AsmOperation::SkipIo(..)
            | AsmOperation::SkipEqual(..)
    )
}

/// Returns the other outcome of a conditional instruction, and corrects the cycles.
fn opposite(op: &AsmOperation, control: Successor, cpu: &mut Cpu) -> Successor {
    if control != Successor::Next {
        cpu.cycles -= 1;
        return Successor::Next;
    }
    cpu.cycles += 1;
    if matches!(op, AsmOperation::Branch(..)) { Successor::Branch } else { Successor::Skip }
}
