//! The functions that may run: those that the global code or an entry point reaches by their names,
//! or by the names of the fields in which they are.

use std::collections::{BTreeMap, BTreeSet};

use crate::check::tree::{
    CheckedExpr, CheckedExprKind, CheckedStmt, CheckedStmtKind, FunctionId, NameId, ResolvedScript,
    children, each_stmt,
};
use crate::image::ENTRIES;

/// Returns true if the script defines or assigns an entry point. A file without one is a library or a
/// first trial.
pub fn has_entry(program: &ResolvedScript) -> bool {
    program.names.iter().any(|name| {
        ENTRIES.contains(&name.text.as_str())
            && (!name.definitions.is_empty() || !name.writes.is_empty())
    })
}

/// Returns the functions that may run. In a file without an entry point, and in one in which syntax
/// errors hide names, these are all functions.
pub fn running(program: &ResolvedScript) -> BTreeSet<FunctionId> {
    if !has_entry(program) || program.hidden.is_any() {
        return (0..program.functions.len()).map(FunctionId).collect();
    }
    let mut reach = Reach::new(program);
    reach.waiting.push(FunctionId::GLOBAL);
    reach.waiting.extend(&program.added);
    ENTRIES.iter().filter_map(|entry| program.find_name(entry)).for_each(|name| reach.name(name));
    reach.finish()
}

/// Returns the functions that `step` reaches by their names. There may be others that it runs, such as
/// the values of variables.
pub fn of_step(program: &ResolvedScript) -> BTreeSet<FunctionId> {
    let mut reach = Reach::new(program);
    program.find_name("step").into_iter().for_each(|name| reach.name(name));
    reach.finish()
}

/// A name that is not a local, and the fields that lead on from it: `math.vec2` is `vec2` in `math`.
type TablePath<'a> = (NameId, Vec<&'a str>);

fn table_path(expr: &CheckedExpr) -> Option<TablePath<'_>> {
    match &expr.kind {
        CheckedExprKind::Name(name) => Some((*name, Vec::new())),
        CheckedExprKind::Field { object, key, .. } => {
            let (name, mut keys) = table_path(object)?;
            keys.push(key);
            Some((name, keys))
        }
        _ => None,
    }
}

/// The tables that are used otherwise than by the names of their fields, so that nothing is known
/// about the fields that are read; `None` stands for all of them.
fn passed_on(program: &ResolvedScript) -> Option<BTreeSet<TablePath<'_>>> {
    let mut tables = BTreeSet::new();
    let mut has_self = false;
    let mut visit = |value| match table_path(value) {
        Some(path) => drop(tables.insert(path)),
        // A call of a field passes its table.
        None => has_self |= matches!(value.kind, CheckedExprKind::SelfValue),
    };
    for function in &program.functions {
        each_stmt(&function.body, &mut |stmt| {
            for expr in expressions(stmt) {
                whole(expr, &mut visit);
            }
        });
    }
    (!has_self).then_some(tables)
}

/// Calls `visit` for the expression and those in it, except for tables and `self` of which a field is
/// named.
fn whole<'a>(expr: &'a CheckedExpr, visit: &mut dyn FnMut(&'a CheckedExpr)) {
    visit(expr);
    children(expr, |child| {
        let is_named = matches!(expr.kind, CheckedExprKind::Field { .. })
            && (table_path(child).is_some() || matches!(child.kind, CheckedExprKind::SelfValue));
        if !is_named {
            whole(child, visit);
        }
    });
}

/// Returns the expressions of a statement, without those of the statements in it, and without a name or
/// a field of a table to which it assigns.
fn expressions(stmt: &CheckedStmt) -> Vec<&CheckedExpr> {
    match &stmt.kind {
        CheckedStmtKind::Var { value, .. } | CheckedStmtKind::Return(value) => {
            value.iter().collect()
        }
        CheckedStmtKind::Assign { target, value } => {
            let target = Some(target).filter(|target| table_path(target).is_none());
            target.into_iter().chain([value]).collect()
        }
        CheckedStmtKind::If { branches, .. } => {
            branches.iter().map(|branch| &branch.condition).collect()
        }
        CheckedStmtKind::While { condition, .. } => vec![condition],
        CheckedStmtKind::Call(call) => vec![call],
    }
}

