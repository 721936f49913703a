//! The protocol between host and machine: entries, budgets, waiting, faults.

use bittybuzz_testkit::{Answer, ImageParts, Recorder};
use bittybuzz_vm_core::image::EntryPoint;
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::opcode::*;
use bittybuzz_vm_core::{
    Entry, Fault, FaultCode, Image, Outcome, Refusal, RobotFault, Type, Value, Vm, builtin,
};

type Machine<'a> = Vm<Tiny, &'a [u8], 120>;

const END: u8 = 0xbc; // RETURN_NIL 0

fn load(bytes: &[u8]) -> Machine<'_> {
    let mut vm = Vm::new();
    vm.set_robot_id(5, 0);
    vm.load(Image::new(bytes), |hash| hash <= 9).expect("the image is sound");
    vm
}

/// A robot whose function 7 is finished when the machine has asked twice more, and which has no function 9.
fn recorder() -> Recorder {
    Recorder::answering(|call| match call.function {
        7 if call.polls < 2 => Answer::Wait,
        7 => Answer::Int(70),
        9 => Answer::Fault(RobotFault::Refused(Refusal::NotBuiltIn)),
        other => Answer::Int(other.into()),
    })
}

/// Runs an entry to its end with this budget for each run; counts the runs.
fn finish(vm: &mut Machine<'_>, host: &mut Recorder, entry: Entry, budget: u16) -> (Outcome, u32) {
    assert!(vm.begin(entry), "{entry:?}");
    for runs in 1..10_000 {
        match vm.run(host, budget) {
            Outcome::Pending | Outcome::Waiting => {}
            outcome => return (outcome, runs),
        }
    }
    panic!("no end");
}

/// Global code that counts global 0 down from 5 and logs it each time.
fn countdown() -> Vec<u8> {
    let body = [0xa0, CALL_BUILTIN, builtin::LOG, 1 | DROP_RESULT, 0xa0, ADD_INT, 0xff, 0xb0];
    let loop_length = body.len() as u8;
    let code = [
        &[0, 2, 0x96, 0xb0, JUMP, loop_length][..],
        &body,
        &[0xa0, JUMP_TRUE, (loop_length + 3).wrapping_neg(), END],
    ];
    ImageParts::new(&[&code.concat()]).build()
}

#[test]
fn every_budget_gives_the_same_run() {
    let image = countdown();
    for budget in [1, 2, 3, 7, 1000, u16::MAX] {
        let mut vm = load(&image);
        let mut host = recorder();
        let (outcome, runs) = finish(&mut vm, &mut host, Entry::Global, budget);
        assert_eq!(outcome, Outcome::Done);
        assert_eq!(host.lines(), ["5", "4", "3", "2", "1"], "budget {budget}");
        assert_eq!(vm.global(0).and_then(|value| value.as_int()), Some(0));
        // 3 instructions to begin, 5 turns of 5 and the condition, and the return.
        if budget == 1 {
            assert!((35..45).contains(&runs), "{runs} runs");
        }
    }
}

#[test]
fn a_budget_of_zero_executes_nothing() {
    let image = countdown();
    let mut vm = load(&image);
    let mut host = recorder();
    assert!(vm.begin(Entry::Global));
    for _ in 0..10 {
        assert_eq!(vm.run(&mut host, 0), Outcome::Pending);
    }
    assert!(host.events.is_empty());
    assert_eq!(vm.run(&mut host, 1000), Outcome::Done);
}

#[test]
fn entries_start_only_if_they_exist_and_the_machine_is_idle() {
    let mut parts = ImageParts::new(&[&[0, 1, END], &[0, 1, 0x98, 0xb0, END]]);
    parts.entries[1] = EntryPoint::Function(1);
    parts.entries[2] = EntryPoint::Global(1);
    let image = parts.build();
    let mut vm: Machine<'_> = Vm::new();
    let mut host = recorder();
    assert!(!vm.begin(Entry::Global), "no program");
    assert_eq!(vm.run(&mut host, 10), Outcome::Done);
    vm.load(Image::new(&image), |_| false).unwrap();
    assert!(!vm.begin(Entry::Init), "the script has no init");
    assert!(!vm.begin(Entry::Reset), "global 1 is nil");
    assert!(vm.begin(Entry::Step));
    assert!(!vm.begin(Entry::Step), "it runs already");
    assert_eq!(vm.run(&mut host, 10), Outcome::Done);
    assert_eq!(vm.global(0).and_then(|value| value.as_int()), Some(7));
    assert!(vm.begin(Entry::Step), "again");
    assert!(vm.global(2).is_none());
    // A program that is refused leaves none.
    assert!(vm.load(Image::new(&[1, 2, 3]), |_| false).is_err());
    assert!(!vm.begin(Entry::Global));
}

