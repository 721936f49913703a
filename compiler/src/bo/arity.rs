//! Finds the numbers of arguments with which functions are called, as far as the program shows
//! them.
//!
//! A `.bo` file does not state the number of parameters of a function. Mostly the function's own
//! use of locals determines the number. If the function creates a lambda, however, parameters that
//! only the lambda uses look like the lambda's own, and the calls must decide. To find the calls of
//! a function that is stored, passed on or returned, all places that may hold the same function are
//! put in one class: globals, fields by name, elements, locals, parameters, results.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use bittybuzz_vm_core::builtin::{Library, find};

use crate::bo::names::Names;
use crate::bo::structure::{ChunkOutline, Node};
use crate::check::tree::{CheckedExpr, CheckedExprKind, NameId};

/// A place that may hold a function.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum FunctionHolder {
    Global(NameId),
    /// A field of that name in any table except the libraries.
    Field(String),
    /// A function of a library.
    Member(Library, String),
    /// An element of any table under a key that is not a constant string.
    Element,
    /// A local of a chunk, by its number in the file.
    Local(usize, u32),
    /// The function of that chunk.
    Function(usize),
}

/// The number of a class. The class may have been merged into another one.
type Class = usize;

#[derive(Debug, Default)]
struct Members {
    /// The class into which this one was merged.
    into: Option<Class>,
    /// Numbers of arguments in calls.
    counts: BTreeSet<usize>,
    has_function: bool,
    result: Option<Class>,
    parameters: BTreeMap<usize, Class>,
}

/// The classes of a program.
#[derive(Debug, Default)]
pub struct Arities {
    classes: Vec<Members>,
    places: HashMap<FunctionHolder, Class>,
    unknown: BTreeSet<usize>,
}

impl Arities {
    /// Analyzes a program. `entries` are the names of functions that the host calls without
    /// arguments; `has_plain_base` returns true for functions whose first parameter is local 1.
    pub fn new(
        outlines: &[ChunkOutline],
        names: &Names,
        entries: &[&str],
        has_plain_base: impl Fn(usize) -> bool,
    ) -> Self {
        let mut arities = Arities::default();
        for (chunk, outline) in outlines.iter().enumerate() {
            let function = arities.place(FunctionHolder::Function(chunk));
            arities.classes[function].has_function = true;
            if has_plain_base(chunk) {
                for local in outline.touched.keys() {
                    let class = arities.place(FunctionHolder::Local(chunk, *local));
                    let index = (*local as usize).saturating_sub(1);
                    arities.classes[function].parameters.insert(index, class);
                }
            }
        }
        for (id, name) in names.iter() {
            for chunk in &name.functions {
                let (global, function) = (
                    arities.place(FunctionHolder::Global(id)),
                    arities.place(FunctionHolder::Function(*chunk)),
                );
                arities.merge(global, function);
            }
            if entries.contains(&name.text.as_str()) {
                let global = arities.place(FunctionHolder::Global(id));
                arities.called(global, 0);
            }
        }
        let mut callbacks = Vec::new();
        for (chunk, outline) in outlines.iter().enumerate() {
            let mut scan = Scan { arities: &mut arities, names, chunk, callbacks: &mut callbacks };
            scan.nodes(&outline.nodes);
        }
        for Callback { callee, argument, count } in callbacks {
            // A function of the program with that name replaces the built-in, so its calls are
            // unknown.
            let callee = arities.find(callee);
            if !arities.classes[callee].has_function {
                arities.called(argument, count);
            }
        }
        arities.unknown = arities.calls_of_unknown();
        arities
    }

    /// Returns the numbers of arguments with which the function of a chunk is called. Empty if no
    /// call of it was found.
    pub fn counts(&mut self, chunk: usize) -> &BTreeSet<usize> {
        let class = self.place(FunctionHolder::Function(chunk));
        let class = self.find(class);
        &self.classes[class].counts
    }

    /// Returns the numbers of arguments in calls that may call any function.
    pub fn unknown(&self) -> &BTreeSet<usize> {
        &self.unknown
    }

    /// Collects the calls of locals for which no function was found: they may call any function.
    fn calls_of_unknown(&mut self) -> BTreeSet<usize> {
        let is_local = |(place, class): (&FunctionHolder, &Class)| {
            matches!(place, FunctionHolder::Local(..)).then_some(*class)
        };
        let locals: Vec<Class> = self.places.iter().filter_map(is_local).collect();
        let mut counts = BTreeSet::new();
        for class in locals {
            let class = self.find(class);
            if !self.classes[class].has_function {
                counts.extend(&self.classes[class].counts);
            }
        }
        counts
    }

