//! The conversion of the arguments of robot functions.

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Argument, ByteCode, CallArguments, Refusal, Reply, RobotFault, Type, Value,
};

/// Returns the reply of a function that returns nothing.
pub fn nothing<P: Profile>() -> Result<Reply<P>, RobotFault> {
    Ok(Reply::Value(Value::nil()))
}

/// Checks the number of arguments; fails with [`Refusal::ArgumentCount`] for another one.
pub fn expect_count<P: Profile, C: ByteCode, const N: usize>(
    arguments: &CallArguments<'_, P, C, N>,
    count: usize,
) -> Result<(), RobotFault> {
    if arguments.count() == count {
        Ok(())
    } else {
        Err(RobotFault::Refused(Refusal::ArgumentCount))
    }
}

/// Returns argument `index`; fails with [`RobotFault::WrongType`] if it is not an integer.
pub fn integer<P: Profile, C: ByteCode, const N: usize>(
    arguments: &CallArguments<'_, P, C, N>,
    index: usize,
) -> Result<i32, RobotFault> {
    match arguments.item(index) {
        Argument::Int(value) => Ok(value),
        Argument::Nil => Err(RobotFault::WrongType(Type::Nil)),
        _ => Err(RobotFault::WrongType(arguments.value(index).type_of())),
    }
}
