//! Builds the syntax tree of an equivalent script from the statements of all chunks.
//!
//! Locals are named after their numbers. A lambda and its creator use the same numbers for the
//! creator's locals, so the ordinary resolution of names finds the captured values.

use std::collections::{BTreeSet, HashSet};

use crate::ast::{
    Block, Branch, ChainLink, Expr, ExprKind, FieldKey, Function, Ident, Script, Stmt, StmtKind,
    TableField,
};
use crate::bo::arity::Arities;
use crate::bo::chunks::Chunks;
use crate::bo::error::{BoCause, BoError};
use crate::bo::listing::BoListing;
use crate::bo::locals::{Parameters, parameters};
use crate::bo::names::{Names, check_name};
use crate::bo::read::Bo;
use crate::bo::structure::{ChunkOutline, Node, outlines};
use crate::check::tree;
use crate::image::ENTRIES;
use crate::limits::PARAMETERS_MAX;

/// A script that was recovered from a `.bo` file.
#[derive(Debug)]
pub struct Recovered {
    /// The script, whose spans are lines of the listing.
    pub script: Script,
    /// The script's string literals and names of fields.
    pub strings: BTreeSet<String>,
    /// Lambdas that a block of the global code creates and that use local 0, by their first
    /// instruction.
    pub doubtful_lambdas: Vec<usize>,
}

/// Recovers the script.
pub fn recover(bo: &Bo, listing: &BoListing) -> Result<Recovered, BoError> {
    let chunks = Chunks::find(bo)?;
    let mut names = Names::default();
    for registration in &chunks.registrations {
        let text = bo.string(registration.name);
        check_name(text).map_err(|cause| bo.error(registration.at, cause))?;
        if text == "self" {
            return Err(bo.error(registration.at, BoCause::SelfAssigned));
        }
        names.entry(text).1.functions.push(registration.chunk);
    }
    let outlines = outlines(bo, listing, &chunks, &mut names)?;
    // Lambdas of the global code capture nothing, so their parameters start at local 1, as in named
    // functions.
    let starts_at_1 = |number: usize| chunks.chunks[number].creator.unwrap_or(0) == 0;
    let arities = Arities::new(&outlines, &names, &ENTRIES, starts_at_1);
    let unread = names.iter().map(|(_, name)| name);
    let unread = unread.filter(|name| !name.is_read && !ENTRIES.contains(&name.text.as_str()));
    let mut builder = Builder {
        bo,
        listing,
        chunks: &chunks,
        outlines: &outlines,
        names: &names,
        dead: unread.flat_map(|name| name.functions.iter().copied()).collect(),
        arities,
        strings: BTreeSet::new(),
        live: 1,
    };
    let mut stmts = Vec::new();
    for registration in &chunks.registrations {
        let name = Ident {
            name: bo.string(registration.name).to_owned(),
            span: listing.span(registration.at),
        };
        let function = builder.function(registration.chunk)?;
        let span = function.span;
        stmts.push(Stmt { kind: StmtKind::Function { name, function }, span });
    }
    let global = &outlines[0].nodes;
    stmts.extend(builder.block(global)?.0);
    let strings = builder.strings;
    let of_global_code = outlines[0].lambdas.iter();
    let doubtful =
        of_global_code.filter(|(chunk, in_block)| *in_block && outlines[*chunk].names_self);
    let doubtful_lambdas = doubtful.map(|(chunk, _)| chunks.start(*chunk)).collect();
    Ok(Recovered { script: Script { stmts }, strings, doubtful_lambdas })
}

struct Builder<'a> {
    bo: &'a Bo,
    listing: &'a BoListing,
    chunks: &'a Chunks,
    outlines: &'a [ChunkOutline],
    names: &'a Names,
    /// Chunks of named functions whose names no code reads.
    dead: HashSet<usize>,
    arities: Arities,
    strings: BTreeSet<String>,
    /// The number of locals at the current place, including `self` and those of the creators.
    live: u32,
}

