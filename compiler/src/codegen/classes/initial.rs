//! Initial values: the classes of values that variables and functions hold before any statement
//! assigns one.

use std::collections::BTreeSet;

use bittybuzz_vm_core::builtin::{self, BuiltinKind, Library};

use super::{Classes, Flow, ValueHolder};
use crate::check::names::{LibraryMember, Meaning};
use crate::check::tree::{
    CheckedExpr, CheckedExprKind, CheckedStmt, CheckedStmtKind, FunctionId, NameId, each_expr,
};

impl<'a> Flow<'a> {
    /// Puts the initial values into their places.
    pub(super) fn begin(&mut self) {
        // A script that uses one of these libraries as a value may send anything under any name.
        // `pos` is one of them, because it is nil instead of a table on robots without a position.
        let lost = [Library::Neighbors, Library::Stigmergy, Library::Position];
        self.is_lost = lost.iter().any(|library| self.meanings.escaped().contains(library));
        // The machine makes tables, too, such as the data of a neighbor.
        self.put(ValueHolder::Element, Classes::NUMBER);
        self.put(ValueHolder::Key, Classes::NUMBER | Classes::STRING);
        // Any variable may hold a robot function.
        self.put(ValueHolder::AnyResult, Classes::PLAIN);
        for (number, function) in self.program.functions.iter().enumerate() {
            if !always_returns(&function.body) {
                self.put(ValueHolder::Result(FunctionId(number)), Classes::NIL);
            }
        }
        let assigned = Assigned::of(self);
        for (number, name) in self.program.names.iter().enumerate() {
            let id = NameId(number);
            if self.meanings.of(id) != Meaning::Global {
                continue;
            }
            match self.meanings.offered(&name.text) {
                _ if !name.definitions.is_empty() => {
                    self.put(ValueHolder::Global(id), Classes::FUNCTION);
                }
                Meaning::Builtin(_) | Meaning::Library(_) => {
                    self.native_all();
                    self.put(ValueHolder::Global(id), self.any);
                }
                Meaning::RobotId => self.put(ValueHolder::Global(id), Classes::NUMBER),
                _ if assigned.contains(&id) => {}
                _ => self.put(ValueHolder::Global(id), Classes::NIL),
            }
        }
    }

    /// Follows the functions that variables hold initially.
    pub(super) fn first_functions(&mut self) {
        let (program, meanings) = (self.program, self.meanings);
        for (number, name) in program.names.iter().enumerate() {
            if meanings.of(NameId(number)) == Meaning::Global {
                for (function, _) in &name.definitions {
                    self.escape(*function);
                }
            }
        }
    }
}

/// Returns true if the statements never run to their end.
fn always_returns(stmts: &[CheckedStmt]) -> bool {
    stmts.iter().any(|stmt| match &stmt.kind {
        CheckedStmtKind::Return(_) => true,
        CheckedStmtKind::If { branches, otherwise } => {
            branches.iter().all(|branch| always_returns(&branch.then.stmts))
                && always_returns(&otherwise.stmts)
        }
        _ => false,
    })
}

/// Finds the globals that are assigned before anything can read them, by the global code or by
/// `init()`.
struct Assigned<'f, 'a> {
    flow: &'f Flow<'a>,
    /// Globals that may be read before they are assigned.
    read: BTreeSet<NameId>,
    assigned: BTreeSet<NameId>,
    /// Functions that were followed.
    called: BTreeSet<FunctionId>,
}

impl<'f, 'a> Assigned<'f, 'a> {
    fn of(flow: &'f Flow<'a>) -> BTreeSet<NameId> {
        let mut walk = Assigned {
            flow,
            read: BTreeSet::new(),
            assigned: BTreeSet::new(),
            called: BTreeSet::new(),
        };
        let init = flow.program.find_name("init").map(|name| flow.meanings.of(name));
        if walk.follow(&flow.program.function(FunctionId::GLOBAL).body)
            && let Some(Meaning::Function(init)) = init
        {
            walk.follow(&flow.program.function(init).body);
        }
        walk.assigned
    }

    /// Follows statements that run in this order. Returns false if the walk cannot continue to the
    /// end.
    fn follow(&mut self, stmts: &[CheckedStmt]) -> bool {
        for stmt in stmts {
            let (mut is_known, mut value_of) = (true, None);
            if let CheckedStmtKind::Assign { target, value } = &stmt.kind
                && let CheckedExprKind::Name(name) = target.kind
            {
                is_known &= self.reads(value);
                value_of = Some(name);
            } else {
                is_known &= self.may_run(std::slice::from_ref(stmt));
            }
            if !is_known || leaves(stmt) {
                return false;
            }
            if let Some(name) = value_of
                && !self.read.contains(&name)
            {
                self.assigned.insert(name);
            }
        }
        true
    }

    /// Records the globals that the statements may read, also in functions that they call. Returns
    /// false if they may call unknown functions.
    fn may_run(&mut self, stmts: &[CheckedStmt]) -> bool {
        let mut is_known = true;
        each_expr(stmts, &mut |expr| is_known &= self.note(expr));
        is_known
    }

    fn reads(&mut self, expr: &CheckedExpr) -> bool {
        let mut is_known = self.note(expr);
        crate::check::tree::children(expr, |child| is_known &= self.reads(child));
        is_known
    }

    fn note(&mut self, expr: &CheckedExpr) -> bool {
        match &expr.kind {
            CheckedExprKind::Name(name) => {
                if !self.assigned.contains(name) {
                    self.read.insert(*name);
                }
                true
            }
            CheckedExprKind::Call { callee, .. } => match &callee.kind {
                CheckedExprKind::Name(name) => match self.flow.meanings.of(*name) {
                    Meaning::Function(called) => {
                        !self.called.insert(called)
                            || self.may_run(&self.flow.program.function(called).body)
                    }
                    Meaning::Builtin(number) => is_plain(number),
                    Meaning::Robot | Meaning::Nil => true,
                    _ => false,
                },
                CheckedExprKind::Field { object, key, .. } => {
                    let library = self.flow.meanings.library(object);
                    let member = library.map(|library| self.flow.meanings.member(library, key));
                    matches!(member, Some(LibraryMember::Known(info)) if is_plain(info.number))
                }
                _ => false,
            },
            _ => true,
        }
    }
}

/// Returns true if the built-in calls no function.
fn is_plain(number: u8) -> bool {
    builtin::info(number).is_some_and(|info| info.kind == BuiltinKind::Plain)
}

/// Returns true if the statement may return from its function.
fn leaves(stmt: &CheckedStmt) -> bool {
    let any = |stmts: &[CheckedStmt]| stmts.iter().any(leaves);
    match &stmt.kind {
        CheckedStmtKind::Return(_) => true,
        CheckedStmtKind::If { branches, otherwise } => {
            branches.iter().any(|branch| any(&branch.then.stmts)) || any(&otherwise.stmts)
        }
        CheckedStmtKind::While { body, .. } => any(&body.stmts),
        _ => false,
    }
}
