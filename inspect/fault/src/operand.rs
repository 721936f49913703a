//! Finds the variable that was nil in the source text of an instruction.

use std::path::Path;

use bittybuzz_compiler::ast::{ChainLink, Expr, ExprKind, Stmt, StmtKind};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::parser;
use bittybuzz_vm_core::builtin::{self, BuiltinInfo, Library};
use bittybuzz_vm_core::{Fault, FaultCode, Type};

/// The prefix that turns an expression into a statement.
const TARGET: &str = "x = ";

/// Returns the variable, field or `self` that was nil, as it is written in the script. `marked` is the source text of the
/// instruction.
pub fn nil(marked: &str, fault: &Fault) -> Option<String> {
    let Fault { code, operands, .. } = *fault;
    let (text, stmt) = parsed(marked)?;
    let expr = match &stmt.kind {
        // The instruction is the assignment itself: its target is not a table.
        StmtKind::Assign { target, .. } if text == marked => target,
        StmtKind::Assign { value, .. } => value,
        _ => return None,
    };
    let operand = match code {
        FaultCode::WrongType => computed(expr, operands)?,
        FaultCode::NotATable if operands[0] == Type::Nil => match &expr.kind {
            ExprKind::Field { object, .. } | ExprKind::Index { object, .. } => object,
            // A method call reads the method from its object.
            ExprKind::Call { callee, .. } => match &callee.kind {
                ExprKind::Field { object, .. } | ExprKind::Index { object, .. } => object,
                _ => return None,
            },
            _ => return None,
        },
        FaultCode::NotCallable if operands[0] == Type::Nil => match &expr.kind {
            ExprKind::Call { callee, args, .. } => match called_by(fault) {
                // The source of the iteration is the first argument, or the object of a method.
                Some(info) => args.get(usize::from(info.library == Library::Global))?,
                None => callee,
            },
            _ => return None,
        },
        _ => return None,
    };
    let is_place =
        matches!(operand.kind, ExprKind::Name(_) | ExprKind::Field { .. } | ExprKind::Index { .. });
    let range = operand.span.start as usize..operand.span.end as usize;
    text.get(range).filter(|_| is_place).map(str::to_owned)
}

/// Returns the built-in function that was to call something that is no function.
pub fn called_by(fault: &Fault) -> Option<&'static BuiltinInfo> {
    let is_argument = fault.code == FaultCode::NotCallable && fault.detail != 0;
    builtin::info(u8::try_from(fault.detail).ok()?).filter(|_| is_argument)
}

/// Returns the side of an operation that is nil, if only one of them can be.
fn computed(expr: &Expr, operands: [Type; 2]) -> Option<&Expr> {
    match &expr.kind {
        ExprKind::Unary { operand, .. } if operands[0] == Type::Nil => Some(operand),
        ExprKind::Chain { first, links } => {
            let (ChainLink { right, .. }, before) = links.split_last()?;
            let left = Some(&**first).filter(|_| before.is_empty());
            let is_literal =
                |side: &Expr| matches!(side.kind, ExprKind::Int(_) | ExprKind::Float(_));
            match (operands[0] == Type::Nil, operands[1] == Type::Nil) {
                // `1 + x` is computed as `x + 1`.
                (true, false) if left.is_some_and(is_literal) => Some(right),
                (true, false) => left,
                (false, true) => Some(right),
                _ => None,
            }
        }
        _ => None,
    }
}

/// Parses the source text of an instruction: an expression as the value of an assignment, anything
/// else as a statement. Returns the text to which the spans of the statement refer.
pub fn parsed(marked: &str) -> Option<(String, Stmt)> {
    let statement = format!("{TARGET}{marked}");
    if let Some(stmt) = only_statement(&statement) {
        return Some((statement, stmt));
    }
    Some((marked.to_owned(), only_statement(marked)?))
}

fn only_statement(text: &str) -> Option<Stmt> {
    let files = MemoryFiles::default();
    let parsed = parser::parse(Path::new(""), text.to_owned(), &IncludeLoader::new(&files));
    let has_errors = parsed.has_errors();
    let mut stmts = parsed.script.stmts.into_iter();
    let first = stmts.next()?;
    (!has_errors && stmts.next().is_none()).then_some(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nil_operand_is_found() {
        use FaultCode::{NotATable, NotCallable, WrongType};
        let (nil, int) = (Type::Nil, Type::Int);
        let fault = |code, operands, detail| Fault { code, position: 0, operands, detail };
        for (marked, code, operands, expected) in [
            ("counter + 1", WrongType, [nil, int], Some("counter")),
            ("1 + counter", WrongType, [nil, int], Some("counter")),
            ("2 * t.x", WrongType, [int, nil], Some("t.x")),
            ("a - b", WrongType, [nil, int], Some("a")),
            ("a - b", WrongType, [int, nil], Some("b")),
            ("a - b", WrongType, [nil, nil], None),
            // The sum before it is no variable.
            ("a + b + c", WrongType, [nil, int], None),
            ("a + b + c", WrongType, [int, nil], Some("c")),
            ("-speed", WrongType, [nil, nil], Some("speed")),
            ("f(1) + 2", WrongType, [nil, int], None),
            ("self.x", NotATable, [nil, nil], Some("self")),
            ("self.x = 1", NotATable, [nil, nil], Some("self")),
            ("t.a[3]", NotATable, [nil, nil], Some("t.a")),
            ("t.a.f(1)", NotATable, [nil, nil], Some("t.a")),
            ("t.f(1)", NotCallable, [nil, nil], Some("t.f")),
            ("t.f(1)", NotCallable, [int, nil], None),
            ("not a statement", WrongType, [nil, int], None),
            ("", WrongType, [nil, int], None),
        ] {
            let fault = fault(code, operands, 0);
            assert_eq!(super::nil(marked, &fault).as_deref(), expected, "{marked}");
        }
        for (marked, by, expected) in [
            ("foreach(t, f)", builtin::FOREACH, Some("f")),
            ("each(t, f)", builtin::FOREACH, Some("f")),
            ("reduce(t, my.f, 0)", builtin::REDUCE, Some("my.f")),
            ("map(t, f())", builtin::MAP, None),
            ("neighbors.foreach(f)", builtin::NEIGHBORS_FOREACH, Some("f")),
            ("v.reduce(f, 0)", builtin::STIGMERGY_REDUCE, Some("f")),
            ("map()", builtin::MAP, None),
        ] {
            let fault = fault(NotCallable, [nil, nil], by.into());
            assert_eq!(super::nil(marked, &fault).as_deref(), expected, "{marked}");
        }
    }
}
