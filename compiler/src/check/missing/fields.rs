//! Finds the fields of tables that only a robot can provide: values and functions.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use bittybuzz_vm_core::builtin;

use super::texts::{Holder, holder};
use super::{DirectCall, MissingFunction, MissingValue, statements};
use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{
    CheckedExpr, CheckedExprKind, CheckedStmtKind, FunctionId, LocalId, LocalKind, NameId,
    ResolvedScript, children, each_expr, each_stmt,
};
use crate::source::Span;

/// The fields of tables that only a robot can provide.
pub struct Fields<'a> {
    program: &'a ResolvedScript,
    meanings: &'a Meanings<'a>,
    /// Paths with the place of the first use.
    uses: BTreeMap<String, Span>,
    /// Calls of functions in tables, by path.
    pub calls: BTreeMap<String, Vec<DirectCall>>,
    /// The function that is being visited.
    function: FunctionId,
    /// Variables that hold tables of the robot, such as the `beam` of `var beam = proximity[0]`.
    held: HashMap<Holder, String>,
}

impl<'a> Fields<'a> {
    pub fn find(program: &'a ResolvedScript, meanings: &'a Meanings<'a>) -> Self {
        let mut fields = Fields {
            program,
            meanings,
            uses: BTreeMap::new(),
            calls: BTreeMap::new(),
            function: FunctionId::GLOBAL,
            held: HashMap::new(),
        };
        fields.find_held();
        for (id, function) in (0..).map(FunctionId).zip(&program.functions) {
            fields.function = id;
            let statements = statements(function);
            each_stmt(&function.body, &mut |stmt| {
                let mut visit = |expr: &'a CheckedExpr| fields.expr(expr, &statements);
                match &stmt.kind {
                    CheckedStmtKind::Var { value, .. } | CheckedStmtKind::Return(value) => {
                        value.iter().for_each(&mut visit);
                    }
                    CheckedStmtKind::Assign { target, value } => {
                        visit(target);
                        visit(value);
                    }
                    CheckedStmtKind::If { branches, .. } => {
                        branches.iter().for_each(|branch| visit(&branch.condition));
                    }
                    CheckedStmtKind::While { condition, .. } => visit(condition),
                    CheckedStmtKind::Call(call) => visit(call),
                }
            });
        }
        fields
    }

    /// Finds the variables that hold tables of the robot.
    fn find_held(&mut self) {
        for (id, function) in (0..).map(FunctionId).zip(&self.program.functions) {
            self.function = id;
            each_stmt(&function.body, &mut |stmt| {
                let (variable, value) = match &stmt.kind {
                    CheckedStmtKind::Var { local, value: Some(value) } => {
                        (Some(Holder::Local(id, *local)), value)
                    }
                    CheckedStmtKind::Assign { target, value } => (holder(id, target), value),
                    _ => return,
                };
                let is_table = !matches!(value.kind, CheckedExprKind::Call { .. });
                if let (Some(variable), Some(path)) =
                    (variable, self.path(value).filter(|_| is_table))
                {
                    self.held.insert(variable, path);
                }
            });
        }
    }

    /// Visits an expression, and those in it that are not the table of a field.
    fn expr(&mut self, expr: &'a CheckedExpr, statements: &HashSet<Span>) {
        match &expr.kind {
            CheckedExprKind::Field { .. } | CheckedExprKind::Index { .. } => {
                if let Some(path) = self.path(expr) {
                    self.note(path, expr.span);
                }
                self.indexes(expr, statements);
            }
            CheckedExprKind::Call { callee, args } => {
                match self.path(callee).filter(|_| !matches!(callee.kind, CheckedExprKind::Name(_)))
                {
                    // A function in a list has no name in a robot file.
                    Some(path) if path.contains('[') => {}
                    Some(path) => {
                        let call = DirectCall::new(expr, args, statements);
                        self.calls.entry(path).or_default().push(call);
                    }
                    None => self.expr(callee, statements),
                }
                if let (CheckedExprKind::Name(name), [table, function, ..]) =
                    (&callee.kind, args.as_slice())
                {
                    self.iteration(*name, table, function);
                }
                args.iter().for_each(|arg| self.expr(arg, statements));
            }
            _ => children(expr, |child| self.expr(child, statements)),
        }
    }

