//! `bbz stubs`: writes a robot file, to start from, for the robot functions that a script calls and
//! for the tables of the robot that it reads.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::check::missing::{Missing, MissingFunction, MissingValue, missing};
use bittybuzz_compiler::source::SourceMap;
use bittybuzz_robot_files::all_shipped;
use bittybuzz_robot_spec::{
    PARAMETERS_MAX, Robot, SignatureType, TableValue, ValueConstant, ValueSource, is_robot_name,
    table_of,
};
use clap::Args;

use crate::exit::ExitStatus;
use crate::output;
use crate::problem::Problem;
use crate::program::{self, InputError, InputKind};
use crate::report;
use crate::whole_file::{self, Inputs};

const EXAMPLES: &str = "\
Examples:
  bbz stubs patrol.bzz                   prints a robot file with the functions that patrol.bzz calls, and
                                         with the tables of the robot that it reads
  bbz stubs patrol.bzz -o rover.toml     writes it; then `bbz check patrol.bzz --robot rover.toml`

docs/own-robot.md leads from there to a robot that moves in `bbz sim`.

Exit status: 0, or 2 syntax error, 3 wrong command line or file.";

/// The sections of a body on two wheels and of a link.
const BODY: &str = "\
# The body that `bbz sim` moves: a disc on two wheels.
[body]
drive = \"differential\"
radius_mm = 50
wheel_distance_mm = 80
speed_mm_s = 200

# The link over which robots exchange messages.
[[sensor]]
name = \"radio\"
kind = \"range-and-bearing\"
range_mm = 1000
";

const POSITION: &str = "
[[table]]
name = \"pos\"
fields = \"x: number, y: number, z: number, orientation: number\"
help = \"x, y and z in mm, orientation in degrees\"
";

/// Arguments of `bbz stubs`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct StubsArguments {
    /// Script (.bzz)
    file: PathBuf,
    /// Write the robot file to OUT [default: standard output]
    #[arg(short, long, value_name = "OUT.toml")]
    output: Option<PathBuf>,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
}

/// Carries out the command.
pub fn execute(arguments: &StubsArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let path = arguments.file.as_path();
    if InputKind::of(path)? != InputKind::Script {
        return Err(InputError::NotAScript(path.to_owned()).into());
    }
    let parsed = program::parsed(path, &arguments.include);
    if parsed.has_errors() {
        report::diagnostics(&parsed.sources, &parsed.diagnostics);
        return Ok(ExitStatus::CompileError);
    }
    let output = arguments.output.as_deref();
    let text = robot_file(path, output, &missing(&parsed.script), &parsed.sources);
    // Parsing fails if two names of the script are too similar for one robot.
    let written = output.map_or_else(|| "the robot file".into(), Path::to_string_lossy);
    Robot::parse(&text, &written)?;
    match output {
        None => output::write(&text)?,
        Some(output) => {
            let mut inputs = Inputs::default();
            program::add_inputs(path, Some(&parsed.sources), &mut inputs);
            inputs.refuse(output)?;
            whole_file::write(output, text.as_bytes())?;
        }
    }
    Ok(ExitStatus::Success)
}

fn robot_file(
    script: &Path,
    output: Option<&Path>,
    missing: &Missing,
    sources: &SourceMap,
) -> String {
    let mut text = format!(
        "# The robot of {}. Each function is only logged: give it an effect with `sets` or `reads`.\n",
        one_line(script)
    );
    if !missing.values.is_empty() {
        text += "# Each value of a table is always 0: give it a sensor with `reads`.\n";
    }
    text += &like(missing);
    text += "\n";
    text += &format!("name = \"{}\"\n\n{BODY}", robot_name(output.unwrap_or(script)));
    if missing.has_position {
        text += POSITION;
    }
    for function in &missing.functions {
        text += &function_section(function, sources);
    }
    let robots = all_shipped();
    let hosts = host_tables(missing, &robots);
    for value in missing.values.iter().filter(|value| !is_in(value, &hosts)) {
        text += &value_section(value, sources);
    }
    for (robot, value) in hosts {
        text += &host_section(robot, value);
    }
    text
}

/// Returns the values of the tables that the script reads, where a robot that ships has a table of that
/// name: the script may read further ones through a variable.
fn host_tables<'a>(missing: &Missing, robots: &'a [Robot]) -> Vec<(&'a Robot, &'a TableValue)> {
    let tables: BTreeSet<&str> = missing.values.iter().map(|value| table_of(&value.path)).collect();
    let of_table = |table: &str| {
        let count = |robot: &&Robot| values_in(robot, table).count();
        let robot = robots.iter().max_by_key(count)?;
        Some(
            robot
                .values
                .iter()
                .filter(move |value| value.path.table() == table)
                .map(move |value| (robot, value))
                .collect::<Vec<_>>(),
        )
    };
    tables.into_iter().filter_map(of_table).flatten().collect()
}

