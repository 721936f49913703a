//! The classes of value that a script may send: nil, numbers, strings, tables, functions.
//!
//! The analysis follows values through variables, parameters, results, tables and messages, without
//! regard to the order of execution. It yields the class table of the image, with which robots
//! refuse forged values, and determines if the script needs long messages.
//!
//! A robot must never refuse a value from a robot with the same script. A set of classes may
//! therefore be too large, but never too small. The other robot may be of another type: an unknown
//! name here may be a robot function there.

mod initial;
mod library;

use std::collections::BTreeMap;
use std::ops::{BitOr, BitOrAssign};

use bittybuzz_vm_core::builtin::Feature;
use bittybuzz_vm_core::image::ALL_CLASSES;
use bittybuzz_vm_core::message::STIGMERGIES;
use bittybuzz_vm_core::{builtin, class};

use crate::check::names::{LibraryMember, Meaning, Meanings};
use crate::check::tree::{
    CheckedBranch, CheckedExpr, CheckedExprKind, CheckedStmt, CheckedStmtKind, FunctionId, LocalId,
    LocalKind, NameId, ResolvedScript,
};
use crate::profile::NumberProfile;
use crate::stigmergies::StigmergyNumbers;

/// A set of classes. The low 8 bits are those of the image's class table; bit 8 is `OBJECT`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Classes(u16);

impl Classes {
    pub const NONE: Classes = Classes(0);
    pub const NIL: Classes = Classes(class::NIL as u16);
    pub const NUMBER: Classes = Classes(class::NUMBER as u16);
    pub const STRING: Classes = Classes(class::STRING as u16);
    pub const TEXT: Classes = Classes(class::TEXT as u16);
    pub const TABLE: Classes = Classes(class::TABLE as u16);
    pub const FUNCTION: Classes = Classes(class::FUNCTION as u16);
    /// A value whose members are built-ins: a library, a swarm, a stigmergy, a snapshot.
    pub const OBJECT: Classes = Classes(1 << 8);
    /// The classes of the results of robot functions.
    const PLAIN: Classes = Classes(Classes::NIL.0 | Classes::NUMBER.0 | Classes::STRING.0);
    const ANY: Classes = Classes(0x1ff);

    pub fn has(self, other: Classes) -> bool {
        self.0 & other.0 != 0
    }

    fn both(self, other: Classes) -> Classes {
        Classes(self.0 & other.0)
    }

    fn without(self, other: Classes) -> Classes {
        Classes(self.0 & !other.0)
    }

    /// Returns the byte for the image's class table. A name under which the script never sends gets
    /// all classes, so that nothing is refused.
    fn row(self) -> u8 {
        let mut classes = self;
        // The machine makes a table of an object.
        if self.has(Classes::OBJECT) {
            classes |= Classes::TABLE;
        }
        // The table does not distinguish strings of the source from strings made at run time.
        if self.has(Classes::STRING | Classes::TEXT) {
            classes |= Classes::STRING | Classes::TEXT;
        }
        let is_all = classes == Classes::NONE || SENDABLE.without(classes) == Classes::NONE;
        if is_all { ALL_CLASSES } else { classes.0 as u8 }
    }
}

/// All classes of values that can be sent.
const SENDABLE: Classes = Classes(Classes::PLAIN.0 | Classes::TABLE.0 | Classes::FUNCTION.0);

impl BitOr for Classes {
    type Output = Classes;

    fn bitor(self, other: Classes) -> Classes {
        Classes(self.0 | other.0)
    }
}

impl BitOrAssign for Classes {
    fn bitor_assign(&mut self, other: Classes) {
        *self = *self | other;
    }
}

/// The topic of a broadcast or the key of a stigmergy, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Name<'a> {
    /// A string of the source.
    Text(&'a str),
    /// A number.
    Number,
    /// A computed value that may be a string.
    Any,
}

/// The values that a script may send.
#[derive(Debug, Default)]
pub struct SentClasses<'a> {
    /// True if some of the values may need more than one frame.
    is_long: bool,
    /// `None` if the script may send anything under any name.
    names: Option<BTreeMap<Name<'a>, Classes>>,
}

