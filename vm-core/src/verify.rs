//! The verifier: it decides whether bytes are code that the machine can run without checks.
//!
//! An image comes from outside: over a debug probe, by radio, from a file. After the verifier has
//! accepted it, the interpreter reads it without a check. The verifier alone therefore decides
//! whether a script can leave its memory. It proves five properties:
//!
//! * Every jump leads to the start of an instruction of the same function.
//! * The operand stack has one known depth at each instruction, on every path that leads there. It
//!   is never less than the instruction takes, and never more than the function's header promises.
//! * Every operand names something that exists: a local, a global, a function, a string, a
//!   built-in, a function of the robot.
//! * Calls by number pass as many arguments as the function has parameters.
//! * The image has the number profile of the machine, and needs no part that the machine lacks.
//!
//! Types are not among these properties: a Buzz variable has no type, so the interpreter checks the
//! tags of values while it runs. Termination is not among them either: the budget of a run takes
//! care of that.
//!
//! # One pass
//! A verifier for general control flow merges the states of all paths until nothing changes, and
//! needs memory for a state at each instruction. This one reads each function once, from its start
//! to its end. A rule for loops, which the compiler keeps, makes that possible: a backward jump may
//! lead only to an instruction right after a `JUMP`, with the depth of that `JUMP`. The depth at
//! the target is then known when the pass gets there.
//!
//! The verifier remembers one slot for each forward jump whose target is still ahead, and one for
//! each place to which a backward jump of the function may lead. These slots are the arena of the
//! image, which is still empty, so the verifier needs no memory of its own. A function with more of
//! them than the arena has slots is refused. The time grows with the product of the instructions
//! and the slots remembered at each.
//!
//! # Flash
//! The verifier is written for the flash of a small robot. A question that arises in several places
//! is one function, the numbers that an operand may name are compared with one limit each, and
//! failures are returned in registers. A robot without room for the verifier takes images that were
//! verified where they were built ([`crate::seal`]).
//!
//! `docs/image-format.md` has the rules one by one, and the fuzz targets `image` and `program` look
//! for a program that breaks them.

use crate::arena::Arena;
use crate::builtin::{self, BuiltinKind, Feature, Library};
use crate::bytecode::ByteCode;
use crate::image::{
    BESIDE_GLOBALS, CAPTURES, DEPTH_MAX, ImageError, PARAMETERS, USES_SELF, Verified,
};
use crate::network::Sizes;
use crate::number::Profile;
use crate::opcode::{self, DROP_RESULT, Operand};
use crate::part::{Part, Parts};
use crate::rom::{BuiltinFlags, Effect};
use crate::slots::Slots;
use crate::value::{Tag, Value};

/// Returns the bits of [`Feature`] that a machine with all [parts](Part) offers in a profile.
/// Strings made at run time need the profile `full`. Neighbors, swarms and stigmergies also need
/// memory, which is not considered here.
pub const fn features<P: Profile>() -> u8 {
    features_of::<P>(Parts::ALL)
}

/// Returns the bits of [`Feature`] that a machine with these parts offers in a profile.
pub(crate) const fn features_of<P: Profile>(parts: Parts) -> u8 {
    let speaks = parts.has(Part::Neighbors) || parts.has(Part::Messages);
    Feature::Numbers as u8
        | when(P::FULL, Feature::Strings)
        | when(parts.has(Part::Maths), Feature::Maths)
        | when(speaks, Feature::Neighbors)
        | when(parts.has(Part::Swarms), Feature::Swarm)
        | if parts.has(Part::Stigmergy) { STIGMERGY } else { 0 }
        | when(parts.has(Part::LongMessages), Feature::LongMessages)
}

const fn when(is_there: bool, feature: Feature) -> u8 {
    if is_there { feature as u8 } else { 0 }
}

/// The features for which a machine needs room for entries.
const STIGMERGY: u8 = Feature::Stigmergy as u8 | Feature::StigmergyTable as u8;

