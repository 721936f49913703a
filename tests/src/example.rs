//! The shipped examples: what their headers promise is checked.
//!
//! ```text
//! # Robots: kilobot, zooids
//! #
//! # bbz run examples/blink.bzz --steps 2
//! # prints
//! #   led(1)
//! #   led(0)
//! ```

use crate::bbz;
use crate::diff;
use crate::files;
use crate::report::Failure;

/// How many steps an example must survive on each of its robots.
const STEPS: &str = "20";

/// What the header of an example says.
#[derive(Debug, PartialEq, Eq)]
struct Header {
    robots: Vec<String>,
    command: Vec<String>,
    output: Vec<String>,
}

/// Checks an example: it compiles without a warning and runs for every robot that it names, and prints what
/// it says that it prints.
pub fn check(path: &str) -> Vec<Failure> {
    let header = match parse(&files::read(path)) {
        Ok(header) => header,
        Err(e) => return vec![format!("{path}:1: {e}\n")],
    };
    let mut failures = Vec::new();
    for robot in &header.robots {
        for arguments in [
            vec!["check", path, "--robot", robot],
            vec!["run", path, "--robot", robot, "--steps", STEPS],
        ] {
            let outcome = bbz::run(&arguments, &[]);
            if outcome.status != Some(0) || !outcome.stderr.is_empty() {
                failures.push(format!(
                    "{path}:1: bbz {} ended with {:?}\n{}",
                    arguments.join(" "),
                    outcome.status,
                    outcome.stderr
                ));
            }
        }
    }
    let outcome = bbz::run(&header.command, &[]);
    let actual: Vec<&str> = outcome.stdout.lines().collect();
    let expected: Vec<&str> = header.output.iter().map(String::as_str).collect();
    if let Some(difference) = diff::lines(&expected, &actual) {
        let command = header.command.join(" ");
        failures.push(format!("{path}:1: bbz {command}\n{difference}{}", outcome.stderr));
    }
    failures
}

fn parse(text: &str) -> Result<Header, String> {
    let mut header = Header { robots: Vec::new(), command: Vec::new(), output: Vec::new() };
    let mut in_output = false;
    for line in text.lines().map_while(|line| line.strip_prefix('#')) {
        if in_output && let Some(output) = line.strip_prefix("   ") {
            header.output.push(output.to_string());
        } else if let Some(robots) = line.strip_prefix(" Robots: ") {
            header.robots = robots.split(", ").map(str::to_string).collect();
        } else if let Some(command) = line.strip_prefix(" bbz ") {
            header.command = command.split_whitespace().map(str::to_string).collect();
        } else {
            in_output = line == " prints";
        }
    }
    if header.robots.is_empty() || header.command.is_empty() || header.output.is_empty() {
        return Err("the header names no robots, no command or no output".to_string());
    }
    Ok(header)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_is_read_up_to_the_first_statement() {
        let text = "# Blinks.\n#\n# Robots: kilobot, zooids\n#\n# bbz run x.bzz --steps 1\n# prints\n\
                    #   led(1)\n#   a  b\n\nled(1)\n# bbz run y.bzz\n";
        let header = parse(text).unwrap();
        assert_eq!(header.robots, ["kilobot", "zooids"]);
        assert_eq!(header.command, ["run", "x.bzz", "--steps", "1"]);
        assert_eq!(header.output, ["led(1)", "a  b"]);
    }

    #[test]
    fn a_header_without_promises_is_refused() {
        assert!(parse("# Blinks.\n").is_err());
    }
}
