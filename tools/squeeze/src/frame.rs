//! Entry and exit code that functions share.
//!
//! A function saves the registers that its caller wants back one by one, two bytes each, and
//! restores them at every exit. After this pass it calls one routine that saves a whole range, r2,
//! r4, ... up to r17 and perhaps Y, and makes room for its variables; and it ends with a jump to
//! the routine that restores them.
//!
//! The routines use X and Z, which hold neither arguments nor results (AVR-GCC ABI, "Call-used registers"), and r1, which is
//! zero between instructions of the source.

use std::collections::{BTreeSet, HashSet};
use std::fmt::Write;

use crate::listing::{AsmFunction, AsmInstruction, Listing, ListingLine};

/// The bytes that sharing must save; otherwise a function keeps its own code.
const WORTH: isize = 4;

/// The registers that a function saves, and the room for its variables.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Prologue {
    /// The saved registers, in the order of their `push` instructions.
    registers: Vec<u8>,
    /// Bytes of the variables; `None` if Y does not point to any.
    room: Option<u8>,
}

/// A shared routine that saves or restores registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct SaveRoutine {
    /// The first register, which is even; 18 if the routine saves none below Y.
    first: u8,
    kind: PrologueKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum PrologueKind {
    /// Saves registers up to r17.
    Plain,
    /// Saves Y, too.
    Pointer,
    /// Saves Y and makes room for variables.
    Room,
}

impl PrologueKind {
    fn suffix(self) -> &'static str {
        match self {
            PrologueKind::Plain => "",
            PrologueKind::Pointer => "_y",
            PrologueKind::Room => "_room",
        }
    }
}

impl Prologue {
    fn routine(&self) -> SaveRoutine {
        let lowest = self.registers.first().copied().unwrap_or(28);
        let has_y = self.registers.iter().any(|register| *register >= 28);
        let kind = match self.room {
            Some(_) => PrologueKind::Room,
            None if has_y => PrologueKind::Pointer,
            None => PrologueKind::Plain,
        };
        SaveRoutine { first: (lowest & !1).min(18), kind }
    }
}

/// Shares entries and exits of all functions if that saves bytes. Returns the shared routines.
pub fn share(listing: &mut Listing, is_hot: &dyn Fn(&str) -> bool) -> String {
    let mut routines = BTreeSet::new();
    for function in listing.functions() {
        if !is_hot(&function.symbol)
            && let Some(routine) = share_function(listing, &function)
        {
            routines.insert(routine);
        }
    }
    listing.compact();
    if routines.is_empty() { String::new() } else { text(&routines) }
}

/// Returns the functions that may read arguments on the stack, above their own variables. Code that
/// calls them must not change the stack.
pub fn with_arguments(listing: &Listing) -> HashSet<String> {
    let takes = |function: &AsmFunction| {
        let code: Vec<usize> =
            (function.start..function.end).filter(|line| listing.code(*line).is_some()).collect();
        let room = FunctionStart::find(listing, &code).and_then(|entry| entry.frame.room);
        code.iter().filter_map(|line| listing.code(*line)).any(|code| match room {
            Some(room) => displacement(&code.operands).is_some_and(|at| at > room),
            None => *code == AsmInstruction::new("in", "r28, 61"),
        })
    };
    listing.functions().into_iter().filter(takes).map(|function| function.symbol).collect()
}

/// Returns the distance of an operand from Y.
fn displacement(operands: &str) -> Option<u8> {
    let (_, behind) = operands.split_once("Y+")?;
    behind.split(',').next()?.trim().parse().ok()
}

fn share_function(listing: &mut Listing, function: &AsmFunction) -> Option<SaveRoutine> {
    let code: Vec<usize> =
        (function.start..function.end).filter(|line| listing.code(*line).is_some()).collect();
    let entry = FunctionStart::find(listing, &code)?;
    let exits = RoutineExit::find_all(listing, &code, &entry)?;
    let bytes = |lines: &[usize]| -> isize { 2 * lines.len() as isize };
    let each = if entry.frame.room.is_some() { 6 } else { 4 };
    let won = bytes(&entry.lines) - each
        + exits.iter().map(|exit| bytes(&exit.lines) - each).sum::<isize>();
    if won < WORTH {
        return None;
    }
    let routine = entry.frame.routine();
    let SaveRoutine { first, kind } = routine;
    let suffix = kind.suffix();
    replace(
        listing,
        &entry.lines,
        entry.frame.room,
        AsmInstruction::new("call", &format!("__save_{first}{suffix}")),
    );
    for exit in exits {
        let jump = AsmInstruction::new("jmp", &format!("__restore_{first}{suffix}"));
        replace(listing, &exit.lines, entry.frame.room, jump);
    }
    Some(routine)
}

