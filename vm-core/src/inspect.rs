//! Functions of [`Vm`](crate::Vm) by which programs on a host inspect a machine, between any two
//! instructions and after a fault. They only read, and allocate nothing. Firmware calls none of
//! them.
//!
//! | Subject | Function |
//! |---|---|
//! | Its state | [`Vm::activity`](crate::Vm::activity) |
//! | Functions that run, and their locals | [`Vm::frames`](crate::Vm::frames), [`Vm::local_of`](crate::Vm::local_of), [`Vm::captured`](crate::Vm::captured) |
//! | Values | [`Vm::kind`](crate::Vm::kind), [`Vm::text`](crate::Vm::text), [`Vm::entries`](crate::Vm::entries), [`Vm::closure`](crate::Vm::closure) |
//! | Other robots | [`Vm::neighbors`](crate::Vm::neighbors), [`Vm::swarms`](crate::Vm::swarms), [`Vm::stigmergies`](crate::Vm::stigmergies), [`Vm::stored_entries`](crate::Vm::stored_entries) |
//! | Events that it waits for | [`Vm::handlers`](crate::Vm::handlers), [`Vm::message_script`](crate::Vm::message_script) |
//! | Memory | [`Vm::stack_slots`](crate::Vm::stack_slots), [`Vm::heap_slots`](crate::Vm::heap_slots), [`Vm::needed_slots`](crate::Vm::needed_slots), [`Vm::slots_held_by`](crate::Vm::slots_held_by) |

pub use crate::machine::{
    Activity, CallFrame, CallFrames, ClosureParts, FramePlace, KnownSwarm, Neighbor, StoredEntry,
    TableEntries, Trigger, ValueKind,
};
