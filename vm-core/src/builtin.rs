//! The built-in functions and libraries: number, name, arguments and the feature that each needs.
//!
//! A direct call in a script (`math.sqrt(2)`) contains the number of the built-in. A library that
//! is used as a value (`m = math`) is the number of a [`Library`]. The image then lists the names
//! of its functions and their built-ins ([`crate::image`]), so that the virtual machine holds no
//! names.

/// A set of built-in functions that scripts see as a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Library {
    /// The functions that belong to no library: `size`, `log`, ...
    Global = 0,
    /// `math`
    Math = 1,
    /// `math.rng`
    Rng = 2,
    /// `string`
    String = 3,
    /// `neighbors`
    Neighbors = 4,
    /// `swarm`
    Swarm = 5,
    /// The object that `swarm.create` and its relatives return.
    SwarmObject = 6,
    /// `stigmergy`
    Stigmergy = 7,
    /// The object that `stigmergy.create` returns.
    StigmergyObject = 8,
    /// `pos`: the position of the robot, if the robot knows it.
    Position = 9,
    /// The object that `neighbors.map` and its relatives return.
    Snapshot = 10,
}

impl Library {
    /// Every library, by number.
    pub const ALL: [Library; 11] = [
        Library::Global,
        Library::Math,
        Library::Rng,
        Library::String,
        Library::Neighbors,
        Library::Swarm,
        Library::SwarmObject,
        Library::Stigmergy,
        Library::StigmergyObject,
        Library::Position,
        Library::Snapshot,
    ];

    /// Returns the name of the global that holds the library; `None` for libraries that are reached
    /// in another way.
    pub const fn global_name(self) -> Option<&'static str> {
        match self {
            Library::Math => Some("math"),
            Library::String => Some("string"),
            Library::Neighbors => Some("neighbors"),
            Library::Swarm => Some("swarm"),
            Library::Stigmergy => Some("stigmergy"),
            Library::Position => Some("pos"),
            Library::Global
            | Library::Rng
            | Library::SwarmObject
            | Library::StigmergyObject
            | Library::Snapshot => None,
        }
    }

    /// Returns true if its functions work on an object, which is then their first argument.
    pub const fn is_object(self) -> bool {
        matches!(self, Library::SwarmObject | Library::StigmergyObject | Library::Snapshot)
    }
}

/// A part of the virtual machine that an image may need; a bit in the image header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Feature {
    /// Always there.
    Core = 0,
    /// Floating-point functions of `math`.
    Maths = 1 << 0,
    /// Text of strings: strings made at run time.
    Strings = 1 << 1,
    /// `neighbors`.
    Neighbors = 1 << 2,
    /// `swarm`.
    Swarm = 1 << 3,
    /// `stigmergy`.
    Stigmergy = 1 << 4,
    /// Values that need more than one frame to be sent. No built-in needs this feature by itself.
    LongMessages = 1 << 5,
    /// Every name accepts numbers in the class table. Every machine has this feature, and no
    /// built-in needs it.
    Numbers = 1 << 6,
    /// The stigmergy table: stigmergies have other numbers in messages than in the script. Every
    /// machine with stigmergies has this feature, and no built-in needs it.
    StigmergyTable = 1 << 7,
}

/// The behavior of a built-in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BuiltinKind {
    /// Computes its result at once.
    Plain,
    /// Calls script functions, suspends the script, or takes an instruction for each element. The
    /// result comes later, so the call cannot drop it.
    Calls,
    /// A value instead of a function: `math.pi`, `math.rng`.
    Value,
}

/// A row of the table of built-ins.
#[derive(Debug, Clone, Copy)]
pub struct BuiltinInfo {
    /// Number in images.
    pub number: u8,
    /// The library that has it.
    pub library: Library,
    /// The name in its library.
    pub name: &'static str,
    /// The smallest number of arguments.
    pub min: u8,
    /// The greatest number of arguments; 255 for any number.
    pub max: u8,
    pub kind: BuiltinKind,
    /// The feature that it needs.
    pub feature: Feature,
    /// Parameters and meaning in one line.
    pub help: &'static str,
}

