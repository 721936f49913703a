//! The meaning of a run-time error in its script.

use bittybuzz_robot_spec::{NumberProfile, Robot};
use bittybuzz_vm_core::builtin::{self, BuiltinInfo, Library};
use bittybuzz_vm_core::{Fault, FaultCode, Refusal, Type, opcode};

use crate::instruction::{self, ByteCodeInstruction};
use crate::operand;
use crate::program::KnownProgram;

/// A fault in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Words {
    /// The mistake, in one sentence without a full stop.
    pub headline: String,
    /// The cure.
    pub help: Option<String>,
}

/// Describes a fault. `marked` is the source text of the instruction, if it is known; `refusal`
/// lists the arguments that the robot function accepts, if it refused those of the call.
pub fn describe(
    fault: &Fault,
    program: KnownProgram<'_>,
    marked: Option<&str>,
    refusal: Option<&str>,
) -> Words {
    let instruction = instruction::ending_at(program.image, fault.position);
    let what = FaultText { fault, program, instruction, callee: callee(instruction, program) };
    let nil = marked.and_then(|marked| operand::nil(marked, fault));
    let mut headline = what.headline(marked);
    if let Some(nil) = &nil {
        headline.push_str(&format!(": `{nil}` is nil"));
    }
    let help = match nil.as_deref() {
        Some("self") => {
            Some("`self` is the table `t` in a call `t.f()`, and nil in a call `f()`".to_owned())
        }
        _ => what.help(refusal),
    };
    Words { headline, help }
}

/// Returns the arguments that a robot's function accepts, after it has refused others.
pub fn accepted(fault: &Fault, program: KnownProgram<'_>, robot: Option<&Robot>) -> Option<String> {
    match fault.code {
        FaultCode::WrongType => {}
        FaultCode::RobotRefused if fault.detail == Refusal::ArgumentCount as u16 => {}
        _ => return None,
    }
    let name = import(instruction::ending_at(program.image, fault.position)?, program)?;
    Some(bittybuzz_robot_spec::accepted_lists(&[robot?.function(name)?]))
}

struct FaultText<'a> {
    fault: &'a Fault,
    program: KnownProgram<'a>,
    instruction: Option<ByteCodeInstruction>,
    /// The built-in or robot function that was called.
    callee: Option<String>,
}

