//! Questions: functions that a host adds to the program of a machine and calls between two entries.
//! Firmware calls nothing here, so it takes no flash.

use super::{Flow, Outcome, Vm, VmState};
use crate::bytecode::ByteCode;
use crate::fault::Stopped;
use crate::host::Host;
use crate::image::{CAPTURES, EntryPoint, PARAMETERS, Verified};
use crate::number::Profile;
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Calls the first function that an image adds to the program, with at most `budget` instructions.
    /// `extended` is a machine that has loaded this image. Returns `None` and changes nothing if an
    /// entry is running, or if the image does not begin with the globals, functions, strings and
    /// robot functions of the program.
    ///
    /// [`Outcome::Done`] is the end of the function. Each other outcome ends the call, too, and a
    /// fault ends nothing else. The machine then has its program again; it keeps the image if it adds
    /// strings, robot functions or more than one function, because its values may name them. A call
    /// that takes no cell changes only the slots that it assigns.
    pub fn call_added<H: Host<P>>(
        &mut self,
        extended: &Self,
        host: &mut H,
        budget: u16,
    ) -> Option<Outcome> {
        let (own, other) = (self.loaded()?, extended.loaded()?);
        if self.state != VmState::Idle || !other.extends(own) {
            return None;
        }
        let question = own.header.functions();
        let is_kept = other.header.names_more_than(own.header);
        self.end_pause();
        let before = (self.code, self.header);
        (self.code, self.header) = (extended.code, extended.header);
        let (base, work) = (self.sp, self.work);
        let arena = &self.arena;
        let (reserved, cells) = (arena.reserved, (arena.bottom, arena.free, arena.allocated));
        if self.enter_function(EntryPoint::Function(question), usize::from(base)) {
            self.state = VmState::Running;
        } else {
            self.begin_value(Value::indexed(Tag::FUNCTION, question));
        }
        let outcome = self.run_question(host, budget);
        self.state = VmState::Idle;
        self.fp = base;
        self.sp = base;
        let arena = &self.arena;
        if cells == (arena.bottom, arena.free, arena.allocated) {
            self.arena.reserved = reserved;
            self.work = work;
        } else {
            self.finish();
            self.end_pause();
        }
        if !is_kept {
            (self.code, self.header) = before;
        }
        Some(outcome)
    }

    /// Runs the function that was entered. A collection takes half of the instructions that are left.
    fn run_question<H: Host<P>>(&mut self, host: &mut H, budget: u16) -> Outcome {
        let mut budget = budget;
        while budget > 0 {
            match self.interpret(host, budget) {
                Ok(Flow::Done) => return Outcome::Done,
                Ok(Flow::Waiting) => return Outcome::Waiting,
                Ok(Flow::Continue) if self.is_paused() => {
                    self.end_pause();
                    budget /= 2;
                }
                Ok(Flow::Continue) => return Outcome::Pending,
                Err(Stopped) => return self.stopped(),
            }
        }
        Outcome::Pending
    }
}

impl<C: ByteCode> Verified<'_, C> {
    /// Returns true if values that name functions, strings or robot functions of the program `own` have
    /// the same meaning in this one, which has at least one function more.
    fn extends(self, own: Self) -> bool {
        let (header, known) = (self.header, own.header);
        let counts = [
            (header.functions(), known.functions() + 1),
            (header.strings(), known.strings()),
            (header.imports(), known.imports()),
        ];
        let is_longer = counts.iter().all(|(count, known)| count >= known);
        let is_like = header.is_full() == known.is_full() && header.globals() == known.globals();
        // The added function captures nothing and has no parameters.
        let is_plain = || {
            let head = self.code.byte(self.function(known.functions()));
            head & (CAPTURES | PARAMETERS) == 0
        };
        is_longer
            && is_like
            && is_plain()
            && (0..known.imports()).all(|number| self.import(number) == own.import(number))
            && (0..known.functions()).all(|number| self.has_code(number, own))
    }

    /// Returns true if a function has the same code as in another program.
    fn has_code(self, number: u16, other: Self) -> bool {
        let (start, end) = self.range(number);
        let (other_start, other_end) = other.range(number);
        end - start == other_end - other_start
            && (start..end)
                .zip(other_start..)
                .all(|(at, other_at)| self.code.byte(at) == other.code.byte(other_at))
    }

    /// Returns the offsets of the first byte of a function and of the byte after it.
    fn range(self, number: u16) -> (usize, usize) {
        let next = number + 1;
        let end = match next < self.header.functions() {
            true => self.function(next),
            false => self.code.len(),
        };
        (self.function(number), end)
    }
}
