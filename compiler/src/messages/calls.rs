//! Finds the calls that send messages, and determines their frames.

use std::collections::BTreeMap;

use bittybuzz_vm_core::builtin;
use bittybuzz_vm_core::message::{FRAGMENTS_MAX, STIGMERGIES};

use crate::check::names::Meanings;
use crate::check::static_type::{StaticType, kind_of};
use crate::check::tree::{
    CheckedExpr, CheckedExprKind, FunctionId, NameId, ResolvedScript, assigned_values, each_expr,
};
use crate::codegen::classes::ValueClasses;
use crate::constant::ConstantNumber;
use crate::messages::form::{Form, Forms};
use crate::messages::size::ContentSizes;
use crate::messages::{Frames, SentMessage, rate};
use crate::profile::NumberProfile;
use crate::stigmergies::StigmergyNumbers;

/// Returns all messages of a script, in the order of the source.
pub fn messages(
    program: &ResolvedScript,
    meanings: &Meanings<'_>,
    profile: NumberProfile,
    stigmergies: &StigmergyNumbers,
) -> Vec<SentMessage> {
    let calls = calls(program, meanings);
    if calls.is_empty() {
        return Vec::new();
    }
    let classes = ValueClasses::of(program, meanings, profile, stigmergies);
    let mut forms = Forms { program, profile, sizes: ContentSizes::of(profile), classes };
    let created = created(program, meanings, stigmergies);
    let rates = rate::rates(program, meanings);
    let mut messages = Vec::new();
    for Call { function, expr, object, name, value, is_entry } in calls {
        let framing = match object {
            Some(object) => stigmergy_framing(object, meanings, stigmergies, &created),
            None => Framing::Always,
        };
        let name_form = forms.of(function, name, expr);
        let framing = framing.and(name_framing(name, name_form, meanings, profile, is_entry));
        let value = forms.of(function, value, expr);
        messages.push(SentMessage {
            span: expr.span,
            is_entry,
            name: match &name.kind {
                CheckedExprKind::Str(text) => Some(format!("\"{text}\"")),
                CheckedExprKind::Int(number) => Some(number.to_string()),
                _ => None,
            },
            frames: frames(&forms.sizes, is_entry, framing, name_form, value),
            rate: rates.get(&(function, expr.span)).copied().flatten(),
        });
    }
    messages.sort_by_key(|message| (message.span.file, message.span.start));
    messages
}

/// A call of `neighbors.broadcast(name, value)`, or of `object.put(name, value)`.
struct Call<'a> {
    function: FunctionId,
    expr: &'a CheckedExpr,
    /// The stigmergy of a put.
    object: Option<&'a CheckedExpr>,
    name: &'a CheckedExpr,
    value: &'a CheckedExpr,
    is_entry: bool,
}

fn calls<'a>(program: &'a ResolvedScript, meanings: &Meanings<'_>) -> Vec<Call<'a>> {
    let mut calls = Vec::new();
    for (number, function) in program.functions.iter().enumerate() {
        each_expr(&function.body, &mut |expr| {
            let CheckedExprKind::Call { callee, args } = &expr.kind else { return };
            let [name, value, ..] = args.as_slice() else { return };
            let Some(info) = meanings.built_in(callee) else { return };
            let CheckedExprKind::Field { object, .. } = &callee.kind else { return };
            let object = match info.number {
                builtin::NEIGHBORS_BROADCAST => None,
                builtin::STIGMERGY_PUT => Some(&**object),
                _ => return,
            };
            let function = FunctionId(number);
            let is_entry = object.is_some();
            calls.push(Call { function, expr, object, name, value, is_entry });
        });
    }
    calls
}

/// Certainty that a message fits a frame, as far as one of its parts decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Framing {
    Always,
    Unknown,
    Never,
}

impl Framing {
    fn of(may_fit: bool, may_not: bool) -> Self {
        match (may_fit, may_not) {
            (true, false) => Framing::Always,
            (false, true) => Framing::Never,
            _ => Framing::Unknown,
        }
    }