impl SentClasses<'_> {
    /// Returns the class table of the image: a byte for all names that are not strings of the
    /// script, then one byte for each of its strings, in reverse order of their numbers. The table
    /// is empty if no class is refused.
    pub fn table(&self, strings: &[String]) -> Vec<u8> {
        let Some(names) = &self.names else { return Vec::new() };
        let of = |name| names.get(&name).copied().unwrap_or_default();
        let texts = strings.iter().rev().map(|string| Name::Text(string.as_str()));
        let all = std::iter::once(Name::Number).chain(texts);
        let rows: Vec<u8> = all.map(|name| (of(name) | of(Name::Any)).row()).collect();
        if rows.iter().all(|row| *row == ALL_CLASSES) { Vec::new() } else { rows }
    }

    /// Returns the features that the image needs for these values.
    pub fn features(&self, table: &[u8]) -> u8 {
        let takes_numbers = table.iter().all(|row| row & class::NUMBER == class::NUMBER);
        let is_quick = takes_numbers && !table.is_empty();
        (if self.is_long { Feature::LongMessages as u8 } else { 0 })
            | (if is_quick { Feature::Numbers as u8 } else { 0 })
    }
}

/// Analyzes the whole script.
pub fn sent<'a>(
    program: &'a ResolvedScript,
    meanings: &'a Meanings<'a>,
    profile: NumberProfile,
    stigmergies: &StigmergyNumbers,
) -> SentClasses<'a> {
    let flow = analyzed(program, meanings, profile, stigmergies);
    if flow.is_lost { SentClasses { is_long: true, names: None } } else { flow.end() }
}

/// The classes that the values of expressions may have, after the analysis of a whole script.
pub struct ValueClasses<'a>(Flow<'a>);

impl<'a> ValueClasses<'a> {
    /// Analyzes the whole script.
    pub fn of(
        program: &'a ResolvedScript,
        meanings: &'a Meanings<'a>,
        profile: NumberProfile,
        stigmergies: &StigmergyNumbers,
    ) -> Self {
        ValueClasses(analyzed(program, meanings, profile, stigmergies))
    }

    /// Returns the classes of an expression in a function. The set may be too large, but never too
    /// small.
    pub fn expression(&mut self, function: FunctionId, expr: &'a CheckedExpr) -> Classes {
        let ValueClasses(flow) = self;
        match flow.value(function, expr) {
            // An expression that is never evaluated has no classes.
            classes if flow.is_lost || classes == Classes::NONE => flow.any,
            classes => classes,
        }
    }
}

/// Follows all values until no set of classes grows, or until the script may send anything.
fn analyzed<'a>(
    program: &'a ResolvedScript,
    meanings: &'a Meanings<'a>,
    profile: NumberProfile,
    stigmergies: &StigmergyNumbers,
) -> Flow<'a> {
    let mut flow = Flow {
        program,
        meanings,
        framed: stigmergies.framed(),
        any: match profile {
            NumberProfile::Tiny => Classes::ANY.without(Classes::TEXT),
            NumberProfile::Full => Classes::ANY,
        },
        held: BTreeMap::new(),
        has_changed: false,
        is_lost: false,
        is_long: false,
    };
    flow.begin();
    loop {
        flow.has_changed = false;
        flow.first_functions();
        for (number, function) in program.functions.iter().enumerate() {
            flow.stmts(FunctionId(number), &function.body);
        }
        if flow.is_lost || !flow.has_changed {
            return flow;
        }
    }
}

/// A place that holds values.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum ValueHolder<'a> {
    Global(NameId),
    Local(FunctionId, LocalId),
    /// The result of a function.
    Result(FunctionId),
    /// The results of functions that are called as values.
    AnyResult,
    /// The arguments of functions that are called as values.
    AnyArgument,
    /// The elements of all tables.
    Element,
    /// Keys of tables and stigmergies.
    Key,
    /// The `self` of functions in objects.
    SelfValue,
    /// The data of a conflict's winner, as the conflict handler returns it.
    Verdict,
    /// Nil, if a conflict handler may return a robot without data.
    NoData,
    /// Messages and entries of stigmergies under that topic or key.
    Sent(Name<'a>),
    /// Messages and entries under all names.
    AllSent,
}

/// An argument of a call. A function of the script in `called` counts as a value only where the
/// callee may call it with unknown arguments.
struct Arg<'a> {
    expr: &'a CheckedExpr,
    called: Option<FunctionId>,
    classes: Classes,
}

