//! Describes the memory of a machine that ran out of it.

use bittybuzz_inspect::ScriptMemory;

use crate::program::KnownProgram;

/// The most globals that are named, those that hold most slots first.
const NAMED: usize = 3;

/// Describes the memory in one sentence.
pub fn text(memory: &ScriptMemory, program: KnownProgram<'_>) -> String {
    let ScriptMemory { slots, stack, heap, held } = memory;
    let all = format!("{slots} slot{}", if *slots == 1 { "" } else { "s" });
    let mut text =
        format!("of {all}, globals and calls take {stack}, tables, closures and strings {heap}");
    let name = |number: u16| {
        let names = program.symbols.map(|symbols| &symbols.globals);
        match names.and_then(|names| names.get(usize::from(number))) {
            Some(name) => format!("`{name}`"),
            None => format!("global {number}"),
        }
    };
    let held: Vec<String> = held
        .iter()
        .take(NAMED)
        .map(|(number, slots)| format!("{} holds {slots}", name(*number)))
        .collect();
    if !held.is_empty() {
        text.push_str(&format!("; {}", held.join(", ")));
    }
    text
}
