//! Code of calls: directly by number where the callee is known, else by value.

use bittybuzz_vm_core::builtin::{self, BuiltinKind};
use bittybuzz_vm_core::opcode;

use crate::check::names::{LibraryMember, Meaning};
use crate::check::tree::{CheckedExpr, CheckedExprKind, FunctionId};
use crate::codegen::function::GeneratedFunction;
use crate::codegen::generator::operand;
use crate::source::Span;

impl<'a> GeneratedFunction<'_, 'a> {
    /// Generates a call. The result stays on the stack unless `drop` is set.
    pub fn call(
        &mut self,
        callee: &'a CheckedExpr,
        args: &'a [CheckedExpr],
        drop: bool,
        span: Span,
    ) {
        match &callee.kind {
            CheckedExprKind::Name(name) => match self.generator.meanings.of(*name) {
                Meaning::Function(function) => return self.call_script(function, args, drop, span),
                Meaning::Builtin(number) => {
                    let info = builtin::info(number).expect("the number is from the table");
                    return self.call_builtin(info, args, drop, span);
                }
                Meaning::Robot => {
                    let text = &self.generator.program.name(*name).text;
                    let import = self.generator.import(text);
                    self.arguments(args);
                    return self.builder.call_native(
                        opcode::CALL_ROBOT,
                        import,
                        args.len(),
                        drop,
                        span,
                    );
                }
                Meaning::Nil | Meaning::Global | Meaning::Library(_) | Meaning::RobotId => {}
            },
            CheckedExprKind::Field { object, key, .. } => {
                if let Some(library) = self.generator.meanings.library(object)
                    && let LibraryMember::Known(info) = self.generator.meanings.member(library, key)
                    && info.kind != BuiltinKind::Value
                {
                    return self.call_builtin(info, args, drop, span);
                }
                self.expr(object);
                let key = self.generator.string(key);
                self.builder.operand(opcode::FIELD_METHOD, key, callee.span);
                self.arguments(args);
                self.builder.operand(opcode::CALL_METHOD, operand(args.len()), span);
                return self.drop_result(drop, span);
            }
            CheckedExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
                self.builder.plain(opcode::INDEX_METHOD, callee.span);
                self.arguments(args);
                self.builder.operand(opcode::CALL_METHOD, operand(args.len()), span);
                return self.drop_result(drop, span);
            }
            _ => {}
        }
        self.expr(callee);
        self.arguments(args);
        self.builder.operand(opcode::CALL, operand(args.len()), span);
        self.drop_result(drop, span);
    }

    fn arguments(&mut self, args: &'a [CheckedExpr]) {
        for arg in args {
            self.expr(arg);
        }
    }

    fn drop_result(&mut self, drop: bool, span: Span) {
        if drop {
            self.builder.pop(1, span);
        }
    }

    fn call_script(&mut self, id: FunctionId, args: &'a [CheckedExpr], drop: bool, span: Span) {
        let parameters = self.generator.program.function(id).parameters;
        for (number, arg) in args.iter().enumerate() {
            if number < parameters {
                self.expr(arg);
            } else {
                self.effect(arg);
            }
        }
        for _ in args.len()..parameters {
            self.builder.plain(opcode::UNSET, span);
        }
        let function = self.generator.function(id);
        self.builder.call_function(function, parameters, span);
        self.drop_result(drop, span);
    }

    fn call_builtin(
        &mut self,
        info: &builtin::BuiltinInfo,
        args: &'a [CheckedExpr],
        drop: bool,
        span: Span,
    ) {
        if let (builtin::IS_NIL, [arg], false) = (info.number, args, drop) {
            self.expr(arg);
            self.builder.plain(opcode::NIL, span);
            return self.builder.plain(opcode::EQ, span);
        }
        self.arguments(args);
        let number = self.generator.builtin(info);
        // Only a plain built-in returns its result at once. The call cannot drop a later result.
        let at_once = drop && info.kind == BuiltinKind::Plain;
        self.builder.call_native(opcode::CALL_BUILTIN, number, args.len(), at_once, span);
        self.drop_result(drop && !at_once, span);
    }
}
