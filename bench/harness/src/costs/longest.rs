//! The longest times of instructions on a robot: scripts with a statement that works on the largest
//! data that the robot's memory holds.
//!
//! The benchmark machine has the memory of a Kilobot and repeats its steps. A statement is
//! therefore counted on two small tables, each of which fits three times, one for each step. The
//! time on a table that fills a robot's heap is computed from the two counts: the time of an
//! instruction grows linearly with the size of its data, which the test `instruction_time` shows.

use crate::target::BenchTarget;
use bittybuzz_robot_spec::NumberProfile;

/// Cells of the tables on which statements are counted.
pub const FEW_CELLS: u64 = 3;
pub const MORE_CELLS: u64 = 7;

/// A robot for which the longest times are published.
pub struct MeasuredRobot {
    pub name: &'static str,
    pub target: BenchTarget,
}

/// One robot for each chip.
pub const ROBOTS: [MeasuredRobot; 3] = [
    MeasuredRobot { name: "kilobot", target: BenchTarget::Avr },
    MeasuredRobot { name: "zooids", target: BenchTarget::Thumbv6m },
    MeasuredRobot { name: "crazyflie", target: BenchTarget::Thumbv7emFull },
];

/// A measured statement.
pub struct Statement {
    /// The instruction that takes most of the time, and its operand.
    pub name: &'static str,
    /// Code that fills a table `t` with `N` elements.
    table: &'static str,
    /// Elements per cell of the table; 0 if the statement does not depend on a table.
    pub per_cell: u64,
    /// The code of `init()`.
    init: &'static str,
    /// A statement of `step()` in both scripts.
    always: &'static str,
    /// The number of measured instructions in the statement.
    pub times: u64,
    with: &'static str,
    /// A statement with the same operands, but without the instruction.
    without: &'static str,
}

/// Elements with keys that do not belong to an array.
const PAIRS: &str = "for(i = 1, i <= N, i = i + 1) t[0 - i] = 1";
/// An array in which only the first and the last element remain.
const GAP: &str = "for(i = 0, i < N, i = i + 1) t[i] = 1
    for(i = 1, i < N - 1, i = i + 1) t[i] = nil";
const ARRAY: &str = "for(i = 0, i < N, i = i + 1) t[i] = 1";

const fn on_pairs(name: &'static str, with: &'static str, without: &'static str) -> Statement {
    Statement { name, table: PAIRS, per_cell: 3, init: "", always: "", times: 1, with, without }
}

const fn on_array(
    name: &'static str,
    table: &'static str,
    with: &'static str,
    without: &'static str,
) -> Statement {
    Statement { name, table, per_cell: 6, init: "", always: "", times: 1, with, without }
}

const fn alone(
    name: &'static str,
    init: &'static str,
    with: &'static str,
    without: &'static str,
) -> Statement {
    Statement { name, table: "", per_cell: 0, init, always: "", times: 1, with, without }
}

/// Counts the second of two equal statements: a step that sends ends with work that does not depend
/// on the number of messages.
const fn repeated(name: &'static str, init: &'static str, statement: &'static str) -> Statement {
    Statement {
        name,
        table: "",
        per_cell: 0,
        init,
        always: statement,
        times: 1,
        with: statement,
        without: "",
    }
}

/// The largest array that fits into eight fragments with the head of an entry of a stigmergy.
const LONG: &str = "v = stigmergy.create(1) m = {} for(i = 0, i < M, i = i + 1) m[i] = i";

/// A table with the same number of pairs.
const LONG_PAIRS: &str =
    "v = stigmergy.create(1) m = {} for(i = 1, i <= M, i = i + 1) m[0 - i] = i";

/// `neighbors.kin` takes an instruction for each neighbor of the benchmark.
const KIN: Statement = Statement {
    times: bittybuzz_bench::NEIGHBORS as u64,
    ..alone("CALL_BUILTIN, `neighbors.kin`, each neighbor", "", "neighbors.kin()", "")
};

/// The largest and the smallest float.
const FAR_APART: &str = "v = 1.7 while(v * 2.0 != v) { w = v v = v * 2.0 }
    v = w w = 1.3 while(w * 0.5 != 0) w = w * 0.5";

