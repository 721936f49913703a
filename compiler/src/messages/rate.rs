//! The rate of messages: the fewest steps from one execution of a call to the next.

use std::collections::{BTreeMap, BTreeSet};

use crate::ast::BinaryOp;
use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{
    CheckedBranch, CheckedExpr, CheckedExprKind, CheckedLink, CheckedStmt, CheckedStmtKind,
    FunctionId, NameId, ResolvedScript, assigned_values, children, each_stmt,
};
use crate::source::Span;

/// The rate at which the steps of a script reach a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Rate {
    /// The call runs at most once in this number of steps.
    pub period: u32,
    /// True if it runs that often, whatever the robot does.
    pub is_certain: bool,
}

/// Returns the rates of the calls that the steps reach, by the places of the calls. A call in a
/// loop, or in a function that the machine calls back, has no rate.
pub fn rates(
    program: &ResolvedScript,
    meanings: &Meanings<'_>,
) -> BTreeMap<(FunctionId, Span), Option<Rate>> {
    let mut assigned = BTreeMap::new();
    for function in &program.functions {
        assigned_values(&function.body, &mut assigned);
    }
    let mut walk = Walk {
        meanings,
        assigned,
        rates: BTreeMap::new(),
        visited: BTreeSet::new(),
        waiting: BTreeSet::new(),
    };
    let step = program.find_name("step").map(|step| meanings.of(step));
    if let Some(Meaning::Function(step)) = step {
        walk.function(step, Some(Rate { period: 1, is_certain: true }));
    }
    // The most frequent execution comes first, so that each function is followed once: a condition
    // makes no call more frequent. A recursion would be as deep as the calls of the script.
    while let Some((_, id, rate)) = walk.waiting.pop_first() {
        if walk.visited.insert(id) {
            walk.stmts(id, &program.function(id).body, rate);
        }
    }
    walk.rates
}

struct Walk<'a> {
    meanings: &'a Meanings<'a>,
    /// The values that the script assigns to each global.
    assigned: BTreeMap<NameId, Vec<&'a CheckedExpr>>,
    rates: BTreeMap<(FunctionId, Span), Option<Rate>>,
    visited: BTreeSet<FunctionId>,
    /// Functions that were reached, with the rank of their rate.
    waiting: BTreeSet<(Rank, FunctionId, Option<Rate>)>,
}

impl<'a> Walk<'a> {
    fn function(&mut self, id: FunctionId, rate: Option<Rate>) {
        if !self.visited.contains(&id) {
            self.waiting.insert((rank(rate), id, rate));
        }
    }

    /// Follows statements. Returns the rate of those after them in the same function.
    fn stmts(
        &mut self,
        function: FunctionId,
        stmts: &'a [CheckedStmt],
        mut rate: Option<Rate>,
    ) -> Option<Rate> {
        for stmt in stmts {
            match &stmt.kind {
                CheckedStmtKind::Var { value, .. } | CheckedStmtKind::Return(value) => {
                    value.iter().for_each(|value| self.expr(function, value, rate));
                }
                CheckedStmtKind::Assign { target, value } => {
                    self.expr(function, target, rate);
                    self.expr(function, value, rate);
                }
                CheckedStmtKind::If { branches, otherwise } => {
                    let mut tested = rate;
                    for CheckedBranch { condition, then } in branches {
                        self.expr(function, condition, tested);
                        self.stmts(function, &then.stmts, self.under(condition, tested));
                        tested = uncertain(tested);
                    }
                    self.stmts(function, &otherwise.stmts, tested);
                }
                CheckedStmtKind::While { condition, body, update } => {
                    self.expr(function, condition, None);
                    self.stmts(function, &body.stmts, None);
                    let update = update.as_deref().map_or(&[][..], std::slice::from_ref);
                    self.stmts(function, update, None);
                }
                CheckedStmtKind::Call(call) => self.expr(function, call, rate),
            }
            if may_return(stmt) {
                rate = uncertain(rate);
            }
        }
        rate
    }

