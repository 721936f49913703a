//! Built-ins: the values that they send, the functions that they call, and the classes of their
//! results.

use bittybuzz_vm_core::builtin::{self, BuiltinInfo, BuiltinKind, Library};

use super::{Arg, Classes, Flow, Name, ValueHolder};
use crate::check::names::LibraryMember;
use crate::check::static_type::{StaticType, kind_of};
use crate::check::tree::{CheckedExpr, CheckedExprKind, FunctionId};

impl<'a> Flow<'a> {
    /// Returns the classes of `object.key` as a value.
    pub(super) fn field(
        &mut self,
        function: FunctionId,
        object: &'a CheckedExpr,
        key: &str,
    ) -> Classes {
        let Some(library) = self.meanings.library(object) else {
            let object = self.value(function, object);
            self.is_lost |= object.has(Classes::OBJECT) && is_method(key);
            return self.element();
        };
        match self.meanings.member(library, key) {
            LibraryMember::Known(info) => {
                self.is_lost |= sends(library) && info.kind != BuiltinKind::Value;
                self.native(info)
            }
            LibraryMember::Absent => self.element(),
            LibraryMember::Changing => {
                self.change_member(library, key);
                self.element()
            }
        }
    }

    /// Records that the script assigns a field of an object.
    pub(super) fn change_object(
        &mut self,
        function: FunctionId,
        object: &'a CheckedExpr,
        key: &str,
    ) {
        if let Some(library) = self.meanings.library(object) {
            self.change_member(library, key);
            self.note_self(Classes::OBJECT);
            return;
        }
        let object = self.value(function, object);
        self.is_lost |= object.has(Classes::OBJECT) && is_method(key);
        self.note_self(object);
    }

    /// Records that a member of a library may have been replaced by the script.
    pub(super) fn change_member(&mut self, library: Library, key: &str) {
        if builtin::find(library, key).is_some() {
            self.is_lost |= sends(library);
            self.native_all();
        }
    }

    /// Returns true if an element of that object may be a built-in that sends.
    pub(super) fn may_be_member(&self, object: Classes, index: Classes) -> bool {
        object.has(Classes::OBJECT) && index.has(Classes::STRING | Classes::TEXT)
    }

    /// Returns the classes of a built-in as a value, which may be called anywhere.
    pub(super) fn native(&mut self, info: &BuiltinInfo) -> Classes {
        if info.kind == BuiltinKind::Value {
            if info.number == builtin::RNG {
                self.native_all();
            }
            return self.result(info.number, Classes::NONE);
        }
        let is_simple = matches!(
            info.library,
            Library::Global | Library::Math | Library::Rng | Library::String
        ) && info.kind == BuiltinKind::Plain;
        if is_simple {
            let result = self.result(info.number, Classes::NONE);
            self.put(ValueHolder::AnyResult, result);
        } else {
            self.native_all();
        }
        Classes::FUNCTION
    }

    /// Records that any built-in may be used as a value.
    pub(super) fn native_all(&mut self) {
        for place in [ValueHolder::AnyResult, ValueHolder::AnyArgument, ValueHolder::Element] {
            self.put(place, self.any);
        }
        self.put(ValueHolder::Key, self.any);
        self.put(ValueHolder::NoData, Classes::NIL);
    }

