//! Statements.

use super::{Kind, Variable, Writer};

impl Writer {
    /// Writes a statement with at most that many levels of blocks inside.
    pub fn statement(&mut self, levels: usize) {
        if self.may_stop && self.random.percent(4) {
            let stopping = self.stopping();
            return self.line(&stopping);
        }
        if !self.affords(100) {
            return self.log();
        }
        match self.random.weighted(&[14, 16, 18, 8, 6, 8, 8, 6, 6, 6, 6, 5, 5, 3, 4, 5, 5, 8]) {
            0 => self.log(),
            1 => self.declaration(),
            2 => self.assignment(),
            3 if levels > 0 => self.branches(levels - 1),
            4 if levels > 0 => self.while_loop(levels - 1),
            5 if levels > 0 => self.for_loop(levels - 1),
            6 => self.list_statement(),
            7 => self.record_statement(),
            8 => self.iteration(),
            9 => self.closure(),
            10 => self.method(),
            11 => {
                let call = self.call(1);
                self.line(&format!("log(\"call \", {call})"));
            }
            12 => self.early_return(),
            13 if levels > 0 => self.same_names(),
            14 => self.nested_tables(),
            15 => self.single_statements(),
            16 => self.dispatch(),
            _ => self.use_of_prelude(),
        }
    }

    fn log(&mut self) {
        let values: Vec<String> = (0..self.random.range(1, 3))
            .map(|_| if self.random.percent(25) { self.condition(1) } else { self.any(2) })
            .collect();
        self.line(&format!("log({})", values.join(", \" \", ")));
    }

    fn declaration(&mut self) {
        let kinds =
            [Kind::Int, Kind::Int, Kind::Int, Kind::Float, Kind::Text, Kind::List, Kind::Record];
        let kind = *self.random.pick(&kinds);
        let value = self.expression(kind, 3);
        let name = self.fresh("v");
        self.line(&format!("var {name} = {value}"));
        self.variables.push(Variable { name, kind });
    }

    fn assignment(&mut self) {
        let kind = *self.random.pick(&[Kind::Int, Kind::Int, Kind::Float, Kind::Text]);
        let value = self.expression(kind, 3);
        let target = self.variable(kind);
        // Counters of loops are not variables of the writer, so that every loop ends.
        match target {
            Some(target) => self.line(&format!("{target} = {value}")),
            None => self.line(&format!("log({value})")),
        }
    }

    fn block(&mut self, levels: usize) {
        let outer = self.variables.len();
        self.indent += 1;
        for _ in 0..self.random.range(1, 3) {
            self.statement(levels);
        }
        self.indent -= 1;
        self.variables.truncate(outer);
    }

    fn branches(&mut self, levels: usize) {
        let condition = self.condition(2);
        self.line(&format!("if({condition}) {{"));
        self.block(levels);
        if self.random.percent(30) {
            let condition = self.condition(1);
            self.line(&format!("}} else if({condition}) {{"));
            self.block(levels);
        }
        if self.random.percent(50) {
            self.line("} else {");
            self.block(levels);
        }
        self.line("}");
    }

    fn while_loop(&mut self, levels: usize) {
        let counter = self.fresh("i");
        let times = self.random.range(1, 5);
        self.line(&format!("var {counter} = 0"));
        let stop = if self.random.percent(30) {
            format!(" and (not ({}))", self.condition(1))
        } else {
            String::new()
        };
        self.line(&format!("while({counter} < {times}{stop}) {{"));
        self.repeated(times as u64, levels);
        self.line(&format!("  {counter} = {counter} + 1"));
        self.line("}");
    }

    fn for_loop(&mut self, levels: usize) {
        let counter = self.fresh("i");
        let times = self.random.range(1, 5);
        self.line(&format!("var {counter}"));
        self.line(&format!(
            "for({counter} = 0, {counter} < {times}, {counter} = {counter} + 1) {{"
        ));
        self.line(&format!("  sum = sum + {counter}"));
        self.repeated(times as u64, levels);
        self.line("}");
    }

    fn repeated(&mut self, times: u64, levels: usize) {
        let before = self.times;
        self.times *= times;
        self.block(levels);
        self.times = before;
    }

