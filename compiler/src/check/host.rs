//! Tables that the robot fills for the script in every step, such as `pose` and `proximity`, and
//! functions that stand in tables, such as `debug.print`.
//!
//! The machine knows no such table. The compiler adds statements that fill them: at the beginning of
//! the global code, and in a function that runs before each `step`. They call the robot function of
//! each value. As on other hosts, the tables are new in every step, so that a script can keep an old
//! one. A call of `debug.print` is a call of the robot function of that name.
//!
//! A function of the script that is called from outside, such as by an event of a scenario, is called
//! there, too: a global of the compiler's own says that it is due.
//!
//! A name that the script itself defines or assigns is the script's own and is not filled. A key that
//! the script does not name is left out, and the function comes after all others: strings and
//! functions keep the numbers that they have on robots without these tables, to which the script may
//! send them.

use std::collections::{BTreeMap, BTreeSet};

use bittybuzz_robot_spec::{Robot, SignatureType, ValueConstant, ValueKey, ValueSource, table_of};
use bittybuzz_vm_core::builtin::{self, Library};

use crate::check::names::{Meaning, offered};
use crate::check::outside::{OutsideUses, called_flag};
use crate::check::robots::KnownRobots;
use crate::check::suggest::{self, Advice};
use crate::check::tree::{
    CheckedBlock, CheckedBranch, CheckedExpr, CheckedExprKind, CheckedFunction, CheckedStmt,
    CheckedStmtKind, FunctionId, HostNode, HostTables, NameId, ResolvedScript, children, each_expr,
    each_expr_mut, each_stmt,
};
use crate::diagnostic::Diagnostic;
use crate::profile::NumberProfile;
use crate::source::Span;
use crate::strings::own_number;

/// The name of the function that runs in place of `step`; no script can have it.
const BEFORE_STEP: &str = "before step";

impl HostNode {
    fn table() -> Self {
        HostNode::Table { entries: BTreeMap::new(), elements: 0 }
    }

    fn any(&self, is_it: &dyn Fn(&HostNode) -> bool) -> bool {
        match self {
            HostNode::Table { entries, .. } => entries.values().any(|entry| entry.any(is_it)),
            leaf => is_it(leaf),
        }
    }

    fn has_functions(&self) -> bool {
        self.any(&|leaf| matches!(leaf, HostNode::Function(_)))
    }

    fn changes(&self) -> bool {
        self.any(&|leaf| matches!(leaf, HostNode::Value(_)))
    }

    /// Adds what `keys` lead to. What another robot has there already stays.
    fn add(&mut self, keys: &[ValueKey], count: u32, leaf: HostNode) {
        let HostNode::Table { entries, elements } = self else { return };
        let Some((key, rest)) = keys.split_first() else { return };
        if *key == ValueKey::Elements {
            *elements = count.max(*elements);
        }
        let entry = entries.entry(key.clone());
        if rest.is_empty() {
            entry.or_insert(leaf);
        } else {
            entry.or_insert_with(HostNode::table).add(rest, count, leaf);
        }
    }
}

/// A field of a table that the robot fills.
pub struct HostField<'a> {
    /// The table, as in `pose.position`.
    pub table: String,
    /// The names of all its fields.
    pub known: Vec<&'a str>,
}

impl HostField<'_> {
    /// Adds the most similar field, or all of them, to a diagnostic about a field at `span`.
    pub fn advise(&self, key: &str, diagnostic: Diagnostic, span: Span) -> Diagnostic {
        match suggest::nearest(key, self.known.iter().copied()) {
            Some(near) => Advice::likely(near).give(diagnostic, span),
            None => diagnostic.help(format!("`{}` has {}", self.table, self.known.join(", "))),
        }
    }
}

