//! Checks calls: the callee must exist on the robot and accept these arguments.

use bittybuzz_robot_spec::{Parameter, RobotFunction, SignatureType, parameter_at, takes_count};
use bittybuzz_vm_core::builtin::{self, Library};

use crate::check::checker::Checker;
use crate::check::names::{LibraryMember, Meaning};
use crate::check::overflow;
use crate::check::static_type::{StaticType, kind_of};
use crate::check::suggest;
use crate::check::tree::{CheckedExpr, CheckedExprKind, FunctionId, NameId};
use crate::codes::DiagnosticCode;
use crate::constant::ConstantNumber;
use crate::diagnostic::Diagnostic;
use crate::profile::NumberProfile;
use crate::source::Span;

/// Returns true if no argument contains a syntax error.
fn is_complete(args: &[CheckedExpr]) -> bool {
    !args.iter().any(|arg| matches!(arg.kind, CheckedExprKind::Error))
}

impl Checker<'_> {
    /// Checks the callee and the arguments of a call, but not their subexpressions.
    pub fn check_call(&mut self, callee: &CheckedExpr, args: &[CheckedExpr], span: Span) {
        match &callee.kind {
            CheckedExprKind::Name(name) => self.check_named_call(*name, args, callee.span, span),
            CheckedExprKind::Field { object, key, key_span } => {
                if let Some(library) = self.meanings.library(object) {
                    let spans = [callee.span, *key_span, span];
                    self.check_member_call(library, key, args, spans);
                } else if let Some(library) = self.meanings.object_of(object) {
                    if let Some(info) = builtin::find(library, key) {
                        self.check_method_call(library, info, args, span);
                    } else {
                        // Other versions of Buzz have further ones, which a script may never call.
                        let code = DiagnosticCode::UnknownMember;
                        let noun = suggest::object_noun(library);
                        let message = format!("{noun} has no function `{key}`");
                        let diagnostic = Diagnostic::new(code, *key_span, message);
                        let diagnostic = self.with_method(library, key, *key_span, diagnostic);
                        self.report(diagnostic.label("nil, and calling it stops the script"));
                    }
                } else if let Some(field) = self.host_field(object, key) {
                    let code = DiagnosticCode::UnknownMemberCalled;
                    let message = format!("`{}` has no function `{key}`", field.table);
                    let diagnostic = self.unknown_function(code, *key_span, message);
                    self.report(field.advise(key, diagnostic, *key_span));
                } else if let Some((missing, table)) = self.missing_field(object, key) {
                    let message = format!("no table of the script has a function `{key}`");
                    let code = DiagnosticCode::UnknownMember;
                    let diagnostic = Diagnostic::new(code, *key_span, message);
                    let diagnostic = match missing.advice(key, table) {
                        Some(advice) => advice.give(diagnostic, *key_span),
                        None => diagnostic,
                    };
                    self.report(diagnostic.label("nil, and calling it stops the script"));
                }
            }
            _ => {
                if let Some(kind) =
                    kind_of(callee, self.meanings).filter(|kind| *kind != StaticType::Function)
                {
                    self.not_callable(callee.span, kind.name());
                }
            }
        }
    }

    fn check_named_call(&mut self, name: NameId, args: &[CheckedExpr], callee: Span, span: Span) {
        let text = &self.program.name(name).text;
        match self.meanings.of(name) {
            Meaning::Function(_) | Meaning::Builtin(_) | Meaning::Robot if !is_complete(args) => {}
            Meaning::Function(_) if self.program.hidden.is_lost(text) => {}
            Meaning::Function(function) => self.check_script_call(text, function, args, span),
            Meaning::Builtin(number) => {
                if let Some(info) = builtin::info(number) {
                    self.check_builtin_call(info, args, span);
                }
            }
            Meaning::Robot => self.check_robot_call(text, args, span),
            meaning @ (Meaning::Library(_) | Meaning::RobotId) => {
                self.not_callable(callee, suggest::describe(meaning));
            }
            Meaning::Nil => self.unknown_call(name, callee),
            Meaning::Global => {}
        }
    }

    /// Checks the number of arguments of a method of a swarm, a stigmergy or a table of neighbors.
    fn check_method_call(
        &mut self,
        library: Library,
        info: &builtin::BuiltinInfo,
        args: &[CheckedExpr],
        span: Span,
    ) {
        let (min, max, given) = (usize::from(info.min), usize::from(info.max), args.len());
        if !is_complete(args) || (min..=max).contains(&given) {
            return;
        }
        let (code, label) = if given < min {
            (DiagnosticCode::MissingArguments, "stops the script")
        } else {
            (DiagnosticCode::ExtraArguments, "the others are ignored")
        };
        let wanted = if given < min { min } else { max };
        let (noun, name) = (suggest::object_noun(library), info.name);
        let message =
            format!("`{name}` of {noun} takes {}, not {given}", counted(wanted, "argument"));
        self.report(Diagnostic::new(code, span, message).label(label).help(info.help));
    }

    /// Adds a suggestion for a method that an object does not have.
    pub fn with_method(
        &self,
        library: Library,
        key: &str,
        span: Span,
        diagnostic: Diagnostic,
    ) -> Diagnostic {
        match suggest::for_method(library, key) {
            Some(advice) => advice.give(diagnostic, span),
            None if library == Library::StigmergyObject => diagnostic
                .help("its entries are read by `get(key)` and written by `put(key, value)`"),
            None => diagnostic,
        }
    }

    fn not_callable(&mut self, span: Span, what: &str) {
        self.report(
            Diagnostic::new(
                DiagnosticCode::NotCallable,
                span,
                format!("this is {what} and cannot be called"),
            )
            .label("not a function"),
        );
    }

    fn unknown_call(&mut self, name: NameId, span: Span) {
        let text = &self.program.name(name).text;
        if self.program.hidden.may_define(text) || self.is_guarded(name) {
            return;
        }
        let robots = self.meanings.robots();
        let others = robots.elsewhere(text);
        if let Some(robot) = robots.target.filter(|_| !others.is_empty()) {
            let message = format!("the {} has no function `{text}`", robot.title);
            self.report(
                self.unknown_function(DiagnosticCode::MissingRobotFunction, span, message)
                    .label("not on this robot")
                    .help(format!(
                        "{}: a script for unlike robots calls it under `if({text}) {{ ... }}`",
                        who_has_it(&others)
                    )),
            );
            return;
        }
        let message = format!("there is no function `{text}`");
        let mut diagnostic = self
            .unknown_function(DiagnosticCode::UnknownFunction, span, message)
            .label("nothing defines this name");
        if let Some(advice) = self.likely_name(text) {
            diagnostic = advice.give(diagnostic, span);
        }
        self.report(diagnostic);
    }

    fn check_script_call(&mut self, name: &str, id: FunctionId, args: &[CheckedExpr], span: Span) {
        let function = self.program.function(id);
        let (wanted, given) = (function.parameters, args.len());
        if given == wanted {
            return;
        }
        let code = if given < wanted {
            DiagnosticCode::MissingArguments
        } else {
            DiagnosticCode::ExtraArguments
        };
        let message = format!(
            "`{name}` has {}, but gets {}",
            counted(wanted, "parameter"),
            counted(given, "argument")
        );
        let mut diagnostic = Diagnostic::new(code, span, message);
        if let Some((_, defined)) =
            self.program.find_name(name).and_then(|id| self.program.name(id).definitions.last())
        {
            diagnostic = diagnostic.related(*defined, "defined here");
        }
        self.report(if given < wanted {
            let missing: Vec<String> = function
                .locals
                .iter()
                .take(wanted)
                .skip(given)
                .map(|parameter| format!("`{}`", parameter.name))
                .collect();
            diagnostic
                .label(format!("{} not passed", missing.join(", ")))
                .help("a function that reads a parameter which was not passed stops the script; pass nil if it is unknown")
        } else {
            diagnostic.label("the others are ignored")
        });
    }

    /// Checks a call of a member of a library. The spans are those of the member with the library, of
    /// its name alone, and of the call.
    fn check_member_call(
        &mut self,
        library: Library,
        key: &str,
        args: &[CheckedExpr],
        [member, key_span, span]: [Span; 3],
    ) {
        match self.meanings.member(library, key) {
            LibraryMember::Known(info) if info.kind == builtin::BuiltinKind::Value => {
                let what = match info.number {
                    builtin::RNG => "a table",
                    _ => "a number",
                };
                self.not_callable(key_span, what);
            }
            LibraryMember::Known(_) if !is_complete(args) => {}
            LibraryMember::Known(info) => self.check_builtin_call(info, args, span),
            LibraryMember::Absent if !self.may_be_member(library, key) => {
                let message =
                    format!("`{}` has no function `{key}`", suggest::library_path(library));
                let code = DiagnosticCode::UnknownMemberCalled;
                let mut diagnostic = self.unknown_function(code, key_span, message);
                if let Some(advice) = suggest::for_member(library, key, self.meanings.robots()) {
                    diagnostic = advice.give(diagnostic, member);
                }
                self.report(diagnostic);
            }
            LibraryMember::Absent | LibraryMember::Changing => {}
        }
    }

    fn check_builtin_call(
        &mut self,
        info: &builtin::BuiltinInfo,
        args: &[CheckedExpr],
        span: Span,
    ) {
        let (min, max) = (usize::from(info.min), usize::from(info.max));
        let is_open = info.max == u8::MAX;
        if args.len() >= min && (is_open || args.len() <= max) {
            return;
        }
        let wanted = match (min, is_open) {
            (_, true) => format!("at least {}", counted(min, "argument")),
            _ if min == max => counted(min, "argument"),
            _ => format!("{min} to {}", counted(max, "argument")),
        };
        self.report(
            Diagnostic::new(
                DiagnosticCode::BuiltinArguments,
                span,
                format!("`{}` takes {wanted}, not {}", suggest::path(info), args.len()),
            )
            .label("wrong number of arguments")
            .help(info.help),
        );
    }

    fn outside_of_range(&mut self, name: &str, list: &[Parameter], args: &[CheckedExpr]) {
        let Some((parameter, arg, number)) = first_outside(list, args) else { return };
        let Some(range) = &parameter.range else { return };
        let help =
            self.meanings.robots().functions(name).first().map(|function| function.help.clone());
        let message = format!(
            "`{}` of `{name}` is {} to {}, not {number}",
            parameter.name,
            range.start(),
            range.end()
        );
        let diagnostic = Diagnostic::new(DiagnosticCode::ArgumentRange, arg.span, message);
        self.report(diagnostic.label("out of range").help(help.unwrap_or_default()));
    }

    fn check_robot_call(&mut self, name: &str, args: &[CheckedExpr], span: Span) {
        let functions = self.meanings.robots().functions(name);
        let of_count: Vec<&Vec<Parameter>> = functions
            .iter()
            .flat_map(|function| &function.accepts)
            .filter(|list| takes_count(list, args.len()))
            .collect();
        if of_count.is_empty() {
            self.report(
                Diagnostic::new(
                    DiagnosticCode::RobotArguments,
                    span,
                    match args.len() {
                        0 => format!("`{name}` needs arguments"),
                        count => format!("`{name}` does not take {}", counted(count, "argument")),
                    },
                )
                .label("wrong number of arguments")
                .help(accepted_forms(name, &functions)),
            );
            return;
        }
        let kinds: Vec<Option<StaticType>> =
            args.iter().map(|arg| kind_of(arg, self.meanings)).collect();
        let first_wrong = |list: &[Parameter]| {
            let is_wrong = |(index, (_, kind)): &(usize, (&CheckedExpr, &Option<StaticType>))| {
                parameter_at(list, *index).is_some_and(|known| !accepts(known.kind, **kind))
            };
            args.iter().zip(&kinds).enumerate().find(is_wrong)
        };
        let fitting: Vec<_> =
            { of_count.iter() }.filter(|list| first_wrong(list).is_none()).collect();
        if let Some(first) = fitting.first() {
            // Without `--robot` the call is right if it is in the range of any robot.
            if fitting.iter().all(|list| first_outside(list, args).is_some()) {
                self.outside_of_range(name, first, args);
            }
            return;
        }
        // The message refers to the first parameter list with this number of arguments. Several are
        // rare.
        let wrong = of_count.first().and_then(|list| {
            let (index, found) = first_wrong(list)?;
            Some((parameter_at(list, index)?, found))
        });
        if let Some((parameter, (arg, Some(kind)))) = wrong {
            self.report(
                Diagnostic::new(
                    DiagnosticCode::RobotArgumentType,
                    arg.span,
                    format!(
                        "`{}` of `{name}` is {}, not {}",
                        parameter.name,
                        type_name(parameter.kind),
                        kind.name()
                    ),
                )
                .label("wrong type")
                .help(accepted_forms(name, &functions)),
            );
        }
    }
}

