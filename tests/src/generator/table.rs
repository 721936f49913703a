//! Tables, their keys, and what is done to them.

use super::Generator;
use super::scope::Kind;

impl Generator {
    /// A table of integers.
    pub fn array(&mut self, depth: usize) -> String {
        if let Some(name) = self.named(Kind::Array)
            && (depth == 0 || self.random.percent(40))
        {
            return name;
        }
        if depth > 0 && self.affords(12) {
            match self.random.below(8) {
                0 => {
                    let from = self.array(depth - 1);
                    let function = self.callback(&[Kind::Int, Kind::Int], Kind::Int);
                    return format!("map({from}, {function})");
                }
                1 => {
                    let from = self.array(depth - 1);
                    let function = self.callback(&[Kind::Int, Kind::Int], Kind::Int);
                    return format!("filter({from}, {function})");
                }
                2 => {
                    let from = self.array(0);
                    self.spend(10);
                    return format!("clone({from})");
                }
                _ => {}
            }
        }
        let count = self.random.below(8);
        let mut entries = Vec::new();
        for number in 0..count {
            let key = if self.random.percent(90) { number } else { self.random.below(12) };
            entries.push(format!(".{key} = {}", self.int(depth.min(1))));
        }
        table(&entries)
    }

    /// A table without cycles.
    pub fn tree(&mut self, depth: usize) -> String {
        if let Some(name) = self.named(Kind::Tree)
            && (depth == 0 || self.random.percent(30))
        {
            return name;
        }
        let count = self.random.below(5);
        let mut entries = Vec::new();
        for _ in 0..count {
            let key = self.literal_key();
            let value = self.leaf(depth);
            entries.push(format!(".{key} = {value}"));
        }
        if depth > 0 && self.random.percent(25) {
            self.spend(20);
            return format!("clone({})", table(&entries));
        }
        table(&entries)
    }

    /// A value that cannot lead to the table that it is put into.
    fn leaf(&mut self, depth: usize) -> String {
        match self.random.below(6) {
            0 | 1 => self.int(depth.min(1)),
            2 => self.float(0),
            3 => self.string(0),
            4 => self.fresh_array(),
            _ if depth > 0 => {
                let (key, value) = (self.literal_key(), self.leaf(depth - 1));
                table(&[format!(".{key} = {value}")])
            }
            _ => "{}".to_owned(),
        }
    }

    fn fresh_array(&mut self) -> String {
        let count = self.random.below(5);
        let entries: Vec<String> =
            (0..count).map(|number| format!(".{number} = {}", self.int_literal())).collect();
        table(&entries)
    }

    /// A table of anything.
    pub fn graph(&mut self, depth: usize) -> String {
        if let Some(name) = self.named(Kind::Graph)
            && (depth == 0 || self.random.percent(40))
        {
            return name;
        }
        let count = self.random.below(4);
        let mut entries = Vec::new();
        for _ in 0..count {
            let key = self.literal_key();
            let value = self.anything(depth.saturating_sub(1));
            entries.push(format!(".{key} = {value}"));
        }
        table(&entries)
    }

    /// A key as it stands after the dot of a table literal.
    fn literal_key(&mut self) -> String {
        match self.random.below(8) {
            0 | 1 => self.random.below(6).to_string(),
            2 => format!("{}.5", self.random.below(3)),
            _ => self.word(),
        }
    }

    /// A key.
    pub fn key(&mut self) -> String {
        if self.risks() && self.random.percent(30) {
            return self.anything(1);
        }
        match self.random.below(10) {
            0..4 => self.small_key(),
            4 | 5 => self.int(1),
            6 => self.float(0),
            _ => self.string(1),
        }
    }

    fn small_key(&mut self) -> String {
        let key = self.random.below(9).to_string();
        self.literal(&key)
    }

    /// Statements that change a table or read it.
    pub fn table_statement(&mut self) {
        match self.random.below(3) {
            0 => self.array_statement(),
            1 => self.tree_statement(),
            _ => self.graph_statement(),
        }
    }

