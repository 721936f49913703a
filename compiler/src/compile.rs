//! Compiles a script to an image and its symbols in one call.

use std::path::Path;

use bittybuzz_robot_spec::Robot;
use bittybuzz_vm_core::hash::fnv_1a_from;
use bittybuzz_vm_core::message;

use crate::allow::Allowances;
use crate::check::{self, outside::OutsideUses, robots::KnownRobots};
use crate::codegen::{self, GLOBAL_CODE, Generated, LocalRange, SourceFunction};
use crate::codes::DiagnosticCode;
use crate::comments;
use crate::diagnostic::{Diagnostic, Severity};
use crate::fit::{self, CapacityError};
use crate::image::{CompiledImage, ImageBuildError};
use crate::include::IncludeLoader;
use crate::messages::{MessageCosts, SentMessage};
use crate::parser::{Parsed, parse};
use crate::profile::NumberProfile;
use crate::source::{SourceMap, Span};
use crate::stigmergies::StigmergyNumbers;
use crate::symbols::{self, FORMAT, FunctionSymbol, LineEntry, LocalSymbol, Symbols};

/// The target and settings of a compilation.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The number profile. `None` selects that of the robot, or `full` if no robot is named.
    pub profile: Option<NumberProfile>,
    /// The target robot. If it is `None`, the script may call every function of every known robot.
    pub robot: Option<Robot>,
    /// All known robots.
    pub robots: Vec<Robot>,
    /// The names of the script that are used from outside of it.
    pub outside: OutsideUses,
}

impl Options {
    pub(crate) fn effective_profile(&self) -> NumberProfile {
        let of_robot = self.robot.as_ref().map(|robot| robot.profile);
        self.profile.or(of_robot).unwrap_or(NumberProfile::Full)
    }

    /// Returns the profile for which operations on constants are checked. A script for any robot
    /// may run on one with small numbers, so its operations are checked for `tiny`.
    pub(crate) fn arithmetic(&self) -> NumberProfile {
        match (self.profile, &self.robot) {
            (None, None) => NumberProfile::Tiny,
            _ => self.effective_profile(),
        }
    }
}

/// The result of a compilation.
#[derive(Debug, Clone)]
pub struct Compiled {
    /// The image; `None` if there are errors.
    pub image: Option<Vec<u8>>,
    /// The symbols of the image.
    pub symbols: Option<Symbols>,
    /// The messages that the script sends, in the order of the source; none if there are errors.
    pub messages: Vec<SentMessage>,
    /// Errors and warnings, in the order of the source.
    pub diagnostics: Vec<Diagnostic>,
    /// The script and everything that it includes.
    pub sources: SourceMap,
}

/// Compiles the script `text`; `main` is its path, relative to which includes are searched.
pub fn compile(
    main: &Path,
    text: String,
    loader: &IncludeLoader<'_>,
    options: &Options,
) -> Compiled {
    compile_parsed(parse(main, text, loader), options)
}

/// Compiles a parsed script.
pub fn compile_parsed(parsed: Parsed, options: &Options) -> Compiled {
    let Parsed { script, sources, mut diagnostics, token_hash, strings, hidden } = parsed;
    let profile = options.effective_profile();
    let robots = KnownRobots { target: options.robot.as_ref(), known: &options.robots };
    let checked =
        check::check(&script, robots, profile, options.arithmetic(), hidden, &options.outside);
    let stigmergies = StigmergyNumbers::find(&script);
    let syntax_errors: Vec<Span> = diagnostics
        .iter()
        .filter(|found| found.severity() == Severity::Error)
        .map(|found| found.span)
        .collect();
    // A warning about source with a syntax error would most likely disappear with the error.
    let is_consequence = |found: &Diagnostic| {
        found.severity() == Severity::Warning
            && syntax_errors.iter().any(|error| found.span.contains(*error))
    };
    let found = checked.diagnostics.into_iter().chain(stigmergies.warnings(options.arithmetic()));
    diagnostics.extend(found.filter(|found| !is_consequence(found)));
    let mut image = None;
    let mut symbols = None;
    let mut sent = Vec::new();
    if !diagnostics.iter().any(|diagnostic| diagnostic.severity() == Severity::Error) {
        let hash = script_hash(token_hash, profile, &stigmergies);
        let meanings = &checked.meanings;
        let mut costs = MessageCosts::new(&checked.program, meanings, &stigmergies);
        sent = costs.messages(profile).to_vec();
        diagnostics.extend(costs.warnings(options.profile));
        let built = codegen::generate(checked.program, meanings, profile, &strings, &stigmergies)
            .and_then(|mut generated| {
                generated.parts.script_hash = hash;
                let written = write(&generated).map_err(|error| vec![*error])?;
                let refused =
                    robots.target.map_or(Vec::new(), |robot| fit(&generated, &written, robot));
                if refused.is_empty() { Ok((generated, written)) } else { Err(refused) }
            });
        match built {
            Ok((generated, written)) => {
                symbols = Some(make_symbols(&generated, &written, &sources, profile, options));
                image = Some(written.bytes);
            }
            Err(errors) => diagnostics.extend(errors),
        }
    }
    diagnostics.extend(comments::warnings(&sources));
    let allowances = Allowances::read(&sources);
    diagnostics.retain(|diagnostic| !allowances.cover(diagnostic, &sources));
    diagnostics.extend(allowances.problems);
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span.file, diagnostic.span.start));
    Compiled { image, symbols, messages: sent, diagnostics, sources }
}

