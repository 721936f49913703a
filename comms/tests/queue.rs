//! Queues, compared with a slow list that follows the same rules, and examples of the rules.

use bittybuzz_comms::queue::{Inbox, Outbox, QueueCounters};
use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::{
    CLOCK_MAX, FULL_FRAME, FrameKind, Message, ScriptIdentity, StigmergyEntry, Swarms, TINY_FRAME,
    Topics,
};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use proptest::prelude::*;

const SCRIPT: ScriptIdentity = ScriptIdentity { hash: 0x5bad_c0de, strings: 30 };

fn frame<P: Profile>(message: Message<'_, P>) -> Vec<u8> {
    let mut frame = [0; FULL_FRAME];
    let length = message.encode(SCRIPT, &mut frame).expect("it fits");
    frame[..length].to_vec()
}

fn beacon(robot: u16) -> Vec<u8> {
    frame::<Tiny>(Message::Beacon { robot })
}

fn digest(robot: u16, digest: u32) -> Vec<u8> {
    frame::<Tiny>(Message::Digest { robot, digest, floor: 7 })
}

fn broadcast(robot: u16, topic: u16, value: i32) -> Vec<u8> {
    broadcast_of::<Tiny>(robot, topic, value)
}

fn broadcast_of<P: Profile>(robot: u16, topic: u16, value: i32) -> Vec<u8> {
    frame::<P>(Message::Broadcast { robot, topic, value: Value::int(value) })
}

fn entry<P: Profile>(owner: u16, clock: u32, key: i32, value: i32) -> Vec<u8> {
    let (key, value) = (Value::int(key), Value::int(value));
    frame::<P>(Message::Entry(StigmergyEntry { stigmergy: 1, owner, clock, key, value }))
}

fn swarms(id: u16) -> Vec<u8> {
    let mut swarms = Swarms::default();
    swarms.push(id, true);
    frame::<Tiny>(Message::Swarms { robot: 1, swarms })
}

/// Takes the next frame to be sent.
fn next<P: Profile, const BYTES: usize, const FRAMES: usize>(
    outbox: &mut Outbox<P, BYTES, FRAMES, 0>,
) -> Option<Vec<u8>> {
    let mut frame = [0; BYTES];
    let length = outbox.pop(&mut frame)?;
    Some(frame[..length].to_vec())
}

/// Takes the next received frame.
fn taken<P: Profile, E: Copy, const BYTES: usize, const FRAMES: usize>(
    inbox: &mut Inbox<P, E, BYTES, FRAMES, 0>,
) -> Option<(Vec<u8>, E)> {
    let mut frame = [0; BYTES];
    let (length, extra) = inbox.pop(&mut frame)?;
    Some((frame[..length].to_vec(), *extra))
}

/// Returns the waiting frames, oldest first.
fn waiting(show: impl FnOnce(&mut dyn FnMut(&[u8]))) -> Vec<Vec<u8>> {
    let mut frames = Vec::new();
    show(&mut |frame| frames.push(frame.to_vec()));
    frames
}

fn popped<const BYTES: usize, const FRAMES: usize>(
    outbox: &mut Outbox<Tiny, BYTES, FRAMES, 0>,
) -> Vec<Vec<u8>> {
    std::iter::from_fn(|| next(outbox)).collect()
}

#[test]
fn the_highest_priority_and_the_oldest_go_in_turn() {
    let mut outbox = Outbox::<Tiny, 10, 8, 0>::new();
    for frame in [swarms(2), entry::<Tiny>(1, 1, 3, 0)] {
        outbox.push(&frame);
    }
    for value in 0..2 {
        outbox.push(&broadcast(1, value, 0));
    }
    let order = [broadcast(1, 0, 0), swarms(2), broadcast(1, 1, 0), entry::<Tiny>(1, 1, 3, 0)];
    assert_eq!(popped(&mut outbox), order);
    assert_eq!(outbox.counters(), QueueCounters::default());
}

