//! Code of one function: its frame and its statements.

use bittybuzz_vm_core::opcode;

use crate::asm::{AsmError, CodeMark, FunctionBuilder, FunctionCode, Shape};
use crate::check::names::Meaning;
use crate::check::tree::{
    CheckedBlock, CheckedBranch, CheckedExpr, CheckedExprKind, CheckedFunction, CheckedLink,
    CheckedStmt, CheckedStmtKind, FunctionId, LocalId, LocalKind, NameId,
};
use crate::codegen::fold;
use crate::codegen::generator::{Generator, nowhere, operand};
use crate::codegen::locals::{LocalRange, Locals};
use crate::codegen::operands::added_literal;
use crate::profile;
use crate::source::Span;
use crate::symbols::LocalPlace;

/// The code of a function, with the places of its locals and statements for the symbols.
pub struct GeneratedCode {
    pub code: FunctionCode,
    pub locals: Vec<LocalRange>,
    /// Offset of the first byte of each statement in the code, ascending, and its source.
    pub statements: Vec<(usize, Span)>,
}

/// Generates a function.
pub fn generate(generator: &mut Generator<'_>, id: FunctionId) -> Result<GeneratedCode, AsmError> {
    let program = generator.program;
    let function = program.function(id);
    let shape = shape(generator, id);
    let word_bytes = profile::word_bytes(generator.profile);
    let mut code = GeneratedFunction {
        function,
        shape,
        builder: FunctionBuilder::new(shape, word_bytes, function.span),
        slots: vec![0; function.locals.len()],
        locals: Locals::default(),
        statements: Vec::new(),
        generator,
    };
    let start = code.builder.mark();
    code.open_arguments(start);
    if id == FunctionId::GLOBAL {
        code.first_values();
    }
    code.copy_assigned_captures(start);
    code.stmts(&function.body);
    let GeneratedFunction { builder, locals, statements, .. } = code;
    let code = builder.finish(end_of(function.span))?;
    let locals = locals.finish(&code);
    let statements = statements.into_iter().map(|(mark, span)| (code.offset(mark), span));
    let mut statements: Vec<(usize, Span)> = statements.collect();
    // Of two statements at one offset, the first has no code. A loop's condition comes after its
    // body, but its marks are made in the order of the code, so the offsets ascend.
    statements.reverse();
    statements.dedup_by_key(|(offset, _)| *offset);
    statements.reverse();
    Ok(GeneratedCode { code, locals, statements })
}

/// Returns the facts in the header of a function.
pub fn shape(generator: &Generator<'_>, id: FunctionId) -> Shape {
    let function = generator.program.function(id);
    Shape {
        parameters: function.parameters,
        captures: !function.captures.is_empty(),
        uses_self: function.uses_self && !generator.meanings.self_is_nil(id),
    }
}

/// Returns the place at an offset from the frame record. An offset that does not fit belongs to a
/// frame that is too deep. The assembler refuses it, and the symbols are discarded.
fn frame_place(offset: i32) -> LocalPlace {
    LocalPlace::Frame(i16::try_from(offset).unwrap_or(i16::MAX))
}

/// Returns the place of a captured value. The assembler refuses more than
/// [`CAPTURES_MAX`](crate::limits::CAPTURES_MAX) of them, so a number that does not fit is discarded
/// with the symbols.
fn capture_place(index: usize) -> LocalPlace {
    LocalPlace::Capture(u16::try_from(index).unwrap_or(u16::MAX))
}

/// Returns the span of the closing brace, the source of an implicit return.
fn end_of(span: Span) -> Span {
    Span { start: span.end.saturating_sub(1).max(span.start), ..span }
}

/// The state of one function while its code is generated.
pub struct GeneratedFunction<'g, 'a> {
    pub function: &'a CheckedFunction,
    pub shape: Shape,
    pub builder: FunctionBuilder,
    /// Offset of each local from the frame record; 0 until the local has a slot.
    pub slots: Vec<i32>,
    /// Names and places of the locals, for the symbols.
    locals: Locals,
    /// The starts of the statements, for the symbols.
    statements: Vec<(CodeMark, Span)>,
    pub generator: &'g mut Generator<'a>,
}

