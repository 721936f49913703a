//! Compiles questions: expressions that a robot evaluates while its script runs.
//!
//! A question becomes a function at the end of the script's image. The image of the script has no
//! room for it, so the machine continues with a longer image. Nothing that the machine remembers may
//! change its meaning then: functions, globals, strings and robot functions keep their numbers, and
//! the functions of the script keep every byte of their code. The script is therefore compiled as if
//! there were no question, and the analyses of the whole program do not see it.
//!
//! The value of the question is the argument of a call of `log`, the last one of the function.

use std::collections::BTreeSet;
use std::fmt;

use bittybuzz_vm_core::builtin::Feature;

use crate::ast::{Stmt, StmtKind};
use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{
    CheckedExpr, CheckedExprKind, CheckedStmt, CheckedStmtKind, NameId, ResolvedScript, each_stmt,
};
use crate::check::{self, robots::KnownRobots};
use crate::codegen::{self, AddedFunctions};
use crate::codes::DiagnosticCode;
use crate::compile::{Options, make_symbols, script_hash};
use crate::diagnostic::{Diagnostic, Severity};
use crate::parser::{Alone, parse_again, parse_alone};
use crate::profile::NumberProfile;
use crate::source::{FileId, SourceMap, Span};
use crate::stigmergies::StigmergyNumbers;
use crate::symbols::Symbols;

/// The greatest length of a question in bytes.
pub const QUESTION_BYTES_MAX: usize = 2000;

/// The path of a question where files have paths.
pub const FILE: &str = "<question>";

/// The name of a question where functions have names.
const NAME: &str = "the question";

/// The name under which a question calls the built-in `log`. No script can write it.
const LOG: &str = "log of the question";

/// The features that concern other robots. The machine decides by those of the script if it takes
/// part in the network.
const NETWORK: u8 = Feature::Neighbors as u8
    | Feature::Swarm as u8
    | Feature::Stigmergy as u8
    | Feature::StigmergyTable as u8
    | Feature::LongMessages as u8;

/// An image with questions at its end.
#[derive(Debug, Clone)]
pub struct ExtendedImage {
    pub image: Vec<u8>,
    pub symbols: Symbols,
    /// The files of the script, and one for each question.
    pub sources: SourceMap,
}

/// A reason why a question cannot be evaluated on a robot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum QuestionError {
    /// The text of the script is not known.
    NoSource,
    /// The text of the script, as it is compiled now, gives another image than the robot's.
    OtherImage,
    /// The question has no token.
    Empty,
    /// The question is longer than [`QUESTION_BYTES_MAX`].
    TooLong,
    /// The question has a `return`.
    Return,
    /// The question defines a function with a name.
    Definition,
    /// The question assigns a name that is no global variable of the script.
    NotGlobal(String),
    /// The question uses a library as a value, which the script does not.
    Library,
    /// The question needs the network, in which a robot with this script takes no part.
    Network,
    /// The question has a mistake at a line and a column.
    Mistake { line: u32, column: u32, message: String, help: Option<String> },
}

impl fmt::Display for QuestionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            QuestionError::NoSource => {
                "the text of the robot's script is not known, so nothing can be asked"
            }
            QuestionError::OtherImage => {
                "the robot's image was not compiled from this text, so nothing can be asked"
            }
            QuestionError::Empty => "an expression or a call is needed, such as `id` or `f(2)`",
            QuestionError::TooLong => {
                return write!(f, "at most {QUESTION_BYTES_MAX} bytes can be asked at once");
            }
            QuestionError::Return => {
                "`return` belongs into a function: write the expression without it"
            }
            QuestionError::Definition => {
                "a function can only be defined in the script: write the function there"
            }
            QuestionError::NotGlobal(name) => {
                return write!(
                    f,
                    "`{name}` cannot be assigned: it is no global variable that the script assigns"
                );
            }
            QuestionError::Library => {
                "a library can only be asked for one of its members, such as `math.pi`"
            }
            QuestionError::Network => {
                "the script does not use neighbors, a swarm or a stigmergy in this way, so its \
                 robots take no part in it"
            }
            QuestionError::Mistake { line, column, message, help } => {
                match line {
                    1 => write!(f, "column {column}: {message}")?,
                    _ => write!(f, "line {line}, column {column}: {message}")?,
                }
                return help.iter().try_for_each(|help| write!(f, "; {help}"));
            }
        })
    }
}