/// Returns the first argument that is a constant outside the range of its parameter, and that parameter.
fn first_outside<'a>(
    list: &'a [Parameter],
    args: &'a [CheckedExpr],
) -> Option<(&'a Parameter, &'a CheckedExpr, f64)> {
    args.iter().enumerate().find_map(|(index, arg)| {
        let parameter = parameter_at(list, index)?;
        let range = parameter.range.as_ref()?;
        // Full numbers hold those of `tiny`, too.
        let number = match overflow::value(arg, NumberProfile::Full)? {
            ConstantNumber::Int(number) => f64::from(number),
            ConstantNumber::Float(number) => f64::from(number),
        };
        let is_inside = f64::from(*range.start()) <= number && number <= f64::from(*range.end());
        (!is_inside).then_some((parameter, arg, number))
    })
}

/// Returns true if a parameter accepts a value of that type. A value of unknown type is accepted.
fn accepts(parameter: SignatureType, kind: Option<StaticType>) -> bool {
    match (parameter, kind) {
        (SignatureType::Any, _) | (_, None) => true,
        (SignatureType::Int, Some(kind)) => matches!(kind, StaticType::Int | StaticType::Number),
        (SignatureType::Number, Some(kind)) => {
            matches!(kind, StaticType::Int | StaticType::Float | StaticType::Number)
        }
        (SignatureType::String, Some(kind)) => kind == StaticType::String,
        (SignatureType::Table, Some(kind)) => kind == StaticType::Table,
        (SignatureType::Function, Some(kind)) => kind == StaticType::Function,
    }
}

