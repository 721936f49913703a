//! Cycles of instructions on a chip.

use bittybuzz_vm_core::builtin;
use bittybuzz_vm_core::number::{Number, Profile};
use bittybuzz_vm_core::opcode::{self, WITH_INT};
use bittybuzz_vm_core::{ByteCode, Callee, Instruction, Value, Vm};

/// Rows of plain and narrow opcodes.
const OPCODES: usize = 0x80;

/// The suffixes of the usual case. Each instruction has exactly one of them.
const USUAL: [&str; 9] = [
    "",
    ", goes on",
    ", element of an array",
    ", and `RETURN_NIL` of the callee",
    ", and `CALL_FUNCTION`",
    ", `isnil`",
    ", a function that does nothing",
    ", of one captured value",
    ", of 2",
];

/// The suffixes of the other case, which depends on the form of the instruction, a jump, the callee or
/// the key.
const OTHER: [&str; 4] =
    [", short form", ", jumps", ", of a closure, and `RETURN_NIL`", ", new element of an array"];

/// The costs of an opcode.
#[derive(Clone, Copy, Debug, Default)]
struct OpcodeCosts {
    usual: u32,
    floats: u32,
    other: u32,
}

/// A table of costs: cycles of a chip, by instruction, and the cycles between two steps.
///
/// The cost of a call includes the `RETURN_NIL` of its callee, so that another return costs only
/// the difference. Built-in functions cost their longest known time, or that of `isnil`. A message,
/// and each element of a built-in that calls back, costs as much as `isnil`. Collections are not
/// counted.
#[derive(Clone, Debug)]
pub struct Costs {
    rows: [OpcodeCosts; OPCODES],
    functions: Vec<u32>,
    /// Cycles from one step to the next.
    pub step_period: u64,
}

/// The case of an instruction before it is executed.
#[derive(Clone, Copy, Debug)]
pub struct InstructionCase {
    row: OpcodeCosts,
    /// Position of the last byte of a jump. The jump was taken if the next instruction does not
    /// follow directly.
    jump: Option<u16>,
    is_other: bool,
    is_float: bool,
}

impl Costs {
    /// Makes the table from the cases of `bench/costs.json`, which `cycles` looks up by name;
    /// `None` if one is missing.
    pub fn new(cycles: impl Fn(&str) -> Option<u32>, step_period: u64) -> Option<Self> {
        let mut rows = [OpcodeCosts::default(); OPCODES];
        for info in opcode::TABLE {
            let case = |case: &&str| cycles(&format!("{}{case}", info.name));
            let floats = [", floats", ", float"].iter().find_map(case);
            let usual = USUAL.iter().find_map(case)?;
            let other = OTHER.iter().find_map(case).unwrap_or(usual);
            let row = rows.get_mut(usize::from(info.byte))?;
            *row = OpcodeCosts { usual, floats: floats.unwrap_or(usual), other };
        }
        // With a float, instructions with an immediate integer cost as much as those without.
        for jump in opcode::JUMP_LT..=opcode::JUMP_NOT_LT {
            let floats = rows[usize::from(jump)].floats;
            rows[usize::from(jump + WITH_INT)].floats = floats;
        }
        rows[usize::from(opcode::LOCAL_ADD)].floats = rows[usize::from(opcode::ADD_INT)].floats;
        let call = rows[usize::from(opcode::CALL_BUILTIN)].usual;
        let functions = builtin::TABLE.iter().map(|info| {
            let name = match (info.library, info.library.global_name()) {
                (builtin::Library::Rng, _) => format!("math.rng.{}", info.name),
                (_, Some(library)) => format!("{library}.{}", info.name),
                (_, None) => info.name.to_owned(),
            };
            let names = [
                format!("CALL_BUILTIN, `{name}`"),
                format!("CALL_BUILTIN, `{name}` of a number"),
                format!("CALL_METHOD, `{name}` of a number"),
            ];
            names.iter().find_map(|name| cycles(name)).unwrap_or(call)
        });
        Some(Costs { rows, functions: functions.collect(), step_period })
    }

