//! Drives the virtual machine: global code, `init()`, steps, `destroy()`.

use std::time::{Duration, Instant};

use bittybuzz_arena::robot::checks::{MachineChecker, RunSlice};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_inspect::{Inspection, Limits, ScriptMemory, inspect};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{Entry, Fault, Image, ImageError, Outcome, Sighting, Sizes, Value, Vm};

use crate::host::{HostClock, HostRobot};
use crate::interrupt::Interrupt;

/// Slots of the machine that stands for every robot: the most that a machine can have.
pub const SLOTS: usize = 65_520;

/// Instructions between two checks for Ctrl-C.
const SLICE: u16 = 50_000;

/// Slices that the running entry, and then `destroy()`, still get after Ctrl-C.
const LAST_SLICES: usize = 4;

/// Instructions after which an entry counts as endless, in a run with a number of steps. This computer
/// executes them within seconds, a Crazyflie within a minute.
pub const INSTRUCTIONS_MAX: u32 = 100_000_000;

/// The limits on the tables that are read after a fault, of which a report shows the values that an
/// instruction used.
const CONTENT_LIMITS: Limits = Limits { depth: 4, values: 1000 };

/// The settings of a run.
pub struct RunSettings<'a> {
    pub id: u16,
    pub seed: u32,
    /// Slots of the robot's machine.
    pub slots: usize,
    /// The capacities for neighbors, stigmergy entries and swarms.
    pub sizes: Sizes,
    /// The number of steps, run at full speed; `None` for endless steps in real time.
    pub steps: Option<u64>,
    /// True to call `destroy()` after the last step.
    pub destroy: bool,
    /// Time between two steps.
    pub period: Duration,
    /// Robots in sight all the time.
    pub neighbors: Vec<InSight>,
    /// The checks of the script, if there are any.
    pub checker: Option<MachineChecker>,
    /// Names for the content of the machine.
    pub symbols: Option<&'a Symbols>,
}

/// A robot in sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InSight {
    pub id: u16,
    /// Distance in mm, azimuth and elevation in radians.
    pub place: [f32; 3],
}

/// The end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunEnd {
    /// The run ended as the script and the settings define it.
    Complete,
    /// A run-time error.
    Fault(Fault),
    /// Ctrl-C ended an entry that did not end by itself.
    Interrupted,
    /// An entry of a run with a number of steps did not end by itself.
    Endless,
    /// The reader of the output has closed it.
    OutputClosed,
}

/// The result of a run.
pub struct Ended {
    pub end: RunEnd,
    /// The machine's positions in the code, innermost first.
    pub positions: Vec<u16>,
    /// The last entry that was called.
    pub entry: Entry,
    /// The number of steps that were started.
    pub steps: u64,
    /// The checks of the script.
    pub checker: Option<MachineChecker>,
    /// The use of the memory, if the script ran out of it.
    pub memory: Option<ScriptMemory>,
    /// The content of the machine after a fault.
    pub content: Option<Inspection>,
}

/// Runs an image.
pub fn drive<P: Profile>(
    image: &[u8],
    settings: &RunSettings<'_>,
    is_robot_function: &dyn Fn(u16) -> bool,
    host: &mut HostRobot<'_>,
    interrupt: &mut Interrupt,
) -> Result<Ended, ImageError> {
    let mut vm: Box<Vm<P, &[u8], SLOTS>> = Box::new(Vm::new());
    vm.set_network_capacity(settings.sizes);
    vm.load_limited(Image::new(image), settings.slots, is_robot_function)?;
    vm.set_robot_id(settings.id, settings.seed);
    let neighbors = &settings.neighbors;
    let checker = settings.checker.clone();
    let slices_max = settings.steps.map(|_| INSTRUCTIONS_MAX / u32::from(SLICE));
    let entry = Entry::Global;
    let mut run = Run { vm, host, interrupt, neighbors, entry, checker, steps: 0, slices_max };
    let mut end = run.all(settings);
    if end == RunEnd::Interrupted {
        end = run.last_words();
    }
    run.host.output.flush();
    let Run { vm, entry, checker, steps, .. } = run;
    let (memory, content) = match &end {
        RunEnd::Fault(fault) => (
            ScriptMemory::after(fault, &*vm, settings.slots),
            Some(inspect(&*vm, settings.symbols, CONTENT_LIMITS)),
        ),
        RunEnd::Complete | RunEnd::Interrupted | RunEnd::Endless | RunEnd::OutputClosed => {
            (None, None)
        }
    };
    Ok(Ended { end, positions: vm.calls().collect(), entry, steps, checker, memory, content })
}

