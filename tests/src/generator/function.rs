//! Functions: named ones, lambdas, methods, callbacks, and their calls.

use super::scope::{Class, Kind, Named, Scope};
use super::{COST_MAX, Effort, Generator};

impl Generator {
    /// Writes the inside of braces somewhere else and gives its text.
    pub fn inside(&mut self, write: impl FnOnce(&mut Self)) -> String {
        let outer = std::mem::take(&mut self.text);
        self.indent += 1;
        write(self);
        self.indent -= 1;
        for _ in 0..self.indent {
            self.text.push_str("  ");
        }
        std::mem::replace(&mut self.text, outer)
    }

    /// The body of a function that is called from elsewhere: with a level and an effort of its own.
    fn body(&mut self, level: u8, write: impl FnOnce(&mut Self)) -> String {
        let effort = Effort { spent: 0, times: 1, most: COST_MAX[usize::from(level)] };
        let outer_effort = std::mem::replace(&mut self.effort, effort);
        let outer_level = std::mem::replace(&mut self.level, level);
        let text = self.inside(write);
        self.effort = outer_effort;
        self.level = outer_level;
        text
    }

    /// Names for parameters; those of a lambda may hide what is around it.
    fn parameters(&mut self, kinds: &[Kind], is_lambda: bool) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for kind in kinds {
            let outer = if is_lambda && self.random.percent(8) { self.named(*kind) } else { None };
            let name = outer.filter(|name| !names.contains(name));
            let name = name.unwrap_or_else(|| self.fresh("p"));
            names.push(name);
        }
        names
    }

    fn declare_parameters(&mut self, names: &[String], kinds: &[Kind]) {
        for (name, kind) in names.iter().zip(kinds) {
            self.declare(name, *kind, false);
        }
    }

    /// A lambda that the function around it passes on at once.
    pub fn callback(&mut self, parameters: &[Kind], result: Kind) -> String {
        self.callback_with(parameters, Some(result), "")
    }

    /// The same with a line of its own, in which KEY and VALUE are the first parameters.
    pub fn callback_with(
        &mut self,
        parameters: &[Kind],
        result: Option<Kind>,
        line: &str,
    ) -> String {
        let names = self.parameters(parameters, true);
        let class = self.scope().class;
        self.scopes.push(Scope { class, ..Scope::new(result.or(Some(Kind::Any))) });
        self.declare_parameters(&names, parameters);
        let body = self.repeated(8, |me| {
            me.inside(|me| {
                if !line.is_empty() {
                    me.line(&line.replace("KEY", &names[0]).replace("VALUE", &names[1]));
                }
                me.statements(2);
                if result.is_none() && me.affords(4) {
                    let list = names.join(", \" \", ");
                    me.line(&format!("log(\"visit \", {list})"));
                }
                if let Some(result) = result {
                    let value = me.expression(result, 2);
                    me.line(&format!("return {value}"));
                }
            })
        });
        self.scopes.pop();
        format!("function({}) {{\n{body}}}", names.join(", "))
    }

    /// A function value of integers.
    pub fn function_value(&mut self, arity: usize, level: u8) -> String {
        let fits = |kind| matches!(kind, Kind::Function { arity: a, level: l } if a == arity && l <= level);
        if self.random.percent(30)
            && let Some(found) = self.variable(|variable| fits(variable.kind))
        {
            return found.name;
        }
        let kinds = vec![Kind::Int; arity];
        let named = self.functions.iter().find(|function| {
            function.level <= level && function.parameters == kinds && function.result == Kind::Int
        });
        if let Some(named) = named
            && self.random.percent(20)
        {
            return named.name.clone();
        }
        self.lambda(&kinds, Kind::Int, level)
    }

    /// A lambda that may be kept.
    fn lambda(&mut self, kinds: &[Kind], result: Kind, level: u8) -> String {
        self.spend(3);
        let names = self.parameters(kinds, true);
        let class = self.scope().class;
        self.scopes.push(Scope { class, ..Scope::new(Some(result)) });
        self.declare_parameters(&names, kinds);
        let body = self.body(level, |me| {
            let most = me.random.below(3);
            me.statements(most);
            me.assign_captured();
            let value = me.expression(result, 3);
            me.line(&format!("return {value}"));
        });
        self.scopes.pop();
        format!("function({}) {{\n{body}}}", names.join(", "))
    }

    /// At times: changes the copy of a local of the function around.
    fn assign_captured(&mut self) {
        if self.random.percent(15)
            && let Some(name) = self.named(Kind::Int)
            && !self.is_fixed(&name)
        {
            let value = self.int(1);
            self.line(&format!("{name} = {name} + ({value})"));
        }
    }

    pub fn is_fixed(&self, name: &str) -> bool {
        self.visible().iter().any(|variable| variable.name == name && variable.fixed)
    }

    /// Writes a named function, and lets the code after it call it.
    pub fn named_function(&mut self, level: u8) -> String {
        let name = self.fresh("f");
        let count = match self.random.below(12) {
            0 => 8 + self.random.below(6),
            _ => self.random.below(4),
        };
        let kinds: Vec<Kind> = (0..count)
            .map(|_| match self.random.below(8) {
                0 => Kind::Float,
                1 => Kind::Array,
                2 => Kind::Any,
                3 => Kind::Text,
                _ => Kind::Int,
            })
            .collect();
        let result = match self.random.below(8) {
            0 => Kind::Float,
            1 => Kind::Array,
            2 if level > 0 => Kind::Function { arity: self.random.below(3), level: level - 1 },
            3 => Kind::Graph,
            _ => Kind::Int,
        };
        let text = self.global_function(&name, &kinds, result, level, |me| {
            let most = 2 + me.random.below(6);
            me.statements(most);
            let value = me.expression(result, 3);
            me.line(&format!("return {value}"));
        });
        self.functions.push(Named { name, parameters: kinds, result, level });
        text
    }

    /// A function that calls itself, so often as its first parameter says.
    pub fn recursive_function(&mut self) -> String {
        let name = self.fresh("r");
        let kinds = [Kind::Int, Kind::Int];
        let depth = self.random.range(2, 12);
        let own = name.clone();
        let text = self.global_function(&name, &kinds, Kind::Int, 1, |me| {
            let names: Vec<String> =
                me.scope().blocks[0].iter().map(|variable| variable.name.clone()).collect();
            let (count, value) = (names[0].clone(), names[1].clone());
            me.scope().blocks[0][0].fixed = true;
            me.line(&format!("if({count} <= 0) return {value}"));
            // Whoever passes a large number must not wait for it.
            me.line(&format!("if({count} > {depth}) return {own}({depth}, {value})"));
            me.repeated(depth as u64, |me| me.statements(2));
            let next = me.repeated(depth as u64, |me| me.int(2));
            match me.random.below(3) {
                0 => me.line(&format!("return {own}({count} - 1, {next})")),
                1 => me.line(&format!("return {own}({count} - 1, {next}) + {count}")),
                _ => {
                    me.line(&format!("var deep = {own}({count} - 1, {next})"));
                    me.line(&format!("return (deep + {value}) - {count}"));
                }
            }
        });
        self.functions.push(Named {
            name,
            parameters: kinds.to_vec(),
            result: Kind::Int,
            level: 1,
        });
        text
    }

    /// A function at the top level, with a body in which its parameters are known.
    pub fn global_function(
        &mut self,
        name: &str,
        kinds: &[Kind],
        result: Kind,
        level: u8,
        write: impl FnOnce(&mut Self),
    ) -> String {
        let outer_scopes = std::mem::replace(&mut self.scopes, vec![Scope::new(Some(result))]);
        let outer_indent = std::mem::take(&mut self.indent);
        let names = self.parameters(kinds, false);
        self.declare_parameters(&names, kinds);
        let body = self.body(level, write);
        self.scopes = outer_scopes;
        self.indent = outer_indent;
        let text = if self.random.percent(5) { " \"documentation\"" } else { "" };
        format!("function {name}({}){text} {{\n{body}}}\n", names.join(", "))
    }

    /// Writes a constructor, and lets the code after it make objects.
    pub fn class(&mut self) -> String {
        let constructor = self.fresh("make");
        let number = self.classes.len();
        let methods: Vec<(String, usize)> =
            (0..self.random.range(1, 3)).map(|_| (self.fresh("m"), self.random.below(3))).collect();
        let text = self.global_function(&constructor, &[Kind::Int], Kind::Int, 1, |me| {
            let start = me.scope().blocks[0][0].name.clone();
            let text = me.string(0);
            let object = me.fresh("self_");
            me.line(&format!(
                "var {object} = {{ .n = {start}, .s = {text}, .t = {{}}, .o = nil }}"
            ));
            for (method, arity) in &methods {
                let lambda = me.method(number, *arity);
                me.line(&format!("{object}.{method} = {lambda}"));
            }
            me.line(&format!("return {object}"));
        });
        self.classes.push(Class { constructor, methods });
        text
    }

    /// A lambda that uses `self`, an object of that class.
    pub fn method(&mut self, class: usize, arity: usize) -> String {
        let kinds = vec![Kind::Int; arity];
        let names = self.parameters(&kinds, true);
        self.scopes.push(Scope { class: Some(class), ..Scope::new(Some(Kind::Int)) });
        self.declare_parameters(&names, &kinds);
        let body = self.body(0, |me| {
            let value = me.int(2);
            me.line(&format!("self.n = self.n + ({value})"));
            match me.random.below(4) {
                0 => me.line("self.t[size(self.t)] = self.n"),
                1 => {
                    let name = me.fresh("v");
                    me.line(&format!("var {name} = function(x) {{ return self.n - x }}"));
                    me.line(&format!("self.n = {name}(1)"));
                }
                _ => me.statements(1),
            }
            let value = me.int(2);
            me.line(&format!("return self.n + ({value})"));
        });
        self.scopes.pop();
        format!("function({}) {{\n{body}}}", names.join(", "))
    }

    /// An object of a class.
    pub fn object(&mut self, class: usize, depth: usize) -> String {
        if let Some(name) = self.named(Kind::Object(class))
            && (depth == 0 || self.random.percent(60))
        {
            return name;
        }
        self.spend(30);
        let argument = self.int(1);
        format!("{}({argument})", self.classes[class].constructor)
    }

    /// A call of a method, an integer.
    pub fn method_call(&mut self, depth: usize) -> String {
        let found = self.variable(|variable| matches!(variable.kind, Kind::Object(_)));
        let Some(found) = found.filter(|_| self.level > 0 && self.affords(COST_MAX[0])) else {
            return self.int(0);
        };
        let Kind::Object(class) = found.kind else { return self.int(0) };
        self.spend(COST_MAX[0]);
        let (method, arity) = self.random.pick(&self.classes[class].methods).clone();
        let arguments = self.int_arguments(arity, depth);
        match self.random.below(5) {
            0 => format!("{}[\"{method}\"]({arguments})", found.name),
            // A name that is known only when the program runs.
            1 => format!("{}[same(\"{method}\")]({arguments})", found.name),
            _ => format!("{}.{method}({arguments})", found.name),
        }
    }

    /// A call of a function of integers, named or a value.
    pub fn function_call(&mut self, depth: usize) -> String {
        let level = self.level;
        if self.random.percent(50) {
            let callable = |kind| matches!(kind, Kind::Function { level: l, .. } if l < level);
            if let Some(found) = self.variable(|variable| callable(variable.kind))
                && let Kind::Function { arity, level } = found.kind
                && self.affords(COST_MAX[usize::from(level)])
            {
                self.spend(COST_MAX[usize::from(level)]);
                return format!("{}({})", found.name, self.int_arguments(arity, depth));
            }
        }
        self.call_of_named(Kind::Int, depth).unwrap_or_else(|| self.int(0))
    }

    /// A call of a named function with that result, if there is one that this place may call.
    pub fn call_of_named(&mut self, result: Kind, depth: usize) -> Option<String> {
        let callable: Vec<Named> = self
            .functions
            .iter()
            .filter(|function| function.level < self.level && function.result == result)
            .filter(|function| self.affords(COST_MAX[usize::from(function.level)]))
            .cloned()
            .collect();
        if callable.is_empty() {
            return None;
        }
        let function = self.random.pick(&callable).clone();
        self.spend(COST_MAX[usize::from(function.level)]);
        let mut arguments: Vec<String> =
            function.parameters.iter().map(|kind| self.expression(*kind, depth.min(1))).collect();
        if self.risks() {
            arguments.pop();
        } else if self.random.percent(2) {
            arguments.push(self.int_literal());
        }
        Some(format!("{}({})", function.name, arguments.join(", ")))
    }
}