struct Reach<'a> {
    program: &'a ResolvedScript,
    passed_on: Option<BTreeSet<TablePath<'a>>>,
    running: BTreeSet<FunctionId>,
    waiting: Vec<FunctionId>,
    /// The names of the fields that running functions read.
    keys: BTreeSet<&'a str>,
    /// Lambdas in fields that no running function has read yet, by the names of the fields.
    members: BTreeMap<&'a str, Vec<FunctionId>>,
}

impl<'a> Reach<'a> {
    fn new(program: &'a ResolvedScript) -> Self {
        Reach {
            program,
            passed_on: passed_on(program),
            running: BTreeSet::new(),
            waiting: Vec::new(),
            keys: BTreeSet::new(),
            members: BTreeMap::new(),
        }
    }

    /// Returns the functions that wait, and those that they reach.
    fn finish(mut self) -> BTreeSet<FunctionId> {
        let program = self.program;
        while let Some(id) = self.waiting.pop() {
            if self.running.insert(id) {
                each_stmt(&program.function(id).body, &mut |stmt| self.stmt(stmt));
            }
        }
        self.running
    }

    fn name(&mut self, name: NameId) {
        self.waiting.extend(self.program.name(name).definitions.iter().map(|(id, _)| *id));
    }

    fn stmt(&mut self, stmt: &'a CheckedStmt) {
        let CheckedStmtKind::Assign { target, value } = &stmt.kind else {
            expressions(stmt).into_iter().for_each(|expr| self.expr(expr));
            return;
        };
        match (&target.kind, &value.kind) {
            (_, CheckedExprKind::Table(entries)) if self.is_only_named(target) => {
                for (key, value) in entries {
                    match (&key.kind, &value.kind) {
                        (CheckedExprKind::Str(key), CheckedExprKind::Lambda(lambda)) => {
                            self.member(key, *lambda);
                        }
                        _ => self.expr(value),
                    }
                }
            }
            (CheckedExprKind::Field { object, key, .. }, CheckedExprKind::Lambda(lambda))
                if self.is_only_named(object) =>
            {
                self.member(key, *lambda);
            }
            (CheckedExprKind::Name(_), _) => self.expr(value),
            _ => {
                children(target, |child| self.expr(child));
                self.expr(value);
            }
        }
    }

    fn expr(&mut self, expr: &'a CheckedExpr) {
        match &expr.kind {
            CheckedExprKind::Name(name) => self.name(*name),
            CheckedExprKind::Lambda(lambda) => self.waiting.push(*lambda),
            CheckedExprKind::Field { key, .. } => {
                self.keys.insert(key);
                self.waiting.extend(self.members.remove(key.as_str()).into_iter().flatten());
            }
            _ => {}
        }
        children(expr, |child| self.expr(child));
    }

    /// Returns true if a table, and every table that it is in, is used only by the names of its fields.
    fn is_only_named(&self, table: &'a CheckedExpr) -> bool {
        let (Some(passed_on), Some((name, keys))) = (&self.passed_on, table_path(table)) else {
            return false;
        };
        let mut tables = (0..=keys.len()).map(|length| (name, keys[..length].to_vec()));
        !tables.any(|table| passed_on.contains(&table))
    }

    /// Handles a lambda in a field.
    fn member(&mut self, key: &'a str, lambda: FunctionId) {
        if self.keys.contains(key) {
            self.waiting.push(lambda);
        } else {
            self.members.entry(key).or_default().push(lambda);
        }
    }
}