#[test]
fn a_full_queue_drops_the_oldest_of_the_lowest_priority() {
    let mut outbox = Outbox::<Tiny, 10, 3, 0>::new();
    for frame in [entry::<Tiny>(1, 1, 1, 0), swarms(1), swarms(2)] {
        outbox.push(&frame);
    }
    // A third list of swarms displaces the first, and an entry displaces the second.
    outbox.push(&swarms(3));
    outbox.push(&entry::<Tiny>(1, 1, 2, 0));
    outbox.push(&entry::<Tiny>(1, 1, 3, 0));
    assert_eq!(outbox.counters().dropped, 3);
    // No waiting frame has a lower priority than the new one.
    outbox.push(&swarms(4));
    assert_eq!(outbox.counters().dropped, 4);
    let entries = [1, 2, 3].map(|key| entry::<Tiny>(1, 1, key, 0));
    assert_eq!(popped(&mut outbox), entries);
}

/// A robot with more entries than its link takes still sends its beacon.
#[test]
fn entries_do_not_keep_a_beacon_back() {
    let mut outbox = Outbox::<Tiny, 10, 3, 0>::new();
    for key in 0..3 {
        outbox.push(&entry::<Tiny>(1, 1, key, 0));
    }
    outbox.push(&beacon(1));
    for key in 3..9 {
        outbox.push(&entry::<Tiny>(1, 1, key, 0));
    }
    assert_eq!(next(&mut outbox), Some(beacon(1)));
}

#[test]
fn a_beacon_replaces_the_robot_s_one_of_before() {
    let mut inbox = Inbox::<Tiny, (), 10, 4, 0>::new(());
    for frame in [beacon(1), digest(2, 5), digest(1, 7), digest(2, 6)] {
        inbox.push(&frame, ());
    }
    let frames: Vec<_> = std::iter::from_fn(|| taken(&mut inbox).map(|(f, ())| f)).collect();
    assert_eq!(frames, [digest(1, 7), digest(2, 6)]);
}

/// Two robots with different scripts may have the same id. Beacons with and without a digest share a byte of the hash.
#[test]
fn a_beacon_does_not_replace_one_of_another_script() {
    let mut other = beacon(1);
    other[3] ^= 1;
    let mut inbox = Inbox::<Tiny, (), 10, 4, 0>::new(());
    inbox.push(&beacon(1), ());
    inbox.push(&other, ());
    assert_eq!(inbox.len(), 2);
}

/// The hash is missing in the first beacon.
#[test]
fn a_beacon_does_not_replace_one_that_was_cut() {
    let mut inbox = Inbox::<Tiny, (), 10, 4, 0>::new(());
    inbox.push(&beacon(1)[..3], ());
    inbox.push(&beacon(1), ());
    assert_eq!(inbox.len(), 2);
}

/// The clock wraps around: 1 follows the greatest value.
#[test]
fn an_entry_replaces_one_from_before_the_end_of_the_circle() {
    assert!(replaces::<Tiny>(&entry::<Tiny>(7, CLOCK_MAX, 3, 9), &entry::<Tiny>(2, 1, 3, 0)));
    assert!(!replaces::<Tiny>(&entry::<Tiny>(7, 1, 3, 9), &entry::<Tiny>(2, CLOCK_MAX, 3, 0)));
}

#[test]
fn a_duplicate_waits_once_with_its_last_sighting() {
    let mut inbox = Inbox::<Tiny, u16, 10, 3, 0>::new(0);
    inbox.push(&beacon(1), 50);
    inbox.push(&beacon(2), 60);
    inbox.push(&beacon(1), 70);
    assert_eq!((inbox.len(), inbox.counters().duplicates), (2, 1));
    assert_eq!(taken(&mut inbox), Some((beacon(1), 70)));
    // The frame does not wait any more, so this one is no duplicate.
    inbox.push(&beacon(1), 80);
    assert_eq!((inbox.len(), inbox.counters().duplicates), (2, 1));
}

/// Returns true if the entry `new` takes the place of the entry `waiting`.
fn replaces<P: Profile>(waiting: &[u8], new: &[u8]) -> bool {
    let mut inbox = Inbox::<P, (), 20, 4, 0>::new(());
    inbox.push(&beacon(1), ());
    inbox.push(waiting, ());
    inbox.push(&beacon(2), ());
    inbox.push(new, ());
    let replaced = inbox.len() == 3;
    let frames: Vec<_> = std::iter::from_fn(|| taken(&mut inbox).map(|(f, ())| f)).collect();
    assert!(frames.iter().any(|frame| frame == new));
    assert_eq!(frames.iter().any(|frame| frame == waiting), !replaced);
    replaced
}

