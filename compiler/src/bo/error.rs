//! The reasons why a `.bo` file cannot be imported.

use std::collections::BTreeSet;
use std::fmt;

use crate::include::SOURCE_BYTES_MAX;
use crate::limits::PARAMETERS_MAX;

/// A reason why a `.bo` file cannot be imported, and its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BoError {
    /// Offset in the file.
    pub offset: usize,
    pub cause: BoCause,
}

/// A mistake in a `.bo` file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BoCause {
    // Errors of the file format.
    /// The file is far larger than the program of any robot.
    TooLarge,
    /// The file is too short to contain the number of strings.
    NoStringCount,
    /// The file ends inside the string of this number.
    StringCut(usize),
    /// The string of this number is not UTF-8.
    StringNotUtf8(usize),
    /// There is no instruction with this opcode.
    UnknownOpcode(u8),
    /// The file ends inside the argument of this instruction.
    ArgumentCut(&'static str),
    /// There is no string of this number.
    UnknownString(i32),
    /// No instruction starts at this offset, which another instruction refers to.
    UnknownAddress(i32),
    /// The number of a local, or a number of locals, is negative.
    NegativeLocal(i32),

    // Errors in the parts of the program. Only code from other sources than the Buzz compiler has
    // these.
    /// The registration of named functions does not end with `nop`.
    NoRegistrationEnd,
    /// The global code does not end with `done`, or another place has a `done`.
    MisplacedDone,
    /// A function does not end with `ret0`.
    NoReturn,
    /// A function starts inside the global code.
    FunctionInGlobalCode,
    /// A function or lambda is created in more than one place.
    SharedFunction,
    /// A lambda precedes the function that creates it.
    LambdaBeforeCreator,
    /// A named function is created outside the registration.
    MisplacedFunction,
    /// A native function by number; the numbers differ from machine to machine.
    NativeFunction,
    /// A swarm call.
    SwarmCall,

    // Errors of the operand stack.
    /// An instruction pops a value from the empty stack.
    StackEmpty,
    /// A statement ends with values left on the stack.
    StackNotEmpty,
    /// A copy made by `dup` is neither the table of a method call nor of a table literal.
    StrayCopy,
    /// The name of a global is computed.
    ComputedName,
    /// The name of a global is no identifier.
    NotAnIdentifier,
    /// The key of a table literal's field is computed.
    ComputedField,
    /// `pop` drops a value that is not the result of a call.
    DroppedValue,
    /// The number of arguments of a call is computed.
    ComputedArgumentCount,
    /// A method is called without its table.
    MethodWithoutTable,
    /// A table is given to a call of a plain function.
    SelfOfPlainCall,

    // Errors of jumps.
    /// A jump that belongs to no `if`, `while` or `for`.
    StrayJump,

    // Errors of local variables.
    /// A local variable in the global code.
    LocalInGlobalCode,
    /// `self` is assigned.
    SelfAssigned,
    /// A local is used where it does not exist, or more locals are removed than exist.
    InconsistentLocals,
    /// The numbers of a lambda's parameters depend on the number of parameters of this function,
    /// which creates the lambda. The file does not contain that number, and calls pass these
    /// numbers of arguments.
    UnknownParameters(BTreeSet<usize>),

    /// A function has more parameters than an image can name.
    TooManyParameters,
    /// Statements, expressions or lambdas are nested too deep.
    TooDeep,
}

impl BoCause {
    /// Returns true if the file may be well-formed, but does not come from the Buzz compiler.
    fn is_foreign(&self) -> bool {
        match self {
            BoCause::TooLarge
            | BoCause::NoStringCount
            | BoCause::StringCut(_)
            | BoCause::StringNotUtf8(_)
            | BoCause::UnknownOpcode(_)
            | BoCause::ArgumentCut(_)
            | BoCause::UnknownString(_)
            | BoCause::UnknownAddress(_)
            | BoCause::NegativeLocal(_)
            | BoCause::LocalInGlobalCode
            | BoCause::SelfAssigned
            | BoCause::UnknownParameters(_)
            | BoCause::TooManyParameters
            | BoCause::TooDeep => false,
            BoCause::NoRegistrationEnd
            | BoCause::MisplacedDone
            | BoCause::NoReturn
            | BoCause::FunctionInGlobalCode
            | BoCause::SharedFunction
            | BoCause::LambdaBeforeCreator
            | BoCause::MisplacedFunction
            | BoCause::NativeFunction
            | BoCause::SwarmCall
            | BoCause::StackEmpty
            | BoCause::StackNotEmpty
            | BoCause::StrayCopy
            | BoCause::ComputedName
            | BoCause::NotAnIdentifier
            | BoCause::ComputedField
            | BoCause::DroppedValue
            | BoCause::ComputedArgumentCount
            | BoCause::MethodWithoutTable
            | BoCause::SelfOfPlainCall
            | BoCause::StrayJump
            | BoCause::InconsistentLocals => true,
        }
    }
}

