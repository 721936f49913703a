//! The measured cases: every instruction in its usual form, and in its longer ones.

use super::image::{
    CLOSURE, CONSTANT, CodeRegion, FAR_GLOBAL, FAR_LOCAL, FIRST_FIELD, FunctionWriter, LARGE,
    LAST_FIELD, LED, NEAR_GLOBAL, NOTHING, NUMBER, SMALL,
};
use bittybuzz_vm_core::builtin::{self, Library};
use bittybuzz_vm_core::opcode as op;
use std::cell::Cell;

/// Writes instructions to a function.
type Write = Box<dyn Fn(&mut FunctionWriter)>;

/// An instruction in one of its cases.
pub struct CostCase {
    pub opcode: u8,
    /// The name of the case; empty for the most frequent one.
    pub label: &'static str,
    pub place: CodeRegion,
    /// The number of times that the instruction is in the image; its results must fit the stack and
    /// the heap.
    pub times: usize,
    /// The code that the instruction needs, without the instruction.
    pub without: Write,
    /// The code that the instruction needs, with the instruction.
    pub with: Write,
}

impl CostCase {
    /// Returns the name in the table of costs.
    pub fn name(&self) -> String {
        let name = op::info(self.opcode).map_or("?", |info| info.name);
        if self.label.is_empty() { name.to_owned() } else { format!("{name}, {}", self.label) }
    }
}

/// The list of all cases.
#[derive(Default)]
struct Cases(Vec<CostCase>);

impl Cases {
    /// Adds an instruction after others.
    fn add(
        &mut self,
        opcode: u8,
        label: &'static str,
        before: impl Fn(&mut FunctionWriter) + Clone + 'static,
        instruction: impl Fn(&mut FunctionWriter) + 'static,
    ) -> &mut CostCase {
        let with = before.clone();
        let with = Box::new(move |body: &mut FunctionWriter| {
            with(body);
            instruction(body);
        });
        let place = CodeRegion::Step;
        self.0.push(CostCase { opcode, label, place, times: 12, without: Box::new(before), with });
        let last = self.0.len() - 1;
        &mut self.0[last]
    }

    /// Adds an instruction without operand.
    fn plain(
        &mut self,
        opcode: u8,
        label: &'static str,
        before: impl Fn(&mut FunctionWriter) + Clone + 'static,
    ) -> &mut CostCase {
        self.add(opcode, label, before, move |body| body.plain(opcode))
    }

    /// Adds an instruction with an operand.
    fn operand(
        &mut self,
        opcode: u8,
        label: &'static str,
        operand: i32,
        before: impl Fn(&mut FunctionWriter) + Clone + 'static,
    ) -> &mut CostCase {
        self.add(opcode, label, before, move |body| body.operand(opcode, operand))
    }
}

/// Returns every case.
pub fn all() -> Vec<CostCase> {
    let mut cases = Cases::default();
    constants(&mut cases);
    variables(&mut cases);
    arithmetic(&mut cases);
    tables(&mut cases);
    calls(&mut cases);
    jumps(&mut cases);
    cases.0
}

fn nothing(_: &mut FunctionWriter) {}

fn one(body: &mut FunctionWriter) {
    body.int(3);
}

fn two(body: &mut FunctionWriter) {
    body.int(3);
    body.int(2);
}

fn two_floats(body: &mut FunctionWriter) {
    body.float(3);
    body.float(5);
}

const SHORT: &str = "short form";
const WIDE: &str = "operand of two bytes";
const FLOATS: &str = "floats";

fn constants(cases: &mut Cases) {
    for opcode in [op::NIL, op::UNSET, op::ROBOT_ID] {
        cases.plain(opcode, "", nothing);
    }
    for opcode in [op::FLOAT, op::FLOAT_HALF, op::INT_WORD] {
        cases.add(opcode, "", nothing, move |body| body.word(opcode, 3));
    }
    cases.operand(op::INT, SHORT, 3, nothing);
    cases.operand(op::INT, "", 100, nothing);
    cases.operand(op::INT, WIDE, 1000, nothing);
    cases.operand(op::STRING, "", FIRST_FIELD, nothing);
    cases.operand(op::FUNCTION, "", NOTHING, nothing);
    cases.operand(op::BUILTIN, "", isnil(), nothing);
    cases.operand(op::ROBOT, "", LED, nothing);
    cases.operand(op::LIBRARY, "", Library::Math as i32, nothing);
    cases.plain(op::DUP, "", one);
    cases.plain(op::POP, "", one);
    cases.operand(op::POP_N, "of 2", 2, two);
}

fn isnil() -> i32 {
    builtin::TABLE.iter().find(|info| info.name == "isnil").map_or(0, |info| i32::from(info.number))
}

