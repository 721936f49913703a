//! Assembler for one function of an image.
//!
//! [`FunctionBuilder`] takes instructions in order and returns the bytes of the function. It does
//! not depend on the syntax tree, so every producer of images can use it: code generation and the
//! importer of `.bo` files.
//!
//! The verifier on the robot accepts only code that follows its rules (`docs/image-format.md`). The
//! assembler keeps these rules for both producers, so that they are implemented once:
//!
//! * It counts the depth of the operand stack at every instruction. All paths to one instruction
//!   must have the same depth, and the greatest depth goes into the function's header.
//! * It drops unreachable instructions, because their depth is unknown.
//! * It allows a loop to be entered only by the jump of [`FunctionBuilder::loop_head`], so that a
//!   single forward pass knows the depth at the head of the loop.
//!
//! It also chooses the shortest form of each operand. The length of a jump changes the distances of
//! other jumps. Every jump therefore starts in its short form; jumps that do not reach their target
//! become wide, until all of them reach it.

use bittybuzz_vm_core::opcode::{self, DROP_RESULT, Operand, SHORTS, WIDE};

use crate::limits::{ARGUMENTS_MAX, CAPTURES_MAX, DEPTH_MAX, PARAMETERS_MAX};
use crate::source::Span;

/// The length of a function's header in bytes.
pub const HEADER_BYTES: usize = 2;

/// The facts in the header of a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Shape {
    /// Number of parameters.
    pub parameters: usize,
    /// The function has captured values; its first hidden slot is the closure.
    pub captures: bool,
    /// The function uses `self`, in the next hidden slot.
    pub uses_self: bool,
}

impl Shape {
    /// Hidden slots at the bottom of the frame.
    pub fn hidden(self) -> usize {
        usize::from(self.captures) + usize::from(self.uses_self)
    }

    /// Number of the local that holds the self of the closure or of the caller, if the function
    /// uses `self`.
    pub fn self_local(self) -> i32 {
        1 + i32::from(self.captures)
    }
}

/// The target of a jump. Only the builder that made it can use it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Label(usize);

/// A position in the code. Its offset is known once the function is assembled: see
/// [`FunctionCode::offset`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CodeMark(usize);

/// A reason why a function cannot be assembled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AsmErrorKind {
    /// More than [`PARAMETERS_MAX`] parameters.
    TooManyParameters,
    /// More than [`DEPTH_MAX`] slots.
    TooDeep,
    /// More than [`ARGUMENTS_MAX`] arguments or [`CAPTURES_MAX`] captured values.
    TooManyArguments,
    /// An operand outside -32768 to 32767.
    OperandRange,
    /// A jump over more than 32767 bytes.
    JumpTooFar,
    /// The opcode does not exist, or takes another form of operand or trailer: a mistake of the
    /// caller.
    BadOpcode,
    /// An instruction pops more values than the stack holds: a mistake of the caller.
    Underflow,
    /// Two paths to one instruction leave different numbers of values: a mistake of the caller.
    DepthMismatch,
    /// A jump to an unbound label, or a backward jump to a label that is no loop head: a mistake of
    /// the caller.
    BadLabel,
}

/// A reason why a function cannot be assembled, and its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AsmError {
    pub kind: AsmErrorKind,
    /// The source of the instruction that failed.
    pub span: Span,
}

/// An assembled function.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FunctionCode {
    /// Header and instructions.
    pub bytes: Vec<u8>,
    /// The sources of the instructions, ascending. The offset in `bytes` is that of the first of
    /// consecutive instructions with the same span.
    pub lines: Vec<(usize, Span)>,
    /// Offsets in `bytes` of the marks.
    pub marks: Vec<usize>,
}

impl FunctionCode {
    /// Returns the offset in `bytes` of a mark of this function.
    pub fn offset(&self, mark: CodeMark) -> usize {
        self.marks[mark.0]
    }
}

