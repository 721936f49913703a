//! State that the robots of a group share in a run.

use std::sync::atomic::{AtomicBool, Ordering};

use bittybuzz_robot_spec::{Function, OnFault, Profile, Robot};
use bittybuzz_vm_core::{Periods, Sizes};

use super::call::{Done, Effect};

/// The program of a group, its machine, and the functions of its robots.
pub struct GroupContext<'p> {
    /// Profile of the machine.
    pub profile: Profile,
    /// The script.
    pub image: &'p [u8],
    /// Slots of the machine for the script.
    pub slots: usize,
    /// Network memory of the machine.
    pub sizes: Sizes,
    /// Frames that can wait to be read by the script, and to be sent.
    pub queues: [usize; 2],
    /// Instructions that a robot executes in a tick, about.
    pub budget: u16,
    /// The ids that scripts see, by the order in which robots come into the world.
    pub ids: &'p [u16],
    /// Steps between messages of the machine's own.
    pub periods: Periods,
    /// The consequence of a fault.
    pub on_fault: OnFault,
    /// Functions by the hash of their names.
    functions: Vec<(u16, &'p Function, Effect)>,
    /// A robot has logged something.
    news: AtomicBool,
}

impl<'p> GroupContext<'p> {
    /// Returns the context of robots of that file with that script. `effect` gives the effect of each function, and `ids` are
    /// those that scripts see, by the order in which robots come into the world.
    pub fn new(
        robot: &'p Robot,
        image: &'p [u8],
        budget: u16,
        ids: &'p [u16],
        effect: impl Fn(&Function) -> Option<Effect>,
    ) -> Self {
        let known = robot.functions.iter();
        let mut functions: Vec<_> = known
            .map(|known| {
                let idle = || -> Effect { Box::new(|_| Done::Idle) };
                (known.hash(), known, effect(known).unwrap_or_else(idle))
            })
            .collect();
        functions.sort_by_key(|(hash, ..)| *hash);
        let vm = &robot.vm;
        GroupContext {
            profile: robot.profile,
            image,
            slots: vm.slots as usize,
            sizes: robot.sizes(),
            queues: [vm.in_queue, vm.out_queue].map(|length| length as usize),
            budget,
            ids,
            periods: Periods {
                beacon: steps(vm.beacon_steps),
                forget: steps(vm.forget_steps),
                advertise: steps(vm.advertise_steps),
            },
            on_fault: robot.on_fault,
            functions,
            news: AtomicBool::new(false),
        }
    }

    /// Returns the function of that name hash, and its effect.
    pub fn function(&self, hash: u16) -> Option<(&'p Function, &Effect)> {
        let found = self.functions.binary_search_by_key(&hash, |(hash, ..)| *hash).ok()?;
        self.functions.get(found).map(|(_, function, effect)| (*function, effect))
    }

    /// Reports to the run that a robot has logged something.
    pub fn note(&self) {
        self.news.store(true, Ordering::Relaxed);
    }

    /// Returns true if there is, since the last question.
    pub fn take_news(&self) -> bool {
        self.news.swap(false, Ordering::Relaxed)
    }
}

/// Robot files have no more than a byte holds.
fn steps(count: u32) -> u8 {
    u8::try_from(count).unwrap_or(u8::MAX)
}