pub const STATEMENTS: [Statement; 32] = [
    on_pairs("INDEX_GET, last of all pairs", "x = t[0 - N]", "x = 0 - N"),
    on_pairs("INDEX_SET, last of all pairs", "t[0 - N] = 1", "x = 0 - N"),
    on_pairs("INDEX_SET, new pair", "t[1000] = 1", "x = 1000"),
    on_array("INDEX_GET, last element of an array", ARRAY, "x = t[N - 1]", "x = N - 1"),
    on_array("INDEX_SET, new element of an array", ARRAY, "t[N] = 1", "x = N"),
    on_array("INDEX_SET, removes the last element", GAP, "t[N - 1] = nil", "x = N - 1"),
    on_pairs("CALL_BUILTIN, `size` of pairs", "x = size(t)", "x = t"),
    on_array("CALL_BUILTIN, `size` of an array", ARRAY, "x = size(t)", "x = t"),
    on_array("CALL_BUILTIN, an element of `foreach`", GAP, "foreach(t, f)", "foreach(o, f)"),
    alone("POW, floats", "v = 1.37 w = 7.77", "x = v ^ w", "x = v x = w"),
    alone("MOD, floats", FAR_APART, "x = v % w", "x = v x = w"),
    alone("CALL_BUILTIN, `math.sqrt`", "v = 1.37", "x = math.sqrt(v)", "x = v"),
    alone("CALL_BUILTIN, `math.exp`", "v = 1.37", "x = math.exp(v)", "x = v"),
    alone("CALL_BUILTIN, `math.log`", "v = 1.37", "x = math.log(v)", "x = v"),
    alone("CALL_BUILTIN, `math.log2`", "v = 1.37", "x = math.log2(v)", "x = v"),
    alone("CALL_BUILTIN, `math.log10`", "v = 1.37", "x = math.log10(v)", "x = v"),
    alone("CALL_BUILTIN, `math.sin`", "v = 99.37", "x = math.sin(v)", "x = v"),
    alone("CALL_BUILTIN, `math.cos`", "v = 99.37", "x = math.cos(v)", "x = v"),
    alone("CALL_BUILTIN, `math.tan`", "v = 99.37", "x = math.tan(v)", "x = v"),
    alone("CALL_BUILTIN, `math.asin`", "v = 0.87", "x = math.asin(v)", "x = v"),
    alone("CALL_BUILTIN, `math.acos`", "v = 0.87", "x = math.acos(v)", "x = v"),
    alone("CALL_BUILTIN, `math.atan`", "v = 0.87", "x = math.atan(v, 1.3)", "x = v"),
    alone("CALL_BUILTIN, `math.rng.uniform`", "v = 0.8", "x = math.rng.uniform(v)", "x = v"),
    alone(
        "CALL_BUILTIN, `math.rng.exponential`",
        "v = 0.8",
        "x = math.rng.exponential(v)",
        "x = v",
    ),
    alone("CALL_BUILTIN, `neighbors.get`", "v = 9", "x = neighbors.get(v)", "x = v"),
    alone("CALL_BUILTIN, `neighbors.count`", "", "x = neighbors.count()", "x = 0"),
    KIN,
    repeated(
        "CALL_BUILTIN, `neighbors.broadcast` of a number",
        "",
        "neighbors.broadcast(\"x\", 5)",
    ),
    repeated(
        "CALL_BUILTIN, `neighbors.broadcast` of an array of numbers",
        LONG,
        "neighbors.broadcast(\"x\", m)",
    ),
    repeated("CALL_METHOD, `put` of a number", LONG, "v.put(3, k)"),
    repeated("CALL_METHOD, `put` of an array of numbers", LONG, "v.put(3, m)"),
    repeated("CALL_METHOD, `put` of pairs of numbers", LONG_PAIRS, "v.put(3, m)"),
];

impl Statement {
    /// Returns the script whose step has the statement, or the one without the instruction.
    pub fn script(&self, profile: NumberProfile, cells: u64, has_instruction: bool) -> String {
        let count = self.per_cell * cells;
        let statement = if has_instruction { self.with } else { self.without };
        let Statement { table, init, always, .. } = self;
        format!(
            "r = 7 k = 0 x = 0 i = 0 m = nil v = nil w = nil t = nil
             function f(key, value) {{ }}
             o = {{}} o[0] = 1
             function make() {{ t = {{}} {table} return t }}
             l = {{}} l[0] = make() l[1] = make() l[2] = make()
             function init() {{ {init} }}
             function step() {{
               t = l[k]
               k = k + 1
               {always}
               {statement}
             }}"
        )
        .replace('N', &count.to_string())
        .replace('M', if profile == NumberProfile::Full { "30" } else { "5" })
    }
}
