//! Recovers the statements of a chunk from its instructions.
//!
//! The Buzz compiler generates the following forms, in which every jump has its place:
//! ```text
//! if(c) A            c jumpz 1  A  1:
//! if(c) A else B     c jumpz 1  A jump 2  1: B  2:
//! while(c) A         1: c jumpz 2  A jump 1  2:
//! for(i, c, u) A     i  1: c jumpnz 3  jump 4  2: u jump 1  3: A jump 2  4:
//! ```
//! Here, locals are identified by their numbers, and lambdas by the numbers of their chunks.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::bo::chunks::Chunks;
use crate::bo::error::{BoCause, BoError};
use crate::bo::instruction::BoAction;
use crate::bo::listing::BoListing;
use crate::bo::names::Names;
use crate::bo::read::Bo;
use crate::bo::stack::Stack;
use crate::check::tree::{CheckedExpr, CheckedExprKind, FunctionId, LocalId};

/// A statement. Expressions refer to locals by the numbers of the file.
#[derive(Debug, Clone)]
pub enum Node {
    /// `target = value` for a global or a table element.
    Assign {
        target: CheckedExpr,
        value: CheckedExpr,
        /// Number of the `gstore` or `tput`.
        at: usize,
    },
    /// `lstore`
    Store {
        /// Number of the local.
        local: u32,
        value: CheckedExpr,
        /// Number of the instruction.
        at: usize,
    },
    /// `lremove`
    Remove {
        /// The number of locals that go out of scope.
        count: u32,
        at: usize,
    },
    /// A call whose result is dropped.
    Call {
        call: CheckedExpr,
        /// Number of the `pop`.
        at: usize,
    },
    /// `ret0` and `ret1`
    Return { value: Option<CheckedExpr>, at: usize },
    /// `if`
    If {
        condition: CheckedExpr,
        /// The statements that run if the condition is true.
        then: Vec<Node>,
        /// The statements that run if the condition is false.
        otherwise: Vec<Node>,
        /// Number of the conditional jump.
        at: usize,
    },
    /// `while` and `for`
    Loop {
        condition: CheckedExpr,
        /// The update of a `for` after each iteration, which the file has before the body.
        update: Vec<Node>,
        body: Vec<Node>,
        /// Number of the conditional jump.
        at: usize,
    },
}

/// The structure of a chunk. The roles of its locals are not yet known.
#[derive(Debug, Clone, Default)]
pub struct ChunkOutline {
    pub nodes: Vec<Node>,
    /// For every local that the chunk uses, except 0, true if the local starts with `pushnil;
    /// lstore`, as a `var` does.
    pub touched: BTreeMap<u32, bool>,
    /// All locals that the chunk or a lambda in it uses.
    pub reach: BTreeSet<u32>,
    /// True if the chunk uses local 0.
    pub names_self: bool,
    /// The lambdas that the chunk creates, each with true if inside an `if`, `while` or `for`.
    pub lambdas: Vec<(usize, bool)>,
    /// Height of the chunk's tree, lambdas included.
    pub height: u32,
}

/// Recovers the statements of every chunk.
pub fn outlines(
    bo: &Bo,
    listing: &BoListing,
    chunks: &Chunks,
    names: &mut Names,
) -> Result<Vec<ChunkOutline>, BoError> {
    let mut outlines = vec![ChunkOutline::default(); chunks.chunks.len()];
    // Lambdas are read before the functions that create them, so that their heights are known.
    for (number, chunk) in chunks.chunks.iter().enumerate().rev() {
        let mut reader = StructureReader {
            bo,
            listing,
            chunks,
            names,
            outlines: &outlines,
            is_global: number == 0,
            stack: Stack::default(),
            outline: ChunkOutline::default(),
        };
        reader.outline.nodes = reader.block(chunk.code.clone())?;
        let mut outline = reader.outline;
        outline.height = reader.stack.highest;
        outline.reach.extend(outline.touched.keys());
        for (lambda, _) in &outline.lambdas {
            outline.reach.extend(&outlines[*lambda].reach);
        }
        if let Some(slot) = outlines.get_mut(number) {
            *slot = outline;
        }
    }
    Ok(outlines)
}