/// Replaces those lines by the instruction, after a load of the room into r26 if there is any.
fn replace(listing: &mut Listing, lines: &[usize], room: Option<u8>, by: AsmInstruction) {
    for line in lines {
        listing.remove(*line);
    }
    let mut places = lines.iter();
    if let (Some(room), Some(place)) = (room, places.next()) {
        listing.lines[*place] =
            ListingLine::Code(AsmInstruction::new("ldi", &format!("r26, {room}")));
    }
    if let Some(place) = places.next() {
        listing.lines[*place] = ListingLine::Code(by);
    }
}

/// The entry code of a function.
struct FunctionStart {
    frame: Prologue,
    lines: Vec<usize>,
}

impl FunctionStart {
    fn find(listing: &Listing, code: &[usize]) -> Option<FunctionStart> {
        let mut registers = Vec::new();
        let mut lines = Vec::new();
        for line in code {
            let instruction = listing.code(*line)?;
            if instruction.name != "push" {
                break;
            }
            registers.push(register(&instruction.operands)?);
            lines.push(*line);
        }
        let is_range = registers.iter().all(|register| matches!(register, 2..=17 | 28 | 29))
            && registers.is_sorted();
        if !is_range || registers.is_empty() {
            return None;
        }
        let mut room = None;
        let rest = &code[lines.len()..];
        if listing.code(*rest.first()?)?.operands == "r28, 61" {
            let (size, behind) = make_room(listing, rest)?;
            lines.extend(&rest[..behind]);
            room = Some(size);
        }
        Some(FunctionStart { frame: Prologue { registers, room }, lines })
    }
}

/// Matches `in r28, 61; in r29, 62`, a subtraction, and the write of the stack pointer. Returns the
/// number of bytes and the number of instructions.
fn make_room(listing: &Listing, code: &[usize]) -> Option<(u8, usize)> {
    let at = |number: usize| code.get(number).and_then(|line| listing.code(*line));
    if at(1)? != &AsmInstruction::new("in", "r29, 62") {
        return None;
    }
    let (size, used) = change(at(2)?, at(3)?, "sbiw", "subi", "sbci")?;
    is_pointer_set(listing, code.get(2 + used..)?).then_some((size, 2 + used + POINTER_SET.len()))
}

const POINTER_SET: [(&str, &str); 5] =
    [("in", "r0, 63"), ("cli", ""), ("out", "62, r29"), ("out", "63, r0"), ("out", "61, r28")];

fn is_pointer_set(listing: &Listing, code: &[usize]) -> bool {
    code.len() >= POINTER_SET.len()
        && POINTER_SET.iter().zip(code).all(|((name, operands), line)| {
            listing.code(*line) == Some(&AsmInstruction::new(name, operands))
        })
}

/// Returns the change of Y, and the number of instructions that make it.
fn change(
    first: &AsmInstruction,
    second: &AsmInstruction,
    word: &str,
    low: &str,
    high: &str,
) -> Option<(u8, usize)> {
    let number = |instruction: &AsmInstruction, register: &str| -> Option<u16> {
        instruction.operands.strip_prefix(register)?.strip_prefix(',')?.trim().parse().ok()
    };
    if first.name == word {
        return Some((u8::try_from(number(first, "r28")?).ok()?, 1));
    }
    if first.name == low && second.name == high {
        let whole = number(first, "r28")? | number(second, "r29")? << 8;
        // `subi` and `sbci` add a number by subtracting its negative.
        let whole = if word == "adiw" { whole.wrapping_neg() } else { whole };
        return Some((u8::try_from(whole).ok()?, 2));
    }
    None
}

/// The exit code of a function.
struct RoutineExit {
    lines: Vec<usize>,
}

impl RoutineExit {
    /// Returns all exits; `None` if one of them does not match the entry.
    fn find_all(
        listing: &Listing,
        code: &[usize],
        entry: &FunctionStart,
    ) -> Option<Vec<RoutineExit>> {
        let mut exits = Vec::new();
        let mut pops = 0;
        for (number, line) in code.iter().enumerate() {
            let instruction = listing.code(*line)?;
            match instruction.name.as_str() {
                "pop" => pops += 1,
                "push" if !entry.lines.contains(line) => return None,
                "reti" | "jmp" | "ijmp" => return None,
                "ret" => exits.push(RoutineExit::find(listing, &code[..=number], entry)?),
                _ => {}
            }
        }
        (pops == exits.len() * entry.frame.registers.len()).then_some(exits)
    }

