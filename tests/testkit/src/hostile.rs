//! A sender that is no robot and does not keep the rules.

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::content::{ContentItem, Head};
use bittybuzz_vm_core::message::{
    CLOCK_MAX, FRAGMENT_HEAD, FULL_FRAME, Fragment, Message, ScriptIdentity, StigmergyEntry,
    TINY_FRAME,
};
use bittybuzz_vm_core::number::Profile;

use crate::frames::{fragments, frame};
use crate::random::Random;

/// A way to break the rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Attack {
    /// Entries of known keys with clocks that are far ahead, the greatest, or half a circle away.
    ForgedClocks,
    /// Values of each class in turn, on known topics and keys, in the name of any robot.
    ForgedValues,
    /// Entries of keys that no robot has put.
    InventedKeys,
    /// Beacons of robots that do not exist, each of another one.
    InventedRobots,
    /// Frames that were received, again.
    Replays,
    /// The first fragment of one and the same long message.
    RepeatedFragments,
    /// The first fragments of other messages of one robot.
    BegunMessages,
    /// The first fragments of messages of invented robots.
    InventedMessages,
    /// Random bytes.
    Babble,
}

impl Attack {
    /// All of them.
    pub const ALL: [Attack; 9] = [
        Attack::ForgedClocks,
        Attack::ForgedValues,
        Attack::InventedKeys,
        Attack::InventedRobots,
        Attack::Replays,
        Attack::RepeatedFragments,
        Attack::BegunMessages,
        Attack::InventedMessages,
        Attack::Babble,
    ];
}

/// The robot in whose name the attacker speaks where it invents none.
pub const FORGER: u16 = 999;
/// Ids of invented robots begin here.
pub const INVENTED: u16 = 1000;
/// Frames that are kept to be replayed.
const KEPT: usize = 256;

/// The attacker. It receives all frames of the robots and learns topics and keys from them; its
/// own frames reach all robots, with the loss of the air.
pub struct Hostile<P: Profile> {
    script: ScriptIdentity,
    random: Random,
    attacks: Vec<Running>,
    heard: Vec<Vec<u8>>,
    /// The latest entry of each key.
    entries: Vec<StigmergyEntry<P>>,
    topics: Vec<u16>,
    /// Messages sent so far, on which the next ones depend.
    count: usize,
}

/// An attack that goes on.
struct Running {
    attack: Attack,
    messages_per_step: f64,
    due: f64,
}

impl<P: Profile> Hostile<P> {
    /// Returns an attacker that knows the script and is quiet.
    pub fn new(script: ScriptIdentity, seed: u64) -> Self {
        Hostile {
            script,
            random: Random::new(seed),
            attacks: Vec::new(),
            heard: Vec::new(),
            entries: Vec::new(),
            topics: Vec::new(),
            count: 0,
        }
    }

    /// Adds an attack with so many messages per step, evenly spread. Most messages are one frame.
    pub fn attack(&mut self, attack: Attack, messages_per_step: f64) {
        self.attacks.push(Running { attack, messages_per_step, due: messages_per_step.max(1.0) });
    }

    /// Ends all attacks.
    pub fn be_quiet(&mut self) {
        self.attacks.clear();
    }

    /// Receives a frame of a robot.
    pub(crate) fn receive(&mut self, bytes: &[u8]) {
        if self.heard.len() < KEPT {
            self.heard.push(bytes.to_vec());
        } else {
            self.heard[self.random.below(KEPT as u64) as usize] = bytes.to_vec();
        }
        match Message::<P>::decode(bytes, self.script) {
            Ok(Message::Broadcast { topic, .. }) if !self.topics.contains(&topic) => {
                self.topics.push(topic);
            }
            Ok(Message::Entry(entry)) if entry.clock != 0 => {
                let is_same = |known: &&mut StigmergyEntry<P>| {
                    known.stigmergy == entry.stigmergy
                        && known.key.as_int() == entry.key.as_int()
                        && known.key.as_string() == entry.key.as_string()
                };
                match self.entries.iter_mut().find(is_same) {
                    Some(known) => *known = entry,
                    None => self.entries.push(entry),
                }
            }
            _ => {}
        }
    }

    /// Returns the frames of a step, and the number of robots that send before them.
    pub(crate) fn send(&mut self, robots: usize) -> (usize, Vec<Vec<u8>>) {
        let mut frames = Vec::new();
        for number in 0..self.attacks.len() {
            let running = &mut self.attacks[number];
            let attack = running.attack;
            // A tenth ten times is a little less than one.
            let messages = (running.due + 1e-6) as usize;
            running.due += running.messages_per_step - messages as f64;
            for _ in 0..messages {
                frames.extend(self.message(attack));
                self.count += 1;
            }
        }
        (self.random.below(robots as u64 + 1) as usize, frames)
    }

