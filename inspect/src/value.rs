//! Values of a script, with names.

/// The identity of a table or closure. Equal ids mean the same object while the script can reach
/// it. After that, another object may get the id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub u16);

/// A value of a script.
#[derive(Debug, Clone, PartialEq)]
pub enum ScriptValue {
    /// The value nil.
    Nil,
    /// An argument that was not passed.
    Unset,
    /// An integer.
    Int(i32),
    /// A float.
    Float(f32),
    /// A string. Bytes that are not valid UTF-8 are replaced.
    String(String),
    /// A constant string of which only the number is known.
    UnknownString(u16),
    /// A table, or a result of `neighbors.map` or a similar function.
    Table(ObjectId),
    /// A function with captured values or a `self`.
    Closure(ObjectId),
    /// A function of the script that captures nothing.
    Function(String),
    /// A built-in function, such as `math.sqrt`.
    Builtin(String),
    /// A robot function.
    RobotFunction(String),
    /// A library, such as `neighbors`.
    Library(&'static str),
    /// A swarm, by its number in the script.
    Swarm(u16),
    /// A stigmergy, by its number in the script.
    Stigmergy(u16),
}

/// A value with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// The name in the source; without symbols a number, such as `global 3`.
    pub name: String,
    pub value: ScriptValue,
}
