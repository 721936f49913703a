//! Writes one function.

use bittybuzz_compiler::asm::{FunctionBuilder, FunctionCode, Label, Shape};
use bittybuzz_compiler::source::Span;
use bittybuzz_vm_core::builtin;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::opcode::{self, Operand, Trailer};

use super::kind::{self, Kind};
use super::{IMPORTS, Program};
use crate::choices::Choices;

/// Instructions of one function.
const INSTRUCTIONS_MAX: usize = 120;
/// Values on the stack above which some are popped.
const DEEPEST: usize = 24;

/// A place that a jump leads to, with the values that there are then.
#[derive(Clone, Copy)]
struct Target {
    label: Label,
    depth: usize,
}

pub struct Writer<'a, 'b> {
    program: &'a Program,
    choices: &'a mut Choices<'b>,
    shape: Shape,
    builder: FunctionBuilder,
    /// What is known of the values from the frame's first slot on.
    kinds: Vec<Kind>,
    /// Labels ahead.
    ahead: Vec<Target>,
    /// Heads of loops.
    behind: Vec<Target>,
}

const SPAN: Span = Span { file: bittybuzz_compiler::source::FileId(0), start: 0, end: 0 };

impl<'a, 'b> Writer<'a, 'b> {
    pub fn new(program: &'a Program, shape: Shape, choices: &'a mut Choices<'b>) -> Self {
        let word_bytes = if program.full { Full::WORD_BYTES } else { Tiny::WORD_BYTES };
        Writer {
            program,
            choices,
            shape,
            builder: FunctionBuilder::new(shape, word_bytes, SPAN),
            kinds: Vec::new(),
            ahead: Vec::new(),
            behind: Vec::new(),
        }
    }

    /// The global code; it gives the globals values of their kinds first.
    pub fn global_code(mut self) -> FunctionCode {
        for global in 0..self.program.globals {
            self.value(kind::of_global(global));
            self.plain_operand(opcode::GLOBAL_SET, global as i32);
        }
        self.function(INSTRUCTIONS_MAX)
    }

    /// A function of some length.
    pub fn some_function(self) -> FunctionCode {
        let length = 1 + self.choices.below(INSTRUCTIONS_MAX);
        self.function(length)
    }

    fn function(mut self, mut left: usize) -> FunctionCode {
        while left > 0 && !self.choices.is_empty() {
            left -= 1;
            if self.builder.is_reachable() {
                self.step();
            } else if !self.bind() {
                break;
            }
        }
        while self.bind() {}
        self.builder.finish(SPAN).expect("the function keeps the rules")
    }

    /// An instruction, the start of a loop, or the place that a jump led to.
    fn step(&mut self) {
        match self.choices.byte() {
            248.. if self.behind.len() < 4 => {
                let label = self.builder.loop_head(None, SPAN);
                // Values are of other kinds when it comes here again.
                self.kinds.clear();
                self.behind.push(Target { label, depth: self.builder.depth() });
            }
            228.. => {
                self.bind();
            }
            choice => {
                let table = opcode::TABLE;
                self.instruction(&table[usize::from(choice) % table.len()]);
            }
        }
    }

    /// Binds the label that was made last; `false` if there is none.
    fn bind(&mut self) -> bool {
        let Some(Target { label, depth }) = self.ahead.pop() else { return false };
        if self.builder.is_reachable() {
            self.adjust(depth);
        }
        self.builder.bind(label, SPAN);
        self.kinds.clear();
        true
    }

    /// Values that may be popped.
    fn values(&self) -> usize {
        self.builder.depth() - self.shape.hidden()
    }

    /// Remembers what was made, if it is there.
    fn made(&mut self, depth_before: usize, kind: Kind) {
        let depth = self.builder.depth();
        self.kinds.resize(depth_before.min(depth), Kind::Any);
        self.kinds.resize(depth, Kind::Any);
        if let Some(top) = self.kinds.last_mut() {
            *top = kind;
        }
    }

    /// Pops or pushes until there are so many values.
    fn adjust(&mut self, depth: usize) {
        self.builder.pop(self.builder.depth().saturating_sub(depth), SPAN);
        self.kinds.truncate(depth);
        while self.builder.depth() < depth {
            self.value(Kind::Any);
        }
    }

    /// Sees to it that there are so many values on top, mostly of the kinds wanted.
    fn need(&mut self, count: usize, wanted: &[Kind]) {
        let wanted = &wanted[..wanted.len().min(count)];
        self.kinds.resize(self.builder.depth(), Kind::Any);
        let top = self.kinds.iter().rev().take(count).rev();
        let suit = top.zip(wanted).all(|(is, wanted)| *wanted == Kind::Any || is == wanted);
        if self.values() >= count && (suit || self.choices.byte() < 8) {
            return;
        }
        for number in 0..count {
            self.value(wanted.get(number).copied().unwrap_or(Kind::Any));
        }
    }

