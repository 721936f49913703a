//! Collections that stop and go on between slices, see [`crate::heap`].

use super::network::NEWS_MAX;
use super::{Native, OVERLAYS, Outcome, Vm, VmState};
use crate::arena::Arena;
use crate::builtin;
use crate::bytecode::ByteCode;
use crate::fault::Stopped;
use crate::heap::{CollectionState, Phase, Progress, Repeat};
use crate::host::Host;
use crate::network::ENTRY;
use crate::number::{Profile, TextWork};
use crate::opcode;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    pub(super) const PAUSES: bool = Arena::<P, C::Slots<P, SLOTS>>::PAUSES;

    /// Returns true if collections may stop and go on between slices.
    #[hot]
    pub(super) fn pauses(&self) -> bool {
        #[cfg(feature = "torture")]
        if !self.torture.pauses_collections {
            return false;
        }
        Self::PAUSES
    }

    /// Returns true if a collection should begin before the next instruction.
    #[hot]
    pub(super) fn wants_collection(&self, is_for_message: bool) -> bool {
        #[cfg(feature = "torture")]
        if self.torture.collect_always && self.arena.allocated && self.pauses() {
            return true;
        }
        self.pauses() && self.arena.wants_collection(is_for_message)
    }

    /// Returns true if a collection has begun and is not complete, or if changes are being sent.
    #[hot]
    pub(super) fn is_paused(&self) -> bool {
        Self::PAUSES && self.arena.collection.get().progress.phase != Phase::None
    }

    /// Begins a collection if one should come before the instruction or the native code at `pc`.
    #[one_copy]
    pub(super) fn begins_collection(&mut self, pc: usize) -> bool {
        let begins = pc != Native::EXIT.position()
            && self.wants_collection(pc == Native::MESSAGES.position());
        if begins {
            self.begin_collection();
        }
        begins
    }

    /// Begins a collection. The script stands still until it is complete.
    #[one_copy]
    pub(super) fn begin_collection(&mut self) {
        let slot = self.sp;
        // While changed entries are sent, the outermost frame is left already, so no slot of the
        // stack holds a record.
        let fp = if self.state == VmState::Idle { slot } else { self.fp };
        #[allow(clippy::useless_conversion, reason = "on a small chip it is a byte")]
        let entry_slots = 2 * u16::from(self.sizes().entries);
        self.set_progress(Progress::new(entry_slots, slot, fp, self.pc));
    }

    /// Goes on in a pause: does the next steps of a collection, a step for each instruction of the
    /// budget, or sends the next changed entry. Returns the rest of the budget if the script may
    /// run.
    pub(super) fn go_on<H: Host<P>>(&mut self, host: &mut H, budget: u16) -> Result<u16, Outcome> {
        let mut progress = self.arena.collection.get().progress;
        if progress.phase == Phase::Send {
            // A message may need room on the stack, and so a collection at once.
            self.set_progress(Progress::NONE);
            if self.flush_next(host, &mut progress.slot, progress.entry_slots) {
                progress.entry_slots -= 1;
                self.set_progress(progress);
                return Err(Outcome::Pending);
            }
            return Err(Outcome::Done);
        }
        // A host that ends slices by time alone gives no budget.
        let mut work = if H::IS_TIMED { usize::MAX } else { usize::from(budget) };
        if !self.collect_on(&mut work) {
            return Err(Outcome::Pending);
        }
        if self.state == VmState::Idle {
            return Err(self.end_in_slices());
        }
        Ok(work.min(budget.into()) as u16)
    }

    /// Ends an entry, unless a collection or the sending of changes comes before that.
    pub(super) fn end_in_slices(&mut self) -> Outcome {
        if !self.is_paused() && self.has_changes() {
            self.set_progress(Progress::sending(NEWS_MAX.into()));
        }
        if self.is_paused() { Outcome::Pending } else { Outcome::Done }
    }

    /// Completes what a pause has interrupted. Changes are sent when the next entry ends.
    #[hot]
    pub(super) fn end_pause(&mut self) {
        if self.is_paused() {
            if self.arena.collection.get().progress.phase == Phase::Send {
                self.keep_changes();
                self.set_progress(Progress::NONE);
            } else {
                let mut work = usize::MAX;
                self.collect_on(&mut work);
            }
        }
    }

    #[hot]
    fn set_progress(&mut self, progress: Progress) {
        self.arena.collection.change(|state| state.progress = progress);
    }

    /// Collects within an instruction, or for the host.
    #[one_copy]
    pub(super) fn collect_at_once(&mut self) {
        self.end_pause();
        self.begin_collection();
        self.end_pause();
    }

    /// Returns true for instructions that can be executed again after they lacked memory.
    #[hot]
    pub(super) fn is_repeatable(op: u8, number: u8) -> bool {
        match op {
            opcode::CALL_ROBOT => false,
            opcode::CALL_BUILTIN => (builtin::LENGTH..=builtin::STRING_TO_FLOAT).contains(&number),
            _ => true,
        }
    }

    /// Notes if the next instruction can be repeated.
    #[hot]
    pub(super) fn allow_repeat(&mut self, is_possible: bool) {
        if self.pauses() {
            self.arena.collection.change(|state| {
                if state.repeat != Repeat::Running {
                    state.repeat = if is_possible { Repeat::Possible } else { Repeat::Never };
                }
            });
        }
    }

    /// Ends an instruction that lacks memory and can be executed again after a collection.
    #[hot]
    pub(super) fn want_repeat(&mut self) -> Result<(), Stopped> {
        if Self::PAUSES && self.arena.collection.get().repeat == Repeat::Possible {
            self.arena.collection.change(|state| state.repeat = Repeat::Wanted);
            return Err(Stopped);
        }
        Ok(())
    }

    /// Undoes the instruction at `start` if it has to be repeated, and begins the collection that
    /// comes before.
    #[hot]
    pub(super) fn repeats(&mut self, start: usize, sp: usize, fp: u16) -> bool {
        if !Self::PAUSES {
            return false;
        }
        let repeats = self.arena.collection.get().repeat == Repeat::Wanted;
        let next = if repeats { Repeat::Running } else { Repeat::Never };
        self.arena.collection.change(|state| state.repeat = next);
        if repeats {
            (self.pc, self.sp, self.fp) = (start as u16, sp as u16, fp);
            self.work = P::TextWork::NONE;
            self.begin_collection();
        }
        repeats
    }

    /// Does at most `work` steps of the collection. Returns true if it is complete.
    #[one_copy]
    fn collect_on(&mut self, work: &mut usize) -> bool {
        let mut progress = self.arena.collection.get().progress;
        while progress.phase == Phase::Mark && *work != 0 {
            self.arena.mark_on(&mut progress, work);
            if *work != 0 {
                *work -= 1;
                self.arena.count_step();
                self.mark_next_root(&mut progress);
            }
        }
        if progress.phase == Phase::Sweep && self.arena.sweep_on(&mut progress, work) {
            progress.phase = Phase::None;
        }
        self.set_progress(progress);
        progress.phase == Phase::None
    }

    /// Marks the next root. After the last one the sweep begins.
    #[hot]
    fn mark_next_root(&mut self, progress: &mut Progress) {
        if let Some(left) = progress.entry_slots.checked_sub(1) {
            progress.entry_slots = left;
            // An entry begins with its key and its value.
            let at = self.entries_at() + usize::from(left / 2) * ENTRY + usize::from(left % 2);
            self.arena.mark_root(progress, self.arena.get(at));
        } else if usize::from(progress.slot) > OVERLAYS {
            progress.slot -= 1;
            if progress.slot == progress.fp {
                // The record of a frame, which is no value.
                let (pc, fp) = (usize::from(progress.pc), usize::from(progress.fp));
                let end = (fp + 1 + self.frame_room(pc)) as u16;
                progress.reserved = progress.reserved.max(end);
                let (pc, fp) = self.caller(fp);
                (progress.pc, progress.fp) = (pc as u16, fp as u16);
            } else {
                self.arena.mark_root(progress, self.arena.get(progress.slot.into()));
            }
        } else {
            self.arena.begin_sweep(progress);
        }
    }
}
