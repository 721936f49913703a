//! The state that all functions of a program share while they are generated: the numbers of
//! functions, globals, strings and imports, and the features that the code requires.

use std::collections::{BTreeMap, BTreeSet};

use bittybuzz_vm_core::builtin::{self, Library};
use bittybuzz_vm_core::image::EntryPoint;

use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{FunctionId, NameId, ResolvedScript};
use crate::diagnostic::Diagnostic;
use crate::image::LibraryRow;
use crate::profile::NumberProfile;
use crate::source::Span;
use crate::strings::StringTable;

/// The state that all functions of a program share while they are generated.
pub struct Generator<'a> {
    pub program: &'a ResolvedScript,
    pub meanings: &'a Meanings<'a>,
    pub profile: NumberProfile,
    pub strings: StringTable,
    /// The strings of the source.
    pub mentioned: &'a BTreeSet<String>,
    pub globals: BTreeMap<NameId, usize>,
    /// Functions by number. Those after the function being generated are still to be generated.
    pub functions: Vec<FunctionId>,
    pub numbers: BTreeMap<FunctionId, usize>,
    pub imports: Vec<String>,
    pub features: u8,
    /// Libraries whose members the machine may have to find by name.
    pub libraries: BTreeSet<Library>,
    /// Objects that built-ins return, such as `swarm.create(1)` and `neighbors.kin()`. Their
    /// members are found by name, too.
    pub objects: BTreeSet<Library>,
    /// True if the script may compare strings by order.
    pub orders_strings: bool,
    pub diagnostics: Vec<Diagnostic>,
}

impl Generator<'_> {
    pub fn entry(&mut self, name: &str) -> EntryPoint {
        let Some(id) = self.program.find_name(name) else { return EntryPoint::None };
        match self.meanings.of(id) {
            Meaning::Function(function) => EntryPoint::Function(self.function(function) as u16),
            Meaning::Global => EntryPoint::Global(self.global(id) as u16),
            _ => EntryPoint::None,
        }
    }

    /// Returns the number of a function. The first use puts the function into the image.
    pub fn function(&mut self, id: FunctionId) -> i32 {
        let next = self.functions.len();
        let number = *self.numbers.entry(id).or_insert(next);
        if number == next {
            self.functions.push(id);
        }
        operand(number)
    }

    pub fn import(&mut self, name: &str) -> i32 {
        let number = self.imports.iter().position(|known| known == name).unwrap_or_else(|| {
            self.imports.push(name.to_owned());
            self.imports.len() - 1
        });
        operand(number)
    }

    /// Returns the number of a string. All strings of the source are in the table; one of an added
    /// function may be new.
    pub fn string(&mut self, text: &str) -> i32 {
        operand(self.strings.number_or_add(text))
    }

    pub fn global(&self, name: NameId) -> i32 {
        operand(*self.globals.get(&name).expect("every global variable has a number"))
    }

    /// Returns the number of a built-in that the code uses, and records the requirements of the
    /// built-in: its feature, the objects that it returns, and the order of strings if it compares
    /// them.
    pub fn builtin(&mut self, info: &builtin::BuiltinInfo) -> i32 {
        self.features |= info.feature as u8;
        match info.number {
            builtin::MIN | builtin::MAX => self.orders_strings = true,
            builtin::RNG => {
                self.libraries.insert(Library::Rng);
            }
            builtin::SWARM_CREATE
            | builtin::SWARM_UNION
            | builtin::SWARM_INTERSECTION
            | builtin::SWARM_DIFFERENCE
            | builtin::SWARM_OTHERS => {
                self.objects.insert(Library::SwarmObject);
            }
            builtin::STIGMERGY_CREATE => {
                self.objects.insert(Library::StigmergyObject);
            }
            builtin::NEIGHBORS_MAP
            | builtin::NEIGHBORS_FILTER
            | builtin::NEIGHBORS_KIN
            | builtin::NEIGHBORS_NONKIN => {
                self.objects.insert(Library::Snapshot);
            }
            _ => {}
        }
        i32::from(info.number)
    }

    /// Returns the number of a library that the code uses as a value, and records the library.
    pub fn library(&mut self, library: Library) -> i32 {
        self.libraries.insert(library);
        i32::from(library as u8)
    }

    /// Returns the rows of the library table, in which the machine looks up members by name at run
    /// time. A library that the script uses as a value needs all its members; a library that is
    /// only modified needs the modified ones; objects and `pos` need those whose name occurs in the
    /// script.
    pub fn library_rows(&mut self) -> Vec<LibraryRow> {
        let meanings = self.meanings;
        let mut done = BTreeSet::new();
        let mut rows = Vec::new();
        // `builtin` below may add another library, so the loop runs until none is left.
        while let Some(library) =
            self.libraries.union(&self.objects).copied().find(|library| !done.contains(library))
        {
            done.insert(library);
            for info in meanings.robots().members(library) {
                let by_name = library == Library::Position || self.objects.contains(&library);
                let wanted = meanings.escaped().contains(&library)
                    || meanings.is_assigned(library, info.name)
                    || (by_name && self.mentioned.contains(info.name));
                let number = self.strings.number(info.name);
                // A member whose name the script cannot produce is never looked up.
                if let Some(string) = number.filter(|_| wanted) {
                    self.builtin(info);
                    // A number above 65535 makes the strings more than an image can count, which
                    // `ImageContent::write` refuses.
                    let string = string as u16;
                    rows.push(LibraryRow { library: library as u8, string, builtin: info.number });
                }
            }
        }
        rows
    }
}

/// Returns the number as an operand; the assembler refuses one that does not fit.
pub fn operand(number: usize) -> i32 {
    i32::try_from(number).unwrap_or(i32::MAX)
}

/// Returns the span of code that no line of the script shows: the start of the script.
pub fn nowhere() -> Span {
    Span::default()
}
