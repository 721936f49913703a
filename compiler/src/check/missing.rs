//! Finds the functions and the values in tables that a script requires from its robot: it uses them,
//! but neither the script nor the language defines them.

mod fields;
mod texts;

use std::collections::{BTreeSet, HashMap, HashSet};

use super::names::{Meaning, Meanings};
use super::resolve;
use super::robots::KnownRobots;
use super::tree::{
    CheckedExpr, CheckedExprKind, CheckedFunction, CheckedStmtKind, NameId, ResolvedScript,
    each_expr, each_stmt,
};
use crate::ast::Script;
use crate::profile::NumberProfile;
use crate::source::Span;
use fields::Fields;

/// The functions, values and tables of a script that only a robot can provide.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Missing {
    /// Functions, in the order in which their names first appear; those in tables come last.
    pub functions: Vec<MissingFunction>,
    /// Values in tables, such as `pose.position.x` and `proximity[].value`, in the order of their
    /// paths.
    pub values: Vec<MissingValue>,
    /// True if the script uses the table `pos`.
    pub has_position: bool,
}

/// A function that a script calls and that only a robot can provide.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissingFunction {
    pub name: String,
    /// The numbers of arguments that are passed in calls.
    pub counts: BTreeSet<usize>,
    /// True if the script uses the result of a call.
    pub is_result_used: bool,
    /// True if the script uses the result of a call as a text.
    pub is_text: bool,
    /// The first call in the source.
    pub first_call: Span,
}

/// A value in a table that a script reads and that only a robot can provide.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissingValue {
    /// Its path in a robot file.
    pub path: String,
    /// The first use in the source.
    pub first_use: Span,
}

/// Finds the functions and values that a script uses and that only a robot can provide.
pub fn missing(script: &Script) -> Missing {
    let (program, _) = resolve::resolve(script);
    let robots = KnownRobots { target: None, known: &[] };
    let meanings = Meanings::new(&program, robots, NumberProfile::Full);
    let fields = Fields::find(&program, &meanings);
    let calls = calls(&program);
    let texts = texts::texts(&program, &meanings);
    let is_missing = |name: NameId| meanings.of(name) == Meaning::Nil;
    let names = program.names.iter().enumerate().map(|(number, name)| (NameId(number), name));
    let mut missing = Missing::default();
    for (id, name) in names.filter(|(id, _)| is_missing(*id)) {
        if name.text == "pos" {
            missing.has_position = true;
        }
        let function = calls.get(&id).and_then(|calls| missing_function(&name.text, calls, &texts));
        missing.functions.extend(function);
    }
    let in_tables = fields.calls.iter();
    let in_tables = in_tables.filter_map(|(path, calls)| missing_function(path, calls, &texts));
    missing.functions.extend(in_tables);
    missing.values = fields.values(&missing.functions);
    missing
}

/// `texts` are the places of calls whose results are texts.
fn missing_function(
    name: &str,
    calls: &[DirectCall],
    texts: &HashSet<Span>,
) -> Option<MissingFunction> {
    Some(MissingFunction {
        name: name.to_owned(),
        counts: calls.iter().map(|call| call.count).collect(),
        is_result_used: calls.iter().any(|call| call.is_result_used),
        is_text: calls.iter().any(|call| texts.contains(&call.span)),
        first_call: calls.iter().map(|call| call.span).min()?,
    })
}

/// A direct call of a name that is not a local, or of a field in its table.
struct DirectCall {
    count: usize,
    is_result_used: bool,
    span: Span,
}

impl DirectCall {
    fn new(call: &CheckedExpr, args: &[CheckedExpr], statements: &HashSet<Span>) -> Self {
        let (count, span) = (args.len(), call.span);
        DirectCall { count, is_result_used: !statements.contains(&span), span }
    }
}

/// Returns the places of the calls whose results are not used, because they are statements.
fn statements(function: &CheckedFunction) -> HashSet<Span> {
    let mut statements = HashSet::new();
    each_stmt(&function.body, &mut |stmt| {
        if let CheckedStmtKind::Call(call) = &stmt.kind {
            statements.insert(call.span);
        }
    });
    statements
}

fn calls(program: &ResolvedScript) -> HashMap<NameId, Vec<DirectCall>> {
    let mut calls: HashMap<NameId, Vec<DirectCall>> = HashMap::new();
    for function in &program.functions {
        let statements = statements(function);
        each_expr(&function.body, &mut |expr| {
            let CheckedExprKind::Call { callee, args } = &expr.kind else { return };
            let CheckedExprKind::Name(name) = callee.kind else { return };
            calls.entry(name).or_default().push(DirectCall::new(expr, args, &statements));
        });
    }
    calls
}