struct Flow<'a> {
    program: &'a ResolvedScript,
    meanings: &'a Meanings<'a>,
    /// The numbers of the stigmergies whose entries fit one frame.
    framed: [u16; STIGMERGIES as usize],
    /// All classes that exist in the profile.
    any: Classes,
    held: BTreeMap<ValueHolder<'a>, Classes>,
    has_changed: bool,
    /// The script may send anything under any name.
    is_lost: bool,
    is_long: bool,
}

impl<'a> Flow<'a> {
    fn put(&mut self, place: ValueHolder<'a>, classes: Classes) {
        let held = self.held.entry(place).or_default();
        let before = *held;
        *held |= classes;
        self.has_changed |= *held != before;
        if matches!(place, ValueHolder::Sent(_)) {
            self.put(ValueHolder::AllSent, classes);
        }
    }

    fn get(&self, place: ValueHolder<'a>) -> Classes {
        self.held.get(&place).copied().unwrap_or_default()
    }

    /// Adds classes to the elements of tables. Nil is never an element, because assigning nil
    /// removes the key.
    fn put_element(&mut self, classes: Classes) {
        self.put(ValueHolder::Element, classes.without(Classes::NIL));
    }

    /// Returns the classes of values under that name, those that other robots sent included.
    fn received(&self, name: Name<'a>) -> Classes {
        match name {
            Name::Any => self.get(ValueHolder::AllSent),
            _ => self.get(ValueHolder::Sent(name)) | self.get(ValueHolder::Sent(Name::Any)),
        }
    }

