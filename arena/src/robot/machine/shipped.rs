//! Machines for the robots that ship, exactly as large as their files say.
//!
//! The build script writes the list. A WebAssembly module does not have them: it is downloaded and
//! should be small, and each of these types is a copy of all code of the machine.

use bittybuzz_comms::queue::{Inbox, Outbox};
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::message::{FULL_FRAME, TINY_FRAME};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

use crate::engine::FrameSighting;
use crate::robot::context::{GroupContext, KeptImage};
use crate::robot::queue::Bounded;

use super::{Loaded, Scripted};

include!(concat!(env!("OUT_DIR"), "/machines.rs"));

/// A machine with queues of at most these lengths, for frames and for long messages.
type Exact<
    P,
    const FRAME: usize,
    const SLOTS: usize,
    const IN: usize,
    const OUT: usize,
    const LONG_IN: usize,
    const LONG_OUT: usize,
> = Scripted<
    P,
    KeptImage,
    Bounded<Inbox<P, FrameSighting, FRAME, IN, LONG_IN>>,
    Bounded<Outbox<P, FRAME, OUT, LONG_OUT>>,
    SLOTS,
>;

/// Loads a machine that is at least as large as the robot file says.
fn load_exact<
    P: Profile,
    const FRAME: usize,
    const SLOTS: usize,
    const IN: usize,
    const OUT: usize,
    const LONG_IN: usize,
    const LONG_OUT: usize,
>(
    context: &GroupContext,
    id: u16,
    seed: u32,
) -> Loaded
where
    Exact<P, FRAME, SLOTS, IN, OUT, LONG_IN, LONG_OUT>: Send,
    Bounded<Inbox<P, FrameSighting, FRAME, IN, LONG_IN>>: Send,
    Bounded<Outbox<P, FRAME, OUT, LONG_OUT>>: Send,
{
    let [inbox, outbox, in_long, out_long] = context.queues;
    let inbox = Bounded::<Inbox<P, FrameSighting, FRAME, IN, LONG_IN>>::inbox(inbox, in_long);
    let outbox = Bounded::<Outbox<P, FRAME, OUT, LONG_OUT>>::outbox(outbox, out_long);
    Exact::<P, FRAME, SLOTS, IN, OUT, LONG_IN, LONG_OUT>::load(context, inbox, outbox, id, seed)
}