struct StructureReader<'a> {
    bo: &'a Bo,
    listing: &'a BoListing,
    chunks: &'a Chunks,
    names: &'a mut Names,
    /// The outlines that are complete, including those of the chunk's lambdas.
    outlines: &'a [ChunkOutline],
    is_global: bool,
    stack: Stack,
    outline: ChunkOutline,
}

impl StructureReader<'_> {
    /// Returns the statements of a range of instructions, which no jump may leave.
    fn block(&mut self, range: Range<usize>) -> Result<Vec<Node>, BoError> {
        self.stack.open_block().map_err(|cause| self.bo.error(range.start, cause))?;
        let mut nodes = Vec::new();
        let mut at = range.start;
        // The start of the current statement, to which a loop jumps back.
        let mut begin = at;
        while at < range.end {
            let place = at;
            let fail = |cause| self.bo.error(place, cause);
            match self.bo.action(at) {
                BoAction::Jumpz(to) => {
                    let condition = self.condition(at)?;
                    let (node, next) = self.if_or_while(begin..range.end, at, to, condition)?;
                    nodes.push(node);
                    at = next;
                }
                BoAction::Jumpnz(to) => {
                    let condition = self.condition(at)?;
                    let (node, next) = self.for_loop(begin..range.end, at, to, condition)?;
                    nodes.push(node);
                    at = next;
                }
                // This jump ends a `then` before an empty `else`.
                BoAction::Jump(to) if to == at + 1 && self.stack.is_empty() => at = to,
                BoAction::Jump(_) => return Err(fail(BoCause::StrayJump)),
                action => {
                    nodes.extend(self.instruction(at, action).map_err(fail)?);
                    at += 1;
                }
            }
            if self.stack.is_empty() {
                begin = at;
            }
        }
        self.stack.close_block();
        self.stack.expect_empty().map_err(|cause| self.bo.error(at.saturating_sub(1), cause))?;
        Ok(nodes)
    }

    fn condition(&mut self, at: usize) -> Result<CheckedExpr, BoError> {
        let condition = self.stack.pop().and_then(|condition| {
            self.stack.expect_empty()?;
            Ok(condition)
        });
        condition.map_err(|cause| self.bo.error(at, cause))
    }

    /// Returns the statement that starts at `within.start` and has a `jumpz` at `at`, and the end
    /// of the statement.
    fn if_or_while(
        &mut self,
        within: Range<usize>,
        at: usize,
        to: usize,
        condition: CheckedExpr,
    ) -> Result<(Node, usize), BoError> {
        if to <= at || to > within.end {
            return Err(self.bo.error(at, BoCause::StrayJump));
        }
        let last = to - 1;
        match self.bo.action(last) {
            BoAction::Jump(back) if last > at && back == within.start => {
                let body = self.block(at + 1..last)?;
                Ok((Node::Loop { condition, update: Vec::new(), body, at }, to))
            }
            BoAction::Jump(end) if last > at && end > to => {
                if end > within.end {
                    return Err(self.bo.error(last, BoCause::StrayJump));
                }
                let then = self.block(at + 1..last)?;
                let otherwise = self.block(to..end)?;
                Ok((Node::If { condition, then, otherwise, at }, end))
            }
            _ => {
                let then = self.block(at + 1..to)?;
                Ok((Node::If { condition, then, otherwise: Vec::new(), at }, to))
            }
        }
    }

    /// Returns the loop that starts at `within.start` and has a `jumpnz` at `at`, and the end of
    /// the loop.
    fn for_loop(
        &mut self,
        within: Range<usize>,
        at: usize,
        to: usize,
        condition: CheckedExpr,
    ) -> Result<(Node, usize), BoError> {
        let stray = |at| Err(self.bo.error(at, BoCause::StrayJump));
        let BoAction::Jump(end) = self.bo.action(at + 1) else { return stray(at) };
        let first = at + 2;
        if to <= first || end <= to || end > within.end {
            return stray(at);
        }
        if self.bo.action(to - 1) != BoAction::Jump(within.start) {
            return stray(to - 1);
        }
        if self.bo.action(end - 1) != BoAction::Jump(first) {
            return stray(end - 1);
        }
        let update = self.block(first..to - 1)?;
        let body = self.block(to..end - 1)?;
        Ok((Node::Loop { condition, update, body, at }, end))
    }

    /// Executes any instruction except jumps. Returns the statement that the instruction completes.
    fn instruction(&mut self, at: usize, action: BoAction) -> Result<Option<Node>, BoCause> {
        let span = self.listing.span(at);
        let kind = match action {
            BoAction::Lload(_) | BoAction::Lstore(_) | BoAction::Lremove(_) if self.is_global => {
                return Err(BoCause::LocalInGlobalCode);
            }
            BoAction::Nop => return Ok(None),
            BoAction::PushNil => CheckedExprKind::Nil,
            BoAction::PushF(value) => CheckedExprKind::Float(f64::from(value)),
            BoAction::PushI(value) => CheckedExprKind::Int(i64::from(value)),
            BoAction::PushS(number) => CheckedExprKind::Str(self.bo.string(number).to_owned()),
            BoAction::PushT => CheckedExprKind::Table(Vec::new()),
            BoAction::PushL(start) => {
                let chunk = self.chunks.starting_at(start);
                self.outline.lambdas.push((chunk, self.stack.depth > 1));
                let height = self.outlines[chunk].height;
                let kind = CheckedExprKind::Lambda(FunctionId(chunk));
                return self
                    .stack
                    .push_value(CheckedExpr { kind, span }, 1 + height)
                    .map(|()| None);
            }
            BoAction::Lload(0) => {
                self.outline.names_self = true;
                CheckedExprKind::SelfValue
            }
            BoAction::Lload(local) => {
                self.outline.touched.entry(local).or_insert(false);
                CheckedExprKind::Local(LocalId(local as usize))
            }
            BoAction::Gload => {
                let (name, span) = self.stack.pop_name()?;
                // No script can assign a global of that name, so its value is nil.
                if name == "self" {
                    return self.stack.push(CheckedExprKind::Nil, span).map(|()| None);
                }
                let (id, global) = self.names.entry(&name);
                global.is_read = true;
                return self.stack.push(CheckedExprKind::Name(id), span).map(|()| None);
            }
            BoAction::Dup => return self.stack.copy().map(|()| None),
            BoAction::Tget => return self.stack.get(span).map(|()| None),
            BoAction::Unary(op) => return self.stack.unary(op, span).map(|()| None),
            BoAction::Binary(op) => return self.stack.binary(op, span).map(|()| None),
            BoAction::Callc => return self.stack.call(span).map(|()| None),
            _ => {
                let node = self.statement(at, action)?;
                if node.is_some() {
                    self.stack.expect_empty()?;
                }
                return Ok(node);
            }
        };
        self.stack.push(kind, span).map(|()| None)
    }

    /// Executes an instruction that ends a statement.
    fn statement(&mut self, at: usize, action: BoAction) -> Result<Option<Node>, BoCause> {
        Ok(Some(match action {
            BoAction::Gstore => {
                let value = self.stack.pop()?;
                let (name, span) = self.stack.pop_name()?;
                if name == "self" {
                    return Err(BoCause::SelfAssigned);
                }
                let (id, _) = self.names.entry(&name);
                Node::Assign {
                    target: CheckedExpr { kind: CheckedExprKind::Name(id), span },
                    value,
                    at,
                }
            }
            BoAction::Tput => match self.stack.put(self.listing.span(at))? {
                Some((target, value)) => Node::Assign { target, value, at },
                None => return Ok(None),
            },
            BoAction::Lstore(0) => return Err(BoCause::SelfAssigned),
            BoAction::Lstore(local) => {
                let value = self.stack.pop()?;
                let is_nil = matches!(value.kind, CheckedExprKind::Nil);
                self.outline.touched.entry(local).or_insert(is_nil);
                Node::Store { local, value, at }
            }
            BoAction::Lremove(count) => Node::Remove { count, at },
            BoAction::Pop => match self.stack.pop()? {
                call @ CheckedExpr { kind: CheckedExprKind::Call { .. }, .. } => {
                    Node::Call { call, at }
                }
                _ => return Err(BoCause::DroppedValue),
            },
            BoAction::Ret0 => Node::Return { value: None, at },
            BoAction::Ret1 => Node::Return { value: Some(self.stack.pop()?), at },
            BoAction::PushCn(_) => return Err(BoCause::MisplacedFunction),
            BoAction::PushCc(_) => return Err(BoCause::NativeFunction),
            BoAction::Calls => return Err(BoCause::SwarmCall),
            _ => return Err(BoCause::MisplacedDone),
        }))
    }
}