    fn and(self, other: Self) -> Self {
        match (self, other) {
            (Framing::Never, _) | (_, Framing::Never) => Framing::Never,
            (Framing::Always, Framing::Always) => Framing::Always,
            _ => Framing::Unknown,
        }
    }
}

/// Returns, for each global, the certainty that entries of the stigmergy in it fit a frame.
fn created(
    program: &ResolvedScript,
    meanings: &Meanings<'_>,
    stigmergies: &StigmergyNumbers,
) -> BTreeMap<NameId, Framing> {
    let mut assigned = BTreeMap::new();
    for function in &program.functions {
        assigned_values(&function.body, &mut assigned);
    }
    let framing = |values: Vec<&CheckedExpr>| {
        let values = values.iter().filter(|value| !matches!(value.kind, CheckedExprKind::Nil));
        let each = values.map(|value| created_framing(value, meanings, stigmergies));
        each.reduce(|a, b| if a == b { a } else { Framing::Unknown }).unwrap_or(Framing::Unknown)
    };
    assigned.into_iter().map(|(name, values)| (name, framing(values))).collect()
}

/// Returns the certainty that entries of the stigmergy that a call creates fit a frame.
fn created_framing(
    value: &CheckedExpr,
    meanings: &Meanings<'_>,
    stigmergies: &StigmergyNumbers,
) -> Framing {
    let CheckedExprKind::Call { callee, args } = &value.kind else { return Framing::Unknown };
    let is_create =
        meanings.built_in(callee).is_some_and(|info| info.number == builtin::STIGMERGY_CREATE);
    match args.first().map(|number| &number.kind) {
        Some(CheckedExprKind::Int(number)) if is_create => {
            let framed: [u16; STIGMERGIES as usize] = stigmergies.framed();
            let is_framed = framed.iter().any(|framed| i64::from(*framed) == *number);
            Framing::of(is_framed, !is_framed)
        }
        _ => Framing::Unknown,
    }
}

fn stigmergy_framing(
    object: &CheckedExpr,
    meanings: &Meanings<'_>,
    stigmergies: &StigmergyNumbers,
    created: &BTreeMap<NameId, Framing>,
) -> Framing {
    match &object.kind {
        CheckedExprKind::Name(name) => created.get(name).copied().unwrap_or(Framing::Unknown),
        _ => created_framing(object, meanings, stigmergies),
    }
}

/// Returns the certainty that a message with that topic or key fits a frame.
fn name_framing(
    name: &CheckedExpr,
    form: Form,
    meanings: &Meanings<'_>,
    profile: NumberProfile,
    is_entry: bool,
) -> Framing {
    let framing = Framing::of(form.may_be_plain, form.may_be_long);
    // A float as key needs a content, unless it is an integer.
    match (kind_of(name, meanings), name.number(profile)) {
        _ if !is_entry => framing,
        (Some(StaticType::Int | StaticType::String), _) => framing,
        (_, Some(ConstantNumber::Float(number))) if number.fract() != 0.0 => Framing::Never,
        _ => framing.and(Framing::Unknown),
    }
}

/// Returns the number of frames of a message; `None` if it is certainly too long.
fn frames(
    sizes: &ContentSizes,
    is_entry: bool,
    framing: Framing,
    name: Form,
    value: Form,
) -> Option<Frames> {
    let framing = framing.and(Framing::of(value.may_be_plain, value.may_be_long));
    if framing == Framing::Always {
        return Some(Frames { least: 1, most: 1 });
    }
    let head = if is_entry { sizes.entry } else { sizes.broadcast };
    let fragments = |content: usize| sizes.fragments(content) as u32;
    let least = match framing {
        Framing::Never => fragments(head + name.least + value.least),
        _ => 1,
    };
    let most = name.most.zip(value.most).map(|(name, value)| fragments(head + name + value));
    let limit = u32::from(FRAGMENTS_MAX);
    (least <= limit).then(|| Frames { least, most: most.map_or(limit, |most| most.min(limit)) })
}
