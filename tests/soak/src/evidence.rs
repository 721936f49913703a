//! The dated claims of `docs/evidence.toml`, from which the tables of docs/testing.md are made.
//!
//! A claim is dated again when its command passes: a part of `soak` whose items were all shown, or
//! an ordinary command of cargo, which the part `claims` runs.

use crate::Verdict;
use anyhow::{Context, Result};
use bittybuzz_builds::shell::{Invocation, root};
use bittybuzz_builds::test_programs::Counts;
use fs_err as fs;
use std::collections::BTreeSet;

/// The file of the claims, from the root.
pub const FILE: &str = "docs/evidence.toml";

/// The start of a line with a claim's command.
const COMMAND: &str = "command = ";

/// Returns the commands of cargo that show claims and are no part of `soak`.
pub fn items() -> Vec<String> {
    let text = fs::read_to_string(root().join(FILE)).expect("the repository has this file");
    let commands = commands(&text).filter(|command| !command.starts_with("cargo xtask "));
    commands.map(str::to_owned).collect::<BTreeSet<_>>().into_iter().collect()
}

/// Runs a command and dates its claims.
pub fn run(command: &str) -> Result<Verdict> {
    let mut words = command.split(' ');
    let program = words.next().context("a command has a program")?;
    let output = Invocation::new(program, &words.collect::<Vec<_>>()).output_if(|_| true)?;
    let printed = String::from_utf8([output.stdout, output.stderr].concat())?;
    // A filter that no longer fits a test selects nothing, and cargo succeeds.
    let is_empty = command.starts_with("cargo test ") && Counts::read(&printed).passed == 0;
    if !output.status.success() || is_empty {
        return Ok(Verdict::Missing(printed));
    }
    record(command)?;
    Ok(Verdict::Shown("passed".to_owned()))
}

/// Dates the claims of a part of `soak` whose items were all shown.
pub fn record_part(part: &str) -> Result<()> {
    record(&format!("cargo xtask soak {part}"))
}

/// Writes the date and the commit of today to the claims of a command.
fn record(command: &str) -> Result<()> {
    let date = printed("date", &["+%F"])?;
    let commit = printed("git", &["rev-parse", "--short=7", "HEAD"])?;
    let path = root().join(FILE);
    let text = fs::read_to_string(&path)?;
    Ok(fs::write(&path, dated(&text, command, &date, &commit))?)
}

fn printed(program: &str, arguments: &[&str]) -> Result<String> {
    let output = Invocation::new(program, arguments).unannounced().output(0)?;
    Ok(String::from_utf8(output.stdout)?.trim().to_owned())
}

/// Returns the commands of all claims.
fn commands(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| Some(line.strip_prefix(COMMAND)?.trim_matches('"')))
}

/// Returns the file's text with another date and commit for the claims of a command. Both lines
/// follow that of the command.
fn dated(text: &str, command: &str, date: &str, commit: &str) -> String {
    let mut lines = Vec::new();
    let mut is_dated = false;
    for line in text.lines() {
        if line.starts_with("[[") {
            is_dated = false;
        }
        if is_dated && (line.starts_with("date = ") || line.starts_with("commit = ")) {
            continue;
        }
        lines.push(line.to_owned());
        if line.strip_prefix(COMMAND).is_some_and(|known| known.trim_matches('"') == command) {
            lines.extend([format!("date = \"{date}\""), format!("commit = \"{commit}\"")]);
            is_dated = true;
        }
    }
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"[[claim]]
claim = "one"
command = "cargo xtask soak day"
date = "2026-11-20"

[[claim]]
claim = "other"
command = "cargo test -p x"
date = "2026-11-21"
commit = "1234567"
"#;

    #[test]
    fn a_command_dates_its_own_claims() {
        let part = dated(TEXT, "cargo xtask soak day", "2026-12-01", "abcdef0");
        assert_eq!(
            part,
            TEXT.replace("date = \"2026-11-20\"", "date = \"2026-12-01\"\ncommit = \"abcdef0\"")
        );
        let test = dated(TEXT, "cargo test -p x", "2026-12-01", "abcdef0");
        assert_eq!(test, TEXT.replace("2026-11-21", "2026-12-01").replace("1234567", "abcdef0"));
        assert_eq!(dated(TEXT, "cargo", "2026-12-01", "abcdef0"), TEXT);
    }

    #[test]
    fn parts_of_soak_exist_and_other_commands_are_items() {
        let text = fs::read_to_string(root().join(FILE)).unwrap();
        let (parts, others): (Vec<_>, Vec<_>) =
            commands(&text).partition(|command| command.starts_with("cargo xtask soak "));
        for command in &parts {
            let (_, part) = command.rsplit_once(' ').unwrap();
            assert!(crate::names().contains(&part), "{command}");
        }
        assert!(parts.len() > 5 && others.len() > 5);
        assert!(others.iter().all(|command| items().iter().any(|item| item == command)));
    }
}
