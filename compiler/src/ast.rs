//! The syntax tree of a Buzz script.
//!
//! The parser builds the tree; [`crate::check`] and [`crate::codegen`] read it. Every node carries
//! the [`Span`] of its source text, and the spans of included files name their own file. An
//! `include` leaves no node: the statements of the included file take its place.

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
    /// The source with the braces.
    pub span: Span,
}

/// A statement.
#[derive(Debug, Clone, PartialEq)]
pub struct Stmt {
    pub kind: StmtKind,
    /// From the first to the last token of the statement.
    pub span: Span,
}

/// The kinds of statements.
#[derive(Debug, Clone, PartialEq)]
pub enum StmtKind {
    /// `var name` or `var name = value`
    Var { name: Ident, value: Option<Expr> },
    /// `function name(params) "docstring" { body }`, only at the top level of a file
    Function { name: Ident, function: Function },
    /// `if(condition) { ... } else if(condition) { ... } else otherwise`, with all conditions in
    /// one list instead of nested statements
    If { branches: Vec<Branch>, otherwise: Option<Block> },
    /// A `for` loop; `init` and `update` are [`StmtKind::Assign`] or [`StmtKind::Call`]
    For { init: Box<Stmt>, condition: Expr, update: Box<Stmt>, body: Block },
    /// `while(condition) body`
    While { condition: Expr, body: Block },
    /// `return` or `return value`
    Return { value: Option<Expr> },
    /// `target = value`; the target is [`ExprKind::Name`], [`ExprKind::Field`] or [`ExprKind::Index`]
    Assign { target: Expr, value: Expr },
    /// A call for its effect; the expression is [`ExprKind::Call`]
    Call(Expr),
}

/// One condition of an `if` and its block, which runs if no earlier condition is true.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    pub condition: Expr,
    pub then: Block,
}

/// A named function or a lambda.
#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    /// The parameters, without `self`.
    pub params: Vec<Ident>,
    /// The statements between the braces.
    pub body: Block,
    /// From `function` to the closing brace.
    pub span: Span,
}

/// An expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    pub kind: ExprKind,
    /// From the first to the last token of the expression.
    pub span: Span,
}

/// The kinds of expressions.
#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    /// `nil`
    Nil,
    /// An integer literal with its sign folded in. A later check compares it with the range of the
    /// profile.
    Int(i64),
    /// A float literal with its sign folded in.
    Float(f64),
    /// A string literal with its escapes resolved. Bytes above 0x7f are kept as written (UTF-8).
    Str(String),
    /// The name of a variable or a function.
    Name(String),
    /// `object.name`; `key` is the field's name
    Field { object: Box<Expr>, key: Ident },
    /// `object[index]`
    Index { object: Box<Expr>, index: Box<Expr> },
    /// `callee(args)`. A `Field` or `Index` as callee makes a method call, whose self is the
    /// object.
    Call { callee: Box<Expr>, args: Vec<Expr> },
    /// `{.x = 1, .2 = "a"}`
    Table(Vec<TableField>),
    /// `function(params) { body }`
    Lambda(Function),
    /// `op operand`
    Unary { op: UnaryOp, operand: Box<Expr> },
    /// `first op right op right ...`, evaluated from left to right; all operators have one
    /// [`Precedence`]
    Chain { first: Box<Expr>, links: Vec<ChainLink> },
    /// A parenthesized expression. The node is kept because parentheses silence the warnings about
    /// precedence.
    Paren(Box<Expr>),
    /// A placeholder for source in which the parser reported an error.
    Error,
}

/// An operation in an [`ExprKind::Chain`]. Its left operand is the value of the chain before it.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainLink {
    pub op: BinaryOp,
    /// The right operand.
    pub right: Expr,
    /// From the first operand of the chain to the right operand of this operation.
    pub span: Span,
}

/// `.key = value` in a table literal.
#[derive(Debug, Clone, PartialEq)]
pub struct TableField {
    pub key: FieldKey,
    /// The key without its dot.
    pub key_span: Span,
    pub value: Expr,
}

/// The key of a field in a table literal.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldKey {
    /// `.x`, the string "x"
    Name(String),
    /// `.2`
    Int(i64),
    /// `.2.5`
    Float(f64),
}

/// The operators with one operand.
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

/// The operators with two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BinaryOp {
    /// `+`
    Add,
    /// `-`
    Sub,
    /// `*`
    Mul,
    /// `/`
    Div,
    /// `%`
    Mod,
    /// `^`
    Pow,
    /// `&`
    BitAnd,
    /// `|`
    BitOr,
    /// `<<`
    ShiftLeft,
    /// `>>`
    ShiftRight,
    /// `==`
    Eq,
    /// `!=`
    NotEq,
    /// `<`
    Less,
    /// `<=`
    LessEq,
    /// `>`
    Greater,
    /// `>=`
    GreaterEq,
    /// `and`
    And,
    /// `or`
    Or,
}

/// The precedence of a binary operator, lowest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Precedence {
    /// `and or`
    Logic,
    /// Comparisons, of which a script has only one in a row.
    Comparison,
    /// `+ -`
    Sum,
    /// `* /`
    Product,
    /// `%`
    Modulo,
    /// `^`, the only operator that is evaluated from right to left.
    Exponent,
    /// `<< >>`
    Shift,
    /// `& |`
    Bits,
}

impl BinaryOp {
    /// Returns the precedence of the operator.
    pub fn power(self) -> Precedence {
        use BinaryOp::{
            Add, And, BitAnd, BitOr, Div, Eq, Greater, GreaterEq, Less, LessEq, Mod, Mul, NotEq,
            Or, Pow, ShiftLeft, ShiftRight, Sub,
        };
        match self {
            And | Or => Precedence::Logic,
            Eq | NotEq | Less | LessEq | Greater | GreaterEq => Precedence::Comparison,
            Add | Sub => Precedence::Sum,
            Mul | Div => Precedence::Product,
            Mod => Precedence::Modulo,
            Pow => Precedence::Exponent,
            ShiftLeft | ShiftRight => Precedence::Shift,
            BitAnd | BitOr => Precedence::Bits,
        }
    }

    /// Returns true for `and` and `or`, which skip their right side if the left side decides the
    /// result.
    pub fn is_logic(self) -> bool {
        self.power() == Precedence::Logic
    }

    /// Returns true for an operator that computes a number from two numbers of any kind.
    pub fn is_arithmetic(self) -> bool {
        use BinaryOp::{Add, Div, Mod, Mul, Pow, Sub};
        matches!(self, Add | Sub | Mul | Div | Mod | Pow)
    }

    /// Returns true for an operator on the bits of two integers.
    pub fn is_bitwise(self) -> bool {
        use BinaryOp::{BitAnd, BitOr, ShiftLeft, ShiftRight};
        matches!(self, BitAnd | BitOr | ShiftLeft | ShiftRight)
    }
}

/// A whole script after includes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Script {
    /// The statements in order, with the named functions among them.
    pub stmts: Vec<Stmt>,
}