    /// Returns the costs of a plain or narrow opcode.
    fn row(&self, opcode: u8) -> OpcodeCosts {
        self.rows[usize::from(opcode)]
    }

    /// Returns the case of the machine's next instruction; `None` stands for a built-in that
    /// continues.
    pub(super) fn case<P: Profile, C: ByteCode, const SLOTS: usize>(
        &self,
        vm: &Vm<P, C, SLOTS>,
        instruction: Option<&Instruction>,
    ) -> InstructionCase {
        let only = |cycles| {
            let row = OpcodeCosts { usual: cycles, floats: cycles, other: cycles };
            InstructionCase { row, jump: None, is_other: false, is_float: false }
        };
        // The call of a function that does not exist ends with a fault, whose cost does not matter.
        let function =
            |number: u8| only(self.functions.get(usize::from(number)).copied().unwrap_or(0));
        let Some(instruction) = instruction else {
            return only(self.row(opcode::CALL_BUILTIN).usual);
        };
        let Instruction { opcode, operand, position, first_byte, .. } = *instruction;
        let is_float = |value: Value<P>| matches!(value.as_number(), Some(Number::Float(_)));
        let top = |below| is_float(vm.operand(below));
        let mut case = only(0);
        case.row = self.row(opcode);
        match opcode {
            opcode::RETURN_NIL => return only(0),
            opcode::RETURN => {
                let beyond = case.row.usual.saturating_sub(self.row(opcode::RETURN_NIL).usual);
                return only(beyond);
            }
            opcode::CALL_BUILTIN => return function(operand as u8),
            opcode::CALL | opcode::CALL_METHOD => {
                match vm.callee(vm.operand((operand as u8).wrapping_add(1))) {
                    Callee::Builtin(number) => return function(number),
                    Callee::Closure => case.is_other = true,
                    Callee::Other => {}
                }
            }
            opcode::INDEX_SET => case.is_other = vm.is_missing(vm.operand(3), vm.operand(2)),
            opcode::LOCAL_ADD => case.is_float = is_float(vm.frame_local(operand)),
            opcode::ADD_INT | opcode::NEG => case.is_float = top(1),
            opcode::POW..=opcode::MOD | opcode::LT..=opcode::GE if opcode != opcode::POP => {
                case.is_float = top(1) || top(2);
            }
            opcode::JUMP_LT..=opcode::JUMP_NOT_LT => {
                case.is_float = top(1) || top(2);
                case.jump = Some(position);
            }
            opcode::JUMP_LT_INT..=opcode::JUMP_NOT_LT_INT => {
                case.is_float = top(1);
                case.jump = Some(position);
            }
            opcode::JUMP_FALSE
            | opcode::JUMP_TRUE
            | opcode::AND
            | opcode::OR
            | opcode::JUMP_LOCAL => case.jump = Some(position),
            // Other instructions have a second case only for their short form.
            _ => case.is_other = first_byte & 0xc0 == 0x80,
        }
        case
    }

    /// Returns the cycles of an executed instruction and of its work on text. `next` is the
    /// machine's next instruction.
    pub(super) fn cycles(
        &self,
        case: InstructionCase,
        next: Option<&Instruction>,
        work: u16,
    ) -> u64 {
        let has_jumped = case
            .jump
            .is_some_and(|position| next.map(|next| next.start) != Some(position.wrapping_add(1)));
        let cycles = match (case.is_float, case.is_other || has_jumped) {
            (true, _) => case.row.floats,
            (false, true) => case.row.other,
            (false, false) => case.row.usual,
        };
        // The unit of work is a cheap instruction.
        u64::from(cycles) + u64::from(work) * u64::from(self.row(opcode::ADD).usual)
    }
}