    /// Returns the exit code, where `code` ends with the return instruction.
    fn find(listing: &Listing, code: &[usize], entry: &FunctionStart) -> Option<RoutineExit> {
        let registers = &entry.frame.registers;
        let from = code.len().checked_sub(1 + registers.len())?;
        for (line, wanted) in code[from..].iter().zip(registers.iter().rev()) {
            let instruction = listing.code(*line)?;
            if instruction.name != "pop" || register(&instruction.operands)? != *wanted {
                return None;
            }
        }
        let mut start = from;
        if let Some(room) = entry.frame.room {
            start = from.checked_sub(POINTER_SET.len())?;
            if !is_pointer_set(listing, &code[start..]) {
                return None;
            }
            let one = listing.code(code[start.checked_sub(1)?])?;
            let two = listing.code(code[start.checked_sub(2)?])?;
            let back = change(one, one, "adiw", "", "")
                .or_else(|| change(two, one, "adiw", "subi", "sbci"));
            let (size, used) = back?;
            if size != room {
                return None;
            }
            start -= used;
        }
        // No branch may lead into the exit code.
        let is_whole = (code[start]..=*code.last()?).skip(1).all(|line| {
            !matches!(&listing.lines[line], ListingLine::Label(label) if !crate::listing::is_mark(label))
        });
        is_whole.then(|| RoutineExit { lines: code[start..].to_vec() })
    }
}

fn register(operand: &str) -> Option<u8> {
    operand.strip_prefix('r')?.parse().ok()
}

/// Writes the assembly of the routines.
fn text(routines: &BTreeSet<SaveRoutine>) -> String {
    let mut text = String::from("\t.section\t.text.shared_frames,\"ax\",@progbits\n");
    let kinds: BTreeSet<PrologueKind> = routines.iter().map(|routine| routine.kind).collect();
    for kind in kinds {
        save(&mut text, kind, routines);
    }
    let firsts: BTreeSet<u8> = routines.iter().map(|routine| routine.first).collect();
    for first in firsts {
        restore(&mut text, first, routines);
    }
    text
}

/// Writes a routine that saves registers. It takes the return address from the stack first, and
/// jumps there at the end.
fn save(text: &mut String, kind: PrologueKind, routines: &BTreeSet<SaveRoutine>) {
    let suffix = kind.suffix();
    let firsts: Vec<u8> =
        routines.iter().filter(|routine| routine.kind == kind).map(|of| of.first).collect();
    for first in &firsts {
        let _ = write!(
            text,
            "__save_{first}{suffix}:\n\tpop\tr31\n\tpop\tr30\n\trjmp\t.Lpush_{first}{suffix}\n"
        );
    }
    for register in (2..=17).chain([28, 29]) {
        if register == 28 && firsts.contains(&18) {
            let _ = writeln!(text, ".Lpush_18{suffix}:");
        }
        if firsts.contains(&register) {
            let _ = writeln!(text, ".Lpush_{register}{suffix}:");
        }
        let is_above = firsts.iter().any(|first| *first <= register);
        if is_above && (register < 28 || kind != PrologueKind::Plain) {
            let _ = writeln!(text, "\tpush\tr{register}");
        }
    }
    if kind == PrologueKind::Room {
        text.push_str("\tin\tr28, 61\n\tin\tr29, 62\n\tsub\tr28, r26\n\tsbc\tr29, r1\n");
        set_pointer(text);
    }
    text.push_str("\tijmp\n");
}

fn restore(text: &mut String, first: u8, routines: &BTreeSet<SaveRoutine>) {
    let has = |kind| routines.contains(&SaveRoutine { first, kind });
    if has(PrologueKind::Room) {
        let _ = writeln!(text, "__restore_{first}_room:\n\tadd\tr28, r26\n\tadc\tr29, r1");
        set_pointer(text);
    }
    if has(PrologueKind::Pointer) {
        let _ = writeln!(text, "__restore_{first}_y:");
    }
    if has(PrologueKind::Room) || has(PrologueKind::Pointer) {
        text.push_str("\tpop\tr29\n\tpop\tr28\n");
    }
    if has(PrologueKind::Plain) {
        let _ = writeln!(text, "__restore_{first}:");
    }
    for register in (first..=17).rev() {
        let _ = writeln!(text, "\tpop\tr{register}");
    }
    text.push_str("\tret\n");
}

fn set_pointer(text: &mut String) {
    for (name, operands) in POINTER_SET {
        let _ = writeln!(text, "\t{name}\t{operands}");
    }
}
