//! Finds sums that stop growing: a float of few bits stays the same when a small number is added.

use std::collections::{BTreeMap, BTreeSet};

use crate::ast::BinaryOp;
use crate::check::names::{Meaning, Meanings};
use crate::check::overflow::value;
use crate::check::reach;
use crate::check::tree::{
    CheckedBlock, CheckedBranch, CheckedExpr, CheckedExprKind, CheckedStmt, CheckedStmtKind,
    FunctionId, NameId, ResolvedScript, children, each_stmt,
};
use crate::codes::DiagnosticCode;
use crate::constant::{self, ConstantNumber};
use crate::diagnostic::Diagnostic;
use crate::profile::NumberProfile;
use crate::source::Span;

/// Checks the globals that only grow: each gets constants in the global code or in `init`, and in
/// functions that `step` calls its own value plus a constant. A condition that depends on the global
/// may bound it, and then nothing is reported.
pub fn check_stuck(
    program: &ResolvedScript,
    meanings: &Meanings<'_>,
    profile: NumberProfile,
) -> Vec<Diagnostic> {
    // With 24 bits a step of 0.1 has an effect for days.
    if profile != NumberProfile::Tiny {
        return Vec::new();
    }
    let init = program.find_name("init").map(|name| meanings.of(name));
    let of_step = reach::of_step(program);
    let mut sums = BTreeMap::new();
    for (number, function) in program.functions.iter().enumerate() {
        let id = FunctionId(number);
        let is_start = id == FunctionId::GLOBAL || init == Some(Meaning::Function(id));
        let is_step = !is_start && of_step.contains(&id);
        let mut visit = Visit { profile, is_start, is_step, sums: &mut sums, tested: Vec::new() };
        visit.stmts(&function.body);
    }
    let sums = sums.into_iter().filter_map(|(name, sum)| Some((name, sum?)));
    sums.filter_map(|(name, sum)| sum.diagnostic(&program.name(name).text, profile)).collect()
}

/// The assignments of a global that only grows.
#[derive(Default)]
struct Sum {
    has_start: bool,
    is_float: bool,
    steps: Vec<Step>,
}

/// An assignment that adds a constant.
#[derive(Clone, Copy)]
struct Step {
    span: Span,
    /// The constant as the profile has it.
    number: ConstantNumber,
    /// The constant as the script has it, which the profile may round.
    written: f64,
}

struct Visit<'a> {
    profile: NumberProfile,
    /// True in the global code and in `init`, which run once.
    is_start: bool,
    /// True in functions that run again and again.
    is_step: bool,
    /// `None` for a global with other assignments.
    sums: &'a mut BTreeMap<NameId, Option<Sum>>,
    /// The globals on which the code that is visited depends.
    tested: Vec<NameId>,
}

impl Visit<'_> {
    fn stmts(&mut self, stmts: &[CheckedStmt]) {
        let before = self.tested.len();
        for stmt in stmts {
            self.stmt(stmt);
            // The statements after a condition with a return depend on the condition, too.
            if let CheckedStmtKind::If { branches, otherwise } = &stmt.kind
                && branches.iter().map(|branch| &branch.then).chain([otherwise]).any(returns)
            {
                branches.iter().for_each(|branch| self.test(&branch.condition));
            }
        }
        self.tested.truncate(before);
    }

    fn stmt(&mut self, stmt: &CheckedStmt) {
        let before = self.tested.len();
        match &stmt.kind {
            CheckedStmtKind::Assign { target, value } => {
                if let CheckedExprKind::Name(name) = target.kind {
                    self.assign(name, value, stmt.span);
                }
            }
            CheckedStmtKind::If { branches, otherwise } => {
                for CheckedBranch { condition, then } in branches {
                    self.test(condition);
                    self.stmts(&then.stmts);
                }
                self.stmts(&otherwise.stmts);
            }
            CheckedStmtKind::While { condition, body, update } => {
                self.test(condition);
                self.stmts(&body.stmts);
                update.iter().for_each(|update| self.stmt(update));
            }
            CheckedStmtKind::Var { .. } | CheckedStmtKind::Return(_) | CheckedStmtKind::Call(_) => {
            }
        }
        self.tested.truncate(before);
    }

    fn test(&mut self, condition: &CheckedExpr) {
        if let CheckedExprKind::Name(name) = condition.kind {
            self.tested.push(name);
        }
        children(condition, |child| self.test(child));
    }

    fn assign(&mut self, name: NameId, assigned: &CheckedExpr, span: Span) {
        let profile = self.profile;
        let entry = self.sums.entry(name).or_insert_with(|| Some(Sum::default()));
        let Some(sum) = entry else { return };
        let is_bounded = self.tested.contains(&name);
        match (value(assigned, profile), step(assigned, name, profile, span)) {
            (Some(start), _) if self.is_start => {
                sum.has_start = true;
                sum.is_float |= matches!(start, ConstantNumber::Float(_));
            }
            (None, Some(step)) if self.is_step && !is_bounded => {
                sum.is_float |= matches!(step.number, ConstantNumber::Float(_));
                sum.steps.push(step);
            }
            _ => *entry = None,
        }
    }
}

