//! `neighbors`: the robots from which this one receives frames, and snapshots that hold a value for
//! each of them.

use crate::builtin::{self, string};
use crate::bytecode::ByteCode;
use crate::fault::Stopped;
use crate::host::Host;
use crate::machine::Vm;
use crate::network::Sighting;
use crate::number::Profile;
use crate::number::wide::IS_WIDE;
use crate::part::Part;
use crate::slots::Slots;
use crate::value::{Tag, Value};

// Slots of a neighbor: its id, with bits of its swarms in place of a tag; its distance, with the
// step at which it is forgotten in place of a tag; and, if the link measures directions, azimuth
// and elevation.
pub(super) const DISTANCE: usize = 1;
pub(super) const AZIMUTH: usize = 2;
pub(super) const ELEVATION: usize = 3;

/// The bits of the distance's tag that hold the step, which is 0 if there is no neighbor. The
/// other bit belongs to swarm 7.
const STEP: u8 = 0x7f;
/// Steps are counted from 1 to this number, and then from 1 again.
pub(super) const LAST_STEP: u8 = 0x7f;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Makes a robot a neighbor for this number of steps, as if a frame of it had been received:
    /// for hosts that have no link.
    pub fn add_neighbor(&mut self, robot: u16, sighting: &Sighting<P>, steps: u8) {
        self.hear(robot, sighting, steps);
    }

    /// Returns the slots of neighbors: the first, and the one after the last.
    #[hot]
    fn neighbor_slots(&self) -> (usize, usize) {
        (self.network_base(), self.entries_at())
    }

    /// Returns the step at which the neighbor is forgotten, 0 if there is none.
    #[hot]
    pub(super) fn end_step(&self, at: usize) -> u8 {
        self.arena.slots.tag_at(at + DISTANCE).byte() & STEP
    }

    /// Returns the first place whose slots of id and distance meet a condition.
    #[hot]
    fn find_place(&self, is_it: impl Fn([Value<P>; 2]) -> bool) -> Option<usize> {
        let (first, end) = self.neighbor_slots();
        if self.sizes().bearings {
            self.arena.slots.groups::<4>(first, end).position(is_it)
        } else {
            self.arena.slots.groups::<2>(first, end).position(is_it)
        }
    }

    /// Returns the number of neighbors.
    pub(super) fn count_neighbors(&self) -> usize {
        let (mut at, end) = self.neighbor_slots();
        let mut count = 0;
        while at < end {
            count += usize::from(self.end_step(at) != 0);
            at += self.sizes().neighbor();
        }
        count
    }

    /// Returns the first slot of the neighbor at that place.
    #[hot]
    fn neighbor_slot(&self, place: u8) -> usize {
        let mut slots = usize::from(place) * 2;
        if self.sizes().bearings {
            slots *= 2;
        }
        self.network_base() + slots
    }

    /// Returns true if that robot is the neighbor at that place.
    #[hot]
    fn is_neighbor(&self, place: u8, robot: u16) -> bool {
        let at = self.neighbor_slot(place);
        place < self.sizes().neighbors
            && self.arena.index_at(at) as u16 == robot
            && self.end_step(at) != 0
    }

    /// Returns the place of a robot. A robot that is no neighbor becomes one. If there is no room,
    /// it replaces the neighbor that is next to be forgotten.
    #[one_copy]
    fn find_neighbor(&mut self, robot: u16) -> u8 {
        if IS_WIDE {
            // Most senders are known, so the search for the id comes before that for the oldest
            // neighbor.
            let place = self.find_place(|[id, distance]| {
                id.index() as u16 == robot && distance.tag().byte() & STEP != 0
            });
            if let Some(place) = place {
                return place as u8;
            }
        }
        let mut fewest = u8::MAX;
        let mut oldest = 0;
        for place in 0..self.sizes().neighbors {
            if !IS_WIDE && self.is_neighbor(place, robot) {
                return place;
            }
            let mut left = self.end_step(self.neighbor_slot(place));
            if left != 0 && left < self.protocol.step {
                left += LAST_STEP;
            }
            if left < fewest {
                fewest = left;
                oldest = place;
            }
            if IS_WIDE && left == 0 {
                break;
            }
        }
        let at = self.neighbor_slot(oldest);
        self.arena.set(at, Value::indexed(Tag::NIL, robot));
        self.arena.set(at + DISTANCE, Value::nil());
        oldest
    }

    /// Keeps a robot as a neighbor for that number of steps, or for half of it if the robot was
    /// unknown.
    // The name decides on the order of the functions on an AVR, and so on the code that they share:
    // with each of ten longer names a step with eight messages takes 3 % more cycles.
    // As a part of its only caller in a Zooid's image, it saves 199 of 9,717 cycles of a step with eight
    // messages, and 32 bytes.
    #[cfg_attr(all(target_arch = "arm", not(target_has_atomic = "ptr")), inline(always))]
    #[cfg_attr(not(all(target_arch = "arm", not(target_has_atomic = "ptr"))), one_copy)]
    pub(super) fn hear(&mut self, robot: u16, sighting: &Sighting<P>, mut steps: u8) {
        let mut place = self.protocol.last_sender;
        if !self.is_neighbor(place, robot) {
            if self.sizes().neighbors == 0 {
                return;
            }
            place = self.find_neighbor(robot);
            // A robot from which only one frame was received is kept half as long. It gives way to
            // robots with several frames, so that invented ids do not displace these.
            if self.end_step(self.neighbor_slot(place)) == 0 {
                steps /= 2;
            }
        }
        self.protocol.last_sender = place + 1;
        let at = self.neighbor_slot(place);
        let swarm = self.arena.slots.tag_at(at + DISTANCE).byte() & !STEP;
        let mut distance = P::NAN;
        if let Some([measured, azimuth, elevation]) = sighting.place {
            distance = measured.raw();
            if self.sizes().bearings {
                self.arena.set(at + AZIMUTH, azimuth);
                self.arena.set(at + ELEVATION, elevation);
            }
        }
        let mut end = self.protocol.step + steps.clamp(1, LAST_STEP - 1);
        if end > LAST_STEP {
            end -= LAST_STEP;
        }
        let neighbor = Value::marked(swarm | end, distance);
        self.arena.set(at + DISTANCE, neighbor);
    }

    /// Counts a step, and forgets the neighbors that are due.
    pub(super) fn age_neighbors(&mut self) {
        let mut step = self.protocol.step + 1;
        if step > LAST_STEP {
            step = 1;
        }
        self.protocol.step = step;
        if IS_WIDE
            && self.find_place(|[_, distance]| distance.tag().byte() & STEP == step).is_none()
        {
            return;
        }
        let (mut at, end) = self.neighbor_slots();
        while at < end {
            if self.end_step(at) == step {
                let swarm = self.arena.slots.tag_at(at + DISTANCE).byte() & !STEP;
                self.arena.set_tag(at + DISTANCE, swarm);
            }
            at += self.sizes().neighbor();
        }
    }

    /// Stores the membership of the last sender in the swarm at that place.
    pub(super) fn note_swarm(&mut self, swarm: u8, is_member: bool) {
        let Some(place) = self.protocol.last_sender.checked_sub(1) else { return };
        let mut at = self.neighbor_slot(place);
        let mut bit = 1 << swarm;
        // The eighth bit does not fit next to the others, since no tag is 255.
        if swarm == 7 {
            at += DISTANCE;
            bit = !STEP;
        }
        let value = self.arena.get(at);
        let mut bits = value.tag().byte() & !bit;
        if is_member {
            bits |= bit;
        }
        self.arena.set(at, Value::marked(bits, value.raw()));
    }

    /// Returns true if the neighbor at slot `at` is in the swarm at that place.
    pub(super) fn is_kin(&self, at: usize, swarm: u8) -> bool {
        if swarm == 7 {
            return self.arena.get(at + DISTANCE).tag().byte() & !STEP != 0;
        }
        self.arena.get(at).tag().byte() >> swarm & 1 != 0
    }

    /// Returns the first slot of the neighbor with the lowest id that is at least `from`; 0 if
    /// there is none.
    #[one_copy]
    pub(super) fn neighbor_from(&self, from: u16) -> usize {
        let (mut at, end) = self.neighbor_slots();
        let mut found = 0;
        let mut lowest = u16::MAX;
        if IS_WIDE {
            let step = self.sizes().neighbor();
            while at < end {
                // One comparison checks both bounds: an id below `from` wraps around to a large
                // number.
                let robot = self.arena.index_at(at) as u16;
                if robot.wrapping_sub(from) <= lowest.wrapping_sub(from) && self.end_step(at) != 0 {
                    found = at;
                    lowest = robot;
                    if robot == from {
                        break;
                    }
                }
                at += step;
            }
            return found;
        }
        while at < end {
            let robot = self.arena.index_at(at) as u16;
            if self.end_step(at) != 0 && robot >= from && robot <= lowest {
                found = at;
                lowest = robot;
            }
            at += self.sizes().neighbor();
        }
        found
    }

    /// Pushes id and data of the neighbor after the one whose id is in slot `last`, or of the
    /// first if the slot is nil, and puts its id into this slot. Returns the neighbor's first
    /// slot, 0 if there is none.
    pub(super) fn next_neighbor(&mut self, last: usize) -> Result<usize, Stopped> {
        let value = self.arena.get(last);
        let mut from = 0;
        if !value.is_nil() {
            from = (value.index() as u16).wrapping_add(1);
            if from == 0 {
                return Ok(0);
            }
        }
        let at = self.neighbor_from(from);
        if at != 0 {
            let robot = Value::indexed(Tag::INT, self.arena.index_at(at) as u16);
            self.arena.set(last, robot);
            self.push(robot);
            let data = self.neighbor_data(at)?;
            self.push(data);
        }
        Ok(at)
    }

    /// Returns a table of distance, azimuth and elevation of a neighbor.
    fn neighbor_data(&mut self, at: usize) -> Result<Value<P>, Stopped> {
        let mut values = [Value::nil(); 3];
        let distance = self.arena.get(at + DISTANCE).raw();
        if distance != P::NAN {
            values = [
                Value::new(Tag::FLOAT, distance),
                Value::new(Tag::FLOAT, P::ZERO),
                Value::new(Tag::FLOAT, P::ZERO),
            ];
            if self.sizes().bearings {
                values[1] = self.arena.get(at + AZIMUTH);
                values[2] = self.arena.get(at + ELEVATION);
            }
        }
        self.record([string::DISTANCE, string::AZIMUTH, string::ELEVATION], values)
    }

    /// Returns a table of three values under constant strings.
    #[one_copy]
    pub(super) fn record(
        &mut self,
        keys: [u16; 3],
        values: [Value<P>; 3],
    ) -> Result<Value<P>, Stopped> {
        // A collection finds the values on the stack.
        let first = usize::from(self.sp);
        if IS_WIDE {
            self.ensure(first + 3)?;
            self.sp = first as u16 + 3;
        } else {
            self.reserve(3)?;
        }
        for (number, value) in values.into_iter().enumerate() {
            self.arena.set(first + number, value);
        }
        let table = self.allocate(|vm| vm.arena.new_record(keys, first))?;
        self.sp = first as u16;
        Ok(table)
    }

    /// Computes a function of `neighbors` or of a snapshot, except those of kind `Calls`; `a` is
    /// the first argument.
    #[one_copy]
    pub(in crate::machine) fn neighbor_builtin<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        count: u8,
        a: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        match number {
            builtin::NEIGHBORS_COUNT if Self::has(Part::Neighbors) => {
                Ok(Value::int(self.count_neighbors() as i32))
            }
            builtin::NEIGHBORS_GET if Self::has(Part::Neighbors) => {
                let Some(id) = a.as_int() else { return Err(self.wrong_type(a, a)) };
                // In `full`, a negative id has the low bits of a valid one, so its upper bits are
                // checked below.
                let at = self.neighbor_from(id as u16);
                let found = at != 0 && self.arena.index_at(at) as u16 == id as u16;
                if !found || P::FULL && id >> 16 != 0 {
                    return Ok(Value::nil());
                }
                self.neighbor_data(at)
            }
            builtin::SNAPSHOT_GET | builtin::SNAPSHOT_COUNT if !a.is(Tag::SNAPSHOT) => {
                Err(self.wrong_type(a, a))
            }
            builtin::SNAPSHOT_COUNT => Ok(Value::int(self.table_size(a) as i32)),
            builtin::SNAPSHOT_GET => {
                let id = self.argument(1, count);
                if !id.is(Tag::INT) {
                    return Err(self.wrong_type(id, id));
                }
                Ok(self.arena.table_get(a.index(), id))
            }
            _ if !Self::has(Part::Messages) => Ok(Value::nil()),
            _ => self.talk(host, number, a, self.argument(1, count)),
        }
    }

    /// Returns true if `kin` or `nonkin`, given by its number, includes the neighbor whose id and
    /// data are on top of the stack. The swarm is that of the running `exec`; outside of it all
    /// neighbors are kin.
    #[one_copy]
    pub(in crate::machine) fn is_chosen(&self, number: u8) -> bool {
        let at = self.neighbor_from(self.top(2).index() as u16);
        let is_kin = self.current_swarm(0).is_none_or(|swarm| self.is_kin(at, swarm));
        is_kin == (number == builtin::NEIGHBORS_KIN)
    }
}