    fn place(&mut self, place: FunctionHolder) -> Class {
        let next = self.classes.len();
        let class = *self.places.entry(place).or_insert(next);
        if class == next {
            self.classes.push(Members::default());
        }
        class
    }

    fn find(&mut self, class: Class) -> Class {
        let mut root = class;
        while let Some(into) = self.classes[root].into {
            root = into;
        }
        let mut at = class;
        while let Some(into) = self.classes[at].into {
            self.classes[at].into = Some(root);
            at = into;
            if at == root {
                break;
            }
        }
        root
    }

    fn called(&mut self, class: Class, count: usize) {
        let class = self.find(class);
        self.classes[class].counts.insert(count);
    }

    /// Returns the class of the value that a function of this class returns.
    fn result(&mut self, class: Class) -> Class {
        let class = self.find(class);
        if let Some(result) = self.classes[class].result {
            return result;
        }
        self.classes.push(Members::default());
        let result = self.classes.len() - 1;
        self.classes[class].result = Some(result);
        result
    }

    /// Returns the class of a parameter, counted from 0, of a function of this class.
    fn parameter(&mut self, class: Class, index: usize) -> Class {
        let class = self.find(class);
        if let Some(parameter) = self.classes[class].parameters.get(&index) {
            return *parameter;
        }
        self.classes.push(Members::default());
        let parameter = self.classes.len() - 1;
        self.classes[class].parameters.insert(index, parameter);
        parameter
    }

    /// Merges two classes, because two places may hold the same function. The classes of their
    /// results and parameters are merged as well.
    fn merge(&mut self, a: Class, b: Class) {
        let mut pending = vec![(a, b)];
        while let Some((a, b)) = pending.pop() {
            let (a, b) = (self.find(a), self.find(b));
            if a == b {
                continue;
            }
            let from = std::mem::take(&mut self.classes[b]);
            self.classes[b].into = Some(a);
            let to = &mut self.classes[a];
            to.counts.extend(from.counts);
            to.has_function |= from.has_function;
            match (to.result, from.result) {
                (Some(x), Some(y)) => pending.push((x, y)),
                (None, result) => to.result = result,
                (Some(_), None) => {}
            }
            for (index, parameter) in from.parameters {
                match to.parameters.get(&index) {
                    Some(known) => pending.push((*known, parameter)),
                    None => {
                        to.parameters.insert(index, parameter);
                    }
                }
            }
        }
    }
}

/// An argument that a built-in function calls back.
struct Callback {
    callee: Class,
    argument: Class,
    count: usize,
}

/// The scan of one chunk.
struct Scan<'a> {
    arities: &'a mut Arities,
    names: &'a Names,
    chunk: usize,
    callbacks: &'a mut Vec<Callback>,
}