    fn array_statement(&mut self) {
        let Some(array) = self.named(Kind::Array) else { return };
        let value = self.int(2);
        let line = match self.random.below(8) {
            0 | 1 => format!("{array}[size({array})] = {value}"),
            2 => format!("{array}[{}] = {value}", self.small_key()),
            3 => format!("{array}[{}] = nil", self.small_key()),
            4 => format!("{array}[({}) % 16] = {value}", self.int(1)),
            5 => format!("{array}[{}] = {value}", self.int(1)),
            _ => format!("{array}[size({array}) - 1] = nil"),
        };
        self.bounded(&array, &line);
    }

    fn tree_statement(&mut self) {
        let Some(tree) = self.named(Kind::Tree) else { return };
        let value = if self.random.percent(20) { "nil".to_owned() } else { self.leaf(2) };
        let line = match self.random.below(3) {
            0 => format!("{tree}[{}] = {value}", self.key()),
            _ => format!("{tree}.{} = {value}", self.word()),
        };
        self.bounded(&tree, &line);
    }

    fn graph_statement(&mut self) {
        let Some(graph) = self.named(Kind::Graph) else { return };
        let value = self.anything(2);
        let line = match self.random.below(5) {
            0 | 1 => format!("{graph}[{}] = {value}", self.key()),
            2 => format!("{graph}[{}] = nil", self.key()),
            3 => format!("{graph}.{} = {value}", self.word()),
            _ => format!("{graph}.{} = {graph}", self.word()),
        };
        self.bounded(&graph, &line);
    }

    /// A line that may make a table larger: in an iteration over that table it could do so for ever.
    fn bounded(&mut self, table: &str, line: &str) {
        if self.is_top_level() || line.ends_with(" = nil") {
            self.line(line);
        } else {
            self.line(&format!("if(size({table}) < 24) {line}"));
        }
    }

    /// `foreach` and its relatives as statements.
    pub fn iteration(&mut self) {
        if !self.affords(25) {
            return;
        }
        match self.random.below(5) {
            0 | 1 => {
                let Some(array) = self.named(Kind::Array) else { return };
                let change = self.change_while_iterating(&array);
                let body = self.callback_with(&[Kind::Int, Kind::Int], None, &change);
                self.line(&format!("foreach({array}, {body})"));
            }
            2 => {
                let table = self.some_table();
                let body = self.callback_with(&[Kind::Any, Kind::Any], None, "");
                self.line(&format!("foreach({table}, {body})"));
            }
            3 => {
                let array = self.array(1);
                let body = self.callback(&[Kind::Int, Kind::Int, Kind::Int], Kind::Int);
                let start = self.int(1);
                self.line(&format!("log(\"reduced \", reduce({array}, {body}, {start}))"));
            }
            _ => {
                let table = self.some_table();
                let body = self.callback(&[Kind::Any, Kind::Any], Kind::Int);
                let chosen = *self.random.pick(&["map", "filter"]);
                self.line(&format!("dump({chosen}({table}, {body}), 1)"));
                self.spend(30);
            }
        }
    }

    /// A line in a callback that changes the table being visited; KEY and VALUE stand for the parameters.
    fn change_while_iterating(&mut self, array: &str) -> String {
        match self.random.below(8) {
            0 => format!("{array}[KEY] = nil"),
            1 => format!("{array}[KEY] = VALUE + 1"),
            2 => format!("if(size({array}) < 12) {array}[size({array}) + 3] = KEY"),
            3 => format!("{array}[KEY + 1] = nil"),
            4 => format!("if(VALUE > 3) {array}[{}] = nil", self.small_key()),
            _ => String::new(),
        }
    }
}

fn table(entries: &[String]) -> String {
    if entries.is_empty() { "{}".to_owned() } else { format!("{{ {} }}", entries.join(", ")) }
}
