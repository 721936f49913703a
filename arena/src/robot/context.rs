//! Data that is shared, in all runs, by the robots of a group that run the same program.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_inspect::Inspection;
use bittybuzz_robot_spec::{NumberProfile, OnFault, Robot, RobotFunction};
use bittybuzz_vm_core::{FlashArea, Periods, Sizes};

use crate::engine::TICK_US;

use super::call::{Done, Effect};
use super::content::ScriptNumber;
use super::program::ProgramId;

const TICKS_PER_SECOND: u32 = 1_000_000 / TICK_US;

/// Returns the step rates, in steps per second, with a whole number of ticks from one step to the
/// next, greatest first.
pub fn step_rates() -> impl Iterator<Item = u32> {
    (1..=TICKS_PER_SECOND).rev().filter(|rate| TICKS_PER_SECOND.is_multiple_of(*rate))
}

/// Bytes of a kept image: the largest size of an image, and two more for [`FlashArea`], which reads them
/// without a check.
const IMAGE_BYTES: usize = (1 << 16) + 2;

/// An image that is never freed.
pub type KeptImage = FlashArea<'static, IMAGE_BYTES>;

/// A program of a group's robots, with the parameters of their machine and their functions.
pub struct GroupContext {
    pub program: ProgramId,
    /// The program without the questions at its end.
    pub script: ProgramId,
    /// Profile of the machine.
    pub profile: NumberProfile,
    /// The image of the script.
    pub image: KeptImage,
    /// The image of the script without the questions at its end.
    pub origin: KeptImage,
    /// The names of the script, if they are known.
    pub symbols: Option<Arc<Symbols>>,
    /// Slots of the machine for the script.
    pub slots: usize,
    /// Network memory of the machine.
    pub sizes: Sizes,
    /// The number of frames that can wait to be read by the script, and that can wait to be sent;
    /// and the same for long messages.
    pub queues: [usize; 4],
    /// Approximate number of instructions that a robot executes in a tick.
    pub budget: u16,
    /// The ids that scripts see, by the order in which robots come into the world.
    pub ids: Arc<[u16]>,
    /// The unit, in mm, in which scripts get the distance of a neighbor.
    pub neighbor_unit_mm: f32,
    /// Ticks from one step to the next.
    pub step_ticks: u64,
    /// Steps between messages that the machine sends on its own.
    pub periods: Periods,
    /// The consequence of a fault.
    pub on_fault: OnFault,
    /// The numbers that globals of the script have after its global code.
    pub globals: Box<[(u16, ScriptNumber)]>,
    robot: Arc<Robot>,
    /// The hash of each function's name, ascending, its index in the robot file, and its effect.
    functions: Vec<(u16, usize, Effect)>,
}

impl GroupContext {
    /// Returns the context of robots with that robot file and program. `effect` gives the effect of
    /// each function, and `ids` are those that scripts see, by the order in which robots come into
    /// the world.
    pub fn new(
        robot: &Arc<Robot>,
        (program, image): (ProgramId, &[u8]),
        symbols: Option<Arc<Symbols>>,
        budget: u16,
        ids: Arc<[u16]>,
        effect: impl Fn(&RobotFunction) -> Option<Effect>,
    ) -> Self {
        let known = robot.functions.iter().enumerate();
        let mut functions: Vec<_> = known
            .map(|(index, known)| {
                let idle = || -> Effect { Box::new(|_| Done::Idle) };
                (known.hash(), index, effect(known).unwrap_or_else(idle))
            })
            .collect();
        functions.sort_by_key(|(hash, ..)| *hash);
        let vm = &robot.vm;
        GroupContext {
            program,
            script: program,
            profile: robot.profile,
            image: kept(image),
            origin: kept(image),
            symbols,
            slots: vm.slots as usize,
            sizes: robot.sizes(),
            queues: [vm.in_queue, vm.out_queue, vm.in_long, vm.out_long]
                .map(|length| length as usize),
            budget,
            ids,
            neighbor_unit_mm: robot.neighbor_unit().mm() as f32,
            step_ticks: (TICKS_PER_SECOND / robot.tick_hz.max(1)).max(1).into(),
            periods: Periods {
                beacon: steps(vm.beacon_steps),
                forget: steps(vm.forget_steps),
                advertise: steps(vm.advertise_steps),
            },
            on_fault: robot.on_fault,
            globals: Box::default(),
            robot: Arc::clone(robot),
            functions,
        }
    }

    /// Sets the numbers that globals of the script have after its global code.
    #[must_use]
    pub fn with_globals(self, globals: Box<[(u16, ScriptNumber)]>) -> Self {
        GroupContext { globals, ..self }
    }

    /// Returns the context of robots whose program has a question at the end of that of `base`.
    #[must_use]
    pub fn extending(self, base: &Self) -> Self {
        GroupContext { script: base.script, origin: base.origin, ..self }
    }

    /// Returns true if the program is that of `base` with questions at its end.
    pub fn extends(&self, base: &Self) -> bool {
        // Equal images are kept once.
        std::ptr::eq(self.origin.image(), base.image.image())
    }

    /// Converts the distances of neighbors to mm, which are in the unit of another host in some
    /// machines.
    pub fn neighbors_to_mm(&self, content: &mut Inspection) {
        for [distance, ..] in content.neighbors.iter_mut().filter_map(|known| known.place.as_mut())
        {
            *distance *= self.neighbor_unit_mm;
        }
    }

    /// Returns the function of that name hash, and its effect.
    pub fn function(&self, hash: u16) -> Option<(&RobotFunction, &Effect)> {
        let found = self.functions.binary_search_by_key(&hash, |(hash, ..)| *hash).ok()?;
        let (_, index, effect) = &self.functions[found];
        Some((&self.robot.functions[*index], effect))
    }
}

/// Returns a copy of an image that exists as long as the process. A machine cannot own its image,
/// because it copies the reference to the image freely. Equal images are kept once.
fn kept(image: &[u8]) -> KeptImage {
    static KEPT: Mutex<BTreeMap<Vec<u8>, KeptImage>> = Mutex::new(BTreeMap::new());
    // The map is consistent even if its last user panicked.
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = kept.get(image) {
        return *known;
    }
    let new = padded(image);
    kept.insert(image.to_vec(), new);
    new
}

/// Returns a copy of an image with zeros after it. An image that is too long for a machine is cut,
/// but remains too long.
fn padded(image: &[u8]) -> KeptImage {
    let bytes = Box::leak(Box::new([0; IMAGE_BYTES]));
    let length = image.len().min(KeptImage::LENGTH_MAX);
    bytes[..length].copy_from_slice(&image[..length]);
    FlashArea::new(bytes, length).expect("the length is at most that of a flash area")
}

fn steps(count: u32) -> u8 {
    u8::try_from(count).expect("the reader of robot files accepts at most 255 steps")
}
