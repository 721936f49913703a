//! Expressions of every kind.

use super::Generator;
use super::scope::Kind;

impl Generator {
    /// An expression of that kind, of at most that many levels.
    pub fn expression(&mut self, kind: Kind, depth: usize) -> String {
        self.spend(1);
        match kind {
            Kind::Int => self.int(depth),
            Kind::Float => self.float(depth),
            Kind::Text => self.string(depth),
            Kind::Array => self.array(depth),
            Kind::Tree => self.tree(depth),
            Kind::Graph => self.graph(depth),
            Kind::Object(class) => self.object(class, depth),
            Kind::Function { arity, level } => self.function_value(arity, level),
            Kind::Any => self.anything(depth),
        }
    }

    /// An integer.
    pub fn int(&mut self, depth: usize) -> String {
        if depth == 0 || self.random.percent(15) {
            return match self.named(Kind::Int) {
                Some(name) if self.random.percent(65) => name,
                _ => self.int_literal(),
            };
        }
        if self.risks() {
            return self.risky_int(depth - 1);
        }
        match self.random.weighted(&[40, 10, 10, 10, 6, 6, 8, 10, 8, 8, 6, 5]) {
            0 => {
                let operator = *self.random.pick(&["+", "-", "*", "+", "-", "&", "|"]);
                let (left, right) = (self.operand(depth), self.operand(depth));
                format!("{left} {operator} {right}")
            }
            1 => {
                let operator = *self.random.pick(&["/", "%"]);
                let left = self.operand(depth);
                let divisor = *self.random.pick(&["2", "3", "7", "10", "(-3)", "100", "(-1)"]);
                format!("{left} {operator} {}", self.literal(divisor))
            }
            2 => {
                let operator = *self.random.pick(&["<<", ">>"]);
                let left = self.operand(depth);
                let count = self.random.range(0, 15).to_string();
                format!("{left} {operator} {}", self.literal(&count))
            }
            3 => format!("({})", self.condition(depth - 1)),
            4 => {
                let operand = self.operand(depth);
                // A sign would belong to a literal after it, not to the whole operand.
                format!("{}({operand})", self.random.pick(&["-", "!", "+"]))
            }
            5 => self.rounding(depth - 1),
            6 => {
                let table = self.some_table();
                format!("size({table})")
            }
            7 => self.function_call(depth - 1),
            8 => {
                let any = self.anything(depth - 1);
                let other = self.int_literal();
                format!("asint({any}, {other})")
            }
            9 => self.method_call(depth - 1),
            10 => {
                let (a, b) = (self.int(depth - 1), self.int(depth - 1));
                format!("math.{}({a}, {b})", self.random.pick(&["min", "max"]))
            }
            _ => self.other_int(depth - 1),
        }
    }

    fn operand(&mut self, depth: usize) -> String {
        let operand = self.int(depth - 1);
        let bare = self.random.percent(10);
        if bare || is_simple(&operand) { operand } else { format!("({operand})") }
    }

    pub fn int_literal(&mut self) -> String {
        let edges: &[i64] = if self.options.full {
            &[
                127,
                128,
                -128,
                -129,
                255,
                256,
                32767,
                -32768,
                32768,
                65535,
                i32::MAX as i64,
                -2_147_483_648,
            ]
        } else {
            &[127, 128, -128, -129, 255, 256, 1000, 32767, -32767, -32768]
        };
        let value = if self.random.percent(12) {
            *self.random.pick(edges)
        } else {
            self.random.range(-3, 20)
        };
        if value < 0 {
            self.literal(&format!("({value})"))
        } else {
            self.literal(&value.to_string())
        }
    }

    /// A literal, or the variable that stands for it.
    pub fn literal(&mut self, text: &str) -> String {
        if !self.options.hide_literals {
            return text.to_owned();
        }
        let next = self.hidden.len();
        self.hidden.entry(text.to_owned()).or_insert_with(|| format!("k{next}")).clone()
    }

