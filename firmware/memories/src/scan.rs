//! The search for decks: requests to the nRF51, which owns the one-wire bus, and its answers.

use crate::conflict::{DeckConflict, FoundDeck};
use crate::deck::{Deck, DeckSet};
use crate::memory::{BoardName, DeckDescription, MEMORY_BYTES, MemoryFault};

/// Types of frames of the link, as Bitcraze numbers them. An answer has the type of its request.
pub mod kind {
    /// The request to look for memories; the answer is their number.
    pub const SCAN: u8 = 0x20;
    /// The request to read a part of a memory.
    pub const READ: u8 = 0x22;
}

/// The number of bytes in the answer to a request to read, whatever its length.
const READ_BYTES: usize = 29;
/// The most decks, as in crazyflie-firmware and in the nRF51's copy of the memories.
const DECKS_MAX: usize = 4;
/// The answer instead of the number of a memory that cannot be read.
const FAILED: u8 = 0xff;

/// A reason why a robot must not fly with its decks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeckRefusal {
    /// The nRF51 does not answer.
    NoAnswer,
    /// There are more decks than a robot can have.
    TooMany(u8),
    /// The nRF51 found the memory of this deck, counted from 0, but cannot read it.
    Unreadable { number: u8 },
    /// The memory of this deck, counted from 0, describes no deck.
    Damaged { number: u8, fault: MemoryFault },
    /// The firmware does not work with this deck.
    Unsupported { vendor: u8, product: u8, name: BoardName },
    /// Two decks disturb each other.
    Conflict { first: Deck, second: Deck, conflict: DeckConflict },
}

/// A request to the nRF51.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OneWireRequest {
    /// Look for memories.
    Scan,
    /// Read memory `number` from this location on.
    Read { number: u8, location: u8 },
}

impl OneWireRequest {
    /// The longest content of a request's frame.
    pub const BYTES_MAX: usize = 3 + READ_BYTES;

    /// Returns the type of the frame, and writes its content to `buffer`. A request to read is as
    /// long as its answer, as that of crazyflie-firmware.
    pub fn write(self, buffer: &mut [u8; Self::BYTES_MAX]) -> (u8, &[u8]) {
        match self {
            OneWireRequest::Scan => (kind::SCAN, &[]),
            OneWireRequest::Read { number, location } => {
                *buffer = [0; Self::BYTES_MAX];
                let [first, second, ..] = buffer;
                (*first, *second) = (number, location);
                (kind::READ, buffer)
            }
        }
    }
}

/// The progress of the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Scan,
    Read { number: u8, location: u8 },
    Done(Result<DeckSet, DeckRefusal>),
}

/// A search for decks.
pub struct DeckScan {
    step: Step,
    /// The number of memories that the nRF51 found.
    count: u8,
    /// The content of the memory that is being read.
    memory: [u8; MEMORY_BYTES],
    found: [Option<FoundDeck>; DECKS_MAX],
}

impl Default for DeckScan {
    fn default() -> Self {
        Self::new()
    }
}

impl DeckScan {
    /// Returns a search that begins.
    pub const fn new() -> Self {
        DeckScan { step: Step::Scan, count: 0, memory: [0; MEMORY_BYTES], found: [None; DECKS_MAX] }
    }

    /// Returns the request whose answer is missing; `None` once the search is done.
    pub fn request(&self) -> Option<OneWireRequest> {
        match self.step {
            Step::Scan => Some(OneWireRequest::Scan),
            Step::Read { number, location } => Some(OneWireRequest::Read { number, location }),
            Step::Done(_) => None,
        }
    }

    /// Returns the decks, or the reason why the robot must not fly; `None` before the end.
    pub fn result(&self) -> Option<Result<DeckSet, DeckRefusal>> {
        match self.step {
            Step::Done(result) => Some(result),
            _ => None,
        }
    }

    /// Processes a frame of the nRF51. Returns true if it answers the request. Answers to earlier
    /// requests, which were repeated in vain, are ignored.
    pub fn process(&mut self, kind: u8, answer: &[u8]) -> bool {
        let next = match (self.step, kind, answer) {
            (Step::Scan, kind::SCAN, [count, ..]) if usize::from(*count) > DECKS_MAX => {
                Step::Done(Err(DeckRefusal::TooMany(*count)))
            }
            (Step::Scan, kind::SCAN, [count, ..]) => {
                self.count = *count;
                self.read_or_end(0)
            }
            (Step::Read { number, .. }, kind::READ, [FAILED]) => {
                Step::Done(Err(DeckRefusal::Unreadable { number }))
            }
            (Step::Read { number, location }, kind::READ, [of, low, 0, bytes @ ..])
                if (*of, *low) == (number, location) && bytes.len() == READ_BYTES =>
            {
                self.store(number, location, bytes)
            }
            _ => return false,
        };
        self.step = next;
        true
    }

    /// Ends the search, since the nRF51 does not answer.
    pub fn give_up(&mut self) {
        if self.request().is_some() {
            self.step = Step::Done(Err(DeckRefusal::NoAnswer));
        }
    }

    /// Returns the step that reads this memory, or the end if there is no such memory.
    fn read_or_end(&self, number: u8) -> Step {
        if number < self.count {
            return Step::Read { number, location: 0 };
        }
        let mut decks = DeckSet::default();
        self.found.iter().flatten().for_each(|found| decks.insert(found.deck));
        Step::Done(Ok(decks))
    }

    /// Keeps a part of a memory, and returns the step after it.
    fn store(&mut self, number: u8, location: u8, bytes: &[u8]) -> Step {
        let rest = self.memory.get_mut(usize::from(location)..).unwrap_or_default();
        rest.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        let next = location + READ_BYTES as u8;
        if usize::from(next) < MEMORY_BYTES {
            return Step::Read { number, location: next };
        }
        match self.check(number) {
            Ok(found) => {
                if let Some(slot) = self.found.get_mut(usize::from(number)) {
                    *slot = Some(found);
                }
                self.read_or_end(number + 1)
            }
            Err(refusal) => Step::Done(Err(refusal)),
        }
    }

    /// Returns the deck of the memory that was read, if the robot may fly with it.
    fn check(&self, number: u8) -> Result<FoundDeck, DeckRefusal> {
        let description = DeckDescription::decode(&self.memory)
            .map_err(|fault| DeckRefusal::Damaged { number, fault })?;
        let DeckDescription { vendor, product, name, .. } = description;
        let unsupported = DeckRefusal::Unsupported { vendor, product, name };
        let second = FoundDeck::new(Deck::of(&description).ok_or(unsupported)?, &description);
        for first in self.found.iter().flatten() {
            if let Some(conflict) = first.conflict_with(second) {
                let (first, second) = (first.deck, second.deck);
                return Err(DeckRefusal::Conflict { first, second, conflict });
            }
        }
        Ok(second)
    }
}
