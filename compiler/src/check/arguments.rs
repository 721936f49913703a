//! Checks arguments of built-in functions whose type is known from the source, and the keys of
//! table literals.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use bittybuzz_vm_core::builtin::{self, BuiltinInfo};

use crate::check::names::{LibraryMember, Meaning, Meanings};
use crate::check::static_type::{StaticType, kind_of};
use crate::check::suggest;
use crate::check::tree::{CheckedExpr, CheckedExprKind, ResolvedScript, each_expr};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;

/// The type that a built-in needs for an argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArgumentType {
    /// An integer or a float.
    Number,
    /// An integer.
    Integer,
    /// A string.
    Text,
    /// A table.
    Table,
    /// A function.
    Function,
    /// A function, or nil to remove the listener.
    Listener,
}

impl ArgumentType {
    fn name(self) -> &'static str {
        match self {
            ArgumentType::Number => "a number",
            ArgumentType::Integer => "an integer",
            ArgumentType::Text => "a string",
            ArgumentType::Table => "a table",
            ArgumentType::Function | ArgumentType::Listener => "a function",
        }
    }

    fn takes(self, kind: StaticType) -> bool {
        let is_number = matches!(kind, StaticType::Int | StaticType::Float | StaticType::Number);
        match self {
            ArgumentType::Number => is_number,
            ArgumentType::Integer => matches!(kind, StaticType::Int | StaticType::Number),
            ArgumentType::Text => kind == StaticType::String,
            ArgumentType::Table => kind == StaticType::Table,
            ArgumentType::Function => kind == StaticType::Function,
            ArgumentType::Listener => matches!(kind, StaticType::Function | StaticType::Nil),
        }
    }
}

/// Returns the types of a built-in's arguments. An argument of another type stops the script.
/// Arguments that are not listed accept any value.
pub fn wanted(number: u8) -> &'static [ArgumentType] {
    use ArgumentType::{Function, Integer, Listener, Number, Table, Text};
    match number {
        builtin::SIZE => &[Table],
        builtin::FOREACH | builtin::MAP | builtin::FILTER | builtin::REDUCE => &[Table, Function],
        builtin::TO_INT | builtin::TO_FLOAT | builtin::DELAY => &[Number],
        builtin::ABS
        | builtin::FLOOR
        | builtin::CEIL
        | builtin::ROUND
        | builtin::SQRT
        | builtin::EXP
        | builtin::LN
        | builtin::LOG2
        | builtin::LOG10
        | builtin::SIN
        | builtin::COS
        | builtin::TAN
        | builtin::ASIN
        | builtin::ACOS
        | builtin::EXPONENTIAL => &[Number],
        builtin::ATAN | builtin::UNIFORM | builtin::GAUSSIAN => &[Number, Number],
        builtin::SET_SEED => &[Integer],
        builtin::LENGTH | builtin::STRING_TO_INT | builtin::STRING_TO_FLOAT => &[Text],
        builtin::SUB => &[Text, Integer, Integer],
        builtin::NEIGHBORS_GET => &[Integer],
        builtin::NEIGHBORS_FOREACH
        | builtin::NEIGHBORS_MAP
        | builtin::NEIGHBORS_FILTER
        | builtin::NEIGHBORS_REDUCE => &[Function],
        builtin::CONCAT => &[Text, Text],
        builtin::NEIGHBORS_BROADCAST | builtin::NEIGHBORS_IGNORE => &[Text],
        builtin::NEIGHBORS_LISTEN => &[Text, Listener],
        builtin::SWARM_CREATE
        | builtin::SWARM_ID
        | builtin::SWARM_UNION
        | builtin::SWARM_INTERSECTION
        | builtin::SWARM_DIFFERENCE
        | builtin::STIGMERGY_CREATE => &[Integer],
        _ => &[],
    }
}

/// Checks a whole script.
pub fn check_arguments(program: &ResolvedScript, meanings: &Meanings<'_>) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for function in &program.functions {
        each_expr(&function.body, &mut |expr| match &expr.kind {
            CheckedExprKind::Call { callee, args } => {
                let Some(info) = called(callee, meanings) else { return };
                diagnostics.extend(wrong_argument(info, args, meanings));
                if matches!(info.number, builtin::SIN | builtin::COS | builtin::TAN) {
                    diagnostics.extend(args.first().and_then(in_degrees));
                }
                if info.number == builtin::LOG {
                    diagnostics.extend(format_in_log(args));
                }
            }
            CheckedExprKind::Table(entries) => diagnostics.extend(duplicate_keys(entries)),
            _ => {}
        });
    }
    diagnostics
}

