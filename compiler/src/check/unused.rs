//! Finds variables, parameters and functions that nothing uses, and assignments that have no
//! effect.

use std::collections::{BTreeMap, BTreeSet};

use crate::ast::UnaryOp;
use crate::check::entries::meant_entry;
use crate::check::names::{Meaning, Meanings, offered};
use crate::check::reach::has_entry;
use crate::check::tree::{
    CheckedBranch, CheckedExpr, CheckedExprKind, CheckedStmt, CheckedStmtKind, FunctionId, LocalId,
    LocalKind, NameId, ResolvedScript, children,
};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::image::ENTRIES;
use crate::source::{FileId, Span};

/// Checks a whole script. `callbacks` are functions that the script calls where it means the functions
/// themselves, so that their parameters are not their author's choice.
pub fn check_unused(
    program: &ResolvedScript,
    meanings: &Meanings<'_>,
    callbacks: &BTreeSet<FunctionId>,
) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut uses = Uses {
        function: FunctionId::GLOBAL,
        locals: BTreeSet::new(),
        self_assignments: Vec::new(),
        assigned: BTreeMap::new(),
    };
    for (number, function) in program.functions.iter().enumerate() {
        uses.function = FunctionId(number);
        uses.stmts(&function.body);
        if let Some(creator) = function.creator {
            uses.locals.extend(function.captures.iter().map(|capture| (creator, *capture)));
        }
    }
    for (number, function) in program.functions.iter().enumerate() {
        let id = FunctionId(number);
        let is_called_by_name =
            !callbacks.contains(&id) && is_called_by_name(program, meanings, id);
        for (number, local) in function.locals.iter().enumerate() {
            let is_used = uses.locals.contains(&(id, LocalId(number)));
            // Only the main script is checked, because included files may be shared. A name with a
            // leading `_` is unused on purpose.
            if is_used || local.name.starts_with('_') || local.span.file != FileId::default() {
                continue;
            }
            match local.kind {
                LocalKind::Variable => diagnostics.push(unused_variable(&local.name, local.span)),
                LocalKind::Parameter(_) if is_called_by_name => {
                    diagnostics.push(unused_parameter(&local.name, local.span));
                }
                LocalKind::Parameter(_) | LocalKind::Captured { .. } => {}
            }
        }
    }
    diagnostics.extend(unused_functions(program));
    diagnostics.extend(uses.self_assignments.iter().copied().map(self_assignment));
    diagnostics.extend(only_own_values(program, meanings, &uses));
    diagnostics
}

/// Returns true for a function whose callers are all known, so that its parameters are its author's
/// choice.
fn is_called_by_name(program: &ResolvedScript, meanings: &Meanings<'_>, id: FunctionId) -> bool {
    let name = program.function(id).name.as_deref().and_then(|name| program.find_name(name));
    name.is_some_and(|name| {
        let uses = program.name(name);
        meanings.of(name) == Meaning::Function(id)
            && uses.reads.is_empty()
            && !uses.calls.is_empty()
    })
}

fn unused_variable(name: &str, span: Span) -> Diagnostic {
    Diagnostic::new(
        DiagnosticCode::UnusedVariable,
        span,
        format!("nothing reads the variable `{name}`"),
    )
    .label("never read")
    .help(format!("remove it, or call it `_{name}` if it is there on purpose"))
}

fn unused_parameter(name: &str, span: Span) -> Diagnostic {
    Diagnostic::new(
        DiagnosticCode::UnusedParameter,
        span,
        format!("nothing reads the parameter `{name}`"),
    )
    .label("never read")
    .help(format!(
        "remove it here and in the calls, or call it `_{name}` if it is there on purpose"
    ))
}

/// Returns warnings about functions of the main script that nothing mentions. A file without an
/// entry point is a library or a first trial and gets no warning.
fn unused_functions(program: &ResolvedScript) -> Vec<Diagnostic> {
    if !has_entry(program) {
        return Vec::new();
    }
    let unused = program.names.iter().filter(|name| {
        let is_entry = ENTRIES.contains(&name.text.as_str());
        let is_mentioned =
            !name.reads.is_empty() || !name.calls.is_empty() || !name.writes.is_empty();
        !is_entry
            && !is_mentioned
            && !name.text.starts_with('_')
            && meant_entry(program, name).is_none()
    });
    let definition = unused.filter_map(|name| Some((&name.text, name.definitions.last()?.1)));
    definition
        .filter(|(_, span)| span.file == FileId::default())
        .map(|(name, span)| {
            Diagnostic::new(DiagnosticCode::UnusedFunction, span, format!("nothing calls `{name}`"))
                .label("never runs")
                .help(format!(
                    "call it or remove it, or call it `_{name}` if it is there on purpose"
                ))
        })
        .collect()
}