#[derive(Debug, Clone, Copy)]
enum Argument {
    Value(i16),
    Target(Label),
}

#[derive(Debug, Clone, Copy)]
struct AsmItem {
    opcode: u8,
    argument: Argument,
    trailer: [u8; 4],
    trailer_length: usize,
    span: Span,
    /// The head of the loop that this `JUMP` enters; the head is the next instruction.
    enters: Option<Label>,
    /// Removed instructions emit no bytes. They stay in the list so that labels keep their
    /// positions.
    removed: bool,
    /// A jump that needs the wide form.
    wide: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct LabelState {
    /// Index of the instruction that follows the label; `None` until the label is bound.
    position: Option<usize>,
    /// The stack depth at all jumps to the label.
    depth: Option<usize>,
    is_loop_head: bool,
}

/// Builds one function.
#[derive(Debug)]
pub struct FunctionBuilder {
    shape: Shape,
    word_bytes: usize,
    items: Vec<AsmItem>,
    labels: Vec<LabelState>,
    /// For each mark the number of instructions before it.
    marks: Vec<usize>,
    depth: usize,
    deepest: usize,
    reachable: bool,
    error: Option<AsmError>,
}

impl FunctionBuilder {
    /// Creates a builder without instructions. `word_bytes` is the profile's size of a literal; an
    /// invalid shape is reported at `span`.
    pub fn new(shape: Shape, word_bytes: usize, span: Span) -> Self {
        let mut builder = FunctionBuilder {
            shape,
            word_bytes,
            items: Vec::new(),
            labels: Vec::new(),
            marks: Vec::new(),
            depth: shape.hidden(),
            deepest: shape.hidden(),
            reachable: true,
            error: None,
        };
        if shape.parameters > PARAMETERS_MAX {
            builder.fail(AsmErrorKind::TooManyParameters, span);
        }
        builder
    }

    /// Returns the number of slots in use above the frame record. The next value pushed is local
    /// number `depth() + 1`.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// Returns true if control can reach this place. Instructions at other places are dropped.
    pub fn is_reachable(&self) -> bool {
        self.reachable
    }

    /// Appends an instruction without an operand.
    pub fn plain(&mut self, opcode: u8, span: Span) {
        self.push(opcode, Argument::Value(0), &[], (0, 0), span);
    }

    /// Appends an instruction with an operand and without a trailer.
    pub fn operand(&mut self, opcode: u8, operand: i32, span: Span) {
        let counted = match opcode {
            opcode::CALL | opcode::CALL_METHOD | opcode::POP_N => {
                usize::try_from(operand).expect("a count of values is not negative")
            }
            _ => 0,
        };
        let argument = self.value(operand, span);
        self.push(opcode, argument, &[], (counted, 0), span);
    }

    /// Appends `CALL_FUNCTION` for a function with that number of parameters.
    pub fn call_function(&mut self, function: i32, parameters: usize, span: Span) {
        let argument = self.value(function, span);
        self.push(opcode::CALL_FUNCTION, argument, &[], (parameters, 0), span);
    }

    /// Appends `CALL_BUILTIN` or `CALL_ROBOT`. With `drop`, the call leaves no result on the stack.
    pub fn call_native(
        &mut self,
        opcode: u8,
        number: i32,
        arguments: usize,
        drop: bool,
        span: Span,
    ) {
        let argument = self.value(number, span);
        if arguments > ARGUMENTS_MAX {
            self.fail(AsmErrorKind::TooManyArguments, span);
        }
        let count = arguments.min(ARGUMENTS_MAX) as u8 | if drop { DROP_RESULT } else { 0 };
        self.push(opcode, argument, &[count], (arguments, usize::from(drop)), span);
    }