impl std::error::Error for QuestionError {}

/// Appends `questions` to the image that a script was compiled to. The last one may have mistakes; the
/// robot was asked the others before.
pub fn extend(
    sources: &SourceMap,
    image: &[u8],
    options: &Options,
    questions: &[&str],
) -> Result<ExtendedImage, QuestionError> {
    if sources.files().next().is_none() {
        return Err(QuestionError::NoSource);
    }
    let mut parsed = parse_again(sources.clone());
    let profile = options.effective_profile();
    let robots = KnownRobots { target: options.robot.as_ref(), known: &options.robots };
    let arithmetic = options.arithmetic();
    let (hidden, outside) = (parsed.hidden, &options.outside);
    let checked = check::check(&parsed.script, robots, profile, arithmetic, hidden, outside);
    let has_errors = |found: &[Diagnostic]| found.iter().any(is_error);
    if has_errors(&parsed.diagnostics) || has_errors(&checked.diagnostics) {
        return Err(QuestionError::OtherImage);
    }
    let stigmergies = StigmergyNumbers::find(&parsed.script);
    let hash = script_hash(parsed.token_hash, profile, &stigmergies);
    let (program, mut meanings) = (checked.program, checked.meanings);
    let strings = &parsed.strings;
    let other = |_| QuestionError::OtherImage;
    let mut own = codegen::generate(program.clone(), &meanings, profile, strings, &stigmergies)
        .map_err(other)?;
    own.parts.script_hash = hash;
    if own.parts.write().ok().is_none_or(|own| own.bytes != image) {
        return Err(QuestionError::OtherImage);
    }

    let mut added = AddedFunctions { program: program.clone(), strings: BTreeSet::new() };
    let log = added.program.intern(LOG);
    for (number, question) in questions.iter().enumerate() {
        if question.len() > QUESTION_BYTES_MAX {
            return Err(QuestionError::TooLong);
        }
        let file = parsed.sources.add(FILE, (*question).to_owned());
        let mistake = |found: Vec<Diagnostic>| mistake(&parsed.sources, &found);
        let alone = parse_alone(&parsed.sources, file).map_err(mistake)?;
        add(&mut added.program, &mut meanings, log, &alone).map_err(|error| match error {
            Wrong::Mistakes(found) => mistake(found),
            Wrong::Question(error) => error,
        })?;
        added.strings.extend(alone.strings);
        if number + 1 == questions.len() {
            let found = mistakes(&added.program, &meanings, profile, arithmetic, file);
            if !found.is_empty() {
                return Err(mistake(found));
            }
        }
    }
    let sources = parsed.sources;
    let mut generated = codegen::generate_with(
        program,
        Some(added),
        &meanings,
        profile,
        &parsed.strings,
        &stigmergies,
    )
    .map_err(|found| mistake(&sources, &found))?;
    if generated.libraries != own.libraries {
        return Err(QuestionError::Library);
    }
    if (generated.parts.features ^ own.parts.features) & NETWORK != 0 {
        return Err(QuestionError::Network);
    }
    generated.parts.script_hash = hash;
    let written = generated.parts.write().map_err(|error| QuestionError::Mistake {
        line: 1,
        column: 1,
        message: error.to_string(),
        help: None,
    })?;
    let is_same =
        |(own, new): (&crate::asm::FunctionCode, &crate::asm::FunctionCode)| own.bytes == new.bytes;
    if !own.parts.functions.iter().zip(&generated.parts.functions).all(is_same) {
        return Err(QuestionError::OtherImage);
    }
    let symbols = make_symbols(&generated, &written, &sources, profile, options);
    Ok(ExtendedImage { image: written.bytes, symbols, sources })
}

