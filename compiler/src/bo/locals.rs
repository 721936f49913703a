//! The number of a function's parameters, which its file does not have.
//!
//! Locals are numbered: 0 is `self`, in a lambda the locals of its creator follow, then the
//! parameters, then each
//! `var`, which starts with `pushnil; lstore` of the next free number and ends with the `lremove`
//! of its block. With a
//! supposed number of parameters every use of a local means something or is wrong, so code that has
//! a `var` fits one
//! number only. Code without fits all that are large enough; the smallest is right, for nobody
//! reads the others,
//! unless a lambda does.

use crate::bo::listing::Listing;
use crate::bo::structure::{Node, Outline};
use crate::check::tree::{Expr, ExprKind, children};
use crate::codegen::asm::MAX_PARAMETERS;

/// The numbers of parameters that fit a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameters {
    /// This one only.
    Exactly(u32),
    /// This one and all above.
    AtLeast(u32),
    /// None; seen at this instruction.
    None(usize),
}

/// The supposed number of parameters does not fit; seen at this instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct UnreachedLocal(usize);

/// The numbers of parameters that fit a function whose first parameter would be local `base`.
pub fn parameters(outline: &Outline, base: u32, listing: &Listing) -> Parameters {
    // A local that does not start like a `var` is no `var`.
    let start_otherwise = outline.touched.iter().filter(|(_, starts_like_var)| !**starts_like_var);
    let count = |local: u32| (local + 1).saturating_sub(base);
    let least = start_otherwise.map(|(local, _)| count(*local)).max().unwrap_or(0);
    // Above the highest local nothing distinguishes the numbers.
    let most = outline.touched.keys().map(|local| count(*local)).max().unwrap_or(0);
    let most = most.min(MAX_PARAMETERS as u32);
    let fits = |parameters| {
        let mut check = Check { listing, live: base.saturating_add(parameters) };
        match check.block(&outline.nodes)? {
            Open { count: 0, .. } => Ok(()),
            // The end of a function removes the locals of its `var`s.
            Open { at, .. } => Err(UnreachedLocal(at)),
        }
    };
    let found = |parameters: u32| match fits(parameters + 1) {
        Ok(()) => Parameters::AtLeast(parameters),
        Err(_) => Parameters::Exactly(parameters),
    };
    match fits(least) {
        Ok(()) => found(least),
        // Parameters that are set to nil before they are read start like a `var`.
        Err(UnreachedLocal(at)) => {
            let other = (least + 1..=most).find(|parameters| fits(*parameters).is_ok());
            other.map_or(Parameters::None(at), found)
        }
    }
}

/// Variables of a block that did not end with it: those of a `var` without braces belong to the block around.
#[derive(Debug, Clone, Copy, Default)]
struct Open {
    count: u32,
    /// The start of one of them.
    at: usize,
}

/// Goes through a function with a supposed number of parameters.
struct Check<'a> {
    listing: &'a Listing,
    /// Locals that exist here.
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
                        if *local > self.live || !matches!(value.kind, ExprKind::Nil) {
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

    fn expr(&self, expr: &Expr) -> Result<(), UnreachedLocal> {
        let mut result = match expr.kind {
            ExprKind::Local(local) if local.0 >= self.live as usize => {
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
