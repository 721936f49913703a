//! The content of a robot's machine at its last fault.
//!
//! A machine forgets globals and calls before its script starts again. A robot keeps a copy only
//! after `Simulation::keep_post_mortems`: a run that is not watched pays neither time nor memory.

use std::sync::Arc;

use bittybuzz_inspect::{Inspection, Limits, inspect};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Vm};

use super::context::GroupContext;
use super::faults::FaultRecord;

/// The limits on the tables of a copy: enough to read, and small enough for each robot of a large
/// swarm.
const LIMITS: Limits = Limits { depth: 3, values: 200 };

/// A fault of a robot, and the content of its machine at that moment.
#[derive(Debug, Clone, PartialEq)]
pub struct PostMortem {
    pub fault: FaultRecord,
    /// The content; `None` for a robot that runs its firmware, if no copies are kept, and for further
    /// faults of listeners and handlers in a tick.
    pub content: Option<Arc<Inspection>>,
}

/// The last fault of a robot since power-on, which the snapshots of a run share. Of the faults of
/// listeners and handlers in a tick, it is the first.
#[derive(Debug, Clone, Default)]
pub struct LastFault(pub Option<Arc<PostMortem>>);

/// Reads a machine that a fault has just ended.
pub fn content<P: Profile, C: ByteCode, const SLOTS: usize>(
    context: &GroupContext,
    vm: &Vm<P, C, SLOTS>,
) -> Arc<Inspection> {
    let mut content = inspect(vm, context.symbols.as_deref(), LIMITS);
    context.neighbors_to_mm(&mut content);
    Arc::new(content)
}
