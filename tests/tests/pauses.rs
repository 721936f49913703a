//! Machines with much memory collect in slices: a run never takes more steps of the collector than its budget, however
//! full the memory is, and nothing that a script or a host does in between disturbs the collection.

use std::collections::BTreeSet;

use bittybuzz_testkit::{Program, Recorder};
use bittybuzz_vm_core::message::Message;
use bittybuzz_vm_core::number::Full;
use bittybuzz_vm_core::{Entry, Image, Outcome, Torture, Value, Vm};

const SLOTS: usize = 4096;
/// Instructions and steps of a slice.
const BUDGET: u16 = 50;

type Machine<'i> = Vm<Full, &'i [u8], SLOTS>;

/// Scripts that keep most of the memory of 4096 slots and make garbage in the rest.
const SCRIPTS: [(&str, &str); 7] = [
    (
        "a list",
        "head = nil
        function init() { for(i = 0, i < 500, i = i + 1) head = { .n = i, .next = head } }
        function step() { for(i = 0, i < 100, i = i + 1) t = { .x = i, .y = { .z = i } } }",
    ),
    (
        "a wide table",
        "keep = {}
        function init() { for(i = 0, i < 440, i = i + 1) keep[i] = { .a = i, .b = i } }
        function step() { for(i = 0, i < 100, i = i + 1) t = { .x = i } }",
    ),
    (
        "texts of 255 characters",
        "keep = {}
        a = \"0123456789\"
        function init() {
          a = string.concat(a, a, a, a, a)
          a = string.concat(a, a, a, a, a, \"01234\")
          for(i = 0, i < 30, i = i + 1) keep[i] = string.concat(a, \"\")
        }
        function step() { for(i = 0, i < 40, i = i + 1) { x = string.concat(\"\", a)  y = string.sub(x, 1, 250) } }",
    ),
    // Each takes more cells than a collection leaves for an instruction.
    (
        "texts of 994 characters",
        "keep = {}
        a = \"0123456789\"
        function init() {
          a = string.concat(a, a, a, a, a)
          a = string.concat(a, a, a, a, a, \"01234\")
          b = string.sub(a, 0, 229)
          for(i = 0, i < 340, i = i + 1) keep[i] = { .a = i, .b = i }
        }
        function step() { for(i = 0, i < 40, i = i + 1) x = string.concat(a, a, a, b) }",
    ),
    (
        "calls",
        "keep = {}
        function init() { for(i = 0, i < 400, i = i + 1) keep[i] = { .a = i, .b = i } }
        function deep(n) { var t = { .n = n } if(n > 0) { var u = deep(n - 1) return u } return t }
        function step() { for(i = 0, i < 20, i = i + 1) { deep(20) f = function(x) { return i + x } f(1) } }",
    ),
    (
        "iterations",
        "keep = {}
        function init() { for(i = 0, i < 150, i = i + 1) keep[0 - i] = { .a = i, .get = function() { return self } } }
        function step() { foreach(keep, function(k, v) { t = { .k = v.get } }) map(keep, function(k, v) { return k }) }",
    ),
    (
        "entries",
        "a = {}
        function init() {
          s = stigmergy.create(1)
          for(i = 0, i < 30, i = i + 1) a[i] = 300 + i
          for(i = 0, i < 60, i = i + 1) s.put(i, a)
        }
        function step() { for(i = 0, i < 30, i = i + 1) { a[0] = i  s.put(i, a)  t = s.get(1) } }",
    ),
];

fn machine(program: &Program) -> Box<Machine<'_>> {
    let mut vm: Box<Machine<'_>> = Box::new(Vm::new());
    vm.torture = Torture { pauses_collections: true, ..Torture::default() };
    vm.set_network_capacity(bittybuzz_vm_core::Sizes {
        entries: 60,
        ..bittybuzz_vm_core::Sizes::NONE
    });
    vm.load(Image::new(program.image.as_slice()), |_| true).expect("the image is sound");
    vm.set_robot_id(1, 7);
    vm
}

/// Runs an entry to its end and calls `between` after each slice.
fn run<'i>(
    vm: &mut Box<Machine<'i>>,
    entry: Entry,
    mut between: impl FnMut(&mut Box<Machine<'i>>),
) {
    let mut host = Recorder::default();
    if !vm.begin(entry) {
        return;
    }
    loop {
        let outcome = vm.run(&mut host, BUDGET);
        between(vm);
        match outcome {
            Outcome::Pending => {}
            Outcome::Done => return,
            other => panic!("{entry:?}: {other:?}"),
        }
    }
}

const ENTRIES: [Entry; 5] = [Entry::Global, Entry::Init, Entry::Step, Entry::Step, Entry::Step];

#[test]
fn no_run_takes_more_steps_than_its_budget() {
    for (name, script) in SCRIPTS {
        let program = Program::new::<Full>(script);
        let mut vm = machine(&program);
        let (mut before, mut most) = (0, 0);
        for entry in ENTRIES {
            run(&mut vm, entry, |vm| {
                most = most.max(vm.collector_steps() - before);
                before = vm.collector_steps();
            });
        }
        assert!(before > 5000, "{name}: {before} steps are few collections");
        assert!(most <= u64::from(BUDGET), "{name}: {most} steps in a slice");
    }
}

/// What a host may do between two slices.
#[test]
fn hosts_may_act_in_a_pause() {
    for (name, script) in SCRIPTS {
        let program = Program::new::<Full>(script);
        let number = program
            .symbols
            .globals
            .iter()
            .position(|global| global == "i")
            .expect("every script has it");
        let mut vm = machine(&program);
        let mut slices = 0;
        for entry in ENTRIES {
            run(&mut vm, entry, |vm| {
                slices += 1;
                // Each of these is done at some of the pauses, in copies that then go on.
                if slices % 13 != 0 {
                    return;
                }
                let mut restarted = vm.clone();
                restarted.restart();
                assert_eq!(restarted.audit(), Ok(()), "{name}: restart");
                for entry in [Entry::Global, Entry::Init] {
                    run(&mut restarted, entry, |_| {});
                }
                assert_eq!(restarted.audit(), Ok(()), "{name}: a run after a restart");
                let mut changed = vm.clone();
                assert!(changed.set_global(number as u16, Value::int(0)));
                assert_eq!(changed.audit(), Ok(()), "{name}: a global that is set");
                let mut loaded = vm.clone();
                loaded
                    .load(Image::new(program.image.as_slice()), |_| true)
                    .expect("the image is sound");
                run(&mut loaded, Entry::Global, |_| {});
                assert_eq!(loaded.audit(), Ok(()), "{name}: another image");
            });
        }
        assert_eq!(vm.audit(), Ok(()), "{name}");
        assert!(slices > 100, "{name}: {slices}");
    }
}

/// Changes are sent one in a slice after an entry point. A restart there leaves the rest to be sent later.
#[test]
fn a_restart_between_two_changes_loses_none() {
    let program = Program::new::<Full>(
        "function init() {
          s = stigmergy.create(1)
          if(s.size() < 4) for(i = 0, i < 4, i = i + 1) s.put(i, i)
        }",
    );
    // The keys of the entries that are sent if the script restarts after that number of slices.
    let keys = |restart_after: usize| {
        let mut vm = machine(&program);
        let mut host = Recorder::default();
        let (mut slices, mut restarted) = (0, false);
        let mut entries = [Entry::Global, Entry::Init].into_iter();
        while let Some(entry) = entries.next() {
            assert!(vm.begin(entry));
            loop {
                let outcome = vm.run(&mut host, BUDGET);
                slices += 1;
                if slices > restart_after && !restarted {
                    restarted = true;
                    vm.restart();
                    entries = [Entry::Global, Entry::Init].into_iter();
                    break;
                }
                match outcome {
                    Outcome::Pending => {}
                    Outcome::Done => break,
                    other => panic!("{entry:?}: {other:?}"),
                }
            }
        }
        let script = vm.message_script().expect("an image is loaded");
        let sent = std::iter::from_fn(|| host.link.pop_sent());
        let keys: BTreeSet<i32> = sent
            .filter_map(|frame| match Message::<Full>::decode(&frame, script) {
                Ok(Message::Entry(entry)) => entry.key.as_int(),
                _ => None,
            })
            .collect();
        (keys, slices)
    };
    let (all, slices) = keys(usize::MAX);
    assert_eq!(all, BTreeSet::from([0, 1, 2, 3]));
    assert!(slices > 6, "{slices}");
    for after in 0..slices {
        assert_eq!(keys(after).0, all, "a restart after {after} slices");
    }
}