macro_rules! builtins {
    ($($id:ident = $number:literal, $library:ident . $name:literal, $min:literal ..= $max:literal, $kind:ident, $feature:ident, $help:literal;)*) => {
        $(#[doc = $help] pub const $id: u8 = $number;)*

        /// Every built-in, by number.
        pub const TABLE: &[BuiltinInfo] = &[$(BuiltinInfo {
            number: $number, library: Library::$library, name: $name, min: $min, max: $max,
            kind: BuiltinKind::$kind, feature: Feature::$feature, help: $help,
        },)*];
    };
}

builtins! {
    SIZE = 0, Global."size", 1..=1, Plain, Core, "size(t): number of entries";
    FOREACH = 1, Global."foreach", 2..=2, Calls, Core, "foreach(t, f): f(key, value) for every entry";
    MAP = 2, Global."map", 2..=2, Calls, Core, "map(t, f): table of f(key, value) under the same keys";
    FILTER = 3, Global."filter", 2..=2, Calls, Core, "filter(t, f): the entries for which f(key, value) is true";
    REDUCE = 4, Global."reduce", 3..=3, Calls, Core, "reduce(t, f, a): a = f(key, value, a) for every entry";
    TYPE = 5, Global."type", 1..=1, Plain, Core, "type(x): name of its type";
    IS_NIL = 6, Global."isnil", 1..=1, Plain, Core, "isnil(x): 1 or 0";
    IS_INT = 7, Global."isint", 1..=1, Plain, Core, "isint(x): 1 or 0";
    IS_FLOAT = 8, Global."isfloat", 1..=1, Plain, Core, "isfloat(x): 1 or 0";
    IS_STRING = 9, Global."isstring", 1..=1, Plain, Core, "isstring(x): 1 or 0";
    IS_TABLE = 10, Global."istable", 1..=1, Plain, Core, "istable(x): 1 or 0";
    IS_CLOSURE = 11, Global."isclosure", 1..=1, Plain, Core, "isclosure(x): 1 or 0";
    IS_USERDATA = 12, Global."isuserdata", 1..=1, Plain, Core, "isuserdata(x): always 0";
    TO_INT = 13, Global."int", 1..=1, Plain, Core, "int(x): truncates and saturates";
    TO_FLOAT = 14, Global."float", 1..=1, Plain, Core, "float(x): the float nearest to x";
    CLONE = 15, Global."clone", 1..=1, Calls, Core, "clone(x): deep copy";
    LOG = 16, Global."log", 0..=255, Plain, Core, "log(...): prints its arguments and a newline";
    ASSERT = 17, Global."assert", 1..=2, Plain, Core, "assert(c[, message]): fault if c is false";
    DELAY = 18, Global."delay", 1..=1, Calls, Core, "delay(ms): suspends the script, nothing else";
    RAND = 19, Global."rand", 0..=0, Plain, Core, "rand(): int 0..32767";

    ABS = 20, Math."abs", 1..=1, Plain, Core, "math.abs(x)";
    FLOOR = 21, Math."floor", 1..=1, Plain, Core, "math.floor(x): int";
    CEIL = 22, Math."ceil", 1..=1, Plain, Core, "math.ceil(x): int";
    ROUND = 23, Math."round", 1..=1, Plain, Core, "math.round(x): int, halves away from zero";
    MIN = 24, Math."min", 2..=2, Plain, Core, "math.min(a, b)";
    MAX = 25, Math."max", 2..=2, Plain, Core, "math.max(a, b)";
    SQRT = 26, Math."sqrt", 1..=1, Plain, Maths, "math.sqrt(x)";
    EXP = 27, Math."exp", 1..=1, Plain, Maths, "math.exp(x)";
    LN = 28, Math."log", 1..=1, Plain, Maths, "math.log(x): natural logarithm";
    LOG2 = 29, Math."log2", 1..=1, Plain, Maths, "math.log2(x)";
    LOG10 = 30, Math."log10", 1..=1, Plain, Maths, "math.log10(x)";
    SIN = 31, Math."sin", 1..=1, Plain, Maths, "math.sin(radians)";
    COS = 32, Math."cos", 1..=1, Plain, Maths, "math.cos(radians)";
    TAN = 33, Math."tan", 1..=1, Plain, Maths, "math.tan(radians)";
    ASIN = 34, Math."asin", 1..=1, Plain, Maths, "math.asin(x): radians";
    ACOS = 35, Math."acos", 1..=1, Plain, Maths, "math.acos(x): radians";
    ATAN = 36, Math."atan", 2..=2, Plain, Maths, "math.atan(y, x): radians in (-pi, pi]";
    PI = 37, Math."pi", 0..=0, Value, Core, "math.pi: 3.14159...";
    RNG = 38, Math."rng", 0..=0, Value, Core, "math.rng: random numbers";

    SET_SEED = 39, Rng."setseed", 1..=1, Plain, Core, "math.rng.setseed(n)";
    UNIFORM = 40, Rng."uniform", 0..=2, Plain, Core, "math.rng.uniform([[a,] b]): from a up to but not including b";
    GAUSSIAN = 41, Rng."gaussian", 0..=2, Plain, Maths, "math.rng.gaussian([stddev[, mean]])";
    EXPONENTIAL = 42, Rng."exponential", 1..=1, Plain, Maths, "math.rng.exponential(mean)";

    LENGTH = 43, String."length", 1..=1, Plain, Strings, "string.length(s): bytes";
    SUB = 44, String."sub", 2..=3, Plain, Strings, "string.sub(s, n[, m]): characters n to m-1";
    CONCAT = 45, String."concat", 2..=255, Plain, Strings, "string.concat(s1, s2, ...)";
    TO_STRING = 46, String."tostring", 1..=1, Plain, Strings, "string.tostring(x): what log prints";
    STRING_TO_INT = 47, String."toint", 1..=1, Plain, Strings, "string.toint(s): nil if s does not start with a number";
    STRING_TO_FLOAT = 48, String."tofloat", 1..=1, Plain, Strings, "string.tofloat(s): nil if s does not start with a number";

    NEIGHBORS_GET = 49, Neighbors."get", 1..=1, Plain, Neighbors, "neighbors.get(id): its data or nil";
    NEIGHBORS_COUNT = 50, Neighbors."count", 0..=0, Plain, Neighbors, "neighbors.count()";
    NEIGHBORS_FOREACH = 51, Neighbors."foreach", 1..=1, Calls, Neighbors, "neighbors.foreach(f): f(id, data)";
    NEIGHBORS_MAP = 52, Neighbors."map", 1..=1, Calls, Neighbors, "neighbors.map(f): snapshot of f(id, data)";
    NEIGHBORS_FILTER = 53, Neighbors."filter", 1..=1, Calls, Neighbors, "neighbors.filter(f): those for which f(id, data)";
    NEIGHBORS_REDUCE = 54, Neighbors."reduce", 2..=2, Calls, Neighbors, "neighbors.reduce(f, a): a = f(id, data, a)";
    NEIGHBORS_KIN = 55, Neighbors."kin", 0..=0, Calls, Neighbors, "neighbors.kin(): those in the current swarm";
    NEIGHBORS_NONKIN = 56, Neighbors."nonkin", 0..=0, Calls, Neighbors, "neighbors.nonkin(): those outside it";
    NEIGHBORS_BROADCAST = 57, Neighbors."broadcast", 2..=2, Plain, Neighbors, "neighbors.broadcast(topic, value)";
    NEIGHBORS_LISTEN = 58, Neighbors."listen", 2..=2, Plain, Neighbors, "neighbors.listen(topic, f): f(topic, value, id)";
    NEIGHBORS_IGNORE = 59, Neighbors."ignore", 1..=1, Plain, Neighbors, "neighbors.ignore(topic)";

    SWARM_CREATE = 60, Swarm."create", 1..=1, Plain, Swarm, "swarm.create(n)";
    SWARM_ID = 61, Swarm."id", 0..=1, Plain, Swarm, "swarm.id([depth]): swarm of the running exec or nil";
    SWARM_UNION = 62, Swarm."union", 3..=3, Plain, Swarm, "swarm.union(n, a, b)";
    SWARM_INTERSECTION = 63, Swarm."intersection", 3..=3, Plain, Swarm, "swarm.intersection(n, a, b)";
    SWARM_DIFFERENCE = 64, Swarm."difference", 3..=3, Plain, Swarm, "swarm.difference(n, a, b)";
    SWARM_OBJECT_ID = 65, SwarmObject."id", 0..=0, Value, Swarm, "s.id: its number";
    SWARM_JOIN = 66, SwarmObject."join", 0..=0, Plain, Swarm, "s.join()";
    SWARM_LEAVE = 67, SwarmObject."leave", 0..=0, Plain, Swarm, "s.leave()";
    SWARM_IN = 68, SwarmObject."in", 0..=0, Plain, Swarm, "s.in(): 1 or 0";
    SWARM_SELECT = 69, SwarmObject."select", 1..=1, Plain, Swarm, "s.select(c): joins or leaves";
    SWARM_UNSELECT = 70, SwarmObject."unselect", 1..=1, Plain, Swarm, "s.unselect(c): leaves if c";
    SWARM_EXEC = 71, SwarmObject."exec", 1..=1, Calls, Swarm, "s.exec(f): f() if in the swarm";
    SWARM_OTHERS = 72, SwarmObject."others", 1..=1, Plain, Swarm, "s.others(n)";

    STIGMERGY_CREATE = 73, Stigmergy."create", 1..=1, Plain, Stigmergy, "stigmergy.create(n)";
    STIGMERGY_PUT = 74, StigmergyObject."put", 2..=2, Plain, Stigmergy, "v.put(key, value)";
    STIGMERGY_GET = 75, StigmergyObject."get", 1..=1, Plain, Stigmergy, "v.get(key)";
    STIGMERGY_SIZE = 76, StigmergyObject."size", 0..=0, Plain, Stigmergy, "v.size()";
    STIGMERGY_FOREACH = 77, StigmergyObject."foreach", 1..=1, Calls, Stigmergy, "v.foreach(f): f(key, value, robot)";
    STIGMERGY_MAP = 78, StigmergyObject."map", 1..=1, Calls, Stigmergy, "v.map(f): table of f(key, value, robot)";
    STIGMERGY_REDUCE = 79, StigmergyObject."reduce", 2..=2, Calls, Stigmergy, "v.reduce(f, a): a = f(key, value, robot, a)";
    STIGMERGY_ONCONFLICT = 80, StigmergyObject."onconflict", 1..=1, Plain, Stigmergy, "v.onconflict(f): f(key, local, remote)";
    STIGMERGY_ONCONFLICTLOST = 81, StigmergyObject."onconflictlost", 1..=1, Plain, Stigmergy, "v.onconflictlost(f): f(key, lost)";
    STIGMERGY_OBJECT_ID = 82, StigmergyObject."id", 0..=0, Value, Stigmergy, "v.id: its number";

    POSITION_X = 83, Position."x", 0..=0, Value, Core, "pos.x: mm";
    POSITION_Y = 84, Position."y", 0..=0, Value, Core, "pos.y: mm";
    POSITION_Z = 85, Position."z", 0..=0, Value, Core, "pos.z: mm";
    POSITION_ORIENTATION = 86, Position."orientation", 0..=0, Value, Core, "pos.orientation: degrees";

    SNAPSHOT_GET = 87, Snapshot."get", 1..=1, Plain, Neighbors, "n.get(id): what is kept for that robot, or nil";
    SNAPSHOT_COUNT = 88, Snapshot."count", 0..=0, Plain, Neighbors, "n.count()";
    SNAPSHOT_FOREACH = 89, Snapshot."foreach", 1..=1, Calls, Neighbors, "n.foreach(f): f(id, value)";
    SNAPSHOT_MAP = 90, Snapshot."map", 1..=1, Calls, Neighbors, "n.map(f): snapshot of f(id, value)";
    SNAPSHOT_FILTER = 91, Snapshot."filter", 1..=1, Calls, Neighbors, "n.filter(f): those for which f(id, value)";
    SNAPSHOT_REDUCE = 92, Snapshot."reduce", 2..=2, Calls, Neighbors, "n.reduce(f, a): a = f(id, value, a)";
}

/// Returns the built-in of that name in that library.
pub fn find(library: Library, name: &str) -> Option<&'static BuiltinInfo> {
    TABLE.iter().find(|info| info.library == library && info.name == name)
}