    /// Appends `CLOSURE`. The captured values are on the stack, preceded by self if the function
    /// uses it.
    pub fn closure(&mut self, function: i32, captures: usize, span: Span) {
        let argument = self.value(function, span);
        if captures > CAPTURES_MAX {
            self.fail(AsmErrorKind::TooManyArguments, span);
        }
        let count = captures.min(CAPTURES_MAX) as u8;
        self.push(opcode::CLOSURE, argument, &[count], (captures, 0), span);
    }

    /// Appends `LOCAL_ADD`, which adds `immediate` to a local.
    pub fn local_add(&mut self, local: i32, immediate: i8, span: Span) {
        let argument = self.value(local, span);
        self.push(opcode::LOCAL_ADD, argument, &immediate.to_le_bytes(), (0, 0), span);
    }

    /// Appends an integer literal of the profile in its shortest form.
    pub fn int(&mut self, value: i32, span: Span) {
        if i16::try_from(value).is_ok() {
            self.operand(opcode::INT, value, span);
        } else {
            self.word(opcode::INT_WORD, value as u32, span);
        }
    }

    /// Appends a float literal with the payload of the profile in its shortest form.
    pub fn float(&mut self, bits: u32, span: Span) {
        let half = self.word_bytes == 4 && bits & 0xffff == 0;
        self.word(if half { opcode::FLOAT_HALF } else { opcode::FLOAT }, bits, span);
    }

    /// Appends `FLOAT`, `FLOAT_HALF` or `INT_WORD` with the payload of the profile.
    pub fn word(&mut self, opcode: u8, bits: u32, span: Span) {
        let bytes = bits.to_le_bytes();
        let from = if opcode == opcode::FLOAT_HALF { self.word_bytes - 2 } else { 0 };
        self.push(opcode, Argument::Value(0), &bytes[from..self.word_bytes], (0, 0), span);
    }

    /// Pops `count` values from the stack.
    pub fn pop(&mut self, count: usize, span: Span) {
        match count {
            0 => {}
            1 => self.plain(opcode::POP, span),
            _ => self.operand(opcode::POP_N, count as i32, span),
        }
    }

    /// Returns from the function with the value on top of the stack.
    pub fn ret(&mut self, span: Span) {
        self.operand(opcode::RETURN, self.shape.parameters as i32, span);
    }

    /// Returns nil from the function.
    pub fn ret_nil(&mut self, span: Span) {
        self.operand(opcode::RETURN_NIL, self.shape.parameters as i32, span);
    }

    /// Creates a label, to be bound later.
    pub fn label(&mut self) -> Label {
        self.labels.push(LabelState::default());
        Label(self.labels.len() - 1)
    }

    /// Marks the place of the next instruction, or the end of the function if none follows.
    pub fn mark(&mut self) -> CodeMark {
        self.marks.push(self.items.len());
        CodeMark(self.marks.len() - 1)
    }

    /// Appends a jump that compares the value on top of the stack with an integer. `opcode` is the
    /// jump that compares two values in the same way. Returns false if no instruction fits, because
    /// the integer needs two bytes and the value is not a local.
    pub fn jump_int(&mut self, opcode: u8, immediate: i16, target: Label, span: Span) -> bool {
        if !self.reachable {
            return true;
        }
        let opcode = opcode + opcode::WITH_INT;
        let [low, high] = immediate.to_le_bytes();
        match self.local_on_top().and_then(|local| opcode::local_with_relation(opcode, local)) {
            Some(local) => {
                self.items.pop();
                self.depth -= 1;
                let trailer = [local, low, high];
                self.push(opcode::JUMP_LOCAL, Argument::Target(target), &trailer, (0, 0), span);
            }
            None if i8::try_from(immediate).is_err() => return false,
            None => self.push(opcode, Argument::Target(target), &[low], (0, 0), span),
        }
        self.arrive(target, self.depth, span);
        true
    }

    /// Returns the local that the last instruction pushed, unless a jump leads to the place after
    /// that instruction.
    fn local_on_top(&self) -> Option<i16> {
        let here = Some(self.items.len());
        match self.items.last()? {
            AsmItem { opcode: opcode::LOCAL_GET, argument: Argument::Value(local), .. }
                if self.labels.iter().all(|label| label.position != here) =>
            {
                Some(*local)
            }
            _ => None,
        }
    }

