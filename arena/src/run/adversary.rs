//! Adversaries: senders that disturb a swarm, or send frames that no robot of it would send.
//!
//! An adversary knows the script of the robots that it imitates, as any receiver of a beacon can if
//! it has the source. It learns keys, topics and ids from the frames that it receives.

use std::collections::VecDeque;

use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::builtin::string;
use bittybuzz_vm_core::message::content::{ContentItem, ContentWriter, Head};
use bittybuzz_vm_core::message::{
    CLOCK_MAX, FRAGMENT_HEAD, FULL_FRAME, Fragment, Message, ScriptIdentity, StigmergyEntry,
    TINY_FRAME,
};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Image, Value};

use crate::engine::{Intruder, Stream, TickFrames};
use crate::scenario::AdversaryKind;

/// The number of received frames that are kept for a replay.
const KEPT_FRAMES_MAX: usize = 256;
/// The number of topics, of keys and of ids that are remembered, each.
const LEARNED_MAX: usize = 64;
/// The sender id of an adversary that has not received any id yet.
const UNKNOWN_ROBOT: u16 = 65_535;
/// The lowest invented id.
const INVENTED_ID_MIN: u32 = 1000;
/// A type byte that belongs to no message.
const NOISE_TYPE: u8 = 0xff;

/// Returns the intruder of an adversary that knows the script in `image`.
pub fn intruder(
    kind: AdversaryKind,
    profile: NumberProfile,
    image: &[u8],
    stream: Stream,
) -> Box<dyn Intruder> {
    match profile {
        NumberProfile::Tiny => Box::new(Mind::<Tiny>::new(kind, script(image), stream)),
        NumberProfile::Full => Box::new(Mind::<Full>::new(kind, script(image), stream)),
    }
}

/// Returns the identity of the script in an image, which the coding of messages needs.
fn script(image: &[u8]) -> ScriptIdentity {
    let header = Image::new(image).header().expect("the setup accepted the image");
    ScriptIdentity { hash: header.hash(), strings: header.strings() + string::COUNT }
}

/// The state of an adversary.
#[derive(Clone, Debug)]
struct Mind<P: Profile> {
    kind: AdversaryKind,
    script: ScriptIdentity,
    stream: Stream,
    /// Received frames, at most [`KEPT_FRAMES_MAX`].
    heard: Vec<Vec<u8>>,
    /// The latest entry of each key.
    entries: Vec<StigmergyEntry<P>>,
    topics: Vec<u16>,
    robots: Vec<u16>,
    /// The number of messages sent, which selects the next ones.
    count: usize,
    /// Frames of the message that it is sending.
    frames: VecDeque<Vec<u8>>,
}

impl<P: Profile> Intruder for Mind<P>
where
    Mind<P>: Send,
{
    fn copy(&self) -> Box<dyn Intruder> {
        Box::new(self.clone())
    }

    fn receive(&mut self, inbox: &TickFrames<'_>) {
        inbox.iter().for_each(|frame| self.learn(frame.bytes));
    }

    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        if self.frames.is_empty() {
            let message = self.message(frame.len());
            self.frames.extend(message);
            self.count += 1;
        }
        // The received frames do not suffice for a message yet.
        let Some(next) = self.frames.pop_front() else { return 0 };
        frame.iter_mut().zip(&next).for_each(|(to, from)| *to = *from);
        next.len()
    }
}

impl<P: Profile> Mind<P> {
    fn new(kind: AdversaryKind, script: ScriptIdentity, stream: Stream) -> Self {
        Mind {
            kind,
            script,
            stream,
            heard: Vec::new(),
            entries: Vec::new(),
            topics: Vec::new(),
            robots: Vec::new(),
            count: 0,
            frames: VecDeque::new(),
        }
    }