/// Returns those features for which a machine of these sizes has room.
pub(crate) const fn within(features: u8, sizes: Sizes) -> u8 {
    features
        & !(when(sizes.neighbors == 0, Feature::Neighbors)
            | when(sizes.swarms == 0, Feature::Swarm)
            | if sizes.entries == 0 { STIGMERGY } else { 0 })
}

// The kinds of operands as numbers, as the table of effects has them. The conversion of a number to
// the enum would take a comparison for each variant.
const JUMP: u8 = Operand::Jump as u8;
const LOCAL: u8 = Operand::Local as u8;
const GLOBAL: u8 = Operand::Global as u8;
const FUNCTION: u8 = Operand::Function as u8;
const STRING: u8 = Operand::String as u8;
const BUILTIN: u8 = Operand::Builtin as u8;
const LIBRARY: u8 = Operand::Library as u8;
const COUNT: u8 = Operand::Count as u8;
const CAPTURE: u8 = Operand::Capture as u8;
const OWN_PARAMETERS: u8 = Operand::Parameters as u8;

/// The result of [`Verified::named`] and [`Verified::pops`] for an operand that is wrong. Valid
/// results are never negative, and an `i16` takes less code than an `Option`.
const NONE: i16 = -1;

/// The bit of a function's header that is reserved; it must be 0.
const RESERVED: u8 = 1 << 5;