/// Returns the hash that identifies a script, its profile and the version of the messages. It
/// continues the FNV-1a hash of the tokens with two bytes, and with the stigmergy table if there is
/// one, since compilers before the table gave those stigmergies other numbers in messages.
pub fn script_hash(token_hash: u32, profile: NumberProfile, stigmergies: &StigmergyNumbers) -> u32 {
    let parts = [u8::from(profile == NumberProfile::Full), message::VERSION];
    let numbers = stigmergies.table().into_iter().flatten();
    numbers.fold(fnv_1a_from(token_hash, &parts), |hash, number| {
        fnv_1a_from(hash, &number.to_le_bytes())
    })
}

fn write(generated: &Generated) -> Result<CompiledImage, Box<Diagnostic>> {
    generated.parts.write().map_err(|error| {
        let help = match error {
            ImageBuildError::Length(_) => "leave out what the robots do not need",
            ImageBuildError::Count { .. } => "use fewer of them",
            ImageBuildError::StringLength(_) => "make it shorter",
        };
        let message = error.to_string();
        Box::new(
            Diagnostic::new(DiagnosticCode::ImageTooLarge, Span::default(), message).help(help),
        )
    })
}

/// Returns the reasons why the robot cannot run the image.
fn fit(generated: &Generated, image: &CompiledImage, robot: &Robot) -> Vec<Diagnostic> {
    let name = |number: u16| function_name(generated, number);
    let refused = fit::capacity_errors(&image.bytes, robot).into_iter().map(|misfit| {
        let message = misfit.message(robot, &name);
        let diagnostic = |code, span| Diagnostic::new(code, span, message).help(misfit.help());
        match &misfit {
            CapacityError::Feature { at, .. } | CapacityError::Part { at, .. } => {
                let span = at.map_or(Span::default(), |at| image.source(at));
                diagnostic(DiagnosticCode::MissingFeature, span)
            }
            CapacityError::Flash { .. } => diagnostic(DiagnosticCode::FlashBudget, Span::default()),
            CapacityError::Globals { most, .. } => {
                diagnostic(DiagnosticCode::TooManyGlobals, generated.first_uses[*most])
                    .label("the first that does not fit")
            }
            CapacityError::Stack { path, .. } => {
                let Some(last) = path.calls.last() else {
                    let entry = path.functions.first().expect("a path of calls starts at an entry");
                    let entry = &generated.functions[usize::from(*entry)];
                    return diagnostic(DiagnosticCode::CallsTooDeep, entry.span);
                };
                diagnostic(DiagnosticCode::CallsTooDeep, image.source(*last))
                    .label("the deepest call")
            }
        }
    });
    refused.collect()
}

fn function_name(generated: &Generated, number: u16) -> String {
    match generated.functions[usize::from(number)].name.as_deref() {
        Some(GLOBAL_CODE) => GLOBAL_CODE.to_owned(),
        Some(name) => format!("{name}()"),
        None => "a lambda".to_owned(),
    }
}

/// Returns the symbols of an image.
pub(crate) fn make_symbols(
    generated: &Generated,
    image: &CompiledImage,
    sources: &SourceMap,
    profile: NumberProfile,
    options: &Options,
) -> Symbols {
    let name = |source: &SourceFunction| match &source.name {
        Some(name) => name.clone(),
        None => {
            let file = sources.path(source.span.file).display();
            format!("lambda at {file}:{}", symbols::place(sources, source.span).line)
        }
    };
    let functions = generated.functions.iter().zip(&generated.locals).zip(&image.functions);
    let local = |local: &LocalRange, function: usize| LocalSymbol {
        name: local.name.clone(),
        place: local.place,
        from: (function + local.from) as u32,
        to: (function + local.to) as u32,
    };
    let entry = |offset: usize, span: Span| LineEntry {
        offset: offset as u32,
        place: symbols::place(sources, span),
    };
    let statements =
        generated.statements.iter().zip(&image.functions).flat_map(|(of, function)| {
            of.iter().map(move |(offset, span)| (function + offset, *span))
        });
    Symbols {
        format: FORMAT,
        profile: profile.name().to_owned(),
        script_hash: generated.parts.script_hash,
        robot: options.robot.as_ref().map(|robot| robot.name.clone()),
        files: sources.files().map(|(_, file)| file.path.display().to_string()).collect(),
        functions: functions
            .map(|((source, locals), offset)| FunctionSymbol {
                name: name(source),
                offset: *offset as u32,
                locals: locals.iter().map(|range| local(range, *offset)).collect(),
            })
            .collect(),
        strings: generated.parts.strings.script().to_vec(),
        globals: generated.globals.clone(),
        imports: generated.imports.clone(),
        lines: image.lines.iter().map(|(offset, span)| entry(*offset, *span)).collect(),
        statements: statements.map(|(offset, span)| entry(offset, span)).collect(),
    }
}