    /// Stores a frame, and the ids, topics and keys in it.
    fn learn(&mut self, bytes: &[u8]) {
        let place = if self.heard.len() < KEPT_FRAMES_MAX {
            self.heard.push(Vec::new());
            self.heard.len() - 1
        } else {
            self.below(KEPT_FRAMES_MAX)
        };
        self.heard[place] = bytes.to_vec();
        let robot = match Message::<P>::decode(bytes, self.script) {
            Ok(Message::Broadcast { robot, topic, .. }) => {
                remember(&mut self.topics, topic);
                robot
            }
            Ok(Message::Entry(entry)) => {
                if entry.clock != 0 {
                    self.learn_entry(entry);
                }
                entry.owner
            }
            Ok(Message::Beacon { robot } | Message::Digest { robot, .. }) => robot,
            Ok(Message::Swarms { robot, .. }) => robot,
            Ok(Message::Fragment(Fragment { robot, .. })) => robot,
            // A frame that no robot sends, such as noise, has nothing to learn.
            Err(_) => return,
        };
        remember(&mut self.robots, robot);
    }

    fn learn_entry(&mut self, entry: StigmergyEntry<P>) {
        let name = |entry: &StigmergyEntry<P>| {
            (entry.stigmergy, entry.key.as_int(), entry.key.as_string())
        };
        if let Some(known) = self.entries.iter_mut().find(|known| name(known) == name(&entry)) {
            *known = entry;
        } else if self.entries.len() < LEARNED_MAX {
            self.entries.push(entry);
        }
    }

    /// Returns the frames of the next message, or none while the received frames do not suffice for
    /// one. `room` is the length of the link's longest frame.
    fn message(&mut self, room: usize) -> Vec<Vec<u8>> {
        match self.kind {
            AdversaryKind::Jam => vec![vec![NOISE_TYPE; room]],
            AdversaryKind::Babble => {
                let length = 1 + self.below(room);
                vec![(0..length).map(|_| self.below(256) as u8).collect()]
            }
            AdversaryKind::Replay => {
                let place = self.below(self.heard.len());
                self.heard.get(place).cloned().into_iter().collect()
            }
            AdversaryKind::ForgedClock => self.forged_clock(),
            AdversaryKind::Poison => self.poison(),
            AdversaryKind::InventedIds => {
                let robot = self.invented();
                self.frame(&Message::Beacon { robot })
            }
            AdversaryKind::HeldFragments => {
                // In turn: one message again and again, further messages of the same robot, and
                // messages of other robots.
                let [robot, number] = match self.count % 3 {
                    0 => [UNKNOWN_ROBOT, 7],
                    1 => [UNKNOWN_ROBOT, (self.count % 256) as u16],
                    _ => [self.invented(), (self.count % 256) as u16],
                };
                self.first_fragment(robot, number as u8)
            }
            AdversaryKind::SameId(robot) => self.in_the_name_of(robot),
        }
    }

    /// Returns a known entry with a clock far ahead of the known one: by 1000, by half of the
    /// clock's range and by one less and one more than that (clocks are compared on a circle, where
    /// this is the limit between later and earlier), or with the greatest clock.
    fn forged_clock(&mut self) -> Vec<Vec<u8>> {
        let Some(known) = self.any_entry() else { return Vec::new() };
        let ahead = [1000, CLOCK_MAX / 2 - 1, CLOCK_MAX / 2, CLOCK_MAX / 2 + 1];
        let clock = match ahead.get(self.count % 5) {
            Some(ahead) => (known.clock + ahead - 1) % CLOCK_MAX + 1,
            None => CLOCK_MAX,
        };
        let (owner, value) = (self.any_robot(), Value::int(self.below(100) as i32));
        self.frame(&Message::Entry(StigmergyEntry { owner, clock, value, ..known }))
    }