impl FaultText<'_> {
    fn headline(&self, marked: Option<&str>) -> String {
        let [first, second] = self.fault.operands.map(with_article);
        match self.fault.code {
            FaultCode::WrongType => self.wrong_type(first, second),
            FaultCode::NotATable => self.no_table(first),
            FaultCode::NotCallable => match operand::called_by(self.fault).map(builtin_name) {
                Some(callee) => format!("{callee} needs a function to call, not {first}"),
                None => format!("cannot call {first}"),
            },
            FaultCode::BadKey => format!("a table key must be a number or a string, not {first}"),
            FaultCode::DivisionByZero => match self.opcode() {
                Some(opcode::MOD) => "integer modulo by zero".to_owned(),
                _ => "integer division by zero".to_owned(),
            },
            FaultCode::ShiftRange => "the shift count is outside the bits of an integer".to_owned(),
            FaultCode::MissingArgument => self.missing_argument(marked),
            FaultCode::Unordered => match &self.callee {
                Some(callee) => format!("{callee} cannot order {first} and {second}"),
                None => format!("cannot order {first} and {second}"),
            },
            FaultCode::StackOverflow => "stack overflow: calls are nested too deep".to_owned(),
            FaultCode::OutOfMemory => "out of memory: no room for another value".to_owned(),
            FaultCode::AssertFailed => match self.message() {
                Some(message) => format!("assertion failed: {message}"),
                None => "assertion failed".to_owned(),
            },
            FaultCode::StoreFull => {
                "the stigmergies of this robot have no room for another key".to_owned()
            }
            FaultCode::NotSendable => format!("{first} cannot be sent to other robots"),
            FaultCode::TooLong => "the message is too long to be sent".to_owned(),
            FaultCode::BadNumber => {
                "the number of a swarm or stigmergy must be 0 to 65535".to_owned()
            }
            FaultCode::TooMany => match self.callee.as_deref() {
                Some("`stigmergy.create`") => {
                    "this robot has no room for another stigmergy".to_owned()
                }
                _ => "this robot has no room for another swarm".to_owned(),
            },
            FaultCode::TextTooLong => "this string would have more than 1000 characters".to_owned(),
            FaultCode::RobotRefused => {
                let callee = self.callee.as_deref().unwrap_or("the robot function");
                let reason =
                    Refusal::ALL.iter().find(|reason| **reason as u16 == self.fault.detail);
                match reason {
                    Some(Refusal::ArgumentCount) | None => {
                        format!("{callee} does not take these arguments")
                    }
                    Some(Refusal::OutOfRange) => {
                        format!("{callee} cannot do that: an argument is out of its range")
                    }
                    Some(Refusal::NotBuiltIn) => {
                        format!("{callee} is not built into this firmware")
                    }
                    Some(Refusal::NotReady) => {
                        format!("{callee} is not ready: what it needs has not answered")
                    }
                }
            }
        }
    }

    fn wrong_type(&self, first: &str, second: &str) -> String {
        match self.opcode() {
            Some(opcode::ADD_INT) if self.instruction.is_some_and(|add| add.operand < 0) => {
                format!("cannot subtract {second} from {first}")
            }
            Some(opcode::ADD | opcode::ADD_INT | opcode::LOCAL_ADD) => {
                format!("cannot add {first} and {second}")
            }
            Some(opcode::SUB) => format!("cannot subtract {second} from {first}"),
            Some(opcode::MUL) => format!("cannot multiply {first} by {second}"),
            Some(opcode::DIV) => format!("cannot divide {first} by {second}"),
            Some(opcode::MOD) => format!("cannot take {first} modulo {second}"),
            Some(opcode::POW) => format!("cannot raise {first} to the power of {second}"),
            Some(opcode::NEG) => format!("cannot negate {first}"),
            Some(opcode::BAND | opcode::BOR) => {
                format!("cannot combine the bits of {first} and {second}")
            }
            Some(opcode::BNOT) => format!("cannot invert the bits of {first}"),
            Some(opcode::SHL | opcode::SHR) => format!("cannot shift {first} by {second}"),
            _ => match &self.callee {
                Some(callee) => format!("{callee} does not take {first}"),
                None => format!("the function does not take {first}"),
            },
        }
    }

    fn no_table(&self, first: &str) -> String {
        match (self.opcode(), self.operand_string(), &self.callee) {
            (Some(opcode::FIELD_GET | opcode::FIELD_METHOD), Some(name), _) => {
                format!("cannot read field `{name}` of {first}")
            }
            (Some(opcode::FIELD_SET | opcode::FIELD_INIT), Some(name), _) => {
                format!("cannot set field `{name}` of {first}")
            }
            (Some(opcode::INDEX_SET | opcode::INDEX_INIT), ..) => {
                format!("cannot set an entry of {first}")
            }
            (_, _, Some(callee)) => format!("{callee} needs a table, not {first}"),
            _ => format!("cannot read an entry of {first}"),
        }
    }

    fn missing_argument(&self, marked: Option<&str>) -> String {
        match (self.opcode(), marked, &self.callee) {
            (Some(opcode::LOCAL_GET), Some(name), _) if is_name(name) => {
                format!("argument `{name}` was not passed")
            }
            (Some(opcode::LOCAL_GET), ..) => "an argument that was not passed is read".to_owned(),
            (_, _, Some(callee)) => format!("an argument of {callee} is missing"),
            _ => "an argument that was not passed is used".to_owned(),
        }
    }

    fn help(&self, refusal: Option<&str>) -> Option<String> {
        let [first, second] = self.fault.operands;
        // An operation with one operand leaves the second nil.
        let is_nil = first == Type::Nil || (self.is_binary() && second == Type::Nil);
        Some(match self.fault.code {
            FaultCode::WrongType | FaultCode::RobotRefused if refusal.is_some() => {
                return refusal.map(str::to_owned);
            }
            FaultCode::WrongType | FaultCode::NotATable if is_nil => {
                "a variable or field that was never assigned is nil; `isnil(x)` tests for it".to_owned()
            }
            FaultCode::WrongType => "`type(x)` returns the type of a value".to_owned(),
            FaultCode::NotATable => "only tables have entries".to_owned(),
            FaultCode::NotCallable if is_nil => {
                "is the name spelled as in its definition, and is it assigned before this call?"
                    .to_owned()
            }
            FaultCode::BadKey => "an entry is found by a number or a string only".to_owned(),
            FaultCode::DivisionByZero => "test the divisor first, as in `if(n != 0)`".to_owned(),
            FaultCode::ShiftRange => match self.program.profile {
                NumberProfile::Tiny => "the count must be 0 to 15 in the tiny profile".to_owned(),
                NumberProfile::Full => "the count must be 0 to 31 in the full profile".to_owned(),
            },
            FaultCode::MissingArgument => "every parameter that is read must be passed".to_owned(),
            FaultCode::Unordered => {
                "numbers are ordered, and strings; nil is below everything".to_owned()
            }
            FaultCode::StackOverflow => {
                "does a function call itself without end? If the calls are few, tables and closures fill the memory"
                    .to_owned()
            }
            FaultCode::OutOfMemory => {
                "keep fewer tables, closures and strings; storing nil removes an entry".to_owned()
            }
            FaultCode::StoreFull => {
                "a deleted key keeps its place for 64 s; `stigmergy_entries` of the robot file \
                 says how many keys there is room for"
                    .to_owned()
            }
            FaultCode::NotSendable => {
                "numbers, strings, tables of these, and functions that capture nothing can be sent"
                    .to_owned()
            }
            FaultCode::TooLong => {
                "a message has at most 8 fragments: send several shorter ones".to_owned()
            }
            FaultCode::BadNumber => return None,
            FaultCode::TooMany => "a robot is in at most 8 swarms, and has as many stigmergies as \
                 `stigmergy_entries` of its robot file says, at most 100"
                .to_owned(),
            FaultCode::TextTooLong => {
                "a robot makes strings of at most 1000 characters: use or send the text in parts"
                    .to_owned()
            }
            FaultCode::NotCallable | FaultCode::AssertFailed | FaultCode::RobotRefused => {
                return None;
            }
        })
    }

    fn opcode(&self) -> Option<u8> {
        self.instruction.map(|instruction| instruction.opcode)
    }

    fn is_binary(&self) -> bool {
        matches!(
            self.opcode(),
            Some(
                opcode::ADD
                    | opcode::ADD_INT
                    | opcode::LOCAL_ADD
                    | opcode::SUB
                    | opcode::MUL
                    | opcode::DIV
                    | opcode::MOD
                    | opcode::POW
                    | opcode::BAND
                    | opcode::BOR
                    | opcode::SHL
                    | opcode::SHR
            )
        )
    }

    /// Returns the string that the instruction names.
    fn operand_string(&self) -> Option<&str> {
        self.program.string(self.instruction?.operand as u16)
    }

    /// Returns the message of a failed assertion.
    fn message(&self) -> Option<&str> {
        self.program.string(self.fault.detail.checked_sub(1)?)
    }
}

