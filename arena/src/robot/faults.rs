//! The faults of a robot's script, and the pauses after which the script restarts.

use bittybuzz_inspect::ScriptMemory;
use bittybuzz_vm_core::{Entry, Fault, Restarts};

use super::program::ProgramId;

/// The largest number of fault places that are remembered per robot. Faults at other places are
/// only counted.
const PLACES_MAX: usize = 8;

/// The faults of a robot's script at one place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultRecord {
    /// Tick of the first fault.
    pub tick: u64,
    /// The program of the robot.
    pub program: ProgramId,
    /// Code and operands of the first fault.
    pub fault: Fault,
    /// Positions in the code, innermost first.
    pub positions: Vec<u16>,
    /// The entry of the script that the robot had called, if it is known.
    pub entry: Option<Entry>,
    /// The argument lists that the robot function accepts, if it refused its arguments.
    pub refusal: Option<String>,
    /// The memory of the machine after the first fault, if it ran out of memory. Firmware does not
    /// report it.
    pub memory: Option<ScriptMemory>,
    /// The consequence of the first fault.
    pub consequence: Consequence,
    /// Faults with this code at this place.
    pub count: u32,
}

/// The consequence of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Consequence {
    /// A listener or a handler of conflicts ended, and the script continued.
    Contained,
    /// The script restarts after this number of ticks.
    Pause(u16),
    /// The script stopped until power-on.
    Stop,
}

/// The numbers of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FaultCounts {
    /// Faults that stopped a script.
    pub faults: u64,
    /// Restarts after such a fault, without a power-on.
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

/// The reason why a script does not run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Halt {
    Pause,
    UntilPowerOn,
}

/// The faults of a robot. Most robots have none, so it is allocated at the first one.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    places: Vec<FaultRecord>,
    counts: FaultCounts,
    restarts: Restarts,
    halt: Option<Halt>,
}

impl Faults {
    /// Returns the places of faults, ordered by the time of the first fault at each.
    pub fn places(&self) -> &[FaultRecord] {
        &self.places
    }

    /// Returns the numbers of faults since power-on.
    pub fn counts(&self) -> FaultCounts {
        self.counts
    }

    /// Returns true while the script does not run because of a fault.
    pub fn is_halted(&self) -> bool {
        self.halt.is_some()
    }

    /// Returns true if the script does not restart by itself.
    pub fn is_over(&self) -> bool {
        self.halt == Some(Halt::UntilPowerOn)
    }

    /// Stores the number of failed handlers that the firmware reports. The firmware describes only
    /// the first failure at each place.
    pub fn has_contained(&mut self, count: u16) {
        self.counts.handler_faults = self.counts.handler_faults.max(count.into());
    }

    /// Returns the pause after a fault that stops the script now.
    pub fn next_pause(&mut self) -> Consequence {
        Consequence::Pause(self.restarts.pause())
    }

    /// Counts a fault, whose consequence begins now.
    pub fn add(&mut self, record: FaultRecord) {
        let (count, halt) = match record.consequence {
            Consequence::Contained => (&mut self.counts.handler_faults, self.halt),
            Consequence::Pause(_) => (&mut self.counts.faults, Some(Halt::Pause)),
            Consequence::Stop => (&mut self.counts.faults, Some(Halt::UntilPowerOn)),
        };
        *count += 1;
        self.halt = halt;
        self.remember(record);
    }

    /// Handles the firmware's report that the script, which has just stopped, restarts after
    /// `pause` ticks.
    pub fn has_paused(&mut self, pause: u16) {
        self.halt = Some(Halt::Pause);
        let last = self.places.iter_mut().find(|place| place.consequence == Consequence::Stop);
        if let Some(last) = last {
            last.consequence = Consequence::Pause(pause);
        }
    }

    /// Counts a tick of the pause. Returns true if this tick ends the pause.
    pub fn tick(&mut self) -> bool {
        self.restarts.tick()
    }

    /// Marks the script as running again and counts the restart.
    pub fn start(&mut self) {
        self.counts.restarts += 1;
        self.halt = None;
    }

    /// Counts a completed step, which affects the length of the next pause.
    pub fn step(&mut self) {
        self.restarts.step();
    }

    fn remember(&mut self, record: FaultRecord) {
        let is_contained = |record: &FaultRecord| record.consequence == Consequence::Contained;
        let place =
            |record: &FaultRecord| (record.fault.position, record.fault.code, is_contained(record));
        if let Some(known) = self.places.iter_mut().find(|known| place(known) == place(&record)) {
            known.count += record.count;
        } else if self.places.len() < PLACES_MAX {
            self.places.push(record);
        }
    }
}

#[cfg(test)]
mod tests {
    use bittybuzz_vm_core::{FaultCode, Type};

    use super::*;

    fn record(position: u16, consequence: Consequence) -> FaultRecord {
        let operands = [Type::Nil, Type::Int];
        FaultRecord {
            tick: 7,
            program: ProgramId(0),
            fault: Fault { code: FaultCode::WrongType, position, operands, detail: 0 },
            positions: vec![position],
            entry: None,
            refusal: None,
            memory: None,
            consequence,
            count: 1,
        }
    }

    fn stop(faults: &mut Faults) {
        faults.add(record(5, Consequence::Stop));
    }

    fn contain(faults: &mut Faults, position: u16) {
        faults.add(record(position, Consequence::Contained));
    }

    /// The trace of a robot has a fault, then the pause, then the restart.
    #[test]
    fn firmware_reports_a_restart_after_the_fault() {
        let mut faults = Faults::default();
        stop(&mut faults);
        assert!(faults.is_over(), "until it reports a restart");
        faults.has_paused(20);
        assert!(faults.is_halted() && !faults.is_over());
        assert_eq!(faults.places()[0].consequence, Consequence::Pause(20));
        faults.start();
        assert!(!faults.is_halted());
        stop(&mut faults);
        faults.has_paused(40);
        let expected = FaultCounts { faults: 2, restarts: 1, handler_faults: 0 };
        assert_eq!((faults.counts(), faults.places()[0].count), (expected, 2));
    }

    /// Firmware describes the first fault of a handler at each place, and counts all of them.
    #[test]
    fn firmware_counts_handlers_that_failed() {
        let mut faults = Faults::default();
        contain(&mut faults, 5);
        faults.has_contained(1);
        assert_eq!(faults.counts().handler_faults, 1);
        faults.has_contained(4);
        contain(&mut faults, 9);
        faults.has_contained(5);
        assert_eq!((faults.counts().handler_faults, faults.places().len()), (5, 2));
    }

    #[test]
    fn one_place_may_stop_the_script_and_fail_in_a_listener() {
        let mut faults = Faults::default();
        contain(&mut faults, 5);
        let pause = faults.next_pause();
        faults.add(record(5, pause));
        let consequences = faults.places().iter().map(|place| place.consequence);
        assert!(consequences.eq([Consequence::Contained, Consequence::Pause(10)]));
        (0..20).for_each(|position| contain(&mut faults, position));
        assert_eq!((faults.places().len(), faults.counts().handler_faults), (PLACES_MAX, 21));
    }
}
