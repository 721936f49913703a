//! The log of a program, which is the one that it prints with Buzz.
//!
//! A script that any host can run has three parts: the tables and functions of the robot, where each function logs its
//! name and arguments; the program; and calls of its `init` and of some steps. With `BUZZ_BIN`, the folder of `bzzc` and
//! `bzzrun`, it also runs with Buzz.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use bittybuzz_builds::shell::Invocation;
use bittybuzz_vm_core::hash::fnv_1a;

use crate::sources::write;

/// The last line of a program that nothing stops.
const END: &str = "the end of the program";
const STEPS: u32 = 20;

/// Returns the script that runs a program without a host. `robot` is the robot file that `bbz stubs` wrote for it.
pub fn script(robot: &toml::Table, program: &str) -> String {
    let mut robot_text = Stubs::default();
    let items = |key: &str| {
        let items = robot.get(key).and_then(toml::Value::as_array);
        items.into_iter().flatten().filter_map(toml::Value::as_table)
    };
    items("value").for_each(|value| robot_text.value(value));
    items("function").for_each(|function| robot_text.function(function));
    let robot_text = robot_text.text;
    // Robots have this function, Buzz does not.
    let delay = "delay = function(ms) { }\n";
    format!(
        "{delay}{robot_text}include \"{program}\"\n\
         entry = init\n\
         if(not isnil(entry)) entry()\n\
         entry = step\n\
         steps = 0\n\
         while(steps < {STEPS}) {{\n  entry()\n  steps = steps + 1\n}}\n\
         log(\"{END}\")\n"
    )
}

/// Returns the hash of what the script has printed, up to its end; host and library may print more behind it. `stopped`
/// is true if a run-time error ended the run.
pub fn hash(printed: &str, stopped: bool) -> String {
    let mut lines: Vec<&str> = printed.lines().collect();
    let end = lines.iter().position(|line| *line == END);
    lines.truncate(end.map_or(lines.len(), |end| end + 1));
    let text = lines.join("\n");
    let text = text.trim_end();
    // Buzz prints the sign of NaN, and where a function stands.
    let text = text.replace("-nan", "nan");
    let mut parts = text.split("[n-closure @");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let rest = part.split_once(']').map_or("", |(_, rest)| rest);
        let _ = write!(text, "[closure]{rest}");
    }
    let has_stopped = stopped && end.is_none();
    format!("{:08x}", fnv_1a(format!("{text}\n{has_stopped}").as_bytes()))
}

/// Runs the script with Buzz, and returns the hash of what it printed; `None` without `BUZZ_BIN`.
pub fn with_buzz(script: &Path, include: &[PathBuf]) -> Result<Option<String>> {
    let Some(bin) = std::env::var_os("BUZZ_BIN").map(PathBuf::from) else { return Ok(None) };
    let folder = script.parent().context("the script is in a folder")?;
    let include: Vec<String> = include.iter().map(|path| path.display().to_string()).collect();
    // `bzzc` starts its stages by name.
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default());
    let start = |program: &str, arguments: &[&str]| {
        Invocation::named(program, &bin.join(program), arguments)
            .in_folder(folder)
            .env("PATH", &path)
            .env("BUZZ_INCLUDE_PATH", &include.join(":"))
            .unannounced()
            .output_if(|output| output.status.code().is_some())
    };
    let name = script.file_name().context("the script has a name")?.to_string_lossy();
    let compiled = start("bzzc", &["-b", "program.bo", "-d", "program.bdb", &name])?;
    if !compiled.status.success() {
        return Ok(Some(String::from_utf8_lossy(&compiled.stderr).trim().to_owned()));
    }
    let ran = start("bzzrun", &["program.bo", "program.bdb"])?;
    let text = String::from_utf8_lossy(&ran.stdout);
    let printed = text.split("program.bo: execution terminated").next().unwrap_or_default();
    Ok(Some(hash(printed, !ran.status.success())))
}

/// Writes the script to that path.
pub fn write_script(path: &Path, robot: &toml::Table, program: &str) -> Result<()> {
    write(path, script(robot, program).as_bytes())
}

