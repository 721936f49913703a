//! Reasons to stop the build, and the place in the texts.

use std::fmt;

use super::program::AsmFileError;

/// A reason to refuse a squeezed text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SqueezeRefusal {
    /// The original cannot be read.
    Original(AsmFileError),
    /// The squeezed text cannot be read.
    Squeezed(AsmFileError),
    /// A section has different data, or different code outside of functions.
    Section(String),
    /// A function is missing, or there is an additional one.
    Functions(String),
    /// An asm! block has changed.
    Assembly(String),
    /// The room for the variables of a function has changed.
    Room(String),
    /// A function reads arguments from the stack, and its callers do not know it or the arguments
    /// have moved.
    StackArguments {
        /// The symbol of the function.
        function: String,
        /// The line of the original.
        line: usize,
    },
    /// Two executions of a function differ.
    Difference(Box<Difference>),
    /// An instruction is never executed, so that nothing is known about it.
    Unreached {
        /// The symbol of the function.
        function: String,
        /// The line.
        line: usize,
        /// True for a line of the squeezed text.
        is_squeezed: bool,
    },
}

/// A difference between two executions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The symbol of the function.
    pub function: String,
    /// The line of the original.
    pub line: usize,
    /// The line of the squeezed text.
    pub squeezed_line: usize,
    /// The difference itself.
    pub cause: DifferenceKind,
}

/// The cause of a difference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DifferenceKind {
    /// The executions have different events.
    Event {
        /// The event of the original.
        original: String,
        /// The event of the squeezed text.
        squeezed: String,
    },
    /// A register has another value.
    Register {
        /// The number of the register.
        number: u8,
        /// The use of the register.
        what: &'static str,
    },
    /// SREG has another value.
    Flags,
    /// The stack pointer has another value.
    Stack,
    /// Other bytes were pushed.
    Pushed,
    /// An event comes later while interrupts are off, or after the four cycles in which the chip
    /// expects the next write.
    Later {
        /// Cycles in the original.
        original: u32,
        /// Cycles in the squeezed text.
        squeezed: u32,
    },
    /// The squeezed text continues without doing anything.
    Hangs,
}

impl fmt::Display for DifferenceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DifferenceKind::Event { original, squeezed } => {
                write!(f, "the original does {original}, the squeezed text {squeezed}")
            }
            DifferenceKind::Register { number, what } => {
                write!(f, "r{number}, {what}, has another value")
            }
            DifferenceKind::Flags => write!(f, "SREG has another value"),
            DifferenceKind::Stack => write!(f, "the stack pointer has another value"),
            DifferenceKind::Pushed => write!(f, "other bytes are on the stack"),
            DifferenceKind::Later { original, squeezed } => write!(
                f,
                "it comes {squeezed} cycles after the access before it, in the original {original}"
            ),
            DifferenceKind::Hangs => write!(f, "the squeezed text goes on without doing anything"),
        }
    }
}

impl fmt::Display for SqueezeRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const CURE: &str = "this is a mistake of tools/squeeze; build with BBZ_SQUEEZE=off, and report it with this message";
        match self {
            SqueezeRefusal::Original(error) => {
                write!(f, "the assembly cannot be squeezed: {error}")
            }
            SqueezeRefusal::Squeezed(error) => {
                write!(f, "the squeezed assembly cannot be read: {error}; {CURE}")
            }
            SqueezeRefusal::Section(name) => {
                write!(f, "section `{name}` has changed outside of functions; {CURE}")
            }
            SqueezeRefusal::Functions(symbol) => {
                write!(f, "function `{symbol}` is not in both texts; {CURE}")
            }
            SqueezeRefusal::Assembly(symbol) => {
                write!(f, "an asm! block in function `{symbol}` has changed; {CURE}")
            }
            SqueezeRefusal::Room(symbol) => {
                write!(f, "function `{symbol}` has another room for its variables; {CURE}")
            }
            SqueezeRefusal::StackArguments { function, line } => write!(
                f,
                "function `{function}`, line {line}: an argument on the stack is not where it was; {CURE}"
            ),
            SqueezeRefusal::Difference(difference) => {
                let Difference { function, line, squeezed_line, cause } = &**difference;
                write!(
                    f,
                    "function `{function}`, line {line} (squeezed: line {squeezed_line}): {cause}; {CURE}"
                )
            }
            SqueezeRefusal::Unreached { function, line, is_squeezed } => write!(
                f,
                "function `{function}`, line {line}{}: no input was found that leads there, so nothing is known of it; build with BBZ_SQUEEZE=off, and report it with this message",
                if *is_squeezed { " of the squeezed text" } else { "" }
            ),
        }
    }
}
