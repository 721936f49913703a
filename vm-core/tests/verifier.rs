//! Every rule of the verifier, with code that breaks it.

use bittybuzz_testkit::ImageParts;
use bittybuzz_vm_core::image::{
    BESIDE_GLOBALS, CAPTURES, EntryPoint, FORM_CLASSES, FORM_FULL, FORM_LIBRARIES, MAGIC, USES_SELF,
};
use bittybuzz_vm_core::number::{Full, Tiny};
use bittybuzz_vm_core::opcode::*;
use bittybuzz_vm_core::{Image, ImageError, Vm, builtin};

fn load(bytes: &[u8]) -> Result<(), ImageError> {
    let mut vm: Vm<Tiny, &[u8], 64> = Vm::new();
    vm.load(Image::new(bytes), |hash| hash == 7)
}

/// Loads an image whose global code is this, with a stack of `depth`. Positions are counted from the first
/// instruction.
fn check(depth: u8, code: &[u8]) -> Result<(), ImageError> {
    check_with(depth, code, |_| {})
}

fn check_with(depth: u8, code: &[u8], change: impl Fn(&mut ImageParts)) -> Result<(), ImageError> {
    let mut parts = ImageParts::new(&[&[&[0, depth], code].concat()]);
    change(&mut parts);
    let bytes = parts.build();
    let after: usize = parts.functions.iter().skip(1).map(Vec::len).sum();
    let start = (bytes.len() - code.len() - after) as u16;
    let relative = |at: u16| at.wrapping_sub(start);
    load(&bytes).map_err(|error| match error {
        ImageError::Instruction(at) => ImageError::Instruction(relative(at)),
        ImageError::Operand(at) => ImageError::Operand(relative(at)),
        ImageError::Depth(at) => ImageError::Depth(relative(at)),
        ImageError::Jump(at) => ImageError::Jump(relative(at)),
        ImageError::NoReturn(at) => ImageError::NoReturn(relative(at)),
        ImageError::TooManyJumps(at) => ImageError::TooManyJumps(relative(at)),
        other => other,
    })
}

const END: u8 = 0xbc; // RETURN_NIL 0

#[test]
fn accepts_the_smallest_program() {
    assert_eq!(check(0, &[END]), Ok(()));
}

#[test]
fn refuses_bytes_without_an_image() {
    assert_eq!(load(&[]), Err(ImageError::Truncated));
    assert_eq!(load(&[0x42; 40]), Err(ImageError::NotAnImage));
    // Of the version before, and of one to come with a class table.
    assert_eq!(load(&[MAGIC, 0x01]), Err(ImageError::Version(1)));
    assert_eq!(load(&[MAGIC, 0x0b]), Err(ImageError::Version(3)));
    let mut full = ImageParts::new(&[&[0, 0, END]]);
    full.form |= FORM_FULL;
    assert_eq!(load(&full.build()), Err(ImageError::Profile));
    let mut vm: Vm<Full, &[u8], 64> = Vm::new();
    assert_eq!(vm.load(Image::new(&full.build()), |_| false), Ok(()));
    let long = vec![MAGIC; 0xff01];
    assert_eq!(load(&long), Err(ImageError::TooLong));
}