    fn rounding(&mut self, depth: usize) -> String {
        let float = self.float(depth);
        let round = *self.random.pick(&["int", "math.floor", "math.ceil", "math.round", "int"]);
        format!("{round}({float})")
    }

    /// An expression that may stop the script, and usually would be an integer.
    fn risky_int(&mut self, depth: usize) -> String {
        match self.random.below(12) {
            9 => format!("(-{})", self.any_variable()),
            10 => format!("(!{})", self.any_variable()),
            11 => format!("same(math.max)({})", self.int(0)),
            0 => format!("({} / {})", self.int(depth), self.int(0)),
            1 => format!("({} % {})", self.int(depth), self.int(0)),
            2 => format!("({} << {})", self.int(depth), self.int(0)),
            3 => format!("({} >> ({}))", self.int(depth), self.int(depth)),
            4 => format!("({} + {})", self.int(depth), self.anything(0)),
            5 => format!("({} < {})", self.any_variable(), self.any_variable()),
            6 => format!("size({})", self.any_variable()),
            7 => format!("{}.{}", self.any_variable(), self.word()),
            _ => format!("{}({})", self.any_variable(), self.int(0)),
        }
    }

    pub fn any_variable(&mut self) -> String {
        let found = self.variable(|variable| !matches!(variable.kind, Kind::Function { .. }));
        found.map_or_else(|| "nothing".to_owned(), |variable| variable.name)
    }

    pub fn float(&mut self, depth: usize) -> String {
        if depth == 0 || self.random.percent(20) {
            return match self.named(Kind::Float) {
                Some(name) if self.random.percent(60) => name,
                _ => self.float_literal(),
            };
        }
        match self.random.weighted(&[40, 15, 15, 15, 5, 5]) {
            0 => {
                let operator = *self.random.pick(&["+", "-", "*", "/", "%"]);
                let (left, right) = (self.float(depth - 1), self.float(depth - 1));
                format!("({left} {operator} {right})")
            }
            1 => {
                let operator = *self.random.pick(&["+", "-", "*", "/"]);
                let (left, right) = (self.int(depth - 1), self.float(depth - 1));
                if self.random.percent(50) {
                    format!("(({left}) {operator} {right})")
                } else {
                    format!("({right} {operator} ({left}))")
                }
            }
            2 => format!("float({})", self.int(depth - 1)),
            3 => self.maths(depth - 1),
            4 => {
                let exponent = *self.random.pick(&["2", "3", "0.5", "(-1)"]);
                format!("({} ^ {})", self.float(depth - 1), self.literal(exponent))
            }
            _ => format!("(-({}))", self.float(depth - 1)),
        }
    }

    fn float_literal(&mut self) -> String {
        let literals =
            ["0.0", "1.0", "0.5", "(-2.5)", "3.14159", "100.25", "1e3", ".125", "7.", "(-0.001)"];
        let literal = *self.random.pick(&literals);
        self.literal(literal)
    }

    pub fn string(&mut self, depth: usize) -> String {
        if depth > 0 && self.options.full && self.random.percent(45) {
            return self.made_string(depth - 1);
        }
        match self.named(Kind::Text) {
            Some(name) if self.random.percent(50) => name,
            _ if self.random.percent(10) => format!("type({})", self.anything(0)),
            _ => {
                let word = self.word();
                self.literal(&format!("\"{word}\""))
            }
        }
    }

    /// Some word of the program.
    pub fn word(&mut self) -> String {
        self.random.pick(&self.words).clone()
    }

