//! A whole program: helpers, globals, functions, entries.

use std::collections::BTreeSet;

use super::scope::{Kind, Scope};
use super::{COST_MAX, Effort, Generator, TOP_LEVEL};

/// What every program has. `dump` shows what a value holds, a few levels deep.
const HELPERS: &str = r#"function dump(x, depth) {
  if(istable(x)) {
    log("table of ", size(x))
    if(depth > 0) foreach(x, function(key, value) {
      log("key ", key)
      dump(value, depth - 1)
    })
  }
  else log(type(x), " ", x)
}
function asint(x, default) {
  if(isint(x)) return x
  return default
}
function elem(table, key) { return table[key] }
function same(x) { return x }
"#;

const HELPERS_FULL: &str = r#"function short(text) {
  if(string.length(text) > 70) return string.sub(text, 3, 50)
  return text
}
function asfloat(x, default) {
  if(isfloat(x)) return x
  return default
}
"#;

/// Texts and field names: some are the machine's own, some longer than a cell of the heap.
const WORDS: [&str; 16] = [
    "a",
    "b",
    "table",
    "string",
    "azimuth",
    "data",
    "zebra",
    "robot",
    "Name",
    "x1",
    "integer",
    "key",
    "distance",
    "timestamp",
    "longer_than_the_first_cell",
    "so_long_that_it_needs_another_cell_and_yet_another",
];

impl Generator {
    /// The whole text.
    pub fn program(mut self) -> String {
        self.choose_words();
        let mut before = vec![HELPERS.to_owned()];
        if self.options.full {
            before.push(HELPERS_FULL.to_owned());
        }
        let main = self.global_code();
        // Functions may stand anywhere at the top level: they exist before the first line runs.
        let mut after = Vec::new();
        for function in main.functions {
            if self.random.percent(50) { &mut before } else { &mut after }.push(function);
        }
        let text = format!("{}{}{}", before.concat(), main.text, after.concat());
        // What was written and then left out would be a string too many.
        let used: BTreeSet<&str> =
            text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').collect();
        let hidden = self.hidden.iter().filter(|(_, name)| used.contains(name.as_str()));
        let hidden: String =
            hidden.map(|(literal, name)| format!("{name} = {literal}\n")).collect();
        format!("{hidden}{text}")
    }

    fn choose_words(&mut self) {
        self.words = WORDS.iter().map(|word| (*word).to_owned()).collect();
        if self.random.percent(15) {
            let more = (0..140).map(|number| format!("word{number}"));
            self.words.extend(more);
        }
    }

    fn global_code(&mut self) -> Main {
        let mut functions = Vec::new();
        let globals = if self.random.percent(10) { 150 } else { 6 + self.random.below(14) };
        self.line("nothing = nil");
        for _ in 0..globals {
            self.global();
        }
        for _ in 0..self.random.below(3) {
            let class = self.class();
            functions.push(class);
        }
        for level in 0..TOP_LEVEL {
            for _ in 0..self.random.range(0, 3) {
                let function = self.named_function(level);
                functions.push(function);
            }
            if level == 1 {
                let function = self.recursive_function();
                functions.push(function);
            }
        }
        for _ in 0..3 {
            self.global();
        }
        self.statements(12);
        self.change_a_function();
        for entry in ["init", "step", "reset"] {
            if self.random.percent(75) {
                let function = self.entry(entry);
                functions.extend(function);
            }
        }
        functions.push(self.last_words());
        Main { text: std::mem::take(&mut self.text), functions }
    }

    fn global(&mut self) {
        let kind = self.some_kind();
        let name = self.fresh("g");
        let value = self.expression(kind, 2);
        let var = if self.random.percent(30) { "var " } else { "" };
        self.line(&format!("{var}{name} = {value}"));
        self.declare(&name, kind, false);
    }

    /// At times a named function becomes a variable.
    fn change_a_function(&mut self) {
        if self.functions.is_empty() || !self.random.percent(15) {
            return;
        }
        let function = self.random.pick(&self.functions).clone();
        if function.result == Kind::Int && function.parameters.iter().all(|kind| *kind == Kind::Int)
        {
            let value = self.function_value(function.parameters.len(), 0);
            // Not itself: that would change nothing.
            if value != function.name {
                self.line(&format!("{} = {value}", function.name));
            }
        }
    }

    /// A function that the host calls; `None` if it is a variable that the text holds already.
    fn entry(&mut self, name: &str) -> Option<String> {
        let write = |me: &mut Self| {
            let most = 4 + me.random.below(8);
            me.statements(most);
        };
        if self.random.percent(15) {
            let outer_effort = self.effort;
            self.effort = Effort { spent: 0, times: 1, most: COST_MAX[usize::from(TOP_LEVEL)] };
            self.scopes.push(Scope::new(Some(Kind::Any)));
            let body = self.inside(write);
            self.scopes.pop();
            self.effort = outer_effort;
            self.line(&format!("{name} = function() {{\n{body}}}"));
            return None;
        }
        Some(self.global_function(name, &[], Kind::Any, TOP_LEVEL, write))
    }

    /// Shows every global.
    fn last_words(&mut self) -> String {
        let globals = self.globals.clone();
        self.global_function("destroy", &[], Kind::Any, TOP_LEVEL, |me| {
            for global in &globals {
                me.line(&format!("log(\"{}\")", global.name));
                me.line(&format!("dump({}, 2)", global.name));
            }
        })
    }
}

struct Main {
    text: String,
    functions: Vec<String>,
}