fn entries_replace_older_ones<P: Profile>() {
    let waiting = entry::<P>(7, 0x10_0105, 3, 9);
    assert!(replaces::<P>(&waiting, &entry::<P>(2, 0x10_0106, 3, 0)));
    assert!(replaces::<P>(&waiting, &entry::<P>(2, 0x11_0000, 3, 0)));
    assert!(replaces::<P>(&waiting, &entry::<P>(2, 0x20_0000, 3, 0)));
    assert!(replaces::<P>(&waiting, &entry::<P>(7, 0x10_0105, 3, 1)));
    // A conflict, an older entry and another key replace nothing.
    assert!(!replaces::<P>(&waiting, &entry::<P>(8, 0x10_0105, 3, 9)));
    assert!(!replaces::<P>(&waiting, &entry::<P>(7, 0x10_0104, 3, 9)));
    assert!(!replaces::<P>(&waiting, &entry::<P>(7, 0x0f_ffff, 3, 9)));
    assert!(!replaces::<P>(&waiting, &entry::<P>(7, 0x10_0106, 4, 9)));
    let message = |stigmergy, key, script| {
        let value = Value::nil();
        let mut frame = [0; 20];
        let entry = StigmergyEntry::<P> { stigmergy, owner: 7, clock: 0x20_0000, key, value };
        let length = Message::Entry(entry).encode(script, &mut frame).expect("it fits");
        frame[..length].to_vec()
    };
    // A key with a value of another type is replaced. Another stigmergy, a string whose number
    // equals the key, and another script replace nothing.
    assert!(replaces::<P>(&waiting, &message(1, Value::int(3), SCRIPT)));
    assert!(!replaces::<P>(&waiting, &message(2, Value::int(3), SCRIPT)));
    let number = 3_u16.wrapping_sub(SCRIPT.hash as u16);
    assert!(!replaces::<P>(&waiting, &message(1, Value::string(number), SCRIPT)));
    let foreign = ScriptIdentity { hash: SCRIPT.hash ^ 0x1000_0000, ..SCRIPT };
    assert!(!replaces::<P>(&waiting, &message(1, Value::int(3), foreign)));
    if P::FULL {
        let foreign = ScriptIdentity { hash: SCRIPT.hash ^ 1, ..SCRIPT };
        assert!(!replaces::<P>(&waiting, &message(1, Value::int(3), foreign)));
    }
}

#[test]
fn an_entry_replaces_older_ones_of_its_key() {
    entries_replace_older_ones::<Tiny>();
    entries_replace_older_ones::<Full>();
}

fn broadcasts_make_those_of_earlier_steps_stale<P: Profile>() {
    // The values differ in each byte.
    let broadcast = |topic, value: i32| broadcast_of::<P>(1, topic, value * 0x0101_0101);
    let mut outbox = Outbox::<P, 20, 8, 0>::new();
    outbox.begin_step();
    outbox.push(&broadcast(1, 10));
    outbox.push(&broadcast(1, 11));
    outbox.push(&broadcast(2, 12));
    assert_eq!(outbox.len(), 3);
    outbox.begin_step();
    outbox.push(&broadcast(1, 13));
    outbox.push(&broadcast(1, 14));
    let frames = std::iter::from_fn(|| next(&mut outbox));
    let values = [(1, 13), (2, 12), (1, 14)];
    assert!(frames.eq(values.map(|(topic, value)| broadcast(topic, value))));
    assert_eq!(outbox.counters(), QueueCounters::default());
}

#[test]
fn a_broadcast_makes_those_of_earlier_steps_stale() {
    broadcasts_make_those_of_earlier_steps_stale::<Tiny>();
    broadcasts_make_those_of_earlier_steps_stale::<Full>();
}

#[test]
fn the_oldest_frame_leaves_first_however_long_it_waited() {
    let mut outbox = Outbox::<Tiny, 10, 3, 0>::new();
    for frame in [broadcast(1, 1, 1), beacon(1)] {
        outbox.push(&frame);
    }
    assert_eq!(next(&mut outbox), Some(broadcast(1, 1, 1)));
    for _ in 0..300 {
        outbox.push(&beacon(2));
        outbox.push(&beacon(3));
    }
    assert_eq!(popped(&mut outbox), [1, 2, 3].map(beacon));
}

