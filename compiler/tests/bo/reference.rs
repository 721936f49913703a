//! The reference compiler: from a syntax tree to the assembly text that it writes for it.
//!
//! It does not optimize; every construct has one sequence of instructions. The tests at the end compare it with what
//! the real one made.

use bittybuzz_compiler::ast::{
    BinaryOp, Block, Branch, Expr, ExprKind, FieldKey, Function, Script, Stmt, StmtKind, UnaryOp,
};
use bittybuzz_compiler::parser::Parsed;
use bittybuzz_compiler::source::SourceMap;

use crate::bo::assembler::assemble_lines;

/// The `.bo` file of a script.
pub fn compile(parsed: &Parsed) -> Vec<u8> {
    assemble_lines(assembly(&parsed.script, &parsed.sources).iter().map(String::as_str))
}

/// The assembly text of a script, line by line, without places.
fn assembly(script: &Script, sources: &SourceMap) -> Vec<String> {
    let mut compiler = Compiler {
        sources,
        strings: Vec::new(),
        registrations: Vec::new(),
        chunks: vec![Vec::new()],
        current: 0,
        labels: 1,
        locals: None,
    };
    compiler.emit("@L0");
    compiler.stmts(&script.stmts);
    let is_empty = script.stmts.is_empty();
    if !is_empty {
        compiler.emit("@__exitpoint");
        compiler.emit("done");
    }
    let mut lines = vec![format!("!{}", compiler.strings.len())];
    lines.extend(compiler.strings.iter().map(|string| format!("'{string}")));
    lines.append(&mut compiler.registrations);
    lines.push("nop".to_owned());
    if !is_empty {
        lines.extend(compiler.chunks.into_iter().flatten());
    }
    lines
}

struct Compiler<'a> {
    sources: &'a SourceMap,
    strings: Vec<String>,
    registrations: Vec<String>,
    chunks: Vec<Vec<String>>,
    current: usize,
    labels: usize,
    /// Names of the locals by number; `None` at the top level.
    locals: Option<Vec<String>>,
}

