//! Garbage must not drive the heap down to where calls need room.

use bittybuzz_testkit::{ImageParts, Recorder};
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::opcode::*;
use bittybuzz_vm_core::{Entry, Image, Outcome, Vm, builtin};

const END: u8 = 0xbc; // RETURN_NIL 0

/// Makes 40 tables of garbage, keeps the last one in global 0, then calls 50 deep. Two thirds of the memory are free all the
/// time, but cells never move: a table that lives on at the lower end of a heap full of garbage would block the calls.
#[test]
fn a_survivor_of_a_collection_does_not_block_calls() {
    let garbage = [INT, 40, JUMP, 4, TABLE_NEW, 0xb0, ADD_INT, 0xff, DUP, JUMP_TRUE, 0xf9, POP];
    let deep = [INT, 50, CALL_FUNCTION, 1, CALL_BUILTIN, builtin::LOG, 0x81, END];
    let image = ImageParts::new(&[
        &[&[0, 3][..], &garbage, &deep].concat(),
        // d(n): if n is 0 return 0, else return 1 + d(n - 1)
        &[
            1,
            3,
            0x83,
            JUMP_TRUE,
            2,
            0x91,
            0xb9,
            0x92,
            0x83,
            ADD_INT,
            0xff,
            CALL_FUNCTION,
            1,
            ADD,
            0xb9,
        ],
    ])
    .build();
    let mut vm: Vm<Tiny, &[u8], 300> = Vm::new();
    vm.load(Image::new(&image), |_| false).expect("the image is sound");
    let mut host = Recorder::default();
    assert!(vm.begin(Entry::Global));
    assert_eq!(vm.run(&mut host, u16::MAX), Outcome::Done);
    assert_eq!(host.lines(), ["50"]);
}