impl<'a> GeneratedFunction<'_, 'a> {
    /// Assigns the globals that have a value before the first line runs: functions that the script
    /// assigns later, and built-ins and robot functions whose names the script assigns.
    fn first_values(&mut self) {
        for number in 0..self.generator.program.names.len() {
            let id = NameId(number);
            if self.generator.meanings.of(id) != Meaning::Global {
                continue;
            }
            let name = self.generator.program.name(id);
            let span = nowhere();
            match name.definitions.last() {
                Some((function, _)) => self.function_value(*function, span),
                None => match self.generator.meanings.offered(&name.text) {
                    Meaning::Nil => continue,
                    meaning => self.offered_value(meaning, &name.text, span),
                },
            }
            let global = self.generator.global(id);
            self.builder.operand(opcode::GLOBAL_SET, global, span);
        }
    }

    /// Records the places of parameters, `self` and captured values, which are valid from the first
    /// instruction on.
    fn open_arguments(&mut self, start: CodeMark) {
        for local in &self.function.locals {
            let place = match local.kind {
                LocalKind::Parameter(number) => {
                    frame_place(operand(number) - operand(self.function.parameters))
                }
                LocalKind::Captured { index, assigned: false } => capture_place(index),
                LocalKind::Captured { assigned: true, .. } | LocalKind::Variable => continue,
            };
            self.locals.open(&local.name, place, start);
        }
        if self.shape.uses_self {
            self.locals.open("self", frame_place(self.shape.self_local()), start);
        }
    }

    /// Copies the captured values that the function assigns into local variables, because captured
    /// values are read-only.
    fn copy_assigned_captures(&mut self, start: CodeMark) {
        let function = self.function;
        for (number, local) in function.locals.iter().enumerate() {
            if let LocalKind::Captured { index, assigned: true } = local.kind {
                self.builder.operand(opcode::CAPTURE_GET, operand(index), local.span);
                let copied = self.place(LocalId(number));
                self.locals.add(&local.name, capture_place(index), start, copied);
            }
        }
    }

    /// Makes the value on top of the stack the slot of a local. Returns the mark from which the
    /// local has this slot.
    fn place(&mut self, local: LocalId) -> CodeMark {
        let depth = operand(self.builder.depth());
        self.slots[local.0] = depth;
        let here = self.builder.mark();
        self.locals.open(&self.function.local(local).name, frame_place(depth), here);
        here
    }

    /// Returns the offset of a local from the frame record; `None` for a captured value.
    pub fn slot(&self, local: LocalId) -> Option<i32> {
        match self.function.local(local).kind {
            LocalKind::Parameter(number) => {
                Some(operand(number) - operand(self.function.parameters))
            }
            LocalKind::Variable | LocalKind::Captured { assigned: true, .. } => {
                Some(self.slots[local.0])
            }
            LocalKind::Captured { assigned: false, .. } => None,
        }
    }

    fn stmts(&mut self, stmts: &'a [CheckedStmt]) {
        for stmt in stmts {
            // Unreachable code after a return must not add functions or imports to the image.
            if !self.builder.is_reachable() {
                return;
            }
            self.stmt(stmt);
        }
    }

    fn block(&mut self, block: &'a CheckedBlock) {
        let (depth, count) = (self.builder.depth(), self.locals.count());
        self.stmts(&block.stmts);
        if self.builder.is_reachable() {
            let declared = self.builder.depth().checked_sub(depth);
            let declared = declared.expect("a block pops only what it pushed");
            self.builder.pop(declared, end_of(block.span));
        }
        let end = self.builder.mark();
        self.locals.close(count, end);
    }

    /// Marks the start of a statement, or of the condition of a branch or loop, where a debugger
    /// stops.
    fn begin_statement(&mut self, span: Span) {
        let mark = self.builder.mark();
        self.statements.push((mark, span));
    }

    fn stmt(&mut self, stmt: &'a CheckedStmt) {
        if !matches!(stmt.kind, CheckedStmtKind::If { .. } | CheckedStmtKind::While { .. }) {
            self.begin_statement(stmt.span);
        }
        match &stmt.kind {
            CheckedStmtKind::Var { local, value } => {
                match value {
                    Some(value) => self.expr(value),
                    None => self.builder.plain(opcode::NIL, stmt.span),
                }
                self.place(*local);
            }
            CheckedStmtKind::Assign { target, value } => self.assign(target, value, stmt.span),
            CheckedStmtKind::If { branches, otherwise } => self.if_else(branches, otherwise),
            CheckedStmtKind::While { condition, body, update } => {
                self.repeat(condition, body, update.as_deref(), stmt.span);
            }
            CheckedStmtKind::Return(None) => self.builder.ret_nil(stmt.span),
            CheckedStmtKind::Return(Some(value)) if matches!(value.kind, CheckedExprKind::Nil) => {
                self.builder.ret_nil(stmt.span);
            }
            CheckedStmtKind::Return(Some(value)) => {
                self.expr(value);
                self.builder.ret(stmt.span);
            }
            CheckedStmtKind::Call(call) => self.effect(call),
        }
    }

    fn if_else(&mut self, branches: &'a [CheckedBranch], otherwise: &'a CheckedBlock) {
        let end = self.builder.label();
        let mut left = branches.iter();
        while let Some(CheckedBranch { condition, then }) = left.next() {
            let is_last = left.as_slice().is_empty() && otherwise.stmts.is_empty();
            let truth = fold::truth(condition, self.generator.meanings);
            if truth.is_none() {
                self.begin_statement(condition.span);
            }
            match truth {
                Some(true) => {
                    self.block(then);
                    return self.builder.bind(end, end_of(condition.span));
                }
                Some(false) => {}
                None if then.stmts.is_empty() && is_last => self.effect(condition),
                None if then.stmts.is_empty() => self.condition(condition, true, end),
                None if is_last => {
                    self.condition(condition, false, end);
                    self.block(then);
                }
                None => {
                    let other = self.builder.label();
                    self.condition(condition, false, other);
                    self.block(then);
                    self.builder.jump(opcode::JUMP, end, end_of(then.span));
                    self.builder.bind(other, end_of(then.span));
                }
            }
        }
        self.block(otherwise);
        self.builder.bind(end, end_of(otherwise.span));
    }

    /// Generates a loop. The condition is placed at the end, so that an iteration costs one jump.
    fn repeat(
        &mut self,
        condition: &'a CheckedExpr,
        body: &'a CheckedBlock,
        update: Option<&'a CheckedStmt>,
        span: Span,
    ) {
        let known = fold::truth(condition, self.generator.meanings);
        if known == Some(false) {
            return;
        }
        let entry = if known == Some(true) { None } else { Some(self.builder.label()) };
        let head = self.builder.loop_head(entry, condition.span);
        self.block(body);
        if let Some(update) = update
            && self.builder.is_reachable()
        {
            self.stmt(update);
        }
        match entry {
            Some(entry) => {
                self.builder.bind(entry, condition.span);
                self.begin_statement(condition.span);
                self.condition(condition, true, head);
            }
            None => self.builder.jump(opcode::JUMP, head, span),
        }
    }

    fn assign(&mut self, target: &'a CheckedExpr, value: &'a CheckedExpr, span: Span) {
        match &target.kind {
            CheckedExprKind::Local(local) => self.assign_local(*local, value, span),
            CheckedExprKind::Name(name) => {
                self.expr(value);
                let global = self.generator.global(*name);
                self.builder.operand(opcode::GLOBAL_SET, global, span);
            }
            CheckedExprKind::Field { object, key, .. } => {
                self.expr(object);
                self.expr(value);
                let key = self.generator.string(key);
                self.builder.operand(opcode::FIELD_SET, key, span);
            }
            CheckedExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
                self.expr(value);
                self.builder.plain(opcode::INDEX_SET, span);
            }
            // A variable inside its own first value, of which the script was warned. It stays nil, and
            // the value is only computed.
            CheckedExprKind::Error => self.effect(value),
            _ => unreachable!("the parser accepts no other target"),
        }
    }

    fn assign_local(&mut self, local: LocalId, value: &'a CheckedExpr, span: Span) {
        let slot = self.slot(local).expect("a captured value that is assigned has a slot");
        if let CheckedExprKind::Chain { first, links } = &value.kind
            && let [CheckedLink { op, right, .. }] = links.as_slice()
            && let Some((rest, literal)) = added_literal(*op, first, right)
            && let Ok(immediate) = i8::try_from(literal)
            && matches!(rest.kind, CheckedExprKind::Local(read) if read == local)
        {
            // A fault of `LOCAL_ADD` is reported at the addition.
            return self.builder.local_add(slot, immediate, value.span);
        }
        self.expr(value);
        self.builder.operand(opcode::LOCAL_SET, slot, span);
    }
}