fn self_assignment(span: Span) -> Diagnostic {
    Diagnostic::new(DiagnosticCode::SelfAssignment, span, "this variable is assigned to itself")
        .label("changes nothing")
        .help("remove the statement, or assign what was meant")
}

/// Finds globals whose every assignment needs their previous value, so that they never get a first
/// value.
fn only_own_values(
    program: &ResolvedScript,
    meanings: &Meanings<'_>,
    uses: &Uses,
) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for (id, values) in &uses.assigned {
        let name = program.name(*id);
        let machine = offered(meanings.robots(), meanings.profile(), &name.text);
        let is_own = !values.is_empty() && values.iter().all(|value| value.is_some());
        if !is_own || !name.definitions.is_empty() || machine != Meaning::Nil {
            continue;
        }
        let Some(first) = values.iter().flatten().min() else { continue };
        let diagnostic = Diagnostic::new(
            DiagnosticCode::OnlyOwnValue,
            *first,
            format!("`{}` is nil here: nothing gives it a first value", name.text),
        )
        .label("stops the script");
        diagnostics.push(match similar(program, &name.text) {
            Some(other) => diagnostic.help(format!("did you mean `{other}`?")).guess(*first, other),
            None => {
                diagnostic.help(format!("assign it before, such as `{} = 0` in `init`", name.text))
            }
        });
    }
    diagnostics
}

/// Returns another name that the script assigns and that differs in capital letters only.
fn similar<'a>(program: &'a ResolvedScript, name: &str) -> Option<&'a str> {
    let others = program.names.iter().filter(|other| !other.writes.is_empty());
    let mut others = others.map(|other| other.text.as_str());
    others.find(|other| *other != name && other.eq_ignore_ascii_case(name))
}

/// The uses of variables.
struct Uses {
    function: FunctionId,
    locals: BTreeSet<(FunctionId, LocalId)>,
    self_assignments: Vec<Span>,
    /// For each assignment of a global, the place where the new value needs the previous one.
    /// Assignments of nil and of the variable itself give no value and are left out.
    assigned: BTreeMap<NameId, Vec<Option<Span>>>,
}

impl Uses {
    fn stmts(&mut self, stmts: &[CheckedStmt]) {
        for stmt in stmts {
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &CheckedStmt) {
        match &stmt.kind {
            CheckedStmtKind::Var { value, .. } | CheckedStmtKind::Return(value) => {
                value.iter().for_each(|value| self.expr(value));
            }
            CheckedStmtKind::Assign { target, value } => self.assign(target, value, stmt.span),
            CheckedStmtKind::If { branches, otherwise } => {
                for CheckedBranch { condition, then } in branches {
                    self.expr(condition);
                    self.stmts(&then.stmts);
                }
                self.stmts(&otherwise.stmts);
            }
            CheckedStmtKind::While { condition, body, update } => {
                self.expr(condition);
                self.stmts(&body.stmts);
                update.iter().for_each(|update| self.stmt(update));
            }
            CheckedStmtKind::Call(call) => self.expr(call),
        }
    }

    fn assign(&mut self, target: &CheckedExpr, value: &CheckedExpr, span: Span) {
        match (&target.kind, &value.kind) {
            (CheckedExprKind::Name(to), CheckedExprKind::Name(from)) if to == from => {
                self.self_assignments.push(span);
            }
            (CheckedExprKind::Local(to), CheckedExprKind::Local(from)) if to == from => {
                self.self_assignments.push(span);
            }
            (CheckedExprKind::Name(_), CheckedExprKind::Nil) => {}
            (CheckedExprKind::Name(name), _) => {
                self.assigned.entry(*name).or_default().push(needed(value, *name));
            }
            (CheckedExprKind::Local(_), _) => {}
            _ => self.expr(target),
        }
        self.expr(value);
    }

    fn expr(&mut self, expr: &CheckedExpr) {
        if let CheckedExprKind::Local(local) = expr.kind {
            self.locals.insert((self.function, local));
        }
        children(expr, |child| self.expr(child));
    }
}

/// Returns the place where an expression computes with the value of a global, so that nil stops the
/// script.
fn needed(expr: &CheckedExpr, name: NameId) -> Option<Span> {
    let operand = |operand: &CheckedExpr| match operand.kind {
        CheckedExprKind::Name(used) if used == name => Some(operand.span),
        _ => needed(operand, name),
    };
    match &expr.kind {
        CheckedExprKind::Chain { first, links } => {
            let computed = links.iter().all(|link| link.op.is_arithmetic() || link.op.is_bitwise());
            let mut operands =
                std::iter::once(&**first).chain(links.iter().map(|link| &link.right));
            if computed { operands.find_map(operand) } else { None }
        }
        CheckedExprKind::Unary { op: UnaryOp::Negate | UnaryOp::BitNot, operand: value } => {
            operand(value)
        }
        _ => None,
    }
}
