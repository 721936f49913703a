//! `neighbors`: robots that were heard, and snapshots of what is kept for each.

use super::Vm;
use crate::builtin::{self, string};
use crate::bytecode::ByteCode;
use crate::fault::Stopped;
use crate::host::Host;
use crate::network::{Network, Sighting};
use crate::number::Profile;
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize, N: Network<P>> Vm<P, C, SLOTS, N> {
    /// Makes a robot a neighbour for so many steps, as if a frame of its had been received: for hosts that have no link.
    pub fn meet(&mut self, robot: u16, sighting: &Sighting<P>, steps: u8) {
        self.hear(robot, sighting, steps);
    }

    /// Remembers for so many steps that a robot was heard. If there is no room, who was not heard for the longest time is forgotten.
    pub(super) fn hear(&mut self, robot: u16, sighting: &Sighting<P>, steps: u8) {
        let mut place = 0;
        let mut fewest = u8::MAX;
        for (index, neighbor) in self.network.neighbors().iter().enumerate() {
            if neighbor.steps_left != 0 && neighbor.robot == robot {
                place = index;
                break;
            }
            if neighbor.steps_left < fewest {
                fewest = neighbor.steps_left;
                place = index;
            }
        }
        let [distance, azimuth, elevation] = match &sighting.place {
            Some(place) => place.map(Value::raw),
            None => [P::float_from_f32(f32::NAN); 3],
        };
        if let Some(neighbor) = self.network.neighbors().get_mut(place) {
            if neighbor.steps_left == 0 || neighbor.robot != robot {
                neighbor.robot = robot;
                neighbor.swarms = 0;
            }
            neighbor.steps_left = steps;
            neighbor.distance = distance;
        }
        if let Some(bearing) = self.network.bearings().get_mut(place) {
            *bearing = [azimuth, elevation];
        }
    }

    /// A step has passed.
    pub(super) fn age_neighbors(&mut self) {
        for neighbor in self.network.neighbors() {
            neighbor.steps_left = neighbor.steps_left.saturating_sub(1);
        }
    }

    /// The neighbour with the lowest id that is at least `from`, with its place among the neighbours.
    fn neighbor_from(&mut self, from: u16) -> Option<(usize, u16)> {
        let mut found: Option<(usize, u16)> = None;
        for (index, neighbor) in self.network.neighbors().iter().enumerate() {
            if neighbor.steps_left != 0
                && neighbor.robot >= from
                && found.is_none_or(|(_, robot)| neighbor.robot < robot)
            {
                found = Some((index, neighbor.robot));
            }
        }
        found
    }

    /// Pushes id and data of the neighbour that comes after the one whose id is in slot `at` (nil: of the first), and
    /// puts its id there. False if there is none.
    pub(super) fn next_neighbor(&mut self, at: usize) -> Result<bool, Stopped> {
        let last = self.arena.get(at);
        let from = if last.is_nil() { 0 } else { (last.index() as u16).wrapping_add(1) };
        if !last.is_nil() && from == 0 {
            return Ok(false);
        }
        let Some((index, robot)) = self.neighbor_from(from) else { return Ok(false) };
        self.arena.set(at, Value::indexed(Tag::INT, robot));
        self.push(Value::int(i32::from(robot)));
        let data = self.neighbor_data(index)?;
        self.push(data);
        Ok(true)
    }

    /// A table of distance, azimuth and elevation of a neighbour.
    fn neighbor_data(&mut self, index: usize) -> Result<Value<P>, Stopped> {
        let mut values = [Value::nil(); 3];
        let distance = self.network.neighbors().get(index).map_or(P::ZERO, |n| n.distance);
        if distance != P::float_from_f32(f32::NAN) {
            let [azimuth, elevation] =
                self.network.bearings().get(index).copied().unwrap_or([P::ZERO; 2]);
            values = [distance, azimuth, elevation].map(|raw| Value::new(Tag::FLOAT, raw));
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
    pub(super) fn neighbor_builtin<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        first: usize,
        end: usize,
        a: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        match number {
            builtin::NEIGHBORS_COUNT => {
                let neighbors = self.network.neighbors().iter();
                let count = neighbors.filter(|neighbor| neighbor.steps_left != 0).count();
                Ok(Value::int(count as i32))
            }
            builtin::NEIGHBORS_GET => {
                let Some(id) = a.as_int() else { return Err(self.wrong_type(a, a)) };
                match self.neighbor_from(id as u16) {
                    Some((index, robot)) if Value::<P>::int(i32::from(robot)).same(a) => {
                        self.neighbor_data(index)
                    }
                    _ => Ok(Value::nil()),
                }
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
    fn kin(&mut self, wanted: bool) -> Result<Value<P>, Stopped> {
        let swarm = self.current_swarm(0);
        let base = usize::from(self.sp);
        // The snapshot, where the iteration is, and a neighbour.
        self.reserve(4)?;
        self.sp = base as u16 + 2;
        let table = self.new_table()?;
        self.arena.set(base, table);
        while self.next_neighbor(base + 1)? {
            let robot = self.arena.get(base + 1).index() as u16;
            let is_kin = match swarm {
                Some(swarm) => self.network.neighbors().iter().any(|neighbor| {
                    neighbor.steps_left != 0
                        && neighbor.robot == robot
                        && neighbor.swarms >> swarm & 1 != 0
                }),
                None => true,
            };
            if is_kin == wanted {
                self.table_set(table, self.top(2), self.top(1))?;
            }
            self.sp = base as u16 + 2;
        }
        self.sp = base as u16;
        Ok(Value::indexed(Tag::SNAPSHOT, table.index() as u16))
    }
}
