//! Line by line: requests that show the statements of a robot's script, and breakpoints.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use bittybuzz_arena::robot::checks::WatchStop;
use bittybuzz_arena::run::NoWayBack;

use super::{INSPECTION_LIMITS, Live, NOT_EDITED, Seek};
use crate::faults;
use crate::pace::Pace;
use crate::page_event::{
    BreakpointDescription, BreakpointsEvent, FaultEvent, PageEvent, StatementDescription,
    SteppedEvent,
};
use crate::request::Request;
use crate::stepping::{self, Breakpoints, KnownPositions, StepPosition, StepTo, WatchedRobot};

/// The number of ticks in which a step looks for the next statement of a robot that begins none.
const TICKS_WITHOUT: u32 = 100;

const EMULATED: &str =
    "a run with robots in emulators cannot be copied, so it has no line by line and no breakpoints";

/// A step that goes on in later ticks.
pub(super) struct Walk {
    robot: usize,
    /// The number of ticks that it may still pass.
    left: u32,
}

impl Live {
    /// Shows the statement of a robot's script at which a step ends.
    pub(super) fn debug(&mut self, robot: usize, to: StepTo, now: Duration) {
        let walk = self.walk.take();
        let run = self.session.run();
        if robot >= run.robot_count() {
            return self.refuse(&format!("there is no robot with the number {robot}"), None);
        }
        if self.pace != Pace::Paused {
            self.pace = Pace::Paused;
            self.add_state();
        }
        let run = self.session.run();
        if run.is_over() && !to.is_backward() {
            return self.refuse("the run is over: go back, or run it from the beginning", None);
        }
        let at = self.position.filter(|at| at.robot == robot && at.tick == run.now());
        let at = at.map(|at| at.number);
        // The tick that follows the end is not part of the run.
        let found = match run.is_over() {
            true => None,
            false => {
                let watched = stepping::watch(run, [robot].into_iter(), None);
                let Some(watched) = watched else { return self.refuse(EMULATED, None) };
                let (_, watched) = watched.into_iter().next().expect("it watched one robot");
                if watched.program.symbols.is_none() {
                    let text = format!("the script of robot {} has no symbols", self.id(robot));
                    return self.refuse(&text, None);
                }
                stepping::target(&watched.statements, at, to)
                    .map(|number| (number, watched.statements.len()))
            }
        };
        match (found, to) {
            (Some((number, count)), _) => self.show_statement(robot, number, count),
            (None, StepTo::At(number)) => {
                let text = format!("the tick has no statement with the number {number}");
                self.refuse(&text, None);
            }
            (None, StepTo::Back | StepTo::Last) => self.step_back(robot, now),
            (None, _) => {
                let left = walk.map_or(TICKS_WITHOUT, |walk| walk.left);
                if left == 0 {
                    let (id, seconds) = (self.id(robot), TICKS_WITHOUT / 10);
                    let text = format!("robot {id} has begun no statement for {seconds} s");
                    return self.refuse(&text, None);
                }
                self.walk = Some(Walk { robot, left: left - 1 });
                self.pace = Pace::Steps(1);
            }
        }
    }

    /// Goes to the tick before, and there to the last statement.
    fn step_back(&mut self, robot: usize, now: Duration) {
        let at = self.session.run().now();
        let to = at.checked_sub(1).ok_or(NoWayBack::BeforeBeginning(0));
        if let Err(error) = to.and_then(|to| self.session.approach(to)) {
            let text = match error {
                NoWayBack::BeforeBeginning(_) => {
                    format!("robot {} has begun no statement before", self.id(robot))
                }
                NoWayBack::Emulated => EMULATED.to_owned(),
                NoWayBack::Firmware(error) => error.to_string(),
            };
            return self.refuse(&text, None);
        }
        self.seek_then(at - 1, Request::Debug { robot, to: StepTo::Last }, now);
    }

    /// Lets the next turns go to a tick, to which the session has approached, and then carry out a
    /// request.
    fn seek_then(&mut self, to: u64, request: Request, now: Duration) {
        let from = self.session.run().now();
        self.seek = Some(Seek { to, from, since: now, told: now, then: vec![request] });
    }

    /// Goes on with a step that has passed a tick.
    pub(super) fn go_on_with_step(&mut self, now: Duration) {
        if let Some(Walk { robot, left }) = self.walk.take() {
            if self.session.run().is_over() {
                return;
            }
            self.walk = Some(Walk { robot, left });
            self.debug(robot, StepTo::First, now);
        }
    }

    fn id(&self, robot: usize) -> u16 {
        self.session.run().setup().id(robot)
    }

    fn show_statement(&mut self, robot: usize, number: usize, count: usize) {
        let run = self.session.run();
        let at = Some((number, INSPECTION_LIMITS));
        let watched = stepping::watch(run, [robot].into_iter(), at).unwrap_or_default();
        let described = watched.first().and_then(|(_, watched)| {
            let WatchedRobot { statements, content, program, setup } = watched;
            let position = statements.get(number)?.position;
            let place = faults::place(setup, self.drafts.as_ref(), robot, program, position)?;
            Some((place, faults::content(setup, content.as_deref()?)))
        });
        let (place, memory) = described.expect("a copy of the same tick has the same statements");
        let tick = run.now();
        self.position = Some(StepPosition { tick, robot, number });
        let at = StatementDescription { tick, robot, number, count, place, memory };
        self.events.push(PageEvent::Stepped(Box::new(SteppedEvent { at: Some(at) })));
    }

