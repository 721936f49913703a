//! Checks names that the script takes from the machine or the robot, or defines twice.

use crate::check::names::{Meaning, offered};
use crate::check::robots::KnownRobots;
use crate::check::tree::{FreeName, ResolvedScript};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::profile::NumberProfile;

/// Checks the names that a script defines.
pub fn check_names(
    program: &ResolvedScript,
    robots: KnownRobots<'_>,
    profile: NumberProfile,
) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
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