fn variables(cases: &mut Cases) {
    cases.operand(op::LOCAL_GET, SHORT, NUMBER, nothing);
    cases.operand(op::LOCAL_GET, "", FAR_LOCAL, nothing);
    cases.operand(op::LOCAL_SET, "", NUMBER, one);
    cases.add(op::LOCAL_ADD, "", nothing, |body| body.local_add(NUMBER));
    cases.operand(op::GLOBAL_GET, SHORT, NEAR_GLOBAL, nothing);
    cases.operand(op::GLOBAL_GET, "", FAR_GLOBAL, nothing);
    cases.operand(op::GLOBAL_SET, SHORT, NEAR_GLOBAL, one);
    cases.operand(op::GLOBAL_SET, "", FAR_GLOBAL, one);
    cases.operand(op::CAPTURE_GET, "", 0, nothing).place = CodeRegion::Capturing;
}

fn arithmetic(cases: &mut Cases) {
    for opcode in [op::ADD, op::SUB, op::MUL, op::DIV, op::MOD, op::POW] {
        cases.plain(opcode, "", two);
        cases.plain(opcode, FLOATS, two_floats);
    }
    cases.operand(op::ADD_INT, "", 100, one);
    cases.operand(op::ADD_INT, "float", 100, |body| body.float(3));
    cases.plain(op::NEG, "", one);
    cases.plain(op::NEG, "float", |body| body.float(3));
    for opcode in [op::BAND, op::BOR, op::SHL, op::SHR] {
        cases.plain(opcode, "", two);
    }
    for opcode in [op::BNOT, op::NOT, op::TRUTH] {
        cases.plain(opcode, "", one);
    }
    for opcode in [op::EQ, op::NE, op::LT, op::LE, op::GT, op::GE] {
        cases.plain(opcode, "", two);
        cases.plain(opcode, FLOATS, two_floats);
    }
}

const ELEMENT: &str = "element of an array";
const LAST: &str = "last of 12 fields";

fn tables(cases: &mut Cases) {
    // Few repetitions, because each table takes heap cells.
    cases.plain(op::TABLE_NEW, "", nothing).times = 2;
    let local = |local| move |body: &mut FunctionWriter| body.operand(op::LOCAL_GET, local);
    let element = |body: &mut FunctionWriter| {
        body.operand(op::LOCAL_GET, SMALL);
        body.int(1);
    };
    let last = |body: &mut FunctionWriter| {
        body.operand(op::LOCAL_GET, LARGE);
        body.operand(op::STRING, LAST_FIELD);
    };
    for opcode in [op::INDEX_GET, op::INDEX_METHOD] {
        cases.plain(opcode, ELEMENT, element);
        cases.plain(opcode, LAST, last);
    }
    for opcode in [op::INDEX_SET, op::INDEX_INIT] {
        cases.plain(opcode, ELEMENT, move |body| {
            element(body);
            body.int(5);
        });
        cases.plain(opcode, LAST, move |body| {
            last(body);
            body.int(5);
        });
    }
    new_elements(cases);
    for opcode in [op::FIELD_GET, op::FIELD_METHOD] {
        cases.operand(opcode, "", FIRST_FIELD, local(SMALL));
        cases.operand(opcode, LAST, LAST_FIELD, local(LARGE));
    }
    for opcode in [op::FIELD_SET, op::FIELD_INIT] {
        for (label, table, field) in [("", SMALL, FIRST_FIELD), (LAST, LARGE, LAST_FIELD)] {
            cases.operand(opcode, label, field, move |body| {
                body.operand(op::LOCAL_GET, table);
                body.int(5);
            });
        }
    }
}

/// Adds the elements of a new table, one after the other. One of them needs a new cell.
fn new_elements(cases: &mut Cases) {
    const IN_CELL: i32 = 6;
    let before = || {
        let key = Cell::new(0);
        move |body: &mut FunctionWriter| {
            if key.get() == 0 {
                body.plain(op::TABLE_NEW);
            }
            body.plain(op::DUP);
            body.int(key.get());
            body.int(5);
            key.set((key.get() + 1) % IN_CELL);
        }
    };
    let (opcode, place, write) = (op::INDEX_SET, CodeRegion::Step, before());
    let with = Box::new(move |body: &mut FunctionWriter| {
        write(body);
        body.plain(opcode);
    });
    let (without, times) = (Box::new(before()), IN_CELL as usize);
    cases.0.push(CostCase {
        opcode,
        label: "new element of an array",
        place,
        times,
        without,
        with,
    });
}

const AND_BACK: &str = "and `RETURN_NIL` of the callee";

