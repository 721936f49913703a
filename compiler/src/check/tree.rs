//! The resolved syntax tree. [`super::resolve`] makes it from the syntax tree, for the checks and
//! the code generator.
//!
//! All functions are in one list, in which number 0 is the global code. The tree has no
//! parentheses, and a `for` is a `while` with an update.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use bittybuzz_robot_spec::{ValueConstant, ValueKey};

use crate::ast::{BinaryOp, UnaryOp};
use crate::constant::ConstantNumber;
use crate::parser::Hidden;
use crate::profile::{self, NumberProfile};
use crate::source::Span;

/// Index into [`ResolvedScript::functions`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FunctionId(pub usize);

/// Index into [`ResolvedScript::names`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NameId(pub usize);

/// Index into [`CheckedFunction::locals`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LocalId(pub usize);

impl FunctionId {
    /// The global code.
    pub const GLOBAL: FunctionId = FunctionId(0);
}

/// A whole script.
#[derive(Debug, Clone, Default)]
pub struct ResolvedScript {
    /// The functions. Number 0 is the global code; a lambda comes after the function that creates
    /// it.
    pub functions: Vec<CheckedFunction>,
    /// The names that are not locals, in order of first appearance.
    pub names: Vec<FreeName>,
    /// The names that syntax errors hide.
    pub hidden: Hidden,
    /// The tables that the robot fills.
    pub host: HostTables,
    /// The functions that were added to a script that already runs.
    pub added: Vec<FunctionId>,
    numbers: HashMap<String, NameId>,
}

impl ResolvedScript {
    /// Returns the function with that number.
    pub fn function(&self, id: FunctionId) -> &CheckedFunction {
        &self.functions[id.0]
    }

    /// Returns the name with that number.
    pub fn name(&self, id: NameId) -> &FreeName {
        &self.names[id.0]
    }

    /// Returns the number of a name if the name occurs in the script.
    pub fn find_name(&self, text: &str) -> Option<NameId> {
        self.numbers.get(text).copied()
    }

    /// Returns the number of a name, and adds the name if it is new.
    pub fn intern(&mut self, text: &str) -> NameId {
        if let Some(id) = self.find_name(text) {
            return id;
        }
        let id = NameId(self.names.len());
        self.names.push(FreeName { text: text.to_owned(), ..FreeName::default() });
        self.numbers.insert(text.to_owned(), id);
        id
    }
}

/// The tables that the robot fills for a script.
#[derive(Debug, Clone, Default)]
pub struct HostTables {
    /// The tables that the script uses.
    pub tables: BTreeMap<NameId, HostNode>,
    /// Those whose fields the script only reads, by their names. The script may put more into others.
    pub read_only: BTreeSet<NameId>,
    /// The function that runs in place of `step`, if something is done before it.
    pub step: Option<FunctionId>,
}

/// A table, or what stands in it.
#[derive(Debug, Clone)]
pub enum HostNode {
    /// A table. A list has only the key [`ValueKey::Elements`], with its number of elements.
    Table { entries: BTreeMap<ValueKey, HostNode>, elements: u32 },
    /// A number that does not change: one for all elements, or one for each.
    Constant(Vec<ValueConstant>),
    /// The result of the robot function of this name.
    Value(NameId),
    /// The robot function of this name.
    Function(NameId),
}

/// A name that is not a local, and the places that use it.
#[derive(Debug, Clone, Default)]
pub struct FreeName {
    /// The text as written.
    pub text: String,
    /// Places that read the name, except for direct calls.
    pub reads: Vec<Span>,
    /// Places that call the name directly.
    pub calls: Vec<Span>,
    /// Places that assign the name, including `var` at the top level.
    pub writes: Vec<Span>,
    /// Named functions of that name, in order.
    pub definitions: Vec<(FunctionId, Span)>,
}

