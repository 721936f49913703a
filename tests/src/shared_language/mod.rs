//! Random programs of the language that Buzz and this project share: each does the same on both, by COMPATIBILITY.md.
//!
//! A program never does what that page lists as different: it prints nothing in the order of a table's entries, its
//! floats are neither infinite nor NaN, and the operands of `and` and `or` have no effect. Of the programs 30 % stop at a
//! run-time error.
//!
//! A program ends because of how it is made: functions call only those above them, and the cost of the code is added up
//! while it is written.

mod expression;
mod statement;

use std::fmt::Write;

use crate::generator::random::Random;

/// The functions that every program has.
const PRELUDE: &str = include_str!("prelude.bzz");

/// The most instructions, roughly, of a function or of the program.
const COST_MAX: u64 = 1500;

/// A class of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Int,
    /// Between -1000 and 1000.
    Float,
    /// Of at most 12 characters.
    Text,
    /// A table with integers under some of the keys 0 to 5.
    List,
    /// A table with the fields `a` and `b` (integers), `c` (float) and `s` (text).
    Record,
}

#[derive(Debug, Clone)]
struct Variable {
    name: String,
    kind: Kind,
}

struct Function {
    name: String,
    parameters: usize,
    cost: u64,
}

struct Writer {
    random: Random,
    /// The program stops at run time if this place is reached.
    may_stop: bool,
    text: String,
    indent: usize,
    /// The variables in scope, innermost last; the first ones are global.
    variables: Vec<Variable>,
    functions: Vec<Function>,
    names: usize,
    /// The cost of the function so far, and the number of times that the place runs.
    cost: u64,
    times: u64,
}

/// Returns the program of a seed.
pub fn program(seed: u64) -> String {
    let mut random = Random::new(seed);
    let may_stop = random.percent(30);
    let (text, variables, functions) = (PRELUDE.to_owned(), Vec::new(), Vec::new());
    let (indent, names, cost, times) = (0, 0, 0, 1);
    let mut writer =
        Writer { random, may_stop, text, indent, variables, functions, names, cost, times };
    writer.write();
    writer.text
}

impl Writer {
    fn write(&mut self) {
        for kind in [Kind::Int, Kind::Int, Kind::Float, Kind::Text, Kind::List, Kind::Record] {
            let value = self.literal(kind);
            let name = self.fresh("g");
            self.line(&format!("{name} = {value}"));
            self.variables.push(Variable { name, kind });
        }
        for _ in 0..self.random.range(1, 4) {
            self.function();
        }
        self.line("function main() {");
        self.body(8);
        self.line("}");
        self.line("main()");
        for variable in self.variables.clone() {
            self.show(&variable);
        }
        self.line("log(sum)");
    }

    /// Writes a function of integers.
    fn function(&mut self) {
        let name = self.fresh("f");
        let parameters = self.random.below(4);
        let outer = self.variables.len();
        let names: Vec<String> = (0..parameters).map(|_| self.fresh("p")).collect();
        self.line(&format!("function {name}({}) {{", names.join(", ")));
        self.variables.extend(names.into_iter().map(|name| Variable { name, kind: Kind::Int }));
        self.cost = 0;
        self.body(5);
        self.line("}");
        self.variables.truncate(outer);
        self.functions.push(Function { name, parameters, cost: self.cost + 5 });
        self.cost = 0;
    }

    /// Writes the statements of a function, and its result.
    fn body(&mut self, most: usize) {
        let outer = self.variables.len();
        self.indent += 1;
        for _ in 0..self.random.range(2, most as i64) {
            self.statement(2);
        }
        let result = self.expression(Kind::Int, 2);
        self.line(&format!("return {result}"));
        self.indent -= 1;
        self.variables.truncate(outer);
    }

    /// Returns a name that nothing else has.
    fn fresh(&mut self, prefix: &str) -> String {
        self.names += 1;
        format!("{prefix}{}", self.names)
    }

    fn line(&mut self, line: &str) {
        let _ = writeln!(self.text, "{:indent$}{line}", "", indent = 2 * self.indent);
        self.cost += self.times;
    }

    /// Returns true if code that costs as much can be written here.
    fn affords(&self, cost: u64) -> bool {
        self.cost + self.times * cost <= COST_MAX
    }

    /// Returns a variable of that kind.
    fn variable(&mut self, kind: Kind) -> Option<String> {
        let fitting: Vec<_> = self.variables.iter().filter(|v| v.kind == kind).collect();
        (!fitting.is_empty()).then(|| self.random.pick(&fitting).name.clone())
    }
}
