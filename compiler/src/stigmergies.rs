//! The numbers of a script's stigmergies, and the table that maps them to numbers in messages.
//!
//! An entry fits one frame only if the number of its stigmergy in messages is below
//! [`STIGMERGIES`]. Scripts use any numbers. The first numbers that a script passes to
//! `stigmergy.create` therefore change places with 0, 1 and 2: the image holds a table of them, and
//! the machine exchanges the numbers in both directions. All other numbers stay as they are, so no
//! two stigmergies meet, and numbers that the script computes at run time need no rule of their
//! own.
//!
//! Robots that are built from one source must have equal tables. The search therefore follows the
//! order of the tokens and knows neither the robot nor the profile, and includes code that never
//! runs. It may miss a number or find too many; then some entries take more frames than necessary.

use std::collections::{BTreeMap, BTreeSet};

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::content::{ContentItem, ContentWriter, Head};
use bittybuzz_vm_core::message::{
    FRAGMENT_HEAD, FULL_FRAME, STIGMERGIES, ScriptIdentity, TINY_FRAME,
};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

use crate::ast::{Block, Expr, ExprKind, Function, Script, Stmt, StmtKind};
use crate::codes::DiagnosticCode;
use crate::constant::{self, ConstantNumber};
use crate::diagnostic::Diagnostic;
use crate::profile::NumberProfile;
use crate::source::Span;

/// The number of stigmergies whose entries fit one frame.
const FRAMED: usize = STIGMERGIES as usize;

/// The most numbers that the search remembers for a variable.
const REMEMBERED_MAX: usize = 16;

/// The constants that a script passes to `stigmergy.create`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct StigmergyNumbers {
    /// Each number once, in the order of the source, with its first place.
    found: Vec<(u16, Span)>,
}

impl StigmergyNumbers {
    /// Searches a whole script.
    pub fn find(script: &Script) -> Self {
        let stigmergy = Variable { is_library: true, ..Variable::default() };
        let mut search = Search {
            scopes: vec![BTreeMap::from([("stigmergy", 0)])],
            variables: vec![stigmergy],
            calls: Vec::new(),
        };
        search.stmts(&script.stmts);
        search.end()
    }

    /// Returns the number in the script of each stigmergy whose entries fit one frame, by its
    /// number in messages. A number below [`STIGMERGIES`] keeps its place.
    pub fn framed(&self) -> [u16; FRAMED] {
        let first = || self.found.iter().take(FRAMED).map(|(number, _)| *number);
        let mut table = std::array::from_fn(|place| place as u16);
        let mut others = first().filter(|number| *number >= STIGMERGIES);
        for (place, number) in table.iter_mut().enumerate() {
            if !first().any(|known| usize::from(known) == place)
                && let Some(other) = others.next()
            {
                *number = other;
            }
        }
        table
    }

    /// Returns the stigmergy table of the image; `None` if all numbers keep their places.
    pub fn table(&self) -> Option<[u16; FRAMED]> {
        let table = self.framed();
        let is_changed = |(place, number): (usize, &u16)| place != usize::from(*number);
        table.iter().enumerate().any(is_changed).then_some(table)
    }

    /// Returns a warning for each stigmergy whose entries need several frames because three others
    /// come first.
    pub fn warnings(&self, profile: NumberProfile) -> Vec<Diagnostic> {
        let frames = match profile {
            NumberProfile::Tiny => entry_frames::<Tiny>(TINY_FRAME),
            NumberProfile::Full => entry_frames::<Full>(FULL_FRAME),
        };
        let others = self.found.iter().skip(FRAMED).filter(|_| frames > 1);
        let warning = |(number, span): &(u16, Span)| {
            let message = format!("each entry of stigmergy {number} takes {frames} frames");
            Diagnostic::new(DiagnosticCode::ManyStigmergies, *span, message)
                .label("the script has three other stigmergies before")
                .help(
                    "an entry of the first three stigmergies takes one frame: \
                     use more keys instead of more stigmergies",
                )
        };
        others.map(warning).collect()
    }
}

