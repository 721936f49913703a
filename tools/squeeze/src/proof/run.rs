//! One execution of a function, as everything that the rest of the program and the chip's peripherals see of it.
//!
//! Nothing is assumed of memory: each load takes the next byte of a [`Tape`], whatever it reads, so both texts of a function have to
//! load and store the same addresses in the same order. Other functions are not executed: a call ends with new bytes of the tape as
//! its results and with garbage in the other registers that it may use.

use super::cpu::{Bus, Control, Cpu};
use super::decode::{Op, flag};
use super::frame::StackUse;
use super::program::{AssemblyProgram, Place};
use super::trail::{Hint, Trail};

/// Registers that a function returns as it found them (AVR-GCC ABI, "Call-saved registers").
pub const SAVED: u32 = 0x3003_fffc;
/// The registers of arguments: r8 to r25.
pub const ARGUMENTS: u32 = 0x03ff_ff00;
/// The registers of results: r18 to r25.
pub const RESULTS: u32 = 0x03fc_0000;

/// Registers in which the ABI passes nothing: r0, X, Z.
const PASSES_NOTHING: u32 = 0xcc00_0001;

/// A return address that is no instruction: the function returns to its caller.
const CALLER: u16 = 0xffff;
/// The addresses of the stack that is executed.
const STACK: std::ops::Range<u16> = 0x7c00..0x8000;
/// The stack pointer at the beginning, at least.
const STACK_START: u16 = 0x7e00;
/// The place on the tape of SREG; those before are of the registers.
pub const FLAGS_AT: usize = 32;

/// Bytes that an execution reads, in the order in which it reads them: registers, flags, memory, results of calls.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tape {
    /// The first of them.
    pub bytes: Vec<u8>,
    /// Makes the others.
    pub seed: u64,
}

impl Tape {
    /// The byte at a place.
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

/// A byte that looks random: of four, one is a number that programs often compare with.
pub fn noise(seed: u64, place: u64) -> u8 {
    let bits = mix(seed ^ mix(place));
    let common = [0, 1, 0xff, 0x80, 2, 0x7f, 3, 4];
    if bits & 0x300 == 0 { common[(bits >> 16) as usize & 7] } else { bits as u8 }
}

/// The finalizer of SplitMix64 (Steele, Lea, Flood 2014).
pub fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ value >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ value >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ value >> 31
}

/// A visible effect of an execution.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
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
    /// Another function is called; `None`: by its address, which is in Z.
    Call(Option<Place>, Box<Snapshot>),
    /// Control goes to another function for good.
    Leave(Place, Box<Snapshot>),
    /// The function returns.
    Return(Box<Snapshot>),
    /// The handler of an interrupt returns.
    ReturnFromInterrupt(Box<Snapshot>),
    /// The function has no instruction there any more.
    End,
    /// It returns to an address that is none.
    Lost,
}

impl Event {
    /// The core, if it is a call or the end.
    pub fn snapshot(&self) -> Option<&Snapshot> {
        match self {
            Event::Call(_, end)
            | Event::Leave(_, end)
            | Event::Return(end)
            | Event::ReturnFromInterrupt(end) => Some(end),
            _ => None,
        }
    }
}

/// The core at a call, or at the end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Snapshot {
    /// Registers and flags.
    pub cpu: Cpu,
    /// The bytes that the function has on the stack below its frame.
    pub pushed: Vec<u8>,
}

/// An event, and when it happens.
#[derive(Clone, Debug)]
pub struct Timed {
    /// The event itself.
    pub event: Event,
    /// Cycles since the function was entered.
    pub cycle: u32,
    /// Cycles since the last event, if interrupts are off.
    pub gap: Option<u32>,
    /// The instruction.
    pub step: usize,
}

/// Outcomes of conditional instructions that do not follow their conditions.
#[derive(Clone, Copy)]
pub enum Steer<'a> {
    /// The first conditional instructions have these outcomes, each true if it branches or skips.
    Outcomes(&'a [bool]),
    /// Those marked of the first ones have the opposite outcome.
    Opposite(&'a [bool]),
}

impl Steer<'_> {
    /// Conditional instructions that are steered.
    fn len(self) -> usize {
        match self {
            Steer::Outcomes(outcomes) | Steer::Opposite(outcomes) => outcomes.len(),
        }
    }

    /// Returns true if the conditional instruction of that number has another outcome than its condition demands.
    fn turns(self, number: usize, is_taken: bool) -> bool {
        match self {
            Steer::Outcomes(outcomes) => outcomes[number] != is_taken,
            Steer::Opposite(marks) => marks[number],
        }
    }
}