/// The second frame is shorter and takes the place of the first.
#[test]
fn a_frame_is_padded_with_zeros() {
    let mut outbox = Outbox::<Tiny, 10, 1, 0>::new();
    for frame in [broadcast(1, 2, -1), beacon(1)] {
        outbox.push(&frame);
        let mut room = [0xaa; 10];
        let length = outbox.pop(&mut room).expect("it waits");
        assert_eq!(room[..length], frame);
        assert!(room[length..].iter().all(|byte| *byte == 0), "{room:?}");
    }
}

#[test]
fn counters_stay_at_their_greatest_value() {
    let mut inbox = Inbox::<Tiny, (), 10, 1, 0>::new(());
    inbox.push(&beacon(1), ());
    for _ in 0..=u16::MAX {
        inbox.push(&beacon(1), ());
        inbox.push(&[], ());
    }
    let most =
        QueueCounters { dropped: u16::MAX, duplicates: u16::MAX, ..QueueCounters::default() };
    assert_eq!(inbox.counters(), most);
}

#[test]
fn bytes_that_are_no_frame_are_dropped() {
    let mut inbox = Inbox::<Tiny, (), 10, 2, 0>::new(());
    for junk in [&[][..], &[0; 10], &[3; 10], &[0x80; 10], &[8; 11]] {
        inbox.push(junk, ());
    }
    assert_eq!((inbox.len(), inbox.counters().dropped), (0, 5));
}

/// The rules of the queue, on a list with the oldest frame first.
#[derive(Default)]
struct Model {
    /// True for an outbox, where beacons have the highest priority.
    is_out: bool,
    waiting: Vec<(Vec<u8>, bool, u16)>,
    by_age: bool,
    counters: QueueCounters,
}

const FRAMES: usize = 5;

impl Model {
    fn push(&mut self, frame: &[u8], extra: u16) {
        let Some(kind) = frame.first().and_then(|first| FrameKind::of(*first)) else {
            self.counters.dropped += 1;
            return;
        };
        let new = (frame.to_vec(), false, extra);
        let key = |frame: &[u8]| (frame[0] & 0xe4, frame[5] & 0xf0, frame[6..8].to_vec());
        let clock = |frame: &[u8]| (frame[0] & 0x18, frame[5] & 15, frame[4], frame[3]);
        let is_replaced = |at: &usize| {
            let (old, is_stale, _) = &self.waiting[*at];
            match (kind, FrameKind::of(old[0])) {
                (FrameKind::Entry, Some(FrameKind::Entry)) => {
                    key(old) == key(frame)
                        && (clock(old) < clock(frame)
                            || clock(old) == clock(frame) && old[1..3] == frame[1..3])
                }
                (
                    FrameKind::Beacon | FrameKind::Digest,
                    Some(FrameKind::Beacon | FrameKind::Digest),
                ) => old[1..4] == frame[1..4],
                (FrameKind::Broadcast, Some(FrameKind::Broadcast)) => {
                    *is_stale && old[1..5] == frame[1..5] && old[7..] == frame[7..]
                }
                _ => false,
            }
        };
        let replaced: Vec<usize> = (0..self.waiting.len()).filter(is_replaced).collect();
        let same = self.waiting.iter().position(|(old, ..)| old == frame);
        let place = same.or(replaced.first().copied());
        if let Some(place) = place {
            self.waiting[place] = new;
            self.counters.duplicates += u16::from(same.is_some());
            for other in replaced.into_iter().rev().filter(|other| *other != place) {
                self.waiting.remove(other);
            }
            return;
        }
        if self.waiting.len() == FRAMES {
            let ranks: Vec<_> = self.waiting.iter().map(|(old, ..)| self.rank(old)).collect();
            let lowest = ranks.iter().min().expect("it is full");
            self.counters.dropped += 1;
            if *lowest > self.rank(frame) {
                return;
            }
            let at = ranks.iter().position(|rank| rank == lowest).expect("one is");
            self.waiting.remove(at);
        }
        self.waiting.push(new);
    }

    fn rank(&self, frame: &[u8]) -> Option<FrameKind> {
        match FrameKind::of(frame[0]) {
            Some(FrameKind::Beacon | FrameKind::Digest) if self.is_out => {
                Some(FrameKind::Broadcast)
            }
            kind => kind,
        }
    }

