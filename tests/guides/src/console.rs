//! Commands and what they print.
//!
//! * A line `...` stands for any lines.
//! * Times, numbers with six decimals, may differ by 5 ms: they are part of no promise.
//! * A command fails if the guide shows a line that begins with `error`, and else succeeds. If the guide shows nothing, it
//!   does not say what is printed.

use std::fmt;
use std::io;
use std::process::Command;

/// Between what a command prints and its exit status. No command prints it.
const MARK: char = '\u{1e}';

/// How much times may differ, in seconds.
const TOLERANCE: f64 = 0.005;

/// A command that did something else than the guide says.
#[derive(Debug)]
pub struct Otherwise {
    command: String,
    status: String,
    expected: String,
    found: String,
}

impl fmt::Display for Otherwise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Otherwise { command, status, expected, found } = self;
        write!(f, "`{command}` ended with status {status} and printed\n{found}\n")?;
        write!(f, "where the guide says\n{expected}")
    }
}

/// A command and the lines below it.
#[derive(Debug, PartialEq, Eq)]
pub struct Promise<'a> {
    /// Its line, from 0.
    pub line: usize,
    command: &'a str,
    output: Vec<&'a str>,
}

/// The commands of a block; `None` if it does not begin with one.
pub fn promises(block: &str) -> Option<Vec<Promise<'_>>> {
    let mut promises: Vec<Promise<'_>> = Vec::new();
    for (line, text) in block.lines().enumerate() {
        match text.strip_prefix("$ ") {
            Some(command) => promises.push(Promise { line, command, output: Vec::new() }),
            None => promises.last_mut()?.output.push(text),
        }
    }
    Some(promises)
}

/// Runs the commands in one shell. The inner error is the first broken promise and its number.
pub fn run(
    shell: &mut Command,
    promises: &[Promise<'_>],
) -> io::Result<Result<(), (usize, Otherwise)>> {
    let script: String = promises
        .iter()
        .map(|promise| format!("{}\nprintf '{MARK}%d{MARK}' $?\n", promise.command))
        .collect();
    let output = shell.arg("-c").arg(format!("exec 2>&1\n{script}")).output()?;
    let printed = String::from_utf8_lossy(&output.stdout);
    let mut parts = printed.split(MARK);
    for (number, promise) in promises.iter().enumerate() {
        let found = parts.next().unwrap_or_default();
        let status = parts.next().unwrap_or("unknown");
        if !promise.is_kept(found, status) {
            let (command, expected) = (promise.command.to_owned(), promise.output.join("\n"));
            let (status, found) = (status.to_owned(), found.to_owned());
            return Ok(Err((number, Otherwise { command, status, expected, found })));
        }
    }
    Ok(Ok(()))
}

impl Promise<'_> {
    fn is_kept(&self, found: &str, status: &str) -> bool {
        let fails = self.output.iter().any(|line| line.starts_with("error"));
        let found: Vec<&str> = found.lines().collect();
        fails != (status == "0") && (self.output.is_empty() || agree(&self.output, &found))
    }
}

fn agree(expected: &[&str], found: &[&str]) -> bool {
    match (expected, found) {
        (["...", rest @ ..], _) => (0..=found.len()).any(|skipped| agree(rest, &found[skipped..])),
        ([line, rest @ ..], [other, more @ ..]) => lines_agree(line, other) && agree(rest, more),
        _ => expected.is_empty() && found.is_empty(),
    }
}

fn lines_agree(expected: &str, found: &str) -> bool {
    let indent = |line: &str| line.len() - line.trim_start().len();
    let both = || expected.split_whitespace().zip(found.split_whitespace());
    indent(expected) == indent(found)
        && expected.split_whitespace().count() == found.split_whitespace().count()
        && both().all(|(a, b)| {
            a == b || matches!((time(a), time(b)), (Some(a), Some(b)) if (a - b).abs() < TOLERANCE)
        })
}

fn time(word: &str) -> Option<f64> {
    let (_, decimals) = word.split_once('.')?;
    (decimals.len() == 6).then(|| word.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_and_their_lines() {
        let found = promises("$ a b\n$ c\nd\n\ne\n").unwrap();
        let commands: Vec<_> = found.iter().map(|p| (p.line, p.command, &p.output[..])).collect();
        assert_eq!(commands, [(0, "a b", &[][..]), (1, "c", &["d", "", "e"][..])]);
        assert!(promises("a\n$ b\n").is_none());
    }

    #[test]
    fn dots_stand_for_lines_and_times_are_about() {
        let agree = |a: &str, b: &str| {
            agree(&a.lines().collect::<Vec<_>>(), &b.lines().collect::<Vec<_>>())
        };
        assert!(agree("a\n...\nd", "a\nb\nc\nd") && agree("...\nd\n...", "d"));
        assert!(!agree("a\n...\nd", "a\nb") && !agree("...\nb", "a\nb\nc") && !agree("a", "a\nb"));
        assert!(
            agree("  0.100417 on", "  0.104017 on") && !agree("  0.100417 on", "  0.110417 on")
        );
        assert!(!agree("0.1", "0.101") && !agree(" a", "a") && !agree("a b", "a"));
    }

    #[test]
    fn promises_are_kept_or_not() {
        let run = |block| run(&mut Command::new("sh"), &promises(block).unwrap()).unwrap();
        assert!(
            run("$ x=3\n$ echo $x; echo 4 >&2\n3\n4\n$ echo error: no; false\nerror: no\n").is_ok()
        );
        for (block, broken) in [
            ("$ true\n$ false\n", 1),
            ("$ echo a\nb\n", 0),
            ("$ echo error\nerror\n", 0),
            ("$ true\n$ exit 3\n$ true\n", 1),
        ] {
            let (number, otherwise) = run(block).unwrap_err();
            assert_eq!(number, broken, "{otherwise}");
        }
    }
}