impl Compiler<'_> {
    fn emit(&mut self, line: impl Into<String>) {
        self.chunks[self.current].push(line.into());
    }

    fn string(&mut self, text: &str) -> usize {
        self.strings.iter().position(|known| known == text).unwrap_or_else(|| {
            self.strings.push(text.to_owned());
            self.strings.len() - 1
        })
    }

    fn push_string(&mut self, text: &str) {
        let number = self.string(text);
        self.emit(format!("pushs {number}"));
    }

    fn new_labels(&mut self, count: usize) -> usize {
        self.labels += count;
        self.labels - count
    }

    fn local(&self, name: &str) -> Option<usize> {
        self.locals.as_ref()?.iter().position(|known| known == name)
    }

    fn stmts(&mut self, stmts: &[Stmt]) {
        for stmt in stmts {
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &Stmt) {
        match &stmt.kind {
            StmtKind::Var { name, value } => self.var(&name.name, value.as_ref()),
            StmtKind::Function { name, function } => self.named_function(&name.name, function),
            StmtKind::If { branches, otherwise } => self.if_else(branches, otherwise.as_ref()),
            StmtKind::While { condition, body } => {
                let label = self.new_labels(2);
                self.emit(format!("@L{label}"));
                self.expr(condition);
                self.emit(format!("jumpz @L{}", label + 1));
                self.block(body);
                self.emit(format!("jump @L{label}"));
                self.emit(format!("@L{}", label + 1));
            }
            StmtKind::For { init, condition, update, body } => {
                let label = self.new_labels(4);
                self.stmt(init);
                self.emit(format!("@L{label}"));
                self.expr(condition);
                self.emit(format!("jumpnz @L{}", label + 2));
                self.emit(format!("jump @L{}", label + 3));
                self.emit(format!("@L{}", label + 1));
                self.stmt(update);
                self.emit(format!("jump @L{label}"));
                self.emit(format!("@L{}", label + 2));
                self.block(body);
                self.emit(format!("jump @L{}", label + 1));
                self.emit(format!("@L{}", label + 3));
            }
            StmtKind::Return { value: None } => self.emit("ret0"),
            StmtKind::Return { value: Some(value) } => {
                self.expr(value);
                self.emit("ret1");
            }
            StmtKind::Assign { target, value } => self.assign(target, value),
            StmtKind::Call(call) => {
                self.expr(call);
                self.emit("pop");
            }
        }
    }

    fn var(&mut self, name: &str, value: Option<&Expr>) {
        match &mut self.locals {
            None => {
                self.push_string(name);
                self.emit("pushnil");
                self.emit("gstore");
                if let Some(value) = value {
                    self.push_string(name);
                    self.expr(value);
                    self.emit("gstore");
                }
            }
            Some(locals) => {
                let number = locals.len();
                locals.push(name.to_owned());
                self.emit("pushnil");
                self.emit(format!("lstore {number}"));
                if let Some(value) = value {
                    self.expr(value);
                    self.emit(format!("lstore {number}"));
                }
            }
        }
    }

    /// With braces a block has its own variables, without it shares those around it.
    fn block(&mut self, block: &Block) {
        if !self.sources.text(block.span).starts_with('{') {
            return self.stmts(&block.stmts);
        }
        let outer = self.locals.clone();
        let before = self.locals.get_or_insert_default().len();
        self.stmts(&block.stmts);
        self.remove(before);
        self.locals = outer;
    }

    fn remove(&mut self, before: usize) {
        let count = self.locals.as_ref().map_or(0, |locals| locals.len() - before);
        if count > 0 {
            self.emit(format!("lremove {count}"));
        }
    }

    fn named_function(&mut self, name: &str, function: &Function) {
        let number = self.string(name);
        let label = self.new_labels(1);
        let registration =
            [format!("pushs {number}"), format!("pushcn @L{label}"), "gstore".to_owned()];
        self.registrations.extend(registration);
        self.chunk(label, vec!["self".to_owned()], function);
    }

    fn chunk(&mut self, label: usize, mut locals: Vec<String>, function: &Function) {
        for parameter in &function.params {
            // A parameter with the name of a captured local is not entered: its argument is never read.
            if !locals.contains(&parameter.name) {
                locals.push(parameter.name.clone());
            }
        }
        let before = locals.len();
        let outer = (self.current, self.locals.replace(locals));
        self.chunks.push(Vec::new());
        self.current = self.chunks.len() - 1;
        self.emit(format!("@L{label}"));
        self.stmts(&function.body.stmts);
        self.remove(before);
        self.emit("ret0");
        (self.current, self.locals) = outer;
    }

    fn assign(&mut self, target: &Expr, value: &Expr) {
        match &target.kind {
            ExprKind::Name(name) => match self.local(name) {
                Some(number) => {
                    self.expr(value);
                    self.emit(format!("lstore {number}"));
                }
                None => {
                    self.push_string(name);
                    self.expr(value);
                    self.emit("gstore");
                }
            },
            ExprKind::Field { object, key } => {
                self.expr(object);
                self.push_string(&key.name);
                self.expr(value);
                self.emit("tput");
            }
            ExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
                self.expr(value);
                self.emit("tput");
            }
            other => panic!("no target of an assignment: {other:?}"),
        }
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Nil => self.emit("pushnil"),
            ExprKind::Int(value) => self.emit(format!("pushi {value}")),
            ExprKind::Float(value) => self.emit(format!("pushf {value}")),
            ExprKind::Str(text) => self.push_string(text),
            ExprKind::Name(name) => match self.local(name) {
                Some(number) => self.emit(format!("lload {number}")),
                None => {
                    self.push_string(name);
                    self.emit("gload");
                }
            },
            ExprKind::Field { object, key } => {
                self.expr(object);
                self.push_string(&key.name);
                self.emit("tget");
            }
            ExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
                self.emit("tget");
            }
            ExprKind::Call { callee, args } => self.call(callee, args),
            ExprKind::Table(fields) => {
                self.emit("pusht");
                for field in fields {
                    self.emit("dup");
                    match &field.key {
                        FieldKey::Name(name) => self.push_string(name),
                        FieldKey::Int(value) => self.emit(format!("pushi {value}")),
                        FieldKey::Float(value) => self.emit(format!("pushf {value}")),
                    }
                    self.expr(&field.value);
                    self.emit("tput");
                }
            }
            ExprKind::Lambda(function) => {
                let label = self.new_labels(1);
                self.emit(format!("pushl @L{label}"));
                let locals = self.locals.clone().unwrap_or_else(|| vec!["self".to_owned()]);
                self.chunk(label, locals, function);
            }
            ExprKind::Unary { op, operand } => {
                self.expr(operand);
                match op {
                    UnaryOp::Negate => self.emit("unm"),
                    UnaryOp::Plus => {}
                    UnaryOp::BitNot => self.emit("bnot"),
                    UnaryOp::Not => self.emit("lnot"),
                }
            }
            ExprKind::Chain { first, links } => {
                self.expr(first);
                for link in links {
                    self.expr(&link.right);
                    self.emit(mnemonic(link.op));
                }
            }
            ExprKind::Paren(inner) => self.expr(inner),
            ExprKind::Error => panic!("a script with errors"),
        }
    }

    /// An `else if` is an `if` in an `else`.
    fn if_else(&mut self, branches: &[Branch], otherwise: Option<&Block>) {
        let Some((Branch { condition, then }, rest)) = branches.split_first() else {
            return otherwise.into_iter().for_each(|block| self.block(block));
        };
        let label = self.new_labels(2);
        self.expr(condition);
        self.emit(format!("jumpz @L{label}"));
        self.block(then);
        if rest.is_empty() && otherwise.is_none() {
            return self.emit(format!("@L{label}"));
        }
        self.emit(format!("jump @L{}", label + 1));
        self.emit(format!("@L{label}"));
        self.if_else(rest, otherwise);
        self.emit(format!("@L{}", label + 1));
    }

    fn call(&mut self, callee: &Expr, args: &[Expr]) {
        match &callee.kind {
            ExprKind::Field { object, key } => {
                self.expr(object);
                self.emit("dup");
                self.push_string(&key.name);
                self.emit("tget");
            }
            ExprKind::Index { object, index } => {
                self.expr(object);
                self.emit("dup");
                self.expr(index);
                self.emit("tget");
            }
            _ => {
                self.emit("pushnil");
                self.expr(callee);
            }
        }
        for arg in args {
            self.expr(arg);
        }
        self.emit(format!("pushi {}", args.len()));
        self.emit("callc");
    }
}

fn mnemonic(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Add => "add",
        BinaryOp::Sub => "sub",
        BinaryOp::Mul => "mul",
        BinaryOp::Div => "div",
        BinaryOp::Mod => "mod",
        BinaryOp::Pow => "pow",
        BinaryOp::BitAnd => "band",
        BinaryOp::BitOr => "bor",
        BinaryOp::ShiftLeft => "lshift",
        BinaryOp::ShiftRight => "rshift",
        BinaryOp::Eq => "eq",
        BinaryOp::NotEq => "neq",
        BinaryOp::Less => "lt",
        BinaryOp::LessEq => "lte",
        BinaryOp::Greater => "gt",
        BinaryOp::GreaterEq => "gte",
        BinaryOp::And => "land",
        BinaryOp::Or => "lor",
    }
}

/// Nothing that this file makes may be used before it makes what the real compiler makes.
#[test]
fn reference_compiler_writes_the_known_vectors() {
    for vector in crate::bo::vectors::ALL {
        let parsed = crate::bo::machine::parse_script("vector.bzz", vector.script);
        assert!(!parsed.has_errors(), "{}", vector.script);
        assert_eq!(compile(&parsed), vector.bytes, "{}", vector.script);
    }
}