    /// A value, of that kind if any is wanted.
    fn value(&mut self, kind: Kind) {
        const KINDS: [Kind; 5] =
            [Kind::Any, Kind::Number, Kind::Number, Kind::Table, Kind::Function];
        let choice = self.choices.byte();
        let number = usize::from(choice >> 3);
        let kind = match kind {
            Kind::Any => KINDS[usize::from(choice & 7) % KINDS.len()],
            kind => kind,
        };
        let globals = (0..self.program.globals).filter(|global| kind::of_global(*global) == kind);
        let globals: Vec<usize> = globals.collect();
        let depth = self.builder.depth();
        match (kind, globals.as_slice()) {
            (_, [first, ..]) if number >= 24 => {
                let global = globals.get(number - 24).unwrap_or(first);
                self.plain_operand(opcode::GLOBAL_GET, *global as i32);
            }
            (Kind::Any, _) if number.is_multiple_of(2) => self.builder.plain(opcode::NIL, SPAN),
            (Kind::Any | Kind::String, _) => {
                self.plain_operand(opcode::STRING, (number % self.program.strings) as i32);
            }
            (Kind::Number, _) => self.builder.int(number as i32 - 4, SPAN),
            (Kind::Table, _) => self.builder.plain(opcode::TABLE_NEW, SPAN),
            (Kind::Function, _) => self.function_value(number),
        }
        self.made(depth, kind);
    }

    /// A function as a value: a constant or a closure.
    fn function_value(&mut self, number: usize) {
        let number = number % self.program.shapes.len();
        if self.program.shapes[number].captures {
            self.builder.int(number as i32, SPAN);
            self.builder.plain(opcode::TABLE_NEW, SPAN);
            self.builder.closure(number as i32, 2, SPAN);
        } else {
            self.plain_operand(opcode::FUNCTION, number as i32);
        }
    }

    fn plain_operand(&mut self, opcode: u8, operand: i32) {
        self.builder.operand(opcode, operand, SPAN);
    }

    fn instruction(&mut self, info: &opcode::OpcodeInfo) {
        if self.values() > DEEPEST {
            self.builder.pop(DEEPEST / 2, SPAN);
        }
        match (info.operand, info.trailer) {
            (Operand::Jump, trailer) => self.jump(info, trailer),
            (operand, Trailer::None) => self.without_trailer(info, operand),
            (_, Trailer::Word | Trailer::Half) => {
                let bytes = [(); 4].map(|()| self.choices.byte());
                self.builder.word(info.byte, u32::from_le_bytes(bytes), SPAN);
            }
            (Operand::Builtin, _) => self.call_builtin(info.byte),
            (Operand::Robot, _) => {
                let number = self.choices.below(IMPORTS.len());
                let (arguments, drop) = (self.choices.below(4), self.choices.flag());
                self.need(arguments, &[]);
                self.builder.call_native(info.byte, number as i32, arguments, drop, SPAN);
            }
            (Operand::Function, _) => {
                let number = self.choices.below(self.program.shapes.len());
                let captures = 1 + self.choices.below(3);
                let shape = self.program.shapes[number];
                if shape.captures || shape.uses_self {
                    self.need(captures, &[]);
                    self.builder.closure(number as i32, captures, SPAN);
                }
            }
            (Operand::Local, _) => {
                if let Some(local) = self.local(0, true) {
                    let immediate = self.choices.byte() as i8;
                    self.builder.local_add(local, immediate, SPAN);
                }
            }
            _ => {}
        }
        let (depth, pushes) = (self.builder.depth(), usize::from(info.pushes));
        // A call whose result is dropped makes nothing, but then nothing is known of what is on top either.
        self.made(
            depth.saturating_sub(pushes),
            if pushes > 0 { kind::made(info.byte) } else { Kind::Any },
        );
    }

    fn without_trailer(&mut self, info: &opcode::OpcodeInfo, operand: Operand) {
        let Some((number, counted)) = self.operand(info, operand) else { return };
        let of_global = [kind::of_global(number as usize)];
        let wanted = if operand == Operand::Global { &of_global } else { kind::wanted(info.byte) };
        self.need(usize::from(info.pops) + counted, wanted);
        match (operand, info.byte) {
            (Operand::None, byte) => self.builder.plain(byte, SPAN),
            (_, opcode::CALL_FUNCTION) => self.builder.call_function(number, counted, SPAN),
            (_, byte) => self.plain_operand(byte, number),
        }
    }

    fn call_builtin(&mut self, opcode: u8) {
        let builtin = self.program.builtin(self.choices);
        if builtin.kind == builtin::BuiltinKind::Value {
            return;
        }
        // Mostly as many arguments as there must be.
        let choice = self.choices.byte();
        let fitting = usize::from(builtin.min) + usize::from(builtin.max > builtin.min);
        let arguments = if choice < 16 { usize::from(choice) % 4 } else { fitting };
        let drop = choice & 16 != 0 && builtin.kind == builtin::BuiltinKind::Plain;
        self.need(arguments, kind::arguments(builtin));
        self.builder.call_native(opcode, i32::from(builtin.number), arguments, drop, SPAN);
    }