/// Returns the quoted name of the built-in or robot function that an instruction calls; `None` for
/// other instructions, and for numbers of functions that only a damaged image has.
fn callee(instruction: Option<ByteCodeInstruction>, program: KnownProgram<'_>) -> Option<String> {
    let ByteCodeInstruction { opcode, operand } = instruction?;
    match opcode {
        opcode::CALL_BUILTIN => Some(builtin_name(builtin::info(u8::try_from(operand).ok()?)?)),
        _ => import(instruction?, program).map(|name| format!("`{name}`")),
    }
}

/// Returns the name of a built-in function, in quotation marks, as a script writes it.
fn builtin_name(info: &BuiltinInfo) -> String {
    match info.library {
        Library::Rng => format!("`math.rng.{}`", info.name),
        library => match library.global_name() {
            Some(name) => format!("`{name}.{}`", info.name),
            None => format!("`{}`", info.name),
        },
    }
}

/// Returns the name of the robot function that an instruction calls.
fn import(instruction: ByteCodeInstruction, program: KnownProgram<'_>) -> Option<&str> {
    let ByteCodeInstruction { opcode: opcode::CALL_ROBOT, operand } = instruction else {
        return None;
    };
    let imports = &program.symbols?.imports;
    imports.get(usize::try_from(operand).ok()?).map(String::as_str)
}

fn with_article(kind: Type) -> &'static str {
    match kind {
        Type::Nil => "nil",
        Type::Int => "an integer",
        Type::Float => "a float",
        Type::String => "a string",
        Type::Table => "a table",
        Type::Closure => "a closure",
        Type::Unset => "an argument that was not passed",
    }
}

fn is_name(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}
