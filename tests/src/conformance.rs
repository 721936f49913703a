//! Scripts with an `.expect` file: a first line that says how the run ends, then the exact output.

use crate::bbz;
use crate::diff;
use crate::files;
use crate::report::Failure;

/// Runs `NAME.bzz` in the `full` profile with more arguments and compares it with `NAME.expect`.
pub fn run(path: &str, arguments: &[&str]) -> Option<Failure> {
    let expected = files::read(&path.replace(".bzz", ".expect"));
    let (ending, output) = expected.split_once('\n').unwrap_or((&expected, ""));
    let status = match ending {
        "ok" => 0,
        "runtime-error" => 1,
        "compile-error" => 2,
        other => return Some(format!("{path}: `{other}` is no way to end\n")),
    };
    let mut command = vec!["run", "--profile", "full"];
    command.extend(arguments);
    command.push(path);
    let outcome = bbz::run(&command, &[]);
    let mut problems = String::new();
    if outcome.status != Some(status) {
        problems.push_str(&format!("    exit status {:?} instead of {status}\n", outcome.status));
    }
    if outcome.stdout != output {
        let (expected, actual): (Vec<_>, Vec<_>) =
            (output.lines().collect(), outcome.stdout.lines().collect());
        let difference = diff::lines(&expected, &actual);
        problems.push_str(&difference.unwrap_or("    only the last newline differs\n".into()));
    }
    if problems.is_empty() {
        None
    } else {
        Some(format!("{path}:1: {ending}\n{problems}{}", outcome.stderr))
    }
}