impl HostTables {
    /// Returns the table of a field that no robot has; `None` if the object is no table that the robot
    /// fills, if the field exists, or if the script may have put it there.
    pub fn unknown_field<'a>(
        &'a self,
        program: &ResolvedScript,
        object: &CheckedExpr,
        key: &str,
    ) -> Option<HostField<'a>> {
        let (root, path, node) = self.find(program, object)?;
        let HostNode::Table { entries, .. } = node else { return None };
        let is_list = entries.contains_key(&ValueKey::Elements);
        let is_known = entries.contains_key(&ValueKey::Field(key.to_owned()));
        if is_list || is_known || !self.read_only.contains(&root) {
            return None;
        }
        let known = entries.keys().filter_map(|key| match key {
            ValueKey::Field(name) => Some(name.as_str()),
            ValueKey::Elements => None,
        });
        Some(HostField { table: path, known: known.collect() })
    }

    fn find(
        &self,
        program: &ResolvedScript,
        expr: &CheckedExpr,
    ) -> Option<(NameId, String, &HostNode)> {
        match &expr.kind {
            CheckedExprKind::Name(name) => {
                Some((*name, program.name(*name).text.clone(), self.tables.get(name)?))
            }
            CheckedExprKind::Field { object, key, .. } => {
                let (root, path, node) = self.find(program, object)?;
                let HostNode::Table { entries, .. } = node else { return None };
                let node = entries.get(&ValueKey::Field(key.clone()))?;
                Some((root, format!("{path}.{key}"), node))
            }
            _ => None,
        }
    }
}

/// Adds the tables of the robots to a script that uses them, and the calls of its functions from
/// outside.
pub fn furnish(
    program: &mut ResolvedScript,
    robots: KnownRobots<'_>,
    profile: NumberProfile,
    outside: &OutsideUses,
) {
    for name in &outside.assigned {
        // A name that the script only reads is a variable then. Others are variables already, or
        // belong to the language or the robot.
        if let Some(id) = program.find_name(name)
            && program.name(id).definitions.is_empty()
            && offered(robots, profile, name) == Meaning::Nil
        {
            let name = &mut program.names[id.0];
            let place = name.reads.first().copied();
            name.writes.extend(place);
        }
    }
    make_texts(program, robots, profile);
    let filled = fill(program, robots);
    let called = outside.called.iter().filter_map(|name| called(program, name)).collect();
    program.host.step = step(program, filled, called);
}

/// Returns the statement that calls a function of the script if its flag is set; `None` if the script
/// has no such function.
fn called(program: &mut ResolvedScript, function: &str) -> Option<CheckedStmt> {
    let id = program.find_name(function)?;
    let name = &mut program.names[id.0];
    let definition = name.definitions.last().map(|(_, span)| *span);
    let span = definition.or(name.writes.first().copied())?;
    name.calls.push(span);
    let flag = program.intern(&called_flag(function));
    let uses = &mut program.names[flag.0];
    uses.reads.push(span);
    uses.writes.push(span);
    let at = |name| expr(CheckedExprKind::Name(name));
    let (target, value) = (at(flag), expr(CheckedExprKind::Nil));
    let call = CheckedExprKind::Call { callee: Box::new(at(id)), args: Vec::new() };
    let assign = stmt(CheckedStmtKind::Assign { target, value });
    Some(under(at(flag), vec![assign, stmt(CheckedStmtKind::Call(expr(call)))]))
}

/// Fills the tables of the robots that the script uses in the global code, and returns the statements
/// that fill them before each step.
fn fill(program: &mut ResolvedScript, robots: KnownRobots<'_>) -> Vec<CheckedStmt> {
    let roots = roots(program, robots);
    if roots.is_empty() {
        return Vec::new();
    }
    let mut tables = tables(program, robots, &roots);
    call_directly(program, &tables);
    // The others were only called.
    tables.retain(|root, _| !program.name(*root).reads.is_empty());
    let read_only = read_only(program, &tables);
    let keys = mentioned(program);
    let mut filling = Filling { program, keys, statements: Vec::new() };
    let mut first = Vec::new();
    for (root, table) in &tables {
        let value = filling.value(table, None);
        first.push(filling.assign(*root, &[], value));
        filling.refresh(*root, &mut Vec::new(), table);
    }
    let statements = filling.statements;
    if let Some(global) = program.functions.first_mut() {
        global.body.splice(..0, first);
    }
    program.host = HostTables { tables, read_only, step: None };
    statements
}

/// Returns the names of tables of the robots that the script uses and does not define itself.
fn roots(program: &ResolvedScript, robots: KnownRobots<'_>) -> BTreeSet<NameId> {
    let names = robots.targets().flat_map(names_in_tables);
    let roots = names.filter_map(|name| {
        let root = program.find_name(table_of(name))?;
        let used = program.name(root);
        let is_own = !used.definitions.is_empty() || !used.writes.is_empty();
        let is_used = !used.reads.is_empty() || !used.calls.is_empty();
        (is_used && !is_own && robots.functions(&used.text).is_empty()).then_some(root)
    });
    roots.collect()
}

