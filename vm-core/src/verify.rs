//! The verifier: from any bytes to code that can be trusted.
//!
//! One forward pass over each function. Its memory is the arena that the image will use, which is still empty: one
//! slot for each forward jump whose target is still ahead, and one for each place that a backward jump may lead to. The rules are in
//! `docs/image-format.md`.

use crate::arena::Arena;
use crate::builtin::{Feature, Kind, Library};
use crate::bytecode::ByteCode;
use crate::image::{
    CAPTURES, DEPTH_MAX, EntryPoint, Header, Image, ImageError, PARAMETERS, USES_SELF, Verified,
};
use crate::number::Profile;
use crate::opcode::{self, DROP_RESULT, Decoded, Operand, Trailer};
use crate::rom::{self, Needs};
use crate::value::{Tag, Value};

/// The bits of [`Feature`] that the machine of this build offers in a profile: strings made at run time need `full`.
pub const fn features<P: Profile>() -> u8 {
    (if cfg!(feature = "maths") { Feature::Maths as u8 } else { 0 })
        | (if cfg!(feature = "strings") && P::FULL { Feature::Strings as u8 } else { 0 })
}

impl<C: ByteCode> Image<C> {
    /// Checks every byte that the machine will rely on. `is_robot_function` tells whether the robot has a function
    /// of that name hash.
    #[inline(never)]
    pub(crate) fn verify<P: Profile, const SLOTS: usize>(
        self,
        scratch: &mut Arena<P, SLOTS>,
        is_robot_function: impl Fn(u16) -> bool,
    ) -> Result<Verified<C>, ImageError> {
        let header = self.header()?;
        if header.is_full() != P::FULL {
            return Err(ImageError::Profile);
        }
        let missing = header.features & !features::<P>();
        if missing != 0 {
            return Err(ImageError::Features(missing));
        }
        if header.functions == 0 {
            return Err(ImageError::Function(0));
        }
        // Room for the globals, the machine's own global, the entry's frame and one cell.
        if usize::from(header.globals) + 16 > scratch.top() {
            return Err(ImageError::TooManyGlobals(header.globals));
        }
        let verified = Verified { code: self.code, header };
        for (number, count) in header.entries.into_iter().enumerate() {
            let known = match EntryPoint::from_count(count) {
                EntryPoint::None => true,
                EntryPoint::Global(global) => global < header.globals,
                EntryPoint::Function(function) => {
                    function < header.functions
                        && verified.code.byte(verified.function(function)) & CAPTURES == 0
                }
            };
            if !known {
                return Err(ImageError::Entry(number as u8));
            }
        }
        for number in 0..header.imports {
            let hash = verified.import(number);
            if !is_robot_function(hash) {
                return Err(ImageError::RobotFunction(hash));
            }
        }
        for row in 0..header.library_rows {
            let (library, string, number) = verified.library_row(row);
            let needs = Needs::of::<C>(u16::from(number));
            let in_build = needs.is_some_and(|needs| needs.is_in(features::<P>()));
            let known = (library as usize) < Library::ALL.len() && header.has_string(string);
            if !known || !in_build {
                return Err(ImageError::LibraryTable(row));
            }
        }
        for number in 0..header.functions {
            let start = verified.function(number);
            let next = number + 1;
            let end =
                if next < header.functions { verified.function(next) } else { self.code.len() };
            let first = usize::from(header.code_at);
            if (number == 0 && start != first) || end < start + 3 || end > self.code.len() {
                return Err(ImageError::Function(number));
            }
            let head = verified.code.byte(start);
            let depth_max = verified.code.byte(start + 1);
            let flags_of_main = number == 0 && head != 0;
            if flags_of_main || head & 0x20 != 0 || depth_max > DEPTH_MAX {
                return Err(ImageError::Function(number));
            }
            let hidden = u8::from(head & USES_SELF != 0) + u8::from(head & CAPTURES != 0);
            let pass = Pass {
                code: &self.code,
                header: &header,
                verified: &verified,
                memory: scratch,
                end,
                parameters: head & PARAMETERS,
                hidden,
                captures: head & CAPTURES != 0,
                depth_max,
                depth: hidden,
                forward: 0,
                backward: 0,
                next_target: NO_TARGET,
            };
            pass.run(start + 2)?;
        }
        Ok(verified)
    }
}

/// No forward jump is pending.
const NO_TARGET: usize = usize::MAX;