/// Returns true if a block may return.
fn returns(block: &CheckedBlock) -> bool {
    let mut found = false;
    each_stmt(&block.stmts, &mut |stmt| found |= matches!(stmt.kind, CheckedStmtKind::Return(_)));
    found
}

/// Returns the constant that an assignment `name = name + constant` adds.
fn step(expr: &CheckedExpr, name: NameId, profile: NumberProfile, span: Span) -> Option<Step> {
    let CheckedExprKind::Chain { first, links } = &expr.kind else { return None };
    let [link] = links.as_slice() else { return None };
    let is_name = |expr: &CheckedExpr| matches!(expr.kind, CheckedExprKind::Name(n) if n == name);
    let (constant, is_taken) = match link.op {
        BinaryOp::Add if is_name(first) => (&link.right, false),
        BinaryOp::Add if is_name(&link.right) => (&**first, false),
        BinaryOp::Sub if is_name(first) => (&link.right, true),
        _ => return None,
    };
    let number = value(constant, profile)?;
    let written = match constant.kind {
        CheckedExprKind::Float(written) => written,
        _ => f64::from(to_f32(number)),
    };
    if !is_taken {
        return Some(Step { span, number, written });
    }
    let number = constant::arithmetic(profile, BinaryOp::Sub, ConstantNumber::Int(0), number)?;
    Some(Step { span, number, written: -written })
}

fn to_f32(number: ConstantNumber) -> f32 {
    match number {
        ConstantNumber::Int(value) => value as f32,
        ConstantNumber::Float(value) => value,
    }
}

impl Sum {
    fn diagnostic(&self, name: &str, profile: NumberProfile) -> Option<Diagnostic> {
        let size = |step: &Step| to_f32(step.number).abs();
        let signs: BTreeSet<bool> =
            self.steps.iter().map(|step| to_f32(step.number) < 0.0).collect();
        let is_sum = self.has_start && self.is_float && signs.len() == 1;
        // The sum stops where the greatest step has no effect.
        let Step { span, number, written } =
            self.steps.iter().copied().max_by(|a, b| size(a).total_cmp(&size(b)))?;
        let end = end(to_f32(number), profile).filter(|_| is_sum)?;
        let message =
            format!("`{name}` stops at {end}: adding {written} to it changes nothing there");
        Some(
            Diagnostic::new(DiagnosticCode::SumStops, span, message)
                .label(format!("the floats of the `{}` profile have 10 bits", profile.name()))
                .help(format!(
                    "count with an integer, and multiply where the sum is needed: `steps * {written}`"
                )),
        )
    }
}

/// Returns the first power of two, with the sign of the step, to which the step adds nothing; `None`
/// for a step of 0 or beyond the floats.
fn end(step: f32, profile: NumberProfile) -> Option<f32> {
    let added = ConstantNumber::Float(step.abs());
    let mut sum = step.abs();
    if step == 0.0 || !step.is_finite() {
        return None;
    }
    sum = sum.log2().ceil().exp2();
    while sum.is_finite() {
        let now = ConstantNumber::Float(sum);
        if constant::arithmetic(profile, BinaryOp::Add, now, added)? == now {
            return Some(sum.copysign(step));
        }
        sum *= 2.0;
    }
    None
}
