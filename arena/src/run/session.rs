//! A run that commands change, and that can be taken back to any tick.

use std::fmt;
use std::sync::Arc;

use crate::scenario::ScenarioError;

use super::firmware::FirmwareError;
use super::observer::Observer;
use super::setup::Setup;
use super::simulation::Simulation;
use super::summary::Summary;
use crate::robot::LogLine;
use crate::robot::checks::{WatchStop, WatchedTick};

/// The greatest number of bytes that the copies of a session take.
pub const COPIES_BYTES: usize = 256_000_000;

/// A run, and copies of its earlier states at ticks that are equally far apart. To reach a later
/// tick, a session simulates again from a copy, which gives the same state bit for bit.
///
/// A copy takes as much memory as the run: about 3 kB for each robot in a world of 20,000, and 9 kB
/// in one of 1,000. All copies together take at most [`COPIES_BYTES`], so a larger world has fewer
/// of them and longer ways to go. A world of which not even the beginning fits is built again.
pub struct Session {
    run: Simulation,
    beginning: Beginning,
    /// The setup with which the session began, without the scripts that commands have loaded since.
    begun: Arc<Setup>,
    /// The copies by time, the first from the start of the session if it fits.
    copies: Vec<Simulation>,
    /// The number of ticks from one copy to the next.
    every: u64,
    /// The greatest number of copies.
    most: usize,
    /// The greatest number of bytes of all copies.
    bytes_max: usize,
}

/// The state with which a session began.
enum Beginning {
    /// The run without commands before its first tick, which can be built again.
    Built,
    /// Another state, of which the first copy is kept however large it is.
    Copied,
    /// Robots run in emulators, whose state cannot be copied.
    Emulated,
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

/// A reason why the commands of a session cannot be replaced.
#[derive(Debug)]
pub enum NotReplaced {
    /// The session cannot be taken to the first change.
    NoWay(NoWayBack),
    /// One of the new commands is not valid without those that are left out.
    Refused(Vec<ScenarioError>),
}

impl fmt::Display for NotReplaced {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NotReplaced::NoWay(reason) => reason.fmt(f),
            NotReplaced::Refused(errors) => {
                f.write_str("a later change does not fit any more: ")?;
                let reasons: Vec<String> = errors.iter().map(ToString::to_string).collect();
                f.write_str(&reasons.join("; "))
            }
        }
    }
}

