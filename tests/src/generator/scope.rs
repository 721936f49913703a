//! Variables that the code at a place can see, and what they hold.

use super::Generator;

/// What a variable or expression holds for certain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Int,
    Float,
    Text,
    /// A table of integers under integer keys.
    Array,
    /// A table of numbers, texts and trees of its own: no cycles.
    Tree,
    /// A table of anything.
    Graph,
    /// An object of a class.
    Object(usize),
    /// A function of integers that gives an integer.
    Function {
        arity: usize,
        level: u8,
    },
    Any,
}

#[derive(Debug, Clone)]
pub struct Variable {
    pub name: String,
    pub kind: Kind,
    /// Counts a loop.
    pub fixed: bool,
}

/// A named function.
#[derive(Debug, Clone)]
pub struct Named {
    pub name: String,
    pub parameters: Vec<Kind>,
    pub result: Kind,
    pub level: u8,
}

/// Objects that one constructor makes: `n` an integer, `s` a text, `t` an array, `o` anything, and methods of integers.
#[derive(Debug, Clone)]
pub struct Class {
    pub constructor: String,
    pub methods: Vec<(String, usize)>,
}

/// A function while it is written.
#[derive(Debug)]
pub struct Scope {
    pub blocks: Vec<Vec<Variable>>,
    /// What it returns; `None` for the global code.
    pub result: Option<Kind>,
    /// The class of its `self`.
    pub class: Option<usize>,
}

impl Scope {
    pub fn new(result: Option<Kind>) -> Scope {
        Scope { blocks: vec![Vec::new()], result, class: None }
    }
}

impl Generator {
    pub fn scope(&mut self) -> &mut Scope {
        self.scopes.last_mut().expect("code stands in a function")
    }

    /// Whether a `var` here declares a global.
    pub fn is_top_level(&self) -> bool {
        self.scopes.len() == 1
            && self.scopes[0].result.is_none()
            && self.scopes[0].blocks.len() == 1
    }

    /// The variables that can be named here, innermost first.
    pub fn visible(&self) -> Vec<&Variable> {
        let locals = self
            .scopes
            .iter()
            .rev()
            .flat_map(|scope| scope.blocks.iter().rev().flat_map(|block| block.iter().rev()));
        let mut found: Vec<&Variable> = Vec::new();
        for variable in locals.chain(&self.globals) {
            if !found.iter().any(|other| other.name == variable.name) {
                found.push(variable);
            }
        }
        found
    }

    /// One of the variables for which `fits`; locals more often than globals.
    pub fn variable(&mut self, fits: impl Fn(&Variable) -> bool) -> Option<Variable> {
        let found: Vec<Variable> =
            self.visible().into_iter().filter(|variable| fits(variable)).cloned().collect();
        if found.is_empty() {
            return None;
        }
        let near = self.random.below(found.len()) + 1;
        Some(found[self.random.below(near)].clone())
    }

    /// The name of a variable of that kind.
    pub fn named(&mut self, kind: Kind) -> Option<String> {
        self.variable(|variable| variable.kind == kind).map(|variable| variable.name)
    }

    /// Declares a variable, without writing anything.
    pub fn declare(&mut self, name: &str, kind: Kind, fixed: bool) {
        let variable = Variable { name: name.to_owned(), kind, fixed };
        if self.is_top_level() {
            self.globals.push(variable);
        } else if let Some(block) = self.scope().blocks.last_mut() {
            block.push(variable);
        }
    }

    /// A name for a local: mostly its own, at times that of a global, which it hides.
    pub fn local_name(&mut self) -> String {
        if self.random.percent(6) && !self.is_top_level() {
            let is_local = |name: &str| {
                self.scopes
                    .iter()
                    .any(|scope| scope.blocks.iter().flatten().any(|v| v.name == name))
            };
            let free: Vec<String> = self
                .globals
                .iter()
                .filter(|global| !is_local(&global.name))
                .map(|global| global.name.clone())
                .collect();
            if !free.is_empty() {
                return self.random.pick(&free).clone();
            }
        }
        self.fresh("v")
    }

    /// A kind for a new variable.
    pub fn some_kind(&mut self) -> Kind {
        let function = Kind::Function {
            arity: self.random.below(4),
            level: self.random.below(usize::from(self.level.max(1))) as u8,
        };
        let object = if self.classes.is_empty() {
            Kind::Int
        } else {
            Kind::Object(self.random.below(self.classes.len()))
        };
        let weights = [30, 10, 10, 12, 8, 8, 8, if self.level > 0 { 8 } else { 0 }, 6];
        match self.random.weighted(&weights) {
            0 => Kind::Int,
            1 => Kind::Float,
            2 => Kind::Text,
            3 => Kind::Array,
            4 => Kind::Tree,
            5 => Kind::Graph,
            6 => object,
            7 => function,
            _ => Kind::Any,
        }
    }
}