/// A named function, a lambda, or the global code.
#[derive(Debug, Clone, Default)]
pub struct CheckedFunction {
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
    /// True if the function uses `self`, or creates a lambda that does.
    pub uses_self: bool,
    /// The function that creates this lambda; `None` for others.
    pub creator: Option<FunctionId>,
    pub body: Vec<CheckedStmt>,
}

impl CheckedFunction {
    /// Returns the local with that number.
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
    pub kind: LocalKind,
}

/// The kind of a local variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LocalKind {
    /// A parameter, by its number from 0.
    Parameter(usize),
    /// A variable, declared by `var`.
    Variable,
    /// A captured value.
    Captured {
        /// Position in [`CheckedFunction::captures`].
        index: usize,
        /// True if the lambda assigns the value, which needs a copy.
        assigned: bool,
    },
}

/// A statement.
#[derive(Debug, Clone)]
pub struct CheckedStmt {
    pub kind: CheckedStmtKind,
    /// The place in the source.
    pub span: Span,
}

/// The kinds of statements.
#[derive(Debug, Clone)]
pub enum CheckedStmtKind {
    /// Declares a local; a `var` that declares a global is an [`CheckedStmtKind::Assign`].
    Var {
        local: LocalId,
        /// The first value; `None` stands for nil.
        value: Option<CheckedExpr>,
    },
    /// An assignment.
    Assign {
        /// [`CheckedExprKind::Local`], [`CheckedExprKind::Name`], [`CheckedExprKind::Field`] or [`CheckedExprKind::Index`].
        target: CheckedExpr,
        value: CheckedExpr,
    },
    /// `if`
    If {
        /// The conditions, in the order in which they are tested.
        branches: Vec<CheckedBranch>,
        /// The block that runs if none of them is true.
        otherwise: CheckedBlock,
    },
    /// `while`, or the part of a `for` after its first statement.
    While {
        condition: CheckedExpr,
        body: CheckedBlock,
        /// The last part of a `for`.
        update: Option<Box<CheckedStmt>>,
    },
    /// A return from the function; `None` returns nil.
    Return(Option<CheckedExpr>),
    /// A call for its effect.
    Call(CheckedExpr),
}

/// One condition of an `if` and its block, which runs if no earlier condition is true.
#[derive(Debug, Clone)]
pub struct CheckedBranch {
    pub condition: CheckedExpr,
    pub then: CheckedBlock,
}

/// A sequence of statements that is the scope of its `var`s.
#[derive(Debug, Clone, Default)]
pub struct CheckedBlock {
    pub stmts: Vec<CheckedStmt>,
    /// The place in the source.
    pub span: Span,
}

/// An expression.
#[derive(Debug, Clone)]
pub struct CheckedExpr {
    pub kind: CheckedExprKind,
    /// The place in the source.
    pub span: Span,
}

impl CheckedExpr {
    /// Returns the value of a number literal, written or folded; `None` for any other expression.
    pub fn number(&self, profile: NumberProfile) -> Option<ConstantNumber> {
        match self.kind {
            CheckedExprKind::Int(value) => i32::try_from(value).ok().map(ConstantNumber::Int),
            CheckedExprKind::Float(value) => {
                let bits = profile::float_bits(profile, value);
                Some(ConstantNumber::Float(profile::from_bits(profile, bits)))
            }
            _ => None,
        }
    }
}

/// The kinds of expressions.
#[derive(Debug, Clone)]
pub enum CheckedExprKind {
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
        object: Box<CheckedExpr>,
        key: String,
        key_span: Span,
    },
    /// `object[index]`
    Index {
        /// The table.
        object: Box<CheckedExpr>,
        /// The key.
        index: Box<CheckedExpr>,
    },
    /// `callee(args)`. If the callee is a field or an element, the call gets the callee's table as
    /// its `self`.
    Call { callee: Box<CheckedExpr>, args: Vec<CheckedExpr> },
    /// A table literal.
    Table(Vec<(CheckedExpr, CheckedExpr)>),
    /// A lambda.
    Lambda(FunctionId),
    /// An operation on one value.
    Unary {
        /// The operation; never [`UnaryOp::Plus`].
        op: UnaryOp,
        operand: Box<CheckedExpr>,
    },
    /// A chain of binary operations whose operators have one [`Precedence`](crate::ast::Precedence),
    /// evaluated from left to right. A long sum is therefore no deep tree.
    Chain {
        /// The left operand of the first operation.
        first: Box<CheckedExpr>,
        /// The operations; at least one.
        links: Vec<CheckedLink>,
    },
    /// Source with an error that was reported.
    Error,
}