impl std::error::Error for NotReplaced {}

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
    /// copies.
    #[must_use]
    pub fn new(run: Simulation, most: usize) -> Self {
        Session::with_bytes(run, most, COPIES_BYTES)
    }

    /// Returns a session as [`new`](Self::new) does, whose copies take at most `bytes_max` bytes.
    #[must_use]
    pub fn with_bytes(run: Simulation, most: usize, bytes_max: usize) -> Self {
        let is_first = run.now() == 0 && run.command_list().next().is_none();
        let first = run.snapshot();
        let beginning = match first {
            None => Beginning::Emulated,
            Some(_) if is_first => Beginning::Built,
            Some(_) => Beginning::Copied,
        };
        let (begun, copies) = (run.setup().clone(), Vec::new());
        let mut session = Session { run, beginning, begun, copies, every: 1, most, bytes_max };
        session.copies.extend(first.filter(|_| session.copies_max() > 0));
        session
    }

    /// Returns the number of copies for which there is room now.
    fn copies_max(&self) -> usize {
        let least = usize::from(matches!(self.beginning, Beginning::Copied));
        self.most.min(self.bytes_max / self.run.copy_bytes().max(1)).max(least)
    }

    /// Returns the run in its current state.
    pub fn run(&self) -> &Simulation {
        &self.run
    }

    /// Watches the statements of a robot's script in the next tick, as
    /// [`Simulation::watch_statements`] does.
    pub fn watch_statements(&mut self, number: usize, stop: WatchStop) {
        self.run.watch_statements(number, stop);
    }

    /// Returns the part of the last tick that the watch on a robot has read, as
    /// [`Simulation::take_statements`] does.
    pub fn take_statements(&mut self, number: usize) -> Option<WatchedTick> {
        self.run.take_statements(number)
    }

    /// Returns a session of another run with the limits of this one.
    #[must_use]
    pub fn anew(&self, run: Simulation) -> Self {
        Session::with_bytes(run, self.most, self.bytes_max)
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

    /// Replaces all commands by others, in the order of their ticks. The session goes to a state from
    /// which the way to the present leads through all changes; the caller goes on from there. The
    /// run is then the same as one to which only the new commands were given. An error leaves the
    /// session unchanged.
    pub fn replace_commands(&mut self, commands: &[(u64, String)]) -> Result<(), NotReplaced> {
        let known = self.run.command_list().zip(commands);
        let is_same =
            |((tick, text), new): &((u64, &str), &(u64, String))| *tick == new.0 && *text == new.1;
        let same = known.take_while(is_same).count();
        let old = self.run.command_list().nth(same).map(|(tick, _)| tick);
        let new = commands.get(same).map(|(tick, _)| *tick);
        let Some(parting) = old.into_iter().chain(new).min() else { return Ok(()) };
        // Programs are numbered in the order in which commands load them, and robots keep the numbers.
        // So a run whose commands load scripts starts from the beginning.
        let loads = !Arc::ptr_eq(self.run.setup(), &self.begun);
        let (mut run, first) = if loads {
            let run = self.begin_again().map_err(NotReplaced::NoWay)?;
            // A session that began later keeps the commands from before.
            let first = run.command_list().take_while(|(tick, _)| *tick < run.now()).count();
            if same < first {
                return Err(NotReplaced::NoWay(NoWayBack::BeforeBeginning(run.now())));
            }
            (run, first)
        } else {
            (self.copy_before(parting).map_err(NotReplaced::NoWay)?, same)
        };
        run.replace_commands(first, &commands[first..]).map_err(NotReplaced::Refused)?;
        let last = if loads { 0 } else { parting };
        let valid = self.copies.partition_point(|copy| copy.now() <= last);
        // A session that began later keeps its beginning.
        let least = usize::from(matches!(self.beginning, Beginning::Copied));
        self.copies.truncate(valid.max(least));
        self.run = run;
        Ok(())
    }

    /// Returns the state with which the session began, with the setup of that time.
    fn begin_again(&self) -> Result<Simulation, NoWayBack> {
        match self.beginning {
            Beginning::Built => Ok(self.run.anew(&self.begun)),
            Beginning::Emulated => Err(NoWayBack::Emulated),
            Beginning::Copied => {
                let first = self.copies.first().expect("its beginning is always kept");
                first.snapshot().ok_or(NoWayBack::Emulated)
            }
        }
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
        self.approach(tick)?;
        while self.run.now() < tick && !self.run.is_over() {
            self.advance_unseen().map_err(NoWayBack::Firmware)?;
        }
        Ok(())
    }

    /// Goes to the known state before a tick from which the way to the tick is the shortest.
    /// [`advance_unseen`](Self::advance_unseen) does the rest of the way.
    pub fn approach(&mut self, tick: u64) -> Result<(), NoWayBack> {
        if !self.is_nearest(tick) {
            self.run = self.earlier(tick)?;
        }
        Ok(())
    }

    /// Returns a run of its own in the state to which [`approach`](Self::approach) goes, without
    /// moving the session.
    pub fn copy_before(&self, tick: u64) -> Result<Simulation, NoWayBack> {
        match self.is_nearest(tick) {
            true => self.run.snapshot().ok_or(NoWayBack::Emulated),
            false => self.earlier(tick),
        }
    }

    /// Returns true if no copy is nearer to a tick than the run, from where the way leads forward.
    fn is_nearest(&self, tick: u64) -> bool {
        let now = self.run.now();
        tick >= now && self.nearest(tick).is_none_or(|copy| copy.now() <= now)
    }

    fn nearest(&self, tick: u64) -> Option<&Simulation> {
        self.copies.iter().rfind(|copy| copy.now() <= tick)
    }

    /// Returns the state of the nearest copy before a tick, or else the beginning.
    fn earlier(&self, tick: u64) -> Result<Simulation, NoWayBack> {
        let mut taken = match self.nearest(tick) {
            Some(copy) => copy.snapshot().ok_or(NoWayBack::Emulated)?,
            None => match self.beginning {
                Beginning::Built => self.run.anew(self.run.setup()),
                Beginning::Emulated => return Err(NoWayBack::Emulated),
                Beginning::Copied => {
                    let first = self.copies.first().expect("its beginning is always kept");
                    return Err(NoWayBack::BeforeBeginning(first.now()));
                }
            },
        };
        taken.copy_commands(&self.run);
        Ok(taken)
    }

    /// Simulates 100 ms and discards the lines that scripts log.
    pub fn advance_unseen(&mut self) -> Result<(), FirmwareError> {
        self.tick()?;
        self.run.take_log();
        Ok(())
    }

    /// Takes a copy if one is due. If there is no room for it, every second copy is dropped.
    fn keep(&mut self) {
        if matches!(self.beginning, Beginning::Emulated) || !self.is_copy_due() {
            return;
        }
        let most = self.copies_max();
        while self.copies.len() >= most && self.copies.len() > 1 {
            let mut number = 0;
            self.copies.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.every *= 2;
        }
        if self.copies.len() > most {
            // Robots have joined, and not even the first copy fits any more.
            self.copies.clear();
        } else if self.copies.len() < most && self.is_copy_due() {
            let mut copy = self.run.snapshot();
            // Who goes on from here has had the lines, or has not asked for them.
            copy.iter_mut().for_each(|copy| drop(copy.take_log()));
            self.copies.extend(copy);
        }
    }

    fn is_copy_due(&self) -> bool {
        self.copies.last().is_none_or(|last| self.run.now() >= last.now() + self.every)
    }
}