/// Returns the names of a robot's functions and values that stand in tables.
fn names_in_tables(robot: &Robot) -> impl Iterator<Item = &str> {
    let functions = robot.functions.iter().map(|function| function.name.as_str());
    let values = robot.values.iter().map(|value| value.path.text());
    functions.chain(values).filter(|name| table_of(name) != *name)
}

fn tables(
    program: &mut ResolvedScript,
    robots: KnownRobots<'_>,
    roots: &BTreeSet<NameId>,
) -> BTreeMap<NameId, HostNode> {
    let mut tables: BTreeMap<NameId, HostNode> = BTreeMap::new();
    for robot in robots.targets() {
        for value in &robot.values {
            let Some(root) = program.find_name(value.path.table()) else { continue };
            if !roots.contains(&root) {
                continue;
            }
            let leaf = match &value.source {
                ValueSource::Constant(all) => HostNode::Constant(all.clone()),
                ValueSource::Reading(_) => HostNode::Value(program.intern(value.path.text())),
            };
            let table = tables.entry(root).or_insert_with(HostNode::table);
            table.add(value.path.keys(), value.elements.unwrap_or(0), leaf);
        }
        let functions = robot.functions.iter().filter(|function| !function.is_reader());
        for function in functions {
            let Some((root, keys)) = function.name.split_once('.') else { continue };
            let Some(root) = program.find_name(root).filter(|root| roots.contains(root)) else {
                continue;
            };
            let leaf = HostNode::Function(program.intern(&function.name));
            let keys: Vec<ValueKey> =
                keys.split('.').map(|key| ValueKey::Field(key.to_owned())).collect();
            tables.entry(root).or_insert_with(HostNode::table).add(&keys, 0, leaf);
        }
    }
    tables
}

/// Makes calls of functions in tables, such as `debug.print(1)`, calls of the robot functions.
fn call_directly(program: &mut ResolvedScript, tables: &BTreeMap<NameId, HostNode>) {
    let host = HostTables { tables: tables.clone(), ..HostTables::default() };
    let mut functions = std::mem::take(&mut program.functions);
    for function in &mut functions {
        each_expr_mut(&mut function.body, &mut |expr| {
            let CheckedExprKind::Call { callee, .. } = &mut expr.kind else { return };
            let Some((root, _, HostNode::Function(function))) = host.find(program, callee) else {
                return;
            };
            let table = start_of(callee);
            program.names[root.0].reads.retain(|read| *read != table);
            program.names[function.0].calls.push(callee.span);
            callee.kind = CheckedExprKind::Name(*function);
        });
    }
    program.functions = functions;
}

/// Returns the place of the name that a path of fields begins with.
fn start_of(expr: &CheckedExpr) -> Span {
    match &expr.kind {
        CheckedExprKind::Field { object, .. } => start_of(object),
        _ => expr.span,
    }
}

/// Returns the tables of which the script only reads fields by their names.
fn read_only(program: &ResolvedScript, tables: &BTreeMap<NameId, HostNode>) -> BTreeSet<NameId> {
    let mut read_only: BTreeSet<NameId> = tables.keys().copied().collect();
    for function in &program.functions {
        each_expr(&function.body, &mut |expr| {
            if matches!(expr.kind, CheckedExprKind::Field { .. }) {
                return;
            }
            children(expr, |child| {
                if let CheckedExprKind::Name(name) = child.kind {
                    read_only.remove(&name);
                }
            });
        });
        each_stmt(&function.body, &mut |stmt| {
            let values: Vec<&CheckedExpr> = match &stmt.kind {
                CheckedStmtKind::Var { value, .. } | CheckedStmtKind::Return(value) => {
                    value.iter().collect()
                }
                CheckedStmtKind::Assign { target, value } => vec![target, value],
                _ => Vec::new(),
            };
            for value in values {
                let is_target = matches!(&stmt.kind, CheckedStmtKind::Assign { target, .. } if std::ptr::eq(target, value));
                let root = match (&value.kind, is_target) {
                    (CheckedExprKind::Name(name), false) => Some(*name),
                    (_, true) => root_of(value),
                    _ => None,
                };
                if let Some(root) = root {
                    read_only.remove(&root);
                }
            }
        });
    }
    read_only
}

/// Returns the name that a path of fields and elements begins with.
fn root_of(expr: &CheckedExpr) -> Option<NameId> {
    match &expr.kind {
        CheckedExprKind::Name(name) => Some(*name),
        CheckedExprKind::Field { object, .. } | CheckedExprKind::Index { object, .. } => {
            root_of(object)
        }
        _ => None,
    }
}