    fn expr(&mut self, function: FunctionId, expr: &'a CheckedExpr, rate: Option<Rate>) {
        match &expr.kind {
            CheckedExprKind::Call { callee, args } => {
                let known = self.rates.entry((function, expr.span)).or_insert(rate);
                *known = std::cmp::min_by_key(*known, rate, |rate| rank(*rate));
                match self.meanings.function(callee) {
                    Some(called) => self.function(called, rate),
                    None => self.expr(function, callee, rate),
                }
                args.iter().for_each(|arg| self.expr(function, arg, rate));
            }
            CheckedExprKind::Lambda(lambda) => self.function(*lambda, None),
            // A function of the script that is used as a value may be called back.
            CheckedExprKind::Name(_) => {
                if let Some(called) = self.meanings.function(expr) {
                    self.function(called, None);
                }
            }
            CheckedExprKind::Chain { first, links }
                if links.iter().any(|link| link.op.is_logic()) =>
            {
                self.expr(function, first, rate);
                links.iter().for_each(|link| self.expr(function, &link.right, uncertain(rate)));
            }
            _ => children(expr, |child| self.expr(function, child, rate)),
        }
    }

    /// Returns the rate of a block that runs only if the condition is true.
    fn under(&self, condition: &CheckedExpr, rate: Option<Rate>) -> Option<Rate> {
        let rate = rate?;
        let slower = |period: u32| Rate { period: period.max(rate.period), ..rate };
        if let Some(period) = self.period_of(condition) {
            return Some(slower(period));
        }
        // All operands of a true `and` are true.
        let CheckedExprKind::Chain { first, links } = &condition.kind else {
            return uncertain(Some(rate));
        };
        let all_and = links.iter().all(|link| link.op == BinaryOp::And);
        let mut operands = std::iter::once(&**first).chain(links.iter().map(|link| &link.right));
        let period = operands.find_map(|operand| self.period_of(operand)).filter(|_| all_and);
        uncertain(Some(period.map_or(rate, slower)))
    }

    /// Returns N for a condition such as `ticks % N == 0`, where `ticks` grows by 1.
    fn period_of(&self, condition: &CheckedExpr) -> Option<u32> {
        let CheckedExprKind::Chain { first, links } = &condition.kind else { return None };
        let [CheckedLink { op: BinaryOp::Eq, right, .. }] = links.as_slice() else { return None };
        let remainder = self.constant(right)?;
        let CheckedExprKind::Chain { first: counter, links } = &first.kind else { return None };
        let [CheckedLink { op: BinaryOp::Mod, right, .. }] = links.as_slice() else {
            return None;
        };
        let period = self.constant(right)?;
        let is_counter = matches!(counter.kind, CheckedExprKind::Name(name) if self.counts(name));
        let is_reached = is_counter && (0..period).contains(&remainder);
        is_reached.then(|| u32::try_from(period).ok()).flatten()
    }

    /// Returns the value of an integer, or of a global that holds only one.
    fn constant(&self, expr: &CheckedExpr) -> Option<i64> {
        match expr.kind {
            CheckedExprKind::Int(number) => Some(number),
            CheckedExprKind::Name(name) => match self.assigned.get(&name)?.as_slice() {
                [CheckedExpr { kind: CheckedExprKind::Int(number), .. }] => Some(*number),
                _ => None,
            },
            _ => None,
        }
    }

    /// Returns true if the script adds 1 to a global.
    fn counts(&self, name: NameId) -> bool {
        let values = self.assigned.get(&name);
        values.is_some_and(|values| values.iter().any(|value| is_next(value, name)))
    }
}

/// Returns true for the expression `name + 1`.
fn is_next(value: &CheckedExpr, name: NameId) -> bool {
    let CheckedExprKind::Chain { first, links } = &value.kind else { return false };
    let [CheckedLink { op: BinaryOp::Add, right, .. }] = links.as_slice() else { return false };
    matches!(first.kind, CheckedExprKind::Name(known) if known == name)
        && matches!(right.kind, CheckedExprKind::Int(1))
}

/// A place in the order of rates.
type Rank = (u32, bool);

/// Returns the place of a rate, the most frequent one first: no bound, then the shorter period, then
/// the certain one.
fn rank(rate: Option<Rate>) -> Rank {
    rate.map_or((0, false), |rate| (rate.period, !rate.is_certain))
}

fn uncertain(rate: Option<Rate>) -> Option<Rate> {
    rate.map(|rate| Rate { is_certain: false, ..rate })
}

/// Returns true if the function may be left inside the statement.
fn may_return(stmt: &CheckedStmt) -> bool {
    let mut found = false;
    each_stmt(std::slice::from_ref(stmt), &mut |stmt| {
        found |= matches!(stmt.kind, CheckedStmtKind::Return(_));
    });
    found
}
