//! Conflicts: two robots put the same key at the same clock, and handlers of the script decide.

use core::cmp::Ordering;

use super::entries::{DIGEST, OWN};
use super::merging::RECLAIMED_MAX;
use super::protocol::{Conflict, Count};
use crate::builtin::string;
use crate::bytecode::ByteCode;
use crate::fault::Stopped;
use crate::host::Host;
use crate::machine::Vm;
use crate::number::Profile;
use crate::slots::Slots;
use crate::stamp::Stamp;
use crate::value::{Tag, Value};

/// Part of [`RECLAIMED_MAX`] that the put of a merged value takes. Merged values meet others at the
/// same clock, and a handler may merge these again for ever.
const MERGED: u8 = 4;

/// The most choices of a handler against the order of stamps for one key and clock. Then the order
/// decides: a handler may choose in circles, or otherwise on each robot.
const CHOICES_MAX: u8 = 100;

/// Numbers of libraries that no script has. With the stigmergy's number they are the keys of its
/// handlers, in the same table as the listeners.
pub(super) const ON_CONFLICT: u8 = 0xfe;
pub(super) const ON_CONFLICT_LOST: u8 = 0xfd;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Calls the handler of conflicts.
    pub(super) fn ask<H: Host<P>>(
        &mut self,
        host: &mut H,
        handler: Value<P>,
        key: Value<P>,
        local: &Stamp<P>,
        remote: &Stamp<P>,
    ) -> Result<(), Stopped> {
        self.push(key);
        self.push_stamp(local)?;
        self.push_stamp(remote)?;
        self.call_back(host, handler, 3)
    }

    /// Pushes a table of robot, data and timestamp.
    fn push_stamp(&mut self, stamp: &Stamp<P>) -> Result<(), Stopped> {
        let clock = stamp.clock.min(P::INT_MAX as u32) as i32;
        // A collection finds the value on the stack.
        let data = self.copied(stamp.value)?;
        self.push(data);
        let table = self.record(
            [string::ROBOT, string::DATA, string::TIMESTAMP],
            [Value::indexed(Tag::INT, stamp.robot), data, Value::int(clock)],
        )?;
        self.pop();
        self.push(table);
        Ok(())
    }

    /// Ends a conflict with the handler's result, which is on top: stores and sends the winner. If
    /// `onconflictlost` has to run, begins its call. Returns true if the handler is called again.
    ///
    /// A choice of the greater stamp is final, since robots without a handler choose it, too. The
    /// handler must make any other choice again with the entries exchanged, as the other robot's
    /// handler sees them: otherwise each robot would keep its own value, or take that of the other,
    /// for ever.
    #[one_copy]
    pub(super) fn settle<H: Host<P>>(
        &mut self,
        host: &mut H,
        conflict: Conflict,
        stigmergy: u8,
        key: Value<P>,
        theirs: &Stamp<P>,
    ) -> Result<bool, Stopped> {
        // The handler itself may have put another value.
        let at = self.find_entry(stigmergy, key);
        let mine = self.stamp(at);
        if at == 0 || mine.clock != theirs.clock {
            return Ok(false);
        }
        // The result says whether to take their entry (`Greater`) or to keep the own one (`Less`).
        let order = theirs.order(&mine);
        let mut winner = order;
        if conflict != Conflict::Failed {
            let Some(choice) = self.choice(stigmergy, key, at, theirs)? else { return Ok(false) };
            let choices = self.arena.slots.tag_at(at + DIGEST).byte();
            if choice != order && choice != Ordering::Equal && choices != CHOICES_MAX {
                if conflict == Conflict::Open {
                    let decides = self.registered(handler(ON_CONFLICT, stigmergy));
                    self.drop_operands();
                    self.ask(host, decides, key, theirs, &mine)?;
                    return Ok(true);
                }
                self.arena.set_tag(at + DIGEST, choices + 1);
                winner = choice;
            } else if choice != order || conflict == Conflict::Exchanged {
                self.protocol.count(Count::Undecided);
            }
        }
        if winner == Ordering::Greater {
            self.adopt(host, at, stigmergy, theirs, &mine)?;
        } else {
            // The neighbor has an older entry.
            self.answer(at);
        }
        Ok(false)
    }

    /// Returns the choice of the handler, whose result is on top: `Greater` for their entry, `Less`
    /// for the robot's own one, `Equal` for none. Puts a merged value, and returns `None` then.
    #[one_copy]
    fn choice(
        &mut self,
        stigmergy: u8,
        key: Value<P>,
        at: usize,
        theirs: &Stamp<P>,
    ) -> Result<Option<Ordering>, Stopped> {
        let verdict = self.top(1);
        if !verdict.is(Tag::TABLE) {
            return Ok(Some(Ordering::Equal));
        }
        let data = self.arena.table_get(verdict.index(), Value::string(string::DATA));
        let mine = self.stamp(at);
        let digest = self.digest_of(stigmergy, key, data)?;
        // A robot that has read a table may write it in another order than the one that put it, so
        // the digests of the stamps say nothing here.
        let mut is = |stamp: &Stamp<P>| -> Result<bool, Stopped> {
            Ok(match stamp.value.is_heap() {
                true => data.is_heap() && self.digest_of(stigmergy, key, stamp.value)? == digest,
                false => data.same(stamp.value),
            })
        };
        let (is_mine, mut is_theirs) = (is(&mine)?, is(theirs)?);
        if is_mine && is_theirs {
            // The robots put the same value, so the robot says which entry it is.
            let robot = self.arena.table_get(verdict.index(), Value::string(string::ROBOT));
            is_theirs = robot.index() as u16 == theirs.robot;
        }
        if is_mine || is_theirs {
            return Ok(Some(if is_theirs { Ordering::Greater } else { Ordering::Less }));
        }
        if data.is_nil() || self.protocol.reclaimed > RECLAIMED_MAX - MERGED {
            return Ok(Some(Ordering::Equal));
        }
        self.protocol.reclaimed += MERGED;
        let value = self.copied(data)?;
        let (clock, robot) = (self.tick(theirs.clock), self.robot_id);
        self.set_stamp(at, stigmergy, &Stamp { clock, robot, value, digest }, OWN);
        Ok(None)
    }

    /// Calls `onconflictlost`, if there is one, with the robot's own entry that lost.
    pub(super) fn call_lost_handler<H: Host<P>>(
        &mut self,
        host: &mut H,
        stigmergy: u8,
        key: Value<P>,
        lost: &Stamp<P>,
    ) -> Result<(), Stopped> {
        let callback = self.registered(handler(ON_CONFLICT_LOST, stigmergy));
        if callback.is_nil() {
            return Ok(());
        }
        self.push(key);
        self.push_stamp(lost)?;
        self.call_back(host, callback, 2)
    }
}

/// Returns the key of a stigmergy's handler in the table of listeners.
pub(super) fn handler<P: Profile>(library: u8, stigmergy: u8) -> Value<P> {
    Value::indexed(Tag::LIBRARY, u16::from_le_bytes([library, stigmergy]))
}
