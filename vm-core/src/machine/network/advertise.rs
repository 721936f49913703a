//! Advertising: the timers by which a robot sends entries of stigmergies, swarms and beacons.
//!
//! Equal replicas are silent. A beacon carries a digest of the sender's entries. While the
//! neighbors' digests are equal to its own, a robot sends no entry. A digest that differs makes it
//! advertise all its entries once, one after the other, at intervals that grow as in Trickle (RFC
//! 6206): they are short after a change and long when nothing is new. A random part is added to
//! each, and they grow further when a neighbor shows that it has the same entry.
//!
//! A robot whose store has no room for the keys of the others can never equal them. It signals this
//! by beacons without a digest. Near such a robot entries are advertised at a low constant rate,
//! since no digest shows when to stop. Entries for which a robot has no room are relayed, also at a
//! low rate, and set no timer. However many there are, they cost each robot at most one frame in
//! [`RELAY_PAUSE`] steps.

use super::protocol::{Count, DIGEST_KNOWN, Timer};
use super::swarms::NEWS;
use crate::builtin::Feature;
use crate::bytecode::ByteCode;
use crate::hash::fnv_1a;
use crate::host::Host;
use crate::machine::Vm;
use crate::message::frame::Frame;
use crate::message::{StigmergyEntry, Swarms};
use crate::number::Profile;
use crate::part::Part;
use crate::value::Value;

