//! Inspection: a virtual machine and the symbols of its script as one tree of named values.
//!
//! [`inspect`] reads a machine between any two instructions, or after a fault. It returns an
//! [`Inspection`], which owns all its data: the calls with their locals, globals, tables, closures,
//! neighbors, swarms, stigmergies and handlers. A [`InspectedQueue`] decodes the messages that wait, and
//! [`ScriptMemory`] counts the slots that the script needs.
//!
//! # Principles
//! 1. **Inspection only reads.** A run is the same with and without inspection, and robots store no
//!    data for it.
//! 2. **Objects have an identity.** A value refers to its table or closure by an [`ObjectId`]. Each
//!    object is expanded once, so that cycles end. The caller limits the expansion.
//! 3. **Names are optional.** Without symbols, or with those of another script, numbers replace
//!    them.
//!
//! # Features
//! * `declarations` declares [`QueuedMessage`] for scripts of pages. It costs nothing in a program,
//!   because only a test uses it.
//!
//! # What it will not do
//! Change a machine, format text for users, or depend on a robot.

mod frame;
mod memory;
mod network;
mod object;
mod queue;
mod reader;
mod value;

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_vm_core::inspect::{Activity, KnownSwarm};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Vm};

pub use frame::{FrameFunction, ScriptFrame, SourcePlace};
pub use memory::ScriptMemory;
pub use network::{Handler, HandlerTrigger, InspectedEntry, InspectedNeighbor, Stigmergy};
pub use object::{Limits, Object, Objects};
pub use queue::{InspectedQueue, QueuedMessage, Queues};
pub use value::{Named, ObjectId, ScriptValue};

use reader::MachineReader;

/// The whole state of a machine, with names.
#[derive(Debug, Clone, PartialEq)]
pub struct Inspection {
    /// The machine's state.
    pub activity: Activity,
    /// The script's globals, ordered by number.
    pub globals: Vec<Named>,
    /// The active functions, innermost first. After a fault, these are the functions that it
    /// stopped.
    pub frames: Vec<ScriptFrame>,
    /// Robots whose frames were received recently, ordered by id.
    pub neighbors: Vec<InspectedNeighbor>,
    /// Swarms that the script has created.
    pub swarms: Vec<KnownSwarm>,
    /// Stigmergies that the script has created.
    pub stigmergies: Vec<Stigmergy>,
    /// The functions that handle messages and conflicts.
    pub handlers: Vec<Handler>,
    /// The messages in the queues; `None` if the caller does not provide the queues.
    pub queues: Option<Queues>,
    /// The memory in use.
    pub slots: SlotUse,
    /// The tables and closures that values refer to, expanded within the limits.
    pub objects: Objects,
}

/// The use of a machine's memory, in slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SlotUse {
    /// Slots of globals and of active functions.
    pub stack: usize,
    /// Slots of tables, closures and strings, including garbage.
    pub heap: usize,
    /// Free slots.
    pub free: usize,
}

/// Reads a machine. Symbols of another script are ignored.
pub fn inspect<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &Vm<P, C, SLOTS>,
    symbols: Option<&Symbols>,
    limits: Limits,
) -> Inspection {
    let mut reader = MachineReader::new(vm, symbols, limits);
    let globals = reader.globals();
    let frames = frame::frames(&mut reader);
    let stigmergies = network::stigmergies(&mut reader);
    let handlers = network::handlers(&mut reader);
    Inspection {
        activity: vm.activity(),
        globals,
        frames,
        neighbors: network::neighbors(vm),
        swarms: vm.swarms().collect(),
        stigmergies,
        handlers,
        queues: None,
        slots: SlotUse { stack: vm.stack_slots(), heap: vm.heap_slots(), free: vm.free_slots() },
        objects: reader.expand(),
    }
}
