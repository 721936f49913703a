//! Statements.

use super::Generator;
use super::scope::Kind;

impl Generator {
    /// At most so many statements.
    pub fn statements(&mut self, most: usize) {
        for _ in 0..most {
            if !self.affords(10) {
                return;
            }
            self.statement();
        }
    }

    pub fn statement(&mut self) {
        self.spend(2);
        match self.random.weighted(&[22, 20, 14, 12, 8, 14, 8, 6, 5, 3, 3, 3, 2, 2, 3, 2]) {
            0 => self.declaration(),
            1 => self.assignment(),
            2 => self.log(),
            3 => self.branch(),
            4 => self.repetition(),
            5 => self.table_statement(),
            6 => self.iteration(),
            7 => self.object_statement(),
            8 => self.call_statement(),
            9 => self.library_statement(),
            10 => self.robot_statement(),
            11 => self.early_return(),
            12 => self.wide_closure(),
            13 => self.swap(),
            14 => self.assertion(),
            _ => self.many_words(),
        }
    }

    /// A block in braces, with variables of its own.
    fn block(&mut self, most: usize) -> String {
        self.scope().blocks.push(Vec::new());
        let body = self.inside(|me| me.statements(most));
        self.scope().blocks.pop();
        format!("{{\n{body}}}")
    }

    /// A block, or a single statement without braces.
    fn branch_body(&mut self) -> String {
        if self.random.percent(20)
            && let Some(name) = self.assignable(Kind::Int)
        {
            let value = self.int(2);
            return format!("{name} = {value}");
        }
        let most = match self.random.below(10) {
            0 => 12,
            _ => self.random.below(4),
        };
        self.block(most)
    }

    fn assignable(&mut self, kind: Kind) -> Option<String> {
        let found = self.variable(|variable| variable.kind == kind && !variable.fixed);
        found.map(|variable| variable.name)
    }

    fn declaration(&mut self) {
        let kind = self.some_kind();
        let value = self.expression(kind, 3);
        let name = self.local_name();
        // In its own first value a variable would be nil.
        let name = if value.contains(name.as_str()) { self.fresh("v") } else { name };
        self.line(&format!("var {name} = {value}"));
        self.declare(&name, kind, false);
    }

    fn assignment(&mut self) {
        let Some(variable) = self.variable(|variable| !variable.fixed) else { return };
        let name = variable.name;
        if matches!(variable.kind, Kind::Int | Kind::Float) && self.random.percent(40) {
            let by = self.random.range(-140, 140).unsigned_abs().to_string();
            let by = self.literal(&by);
            let operator = *self.random.pick(&["+", "-"]);
            self.line(&format!("{name} = {name} {operator} {by}"));
            return;
        }
        let value = self.expression(variable.kind, 3);
        self.line(&format!("{name} = {value}"));
    }

    fn log(&mut self) {
        let count = self.random.below(5);
        let mut arguments = vec![format!("\"line {} \"", self.names)];
        for _ in 0..count {
            let kind = match self.random.below(6) {
                0 => Kind::Float,
                1 => Kind::Text,
                2 => Kind::Any,
                _ => Kind::Int,
            };
            arguments.push(self.expression(kind, 3));
        }
        self.line(&format!("log({})", arguments.join(", \" \", ")));
    }

    fn branch(&mut self) {
        let condition = self.test();
        let mut text = format!("if({condition}) {}", self.branch_body());
        while self.random.percent(25) {
            let condition = self.condition(2);
            text = format!("{text}\nelse if({condition}) {}", self.branch_body());
        }
        if self.random.percent(50) {
            text = format!("{text}\nelse {}", self.branch_body());
        }
        self.line(&text);
    }

    fn repetition(&mut self) {
        let times = self.random.range(1, 8);
        if !self.affords(times as u64 * 10) {
            return;
        }
        let counter = self.fresh("i");
        let end = times.to_string();
        let end = self.literal(&end);
        let more = if self.random.percent(25) {
            format!(" and ({})", self.condition(1))
        } else {
            String::new()
        };
        self.line(&format!("var {counter} = 0"));
        self.declare(&counter, Kind::Int, true);
        let is_for = self.random.percent(60);
        self.scope().blocks.push(Vec::new());
        let body = self.repeated(times as u64, |me| {
            me.inside(|me| {
                if !is_for && me.random.percent(50) {
                    me.line(&format!("{counter} = {counter} + 1"));
                    me.statements(4);
                } else {
                    me.statements(4);
                    if !is_for {
                        me.line(&format!("{counter} = {counter} + 1"));
                    }
                }
            })
        });
        self.scope().blocks.pop();
        if is_for {
            self.line(&format!(
                "for({counter} = 0, {counter} < {end}{more}, {counter} = {counter} + 1) {{\n{body}}}"
            ));
        } else {
            self.line(&format!("while({counter} < {end}{more}) {{\n{body}}}"));
        }
    }

