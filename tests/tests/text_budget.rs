//! What is done with text takes time, and so counts as instructions: however a built-in is called, and only for the script
//! that calls it.

use bittybuzz_testkit::{Program, Recorder};
use bittybuzz_vm_core::number::Full;
use bittybuzz_vm_core::{Entry, Image, Outcome, Vm};

type Machine<'i> = Vm<Full, &'i [u8], 1000>;

fn image(script: &str) -> Vec<u8> {
    Program::new::<Full>(script).image
}

/// Slices of the global code, and how they end.
fn slices(vm: &mut Machine<'_>, budget: u16) -> (u32, Outcome) {
    assert!(vm.begin(Entry::Global));
    let (mut host, mut slices) = (Recorder::default(), 0);
    loop {
        slices += 1;
        match vm.run(&mut host, budget) {
            Outcome::Pending => {}
            end => return (slices, end),
        }
    }
}

/// Makes a text of a hundred bytes fifty times, by this code.
fn script(call: &str) -> String {
    let text = "0123456789".repeat(5);
    format!(
        "f = string.concat\na = \"{text}\"\nt = {{}}\nt[a] = a\nfor(i = 0, i < 50, i = i + 1) {{ {call} }}"
    )
}

/// Two instructions for each of 5000 bytes, and some around them.
const SLICES: std::ops::Range<u32> = 11..13;

#[test]
fn every_form_of_a_built_in_call_has_the_same_cost() {
    for call in ["string.concat(a, a)", "f(a, a)", "foreach(t, f)"] {
        let image = image(&script(call));
        let mut vm = Machine::new();
        vm.load(Image::new(&image), |_| true).expect("it is sound");
        let (slices, end) = slices(&mut vm, 1000);
        assert_eq!(end, Outcome::Done);
        assert!(SLICES.contains(&slices), "{call}: {slices}");
    }
}

#[test]
fn a_script_does_not_inherit_the_cost_of_the_previous_one() {
    // Faults in the middle of a text.
    let before = image("a = \"0123456789\"\nwhile(1) a = string.concat(a, a)");
    let after = image(&script("string.concat(a, a)"));
    let mut vm = Machine::new();
    vm.load(Image::new(&after), |_| true).expect("it is sound");
    let alone = slices(&mut vm, 1000);
    vm.load(Image::new(&before), |_| true).expect("it is sound");
    assert!(matches!(slices(&mut vm, 1000).1, Outcome::Fault(_)));
    vm.load(Image::new(&after), |_| true).expect("it is sound");
    assert_eq!(slices(&mut vm, 1000), alone);
}
