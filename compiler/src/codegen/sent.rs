//! Whether a script may send what fits no frame: tables, functions, text, entries of stigmergies that have no frame of their own.
//!
//! Values are followed through variables, parameters and results, whatever the order in which things happen. What cannot be
//! followed counts as too long.

use std::collections::BTreeSet;

use bittybuzz_vm_core::builtin::{self, Library};
use bittybuzz_vm_core::message::STIGMERGIES;

use crate::check::names::{Meaning, Meanings, Member};
use crate::check::tree::{
    Expr, ExprKind, FunctionId, LocalId, LocalKind, NameId, Program, Stmt, StmtKind,
};
use crate::check::values::{Kind, kind_of};

/// Looks at the whole script.
pub fn may_be_long(program: &Program, meanings: &Meanings<'_>) -> bool {
    let mut flow = Flow { program, meanings, long: BTreeSet::new() };
    loop {
        let known = flow.long.len();
        for (number, function) in program.functions.iter().enumerate() {
            flow.stmts(FunctionId(number), &function.body);
        }
        if flow.long.len() == known {
            return flow.long.contains(&Place::Sent);
        }
    }
}

/// Where a value may be.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    Global(NameId),
    Local(FunctionId, LocalId),
    /// What a function returns.
    Result(FunctionId),
    /// What some function returns that is called as a value.
    AnyResult,
    /// In some table.
    Element,
    /// In messages and stigmergies.
    Sent,
}

struct Flow<'a> {
    program: &'a Program,
    meanings: &'a Meanings<'a>,
    /// Places that may hold what fits no frame.
    long: BTreeSet<Place>,
}

