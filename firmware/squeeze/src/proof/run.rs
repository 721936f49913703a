//! One execution of a function, as everything that the rest of the program and the chip's peripherals see of it.
//!
//! Nothing is assumed of memory: each load takes the next byte of a [`Tape`], whatever it reads, so both texts of a function have to
//! load and store the same addresses in the same order. Other functions are not executed: a call ends with new bytes of the tape as
//! its results and with garbage in the other registers that it may use.

use super::cpu::{Bus, Control, Cpu};
use super::decode::{Op, Pair, flag};
use super::program::{Place, Program};

/// Registers that a function returns as it found them (AVR-GCC ABI, "Call-saved registers").
pub const SAVED: u32 = 0x3003_fffc;
/// Where arguments are: r8 to r25.
pub const ARGUMENTS: u32 = 0x03ff_ff00;
/// Where results are: r18 to r25.
pub const RESULTS: u32 = 0x03fc_0000;

/// A return address that is no instruction: the function returns to its caller.
const CALLER: u16 = 0xffff;
/// The addresses of the stack that is executed.
const STACK: std::ops::Range<u16> = 0x7c00..0x8000;
/// The stack pointer at the beginning, at least.
const STACK_START: u16 = 0x7e00;
/// The place on the tape of SREG; those before are of the registers.
const FLAGS_AT: usize = 32;

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

/// What is seen of an execution.
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

/// The core at a call, or at the end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Snapshot {
    /// Registers and flags.
    pub cpu: Cpu,
    /// What the function has on the stack below its frame.
    pub pushed: Vec<u8>,
}

/// An event, and when it happens.
#[derive(Clone, Debug)]
pub struct Timed {
    /// What happens.
    pub event: Event,
    /// Cycles since the function was entered.
    pub cycle: u32,
    /// Cycles since the last event, if interrupts are off.
    pub gap: Option<u32>,
    /// The instruction.
    pub step: usize,
}

/// The way of a function's text to its frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frame {
    /// Bytes of registers that it saves first.
    pub saved: u16,
    /// These registers.
    pub registers: u32,
    /// Bytes of its variables.
    pub room: u16,
    /// Y points to the variables.
    pub has_pointer: bool,
    /// The first instruction behind the beginning.
    pub end: usize,
}

/// What an execution begins with.
pub struct Start<'a> {
    /// The text.
    pub program: &'a Program,
    /// The function's first instruction.
    pub entry: usize,
    /// Its frame.
    pub frame: Frame,
    /// The registers that it gets then.
    pub free: u32,
    /// Where it goes on when it has made its frame, with other registers, if not there.
    pub enter: Option<usize>,
    /// Bytes by which the stack pointer is higher, so that the variables are at the same addresses.
    pub shift: u16,
    /// The registers that are the same in both texts, from the tape.
    pub arguments: u32,
    /// It is entered by an interrupt.
    pub is_interrupt: bool,
    /// Registers with results, from the callee's symbol.
    pub results: &'a dyn Fn(&Place) -> u32,
    /// Makes what is not the same in both texts.
    pub garbage: u64,
    /// Instructions that are executed at most.
    pub limit: u32,
}