/// The beginning of an execution.
pub struct Start<'a> {
    /// The text.
    pub program: &'a AssemblyProgram,
    /// The function's first instruction.
    pub entry: usize,
    /// Its frame.
    pub frame: StackUse,
    /// Bytes by which the stack pointer is higher, so that the variables are at the same addresses.
    pub shift: u16,
    /// The registers that are the same in both texts, from the tape.
    pub arguments: u32,
    /// It is entered by an interrupt.
    pub is_interrupt: bool,
    /// Registers with results, from the callee's symbol.
    pub results: &'a dyn Fn(&Place) -> u32,
    /// The seed of all values that differ between both texts.
    pub garbage: u64,
    /// Chooses other values for registers in which nothing is passed: 0 those of `garbage`, 1 all their bits inverted.
    pub unset: u64,
    /// The most instructions after the last steered one.
    pub limit: u32,
}

/// An execution.
pub struct Run {
    /// The events, in order.
    pub events: Vec<Timed>,
    /// The core at the beginning.
    pub before: Cpu,
    /// Instructions that were executed.
    pub steps: u32,
    /// The execution was stopped at the limit.
    pub is_cut: bool,
    /// The conditional instructions that were executed, in order.
    pub path: Vec<Passed>,
    /// The steered ones, each with a mark if its condition demanded the other outcome.
    pub turned: Vec<bool>,
}

/// A conditional instruction that was executed.
#[derive(Clone, Debug)]
pub struct Passed {
    /// The instruction.
    pub step: usize,
    /// It branched or skipped.
    pub is_taken: bool,
    /// The places on the tape on which that depended, a bit for each of the first 128.
    pub tag: u128,
    /// Comparisons before it.
    pub hints: Vec<Hint>,
}

struct World<'a> {
    tape: &'a Tape,
    /// The next byte of it.
    cursor: usize,
    stack: Vec<u8>,
    events: Vec<Event>,
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

impl Bus for World<'_> {
    fn load(&mut self, address: u16) -> u8 {
        self.events.push(Event::Load(address));
        self.next()
    }

    fn store(&mut self, address: u16, value: u8) {
        self.events.push(Event::Store(address, value));
    }

    fn load_flash(&mut self, address: u16) -> u8 {
        self.events.push(Event::Flash(address));
        self.next()
    }

    fn pop(&mut self, address: u16) -> u8 {
        self.stack[Self::place(address)]
    }

    fn push(&mut self, address: u16, value: u8) {
        self.stack[Self::place(address)] = value;
    }

    fn special(&mut self, name: &'static str) {
        self.events.push(Event::Special(name));
    }
}

