//! Expressions.

use super::{Kind, Writer};

const WORDS: [&str; 6] = ["ant", "bee", "swarm", "12", "-7", "x"];

impl Writer {
    /// Returns an expression of at most that many levels.
    pub fn expression(&mut self, kind: Kind, depth: usize) -> String {
        if depth > 0 && self.random.percent(75) {
            return match kind {
                Kind::Int => self.int(depth - 1),
                Kind::Float => self.float(depth - 1),
                Kind::Text => self.made_text(depth - 1),
                Kind::List => self.list(depth - 1),
                Kind::Record => self.record(depth - 1),
            };
        }
        match self.variable(kind) {
            Some(name) if self.random.percent(65) => name,
            _ => self.literal(kind),
        }
    }

    pub fn literal(&mut self, kind: Kind) -> String {
        match kind {
            Kind::Int => {
                let edges = ["32767", "65536", "2147483647", "(-2147483647)", "255", "1000000"];
                match self.random.below(10) {
                    0 => (*self.random.pick(&edges)).to_owned(),
                    1 => format!("({})", self.random.range(-20, -1)),
                    _ => self.random.range(0, 20).to_string(),
                }
            }
            Kind::Float => {
                let floats = ["0.0", "1.0", "0.5", "2.25", "(-3.75)", "100.125", "0.1", "3.14159"];
                (*self.random.pick(&floats)).to_owned()
            }
            Kind::Text => format!("\"{}\"", self.random.pick(&WORDS)),
            Kind::List => self.list(0),
            Kind::Record => self.record(0),
        }
    }

    fn int(&mut self, depth: usize) -> String {
        match self.random.weighted(&[30, 15, 10, 8, 8, 8, 8, 8, 8, 6, 6, 6]) {
            0 => {
                let operator = *self.random.pick(&["+", "-", "*"]);
                let (a, b) = (self.int_operand(depth), self.int_operand(depth));
                format!("({a} {operator} {b})")
            }
            // Operators in a row, by precedence.
            1 => {
                let mut text = self.int_operand(depth);
                for _ in 0..self.random.range(1, 3) {
                    let operator = *self.random.pick(&["+", "-", "*", "&", "|", "- -"]);
                    text = format!("{text} {operator} {}", self.int_operand(0));
                }
                format!("({text})")
            }
            // The least integer divided by -1 does not fit; a positive divisor gives the same remainder on both.
            2 => {
                let divisor = self.random.range(2, 30);
                let operator = *self.random.pick(&["/", "%"]);
                format!("({} {operator} {divisor})", self.int_operand(depth))
            }
            3 => {
                let operator = *self.random.pick(&["<<", ">>"]);
                let count = self.random.range(0, 9);
                format!("({} {operator} {count})", self.int_operand(depth))
            }
            4 => {
                let operator = *self.random.pick(&["-", "!"]);
                format!("{operator}({})", self.expression(Kind::Int, depth))
            }
            5 => {
                let rounding = *self.random.pick(&["int", "math.floor", "math.ceil", "math.round"]);
                format!("{rounding}({})", self.expression(Kind::Float, depth))
            }
            6 => match self.variable(Kind::List) {
                Some(list) => {
                    let key = self.expression(Kind::Int, depth);
                    format!("known({list}[{key} % 6])")
                }
                None => self.int_operand(0),
            },
            7 => match self.variable(Kind::Record) {
                Some(record) => format!("{record}.{}", self.random.pick(&["a", "b"])),
                None => self.int_operand(0),
            },
            8 => self.call(depth),
            9 => {
                let function = *self.random.pick(&["min", "max"]);
                let (a, b) = (self.int_operand(depth), self.int_operand(depth));
                format!("math.{function}({a}, {b})")
            }
            10 => {
                let text = self.expression(Kind::Text, depth);
                match self.random.below(3) {
                    0 => format!("string.length({text})"),
                    1 => format!("number({text})"),
                    _ => format!("math.abs({} % 1000)", self.int_operand(depth)),
                }
            }
            _ => match self.variable(Kind::List) {
                Some(list) => format!("size({list})"),
                None => format!("down({})", self.random.range(0, 4)),
            },
        }
    }

    fn int_operand(&mut self, depth: usize) -> String {
        self.expression(Kind::Int, depth)
    }

    /// Returns a call of a function of the program.
    pub fn call(&mut self, depth: usize) -> String {
        let Writer { random, functions, .. } = self;
        if functions.is_empty() {
            return format!("down({})", random.range(0, 4));
        }
        let at = random.below(functions.len());
        let (name, parameters, cost) =
            (functions[at].name.clone(), functions[at].parameters, functions[at].cost);
        if !self.affords(cost) {
            return self.int_operand(0);
        }
        self.cost += self.times * cost;
        let arguments: Vec<String> = (0..parameters).map(|_| self.int_operand(depth)).collect();
        format!("{name}({})", arguments.join(", "))
    }