#[test]
fn refuses_every_truncation() {
    let mut parts = ImageParts::new(&[&[0, 2, INT, 100, 0xb0, END], &[1, 1, 0x83, 0xb9]]);
    parts.form |= FORM_LIBRARIES;
    parts.imports = vec![7];
    parts.libraries = vec![[1, 3, 0, builtin::ABS]];
    parts.form |= FORM_CLASSES;
    parts.strings = vec!["a", "b"];
    parts.classes = vec![1, 2, 0xff];
    let bytes = parts.build();
    assert_eq!(load(&bytes), Ok(()));
    for length in 0..bytes.len() {
        assert!(load(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
    }
}

#[test]
fn checks_the_header() {
    let base = ImageParts::new(&[&[0, 0, END]]);
    let with = |change: fn(&mut ImageParts)| {
        let mut parts = base.clone();
        change(&mut parts);
        load(&parts.build())
    };
    assert_eq!(with(|p| p.features = 0x0c), Err(ImageError::Features(0x0c)));
    // A machine without room for stigmergies refuses their table.
    let table = |p: &mut ImageParts| (p.features, p.stigmergies) = (0x80, vec![5, 1, 2]);
    assert_eq!(with(table), Err(ImageError::Features(0x80)));
    assert_eq!(with(|p| p.entries[1] = EntryPoint::Function(1)), Err(ImageError::Entry(1)));
    assert_eq!(with(|p| p.entries[3] = EntryPoint::Global(2)), Err(ImageError::Entry(3)));
    assert_eq!(with(|p| p.entries[3] = EntryPoint::Global(1)), Ok(()));
    assert_eq!(with(|p| p.imports = vec![7, 8]), Err(ImageError::RobotFunction(8)));
    assert_eq!(with(|p| p.globals = 60), Err(ImageError::TooManyGlobals(60)));
    assert_eq!(with(|p| p.functions.clear()), Err(ImageError::Function(0)));
    // Parameters, flags and depth of the global code.
    assert_eq!(with(|p| p.functions[0][0] = 1), Err(ImageError::Function(0)));
    assert_eq!(with(|p| p.functions[0][0] = USES_SELF), Err(ImageError::Function(0)));
    assert_eq!(with(|p| p.functions[0][1] = 201), Err(ImageError::Function(0)));
    // A row of the library table: library, string, built-in.
    for (row, result) in [
        ([1, 3, 0, builtin::ABS], Ok(())),
        ([99, 3, 0, builtin::ABS], Err(ImageError::LibraryTable(0))),
        ([1, 12, 0, builtin::ABS], Err(ImageError::LibraryTable(0))),
        ([1, 3, 0, 255], Err(ImageError::LibraryTable(0))),
        ([4, 3, 0, builtin::NEIGHBORS_GET], Err(ImageError::LibraryTable(0))),
    ] {
        let mut parts = base.clone();
        parts.form |= FORM_LIBRARIES;
        parts.libraries = vec![row];
        assert_eq!(load(&parts.build()), result, "{row:?}");
    }
}

/// Returns code of that length that leaves the stack empty.
fn code_of(length: usize) -> Vec<u8> {
    let mut code = [INT, 100, POP].repeat((length + 1) % 2);
    let rest = length - 1 - code.len();
    code.extend([NIL, POP].repeat(rest / 2));
    code.push(END);
    code
}

#[test]
fn the_greatest_of_each_limit_is_accepted() {
    let head = ImageParts::new(&[&[0, 1]]).build().len();
    // docs/image-format.md states the limit of 0xff00 bytes.
    let image = |length: usize| {
        let code = code_of(length - head);
        ImageParts::new(&[&[&[0, 1], &code[..]].concat()]).build()
    };
    assert_eq!(image(0xff00).len(), 0xff00);
    assert_eq!(load(&image(0xff00)), Ok(()));
    assert_eq!(load(&image(0xff01)), Err(ImageError::TooLong));
    // The global code needs some of the 64 slots.
    let globals = |count: u8| check_with(0, &[END], |parts| parts.globals = count);
    let greatest = 64 - BESIDE_GLOBALS as u8;
    assert_eq!(globals(greatest), Ok(()));
    assert_eq!(globals(greatest + 1), Err(ImageError::TooManyGlobals((greatest + 1).into())));
    assert_eq!(check(200, &[END]), Ok(()));
    assert_eq!(check(201, &[END]), Err(ImageError::Function(0)));
    // Self, or the first captured value, takes a slot of the closure's own frame.
    let captures = |count: u8| {
        let code = [&[NIL].repeat(count.into())[..], &[CLOSURE, 1, count, POP, END]].concat();
        check_with(count, &code, |parts| parts.functions.push(vec![CAPTURES, 1, END]))
    };
    assert_eq!(captures(199), Ok(()));
    assert_eq!(captures(200), Err(ImageError::Operand(200)));
    // Each jump that is pending takes one of the 64 slots.
    let jumps = |count: u16| {
        let jump = |number: u16| {
            let [low, high] = (4 * (count - 1 - number)).to_le_bytes();
            [NIL, JUMP_FALSE | WIDE, low, high]
        };
        let code: Vec<u8> = (0..count).flat_map(jump).collect();
        check(2, &[&code[..], &[END]].concat())
    };
    assert_eq!(jumps(64), Ok(()));
    assert!(matches!(jumps(65), Err(ImageError::TooManyJumps(_))));
}

#[test]
fn the_next_program_starts_with_clean_state() {
    let plain = ImageParts::new(&[&[0, 0, END]]);
    let mut with_libraries = plain.clone();
    with_libraries.form |= FORM_LIBRARIES;
    with_libraries.libraries = vec![[1, 3, 0, builtin::ABS]];
    let (before, bytes) = (with_libraries.build(), plain.build());
    let mut vm: Vm<Tiny, &[u8], 64> = Vm::new();
    assert_eq!(vm.load(Image::new(&before), |_| false), Ok(()));
    assert_eq!(vm.load(Image::new(&bytes), |_| false), Ok(()));
    assert_eq!(vm.header().map(|header| header.library_rows()), Some(0));
}

#[test]
fn function_table_must_be_contiguous() {
    let parts = ImageParts::new(&[&[0, 0, END], &[0, 0, END]]);
    let mut bytes = parts.build();
    let table = bytes.len() - 6 - 4;
    assert_eq!(load(&bytes), Ok(()));
    bytes[table + 2] = 4;
    assert!(load(&bytes).is_err(), "gap");
    bytes[table + 2] = 1;
    assert_eq!(load(&bytes), Err(ImageError::Function(0)), "overlap");
    bytes[table + 2] = 200;
    assert!(load(&bytes).is_err(), "behind the end");
    bytes[table] = 1;
    assert_eq!(load(&bytes), Err(ImageError::Function(0)), "first not at 0");
}

#[test]
fn knows_every_instruction_and_no_other() {
    for byte in 0..=0xff_u8 {
        let decoded = decode([byte, 0, 0]);
        let known = TABLE.iter().any(|info| info.byte == decoded.opcode);
        let result = check(20, &[byte, 0, 0, 0, 0, END, END]);
        if !known {
            assert_eq!(result, Err(ImageError::Instruction(0)), "{byte:#x}");
        } else {
            assert_ne!(result, Err(ImageError::Instruction(0)), "{byte:#x}");
        }
    }
}

#[test]
fn instructions_end_inside_their_function() {
    assert_eq!(check(1, &[END, INT]), Err(ImageError::Instruction(1)));
    assert_eq!(check(1, &[END, INT | WIDE, 0]), Err(ImageError::Instruction(1)));
    assert_eq!(check(1, &[END, FLOAT, 0]), Err(ImageError::Instruction(1)));
    assert_eq!(check(1, &[END, CALL_BUILTIN, 16]), Err(ImageError::Instruction(1)));
    assert_eq!(check(1, &[NIL]), Err(ImageError::NoReturn(1)));
}

#[test]
fn counts_the_operand_stack() {
    assert_eq!(check(1, &[POP, END]), Err(ImageError::Depth(0)));
    assert_eq!(check(1, &[NIL, ADD, END]), Err(ImageError::Depth(1)));
    assert_eq!(check(1, &[NIL, NIL, END]), Err(ImageError::Depth(1)));
    assert_eq!(check(2, &[NIL, NIL, POP_N, 3, END]), Err(ImageError::Depth(2)));
    assert_eq!(check(2, &[NIL, NIL, POP_N, 2, END]), Ok(()));
    assert_eq!(check(3, &[NIL, NIL, CALL, 2, END]), Err(ImageError::Depth(2)));
    assert_eq!(check(3, &[NIL, NIL, CALL, 1, END]), Ok(()));
    assert_eq!(check(3, &[NIL, CALL_METHOD, 0, END]), Err(ImageError::Depth(1)));
    assert_eq!(check(3, &[CALL_BUILTIN, builtin::SIZE, 1, END]), Err(ImageError::Depth(0)));
    // RETURN needs a value.
    assert_eq!(check(3, &[0xb8]), Err(ImageError::Depth(0)));
}

#[test]
fn hidden_locals_stay() {
    let with_self = |code: &[u8]| {
        check_with(0, &[END], |parts| {
            parts.functions.push([&[USES_SELF, 3], code].concat());
        })
    };
    assert_eq!(with_self(&[0x85, POP, END]), Ok(()), "reads self");
    assert!(matches!(with_self(&[POP, END]), Err(ImageError::Depth(_))), "pops self");
    assert!(matches!(with_self(&[NIL, LOCAL_SET, 1, END]), Err(ImageError::Operand(_))));
    assert!(matches!(with_self(&[LOCAL_ADD, 1, 1, END]), Err(ImageError::Operand(_))));
    assert_eq!(with_self(&[NIL, LOCAL_ADD, 2, 1, END]), Ok(()), "writes a variable");
}

#[test]
fn locals_are_parameters_or_on_the_stack() {
    let function =
        |code: &[u8]| check_with(0, &[END], |parts| parts.functions.push([&[2, 3], code].concat()));
    assert_eq!(function(&[0x82, 0x83, NIL, POP_N, 3, 0xbe]), Ok(()), "parameters -2, -1");
    assert!(matches!(function(&[0x81, 0xbe]), Err(ImageError::Operand(_))), "-3");
    assert!(matches!(function(&[0x84, 0xbe]), Err(ImageError::Operand(_))), "the record");
    assert!(matches!(function(&[0x85, 0xbe]), Err(ImageError::Operand(_))), "above the stack");
    assert!(matches!(function(&[NIL, LOCAL_SET, 1, 0xbe]), Err(ImageError::Operand(_))));
    assert_eq!(function(&[NIL, NIL, LOCAL_SET, 1, 0xbe]), Ok(()));
    assert!(matches!(function(&[LOCAL_ADD, 0, 1, 0xbe]), Err(ImageError::Operand(_))));
    assert!(matches!(function(&[0xbd]), Err(ImageError::Operand(_))), "RETURN_NIL 1 of 2");
}

#[test]
fn operands_exist() {
    assert_eq!(check(1, &[GLOBAL_GET, 2, END]), Err(ImageError::Operand(0)));
    assert_eq!(check(1, &[0xa2, END]), Err(ImageError::Operand(0)));
    assert_eq!(check(1, &[GLOBAL_GET, 0xff, END]), Err(ImageError::Operand(0)));
    assert_eq!(check(1, &[STRING, 11, END]), Ok(()));
    assert_eq!(check(1, &[STRING, 12, END]), Err(ImageError::Operand(0)));
    assert_eq!(check(1, &[FUNCTION, 1, END]), Err(ImageError::Operand(0)));
    assert_eq!(check(1, &[CALL_FUNCTION, 1, END]), Err(ImageError::Operand(0)));
    assert_eq!(check(1, &[BUILTIN, builtin::SIZE, END]), Ok(()));
    assert_eq!(check(1, &[BUILTIN, builtin::PI, END]), Err(ImageError::Operand(0)));
    assert_eq!(check(1, &[BUILTIN, builtin::SWARM_ID, END]), Err(ImageError::Operand(0)));
    assert_eq!(check(1, &[ROBOT, 0, END]), Err(ImageError::Operand(0)));
    assert_eq!(check_with(1, &[ROBOT, 0, END], |p| p.imports = vec![7]), Ok(()));
    assert_eq!(check(1, &[LIBRARY, 11, END]), Err(ImageError::Operand(0)));
    assert_eq!(check(1, &[CAPTURE_GET, 0, END]), Err(ImageError::Operand(0)));
    // A result can be dropped only where the built-in gives it at once.
    let drop = |number| check(2, &[NIL, NIL, CALL_BUILTIN, number, 2 | DROP_RESULT, END]);
    assert_eq!(drop(builtin::ASSERT), Ok(()));
    assert_eq!(drop(builtin::FOREACH), Err(ImageError::Operand(2)));
}

#[test]
fn closures_and_plain_functions_are_not_mixed_up() {
    let program = |flags: u8, code: &[u8]| {
        check_with(3, &[code, &[END]].concat(), |parts| {
            parts.functions.push(vec![flags, 2, END]);
        })
    };
    assert_eq!(program(CAPTURES, &[NIL, CLOSURE, 1, 1, POP]), Ok(()));
    assert_eq!(program(USES_SELF, &[NIL, CLOSURE, 1, 1, POP]), Ok(()));
    assert_eq!(program(USES_SELF, &[FUNCTION, 1, POP]), Ok(()));
    assert_eq!(program(0, &[NIL, CLOSURE, 1, 1, POP]), Err(ImageError::Operand(1)));
    assert_eq!(program(CAPTURES, &[CLOSURE, 1, 0, POP]), Err(ImageError::Operand(0)));
    assert_eq!(program(CAPTURES, &[FUNCTION, 1, POP]), Err(ImageError::Operand(0)));
    assert_eq!(program(CAPTURES, &[CALL_FUNCTION, 1, POP]), Err(ImageError::Operand(0)));
}

#[test]
fn forward_jumps_meet_at_one_depth() {
    assert_eq!(check(2, &[NIL, JUMP_FALSE, 1, END, END]), Ok(()));
    // One way brings a value, the other none.
    assert_eq!(check(2, &[NIL, JUMP_FALSE, 1, NIL, END]), Err(ImageError::Depth(4)));
    // Into the middle of an instruction, to the end, after the end.
    assert!(matches!(check(2, &[NIL, JUMP_FALSE, 1, INT, 5, POP, END]), Err(ImageError::Jump(_))));
    assert_eq!(check(2, &[NIL, JUMP_FALSE, 1, END]), Err(ImageError::Jump(1)));
    assert_eq!(check(2, &[NIL, JUMP_FALSE, 100, END]), Err(ImageError::Jump(1)));
    // A truth value is kept at the target.
    assert_eq!(check(2, &[NIL, AND, 2, NIL, TRUTH, POP, END]), Ok(()));
    assert_eq!(check(2, &[NIL, AND, 1, NIL, END]), Ok(()));
    assert_eq!(check(2, &[NIL, AND, 0, END]), Err(ImageError::Depth(3)));
}

#[test]
fn backward_jumps_lead_to_the_place_after_a_jump() {
    // JUMP to the condition, body, condition, jump back to the body.
    assert_eq!(check(2, &[JUMP, 2, NIL, POP, NIL, JUMP_TRUE, 0xfb, END]), Ok(()));
    // To the JUMP itself, to the middle of the body.
    assert_eq!(check(2, &[JUMP, 2, NIL, POP, NIL, JUMP_TRUE, 0xf9, END]), Err(ImageError::Jump(5)));
    assert_eq!(check(2, &[JUMP, 2, NIL, POP, NIL, JUMP_TRUE, 0xfc, END]), Err(ImageError::Jump(5)));
    // With another depth than at the JUMP.
    assert_eq!(
        check(3, &[JUMP, 2, NIL, POP, NIL, NIL, JUMP_TRUE, 0xfa, END]),
        Err(ImageError::Jump(6))
    );
    // A value loop is forward only.
    assert_eq!(check(2, &[JUMP, 0, NIL, AND, 0xfd, END]), Err(ImageError::Jump(3)));
}

#[test]
fn a_jump_target_after_a_jump_has_the_depth_of_the_forward_jump() {
    // The place after the JUMP is reached by a forward jump at depth 1 only; the code there pops. A backward jump
    // to it at depth 0, the depth of the JUMP, must be refused.
    let code = [
        NIL, NIL, JUMP_FALSE, 3, // 0: depth 1 goes to 7
        POP, JUMP, 3, // 4: depth 0, to 10
        POP, JUMP, 0, // 7: expects depth 1
        NIL, JUMP_TRUE, 0xfa, // 10: depth 0, back to 7
        END,
    ];
    assert_eq!(check(2, &code), Err(ImageError::Jump(11)));
}

#[test]
fn the_verifier_uses_the_arena_as_memory() {
    // More pending jumps than the arena has slots.
    let jumps: Vec<u8> = (0..70).flat_map(|_| [NIL, JUMP_FALSE | WIDE, 250, 0]).collect();
    let code = [&jumps[..], &[NIL, POP].repeat(200), &[END]].concat();
    assert!(matches!(check(2, &code), Err(ImageError::TooManyJumps(_) | ImageError::Jump(_))));
}

#[test]
fn strings_made_at_run_time_need_the_full_profile() {
    let mut parts =
        ImageParts::new(&[&[0, 1, STRING, 3, CALL_BUILTIN, builtin::LENGTH, 1, POP, END]]);
    assert_eq!(
        load(&parts.build()),
        Err(ImageError::Operand(parts.build().len() as u16 - 5)),
        "in code"
    );
    parts.features = 1 << 1;
    assert_eq!(load(&parts.build()), Err(ImageError::Features(2)), "in the header");
    parts.form |= FORM_FULL;
    let mut vm: Vm<Full, &[u8], 64> = Vm::new();
    assert_eq!(vm.load(Image::new(&parts.build()), |_| false), Ok(()));
}