    fn object_statement(&mut self) {
        let found = self.variable(|variable| matches!(variable.kind, Kind::Object(_)));
        let Some(found) = found.filter(|_| self.level > 0 && self.affords(100)) else { return };
        let Kind::Object(class) = found.kind else { return };
        let name = found.name;
        let (method, arity) = self.random.pick(&self.classes[class].methods).clone();
        match self.random.below(7) {
            0 => {
                let value = self.int(2);
                self.line(&format!("{name}.n = {value}"));
            }
            1 => {
                let value = self.anything(1);
                self.line(&format!("{name}.o = {value}"));
            }
            2 => {
                // Read out of its object it keeps it.
                let bound = self.fresh("v");
                self.line(&format!("var {bound} = {name}.{method}"));
                self.declare(&bound, Kind::Function { arity, level: 0 }, true);
            }
            3 => {
                let lambda = self.method(class, arity);
                self.line(&format!("{name}.{method} = {lambda}"));
            }
            4 => {
                self.line(&format!("log({name}.{method} == {name}.{method}, {name} == {name}.o)"));
            }
            5 => {
                let other = self.object(class, 1);
                self.line(&format!("{name}.{method} = {other}.{method}"));
            }
            _ => {
                let call = self.method_call(2);
                self.line(&format!("log(\"method \", {call})"));
            }
        }
    }

    fn call_statement(&mut self) {
        let kind = match self.random.below(5) {
            0 => Kind::Float,
            1 => Kind::Array,
            2 => Kind::Graph,
            _ => Kind::Int,
        };
        if let Some(call) = self.call_of_named(kind, 2) {
            let line = if self.random.percent(50) { format!("log({call})") } else { call };
            self.line(&line);
            return;
        }
        // A function that gives a function, which is called at once.
        let function = self.functions.iter().find_map(|function| match function.result {
            Kind::Function { arity, level } if function.level < self.level => {
                Some((function.result, arity, level))
            }
            _ => None,
        });
        if let Some((result, arity, level)) = function
            && self.affords(super::COST_MAX[usize::from(level)])
            && let Some(call) = self.call_of_named(result, 1)
        {
            self.spend(super::COST_MAX[usize::from(level)]);
            let arguments = self.int_arguments(arity, 1);
            self.line(&format!("log({call}({arguments}))"));
        }
    }

    fn early_return(&mut self) {
        let Some(result) = self.scope().result else { return };
        let condition = self.condition(1);
        let value = self.expression(result, 2);
        if self.random.percent(30) && result == Kind::Any {
            self.line(&format!("if({condition}) {{ return }}"));
        } else {
            self.line(&format!("if({condition}) return {value}"));
        }
    }

    /// A lambda with more captured values than one heap cell holds.
    fn wide_closure(&mut self) {
        if self.is_top_level() || self.level == 0 || !self.affords(40) {
            return;
        }
        self.spend(20);
        let names: Vec<String> = (0..self.random.range(4, 13))
            .map(|_| {
                let name = self.fresh("w");
                let value = self.expression(Kind::Int, 1);
                self.line(&format!("var {name} = {value}"));
                name
            })
            .collect();
        for name in &names {
            self.declare(name, Kind::Int, false);
        }
        let closure = self.fresh("v");
        self.line(&format!("var {closure} = function(x) {{ return x + {} }}", names.join(" - ")));
        self.declare(&closure, Kind::Function { arity: 1, level: 0 }, false);
        let argument = self.int(0);
        self.line(&format!("log(\"wide \", {closure}({argument}))"));
    }

    fn swap(&mut self) {
        let (Some(a), Some(b)) = (self.assignable(Kind::Int), self.assignable(Kind::Int)) else {
            return;
        };
        let spare = self.fresh("v");
        self.line(&format!("var {spare} = {a}"));
        self.line(&format!("{a} = {b}"));
        self.line(&format!("{b} = {spare}"));
        self.declare(&spare, Kind::Int, false);
    }

    fn assertion(&mut self) {
        if self.risk > 0 && self.random.percent(15) {
            let condition = self.condition(2);
            self.line(&format!("assert({condition}, \"asserted\")"));
        } else {
            let value = self.int(2);
            self.line(&format!("assert(isint({value}))"));
        }
    }

    /// Many fields, so that numbers of strings need two bytes.
    fn many_words(&mut self) {
        if !self.affords(60) {
            return;
        }
        self.spend(40);
        let name = self.fresh("v");
        let words = self.words.clone();
        let entries: Vec<String> = words
            .iter()
            .take(1 + self.random.below(words.len().min(20)))
            .map(|word| format!(".{word} = {}", self.int(0)))
            .collect();
        self.line(&format!("var {name} = {{ {} }}", entries.join(", ")));
        self.declare(&name, Kind::Tree, false);
        let word = self.word();
        self.line(&format!("log({name}.{word}, size({name}))"));
    }
}
