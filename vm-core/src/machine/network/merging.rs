//! Merging of received entries: an entry is taken, refused, answered or deleted once more.

use core::cmp::Ordering;

use super::conflicts::{ON_CONFLICT, handler};
use super::entries::{CLOCK, KEY, OWN};
use super::messages::LOST;
use super::protocol::{Flag, Timer};
use crate::bytecode::ByteCode;
use crate::fault::Stopped;
use crate::host::Host;
use crate::machine::Vm;
use crate::message::StigmergyEntry;
use crate::number::Profile;
use crate::part::Part;
use crate::stamp::{Stamp, is_earlier, next};
use crate::value::Value;

/// The most entries from before a restart that a robot puts again. One more is allowed every 256
/// steps. Without this limit two robots with the same id would do so for ever.
pub(super) const RECLAIMED_MAX: u8 = 16;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Merges a received entry. If a handler has to decide, begins its call.
    #[one_copy]
    pub(super) fn merge<H: Host<P>>(
        &mut self,
        host: &mut H,
        remote: &mut StigmergyEntry<P>,
        digest: u16,
    ) -> Result<(), Stopped> {
        self.end_absence();
        let StigmergyEntry { owner: robot, clock, key, value, .. } = *remote;
        let stigmergy = self.find_stigmergy(remote.stigmergy);
        if stigmergy == self.protocol.stigmergies {
            // The sender has entries that this robot's digest cannot cover.
            self.drop_entry(clock != 0);
            return Ok(());
        }
        // An entry with clock 0 asks for the value and changes nothing.
        if clock != 0 && !self.expects(key, value) {
            return Ok(());
        }
        self.note_clock(clock);
        let theirs = Stamp { clock, robot, value, digest };
        let mut at = self.find_entry(stigmergy, key);
        let is_new = at == 0;
        if is_new || !self.is_shared(at) {
            // The sender asks for an entry that this robot does not have.
            if clock == 0 {
                return Ok(());
            }
            let floor = if is_new { self.protocol.floor } else { self.stamp(at).clock };
            if !is_earlier(floor, clock) && !value.is_nil() && self.may_send(key, Value::nil()) {
                if !is_new || self.protocol.has(Flag::Complete) {
                    self.delete_again(host, remote, floor);
                    return Ok(());
                }
                if self.protocol.timer(Timer::Distrust) != 0 {
                    return Ok(());
                }
            }
        }
        if is_new {
            at = self.find_room();
            if at == 0 {
                self.relay(host, remote, digest);
                return Ok(());
            }
            // The deletion of a key that is unknown here has no effect.
            if value.is_nil() {
                return Ok(());
            }
            self.new_entry(at, key);
        }
        let mut mine = self.stamp(at);
        // A robot that was switched off knows its earlier puts only from others. A put since then
        // is the later value, whatever its clock: OSPF treats a router's own announcements in the
        // same way (RFC 2328, 13.4).
        if robot == self.robot_id
            && self.arena.get(at + CLOCK).tag().byte() & OWN != 0
            && theirs.order(&mine) == Ordering::Greater
            && (!value.is_nil() || self.is_unsettled(mine.clock))
            && self.protocol.reclaimed < RECLAIMED_MAX
        {
            self.protocol.reclaimed += 1;
            mine.clock = self.tick(clock);
            self.set_stamp(at, stigmergy, &mine, OWN);
            return Ok(());
        }
        if Self::has(Part::Conflicts) && mine.clock == theirs.clock && mine.robot != theirs.robot {
            let decides = self.registered(handler(ON_CONFLICT, stigmergy));
            if !decides.is_nil() {
                self.begin_conflict(stigmergy, key, &theirs);
                return self.ask(host, decides, key, &mine, &theirs);
            }
        }
        self.take_greater(host, at, stigmergy, &theirs)
    }

    /// Returns true if no other robot may know a put of this robot with that clock.
    #[hot]
    fn is_unsettled(&self, clock: u32) -> bool {
        (clock as u16).wrapping_sub(self.protocol.settled).wrapping_sub(1) < 0x7fff
    }

    /// Answers an entry that was deleted before: sends its deletion, in the name of its robot, with
    /// a clock after `clock`. That robot puts the entry again if no other robot can have deleted it.
    fn delete_again<H: Host<P>>(
        &mut self,
        host: &mut H,
        entry: &mut StigmergyEntry<P>,
        clock: u32,
    ) {
        if self.may_answer() {
            entry.clock = next(clock);
            entry.value = Value::nil();
            self.send_entry(host, entry, 0);
        }
    }

    /// Keeps the greater one of an entry's stamp and a neighbor's. If `onconflictlost` has to run,
    /// begins its call.
    #[one_copy]
    fn take_greater<H: Host<P>>(
        &mut self,
        host: &mut H,
        at: usize,
        stigmergy: u8,
        theirs: &Stamp<P>,
    ) -> Result<(), Stopped> {
        let mine = self.stamp(at);
        match theirs.order(&mine) {
            Ordering::Greater => return self.adopt(host, at, stigmergy, theirs, &mine),
            // The neighbor has an older entry.
            Ordering::Less => self.answer(at),
            // The neighbor has this entry, so advertising is less urgent.
            Ordering::Equal => {
                self.mark_heard(at);
                if usize::from(self.protocol.newest) == at {
                    self.protocol.clear(Flag::Unheard);
                }
                if self.protocol.interval < host.periods().advertise
                    && !self.protocol.has(Flag::Unheard)
                {
                    self.protocol.interval += 1;
                }
            }
        }
        Ok(())
    }

    /// Replaces the stamp of an entry by the winner. If `onconflictlost` has to run, begins its
    /// call.
    #[one_copy]
    pub(super) fn adopt<H: Host<P>>(
        &mut self,
        host: &mut H,
        at: usize,
        stigmergy: u8,
        winner: &Stamp<P>,
        mine: &Stamp<P>,
    ) -> Result<(), Stopped> {
        self.set_stamp(at, stigmergy, winner, 0);
        self.mark_heard(at);
        if Self::has(Part::LostConflicts)
            && mine.clock == winner.clock
            && mine.robot == self.robot_id
            && mine.robot != winner.robot
        {
            // In this slot a collection finds the value.
            self.set_local(LOST, mine.value);
            return self.call_lost_handler(host, stigmergy, self.arena.get(at + KEY), mine);
        }
        Ok(())
    }
}
