//! Finds the number of a function's parameters, which a `.bo` file does not contain.
//!
//! Locals are numbered: 0 is `self`, in a lambda the locals of its creator follow, then the
//! parameters, then each `var`. A `var` starts with `pushnil; lstore` of the next free number and
//! ends with the `lremove` of its block. For an assumed number of parameters, every use of a local
//! is either valid or not, so code with a `var` fits one number only. Code without `var` fits all
//! numbers that are large enough. The smallest of them is right, because the code does not read the
//! others, unless a lambda does.

use crate::bo::listing::BoListing;
use crate::bo::structure::{ChunkOutline, Node};
use crate::check::tree::{CheckedExpr, CheckedExprKind, children};
use crate::limits::PARAMETERS_MAX;

/// The numbers of parameters that fit a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameters {
    /// Only this number.
    Exactly(u32),
    /// This number and all larger ones.
    AtLeast(u32),
    /// No number; the contradiction is at this instruction.
    None(usize),
}

/// The assumed number of parameters does not fit, because of this instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct UnreachedLocal(usize);

/// Returns the numbers of parameters that fit a function whose first parameter would be local
/// `base`.
pub fn parameters(outline: &ChunkOutline, base: u32, listing: &BoListing) -> Parameters {
    // A local that does not start like a `var` is a parameter or belongs to the creator.
    let start_otherwise = outline.touched.iter().filter(|(_, starts_like_var)| !**starts_like_var);
    let count = |local: u32| (local + 1).saturating_sub(base);
    let least = start_otherwise.map(|(local, _)| count(*local)).max().unwrap_or(0);
    // Numbers above the highest local cannot be distinguished.
    let most = outline.touched.keys().map(|local| count(*local)).max().unwrap_or(0);
    let most = most.min(PARAMETERS_MAX as u32);
    let fits = |parameters| {
        let mut check = Check { listing, live: base.saturating_add(parameters) };
        match check.block(&outline.nodes)? {
            Open { count: 0, .. } => Ok(()),
            // A function that ends removes the locals of its `var`s, so none may be left.
            Open { at, .. } => Err(UnreachedLocal(at)),
        }
    };
    let found = |parameters: u32| match fits(parameters + 1) {
        Ok(()) => Parameters::AtLeast(parameters),
        Err(_) => Parameters::Exactly(parameters),
    };
    match fits(least) {
        Ok(()) => found(least),
        // A parameter that is set to nil before it is read starts like a `var`.
        Err(UnreachedLocal(at)) => {
            let other = (least + 1..=most).find(|parameters| fits(*parameters).is_ok());
            other.map_or(Parameters::None(at), found)
        }
    }
}

/// Variables that outlive their block: those of a `var` without braces belong to the enclosing
/// block.
#[derive(Debug, Clone, Copy, Default)]
struct Open {
    count: u32,
    /// The instruction that starts the last of them.
    at: usize,
}

/// The check of a function with an assumed number of parameters.
struct Check<'a> {
    listing: &'a BoListing,
    /// The number of locals that exist at the current place.
    live: u32,
}

impl Check<'_> {
    fn block(&mut self, nodes: &[Node]) -> Result<Open, UnreachedLocal> {
        let mut open = Open::default();
        for (index, node) in nodes.iter().enumerate() {
            match node {
                Node::Store { local, value, at } => {
                    self.expr(value)?;
                    if *local >= self.live {
                        if *local > self.live || !matches!(value.kind, CheckedExprKind::Nil) {
                            return Err(UnreachedLocal(*at));
                        }
                        self.live += 1;
                        open = Open { count: open.count + 1, at: *at };
                    }
                }
                Node::Remove { count, at } => {
                    if *count != open.count || index + 1 != nodes.len() {
                        return Err(UnreachedLocal(*at));
                    }
                    self.live -= open.count;
                    open.count = 0;
                }
                Node::Assign { target, value, .. } => {
                    self.expr(target)?;
                    self.expr(value)?;
                }
                Node::Call { call, .. } => self.expr(call)?,
                Node::Return { value, .. } => {
                    value.iter().try_for_each(|value| self.expr(value))?
                }
                Node::If { condition, then, otherwise, .. } => {
                    self.expr(condition)?;
                    self.inner(then, &mut open)?;
                    self.inner(otherwise, &mut open)?;
                }
                Node::Loop { condition, update, body, .. } => {
                    self.expr(condition)?;
                    self.inner(update, &mut open)?;
                    self.inner(body, &mut open)?;
                }
            }
        }
        Ok(open)
    }

    fn inner(&mut self, nodes: &[Node], open: &mut Open) -> Result<(), UnreachedLocal> {
        let inner = self.block(nodes)?;
        if inner.count > 0 {
            *open = Open { count: open.count + inner.count, at: inner.at };
        }
        Ok(())
    }

    fn expr(&self, expr: &CheckedExpr) -> Result<(), UnreachedLocal> {
        let mut result = match expr.kind {
            CheckedExprKind::Local(local) if local.0 >= self.live as usize => {
                Err(UnreachedLocal(self.listing.instruction(expr.span)))
            }
            _ => Ok(()),
        };
        children(expr, |child| {
            if result.is_ok() {
                result = self.expr(child);
            }
        });
        result
    }
}