    fn end(self) -> SentClasses<'a> {
        let mut names = BTreeMap::new();
        let mut is_long = self.is_long;
        for (place, classes) in &self.held {
            if let ValueHolder::Sent(name) = place {
                is_long |= classes.has(Classes::TEXT | Classes::TABLE | Classes::FUNCTION);
                names.insert(*name, *classes);
            }
        }
        SentClasses { is_long, names: Some(names) }
    }

    fn stmts(&mut self, function: FunctionId, stmts: &'a [CheckedStmt]) {
        for stmt in stmts {
            self.stmt(function, stmt);
        }
    }

    fn stmt(&mut self, function: FunctionId, stmt: &'a CheckedStmt) {
        match &stmt.kind {
            CheckedStmtKind::Var { local, value } => {
                let classes = self.value_or_nil(function, value.as_ref());
                self.put(self.local(function, *local), classes);
            }
            CheckedStmtKind::Assign { target, value } => {
                let classes = self.value(function, value);
                self.assign(function, target, classes);
            }
            CheckedStmtKind::If { branches, otherwise } => {
                for CheckedBranch { condition, then } in branches {
                    self.tested(function, condition);
                    self.stmts(function, &then.stmts);
                }
                self.stmts(function, &otherwise.stmts);
            }
            CheckedStmtKind::While { condition, body, update } => {
                self.tested(function, condition);
                self.stmts(function, &body.stmts);
                self.stmts(function, update.as_deref().map_or(&[], std::slice::from_ref));
            }
            CheckedStmtKind::Return(value) => {
                let classes = self.value_or_nil(function, value.as_ref());
                self.put(ValueHolder::Result(function), classes);
            }
            CheckedStmtKind::Call(call) => {
                self.value(function, call);
            }
        }
    }

    fn assign(&mut self, function: FunctionId, target: &'a CheckedExpr, classes: Classes) {
        match &target.kind {
            CheckedExprKind::Name(name) => self.put(ValueHolder::Global(*name), classes),
            CheckedExprKind::Local(local) => self.put(self.local(function, *local), classes),
            CheckedExprKind::Field { object, key, .. } => {
                self.change_object(function, object, key);
                self.put_element(classes);
                // A table with a robot may be the result of a conflict handler, without data.
                if key == "robot" || key == "data" && classes.has(Classes::NIL) {
                    self.put(ValueHolder::NoData, Classes::NIL);
                }
            }
            CheckedExprKind::Index { object, index } => {
                let object = self.value(function, object);
                let index = self.value(function, index);
                self.is_lost |= self.may_be_member(object, index);
                self.put(ValueHolder::Key, index);
                self.put_element(classes);
                self.note_self(object);
                if index.has(Classes::STRING | Classes::TEXT) {
                    self.put(ValueHolder::NoData, Classes::NIL);
                }
            }
            _ => self.is_lost = true,
        }
    }

    /// Records that the script assigns a field or element of that object. A function stored there
    /// is called with the object as its `self`.
    pub(super) fn note_self(&mut self, object: Classes) {
        self.put(ValueHolder::SelfValue, object.both(Classes::OBJECT));
    }

    /// Returns the place of a variable. A captured copy in a lambda shares the place of the
    /// original.
    fn local(&self, function: FunctionId, local: LocalId) -> ValueHolder<'a> {
        let of = self.program.function(function);
        match (of.local(local).kind, of.creator) {
            (LocalKind::Captured { index, .. }, Some(creator)) => {
                self.local(creator, of.captures[index])
            }
            _ => ValueHolder::Local(function, local),
        }
    }

    fn value_or_nil(&mut self, function: FunctionId, value: Option<&'a CheckedExpr>) -> Classes {
        value.map_or(Classes::NIL, |value| self.value(function, value))
    }

    /// Follows an expression of which only the truth counts. A bare name is skipped, because its
    /// value goes nowhere else.
    fn tested(&mut self, function: FunctionId, expr: &'a CheckedExpr) {
        if !matches!(expr.kind, CheckedExprKind::Name(_)) {
            self.value(function, expr);
        }
    }

    /// Returns the classes that the value of an expression may have.
    fn value(&mut self, function: FunctionId, expr: &'a CheckedExpr) -> Classes {
        match &expr.kind {
            CheckedExprKind::Nil => Classes::NIL,
            CheckedExprKind::Int(_) | CheckedExprKind::Float(_) => Classes::NUMBER,
            CheckedExprKind::Str(_) => Classes::STRING,
            CheckedExprKind::Local(local) => self.get(self.local(function, *local)),
            CheckedExprKind::Name(name) => self.name(*name),
            CheckedExprKind::Lambda(lambda) => self.escape(*lambda),
            CheckedExprKind::Table(entries) => {
                let (mut names_robot, mut has_data) = (false, false);
                for (key, value) in entries {
                    let classes = self.value(function, value);
                    self.put_element(classes);
                    if let CheckedExprKind::Str(key) = &key.kind {
                        names_robot |= key == "robot";
                        // If two entries have the same key, the last one counts.
                        if key == "data" {
                            has_data = !classes.has(Classes::NIL);
                        }
                    }
                }
                if names_robot && !has_data {
                    self.put(ValueHolder::NoData, Classes::NIL);
                }
                Classes::TABLE
            }
            CheckedExprKind::Unary { operand, .. } => {
                self.tested(function, operand);
                Classes::NUMBER
            }
            CheckedExprKind::Chain { first, links } => {
                self.tested(function, first);
                links.iter().for_each(|link| self.tested(function, &link.right));
                Classes::NUMBER
            }
            CheckedExprKind::Field { object, key, .. } => self.field(function, object, key),
            CheckedExprKind::Index { object, index } => {
                let object = self.value(function, object);
                let index = self.value(function, index);
                self.is_lost |= self.may_be_member(object, index);
                self.element()
            }
            CheckedExprKind::Call { callee, args } => self.call(function, callee, args),
            CheckedExprKind::SelfValue => {
                Classes::NIL | Classes::TABLE | self.get(ValueHolder::SelfValue)
            }
            CheckedExprKind::Error => self.any,
        }
    }

    fn name(&mut self, name: NameId) -> Classes {
        match self.meanings.of(name) {
            Meaning::Global => self.get(ValueHolder::Global(name)),
            Meaning::RobotId => Classes::NUMBER,
            Meaning::Function(function) => self.escape(function),
            Meaning::Nil => Classes::NIL,
            // On robots without the function the name is nil.
            Meaning::Robot => Classes::NIL | Classes::FUNCTION,
            Meaning::Builtin(number) => match builtin::info(number) {
                Some(info) => self.native(info),
                None => self.any,
            },
            Meaning::Library(_) => {
                self.native_all();
                Classes::NIL | Classes::OBJECT
            }
        }
    }

    /// Records that a function of the script is used as a value.
    fn escape(&mut self, called: FunctionId) -> Classes {
        let argument = self.get(ValueHolder::AnyArgument);
        for number in 0..self.program.function(called).parameters {
            self.put(ValueHolder::Local(called, LocalId(number)), argument);
        }
        let result = self.get(ValueHolder::Result(called));
        self.put(ValueHolder::AnyResult, result);
        Classes::FUNCTION
    }

    /// Returns the classes of a value in a table or object, or of a missing one.
    fn element(&self) -> Classes {
        self.get(ValueHolder::Element) | Classes::NIL
    }

    fn call(
        &mut self,
        function: FunctionId,
        callee: &'a CheckedExpr,
        args: &'a [CheckedExpr],
    ) -> Classes {
        let args: Vec<Arg<'a>> = args.iter().map(|arg| self.arg(function, arg)).collect();
        let args = args.as_slice();
        match &callee.kind {
            CheckedExprKind::Name(name) => match self.meanings.of(*name) {
                Meaning::Function(called) => {
                    let args: Vec<_> = args.iter().map(|arg| self.pass(arg)).collect();
                    self.call_function(called, &args)
                }
                Meaning::Builtin(number) => self.builtin(number, args),
                // A robot function may return an argument.
                Meaning::Robot | Meaning::Nil => Classes::PLAIN | self.pass_all(args),
                _ => self.call_any(args),
            },
            CheckedExprKind::Field { object, key, .. } => {
                if let Some(library) = self.meanings.library(object) {
                    return match self.meanings.member(library, key) {
                        LibraryMember::Known(info) => self.builtin(info.number, args),
                        _ => {
                            self.change_member(library, key);
                            self.call_any(args)
                        }
                    };
                }
                let object = self.value(function, object);
                self.method(object, key, args)
            }
            CheckedExprKind::Index { object, index } => {
                let object = self.value(function, object);
                let index = self.value(function, index);
                self.is_lost |= self.may_be_member(object, index);
                self.call_any(args)
            }
            _ => {
                self.value(function, callee);
                self.call_any(args)
            }
        }
    }

    fn arg(&mut self, function: FunctionId, expr: &'a CheckedExpr) -> Arg<'a> {
        let called = self.function_of(expr);
        let classes = match called {
            Some(_) => Classes::FUNCTION,
            None => self.value(function, expr),
        };
        Arg { expr, called, classes }
    }

    /// Returns the classes of an argument that is passed to a callee that treats functions like
    /// other values.
    fn pass(&mut self, arg: &Arg<'a>) -> Classes {
        if let Some(called) = arg.called {
            self.escape(called);
        }
        arg.classes
    }

    fn pass_all(&mut self, args: &[Arg<'a>]) -> Classes {
        let mut passed = Classes::NONE;
        for arg in args {
            passed |= self.pass(arg);
        }
        passed
    }

    /// Follows a call of a value: a function of the script or of the robot, which may return an
    /// argument.
    fn call_any(&mut self, args: &[Arg<'a>]) -> Classes {
        let passed = self.pass_all(args);
        self.put(ValueHolder::AnyArgument, passed);
        self.get(ValueHolder::AnyResult) | passed
    }

    /// Follows the call of a callback with arguments of these classes. Returns the classes of its
    /// result.
    fn call_back(&mut self, callback: &Arg<'a>, args: &[Classes]) -> Classes {
        if let Some(called) = callback.called {
            return self.call_function(called, args);
        }
        let passed = args.iter().fold(Classes::NONE, |all, arg| all | *arg);
        self.put(ValueHolder::AnyArgument, passed);
        self.get(ValueHolder::AnyResult) | passed
    }

    /// Follows the call of a known function. A parameter without an argument cannot be read, so it
    /// gets no class.
    fn call_function(&mut self, called: FunctionId, args: &[Classes]) -> Classes {
        let parameters = self.program.function(called).parameters;
        for (number, arg) in args.iter().take(parameters).enumerate() {
            self.put(ValueHolder::Local(called, LocalId(number)), *arg);
        }
        self.get(ValueHolder::Result(called))
    }

    fn function_of(&self, expr: &CheckedExpr) -> Option<FunctionId> {
        match &expr.kind {
            CheckedExprKind::Lambda(function) => Some(*function),
            CheckedExprKind::Name(name) => match self.meanings.of(*name) {
                Meaning::Function(function) => Some(function),
                _ => None,
            },
            _ => None,
        }
    }
}