impl fmt::Display for BoCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_foreign() {
            f.write_str("not produced by the Buzz compiler: ")?;
        }
        match self {
            BoCause::TooLarge => write!(f, "the file has more than {SOURCE_BYTES_MAX} bytes"),
            BoCause::NoStringCount => f.write_str("too short to be a Buzz object file"),
            BoCause::StringCut(number) => write!(f, "the file ends inside string {number}"),
            BoCause::StringNotUtf8(number) => {
                write!(f, "string {number} is not UTF-8; save the script as UTF-8 and compile it again")
            }
            BoCause::UnknownOpcode(byte) => write!(f, "no instruction has the opcode {byte}"),
            BoCause::ArgumentCut(name) => write!(f, "the file ends inside the argument of `{name}`"),
            BoCause::UnknownString(number) => write!(f, "there is no string {number}"),
            BoCause::UnknownAddress(to) => write!(f, "no instruction starts at offset {to}"),
            BoCause::NegativeLocal(number) => write!(f, "{number} is no number of a local variable"),
            BoCause::NoRegistrationEnd => {
                f.write_str("the registration of named functions is incomplete")
            }
            BoCause::MisplacedDone => f.write_str("the global code does not end with its only `done`"),
            BoCause::NoReturn => f.write_str("a function does not end with `ret0`"),
            BoCause::FunctionInGlobalCode => f.write_str("a function starts inside the global code"),
            BoCause::SharedFunction => f.write_str("one function is made in two places"),
            BoCause::LambdaBeforeCreator => {
                f.write_str("a lambda stands before the function that creates it")
            }
            BoCause::MisplacedFunction => {
                f.write_str("a named function is made outside the registration")
            }
            BoCause::NativeFunction => f.write_str("it names a native function by its number"),
            BoCause::SwarmCall => f.write_str("it makes a swarm call"),
            BoCause::StackEmpty => f.write_str("this instruction takes a value that is not there"),
            BoCause::StackNotEmpty => f.write_str("a statement leaves values on the stack"),
            BoCause::StrayCopy => f.write_str("a copied value is used otherwise than as a table"),
            BoCause::ComputedName => f.write_str("the name of a global variable is computed"),
            BoCause::NotAnIdentifier => f.write_str("the name of a global variable is no identifier"),
            BoCause::ComputedField => f.write_str("the key of a field in a table literal is computed"),
            BoCause::DroppedValue => f.write_str("a value that comes from no call is dropped"),
            BoCause::ComputedArgumentCount => f.write_str("the number of arguments is computed"),
            BoCause::MethodWithoutTable => f.write_str("a method is called without its table"),
            BoCause::SelfOfPlainCall => f.write_str("a plain call is given a table as self"),
            BoCause::StrayJump => f.write_str("this jump belongs to no `if`, `while` or `for`"),
            BoCause::LocalInGlobalCode => f.write_str(
                "`var` in a block of the global code: Buzz itself crashes here; compile the script instead of \
                 the .bo file",
            ),
            BoCause::SelfAssigned => f.write_str("`self` is assigned"),
            BoCause::InconsistentLocals => {
                f.write_str("no number of parameters fits the local variables of this function")
            }
            BoCause::UnknownParameters(counts) => {
                let counts: Vec<String> = counts.iter().map(usize::to_string).collect();
                write!(
                    f,
                    "a .bo file does not say how many parameters a function has; this one creates a function that \
                     depends on it, and is called with {} arguments; compile the script instead of the .bo file",
                    counts.join(" and ")
                )
            }
            BoCause::TooManyParameters => {
                write!(f, "a function can have at most {PARAMETERS_MAX} parameters")
            }
            BoCause::TooDeep => f.write_str("this is nested too deep"),
        }
    }
}

impl fmt::Display for BoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (offset {})", self.cause, self.offset)
    }
}

impl std::error::Error for BoError {}