    /// Reports to the client that no statement is shown any more, if the run has left it.
    pub(super) fn leave_statement(&mut self, is_changed: bool) {
        let now = self.session.run().now();
        let is_moving = self.seek.is_some() || self.walk.is_some();
        if !is_moving && self.position.is_some_and(|at| is_changed || at.tick != now) {
            self.position = None;
            self.events.push(PageEvent::Stepped(Box::new(SteppedEvent { at: None })));
        }
    }

    /// Sets the lines before which the run pauses.
    pub(super) fn set_breakpoints(
        &mut self,
        lines: &BTreeMap<String, BTreeSet<u32>>,
        robot: Option<usize>,
    ) {
        let run = self.session.run();
        let Some(drafts) = &self.drafts else { return self.refuse(NOT_EDITED, None) };
        if !lines.is_empty() && run.snapshot().is_none() {
            self.events.push(PageEvent::Breakpoints(BreakpointsEvent { lines: Vec::new() }));
            return self.refuse(EMULATED, None);
        }
        let (breakpoints, found) = Breakpoints::new(drafts, run.setup(), lines, robot);
        self.breakpoints = breakpoints;
        let describe = |(script, line, at)| BreakpointDescription { script, line, at };
        let lines = found.into_iter().map(describe).collect();
        self.events.push(PageEvent::Breakpoints(BreakpointsEvent { lines }));
    }

    /// Looks for a breakpoint later in the tick of which a statement is shown, before the run goes on.
    /// Returns true if it shows one.
    pub(super) fn stops_in_this_tick(&mut self) -> bool {
        let run = self.session.run();
        let tick = run.now();
        let (Some(drafts), false, false) =
            (&self.drafts, self.breakpoints.is_empty(), run.is_over())
        else {
            return false;
        };
        let Some(at) = self.position.filter(|at| at.tick == tick) else { return false };
        let robots = self.breakpoints.robots(drafts, run);
        let watched = stepping::watch(run, robots.into_iter(), None).unwrap_or_default();
        let mut found = None;
        for (robot, WatchedRobot { statements, program, setup, .. }) in &watched {
            let mut positions = KnownPositions::new(&self.breakpoints, drafts, setup);
            let positions = positions.of(program);
            let is_later = |number: usize| StepPosition { tick, robot: *robot, number } > at;
            let later = statements.iter().enumerate().find(|(number, statement)| {
                positions.contains(&statement.position) && is_later(*number)
            });
            if let Some((number, _)) = later {
                found = Some((*robot, number, statements.len()));
                break;
            }
        }
        if let Some((robot, number, count)) = found {
            self.pace = Pace::Paused;
            self.add_state();
            self.show_statement(robot, number, count);
            return true;
        }
        self.breakpoints.passed = Some(tick);
        false
    }

    /// Simulates a tick, and returns its faults. If a robot reaches a breakpoint in it, it returns
    /// `None`: the next turn goes back to the beginning of the tick and shows the statement, and the
    /// client sees nothing else of the tick.
    pub(super) fn simulate_to_breakpoint(&mut self, now: Duration) -> Option<Vec<FaultEvent>> {
        let tick = self.session.run().now();
        let is_passed = self.breakpoints.passed.take() == Some(tick);
        let Some(drafts) =
            self.drafts.as_ref().filter(|_| !self.breakpoints.is_empty() && !is_passed)
        else {
            return Some(self.simulate());
        };
        let robots = self.breakpoints.robots(drafts, self.session.run());
        for robot in &robots {
            self.session.watch_statements(*robot, WatchStop::Never);
        }
        let before = std::mem::take(&mut self.events);
        let faults = self.simulate();
        let watched: Vec<_> = robots
            .into_iter()
            .map(|robot| {
                (robot, self.session.take_statements(robot).unwrap_or_default().statements)
            })
            .collect();
        // A command may have loaded another program at the beginning of the tick.
        let (drafts, run) = (self.drafts.as_ref(), self.session.run());
        let hit = drafts.and_then(|drafts| {
            let mut known = KnownPositions::new(&self.breakpoints, drafts, run.setup());
            watched.iter().find_map(|(robot, statements)| {
                let positions = known.of(run.program(*robot));
                let number = statements.iter().position(|one| positions.contains(&one.position));
                Some((*robot, number?))
            })
        });
        let during = std::mem::replace(&mut self.events, before);
        match hit {
            Some((robot, number)) if !self.has_failed && self.session.approach(tick).is_ok() => {
                self.watch.forget();
                self.reports.forget_sent(tick);
                self.pace = Pace::Paused;
                self.seek_then(tick, Request::Debug { robot, to: StepTo::At(number) }, now);
                None
            }
            _ => {
                self.events.append(during);
                Some(faults)
            }
        }
    }
}
