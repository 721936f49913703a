//! `stigmergy`: tables that all robots share, each in a replica of its own.

use core::cmp::Ordering;

use super::Vm;
use super::messages::LOST;
use super::swarms::{NEWS, object, object_number};
use crate::builtin::{self, Library, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::message::{CLOCK_MAX, Entry};
use crate::network::{Count, ENTRY};
use crate::number::Profile;
use crate::part::Part;
use crate::stamp::Stamp;
use crate::value::{Tag, Type, Value};

// Slots of an entry: key and value; the robot that put it, with 1 + the place of its stigmergy in place of a tag, nil if there
// is no entry; the low bits of the clock, with the high ones in place of a tag.
const KEY: usize = 0;
const VALUE: usize = 1;
const ROBOT: usize = 2;
const CLOCK: usize = 3;

/// The tag of a stigmergy's number after a restart, until the script creates the stigmergy again.
const KEPT: Tag = Tag::NIL;

/// The handlers of stigmergies, beside listeners: a library that no script has, with the object's number.
const ON_CONFLICT: u8 = 0xfe;
const ON_CONFLICT_LOST: u8 = 0xfd;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// The first slot of the entry at that place.
    #[inline(never)]
    pub(super) fn entry_slot(&self, place: u8) -> usize {
        self.entries_at() + usize::from(place) * ENTRY
    }

    /// The slot of the number of the stigmergy at that place.
    fn stigmergy_slot(&self, place: u8) -> usize {
        self.entry_slot(self.sizes().entries) + usize::from(place)
    }

    /// The number of the stigmergy at that place.
    pub(super) fn number_of_stigmergy(&self, place: u8) -> u16 {
        self.arena.index_at(self.stigmergy_slot(place)) as u16
    }

    /// What an entry is worth.
    #[inline(never)]
    pub(super) fn stamp(&self, at: usize) -> Stamp<P> {
        let clock = self.arena.get(at + CLOCK);
        let [low, high] = (clock.index() as u16).to_le_bytes();
        Stamp {
            clock: u32::from_le_bytes([low, high, clock.tag().byte(), 0]),
            robot: self.arena.index_at(at + ROBOT) as u16,
            value: self.arena.get(at + VALUE),
        }
    }

    /// Sets it, as news.
    fn set_stamp(&mut self, at: usize, stigmergy: u8, stamp: &Stamp<P>) {
        let [low, high, highest, _] = stamp.clock.to_le_bytes();
        let state = (stigmergy + 1) | NEWS;
        self.arena.set(at + VALUE, stamp.value);
        self.arena.set(at + ROBOT, Value::marked(state, P::raw_from_u16(stamp.robot)));
        let clock = Value::marked(highest, P::raw_from_u16(u16::from_le_bytes([low, high])));
        self.arena.set(at + CLOCK, clock);
        self.protocol.has_news = true;
        self.hurry(at);
    }

    /// 1 + the place of the stigmergy of an entry, 0 if there is no entry; with [`NEWS`].
    #[inline(never)]
    pub(super) fn entry_state(&self, at: usize) -> u8 {
        self.arena.get(at + ROBOT).tag().byte()
    }

    /// That an entry is news, or no longer.
    pub(super) fn set_entry_state(&mut self, at: usize, state: u8) {
        let robot = self.arena.get(at + ROBOT).raw();
        self.arena.set(at + ROBOT, Value::marked(state, robot));
    }

    /// An entry as it is sent.
    #[inline(never)]
    pub(super) fn entry_message(&self, at: usize) -> Entry<P> {
        let stamp = self.stamp(at);
        let place = (self.entry_state(at) & !NEWS).wrapping_sub(1);
        Entry {
            stigmergy: self.number_of_stigmergy(place),
            owner: stamp.robot,
            clock: stamp.clock,
            key: self.arena.get(at + KEY),
            value: stamp.value,
        }
    }

    /// The place of the stigmergy that is an argument.
    pub(super) fn need_stigmergy(&mut self, value: Value<P>) -> Result<u8, Stopped> {
        if value.is(Tag::LIBRARY) && value.index() as u8 == Library::StigmergyObject as u8 {
            return Ok(object_number(value));
        }
        Err(self.wrong_type(value, value))
    }

    /// Number of a swarm or stigmergy.
    pub(super) fn object_id(&self, value: Value<P>, member: u8) -> Value<P> {
        let place = object_number(value);
        self.number_at(match member {
            builtin::SWARM_OBJECT_ID => self.swarm_slot(place),
            _ => self.stigmergy_slot(place),
        })
    }

    /// The integer in a slot, whatever there is in place of its tag.
    pub(super) fn number_at(&self, at: usize) -> Value<P> {
        Value::indexed(Tag::INT, self.arena.index_at(at) as u16)
    }

    /// The place of the stigmergy of that number; how many there are if there is none.
    pub(super) fn find_stigmergy(&self, number: u16) -> u8 {
        let mut place = 0;
        while place < self.protocol.stigmergies && self.number_of_stigmergy(place) != number {
            place += 1;
        }
        place
    }

    /// The first slot of an entry, 0 if there is none.
    #[inline(never)]
    pub(super) fn find_entry(&self, stigmergy: u8, key: Value<P>) -> usize {
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if self.entry_state(at) & !NEWS == stigmergy + 1 {
                let here = self.arena.get(at + KEY);
                if here.same(key) || self.arena.same_text(here, key) {
                    return at;
                }
            }
        }
        0
    }

    /// The first slot for a new entry with that key, clock 0 and no value; 0 if there is no room.
    fn new_entry(&mut self, key: Value<P>) -> usize {
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if self.entry_state(at) == 0 {
                self.arena.set(at + KEY, key);
                self.arena.set(at + VALUE, Value::nil());
                self.arena.set(at + CLOCK, Value::nil());
                return at;
            }
        }
        0
    }

    /// Pushes key, value and robot of the next entry, where slot `at` counts; false if there is none.
    pub(super) fn next_entry(&mut self, stigmergy: u8, at: usize) -> bool {
        let next = self.arena.get(at);
        let from = if next.is_nil() { 0 } else { next.index() as u8 };
        for place in from..self.sizes().entries {
            let entry = self.entry_slot(place);
            let value = self.arena.get(entry + VALUE);
            if self.entry_state(entry) & !NEWS == stigmergy + 1 && !value.is_nil() {
                self.arena.set(at, Value::int(i32::from(place) + 1));
                self.push(self.arena.get(entry + KEY));
                self.push(value);
                self.push(self.number_at(entry + ROBOT));
                return true;
            }
        }
        false
    }

    /// Functions of `stigmergy` and of stigmergies that have their result at once; `a` is the first argument.
    #[inline(never)]
    pub(super) fn stigmergy_builtin<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        count: u8,
        a: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        if number == builtin::STIGMERGY_CREATE {
            let number = self.need_id(a)?;
            let stigmergy = self.create_stigmergy(number)?;
            return Ok(object(Library::StigmergyObject, stigmergy));
        }
        let stigmergy = self.need_stigmergy(a)?;
        let b = self.argument(1, count);
        match number {
            builtin::STIGMERGY_SIZE => {
                // The iteration counts in a slot of its own.
                let top = self.sp;
                self.reserve(1)?;
                let mut size = 0;
                while self.next_entry(stigmergy, top.into()) {
                    self.sp = top + 1;
                    size += 1;
                }
                self.sp = top;
                return Ok(Value::int(size));
            }
            builtin::STIGMERGY_ONCONFLICT if Self::has(Part::Conflicts) => {
                self.set_handler(handler(ON_CONFLICT, stigmergy), b)?;
                return Ok(Value::nil());
            }
            builtin::STIGMERGY_ONCONFLICTLOST if Self::has(Part::Conflicts) => {
                self.set_handler(handler(ON_CONFLICT_LOST, stigmergy), b)?;
                return Ok(Value::nil());
            }
            _ => {}
        }
        let key = self.key(a, b)?;
        let mut at = self.find_entry(stigmergy, key);
        if number == builtin::STIGMERGY_GET {
            if at != 0 {
                return Ok(self.arena.get(at + VALUE));
            }
            // Who knows it?
            let stigmergy = self.number_of_stigmergy(stigmergy);
            let owner = self.robot_id;
            let question = Entry { stigmergy, owner, clock: 0, key, value: Value::nil() };
            self.send_entry(host, &question);
            return Ok(Value::nil());
        }
        let value = self.argument(2, count);
        if value.is(Tag::UNSET) {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        if at == 0 && value.is_nil() {
            return Ok(value);
        }
        let value = self.sendable(stigmergy, key, value)?;
        if at == 0 {
            at = self.new_entry(key);
            if at == 0 {
                return Err(self.fail(FaultCode::StoreFull));
            }
        }
        let clock = (self.stamp(at).clock + 1).min(CLOCK_MAX);
        self.set_stamp(at, stigmergy, &Stamp { clock, robot: self.robot_id, value });
        Ok(Value::nil())
    }

    /// The place of the stigmergy of that number, empty.
    fn create_stigmergy(&mut self, number: u16) -> Result<u8, Stopped> {
        let stigmergy = self.find_stigmergy(number);
        if stigmergy == self.sizes().entries {
            return Err(self.fail(FaultCode::TooMany));
        }
        if stigmergy == self.protocol.stigmergies {
            self.protocol.stigmergies += 1;
            self.protocol.shares = true;
        }
        let at = self.stigmergy_slot(stigmergy);
        // The entries that a restart has kept are the history of the swarm: only a second call empties the replica.
        let is_kept = self.arena.get(at).tag() == KEPT;
        self.arena.set(at, Value::indexed(Tag::INT, number));
        if is_kept {
            return Ok(stigmergy);
        }
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if self.entry_state(at) & !NEWS == stigmergy + 1 {
                self.arena.fill(at, at + ENTRY);
            }
        }
        Ok(stigmergy)
    }

    /// Keeps the stigmergies with their entries while the script starts again.
    pub(super) fn keep_stigmergies(&mut self) {
        for place in 0..self.protocol.stigmergies {
            let at = self.stigmergy_slot(place);
            self.arena.set(at, Value::indexed(KEPT, self.number_of_stigmergy(place)));
        }
    }

    /// Sets a listener or handler; nil removes.
    #[inline(never)]
    pub(super) fn set_handler(&mut self, key: Value<P>, function: Value<P>) -> Result<(), Stopped> {
        if !function.is_nil() && function.type_of() != Type::Closure {
            return Err(self.wrong_type(function, function));
        }
        let handlers = self.overlays()?;
        self.table_set(handlers, key, function)
    }

    /// Merges an entry that was heard; a handler may have to be called for that, which begins then.
    #[inline(never)]
    pub(super) fn merge<H: Host<P>>(
        &mut self,
        host: &mut H,
        remote: &Entry<P>,
    ) -> Result<(), Stopped> {
        let stigmergy = self.find_stigmergy(remote.stigmergy);
        if stigmergy == self.protocol.stigmergies {
            return Ok(());
        }
        let theirs = Stamp { clock: remote.clock, robot: remote.owner, value: remote.value };
        let mut at = self.find_entry(stigmergy, remote.key);
        if at == 0 {
            if remote.clock == 0 {
                return Ok(());
            }
            at = self.new_entry(remote.key);
            if at == 0 {
                self.pass_on(host, remote);
                return Ok(());
            }
        }
        let mine = self.stamp(at);
        if Self::has(Part::Conflicts) && mine.clock == theirs.clock && mine.robot != theirs.robot {
            let decides = self.overlay(handler(ON_CONFLICT, stigmergy));
            if !decides.is_nil() {
                self.begin_conflict(stigmergy, remote);
                self.push(remote.key);
                self.push_stamp(&mine)?;
                self.push_stamp(&theirs)?;
                return self.call_back(host, decides, 3);
            }
        }
        self.take_greater(host, at, stigmergy, &theirs)
    }

    /// Ends a conflict by the default rule, unless the handler has put something else before it failed.
    pub(super) fn settle_by_default<H: Host<P>>(
        &mut self,
        host: &mut H,
        stigmergy: u8,
        key: Value<P>,
        theirs: &Stamp<P>,
    ) -> Result<(), Stopped> {
        let at = self.find_entry(stigmergy, key);
        if at == 0 {
            return Ok(());
        }
        self.take_greater(host, at, stigmergy, theirs)
    }

    /// Keeps the greater one of an entry's stamp and a neighbour's. `onconflictlost` may have to run, and begins then.
    #[inline(never)]
    fn take_greater<H: Host<P>>(
        &mut self,
        host: &mut H,
        at: usize,
        stigmergy: u8,
        theirs: &Stamp<P>,
    ) -> Result<(), Stopped> {
        let mine = self.stamp(at);
        let order = theirs.order(&mine);
        if Self::has(Part::Conflicts)
            && mine.clock == theirs.clock
            && mine.robot == self.robot_id
            && mine.robot != theirs.robot
            && order == Ordering::Greater
        {
            self.set_local(LOST, mine.value);
            self.set_stamp(at, stigmergy, theirs);
            return self.tell_lost(host, stigmergy, self.arena.get(at + KEY), &mine);
        }
        match order {
            Ordering::Greater => self.set_stamp(at, stigmergy, theirs),
            // The neighbour is behind.
            Ordering::Less => self.set_stamp(at, stigmergy, &mine),
            // The neighbour has it: less haste.
            Ordering::Equal => {
                if self.protocol.interval < host.periods().advertise {
                    self.protocol.interval += 1;
                }
            }
        }
        Ok(())
    }

    /// Pushes a table of robot, data and timestamp.
    fn push_stamp(&mut self, stamp: &Stamp<P>) -> Result<(), Stopped> {
        let clock = stamp.clock.min(P::INT_MAX as u32) as i32;
        let table = self.record(
            [string::ROBOT, string::DATA, string::TIMESTAMP],
            [Value::indexed(Tag::INT, stamp.robot), stamp.value, Value::int(clock)],
        )?;
        self.push(table);
        Ok(())
    }

    /// Ends a conflict by what the handler said: the winner is stored and sent. `onconflictlost` may have to run, and
    /// begins then.
    #[inline(never)]
    pub(super) fn settle<H: Host<P>>(
        &mut self,
        host: &mut H,
        verdict: Value<P>,
        stigmergy: u8,
        key: Value<P>,
        clock: u32,
    ) -> Result<(), Stopped> {
        let mut robot = Value::nil();
        let mut data = Value::nil();
        if verdict.is(Tag::TABLE) {
            robot = self.arena.table_get(verdict.index(), Value::string(string::ROBOT));
            data = self.arena.table_get(verdict.index(), Value::string(string::DATA));
        }
        let at = self.find_entry(stigmergy, key);
        if !robot.is(Tag::INT) || at == 0 {
            self.protocol.count(Count::Undecided);
            return Ok(());
        }
        let mine = self.stamp(at);
        // The handler may have put something else.
        if mine.clock != clock {
            return Ok(());
        }
        let value = self.sendable(stigmergy, key, data)?;
        let winner = Stamp { clock, robot: robot.index() as u16, value };
        self.set_local(LOST, mine.value);
        self.set_stamp(at, stigmergy, &winner);
        if mine.robot == self.robot_id && winner.robot != self.robot_id {
            self.tell_lost(host, stigmergy, key, &mine)?;
        }
        Ok(())
    }

    /// Calls `onconflictlost`, if there is one, with the robot's own entry that lost.
    fn tell_lost<H: Host<P>>(
        &mut self,
        host: &mut H,
        stigmergy: u8,
        key: Value<P>,
        lost: &Stamp<P>,
    ) -> Result<(), Stopped> {
        let told = self.overlay(handler(ON_CONFLICT_LOST, stigmergy));
        if told.is_nil() {
            return Ok(());
        }
        self.push(key);
        self.push_stamp(lost)?;
        self.call_back(host, told, 2)
    }
}

/// The key of a stigmergy's handler.
fn handler<P: Profile>(library: u8, stigmergy: u8) -> Value<P> {
    Value::indexed(Tag::LIBRARY, u16::from_le_bytes([library, stigmergy]))
}
