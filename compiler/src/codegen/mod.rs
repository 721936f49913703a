//! Code generation: turns the checked program into the parts of an image.
//!
//! The checks report every mistake of the script before this stage. Code generation can only fail
//! at the limits of the image format, such as the number of parameters.
//!
//! # Whole program
//! A script is small and complete, and the compiler sees all of it, includes too. The form of the
//! code depends on this knowledge:
//!
//! * A function is generated when the code first refers to it. Unused functions are not in the
//!   image.
//! * A function whose name is never reassigned is called by its number, without a look-up by name.
//! * A member of a library that the script does not modify is a built-in, without a table.
//! * The globals that are used most get the numbers with the shortest instructions.
//!
//! # Division of labor
//! This module walks the syntax tree and decides which values to compute. [`asm`] encodes the
//! instructions, counts the stack, and keeps the rules of the verifier. The importer of `.bo` files
//! has no syntax tree and uses the same assembler.
//!
//! Strings are numbered by the source alone, so that robots of different kinds agree on the
//! numbers that travel in messages.

pub mod asm;
mod call;
mod classes;
mod condition;
pub mod constant;
mod expression;
pub mod fold;
mod function;
mod globals;
mod locals;
mod operands;
mod own_strings;

use std::collections::{BTreeMap, BTreeSet};

use bittybuzz_vm_core::builtin::{self, Feature, Library};
use bittybuzz_vm_core::hash::name_hash;
use bittybuzz_vm_core::image::EntryPoint;

use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{FunctionId, NameId, ResolvedScript};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::image::{ImageContent, LibraryRow};
use crate::source::{FileId, Span};
use crate::strings::StringTable;
use asm::{AsmError, AsmErrorKind, FunctionCode};
use constant::NumberProfile;
pub use locals::LocalRange;

/// The functions that the host calls, in the order of the image header.
pub const ENTRIES: [&str; 4] = ["init", "step", "reset", "destroy"];

/// The result of the code generator.
#[derive(Debug, Clone)]
pub struct Generated {
    /// The parts of the image, complete except for the script hash.
    pub parts: ImageContent,
    /// The functions, by number.
    pub functions: Vec<SourceFunction>,
    /// The locals of each function, by its number.
    pub locals: Vec<Vec<LocalRange>>,
    /// Names of the globals, by number.
    pub globals: Vec<String>,
    /// The first occurrence of each global, in the order of the source.
    pub first_uses: Vec<Span>,
    /// Names of the imported robot functions, by number.
    pub imports: Vec<String>,
}

/// A function in the source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceFunction {
    /// `None` for a lambda.
    pub name: Option<String>,
    pub span: Span,
}

/// The features whose built-ins send messages.
const NETWORK: u8 = Feature::Neighbors as u8 | Feature::Swarm as u8 | Feature::Stigmergy as u8;

/// The name under which the global code appears among the functions.
pub const GLOBAL_CODE: &str = "global code";

