//! Long messages in the queues: whole messages enter and leave, whatever happens to their fragments.

use bittybuzz_comms::queue::{Inbox, Outbox, QueueCounters};
use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::content::{ContentItem, ContentWriter, Head};
use bittybuzz_vm_core::message::{Fragment, Message, ScriptIdentity, TINY_FRAME, Topics};
use bittybuzz_vm_core::number::Tiny;
use proptest::prelude::*;

const SCRIPT: ScriptIdentity = ScriptIdentity { hash: 0x5bad_c0de, strings: 30 };

type In = Inbox<Tiny, u16, TINY_FRAME, 4, 2>;
type Out = Outbox<Tiny, TINY_FRAME, 4, 2>;

/// Returns a content with a name and a table of pairs of integers: two fragments without a pair, and
/// one more for each.
fn content(head: Head, name: u16, pairs: u8, value: i32) -> Vec<u8> {
    let mut room = [0; 48];
    let mut writer = ContentWriter::new(&mut room, SCRIPT, head);
    writer.item(ContentItem::Plain(Value::<Tiny>::string(name)));
    writer.item(ContentItem::<Tiny>::Table(pairs));
    for pair in 0..pairs {
        writer.item(ContentItem::Plain(Value::<Tiny>::int(pair.into())));
        writer.item(ContentItem::Plain(Value::<Tiny>::int(value)));
    }
    let length = writer.finish().expect("it fits");
    room[..length].to_vec()
}

fn broadcast(topic: u16, pairs: u8, value: i32) -> Vec<u8> {
    content(Head::Broadcast, topic, pairs, value)
}

fn entry(key: u16, clock: u32, value: i32) -> Vec<u8> {
    content(Head::Entry { stigmergy: 5, owner: 7, clock, digest: 0 }, key, 1, value)
}

fn beacon(robot: u16) -> Vec<u8> {
    let mut frame = [0; TINY_FRAME];
    let message: Message<'_, Tiny> = Message::Beacon { robot };
    let length = message.encode(SCRIPT, &mut frame).expect("it fits");
    frame[..length].to_vec()
}

/// Takes the next frame to be sent.
fn next(outbox: &mut Out) -> Option<Vec<u8>> {
    let mut frame = [0; TINY_FRAME];
    let length = outbox.pop(&mut frame)?;
    Some(frame[..length].to_vec())
}

/// Returns the fragments of a message from a robot.
fn fragments(robot: u16, content: &[u8]) -> Vec<Vec<u8>> {
    let mut outbox = Out::new();
    assert!(outbox.push_content(robot, content));
    std::iter::from_fn(|| next(&mut outbox)).collect()
}

/// Takes the next message: its sender, its data from the link, and its content.
fn message(inbox: &mut In) -> Option<(u16, u16, Vec<u8>)> {
    let mut head = [0; TINY_FRAME];
    let (length, extra) = inbox.pop(&mut head)?;
    let extra = *extra;
    // The first bytes of a fragment, which has no content here, or the first fragment of a message without a listener.
    assert!(length == 4 || length == 10);
    assert_eq!(head[0], 0x10);
    let mut room = [0; 48];
    let length = inbox.take_content(&mut room);
    Some((u16::from_le_bytes([head[1], head[2]]), extra, room[..length].to_vec()))
}

fn push(inbox: &mut In, frames: &[Vec<u8>]) {
    frames.iter().for_each(|frame| inbox.push(frame, 7));
}

#[test]
fn a_content_is_cut_as_the_wire_format_says() {
    let content = broadcast(12, 2, 5);
    let frames = fragments(0x0102, &content);
    assert_eq!(frames.len(), content.len().div_ceil(6));
    for (index, frame) in frames.iter().enumerate() {
        let last = if index + 1 == frames.len() { 8 } else { 0 };
        assert_eq!(frame[..4], [0x10 + last + index as u8, 2, 1, content[0]]);
        assert_eq!(frame[4..], *content.chunks(6).nth(index).unwrap());
    }
}

#[test]
fn fragments_in_any_order_are_joined_once() {
    let content = broadcast(12, 2, 5);
    let mut frames = fragments(3, &content);
    frames.reverse();
    let mut inbox = In::new(0);
    for frame in &frames {
        assert_eq!(message(&mut inbox), None);
        inbox.push(frame, 40);
        inbox.push(frame, 41);
    }
    assert_eq!(message(&mut inbox), Some((3, 40, content)));
    assert_eq!(message(&mut inbox), None);
    assert_eq!(inbox.counters(), QueueCounters::default());
}

