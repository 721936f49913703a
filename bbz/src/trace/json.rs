//! Faults and counts as JSON objects.

use bittybuzz_comms::trace::Unused;
use bittybuzz_vm_core::Fault;
use serde_json::{Value, json};

use crate::backtrace::Backtrace;
use crate::fault;
use crate::program::LoadedProgram;

/// Returns the object for a fault that stopped the script. `positions` are the calls that led
/// there, innermost first; `accepted` lists the arguments that a robot function accepts, if it
/// refused those of the call.
pub fn fault(
    step: Option<u32>,
    fault: &Fault,
    program: &LoadedProgram,
    positions: &[u16],
    accepted: Option<&str>,
) -> Value {
    let marked = Backtrace::new(program, positions.to_vec(), None).marked();
    let words = fault::describe(fault, program, marked.as_deref(), accepted);
    let calls: Vec<Value> = positions.iter().map(|position| call(program, *position)).collect();
    json!({
        "kind": "fault",
        "step": step,
        "code": fault::code(fault.code),
        "message": words.headline,
        "help": words.help,
        "calls": calls,
    })
}

/// Returns the object for discarded messages.
pub fn unused(unused: &Unused) -> Value {
    let Unused { dropped: [unread, unsent], messages } = unused;
    json!({
        "kind": "unused",
        "unread": unread,
        "unsent": unsent,
        "foreign": messages.foreign,
        "malformed": messages.malformed,
        "own_id": messages.own_id,
        "not_kept": messages.not_kept,
        "incomplete": messages.incomplete,
        "undecided": messages.undecided,
        "failed": messages.failed,
    })
}

/// Returns the place of a call. Without symbols, all its fields are null except the position.
fn call(program: &LoadedProgram, position: u16) -> Value {
    let symbols = program.symbols.as_ref();
    let at = u32::from(position);
    let place = symbols.and_then(|symbols| symbols.position(at));
    let function = symbols.and_then(|symbols| symbols.function(at));
    let file = place.as_ref().and_then(|place| symbols?.file(place.file));
    json!({
        "position": position,
        "function": function.map(|function| &function.name),
        "file": file,
        "line": place.as_ref().map(|place| place.line),
        "column": place.as_ref().map(|place| place.column),
        "end_line": place.as_ref().map(|place| place.end_line),
        "end_column": place.as_ref().map(|place| place.end_column),
    })
}
