//! The codes of run-time errors, and their titles.

use bittybuzz_vm_core::FaultCode;

/// Returns the code of a cause as it is printed: `R0005`. `docs/run-time-errors.md` explains each.
pub fn code(cause: FaultCode) -> String {
    format!("R{:04}", cause as u8)
}

/// Returns a line that names the cause.
pub fn title(cause: FaultCode) -> &'static str {
    match cause {
        FaultCode::WrongType => "an operand of the wrong type",
        FaultCode::NotATable => "a field of something that is no table",
        FaultCode::NotCallable => "a call of something that is no function",
        FaultCode::BadKey => "a table key that is neither number nor string",
        FaultCode::DivisionByZero => "an integer division by zero",
        FaultCode::ShiftRange => "a shift by more bits than an integer has",
        FaultCode::MissingArgument => "an argument that was not passed",
        FaultCode::Unordered => "a comparison of values that have no order",
        FaultCode::StackOverflow => "calls that are nested too deep",
        FaultCode::OutOfMemory => "no memory for a table, closure or string",
        FaultCode::AssertFailed => "an assertion that failed",
        FaultCode::RobotRefused => "a robot function that refused its arguments",
        FaultCode::StoreFull => "a stigmergy that is full",
        FaultCode::NotSendable => "a value that cannot be sent",
        FaultCode::TooLong => "a value that is too long to be sent",
        FaultCode::BadNumber => "a number that no swarm or stigmergy can have",
        FaultCode::TooMany => "more swarms or stigmergies than the robot has memory for",
        FaultCode::TextTooLong => "a string that is too long",
    }
}
