//! Machines for the robots that ship, exactly as large as their files say.
//!
//! The build script writes the list. A WebAssembly module does not have them: it is downloaded and
//! should be small, and each of these types is a copy of all code of the machine.

use bittybuzz_comms::queue::{Inbox, Outbox};
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::message::{FULL_FRAME, TINY_FRAME};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

use crate::engine::FrameSighting;
use crate::robot::context::GroupContext;
use crate::robot::queue::Bounded;

use super::{Loaded, Scripted};

include!(concat!(env!("OUT_DIR"), "/machines.rs"));

/// A machine with queues of at most these lengths.
type Exact<P, const FRAME: usize, const SLOTS: usize, const IN: usize, const OUT: usize> =
    Scripted<P, Bounded<Inbox<P, FrameSighting, FRAME, IN>>, Bounded<Outbox<P, FRAME, OUT>>, SLOTS>;

/// Loads a machine that is at least as large as the robot file says.
fn load_exact<
    P: Profile,
    const FRAME: usize,
    const SLOTS: usize,
    const IN: usize,
    const OUT: usize,
>(
    context: &GroupContext,
    id: u16,
    seed: u32,
) -> Loaded
where
    Exact<P, FRAME, SLOTS, IN, OUT>: Send,
    Bounded<Inbox<P, FrameSighting, FRAME, IN>>: Send,
    Bounded<Outbox<P, FRAME, OUT>>: Send,
{
    let [inbox, outbox] = context.queues;
    let inbox = Bounded::<Inbox<P, FrameSighting, FRAME, IN>>::inbox(inbox);
    let outbox = Bounded::<Outbox<P, FRAME, OUT>>::outbox(outbox);
    Exact::<P, FRAME, SLOTS, IN, OUT>::load(context, inbox, outbox, id, seed)
}
