//! Built-in functions: mathematics, strings, libraries as tables, robot functions.

use super::Generator;
use super::scope::Kind;

impl Generator {
    /// A float from a function of `math`.
    pub fn maths(&mut self, depth: usize) -> String {
        let x = self.float(depth);
        match self.random.below(7) {
            5 => {
                let y = self.float(0);
                format!("math.rng.uniform({x}, {y})")
            }
            6 => format!("math.rng.exponential({x})"),
            0 => {
                let y = self.float(0);
                format!("math.atan({x}, {y})")
            }
            1 => {
                let y = self.float(0);
                format!("math.{}({x}, {y})", self.random.pick(&["min", "max"]))
            }
            2 => format!("math.abs({x})"),
            _ => {
                let functions =
                    ["sqrt", "exp", "log", "log2", "log10", "sin", "cos", "tan", "asin", "acos"];
                format!("math.{}({x})", self.random.pick(&functions))
            }
        }
    }

    /// An integer from somewhere else.
    pub fn other_int(&mut self, depth: usize) -> String {
        match self.random.below(7) {
            0 => "rand()".to_owned(),
            1 => format!("math.rng.uniform({})", self.literal("10")),
            2 => "id".to_owned(),
            3 => format!("math.abs({})", self.int(depth)),
            4 if self.options.full => format!("string.length({})", self.string(depth)),
            5 if self.options.full => {
                let text = self.string(depth);
                let default = self.int_literal();
                if self.random.percent(50) {
                    format!("asint(string.toint({text}), {default})")
                } else {
                    format!("int(asfloat(string.tofloat({text}), {default}))")
                }
            }
            _ => {
                let (class, name) = match self.scope().class {
                    Some(class) => (Some(class), "self".to_owned()),
                    None => {
                        let found = self.variable(|v| matches!(v.kind, Kind::Object(_)));
                        match found {
                            Some(found) => (Some(0), found.name),
                            None => (None, String::new()),
                        }
                    }
                };
                if class.is_some() { format!("{name}.n") } else { self.int(0) }
            }
        }
    }

    /// A string made at run time.
    pub fn made_string(&mut self, depth: usize) -> String {
        self.spend(20);
        let text = self.string(depth.min(1));
        match self.random.below(6) {
            4 => format!("string.tostring(string.sub({text}, {}))", self.int(0)),
            5 => {
                let found =
                    self.variable(|variable| matches!(variable.kind, Kind::Function { .. }));
                format!("string.tostring({})", found.map_or("log".to_owned(), |v| v.name))
            }
            0 => {
                let other = self.string(depth.min(1));
                // Long texts would make long runs.
                format!("short(string.concat({text}, {other}))")
            }
            1 => format!("string.tostring({})", self.anything(depth)),
            2 => {
                let end = self.random.below(6).to_string();
                format!("string.tostring(string.sub({text}, 0, {}))", self.literal(&end))
            }
            _ => format!("short(string.concat({text}, string.tostring({}), {text}))", self.int(0)),
        }
    }

    /// Libraries as tables.
    pub fn library_statement(&mut self) {
        if !self.affords(150) {
            return;
        }
        self.spend(10);
        match self.random.below(11) {
            9 => {
                // Built-in functions are values like any other.
                let array = self.array(1);
                let number = self.float(1);
                self.line(&format!(
                    "log(reduce(map({array}, math.max), math.min, {number}), size(filter({array}, math.min)))"
                ));
                self.line(&format!("foreach({array}, log)"));
            }
            10 => {
                let (a, b) = (self.anything(0), self.int(0));
                let maybe = format!("(elem({{}}, {b}))");
                self.line(&format!(
                    "log(math.min({maybe}, {b}), math.max({b}, {maybe}), {maybe} < {maybe}, {maybe} <= ({a}))"
                ));
            }
            0 => {
                let value = self.int(1);
                let word = self.word();
                self.line(&format!("math.{word} = {value}"));
                self.line(&format!("log(\"math \", math.{word})"));
            }
            1 => {
                self.line("if(math.changed == nil) math.changed = 0");
                self.line("math.changed = math.changed + 1");
                self.line("log(math.changed)");
            }
            2 => {
                let name = self.fresh("v");
                self.line(&format!("var {name} = math"));
                let argument = self.int(1);
                self.line(&format!("log({name}.abs({argument}), {name}.pi, size({name}) > 3)"));
                self.declare(&name, Kind::Any, true);
            }
            3 => {
                let own = self.function_value(1, 0);
                self.line(&format!("math.own = {own}"));
                let argument = self.int(1);
                self.line(&format!("log(math.own({argument}))"));
            }
            4 => {
                self.line("foreach(math.rng, function(key, value) { log(key, value) })");
            }
            5 => {
                let seed = self.int(1);
                self.line(&format!("math.rng.setseed({seed})"));
                self.line("log(math.rng.uniform(), \" \", math.rng.gaussian(1.0, 2.0))");
            }
            6 => {
                let name = self.fresh("v");
                self.line(&format!("var {name} = math.max"));
                let (a, b) = (self.int(1), self.int(1));
                self.line(&format!("log({name}({a}, {b}))"));
                self.declare(&name, Kind::Any, true);
            }
            7 => self.line("log(pos.x, \" \", pos.y, \" \", pos.z, \" \", pos.orientation)"),
            _ => {
                let word = self.word();
                self.line(&format!("math.{word} = nil"));
                self.line(&format!("log(math.{word}, size(math) > 2)"));
            }
        }
    }

    /// What a robot does, and what takes time.
    pub fn robot_statement(&mut self) {
        let line = match self.random.below(9) {
            0 | 1 => format!("delay({})", self.int_literal()),
            7 => format!("goto({}, {})", self.float(0), self.int(0)),
            8 if self.risk > 0 => format!("led({})", self.any_variable()),
            2 => format!("led({})", self.int(0)),
            3 => {
                let (x, y) = (self.int(0), self.float(0));
                format!("log(\"went \", goto({x}, {y}))")
            }
            4 => format!("log(get_front() + ({}))", self.int(1)),
            5 if self.risk > 0 && self.random.percent(10) => {
                format!("set_motor({}, 3)", self.int(0))
            }
            _ => {
                let name = self.fresh("v");
                let (x, y) = (self.int(0), self.int(0));
                let line = format!("var {name} = goto log({name}({x}, {y}))");
                self.declare(&name, Kind::Any, true);
                line
            }
        };
        self.line(&line);
    }
}