    /// Appends a jump, `AND` or `OR`. A backward jump needs a label of
    /// [`FunctionBuilder::loop_head`].
    pub fn jump(&mut self, opcode: u8, target: Label, span: Span) {
        if !self.reachable {
            return;
        }
        self.push(opcode, Argument::Target(target), &[], (0, 0), span);
        // AND and OR push their result when they jump.
        let kept = usize::from(matches!(opcode, opcode::AND | opcode::OR));
        self.arrive(target, self.depth + kept, span);
    }

    /// Binds a label to the next instruction.
    pub fn bind(&mut self, label: Label, span: Span) {
        let state = &mut self.labels[label.0];
        if state.position.is_some() {
            return self.fail(AsmErrorKind::BadLabel, span);
        }
        state.position = Some(self.items.len());
        match state.depth {
            Some(depth) if self.reachable && depth != self.depth => {
                self.fail(AsmErrorKind::DepthMismatch, span);
            }
            Some(depth) => {
                self.depth = depth;
                self.reachable = true;
            }
            // Nothing jumps here yet, and only the head of a loop may be the target of a later
            // jump.
            None => {}
        }
    }

    /// Starts a loop. Jumps to `entry`, or to the first instruction of the loop if there is no
    /// `entry`. Returns the label of that first instruction, to which the loop jumps back.
    pub fn loop_head(&mut self, entry: Option<Label>, span: Span) -> Label {
        let head = self.label();
        let reachable = self.reachable;
        if reachable {
            self.jump(opcode::JUMP, entry.unwrap_or(head), span);
            let jump =
                self.items.last_mut().expect("a jump was appended, because control gets here");
            jump.enters = Some(head);
        }
        let (position, depth) = (self.items.len(), self.depth);
        self.labels[head.0] =
            LabelState { position: Some(position), depth: Some(depth), is_loop_head: true };
        self.reachable = reachable;
        head
    }

    /// Assembles the function. If control can reach the end, a return of nil is appended, with
    /// `end` as its source.
    pub fn finish(mut self, end: Span) -> Result<FunctionCode, AsmError> {
        if self.reachable {
            self.ret_nil(end);
        }
        if let Some(error) = self.error {
            return Err(error);
        }
        self.check_jumps()?;
        self.shorten_jumps();
        let offsets = self.layout()?;
        Ok(self.encode(&offsets))
    }

    fn value(&mut self, operand: i32, span: Span) -> Argument {
        match i16::try_from(operand) {
            Ok(operand) => Argument::Value(operand),
            Err(_) => {
                self.fail(AsmErrorKind::OperandRange, span);
                Argument::Value(0)
            }
        }
    }

    fn fail(&mut self, kind: AsmErrorKind, span: Span) {
        // Only the first error is kept, because it causes those that follow.
        self.error.get_or_insert(AsmError { kind, span });
    }

    /// Appends an instruction. The instruction pops `counted` more values and pushes `dropped`
    /// fewer values than the opcode table states.
    fn push(
        &mut self,
        opcode: u8,
        argument: Argument,
        trailer: &[u8],
        (counted, dropped): (usize, usize),
        span: Span,
    ) {
        if !self.reachable {
            return;
        }
        let Some(effect) = opcode::info(opcode) else {
            return self.fail(AsmErrorKind::BadOpcode, span);
        };
        let expected = effect.trailer.length(self.word_bytes);
        let is_jump = matches!(argument, Argument::Target(_));
        if expected != trailer.len() || is_jump != (effect.operand == Operand::Jump) {
            return self.fail(AsmErrorKind::BadOpcode, span);
        }
        let Some(left) = self.depth.checked_sub(usize::from(effect.pops) + counted) else {
            return self.fail(AsmErrorKind::Underflow, span);
        };
        if left < self.shape.hidden() {
            return self.fail(AsmErrorKind::Underflow, span);
        }
        self.depth = left + usize::from(effect.pushes) - dropped.min(usize::from(effect.pushes));
        self.deepest = self.deepest.max(self.depth);
        if self.deepest > DEPTH_MAX {
            self.fail(AsmErrorKind::TooDeep, span);
        }
        let mut bytes = [0; 4];
        for (to, from) in bytes.iter_mut().zip(trailer) {
            *to = *from;
        }
        self.items.push(AsmItem {
            opcode,
            argument,
            trailer: bytes,
            trailer_length: trailer.len(),
            span,
            enters: None,
            removed: false,
            wide: false,
        });
        if is_terminator(opcode) {
            self.reachable = false;
        }
    }