#[test]
fn the_host_sets_globals_to_numbers_alone() {
    // Global code puts function 1 into global 1; `step` logs global 0.
    let mut parts = ImageParts::new(&[
        &[0, 1, FUNCTION, 1, 0xb1, END],
        &[0, 1, 0xa0, CALL_BUILTIN, builtin::LOG, 0x81, END],
    ]);
    parts.entries[1] = EntryPoint::Global(1);
    let image = parts.build();
    let mut vm = load(&image);
    let mut host = recorder();
    assert_eq!(finish(&mut vm, &mut host, Entry::Global, 100).0, Outcome::Done);
    for value in [Value::int(-3), Value::float(1.5)] {
        assert!(vm.set_global(0, value));
        assert_eq!(finish(&mut vm, &mut host, Entry::Step, 100).0, Outcome::Done);
    }
    assert_eq!(host.lines(), ["-3", "1.5"]);
    let function = vm.global(1).expect("there is one");
    assert!(!vm.set_global(0, function) && !vm.set_global(0, Value::nil()));
    assert_eq!(vm.global(0).and_then(Value::as_f32), Some(1.5));
    assert!(!vm.set_global(2, Value::int(1)), "there are two globals");
    assert!(!Machine::new().set_global(0, Value::int(1)), "there is no program");
}

#[test]
fn an_entry_in_a_global_may_change() {
    // Global code puts function 1 into global 1, which is `step`; function 1 puts function 2 there.
    let mut parts = ImageParts::new(&[
        &[0, 1, FUNCTION, 1, 0xb1, END],
        &[0, 2, 0x92, CALL_BUILTIN, builtin::LOG, 0x81, FUNCTION, 2, 0xb1, END],
        &[0, 1, 0x93, CALL_BUILTIN, builtin::LOG, 0x81, END],
    ]);
    parts.entries[1] = EntryPoint::Global(1);
    let image = parts.build();
    let mut vm = load(&image);
    let mut host = recorder();
    for entry in [Entry::Global, Entry::Step, Entry::Step, Entry::Step] {
        assert_eq!(finish(&mut vm, &mut host, entry, 100).0, Outcome::Done);
    }
    assert_eq!(host.lines(), ["1", "2", "2"]);
}

#[test]
fn a_robot_function_may_finish_later() {
    // log(robot7(1, 2)), then a call that drops its result.
    let mut parts = ImageParts::new(&[&[
        0,
        4,
        0x92,
        0x93,
        CALL_ROBOT,
        0,
        2,
        CALL_BUILTIN,
        builtin::LOG,
        0x81,
        0x99,
        CALL_ROBOT,
        1,
        0x81,
        END,
    ]]);
    parts.imports = vec![7, 3];
    let image = parts.build();
    for budget in [1, 100] {
        let mut vm = load(&image);
        let mut host = recorder();
        assert!(vm.begin(Entry::Global));
        let mut waited = 0;
        loop {
            match vm.run(&mut host, budget) {
                Outcome::Waiting => waited += 1,
                Outcome::Pending => {}
                outcome => break assert_eq!(outcome, Outcome::Done),
            }
        }
        // Asked at once, again before the first run ends, and in the second run.
        assert_eq!((waited, host.asked_again), (1, 2), "budget {budget}");
        assert_eq!(host.lines(), ["7(1, 2)", "70", "3(8)"]);
    }
}

#[test]
fn delay_waits_without_using_the_budget() {
    let image =
        ImageParts::new(&[&[0, 2, INT, 100, CALL_BUILTIN, builtin::DELAY, 1, POP, END]]).build();
    let mut vm = load(&image);
    let mut host = recorder();
    assert!(vm.begin(Entry::Global));
    assert_eq!(vm.run(&mut host, 1000), Outcome::Waiting);
    assert_eq!(vm.run(&mut host, 1000), Outcome::Done);
}

