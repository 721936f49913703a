//! A run does not change if the whole state of the machine is inspected before each instruction.

use std::fs;
use std::path::Path;

use bittybuzz_inspect::{Inspection, Limits, Object, ScriptValue, inspect};
use bittybuzz_robot_spec::NumberProfile as ProfileName;
use bittybuzz_testkit::profiles::{Full, Tiny};
use bittybuzz_testkit::{Program, Recorder};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{Entry, Image, Outcome, Sighting, Sizes, Value, Vm};

const SLOTS: usize = 4000;
const SIZES: Sizes = Sizes { neighbors: 5, bearings: true, entries: 8, swarms: 8 };
/// The number of instructions after which an entry is stopped.
const INSTRUCTIONS_MAX: usize = 50_000;

/// The record of a run: outcomes, events, and the state of the machine at the end.
fn run<P: Profile>(path: &str, script: &str, limits: Option<Limits>) -> Option<String> {
    let profile = if P::FULL { ProfileName::Full } else { ProfileName::Tiny };
    let compiled = Program::compile(script, &Program::options(profile));
    // Some scripts contain errors on purpose.
    let (image, symbols) = (compiled.image?, compiled.symbols?);
    let mut vm: Box<Vm<P, &[u8], SLOTS>> = Box::new(Vm::new());
    vm.set_network_capacity(SIZES);
    vm.load(Image::new(&image), |_| true).expect("it is sound");
    vm.set_robot_id(1, 7);
    let mut host = Recorder::default();
    let mut output = String::new();
    for entry in [Entry::Global, Entry::Init, Entry::Step, Entry::Step, Entry::Destroy] {
        let place = Some([10.0, 0.5, 0.0].map(Value::float));
        vm.add_neighbor(2, &Sighting { robot: None, place }, 100);
        if !vm.begin(entry) {
            continue;
        }
        for _ in 0..INSTRUCTIONS_MAX {
            if let Some(limits) = limits {
                let found = inspect(&vm, Some(&symbols), limits);
                assert_eq!(found.frames.len(), vm.frames().count(), "{path}");
                check(&found, limits);
            }
            let outcome = vm.run(&mut host, 1);
            if !matches!(outcome, Outcome::Pending | Outcome::Waiting) {
                output += &format!("{entry:?}: {outcome:?}\n");
                break;
            }
        }
    }
    // The tree is the same with and without symbols, except for operands of running functions,
    // which have no names.
    let [named, numbered] = [Some(&symbols), None].map(|names| inspect(&vm, names, Limits::NONE));
    if named.frames.is_empty() {
        assert_eq!(named.objects.len(), numbered.objects.len(), "{path}");
    }
    Some(format!("{output}{:?}\n{named:?}", host.events))
}

/// The tree contains every object within the depth limit.
fn check(found: &Inspection, limits: Limits) {
    let locals = found.frames.iter().flat_map(|frame| &frame.locals);
    for root in found.globals.iter().chain(locals) {
        if let ScriptValue::Table(id) | ScriptValue::Closure(id) = root.value {
            assert!(found.objects.contains_key(&id), "{} leads nowhere", root.name);
        }
    }
    let size = |object: &Object| match object {
        Object::Table { entries, .. } => entries.len(),
        Object::Closure { captures, .. } => captures.len(),
        Object::Bound { .. } => 0,
    };
    assert!(found.objects.values().map(size).sum::<usize>() <= limits.values);
}

fn conformance<P: Profile>() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/conformance");
    let limits = Limits { depth: 3, values: 100 };
    let mut count = 0;
    for file in fs::read_dir(folder).expect("is there") {
        let path = file.expect("can be read").path();
        if path.extension().is_none_or(|extension| extension != "bzz") {
            continue;
        }
        let (name, script) = (path.display().to_string(), fs::read_to_string(&path));
        let script = script.expect("is text");
        let plain = run::<P>(&name, &script, None);
        assert_eq!(plain, run::<P>(&name, &script, Some(limits)), "{name}");
        count += usize::from(plain.is_some());
    }
    assert!(count >= 44, "{count} scripts");
}

#[test]
fn inspection_does_not_change_tiny_machines() {
    conformance::<Tiny>();
}

#[test]
fn inspection_does_not_change_full_machines() {
    conformance::<Full>();
}