    /// Returns a value of the next type, on a topic or under a key that the script uses.
    fn poison(&mut self) -> Vec<Vec<u8>> {
        let pair = [ContentItem::Plain(Value::string(0)), ContentItem::Plain(Value::int(1))];
        let items: &[ContentItem<P>] = match self.count / 2 % 6 {
            0 => &[ContentItem::Plain(Value::nil())],
            1 => &[ContentItem::Plain(Value::int(-32_767))],
            2 => &[ContentItem::Plain(Value::float(f32::NAN))],
            3 => &[ContentItem::Plain(Value::string(0))],
            4 => &[ContentItem::Table(1), pair[0], pair[1]],
            _ => &[ContentItem::Function(0)],
        };
        let robot = self.any_robot();
        if self.count.is_multiple_of(2) {
            let place = self.below(self.topics.len());
            let Some(topic) = self.topics.get(place).copied() else { return Vec::new() };
            if let [ContentItem::Plain(value)] = items {
                return self.frame(&Message::Broadcast { robot, topic, value: *value });
            }
            let items = [&[ContentItem::Plain(Value::string(topic))], items].concat();
            return self.fragments(robot, Head::Broadcast, &items);
        }
        let Some(known) = self.any_entry() else { return Vec::new() };
        let clock = known.clock % CLOCK_MAX + 1;
        if let [ContentItem::Plain(value)] = items {
            return self.frame(&Message::Entry(StigmergyEntry {
                owner: robot,
                clock,
                value: *value,
                ..known
            }));
        }
        let head = Head::Entry { stigmergy: known.stigmergy, owner: robot, clock, digest: 1 };
        let items = [&[ContentItem::Plain(known.key)], items].concat();
        self.fragments(robot, head, &items)
    }

    /// Returns a beacon, a broadcast or an entry with `robot` as its sender.
    fn in_the_name_of(&mut self, robot: u16) -> Vec<Vec<u8>> {
        let place = self.below(self.topics.len());
        let topic = self.topics.get(place).copied();
        let value = Value::int(self.below(100) as i32);
        match (self.count % 3, topic, self.any_entry()) {
            (1, Some(topic), _) => self.frame(&Message::Broadcast { robot, topic, value }),
            (2, _, Some(known)) => {
                let clock = known.clock % CLOCK_MAX + 1;
                self.frame(&Message::Entry(StigmergyEntry { owner: robot, clock, value, ..known }))
            }
            _ => self.frame(&Message::Beacon { robot }),
        }
    }

    fn first_fragment(&self, robot: u16, number: u8) -> Vec<Vec<u8>> {
        let content = &[1; FULL_FRAME][..piece::<P>()];
        let fragment = Fragment { robot, number, index: 0, last: false, content };
        self.frame(&Message::Fragment(fragment))
    }

    /// Returns the frame of a message, or none if the message does not fit into one frame.
    fn frame(&self, message: &Message<'_, P>) -> Vec<Vec<u8>> {
        let mut room = [0; FULL_FRAME];
        let length = message.encode(self.script, &mut room);
        length.map(|length| room[..length].to_vec()).into_iter().collect()
    }

    /// Returns the fragments of a message that consists of a topic or key, and a value.
    fn fragments(&self, robot: u16, head: Head, items: &[ContentItem<P>]) -> Vec<Vec<u8>> {
        let mut room = [0; 64];
        let mut writer = ContentWriter::new(&mut room, self.script, head);
        items.iter().for_each(|item| writer.item(*item));
        // The script may have no form for an item, such as a function.
        let Some(length) = writer.finish() else { return Vec::new() };
        let content = &room[..length];
        let number = content[0];
        let parts = content.chunks(piece::<P>());
        let last = parts.len().saturating_sub(1);
        let fragments = parts.enumerate().flat_map(|(place, content)| {
            let (index, last) = (place as u8, place == last);
            self.frame(&Message::Fragment(Fragment { robot, number, index, last, content }))
        });
        fragments.collect()
    }

    fn any_entry(&mut self) -> Option<StigmergyEntry<P>> {
        let place = self.below(self.entries.len());
        self.entries.get(place).copied()
    }

    /// Returns an id from received frames, chosen at random.
    fn any_robot(&mut self) -> u16 {
        let place = self.below(self.robots.len());
        self.robots.get(place).copied().unwrap_or(UNKNOWN_ROBOT)
    }

    fn invented(&mut self) -> u16 {
        (INVENTED_ID_MIN + self.stream.below(60_000)) as u16
    }

    /// Returns a random number below `end`; 0 if `end` is 0.
    fn below(&mut self, end: usize) -> usize {
        self.stream.below(end as u32) as usize
    }
}

/// Returns the number of content bytes in a fragment.
fn piece<P: Profile>() -> usize {
    if P::FULL { FULL_FRAME - FRAGMENT_HEAD } else { TINY_FRAME - FRAGMENT_HEAD }
}

fn remember(known: &mut Vec<u16>, new: u16) {
    if known.len() < LEARNED_MAX && !known.contains(&new) {
        known.push(new);
    }
}
