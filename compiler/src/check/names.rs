//! The meaning of every name of a script: a constant function, a variable, or a name that the
//! machine or the robot provides.
//!
//! The whole program is known. A function that is never reassigned therefore needs no variable, and
//! the members of a library that the script does not modify are known where they are called.

use std::collections::{BTreeMap, BTreeSet};

use bittybuzz_vm_core::builtin::{self, Library};

use crate::ast::UnaryOp;
use crate::check::robots::KnownRobots;
use crate::check::tree::{
    CheckedBlock, CheckedExpr, CheckedExprKind, CheckedStmt, CheckedStmtKind, FreeName, FunctionId,
    NameId, ResolvedScript, assigned_values, children,
};
use crate::profile::NumberProfile;

/// The meaning of a name that is not a local.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meaning {
    /// Nothing defines the name, so its value is nil.
    Nil,
    /// A script function that is never assigned.
    Function(FunctionId),
    /// A global variable.
    Global,
    /// A built-in function, by its number.
    Builtin(u8),
    /// A library.
    Library(Library),
    /// A function of the robot.
    Robot,
    /// `id`
    RobotId,
}

/// The meaning of a library's field.
#[derive(Debug, Clone, Copy)]
pub enum LibraryMember {
    /// Always this built-in.
    Known(&'static builtin::BuiltinInfo),
    /// Always nil.
    Absent,
    /// The script may change it.
    Changing,
}

/// The meaning of every name of a program.
#[derive(Debug, Clone)]
pub struct Meanings<'a> {
    robots: KnownRobots<'a>,
    profile: NumberProfile,
    names: Vec<Meaning>,
    /// Libraries that the script uses as values, so that their members may be read anywhere.
    escaped: BTreeSet<Library>,
    /// Those of them whose members may be changed anywhere: `log` and the like only look at a library.
    changing: BTreeSet<Library>,
    /// Fields that the script assigns.
    assigned: BTreeSet<(Library, String)>,
    /// For every function, true if its self is always nil.
    self_is_nil: Vec<bool>,
    /// Globals that hold only objects of one library, or nil.
    objects: BTreeMap<NameId, Library>,
}

/// Returns the meaning of a name that the machine or the robot provides.
pub fn offered(robots: KnownRobots<'_>, profile: NumberProfile, name: &str) -> Meaning {
    if name == "id" {
        return Meaning::RobotId;
    }
    // Other hosts of Buzz provide `log` under the name `print`, too. A robot's own function `print`
    // has precedence.
    let global = if name == "print" && robots.functions(name).is_empty() { "log" } else { name };
    if let Some(info) = builtin::find(Library::Global, global) {
        return Meaning::Builtin(info.number);
    }
    let library = Library::ALL.into_iter().find(|library| library.global_name() == Some(name));
    match library {
        Some(Library::Position) if !robots.has_table(name) => {}
        // Strings are made at run time in the full profile only.
        Some(Library::String) if profile == NumberProfile::Tiny => return Meaning::Nil,
        Some(library) => return Meaning::Library(library),
        None => {}
    }
    if robots.functions(name).is_empty() { Meaning::Nil } else { Meaning::Robot }
}

impl<'a> Meanings<'a> {
    /// Finds the meaning of every name.
    pub fn new(program: &ResolvedScript, robots: KnownRobots<'a>, profile: NumberProfile) -> Self {
        let names: Vec<Meaning> =
            program.names.iter().map(|name| meaning(robots, profile, name)).collect();
        let mut meanings = Meanings {
            robots,
            profile,
            names,
            escaped: BTreeSet::new(),
            changing: BTreeSet::new(),
            assigned: BTreeSet::new(),
            self_is_nil: Vec::new(),
            objects: BTreeMap::new(),
        };
        // The scan runs twice, because the first pass finds out if the script assigns `math.rng`,
        // and only the second pass knows if `math.rng` is the library.
        for _ in 0..2 {
            let mut scan = LibraryScan {
                meanings: &meanings,
                position: program.find_name("pos"),
                escaped: program.names.iter().filter_map(first_library).collect(),
                changing: program.names.iter().filter_map(first_library).collect(),
                assigned: BTreeSet::new(),
            };
            for function in &program.functions {
                scan.stmts(&function.body);
            }
            let LibraryScan { escaped, changing, assigned, .. } = scan;
            meanings.escaped = escaped;
            meanings.changing = changing;
            meanings.assigned = assigned;
            let is_assigned = meanings.is_assigned(Library::Math, "rng");
            for set in [&mut meanings.escaped, &mut meanings.changing] {
                if set.contains(&Library::Math) || is_assigned {
                    set.insert(Library::Rng);
                }
            }
        }
        meanings.self_is_nil = program
            .functions
            .iter()
            .enumerate()
            .map(|(number, function)| match &function.name {
                Some(name) => program.find_name(name).is_some_and(|id| {
                    meanings.of(id) == Meaning::Function(FunctionId(number))
                        && program.name(id).reads.is_empty()
                }),
                None => number == FunctionId::GLOBAL.0,
            })
            .collect();
        meanings.objects = objects(program, &meanings);
        meanings
    }