#[test]
fn a_fault_names_cause_operands_position_and_calls() {
    // Global code calls function 1, which calls function 2, which adds nil to its argument.
    let image = ImageParts::new(&[
        &[0, 2, 0x92, CALL_FUNCTION, 1, POP, END],
        &[1, 2, 0x83, CALL_FUNCTION, 2, 0xb9],
        &[1, 2, 0x83, NIL, ADD, 0xb9],
    ])
    .build();
    let mut vm = load(&image);
    let mut host = recorder();
    let (outcome, _) = finish(&mut vm, &mut host, Entry::Global, 100);
    let fault = Fault {
        code: FaultCode::WrongType,
        position: 7 + 6 + 4,
        operands: [Type::Int, Type::Nil],
        detail: 0,
    };
    assert_eq!(outcome, Outcome::Fault(fault));
    assert_eq!(vm.calls().collect::<Vec<_>>(), [17, 7 + 4, 4]);
    // It stays stopped, until it is loaded again.
    assert_eq!(vm.run(&mut host, 100), Outcome::Fault(fault));
    assert!(!vm.begin(Entry::Global));
    vm.load(Image::new(&image), |_| false).unwrap();
    assert!(vm.begin(Entry::Global));
}

#[test]
fn nothing_is_called_when_an_entry_is_done() {
    let image = ImageParts::new(&[&[0, 1, END]]).build();
    let mut vm = load(&image);
    let (outcome, _) = finish(&mut vm, &mut recorder(), Entry::Global, 100);
    assert_eq!(outcome, Outcome::Done);
    assert_eq!(vm.calls().next(), None);
}

#[test]
fn the_calls_of_a_fault_pass_over_built_ins() {
    // foreach({.0 = 1}, f), f divides by zero.
    let image = ImageParts::new(&[
        &[
            0,
            4,
            TABLE_NEW,
            0x91,
            0x92,
            INDEX_INIT,
            FUNCTION,
            1,
            CALL_BUILTIN,
            builtin::FOREACH,
            2,
            POP,
            END,
        ],
        &[2, 2, 0x83, 0x91, DIV, 0xba],
    ])
    .build();
    let mut vm = load(&image);
    let (outcome, _) = finish(&mut vm, &mut recorder(), Entry::Global, 100);
    let Outcome::Fault(fault) = outcome else { panic!("{outcome:?}") };
    assert_eq!((fault.code, fault.position), (FaultCode::DivisionByZero, 13 + 4));
    assert_eq!(vm.calls().collect::<Vec<_>>(), [17, 10]);
}

#[test]
fn a_robot_function_may_refuse() {
    let mut parts = ImageParts::new(&[&[0, 1, CALL_ROBOT, 0, 0, POP, END]]);
    parts.imports = vec![9];
    let image = parts.build();
    let mut vm = load(&image);
    let (outcome, _) = finish(&mut vm, &mut recorder(), Entry::Global, 100);
    let Outcome::Fault(fault) = outcome else { panic!("{outcome:?}") };
    assert_eq!((fault.code, fault.detail, fault.position), (FaultCode::RobotRefused, 3, 4));
}

#[test]
fn recursion_stops_at_the_heap() {
    // f calls itself for ever.
    let image =
        ImageParts::new(&[&[0, 1, CALL_FUNCTION, 1, POP, END], &[0, 1, CALL_FUNCTION, 1, 0xb8]]);
    let image = image.build();
    let mut vm = load(&image);
    let (outcome, _) = finish(&mut vm, &mut recorder(), Entry::Global, 7);
    let Outcome::Fault(fault) = outcome else { panic!("{outcome:?}") };
    assert_eq!(fault.code, FaultCode::StackOverflow);
}

#[test]
fn the_stack_reuses_freed_heap() {
    // Makes garbage until the heap reaches the stack, then calls 8 deep: the frames need the room of the garbage.
    let image = ImageParts::new(&[
        &[0, 2, TABLE_NEW, POP, 0x99, CALL_FUNCTION, 1, POP, END],
        // d(n): if n is 0 return 0, else return d(n - 1)
        &[1, 12, 0x83, JUMP_TRUE, 2, 0x91, 0xb9, 0x83, ADD_INT, 0xff, CALL_FUNCTION, 1, 0xb9],
    ])
    .build();
    let mut vm = load(&image);
    for _ in 0..20 {
        let (outcome, _) = finish(&mut vm, &mut recorder(), Entry::Global, 100);
        assert_eq!(outcome, Outcome::Done);
    }
}