impl Scan<'_> {
    fn nodes(&mut self, nodes: &[Node]) {
        for node in nodes {
            match node {
                Node::Assign { target, value, .. } => {
                    let (target, value) = (self.expr(target), self.expr(value));
                    self.flow(target, value);
                }
                Node::Store { local, value, .. } => {
                    let target = self.arities.place(FunctionHolder::Local(self.chunk, *local));
                    let value = self.expr(value);
                    self.flow(Some(target), value);
                }
                Node::Remove { .. } | Node::Return { value: None, .. } => {}
                Node::Call { call, .. } => {
                    self.expr(call);
                }
                Node::Return { value: Some(value), .. } => {
                    let value = self.expr(value);
                    let function = self.arities.place(FunctionHolder::Function(self.chunk));
                    let result = self.arities.result(function);
                    self.flow(Some(result), value);
                }
                Node::If { condition, then, otherwise, .. } => {
                    self.expr(condition);
                    self.nodes(then);
                    self.nodes(otherwise);
                }
                Node::Loop { condition, update, body, .. } => {
                    self.expr(condition);
                    self.nodes(update);
                    self.nodes(body);
                }
            }
        }
    }

    fn flow(&mut self, to: Option<Class>, from: Option<Class>) {
        if let (Some(to), Some(from)) = (to, from) {
            self.arities.merge(to, from);
        }
    }

    /// Returns the class of the function that an expression may yield.
    fn expr(&mut self, expr: &CheckedExpr) -> Option<Class> {
        let place = match &expr.kind {
            CheckedExprKind::Name(id) => FunctionHolder::Global(*id),
            CheckedExprKind::Local(local) => {
                FunctionHolder::Local(self.chunk, u32::try_from(local.0).ok()?)
            }
            CheckedExprKind::Lambda(id) => FunctionHolder::Function(id.0),
            CheckedExprKind::Field { object, key, .. } => {
                self.expr(object);
                let members = library(object, self.names).filter(|l| find(*l, key).is_some());
                match members {
                    Some(library) => FunctionHolder::Member(library, key.clone()),
                    None => FunctionHolder::Field(key.clone()),
                }
            }
            CheckedExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
                FunctionHolder::Element
            }
            CheckedExprKind::Call { callee, args } => return self.call(callee, args),
            CheckedExprKind::Table(entries) => {
                for (key, value) in entries {
                    self.expr(key);
                    let value = self.expr(value);
                    let place = match &key.kind {
                        CheckedExprKind::Str(name) => FunctionHolder::Field(name.clone()),
                        _ => FunctionHolder::Element,
                    };
                    let place = self.arities.place(place);
                    self.flow(Some(place), value);
                }
                return None;
            }
            CheckedExprKind::Unary { operand, .. } => {
                self.expr(operand);
                return None;
            }
            CheckedExprKind::Chain { first, links } => {
                self.expr(first);
                links.iter().for_each(|link| {
                    self.expr(&link.right);
                });
                return None;
            }
            CheckedExprKind::Nil
            | CheckedExprKind::Int(_)
            | CheckedExprKind::Float(_)
            | CheckedExprKind::Str(_)
            | CheckedExprKind::SelfValue
            | CheckedExprKind::Error => return None,
        };
        Some(self.arities.place(place))
    }

    fn call(&mut self, callee: &CheckedExpr, args: &[CheckedExpr]) -> Option<Class> {
        let class = self.expr(callee);
        if let Some(class) = class {
            self.arities.called(class, args.len());
        }
        for (index, arg) in args.iter().enumerate() {
            let argument = self.expr(arg);
            let (Some(callee_class), Some(argument)) = (class, argument) else { continue };
            if let Some(count) = callback(callee, index, self.names) {
                self.callbacks.push(Callback { callee: callee_class, argument, count });
            }
            let parameter = self.arities.parameter(callee_class, index);
            self.arities.merge(parameter, argument);
        }
        class.map(|class| self.arities.result(class))
    }
}

/// Returns the library that an expression refers to.
fn library(expr: &CheckedExpr, names: &Names) -> Option<Library> {
    match &expr.kind {
        CheckedExprKind::Name(id) => {
            let name = Some(names.text(*id));
            Library::ALL.into_iter().find(|library| library.global_name() == name)
        }
        CheckedExprKind::Field { object, key, .. } if key == "rng" => {
            library(object, names).filter(|l| *l == Library::Math).map(|_| Library::Rng)
        }
        _ => None,
    }
}

/// Returns the number of arguments with which a built-in function calls its argument `index`.
fn callback(callee: &CheckedExpr, index: usize, names: &Names) -> Option<usize> {
    let (name, first, extra) = match &callee.kind {
        // `foreach(t, f)`: f(key, value)
        CheckedExprKind::Name(id) => (names.text(*id), 1, 0),
        // `neighbors.foreach(f)`: f(id, data)
        CheckedExprKind::Field { object, key, .. } if is_neighbors(object, names) => {
            (key.as_str(), 0, 0)
        }
        // `v.foreach(f)` of a stigmergy: f(key, value, robot)
        CheckedExprKind::Field { key, .. } => (key.as_str(), 0, 1),
        _ => return None,
    };
    match (name, index) {
        ("foreach" | "map" | "filter", _) if index == first => Some(2 + extra),
        ("reduce", _) if index == first => Some(3 + extra),
        ("listen", 1) | ("onconflict", 0) => Some(3),
        ("onconflictlost", 0) => Some(2),
        ("exec", 0) => Some(0),
        _ => None,
    }
}

/// Returns true for `neighbors`, its members and the results of its functions.
fn is_neighbors(expr: &CheckedExpr, names: &Names) -> bool {
    match &expr.kind {
        CheckedExprKind::Name(id) => names.text(*id) == "neighbors",
        CheckedExprKind::Field { object, .. } => is_neighbors(object, names),
        CheckedExprKind::Call { callee, .. } => is_neighbors(callee, names),
        _ => false,
    }
}