    /// Returns an operand, and the number of values that it pops in addition to those of the table.
    /// `None` if nothing exists that it could name.
    fn operand(&mut self, info: &opcode::OpcodeInfo, operand: Operand) -> Option<(i32, usize)> {
        let program = self.program;
        let number = match operand {
            Operand::None => 0,
            Operand::Int => match self.choices.byte() {
                // Now and then one that needs two bytes.
                0x80 => i32::from(i16::from_le_bytes([self.choices.byte(), self.choices.byte()])),
                byte => i32::from(byte as i8),
            },
            Operand::String => self.choices.below(program.strings) as i32,
            Operand::Library => self.choices.below(builtin::Library::ALL.len()) as i32,
            Operand::Global => self.choices.below(program.globals) as i32,
            Operand::Robot => self.choices.below(IMPORTS.len()) as i32,
            Operand::Builtin => {
                let builtin = program.builtin(self.choices);
                (builtin.kind != builtin::BuiltinKind::Value)
                    .then_some(i32::from(builtin.number))?
            }
            Operand::Function => {
                let number = self.choices.below(program.shapes.len());
                let shape = program.shapes[number];
                let counted = if info.byte == opcode::CALL_FUNCTION { shape.parameters } else { 0 };
                return (!shape.captures).then_some((number as i32, counted));
            }
            Operand::Local => {
                self.need(usize::from(info.pops), &[]);
                self.local(usize::from(info.pops), info.byte == opcode::LOCAL_SET)?
            }
            Operand::Capture => self.shape.captures.then(|| self.choices.below(4) as i32)?,
            Operand::Count => {
                let count = self.choices.below(4);
                return Some((count as i32, count));
            }
            Operand::Parameters => self.shape.parameters as i32,
            Operand::Jump => return None,
        };
        Some((number, 0))
    }

    /// A local below the values that the instruction pops.
    fn local(&mut self, pops: usize, written: bool) -> Option<i32> {
        let lowest = if written { self.shape.hidden() } else { 0 };
        let own = (self.builder.depth() - pops).saturating_sub(lowest);
        let chosen = self.choices.below((own + self.shape.parameters).clamp(1, 256));
        if chosen < own {
            if written && let Some(kind) = self.kinds.get_mut(lowest + chosen) {
                *kind = Kind::Any;
            }
            Some((lowest + chosen + 1) as i32)
        } else {
            (chosen - own < self.shape.parameters).then(|| -((chosen - own) as i32) - 1)
        }
    }

    /// The operands of a jump: for one that compares a local, that as the only one.
    fn operands(&mut self, info: &opcode::OpcodeInfo, trailer: Trailer) {
        if trailer == Trailer::LocalImmediate {
            match self.local(0, false) {
                Some(local) => self.plain_operand(opcode::LOCAL_GET, local),
                None => self.value(Kind::Number),
            }
        } else {
            for number in 0..usize::from(info.pops) {
                self.value(kind::wanted(info.byte).get(number).copied().unwrap_or(Kind::Any));
            }
        }
    }

    fn jump(&mut self, info: &opcode::OpcodeInfo, trailer: Trailer) {
        let choice = self.choices.byte();
        let keeps = usize::from(matches!(info.byte, opcode::AND | opcode::OR));
        let pick = |targets: &[Target]| {
            let chosen = usize::from(choice >> 2).checked_rem(targets.len());
            chosen.map(|chosen| targets[chosen])
        };
        let target = match choice & 3 {
            0 if keeps == 0 => pick(&self.behind),
            // Where a truth value is kept, the stack is never empty.
            1 => pick(&self.ahead).filter(|target| target.depth >= self.shape.hidden() + keeps),
            _ => None,
        };
        let pops = usize::from(info.pops).max(usize::from(trailer == Trailer::LocalImmediate));
        match target {
            Some(target) => {
                self.adjust(target.depth - keeps);
                self.operands(info, trailer);
            }
            None if trailer == Trailer::LocalImmediate => self.operands(info, trailer),
            None => self.need(pops, kind::wanted(info.byte)),
        }
        let label = match target {
            Some(target) => target.label,
            None => {
                let label = self.builder.label();
                self.ahead.push(Target { label, depth: self.builder.depth() - pops + keeps });
                label
            }
        };
        // The assembler itself joins the comparison with the local.
        let relation = match trailer {
            Trailer::LocalImmediate => opcode::JUMP_LT,
            _ => info.byte.wrapping_sub(opcode::WITH_INT),
        };
        match trailer {
            Trailer::None => self.builder.jump(info.byte, label, SPAN),
            _ => {
                // Small ones have a form whatever is compared.
                let immediate = i16::from(self.choices.byte() as i8);
                self.builder.jump_int(relation, immediate, label, SPAN);
            }
        }
    }
}