    fn list_statement(&mut self) {
        let Some(list) = self.variable(Kind::List) else { return self.declaration() };
        let key = self.expression(Kind::Int, 1);
        let value =
            if self.random.percent(25) { "nil".to_owned() } else { self.expression(Kind::Int, 2) };
        self.line(&format!("{list}[{key} % 6] = {value}"));
        if self.random.percent(40) {
            self.show(&Variable { name: list, kind: Kind::List });
        }
    }

    fn record_statement(&mut self) {
        let Some(record) = self.variable(Kind::Record) else { return self.declaration() };
        let (field, kind) =
            *self.random.pick(&[("a", Kind::Int), ("b", Kind::Int), ("c", Kind::Float)]);
        let value = self.expression(kind, 2);
        match self.random.below(3) {
            0 => self.line(&format!("{record}[\"{field}\"] = {value}")),
            _ => self.line(&format!("{record}.{field} = {value}")),
        }
        if self.random.percent(40) {
            self.show(&Variable { name: record, kind: Kind::Record });
        }
    }

    /// Writes an iteration whose result does not depend on the order.
    fn iteration(&mut self) {
        let Some(list) = self.variable(Kind::List) else { return self.declaration() };
        let (k, v, a) = (self.fresh("k"), self.fresh("x"), self.fresh("a"));
        match self.random.below(5) {
            0 => self.line(&format!("foreach({list}, add)")),
            1 => {
                let factor = self.random.range(1, 9);
                self.line(&format!(
                    "foreach({list}, function({k}, {v}) {{ sum = sum + {k} * {factor} + {v} }})"
                ));
            }
            2 => {
                let value = self.callback(&[&k, &v]);
                let name = self.fresh("v");
                self.line(&format!(
                    "var {name} = map({list}, function({k}, {v}) {{ return {value} }})"
                ));
                self.variables.push(Variable { name, kind: Kind::List });
            }
            3 => {
                let name = self.fresh("v");
                let limit = self.random.range(-5, 20);
                self.line(&format!(
                    "var {name} = filter({list}, function({k}, {v}) {{ return {v} > {limit} }})"
                ));
                self.variables.push(Variable { name, kind: Kind::List });
            }
            _ => {
                let start = self.expression(Kind::Int, 1);
                self.line(&format!(
                    "log(reduce({list}, function({k}, {v}, {a}) {{ return {a} + {k} - {v} }}, {start}))"
                ));
            }
        }
    }

    /// Returns a result of a callback with these integer parameters, which has no effect.
    fn callback(&mut self, parameters: &[&String]) -> String {
        let [a, b] = [0, 1].map(|_| {
            if self.random.percent(60) {
                (*self.random.pick(parameters)).clone()
            } else {
                self.variable(Kind::Int).unwrap_or_else(|| "3".to_owned())
            }
        });
        format!("{a} {} {b}", self.random.pick(&["+", "-", "*", "&", "|"]))
    }

    /// Writes a function value that captures locals, and calls it.
    fn closure(&mut self) {
        let (name, x) = (self.fresh("c"), self.fresh("x"));
        let value = self.callback(&[&x]);
        self.line(&format!("var {name} = function({x}) {{"));
        if self.random.percent(40) {
            let changed = self.variable(Kind::Int).unwrap_or_else(|| "sum".to_owned());
            self.line(&format!("  {changed} = {changed} + {x}"));
        }
        self.line(&format!("  return {value}"));
        self.line("}");
        if self.random.percent(40) {
            self.assignment();
        }
        for _ in 0..self.random.range(1, 2) {
            let argument = self.expression(Kind::Int, 1);
            self.line(&format!("log(\"closure \", {name}({argument}))"));
        }
        if self.random.percent(30) {
            let argument = self.expression(Kind::Int, 1);
            self.line(&format!("log(same({name})({argument}), \" \", type({name}))"));
        }
    }

    /// Writes a function of a table that uses `self`, and calls it.
    fn method(&mut self) {
        let Some(record) = self.variable(Kind::Record) else { return self.declaration() };
        let x = self.fresh("x");
        self.line(&format!("{record}.m = function({x}) {{"));
        self.line(&format!("  self.a = self.a + {x}"));
        self.line("  return self.a - self.b");
        self.line("}");
        let argument = self.expression(Kind::Int, 1);
        self.line(&format!("log(\"method \", {record}.m({argument}), \" \", {record}.a)"));
    }

