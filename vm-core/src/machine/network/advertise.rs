//! Advertising: the timers by which a robot sends entries of stigmergies, swarms and beacons.
//!
//! Equal replicas are silent. A beacon carries a digest of the sender's entries. While the
//! neighbors' digests are equal to its own, a robot sends no entry. A digest that differs makes it
//! advertise all its entries once, one after the other, at intervals that grow as in Trickle (RFC
//! 6206): they are short after a change and long when nothing is new. A random part is added to
//! each, and they grow further when a neighbor shows that it has the same entry. A neighbor that
//! hears no robot sends the same digest for ever: the pauses before all entries are repeated for it
//! double.
//!
//! A robot whose store has no room for the keys of the others can never equal them. It signals this
//! by beacons without a digest. Near such a robot entries are advertised at a low constant rate,
//! since no digest shows when to stop. Entries for which a robot has no room are relayed, also at a
//! low rate, and set no timer. However many there are, they cost each robot at most one frame in
//! [`RELAY_PAUSE`] steps.

use super::entries::{CLOCK, OWN};
use super::protocol::{ALONE, COMPARED, Count, DIGEST_BITS, DIGEST_KNOWN, Flag, Timer};
use super::swarms::NEWS;
use crate::builtin::Feature;
use crate::bytecode::ByteCode;
use crate::hash::fnv_1a;
use crate::host::Host;
use crate::machine::Vm;
use crate::message::frame::Frame;
use crate::message::{StigmergyEntry, Swarms};
use crate::network::{HAS_MANY_PLACES, Places};
use crate::number::Profile;
use crate::part::Part;
use crate::stamp::is_earlier;
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
pub(in crate::machine) const NEWS_MAX: u8 = 4;
/// A turn advertises one more entry for each 64 entries that are still to be advertised.
const BURST_ENTRIES: Places = 64;
/// The most entries that a turn advertises in addition to one.
const BURST_MAX: Places = 7;
/// Steps after which the age of a deleted entry grows by one.
const AGE_STEPS: u16 = 16;
/// Steps after which one more answer may be sent at once, up to [`NEWS_MAX`].
const ANSWER_STEPS: u16 = 2;
/// Steps after which the first answer may be sent when all have been used up: most of them had no
/// effect.
const USED_UP_STEPS: u16 = 16;
/// The shortest and the longest time between two rounds of all entries for a neighbor whose digest
/// stays another one. It doubles with each round: a neighbor that hears no robot never changes.
const HELP_MIN: u8 = 4;
const HELP_MAX: u8 = 128;
/// Steps after which a robot may put again one more of the entries from before its restart.
const RECLAIM_STEPS: u16 = 256;
/// Steps after which a robot whose store had no room compares digests again. Otherwise one forged
/// entry of an unknown stigmergy would prevent comparisons for ever.
const RETRY_STEPS: u16 = 1024;
/// The age from which on a deleted entry is no longer advertised, and another entry may take its
/// place: 64 s at ten steps per second.
pub(super) const FORGOTTEN: u16 = 40;
/// Steps for which a robot remembers that a neighbor has another clock floor.
const DISTRUST_STEPS: u8 = 50;
/// The pause before the next round for a neighbor, see [`HELP_MAX`], from which on a robot no longer
/// heeds that their clock floors differ. Two that wait for each other would wait for ever.
const DISTRUST_PAUSE: u8 = 64;
/// Steps in which two groups that meet exchange their entries. A robot that lacks an entry when the
/// floor rises has lacked it for longer: it was put before a deletion that is [`FORGOTTEN`].
const MEETING_STEPS: u8 = 250;

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
                if self.send_news(host, at) {
                    self.set_entry_state(at, state & !NEWS);
                } else {
                    self.protocol.has_dirty_entries = true;
                }
            }
        }
        self.flush_swarms(host);
    }

    /// Does what [`Vm::flush_stigmergy`] does, from the entry at `place` on, but sends only one
    /// entry, since it takes long to write a table. `left` is the number of entries that may still
    /// be sent. Returns true if this has to go on, from `place` on.
    pub(in crate::machine) fn flush_next<H: Host<P>>(
        &mut self,
        host: &mut H,
        place: &mut u16,
        left: u16,
    ) -> bool {
        #[allow(clippy::useless_conversion, reason = "on a small chip it is a byte")]
        while *place < u16::from(self.sizes().entries) {
            let at = self.entry_slot(*place as Places);
            *place += 1;
            let state = self.entry_state(at);
            if state & NEWS != 0 {
                if left == 0 {
                    self.protocol.has_dirty_entries = true;
                    break;
                }
                if self.send_news(host, at) {
                    self.set_entry_state(at, state & !NEWS);
                } else {
                    self.protocol.has_dirty_entries = true;
                }
                return true;
            }
        }
        self.flush_swarms(host);
        false
    }

    /// Sends an entry that has changed. Returns false if this has to be tried again, since the host has
    /// no room for it.
    ///
    /// A long entry of another robot is left to the next advertisements. All neighbors of that robot
    /// have received it at the same time: their copies would fill the air for as many frames as the
    /// entry has fragments, and the robots' own entries would have to wait.
    #[hot]
    fn send_news<H: Host<P>>(&mut self, host: &mut H, at: usize) -> bool {
        let is_own = self.arena.get(at + CLOCK).tag().byte() & OWN != 0;
        let is_left = Self::has(Part::LongMessages) && !is_own && self.stamp(at).digest != 0;
        is_left || self.send_entry_at(host, at)
    }

    /// Sends the memberships that the ending entry point has changed.
    #[hot]
    fn flush_swarms<H: Host<P>>(&mut self, host: &mut H) {
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

    /// Notes that an entry has changed: for a while it is advertised often. A put of this robot that
    /// no other one has confirmed stays the newest entry until the next one.
    pub(super) fn hurry(&mut self, at: usize) {
        if !self.protocol.has(Flag::Unheard) {
            self.protocol.newest = at as u16;
        }
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
        if self.is_comparing() {
            return;
        }
        if self.may_answer() {
            self.set_entry_state(at, self.entry_state(at) | NEWS);
            self.protocol.has_dirty_entries = true;
        } else {
            // The answer is advertised as the newest entry, in place of an unconfirmed put.
            self.protocol.clear(Flag::Unheard);
        }
        self.hurry(at);
    }

    /// Returns true if few answers were sent shortly before, and counts one more.
    pub(super) fn may_answer(&mut self) -> bool {
        let may = self.protocol.answers != 0;
        self.protocol.answers -= u8::from(may);
        may
    }

    /// Returns true while a robot that was away for long compares digests with the others: it sends
    /// no entry that it had before, since that may have been deleted.
    fn is_comparing(&self) -> bool {
        self.protocol.alone >= ALONE
    }

    /// Takes note that a frame was received that only robots with stigmergies send often.
    #[one_copy]
    pub(super) fn end_absence(&mut self) {
        let alone = &mut self.protocol.alone;
        if *alone < ALONE {
            *alone = 0;
        } else if *alone == ALONE {
            *alone += 1;
        }
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
        if Self::HAS_SHARED_STATE && advertises && !self.is_comparing() {
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
            frame.put_digest(self.robot_id, digest, self.protocol.floor);
            self.protocol.set_timer(Timer::Digest, host.periods().advertise);
        } else {
            frame.put_beacon(self.robot_id);
        }
        self.send(host, &mut frame);
    }

    /// Returns true if the robot keeps all entries of its stigmergies that it receives.
    fn is_comparable(&self) -> bool {
        self.protocol.stigmergies != 0 && !self.protocol.has(Flag::Dropped)
    }

    /// Sends the newest entry until enough neighbors are known to have it. Also sends the next
    /// swarm, or the next entry if neighbors may lack entries.
    fn advertise<H: Host<P>>(&mut self, host: &mut H) {
        let newest = usize::from(self.protocol.newest);
        let mut sent = 0;
        if self.protocol.interval >= LONG_INTERVAL {
            // Nobody may be there that could confirm a put.
            self.protocol.clear(Flag::Unheard);
        } else if newest != 0 && self.is_shared(newest) {
            self.send_entry_at(host, newest);
            sent = newest;
        }
        self.protocol.turn = self.protocol.turn.wrapping_add(1);
        let mut has_entries = self.protocol.unadvertised != 0;
        if !has_entries && self.protocol.turn.is_multiple_of(SLOW_TURNS) {
            has_entries = self.protocol.has(Flag::Dropped) || self.protocol.has(Flag::MeetsBeacon);
            self.protocol.clear(Flag::MeetsBeacon);
        }
        let mut burst = self.burst();
        let entries = self.sizes().entries;
        let all = entries + Places::from(self.sizes().swarms);
        let mut place = self.protocol.advertised;
        for _ in 0..all {
            place += 1;
            if place >= all {
                place = 0;
            }
            if place >= entries {
                let swarm = (place - entries) as u8;
                if self.arena.get(self.swarm_slot(swarm)).tag() != crate::value::Tag::NIL {
                    self.protocol.advertised = place;
                    return self.send_swarm(host, swarm);
                }
            } else if has_entries {
                let at = self.entry_slot(place);
                if !self.is_shared(at) || at == sent || self.may_skip(at) {
                    continue;
                }
                // An entry for which there is no room gets the next turn.
                if !self.send_entry_at(host, at) {
                    return;
                }
                self.protocol.advertised = place;
                self.protocol.unadvertised = self.protocol.unadvertised.saturating_sub(1);
                if burst == 0 {
                    return;
                }
                burst -= 1;
            }
        }
        // All entries had their turns.
        self.protocol.unadvertised = 0;
    }

    /// Returns true if an entry need not be advertised now, since neighbors have it, too. One in
    /// four such entries is advertised nevertheless: the neighbor that sent it may be out of reach
    /// of another one that lacks it.
    #[hot]
    fn may_skip(&mut self, at: usize) -> bool {
        let is_skipped = self.take_heard(at) && self.random() & 3 != 0;
        if is_skipped {
            self.protocol.unadvertised = self.protocol.unadvertised.saturating_sub(1);
        }
        is_skipped
    }

    /// Returns the number of entries that a turn advertises in addition to one. With thousands of
    /// entries, a missing one would otherwise be found only after an hour.
    #[hot]
    fn burst(&self) -> Places {
        if !self.sizes().have_index() {
            return 0;
        }
        (self.protocol.unadvertised / BURST_ENTRIES).min(BURST_MAX)
    }

    /// Sends the entry whose first slot is `at`. Returns false if the host has no room for it.
    fn send_entry_at<H: Host<P>>(&mut self, host: &mut H, at: usize) -> bool {
        let (entry, digest) = self.entry_message(at);
        self.send_entry(host, &entry, digest)
    }

    /// Compares a neighbor's digest and clock floor with the robot's own ones. `None` stands for a
    /// beacon without a digest.
    #[one_copy]
    pub(super) fn compare(&mut self, theirs: Option<(u32, u32)>) {
        self.end_absence();
        let Some((theirs, floor)) = theirs else {
            self.protocol.set(Flag::MeetsBeacon);
            return;
        };
        // New keys then have later clocks than the deletions that the neighbor has forgotten.
        self.note_clock(floor);
        if !self.is_comparable() {
            return;
        }
        let is_equal = theirs == self.digest();
        let protocol = &mut self.protocol;
        if is_equal {
            if is_earlier(protocol.floor, floor) {
                protocol.floor = floor;
            }
            protocol.settled = protocol.clock as u16;
            protocol.set(Flag::Complete);
            protocol.clear(Flag::Differs);
            return;
        }
        if !protocol.has(Flag::Differs) {
            protocol.set(Flag::Differs);
            protocol.set_timer(Timer::Meeting, MEETING_STEPS);
        }
        if protocol.floor != floor && protocol.help_pause < DISTRUST_PAUSE {
            protocol.set_timer(Timer::Distrust, DISTRUST_STEPS);
        }
        if protocol.alone >= ALONE {
            return;
        }
        let theirs = theirs as u16;
        if protocol.differing != theirs {
            protocol.differing = theirs;
            protocol.help_pause = HELP_MIN;
        } else if protocol.timer(Timer::Help) != 0 {
            return;
        }
        let pause = protocol.help_pause;
        protocol.set_timer(Timer::Help, pause);
        if pause != HELP_MAX {
            protocol.help_pause = pause << 1;
        }
        if protocol.unadvertised == 0 {
            self.advertise_soon();
        }
        let used = |place: &Places| self.is_shared(self.entry_slot(*place));
        self.protocol.unadvertised = (0..self.sizes().entries).filter(used).count() as Places;
    }

    /// Returns the sum of the hashes of all entries, of 24 bits. Deleted entries are not included,
    /// since robots forget them at different times.
    pub(in crate::machine) fn digest(&mut self) -> u32 {
        if !HAS_MANY_PLACES && self.protocol.digest & DIGEST_KNOWN == 0 {
            self.protocol.digest = self.sum_of_entries() | DIGEST_KNOWN;
        }
        self.protocol.digest & DIGEST_BITS
    }

    /// Returns the digest after adding up all entries.
    pub(in crate::machine) fn sum_of_entries(&self) -> u32 {
        let mut sum = 0_u32;
        for place in 0..self.sizes().entries {
            sum = sum.wrapping_add(self.summand(self.entry_slot(place)));
        }
        sum & DIGEST_BITS
    }

    /// Returns the part of an entry in the digest.
    fn summand(&self, at: usize) -> u32 {
        let (entry, digest) = self.entry_message(at);
        if self.entry_state(at) == 0 || entry.value.is_nil() { 0 } else { hash(&entry, digest) }
    }

    /// Takes an entry out of the digest, before it changes.
    #[hot]
    pub(super) fn subtract_entry(&mut self, at: usize) {
        self.protocol.digest = match HAS_MANY_PLACES {
            true => self.protocol.digest.wrapping_sub(self.summand(at)),
            false => 0,
        };
    }

    /// Adds an entry that was taken out by [`Vm::subtract_entry`] to the digest again.
    #[hot]
    pub(super) fn add_entry(&mut self, at: usize) {
        if HAS_MANY_PLACES {
            self.protocol.digest = self.protocol.digest.wrapping_add(self.summand(at));
        }
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
        self.drop_entry(!entry.value.is_nil());
        let hash = hash(entry, digest) as u16;
        if self.protocol.timer(Timer::Relay) != 0 || self.protocol.relayed == hash {
            return;
        }
        self.protocol.relayed = hash;
        let pause = RELAY_PAUSE + (self.random() & (RELAY_PAUSE / 2 - 1));
        self.protocol.set_timer(Timer::Relay, pause);
        self.send_entry(host, entry, digest);
    }

    /// Takes note that an entry was not kept, if `is_value`.
    pub(super) fn drop_entry(&mut self, is_value: bool) {
        if is_value {
            self.protocol.set(Flag::Dropped);
            self.protocol.clear(Flag::Complete);
        }
    }

    /// Advances the pauses, and the age of deleted entries.
    fn grow_older(&mut self) {
        let protocol = &mut self.protocol;
        protocol.age = protocol.age.wrapping_add(1);
        let steps = if protocol.answers == 0 { USED_UP_STEPS } else { ANSWER_STEPS };
        if protocol.age.is_multiple_of(steps) && protocol.answers < NEWS_MAX {
            protocol.answers += 1;
        }
        if protocol.age.is_multiple_of(RECLAIM_STEPS) && protocol.reclaimed != 0 {
            protocol.reclaimed -= 1;
        }
        if protocol.age.is_multiple_of(RETRY_STEPS) {
            protocol.clear(Flag::Dropped);
        }
        if protocol.age.is_multiple_of(AGE_STEPS) {
            if protocol.alone != ALONE {
                protocol.alone += 1;
                if protocol.alone == COMPARED {
                    protocol.alone = 0;
                }
            }
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
