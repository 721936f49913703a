//! Reasons to stop the build, and the place in the texts.

use std::fmt;

use super::program::ReadError;

/// A reason to refuse a squeezed text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The original cannot be read.
    Original(ReadError),
    /// The squeezed text cannot be read.
    Squeezed(ReadError),
    /// A section has other data, or other code outside of functions.
    Section(String),
    /// A function is missing, or there is another one.
    Functions(String),
    /// An asm! block is not as it was.
    Assembly(String),
    /// The variables of a function have less room, or more.
    Room(String),
    /// A function reads its arguments from the stack and this is not known to its callers, or they have moved.
    StackArguments {
        /// The function.
        function: String,
        /// The line of the original.
        line: usize,
    },
    /// Two executions of a function differ.
    Difference(Box<Difference>),
    /// An instruction is never executed, so nothing is known of it.
    Unreached {
        /// The function.
        function: String,
        /// The line.
        line: usize,
        /// It stands in the squeezed text.
        is_squeezed: bool,
    },
}

/// A difference between two executions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The function.
    pub function: String,
    /// The line of the original.
    pub line: usize,
    /// The line of the squeezed text.
    pub squeezed_line: usize,
    /// The difference itself.
    pub cause: Cause,
}

/// The kind of a difference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Something else happens.
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
        /// Its use.
        what: &'static str,
    },
    /// SREG has another value.
    Flags,
    /// The stack pointer is elsewhere.
    Stack,
    /// Other bytes were pushed.
    Pushed,
    /// It takes more cycles, where interrupts are off or the chip expects the next write within four.
    Later {
        /// Cycles in the original.
        original: u32,
        /// Cycles in the squeezed text.
        squeezed: u32,
    },
    /// The squeezed text goes on without doing anything.
    Hangs,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::Event { original, squeezed } => {
                write!(f, "the original does {original}, the squeezed text {squeezed}")
            }
            Cause::Register { number, what } => {
                write!(f, "r{number}, {what}, has another value")
            }
            Cause::Flags => write!(f, "SREG has another value"),
            Cause::Stack => write!(f, "the stack pointer has another value"),
            Cause::Pushed => write!(f, "other bytes are on the stack"),
            Cause::Later { original, squeezed } => write!(
                f,
                "it comes {squeezed} cycles after the access before it, in the original {original}"
            ),
            Cause::Hangs => write!(f, "the squeezed text goes on without doing anything"),
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const CURE: &str = "this is a mistake of tools/squeeze; build with BBZ_SQUEEZE=off, and report it with this message";
        match self {
            Refusal::Original(error) => write!(f, "the assembly cannot be squeezed: {error}"),
            Refusal::Squeezed(error) => {
                write!(f, "the squeezed assembly cannot be read: {error}; {CURE}")
            }
            Refusal::Section(name) => {
                write!(f, "section `{name}` has changed outside of functions; {CURE}")
            }
            Refusal::Functions(symbol) => {
                write!(f, "function `{symbol}` is not in both texts; {CURE}")
            }
            Refusal::Assembly(symbol) => {
                write!(f, "an asm! block in function `{symbol}` has changed; {CURE}")
            }
            Refusal::Room(symbol) => {
                write!(f, "function `{symbol}` has another room for its variables; {CURE}")
            }
            Refusal::StackArguments { function, line } => write!(
                f,
                "function `{function}`, line {line}: an argument on the stack is not where it was; {CURE}"
            ),
            Refusal::Difference(difference) => {
                let Difference { function, line, squeezed_line, cause } = &**difference;
                write!(
                    f,
                    "function `{function}`, line {line} (squeezed: line {squeezed_line}): {cause}; {CURE}"
                )
            }
            Refusal::Unreached { function, line, is_squeezed } => write!(
                f,
                "function `{function}`, line {line}{}: no input was found that leads there, so nothing is known of it; build with BBZ_SQUEEZE=off, and report it with this message",
                if *is_squeezed { " of the squeezed text" } else { "" }
            ),
        }
    }
}