struct Run<'a, 'h, 'i, P: Profile> {
    vm: Box<Vm<P, &'i [u8], SLOTS>>,
    host: &'a mut HostRobot<'h>,
    interrupt: &'a mut Interrupt,
    neighbors: &'a [InSight],
    /// The last entry that was called.
    entry: Entry,
    checker: Option<MachineChecker>,
    /// The number of steps that were started.
    steps: u64,
    /// The most slices of an entry; `None` for any number.
    slices_max: Option<u32>,
}

impl<P: Profile> Run<'_, '_, '_, P> {
    fn all(&mut self, settings: &RunSettings<'_>) -> RunEnd {
        match self.run(settings) {
            Ok(()) => RunEnd::Complete,
            Err(end) => end,
        }
    }

    fn run(&mut self, settings: &RunSettings<'_>) -> Result<(), RunEnd> {
        self.entry(Entry::Global)?;
        self.entry(Entry::Init)?;
        match settings.steps {
            Some(steps) => {
                for _ in 0..steps {
                    self.entry(Entry::Step)?;
                }
                if settings.destroy {
                    self.entry(Entry::Destroy)?;
                }
                Ok(())
            }
            None => self.tick(settings.period),
        }
    }

    /// Runs a step per period in real time, as long as the script has a step function. A step that
    /// takes longer than a period skips ticks, which are not made up for.
    fn tick(&mut self, period: Duration) -> Result<(), RunEnd> {
        let mut tick = Instant::now();
        while self.entry(Entry::Step)? {
            self.host.output.flush();
            let now = Instant::now();
            while tick <= now {
                tick += period;
            }
            self.interrupt.wait(tick - now);
            self.look_up()?;
        }
        Ok(())
    }

    fn begin(&mut self, entry: Entry) -> bool {
        self.entry = entry;
        self.steps += u64::from(entry == Entry::Step);
        for neighbor in self.neighbors {
            let place = Some(neighbor.place.map(Value::float));
            self.vm.add_neighbor(neighbor.id, &Sighting { robot: None, place }, u8::MAX);
        }
        self.vm.begin(entry)
    }

    fn slice(&mut self) -> Outcome {
        let is_step = self.entry == Entry::Step;
        match &mut self.checker {
            None => self.vm.run(self.host, SLICE),
            Some(checker) => {
                let slice = RunSlice { budget: SLICE, tick: self.steps, is_step };
                checker.run(&mut *self.vm, self.host, slice)
            }
        }
    }

    /// Runs an entry to its end. Returns false if the script does not have it.
    fn entry(&mut self, entry: Entry) -> Result<bool, RunEnd> {
        if !self.begin(entry) {
            return Ok(false);
        }
        let mut slices = 0;
        loop {
            slices += 1;
            if self.slices_max.is_some_and(|most| slices > most) {
                return Err(RunEnd::Endless);
            }
            match self.slice() {
                Outcome::Done => {
                    self.look_up()?;
                    return Ok(true);
                }
                Outcome::Fault(fault) => return Err(RunEnd::Fault(fault)),
                Outcome::Pending => {}
                Outcome::Waiting => {
                    self.host.output.flush();
                    self.interrupt.wait(self.host.remaining_delay());
                }
            }
            self.look_up()?;
        }
    }

    /// Returns an error if the output has failed or Ctrl-C was pressed.
    fn look_up(&mut self) -> Result<(), RunEnd> {
        self.host.output.refresh();
        if self.host.output.has_failed() {
            return Err(RunEnd::OutputClosed);
        }
        if self.interrupt.is_raised() { Err(RunEnd::Interrupted) } else { Ok(()) }
    }

    /// Ends a run after Ctrl-C: lets the running entry end, and then calls `destroy()`. Both get
    /// only a few slices ([`LAST_SLICES`]), and an entry that waits is ended at once.
    fn last_words(&mut self) -> RunEnd {
        if let Some(end) = self.run_out() {
            return end;
        }
        self.host.clock = HostClock::Simulated;
        self.begin(Entry::Destroy);
        self.run_out().unwrap_or(RunEnd::Complete)
    }

    /// Runs the entry for at most [`LAST_SLICES`] slices. Returns `None` if it ended, else the
    /// reason why it did not.
    fn run_out(&mut self) -> Option<RunEnd> {
        for _ in 0..LAST_SLICES {
            match self.slice() {
                Outcome::Done => return None,
                Outcome::Fault(fault) => return Some(RunEnd::Fault(fault)),
                Outcome::Pending => {}
                Outcome::Waiting => break,
            }
        }
        Some(RunEnd::Interrupted)
    }
}