    /// Returns the frames of the next message of an attack; none if nothing is known for it.
    fn message(&mut self, attack: Attack) -> Vec<Vec<u8>> {
        let invented = INVENTED + self.random.below(60_000) as u16;
        match attack {
            Attack::ForgedClocks => {
                let Some(known) = self.any_entry() else { return Vec::new() };
                let ahead = [1000, CLOCK_MAX / 2 - 1, CLOCK_MAX / 2, CLOCK_MAX / 2 + 1];
                let clock = match ahead.get(self.count % 6) {
                    Some(ahead) => (known.clock + ahead - 1) % CLOCK_MAX + 1,
                    None => CLOCK_MAX - (self.count % 6 - 4) as u32,
                };
                let value = Value::int(self.random.below(100) as i32);
                self.entry(StigmergyEntry { owner: FORGER, clock, value, ..known })
            }
            Attack::ForgedValues => self.forge_value(invented),
            Attack::InventedKeys => {
                let Some(known) = self.any_entry() else { return Vec::new() };
                let key = Value::int(1000 + self.random.below(1000) as i32);
                self.entry(StigmergyEntry { owner: FORGER, key, ..known })
            }
            Attack::InventedRobots => {
                vec![frame::<P>(self.script, &Message::Beacon { robot: invented })]
            }
            Attack::Replays => {
                if self.heard.is_empty() {
                    return Vec::new();
                }
                let number = self.random.below(self.heard.len() as u64) as usize;
                vec![self.heard[number].clone()]
            }
            Attack::RepeatedFragments => self.first_fragment(FORGER, 7),
            Attack::BegunMessages => self.first_fragment(FORGER, self.count as u8),
            Attack::InventedMessages => self.first_fragment(invented, self.count as u8),
            Attack::Babble => {
                let length = 1 + self.random.below(FULL_FRAME as u64);
                vec![(0..length).map(|_| self.random.below(256) as u8).collect()]
            }
        }
    }

    fn any_entry(&mut self) -> Option<StigmergyEntry<P>> {
        let number = self.random.below(self.entries.len().max(1) as u64) as usize;
        self.entries.get(number).copied()
    }

    fn entry(&self, entry: StigmergyEntry<P>) -> Vec<Vec<u8>> {
        vec![frame(self.script, &Message::Entry(entry))]
    }

    /// Returns a value of the next class, on a topic or under a key.
    fn forge_value(&mut self, invented: u16) -> Vec<Vec<u8>> {
        let pair = [ContentItem::Plain(Value::string(0)), ContentItem::Plain(Value::int(1))];
        let items: &[ContentItem<P>] = match self.count / 2 % 6 {
            0 => &[ContentItem::Plain(Value::nil())],
            1 => &[ContentItem::Plain(Value::int(-32767))],
            2 => &[ContentItem::Plain(Value::float(f32::NAN))],
            3 => &[ContentItem::Plain(Value::string(0))],
            4 => &[ContentItem::Table(1), pair[0], pair[1]],
            _ => &[ContentItem::Function(0)],
        };
        // In the name of a robot that there is, or of one that there is not.
        let robot = if self.random.chance(0.5) { 1 + (invented & 7) } else { invented };
        if self.count.is_multiple_of(2) {
            let Some(topic) = self.topics.get(usize::from(invented) % self.topics.len().max(1))
            else {
                return Vec::new();
            };
            if let [ContentItem::Plain(value)] = items {
                let message = Message::Broadcast { robot, topic: *topic, value: *value };
                return vec![frame(self.script, &message)];
            }
            let items = [&[ContentItem::Plain(Value::string(*topic))], items].concat();
            return fragments(self.script, robot, Head::Broadcast, &items);
        }
        let Some(known) = self.any_entry() else { return Vec::new() };
        let clock = known.clock % CLOCK_MAX + 1;
        if let [ContentItem::Plain(value)] = items {
            return self.entry(StigmergyEntry { owner: robot, clock, value: *value, ..known });
        }
        let head = Head::Entry { stigmergy: known.stigmergy, owner: robot, clock, digest: 1 };
        fragments(self.script, robot, head, &[&[ContentItem::Plain(known.key)], items].concat())
    }

    fn first_fragment(&self, robot: u16, number: u8) -> Vec<Vec<u8>> {
        let length = if P::FULL { FULL_FRAME } else { TINY_FRAME } - FRAGMENT_HEAD;
        let content = &[1; FULL_FRAME][..length];
        let fragment = Fragment { robot, number, index: 0, last: false, content };
        vec![frame::<P>(self.script, &Message::Fragment(fragment))]
    }
}
