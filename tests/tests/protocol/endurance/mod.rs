//! Many robots, many steps, and hostile senders. These tests take seconds, those beside them a second together.

mod forged;
mod hostile;
mod stigmergy;