/// Returns the keys that the script can use: names of fields, and texts.
fn mentioned(program: &ResolvedScript) -> BTreeSet<String> {
    let mut keys = BTreeSet::new();
    for function in &program.functions {
        each_stmt(&function.body, &mut |stmt| {
            if let CheckedStmtKind::Assign { target, .. } = &stmt.kind
                && let CheckedExprKind::Field { key, .. } = &target.kind
            {
                keys.insert(key.clone());
            }
        });
        each_expr(&function.body, &mut |expr| match &expr.kind {
            CheckedExprKind::Field { key, .. } | CheckedExprKind::Str(key) => {
                keys.insert(key.clone());
            }
            CheckedExprKind::Table(entries) => {
                keys.extend(entries.iter().filter_map(|(key, _)| match &key.kind {
                    CheckedExprKind::Str(key) => Some(key.clone()),
                    _ => None,
                }));
            }
            _ => {}
        });
    }
    keys
}

/// The statements that fill tables.
struct Filling<'a> {
    program: &'a mut ResolvedScript,
    /// The keys that the script can use.
    keys: BTreeSet<String>,
    statements: Vec<CheckedStmt>,
}

impl Filling<'_> {
    /// Adds the statements that fill a table anew before each step. Functions stay where they are.
    fn refresh(&mut self, root: NameId, path: &mut Vec<String>, node: &HostNode) {
        if !node.changes() {
            return;
        }
        if let (HostNode::Table { entries, .. }, true) = (node, node.has_functions()) {
            for (key, entry) in entries {
                let ValueKey::Field(key) = key else { continue };
                if self.is_usable(key) {
                    path.push(key.clone());
                    self.refresh(root, path, entry);
                    path.pop();
                }
            }
            return;
        }
        let value = self.value(node, None);
        let statement = self.assign(root, path, value);
        self.statements.push(statement);
    }

    /// Returns true for a key whose text is in the image.
    fn is_usable(&self, key: &str) -> bool {
        self.keys.contains(key) || own_number(key).is_some()
    }

    fn value(&mut self, node: &HostNode, element: Option<u32>) -> CheckedExpr {
        expr(match node {
            HostNode::Constant(all) => {
                let place = element.map_or(0, |element| element as usize);
                match all.get(place).or(all.first()) {
                    Some(ValueConstant::Int(value)) => CheckedExprKind::Int((*value).into()),
                    Some(ValueConstant::Float(value)) => CheckedExprKind::Float(*value),
                    None => CheckedExprKind::Nil,
                }
            }
            HostNode::Value(function) => {
                let args = element.map(|element| expr(CheckedExprKind::Int(element.into())));
                self.call(*function, args.into_iter().collect())
            }
            HostNode::Function(function) => {
                self.program.names[function.0].reads.push(Span::default());
                CheckedExprKind::Name(*function)
            }
            HostNode::Table { entries, elements } => {
                let mut fields = Vec::new();
                for (key, entry) in entries {
                    match key {
                        ValueKey::Field(key) if !self.is_usable(key) => {}
                        ValueKey::Field(key) => {
                            let key = expr(CheckedExprKind::Str(key.clone()));
                            fields.push((key, self.value(entry, element)));
                        }
                        ValueKey::Elements => {
                            for number in 0..*elements {
                                let key = expr(CheckedExprKind::Int(number.into()));
                                fields.push((key, self.value(entry, Some(number))));
                            }
                        }
                    }
                }
                CheckedExprKind::Table(fields)
            }
        })
    }

    fn call(&mut self, function: NameId, args: Vec<CheckedExpr>) -> CheckedExprKind {
        self.program.names[function.0].calls.push(Span::default());
        CheckedExprKind::Call { callee: Box::new(expr(CheckedExprKind::Name(function))), args }
    }

    fn assign(&mut self, root: NameId, path: &[String], value: CheckedExpr) -> CheckedStmt {
        let name = &mut self.program.names[root.0];
        let span = name.reads.first().copied().unwrap_or_default();
        let uses = if path.is_empty() { &mut name.writes } else { &mut name.reads };
        uses.push(span);
        let target = path.iter().fold(expr(CheckedExprKind::Name(root)), |object, key| {
            let object = Box::new(object);
            let key_span = Span::default();
            expr(CheckedExprKind::Field { object, key: key.clone(), key_span })
        });
        stmt(CheckedStmtKind::Assign { target, value })
    }
}