impl Flow<'_> {
    fn put(&mut self, place: Place, is_long: bool) {
        if is_long {
            self.long.insert(place);
        }
    }

    fn stmts(&mut self, function: FunctionId, stmts: &[Stmt]) {
        for stmt in stmts {
            match &stmt.kind {
                StmtKind::Var { local, value } => {
                    let is_long = value.as_ref().is_some_and(|value| self.value(function, value));
                    self.put(self.local(function, *local), is_long);
                }
                StmtKind::Assign { target, value } => {
                    let is_long = self.value(function, value);
                    let place = match &target.kind {
                        ExprKind::Name(name) => Place::Global(*name),
                        ExprKind::Local(local) => self.local(function, *local),
                        _ => {
                            self.value(function, target);
                            Place::Element
                        }
                    };
                    self.put(place, is_long);
                }
                StmtKind::If { condition, then, otherwise } => {
                    self.value(function, condition);
                    self.stmts(function, &then.stmts);
                    self.stmts(function, &otherwise.stmts);
                }
                StmtKind::While { condition, body, update } => {
                    self.value(function, condition);
                    self.stmts(function, &body.stmts);
                    self.stmts(function, update.as_deref().map_or(&[], std::slice::from_ref));
                }
                StmtKind::Return(value) => {
                    let is_long = value.as_ref().is_some_and(|value| self.value(function, value));
                    self.put(Place::Result(function), is_long);
                }
                StmtKind::Call(call) => {
                    self.value(function, call);
                }
            }
        }
    }

    /// The variable itself, of which a lambda has a captured copy.
    fn local(&self, function: FunctionId, local: LocalId) -> Place {
        let of = self.program.function(function);
        match (of.local(local).kind, of.creator) {
            (LocalKind::Captured { index, .. }, Some(creator)) => {
                self.local(creator, of.captures[index])
            }
            _ => Place::Local(function, local),
        }
    }

    /// Whether the value of an expression may be too long.
    fn value(&mut self, function: FunctionId, expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Nil | ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_) => false,
            ExprKind::Local(local) => self.long.contains(&self.local(function, *local)),
            ExprKind::Name(name) => match self.meanings.of(*name) {
                Meaning::Global => self.long.contains(&Place::Global(*name)),
                Meaning::Nil | Meaning::RobotId => false,
                Meaning::Function(_) => {
                    self.called_with(expr, &[]);
                    true
                }
                Meaning::Builtin(_) | Meaning::Robot => true,
                Meaning::Library(library) => {
                    // By another name anything may be called.
                    let sends = matches!(library, Library::Neighbors | Library::Stigmergy);
                    let escapes = self.meanings.escaped().contains(&library);
                    self.put(Place::Sent, sends && escapes);
                    true
                }
            },
            ExprKind::Lambda(_) => {
                self.called_with(expr, &[]);
                true
            }
            ExprKind::Table(entries) => {
                for (_, value) in entries {
                    let is_long = self.value(function, value);
                    self.put(Place::Element, is_long);
                }
                true
            }
            ExprKind::Unary { operand, .. } => {
                self.value(function, operand);
                false
            }
            ExprKind::Binary { left, right, .. } => {
                self.value(function, left);
                self.value(function, right);
                false
            }
            ExprKind::Field { object, .. } => {
                self.value(function, object);
                self.long.contains(&Place::Element)
            }
            ExprKind::Index { object, index } => {
                self.value(function, object);
                self.value(function, index);
                self.long.contains(&Place::Element)
            }
            ExprKind::Call { callee, args } => self.call(function, callee, args),
            ExprKind::SelfValue | ExprKind::Error => true,
        }
    }

    fn call(&mut self, function: FunctionId, callee: &Expr, args: &[Expr]) -> bool {
        match &callee.kind {
            ExprKind::Name(name) => match self.meanings.of(*name) {
                Meaning::Function(called) => {
                    for (number, arg) in args.iter().enumerate() {
                        let is_long = self.value(function, arg);
                        self.put(Place::Local(called, LocalId(number)), is_long);
                    }
                    return self.long.contains(&Place::Result(called));
                }
                Meaning::Builtin(number) => return self.builtin(function, number, args),
                Meaning::Robot => {
                    for arg in args {
                        self.value(function, arg);
                    }
                    return false;
                }
                _ => {}
            },
            ExprKind::Field { object, key, .. } => {
                if let Some(library) = self.meanings.library(object)
                    && let Member::Known(info) = self.meanings.member(library, key)
                {
                    return self.builtin(function, info.number, args);
                }
                self.value(function, object);
                // Of a stigmergy, of another object, or of a table of the script.
                if let [key_of, value] = args
                    && key == "put"
                {
                    let is_float = kind_of(key_of, self.meanings) == Some(Kind::Float);
                    let is_long = self.value(function, value);
                    self.put(Place::Sent, is_long || is_float);
                }
            }
            _ => {
                self.value(function, callee);
            }
        }
        for arg in args {
            self.value(function, arg);
        }
        [Place::AnyResult, Place::Element, Place::Sent].iter().any(|of| self.long.contains(of))
    }

    fn builtin(&mut self, function: FunctionId, number: u8, args: &[Expr]) -> bool {
        let has = |flow: &Self, place| flow.long.contains(&place);
        let element = has(self, Place::Element);
        match (number, args) {
            (builtin::NEIGHBORS_LISTEN, [_, listener]) => {
                let sent = has(self, Place::Sent);
                self.called_with(listener, &[false, sent, false]);
                return false;
            }
            (builtin::FOREACH, [table, callback]) => {
                self.value(function, table);
                self.called_with(callback, &[false, element]);
                return false;
            }
            (builtin::NEIGHBORS_FOREACH, [callback]) => {
                self.called_with(callback, &[false, true]);
                return false;
            }
            (builtin::REDUCE, [table, callback, first]) => {
                self.value(function, table);
                return self.reduce(function, callback, element, first);
            }
            (builtin::NEIGHBORS_REDUCE, [callback, first]) => {
                return self.reduce(function, callback, true, first);
            }
            _ => {}
        }
        let mut is_any_long = false;
        for arg in args {
            is_any_long |= self.value(function, arg);
        }
        match number {
            builtin::NEIGHBORS_BROADCAST => {
                let is_long = args.get(1).is_some_and(|value| self.value(function, value));
                self.put(Place::Sent, is_long);
                false
            }
            builtin::STIGMERGY_CREATE => {
                let has_frames = args.first().is_some_and(|number| {
                    matches!(number.kind, ExprKind::Int(number) if number < STIGMERGIES.into())
                });
                self.put(Place::Sent, !has_frames);
                true
            }
            // What their functions return, too.
            builtin::MAP | builtin::FILTER | builtin::NEIGHBORS_MAP | builtin::NEIGHBORS_FILTER => {
                let is_long = has(self, Place::AnyResult) || number == builtin::NEIGHBORS_FILTER;
                self.put(Place::Element, is_long);
                true
            }
            // One of their arguments, or 0.
            builtin::MIN | builtin::MAX => is_any_long,
            _ => builtin::info(number).is_none_or(|info| match info.library {
                Library::Math | Library::Rng | Library::Position => info.number == builtin::RNG,
                Library::Global => info.number == builtin::CLONE,
                Library::Neighbors => number != builtin::NEIGHBORS_COUNT,
                Library::Swarm => number != builtin::SWARM_ID,
                _ => true,
            }),
        }
    }

    /// A function that is called for each element, and the value that it hands on.
    fn reduce(
        &mut self,
        function: FunctionId,
        callback: &Expr,
        element: bool,
        first: &Expr,
    ) -> bool {
        let result = match self.function_of(callback) {
            Some(called) => self.long.contains(&Place::Result(called)),
            None => true,
        };
        let is_long = self.value(function, first) || result;
        self.called_with(callback, &[false, element, is_long]);
        is_long
    }

    fn function_of(&self, expr: &Expr) -> Option<FunctionId> {
        match &expr.kind {
            ExprKind::Lambda(function) => Some(*function),
            ExprKind::Name(name) => match self.meanings.of(*name) {
                Meaning::Function(function) => Some(function),
                _ => None,
            },
            _ => None,
        }
    }

    /// A function that is called with such arguments; with any, where nothing is known of one.
    fn called_with(&mut self, expr: &Expr, args: &[bool]) {
        let Some(called) = self.function_of(expr) else { return };
        for number in 0..self.program.function(called).parameters {
            let is_long = args.get(number).copied().unwrap_or(true);
            self.put(Place::Local(called, LocalId(number)), is_long);
        }
        let is_long = self.long.contains(&Place::Result(called));
        self.put(Place::AnyResult, is_long);
    }
}