/// Returns true if a table has the value already, or a table in its place, or it leads into a value.
fn is_in(value: &MissingValue, tables: &[(&Robot, &TableValue)]) -> bool {
    let leads_to = |one: &str, other: &str| {
        let rest = other.strip_prefix(one);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    };
    tables.iter().any(|(_, known)| {
        let known = known.path.text();
        leads_to(&value.path, known) || leads_to(known, &value.path)
    })
}

fn host_section(robot: &Robot, value: &TableValue) -> String {
    let path = value.path.text();
    let is_integer = match (&value.source, robot.function(path)) {
        (ValueSource::Constant(all), _) => {
            matches!(all.first(), Some(ValueConstant::Int(_)))
        }
        (ValueSource::Reading(_), function) => {
            function.is_some_and(|function| function.returns == Some(SignatureType::Int))
        }
    };
    let number = if is_integer { "0" } else { "0.0" };
    let count = value.elements.map_or(String::new(), |count| format!("count = {count}\n"));
    format!(
        "\n# As in the robot file of {}.\n[[value]]\nname = \"{path}\"\nis = {number}\n{count}help = {:?}\n",
        robot.name, value.help
    )
}

/// Returns a comment that names the robots that ship and have everything that the script requires;
/// nothing if there is none.
fn like(missing: &Missing) -> String {
    let functions = missing.functions.iter().map(|function| function.name.as_str());
    let tables = missing.values.iter().map(|value| table_of(&value.path));
    let names: Vec<&str> = functions.chain(tables).collect();
    let has = |robot: &Robot, name: &str| {
        robot.function(name).is_some() || values_in(robot, name).next().is_some()
    };
    let robots: Vec<String> = all_shipped()
        .iter()
        .filter(|robot| names.iter().all(|name| has(robot, name)))
        .map(|robot| format!("`--robot {}`", robot.name))
        .collect();
    match robots.is_empty() || names.is_empty() {
        true => String::new(),
        false => format!("# These have all of them already: {}.\n", robots.join(", ")),
    }
}

/// Returns the values of a robot in the table of that name.
fn values_in<'a>(robot: &'a Robot, table: &'a str) -> impl Iterator<Item = &'a TableValue> {
    robot.values.iter().filter(move |value| value.path.table() == table)
}

/// The number of elements of a list; a script does not say how many its robot has.
const ELEMENTS: u32 = 8;

fn value_section(value: &MissingValue, sources: &SourceMap) -> String {
    let path = one_line(sources.path(value.first_use.file));
    let place = sources.line_column(value.first_use);
    let is_list = value.path.contains('[');
    let (count, meaning) = match is_list {
        true => (format!("count = {ELEMENTS}\n"), format!("of {ELEMENTS} elements")),
        false => (String::new(), "a number".to_owned()),
    };
    format!(
        "\n# First used in {path}:{}:{}.\n[[value]]\nname = \"{}\"\nis = 0.0\n{count}\
         help = \"{meaning}\"\n",
        place.line, place.column, value.path,
    )
}

fn function_section(function: &MissingFunction, sources: &SourceMap) -> String {
    let path = one_line(sources.path(function.first_call.file));
    let place = sources.line_column(function.first_call);
    let mut accepts: Vec<String> =
        function.counts.iter().map(|count| format!("\"{}\"", parameters(*count))).collect();
    // Several large numbers of arguments give the same list.
    accepts.dedup();
    let mut counts: Vec<String> = function.counts.iter().map(usize::to_string).collect();
    let last = counts.pop().expect("a function is missing because it is called");
    let before = if counts.is_empty() { "" } else { " or " };
    let counts = format!("{}{before}{last}", counts.join(", "));
    let noun = if function.counts.iter().eq([&1]) { "argument" } else { "arguments" };
    let returns = match (function.is_result_used, function.is_text) {
        (true, true) => "returns = \"string\"\n",
        (true, false) => "returns = \"int\"\n",
        (false, _) => "",
    };
    format!(
        "\n# First called in {path}:{}:{}.\n[[function]]\nname = \"{}\"\naccepts = [{}]\n{returns}\
         logs = true\nhelp = \"called with {} {noun}\"\n",
        place.line,
        place.column,
        function.name,
        accepts.join(", "),
        counts,
    )
}

/// Returns parameters for that number of arguments. Their types are not known.
fn parameters(count: usize) -> String {
    if count > PARAMETERS_MAX {
        return "values: any...".to_owned();
    }
    let parameters: Vec<String> = (1..=count).map(|number| format!("a{number}: any")).collect();
    parameters.join(", ")
}

/// Derives the name of a robot from the name of the file.
fn robot_name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = stem.to_lowercase().replace(|c: char| !c.is_ascii_alphanumeric(), "-");
    if is_robot_name(&name) { name } else { format!("robot-{name}") }
}

/// Returns a path without control characters, for a comment of one line.
fn one_line(path: &Path) -> String {
    path.display().to_string().replace(char::is_control, "?")
}
