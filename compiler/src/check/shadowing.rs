//! Checks names that the script takes from the machine or the robot, or defines twice.

use std::collections::BTreeSet;

use crate::check::names::{Meaning, Meanings, offered};
use crate::check::robots::KnownRobots;
use crate::check::static_type::{StaticType, kind_of};
use crate::check::tree::{
    CheckedExpr, CheckedExprKind, CheckedStmt, CheckedStmtKind, FreeName, FunctionId,
    ResolvedScript, each_stmt,
};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::image::ENTRIES;
use crate::profile::NumberProfile;

/// Checks the names that a script defines.
pub fn check_names(
    program: &ResolvedScript,
    robots: KnownRobots<'_>,
    profile: NumberProfile,
    meanings: &Meanings<'_>,
) -> Vec<Diagnostic> {
    let mut diagnostics = replaced(program, meanings);
    for name in &program.names {
        diagnostics.extend(taken(name, robots, profile));
        diagnostics.extend(redefinitions(name));
    }
    diagnostics
}

fn taken(name: &FreeName, robots: KnownRobots<'_>, profile: NumberProfile) -> Option<Diagnostic> {
    let definitions = name.definitions.iter().map(|(_, span)| *span);
    let first = definitions.chain(name.writes.iter().copied()).min()?;
    let text = &name.text;
    let (code, what) = match offered(robots, profile, text) {
        Meaning::Robot => (DiagnosticCode::RobotNameTaken, of_robot(text, robots)?),
        Meaning::Builtin(_) => (DiagnosticCode::BuiltinNameTaken, "a built-in function".to_owned()),
        Meaning::Library(_) => (DiagnosticCode::BuiltinNameTaken, "a built-in table".to_owned()),
        Meaning::RobotId => {
            (DiagnosticCode::BuiltinNameTaken, "the number of the robot".to_owned())
        }
        Meaning::Nil | Meaning::Function(_) | Meaning::Global => return None,
    };
    Some(
        Diagnostic::new(
            code,
            first,
            format!("`{text}` is {what}, and becomes a name of this script"),
        )
        .label("an ordinary global from here on, everywhere in the script")
        .help("choose another name, unless you mean to replace it"),
    )
}

/// Describes the robot function that a script replaces. If no robot is named, the script may take a
/// name that only some of the robots with a chip have. Robots without a chip are descriptions, such
/// as those of other hosts, which share no function with the others.
fn of_robot(name: &str, robots: KnownRobots<'_>) -> Option<String> {
    if let Some(robot) = robots.target {
        return Some(format!("a function of the {}", robot.title));
    }
    let mut flashed = robots.known.iter().filter(|robot| robot.chip.is_some()).peekable();
    let is_on_all = flashed.peek().is_some() && flashed.all(|robot| robot.function(name).is_some());
    is_on_all.then(|| "a function of every robot with a chip".to_owned())
}

/// Returns warnings about functions that an assignment certainly replaces: by a value that is no
/// function, or by another function before they can run. A state machine assigns its functions to a
/// name, and gets none.
fn replaced(program: &ResolvedScript, meanings: &Meanings<'_>) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut known = BTreeSet::new();
    let mut check = |target: &CheckedExpr, value: &CheckedExpr, is_at_start: bool| {
        let CheckedExprKind::Name(id) = target.kind else { return };
        let name = program.name(id);
        let Some((_, defined)) = name.definitions.last() else { return };
        let what = match (kind_of(value, meanings), &value.kind) {
            (Some(StaticType::Function), CheckedExprKind::Lambda(_))
                if is_at_start && ENTRIES.contains(&name.text.as_str()) =>
            {
                "another function before it can run"
            }
            (Some(StaticType::Function | StaticType::Nil) | None, _) => return,
            (Some(kind), _) => kind.name(),
        };
        if !known.insert(id) {
            return;
        }
        let message = format!("the function `{}` is replaced by {what}", name.text);
        diagnostics.push(
            Diagnostic::new(DiagnosticCode::FunctionRedefined, target.span, message)
                .label("the function is lost from here on")
                .related(*defined, "defined here")
                .help("choose another name for one of them"),
        );
    };
    for (number, function) in program.functions.iter().enumerate() {
        let is_global = FunctionId(number) == FunctionId::GLOBAL;
        let at_start: Vec<&CheckedStmt> = function.body.iter().filter(|_| is_global).collect();
        each_stmt(&function.body, &mut |stmt| {
            if let CheckedStmtKind::Assign { target, value } = &stmt.kind {
                check(target, value, at_start.iter().any(|start| std::ptr::eq(*start, stmt)));
            }
        });
    }
    diagnostics
}

fn redefinitions(name: &FreeName) -> Vec<Diagnostic> {
    let Some((_, first)) = name.definitions.first() else { return Vec::new() };
    let later = name.definitions.iter().skip(1);
    later
        .map(|(_, span)| {
            let message = format!("the function `{}` is defined more than once", name.text);
            Diagnostic::new(DiagnosticCode::FunctionRedefined, *span, message)
                .label("the last definition counts, everywhere in the script")
                .related(*first, "first defined here")
        })
        .collect()
}