fn type_name(kind: SignatureType) -> &'static str {
    match kind {
        SignatureType::Int => "an integer",
        SignatureType::Number => "a number",
        SignatureType::String => "a string",
        SignatureType::Table => "a table",
        SignatureType::Function => "a function",
        SignatureType::Any => "any value",
    }
}

fn accepted_forms(name: &str, functions: &[&RobotFunction]) -> String {
    let mut forms: Vec<String> = Vec::new();
    for function in functions {
        for list in &function.accepts {
            let parameters: Vec<String> = list.iter().map(Parameter::to_string).collect();
            let form = format!("`{name}({})`", parameters.join(", "));
            if !forms.contains(&form) {
                forms.push(form);
            }
        }
    }
    let help = functions.first().map_or("", |function| function.help.as_str());
    format!("write {}: {help}", forms.join(" or "))
}

fn who_has_it(titles: &[&str]) -> String {
    match titles {
        [one] => format!("the {one} has it"),
        [first @ .., last] => {
            let first: Vec<String> = first.iter().map(|title| format!("the {title}")).collect();
            format!("{} and the {last} have it", first.join(", "))
        }
        [] => String::new(),
    }
}

/// Returns a number with its noun, in the plural if needed.
pub fn counted(count: usize, noun: &str) -> String {
    match count {
        0 => format!("no {noun}s"),
        1 => format!("1 {noun}"),
        _ => format!("{count} {noun}s"),
    }
}
