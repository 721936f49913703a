//! Events after each sample that a client subscribes to: messages between robots, and a quantity of
//! each robot.

use bittybuzz_arena::run::Simulation;
use bittybuzz_arena::scenario::Quantity;

use crate::page_event::{MessagesEvent, PageEvent, QuantityEvent};

/// The greatest number of messages of one fate in an event: more lines than this merge into a gray
/// area.
const MESSAGES_MAX: usize = 4000;

/// The fate of a message at a robot in range.
#[derive(Clone, Copy)]
pub enum MessageFate {
    /// The message arrived.
    Received,
    /// The message overlapped with another one at the receiver.
    Collided,
    /// The message was lost for another reason.
    Lost,
}

/// The subscription of a client, and the messages since the last sample.
#[derive(Default)]
pub struct Watch {
    /// True if the client wants messages.
    messages: bool,
    /// The quantity that the client wants.
    quantity: Option<Quantity>,
    /// The sender and the receiver of each message, by fate.
    fates: [Vec<[usize; 2]>; 3],
}

impl Watch {
    /// Returns the subscription of a client, without messages yet.
    pub fn new(messages: bool, quantity: Option<Quantity>) -> Self {
        Watch { messages, quantity, ..Watch::default() }
    }

    /// Returns true if the client wants messages.
    pub fn has_messages(&self) -> bool {
        self.messages
    }

    /// Records the fate of a message at one robot.
    pub fn record(&mut self, fate: MessageFate, sender: usize, receiver: usize) {
        let [heard, collided, lost] = &mut self.fates;
        let list = match fate {
            MessageFate::Received => heard,
            MessageFate::Collided => collided,
            MessageFate::Lost => lost,
        };
        if list.len() < MESSAGES_MAX {
            list.push([sender, receiver]);
        }
    }

    /// Forgets the messages since the last sample.
    pub fn forget(&mut self) {
        self.fates = Default::default();
    }

    /// Returns the events that follow a sample.
    pub fn take(&mut self, run: &Simulation) -> Vec<PageEvent> {
        let (mut events, tick) = (Vec::new(), run.now());
        if self.messages {
            let [heard, collided, lost] = std::mem::take(&mut self.fates);
            events.push(PageEvent::Messages(MessagesEvent { tick, heard, collided, lost }));
        }
        if let Some(quantity) = &self.quantity
            // Resolved again each time, because scripts may be loaded during a run.
            && let Ok(probe) = run.setup().probe(quantity)
        {
            let (name, values) = (quantity.to_string(), run.numbers(&probe));
            events.push(PageEvent::Quantity(QuantityEvent { tick, name, values }));
        }
        events
    }
}