    fn pop(&mut self) -> Option<(Vec<u8>, u16)> {
        let highest = self.waiting.iter().map(|(frame, ..)| self.rank(frame)).max()?;
        let is_next =
            |(frame, ..): &(Vec<u8>, bool, u16)| self.by_age || self.rank(frame) == highest;
        let at = self.waiting.iter().position(is_next)?;
        self.by_age = !self.by_age;
        let (frame, _, extra) = self.waiting.remove(at);
        Some((frame, extra))
    }
}

#[derive(Debug, Clone)]
enum Act {
    Push(Vec<u8>, u16),
    Pop,
    Step,
}

fn frames() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        (0..3_u16).prop_map(beacon),
        (0..3_u16, 0..2_u32).prop_map(|(robot, sum)| digest(robot, sum)),
        (0..3_u16).prop_map(swarms),
        (0..2_u16, 0..3_u16, 0..3_i32).prop_map(|(robot, topic, v)| broadcast(robot, topic, v)),
        (0..3_u16, prop_oneof![0..4_u32, 0xffff..0x1_0002_u32], 0..2_i32, 0..2_i32)
            .prop_map(|(owner, clock, key, value)| entry::<Tiny>(owner, clock, key, value)),
        prop::collection::vec(any::<u8>(), 10)
            .prop_filter("fragments have places of their own", |frame| frame[0] >> 4 != 1),
    ]
}

fn acts() -> impl Strategy<Value = Vec<Act>> {
    let act = prop_oneof![
        6 => (frames(), any::<u16>()).prop_map(|(frame, extra)| Act::Push(frame, extra)),
        3 => Just(Act::Pop),
        1 => Just(Act::Step),
    ];
    prop::collection::vec(act, 0..120)
}

/// Compares queues of `ROOM` places with larger queues that are limited to `ROOM` frames.
fn same_as_smaller<const ROOM: usize>(acts: Vec<Act>) -> Result<(), TestCaseError> {
    let mut inboxes = (
        Inbox::<Tiny, u16, 10, ROOM, 0>::new(0),
        Inbox::<Tiny, u16, 10, 9, 0>::with_room(0, ROOM, 0),
    );
    let mut outboxes =
        (Outbox::<Tiny, 10, ROOM, 0>::new(), Outbox::<Tiny, 10, 9, 0>::with_room(ROOM, 0));
    for act in acts {
        match act {
            Act::Push(frame, extra) => {
                inboxes.0.push(&frame, extra);
                inboxes.1.push(&frame, extra);
                outboxes.0.push(&frame);
                outboxes.1.push(&frame);
            }
            Act::Pop => {
                prop_assert_eq!(taken(&mut inboxes.0), taken(&mut inboxes.1));
                prop_assert_eq!(next(&mut outboxes.0), next(&mut outboxes.1));
            }
            Act::Step => {
                outboxes.0.begin_step();
                outboxes.1.begin_step();
            }
        }
        let shown = waiting(|show| inboxes.0.show(show));
        prop_assert_eq!(shown, waiting(|show| inboxes.1.show(show)));
        let shown = waiting(|show| outboxes.0.show(show));
        prop_assert_eq!(shown, waiting(|show| outboxes.1.show(show)));
        prop_assert_eq!(inboxes.0.counters(), inboxes.1.counters());
        prop_assert_eq!(outboxes.0.counters(), outboxes.1.counters());
    }
    Ok(())
}

