//! The script with its names resolved: [`super::resolve`] makes it from the syntax tree, for the
//! checks and the code generator.
//!
//! Functions lie in one list; number 0 is the global code. Parentheses are gone, `for` is a `while`
//! with an update.

use std::collections::HashMap;

use crate::ast::{BinaryOp, UnaryOp};
use crate::parser::Hidden;
use crate::source::Span;

/// Index into [`ResolvedScript::functions`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FunctionId(pub usize);

/// Index into [`ResolvedScript::names`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NameId(pub usize);

/// Index into [`Function::locals`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LocalId(pub usize);

impl FunctionId {
    /// The global code.
    pub const GLOBAL: FunctionId = FunctionId(0);
}

/// A whole script.
#[derive(Debug, Clone, Default)]
pub struct ResolvedScript {
    /// Number 0 is the global code; a lambda comes after the function that creates it.
    pub functions: Vec<Function>,
    /// Names that are no locals, in order of first appearance.
    pub names: Vec<Name>,
    /// The names that syntax errors hide.
    pub hidden: Hidden,
    numbers: HashMap<String, NameId>,
}

impl ResolvedScript {
    /// The function with that number.
    pub fn function(&self, id: FunctionId) -> &Function {
        &self.functions[id.0]
    }

    /// The name with that number.
    pub fn name(&self, id: NameId) -> &Name {
        &self.names[id.0]
    }

    /// The number of a name that occurs in the script.
    pub fn find_name(&self, text: &str) -> Option<NameId> {
        self.numbers.get(text).copied()
    }

    /// The number of a name, which it gets now if it is new.
    pub fn intern(&mut self, text: &str) -> NameId {
        if let Some(id) = self.find_name(text) {
            return id;
        }
        let id = NameId(self.names.len());
        self.names.push(Name { text: text.to_owned(), ..Name::default() });
        self.numbers.insert(text.to_owned(), id);
        id
    }
}

/// A name that is no local, and where the script uses it.
#[derive(Debug, Clone, Default)]
pub struct Name {
    /// The text as written.
    pub text: String,
    /// Places that read it, but for direct calls.
    pub reads: Vec<Span>,
    /// Places that call it directly.
    pub calls: Vec<Span>,
    /// Places that assign it, `var` at the top level included.
    pub writes: Vec<Span>,
    /// Named functions of that name, in order.
    pub definitions: Vec<(FunctionId, Span)>,
}

/// A named function, a lambda, or the global code.
#[derive(Debug, Clone, Default)]
pub struct Function {
    /// `None` for a lambda and for the global code.
    pub name: Option<String>,
    /// From `function` to the closing brace.
    pub span: Span,
    /// Number of parameters; they are the first locals.
    pub parameters: usize,
    /// Parameters, variables and captured values.
    pub locals: Vec<Local>,
    /// Locals of the creating function that are captured, in the order of their numbers.
    pub captures: Vec<LocalId>,
    /// `self` occurs in it, or in a lambda that takes its self from here.
    pub uses_self: bool,
    /// The function that creates this lambda.
    pub creator: Option<FunctionId>,
    /// Statements.
    pub body: Vec<Stmt>,
}

impl Function {
    /// The local with that number.
    pub fn local(&self, id: LocalId) -> &Local {
        &self.locals[id.0]
    }
}

/// A local variable.
#[derive(Debug, Clone)]
pub struct Local {
    /// The name as written.
    pub name: String,
    /// The place of its declaration.
    pub span: Span,
    /// Its kind.
    pub kind: LocalKind,
}

/// The kind of a local variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LocalKind {
    /// Parameter number, from 0.
    Parameter(usize),
    /// `var`
    Variable,
    /// A captured value: its number, and whether the lambda assigns it, which needs a copy.
    Captured {
        /// Position in [`Function::captures`].
        index: usize,
        /// The lambda assigns it.
        assigned: bool,
    },
}

/// A statement.
#[derive(Debug, Clone)]
pub struct Stmt {
    /// The statement.
    pub kind: StmtKind,
    /// The place in the source.
    pub span: Span,
}

/// A statement.
#[derive(Debug, Clone)]
pub enum StmtKind {
    /// Declares a local; a `var` that declares a global is an [`StmtKind::Assign`].
    Var {
        /// The local.
        local: LocalId,
        /// nil without.
        value: Option<Expr>,
    },
    /// Assigns.
    Assign {
        /// [`ExprKind::Local`], [`ExprKind::Name`], [`ExprKind::Field`] or [`ExprKind::Index`].
        target: Expr,
        /// The new value.
        value: Expr,
    },
    /// `if`
    If {
        /// The conditions, in the order in which they are tested.
        branches: Vec<Branch>,
        /// The block that runs if none of them is true.
        otherwise: Block,
    },
    /// `while`, or the part of a `for` after its first statement.
    While {
        /// The condition.
        condition: Expr,
        /// The body.
        body: Block,
        /// The last part of a `for`.
        update: Option<Box<Stmt>>,
    },
    /// Leaves the function.
    Return(Option<Expr>),
    /// A call for its effect.
    Call(Expr),
}

/// One condition of an `if` and its block, which runs if no earlier condition is true.
#[derive(Debug, Clone)]
pub struct Branch {
    /// The condition.
    pub condition: Expr,
    /// The block.
    pub then: Block,
}

