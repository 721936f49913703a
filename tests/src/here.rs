//! A script in this process, as [`crate::buzz`] runs it with Buzz: its global code only.

use std::rc::Rc;

use bittybuzz_compiler::diagnostic::Severity;
use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_testkit::{Event, RecordedArgument, Recorder, SIZES};
use bittybuzz_vm_core::image::Image;
use bittybuzz_vm_core::number::{Full, format_float};
use bittybuzz_vm_core::{Entry, Outcome, Vm};

use crate::compatibility::End;
use crate::compiler;

/// More slots than a script of the tests fills.
const SLOTS: usize = 60_000;

/// Compiles and runs a script for profile `full`. Returns all that it printed, and its end.
///
/// # Panics
/// If the machine refuses the image.
pub fn run(script: &str) -> (String, End) {
    let compiled = compiler::compile(script.to_owned(), true, &MemoryFiles::default());
    let Some(image) = compiled.image else {
        let mut errors = compiled.diagnostics.iter().filter(|it| it.severity() == Severity::Error);
        let code = errors.next().map(|error| error.code.text().to_owned()).unwrap_or_default();
        return (String::new(), End::Refuses(code));
    };
    let mut vm: Box<Vm<Full, &[u8], SLOTS>> = Box::new(Vm::new());
    vm.set_network_capacity(SIZES);
    vm.load(Image::new(&image), |_| false).expect("the compiler's images load");
    let mut recorder = Recorder { symbols: compiled.symbols.map(Rc::new), ..Recorder::default() };
    vm.begin(Entry::Global);
    let fault = loop {
        match vm.run(&mut recorder, u16::MAX) {
            Outcome::Done => break None,
            Outcome::Fault(fault) => break Some(fault),
            Outcome::Pending | Outcome::Waiting => {}
        }
    };
    let output = output(&recorder).trim_end().to_owned();
    let end = match fault {
        Some(fault) => End::Stops(format!("R{:04}", fault.code as u8)),
        None => End::Prints(output.clone()),
    };
    (output, end)
}

fn output(recorder: &Recorder) -> String {
    let mut output = String::new();
    for event in &recorder.events {
        let Event::Log(items) = event else { continue };
        for item in items {
            match item {
                // As `log` of `bbz run` writes floats.
                RecordedArgument::Float(value) => {
                    format_float(*value, &mut |byte| output.push(byte.into()));
                }
                other => output.push_str(&recorder.show(other)),
            }
        }
        output.push('\n');
    }
    output
}