/// Adds the function that runs in place of `step`; `None` if it would do nothing else. Nothing is filled
/// if the script has no steps.
fn step(
    program: &mut ResolvedScript,
    filled: Vec<CheckedStmt>,
    called: Vec<CheckedStmt>,
) -> Option<FunctionId> {
    if filled.is_empty() && called.is_empty() {
        return None;
    }
    let (mut body, mut span) = (called, Span::default());
    if let Some((name, place)) = own_step(program) {
        span = place;
        body.splice(..0, filled);
        let uses = &mut program.names[name.0];
        uses.reads.push(place);
        uses.calls.push(place);
        let at = || expr(CheckedExprKind::Name(name));
        let call = CheckedExprKind::Call { callee: Box::new(at()), args: Vec::new() };
        // A variable may hold nil.
        body.push(under(at(), vec![stmt(CheckedStmtKind::Call(expr(call)))]));
    } else if body.is_empty() {
        return None;
    }
    let id = FunctionId(program.functions.len());
    let name = Some(BEFORE_STEP.to_owned());
    program.functions.push(CheckedFunction { name, span, body, ..CheckedFunction::default() });
    Some(id)
}

/// Makes the results of robot functions that return text empty texts. Only robots without firmware
/// have such functions, none of which gives a text yet, and a robot function returns numbers only.
fn make_texts(program: &mut ResolvedScript, robots: KnownRobots<'_>, profile: NumberProfile) {
    let gives_text = |name: &str| {
        let functions = robots.functions(name);
        !functions.is_empty()
            && functions.iter().all(|known| known.returns == Some(SignatureType::String))
    };
    let texts: BTreeSet<NameId> = (0..program.names.len())
        .map(NameId)
        .filter(|id| gives_text(&program.name(*id).text))
        .collect();
    if texts.is_empty() || profile != NumberProfile::Full {
        return;
    }
    let library = Library::String.global_name().expect("the library of strings has a name");
    let kind = builtin::info(builtin::TYPE).expect("the number is from the table").name;
    let [library, kind] = [library, kind].map(|name| program.intern(name));
    let is_own = |id: NameId| {
        let name = program.name(id);
        !name.definitions.is_empty() || !name.writes.is_empty()
    };
    if is_own(library) || is_own(kind) {
        return;
    }
    let mut functions = std::mem::take(&mut program.functions);
    for function in &mut functions {
        each_expr_mut(&mut function.body, &mut |inner| {
            let CheckedExprKind::Call { callee, .. } = &inner.kind else { return };
            let CheckedExprKind::Name(name) = callee.kind else { return };
            if !texts.contains(&name) {
                return;
            }
            let span = inner.span;
            let at = |kind| CheckedExpr { kind, span };
            let call = std::mem::replace(inner, at(CheckedExprKind::Nil));
            let callee = Box::new(at(CheckedExprKind::Name(kind)));
            let text = at(CheckedExprKind::Call { callee, args: vec![call] });
            let object = Box::new(at(CheckedExprKind::Name(library)));
            let key = builtin::info(builtin::SUB).expect("the number is from the table").name;
            let callee = at(CheckedExprKind::Field { object, key: key.to_owned(), key_span: span });
            let zero = || at(CheckedExprKind::Int(0));
            let args = vec![text, zero(), zero()];
            *inner = at(CheckedExprKind::Call { callee: Box::new(callee), args });
            program.names[kind.0].calls.push(span);
            program.names[library.0].reads.push(span);
        });
    }
    program.functions = functions;
}

/// Returns the name of the script's steps and its place, if the script has any.
fn own_step(program: &ResolvedScript) -> Option<(NameId, Span)> {
    let id = program.find_name("step")?;
    let name = program.name(id);
    let definition = name.definitions.last().map(|(_, span)| *span);
    Some((id, definition.or(name.writes.first().copied())?))
}

/// Returns `if(condition) { statements }`.
fn under(condition: CheckedExpr, stmts: Vec<CheckedStmt>) -> CheckedStmt {
    let then = CheckedBlock { stmts, span: Span::default() };
    let branches = vec![CheckedBranch { condition, then }];
    stmt(CheckedStmtKind::If { branches, otherwise: CheckedBlock::default() })
}

fn expr(kind: CheckedExprKind) -> CheckedExpr {
    CheckedExpr { kind, span: Span::default() }
}

fn stmt(kind: CheckedStmtKind) -> CheckedStmt {
    CheckedStmt { kind, span: Span::default() }
}