    fn early_return(&mut self) {
        let condition = self.condition(1);
        let result = self.expression(Kind::Int, 1);
        self.line(&format!("if({condition}) {{ return {result} }}"));
    }

    /// Writes two blocks that each have a variable of the same name, which is that of a global outside.
    fn same_names(&mut self) {
        let (one, other) = (self.expression(Kind::Int, 1), self.expression(Kind::Int, 1));
        self.line("if(1) {");
        self.line(&format!("  var sum = {one}"));
        self.line("  sum = sum + 1");
        self.line("  log(\"inner \", sum)");
        self.line("}");
        self.line("if(1) {");
        self.line(&format!("  var sum = {other}"));
        self.line("  log(\"second \", sum)");
        self.line("}");
        self.line("log(\"outer \", sum)");
    }

    fn nested_tables(&mut self) {
        let Some(record) = self.variable(Kind::Record) else { return self.declaration() };
        let value = self.expression(Kind::Int, 2);
        let inner = self.fresh("t");
        self.line(&format!("{record}.{inner} = {{ .x = {value}, .y = {{ .z = {value} }} }}"));
        self.line(&format!("{record}.{inner}.y.z = {record}.{inner}.x + 1"));
        self.line(&format!(
            "log({record}.{inner}.x, \" \", {record}.{inner}.y.z, \" \", size({record}.{inner}))"
        ));
    }

    /// Writes branches without braces.
    fn single_statements(&mut self) {
        let condition = self.condition(1);
        let (value, other) = (self.any(1), self.any(1));
        self.line(&format!("if({condition}) log(\"yes \", {value})"));
        if self.random.percent(50) {
            self.line(&format!("else log(\"no \", {other})"));
        }
    }

    /// Writes a table of functions, and calls some by name and by number.
    fn dispatch(&mut self) {
        let (name, x) = (self.fresh("d"), self.fresh("x"));
        let (go, stop) = (self.callback(&[&x]), self.callback(&[&x]));
        self.line(&format!(
            "var {name} = {{ .go = function({x}) {{ return {go} }}, .1 = function({x}) {{ return {stop} }} }}"
        ));
        let (a, b) = (self.expression(Kind::Int, 1), self.expression(Kind::Int, 1));
        self.line(&format!(
            "log({name}[\"go\"]({a}), \" \", {name}[1]({b}), \" \", {name}.go({b}, 9))"
        ));
        if self.random.percent(40) {
            self.line(&format!("{name}.go = nil"));
            self.line(&format!("log(isnil({name}.go), size({name}))"));
        }
    }

    fn use_of_prelude(&mut self) {
        self.cost += 100 * self.times;
        match self.random.below(4) {
            0 => {
                let name = self.fresh("c");
                let start = self.expression(Kind::Int, 1);
                let (a, b) = (self.expression(Kind::Int, 1), self.expression(Kind::Int, 1));
                self.line(&format!("var {name} = counter({start})"));
                self.line(&format!("log({name}({a}), \" \", {name}({b}))"));
            }
            1 => {
                let levels = self.random.range(0, 6);
                self.line(&format!("log(total(chain({levels})))"));
            }
            2 => {
                let Some(list) = self.variable(Kind::List) else { return self.declaration() };
                let name = self.fresh("v");
                self.line(&format!("var {name} = sorted({list})"));
                self.show(&Variable { name: name.clone(), kind: Kind::List });
                self.variables.push(Variable { name, kind: Kind::List });
            }
            _ => {
                let text = self.expression(Kind::Text, 1);
                self.line(&format!("log(spaced({text}))"));
            }
        }
    }

    /// Writes what shows a variable.
    pub fn show(&mut self, variable: &Variable) {
        let Variable { name, kind } = variable;
        let values = match kind {
            Kind::Int | Kind::Float | Kind::Text => name.clone(),
            Kind::List => {
                let entries: Vec<String> =
                    (0..6).map(|key| format!("known({name}[{key}])")).collect();
                format!("size({name}), \": \", {}", entries.join(", \" \", "))
            }
            Kind::Record => {
                let fields = ["a", "b", "c", "s"].map(|field| format!("{name}.{field}"));
                fields.join(", \" \", ")
            }
        };
        self.line(&format!("log({values})"));
    }
}
