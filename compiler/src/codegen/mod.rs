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
//! This module walks the syntax tree and decides which values to compute. [`asm`](crate::asm) encodes the
//! instructions, counts the stack, and keeps the rules of the verifier. The importer of `.bo` files
//! has no syntax tree and uses the same assembler.
//!
//! Strings are numbered by the source alone, so that robots of different kinds agree on the
//! numbers that travel in messages.

mod call;
pub(crate) mod classes;
mod condition;
mod expression;
pub mod fold;
mod function;
mod generator;
mod globals;
mod locals;
mod operands;
mod own_strings;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::iter;

use bittybuzz_vm_core::builtin::{self, Feature, Library};
use bittybuzz_vm_core::hash::name_hash;
use bittybuzz_vm_core::image::{ALL_CLASSES, EntryPoint};

use crate::asm::{AsmError, AsmErrorKind, FunctionCode};
use crate::check::names::Meanings;
use crate::check::tree::{FunctionId, NameId, ResolvedScript};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::image::{ENTRIES, ImageContent};
use crate::limits;
use crate::profile::NumberProfile;
use crate::source::{FileId, Span};
use crate::stigmergies::StigmergyNumbers;
use crate::strings::StringTable;
use generator::Generator;
pub use locals::LocalRange;

/// The result of the code generator.
#[derive(Debug, Clone)]
pub struct Generated {
    /// The parts of the image, complete except for the script hash.
    pub parts: ImageContent,
    /// The functions, by number.
    pub functions: Vec<SourceFunction>,
    /// The locals of each function, by its number.
    pub locals: Vec<Vec<LocalRange>>,
    /// The offsets of the statements in each function, ascending, and their sources.
    pub statements: Vec<Vec<(usize, Span)>>,
    /// Names of the globals, by number.
    pub globals: Vec<String>,
    /// The first occurrence of each global, in the order of the source.
    pub first_uses: Vec<Span>,
    /// Names of the imported robot functions, by number.
    pub imports: Vec<String>,
    /// Libraries whose members the machine may have to find by name.
    pub libraries: BTreeSet<Library>,
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

/// Functions that are added to a script which already runs.
pub struct AddedFunctions {
    /// The script with these functions. Names and functions of the script have their numbers.
    pub program: ResolvedScript,
    /// The strings in their source.
    pub strings: BTreeSet<String>,
}

/// Generates code for a program without errors. `strings` are all strings of the source.
pub fn generate(
    program: ResolvedScript,
    meanings: &Meanings<'_>,
    profile: NumberProfile,
    strings: &BTreeSet<String>,
    stigmergies: &StigmergyNumbers,
) -> Result<Generated, Vec<Diagnostic>> {
    generate_with(program, None, meanings, profile, strings, stigmergies)
}

/// Generates code as [`generate`] does, and appends functions. The functions of the script have the
/// same code as without them, and all numbers remain: of functions, globals, strings and imports.
pub fn generate_with(
    mut program: ResolvedScript,
    added: Option<AddedFunctions>,
    meanings: &Meanings<'_>,
    profile: NumberProfile,
    strings: &BTreeSet<String>,
    stigmergies: &StigmergyNumbers,
) -> Result<Generated, Vec<Diagnostic>> {
    let mut names: BTreeSet<&str> = strings.iter().map(String::as_str).collect();
    // A library that is used as a value needs the names of all its members.
    for library in meanings.escaped() {
        names.extend(builtin::TABLE.iter().filter(|b| b.library == *library).map(|b| b.name));
    }
    let holds_own_strings = own_strings::may_observe_builtin_strings(&program, meanings);
    let table = StringTable::new(names);
    let sent = classes::sent(&program, meanings, profile, stigmergies);
    let mut classes = sent.table(table.script());
    let sending = sent.features(&classes);
    fold::fold(&mut program, meanings, profile);
    let globals = globals::number(&program, meanings);
    let first_uses = first_uses(&program, &globals);
    let (mut mentioned, mut more) = (Cow::Borrowed(strings), Vec::new());
    if let Some(added) = added {
        mentioned.to_mut().extend(added.strings);
        program = added.program;
        fold::fold(&mut program, meanings, profile);
        more.clone_from(&program.added);
    }
    let mut more = more.into_iter();
    let mut generator = Generator {
        program: &program,
        meanings,
        profile,
        strings: table,
        mentioned: &mentioned,
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
    let mut entries = ENTRIES.map(|name| generator.entry(name).to_count());
    let mut codes: Vec<FunctionCode> = Vec::new();
    let (mut locals, mut statements) = (Vec::new(), Vec::new());
    let mut filling = program.host.step;
    loop {
        let Some(id) = generator.functions.get(codes.len()).copied() else {
            // The function that fills tables comes last, and all others keep their numbers.
            let Some(id) = filling.take() else {
                // Each that was added comes after all of the script and of those before it.
                let Some(id) = more.next() else { break };
                generator.function(id);
                continue;
            };
            let step = EntryPoint::Function(generator.function(id) as u16);
            let places = ENTRIES.iter().zip(&mut entries);
            let entry = places.into_iter().find(|(name, _)| **name == "step");
            entry.into_iter().for_each(|(_, entry)| *entry = step.to_count());
            continue;
        };
        match function::generate(&mut generator, id) {
            Ok(generated) => {
                codes.push(generated.code);
                locals.push(generated.locals);
                statements.push(generated.statements);
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
    // The rows after the first are in descending order of the strings. Nothing is known about the
    // values that are sent under added ones.
    if !classes.is_empty() {
        let new = generator.strings.script().len() + 1 - classes.len();
        classes.splice(1..1, iter::repeat_n(ALL_CLASSES, new));
    }
    let has_stigmergies = generator.features & Feature::Stigmergy as u8 != 0;
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
        stigmergies: stigmergies.table().filter(|_| has_stigmergies),
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
        statements,
        globals: globals.iter().map(|id| program.name(*id).text.clone()).collect(),
        first_uses,
        libraries: generator.libraries,
        imports: generator.imports,
    })
}

fn first_uses(program: &ResolvedScript, globals: &[NameId]) -> Vec<Span> {
    let names = globals.iter().map(|id| program.name(*id));
    let mut spans: Vec<Span> = names
        .map(|name| {
            let uses = name.reads.iter().chain(&name.calls).chain(&name.writes);
            *uses.min_by_key(|span| place(span)).expect("the script assigns every global variable")
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

fn asm_diagnostic(error: AsmError) -> Diagnostic {
    let (code, message, help) = match error.kind {
        AsmErrorKind::TooManyParameters => (
            DiagnosticCode::TooManyParameters,
            format!("a function can have at most {} parameters", limits::PARAMETERS_MAX),
            "pass a table",
        ),
        AsmErrorKind::TooDeep => (
            DiagnosticCode::FunctionTooDeep,
            format!("this function needs more than {} values at a time", limits::DEPTH_MAX),
            "use fewer local variables, shorter argument lists, or a table",
        ),
        AsmErrorKind::TooManyArguments => (
            DiagnosticCode::TooManyArguments,
            format!("a call can pass at most {} arguments", limits::ARGUMENTS_MAX),
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
