//! Events after each sample that a client may ask for: messages on their way, and a quantity of each robot.

use bittybuzz_arena::run::Simulation;
use bittybuzz_arena::scenario::Quantity;
use serde_json::{Value, json};

/// The greatest number of messages of one fate in an event: more lines than these are a gray area.
const MOST_MESSAGES: usize = 4000;

/// The fate of a message at a robot in its reach.
#[derive(Clone, Copy)]
pub enum Fate {
    /// It arrived.
    Heard,
    /// It overlapped with another one there.
    Collided,
    /// It did not arrive for another reason.
    Lost,
}

/// The wishes of the client, and the messages since the last sample.
#[derive(Default)]
pub struct Watch {
    /// Messages are wanted.
    messages: bool,
    /// The wanted quantity.
    quantity: Option<Quantity>,
    /// Senders and receivers of the messages of each fate.
    fates: [Vec<[usize; 2]>; 3],
}

impl Watch {
    /// The wishes of a client that has seen no messages yet.
    pub fn new(messages: bool, quantity: Option<Quantity>) -> Self {
        Watch { messages, quantity, ..Watch::default() }
    }

    /// Notes the fate of a message at one robot.
    pub fn note(&mut self, fate: Fate, sender: usize, receiver: usize) {
        let [heard, collided, lost] = &mut self.fates;
        let list = match fate {
            Fate::Heard => heard,
            Fate::Collided => collided,
            Fate::Lost => lost,
        };
        if self.messages && list.len() < MOST_MESSAGES {
            list.push([sender, receiver]);
        }
    }

    /// Returns the events that follow a sample.
    pub fn take(&mut self, run: &Simulation) -> Vec<Value> {
        let (mut events, tick) = (Vec::new(), run.now());
        if self.messages {
            let [heard, collided, lost] = std::mem::take(&mut self.fates);
            events.push(json!({
                "event": "messages", "tick": tick, "heard": heard, "collided": collided, "lost": lost,
            }));
        }
        if let Some(quantity) = &self.quantity
            // Looked up again each time: scripts are loaded during a run.
            && let Ok(probe) = run.setup().probe(quantity)
        {
            let (name, values) = (quantity.to_string(), run.numbers(&probe));
            events
                .push(json!({ "event": "quantity", "tick": tick, "name": name, "values": values }));
        }
        events
    }
}
