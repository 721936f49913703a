//! Checks callbacks: compares the parameters of functions that built-ins call with the arguments
//! that they pass.

use std::collections::BTreeSet;

use bittybuzz_vm_core::builtin::{self, BuiltinInfo, Library};

use crate::check::calls::counted;
use crate::check::names::Meanings;
use crate::check::suggest::{self, Advice};
use crate::check::tree::{
    CheckedExpr, CheckedExprKind, CheckedStmt, CheckedStmtKind, FunctionId, LocalId,
    ResolvedScript, each_expr, each_stmt,
};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::Span;

/// The value that a callback gets for a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    /// The topic of a message, a string.
    Topic,
    /// A key, which is a number or a string.
    Key,
    /// The number (`id`) of a robot.
    Id,
    /// The table with the position of a neighbor.
    Data,
    /// Any value.
    Value,
}

impl Role {
    fn name(self) -> &'static str {
        match self {
            Role::Topic => "the topic, a string",
            Role::Key => "the key, a number or a string",
            Role::Id => "the number of a robot",
            Role::Data => "the neighbor's data, a table",
            Role::Value => "the value",
        }
    }

    fn is_number(self) -> bool {
        !matches!(self, Role::Topic | Role::Data)
    }

    fn is_table(self) -> bool {
        matches!(self, Role::Data | Role::Value)
    }
}

/// Returns the position of the callback among the arguments, and the roles of its parameters.
fn roles(info: &BuiltinInfo) -> Option<(usize, &'static [Role])> {
    use Role::{Data, Id, Key, Topic, Value};
    Some(match info.number {
        builtin::FOREACH | builtin::MAP | builtin::FILTER => (1, &[Key, Value]),
        builtin::REDUCE => (1, &[Key, Value, Value]),
        builtin::NEIGHBORS_FOREACH | builtin::NEIGHBORS_MAP | builtin::NEIGHBORS_FILTER => {
            (0, &[Id, Data])
        }
        builtin::NEIGHBORS_REDUCE => (0, &[Id, Data, Value]),
        builtin::NEIGHBORS_LISTEN => (1, &[Topic, Value, Id]),
        builtin::SNAPSHOT_FOREACH | builtin::SNAPSHOT_MAP | builtin::SNAPSHOT_FILTER => {
            (0, &[Id, Value])
        }
        builtin::SNAPSHOT_REDUCE => (0, &[Id, Value, Value]),
        builtin::STIGMERGY_FOREACH | builtin::STIGMERGY_MAP => (0, &[Key, Value, Id]),
        builtin::STIGMERGY_REDUCE => (0, &[Key, Value, Id, Value]),
        builtin::STIGMERGY_ONCONFLICT => (0, &[Key, Value, Value]),
        builtin::STIGMERGY_ONCONFLICTLOST => (0, &[Key, Value]),
        builtin::SWARM_EXEC => (0, &[]),
        _ => return None,
    })
}

/// Parameter names that suggest a value. No callback gets a value as its first argument.
const VALUE_NAMES: [&str; 6] = ["value", "val", "v", "data", "msg", "message"];
/// Parameter names that suggest a key or the number of a robot.
const KEY_NAMES: [&str; 6] = ["key", "k", "id", "rid", "topic", "robot_id"];
/// The fields of a neighbor's data.
const NEIGHBOR_FIELDS: [&str; 3] = ["distance", "azimuth", "elevation"];

/// What is found about callbacks.
pub struct Callbacks {
    pub diagnostics: Vec<Diagnostic>,
    /// Functions that are called where they are meant as callbacks.
    pub called: BTreeSet<FunctionId>,
}

/// Checks every callback of a script.
pub fn check_callbacks(program: &ResolvedScript, meanings: &Meanings<'_>) -> Callbacks {
    let mut checker = CallbackChecker {
        program,
        meanings,
        fields: written_fields(program),
        known: BTreeSet::new(),
        called: BTreeSet::new(),
        diagnostics: Vec::new(),
    };
    for function in &program.functions {
        each_expr(&function.body, &mut |expr| {
            if let CheckedExprKind::Call { callee, args } = &expr.kind {
                checker.call(callee, args);
            }
            if let CheckedExprKind::Field { object, key, key_span } = &expr.kind
                && checker.is_data_of_get(object)
            {
                checker.field(key, *key_span);
            }
        });
    }
    Callbacks { diagnostics: checker.diagnostics, called: checker.called }
}