/// Generates code for a program without errors. `strings` are all strings of the source.
pub fn generate(
    mut program: ResolvedScript,
    meanings: &Meanings<'_>,
    profile: NumberProfile,
    strings: &BTreeSet<String>,
) -> Result<Generated, Vec<Diagnostic>> {
    let mut names: BTreeSet<&str> = strings.iter().map(String::as_str).collect();
    // A library that is used as a value needs the names of all its members.
    for library in meanings.escaped() {
        names.extend(builtin::TABLE.iter().filter(|b| b.library == *library).map(|b| b.name));
    }
    let holds_own_strings = own_strings::may_observe_builtin_strings(&program, meanings);
    let table = StringTable::new(names);
    let sent = classes::sent(&program, meanings, profile);
    let mut classes = sent.table(table.script());
    let sending = sent.features(&classes);
    fold::fold(&mut program, meanings, profile);
    let globals = globals::number(&program, meanings);
    let mut generator = Generator {
        program: &program,
        meanings,
        profile,
        strings: table,
        mentioned: strings,
        globals: globals.iter().enumerate().map(|(number, id)| (*id, number)).collect(),
        functions: vec![FunctionId::GLOBAL],
        numbers: BTreeMap::from([(FunctionId::GLOBAL, 0)]),
        imports: Vec::new(),
        features: 0,
        libraries: BTreeSet::new(),
        objects: BTreeSet::new(),
        orders_strings: false,
        diagnostics: Vec::new(),
    };
    // The entry points enter the list of functions first. The loop below then generates every
    // function of the list, which grows as the code refers to more functions.
    let entries = ENTRIES.map(|name| generator.entry(name).to_count());
    let mut codes: Vec<FunctionCode> = Vec::new();
    let mut locals = Vec::new();
    while let Some(id) = generator.functions.get(codes.len()).copied() {
        match function::generate(&mut generator, id) {
            Ok((code, of_function)) => {
                codes.push(code);
                locals.push(of_function);
            }
            Err(error) => {
                generator.diagnostics.push(asm_diagnostic(error));
                codes.push(FunctionCode::default());
            }
        }
    }
    if !generator.diagnostics.is_empty() {
        return Err(generator.diagnostics);
    }
    let libraries = generator.library_rows();
    // A script without networking built-ins sends nothing, even if the analysis of its values gave
    // up.
    if generator.features & NETWORK == 0 {
        classes = Vec::new();
    } else {
        generator.features |= sending;
    }
    let text = generator.features & Feature::Strings as u8 != 0;
    // The strings of the script are numbered in their sort order. The order table states how many
    // of the machine's own strings sort before each of them, so only a script that can get such
    // strings needs it.
    let order = generator.orders_strings
        && (holds_own_strings || text)
        && !generator.strings.script().is_empty();
    let parts = ImageContent {
        full: profile == NumberProfile::Full,
        features: generator.features,
        script_hash: 0,
        entries,
        globals: globals.len(),
        imports: generator.imports.iter().map(|name| name_hash(name)).collect(),
        order,
        text,
        libraries,
        classes,
        functions: codes,
        strings: generator.strings,
    };
    Ok(Generated {
        parts,
        functions: generator.functions.iter().map(|id| source_function(&program, *id)).collect(),
        locals,
        globals: globals.iter().map(|id| program.name(*id).text.clone()).collect(),
        first_uses: first_uses(&program, &globals),
        imports: generator.imports,
    })
}

fn first_uses(program: &ResolvedScript, globals: &[NameId]) -> Vec<Span> {
    let names = globals.iter().map(|id| program.name(*id));
    let mut spans: Vec<Span> = names
        .filter_map(|name| {
            let uses = name.reads.iter().chain(&name.calls).chain(&name.writes);
            uses.copied().min_by_key(place)
        })
        .collect();
    spans.sort_by_key(place);
    spans
}

fn place(span: &Span) -> (FileId, u32) {
    (span.file, span.start)
}

fn source_function(program: &ResolvedScript, id: FunctionId) -> SourceFunction {
    let function = program.function(id);
    let global = (id == FunctionId::GLOBAL).then(|| GLOBAL_CODE.to_owned());
    SourceFunction { name: function.name.clone().or(global), span: function.span }
}

/// The state that all functions of a program share while they are generated.
struct Generator<'a> {
    program: &'a ResolvedScript,
    meanings: &'a Meanings<'a>,
    profile: NumberProfile,
    strings: StringTable,
    /// The strings of the source.
    mentioned: &'a BTreeSet<String>,
    globals: BTreeMap<NameId, usize>,
    /// Functions by number. Those after the function being generated are still to be generated.
    functions: Vec<FunctionId>,
    numbers: BTreeMap<FunctionId, usize>,
    imports: Vec<String>,
    features: u8,
    /// Libraries whose members the machine may have to find by name.
    libraries: BTreeSet<Library>,
    /// Objects that built-ins return, such as `swarm.create(1)` and `neighbors.kin()`. Their
    /// members are found by name, too.
    objects: BTreeSet<Library>,
    /// True if the script may compare strings by order.
    orders_strings: bool,
    diagnostics: Vec<Diagnostic>,
}