    fn float(&mut self, depth: usize) -> String {
        let float = |me: &mut Self| me.expression(Kind::Float, depth);
        match self.random.below(8) {
            0..=2 => {
                let operator = *self.random.pick(&["+", "-", "*"]);
                let (a, b) = (float(self), float(self));
                format!("small({a} {operator} {b})")
            }
            3 => {
                let divisor = *self.random.pick(&["2.0", "0.7", "(-3.0)", "10"]);
                format!("small({} / {divisor})", float(self))
            }
            4 => {
                let operator = *self.random.pick(&["+", "-", "*"]);
                let (a, b) = (self.expression(Kind::Int, depth), float(self));
                if self.random.percent(50) {
                    format!("small({a} % 1000 {operator} {b})")
                } else {
                    format!("small({b} {operator} ({a} % 1000))")
                }
            }
            5 => format!("float({} % 1000)", self.expression(Kind::Int, depth)),
            6 => match self.random.below(3) {
                0 => format!("math.sqrt(math.abs({}))", float(self)),
                1 => format!("math.abs({})", float(self)),
                _ => {
                    let function = *self.random.pick(&["min", "max"]);
                    let (a, b) = (float(self), float(self));
                    format!("math.{function}({a}, {b})")
                }
            },
            _ => match self.variable(Kind::Record) {
                Some(record) => format!("{record}.c"),
                None => format!("-({})", float(self)),
            },
        }
    }

    fn made_text(&mut self, depth: usize) -> String {
        let text = self.expression(Kind::Text, depth);
        match self.random.below(5) {
            0 | 1 => {
                let other = self.expression(Kind::Text, depth);
                format!("short(string.concat({text}, {other}))")
            }
            2 => format!("string.tostring({})", self.expression(Kind::Int, depth)),
            3 => match self.variable(Kind::Record) {
                Some(record) => format!("{record}.s"),
                None => text,
            },
            _ => format!("type({})", self.any(depth)),
        }
    }

    fn list(&mut self, depth: usize) -> String {
        let mut entries = Vec::new();
        for key in 0..self.random.below(5) {
            entries.push(format!(".{key} = {}", self.expression(Kind::Int, depth)));
        }
        format!("{{ {} }}", entries.join(", "))
    }

    fn record(&mut self, depth: usize) -> String {
        let (a, b) = (self.expression(Kind::Int, depth), self.expression(Kind::Int, depth));
        let (c, s) = (self.expression(Kind::Float, depth), self.expression(Kind::Text, depth));
        format!("{{ .a = {a}, .b = {b}, .c = {c}, .s = {s} }}")
    }

    /// Returns a value whose text is the same on both.
    pub fn any(&mut self, depth: usize) -> String {
        let kind = match self.random.below(6) {
            0..=2 => Kind::Int,
            3 | 4 => Kind::Float,
            _ => Kind::Text,
        };
        self.expression(kind, depth)
    }

    /// Returns a condition without effect.
    pub fn condition(&mut self, depth: usize) -> String {
        if depth > 0 && self.random.percent(30) {
            let (a, b) = (self.condition(depth - 1), self.condition(depth - 1));
            return match self.random.below(3) {
                0 => format!("not ({a})"),
                1 => format!("({a}) and ({b})"),
                _ => format!("({a}) or ({b})"),
            };
        }
        let order = *self.random.pick(&["<", "<=", ">", ">=", "==", "!="]);
        match self.random.below(9) {
            0..=3 => {
                let (a, b) = (self.plain(Kind::Int), self.plain(Kind::Int));
                format!("{a} {order} {b}")
            }
            4 => format!("{} {order} {}", self.plain(Kind::Float), self.plain(Kind::Float)),
            5 => format!("{} % 1000 {order} {}", self.plain(Kind::Int), self.plain(Kind::Float)),
            6 => {
                // Text that could be a number is compared as text on both.
                format!("{} {order} {}", self.plain(Kind::Text), self.plain(Kind::Text))
            }
            7 => {
                let test = *self.random.pick(&["isnil", "isint", "isfloat", "isstring", "istable"]);
                let kind = *self.random.pick(&[Kind::Int, Kind::Float, Kind::Text, Kind::List]);
                format!("{test}({})", self.plain(kind))
            }
            _ => match self.variable(Kind::List) {
                Some(list) => format!("isnil({list}[{}])", self.random.range(0, 6)),
                None => self.plain(Kind::Int),
            },
        }
    }

    /// Returns an operand of a condition: no call of the program's functions, which have effects.
    fn plain(&mut self, kind: Kind) -> String {
        match self.variable(kind) {
            Some(name) if self.random.percent(65) => name,
            _ => self.literal(kind),
        }
    }

    /// Returns a statement that stops the program.
    pub fn stopping(&mut self) -> String {
        let stopping = [
            "log(same(nil) + 1)",
            "log(1 - same(\"x\"))",
            "log(same(nil).x)",
            "same(3).x = 1",
            "log(same(5)[0])",
            "log(same(nil)())",
            "log(same(4)(1))",
            "log(size(same(5)))",
            "foreach(same(nil), add)",
            "foreach({}, same(3))",
            "log(size(map({}, same(nil))))",
            "log(reduce({}, same(\"f\"), 0))",
            "log(math.sqrt(same(\"x\")))",
            "log(string.length(same(3)))",
            "log(-same(\"a\"))",
            "log(same({}) * 2)",
            "log(second(1))",
            "log(same(1.5) & 3)",
            "log(1 << same(\"x\"))",
            "log(string.concat(same(nil), \"x\"))",
            "log(same(nil) % 3)",
            "log(known(same(nil).a.b))",
        ];
        (*self.random.pick(&stopping)).to_owned()
    }
}
