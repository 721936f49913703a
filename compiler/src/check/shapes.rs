//! Types of variables to which the script assigns values of one type only, and the keys that its
//! tables may have.

use std::collections::{BTreeMap, BTreeSet};

use bittybuzz_vm_core::builtin;

use crate::check::names::{Meaning, Meanings};
use crate::check::static_type::{StaticType, kind_of};
use crate::check::suggest::{self, Advice};
use crate::check::tree::{
    CheckedExpr, CheckedExprKind, CheckedStmtKind, FunctionId, LocalId, LocalKind, NameId,
    ResolvedScript, each_expr, each_stmt,
};

/// A variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Variable {
    Global(NameId),
    Local(FunctionId, LocalId),
}

/// The types and keys of a script.
pub struct Shapes<'a> {
    /// The types of variables that hold values of one type only, or nil.
    kinds: BTreeMap<Variable, StaticType>,
    /// Those of them that hold a library or the table of something else.
    others: BTreeSet<Variable>,
    /// The keys that some table may have: those that the script writes, and all of its texts. `None` if
    /// the script makes texts, which may be keys.
    keys: Option<BTreeSet<&'a str>>,
    /// Lambdas that stand in fields, which are called as methods.
    methods: BTreeSet<FunctionId>,
}

impl<'a> Shapes<'a> {
    pub fn new(program: &'a ResolvedScript, meanings: &Meanings<'_>) -> Self {
        let mut kinds: BTreeMap<Variable, Option<StaticType>> = BTreeMap::new();
        let mut others = BTreeSet::new();
        for (id, function) in (0..).map(FunctionId).zip(&program.functions) {
            each_stmt(&function.body, &mut |stmt| {
                let (variable, value) = match &stmt.kind {
                    CheckedStmtKind::Var { local, value: Some(value) } => {
                        (Some(Variable::Local(id, *local)), value)
                    }
                    CheckedStmtKind::Assign { target, value } => (variable(target, id), value),
                    _ => return,
                };
                let Some(variable) = variable else { return };
                let is_variable = match variable {
                    Variable::Global(name) => {
                        meanings.of(name) == Meaning::Global
                            && program.name(name).definitions.is_empty()
                    }
                    Variable::Local(_, local) => function.local(local).kind == LocalKind::Variable,
                };
                if !is_variable || matches!(value.kind, CheckedExprKind::Nil) {
                    return;
                }
                if !matches!(value.kind, CheckedExprKind::Table(_)) {
                    others.insert(variable);
                }
                let kind = kind_of(value, meanings);
                let known = kinds.entry(variable).or_insert(kind);
                *known = match (*known, kind) {
                    (Some(one), Some(other)) if one == other => Some(one),
                    (Some(one), Some(other)) if one.is_number() && other.is_number() => {
                        Some(StaticType::Number)
                    }
                    _ => None,
                };
            });
        }
        let kinds = kinds.into_iter().filter_map(|(variable, kind)| Some((variable, kind?)));
        let makes_texts = program.find_name("string").is_some();
        let keys = (!makes_texts).then(|| keys(program));
        Shapes { kinds: kinds.collect(), others, keys, methods: methods(program) }
    }

    /// Returns true for a name in a method that may be meant as a field of its table.
    pub fn is_field_of_self(&self, name: &str, function: FunctionId) -> bool {
        self.methods.contains(&function)
            && self.keys.as_ref().is_some_and(|keys| keys.contains(name))
    }

    /// Returns the type of an expression in a function, if it is known and the value is not nil.
    pub fn kind(
        &self,
        expr: &CheckedExpr,
        function: FunctionId,
        meanings: &Meanings<'_>,
    ) -> Option<StaticType> {
        kind_of(expr, meanings).or_else(|| self.kinds.get(&variable(expr, function)?).copied())
    }

    /// Returns advice about a field that no table of the script has; `None` if the object may be
    /// something else, or if some table may have such a field.
    pub fn missing_field(
        &self,
        object: &CheckedExpr,
        key: &str,
        function: FunctionId,
    ) -> Option<MissingField<'a>> {
        let variable = variable(object, function)?;
        let kind = self.kinds.get(&variable).filter(|_| !self.others.contains(&variable))?;
        let keys = self.keys.as_ref()?;
        if *kind != StaticType::Table || keys.contains(key) || builtin::STRINGS.contains(&key) {
            return None;
        }
        Some(MissingField { near: suggest::nearest(key, keys.iter().copied()) })
    }
}

/// A field that no table of a script has.
pub struct MissingField<'a> {
    near: Option<&'a str>,
}

impl MissingField<'_> {
    /// Returns advice about the field. `table` is the source of its table.
    pub fn advice(&self, key: &str, table: &str) -> Option<Advice> {
        let help = match key {
            "length" | "len" | "size" | "count" | "n" => {
                format!("the number of entries of a table is `size({table})`")
            }
            "append" | "push" | "add" | "insert" | "push_back" => {
                format!(
                    "an entry at the end of a list is added by `{table}[size({table})] = value`"
                )
            }
            "remove" | "pop" | "delete" | "erase" => {
                format!("an entry is removed by `{table}[key] = nil`")
            }
            "contains" | "has" | "exists" => format!("an entry exists if `{table}[key] != nil`"),
            "keys" | "values" | "items" | "foreach" | "forEach" | "map" | "filter" => {
                format!(
                    "all entries are visited by `foreach({table}, function(key, value) {{ ... }})`"
                )
            }
            _ => return self.near.map(Advice::likely),
        };
        Some(Advice::words(help))
    }
}

fn variable(expr: &CheckedExpr, function: FunctionId) -> Option<Variable> {
    match expr.kind {
        CheckedExprKind::Name(name) => Some(Variable::Global(name)),
        CheckedExprKind::Local(local) => Some(Variable::Local(function, local)),
        _ => None,
    }
}

fn methods(program: &ResolvedScript) -> BTreeSet<FunctionId> {
    let mut methods = BTreeSet::new();
    let lambda = |value: &CheckedExpr| match value.kind {
        CheckedExprKind::Lambda(function) => Some(function),
        _ => None,
    };
    for function in &program.functions {
        each_stmt(&function.body, &mut |stmt| {
            if let CheckedStmtKind::Assign { target, value } = &stmt.kind
                && matches!(target.kind, CheckedExprKind::Field { .. })
            {
                methods.extend(lambda(value));
            }
        });
        each_expr(&function.body, &mut |expr| {
            if let CheckedExprKind::Table(entries) = &expr.kind {
                methods.extend(entries.iter().filter_map(|(_, value)| lambda(value)));
            }
        });
    }
    methods
}

/// Returns the keys that the script writes, and all of its texts.
fn keys(program: &ResolvedScript) -> BTreeSet<&str> {
    let mut keys = BTreeSet::new();
    for function in &program.functions {
        each_stmt(&function.body, &mut |stmt| {
            if let CheckedStmtKind::Assign { target, .. } = &stmt.kind
                && let CheckedExprKind::Field { key, .. } = &target.kind
            {
                keys.insert(key.as_str());
            }
        });
        each_expr(&function.body, &mut |expr| match &expr.kind {
            CheckedExprKind::Str(text) => {
                keys.insert(text.as_str());
            }
            CheckedExprKind::Table(entries) => {
                keys.extend(entries.iter().filter_map(|(key, _)| match &key.kind {
                    CheckedExprKind::Str(key) => Some(key.as_str()),
                    _ => None,
                }));
            }
            _ => {}
        });
    }
    keys
}
