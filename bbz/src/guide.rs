//! `bbz guide`: everything that a script can use, as one page for people and for coding assistants.
//!
//! Each section comes from the source of its facts: the language from its page in the book, the
//! built-ins from the table of the virtual machine, the libraries from their files, the robots from
//! their robot files, the codes from the compiler, and the commands from the command line itself.
//! This file adds only headings.

use std::fmt::Display;

use bittybuzz_compiler::token::{FixedToken, KEYWORDS};
use bittybuzz_robot_files::{all_shipped, find};
use bittybuzz_robot_spec::Robot;
use bittybuzz_vm_core::builtin::{Feature, Library, TABLE};
use clap::{Arg, Args, Command};

use crate::exit::ExitStatus;
use crate::explain;
use crate::output;
use crate::problem::Problem;
use crate::robots;

/// The page of the book about the language. Tests compile and run its scripts.
const LANGUAGE: &str = include_str!("../../docs/language.md");

/// Whole scripts, with a comment that names the robots that can run them.
const SCRIPTS: [&str; 3] = [
    include_str!("../../examples/swarm/gradient.bzz"),
    include_str!("../../examples/patrol.bzz"),
    include_str!("../../examples/swarm/leader_election.bzz"),
];

/// The scenario that simulates the last of [`SCRIPTS`], which every robot can run.
const SCENARIO: &str = include_str!("../../examples/swarm/leader_election.toml");

/// The line of a script that names its robots.
const ROBOTS: &str = "# Robots: ";

const EXAMPLES: &str = "\
Examples:
  bbz guide > buzz.md            everything, as a file for a coding assistant
  bbz guide --robot kilobot      the page for scripts of one robot
  bbz guide --robot mine.toml    the same with a robot file of your own";

/// Arguments of `bbz guide`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct GuideArguments {
    /// Robot: its name or the path of a robot file (*.toml); without, the page describes all
    #[arg(long, value_name = "NAME|PATH.toml")]
    robot: Option<String>,
}

/// Prints the page, with a section for each command of `command`.
pub fn execute(
    arguments: &GuideArguments,
    command: Command,
) -> Result<ExitStatus, Box<dyn Problem>> {
    let robots = match &arguments.robot {
        Some(robot) => vec![find(robot)?],
        None => all_shipped(),
    };
    output::write(&page(&robots, command))?;
    Ok(ExitStatus::Success)
}

fn page(robots: &[Robot], mut command: Command) -> String {
    command.build();
    let version = env!("CARGO_PKG_VERSION");
    let titles: Vec<&str> = robots.iter().map(|robot| robot.title.as_str()).collect();
    let sections = [
        format!(
            "# Buzz scripts with bbz {version}\n\nThis page is the output of `bbz guide`: the language, \
             its functions, the functions of the robots ({}), whole scripts, the messages of the compiler, \
             and the commands.\n",
            titles.join(", ")
        ),
        language(),
        words(),
        built_ins(),
        libraries(),
        robots.iter().map(robot).collect(),
        scripts(robots),
        codes(),
        commands(&command),
    ];
    sections.join("\n")
}

/// Returns a block of text that Markdown prints as it is.
fn block(language: &str, text: impl Display) -> String {
    format!("```{language}\n{}\n```\n", text.to_string().trim_end())
}

/// Returns the page about the language, with its headings one level lower, and without links,
/// which lead to other pages.
fn language() -> String {
    let mut text = String::new();
    let mut is_block = false;
    for line in LANGUAGE.lines() {
        is_block ^= line.starts_with("```");
        if !is_block && line.starts_with('#') {
            text.push('#');
        }
        text += &if is_block { line.to_owned() } else { without_links(line) };
        text.push('\n');
    }
    text
}

/// Replaces each `[text](target)` by its text.
fn without_links(line: &str) -> String {
    let mut text = String::new();
    let mut rest = line;
    while let Some((before, (label, after))) = rest.split_once('[').and_then(|(before, link)| {
        let (label, target) = link.split_once("](")?;
        Some((before, (label, target.split_once(')')?.1)))
    }) {
        text += before;
        text += label;
        rest = after;
    }
    text + rest
}

fn words() -> String {
    let keywords: Vec<String> =
        KEYWORDS.map(FixedToken::text).iter().map(|word| format!("`{word}`")).collect();
    format!(
        "## Keywords\n\nNo name can be one of {}.\n`include` is special only before a string.\n",
        keywords.join(", ")
    )
}

