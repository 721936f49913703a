//! `neighbors`: robots that were heard, and snapshots of what is kept for each.

use super::Vm;
use crate::builtin::{self, string};
use crate::bytecode::ByteCode;
use crate::fault::Stopped;
use crate::host::Host;
use crate::network::{ENTRY, Sighting};
use crate::number::Profile;
use crate::slots::Slots;
use crate::value::{Tag, Value};

// Slots of a neighbour: its id, with bits of its swarms in place of a tag; its distance, with the steps until it is
// forgotten; and where directions are known these two.
const DISTANCE: usize = 1;
const AZIMUTH: usize = 2;
const ELEVATION: usize = 3;

/// The bits of the tag that are steps; the other is that of swarm 7.
const STEPS: u8 = 0x7f;
/// Most steps.
const STEPS_MAX: u8 = 126;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Makes a robot a neighbour for so many steps, as if a frame of its had been received: for hosts that have no link.
    pub fn meet(&mut self, robot: u16, sighting: &Sighting<P>, steps: u8) {
        self.hear(robot, sighting, steps);
    }

    /// The first slot of the neighbour at that place.
    #[inline(never)]
    fn neighbor_slot(&self, place: usize) -> usize {
        let sizes = &self.protocol.sizes;
        usize::from(self.others)
            + usize::from(sizes.entries) * (ENTRY + 1)
            + usize::from(sizes.swarms)
            + place * sizes.neighbor()
    }

    /// Steps until it is forgotten; 0: there is none.
    #[inline(never)]
    fn steps_left(&self, at: usize) -> u8 {
        self.arena.slots.tag_at(at + DISTANCE).byte() & STEPS
    }

    /// How many there are.
    pub(super) fn count_neighbors(&self) -> usize {
        let all = 0..usize::from(self.protocol.sizes.neighbors);
        all.filter(|place| self.steps_left(self.neighbor_slot(*place)) != 0).count()
    }

    /// The first slot of a robot that is a neighbour, 0 if it is none.
    #[inline(never)]
    fn find_neighbor(&mut self, robot: u16) -> usize {
        // Frames often come in the order in which they came before.
        let mut place = self.protocol.heard;
        for _ in 0..self.protocol.sizes.neighbors {
            place += 1;
            if place >= self.protocol.sizes.neighbors {
                place = 0;
            }
            let at = self.neighbor_slot(place.into());
            if self.arena.index_at(at) as u16 == robot && self.steps_left(at) != 0 {
                self.protocol.heard = place;
                return at;
            }
        }
        0
    }

    /// Remembers for so many steps that a robot was heard. If there is no room, who was not heard for the longest time is
    /// forgotten.
    #[inline(never)]
    pub(super) fn hear(&mut self, robot: u16, sighting: &Sighting<P>, steps: u8) {
        let mut at = self.find_neighbor(robot);
        if at == 0 {
            let mut fewest = u8::MAX;
            for place in 0..usize::from(self.protocol.sizes.neighbors) {
                let here = self.neighbor_slot(place);
                let left = self.steps_left(here);
                if left < fewest {
                    fewest = left;
                    at = here;
                }
            }
            if at == 0 {
                return;
            }
            self.arena.set(at, Value::indexed(Tag::NIL, robot));
            self.arena.set(at + DISTANCE, Value::nil());
        }
        let swarm = self.arena.get(at + DISTANCE).tag().byte() & !STEPS;
        let mut distance = P::NAN;
        if let Some([measured, azimuth, elevation]) = sighting.place {
            distance = measured.raw();
            if self.protocol.sizes.bearings {
                self.arena.set(at + AZIMUTH, azimuth);
                self.arena.set(at + ELEVATION, elevation);
            }
        }
        let neighbor = Value::marked(swarm | steps.min(STEPS_MAX), distance);
        self.arena.set(at + DISTANCE, neighbor);
    }

    /// A step has passed.
    pub(super) fn age_neighbors(&mut self) {
        let mut at = self.neighbor_slot(0) + DISTANCE;
        for _ in 0..self.protocol.sizes.neighbors {
            let tag = self.arena.slots.tag_at(at);
            if tag.byte() & STEPS != 0 {
                self.arena.set_tag(at, tag.byte() - 1);
            }
            at += self.protocol.sizes.neighbor();
        }
    }

    /// Notes whether a neighbour is in the swarm at that place.
    pub(super) fn note_swarm(&mut self, robot: u16, swarm: u8, is_member: bool) {
        let mut at = self.find_neighbor(robot);
        if at == 0 {
            return;
        }
        let mut bit = 1 << swarm;
        // The eighth has no room beside the others: no tag is 255.
        if swarm == 7 {
            at += DISTANCE;
            bit = !STEPS;
        }
        let value = self.arena.get(at);
        let mut bits = value.tag().byte() & !bit;
        if is_member {
            bits |= bit;
        }
        self.arena.set(at, Value::marked(bits, value.raw()));
    }

    /// Whether a neighbour is in the swarm at that place.
    fn is_kin(&self, at: usize, swarm: u8) -> bool {
        if swarm == 7 {
            return self.arena.get(at + DISTANCE).tag().byte() & !STEPS != 0;
        }
        self.arena.get(at).tag().byte() >> swarm & 1 != 0
    }

    /// The first slot of the neighbour with the lowest id that is at least `from`; 0 if there is none.
    #[inline(never)]
    fn neighbor_from(&self, from: u16) -> usize {
        let mut found = 0;
        let mut lowest = u16::MAX;
        for place in 0..usize::from(self.protocol.sizes.neighbors) {
            let at = self.neighbor_slot(place);
            let robot = self.arena.index_at(at) as u16;
            if self.steps_left(at) != 0 && robot >= from && robot <= lowest {
                found = at;
                lowest = robot;
            }
        }
        found
    }

    /// Pushes id and data of the neighbour that comes after the one whose id is in slot `last` (nil: of the first), and
    /// puts its id there. Its first slot, 0 if there is none.
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

    /// A table of distance, azimuth and elevation of a neighbour.
    fn neighbor_data(&mut self, at: usize) -> Result<Value<P>, Stopped> {
        let mut values = [Value::nil(); 3];
        let distance = self.arena.get(at + DISTANCE).raw();
        if distance != P::NAN {
            values = [
                Value::new(Tag::FLOAT, distance),
                Value::new(Tag::FLOAT, P::ZERO),
                Value::new(Tag::FLOAT, P::ZERO),
            ];
            if self.protocol.sizes.bearings {
                values[1] = self.arena.get(at + AZIMUTH);
                values[2] = self.arena.get(at + ELEVATION);
            }
        }
        self.record([string::DISTANCE, string::AZIMUTH, string::ELEVATION], values)
    }

    /// A table of three values under constant strings.
    #[inline(never)]
    pub(super) fn record(
        &mut self,
        keys: [u16; 3],
        values: [Value<P>; 3],
    ) -> Result<Value<P>, Stopped> {
        // On the stack, where a collection finds them.
        let first = usize::from(self.sp);
        self.reserve(4)?;
        for (number, value) in values.into_iter().enumerate() {
            self.arena.set(first + number, value);
        }
        let table = self.new_table()?;
        self.set_top(table);
        for (number, key) in keys.into_iter().enumerate() {
            let value = self.arena.get(first + number);
            self.table_set(table, Value::string(key), value)?;
        }
        self.sp = first as u16;
        Ok(table)
    }

    /// Functions of `neighbors` and of snapshots that have their result at once; `a` is the first argument.
    #[inline(never)]
    pub(super) fn neighbor_builtin<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        first: usize,
        end: usize,
        a: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        match number {
            builtin::NEIGHBORS_COUNT => Ok(Value::int(self.count_neighbors() as i32)),
            builtin::NEIGHBORS_GET => {
                let Some(id) = a.as_int() else { return Err(self.wrong_type(a, a)) };
                // Of a negative id, which none has in `full`, the bits are those of another.
                let at = self.find_neighbor(id as u16);
                if at == 0 || P::FULL && id >> 16 != 0 {
                    return Ok(Value::nil());
                }
                self.neighbor_data(at)
            }
            builtin::NEIGHBORS_KIN | builtin::NEIGHBORS_NONKIN => {
                self.kin(number == builtin::NEIGHBORS_KIN)
            }
            builtin::SNAPSHOT_GET | builtin::SNAPSHOT_COUNT if !a.is(Tag::SNAPSHOT) => {
                Err(self.wrong_type(a, a))
            }
            builtin::SNAPSHOT_COUNT => Ok(Value::int(self.table_size(a) as i32)),
            builtin::SNAPSHOT_GET => {
                let id = self.argument(first + 1, end);
                if !id.is(Tag::INT) {
                    return Err(self.wrong_type(id, id));
                }
                Ok(self.arena.table_get(a.index(), id))
            }
            _ => self.talk(host, number, a, self.argument(first + 1, end)),
        }
    }

    /// A snapshot of the neighbours that are in the swarm of the running `exec`, or of those that are not.
    #[inline(never)]
    fn kin(&mut self, wanted: bool) -> Result<Value<P>, Stopped> {
        let swarm = self.current_swarm(0);
        let base = usize::from(self.sp);
        // The snapshot, where the iteration is, and a neighbour.
        self.reserve(4)?;
        self.sp = base as u16 + 2;
        let table = self.new_table()?;
        self.arena.set(base, table);
        loop {
            let at = self.next_neighbor(base + 1)?;
            if at == 0 {
                break;
            }
            let is_kin = swarm.is_none_or(|swarm| self.is_kin(at, swarm));
            if is_kin == wanted {
                self.table_set(table, self.top(2), self.top(1))?;
            }
            self.sp = base as u16 + 2;
        }
        self.sp = base as u16;
        Ok(Value::indexed(Tag::SNAPSHOT, table.index() as u16))
    }
}
