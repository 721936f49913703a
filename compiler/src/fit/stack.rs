//! Computes a lower bound of the stack depth on the deepest path through a script's calls.
//!
//! Only calls by number are known. A cycle of calls counts as one round.

use std::collections::BTreeMap;

use bittybuzz_vm_core::GLOBALS;
use bittybuzz_vm_core::image::{CAPTURES, EntryPoint, ImageHeader, PARAMETERS, USES_SELF};
use bittybuzz_vm_core::opcode::{self, DROP_RESULT, Operand, Trailer};

use super::code;

/// A path through a program's calls.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CallPath {
    /// Slots that the path needs, including the machine's own but not the globals of the script.
    pub slots: usize,
    /// The functions on the path, an entry point first.
    pub functions: Vec<u16>,
    /// The position of each call to the next function, counted from the start of the code. There is
    /// one call fewer than functions.
    pub calls: Vec<usize>,
}

/// A call of a script function by number.
struct ScriptCall {
    at: usize,
    function: u16,
    /// Slots between the caller's record and that of the callee.
    between: usize,
}

struct StackFunction {
    /// Slots below the function's record if the function is an entry point. These are the
    /// parameters and the record of the machine's own frame, from which the machine calls an entry
    /// point unless its header byte is 0.
    below: usize,
    /// Slots above the function's record.
    room: usize,
    calls: Vec<ScriptCall>,
    /// Slots from the record up including those of the deepest call, and the index of that call in
    /// `calls`. `None` until it is computed.
    need: Option<(usize, Option<usize>)>,
}

/// Returns the path that needs the most slots.
pub fn deepest(image: &[u8], header: &ImageHeader) -> CallPath {
    let numbers = 0..header.functions();
    let mut functions: Vec<StackFunction> =
        numbers.map(|number| function(image, header, number)).collect();
    let entries = header.entries().filter_map(|count| match EntryPoint::from_count(count) {
        EntryPoint::Function(number) => Some(number),
        EntryPoint::None | EntryPoint::Global(_) => None,
    });
    let paths = [0].into_iter().chain(entries).filter_map(|entry| {
        find_needs(&mut functions, entry);
        let (need, _) = functions.get(usize::from(entry))?.need?;
        let below = functions.get(usize::from(entry))?.below;
        Some(call_path(&functions, entry, GLOBALS + below + need))
    });
    // Of several paths that need the most slots, the first one is taken.
    paths.reduce(|most, path| if path.slots > most.slots { path } else { most }).unwrap_or_default()
}

fn call_path(functions: &[StackFunction], entry: u16, slots: usize) -> CallPath {
    let mut path = CallPath { slots, functions: vec![entry], calls: Vec::new() };
    let mut number = entry;
    while let Some(function) = functions.get(usize::from(number))
        && let Some((_, Some(call))) = function.need
        && let Some(call) = function.calls.get(call)
    {
        number = call.function;
        path.functions.push(number);
        path.calls.push(call.at);
    }
    path
}

/// Computes the needs of a function and of all functions that it calls. The walk is iterative,
/// because a script may have a long chain of calls.
fn find_needs(functions: &mut [StackFunction], entry: u16) {
    let mut is_active = vec![false; functions.len()];
    // The current chain of calls. Each function has the index of its next call.
    let mut active = vec![(usize::from(entry), 0)];
    while let Some((number, next)) = active.last_mut() {
        let number = *number;
        let Some(function) = functions.get(number) else { return };
        if let Some(flag) = is_active.get_mut(number) {
            *flag = true;
        }
        if let Some(call) = function.calls.get(*next) {
            *next += 1;
            let callee = usize::from(call.function);
            let is_new = functions.get(callee).is_some_and(|callee| callee.need.is_none());
            if is_new && is_active.get(callee) == Some(&false) {
                active.push((callee, 0));
            }
            continue;
        }
        let mut need = (1 + function.room, None);
        for (index, call) in function.calls.iter().enumerate() {
            // A function on the current chain has no result yet: this call is recursive.
            let callee = functions.get(usize::from(call.function)).and_then(|callee| callee.need);
            if let Some((slots, _)) = callee
                && call.between + slots > need.0
            {
                need = (call.between + slots, Some(index));
            }
        }
        if let Some(function) = functions.get_mut(number) {
            function.need = Some(need);
        }
        if let Some(flag) = is_active.get_mut(number) {
            *flag = false;
        }
        active.pop();
    }
}

/// Finds the calls of a function. Tracks the depth of the operand stack as docs/image-format.md
/// states.
fn function(image: &[u8], header: &ImageHeader, number: u16) -> StackFunction {
    let [head, room] = code::head(image, header, number);
    let hidden = usize::from(head & CAPTURES != 0) + usize::from(head & USES_SELF != 0);
    let mut function = StackFunction {
        below: usize::from(head != 0) + usize::from(head & PARAMETERS),
        room: usize::from(room),
        calls: Vec::new(),
        need: None,
    };
    let mut depth = hidden;
    let mut arriving = BTreeMap::new();
    for instruction in code::instructions(image, header, number) {
        depth = arriving.remove(&instruction.at).unwrap_or(depth);
        let info = instruction.info;
        let operand = usize::try_from(instruction.operand).unwrap_or(0);
        let mut pushes = usize::from(info.pushes);
        let counted = match (info.byte, info.operand, info.trailer) {
            (opcode::CALL_FUNCTION, ..) => {
                let callee = u16::try_from(operand).unwrap_or(0);
                function.calls.push(ScriptCall {
                    at: instruction.at,
                    function: callee,
                    between: 1 + depth,
                });
                usize::from(code::head(image, header, callee)[0] & PARAMETERS)
            }
            (_, Operand::Count, _) => operand,
            (.., Trailer::Arguments) => {
                if instruction.trailer & DROP_RESULT != 0 {
                    pushes = 0;
                }
                usize::from(instruction.trailer & !DROP_RESULT)
            }
            (.., Trailer::Captures) => usize::from(instruction.trailer),
            _ => 0,
        };
        let between = depth.saturating_sub(usize::from(info.pops) + counted);
        depth = between + pushes;
        if info.operand == Operand::Jump
            && let Some(target) = instruction.next.checked_add_signed(instruction.operand.into())
        {
            // `AND` and `OR` push their truth value when they jump.
            let kept = usize::from(matches!(info.byte, opcode::AND | opcode::OR));
            arriving.insert(target, between + kept);
        }
    }
    function
}