/// The shortest time between two advertisements, in steps.
const INTERVAL_MIN: u8 = 2;
/// From this interval on the newest entry is no longer advertised in addition to the others.
const LONG_INTERVAL: u8 = 10;
/// Next to robots that have no digest, one turn out of this number advertises an entry although no
/// digest differs.
const SLOW_TURNS: u8 = 4;
/// Steps between two entries that are relayed without being kept. A random number of steps, at most
/// half as many, is added.
const RELAY_PAUSE: u8 = 64;
/// The most entries that are sent when an entry point ends. The others follow when the next ones
/// end, so that no step takes the time of a whole store.
const NEWS_MAX: u8 = 4;
/// Steps after which the age of a deleted entry grows by one.
const AGE_STEPS: u16 = 16;
/// Steps after which one more answer may be sent at once, up to [`NEWS_MAX`].
const ANSWER_STEPS: u16 = 2;
/// Steps after which a robot may put again one more of the entries from before its restart.
const RECLAIM_STEPS: u16 = 256;
/// Steps after which a robot whose store had no room compares digests again. Otherwise one forged
/// entry of an unknown stigmergy would prevent comparisons for ever.
const RETRY_STEPS: u16 = 1024;
/// The age at which a deleted entry frees its place: 64 s at ten steps per second.
pub(super) const FORGOTTEN: u16 = 40;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Sends the entries and swarms that the ending entry point has changed, at most [`NEWS_MAX`]
    /// entries.
    #[one_copy]
    pub(super) fn flush_stigmergy<H: Host<P>>(&mut self, host: &mut H) {
        self.protocol.has_dirty_entries = false;
        let mut left = NEWS_MAX;
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            let state = self.entry_state(at);
            if state & NEWS != 0 {
                if left == 0 {
                    self.protocol.has_dirty_entries = true;
                    break;
                }
                left -= 1;
                if self.send_entry_at(host, at) {
                    self.set_entry_state(at, state & !NEWS);
                } else {
                    self.protocol.has_dirty_entries = true;
                }
            }
        }
        for place in 0..self.sizes().swarms {
            let at = self.swarm_slot(place);
            let swarm = self.arena.get(at);
            let state = swarm.tag().byte();
            if state & NEWS != 0 {
                self.arena.set(at, Value::marked(state & !NEWS, swarm.raw()));
                self.send_swarm(host, place);
            }
        }
    }

    /// Sends the robot's membership of the swarm at that place.
    fn send_swarm<H: Host<P>>(&mut self, host: &mut H, place: u8) {
        let mut swarms = Swarms::default();
        let number = self.arena.index_at(self.swarm_slot(place)) as u16;
        swarms.push(number, self.is_member(place));
        let mut frame = Frame::EMPTY;
        frame.put_swarms(self.robot_id, &swarms);
        self.send(host, &mut frame);
    }

    /// Notes that an entry has changed: for a while it is advertised often.
    pub(super) fn hurry(&mut self, at: usize) {
        self.protocol.newest = at as u16;
        self.advertise_soon();
    }

    /// Makes the next advertisement due soon, and the following ones frequent for a while.
    #[one_copy]
    fn advertise_soon(&mut self) {
        let protocol = &mut self.protocol;
        protocol.interval = INTERVAL_MIN;
        protocol.set_timer(Timer::Advertise, protocol.timer(Timer::Advertise).min(INTERVAL_MIN));
    }

    /// Answers a neighbor that has an older value of an entry, or asks for it. The entry is sent
    /// when the step ends, unless many answers were sent shortly before, and advertised often for a
    /// while. The limit prevents a robot that sends old entries from filling the channel with
    /// answers.
    pub(super) fn answer(&mut self, at: usize) {
        if self.protocol.answers != 0 {
            self.protocol.answers -= 1;
            self.set_entry_state(at, self.entry_state(at) | NEWS);
            self.protocol.has_dirty_entries = true;
        }
        self.hurry(at);
    }

    /// Advances all timers by a step, and sends the messages that are due.
    #[one_copy]
    pub(super) fn keep_in_touch<H: Host<P>>(&mut self, host: &mut H) {
        let periods = host.periods();
        if Self::has(Part::Stigmergy) {
            self.grow_older();
        }
        let protocol = &mut self.protocol;
        protocol.tick();
        #[allow(clippy::implicit_saturating_add, reason = "an AVR has no conditional moves")]
        if protocol.silent != u8::MAX {
            protocol.silent += 1;
        }
        let advertises = protocol.timer(Timer::Advertise) == 0 && protocol.shares;
        if advertises {
            // The intervals grow, and their random part keeps robots from sending at the same time.
            let random = self.random();
            let protocol = &mut self.protocol;
            let interval = protocol.interval.max(INTERVAL_MIN);
            protocol.set_timer(Timer::Advertise, interval.wrapping_add(random & (interval >> 1)));
            protocol.interval = (interval + (random & 1)).min(periods.advertise);
        }
        let is_silent = Self::has(Part::Neighbors)
            && self.protocol.silent >= periods.beacon
            && self.header.features() & (Feature::Neighbors as u8 | Feature::Swarm as u8) != 0;
        // The digest goes before all entries. A neighbor that lacks nothing sends no entries until
        // it sees this digest, and meanwhile its own digest may keep this robot sending entries for
        // ever.
        let is_compared = Self::has(Part::Stigmergy)
            && advertises
            && self.is_comparable()
            && self.protocol.timer(Timer::Digest) == 0;
        if is_silent || is_compared {
            self.send_beacon(host);
            // Robots that were switched on at the same time drift apart by the random bit.
            self.protocol.silent = self.random() & 1;
        }
        if Self::HAS_SHARED_STATE && advertises {
            self.advertise(host);
        }
    }

    /// Returns a random byte, from a generator that is not the script's.
    fn random(&mut self) -> u8 {
        self.protocol.jitter = self.protocol.jitter.wrapping_mul(25173).wrapping_add(13849);
        let [_, random] = self.protocol.jitter.to_le_bytes();
        random
    }

    /// Sends a beacon, with the digest if the digest can be compared.
    fn send_beacon<H: Host<P>>(&mut self, host: &mut H) {
        let mut frame = Frame::EMPTY;
        if Self::has(Part::Stigmergy) && self.is_comparable() {
            let digest = self.digest();
            frame.put_digest(self.robot_id, digest);
            self.protocol.set_timer(Timer::Digest, host.periods().advertise);
        } else {
            frame.put_beacon(self.robot_id);
        }
        self.send(host, &mut frame);
    }

    /// Returns true if the robot keeps all entries of its stigmergies that it receives.
    fn is_comparable(&self) -> bool {
        self.protocol.stigmergies != 0 && !self.protocol.has_dropped
    }

    /// Sends the newest entry until enough neighbors are known to have it. Also sends the next
    /// swarm, or the next entry if neighbors may lack entries.
    fn advertise<H: Host<P>>(&mut self, host: &mut H) {
        let newest = usize::from(self.protocol.newest);
        let mut sent = 0;
        if newest != 0 && self.protocol.interval < LONG_INTERVAL && self.entry_state(newest) != 0 {
            self.send_entry_at(host, newest);
            sent = newest;
        }
        self.protocol.turn = self.protocol.turn.wrapping_add(1);
        let mut has_entries = self.protocol.unadvertised != 0;
        if has_entries {
            self.protocol.unadvertised -= 1;
        } else if self.protocol.turn.is_multiple_of(SLOW_TURNS) {
            has_entries = self.protocol.has_dropped || self.protocol.meets_beacon;
            self.protocol.meets_beacon = false;
        }
        let entries = self.sizes().entries;
        let all = entries + self.sizes().swarms;
        for _ in 0..all {
            let mut place = self.protocol.advertised + 1;
            if place >= all {
                place = 0;
            }
            self.protocol.advertised = place;
            if place >= entries {
                let place = place - entries;
                if self.arena.get(self.swarm_slot(place)).tag() != crate::value::Tag::NIL {
                    return self.send_swarm(host, place);
                }
            } else if has_entries {
                let at = self.entry_slot(place);
                if self.entry_state(at) != 0 && at != sent {
                    self.send_entry_at(host, at);
                    return;
                }
            }
        }
    }

    /// Sends the entry whose first slot is `at`. Returns false if the host has no room for it.
    fn send_entry_at<H: Host<P>>(&mut self, host: &mut H, at: usize) -> bool {
        let (entry, digest) = self.entry_message(at);
        self.send_entry(host, &entry, digest)
    }

    /// Compares a neighbor's digest with the robot's own one. `None` stands for a beacon without a
    /// digest.
    #[one_copy]
    pub(super) fn compare(&mut self, theirs: Option<u32>) {
        let Some(theirs) = theirs else {
            self.protocol.meets_beacon = true;
            return;
        };
        if !self.is_comparable() || theirs == self.digest() {
            return;
        }
        if self.protocol.unadvertised == 0 {
            self.advertise_soon();
        }
        let used = |place: &u8| self.entry_state(self.entry_slot(*place)) != 0;
        self.protocol.unadvertised = (0..self.sizes().entries).filter(used).count() as u8;
    }

    /// Returns the sum of the hashes of all entries, of 24 bits. Deleted entries are not included,
    /// since robots forget them at different times.
    fn digest(&mut self) -> u32 {
        if self.protocol.digest & DIGEST_KNOWN == 0 {
            let mut sum = 0_u32;
            for place in 0..self.sizes().entries {
                let at = self.entry_slot(place);
                let (entry, digest) = self.entry_message(at);
                if self.entry_state(at) != 0 && !entry.value.is_nil() {
                    sum = sum.wrapping_add(hash(&entry, digest));
                }
            }
            self.protocol.digest = (sum & 0x00ff_ffff) | DIGEST_KNOWN;
        }
        self.protocol.digest & !DIGEST_KNOWN
    }

    /// Handles an entry for which there is no room: counts it, and relays it if none was relayed
    /// for a while.
    #[one_copy]
    pub(super) fn relay<H: Host<P>>(
        &mut self,
        host: &mut H,
        entry: &StigmergyEntry<P>,
        digest: u16,
    ) {
        self.protocol.count(Count::NotKept);
        // A digest does not include deletions.
        self.protocol.has_dropped |= !entry.value.is_nil();
        let hash = hash(entry, digest) as u16;
        if self.protocol.timer(Timer::Relay) != 0 || self.protocol.relayed == hash {
            return;
        }
        self.protocol.relayed = hash;
        let pause = RELAY_PAUSE + (self.random() & (RELAY_PAUSE / 2 - 1));
        self.protocol.set_timer(Timer::Relay, pause);
        self.send_entry(host, entry, digest);
    }

    /// Advances the pauses, and the age of deleted entries.
    fn grow_older(&mut self) {
        let protocol = &mut self.protocol;
        protocol.age = protocol.age.wrapping_add(1);
        if protocol.age.is_multiple_of(ANSWER_STEPS) && protocol.answers < NEWS_MAX {
            protocol.answers += 1;
        }
        if protocol.age.is_multiple_of(RECLAIM_STEPS) && protocol.reclaimed != 0 {
            protocol.reclaimed -= 1;
        }
        if protocol.age.is_multiple_of(RETRY_STEPS) {
            protocol.has_dropped = false;
        }
        if protocol.age.is_multiple_of(AGE_STEPS) {
            self.forget_deleted();
        }
    }
}

/// Returns the hash of an entry: FNV-1a over its frame. A digest stands for key and value if they
/// do not fit a frame.
#[one_copy]
fn hash<P: Profile>(entry: &StigmergyEntry<P>, digest: u16) -> u32 {
    let mut frame = Frame::EMPTY;
    let _ = frame.put_entry(entry, digest);
    let hash = fnv_1a(frame.bytes_mut());
    // A product carries upwards only, so its lower bits alone are mixed badly.
    hash ^ hash >> 15
}