impl<C: ByteCode> Verified<'_, C> {
    /// Checks every byte that the machine will rely on. `is_robot_function` returns true if the
    /// robot has a function with that name hash.
    #[one_copy]
    pub(crate) fn verify<P: Profile, S: Slots<P>>(
        self,
        scratch: &mut Arena<P, S>,
        offered: u8,
        is_robot_function: impl Fn(u16) -> bool,
    ) -> Result<(), ImageError> {
        let header = self.header;
        if header.is_full() != P::FULL {
            return Err(ImageError::Profile);
        }
        let missing = header.features() & !offered;
        if missing != 0 {
            return Err(ImageError::Features(missing.into()));
        }
        if usize::from(header.globals()) + BESIDE_GLOBALS > scratch.top() {
            return Err(ImageError::TooManyGlobals(header.globals()));
        }
        for (number, count) in header.entries().enumerate() {
            // The encoding of EntryPoint::from_count: even counts name a global or nothing, odd
            // ones a function, which must not have captured values.
            let known = if count % 2 == 0 {
                count / 2 <= header.globals()
            } else {
                self.named::<P>(FUNCTION, count / 2) & (NONE ^ 0xff | i16::from(CAPTURES)) == 0
            };
            if !known {
                return Err(ImageError::Entry(number as u16));
            }
        }
        for number in 0..header.imports() {
            let hash = self.import(number);
            if !is_robot_function(hash) {
                return Err(ImageError::RobotFunction(hash));
            }
        }
        for row in 0..header.library_rows() {
            let (library, string, number) = self.library_row(row);
            let needs = self.named::<P>(BUILTIN, number.into());
            if self.named::<P>(LIBRARY, library.into()) < 0
                || self.named::<P>(STRING, string) < 0
                || needs < 0
                || !BuiltinFlags::from_byte(needs as u8).are_in(offered)
            {
                return Err(ImageError::LibraryTable(row));
            }
        }
        let mut start = self.start(0);
        if start != usize::from(header.code_at()) || self.code.byte(start) != 0 {
            return Err(ImageError::Function(0));
        }
        let mut number = 0;
        // The loop runs at least once, so that an image without functions is refused.
        loop {
            let end = self.start(number + 1);
            if end < start + 3
                || end > self.code.len()
                || self.code.byte(start) & RESERVED != 0
                || self.code.byte(start + 1) > DEPTH_MAX
            {
                return Err(ImageError::Function(number));
            }
            self.pass(offered, start, end, scratch)?;
            start = end;
            number += 1;
            if number >= header.functions() {
                return Ok(());
            }
        }
    }

    /// Returns the offset of a function, or the end of the code if there is no function of that
    /// number.
    #[one_copy]
    fn start(self, number: u16) -> usize {
        if number < self.header.functions() { self.function(number) } else { self.code.len() }
    }

    /// Looks up the thing that an operand, from [`Operand::Global`] to [`Operand::Count`], names by
    /// its number. Returns the first header byte of a function, the [`BuiltinFlags`] of a built-in,
    /// 0 for any other thing that exists, and [`NONE`] if it does not exist.
    #[one_copy]
    fn named<P: Profile>(self, operand: u8, number: u16) -> i16 {
        let limit = if operand < BUILTIN {
            let count = self.header.count(operand);
            if operand == STRING { count + builtin::string::COUNT } else { count }
        } else if operand == BUILTIN {
            builtin::TABLE.len() as u16
        } else if operand == LIBRARY {
            Library::ALL.len() as u16
        } else {
            u16::from(DEPTH_MAX) + 1
        };
        if number >= limit {
            return NONE;
        }
        let byte = if operand == FUNCTION {
            self.code.byte(self.start(number))
        } else if operand == BUILTIN {
            BuiltinFlags::of::<P, C>(number as u8).byte()
        } else {
            0
        };
        byte.into()
    }

    /// Returns the number of values that an instruction takes off the stack, or [`NONE`] if its
    /// operand or trailer is wrong. Locals and jumps are not checked here, because they depend on
    /// the depth and the position. `head` is the first header byte of the function that the
    /// instruction is in.
    #[one_copy]
    fn pops<P: Profile>(
        self,
        offered: u8,
        opcode: u8,
        effect: Effect,
        number: u16,
        trailer: u8,
        head: u8,
    ) -> i16 {
        let operand = effect.operand();
        let pops = effect.pops().into();
        if operand < GLOBAL {
            return pops;
        }
        if operand == OWN_PARAMETERS {
            return if number == (head & PARAMETERS).into() { pops } else { NONE };
        }
        if (number as i16) < 0 {
            return NONE;
        }
        if operand == CAPTURE {
            return if head & CAPTURES != 0 { pops } else { NONE };
        }
        let named = self.named::<P>(operand, number);
        if named < 0 {
            return NONE;
        }
        let named = named as u8;
        if operand == COUNT {
            return pops + number as i16;
        }
        if opcode == opcode::CLOSURE {
            // Without captured values it would be a constant function.
            let wrong = named & (CAPTURES | USES_SELF) == 0 || trailer == 0 || trailer >= DEPTH_MAX;
            return if wrong { NONE } else { trailer.into() };
        }
        if operand == FUNCTION {
            if named & CAPTURES != 0 {
                return NONE;
            }
            if opcode == opcode::CALL_FUNCTION {
                return (named & PARAMETERS).into();
            }
        }
        if operand == BUILTIN {
            let needs = BuiltinFlags::from_byte(named);
            // A built-in of kind `Calls` has its result only after script functions have returned,
            // and its frame does not record that the result is to be dropped.
            let drops = effect.has_arguments() && trailer & DROP_RESULT != 0;
            if !needs.is_function_in(offered) || drops && needs.is(BuiltinKind::Calls) {
                return NONE;
            }
        }
        if effect.has_arguments() { (trailer & !DROP_RESULT).into() } else { pops }
    }

    /// Checks the code of the function from `start` to `end`. It is inlined into its only caller,
    /// which saves a prologue.
    #[hot]
    fn pass<P: Profile, S: Slots<P>>(
        self,
        offered: u8,
        start: usize,
        end: usize,
        memory: &mut Arena<P, S>,
    ) -> Result<(), ImageError> {
        let code = &self.code;
        let head = code.byte(start);
        let depth_max = code.byte(start + 1);
        let flags = head >> 6;
        let hidden = flags - (flags >> 1);
        let mut depth = hidden;
        let mut at = start + 2;
        let mut before = at;
        let mut opcode = opcode::NIL;
        // Not zero if the instruction before never continues with the next one.
        let mut leaves = 0;
        // The number of slots in use. Each holds a position and, in place of a tag, the depth
        // there. Positions ahead are targets of forward jumps; positions already passed are places
        // to which backward jumps may lead.
        let mut marks = 0;
        loop {
            let here = at as u16;
            // One check serves all instructions that add a mark. If the one before found no slot
            // for its mark, the mark is lost, but the function is refused here.
            if marks > memory.top() {
                return Err(ImageError::TooManyJumps(before as u16));
            }
            let mut index = 0;
            while index < marks {
                let mark = memory.get(index);
                if mark.index() <= before || mark.index() > at {
                    index += 1;
                    continue;
                }
                if mark.index() != at {
                    return Err(ImageError::Jump(mark.index() as u16));
                }
                if leaves == 0 && depth != mark.tag().byte() {
                    return Err(ImageError::Depth(here));
                }
                depth = mark.tag().byte();
                leaves = 0;
                marks -= 1;
                memory.copy(marks, index);
            }
            if opcode == opcode::JUMP {
                memory.set(marks, Value::indexed(Tag::of(depth), here));
                marks += 1;
            }
            if at >= end {
                return if leaves == 0 { Err(ImageError::NoReturn(here)) } else { Ok(()) };
            }
            before = at;

            let [low, high] = code.word(at.wrapping_add(1)).to_le_bytes();
            let decoded = opcode::decode([code.byte(at), low, high]);
            opcode = decoded.opcode;
            at += usize::from(decoded.length);
            let trailer = code.byte(at);
            let effect = Effect::of::<P, C>(opcode);
            at += effect.trailer();
            if !effect.is_known(opcode) || at > end {
                return Err(ImageError::Instruction(here));
            }
            if opcode == opcode::POW && !C::PARTS.has(Part::Maths) {
                return Err(ImageError::Features(Feature::Maths as u16));
            }
            leaves = effect.leaves();

            let operand = effect.operand();
            let number = decoded.operand as u16;
            let pops = self.pops::<P>(offered, opcode, effect, number, trailer, head);
            if pops < 0 {
                return Err(ImageError::Operand(here));
            }
            let pops = pops as u8;
            let mut wrong = false;
            if operand == LOCAL {
                // Hidden locals can be read but never written.
                let hole = if opcode == opcode::LOCAL_GET { 0 } else { hidden };
                wrong = !is_local(decoded.operand, head, hole, depth, pops);
            }
            if opcode == opcode::JUMP_LOCAL {
                let (relation, local) = opcode::relation_of_local(trailer);
                wrong = !Effect::of::<P, C>(relation).is_known(relation)
                    || !is_local(local, head, 0, depth, 0);
            }
            if wrong {
                return Err(ImageError::Operand(here));
            }
            // Hidden locals are never popped.
            if pops > depth - hidden {
                return Err(ImageError::Depth(here));
            }
            let mut pushes = effect.pushes();
            if effect.has_arguments() && trailer & DROP_RESULT != 0 {
                pushes = 0;
            }
            depth = depth - pops + pushes;
            if depth > depth_max {
                return Err(ImageError::Depth(here));
            }
            if operand == JUMP {
                let value = matches!(opcode, opcode::AND | opcode::OR);
                let target = at.wrapping_add_signed(decoded.operand.into());
                if decoded.operand < 0 {
                    let mut index = 0;
                    loop {
                        if value || index >= marks {
                            return Err(ImageError::Jump(here));
                        }
                        let place = memory.get(index);
                        if place.index() == target && place.tag().byte() == depth {
                            break;
                        }
                        index += 1;
                    }
                } else {
                    if usize::from(number) >= end - at {
                        return Err(ImageError::Jump(here));
                    }
                    // AND and OR put the truth value back before they jump.
                    let depth = depth + u8::from(value);
                    memory.set(marks, Value::indexed(Tag::of(depth), target as u16));
                    marks += 1;
                }
            }
        }
    }
}

/// Returns true if a function with the header byte `head` has a local at `offset` after `pops`
/// values were taken off a stack of that `depth`. The first `hidden` locals do not count.
#[one_copy]
fn is_local(offset: i16, head: u8, hidden: u8, depth: u8, pops: u8) -> bool {
    if offset < 0 {
        offset >= -i16::from(head & PARAMETERS)
    } else {
        offset > hidden.into() && offset <= i16::from(depth) - i16::from(pops)
    }
}