impl From<ConstantNumber> for CheckedExprKind {
    fn from(number: ConstantNumber) -> Self {
        match number {
            ConstantNumber::Int(value) => CheckedExprKind::Int(i64::from(value)),
            ConstantNumber::Float(value) => CheckedExprKind::Float(f64::from(value)),
        }
    }
}

/// An operation in an [`CheckedExprKind::Chain`]. Its left operand is the value of the chain before it.
#[derive(Debug, Clone)]
pub struct CheckedLink {
    pub op: BinaryOp,
    /// The right operand.
    pub right: CheckedExpr,
    /// The source from the first operand of the chain to the right operand of this operation.
    pub span: Span,
}

/// Calls `visit` for every direct subexpression, except for the keys of table literals, which are
/// constants.
pub fn children<'a>(expr: &'a CheckedExpr, mut visit: impl FnMut(&'a CheckedExpr)) {
    match &expr.kind {
        CheckedExprKind::Field { object, .. } => visit(object),
        CheckedExprKind::Index { object, index } => {
            visit(object);
            visit(index);
        }
        CheckedExprKind::Call { callee, args } => {
            visit(callee);
            args.iter().for_each(visit);
        }
        CheckedExprKind::Table(entries) => {
            entries.iter().for_each(|(_, value)| visit(value));
        }
        CheckedExprKind::Unary { operand, .. } => visit(operand),
        CheckedExprKind::Chain { first, links } => {
            visit(first);
            links.iter().for_each(|link| visit(&link.right));
        }
        CheckedExprKind::Nil
        | CheckedExprKind::Int(_)
        | CheckedExprKind::Float(_)
        | CheckedExprKind::Str(_)
        | CheckedExprKind::Local(_)
        | CheckedExprKind::Name(_)
        | CheckedExprKind::SelfValue
        | CheckedExprKind::Lambda(_)
        | CheckedExprKind::Error => {}
    }
}

/// Calls `visit` for every statement, outer ones first. The bodies of lambdas are not visited,
/// because lambdas are functions of their own.
pub fn each_stmt<'a>(stmts: &'a [CheckedStmt], visit: &mut dyn FnMut(&'a CheckedStmt)) {
    for stmt in stmts {
        visit(stmt);
        match &stmt.kind {
            CheckedStmtKind::If { branches, otherwise } => {
                branches.iter().for_each(|branch| each_stmt(&branch.then.stmts, visit));
                each_stmt(&otherwise.stmts, visit);
            }
            CheckedStmtKind::While { body, update, .. } => {
                each_stmt(&body.stmts, visit);
                each_stmt(update.as_deref().map_or(&[], std::slice::from_ref), visit);
            }
            CheckedStmtKind::Var { .. }
            | CheckedStmtKind::Assign { .. }
            | CheckedStmtKind::Return(_)
            | CheckedStmtKind::Call(_) => {}
        }
    }
}

