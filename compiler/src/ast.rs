//! The syntax tree of a Buzz script.
//!
//! The parser builds it, [`crate::check`] and [`crate::codegen`] read it. Every node carries the [`Span`] of
//! the source text it came from; spans of included files name their own file. An `include` leaves no node:
//! the statements of the included file stand in its place.

use crate::source::Span;

/// A name as written, with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Ident {
    /// The name.
    pub name: String,
    /// The place in the source text.
    pub span: Span,
}

/// Statements between braces, or the single statement of an `if`/`while`/`for` without braces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Block {
    /// The statements in order.
    pub stmts: Vec<Stmt>,
    /// With the braces.
    pub span: Span,
}

/// A statement.
#[derive(Debug, Clone, PartialEq)]
pub struct Stmt {
    /// The statement.
    pub kind: StmtKind,
    /// From its first to its last token.
    pub span: Span,
}

/// The kinds of statements.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the fields are named after the parts of the grammar")]
pub enum StmtKind {
    /// `var name` or `var name = value`
    Var { name: Ident, value: Option<Expr> },
    /// `function name(params) "docstring" { body }`, only at the top level of a file
    Function { name: Ident, function: Function },
    /// `if(condition) { ... } else if(condition) { ... } else otherwise`: a row of conditions is no nest of them
    If { branches: Vec<Branch>, otherwise: Option<Block> },
    /// `init` and `update` are [`StmtKind::Assign`] or [`StmtKind::Call`]
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
    /// The condition.
    pub condition: Expr,
    /// The block.
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
    /// The expression.
    pub kind: ExprKind,
    /// From its first to its last token.
    pub span: Span,
}

/// The kinds of expressions.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the fields are named after the parts of the grammar")]
pub enum ExprKind {
    /// `nil`
    Nil,
    /// An integer literal with its sign folded in; whether it fits the profile is checked later.
    Int(i64),
    /// A float literal with its sign folded in.
    Float(f64),
    /// A string literal, escapes resolved. Bytes above 0x7f are kept as written (UTF-8).
    Str(String),
    /// A variable or a function by its name.
    Name(String),
    /// `object.name`; `key` is the field's name
    Field { object: Box<Expr>, key: Ident },
    /// `object[index]`
    Index { object: Box<Expr>, index: Box<Expr> },
    /// `callee(args)`. A callee that is `Field` or `Index` is a method call: self is its object.
    Call { callee: Box<Expr>, args: Vec<Expr> },
    /// `{.x = 1, .2 = "a"}`
    Table(Vec<TableField>),
    /// `function(params) { body }`
    Lambda(Function),
    /// `op operand`
    Unary { op: UnaryOp, operand: Box<Expr> },
    /// `first op right op right ...`, computed from the left: operators of one [`Power`] in a row
    Chain { first: Box<Expr>, links: Vec<Link> },
    /// A parenthesised expression: kept, because parentheses silence the precedence warnings.
    Paren(Box<Expr>),
    /// Stands where the parser reported an error and went on.
    Error,
}

/// An operation on the value of all that stands before it in a [`ExprKind::Chain`].
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// The operator.
    pub op: BinaryOp,
    /// Its right side.
    pub right: Expr,
    /// From the first operand of the chain to this one.
    pub span: Span,
}

/// `.key = value` in a table literal.
#[derive(Debug, Clone, PartialEq)]
pub struct TableField {
    /// The key after the dot.
    pub key: FieldKey,
    /// The key without its dot.
    pub key_span: Span,
    /// The stored value.
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

/// The precedence of a binary operator, the loosest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Power {
    /// `and or`
    Logic,
    /// Comparisons, which do not stand in a row in a script.
    Comparison,
    /// `+ -`
    Sum,
    /// `* /`
    Product,
    /// `%`
    Modulo,
    /// `^`, the only one that is computed from the right.
    Exponent,
    /// `<< >>`
    Shift,
    /// `& |`
    Bits,
}

impl BinaryOp {
    /// Returns how tightly the operator binds.
    pub fn power(self) -> Power {
        use BinaryOp::{
            Add, And, BitAnd, BitOr, Div, Eq, Greater, GreaterEq, Less, LessEq, Mod, Mul, NotEq,
            Or, Pow, ShiftLeft, ShiftRight, Sub,
        };
        match self {
            And | Or => Power::Logic,
            Eq | NotEq | Less | LessEq | Greater | GreaterEq => Power::Comparison,
            Add | Sub => Power::Sum,
            Mul | Div => Power::Product,
            Mod => Power::Modulo,
            Pow => Power::Exponent,
            ShiftLeft | ShiftRight => Power::Shift,
            BitAnd | BitOr => Power::Bits,
        }
    }

    /// Returns true for `and` and `or`, which skip their right side where the left side decides.
    pub fn is_logic(self) -> bool {
        self.power() == Power::Logic
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
    /// The statements in order, named functions among them.
    pub stmts: Vec<Stmt>,
}
