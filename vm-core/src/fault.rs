//! The faults that stop a script.

use crate::value::Type;

/// The cause of a run-time error.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[repr(u8)]
pub enum FaultCode {
    /// An operand is not of the type that the operation needs.
    WrongType = 1,
    /// The value before `.` or `[` is no table.
    NotATable = 2,
    /// The value called is no function. The detail is the number of the built-in function that has
    /// got this value to call, or 0 if the script calls it.
    NotCallable = 3,
    /// A table key that is neither number nor string.
    BadKey = 4,
    /// Integer division or modulo by zero.
    DivisionByZero = 5,
    /// Shift count outside 0 to width - 1.
    ShiftRange = 6,
    /// A parameter that the caller did not pass was read.
    MissingArgument = 7,
    /// `<` and the like between types that have no order.
    Unordered = 8,
    /// Calls too deep: the stack met the heap.
    StackOverflow = 9,
    /// No room for a table, closure or string, even after a collection.
    OutOfMemory = 10,
    /// `assert` failed; the detail is 1 + the number of its message string, or 0 without a message.
    AssertFailed = 11,
    /// A robot function refused; the detail is the number of the [`Refusal`].
    RobotRefused = 12,
    /// No room for one more entry in the robot's stigmergies.
    StoreFull = 13,
    /// A value that cannot be sent: a function with captured values, a robot's function, a library.
    NotSendable = 14,
    /// A value that does not fit the fragments of a message.
    TooLong = 15,
    /// The number of a swarm or stigmergy is outside 0 to 65535.
    BadNumber = 16,
    /// More swarms or stigmergies than the robot has memory for.
    TooMany = 17,
    /// A string made at run time that has more bytes than the machine makes in one instruction.
    TextTooLong = 18,
}

impl FaultCode {
    /// Every cause.
    pub const ALL: [FaultCode; 18] = [
        FaultCode::WrongType,
        FaultCode::NotATable,
        FaultCode::NotCallable,
        FaultCode::BadKey,
        FaultCode::DivisionByZero,
        FaultCode::ShiftRange,
        FaultCode::MissingArgument,
        FaultCode::Unordered,
        FaultCode::StackOverflow,
        FaultCode::OutOfMemory,
        FaultCode::AssertFailed,
        FaultCode::RobotRefused,
        FaultCode::StoreFull,
        FaultCode::NotSendable,
        FaultCode::TooLong,
        FaultCode::BadNumber,
        FaultCode::TooMany,
        FaultCode::TextTooLong,
    ];
}

/// A run-time error. With the script hash and the compiler's symbols, the host finds file, line and
/// column.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Fault {
    /// The cause.
    pub code: FaultCode,
    /// The offset of the instruction from the start of the code.
    pub position: u16,
    /// The types of the operands or of the offending value; nil if the cause has none.
    pub operands: [Type; 2],
    /// A number for [`FaultCode::NotCallable`], [`FaultCode::AssertFailed`] and
    /// [`FaultCode::RobotRefused`]; else 0.
    pub detail: u16,
}

/// A fault that a robot function reports instead of a result.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RobotFault {
    /// An argument is not of a type that the function takes.
    WrongType(Type),
    /// The function refuses the call.
    Refused(Refusal),
}

/// A reason why a robot function refuses a call. Its number is the fault's detail.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u16)]
pub enum Refusal {
    /// The function takes another number of arguments.
    ArgumentCount = 1,
    /// An argument is outside the robot's range.
    OutOfRange = 2,
    /// The function is known, but this firmware cannot do it.
    NotBuiltIn = 3,
    /// A device that the function needs is missing, or has not answered yet.
    NotReady = 4,
}

impl Refusal {
    /// Every reason.
    pub const ALL: [Refusal; 4] =
        [Refusal::ArgumentCount, Refusal::OutOfRange, Refusal::NotBuiltIn, Refusal::NotReady];
}

/// The error of an operation that stopped the script. The machine already holds the fault, so that
/// returning this error costs nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Stopped;