fn built_ins() -> String {
    let library = |library: Library| {
        let title = match library {
            Library::Global => "without a library".to_owned(),
            Library::Rng => "math.rng".to_owned(),
            Library::SwarmObject => "of a swarm s".to_owned(),
            Library::StigmergyObject => "of a virtual stigmergy v".to_owned(),
            Library::Snapshot => "of a result n of neighbors.map, filter, kin or nonkin".to_owned(),
            library => library.global_name().expect("the others have no global").to_owned(),
        };
        let functions = TABLE.iter().filter(|info| info.library == library);
        let lines = functions.map(|info| match info.feature {
            Feature::Strings => format!("  {} (profile full only)\n", info.help),
            _ => format!("  {}\n", info.help),
        });
        format!("{title}\n{}", lines.collect::<String>())
    };
    let shown = Library::ALL.map(library).join("\n");
    format!("## All built-in functions\n\n{}", block("text", shown))
}

/// Returns the head and the functions of each file of the library.
fn libraries() -> String {
    let files = bittybuzz_library::FILES.iter().map(|(name, file)| {
        let head = file.lines().map_while(|line| line.strip_prefix('#'));
        let lines = head.map(|line| format!("{}\n", line.strip_prefix(' ').unwrap_or(line)));
        let functions = library_functions(file).into_iter().map(|line| format!("  {line}\n"));
        format!("{name}: {}", lines.chain(functions).collect::<String>())
    });
    let shown = files.collect::<Vec<_>>().join("\n");
    format!("## Libraries\n\nA script uses them by `include`.\n\n{}", block("text", shown))
}

/// Returns a line for each function of a library that has a comment.
fn library_functions(file: &str) -> Vec<String> {
    let mut functions = Vec::new();
    let mut comment = String::new();
    for line in file.lines() {
        let line = line.trim();
        if let Some(more) = line.strip_prefix('#') {
            comment += more;
            continue;
        }
        if let Some((name, rest)) = line.split_once(" = function(")
            && let Some((parameters, _)) = rest.split_once(')')
            && !comment.is_empty()
        {
            functions.push(format!("{name}({parameters}):{comment}"));
        }
        comment.clear();
    }
    functions
}

fn robot(robot: &Robot) -> String {
    let shown = block("text", robots::describe(robot));
    format!("## Robot {}\n\n{shown}\n", robot.name)
}

/// Returns the scripts that one of the robots can run, and a scenario.
fn scripts(robots: &[Robot]) -> String {
    let mut text = "## Whole scripts\n".to_owned();
    let can_run = |script: &&&str| {
        let named = script.lines().find_map(|line| line.strip_prefix(ROBOTS)).unwrap_or("");
        named.split(", ").any(|name| robots.iter().any(|robot| robot.name == name))
    };
    for script in SCRIPTS.iter().filter(can_run) {
        text += &format!("\n{}", block("buzz", script));
    }
    text + "\nThis scenario simulates the last of them with `bbz sim`:\n\n"
        + &block("toml", SCENARIO)
}

/// Returns the codes, a line for all that begin with the same three characters.
fn codes() -> String {
    let mut text = "## Messages\n\n`bbz explain CODE` prints cause and cure.\n".to_owned();
    let mut group = String::new();
    for (code, title) in explain::codes() {
        text += match code.get(..3).expect("a code has five characters") {
            same if same == group => "; ",
            other => {
                other.clone_into(&mut group);
                "\n* "
            }
        };
        text += &format!("{code} {title}");
    }
    text + "\n"
}

fn commands(command: &Command) -> String {
    let examples = command.get_after_help().expect("the command line has examples");
    let mut text = format!("## Commands\n\n{}", block("text", examples));
    let commands = command.get_subcommands().filter(|command| command.get_name() != "help");
    let commands = commands.map(|command| {
        let arguments = command.get_arguments().filter_map(argument).collect::<String>();
        let inner = command.get_subcommands().filter(|command| command.get_name() != "help");
        usage(command) + &arguments + &inner.map(usage).collect::<String>()
    });
    text += "\n";
    text += &block("text", commands.collect::<String>());
    text
}

/// Returns a line with the form of a command and its purpose.
fn usage(command: &Command) -> String {
    let about = command.get_about().expect("each command has a comment");
    let usage = command.clone().render_usage().to_string();
    format!("{}: {about}\n", usage.trim_start_matches("Usage: "))
}

/// Returns a line with the form of an argument and its help; `None` for `--help`.
fn argument(argument: &Arg) -> Option<String> {
    if argument.get_id() == "help" || argument.is_hide_set() {
        return None;
    }
    let help = argument.get_help().expect("each argument has a comment");
    Some(format!("    {argument}: {help}\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_become_their_text() {
        assert_eq!(without_links("see [a](b.md), or [c](d) and t[1](2)."), "see a, or c and t1.");
        assert_eq!(without_links("a[0] and f(x) [x] (y)"), "a[0] and f(x) [x] (y)");
    }

    #[test]
    fn a_function_of_a_library_has_its_comment() {
        let file = "# Head.\n\nt = {\n  # Adds x,\n  # twice.\n  .add = function(t, x) {\n    \
                    var f = function(y) { y }\n  }\n}\n";
        assert_eq!(library_functions(file), [".add(t, x): Adds x, twice."]);
    }
}