/// Returns the names of all fields that the script writes, in any table.
fn written_fields(program: &ResolvedScript) -> BTreeSet<&str> {
    let mut fields = BTreeSet::new();
    for function in &program.functions {
        each_stmt(&function.body, &mut |stmt| {
            if let CheckedStmtKind::Assign { target, .. } = &stmt.kind
                && let CheckedExprKind::Field { key, .. } = &target.kind
            {
                fields.insert(key.as_str());
            }
        });
        each_expr(&function.body, &mut |expr| {
            if let CheckedExprKind::Table(entries) = &expr.kind {
                fields.extend(entries.iter().filter_map(|(key, _)| match &key.kind {
                    CheckedExprKind::Str(key) => Some(key.as_str()),
                    _ => None,
                }));
            }
        });
    }
    fields
}

struct CallbackChecker<'a> {
    program: &'a ResolvedScript,
    meanings: &'a Meanings<'a>,
    /// The names of the fields that the script itself writes.
    fields: BTreeSet<&'a str>,
    /// Pairs of a callback and a built-in that were already checked.
    known: BTreeSet<(FunctionId, u8)>,
    /// Functions that are called where they are meant as callbacks.
    called: BTreeSet<FunctionId>,
    diagnostics: Vec<Diagnostic>,
}

impl CallbackChecker<'_> {
    fn call(&mut self, callee: &CheckedExpr, args: &[CheckedExpr]) {
        let Some(info) = self.meanings.built_in(callee) else { return };
        let Some((at, mut roles)) = roles(info) else { return };
        // `kin()`, `nonkin()` and filters keep the data of neighbors unchanged.
        if info.library == Library::Snapshot && self.is_of_neighbors(callee) {
            roles = match roles.len() {
                2 => &[Role::Id, Role::Data],
                _ => &[Role::Id, Role::Data, Role::Value],
            };
        }
        let Some(arg) = args.get(at) else { return };
        self.check_for_call(arg, info);
        let Some(function) = self.meanings.function(arg) else { return };
        if self.known.insert((function, info.number)) {
            self.callback(function, info, roles, arg.span);
        }
    }

    /// Reports a call of a script function that returns nothing in place of a callback.
    fn check_for_call(&mut self, arg: &CheckedExpr, info: &BuiltinInfo) {
        let CheckedExprKind::Call { callee, args } = &arg.kind else { return };
        let Some(function) = self.meanings.function(callee) else { return };
        let CheckedExprKind::Name(name) = callee.kind else { return };
        let mut has_result = false;
        each_stmt(&self.program.function(function).body, &mut |stmt| {
            has_result |= matches!(stmt.kind, CheckedStmtKind::Return(Some(_)));
        });
        if has_result {
            return;
        }
        self.called.insert(function);
        let name = &self.program.name(name).text;
        let message = format!(
            "`{}` needs a function here, and this call of `{name}` gives nil",
            suggest::path(info)
        );
        let diagnostic = Diagnostic::new(DiagnosticCode::BuiltinArgumentType, arg.span, message)
            .label("called at once, only here")
            .help(format!("pass the function itself, without arguments: `{name}`"));
        let has_arguments = !args.is_empty();
        let rest = Span { start: callee.span.end, ..arg.span };
        self.diagnostics.push(match has_arguments {
            true => diagnostic.guess(rest, ""),
            false => diagnostic.edit(rest, ""),
        });
    }

    /// Returns true if the callee is a method of a snapshot that holds the data of neighbors
    /// unchanged.
    fn is_of_neighbors(&self, callee: &CheckedExpr) -> bool {
        let CheckedExprKind::Field { object, .. } = &callee.kind else { return false };
        let CheckedExprKind::Call { callee, .. } = &object.kind else { return false };
        match self.meanings.built_in(callee).map(|info| info.number) {
            Some(
                builtin::NEIGHBORS_KIN | builtin::NEIGHBORS_NONKIN | builtin::NEIGHBORS_FILTER,
            ) => true,
            Some(builtin::SNAPSHOT_FILTER) => self.is_of_neighbors(callee),
            _ => false,
        }
    }

    fn is_data_of_get(&self, object: &CheckedExpr) -> bool {
        let CheckedExprKind::Call { callee, .. } = &object.kind else { return false };
        self.meanings.built_in(callee).is_some_and(|info| info.number == builtin::NEIGHBORS_GET)
    }

    fn callback(&mut self, id: FunctionId, info: &BuiltinInfo, roles: &[Role], call: Span) {
        let function = self.program.function(id);
        let path = suggest::path(info);
        if let Some(excess) =
            function.locals.get(roles.len()).filter(|_| function.parameters > roles.len())
        {
            self.diagnostics.push(
                Diagnostic::new(
                    DiagnosticCode::CallbackParameters,
                    excess.span,
                    format!(
                        "`{path}` passes {} to this function",
                        counted(roles.len(), "argument")
                    ),
                )
                .label(format!("`{}` gets nothing, and reading it stops the script", excess.name))
                .related(call, "called back from here")
                .help(info.help),
            );
        }
        let body = &function.body;
        for (number, (local, role)) in
            function.locals.iter().zip(roles).take(function.parameters).enumerate()
        {
            let id = LocalId(number);
            if is_assigned(body, id) {
                continue;
            }
            let wrong = wrong_use(body, id, *role);
            if let Some(wrong) = wrong {
                self.meaning(info, &local.name, local.span, *role, call, Some(wrong));
            } else if number == 0
                && is_misnamed(
                    function
                        .locals
                        .get(1)
                        .filter(|_| function.parameters > 1)
                        .map(|next| next.name.as_str()),
                    &local.name,
                )
                && is_read(body, id)
            {
                self.meaning(info, &local.name, local.span, *role, call, None);
            }
            if *role == Role::Data {
                each_expr(body, &mut |expr| {
                    if let CheckedExprKind::Field { object, key, key_span } = &expr.kind
                        && is_local(object, id)
                    {
                        self.field(key, *key_span);
                    }
                });
            }
        }
    }

    fn meaning(
        &mut self,
        info: &BuiltinInfo,
        name: &str,
        span: Span,
        role: Role,
        call: Span,
        wrong: Option<(Span, &str)>,
    ) {
        let mut diagnostic = Diagnostic::new(
            DiagnosticCode::CallbackMeaning,
            span,
            format!("`{name}` gets {}", role.name()),
        )
        .label(format!("called back by `{}`", suggest::path(info)))
        .help(info.help);
        if let Some((place, what)) = wrong {
            diagnostic = diagnostic.related(place, what);
        } else {
            diagnostic = diagnostic.related(call, "called back from here");
        }
        self.diagnostics.push(diagnostic);
    }

    /// Checks a field of a neighbor's data that is read.
    fn field(&mut self, key: &str, span: Span) {
        if NEIGHBOR_FIELDS.contains(&key) || self.fields.contains(key) {
            return;
        }
        let mut diagnostic = Diagnostic::new(
            DiagnosticCode::UnknownNeighborField,
            span,
            format!("the data of a neighbor has no `{key}`: it is nil"),
        )
        .label("always nil");
        let meant = match key {
            "range" | "dist" | "length" => Some("distance"),
            "angle" | "bearing" | "direction" | "heading" | "theta" => Some("azimuth"),
            _ => suggest::nearest(key, NEIGHBOR_FIELDS),
        };
        diagnostic = match meant {
            Some(likely) => Advice::likely(likely).give(diagnostic, span),
            None => {
                diagnostic.help("it has `distance` in mm, `azimuth` and `elevation` in radians")
            }
        };
        self.diagnostics.push(diagnostic);
    }
}