/// Returns the number of frames of an entry with two plain values that travels in fragments.
fn entry_frames<P: Profile>(frame: usize) -> usize {
    let script = ScriptIdentity { hash: 0, strings: 0 };
    let head = Head::Entry { stigmergy: 0, owner: 0, clock: 0, digest: 0 };
    let mut room = [0; FULL_FRAME];
    let mut writer = ContentWriter::new(&mut room, script, head);
    for _ in 0..2 {
        writer.item(ContentItem::Plain(Value::<P>::int(0)));
    }
    let length = writer.finish().expect("two numbers fit a frame of the full profile");
    length.div_ceil(frame - FRAGMENT_HEAD)
}

/// The values that the source assigns to a variable, as far as the search needs them.
#[derive(Debug, Default)]
struct Variable {
    /// Integers, each once.
    numbers: Vec<i32>,
    /// True if the variable may be the library `stigmergy`.
    is_library: bool,
    /// True if the variable may be `stigmergy.create`.
    is_create: bool,
}

/// A call that may create a stigmergy.
struct Call {
    callee: Callee,
    argument: Argument,
    span: Span,
}

enum Callee {
    /// `variable.create(...)`
    Member(usize),
    /// `variable(...)`
    Value(usize),
}

enum Argument {
    Numbers(Vec<i32>),
    /// The variable may get its numbers later in the source.
    Variable(usize),
}

struct Search<'a> {
    /// The names of the global code, then those of each function around the current place, with
    /// their variables.
    scopes: Vec<BTreeMap<&'a str, usize>>,
    variables: Vec<Variable>,
    calls: Vec<Call>,
}

impl<'a> Search<'a> {
    fn end(self) -> StigmergyNumbers {
        let mut found = Vec::new();
        let mut seen = BTreeSet::new();
        for Call { callee, argument, span } in &self.calls {
            let creates = match callee {
                Callee::Member(variable) => self.variables[*variable].is_library,
                Callee::Value(variable) => self.variables[*variable].is_create,
            };
            let numbers = match argument {
                Argument::Numbers(numbers) => numbers,
                Argument::Variable(variable) => &self.variables[*variable].numbers,
            };
            for number in numbers.iter().filter(|_| creates) {
                if let Ok(number) = u16::try_from(*number)
                    && seen.insert(number)
                {
                    found.push((number, *span));
                }
            }
        }
        StigmergyNumbers { found }
    }

    /// Returns the variable of that name. A name that no function declares is global.
    fn variable(&mut self, name: &'a str) -> usize {
        let known = self.scopes.iter().rev().find_map(|scope| scope.get(name)).copied();
        known.unwrap_or_else(|| self.declare(0, name))
    }

    fn declare(&mut self, scope: usize, name: &'a str) -> usize {
        let next = self.variables.len();
        let variable = *self.scopes[scope].entry(name).or_insert(next);
        if variable == next {
            self.variables.push(Variable::default());
        }
        variable
    }

    fn stmts(&mut self, stmts: &'a [Stmt]) {
        for stmt in stmts {
            self.stmt(stmt);
        }
    }

    fn block(&mut self, block: &'a Block) {
        self.stmts(&block.stmts);
    }

    fn stmt(&mut self, stmt: &'a Stmt) {
        match &stmt.kind {
            StmtKind::Var { name, value } => {
                if let Some(value) = value {
                    self.expr(value);
                }
                let variable = self.declare(self.scopes.len() - 1, &name.name);
                if let Some(value) = value {
                    self.assign(variable, value);
                }
            }
            StmtKind::Function { function, .. } => self.function(function),
            StmtKind::If { branches, otherwise } => {
                for branch in branches {
                    self.expr(&branch.condition);
                    self.block(&branch.then);
                }
                if let Some(otherwise) = otherwise {
                    self.block(otherwise);
                }
            }
            StmtKind::For { init, condition, update, body } => {
                self.stmt(init);
                self.expr(condition);
                self.stmt(update);
                self.block(body);
            }
            StmtKind::While { condition, body } => {
                self.expr(condition);
                self.block(body);
            }
            StmtKind::Return { value } => {
                if let Some(value) = value {
                    self.expr(value);
                }
            }
            StmtKind::Assign { target, value } => {
                self.expr(target);
                self.expr(value);
                if let ExprKind::Name(name) = &target.kind {
                    let variable = self.variable(name);
                    self.assign(variable, value);
                }
            }
            StmtKind::Call(call) => self.expr(call),
        }
    }

