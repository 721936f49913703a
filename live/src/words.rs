//! The names that scripts may use, with their help, for the completion in an editor.

use bittybuzz_arena::scenario::Group;
use bittybuzz_robot_spec::{Robot, RobotFunction};
use bittybuzz_vm_core::builtin::{self, BuiltinInfo, BuiltinKind, Library};
use serde::Serialize;

/// A name that scripts can use, with its help.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Word {
    /// The table before the dot, `*` for any variable, and empty for names without a dot.
    pub of: String,
    pub name: String,
    /// The form of the call, as written in the help.
    pub call: String,
    pub help: String,
    /// True for functions, and false for values.
    pub is_called: bool,
}

/// The library of methods of objects, which can follow any variable.
const OBJECT: &str = "*";

/// Returns the names that scripts can use on the robots of some groups: built-in functions,
/// functions of the robots, and tables of sensors with their fields.
pub fn describe<'a>(groups: impl Iterator<Item = &'a Group>) -> Vec<Word> {
    let mut words: Vec<Word> = builtin::TABLE.iter().map(of_builtin).collect();
    words.extend(groups.flat_map(|group| of_robot(&group.robot)));
    let mut once: Vec<Word> = Vec::new();
    for word in words {
        if !once.contains(&word) {
            once.push(word);
        }
    }
    once
}

fn of_builtin(info: &BuiltinInfo) -> Word {
    let of = match info.library {
        Library::Rng => "math.rng",
        library if library.is_object() => OBJECT,
        // Functions without a library have no table.
        library => library.global_name().unwrap_or_default(),
    };
    let (call, help) = info.help.split_once(": ").unwrap_or((info.help, ""));
    Word {
        of: of.to_owned(),
        name: info.name.to_owned(),
        call: call.to_owned(),
        help: help.to_owned(),
        is_called: info.kind != BuiltinKind::Value,
    }
}

fn of_robot(robot: &Robot) -> impl Iterator<Item = Word> + '_ {
    let functions = robot.functions.iter().map(|function| Word {
        of: String::new(),
        name: function.name.clone(),
        call: call(function),
        help: function.help.clone(),
        is_called: true,
    });
    let tables = robot.tables.iter().flat_map(|table| {
        let fields = table.fields.iter().map(|field| Word {
            of: table.name.clone(),
            name: field.name.clone(),
            call: format!("{}.{field}", table.name),
            help: table.help.clone(),
            is_called: false,
        });
        let own = Word {
            of: String::new(),
            name: table.name.clone(),
            call: table.name.clone(),
            help: table.help.clone(),
            is_called: false,
        };
        std::iter::once(own).chain(fields)
    });
    functions.chain(tables)
}

/// Formats a call with the first list of arguments that a function accepts.
fn call(function: &RobotFunction) -> String {
    let parameters = function.accepts.first().into_iter().flatten();
    let parameters: Vec<String> = parameters.map(ToString::to_string).collect();
    format!("{}({})", function.name, parameters.join(", "))
}