fn called(callee: &CheckedExpr, meanings: &Meanings<'_>) -> Option<&'static BuiltinInfo> {
    match &callee.kind {
        CheckedExprKind::Name(name) => match meanings.of(*name) {
            Meaning::Builtin(number) => builtin::info(number),
            _ => None,
        },
        CheckedExprKind::Field { object, key, .. } => {
            match meanings.member(meanings.library(object)?, key) {
                LibraryMember::Known(info) => Some(info),
                LibraryMember::Absent | LibraryMember::Changing => None,
            }
        }
        _ => None,
    }
}

fn wrong_argument(
    info: &BuiltinInfo,
    args: &[CheckedExpr],
    meanings: &Meanings<'_>,
) -> Option<Diagnostic> {
    // Another number of arguments is an error of its own, and each may stand at a wrong place.
    if args.len() < usize::from(info.min) || args.len() > usize::from(info.max) {
        return None;
    }
    let mut pairs = args.iter().zip(wanted(info.number));
    let (arg, wanted, kind) = pairs.find_map(|(arg, wanted)| {
        let kind = kind_of(arg, meanings).filter(|kind| !wanted.takes(*kind))?;
        Some((arg, wanted, kind))
    })?;
    Some(
        Diagnostic::new(
            DiagnosticCode::BuiltinArgumentType,
            arg.span,
            format!("`{}` needs {} here, not {}", suggest::path(info), wanted.name(), kind.name()),
        )
        .label("stops the script")
        .help(info.help),
    )
}

/// Reports a constant angle that is beyond a whole turn in radians. Half of a turn and the like are
/// meant in degrees.
fn in_degrees(angle: &CheckedExpr) -> Option<Diagnostic> {
    let number = match angle.kind {
        CheckedExprKind::Int(number) => number as f64,
        CheckedExprKind::Float(number) => number,
        _ => return None,
    };
    if number.abs() <= std::f64::consts::TAU.ceil() {
        return None;
    }
    let radians = format!("{:.4}", number.to_radians());
    Some(
        Diagnostic::new(
            DiagnosticCode::DegreesForRadians,
            angle.span,
            format!("angles are in radians, and {number} rad are more than a whole turn"),
        )
        .help(format!("{number} degrees are {radians}"))
        .guess(angle.span, radians),
    )
}

fn format_in_log(args: &[CheckedExpr]) -> Option<Diagnostic> {
    let (first, _) = args.split_first().filter(|(_, rest)| !rest.is_empty())?;
    let CheckedExprKind::Str(text) = &first.kind else { return None };
    let format = format_of(text)?;
    Some(
        Diagnostic::new(
            DiagnosticCode::LogFormat,
            first.span,
            format!("`log` prints `{format}` as it stands"),
        )
        .label("no format")
        .help("write the values between the texts: `log(\"battery: \", value, \" %\")`"),
    )
}

/// Returns the first format specifier of C's `printf`, such as `%d` or `%.2f`.
fn format_of(text: &str) -> Option<&str> {
    text.match_indices('%').find_map(|(at, _)| {
        let rest = text.get(at + 1..)?;
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.')?;
        let mut letters = rest.get(digits..)?.chars();
        let is_format = letters.next().is_some_and(|letter| "difgusx".contains(letter))
            && !letters.next().is_some_and(char::is_alphanumeric);
        text.get(at..at + digits + 2).filter(|_| is_format)
    })
}

fn duplicate_keys(entries: &[(CheckedExpr, CheckedExpr)]) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut known = HashMap::new();
    for (key, _) in entries {
        let Some(constant) = ConstantKey::of(key) else { continue };
        match known.entry(constant) {
            Entry::Vacant(free) => drop(free.insert(key.span)),
            Entry::Occupied(first) => diagnostics.push(
                Diagnostic::new(DiagnosticCode::DuplicateKey, key.span, "this key is given twice")
                    .label("the last value counts")
                    .related(*first.get(), "first given here")
                    .help("remove one of them"),
            ),
        }
    }
    diagnostics
}

/// A key that is known from the source.
#[derive(PartialEq, Eq, Hash)]
enum ConstantKey<'a> {
    Str(&'a str),
    Int(i64),
    /// The bits of the number.
    Float(u64),
}

impl ConstantKey<'_> {
    fn of(key: &CheckedExpr) -> Option<ConstantKey<'_>> {
        match &key.kind {
            CheckedExprKind::Str(text) => Some(ConstantKey::Str(text)),
            CheckedExprKind::Int(number) => Some(ConstantKey::Int(*number)),
            // Both zeros are the same key; a value that is no number differs from each other one.
            CheckedExprKind::Float(number) if number.is_nan() => None,
            CheckedExprKind::Float(number) => Some(ConstantKey::Float((number + 0.0).to_bits())),
            _ => None,
        }
    }
}