/// Returns true if the name of the first parameter suggests a value. The parameter must be the only
/// one, or the name of the next one must suggest a key.
fn is_misnamed(next: Option<&str>, name: &str) -> bool {
    let is_in = |names: &[&str], name: &str| names.contains(&name.to_ascii_lowercase().as_str());
    is_in(&VALUE_NAMES, name) && next.is_none_or(|next| is_in(&KEY_NAMES, next))
}

fn is_local(expr: &CheckedExpr, id: LocalId) -> bool {
    matches!(expr.kind, CheckedExprKind::Local(local) if local == id)
}

fn is_read(body: &[CheckedStmt], id: LocalId) -> bool {
    let mut found = false;
    each_expr(body, &mut |expr| found |= is_local(expr, id));
    found
}

fn is_assigned(body: &[CheckedStmt], id: LocalId) -> bool {
    let mut found = false;
    each_stmt(body, &mut |stmt| {
        found |=
            matches!(&stmt.kind, CheckedStmtKind::Assign { target, .. } if is_local(target, id));
    });
    found
}

/// Returns the first use of a parameter that stops the script, and its description.
fn wrong_use(body: &[CheckedStmt], id: LocalId, role: Role) -> Option<(Span, &'static str)> {
    let mut found = None;
    each_expr(body, &mut |expr| {
        let wrong = match &expr.kind {
            CheckedExprKind::Field { object, .. } | CheckedExprKind::Index { object, .. }
                if !role.is_table() && is_local(object, id) =>
            {
                Some("here it is used as a table")
            }
            CheckedExprKind::Chain { first, links }
                if !role.is_number()
                    && links.iter().all(|link| link.op.is_arithmetic())
                    && (is_local(first, id)
                        || links.iter().any(|link| is_local(&link.right, id))) =>
            {
                Some("here it is used as a number")
            }
            CheckedExprKind::Call { callee, .. } if role != Role::Value && is_local(callee, id) => {
                Some("here it is called")
            }
            _ => None,
        };
        if let (None, Some(wrong)) = (found, wrong) {
            found = Some((expr.span, wrong));
        }
    });
    found
}