    /// Visits the keys between brackets, and the table that a path begins with if it is not a name.
    fn indexes(&mut self, expr: &'a CheckedExpr, statements: &HashSet<Span>) {
        match &expr.kind {
            CheckedExprKind::Field { object, .. } => self.indexes(object, statements),
            CheckedExprKind::Index { object, index } => {
                self.indexes(object, statements);
                self.expr(index, statements);
            }
            _ => self.expr(expr, statements),
        }
    }

    /// Handles `foreach(table, function)` and the like: each element is a value, or a table with the
    /// fields that the function reads of its second parameter.
    fn iteration(&mut self, name: NameId, table: &CheckedExpr, function: &CheckedExpr) {
        let iterates = [builtin::FOREACH, builtin::MAP, builtin::FILTER, builtin::REDUCE];
        let is_iteration =
            iterates.iter().any(|it| self.meanings.of(name) == Meaning::Builtin(*it));
        let Some(path) = self.path(table).filter(|_| is_iteration) else { return };
        let id = match &function.kind {
            CheckedExprKind::Lambda(id) => Some(*id),
            CheckedExprKind::Name(name) => match self.meanings.of(*name) {
                Meaning::Function(id) => Some(id),
                _ => None,
            },
            _ => None,
        };
        let fields = id.map_or(BTreeSet::new(), |id| fields_of_element(self.program, id));
        let list = format!("{path}[]");
        if fields.is_empty() {
            self.note(list, table.span);
        } else {
            fields.iter().for_each(|field| self.note(format!("{list}.{field}"), table.span));
        }
    }

    fn note(&mut self, path: String, span: Span) {
        let first = self.uses.entry(path).or_insert(span);
        *first = (*first).min(span);
    }

    /// Returns the path of a name that nothing defines and of fields in its table.
    fn path(&self, expr: &CheckedExpr) -> Option<String> {
        let held = || self.held.get(&holder(self.function, expr)?).cloned();
        match &expr.kind {
            CheckedExprKind::Local(_) => held(),
            CheckedExprKind::Name(name) => {
                let text = &self.program.name(*name).text;
                let is_missing = self.meanings.of(*name) == Meaning::Nil;
                match is_missing && text != "pos" && text != "io" {
                    true => Some(text.clone()),
                    false => held(),
                }
            }
            CheckedExprKind::Field { object, key, .. } => {
                self.path(object).map(|table| format!("{table}.{key}"))
            }
            CheckedExprKind::Index { object, .. } => {
                self.path(object).map(|table| format!("{table}[]"))
            }
            _ => None,
        }
    }

    /// Returns the values: the paths that are not tables with other paths in them. What is called is a
    /// function, and nothing stands in it.
    pub fn values(&self, functions: &[MissingFunction]) -> Vec<MissingValue> {
        let called: Vec<&String> = functions.iter().map(|function| &function.name).collect();
        let paths = self.uses.iter().filter(|(path, _)| {
            let leads_on = |other: &&String| {
                let rest = other.strip_prefix(path.as_str());
                rest.is_some_and(|rest| rest.starts_with(['.', '[']))
            };
            let is_table = self.uses.keys().chain(self.calls.keys()).any(|other| leads_on(&other));
            let is_in_function = called.iter().any(|function| {
                let rest = path.strip_prefix(function.as_str());
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
            });
            !is_table && !is_in_function && path.matches("[]").count() <= 1
        });
        paths.map(|(path, span)| MissingValue { path: path.clone(), first_use: *span }).collect()
    }
}

/// Returns the fields that a function reads of its second parameter.
fn fields_of_element(program: &ResolvedScript, id: FunctionId) -> BTreeSet<String> {
    let function = program.function(id);
    let is_element = |local: LocalId| function.local(local).kind == LocalKind::Parameter(1);
    let mut fields = BTreeSet::new();
    each_expr(&function.body, &mut |expr| {
        if let CheckedExprKind::Field { object, key, .. } = &expr.kind
            && matches!(object.kind, CheckedExprKind::Local(local) if is_element(local))
        {
            fields.insert(key.clone());
        }
    });
    fields
}