/// Statements whose `var`s end with them.
#[derive(Debug, Clone, Default)]
pub struct Block {
    /// The statements.
    pub stmts: Vec<Stmt>,
    /// The place in the source.
    pub span: Span,
}

/// An expression.
#[derive(Debug, Clone)]
pub struct Expr {
    /// The expression.
    pub kind: ExprKind,
    /// The place in the source.
    pub span: Span,
}

/// An expression.
#[derive(Debug, Clone)]
pub enum ExprKind {
    /// nil
    Nil,
    /// An integer literal.
    Int(i64),
    /// A float literal.
    Float(f64),
    /// A string literal.
    Str(String),
    /// A local variable.
    Local(LocalId),
    /// Any other name.
    Name(NameId),
    /// `self` inside a function.
    SelfValue,
    /// `object.key`
    Field {
        /// The table.
        object: Box<Expr>,
        /// Name of the field.
        key: String,
        /// The place of the name.
        key_span: Span,
    },
    /// `object[index]`
    Index {
        /// The table.
        object: Box<Expr>,
        /// The key.
        index: Box<Expr>,
    },
    /// `callee(args)`; a callee that is a field or an element makes its table the `self` of the call.
    Call {
        /// The called value.
        callee: Box<Expr>,
        /// Its arguments.
        args: Vec<Expr>,
    },
    /// A table literal.
    Table(Vec<(Expr, Expr)>),
    /// A lambda.
    Lambda(FunctionId),
    /// An operation on one value.
    Unary {
        /// The operation; never [`UnaryOp::Plus`].
        op: UnaryOp,
        /// The value.
        operand: Box<Expr>,
    },
    /// Operations on two values in a row: operators of one [`Power`](crate::ast::Power), computed from the left. So
    /// a long sum is no deep tree.
    Chain {
        /// The left side of the first operation.
        first: Box<Expr>,
        /// The operations; at least one.
        links: Vec<Link>,
    },
    /// Source that could not be understood; an error was reported.
    Error,
}

/// An operation on the value of all that stands before it in a [`ExprKind::Chain`].
#[derive(Debug, Clone)]
pub struct Link {
    /// The operation.
    pub op: BinaryOp,
    /// Its right side.
    pub right: Expr,
    /// The source of the value up to here, from the first operand to this one.
    pub span: Span,
}

/// Calls `visit` for every expression directly below this one, but for the keys of table literals, which are
/// constants.
pub fn children<'a>(expr: &'a Expr, mut visit: impl FnMut(&'a Expr)) {
    match &expr.kind {
        ExprKind::Field { object, .. } => visit(object),
        ExprKind::Index { object, index } => {
            visit(object);
            visit(index);
        }
        ExprKind::Call { callee, args } => {
            visit(callee);
            args.iter().for_each(visit);
        }
        ExprKind::Table(entries) => {
            entries.iter().for_each(|(_, value)| visit(value));
        }
        ExprKind::Unary { operand, .. } => visit(operand),
        ExprKind::Chain { first, links } => {
            visit(first);
            links.iter().for_each(|link| visit(&link.right));
        }
        ExprKind::Nil
        | ExprKind::Int(_)
        | ExprKind::Float(_)
        | ExprKind::Str(_)
        | ExprKind::Local(_)
        | ExprKind::Name(_)
        | ExprKind::SelfValue
        | ExprKind::Lambda(_)
        | ExprKind::Error => {}
    }
}

/// Calls `visit` for every statement, outer ones first. Lambdas are functions of their own.
pub fn each_stmt<'a>(stmts: &'a [Stmt], visit: &mut dyn FnMut(&'a Stmt)) {
    for stmt in stmts {
        visit(stmt);
        match &stmt.kind {
            StmtKind::If { branches, otherwise } => {
                branches.iter().for_each(|branch| each_stmt(&branch.then.stmts, visit));
                each_stmt(&otherwise.stmts, visit);
            }
            StmtKind::While { body, update, .. } => {
                each_stmt(&body.stmts, visit);
                each_stmt(update.as_deref().map_or(&[], std::slice::from_ref), visit);
            }
            StmtKind::Var { .. }
            | StmtKind::Assign { .. }
            | StmtKind::Return(_)
            | StmtKind::Call(_) => {}
        }
    }
}

/// Calls `visit` for every expression in the statements, outer ones first. Lambdas are functions of their own.
pub fn each_expr<'a>(stmts: &'a [Stmt], visit: &mut dyn FnMut(&'a Expr)) {
    for stmt in stmts {
        match &stmt.kind {
            StmtKind::Var { value, .. } | StmtKind::Return(value) => {
                value.iter().for_each(|value| with_children(value, visit));
            }
            StmtKind::Assign { target, value } => {
                with_children(target, visit);
                with_children(value, visit);
            }
            StmtKind::If { branches, otherwise } => {
                for Branch { condition, then } in branches {
                    with_children(condition, visit);
                    each_expr(&then.stmts, visit);
                }
                each_expr(&otherwise.stmts, visit);
            }
            StmtKind::While { condition, body, update } => {
                with_children(condition, visit);
                each_expr(&body.stmts, visit);
                each_expr(update.as_deref().map_or(&[], std::slice::from_ref), visit);
            }
            StmtKind::Call(call) => with_children(call, visit),
        }
    }
}

fn with_children<'a>(expr: &'a Expr, visit: &mut dyn FnMut(&'a Expr)) {
    visit(expr);
    children(expr, |child| with_children(child, visit));
}