/// Executes a function. `reached` gets a mark for each instruction; where values come from is followed if `follows` is set.
pub fn run(
    start: &Start<'_>,
    tape: &Tape,
    steer: Steer<'_>,
    reached: &mut [bool],
    follows: bool,
) -> Run {
    let garbage = |number: u64| mix(start.garbage ^ number.wrapping_mul(0x1_0001)) as u8;
    let mut world = World {
        tape,
        cursor: FLAGS_AT + 1,
        stack: (0..u64::from(STACK.end - STACK.start)).map(|n| garbage(n + 0x1000)).collect(),
        events: Vec::new(),
    };
    let mut trail = Trail::new(start.arguments);
    // A register that was never set, at the beginning or after a call.
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
    let mut run = Run {
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
            world.events.push(Event::End);
            note(&mut run, &mut world, &cpu, at, &mut off_since);
            return run;
        };
        reached[at] = true;
        let cursor = world.cursor;
        let old = if follows { Some(cpu.clone()) } else { None };
        let were_on = cpu.flags & 1 << flag::I != 0;
        let mut control = cpu.execute(op, &mut world);
        if is_conditional(op) && run.turned.len() < steer.len() {
            let turns = steer.turns(run.turned.len(), control != Control::Next);
            if turns {
                control = opposite(op, control, &mut cpu);
            }
            run.turned.push(turns);
            last_steered = run.steps;
        }
        if let Some(old) = old {
            trail.follow(op, &old, tape, cursor);
            if is_conditional(op) {
                let is_taken = control != Control::Next;
                let tag = trail.condition(op);
                let hints = trail.take_hints();
                run.path.push(Passed { step: at, is_taken, tag, hints });
            }
        }
        let are_on = cpu.flags & 1 << flag::I != 0;
        note(&mut run, &mut world, &cpu, at, &mut off_since);
        if were_on != are_on && control == Control::Next {
            world.events.push(if are_on { Event::On } else { Event::Off });
            note(&mut run, &mut world, &cpu, at, &mut off_since);
            // A restore of SREG that leaves them off ends what another `cli` began.
            let begins = *op == Op::Flag(flag::I, false);
            off_since = begins.then_some(cpu.cycles);
        }
        let snapshot = |cpu: &Cpu, world: &World<'_>| {
            let below = (cpu.stack.wrapping_add(1)..=body).take(32);
            let pushed = below.map(|address| world.stack[World::place(address)]).collect();
            Box::new(Snapshot { cpu: cpu.clone(), pushed })
        };
        at = match (control, &step.place) {
            (Control::Next, _) => at + 1,
            (Control::Skip, _) => {
                if start.program.steps.get(at + 1).is_some_and(|next| next.is_long) {
                    cpu.cycles += 1;
                }
                at + 2
            }
            (Control::Branch | Control::Jump, Place::Inside(target)) => *target,
            (Control::Call, Place::Inside(target)) => {
                push_address(&mut cpu, &mut world, (at + 1) as u16);
                *target
            }
            (Control::Call | Control::CallPointer, place) => {
                let callee = (control == Control::Call).then(|| place.clone());
                world.events.push(Event::Call(callee, snapshot(&cpu, &world)));
                note(&mut run, &mut world, &cpu, at, &mut off_since);
                calls += 1;
                let results =
                    if control == Control::Call { (start.results)(place) } else { RESULTS };
                for number in (0..32_u8).filter(|number| *number != 1 && SAVED >> number & 1 == 0) {
                    let is_same = results & 1 << number != 0;
                    let place = world.cursor;
                    // Both texts take as many bytes of the tape.
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
            (Control::Return, _) => {
                let back = pop_address(&mut cpu, &world);
                if back == CALLER || usize::from(back) >= start.program.steps.len() {
                    let is_back = back == CALLER;
                    let event = Event::Return(snapshot(&cpu, &world));
                    world.events.push(if is_back { event } else { Event::Lost });
                    note(&mut run, &mut world, &cpu, at, &mut off_since);
                    return run;
                }
                back.into()
            }
            (Control::ReturnFromInterrupt, _) => {
                let is_back = pop_address(&mut cpu, &world) == CALLER;
                let event = Event::ReturnFromInterrupt(snapshot(&cpu, &world));
                world.events.push(if is_back { event } else { Event::Lost });
                note(&mut run, &mut world, &cpu, at, &mut off_since);
                return run;
            }
            (Control::JumpPointer, _) => {
                let target = cpu.pair(30);
                if usize::from(target) >= start.program.steps.len() {
                    world.events.push(Event::Lost);
                    note(&mut run, &mut world, &cpu, at, &mut off_since);
                    return run;
                }
                target.into()
            }
            (Control::Jump | Control::Branch, place) => {
                world.events.push(Event::Leave(place.clone(), snapshot(&cpu, &world)));
                note(&mut run, &mut world, &cpu, at, &mut off_since);
                return run;
            }
        };
    }
}

/// Records the events of the last instruction.
fn note(run: &mut Run, world: &mut World<'_>, cpu: &Cpu, step: usize, off_since: &mut Option<u32>) {
    for event in world.events.drain(..) {
        let gap = off_since.map(|since| cpu.cycles - since);
        if off_since.is_some() {
            *off_since = Some(cpu.cycles);
        }
        run.events.push(Timed { event, cycle: cpu.cycles, gap, step });
    }
}

/// The low byte first, as calls do.
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
pub fn is_conditional(op: &Op) -> bool {
    matches!(op, Op::Branch(..) | Op::SkipBit(..) | Op::SkipIo(..) | Op::SkipEqual(..))
}

/// The other outcome of a conditional instruction, with its cycles.
fn opposite(op: &Op, control: Control, cpu: &mut Cpu) -> Control {
    if control != Control::Next {
        cpu.cycles -= 1;
        return Control::Next;
    }
    cpu.cycles += 1;
    if matches!(op, Op::Branch(..)) { Control::Branch } else { Control::Skip }
}
