//! Random Buzz programs: well-formed, compiling without errors, ending on their own, the same for the same seed.
//!
//! A program uses the features of the language in combination and prints what it computes. It ends because of how it
//! is made, not because it looks at a clock:
//! * loops count a variable that nothing else assigns, recursion counts down a parameter;
//! * functions have levels, and code of a level calls only functions and function values of lower ones;
//! * the greatest cost of code is added up while it is written (`Effort`), and code that would cost too much is not written.
//!
//! Expressions have kinds, so that most programs run to their end; some take the risk of a run-time error.

mod expression;
mod function;
mod library;
mod program;
pub mod random;
mod scope;
mod statement;
mod table;

use std::collections::BTreeMap;

use random::Random;
use scope::{Class, Named, Scope, Variable};

/// What program to make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Decides everything.
    pub seed: u64,
    /// For profile `full`, else `tiny`.
    pub full: bool,
    /// Reads every literal from a variable, so that the compiler can compute nothing: the same program otherwise.
    pub hide_literals: bool,
}

/// The program for these options.
pub fn program(options: Options) -> String {
    Generator::new(options).program()
}

/// What the code that is being written costs when it runs.
#[derive(Debug, Clone, Copy)]
struct Effort {
    spent: u64,
    /// How often the place runs.
    times: u64,
    most: u64,
}

/// What a function of each level may cost; the last is for the entries.
const COST_MAX: [u64; 4] = [40, 250, 1000, 2500];
/// The level of the entries.
const TOP_LEVEL: u8 = 3;

struct Generator {
    random: Random,
    options: Options,
    /// In so many of a hundred places that could, something is done that may stop the script.
    risk: usize,
    /// The code of the function that is being written.
    text: String,
    indent: usize,
    effort: Effort,
    level: u8,
    /// Functions around the place, innermost last; the outermost is a named function or the global code.
    scopes: Vec<Scope>,
    globals: Vec<Variable>,
    functions: Vec<Named>,
    classes: Vec<Class>,
    /// Field names and texts.
    words: Vec<String>,
    /// Variables in place of literals.
    hidden: BTreeMap<String, String>,
    names: usize,
}

impl Generator {
    fn new(options: Options) -> Generator {
        let mut random = Random::new(options.seed);
        let risk = if random.percent(40) { 2 } else { 0 };
        Generator {
            random,
            options,
            risk,
            text: String::new(),
            indent: 0,
            effort: Effort { spent: 0, times: 1, most: COST_MAX[usize::from(TOP_LEVEL)] },
            level: TOP_LEVEL,
            scopes: vec![Scope::new(None)],
            globals: Vec::new(),
            functions: Vec::new(),
            classes: Vec::new(),
            words: Vec::new(),
            hidden: BTreeMap::new(),
            names: 0,
        }
    }

    /// A name that no other variable has.
    fn fresh(&mut self, prefix: &str) -> String {
        self.names += 1;
        format!("{prefix}{}", self.names)
    }

    fn line(&mut self, line: &str) {
        for _ in 0..self.indent {
            self.text.push_str("  ");
        }
        self.text.push_str(line);
        self.text.push(if self.random.percent(4) { ';' } else { '\n' });
    }

    fn risks(&mut self) -> bool {
        self.random.percent(self.risk)
    }

    fn affords(&self, amount: u64) -> bool {
        self.effort.spent + self.effort.times * amount <= self.effort.most
    }

    fn spend(&mut self, amount: u64) {
        self.effort.spent += self.effort.times * amount;
    }

    /// Writes code that runs `times` times where it stands.
    fn repeated<T>(&mut self, times: u64, write: impl FnOnce(&mut Self) -> T) -> T {
        let before = self.effort.times;
        self.effort.times *= times;
        let result = write(self);
        self.effort.times = before;
        result
    }
}
