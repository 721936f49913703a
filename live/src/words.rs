//! The names that scripts may use, with their help, for the completion in an editor.

use bittybuzz_arena::scenario::Group;
use bittybuzz_robot_spec::{Robot, RobotFunction};
use bittybuzz_vm_core::builtin::{self, BuiltinInfo, BuiltinKind, Library};
use serde_json::{Value, json};

/// The library of methods of objects, which can follow any variable.
const OBJECT: &str = "*";

/// Returns the names that scripts can use on the robots of some groups: built-in functions,
/// functions of the robots, and tables of sensors with their fields. Each is an object. `of` is the
/// table before the dot, `*` for any variable, and empty for names without a dot. `call` is written
/// as in the help. `is_called` is true for functions, and false for values.
pub fn describe<'a>(groups: impl Iterator<Item = &'a Group>) -> Vec<Value> {
    let mut words: Vec<Value> = builtin::TABLE.iter().map(of_builtin).collect();
    words.extend(groups.flat_map(|group| of_robot(&group.robot)));
    let mut once: Vec<Value> = Vec::new();
    for word in words {
        if !once.contains(&word) {
            once.push(word);
        }
    }
    once
}

fn of_builtin(info: &BuiltinInfo) -> Value {
    let of = match info.library {
        Library::Rng => "math.rng",
        library if library.is_object() => OBJECT,
        library => library.global_name().unwrap_or_default(),
    };
    let (call, help) = info.help.split_once(": ").unwrap_or((info.help, ""));
    json!({ "of": of, "name": info.name, "call": call, "help": help, "is_called": info.kind != BuiltinKind::Value })
}

fn of_robot(robot: &Robot) -> impl Iterator<Item = Value> + '_ {
    let functions = robot.functions.iter().map(|function| {
        let (name, call, help) = (&function.name, call(function), &function.help);
        json!({ "of": "", "name": name, "call": call, "help": help, "is_called": true })
    });
    let tables = robot.tables.iter().flat_map(|table| {
        let help = &table.help;
        let fields = table.fields.iter().map(move |field| {
            let (of, name, call) = (&table.name, &field.name, format!("{}.{field}", table.name));
            json!({ "of": of, "name": name, "call": call, "help": help, "is_called": false })
        });
        let name = &table.name;
        let own = json!({ "of": "", "name": name, "call": name, "help": help, "is_called": false });
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
