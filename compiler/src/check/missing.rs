//! Finds the functions that a script requires from its robot: it calls them, but neither the script
//! nor the language defines them.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::names::{Meaning, Meanings};
use super::resolve;
use super::robots::KnownRobots;
use super::tree::{CheckedExprKind, CheckedStmtKind, NameId, ResolvedScript, each_expr, each_stmt};
use crate::ast::Script;
use crate::profile::NumberProfile;
use crate::source::Span;

/// The functions and tables of a script that only a robot can provide.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Missing {
    /// Functions, in the order in which their names first appear.
    pub functions: Vec<MissingFunction>,
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
    /// The first call in the source.
    pub first_call: Span,
}

/// Finds the functions that a script calls and that only a robot can provide.
pub fn missing(script: &Script) -> Missing {
    let (program, _) = resolve::resolve(script);
    let robots = KnownRobots { target: None, known: &[] };
    let meanings = Meanings::new(&program, robots, NumberProfile::Full);
    let calls = calls(&program);
    let is_missing = |name: NameId| meanings.of(name) == Meaning::Nil;
    let names = program.names.iter().enumerate().map(|(number, name)| (NameId(number), name));
    let mut missing = Missing::default();
    for (id, name) in names.filter(|(id, _)| is_missing(*id)) {
        if name.text == "pos" {
            missing.has_position = true;
        }
        let Some(calls) = calls.get(&id) else { continue };
        let Some(first_call) = calls.iter().map(|call| call.span).min() else { continue };
        missing.functions.push(MissingFunction {
            name: name.text.clone(),
            counts: calls.iter().map(|call| call.count).collect(),
            is_result_used: calls.iter().any(|call| call.is_result_used),
            first_call,
        });
    }
    missing
}

/// A direct call of a name that is not a local.
struct DirectCall {
    count: usize,
    is_result_used: bool,
    span: Span,
}

fn calls(program: &ResolvedScript) -> HashMap<NameId, Vec<DirectCall>> {
    let mut calls: HashMap<NameId, Vec<DirectCall>> = HashMap::new();
    for function in &program.functions {
        let mut statements = HashSet::new();
        // The result of a call that is a statement is not used.
        each_stmt(&function.body, &mut |stmt| {
            if let CheckedStmtKind::Call(call) = &stmt.kind {
                statements.insert(call.span);
            }
        });
        each_expr(&function.body, &mut |expr| {
            let CheckedExprKind::Call { callee, args } = &expr.kind else { return };
            let CheckedExprKind::Name(name) = callee.kind else { return };
            calls.entry(name).or_default().push(DirectCall {
                count: args.len(),
                is_result_used: !statements.contains(&expr.span),
                span: expr.span,
            });
        });
    }
    calls
}
