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

use std::path::Path;

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

/// Checks an example: it compiles without a warning and runs for every robot that it names, as a script and
/// as an image alike, and prints what it says that it prints. Images are written to `folder`.
pub fn check(path: &str, folder: &Path) -> Vec<Failure> {
    let header = match parse(&files::read(path)) {
        Ok(header) => header,
        Err(e) => return vec![format!("{path}:1: {e}\n")],
    };
    let mut failures = Vec::new();
    for robot in &header.robots {
        failures.extend(check_on(path, robot, folder));
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

/// Checks, runs, builds, and runs what was built.
fn check_on(path: &str, robot: &str, folder: &Path) -> Option<Failure> {
    // Both may be paths; files of one name lie in several folders.
    let image = format!("{path}-{robot}.bbi").replace('/', "_");
    let image = folder.join(image).to_string_lossy().into_owned();
    let commands = [
        vec!["check", path, "--robot", robot],
        vec!["run", path, "--robot", robot, "--steps", STEPS],
        vec!["build", path, "--robot", robot, "-o", &image],
        vec!["run", &image, "--robot", robot, "--steps", STEPS],
    ];
    let outcomes = commands.each_ref().map(|command| bbz::run(command, &[]));
    for (command, outcome) in commands.iter().zip(&outcomes) {
        // Only `build` has something to say: how large the image is.
        if outcome.status != Some(0) || command[0] != "build" && !outcome.stderr.is_empty() {
            return Some(format!(
                "{path}:1: bbz {} ended with {:?}\n{}",
                command.join(" "),
                outcome.status,
                outcome.stderr
            ));
        }
    }
    let (script, image): (Vec<_>, Vec<_>) =
        (outcomes[1].stdout.lines().collect(), outcomes[3].stdout.lines().collect());
    diff::lines(&script, &image)
        .map(|difference| format!("{path}:1: the image for {robot} differs\n{difference}"))
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