    fn arrive(&mut self, target: Label, depth: usize, span: Span) {
        let state = &mut self.labels[target.0];
        let backward = state.position.is_some();
        if backward && !state.is_loop_head {
            return self.fail(AsmErrorKind::BadLabel, span);
        }
        if *state.depth.get_or_insert(depth) != depth {
            self.fail(AsmErrorKind::DepthMismatch, span);
        }
    }

    /// Returns the first instruction after a label that was not removed; `None` if the label is
    /// unbound or no instruction follows it.
    fn target(&self, label: Label) -> Option<usize> {
        let position = self.labels[label.0].position?;
        (position..self.items.len()).find(|&at| !self.items[at].removed)
    }

    /// Returns the target of a jump after [`FunctionBuilder::check_jumps`].
    fn checked_target(&self, label: Label) -> usize {
        self.target(label).expect("`check_jumps` found a target, and targets are never removed")
    }

    fn check_jumps(&self) -> Result<(), AsmError> {
        for item in &self.items {
            if let Argument::Target(label) = item.argument
                && self.target(label).is_none()
            {
                return Err(AsmError { kind: AsmErrorKind::BadLabel, span: item.span });
            }
        }
        Ok(())
    }

    /// Returns true if a jump other than the one that enters the loop leads to that label.
    fn is_repeated(&self, head: Label) -> bool {
        self.items.iter().any(|item| {
            !item.removed
                && item.enters != Some(head)
                && matches!(item.argument, Argument::Target(label) if label == head)
        })
    }

    /// Removes jumps to the next instruction, replaces a jump to `RETURN_NIL` with that return, and
    /// removes a final `RETURN_NIL` that is unreachable after that.
    fn shorten_jumps(&mut self) {
        for at in 0..self.items.len() {
            let item = self.items[at];
            let Argument::Target(label) = item.argument else { continue };
            let needed = item.enters.is_some_and(|head| self.is_repeated(head));
            if item.opcode != opcode::JUMP || needed {
                continue;
            }
            let to = self.checked_target(label);
            let is_next = to > at && self.items[at + 1..to].iter().all(|item| item.removed);
            if is_next {
                self.items[at].removed = true;
            } else if self.items[to].opcode == opcode::RETURN_NIL {
                self.items[at] = self.items[to];
            }
        }
        let last = self.items.len() - 1;
        let follows_terminator = self.items[..last]
            .iter()
            .rev()
            .find(|item| !item.removed)
            .is_some_and(|item| is_terminator(item.opcode));
        let is_target = self.items.iter().any(|item| match item.argument {
            Argument::Target(label) => !item.removed && self.target(label) == Some(last),
            Argument::Value(_) => false,
        });
        let item = &mut self.items[last];
        if item.opcode == opcode::RETURN_NIL && follows_terminator && !is_target {
            item.removed = true;
        }
    }