    /// Finds the meaning of the names and functions that were added to a script. Those of the script
    /// keep theirs. `log` is a name that stands for the built-in function.
    pub fn extend(&mut self, program: &ResolvedScript, log: NameId) {
        let names = program.names.iter().enumerate().skip(self.names.len());
        let more = names.map(|(number, name)| match NameId(number) == log {
            true => Meaning::Builtin(builtin::LOG),
            false => self.offered(&name.text),
        });
        let more: Vec<Meaning> = more.collect();
        self.names.extend(more);
        let functions = program.functions.iter().skip(self.self_is_nil.len());
        self.self_is_nil.extend(functions.map(|function| function.name.is_some()));
    }

    /// Returns the library of the objects that a global holds, if the global holds nothing else.
    pub fn object(&self, name: NameId) -> Option<Library> {
        self.objects.get(&name).copied()
    }

    /// Returns the robots that the script is compiled for.
    pub fn robots(&self) -> KnownRobots<'a> {
        self.robots
    }

    /// Returns the number profile.
    pub fn profile(&self) -> NumberProfile {
        self.profile
    }

    /// Returns the meaning of a name that the machine or the robot provides.
    pub fn offered(&self, name: &str) -> Meaning {
        offered(self.robots, self.profile, name)
    }

    /// Returns the meaning of a name.
    pub fn of(&self, name: NameId) -> Meaning {
        self.names[name.0]
    }

    /// Returns true if a function's self is always nil, because the function is never stored in a
    /// table.
    pub fn self_is_nil(&self, function: FunctionId) -> bool {
        self.self_is_nil[function.0]
    }

    /// Returns the library that an expression certainly refers to.
    pub fn library(&self, expr: &CheckedExpr) -> Option<Library> {
        match &expr.kind {
            CheckedExprKind::Name(name) => match self.of(*name) {
                Meaning::Library(library) => Some(library),
                _ => None,
            },
            CheckedExprKind::Field { object, key, .. } if key == "rng" => {
                let is_math = self.library(object) == Some(Library::Math);
                let known =
                    !self.escaped.contains(&Library::Math) && !self.is_assigned(Library::Math, key);
                (is_math && known).then_some(Library::Rng)
            }
            _ => None,
        }
    }

    /// Returns the meaning of a library's field.
    pub fn member(&self, library: Library, key: &str) -> LibraryMember {
        if self.changing.contains(&library) || self.is_assigned(library, key) {
            return LibraryMember::Changing;
        }
        self.robots.member(library, key).map_or(LibraryMember::Absent, LibraryMember::Known)
    }

    /// Returns the libraries that the script uses as values.
    pub fn escaped(&self) -> &BTreeSet<Library> {
        &self.escaped
    }

    /// Returns true if the script assigns that field of a library.
    pub fn is_assigned(&self, library: Library, key: &str) -> bool {
        self.assigned.contains(&(library, key.to_owned()))
    }
}

fn meaning(robots: KnownRobots<'_>, profile: NumberProfile, name: &FreeName) -> Meaning {
    match name.definitions.last() {
        // The last definition is in force before the first line runs.
        Some((function, _)) if name.writes.is_empty() => Meaning::Function(*function),
        None if name.writes.is_empty() => offered(robots, profile, &name.text),
        _ => Meaning::Global,
    }
}

/// Returns the globals whose values come only from `swarm.create` or `stigmergy.create`, with the
/// library of these objects.
fn objects(program: &ResolvedScript, meanings: &Meanings<'_>) -> BTreeMap<NameId, Library> {
    let mut objects = BTreeMap::new();
    let mut assigned = BTreeMap::new();
    for function in &program.functions {
        assigned_values(&function.body, &mut assigned);
    }
    for (id, values) in assigned {
        if !program.name(id).definitions.is_empty() {
            continue;
        }
        let mut made = values
            .iter()
            .filter(|value| !matches!(value.kind, CheckedExprKind::Nil))
            .map(|value| made_object(value, meanings));
        let first = made.next().flatten();
        if let Some(library) = first.filter(|_| made.all(|other| other == first)) {
            objects.insert(id, library);
        }
    }
    objects
}

fn made_object(value: &CheckedExpr, meanings: &Meanings<'_>) -> Option<Library> {
    let CheckedExprKind::Call { callee, .. } = &value.kind else { return None };
    let CheckedExprKind::Field { object, key, .. } = &callee.kind else { return None };
    match meanings.member(meanings.library(object)?, key) {
        LibraryMember::Known(info) if info.number == builtin::SWARM_CREATE => {
            Some(Library::SwarmObject)
        }
        LibraryMember::Known(info) if info.number == builtin::STIGMERGY_CREATE => {
            Some(Library::StigmergyObject)
        }
        _ => None,
    }
}

