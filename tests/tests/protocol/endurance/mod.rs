//! Many robots, many steps, and hostile senders. Each of these tests takes seconds; the other tests of the protocol take one second together.

mod forged;
mod hostile;
mod stigmergy;
