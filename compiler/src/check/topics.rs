//! Finds listeners for topics that the script never sends. All robots that hear each other run one script, so such a
//! listener never gets a value.

use std::collections::BTreeSet;

use bittybuzz_vm_core::builtin::{self, Library};

use crate::check::names::Meanings;
use crate::check::suggest::{self, Advice};
use crate::check::tree::{CheckedExpr, CheckedExprKind, ResolvedScript, each_expr};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;

/// Checks a whole script. Nothing is reported if a topic of a message is computed, or if `neighbors` or `broadcast` is
/// used as a value.
pub fn check_topics(program: &ResolvedScript, meanings: &Meanings<'_>) -> Vec<Diagnostic> {
    // A library that is checked alone may be included by a script that sends.
    let is_program = ["step", "init"].iter().any(|entry| {
        program.find_name(entry).is_some_and(|name| !program.name(name).definitions.is_empty())
    });
    let may_send_elsewhere = meanings.escaped().contains(&Library::Neighbors);
    if !is_program || may_send_elsewhere || program.hidden.is_any() {
        return Vec::new();
    }
    let (mut sent, mut listens) = (BTreeSet::new(), Vec::new());
    let (mut broadcasts, mut calls) = (0, 0);
    for function in &program.functions {
        each_expr(&function.body, &mut |expr| {
            if meanings
                .built_in(expr)
                .is_some_and(|info| info.number == builtin::NEIGHBORS_BROADCAST)
            {
                broadcasts += 1;
            }
            let CheckedExprKind::Call { callee, args } = &expr.kind else { return };
            let (Some(info), [topic, ..]) = (meanings.built_in(callee), args.as_slice()) else {
                return;
            };
            match (info.number, &topic.kind) {
                (builtin::NEIGHBORS_BROADCAST, CheckedExprKind::Str(text)) => {
                    calls += 1;
                    sent.insert(text.as_str());
                }
                (builtin::NEIGHBORS_LISTEN, CheckedExprKind::Str(text)) => {
                    listens.push((topic, text.as_str()));
                }
                _ => {}
            }
        });
    }
    if broadcasts != calls {
        return Vec::new();
    }
    listens.retain(|(_, text)| !sent.contains(text));
    listens.into_iter().map(|(topic, text)| never_sent(topic, text, &sent)).collect()
}

fn never_sent(topic: &CheckedExpr, text: &str, sent: &BTreeSet<&str>) -> Diagnostic {
    let diagnostic = Diagnostic::new(
        DiagnosticCode::TopicNeverSent,
        topic.span,
        format!("the script never sends the topic \"{text}\""),
    )
    .label("the listener gets nothing");
    match suggest::nearest(text, sent.iter().copied()) {
        Some(likely) => Advice::likely(format!("\"{likely}\"")).give(diagnostic, topic.span),
        None => diagnostic.help(format!(
            "robots hear only robots with the same script, so it has to send: \
             `neighbors.broadcast(\"{text}\", value)`"
        )),
    }
}
