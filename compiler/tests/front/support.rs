//! Parsing from memory, and syntax trees as text.

use std::path::Path;

use bittybuzz_compiler::ast::{
    BinaryOp, Block, Expr, ExprKind, FieldKey, Function, Stmt, StmtKind, UnaryOp,
};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::parser::{Parsed, parse};

pub fn parse_text(text: &str) -> Parsed {
    let files = MemoryFiles::default();
    parse(Path::new("main.bzz"), text.to_owned(), &IncludeLoader::new(&files))
}

/// The diagnostics as `CODE line:column`.
pub fn found(parsed: &Parsed) -> Vec<String> {
    let place = |diagnostic: &bittybuzz_compiler::diagnostic::Diagnostic| {
        let at = parsed.sources.line_column(diagnostic.span);
        format!("{} {}:{}", diagnostic.code.text(), at.line, at.column)
    };
    parsed.diagnostics.iter().map(place).collect()
}

/// Asserts that `text` gives exactly these diagnostics, written `CODE line:column`.
#[track_caller]
pub fn expect(text: &str, expected: &[&str]) {
    let parsed = parse_text(text);
    assert_eq!(found(&parsed), expected, "{text}\n{:#?}", parsed.diagnostics);
}

/// Asserts that the diagnostics of `text` say all of `parts`, in headline, label, related places or help.
#[track_caller]
pub fn expect_words(text: &str, parts: &[&str]) {
    let parsed = parse_text(text);
    let said: String = parsed
        .diagnostics
        .iter()
        .map(|d| {
            let related: String = d.related.iter().map(|(_, text)| format!("{text}\n")).collect();
            format!("{}\n{}\n{related}{}\n", d.message, d.label, d.help.as_deref().unwrap_or(""))
        })
        .collect();
    for part in parts {
        assert!(said.contains(part), "{text}\nsays:\n{said}\nnot: {part}");
    }
}

/// Asserts that `text` has no errors, and that its statements are `expected`.
#[track_caller]
pub fn expect_tree(text: &str, expected: &str) {
    let parsed = parse_text(text);
    assert!(!parsed.has_errors(), "{text}\n{:#?}", parsed.diagnostics);
    assert_eq!(stmts(&parsed.script.stmts), expected, "{text}");
}

/// As [`expect_tree`], for the value that is assigned.
#[track_caller]
pub fn expect_value(value: &str, expected: &str) {
    expect_tree(&format!("r = {value}"), &format!("(= r {expected})"));
}

pub fn stmts(list: &[Stmt]) -> String {
    list.iter().map(stmt).collect::<Vec<_>>().join(" ")
}

fn block(block: &Block) -> String {
    format!("{{{}}}", stmts(&block.stmts))
}

fn function(function: &Function) -> String {
    let params: Vec<&str> = function.params.iter().map(|p| p.name.as_str()).collect();
    format!("({}) {}", params.join(" "), block(&function.body))
}

fn stmt(stmt: &Stmt) -> String {
    match &stmt.kind {
        StmtKind::Var { name, value: None } => format!("(var {})", name.name),
        StmtKind::Var { name, value: Some(value) } => {
            format!("(var {} {})", name.name, expr(value))
        }
        StmtKind::Function { name, function: f } => {
            format!("(function {} {})", name.name, function(f))
        }
        StmtKind::If { branches, otherwise } => {
            let otherwise = otherwise.as_ref().map(block);
            // An `else if` is shown as an `if` in the block of an `else`.
            let shown = branches.iter().rev().fold(otherwise, |otherwise, branch| {
                let (condition, then) = (expr(&branch.condition), block(&branch.then));
                let otherwise = otherwise.map(|shown| format!(" {shown}")).unwrap_or_default();
                Some(format!("{{(if {condition} {then}{otherwise})}}"))
            });
            let shown = shown.unwrap_or_default();
            shown.strip_prefix('{').and_then(|s| s.strip_suffix('}')).unwrap_or(&shown).to_owned()
        }
        StmtKind::For { init, condition, update, body } => {
            let (init, update) = (self::stmt(init), self::stmt(update));
            format!("(for {init} {} {update} {})", expr(condition), block(body))
        }
        StmtKind::While { condition, body } => {
            format!("(while {} {})", expr(condition), block(body))
        }
        StmtKind::Return { value: None } => "(return)".to_owned(),
        StmtKind::Return { value: Some(value) } => format!("(return {})", expr(value)),
        StmtKind::Assign { target, value } => format!("(= {} {})", expr(target), expr(value)),
        StmtKind::Call(call) => expr(call),
    }
}

fn expr(expr: &Expr) -> String {
    match &expr.kind {
        ExprKind::Nil => "nil".to_owned(),
        ExprKind::Int(value) => value.to_string(),
        ExprKind::Float(value) => format!("{value:?}"),
        ExprKind::Str(text) => format!("{text:?}"),
        ExprKind::Name(name) => name.clone(),
        ExprKind::Field { object, key } => format!("{}.{}", self::expr(object), key.name),
        ExprKind::Index { object, index } => {
            format!("{}[{}]", self::expr(object), self::expr(index))
        }
        ExprKind::Call { callee, args } => {
            let args: Vec<String> = args.iter().map(self::expr).collect();
            format!("{}({})", self::expr(callee), args.join(", "))
        }
        ExprKind::Table(fields) => {
            let fields = fields.iter().map(|field| {
                let key = match &field.key {
                    FieldKey::Name(name) => name.clone(),
                    FieldKey::Int(value) => value.to_string(),
                    FieldKey::Float(value) => format!("{value:?}"),
                };
                format!(".{key}={}", self::expr(&field.value))
            });
            format!("{{{}}}", fields.collect::<Vec<_>>().join(", "))
        }
        ExprKind::Lambda(f) => format!("(lambda {})", function(f)),
        ExprKind::Unary { op, operand } => {
            let op = match op {
                UnaryOp::Negate => "-",
                UnaryOp::Plus => "+",
                UnaryOp::BitNot => "!",
                UnaryOp::Not => "not",
            };
            format!("({op} {})", self::expr(operand))
        }
        ExprKind::Chain { first, links } => links.iter().fold(self::expr(first), |left, link| {
            format!("({} {left} {})", operator(link.op), self::expr(&link.right))
        }),
        ExprKind::Paren(inner) => format!("[{}]", self::expr(inner)),
        ExprKind::Error => "<error>".to_owned(),
    }
}

fn operator(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Add => "+",
        BinaryOp::Sub => "-",
        BinaryOp::Mul => "*",
        BinaryOp::Div => "/",
        BinaryOp::Mod => "%",
        BinaryOp::Pow => "^",
        BinaryOp::BitAnd => "&",
        BinaryOp::BitOr => "|",
        BinaryOp::ShiftLeft => "<<",
        BinaryOp::ShiftRight => ">>",
        BinaryOp::Eq => "==",
        BinaryOp::NotEq => "!=",
        BinaryOp::Less => "<",
        BinaryOp::LessEq => "<=",
        BinaryOp::Greater => ">",
        BinaryOp::GreaterEq => ">=",
        BinaryOp::And => "and",
        BinaryOp::Or => "or",
    }
}