    /// Follows a call of the built-in of that number.
    pub(super) fn builtin(&mut self, number: u8, args: &[Arg<'a>]) -> Classes {
        match (number, args) {
            (builtin::NEIGHBORS_LISTEN, [topic, listener, ..]) => {
                let value = self.received(name_of(topic));
                self.call_back(listener, &[topic.classes, value, Classes::NUMBER]);
                Classes::NIL
            }
            (builtin::NEIGHBORS_BROADCAST, [topic, value, ..]) => {
                self.is_long |= topic.classes.has(Classes::TEXT);
                let value = self.pass(value);
                self.put(ValueHolder::Sent(name_of(topic)), value);
                Classes::NIL
            }
            (builtin::STIGMERGY_CREATE, _) => {
                let has_frames = args.first().is_some_and(|number| {
                    matches!(number.expr.kind, CheckedExprKind::Int(number)
                        if self.framed.iter().any(|framed| i64::from(*framed) == number))
                });
                self.is_long |= !has_frames;
                Classes::OBJECT
            }
            (builtin::FOREACH..=builtin::REDUCE, [table, callback, rest @ ..]) => {
                // The elements of a library are built-ins, which may send.
                self.is_lost |= table.classes.has(Classes::OBJECT);
                let element = [self.get(ValueHolder::Key), self.get(ValueHolder::Element)];
                self.iterate(number, callback, &element, rest)
            }
            (builtin::NEIGHBORS_FOREACH..=builtin::NEIGHBORS_REDUCE, [callback, rest @ ..]) => {
                self.put(ValueHolder::Element, Classes::TABLE);
                let task = number - builtin::NEIGHBORS_FOREACH + builtin::FOREACH;
                let element = [Classes::NUMBER, Classes::TABLE];
                let is_snapshot = matches!(task, builtin::MAP | builtin::FILTER);
                let object = if is_snapshot { Classes::OBJECT } else { Classes::NONE };
                object | self.iterate(task, callback, &element, rest)
            }
            (builtin::NEIGHBORS_KIN | builtin::NEIGHBORS_NONKIN, _) => {
                self.put(ValueHolder::Element, Classes::TABLE);
                Classes::TABLE | Classes::OBJECT
            }
            (builtin::MIN | builtin::MAX, [a, b, ..]) => {
                let (a, b) = (self.pass(a), self.pass(b));
                // If one argument is nil, the result is the other one.
                (a | b).without(Classes::NIL) | a.both(b).both(Classes::NIL)
            }
            _ => {
                let passed = self.pass_all(args);
                // The copy of a library is a table of built-ins.
                self.is_lost |= number == builtin::CLONE && passed.has(Classes::OBJECT);
                self.result(number, passed)
            }
        }
    }

    /// Follows `foreach`, `map`, `filter` or `reduce`, whose callback gets the classes `element` as
    /// its first arguments.
    fn iterate(
        &mut self,
        task: u8,
        callback: &Arg<'a>,
        element: &[Classes],
        rest: &[Arg<'a>],
    ) -> Classes {
        match (task, rest) {
            (builtin::REDUCE, [first, ..]) => {
                let first = self.pass(first);
                let result = first | self.call_back(callback, &[element, &[first]].concat());
                self.call_back(callback, &[element, &[result]].concat());
                result
            }
            (builtin::FOREACH, _) => {
                self.call_back(callback, element);
                Classes::NIL
            }
            _ => {
                let result = self.call_back(callback, element);
                if task == builtin::MAP {
                    self.put_element(result);
                }
                self.put(ValueHolder::NoData, Classes::NIL);
                Classes::TABLE
            }
        }
    }

    /// Follows a call of `object.key`.
    pub(super) fn method(&mut self, object: Classes, key: &str, args: &[Arg<'a>]) -> Classes {
        // The script may have stored functions of its own in objects, where their `self` is the
        // object.
        let is_changed = self.get(ValueHolder::SelfValue).has(Classes::OBJECT);
        let mut result = Classes::NONE;
        if object.has(Classes::OBJECT) {
            let is_table = object.has(Classes::TABLE) || is_changed;
            result |= self.object_method(is_table, key, args);
        }
        if object.has(Classes::TABLE) || is_changed {
            result |= self.call_any(args);
        }
        result
    }

    /// Follows a call of a method of an object; `is_table` if the object may be a snapshot, or
    /// `neighbors` itself.
    fn object_method(&mut self, is_table: bool, key: &str, args: &[Arg<'a>]) -> Classes {
        let mut stored = self.get(ValueHolder::AllSent);
        if is_table {
            self.put(ValueHolder::Element, Classes::TABLE);
            stored |= self.get(ValueHolder::Element);
        }
        let record = Classes::TABLE;
        let element = [self.get(ValueHolder::Key), stored.without(Classes::NIL), Classes::NUMBER];
        let snapshot = if is_table { Classes::OBJECT } else { Classes::NONE };
        match (key, args) {
            ("put", [key, value, ..]) => {
                let is_float = kind_of(key.expr, self.meanings) == Some(StaticType::Float);
                self.is_long |= is_float || key.classes.has(Classes::TEXT);
                self.put(ValueHolder::Key, key.classes);
                let sent = self.pass(value) | self.get(ValueHolder::Verdict);
                self.put(ValueHolder::Sent(name_of(key)), sent);
                Classes::NIL
            }
            ("get", [key, ..]) => {
                let stored = if is_table { stored } else { Classes::NONE };
                self.received(name_of(key)) | stored | Classes::NIL
            }
            ("foreach", [callback, rest @ ..]) => {
                self.iterate(builtin::FOREACH, callback, &element, rest)
            }
            ("map", [callback, rest @ ..]) => {
                self.iterate(builtin::MAP, callback, &element, rest) | snapshot
            }
            ("filter", [callback, rest @ ..]) => {
                self.iterate(builtin::FILTER, callback, &element, rest) | snapshot
            }
            ("reduce", [callback, rest @ ..]) => {
                // The callback for a snapshot gets no robot, unlike that for a stigmergy.
                let [key, value, _] = element;
                let mut result = self.iterate(builtin::REDUCE, callback, &element, rest);
                if is_table {
                    result |= self.iterate(builtin::REDUCE, callback, &[key, value], rest);
                }
                result
            }
            ("onconflict", [handler, ..]) => {
                self.put_element(stored);
                self.call_back(handler, &[element[0], record, record]);
                // The value of a deleted entry is nil.
                let nil = stored.both(Classes::NIL) | self.get(ValueHolder::NoData);
                let data = self.get(ValueHolder::Element) | nil;
                self.put(ValueHolder::Verdict, data);
                Classes::NIL
            }
            ("onconflictlost", [handler, ..]) => {
                self.put_element(stored);
                self.call_back(handler, &[element[0], record]);
                Classes::NIL
            }
            ("exec", [callback, ..]) => self.call_back(callback, &[]) | Classes::NIL,
            _ => self.other_method(key, args),
        }
    }

    fn other_method(&mut self, key: &str, args: &[Arg<'a>]) -> Classes {
        let mut result = self.pass_all(args);
        for info in builtin::TABLE.iter().filter(|info| info.name == key) {
            if info.library.is_object() && info.kind == BuiltinKind::Plain {
                result |= self.result(info.number, Classes::NONE);
            } else if sends(info.library) {
                // The object may be `neighbors` or `stigmergy` under another name.
                self.is_lost |= !is_method(key);
            } else if info.library != Library::Global {
                self.native_all();
                result |= self.call_any(args);
            }
        }
        result
    }

    /// Returns the classes of a built-in's result; `passed` are those of its arguments.
    fn result(&self, number: u8, passed: Classes) -> Classes {
        match number {
            // If one of these is called as a value, the call adds the classes of its arguments.
            builtin::MIN | builtin::MAX | builtin::CLONE => passed,
            builtin::TYPE => Classes::STRING,
            builtin::SIZE
            | builtin::IS_NIL..=builtin::TO_FLOAT
            | builtin::RAND..=builtin::ROUND
            | builtin::SQRT..=builtin::PI
            | builtin::UNIFORM..=builtin::LENGTH
            | builtin::NEIGHBORS_COUNT
            | builtin::SWARM_OBJECT_ID
            | builtin::SWARM_IN
            | builtin::STIGMERGY_SIZE
            | builtin::STIGMERGY_OBJECT_ID
            | builtin::SNAPSHOT_COUNT => Classes::NUMBER,
            builtin::FOREACH
            | builtin::LOG..=builtin::DELAY
            | builtin::SET_SEED
            | builtin::NEIGHBORS_BROADCAST..=builtin::NEIGHBORS_IGNORE
            | builtin::SWARM_JOIN
            | builtin::SWARM_LEAVE
            | builtin::SWARM_SELECT
            | builtin::SWARM_UNSELECT => Classes::NIL,
            builtin::SUB..=builtin::TO_STRING => Classes::STRING | Classes::TEXT,
            // These are nil if a text is no number, or if the robot does not know its position.
            builtin::STRING_TO_INT
            | builtin::STRING_TO_FLOAT
            | builtin::SWARM_ID
            | builtin::POSITION_X..=builtin::POSITION_ORIENTATION => Classes::NUMBER | Classes::NIL,
            builtin::NEIGHBORS_GET => Classes::TABLE | Classes::NIL,
            builtin::NEIGHBORS_KIN | builtin::NEIGHBORS_NONKIN => Classes::TABLE | Classes::OBJECT,
            builtin::RNG
            | builtin::SWARM_CREATE
            | builtin::SWARM_UNION..=builtin::SWARM_DIFFERENCE
            | builtin::SWARM_OTHERS => Classes::OBJECT,
            _ => self.any,
        }
    }
}

/// Returns the name that an argument stands for as a topic or key. Values other than numbers and
/// strings are faults there.
fn name_of<'a>(arg: &Arg<'a>) -> Name<'a> {
    match &arg.expr.kind {
        CheckedExprKind::Str(text) => Name::Text(text),
        _ if arg.classes.has(Classes::STRING | Classes::TEXT) => Name::Any,
        _ => Name::Number,
    }
}

/// Returns true if built-ins of the library send, or return objects that send.
fn sends(library: Library) -> bool {
    matches!(library, Library::Neighbors | Library::Stigmergy)
}

/// Returns true if objects have a method of that name.
fn is_method(key: &str) -> bool {
    let named = builtin::TABLE.iter().filter(|info| info.name == key);
    named.into_iter().any(|info| info.library.is_object() && info.kind != BuiltinKind::Value)
}
