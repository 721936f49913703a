//! The script's schedule: global code, `init()`, and `step()` ten times per second.

use bittybuzz_kilobot::clock::{Ticks, units};
use bittybuzz_kilobot::phase::Phase;
use bittybuzz_vm_core::builtin::Feature;
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::seal::{self, SealedImage};
use bittybuzz_vm_core::{ByteCode, Entry, Fault, FaultCode, Outcome, Restarts, Vm, features};

use crate::chip::registers;
use crate::clock;
use crate::robot::KilobotHost;
use crate::section::Section;
use crate::toml;

/// The time for which the script's settings hold after the last completed step.
const HOLD: u16 = units(500);

/// The features of the virtual machine. Its parts limit them, except for the functions of `math`.
const FEATURES: u8 = {
    let left_out = if toml::MATHS { 0 } else { Feature::Maths as u8 };
    features::<Tiny>() & !left_out
};

/// The number that stands for everything that the robot offers to scripts ([`seal::robot`]). A
/// sealed image must match it.
const OFFERED: u16 = seal::robot::<Tiny>(FEATURES, toml::SIZES, Section::PARTS, toml::FUNCTIONS);

/// The virtual machine of this robot.
pub type Machine = Vm<Tiny, Section, { crate::SLOTS }>;

/// The times of the script's steps and the script's phase. The virtual machine is passed with each
/// call: at an address that the compiler knows, it takes a quarter less flash.
pub struct ScriptSchedule {
    pub(crate) phase: Phase,
    restarts: Restarts,
    ticks: Ticks,
    /// The time of the last completed step.
    completed: u16,
    /// True if the script has more to do at once.
    goes_on: bool,
    /// True if the controller has stopped the script since its last step.
    was_stopped: bool,
}

impl ScriptSchedule {
    /// Returns the schedule of a script that is not started.
    pub const fn new() -> Self {
        ScriptSchedule {
            phase: Phase::New,
            restarts: Restarts::new(),
            ticks: Ticks::start(0),
            completed: 0,
            goes_on: false,
            was_stopped: false,
        }
    }

    /// Restarts the ticks after the controller changed the mode.
    pub fn resume(&mut self, now: u16) {
        self.ticks = Ticks::start(now);
        self.completed = now;
        self.was_stopped = self.phase == Phase::Waits;
    }

    /// Returns true if the script had more to do at the end of the last call of [`run`](Self::run).
    pub fn goes_on(&self) -> bool {
        self.goes_on
    }

    /// Returns false after a fault that stopped the script, for good or until its restart.
    pub fn is_on(&self) -> bool {
        self.phase < Phase::Stopped
    }

    /// Returns true if the script will not run again.
    pub fn is_over(&self) -> bool {
        self.phase == Phase::Stopped
    }

    /// Stops the script, for good or until the pause is over.
    #[inline(never)]
    fn stop(&mut self, vm: &mut Machine, robot: &mut KilobotHost, fault: Option<Fault>) {
        robot.note(fault, false);
        self.phase = match fault {
            Some(fault) if !toml::ON_FAULT_STOPS && fault.code != FaultCode::AssertFailed => {
                self.restarts.pause();
                vm.restart();
                Phase::Rests
            }
            _ => Phase::Stopped,
        };
    }

    /// Runs a slice of the script, if it has something to do.
    #[inline(never)]
    pub fn run(&mut self, vm: &mut Machine, robot: &mut KilobotHost, now: u16) {
        self.goes_on = true;
        match self.phase {
            Phase::New => {
                if vm.load_sealed(SealedImage::new(Section), OFFERED).is_err() {
                    return self.stop(vm, robot, None);
                }
                robot.script = vm.header().map_or(0, |header| header.hash()) as u16;
                vm.set_robot_id(robot.mode.id, 0);
                self.begin(vm, Entry::Global, Phase::Global);
            }
            Phase::Global | Phase::Runs | Phase::Relays => match self.slice(vm, robot) {
                Outcome::Done => {
                    self.completed = now;
                    match self.phase {
                        Phase::Global => self.begin(vm, Entry::Init, Phase::Runs),
                        Phase::Relays => self.phase = Phase::Rests,
                        _ => {
                            self.restarts.step();
                            self.phase = Phase::Waits;
                        }
                    }
                }
                Outcome::Waiting => {
                    self.goes_on = false;
                    self.completed = now;
                    // The script waits on purpose, so these ticks are not missed.
                    let _ = self.ticks.take(now);
                }
                Outcome::Pending => {}
                Outcome::Fault(fault) => self.stop(vm, robot, Some(fault)),
            },
            Phase::Waits | Phase::Rests => {
                self.goes_on = self.ticks.take(now);
                if self.goes_on {
                    self.tick(vm, robot, now);
                }
            }
            Phase::Stopped => self.goes_on = false,
        }
        if !self.is_on() || now.wrapping_sub(self.completed) >= HOLD {
            robot.motors.set([0, 0], now);
            // The time is kept half a second in the past, so that its age does not wrap around.
            self.completed = now.wrapping_sub(HOLD);
        }
    }

    /// Runs the virtual machine until the slice is over.
    #[inline(always)]
    fn slice(&self, vm: &mut Machine, robot: &mut KilobotHost) -> Outcome {
        clock::begin_slice(&registers());
        vm.run(robot, 0)
    }

    /// Handles a tick, at which a step begins. During a pause the robot handles messages at each
    /// tick, and the last tick restarts the script.
    fn tick(&mut self, vm: &mut Machine, robot: &mut KilobotHost, now: u16) {
        robot.outbox.begin_step();
        if self.phase == Phase::Waits {
            if core::mem::take(&mut self.was_stopped) {
                vm.come_back();
            }
            self.begin(vm, Entry::Step, Phase::Runs);
        } else if self.restarts.tick() {
            robot.restart();
            self.completed = now;
            self.begin(vm, Entry::Global, Phase::Global);
        } else if vm.begin(Entry::Step) {
            self.phase = Phase::Relays;
        }
    }

    /// Begins an entry. If the script does not have it, the phase becomes `Waits`; without a
    /// `step()` it stays so for ever.
    #[inline(never)]
    fn begin(&mut self, vm: &mut Machine, entry: Entry, phase: Phase) {
        self.phase = if vm.begin(entry) { phase } else { Phase::Waits };
    }
}