/// Returns the row of a built-in.
pub fn info(number: u8) -> Option<&'static BuiltinInfo> {
    TABLE.get(usize::from(number))
}

/// The strings that the virtual machine itself makes or reads, sorted by text. They have the first
/// string numbers of every image; the strings of the script follow, also sorted by text.
pub const STRINGS: &[&str] = &[
    "azimuth",
    "closure",
    "data",
    "distance",
    "elevation",
    "float",
    "integer",
    "nil",
    "robot",
    "string",
    "table",
    "timestamp",
];

/// Numbers of [`STRINGS`].
pub mod string {
    /// "azimuth"
    pub const AZIMUTH: u16 = 0;
    /// "closure"
    pub const CLOSURE: u16 = 1;
    /// "data"
    pub const DATA: u16 = 2;
    /// "distance"
    pub const DISTANCE: u16 = 3;
    /// "elevation"
    pub const ELEVATION: u16 = 4;
    /// "float"
    pub const FLOAT: u16 = 5;
    /// "integer"
    pub const INTEGER: u16 = 6;
    /// "nil"
    pub const NIL: u16 = 7;
    /// "robot"
    pub const ROBOT: u16 = 8;
    /// "string"
    pub const STRING: u16 = 9;
    /// "table"
    pub const TABLE: u16 = 10;
    /// "timestamp"
    pub const TIMESTAMP: u16 = 11;
    /// The number of strings that the machine has; the first string of the script has this number.
    pub const COUNT: u16 = 12;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_positions() {
        for (position, info) in TABLE.iter().enumerate() {
            assert_eq!(usize::from(info.number), position, "{}", info.name);
        }
    }

    #[test]
    fn strings_are_sorted_and_numbered() {
        assert!(STRINGS.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(STRINGS.len(), usize::from(string::COUNT));
        assert_eq!(STRINGS[usize::from(string::TIMESTAMP)], "timestamp");
        assert_eq!(STRINGS[usize::from(string::INTEGER)], "integer");
        assert_eq!(STRINGS[usize::from(string::CLOSURE)], "closure");
    }
}
