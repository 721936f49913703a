//! Code of expressions: each leaves one value on the stack.

use bittybuzz_vm_core::builtin::{self, Feature, Library};
use bittybuzz_vm_core::opcode;

use crate::asm::Label;
use crate::ast::{BinaryOp, UnaryOp};
use crate::check::names::{LibraryMember, Meaning};
use crate::check::tree::{
    CheckedExpr, CheckedExprKind, CheckedLink, FunctionId, LocalId, LocalKind,
};
use crate::codegen::fold::is_truth_value;
use crate::codegen::function::{GeneratedFunction, shape};
use crate::codegen::generator::operand;
use crate::codegen::operands::{
    added_integer, added_literal, gives_float, is_float, is_number_or_nil,
};
use crate::profile;
use crate::source::Span;

impl<'a> GeneratedFunction<'_, 'a> {
    /// Puts the value of an expression on the stack.
    pub fn expr(&mut self, expr: &'a CheckedExpr) {
        let span = expr.span;
        match &expr.kind {
            CheckedExprKind::Nil | CheckedExprKind::Error => self.builder.plain(opcode::NIL, span),
            CheckedExprKind::Int(value) => self.builder.int(*value as i32, span),
            CheckedExprKind::Float(value) => {
                let bits = profile::float_bits(self.generator.profile, *value);
                self.builder.float(bits, span);
            }
            CheckedExprKind::Str(text) => {
                let number = self.generator.string(text);
                self.builder.operand(opcode::STRING, number, span);
            }
            CheckedExprKind::Local(local) => self.read_local(*local, span),
            CheckedExprKind::Name(name) => match self.generator.meanings.of(*name) {
                Meaning::Global => {
                    let global = self.generator.global(*name);
                    self.builder.operand(opcode::GLOBAL_GET, global, span);
                }
                meaning => {
                    let text = &self.generator.program.name(*name).text;
                    self.offered_value(meaning, text, span);
                }
            },
            CheckedExprKind::SelfValue => self.self_value(span),
            CheckedExprKind::Field { object, key, .. } => self.field(object, key, span),
            CheckedExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
                self.builder.plain(opcode::INDEX_GET, span);
            }
            CheckedExprKind::Call { callee, args } => self.call(callee, args, false, span),
            CheckedExprKind::Table(entries) => self.table(entries, span),
            CheckedExprKind::Lambda(function) => self.lambda(*function, span),
            CheckedExprKind::Unary { op, operand } => self.unary(*op, operand, span),
            CheckedExprKind::Chain { first, links } => self.chain(first, links),
        }
    }

    /// Puts the value of a chain of operations on the stack.
    pub fn chain(&mut self, first: &'a CheckedExpr, links: &'a [CheckedLink]) {
        match links.split_last() {
            Some((last, before)) if last.op.is_logic() => self.logic(first, before, last),
            Some(_) => self.operations(first, links),
            None => self.expr(first),
        }
    }

    /// Evaluates an expression for its effects and discards the value.
    pub fn effect(&mut self, expr: &'a CheckedExpr) {
        match &expr.kind {
            CheckedExprKind::Call { callee, args } => self.call(callee, args, true, expr.span),
            CheckedExprKind::Nil
            | CheckedExprKind::Int(_)
            | CheckedExprKind::Float(_)
            | CheckedExprKind::Str(_)
            | CheckedExprKind::Name(_)
            | CheckedExprKind::SelfValue
            | CheckedExprKind::Error => {}
            _ => {
                self.expr(expr);
                self.builder.pop(1, expr.span);
            }
        }
    }

    fn read_local(&mut self, local: LocalId, span: Span) {
        match self.slot(local) {
            Some(slot) => self.builder.operand(opcode::LOCAL_GET, slot, span),
            None => {
                let LocalKind::Captured { index, .. } = self.function.local(local).kind else {
                    unreachable!("only captured values have no slot")
                };
                self.builder.operand(opcode::CAPTURE_GET, operand(index), span);
            }
        }
    }

    fn self_value(&mut self, span: Span) {
        if self.shape.uses_self {
            let local = self.shape.self_local();
            self.builder.operand(opcode::LOCAL_GET, local, span);
        } else {
            self.builder.plain(opcode::NIL, span);
        }
    }

    /// Puts a value on the stack that a name stands for without being a variable.
    pub fn offered_value(&mut self, meaning: Meaning, name: &str, span: Span) {
        match meaning {
            Meaning::Nil | Meaning::Global => self.builder.plain(opcode::NIL, span),
            Meaning::Function(function) => self.function_value(function, span),
            Meaning::Builtin(number) => {
                let info = builtin::info(number).expect("the number is from the table");
                let number = self.generator.builtin(info);
                self.builder.operand(opcode::BUILTIN, number, span);
            }
            Meaning::Library(library) => self.library_value(library, span),
            Meaning::Robot => {
                let import = self.generator.import(name);
                self.builder.operand(opcode::ROBOT, import, span);
            }
            Meaning::RobotId => self.builder.plain(opcode::ROBOT_ID, span),
        }
    }

    fn library_value(&mut self, library: Library, span: Span) {
        let number = self.generator.library(library);
        self.builder.operand(opcode::LIBRARY, number, span);
    }

    /// Puts a function on the stack that captures nothing.
    pub fn function_value(&mut self, function: FunctionId, span: Span) {
        let number = self.generator.function(function);
        self.builder.operand(opcode::FUNCTION, number, span);
    }

    fn field(&mut self, object: &'a CheckedExpr, key: &str, span: Span) {
        if let Some(library) = self.generator.meanings.library(object)
            && let LibraryMember::Known(info) = self.generator.meanings.member(library, key)
        {
            if info.number == builtin::RNG {
                return self.library_value(Library::Rng, span);
            }
            if info.kind != builtin::BuiltinKind::Value {
                let number = self.generator.builtin(info);
                return self.builder.operand(opcode::BUILTIN, number, span);
            }
        }
        self.expr(object);
        let key = self.generator.string(key);
        self.builder.operand(opcode::FIELD_GET, key, span);
    }

    fn table(&mut self, entries: &'a [(CheckedExpr, CheckedExpr)], span: Span) {
        self.builder.plain(opcode::TABLE_NEW, span);
        for (key, value) in entries {
            let entry = key.span.to(value.span);
            if let CheckedExprKind::Str(name) = &key.kind {
                self.expr(value);
                let name = self.generator.string(name);
                self.builder.operand(opcode::FIELD_INIT, name, entry);
            } else {
                self.expr(key);
                self.expr(value);
                self.builder.plain(opcode::INDEX_INIT, entry);
            }
        }
    }

    fn lambda(&mut self, id: FunctionId, span: Span) {
        let function = self.generator.program.function(id);
        let shape = shape(self.generator, id);
        // A self that is always nil need not be captured, because a plain call passes nil as well.
        let has_self = shape.uses_self && self.shape.uses_self;
        if !shape.captures && !has_self {
            return self.function_value(id, span);
        }
        if shape.uses_self {
            self.self_value(span);
        }
        for captured in &function.captures {
            self.read_local(*captured, span);
        }
        let number = self.generator.function(id);
        let count = function.captures.len() + usize::from(shape.uses_self);
        self.builder.closure(number, count, span);
    }

    fn unary(&mut self, op: UnaryOp, operand: &'a CheckedExpr, span: Span) {
        let opcode = match op {
            UnaryOp::Plus => return self.expr(operand),
            UnaryOp::Negate => opcode::NEG,
            UnaryOp::BitNot => opcode::BNOT,
            UnaryOp::Not => match &operand.kind {
                // `not not x` is the truth of `x`.
                CheckedExprKind::Unary { op: UnaryOp::Not, operand } => {
                    self.tested(operand);
                    return self.builder.plain(opcode::TRUTH, span);
                }
                _ => {
                    self.tested(operand);
                    return self.builder.plain(opcode::NOT, span);
                }
            },
        };
        self.expr(operand);
        self.builder.plain(opcode, span);
    }

    /// Generates `and` and `or`, which put 0 or 1 on the stack.
    fn logic(&mut self, first: &'a CheckedExpr, before: &'a [CheckedLink], last: &'a CheckedLink) {
        self.tested_in_row(first, before);
        let end = self.short_cut(last.op, before.last().map_or(first.span, |link| link.span));
        if is_truth_value(&last.right) {
            self.expr(&last.right);
        } else {
            self.tested(&last.right);
            self.builder.plain(opcode::TRUTH, last.right.span);
        }
        self.builder.bind(end, last.span);
    }

    /// Puts a value on the stack that has the truth of a row of `and` and `or`.
    fn tested_in_row(&mut self, first: &'a CheckedExpr, links: &'a [CheckedLink]) {
        self.tested(first);
        let mut span = first.span;
        for link in links {
            let end = self.short_cut(link.op, span);
            self.tested(&link.right);
            self.builder.bind(end, link.span);
            span = link.span;
        }
    }

    /// Emits the jump over the right side of `and` or `or`, taken if the left side on the stack decides the result.
    fn short_cut(&mut self, op: BinaryOp, left: Span) -> Label {
        let end = self.builder.label();
        let opcode = if op == BinaryOp::And { opcode::AND } else { opcode::OR };
        self.builder.jump(opcode, end, left);
        end
    }

    /// Puts a value on the stack that has the same truth as the expression.
    fn tested(&mut self, expr: &'a CheckedExpr) {
        match &expr.kind {
            CheckedExprKind::Chain { first, links }
                if links.iter().any(|link| link.op.is_logic()) =>
            {
                self.tested_in_row(first, links);
            }
            CheckedExprKind::Unary { op: UnaryOp::Not, operand } => match &operand.kind {
                CheckedExprKind::Unary { op: UnaryOp::Not, operand } => self.tested(operand),
                _ => self.expr(expr),
            },
            _ => self.expr(expr),
        }
    }

    /// Generates arithmetic and comparisons from left to right.
    fn operations(&mut self, first: &'a CheckedExpr, links: &'a [CheckedLink]) {
        let mut left = Some(first);
        let mut left_is_float = is_float(first);
        for CheckedLink { op, right, span } in links {
            let added = match left {
                Some(first) => match added_literal(*op, first, right) {
                    Some((rest, literal)) => {
                        self.expr(rest);
                        Some(literal)
                    }
                    None => {
                        self.expr(first);
                        None
                    }
                },
                None => added_integer(*op, left_is_float, right),
            };
            match added {
                Some(literal) => {
                    self.builder.operand(opcode::ADD_INT, i32::from(literal), *span);
                }
                None => {
                    self.expr(right);
                    self.note_order(*op, left, right);
                    self.operation(*op, *span);
                }
            }
            left_is_float = gives_float(*op, left_is_float, right);
            left = None;
        }
    }

    fn operation(&mut self, op: BinaryOp, span: Span) {
        let opcode = match op {
            BinaryOp::Add => opcode::ADD,
            BinaryOp::Sub => opcode::SUB,
            BinaryOp::Mul => opcode::MUL,
            BinaryOp::Div => opcode::DIV,
            BinaryOp::Mod => opcode::MOD,
            BinaryOp::Pow => opcode::POW,
            BinaryOp::BitAnd => opcode::BAND,
            BinaryOp::BitOr => opcode::BOR,
            BinaryOp::ShiftLeft => opcode::SHL,
            BinaryOp::ShiftRight => opcode::SHR,
            BinaryOp::Eq => opcode::EQ,
            BinaryOp::NotEq => opcode::NE,
            BinaryOp::Less => opcode::LT,
            BinaryOp::LessEq => opcode::LE,
            BinaryOp::Greater => opcode::GT,
            BinaryOp::GreaterEq => opcode::GE,
            // `logic` generates them.
            BinaryOp::And | BinaryOp::Or => return,
        };
        if op == BinaryOp::Pow {
            self.generator.features |= Feature::Maths as u8;
        }
        self.builder.plain(opcode, span);
    }

    /// Records that strings may be compared by order. `left` is `None` if the left side is the
    /// result of an operation, which is never a string.
    pub fn note_order(&mut self, op: BinaryOp, left: Option<&CheckedExpr>, right: &CheckedExpr) {
        let orders = matches!(
            op,
            BinaryOp::Less | BinaryOp::LessEq | BinaryOp::Greater | BinaryOp::GreaterEq
        );
        let meanings = self.generator.meanings;
        let may_be_string = |side: &CheckedExpr| !is_number_or_nil(side, meanings);
        if orders && left.is_some_and(may_be_string) && may_be_string(right) {
            self.generator.orders_strings = true;
        }
    }
}