    /// Returns the offsets of all instructions and of the end, counted from the first instruction.
    /// Jumps start narrow and become wide where they must. A wider jump can only lengthen other
    /// jumps, so the loop ends.
    fn layout(&mut self) -> Result<Vec<usize>, AsmError> {
        loop {
            let mut offsets = Vec::with_capacity(self.items.len() + 1);
            let mut offset = 0;
            for item in &self.items {
                offsets.push(offset);
                offset += length(item);
            }
            offsets.push(offset);
            let mut grown = Vec::new();
            for (at, item) in self.items.iter().enumerate() {
                let Argument::Target(label) = item.argument else { continue };
                if item.removed {
                    continue;
                }
                let distance = self.distance(&offsets, at, label);
                if i16::try_from(distance).is_err() {
                    return Err(AsmError { kind: AsmErrorKind::JumpTooFar, span: item.span });
                }
                if !item.wide && i8::try_from(distance).is_err() {
                    grown.push(at);
                }
            }
            if grown.is_empty() {
                return Ok(offsets);
            }
            for at in grown {
                self.items[at].wide = true;
            }
        }
    }

    /// Returns the distance in bytes from the end of the jump at `at` to its target.
    fn distance(&self, offsets: &[usize], at: usize, label: Label) -> i64 {
        offsets[self.checked_target(label)] as i64 - offsets[at + 1] as i64
    }

    fn encode(&self, offsets: &[usize]) -> FunctionCode {
        let flags = u8::from(self.shape.captures) << 6 | u8::from(self.shape.uses_self) << 7;
        let mut bytes = vec![self.shape.parameters as u8 | flags, self.deepest as u8];
        let mut lines: Vec<(usize, Span)> = Vec::new();
        for (at, item) in self.items.iter().enumerate() {
            if item.removed {
                continue;
            }
            if lines.last().is_none_or(|(_, span)| *span != item.span) {
                lines.push((bytes.len(), item.span));
            }
            match item.argument {
                Argument::Value(_) if item.opcode < 0x40 => bytes.push(item.opcode),
                Argument::Value(operand) => encode_operand(&mut bytes, item.opcode, operand),
                Argument::Target(label) => {
                    let distance = i16::try_from(self.distance(offsets, at, label));
                    let distance = distance.expect("`layout` refuses jumps that are too far");
                    let [low, high] = distance.to_le_bytes();
                    if item.wide {
                        bytes.extend([item.opcode | WIDE, low, high]);
                    } else {
                        bytes.extend([item.opcode, low]);
                    }
                }
            }
            bytes.extend(item.trailer.iter().take(item.trailer_length));
        }
        let marks = self.marks.iter().map(|mark| HEADER_BYTES + offsets[*mark]).collect();
        FunctionCode { bytes, lines, marks }
    }
}

fn is_terminator(opcode: u8) -> bool {
    matches!(opcode, opcode::JUMP | opcode::RETURN | opcode::RETURN_NIL)
}

fn length(item: &AsmItem) -> usize {
    if item.removed {
        return 0;
    }
    let own = match item.argument {
        Argument::Value(_) if item.opcode < 0x40 => 1,
        Argument::Value(operand) => {
            if short_form(item.opcode, operand).is_some() {
                1
            } else if i8::try_from(operand).is_ok() {
                2
            } else {
                3
            }
        }
        Argument::Target(_) => 2 + usize::from(item.wide),
    };
    own + item.trailer_length
}

fn short_form(opcode: u8, operand: i16) -> Option<u8> {
    let form = SHORTS.iter().find(|form| form.opcode == opcode)?;
    let step = u8::try_from(operand.checked_sub(form.low)?).ok()?;
    (step < form.count).then(|| form.first + step)
}

fn encode_operand(bytes: &mut Vec<u8>, opcode: u8, operand: i16) {
    let [low, high] = operand.to_le_bytes();
    if let Some(byte) = short_form(opcode, operand) {
        bytes.push(byte);
    } else if i8::try_from(operand).is_ok() {
        bytes.extend([opcode, low]);
    } else {
        bytes.extend([opcode | WIDE, low, high]);
    }
}
