//! `swarm`: groups that robots join and leave.

use crate::builtin::{self, Library};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::machine::{Native, Vm};
use crate::number::Profile;
use crate::value::{Tag, Value};

// A swarm is one slot: its number, with these bits in place of a tag.
const EXISTS: u8 = 1;
pub(super) const MEMBER: u8 = 2;
/// A bit in place of the tag of a swarm or an entry: it is to be sent when the running entry point
/// returns.
pub(super) const NEWS: u8 = 0x80;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the place of the swarm of a running `exec`. `depth` counts from the innermost one,
    /// which is 0.
    pub(super) fn current_swarm(&self, depth: u16) -> Option<u8> {
        let (mut pc, mut fp) = (usize::from(self.pc), usize::from(self.fp));
        let mut depth = depth;
        while pc != Native::EXIT.position() {
            if pc == Native(builtin::SWARM_EXEC).position() {
                if depth == 0 {
                    return Some(object_number(self.arena.get(fp.wrapping_sub(2))));
                }
                depth -= 1;
            }
            (pc, fp) = self.caller(fp);
        }
        None
    }

    /// Returns the slot of the swarm at that place.
    #[one_copy]
    pub(super) fn swarm_slot(&self, place: u8) -> usize {
        let sizes = self.sizes();
        let stigmergies = self.entry_slot(sizes.entries);
        stigmergies + usize::from(sizes.stigmergies()) + usize::from(place)
    }

    /// Returns true if the robot is in the swarm at that place.
    #[one_copy]
    pub(super) fn is_member(&self, place: u8) -> bool {
        self.arena.get(self.swarm_slot(place)).tag().byte() & MEMBER != 0
    }

    fn set_member(&mut self, place: u8, is_member: bool) {
        if self.is_member(place) != is_member {
            let at = self.swarm_slot(place);
            let swarm = self.arena.get(at);
            let state = (swarm.tag().byte() ^ MEMBER) | NEWS;
            self.arena.set(at, Value::marked(state, swarm.raw()));
            self.protocol.has_dirty_entries = true;
        }
    }

    /// Leaves all swarms.
    pub(super) fn leave_swarms(&mut self) {
        for place in 0..self.sizes().swarms {
            self.set_member(place, false);
        }
    }

    /// Returns the place of the swarm of that number, or the number of places if there is none.
    pub(super) fn find_swarm(&self, number: u16) -> u8 {
        let mut place = 0;
        while place < self.sizes().swarms {
            let swarm = self.arena.get(self.swarm_slot(place));
            if swarm.tag() != Tag::NIL && swarm.index() as u16 == number {
                break;
            }
            place += 1;
        }
        place
    }

    /// Returns the place of the swarm of that number. Creates the swarm if there is none.
    fn create_swarm(&mut self, number: Value<P>) -> Result<u8, Stopped> {
        let number = self.need_id(number)?;
        let mut place = self.find_swarm(number);
        if place < self.sizes().swarms {
            return Ok(place);
        }
        place = 0;
        while place < self.sizes().swarms {
            let at = self.swarm_slot(place);
            if self.arena.get(at).tag() == Tag::NIL {
                self.arena.set(at, Value::indexed(Tag::of(EXISTS), number));
                self.protocol.shares = true;
                return Ok(place);
            }
            place += 1;
        }
        Err(self.fail(FaultCode::TooMany))
    }

    /// Returns the number of a swarm or stigmergy. Fails unless it is an integer from 0 to 65535.
    pub(super) fn need_id(&mut self, number: Value<P>) -> Result<u16, Stopped> {
        match number.as_int() {
            None => Err(self.wrong_type(number, number)),
            Some(id) => u16::try_from(id).map_err(|_| self.fail(FaultCode::BadNumber)),
        }
    }

    /// Returns the place of the swarm that this object stands for. Fails if it is no swarm.
    pub(super) fn need_swarm(&mut self, object: Value<P>) -> Result<u8, Stopped> {
        if object.is(Tag::LIBRARY) && object.index() as u8 == Library::SwarmObject as u8 {
            return Ok(object_number(object));
        }
        Err(self.wrong_type(object, object))
    }

    /// Computes a function of `swarm` or of a swarm, except those of kind `Calls`; `a` is the first
    /// argument.
    #[one_copy]
    pub(in crate::machine) fn swarm_builtin(
        &mut self,
        number: u8,
        count: u8,
        a: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        let b = self.argument(1, count);
        let swarm = match number {
            builtin::SWARM_ID => {
                let depth = if a.is(Tag::UNSET) { 0 } else { self.need_id(a)? };
                return Ok(match self.current_swarm(depth) {
                    Some(place) => self.number_at(self.swarm_slot(place)),
                    None => Value::nil(),
                });
            }
            builtin::SWARM_CREATE => self.create_swarm(a)?,
            builtin::SWARM_UNION..=builtin::SWARM_DIFFERENCE => {
                let one = self.need_swarm(b)?;
                let other = self.argument(2, count);
                let other = self.need_swarm(other)?;
                let (in_one, in_other) = (self.is_member(one), self.is_member(other));
                let is_member = match number {
                    builtin::SWARM_UNION => in_one || in_other,
                    builtin::SWARM_INTERSECTION => in_one && in_other,
                    _ => in_one && !in_other,
                };
                let made = self.create_swarm(a)?;
                self.set_member(made, is_member);
                made
            }
            builtin::SWARM_OTHERS => {
                let one = self.need_swarm(a)?;
                let is_member = !self.is_member(one);
                let made = self.create_swarm(b)?;
                self.set_member(made, is_member);
                made
            }
            _ => {
                let swarm = self.need_swarm(a)?;
                if b.is(Tag::UNSET) && number >= builtin::SWARM_SELECT {
                    return Err(self.fail(FaultCode::MissingArgument));
                }
                match number {
                    builtin::SWARM_IN => return Ok(Value::truth(self.is_member(swarm))),
                    builtin::SWARM_SELECT => self.set_member(swarm, !b.is_false()),
                    // If the condition of `unselect` is false, nothing changes.
                    builtin::SWARM_UNSELECT if b.is_false() => {}
                    _ => self.set_member(swarm, number == builtin::SWARM_JOIN),
                }
                return Ok(Value::nil());
            }
        };
        Ok(object(Library::SwarmObject, swarm))
    }
}

/// Returns the object that stands for a swarm or a stigmergy in scripts.
pub(super) fn object<P: Profile>(library: Library, number: u8) -> Value<P> {
    Value::indexed(Tag::LIBRARY, u16::from_le_bytes([library as u8, number]))
}

/// Returns the place of the swarm or stigmergy that an object stands for.
pub(super) fn object_number<P: Profile>(object: Value<P>) -> u8 {
    let [_, number] = (object.index() as u16).to_le_bytes();
    number
}