/// An execution.
pub struct Run {
    /// What was seen, in order.
    pub events: Vec<Timed>,
    /// The core at the beginning.
    pub before: Cpu,
    /// Instructions that were executed.
    pub steps: u32,
    /// The execution was stopped at the limit.
    pub is_cut: bool,
    /// The executed instructions, in order, each conditional one with its outcome.
    pub path: Vec<Passed>,
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

/// A comparison: for each of both values its place on the tape, if it stands there, and the other value.
pub type Hint = [Option<(usize, u8)>; 2];

/// Where each value comes from: a bit for each of the first 128 places on the tape.
#[derive(Clone)]
pub struct Trail {
    registers: [u128; 32],
    flags: u128,
    /// The T flag.
    copied: u128,
    hints: Vec<Hint>,
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

fn bit(place: usize) -> u128 {
    if place < 128 { 1 << place } else { 0 }
}

/// Executes a function. `reached` gets a mark for each instruction; where values come from is followed if `follows` is set.
pub fn run(start: &Start<'_>, tape: &Tape, reached: &mut [bool], follows: bool) -> Run {
    let garbage = |number: u64| mix(start.garbage ^ number.wrapping_mul(0x1_0001)) as u8;
    let mut world = World {
        tape,
        cursor: FLAGS_AT + 1,
        stack: (0..u64::from(STACK.end - STACK.start)).map(|n| garbage(n + 0x1000)).collect(),
        events: Vec::new(),
    };
    let mut trail = Trail {
        registers: [0; 32],
        flags: bit(FLAGS_AT),
        copied: bit(FLAGS_AT),
        hints: Vec::new(),
    };
    let mut registers = [0; 32];
    for (number, register) in registers.iter_mut().enumerate() {
        let is_same = start.arguments & 1 << number != 0;
        *register = if is_same { tape.at(number) } else { garbage(number as u64) };
        if is_same {
            trail.registers[number] = bit(number);
        }
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
    let mut run = Run { events: Vec::new(), before, steps: 0, is_cut: false, path: Vec::new() };
    let mut calls = 0;
    let mut off_since = None;
    let mut enter = start.enter;
    loop {
        if at == start.frame.end
            && let Some(entered) = enter.take()
        {
            at = entered;
            for number in (0..32).filter(|number| start.free & 1 << number != 0) {
                cpu.registers[number] = tape.at(number);
                trail.registers[number] = bit(number);
            }
            cpu.flags = cpu.flags & 1 << flag::I | tape.at(FLAGS_AT) & !(1 << flag::I);
            trail.flags = bit(FLAGS_AT);
            trail.copied = bit(FLAGS_AT);
        }
        if run.steps >= start.limit {
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
        let control = cpu.execute(op, &mut world);
        if let Some(old) = old {
            trail.follow(op, &old, tape, cursor);
            if is_conditional(op) {
                let is_taken = control != Control::Next;
                let tag = trail.condition(op);
                let hints = std::mem::take(&mut trail.hints);
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
                    let known = [value, garbage(calls << 8 | u64::from(number))];
                    cpu.registers[usize::from(number)] = known[usize::from(!is_same)];
                    trail.registers[usize::from(number)] = if is_same { bit(place) } else { 0 };
                }
                let place = world.cursor;
                cpu.flags = cpu.flags & 0x80 | world.next() & 0x7f;
                trail.flags = bit(place);
                trail.copied = bit(place);
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

/// Takes over what the last instruction did.
fn note(run: &mut Run, world: &mut World<'_>, cpu: &Cpu, step: usize, off_since: &mut Option<u32>) {
    for event in world.events.drain(..) {
        let gap = off_since.map(|since| cpu.cycles - since);
        if off_since.is_some() {
            *off_since = Some(cpu.cycles);
        }
        run.events.push(Timed { event, cycle: cpu.cycles, gap, step });
    }
}

/// As calls do: the low byte first.
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

/// Whether an instruction has two outcomes.
pub fn is_conditional(op: &Op) -> bool {
    matches!(op, Op::Branch(..) | Op::SkipBit(..) | Op::SkipIo(..) | Op::SkipEqual(..))
}

impl Trail {
    /// Where the outcome of a conditional instruction comes from.
    fn condition(&self, op: &Op) -> u128 {
        match *op {
            Op::Branch(flag::T, ..) => self.copied,
            Op::SkipBit(register, ..) => self.registers[usize::from(register)],
            Op::SkipEqual(one, other) => {
                self.registers[usize::from(one)] | self.registers[usize::from(other)]
            }
            _ => self.flags,
        }
    }

    /// Follows an instruction that is executed with that core, while the tape was at that place.
    fn follow(&mut self, op: &Op, cpu: &Cpu, tape: &Tape, cursor: usize) {
        let tags = self.registers;
        let at = |register: u8| tags[usize::from(register)];
        let takes_carry = |kind| matches!(kind, Pair::Adc | Pair::Sbc | Pair::Cpc);
        match *op {
            Op::Pair(kind, to, from) => {
                if matches!(kind, Pair::Cp | Pair::Cpc | Pair::Sub | Pair::Sbc) {
                    let value = |register: u8| cpu.registers[usize::from(register)];
                    self.hint([
                        place(tape, at(to), value(to), value(from)),
                        place(tape, at(from), value(from), value(to)),
                    ]);
                }
                let mut tag = self.registers[usize::from(to)] | self.registers[usize::from(from)];
                if takes_carry(kind) {
                    tag |= self.flags;
                }
                if to == from && matches!(kind, Pair::Eor | Pair::Sub) {
                    tag = 0;
                }
                self.flags = tag;
                if !matches!(kind, Pair::Cp | Pair::Cpc) {
                    self.registers[usize::from(to)] = tag;
                }
            }
            Op::Constant(kind, to, value) => {
                if matches!(kind, Pair::Cp | Pair::Sub | Pair::Sbc) {
                    self.hint([place(tape, at(to), cpu.registers[usize::from(to)], value), None]);
                }
                let carry = if takes_carry(kind) { self.flags } else { 0 };
                let tag = self.registers[usize::from(to)] | carry;
                self.flags = tag;
                if kind != Pair::Cp {
                    self.registers[usize::from(to)] = tag;
                }
            }
            Op::Single(_, register) => {
                // `ror` takes the carry.
                self.registers[usize::from(register)] |= self.flags;
                self.flags = self.registers[usize::from(register)];
            }
            Op::Multiply(_, one, other) => {
                let tag = at(one) | at(other);
                self.registers[0] = tag;
                self.registers[1] = tag;
                self.flags = tag;
            }
            Op::Word(pair, ..) => {
                let pair = usize::from(pair);
                let tag = self.registers[pair] | self.registers[pair + 1];
                self.registers[pair + 1] = tag;
                self.flags = tag;
            }
            Op::Copy(to, from) => self.registers[usize::from(to)] = at(from),
            Op::CopyPair(to, from) => {
                let tags = [at(from), at(from + 1)];
                self.registers[usize::from(to)] = tags[0];
                self.registers[usize::from(to + 1)] = tags[1];
            }
            Op::Load(to, _) => self.registers[usize::from(to)] = 0,
            Op::Read(to, _) | Op::ReadAt(to, _) | Op::ReadFlash(to, _) => {
                self.registers[usize::from(to)] = bit(cursor);
            }
            Op::In(to, from) => {
                let tag = if from < 0x3d { bit(cursor) } else { self.flags };
                self.registers[usize::from(to)] = tag;
            }
            Op::Out(0x3f, from) => {
                self.flags = at(from);
                self.copied = at(from);
            }
            Op::SkipIo(..) => self.flags |= bit(cursor),
            Op::Store(register, _) => self.copied = at(register),
            Op::Restore(register, _) => {
                self.registers[usize::from(register)] |= self.copied;
            }
            Op::Pop(register) => self.registers[usize::from(register)] = 0,
            _ => {}
        }
    }

    /// Keeps the last comparisons.
    fn hint(&mut self, hint: Hint) {
        self.hints.push(hint);
        if self.hints.len() > 4 {
            self.hints.remove(0);
        }
    }
}

/// The place of a value on the tape, if it stands there, with what it is compared with.
fn place(tape: &Tape, tag: u128, value: u8, other: u8) -> Option<(usize, u8)> {
    let place = tag.trailing_zeros() as usize;
    (tag.count_ones() == 1 && tape.at(place) == value).then_some((place, other))
}