/// A Kilobot's packets all have nine bytes of data.
#[test]
fn zeros_after_the_last_fragment_stay_behind_the_content() {
    let content = broadcast(12, 1, 5);
    let mut inbox = In::new(0);
    for mut frame in fragments(3, &content) {
        frame.resize(TINY_FRAME, 0);
        inbox.push(&frame, 0);
    }
    let (.., received) = message(&mut inbox).expect("it is complete");
    assert_eq!(received[..content.len()], content);
    assert!(received[content.len()..].iter().all(|byte| *byte == 0));
}

#[test]
fn two_senders_do_not_disturb_each_other() {
    let contents = [1, 2].map(|value| broadcast(12, 2, value));
    let all = [1, 2].map(|robot| fragments(robot, &contents[usize::from(robot) - 1]));
    let mut inbox = In::new(0);
    for index in 0..all[0].len() {
        all.iter().for_each(|frames| inbox.push(&frames[index], 0));
    }
    assert_eq!(message(&mut inbox), Some((1, 0, contents[0].clone())));
    assert_eq!(message(&mut inbox), Some((2, 0, contents[1].clone())));
    assert_eq!(message(&mut inbox), None);
    assert_eq!(inbox.counters(), QueueCounters::default());
}

/// A message that is complete keeps its place until it is read, whatever arrives.
#[test]
fn complete_messages_wait_and_others_find_no_place() {
    let contents = [1, 2].map(|value| broadcast(12, 1, value));
    let mut inbox = In::new(0);
    for robot in 1..=2 {
        push(&mut inbox, &fragments(robot, &contents[usize::from(robot) - 1]));
    }
    for robot in 3..20 {
        push(&mut inbox, &fragments(robot, &broadcast(12, 1, 5)));
    }
    assert_eq!(inbox.counters().incomplete, 17 * 3);
    assert_eq!(message(&mut inbox), Some((1, 7, contents[0].clone())));
    assert_eq!(message(&mut inbox), Some((2, 7, contents[1].clone())));
}

#[test]
fn a_repetition_completes_a_message() {
    let content = broadcast(12, 2, 5);
    let frames = fragments(3, &content);
    let mut inbox = In::new(0);
    push(&mut inbox, &frames[1..]);
    assert_eq!(message(&mut inbox), None);
    // Others have the other place meanwhile.
    for value in 0..2 {
        push(&mut inbox, &fragments(4, &broadcast(12, 0, value)));
        assert!(message(&mut inbox).is_some());
    }
    push(&mut inbox, &frames[..1]);
    assert_eq!(message(&mut inbox), Some((3, 7, content)));
    assert_eq!(inbox.counters(), QueueCounters::default());
}

/// Two messages of which fragments have arrived keep both places until two other fragments arrive.
#[test]
fn a_place_goes_to_another_message_after_as_many_fragments_as_there_are_places() {
    let content = broadcast(12, 2, 9);
    let frames = fragments(3, &content);
    let mut inbox = In::new(0);
    for robot in [1, 2] {
        push(&mut inbox, &fragments(robot, &broadcast(12, 2, 5))[..2]);
    }
    // One fragment since the last one of robot 2, and three since that of robot 1.
    inbox.push(&frames[0], 7);
    push(&mut inbox, &fragments(2, &broadcast(12, 2, 5))[2..]);
    push(&mut inbox, &frames[1..]);
    assert_eq!(message(&mut inbox), Some((3, 7, content)));
    assert_eq!(message(&mut inbox), Some((2, 7, broadcast(12, 2, 5))));
    assert_eq!(inbox.counters().incomplete, 1, "that of robot 1");
}

/// A robot has at most one place for messages that are not complete.
#[test]
fn a_sender_that_begins_anew_gives_up_its_message() {
    let mut inbox = In::new(0);
    for value in 0..20 {
        push(&mut inbox, &fragments(1, &broadcast(12, 2, value))[1..]);
    }
    let content = broadcast(12, 2, 5);
    push(&mut inbox, &fragments(2, &content));
    assert_eq!(message(&mut inbox), Some((2, 7, content)));
    assert_eq!(inbox.counters().incomplete, 19);
}

#[test]
fn a_message_that_is_not_read_keeps_its_place_until_the_next_one_is_taken() {
    let mut inbox = In::new(0);
    push(&mut inbox, &fragments(1, &broadcast(12, 1, 1)));
    push(&mut inbox, &fragments(2, &broadcast(12, 1, 2)));
    assert!(inbox.pop(&mut [0; TINY_FRAME]).is_some());
    assert_eq!(message(&mut inbox), Some((2, 7, broadcast(12, 1, 2))));
    assert_eq!(inbox.take_content(&mut [0; 48]), 0);
    assert_eq!(message(&mut inbox), None);
    assert!(!inbox.is_assembling());
}

#[test]
fn fragments_that_no_robot_sends_are_dropped() {
    let mut inbox = In::new(0);
    for junk in [&[0x10, 1, 0, 9][..], &[0x10, 1, 0], &[0x11, 1, 0, 9, 1, 2, 3, 4, 5]] {
        inbox.push(junk, 0);
    }
    assert!(!inbox.is_assembling());
    assert_eq!(inbox.counters().incomplete, 3);
}

