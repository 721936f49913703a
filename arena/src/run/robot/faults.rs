//! The faults of a robot's script, and the pauses after which it starts again.

use bittybuzz_vm_core::{Entry, Fault, Restarts};

/// The number of places that are remembered of a robot. Faults at other places are counted only.
const PLACES: usize = 8;

/// The faults of a robot's script at one place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultRecord {
    /// Tick of the first one.
    pub tick: u64,
    /// Code and operands of the first one.
    pub fault: Fault,
    /// Positions in the code, innermost first.
    pub positions: Vec<u16>,
    /// The entry that the robot had called, if that is known.
    pub entry: Option<Entry>,
    /// The argument lists of the robot function that refused its arguments.
    pub refusal: Option<String>,
    /// The consequence of the first one.
    pub consequence: Consequence,
    /// Faults with this code at this place.
    pub count: u32,
}

/// The consequence of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Consequence {
    /// A listener or a handler of conflicts ended, and the script went on.
    Contained,
    /// The script starts again after this number of ticks.
    Pause(u16),
    /// The script stopped until power-on.
    Stop,
}

/// Numbers of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FaultCounts {
    /// Faults that stopped a script.
    pub faults: u64,
    /// Starts after such a fault, without a power-on.
    pub restarts: u64,
    /// Faults that ended a listener or a handler of conflicts.
    pub handler_faults: u64,
}

impl std::ops::AddAssign for FaultCounts {
    fn add_assign(&mut self, other: Self) {
        self.faults += other.faults;
        self.restarts += other.restarts;
        self.handler_faults += other.handler_faults;
    }
}

/// A script that does not run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Halt {
    Pause,
    UntilPowerOn,
}

/// The faults of a robot. Most robots have none, so it is allocated at the first one.
#[derive(Debug, Default)]
pub struct Faults {
    places: Vec<FaultRecord>,
    counts: FaultCounts,
    restarts: Restarts,
    halt: Option<Halt>,
}

impl Faults {
    /// The places of faults, by the time of their first fault.
    pub fn places(&self) -> &[FaultRecord] {
        &self.places
    }

    /// The numbers since power-on.
    pub fn counts(&self) -> FaultCounts {
        self.counts
    }

    /// Returns true while the script does not run because of a fault.
    pub fn is_halted(&self) -> bool {
        self.halt.is_some()
    }

    /// Returns true if the script does not start again by itself.
    pub fn is_over(&self) -> bool {
        self.halt == Some(Halt::UntilPowerOn)
    }

    /// A fault has ended a listener or a handler of conflicts.
    pub fn contain(&mut self, record: FaultRecord) {
        self.counts.handler_faults += 1;
        self.remember(record);
    }

    /// Firmware reports the number of handlers that failed, of which it describes the first at each place.
    pub fn has_contained(&mut self, count: u16) {
        self.counts.handler_faults = self.counts.handler_faults.max(count.into());
    }

    /// A fault has stopped the script, which starts again when a pause is over.
    pub fn pause(&mut self, record: FaultRecord) {
        let pause = self.restarts.pause();
        self.counts.faults += 1;
        self.halt = Some(Halt::Pause);
        self.remember(FaultRecord { consequence: Consequence::Pause(pause), ..record });
    }

    /// A fault has stopped the script until power-on, as far as is known.
    pub fn stop(&mut self, record: FaultRecord) {
        self.counts.faults += 1;
        self.halt = Some(Halt::UntilPowerOn);
        self.remember(FaultRecord { consequence: Consequence::Stop, ..record });
    }

    /// Firmware reports that the script, which has just stopped, starts again after `pause` ticks.
    pub fn has_paused(&mut self, pause: u16) {
        self.halt = Some(Halt::Pause);
        let last = self.places.iter_mut().find(|place| place.consequence == Consequence::Stop);
        if let Some(last) = last {
            last.consequence = Consequence::Pause(pause);
        }
    }

    /// Counts a tick of the pause. Returns true if the pause is over with it.
    pub fn tick(&mut self) -> bool {
        self.restarts.tick()
    }

    /// The script starts again.
    pub fn start(&mut self) {
        self.counts.restarts += 1;
        self.halt = None;
    }

    /// The script has completed a step.
    pub fn step(&mut self) {
        self.restarts.step();
    }

    fn remember(&mut self, record: FaultRecord) {
        let is_contained = |record: &FaultRecord| record.consequence == Consequence::Contained;
        let place =
            |record: &FaultRecord| (record.fault.position, record.fault.code, is_contained(record));
        if let Some(known) = self.places.iter_mut().find(|known| place(known) == place(&record)) {
            known.count += record.count;
        } else if self.places.len() < PLACES {
            self.places.push(record);
        }
    }
}