/// Calls `visit` for every expression in the statements, outer ones first. The bodies of lambdas
/// are not visited, because lambdas are functions of their own.
pub fn each_expr<'a>(stmts: &'a [CheckedStmt], visit: &mut dyn FnMut(&'a CheckedExpr)) {
    for stmt in stmts {
        match &stmt.kind {
            CheckedStmtKind::Var { value, .. } | CheckedStmtKind::Return(value) => {
                value.iter().for_each(|value| with_children(value, visit));
            }
            CheckedStmtKind::Assign { target, value } => {
                with_children(target, visit);
                with_children(value, visit);
            }
            CheckedStmtKind::If { branches, otherwise } => {
                for CheckedBranch { condition, then } in branches {
                    with_children(condition, visit);
                    each_expr(&then.stmts, visit);
                }
                each_expr(&otherwise.stmts, visit);
            }
            CheckedStmtKind::While { condition, body, update } => {
                with_children(condition, visit);
                each_expr(&body.stmts, visit);
                each_expr(update.as_deref().map_or(&[], std::slice::from_ref), visit);
            }
            CheckedStmtKind::Call(call) => with_children(call, visit),
        }
    }
}

fn with_children<'a>(expr: &'a CheckedExpr, visit: &mut dyn FnMut(&'a CheckedExpr)) {
    visit(expr);
    children(expr, |child| with_children(child, visit));
}

/// Calls `visit` for every expression in the statements, inner ones first, to change them. The bodies
/// of lambdas are not visited, because lambdas are functions of their own.
pub fn each_expr_mut(stmts: &mut [CheckedStmt], visit: &mut dyn FnMut(&mut CheckedExpr)) {
    for stmt in stmts {
        match &mut stmt.kind {
            CheckedStmtKind::Var { value, .. } | CheckedStmtKind::Return(value) => {
                value.iter_mut().for_each(|value| inner_first(value, visit));
            }
            CheckedStmtKind::Assign { target, value } => {
                inner_first(target, visit);
                inner_first(value, visit);
            }
            CheckedStmtKind::If { branches, otherwise } => {
                for CheckedBranch { condition, then } in branches {
                    inner_first(condition, visit);
                    each_expr_mut(&mut then.stmts, visit);
                }
                each_expr_mut(&mut otherwise.stmts, visit);
            }
            CheckedStmtKind::While { condition, body, update } => {
                inner_first(condition, visit);
                each_expr_mut(&mut body.stmts, visit);
                let update = update.as_deref_mut();
                each_expr_mut(update.map_or(&mut [], std::slice::from_mut), visit);
            }
            CheckedStmtKind::Call(call) => inner_first(call, visit),
        }
    }
}

fn inner_first(expr: &mut CheckedExpr, visit: &mut dyn FnMut(&mut CheckedExpr)) {
    match &mut expr.kind {
        CheckedExprKind::Field { object, .. } => inner_first(object, visit),
        CheckedExprKind::Index { object, index } => {
            inner_first(object, visit);
            inner_first(index, visit);
        }
        CheckedExprKind::Call { callee, args } => {
            inner_first(callee, visit);
            args.iter_mut().for_each(|arg| inner_first(arg, visit));
        }
        CheckedExprKind::Table(entries) => {
            entries.iter_mut().for_each(|(_, value)| inner_first(value, visit));
        }
        CheckedExprKind::Unary { operand, .. } => inner_first(operand, visit),
        CheckedExprKind::Chain { first, links } => {
            inner_first(first, visit);
            links.iter_mut().for_each(|link| inner_first(&mut link.right, visit));
        }
        CheckedExprKind::Nil
        | CheckedExprKind::Int(_)
        | CheckedExprKind::Float(_)
        | CheckedExprKind::Str(_)
        | CheckedExprKind::Local(_)
        | CheckedExprKind::Name(_)
        | CheckedExprKind::SelfValue
        | CheckedExprKind::Lambda(_)
        | CheckedExprKind::Error => {}
    }
    visit(expr);
}

/// Collects the values that statements assign to each global.
pub fn assigned_values<'a>(
    stmts: &'a [CheckedStmt],
    values: &mut BTreeMap<NameId, Vec<&'a CheckedExpr>>,
) {
    each_stmt(stmts, &mut |stmt| {
        if let CheckedStmtKind::Assign { target, value } = &stmt.kind
            && let CheckedExprKind::Name(name) = target.kind
        {
            values.entry(name).or_default().push(value);
        }
    });
}