/// A full outbox drops whole messages: the fragments of those that leave are complete.
#[test]
fn a_begun_message_is_finished_before_its_successor() {
    let mut outbox = Out::new();
    let first = broadcast(1, 3, 0);
    assert!(outbox.push_content(9, &first));
    let mut sent = vec![next(&mut outbox).unwrap()];
    assert!(outbox.is_within_message());
    for value in 1..20 {
        outbox.begin_step();
        // On the same topic as the message that was begun, and on another one.
        assert!(outbox.push_content(9, &broadcast(1, 3, value)));
        assert!(outbox.push_content(9, &broadcast(2, 3, value)));
    }
    while outbox.is_within_message() {
        sent.push(next(&mut outbox).unwrap());
    }
    assert_eq!(sent, fragments(9, &first));
    let last = fragments(9, &broadcast(2, 3, 19));
    assert_eq!(std::iter::from_fn(|| next(&mut outbox)).collect::<Vec<_>>(), last);
    assert!(outbox.is_empty());
    // Each of the others was displaced by the next one.
    assert_eq!(outbox.counters().dropped, 37);
}

#[test]
fn a_broadcast_replaces_a_stale_one_on_its_topic() {
    let mut outbox = Out::new();
    assert!(outbox.push_content(9, &broadcast(1, 2, 1)));
    assert!(outbox.push_content(9, &broadcast(2, 2, 1)));
    outbox.begin_step();
    assert!(outbox.push_content(9, &broadcast(1, 1, 2)));
    // It keeps the turn of the one that it replaces.
    let frames: Vec<_> = std::iter::from_fn(|| next(&mut outbox)).collect();
    let expected = [fragments(9, &broadcast(1, 1, 2)), fragments(9, &broadcast(2, 2, 1))].concat();
    assert_eq!(frames, expected);
    assert_eq!(outbox.counters(), QueueCounters::default());
}

#[test]
fn an_entry_replaces_an_older_one_and_waits_for_room() {
    let mut outbox = Out::new();
    assert!(outbox.push_content(9, &entry(1, 5, 1)));
    assert!(outbox.push_content(9, &entry(1, 6, 2)), "a later clock");
    assert!(outbox.push_content(9, &entry(2, 6, 3)));
    assert!(!outbox.push_content(9, &entry(3, 6, 4)), "there is no room");
    assert!(!outbox.push_content(9, &broadcast(1, 1, 1)), "no broadcast waits");
    let frames: Vec<_> = std::iter::from_fn(|| next(&mut outbox)).collect();
    let expected = [fragments(9, &entry(1, 6, 2)), fragments(9, &entry(2, 6, 3))].concat();
    assert_eq!(frames, expected);
    // The machine sends entries later, so only the broadcast is lost.
    let counters = QueueCounters { dropped: 1, ..QueueCounters::default() };
    assert_eq!(outbox.counters(), counters);
}

/// After a message of three fragments, three frames go before the next message.
#[test]
fn frames_and_messages_share_the_link() {
    let mut outbox = Out::new();
    assert!(outbox.push_content(9, &broadcast(1, 1, 1)));
    assert!(outbox.push_content(9, &broadcast(2, 1, 1)));
    let fragment_count = fragments(9, &broadcast(1, 1, 1)).len();
    let mut kinds = Vec::new();
    for robot in 0.. {
        outbox.push(&beacon(robot));
        let Some(frame) = next(&mut outbox) else { break };
        kinds.push(frame[0] >> 4 == 1);
        if kinds.len() == 3 * fragment_count {
            break;
        }
    }
    let expected: Vec<_> = [true, false, true]
        .iter()
        .flat_map(|is_message| std::iter::repeat_n(*is_message, fragment_count))
        .collect();
    assert_eq!(kinds, expected);
}

#[test]
fn a_frame_that_could_not_be_sent_is_sent_again() {
    let mut outbox = Out::new();
    let content = broadcast(1, 2, 1);
    assert!(outbox.push_content(9, &content));
    let expected = fragments(9, &content);
    for frame in &expected {
        for _ in 0..3 {
            assert!(next(&mut outbox).is_some_and(|again| again.starts_with(frame)));
            outbox.unpop(frame);
        }
        // The last one is filled up.
        assert!(next(&mut outbox).is_some_and(|again| again.starts_with(frame)));
    }
    assert_eq!(next(&mut outbox), None);
    outbox.push(&beacon(1));
    let frame = next(&mut outbox).unwrap();
    outbox.unpop(&frame);
    assert_eq!(next(&mut outbox), Some(frame));
}