/// Returns the library that a variable holds initially, because the script assigns the name of a
/// library.
fn first_library(name: &FreeName) -> Option<Library> {
    let is_variable = name.definitions.is_empty() && !name.writes.is_empty();
    let named = |library: &Library| library.global_name() == Some(name.text.as_str());
    Library::ALL.into_iter().find(named).filter(|_| is_variable)
}

/// The scan for libraries that the script uses as values or modifies.
struct LibraryScan<'m> {
    meanings: &'m Meanings<'m>,
    /// The name `pos`, which counts as a library on robots without a position, too. All robots must
    /// agree on the strings of a script, and the member names of a library that is used as a value
    /// are among these strings.
    position: Option<NameId>,
    escaped: BTreeSet<Library>,
    /// Those of them that reach code which may change them.
    changing: BTreeSet<Library>,
    assigned: BTreeSet<(Library, String)>,
}

impl LibraryScan<'_> {
    fn library(&self, expr: &CheckedExpr) -> Option<Library> {
        match expr.kind {
            CheckedExprKind::Name(name)
                if Some(name) == self.position && self.meanings.of(name) == Meaning::Nil =>
            {
                Some(Library::Position)
            }
            _ => self.meanings.library(expr),
        }
    }

    fn block(&mut self, block: &CheckedBlock) {
        self.stmts(&block.stmts);
    }

    fn stmts(&mut self, stmts: &[CheckedStmt]) {
        for stmt in stmts {
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &CheckedStmt) {
        match &stmt.kind {
            CheckedStmtKind::Var { value, .. } | CheckedStmtKind::Return(value) => {
                if let Some(value) = value {
                    self.value(value);
                }
            }
            CheckedStmtKind::Assign { target, value } => {
                match &target.kind {
                    CheckedExprKind::Field { object, key, .. } => match self.library(object) {
                        Some(library) => {
                            self.assigned.insert((library, key.clone()));
                        }
                        None => self.value(object),
                    },
                    _ => children(target, |child| self.value(child)),
                }
                self.value(value);
            }
            CheckedStmtKind::If { branches, otherwise } => {
                for branch in branches {
                    self.tested(&branch.condition);
                    self.block(&branch.then);
                }
                self.block(otherwise);
            }
            CheckedStmtKind::While { condition, body, update } => {
                self.tested(condition);
                self.block(body);
                if let Some(update) = update {
                    self.stmt(update);
                }
            }
            CheckedStmtKind::Call(call) => self.value(call),
        }
    }

    /// Visits an expression of which only the truth counts. A library there does not count as a
    /// value.
    fn tested(&mut self, expr: &CheckedExpr) {
        if self.library(expr).is_none() {
            self.value(expr);
        }
    }

    fn value(&mut self, expr: &CheckedExpr) {
        if let Some(library) = self.library(expr) {
            self.escaped.insert(library);
            self.changing.insert(library);
            return;
        }
        match &expr.kind {
            CheckedExprKind::Call { callee, args } if self.only_looks(callee) => {
                for arg in args {
                    match self.library(arg) {
                        Some(library) => _ = self.escaped.insert(library),
                        None => self.value(arg),
                    }
                }
            }
            CheckedExprKind::Field { object, .. } => self.tested(object),
            CheckedExprKind::Unary { op: UnaryOp::Not, operand } => self.tested(operand),
            CheckedExprKind::Chain { links, .. } if links.iter().any(|link| link.op.is_logic()) => {
                children(expr, |child| self.tested(child));
            }
            CheckedExprKind::Call { callee, args } if self.is_isnil(callee) => {
                args.iter().for_each(|arg| self.tested(arg));
            }
            _ => children(expr, |child| self.value(child)),
        }
    }

    /// Returns true for a built-in function that changes none of its arguments, and keeps none.
    fn only_looks(&self, callee: &CheckedExpr) -> bool {
        const LOOKING: [u8; 9] = [
            builtin::LOG,
            builtin::SIZE,
            builtin::TYPE,
            builtin::IS_INT,
            builtin::IS_FLOAT,
            builtin::IS_STRING,
            builtin::IS_TABLE,
            builtin::IS_CLOSURE,
            builtin::IS_USERDATA,
        ];
        matches!(callee.kind, CheckedExprKind::Name(name)
            if matches!(self.meanings.of(name), Meaning::Builtin(number) if LOOKING.contains(&number)))
    }

    fn is_isnil(&self, callee: &CheckedExpr) -> bool {
        matches!(callee.kind, CheckedExprKind::Name(name)
            if self.meanings.of(name) == Meaning::Builtin(builtin::IS_NIL))
    }
}
