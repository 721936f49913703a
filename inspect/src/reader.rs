//! The reader of a machine's values, and of the objects they refer to, the nearest first.

use std::collections::{BTreeSet, VecDeque};

use bittybuzz_compiler::symbols::{LocalPlace, Symbols};
use bittybuzz_vm_core::builtin::{self, Library};
use bittybuzz_vm_core::inspect::{ClosureParts, ValueKind};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Value, Vm};

use crate::object::{Limits, Object, Objects};
use crate::value::{Named, ObjectId, ScriptValue};

/// The state of an inspection.
pub struct MachineReader<'a, P: Profile, C: ByteCode, const SLOTS: usize> {
    pub vm: &'a Vm<P, C, SLOTS>,
    /// The symbols of the machine's script.
    pub symbols: Option<&'a Symbols>,
    limits: Limits,
    /// Objects that were found, to expand each only once.
    met: BTreeSet<ObjectId>,
    /// Objects to expand, with their depth.
    waiting: VecDeque<(ObjectId, Value<P>, usize)>,
    /// The depth of the objects that the current values refer to.
    depth: usize,
}

impl<'a, P: Profile, C: ByteCode, const SLOTS: usize> MachineReader<'a, P, C, SLOTS> {
    pub fn new(
        vm: &'a Vm<P, C, SLOTS>,
        symbols: Option<&'a Symbols>,
        limits: Limits,
    ) -> MachineReader<'a, P, C, SLOTS> {
        let hash = vm.header().map(|header| header.hash());
        let symbols = symbols.filter(|symbols| Some(symbols.script_hash) == hash);
        let (met, waiting) = (BTreeSet::new(), VecDeque::new());
        MachineReader { vm, symbols, limits, met, waiting, depth: 1 }
    }

    /// Returns the globals of the script.
    pub fn globals(&mut self) -> Vec<Named> {
        let (vm, symbols) = (self.vm, self.symbols);
        let values = (0..).map_while(|number| Some((number, vm.global(number)?)));
        let names = symbols.map_or(&[][..], |symbols| &symbols.globals);
        let named = values.map(|(number, value)| {
            let name = names.get(usize::from(number)).cloned();
            let name = name.unwrap_or_else(|| format!("global {number}"));
            Named { name, value: self.value(value) }
        });
        named.collect()
    }

    /// Converts a value. The objects that it refers to are expanded later.
    pub fn value(&mut self, value: Value<P>) -> ScriptValue {
        match self.vm.kind(value) {
            ValueKind::Nil => ScriptValue::Nil,
            ValueKind::Unset => ScriptValue::Unset,
            ValueKind::Int(int) => ScriptValue::Int(int),
            ValueKind::Float(float) => ScriptValue::Float(float),
            ValueKind::String(number) => self.constant(number, value),
            ValueKind::Text(_) => ScriptValue::String(self.text(value)),
            ValueKind::Table(cell) | ValueKind::Snapshot(cell) => {
                ScriptValue::Table(self.object_id(cell, value))
            }
            ValueKind::Closure(cell) | ValueKind::Bound(cell) => {
                ScriptValue::Closure(self.object_id(cell, value))
            }
            ValueKind::Function(number) => ScriptValue::Function(self.function(number)),
            ValueKind::Builtin(number) => ScriptValue::Builtin(builtin_name(number)),
            ValueKind::Robot(number) => ScriptValue::RobotFunction(self.import(number)),
            ValueKind::Library(library) => ScriptValue::Library(library_name(library)),
            ValueKind::Swarm(number) => ScriptValue::Swarm(number),
            ValueKind::Stigmergy(number) => ScriptValue::Stigmergy(number),
        }
    }

    /// Returns the name of a function of the script.
    pub fn function(&self, number: u16) -> String {
        let functions = self.symbols.map_or(&[][..], |symbols| &symbols.functions);
        let known = functions.get(usize::from(number));
        known.map_or_else(|| format!("function {number}"), |function| function.name.clone())
    }

    /// Returns the name of an imported robot function.
    pub fn import(&self, number: u16) -> String {
        let imports = self.symbols.map_or(&[][..], |symbols| &symbols.imports);
        let known = imports.get(usize::from(number));
        known.map_or_else(|| format!("robot function {number}"), Clone::clone)
    }

    /// Expands the objects that were found, within the limits.
    pub fn expand(mut self) -> Objects {
        let mut objects = Objects::new();
        let mut left = self.limits.values;
        while let Some((id, value, depth)) = self.waiting.pop_front() {
            self.depth = depth + 1;
            let object = match self.vm.closure(value) {
                Some(parts) => self.closure(value, parts, &mut left),
                None => self.table(value, &mut left),
            };
            objects.insert(id, object);
        }
        objects
    }

    fn object_id(&mut self, cell: u16, value: Value<P>) -> ObjectId {
        let id = ObjectId(cell);
        if self.depth <= self.limits.depth && self.met.insert(id) {
            self.waiting.push_back((id, value, self.depth));
        }
        id
    }

    fn table(&mut self, table: Value<P>, left: &mut usize) -> Object {
        let vm = self.vm;
        let mut all = vm.entries(table);
        let mut entries = Vec::new();
        for [key, value] in all.by_ref().take(*left) {
            entries.push((self.value(key), self.value(value)));
        }
        *left -= entries.len();
        Object::Table { entries, left_out: all.count() }
    }

    fn closure(&mut self, value: Value<P>, parts: ClosureParts<P>, left: &mut usize) -> Object {
        let self_value = self.value(parts.self_value);
        let kinds = (self.vm.kind(value), self.vm.kind(parts.function));
        let (ValueKind::Closure(_), ValueKind::Function(number)) = kinds else {
            return Object::Bound { function: self.value(parts.function), self_value };
        };
        let names = self.capture_names(number, value, parts.slots);
        let values = (0..).map_while(|number| u16::try_from(number).ok()).zip(names).take(*left);
        let captures: Vec<Named> = values
            .map(|(number, name)| {
                let value = self.vm.captured(value, number);
                Named { name, value: self.value(value) }
            })
            .collect();
        *left -= captures.len();
        Object::Closure { function: self.function(number), self_value, captures }
    }

    /// Returns the names of captured values, by their numbers. Without symbols, nil values at the
    /// end cannot be distinguished from unused slots and are left out.
    fn capture_names(&self, function: u16, closure: Value<P>, slots: usize) -> Vec<String> {
        let functions = self.symbols.map(|symbols| &symbols.functions);
        let Some(known) = functions.and_then(|all| all.get(usize::from(function))) else {
            let slots = u16::try_from(slots).expect("an instruction counts the slots in a byte");
            let is_there = |number: &u16| !self.vm.captured(closure, *number).is_nil();
            let count = (0..slots).rev().find(is_there).map_or(0, |last| last + 1);
            return (0..count).map(|number| format!("captured {number}")).collect();
        };
        let mut names: Vec<(u16, &str)> = known
            .locals
            .iter()
            .filter_map(|local| match local.place {
                LocalPlace::Capture(number) => Some((number, local.name.as_str())),
                LocalPlace::Frame(_) => None,
            })
            .collect();
        names.sort_unstable();
        names.into_iter().map(|(_, name)| name.to_owned()).collect()
    }

    fn constant(&self, number: u16, value: Value<P>) -> ScriptValue {
        let own = builtin::STRINGS.get(usize::from(number)).copied();
        if let Some(text) = self.symbols.and_then(|symbols| symbols.string(number)).or(own) {
            return ScriptValue::String(text.to_owned());
        }
        match self.vm.header().is_some_and(|header| header.has_text()) {
            true => ScriptValue::String(self.text(value)),
            false => ScriptValue::UnknownString(number),
        }
    }

    fn text(&self, value: Value<P>) -> String {
        // A message may name a string that the image does not have.
        let bytes: Vec<u8> =
            self.vm.text(value).map_or_else(Vec::new, |text| text.bytes().collect());
        String::from_utf8_lossy(&bytes).into_owned()
    }
}

/// Returns the name of a built-in, as written in scripts.
pub fn builtin_name(number: u8) -> String {
    match builtin::info(number) {
        Some(info) if info.library == Library::Global => info.name.to_owned(),
        Some(info) => format!("{}.{}", library_name(info.library), info.name),
        None => format!("built-in {number}"),
    }
}

/// Returns the name of a library, as written in scripts, or a term for an object without a name.
fn library_name(library: Library) -> &'static str {
    match library {
        Library::Rng => "math.rng",
        Library::SwarmObject => "swarm object",
        Library::StigmergyObject => "stigmergy object",
        Library::Snapshot => "snapshot",
        Library::Global => "global",
        _ => library.global_name().expect("scripts know the other libraries by a name"),
    }
}