/// Adds calls and returns, which are counted together, because a call never comes without its
/// return.
fn calls(cases: &mut Cases) {
    cases.operand(op::CALL, AND_BACK, 0, |body| body.operand(op::FUNCTION, NOTHING));
    cases.operand(op::CALL, "of a closure, and `RETURN_NIL`", 0, |body| {
        body.operand(op::LOCAL_GET, CLOSURE);
    });
    cases.operand(op::CALL_METHOD, AND_BACK, 0, |body| {
        body.operand(op::LOCAL_GET, SMALL);
        body.operand(op::FUNCTION, NOTHING);
    });
    cases.add(op::CALL_FUNCTION, AND_BACK, nothing, |body| body.call_function(NOTHING));
    cases.add(op::RETURN_NIL, "and `CALL_FUNCTION`", nothing, |body| body.call_function(NOTHING));
    let and_call = cases.add(op::RETURN, "and `CALL_FUNCTION`", nothing, |_| {});
    // The callee has a constant to return.
    and_call.without = Box::new(|body| body.int(0));
    and_call.with = Box::new(|body| body.call_function(CONSTANT));
    cases.add(op::CALL_BUILTIN, "`isnil`", one, |body| {
        body.call_native(op::CALL_BUILTIN, isnil());
    });
    cases.add(op::CALL_ROBOT, "a function that does nothing", one, |body| {
        body.call_native(op::CALL_ROBOT, LED);
    });
    cases.add(op::CLOSURE, "of one captured value", one, |body| body.closure()).times = 2;
}

const TAKEN: &str = "jumps";
const NOT_TAKEN: &str = "goes on";

/// The comparisons, in the order of their jumps, and true for those that hold for 3 and 2.
const COMPARISONS: [(u8, bool); 10] = [
    (op::JUMP_EQ, false),
    (op::JUMP_NE, true),
    (op::JUMP_LT, false),
    (op::JUMP_LE, false),
    (op::JUMP_GT, true),
    (op::JUMP_GE, true),
    (op::JUMP_NOT_LT, true),
    (op::JUMP_NOT_LE, true),
    (op::JUMP_NOT_GT, false),
    (op::JUMP_NOT_GE, false),
];

fn jumps(cases: &mut Cases) {
    let jump = cases.add(op::JUMP, "", nothing, nothing);
    jump.without = Box::new(|body| {
        body.int(1);
        body.jump(op::JUMP_FALSE);
    });
    jump.with = Box::new(FunctionWriter::jump_over);
    for (opcode, jumps_for) in [(op::JUMP_FALSE, 0), (op::JUMP_TRUE, 1)] {
        for (label, value) in [(TAKEN, jumps_for), (NOT_TAKEN, 1 - jumps_for)] {
            cases.add(opcode, label, move |body| body.int(value), move |body| body.jump(opcode));
        }
    }
    for (opcode, jumps_for) in [(op::AND, 0), (op::OR, 1)] {
        let with = move |value| -> Write {
            Box::new(move |body: &mut FunctionWriter| {
                body.int(value);
                body.and_or(opcode);
            })
        };
        let taken = cases.add(opcode, TAKEN, nothing, nothing);
        taken.without = Box::new(move |body| body.int(jumps_for));
        taken.with = with(jumps_for);
        let goes_on = cases.add(opcode, NOT_TAKEN, nothing, nothing);
        goes_on.without = Box::new(move |body| {
            body.int(1 - jumps_for);
            body.int(1);
        });
        goes_on.with = with(1 - jumps_for);
    }
    for (label, immediate) in [(TAKEN, 9), (NOT_TAKEN, 1)] {
        cases.add(op::JUMP_LOCAL, label, nothing, move |body| {
            body.operand(op::LOCAL_GET, NUMBER);
            body.jump_int(op::JUMP_LT_INT, immediate);
        });
    }
    for (opcode, holds) in COMPARISONS {
        // Operands with the opposite outcome: 3 and 3 for equality, else 2 and 3.
        let turned = match opcode {
            op::JUMP_EQ | op::JUMP_NE => [3, 3],
            _ => [2, 3],
        };
        for (label, [a, b]) in if holds {
            [(TAKEN, [3, 2]), (NOT_TAKEN, turned)]
        } else {
            [(TAKEN, turned), (NOT_TAKEN, [3, 2])]
        } {
            let before = move |body: &mut FunctionWriter| {
                body.int(a);
                body.int(b);
            };
            cases.add(opcode, label, before, move |body| body.jump(opcode));
            let with_int = opcode + op::WITH_INT;
            let before = move |body: &mut FunctionWriter| body.int(a);
            cases.add(with_int, label, before, move |body| body.jump_int(with_int, b as i8));
        }
        cases.add(opcode, FLOATS, two_floats, move |body| body.jump(opcode));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_instruction_has_a_case_and_every_case_a_name() {
        let cases = all();
        let opcodes: BTreeSet<u8> = cases.iter().map(|case| case.opcode).collect();
        assert!(op::TABLE.iter().map(|info| info.byte).eq(opcodes));
        let names: BTreeSet<String> = cases.iter().map(CostCase::name).collect();
        assert_eq!(names.len(), cases.len());
    }
}