proptest! {
    #[test]
    fn an_inbox_does_what_the_model_does(acts in acts()) {
        let mut inbox = Inbox::<Tiny, u16, 10, FRAMES, 0>::new(0);
        let mut model = Model::default();
        for act in acts {
            match act {
                Act::Push(frame, extra) => {
                    inbox.push(&frame, extra);
                    model.push(&frame, extra);
                }
                Act::Pop | Act::Step => {
                    prop_assert_eq!(taken(&mut inbox), model.pop());
                }
            }
            prop_assert_eq!(inbox.len(), model.waiting.len());
            prop_assert_eq!(inbox.counters(), model.counters);
        }
    }

    #[test]
    fn an_outbox_does_what_the_model_does(acts in acts()) {
        let mut outbox = Outbox::<Tiny, 10, FRAMES, 0>::new();
        let mut model = Model { is_out: true, ..Model::default() };
        for act in acts {
            match act {
                Act::Push(frame, _) => {
                    outbox.push(&frame);
                    model.push(&frame, 0);
                }
                Act::Pop => {
                    prop_assert_eq!(next(&mut outbox), model.pop().map(|(frame, _)| frame));
                }
                Act::Step => {
                    outbox.begin_step();
                    model.waiting.iter_mut().for_each(|waiting| waiting.1 = true);
                }
            }
            prop_assert_eq!(outbox.len(), model.waiting.len());
            prop_assert_eq!(outbox.counters(), model.counters);
        }
    }

    /// A queue with a limit behaves like a queue that has no more places.
    #[test]
    fn a_queue_with_less_room_does_what_a_smaller_one_does(room in 1..=FRAMES, acts in acts()) {
        match room {
            1 => same_as_smaller::<1>(acts)?,
            2 => same_as_smaller::<2>(acts)?,
            3 => same_as_smaller::<3>(acts)?,
            4 => same_as_smaller::<4>(acts)?,
            _ => same_as_smaller::<FRAMES>(acts)?,
        }
    }

    /// A waiting frame leaves the queue, or is dropped, before twice the queue's size of other
    /// frames have left.
    #[test]
    fn nothing_starves(flood in prop::collection::vec(frames(), 40)) {
        let mut outbox = Outbox::<Tiny, 10, FRAMES, 0>::new();
        outbox.push(&beacon(999));
        let mut left = 0;
        for frame in flood {
            if outbox.len() == FRAMES {
                break;
            }
            outbox.push(&frame);
            if next(&mut outbox) == Some(beacon(999)) {
                prop_assert!(left <= 2);
                return Ok(());
            }
            left += 1;
        }
        prop_assert!(left <= 2, "the oldest goes every second time");
    }
}

/// All topics except those whose number is that of `topic`.
fn all_except(topic: u16) -> Topics {
    !(1 << ((u32::from(topic) + SCRIPT.hash) % 32))
}

/// Robots 1 to 3 send on topics 13 to 15, and robot 4 once on topic 12, to which the script listens.
#[test]
fn a_flood_on_topics_without_a_listener_displaces_no_other_frame() {
    let mut inbox = Inbox::<Tiny, (), TINY_FRAME, 3, 0>::new(());
    let wanted = broadcast(4, 12, 1);
    inbox.push_except(&broadcast(1, 13, 0), (), all_except(12));
    inbox.push_except(&wanted, (), all_except(12));
    inbox.push_except(&beacon(5), (), all_except(12));
    let flood: Vec<_> =
        (1..20).map(|value| broadcast(value % 3 + 1, value % 3 + 13, value.into())).collect();
    flood.iter().for_each(|frame| inbox.push_except(frame, (), all_except(12)));
    let mut left = waiting(|show| inbox.show(show));
    // Only the last frame of the flood waits.
    assert_eq!(left.pop(), flood.last().cloned());
    assert_eq!(left, [wanted, beacon(5)]);
    assert_eq!(inbox.counters().unwanted, 20);
    // Any other frame displaces it.
    inbox.push_except(&beacon(6), (), all_except(12));
    assert_eq!(waiting(|show| inbox.show(show)).last(), Some(&beacon(6)));
}

/// The frames of one robot take one place, so that other robots are not forgotten.
#[test]
fn messages_without_a_listener_take_one_place_for_each_sender() {
    let mut inbox = Inbox::<Tiny, (), TINY_FRAME, 3, 0>::new(());
    for value in 0..20 {
        for robot in 1..3 {
            for topic in 13..15 {
                inbox.push_except(&broadcast(robot, topic, value), (), all_except(12));
            }
        }
    }
    let left = waiting(|show| inbox.show(show));
    assert_eq!(left, [broadcast(1, 14, 19), broadcast(2, 14, 19)]);
    let counters = QueueCounters { unwanted: 80, ..QueueCounters::default() };
    assert_eq!(inbox.counters(), counters);
}

/// A script may listen to the topic before the machine takes the frame.
#[test]
fn a_message_without_a_listener_waits_while_there_is_room() {
    let mut inbox = Inbox::<Tiny, (), TINY_FRAME, 3, 0>::new(());
    inbox.push_except(&broadcast(1, 13, 7), (), !0);
    assert_eq!(taken(&mut inbox), Some((broadcast(1, 13, 7), ())));
}