/// The state of the pass over one function.
struct Pass<'a, C: ByteCode, P: Profile, const SLOTS: usize> {
    code: &'a C,
    header: &'a Header,
    verified: &'a Verified<C>,
    memory: &'a mut Arena<P, SLOTS>,
    end: usize,
    parameters: u8,
    hidden: u8,
    captures: bool,
    depth_max: u8,
    depth: u8,
    /// Pending forward jumps, in the slots from 0 up: target, and depth in place of a tag.
    forward: usize,
    /// Targets of backward jumps, in the slots from the top down.
    backward: usize,
    /// The nearest pending target.
    next_target: usize,
}

impl<C: ByteCode, P: Profile, const SLOTS: usize> Pass<'_, C, P, SLOTS> {
    #[inline(never)]
    fn run(mut self, mut at: usize) -> Result<(), ImageError> {
        // Whether the way from the instruction before leads here.
        let mut reached = true;
        while at < self.end {
            if at == self.next_target {
                self.arrive(at, reached)?;
            }
            let here = at as u16;
            let start = [
                self.code.byte(at),
                self.code.byte(at.wrapping_add(1)),
                self.code.byte(at.wrapping_add(2)),
            ];
            let instruction = opcode::decode(start);
            let trailer = at + usize::from(instruction.length);
            let effect =
                rom::effect::<C>(instruction.opcode).ok_or(ImageError::Instruction(here))?;
            at = trailer
                + match effect.trailer {
                    Trailer::None => 0,
                    Trailer::Arguments | Trailer::Captures | Trailer::Immediate => 1,
                    Trailer::LocalImmediate => 2,
                    Trailer::Word => P::WORD_BYTES,
                };
            if at > self.end {
                return Err(ImageError::Instruction(here));
            }
            if instruction.opcode == opcode::POW && features::<P>() & Feature::Maths as u8 == 0 {
                return Err(ImageError::Features(Feature::Maths as u8));
            }
            let mut pops = effect.pops;
            let mut pushes = effect.pushes;
            let byte = self.code.byte(trailer);
            let operand = u16::try_from(instruction.operand).ok();
            let mut fits =
                self.operand(&instruction, effect.operand, operand) && self.writable(&instruction);
            match effect.trailer {
                Trailer::Arguments => {
                    let count = byte & !DROP_RESULT;
                    pops = pops.saturating_add(count);
                    if byte & DROP_RESULT != 0 {
                        pushes = 0;
                        fits &= instruction.opcode != opcode::CALL_BUILTIN
                            || operand
                                .and_then(Needs::of::<C>)
                                .is_some_and(|needs| needs.is(Kind::Plain));
                    }
                }
                Trailer::Captures => {
                    // Without captured values it would be a constant function.
                    fits &= byte > 0 && byte < DEPTH_MAX;
                    pops = pops.saturating_add(byte);
                }
                Trailer::LocalImmediate => {
                    let (jump, local) = opcode::relation_of_local(byte);
                    fits &= rom::effect::<C>(jump).is_some() && self.is_local(local);
                }
                Trailer::None | Trailer::Immediate | Trailer::Word => {}
            }
            if effect.operand == Operand::Count {
                pops = pops.saturating_add(operand.unwrap_or(0).min(255) as u8);
            }
            if instruction.opcode == opcode::CALL_FUNCTION {
                pops = self.code.byte(self.verified.function(operand.unwrap_or(0))) & PARAMETERS;
            }
            if !fits {
                return Err(ImageError::Operand(here));
            }
            // Hidden locals are never popped.
            let Some(after) = self.depth.checked_sub(pops).filter(|d| *d >= self.hidden) else {
                return Err(ImageError::Depth(here));
            };
            let between = after;
            self.depth = after.saturating_add(pushes);
            if self.depth > self.depth_max {
                return Err(ImageError::Depth(here));
            }
            reached = true;
            if effect.operand == Operand::Jump {
                let value = matches!(instruction.opcode, opcode::AND | opcode::OR);
                let target = at.wrapping_add_signed(isize::from(instruction.operand));
                // A kept truth value is on the stack at the target.
                let depth = if value { between + 1 } else { between };
                if depth > self.depth_max || (value && target < at) {
                    return Err(ImageError::Jump(here));
                }
                self.jump(here, at, target, depth)?;
                if instruction.opcode == opcode::JUMP {
                    reached = false;
                    self.allow_backward(here, at)?;
                }
            }
            if matches!(instruction.opcode, opcode::RETURN | opcode::RETURN_NIL) {
                reached = false;
            }
        }
        if self.next_target != NO_TARGET {
            return Err(ImageError::Jump(self.next_target as u16));
        }
        if reached { Err(ImageError::NoReturn(self.end as u16)) } else { Ok(()) }
    }

    /// Whether what the operand names exists.
    fn operand(&self, instruction: &Decoded, operand: Operand, number: Option<u16>) -> bool {
        let function = |number: u16| {
            let exists = number < self.header.functions;
            exists.then(|| self.code.byte(self.verified.function(number)))
        };
        match (operand, number) {
            (Operand::None | Operand::Int | Operand::Jump, _) => true,
            (Operand::Local, _) => self.is_local(instruction.operand),
            (_, None) => false,
            (Operand::String, Some(number)) => self.header.has_string(number),
            (Operand::Function, Some(number)) => {
                function(number).is_some_and(|head| match instruction.opcode {
                    opcode::CLOSURE => head & (CAPTURES | USES_SELF) != 0,
                    _ => head & CAPTURES == 0,
                })
            }
            (Operand::Builtin, Some(number)) => Needs::of::<C>(number)
                .is_some_and(|needs| !needs.is(Kind::Value) && needs.is_in(features::<P>())),
            (Operand::Robot, Some(number)) => number < self.header.imports,
            (Operand::Library, Some(number)) => usize::from(number) < Library::ALL.len(),
            (Operand::Global, Some(number)) => number < self.header.globals,
            (Operand::Capture, Some(_)) => self.captures,
            (Operand::Count, Some(number)) => number <= u16::from(DEPTH_MAX),
            (Operand::Parameters, Some(number)) => number == u16::from(self.parameters),
        }
    }

    /// Whether that local exists.
    fn is_local(&self, offset: i16) -> bool {
        (offset >= -i16::from(self.parameters) && offset < 0)
            || (offset > 0 && offset <= i16::from(self.depth))
    }

    /// Whether a local may be written: hidden ones may not.
    fn writable(&self, instruction: &Decoded) -> bool {
        let depth = match instruction.opcode {
            opcode::LOCAL_SET => self.depth.saturating_sub(1),
            opcode::LOCAL_ADD => self.depth,
            _ => return true,
        };
        let offset = instruction.operand;
        (offset < 0 && offset >= -i16::from(self.parameters))
            || (offset > i16::from(self.hidden) && offset <= i16::from(depth))
    }

    /// The pass has come to the nearest pending target.
    fn arrive(&mut self, at: usize, mut reached: bool) -> Result<(), ImageError> {
        let mut next_target = NO_TARGET;
        let mut kept = 0;
        for index in 0..self.forward {
            let pending = self.memory.get(index);
            if pending.index() == at {
                if reached && pending.tag().count() != self.depth {
                    return Err(ImageError::Depth(at as u16));
                }
                self.depth = pending.tag().count();
                reached = true;
            } else {
                next_target = next_target.min(pending.index());
                self.memory.set(kept, pending);
                kept += 1;
            }
        }
        self.forward = kept;
        self.next_target = next_target;
        // A backward jump may lead here as well, if a `JUMP` stands before: with the depth found now.
        if self.backward > 0 {
            let last = self.memory.top() - self.backward;
            if self.memory.get(last).index() == at {
                self.memory.set(last, Value::indexed(Tag::counting(self.depth), at as u16));
            }
        }
        Ok(())
    }

    fn jump(&mut self, here: u16, at: usize, target: usize, depth: u8) -> Result<(), ImageError> {
        if target >= at && target < self.end {
            self.reserve(here)?;
            self.memory.set(self.forward, Value::indexed(Tag::counting(depth), target as u16));
            self.forward += 1;
            self.next_target = self.next_target.min(target);
            return Ok(());
        }
        for index in 0..self.backward {
            let place = self.memory.get(self.memory.top() - 1 - index);
            if place.index() == target && place.tag().count() == depth {
                return Ok(());
            }
        }
        Err(ImageError::Jump(here))
    }

    /// A backward jump may lead to `at`, behind a `JUMP`.
    fn allow_backward(&mut self, here: u16, at: usize) -> Result<(), ImageError> {
        self.reserve(here)?;
        let slot = self.memory.top() - 1 - self.backward;
        self.memory.set(slot, Value::indexed(Tag::counting(self.depth), at as u16));
        self.backward += 1;
        Ok(())
    }

    fn reserve(&self, here: u16) -> Result<(), ImageError> {
        if self.forward + self.backward < self.memory.top() {
            Ok(())
        } else {
            Err(ImageError::TooManyJumps(here))
        }
    }
}