    /// Something of any kind, at times nil.
    pub fn anything(&mut self, depth: usize) -> String {
        if depth == 0 || self.random.percent(30) {
            return match self.random.below(10) {
                0 => "nil".to_owned(),
                1 => self.int_literal(),
                2 => self.string(0),
                _ => {
                    // Functions stay where their levels are known.
                    let found =
                        self.variable(|variable| !matches!(variable.kind, Kind::Function { .. }));
                    found.map_or_else(|| "nil".to_owned(), |variable| variable.name)
                }
            };
        }
        match self.random.weighted(&[20, 10, 15, 12, 15, 10, 8]) {
            0 => self.int(depth - 1),
            1 => self.float(depth - 1),
            2 => self.string(depth - 1),
            3 => self.graph(depth - 1),
            4 => {
                let table = self.some_table();
                let key = self.key();
                format!("elem({table}, {key})")
            }
            5 => match self.named(Kind::Graph) {
                Some(table) => format!("{table}.{}", self.word()),
                None => "nil".to_owned(),
            },
            _ => self.array(depth - 1),
        }
    }

    /// What stands between the parentheses of `if`: any value will do.
    pub fn test(&mut self) -> String {
        if self.random.percent(12) { self.anything(2) } else { self.condition(3) }
    }

    /// A condition, 0 or 1, at times without the parentheses that a person would write.
    pub fn condition(&mut self, depth: usize) -> String {
        self.spend(1);
        if depth > 0 && self.random.percent(35) {
            return match self.random.below(4) {
                0 => format!("not {}", self.joined_condition(depth - 1)),
                _ => {
                    let mut text = self.joined_condition(depth - 1);
                    for _ in 0..self.random.range(1, 3) {
                        let join = *self.random.pick(&["and", "or"]);
                        let not = if self.random.percent(15) { "not " } else { "" };
                        text = format!("{text} {join} {not}{}", self.joined_condition(depth - 1));
                    }
                    text
                }
            };
        }
        let depth = depth.saturating_sub(1);
        let order = *self.random.pick(&["<", "<=", ">", ">=", "==", "!="]);
        match self.random.weighted(&[40, 12, 12, 12, 8, 10]) {
            0 => {
                let (left, right) = (self.int(depth), self.int(depth));
                format!("{} {order} {}", closed(&left), closed(&right))
            }
            1 => format!("{} {order} {}", self.float(depth), closed(&self.int(depth))),
            2 => format!("{} {order} {}", self.string(depth), self.string(depth)),
            3 => {
                let equal = *self.random.pick(&["==", "!="]);
                format!("{} {equal} {}", closed(&self.anything(depth)), closed(&self.anything(0)))
            }
            4 => format!("(not {})", closed(&self.anything(depth))),
            _ => {
                let test = *self.random.pick(&[
                    "isnil",
                    "isint",
                    "isfloat",
                    "isstring",
                    "istable",
                    "isclosure",
                    "isuserdata",
                ]);
                format!("{test}({})", self.anything(depth))
            }
        }
    }

    fn joined_condition(&mut self, depth: usize) -> String {
        let condition = self.condition(depth);
        if self.random.percent(50) || condition.starts_with("not") {
            format!("({condition})")
        } else {
            condition
        }
    }

    /// A variable that holds a table, or an empty table.
    pub fn some_table(&mut self) -> String {
        let is_table =
            |kind| matches!(kind, Kind::Array | Kind::Tree | Kind::Graph | Kind::Object(_));
        let found = self.variable(|variable| is_table(variable.kind));
        found.map_or_else(|| "{}".to_owned(), |variable| variable.name)
    }

    /// An argument list of integers.
    pub fn int_arguments(&mut self, mut count: usize, depth: usize) -> String {
        if self.risks() {
            count = self.random.below(count + 2);
        }
        let arguments: Vec<String> = (0..count).map(|_| self.int(depth.min(2))).collect();
        arguments.join(", ")
    }
}

/// Whether it needs no parentheses anywhere.
fn is_simple(expression: &str) -> bool {
    expression.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// The expression, in parentheses where a comparison next to it could be read otherwise.
fn closed(expression: &str) -> String {
    if is_simple(expression) || expression.starts_with('{') {
        expression.to_owned()
    } else {
        format!("({expression})")
    }
}
