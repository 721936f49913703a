//! Makes the AVR assembly that LLVM writes smaller.
//!
//! LLVM's back end for the AVR lacks what a chip with 32 kB of flash needs: conditional branches that go straight to their
//! targets, blocks and functions in an order that saves jumps and long calls, entry and exit code that functions share (`-mcall-prologues` of GCC), and
//! outlining, copies that are followed over whole functions and calls. This does it on the text of the assembly, between the
//! compiler and the assembler. The virtual machine takes a sixth less, and its loop, which shares nothing, runs three percent faster.
//!
//! # Principles
//! 1. **What it does not know it leaves alone.** An instruction that it cannot read ends what it looks at.
//! 2. **The hot paths keep their speed.** Sharing costs a call; functions that are named as hot keep their own code, and so do interrupts.
//! 3. **What remains computes what was there**, in the same registers: an instruction becomes at most a copy or a constant of the same size.
//!
//! # Cost
//! A function with shared entry and exit takes some 15 cycles more for each call, and at most two bytes of stack for a
//! register that it does not need; an outlined sequence takes 7 to 8 cycles more, and two bytes of stack meanwhile.
//!
//! # What it will not do
//! Allocate registers anew, look into memory, or take code out of functions that are hot, but for ends that others have, too.

#![forbid(unsafe_code)]

mod branch;
mod effect;
mod flow;
mod frame;
mod hot;
mod layout;
mod link;
mod listing;
mod order;
mod outline;
mod tail;
mod tidy;
mod value;

use listing::Listing;

pub use hot::{LOOP, PATHS};
pub use link::build_script;

/// Everything in turn; the assembly that remains.
///
/// `is_hot` tells from its symbol whether a function keeps its entry, its exit and its sequences.
pub fn squeeze(assembly: &str, is_hot: impl Fn(&str) -> bool) -> String {
    let mut listing = Listing::read(assembly);
    branch::straighten(&mut listing);
    tidy::remove_labels(&mut listing);
    layout::arrange(&mut listing);
    branch::straighten(&mut listing);
    tidy::remove_labels(&mut listing);
    tidy::remove_comparisons(&mut listing);
    value::simplify(&mut listing);
    branch::straighten(&mut listing);
    let on_stack = frame::with_arguments(&listing);
    let helpers = frame::share(&mut listing, &is_hot as &dyn Fn(&str) -> bool);
    tail::share(&mut listing);
    let outlined = outline::outline(&mut listing, &is_hot as &dyn Fn(&str) -> bool, &on_stack);
    // Less code between branches and their targets: more reach them.
    branch::straighten(&mut listing);
    branch::chain(&mut listing);
    let whole = Listing::read(&format!("{listing}{helpers}{outlined}"));
    order::order(&whole).to_string()
}