impl Generator<'_> {
    fn entry(&mut self, name: &str) -> EntryPoint {
        let Some(id) = self.program.find_name(name) else { return EntryPoint::None };
        match self.meanings.of(id) {
            Meaning::Function(function) => EntryPoint::Function(self.function(function) as u16),
            Meaning::Global => match self.globals.get(&id) {
                Some(number) => EntryPoint::Global(*number as u16),
                None => EntryPoint::None,
            },
            _ => EntryPoint::None,
        }
    }

    /// Returns the number of a function. The first use puts the function into the image.
    fn function(&mut self, id: FunctionId) -> i32 {
        let next = self.functions.len();
        let number = *self.numbers.entry(id).or_insert(next);
        if number == next {
            self.functions.push(id);
        }
        operand(number)
    }

    fn import(&mut self, name: &str) -> i32 {
        let number = self.imports.iter().position(|known| known == name).unwrap_or_else(|| {
            self.imports.push(name.to_owned());
            self.imports.len() - 1
        });
        operand(number)
    }

    fn string(&self, text: &str) -> i32 {
        self.strings.number(text).map_or(i32::MAX, i32::from)
    }

    fn global(&self, name: NameId) -> i32 {
        self.globals.get(&name).map_or(i32::MAX, |number| operand(*number))
    }

    /// Returns the number of a built-in that the code uses, and records the requirements of the
    /// built-in: its feature, the objects that it returns, and the order of strings if it compares
    /// them.
    fn builtin(&mut self, info: &builtin::BuiltinInfo) -> i32 {
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
    fn library(&mut self, library: Library) -> i32 {
        self.libraries.insert(library);
        i32::from(library as u8)
    }

    /// Returns the rows of the library table, in which the machine looks up members by name at run
    /// time. A library that the script uses as a value needs all its members; a library that is
    /// only modified needs the modified ones; objects and `pos` need those whose name occurs in the
    /// script.
    fn library_rows(&mut self) -> Vec<LibraryRow> {
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
                if let Some(string) = number.filter(|_| wanted) {
                    self.builtin(info);
                    rows.push(LibraryRow { library: library as u8, string, builtin: info.number });
                }
            }
        }
        rows
    }
}

/// Returns the number as an operand; the assembler refuses one that does not fit.
fn operand(number: usize) -> i32 {
    i32::try_from(number).unwrap_or(i32::MAX)
}

fn asm_diagnostic(error: AsmError) -> Diagnostic {
    let (code, message, help) = match error.kind {
        AsmErrorKind::TooManyParameters => (
            DiagnosticCode::TooManyParameters,
            format!("a function can have at most {} parameters", asm::MAX_PARAMETERS),
            "pass a table",
        ),
        AsmErrorKind::TooDeep => (
            DiagnosticCode::FunctionTooDeep,
            format!("this function needs more than {} values at a time", asm::MAX_DEPTH),
            "use fewer local variables, shorter argument lists, or a table",
        ),
        AsmErrorKind::TooManyArguments => (
            DiagnosticCode::TooManyArguments,
            format!("a call can pass at most {} arguments", asm::MAX_ARGUMENTS),
            "pass a table, or call several times",
        ),
        AsmErrorKind::OperandRange => (
            DiagnosticCode::ImageTooLarge,
            "the script has more names, strings or functions than an image can number".to_owned(),
            "at most 32767 of each are possible",
        ),
        AsmErrorKind::JumpTooFar => (
            DiagnosticCode::FunctionTooLong,
            "the code between here and the end of this statement is too long to jump over"
                .to_owned(),
            "move a part of it into a function",
        ),
        AsmErrorKind::BadOpcode
        | AsmErrorKind::Underflow
        | AsmErrorKind::DepthMismatch
        | AsmErrorKind::BadLabel => (
            DiagnosticCode::Internal,
            format!("the compiler made wrong code here ({:?})", error.kind),
            "this is a mistake in the compiler: please report it with the script",
        ),
    };
    Diagnostic::new(code, error.span, message).help(help)
}

/// Returns the span of code that no line of the script shows: the start of the script.
fn nowhere() -> Span {
    Span::default()
}
