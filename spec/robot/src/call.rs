//! Checks calls of robot functions against the robot file, for programs that simulate robots on a
//! computer.

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{Argument, ByteCode, CallArguments, Refusal, RobotFault, Value};

use crate::{Parameter, RobotFunction, SignatureType, parameter_at, takes_count};

/// Returns the first of `candidates`, functions of one name, that takes these arguments, and the
/// list that takes them. If there is none, returns the fault that a robot would report.
pub fn accepting<'a, P: Profile, C: ByteCode, const SLOTS: usize>(
    candidates: &[&'a RobotFunction],
    arguments: &CallArguments<'_, P, C, SLOTS>,
) -> Result<(&'a RobotFunction, &'a [Parameter]), RobotFault> {
    let mut wrong = None;
    for function in candidates {
        for list in &function.accepts {
            match mismatch(list, arguments) {
                Mismatch::None => return Ok((function, list)),
                // If several lists do not fit, the fault names the mismatch farthest to the right.
                Mismatch::Argument(index) => wrong = wrong.max(Some(index)),
                Mismatch::Count => {}
            }
        }
    }
    Err(match wrong {
        Some(index) => RobotFault::WrongType(arguments.value(index).type_of()),
        None => RobotFault::Refused(Refusal::ArgumentCount),
    })
}

/// Returns the accepted lists as text:
/// `goto takes (x: number, y: number) or (x: number, y: number, z: number)`.
pub fn accepted_lists(candidates: &[&RobotFunction]) -> String {
    let lists = candidates.iter().flat_map(|known| &known.accepts);
    let accepted: Vec<String> = lists.map(|list| signature(list)).collect();
    let name = candidates.first().map_or("the function", |known| known.name.as_str());
    format!("{name} takes {}", accepted.join(" or "))
}

/// Returns the result of a function that has no effect: 0, 0.0 or nil.
pub fn idle_result<P: Profile>(function: &RobotFunction) -> Value<P> {
    match function.returns {
        Some(SignatureType::Int) => Value::int(0),
        Some(SignatureType::Number) => Value::float(0.0),
        _ => Value::nil(),
    }
}

/// A reason why arguments do not fit a list of parameters.
enum Mismatch {
    None,
    Count,
    /// The first argument of a wrong type.
    Argument(usize),
}

fn mismatch<P: Profile, C: ByteCode, const SLOTS: usize>(
    list: &[Parameter],
    arguments: &CallArguments<'_, P, C, SLOTS>,
) -> Mismatch {
    if !takes_count(list, arguments.count()) {
        return Mismatch::Count;
    }
    let fits = |index: usize, kind| {
        matches!(
            (kind, arguments.item(index)),
            (SignatureType::Any, _)
                | (SignatureType::Int | SignatureType::Number, Argument::Int(_))
                | (SignatureType::Number, Argument::Float(_))
                | (SignatureType::String, Argument::String(_))
                | (SignatureType::Table, Argument::Table(_))
                | (SignatureType::Function, Argument::Function)
        )
    };
    let is_wrong = |index: &usize| {
        parameter_at(list, *index).is_some_and(|parameter| !fits(*index, parameter.kind))
    };
    (0..arguments.count()).find(is_wrong).map_or(Mismatch::None, Mismatch::Argument)
}

/// Returns a list as text: `(x: number, y: number)`.
fn signature(list: &[Parameter]) -> String {
    let parameters: Vec<String> = list.iter().map(Parameter::to_string).collect();
    format!("({})", parameters.join(", "))
}
