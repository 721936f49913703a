//! A robot's end of the air: the frames that it has received and those that it wants to send.

use std::collections::{BTreeMap, HashMap, VecDeque};

use bittybuzz_comms::queue::{Inbox, Outbox};
use bittybuzz_vm_core::message::{FULL_FRAME, Fragment, Topics};
use bittybuzz_vm_core::number::Profile;

/// A frame that a robot received.
#[derive(Debug, Clone, PartialEq)]
pub struct Received {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// The sender's id, if the link knows it.
    pub sender: Option<u16>,
    /// Distance in mm, azimuth and elevation in radians, if the link knows them.
    pub place: Option<[f32; 3]>,
}

impl Received {
    /// A frame of a sender of which the link knows nothing.
    pub fn new(bytes: &[u8]) -> Self {
        Received { bytes: bytes.to_vec(), sender: None, place: None }
    }
}

/// Frames in both directions.
pub trait Link {
    /// A step begins, with the topics to which the script does not listen.
    fn begin_step(&mut self, unwanted: Topics);
    /// The air delivers a frame.
    fn push(&mut self, frame: Received);
    /// The machine takes a frame, or the first bytes of a fragment for a whole long message.
    fn pop(&mut self) -> Option<Received>;
    /// The machine takes the content of the long message that it has taken last.
    fn take_content(&mut self, content: &mut [u8]) -> usize;
    /// The machine sends a frame.
    fn send(&mut self, frame: &[u8]);
    /// The machine sends the content of a long message, of which each fragment has a piece of that
    /// length; false if there is no room for it.
    fn send_content(&mut self, robot: u16, content: &[u8], piece: usize) -> bool;
    /// The air takes a frame.
    fn pop_sent(&mut self) -> Option<Vec<u8>>;
}

/// Lists without a limit, first in, first out: whatever is sent arrives.
#[derive(Debug, Default)]
pub struct Direct {
    received: VecDeque<Received>,
    sent: VecDeque<Vec<u8>>,
    /// The messages of which fragments were taken from the list, by sender and number.
    arriving: HashMap<(u16, u8), Arriving>,
    /// The content of the message that was taken last.
    content: Vec<u8>,
}

/// A long message of which fragments have arrived.
#[derive(Debug, Default)]
struct Arriving {
    /// The content of each fragment, by its place.
    parts: BTreeMap<u8, Vec<u8>>,
    /// The place of the last one.
    end: Option<u8>,
}

impl Link for Direct {
    fn begin_step(&mut self, _unwanted: Topics) {}

    fn push(&mut self, frame: Received) {
        self.received.push_back(frame);
    }

    fn pop(&mut self) -> Option<Received> {
        loop {
            let next = self.received.pop_front()?;
            let Some(fragment) = Fragment::parse(&next.bytes) else { return Some(next) };
            let Fragment { robot, number, index, last, content } = fragment;
            let Arriving { parts, end } = self.arriving.entry((robot, number)).or_default();
            parts.insert(index, content.to_vec());
            *end = end.or(last.then_some(index));
            if end.is_some_and(|end| (0..=end).all(|index| parts.contains_key(&index))) {
                self.content = parts.values().flatten().copied().collect();
                self.arriving.remove(&(robot, number));
                return Some(Received { bytes: fragment.head().to_vec(), ..next });
            }
        }
    }

    fn take_content(&mut self, content: &mut [u8]) -> usize {
        let length = self.content.len().min(content.len());
        content[..length].copy_from_slice(&self.content[..length]);
        length
    }

    fn send(&mut self, frame: &[u8]) {
        self.sent.push_back(frame.to_vec());
    }

    fn send_content(&mut self, robot: u16, content: &[u8], piece: usize) -> bool {
        let (number, parts) = (content[0], content.chunks(piece));
        let count = parts.len();
        self.sent.extend(parts.enumerate().map(|(index, content)| {
            let last = index + 1 == count;
            let fragment = Fragment { robot, number, index: index as u8, last, content };
            [&fragment.head(), content].concat()
        }));
        true
    }

    fn pop_sent(&mut self) -> Option<Vec<u8>> {
        self.sent.pop_front()
    }
}

/// The long messages for which [`Queues`] has room in both directions.
const LONG: usize = 4;

/// The queues of the robots' firmware, with room for `IN` and `OUT` frames.
pub struct Queues<P: Profile, const IN: usize, const OUT: usize> {
    received: Inbox<P, Seen, FULL_FRAME, IN, LONG>,
    sent: Outbox<P, FULL_FRAME, OUT, LONG>,
    unwanted: Topics,
}

/// Sender and place of a frame that waits.
type Seen = (Option<u16>, Option<[f32; 3]>);

impl<P: Profile, const IN: usize, const OUT: usize> Default for Queues<P, IN, OUT> {
    fn default() -> Self {
        Queues { received: Inbox::new((None, None)), sent: Outbox::new(), unwanted: 0 }
    }
}

impl<P: Profile, const IN: usize, const OUT: usize> Link for Queues<P, IN, OUT> {
    fn begin_step(&mut self, unwanted: Topics) {
        self.unwanted = unwanted;
        self.sent.begin_step();
    }

    fn push(&mut self, frame: Received) {
        self.received.push_except(&frame.bytes, (frame.sender, frame.place), self.unwanted);
    }

    fn pop(&mut self) -> Option<Received> {
        let mut frame = [0; FULL_FRAME];
        let (length, (sender, place)) = self.received.pop(&mut frame)?;
        Some(Received { bytes: frame[..length].to_vec(), sender: *sender, place: *place })
    }

    fn take_content(&mut self, content: &mut [u8]) -> usize {
        self.received.take_content(content)
    }

    fn send(&mut self, frame: &[u8]) {
        self.sent.push(frame);
    }

    fn send_content(&mut self, robot: u16, content: &[u8], _piece: usize) -> bool {
        self.sent.push_content(robot, content)
    }

    fn pop_sent(&mut self) -> Option<Vec<u8>> {
        let mut frame = [0; FULL_FRAME];
        let length = self.sent.pop(&mut frame)?;
        Some(frame[..length].to_vec())
    }
}