    fn function(&mut self, function: &'a Function) {
        self.scopes.push(BTreeMap::new());
        for parameter in &function.params {
            self.declare(self.scopes.len() - 1, &parameter.name);
        }
        self.block(&function.body);
        self.scopes.pop();
    }

    fn expr(&mut self, expr: &'a Expr) {
        match &expr.kind {
            ExprKind::Call { callee, args } => {
                if let Some(first) = args.first() {
                    self.call(callee, first);
                }
                self.expr(callee);
                args.iter().for_each(|arg| self.expr(arg));
            }
            ExprKind::Field { object, .. } => self.expr(object),
            ExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
            }
            ExprKind::Table(fields) => fields.iter().for_each(|field| self.expr(&field.value)),
            ExprKind::Lambda(function) => self.function(function),
            ExprKind::Unary { operand, .. } => self.expr(operand),
            ExprKind::Chain { first, links } => {
                self.expr(first);
                links.iter().for_each(|link| self.expr(&link.right));
            }
            ExprKind::Paren(inner) => self.expr(inner),
            ExprKind::Nil
            | ExprKind::Int(_)
            | ExprKind::Float(_)
            | ExprKind::Str(_)
            | ExprKind::Name(_)
            | ExprKind::Error => {}
        }
    }

    fn call(&mut self, callee: &'a Expr, first: &'a Expr) {
        let callee = match &callee.kind {
            ExprKind::Name(name) => Callee::Value(self.variable(name)),
            _ => match library_of_create(callee) {
                Some(library) => Callee::Member(self.variable(library)),
                None => return,
            },
        };
        let argument = match &first.kind {
            ExprKind::Name(name) => Argument::Variable(self.variable(name)),
            _ => Argument::Numbers(self.numbers(first)),
        };
        self.calls.push(Call { callee, argument, span: first.span });
    }

    /// Records that the source assigns a value to a variable.
    fn assign(&mut self, variable: usize, value: &'a Expr) {
        let numbers = self.numbers(value);
        let (mut is_library, mut is_create) = (false, false);
        if let ExprKind::Name(name) = &value.kind {
            let value = self.variable(name);
            Variable { is_library, is_create, .. } = self.variables[value];
        } else if let Some(library) = library_of_create(value) {
            let library = self.variable(library);
            is_create = self.variables[library].is_library;
        }
        let variable = &mut self.variables[variable];
        variable.is_library |= is_library;
        variable.is_create |= is_create;
        for number in numbers {
            if variable.numbers.len() < REMEMBERED_MAX && !variable.numbers.contains(&number) {
                variable.numbers.push(number);
            }
        }
    }

    /// Returns the integers that an expression may have, as far as they are known.
    fn numbers(&mut self, expr: &'a Expr) -> Vec<i32> {
        match &expr.kind {
            ExprKind::Int(number) => i32::try_from(*number).into_iter().collect(),
            ExprKind::Name(name) => {
                let variable = self.variable(name);
                self.variables[variable].numbers.clone()
            }
            ExprKind::Paren(inner) => self.numbers(inner),
            ExprKind::Unary { .. } | ExprKind::Chain { .. } => match self.constant(expr) {
                Some(ConstantNumber::Int(number)) => vec![number],
                _ => Vec::new(),
            },
            _ => Vec::new(),
        }
    }

    /// Returns the value of an expression of which each part has one known value.
    fn constant(&mut self, expr: &'a Expr) -> Option<ConstantNumber> {
        // The profile makes a difference only for numbers that `tiny` cannot represent.
        let profile = NumberProfile::Full;
        match &expr.kind {
            ExprKind::Unary { op, operand } => {
                constant::unary(profile, *op, self.constant(operand)?)
            }
            ExprKind::Chain { first, links } => {
                let mut result = self.constant(first)?;
                for link in links {
                    let right = self.constant(&link.right)?;
                    result = constant::arithmetic(profile, link.op, result, right)?;
                }
                Some(result)
            }
            ExprKind::Paren(inner) => self.constant(inner),
            _ => match *self.numbers(expr) {
                [number] => Some(ConstantNumber::Int(number)),
                _ => None,
            },
        }
    }
}

/// Returns the name of the object in `object.create`.
fn library_of_create(expr: &Expr) -> Option<&str> {
    if let ExprKind::Field { object, key } = &expr.kind
        && let ExprKind::Name(library) = &object.kind
        && key.name == "create"
    {
        return Some(library);
    }
    None
}
