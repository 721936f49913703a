//! Values of scripts in a form that does not depend on the machine.

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::number::Profile;

/// The visible content of a variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VariableContent {
    /// nil, or no such variable.
    Nil,
    /// A number.
    Number(f64),
    /// A string, by its number in the script.
    Text(u16),
    /// A table, a function, or a string that was made at run time.
    Other,
}

pub fn content<P: Profile>(value: Option<Value<P>>) -> VariableContent {
    let Some(value) = value.filter(|value| !value.is_nil()) else { return VariableContent::Nil };
    if let Some(integer) = value.as_int() {
        return VariableContent::Number(f64::from(integer));
    }
    match (value.as_f32(), value.as_string()) {
        (Some(float), _) => VariableContent::Number(f64::from(float)),
        (None, Some(number)) => VariableContent::Text(number),
        (None, None) => VariableContent::Other,
    }
}

/// A number of a script.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScriptNumber {
    /// An integer.
    Int(i32),
    /// A float.
    Float(f32),
}

impl ScriptNumber {
    /// Returns the number in a value; `None` if the value is not a number.
    pub fn from_value<P: Profile>(value: Value<P>) -> Option<Self> {
        let float = || value.as_f32().map(ScriptNumber::Float);
        value.as_int().map(ScriptNumber::Int).or_else(float)
    }

    /// Returns the number as a value. The scenario has checked that it fits the number profile of
    /// the robot.
    pub fn value<P: Profile>(self) -> Value<P> {
        match self {
            ScriptNumber::Int(int) => Value::int(int),
            ScriptNumber::Float(float) => Value::float(float),
        }
    }
}

/// Returns a key of a stigmergy or a table as a value.
pub fn value<P: Profile>(key: VariableContent) -> Value<P> {
    match key {
        VariableContent::Number(number) => Value::int(number as i32),
        VariableContent::Text(number) => Value::string(number),
        VariableContent::Nil | VariableContent::Other => Value::nil(),
    }
}