proptest! {
    /// A queue with a limit behaves like a queue that has no more places.
    #[test]
    fn a_queue_with_less_room_does_what_a_smaller_one_does(
        order in prop::collection::vec((0..7_u16, any::<prop::sample::Index>()), 0..200),
    ) {
        let mut small = In::new(0);
        let mut large = Inbox::<Tiny, u16, TINY_FRAME, 9, 9>::with_room(0, 4, 2);
        for (robot, index) in order {
            let frames = fragments(robot, &broadcast(12, 2, robot.into()));
            let frame: &Vec<u8> = index.get(&frames);
            small.push(frame, 0);
            large.push(frame, 0);
            if robot == 0 {
                let (mut one, mut other) = ([0; TINY_FRAME], [0; TINY_FRAME]);
                prop_assert_eq!(small.pop(&mut one), large.pop(&mut other));
                prop_assert_eq!(one, other);
            }
            prop_assert_eq!(small.counters(), large.counters());
        }
        let mut outboxes = (Out::new(), Outbox::<Tiny, TINY_FRAME, 9, 9>::with_room(4, 2));
        for step in 0..40 {
            outboxes.0.begin_step();
            outboxes.1.begin_step();
            for topic in 1..=step % 4 {
                let content = broadcast(topic, 1, step.into());
                prop_assert_eq!(outboxes.0.push_content(9, &content), outboxes.1.push_content(9, &content));
            }
            let (mut one, mut other) = ([0; TINY_FRAME], [0; TINY_FRAME]);
            prop_assert_eq!(outboxes.0.pop(&mut one), outboxes.1.pop(&mut other));
            prop_assert_eq!(one, other);
        }
    }

    /// Whatever arrives, each message that comes out was sent, or is caught by its check.
    #[test]
    fn lost_and_mixed_fragments_give_no_other_message(
        order in prop::collection::vec((0..3_u16, 0..2_i32, any::<prop::sample::Index>()), 0..200),
    ) {
        let mut inbox = In::new(0);
        let mut arrived = Vec::new();
        for (robot, value, index) in order {
            let frames = fragments(robot, &broadcast(12, 2, value));
            let frame = index.get(&frames);
            prop_assert!(Fragment::parse(frame).is_some());
            inbox.push(frame, 0);
            arrived.push((robot, value));
            while let Some((robot, _, content)) = message(&mut inbox) {
                let known = (0..2).find(|value| content == broadcast(12, 2, *value));
                // The number of the message is a part of its check, so other contents do not mix.
                prop_assert!(known.is_some_and(|value| arrived.contains(&(robot, value))));
            }
        }
    }
}

/// Robots that do not exist begin messages, each time another one, between and before the fragments
/// of a robot that sends a message in each step.
#[test]
fn fifty_invented_robots_at_most_halve_what_arrives() {
    for (before, between) in [(0, 0), (1, 0), (3, 0), (10, 0), (3, 1), (10, 1), (10, 2)] {
        let mut inbox = Inbox::<Tiny, u16, TINY_FRAME, 4, 4>::new(0);
        let mut invented = (0..).map(|number: u16| {
            let robot = 1000 + number % 50;
            fragments(robot, &broadcast(12, 2, number.into())).swap_remove(0)
        });
        let mut heard = 0;
        for step in 0..100 {
            invented.by_ref().take(before).for_each(|frame| inbox.push(&frame, 0));
            for frame in fragments(2, &broadcast(12, 2, step)) {
                inbox.push(&frame, 0);
                invented.by_ref().take(between).for_each(|frame| inbox.push(&frame, 0));
            }
            let mut head = [0; TINY_FRAME];
            while inbox.pop(&mut head).is_some() {
                heard += u32::from(inbox.take_content(&mut [0; 48]) != 0);
            }
        }
        assert!(heard >= 50, "{before} frames before, {between} between: {heard} of 100");
    }
}

/// Eight robots send messages on a topic without a listener, all at once, and another one sends a message on another topic:
/// there are only two places.
#[test]
fn messages_without_a_listener_take_no_place() {
    let unwanted: Topics = 1 << ((14 + SCRIPT.hash) % 32);
    let wanted = broadcast(12, 2, 5);
    let mut inbox = In::new(0);
    for _ in 0..3 {
        let mut all: Vec<_> =
            (1..9).map(|robot| fragments(robot, &broadcast(14, 2, robot.into()))).collect();
        all.push(fragments(9, &wanted));
        for index in 0..all[0].len() {
            all.iter().for_each(|frames| inbox.push_except(&frames[index], 7, unwanted));
        }
        assert_eq!(message(&mut inbox), Some((9, 7, wanted.clone())));
        // The messages of the other robots only show that these are there.
        while let Some((_, _, content)) = message(&mut inbox) {
            assert!(content.is_empty());
        }
    }
    assert_eq!(inbox.counters().incomplete, 0);
}
