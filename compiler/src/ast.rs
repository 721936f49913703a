//! The syntax tree of a Buzz script.
//!
//! The parser builds it, [`crate::check`] and [`crate::codegen`] read it. Every node carries the [`Span`] of
//! the source text it came from; spans of included files name their own file. An `include` leaves no node:
//! the statements of the included file stand in its place.

use crate::source::Span;

/// A name as written, with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Ident {
    pub name: String,
    pub span: Span,
}

/// Statements between braces, or the single statement of an `if`/`while`/`for` without braces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Block {
    pub stmts: Vec<Stmt>,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Stmt {
    pub kind: StmtKind,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub enum StmtKind {
    /// `var name` or `var name = value`
    Var { name: Ident, value: Option<Expr> },
    /// `function name(params) "docstring" { body }`, only at the top level of a file
    Function { name: Ident, function: Function },
    If { condition: Expr, then: Block, otherwise: Option<Block> },
    /// `init` and `update` are [`StmtKind::Assign`] or [`StmtKind::Call`]
    For { init: Box<Stmt>, condition: Expr, update: Box<Stmt>, body: Block },
    While { condition: Expr, body: Block },
    Return { value: Option<Expr> },
    /// `target = value`; the target is [`ExprKind::Name`], [`ExprKind::Field`] or [`ExprKind::Index`]
    Assign { target: Expr, value: Expr },
    /// A call for its effect; the expression is [`ExprKind::Call`]
    Call(Expr),
}

/// A named function or a lambda.
#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    pub params: Vec<Ident>,
    pub body: Block,
    /// From `function` to the closing brace.
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    pub kind: ExprKind,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    Nil,
    /// An integer literal with its sign folded in; whether it fits the profile is checked later.
    Int(i64),
    /// A float literal with its sign folded in.
    Float(f64),
    /// A string literal, escapes resolved. Bytes above 0x7f are kept as written (UTF-8).
    Str(String),
    Name(String),
    /// `object.name`; `key` is the field's name
    Field { object: Box<Expr>, key: Ident },
    /// `object[index]`
    Index { object: Box<Expr>, index: Box<Expr> },
    /// `callee(args)`. A callee that is `Field` or `Index` is a method call: self is its object.
    Call { callee: Box<Expr>, args: Vec<Expr> },
    /// `{.x = 1, .2 = "a"}`
    Table(Vec<TableField>),
    Lambda(Function),
    Unary { op: UnaryOp, operand: Box<Expr> },
    Binary { op: BinaryOp, left: Box<Expr>, right: Box<Expr> },
    /// A parenthesised expression: kept, because parentheses silence the precedence warnings.
    Paren(Box<Expr>),
    /// Stands where the parser reported an error and went on.
    Error,
}

#[derive(Debug, Clone, PartialEq)]
pub struct TableField {
    pub key: FieldKey,
    pub key_span: Span,
    pub value: Expr,
}

#[derive(Debug, Clone, PartialEq)]
pub enum FieldKey {
    Name(String),
    Int(i64),
    Float(f64),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnaryOp {
    /// `-x`
    Negate,
    /// `+x`
    Plus,
    /// `!x`, bitwise
    BitNot,
    /// `not x`
    Not,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BinaryOp {
    Add,
    Sub,
    Mul,
    Div,
    Mod,
    Pow,
    BitAnd,
    BitOr,
    ShiftLeft,
    ShiftRight,
    Eq,
    NotEq,
    Less,
    LessEq,
    Greater,
    GreaterEq,
    And,
    Or,
}

/// A whole script after includes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Script {
    pub stmts: Vec<Stmt>,
}