/// The tables and functions of a robot as a script.
#[derive(Default)]
struct Stubs {
    text: String,
    tables: BTreeSet<String>,
}

impl Stubs {
    fn line(&mut self, line: &str) {
        let _ = writeln!(self.text, "{line}");
    }

    /// Makes the tables around the last part of a name, as in `pose.position.x`.
    fn tables_around(&mut self, name: &str) {
        for (dot, _) in name.match_indices('.') {
            self.table(&name[..dot]);
        }
    }

    fn table(&mut self, name: &str) {
        if self.tables.insert(name.to_owned()) {
            self.line(&format!("{name} = {{}}"));
        }
    }

    fn value(&mut self, value: &toml::Table) {
        let name = value.get("name").and_then(toml::Value::as_str).unwrap_or_default();
        let text = match value.get("is") {
            Some(toml::Value::String(text)) => format!("\"{text}\""),
            Some(toml::Value::Integer(number)) => number.to_string(),
            _ => "0.0".to_owned(),
        };
        let Some((list, rest)) = name.split_once("[]") else {
            self.tables_around(name);
            return self.line(&format!("{name} = {text}"));
        };
        self.tables_around(list);
        self.table(list);
        let count = value.get("count").and_then(toml::Value::as_integer).unwrap_or(1);
        for item in 0..count {
            let item = format!("{list}[{item}]{rest}");
            self.tables_around(&item);
            self.line(&format!("{item} = {text}"));
        }
    }

    fn function(&mut self, function: &toml::Table) {
        let name = function.get("name").and_then(toml::Value::as_str).unwrap_or_default();
        self.tables_around(name);
        let accepts = function.get("accepts").and_then(toml::Value::as_array);
        let lists = accepts.into_iter().flatten().filter_map(toml::Value::as_str);
        let parameters = |list: &str| match list.contains("...") {
            true => 0,
            false => list.split(',').filter(|item| !item.trim().is_empty()).count(),
        };
        // Every call passes at least so many.
        let count = lists.map(parameters).min().unwrap_or(0);
        let names: Vec<String> = (0..count).map(|number| format!("a{number}")).collect();
        let shown: String = names.iter().map(|name| format!(", \" \", {name}")).collect();
        let result = match function.get("returns").and_then(toml::Value::as_str) {
            Some("string") => " return \"\"",
            Some(_) => " return 0",
            None => "",
        };
        let names = names.join(", ");
        self.line(&format!("{name} = function({names}) {{ log(\"{name}\"{shown}){result} }}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_becomes_tables_and_functions_that_log() {
        let robot = "
            [[value]]
            name = 'pose.position.x'
            is = 0.0
            [[value]]
            name = 'proximity[].value'
            is = 1
            count = 2
            [[function]]
            name = 'debug.print'
            accepts = ['a: any', 'a: any, b: any']
            [[function]]
            name = 'battery'
            returns = 'int'
        ";
        let robot: toml::Table = toml::from_str(robot).unwrap();
        let expected = "\
delay = function(ms) { }
pose = {}
pose.position = {}
pose.position.x = 0.0
proximity = {}
proximity[0] = {}
proximity[0].value = 1
proximity[1] = {}
proximity[1].value = 1
debug = {}
debug.print = function(a0) { log(\"debug.print\", \" \", a0) }
battery = function() { log(\"battery\") return 0 }
include \"p.bzz\"
";
        let script = script(&robot, "p.bzz");
        assert!(script.starts_with(expected), "{script}");
    }

    #[test]
    fn differences_without_a_meaning_do_not_count() {
        assert_eq!(hash("f [n-closure @384] 1", false), hash("f [closure] 1", false));
        let one = hash(&format!("1 -nan\n{END}\nmore\n"), true);
        assert_eq!(one, hash(&format!("1 nan\n{END}"), false));
        assert_ne!(one, hash("1 nan", false));
        assert_ne!(hash("1", true), hash("1", false));
    }
}