/// Returns the name of a local, which no global can have.
fn local_name(number: usize) -> String {
    format!("local {number}")
}

impl Builder<'_> {
    /// Builds the function of a chunk that is created at the current place.
    fn function(&mut self, number: usize) -> Result<Function, BoError> {
        let outlines = self.outlines;
        let base = self.live;
        let start = self.chunks.start(number);
        let span = self.listing.span(start).to(self.listing.span(self.chunks.end(number)));
        let nodes = &outlines[number].nodes;
        let parameters = self.parameters(number, base)?;
        self.live = base + parameters;
        let params = (base..self.live)
            .map(|local| Ident { name: local_name(local as usize), span: self.listing.span(start) })
            .collect();
        let (stmts, _) = self.block(nodes)?;
        self.live = base;
        Ok(Function { params, body: Block { stmts, span }, span })
    }

    /// Returns the number of a function's parameters.
    fn parameters(&mut self, number: usize, base: u32) -> Result<u32, BoError> {
        let start = self.chunks.start(number);
        let outline = &self.outlines[number];
        let least = match parameters(outline, base, self.listing) {
            Parameters::None(at) => return Err(self.bo.error(at, BoCause::InconsistentLocals)),
            Parameters::Exactly(count) | Parameters::AtLeast(count)
                if count as usize > PARAMETERS_MAX =>
            {
                return Err(self.bo.error(start, BoCause::TooManyParameters));
            }
            Parameters::Exactly(count) => return Ok(count),
            Parameters::AtLeast(count) => count,
        };
        let inner = outline.lambdas.iter().map(|(lambda, _)| &self.outlines[*lambda]);
        let highest = inner.filter_map(|lambda| lambda.reach.last()).max();
        if highest.is_none_or(|local| *local < base + least) || self.dead.contains(&number) {
            return Ok(least);
        }
        let mut counts = self.arities.counts(number).clone();
        let is_called = !counts.is_empty();
        if !is_called {
            counts.clone_from(self.arities.unknown());
        }
        let mut possible = counts.iter().copied().filter(|count| *count >= least as usize);
        match (possible.next(), possible.next()) {
            (Some(count), None) if count <= PARAMETERS_MAX => Ok(count as u32),
            (None, _) if !is_called => Ok(least),
            _ => Err(self.bo.error(start, BoCause::UnknownParameters(counts))),
        }
    }

    /// Returns the statements of a block, and the variables that outlive the block. The variables
    /// of a `var` without braces belong to the enclosing block.
    fn block(&mut self, nodes: &[Node]) -> Result<(Vec<Stmt>, Vec<Ident>), BoError> {
        let mut stmts = Vec::new();
        let mut open = Vec::new();
        for node in nodes {
            match node {
                Node::Store { local, value, at } => {
                    self.store(*local, value, *at, &mut stmts, &mut open)?;
                }
                Node::Remove { count, .. } => {
                    self.live = self.live.saturating_sub(*count);
                    open.clear();
                }
                Node::Assign { target, value, at } => {
                    let (target, value) = (self.expr(target)?, self.expr(value)?);
                    stmts.push(self.stmt(StmtKind::Assign { target, value }, *at));
                }
                Node::Call { call, at } => {
                    let call = self.expr(call)?;
                    stmts.push(self.stmt(StmtKind::Call(call), *at));
                }
                Node::Return { value, at } => {
                    let value = value.as_ref().map(|value| self.expr(value)).transpose()?;
                    stmts.push(self.stmt(StmtKind::Return { value }, *at));
                }
                Node::If { condition, then, otherwise, at } => {
                    let condition = self.expr(condition)?;
                    let then = self.inner_block(then, *at, &mut stmts, &mut open)?;
                    let otherwise = match otherwise.is_empty() {
                        true => None,
                        false => Some(self.inner_block(otherwise, *at, &mut stmts, &mut open)?),
                    };
                    let branches = vec![Branch { condition, then }];
                    stmts.push(self.stmt(StmtKind::If { branches, otherwise }, *at));
                }
                Node::Loop { condition, update, body, at } => {
                    // The statement before a `for` is its first part. That statement also precedes
                    // the declarations of the body.
                    let is_simple = |stmt: &mut Stmt| {
                        matches!(stmt.kind, StmtKind::Assign { .. } | StmtKind::Call(_))
                    };
                    let init = if update.is_empty() { None } else { stmts.pop_if(is_simple) };
                    let condition = self.expr(condition)?;
                    let update = self.inner_block(update, *at, &mut stmts, &mut open)?;
                    let body = self.inner_block(body, *at, &mut stmts, &mut open)?;
                    let kind = repeat(init, condition, update, body, &mut stmts);
                    stmts.push(self.stmt(kind, *at));
                }
            }
        }
        Ok((stmts, open))
    }

    fn stmt(&self, kind: StmtKind, at: usize) -> Stmt {
        Stmt { kind, span: self.listing.span(at) }
    }

    /// Builds a block inside a statement. Variables that outlive the block are declared before the
    /// statement.
    fn inner_block(
        &mut self,
        nodes: &[Node],
        at: usize,
        outer: &mut Vec<Stmt>,
        open: &mut Vec<Ident>,
    ) -> Result<Block, BoError> {
        let (mut stmts, left) = self.block(nodes)?;
        for local in left {
            for stmt in &mut stmts {
                if let StmtKind::Var { name, value } = &mut stmt.kind
                    && name.name == local.name
                {
                    let span = stmt.span;
                    let target = Expr { kind: ExprKind::Name(local.name.clone()), span };
                    let value = value.take().unwrap_or(Expr { kind: ExprKind::Nil, span });
                    stmt.kind = StmtKind::Assign { target, value };
                }
            }
            outer.push(self.stmt(StmtKind::Var { name: local.clone(), value: None }, at));
            open.push(local);
        }
        Ok(Block { stmts, span: self.listing.span(at) })
    }

    fn store(
        &mut self,
        local: u32,
        value: &tree::CheckedExpr,
        at: usize,
        stmts: &mut Vec<Stmt>,
        open: &mut Vec<Ident>,
    ) -> Result<(), BoError> {
        let span = self.listing.span(at);
        let text = local_name(local as usize);
        if local >= self.live {
            let name = Ident { name: text, span };
            open.push(name.clone());
            stmts.push(self.stmt(StmtKind::Var { name, value: None }, at));
            self.live += 1;
            return Ok(());
        }
        let names_itself = self.names_local(value, local);
        let value = self.expr(value)?;
        // The Buzz compiler writes `var x = value` as `var x` and `x = value`, so x is nil in
        // `value`.
        if let Some(Stmt { kind: StmtKind::Var { name, value: first @ None }, .. }) =
            stmts.last_mut()
            && name.name == text
            && !names_itself
        {
            *first = Some(value);
            return Ok(());
        }
        let target = Expr { kind: ExprKind::Name(text), span };
        stmts.push(self.stmt(StmtKind::Assign { target, value }, at));
        Ok(())
    }

    /// Returns true if an expression, or a lambda in it, names a local.
    fn names_local(&self, expr: &tree::CheckedExpr, number: u32) -> bool {
        let mut found = match expr.kind {
            tree::CheckedExprKind::Local(local) => local.0 == number as usize,
            tree::CheckedExprKind::Lambda(id) => self.outlines[id.0].reach.contains(&number),
            _ => false,
        };
        tree::children(expr, |child| found |= self.names_local(child, number));
        found
    }

    fn expr(&mut self, expr: &tree::CheckedExpr) -> Result<Expr, BoError> {
        let kind = match &expr.kind {
            tree::CheckedExprKind::Nil | tree::CheckedExprKind::Error => ExprKind::Nil,
            tree::CheckedExprKind::Int(value) => ExprKind::Int(*value),
            tree::CheckedExprKind::Float(value) => ExprKind::Float(*value),
            tree::CheckedExprKind::Str(text) => {
                self.strings.insert(text.clone());
                ExprKind::Str(text.clone())
            }
            tree::CheckedExprKind::Local(local) => ExprKind::Name(local_name(local.0)),
            tree::CheckedExprKind::Name(name) => ExprKind::Name(self.names.text(*name).to_owned()),
            tree::CheckedExprKind::SelfValue => ExprKind::Name("self".to_owned()),
            tree::CheckedExprKind::Field { object, key, key_span } => {
                self.strings.insert(key.clone());
                let key = Ident { name: key.clone(), span: *key_span };
                ExprKind::Field { object: self.boxed(object)?, key }
            }
            tree::CheckedExprKind::Index { object, index } => {
                ExprKind::Index { object: self.boxed(object)?, index: self.boxed(index)? }
            }
            tree::CheckedExprKind::Call { callee, args } => {
                let callee = self.boxed(callee)?;
                let args = args.iter().map(|arg| self.expr(arg)).collect::<Result<_, _>>()?;
                ExprKind::Call { callee, args }
            }
            tree::CheckedExprKind::Table(entries) => {
                let fields = entries.iter().map(|(key, value)| self.field(key, value));
                ExprKind::Table(fields.collect::<Result<_, _>>()?)
            }
            tree::CheckedExprKind::Lambda(id) => ExprKind::Lambda(self.function(id.0)?),
            tree::CheckedExprKind::Unary { op, operand } => {
                ExprKind::Unary { op: *op, operand: self.boxed(operand)? }
            }
            tree::CheckedExprKind::Chain { first, links } => {
                let first = self.boxed(first)?;
                let links = links.iter().map(|link| {
                    let right = self.expr(&link.right)?;
                    Ok(ChainLink { op: link.op, right, span: link.span })
                });
                ExprKind::Chain { first, links: links.collect::<Result<_, _>>()? }
            }
        };
        Ok(Expr { kind, span: expr.span })
    }

    fn boxed(&mut self, expr: &tree::CheckedExpr) -> Result<Box<Expr>, BoError> {
        self.expr(expr).map(Box::new)
    }

    fn field(
        &mut self,
        key: &tree::CheckedExpr,
        value: &tree::CheckedExpr,
    ) -> Result<TableField, BoError> {
        let key_span = key.span;
        let key = match &key.kind {
            tree::CheckedExprKind::Str(name) => {
                self.strings.insert(name.clone());
                FieldKey::Name(name.clone())
            }
            tree::CheckedExprKind::Int(number) => FieldKey::Int(*number),
            tree::CheckedExprKind::Float(number) => FieldKey::Float(*number),
            _ => {
                let at = self.listing.instruction(key_span);
                return Err(self.bo.error(at, BoCause::ComputedField));
            }
        };
        Ok(TableField { key, key_span, value: self.expr(value)? })
    }
}

/// Makes a loop. A loop that cannot be a `for` becomes a `while` with the update at the end of its
/// body.
fn repeat(
    init: Option<Stmt>,
    condition: Expr,
    mut update: Block,
    mut body: Block,
    stmts: &mut Vec<Stmt>,
) -> StmtKind {
    let is_simple = |stmt: &Stmt| matches!(stmt.kind, StmtKind::Assign { .. } | StmtKind::Call(_));
    if let Some(init) = init {
        if let [only] = update.stmts.as_slice()
            && is_simple(only)
            && let Some(update) = update.stmts.pop()
        {
            let (init, update) = (Box::new(init), Box::new(update));
            return StmtKind::For { init, condition, update, body };
        }
        stmts.push(init);
    }
    body.stmts.append(&mut update.stmts);
    StmtKind::While { condition, body }
}
