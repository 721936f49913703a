//! `stigmergy`: tables that all robots share, each in a replica of its own.

use core::cmp::Ordering;

use super::Vm;
use super::messages::LOST;
use super::swarms::{object, object_number};
use crate::builtin::{self, Library, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::message::{self, CLOCK_MAX};
use crate::network::{Entry, NEWS, Network};
use crate::number::Profile;
use crate::stamp::Stamp;
use crate::value::{Tag, Type, Value};

/// The handlers of stigmergies, beside listeners: a library that no script has, with the object's number.
const ON_CONFLICT: u8 = 0xfe;
const ON_CONFLICT_LOST: u8 = 0xfd;
/// In place of a library whose overlay holds listeners and handlers.
const HANDLERS: u16 = 0xff;

impl<P: Profile> Entry<P> {
    pub(super) fn stamp(&self) -> Stamp<P> {
        Stamp { clock: self.clock, robot: self.robot, value: self.value }
    }
}

impl<P: Profile, C: ByteCode, const SLOTS: usize, N: Network<P>> Vm<P, C, SLOTS, N> {
    /// The place of the stigmergy that is an argument.
    pub(super) fn need_stigmergy(&mut self, value: Value<P>) -> Result<u8, Stopped> {
        if value.is(Tag::LIBRARY) && value.index() as u8 == Library::StigmergyObject as u8 {
            return Ok(object_number(value));
        }
        Err(self.wrong_type(value, value))
    }

    /// Number of a swarm or stigmergy.
    pub(super) fn object_id(&self, value: Value<P>, member: u8) -> Value<P> {
        let place = usize::from(object_number(value));
        let number = if member == builtin::SWARM_OBJECT_ID {
            self.network.swarms().get(place).map(|swarm| swarm.number)
        } else {
            self.network.stigmergies().get(place).copied()
        };
        number.map_or(Value::nil(), |number| Value::int(i32::from(number)))
    }

    /// The place of the stigmergy of that number, among those that exist.
    pub(super) fn find_stigmergy(&mut self, number: u16) -> Option<u8> {
        let count = usize::from(self.network.protocol()?.stigmergies);
        let found = self.network.stigmergies().iter().take(count).position(|n| *n == number);
        found.map(|place| place as u8)
    }

    /// The place of an entry.
    pub(super) fn find_entry(&self, stigmergy: u8, key: Value<P>) -> Option<usize> {
        self.network.entries().iter().position(|entry| {
            entry.is_of(stigmergy) && (entry.key.same(key) || self.arena.same_text(entry.key, key))
        })
    }

    /// The place of a new entry, with clock 0 and no value.
    pub(super) fn new_entry(&mut self, stigmergy: u8, key: Value<P>) -> Option<usize> {
        let entries = self.network.entries_mut();
        let free = entries.iter().position(|entry| entry.state == 0)?;
        let entry = entries.get_mut(free)?;
        *entry = Entry { key, value: Value::nil(), clock: 0, robot: 0, state: stigmergy + 1 };
        Some(free)
    }

    /// Slots `at` and above get key, value and robot of the next entry, that slot `at` counts; false if there is none.
    pub(super) fn next_entry(&mut self, stigmergy: u8, at: usize) -> bool {
        let next = self.arena.get(at);
        let from = if next.is_nil() { 0 } else { next.index() };
        let entries = self.network.entries();
        let found = (from..entries.len()).find_map(|place| {
            let entry = entries.get(place)?;
            let is_one = entry.is_of(stigmergy) && !entry.value.is_nil();
            is_one.then_some((place, *entry))
        });
        let Some((place, entry)) = found else { return false };
        self.arena.set(at, Value::int(place as i32 + 1));
        self.push(entry.key);
        self.push(entry.value);
        self.push(Value::int(i32::from(entry.robot)));
        true
    }

    /// Functions of `stigmergy` and of stigmergies that have their result at once; `a` is the first argument.
    pub(super) fn stigmergy_builtin<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        first: usize,
        end: usize,
        a: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        if number == builtin::STIGMERGY_CREATE {
            let number = self.need_id(a)?;
            let stigmergy = self.create_stigmergy(number)?;
            return Ok(object(Library::StigmergyObject, stigmergy));
        }
        let stigmergy = self.need_stigmergy(a)?;
        if number == builtin::STIGMERGY_SIZE {
            let entries = self.network.entries().iter();
            let present = entries.filter(|entry| entry.is_of(stigmergy) && !entry.value.is_nil());
            return Ok(Value::int(present.count() as i32));
        }
        let b = self.argument(first + 1, end);
        if number >= builtin::STIGMERGY_ONCONFLICT {
            let library = match number {
                builtin::STIGMERGY_ONCONFLICT => ON_CONFLICT,
                _ => ON_CONFLICT_LOST,
            };
            self.set_handler(handler(library, stigmergy), b)?;
            return Ok(Value::nil());
        }
        let key = self.key(a, b)?;
        let found = self.find_entry(stigmergy, key);
        if number == builtin::STIGMERGY_GET {
            if let Some(entry) = found.and_then(|place| self.network.entries().get(place)) {
                return Ok(entry.value);
            }
            self.ask(host, stigmergy, key)?;
            return Ok(Value::nil());
        }
        let value = self.argument(first + 2, end);
        if value.is(Tag::UNSET) {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        if found.is_none() && value.is_nil() {
            return Ok(Value::nil());
        }
        let value = self.sendable(stigmergy, key, value)?;
        let Some(place) = found.or_else(|| self.new_entry(stigmergy, key)) else {
            return Err(self.fail(FaultCode::StoreFull));
        };
        let robot = self.robot_id;
        if let Some(entry) = self.network.entries_mut().get_mut(place) {
            entry.value = value;
            entry.robot = robot;
            entry.clock = (entry.clock + 1).min(CLOCK_MAX);
            entry.state |= NEWS;
        }
        self.hurry();
        Ok(Value::nil())
    }

    /// The place of the stigmergy of that number, empty.
    fn create_stigmergy(&mut self, number: u16) -> Result<u8, Stopped> {
        if let Some(place) = self.find_stigmergy(number) {
            for entry in self.network.entries_mut() {
                if entry.is_of(place) {
                    entry.state = 0;
                    entry.key = Value::nil();
                    entry.value = Value::nil();
                }
            }
            return Ok(place);
        }
        let place = self.network.protocol().map_or(0, |protocol| protocol.stigmergies);
        let Some(slot) = self.network.stigmergies_mut().get_mut(usize::from(place)) else {
            return Err(self.fail(FaultCode::TooMany));
        };
        *slot = number;
        if let Some(protocol) = self.network.protocol() {
            protocol.stigmergies = place + 1;
        }
        Ok(place)
    }

    /// Asks the neighbours for an entry that is not here.
    fn ask<H: Host<P>>(
        &mut self,
        host: &mut H,
        stigmergy: u8,
        key: Value<P>,
    ) -> Result<(), Stopped> {
        let question = Entry {
            key,
            value: Value::nil(),
            clock: 0,
            robot: self.robot_id,
            state: stigmergy + 1,
        };
        self.send_entry(host, &question)
    }

    /// The function under that key of the table of listeners and handlers, nil if there is none.
    pub(super) fn handler(&self, key: Value<P>) -> Value<P> {
        let handlers = self.overlay(Value::indexed(Tag::LIBRARY, HANDLERS));
        if handlers.is_nil() { handlers } else { self.arena.table_get(handlers.index(), key) }
    }

    /// Sets it; nil removes.
    pub(super) fn set_handler(&mut self, key: Value<P>, function: Value<P>) -> Result<(), Stopped> {
        if !function.is_nil() && function.type_of() != Type::Closure {
            return Err(self.wrong_type(function, function));
        }
        let handlers = self.make_overlay(Value::indexed(Tag::LIBRARY, HANDLERS))?;
        self.table_set(handlers, key, function)
    }

    /// Merges an entry that was heard. True if that takes a call of a handler, which has begun then.
    pub(super) fn merge<H: Host<P>>(
        &mut self,
        host: &mut H,
        remote: &message::Entry<P>,
    ) -> Result<bool, Stopped> {
        let Some(stigmergy) = self.find_stigmergy(remote.stigmergy) else { return Ok(false) };
        let Some(place) = self.find_entry(stigmergy, remote.key) else {
            if remote.clock != 0 {
                match self.new_entry(stigmergy, remote.key) {
                    Some(place) => self.take(place, remote),
                    None => self.pass_on(host, remote)?,
                }
            }
            return Ok(false);
        };
        let Some(local) = self.network.entries().get(place).copied() else { return Ok(false) };
        let stamp = Stamp { clock: remote.clock, robot: remote.owner, value: remote.value };
        let order = stamp.order(&local.stamp());
        if remote.clock == local.clock && remote.owner != local.robot {
            let decides = self.handler(handler(ON_CONFLICT, stigmergy));
            if !decides.is_nil() {
                self.ask_handler(host, decides, &local, remote)?;
                return Ok(true);
            }
            if order == Ordering::Greater && local.robot == self.robot_id {
                self.set_local(LOST, local.value);
                self.take(place, remote);
                return self.tell_lost(host, stigmergy, &local);
            }
        }
        match order {
            Ordering::Greater => self.take(place, remote),
            // The neighbour is behind.
            Ordering::Less => self.mark_news(place),
            Ordering::Equal => {}
        }
        Ok(false)
    }

    /// Puts what was heard in the place of an entry.
    fn take(&mut self, place: usize, remote: &message::Entry<P>) {
        if let Some(entry) = self.network.entries_mut().get_mut(place) {
            entry.value = remote.value;
            entry.clock = remote.clock;
            entry.robot = remote.owner;
        }
        self.mark_news(place);
    }

    fn mark_news(&mut self, place: usize) {
        if let Some(entry) = self.network.entries_mut().get_mut(place) {
            entry.state |= NEWS;
        }
        self.hurry();
    }

    /// Calls the handler of conflicts: f(key, local, remote).
    fn ask_handler<H: Host<P>>(
        &mut self,
        host: &mut H,
        decides: Value<P>,
        local: &Entry<P>,
        remote: &message::Entry<P>,
    ) -> Result<(), Stopped> {
        self.begin_conflict(local, remote);
        self.push(local.key);
        let mine = self.entry_table(local.robot, local.value, local.clock)?;
        self.push(mine);
        let theirs = self.entry_table(remote.owner, remote.value, remote.clock)?;
        self.push(theirs);
        self.call(host, decides, 3, 0)
    }

    /// A table of robot, data and timestamp.
    fn entry_table(
        &mut self,
        robot: u16,
        value: Value<P>,
        clock: u32,
    ) -> Result<Value<P>, Stopped> {
        let clock = clock.min(P::INT_MAX as u32) as i32;
        self.record(
            [string::ROBOT, string::DATA, string::TIMESTAMP],
            [Value::int(i32::from(robot)), value, Value::int(clock)],
        )
    }

    /// Ends a conflict by what the handler said: the winner is stored and sent. True if `onconflictlost` has to run,
    /// which has begun then.
    pub(super) fn settle<H: Host<P>>(
        &mut self,
        host: &mut H,
        verdict: Value<P>,
        stigmergy: u8,
        key: Value<P>,
        clock: u32,
    ) -> Result<bool, Stopped> {
        let mut robot = Value::nil();
        let mut data = Value::nil();
        if verdict.is(Tag::TABLE) {
            robot = self.arena.table_get(verdict.index(), Value::string(string::ROBOT));
            data = self.arena.table_get(verdict.index(), Value::string(string::DATA));
        }
        let place = self.find_entry(stigmergy, key);
        let local = place.and_then(|place| self.network.entries().get(place).copied());
        let (Some(place), Some(local), Some(robot)) = (place, local, robot.as_int()) else {
            self.count(|counters| &mut counters.undecided);
            return Ok(false);
        };
        // The handler may have put something else.
        if local.clock != clock {
            return Ok(false);
        }
        let data = self.sendable(stigmergy, key, data)?;
        self.set_local(LOST, local.value);
        let winner = message::Entry { stigmergy: 0, owner: robot as u16, clock, key, value: data };
        self.take(place, &winner);
        if local.robot == self.robot_id && winner.owner != self.robot_id {
            return self.tell_lost(host, stigmergy, &local);
        }
        Ok(false)
    }

    /// Calls `onconflictlost`, if there is one, with the robot's own entry that lost.
    fn tell_lost<H: Host<P>>(
        &mut self,
        host: &mut H,
        stigmergy: u8,
        lost: &Entry<P>,
    ) -> Result<bool, Stopped> {
        let told = self.handler(handler(ON_CONFLICT_LOST, stigmergy));
        if told.is_nil() {
            return Ok(false);
        }
        self.push(lost.key);
        let mine = self.entry_table(lost.robot, lost.value, lost.clock)?;
        self.push(mine);
        self.call(host, told, 2, 0)?;
        Ok(true)
    }
}

/// The key of a stigmergy's handler.
fn handler<P: Profile>(library: u8, stigmergy: u8) -> Value<P> {
    Value::indexed(Tag::LIBRARY, u16::from_le_bytes([library, stigmergy]))
}
