//! A run that commands change, and that can be taken back to any tick.

use std::fmt;

use crate::scenario::ScenarioError;

use super::firmware::FirmwareError;
use super::observer::Observer;
use super::simulation::Simulation;
use super::summary::Summary;
use crate::robot::LogLine;

/// A run, and copies of its earlier states at ticks that are equally far apart. To reach a later
/// tick, a session simulates again from a copy, which gives the same state bit for bit.
///
/// A copy takes as much memory as the run: about 3 kB for each robot in a world of 20,000, and 9 kB
/// in one of 1,000.
pub struct Session {
    run: Simulation,
    /// The copies by time, the first from the start of the session. Empty for a run with emulated
    /// robots, whose state cannot be copied.
    copies: Vec<Simulation>,
    /// The number of ticks from one copy to the next.
    every: u64,
    /// The greatest number of copies, at least 2.
    most: usize,
}

/// A reason why a session cannot be taken to a tick.
#[derive(Debug)]
pub enum NoWayBack {
    /// Robots run in emulators, whose state cannot be copied.
    Emulated,
    /// The session began at this later tick.
    BeforeBeginning(u64),
    /// The emulation of robots failed on the way forward.
    Firmware(FirmwareError),
}

impl fmt::Display for NoWayBack {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoWayBack::Emulated => {
                f.write_str("a run with robots in emulators cannot be taken back")
            }
            NoWayBack::BeforeBeginning(tick) => write!(f, "the session began at tick {tick}"),
            NoWayBack::Firmware(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for NoWayBack {}

impl Session {
    /// Returns a session that begins with the current state of a run, and keeps at most `most`
    /// copies, but at least 2.
    #[must_use]
    pub fn new(run: Simulation, most: usize) -> Self {
        let copies = run.snapshot().into_iter().collect();
        Session { run, copies, every: 1, most: most.max(2) }
    }

    /// Returns the run in its current state.
    pub fn run(&self) -> &Simulation {
        &self.run
    }

    /// Returns the greatest number of copies.
    pub fn most_copies(&self) -> usize {
        self.most
    }

    /// Keeps the content of each robot's machine at its last fault from now on, as
    /// [`Simulation::keep_post_mortems`] does, also after a step back.
    pub fn keep_post_mortems(&mut self) {
        self.run.keep_post_mortems();
        self.copies.iter_mut().for_each(Simulation::keep_post_mortems);
    }

    /// Gives a command, as [`Simulation::command`] does. If the session was taken back, all later
    /// states and commands are discarded.
    pub fn command(&mut self, text: &str) -> Result<(), Vec<ScenarioError>> {
        self.run.command(text)?;
        let now = self.run.now();
        let later = self.copies.partition_point(|copy| copy.now() <= now);
        self.copies.truncate(later);
        Ok(())
    }

    /// Simulates 100 ms, as [`Simulation::tick`] does.
    pub fn tick(&mut self) -> Result<(), FirmwareError> {
        self.run.tick()?;
        self.keep();
        Ok(())
    }

    /// Simulates 100 ms and shows them to an observer, as [`Simulation::tick_observed`] does.
    pub fn tick_observed(&mut self, observer: &mut dyn Observer) -> Result<(), FirmwareError> {
        self.run.tick_observed(observer)?;
        self.keep();
        Ok(())
    }

    /// Returns the lines that were logged since the last call, as [`Simulation::take_log`] does.
    /// The lines of ticks that [`go_to`](Self::go_to) simulates are not included.
    pub fn take_log(&mut self) -> Vec<(usize, LogLine)> {
        self.run.take_log()
    }

    /// Returns the results of the run up to now.
    pub fn summary(&mut self) -> Summary {
        self.run.summary()
    }

    /// Goes back or forward to a tick, but not beyond the end of the run. After a step back, later
    /// commands act again at their times, until a new command replaces them.
    pub fn go_to(&mut self, tick: u64) -> Result<(), NoWayBack> {
        let now = self.run.now();
        let nearest = self.copies.iter().rfind(|copy| copy.now() <= tick);
        let is_nearer = |copy: &&Simulation| tick < now || copy.now() > now;
        if let Some(copy) = nearest.filter(is_nearer) {
            let mut taken = copy.snapshot().ok_or(NoWayBack::Emulated)?;
            taken.copy_commands(&self.run);
            self.run = taken;
        } else if tick < now {
            let first = self.copies.first().map(Simulation::now);
            return Err(first.map_or(NoWayBack::Emulated, NoWayBack::BeforeBeginning));
        }
        while self.run.now() < tick && !self.run.is_over() {
            self.tick().map_err(NoWayBack::Firmware)?;
            self.run.take_log();
        }
        Ok(())
    }

    /// Takes a copy if one is due. If there are then too many copies, every second one is dropped.
    fn keep(&mut self) {
        // A run with emulated robots has no copies.
        let Some(last) = self.copies.last() else { return };
        if self.run.now() < last.now() + self.every {
            return;
        }
        self.copies.extend(self.run.snapshot());
        if self.copies.len() > self.most {
            let mut number = 0;
            self.copies.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.every *= 2;
        }
    }
}