/// A reason why a question cannot be added to a script.
enum Wrong {
    Mistakes(Vec<Diagnostic>),
    Question(QuestionError),
}

/// Adds a question to a script as a function, which logs its value at the end.
fn add(
    program: &mut ResolvedScript,
    meanings: &mut Meanings<'_>,
    log: NameId,
    alone: &Alone,
) -> Result<(), Wrong> {
    let stmts = &alone.function.body.stmts;
    let refused = |error| Err(Wrong::Question(error));
    if stmts.is_empty() {
        return refused(QuestionError::Empty);
    }
    let is_definition = |stmt: &Stmt| matches!(stmt.kind, StmtKind::Function { .. });
    if stmts.iter().any(is_definition) {
        return refused(QuestionError::Definition);
    }
    let first = program.functions.len();
    let found = check::resolve::add(program, NAME, &alone.function);
    meanings.extend(program, log);
    if found.iter().any(is_error) {
        return Err(Wrong::Mistakes(found));
    }
    for function in &program.functions[first..] {
        let (mut has_return, mut wrong) = (false, None);
        each_stmt(&function.body, &mut |stmt| match &stmt.kind {
            CheckedStmtKind::Return(_) => has_return = true,
            CheckedStmtKind::Assign { target, .. } => {
                if let CheckedExprKind::Name(name) = target.kind
                    && meanings.of(name) != Meaning::Global
                {
                    wrong = Some(name);
                }
            }
            _ => {}
        });
        if let Some(name) = wrong {
            let text = program.name(name).text.clone();
            return refused(QuestionError::NotGlobal(text));
        }
        // An expression is parsed as a `return`; a lambda may have some of its own.
        let is_expression = alone.is_expression || function.name.is_none();
        if has_return && !is_expression {
            return refused(QuestionError::Return);
        }
    }
    let body = &mut program.functions[first].body;
    let value = match body.last().map(|last| &last.kind) {
        Some(CheckedStmtKind::Return(Some(value)) | CheckedStmtKind::Call(value)) => {
            let value = value.clone();
            body.pop();
            vec![value]
        }
        _ => Vec::new(),
    };
    let span = alone.function.span;
    let callee = Box::new(CheckedExpr { kind: CheckedExprKind::Name(log), span });
    let call = CheckedExpr { kind: CheckedExprKind::Call { callee, args: value }, span };
    body.push(CheckedStmt { kind: CheckedStmtKind::Call(call), span });
    Ok(())
}

/// Returns the mistakes of the question in a file.
fn mistakes(
    program: &ResolvedScript,
    meanings: &Meanings<'_>,
    profile: NumberProfile,
    arithmetic: NumberProfile,
    file: FileId,
) -> Vec<Diagnostic> {
    let mut found = check::check_added(program, meanings, profile, arithmetic);
    found.retain(|one| {
        let is_unknown = one.code == DiagnosticCode::NeverAssigned;
        one.span.file == file && (is_error(one) || is_unknown)
    });
    found
}

fn is_error(found: &Diagnostic) -> bool {
    found.severity() == Severity::Error
}

/// Returns the first mistake.
fn mistake(sources: &SourceMap, found: &[Diagnostic]) -> QuestionError {
    let first =
        found.iter().filter(|one| is_error(one) || one.code == DiagnosticCode::NeverAssigned);
    let first = first.min_by_key(|one| one.span.start);
    let span = first.map_or(Span::default(), |one| one.span);
    let place = sources.line_column(span);
    QuestionError::Mistake {
        line: place.line,
        column: place.column,
        message: first.map_or_else(String::new, |one| one.message.clone()),
        help: first.and_then(|one| one.help.clone()),
    }
}
