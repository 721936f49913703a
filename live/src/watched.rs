//! Robots outside the simulator, as seen from their reports: real ones, or emulated ones that are
//! traced.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::Duration;

use bittybuzz_arena::output::recording::{
    RecordedBody, RecordedRobot, RecordingHeader, RobotStatus,
};
use bittybuzz_fault::FaultDescription;

use crate::backlog::{Backlog, Report};
use crate::page_event::{
    BeginEvent, FaultConsequence, FaultEvent, GlyphName, GroupDescription, LogEvent, PageEvent,
    StateEvent,
};
use crate::samples::Samples;
use crate::source::Source;

/// Ticks per second, as in the simulator.
const TICKS_PER_SECOND: f64 = 10.0;

/// The number of past events that are kept for a page that connects later.
const KEPT_EVENTS_MAX: usize = 500;

/// The radius of a robot in the picture and the distance from one to the next, in mm. The positions
/// of the robots are not known.
const RADIUS: u32 = 30;
const APART: u32 = 100;

/// A report of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotReport {
    /// Seconds on the robot's clock; `None` if they are not known.
    pub seconds: Option<f64>,
    /// The id of the robot.
    pub robot: u16,
    pub content: ReportContent,
}

/// The content of a report.
#[derive(Debug, Clone, PartialEq)]
pub enum ReportContent {
    /// A line that the script logged, or a line about the robot.
    Line(String),
    /// A line at a start or a restart of the script.
    Began(String),
    /// A fault of the script.
    Fault {
        /// True if the fault ended only a listener or a handler.
        is_contained: bool,
        description: FaultDescription,
    },
}

/// Robots that report, from a client's view. The client cannot control them.
pub struct Watched {
    reports: Receiver<RobotReport>,
    /// The name of the robots' model, and the name of their script.
    kind: [String; 2],
    robots: Vec<(u16, RobotStatus)>,
    /// The last events of the robots, for a client that connects later.
    kept: VecDeque<Report>,
    events: Backlog,
    samples: Samples,
    tick: u64,
    /// True if no more reports can come.
    is_over: bool,
}

impl Watched {
    /// Returns a session of robots whose reports come through a channel. `robot` and `script` are
    /// the names of their model and their script. The session is over when the other end of the
    /// channel is dropped.
    pub fn new(reports: Receiver<RobotReport>, robot: &str, script: &str) -> Self {
        let mut watched = Watched {
            reports,
            kind: [robot.to_owned(), script.to_owned()],
            robots: Vec::new(),
            kept: VecDeque::new(),
            events: Backlog::default(),
            samples: Samples::NEW,
            tick: 0,
            is_over: false,
        };
        watched.begin();
        watched
    }

    fn take(&mut self, RobotReport { seconds, robot, content }: RobotReport) {
        let number = self.number(robot);
        let seconds = seconds.filter(|seconds| seconds.is_finite() && *seconds >= 0.0);
        let now = seconds.map_or(self.tick, |seconds| (seconds * TICKS_PER_SECOND) as u64);
        self.tick = self.tick.max(now);
        let event = match content {
            ReportContent::Line(text) => line(now, number, text),
            ReportContent::Began(text) => {
                self.change(number, RobotStatus::Running);
                line(now, number, text)
            }
            ReportContent::Fault { is_contained, description } => {
                if !is_contained {
                    self.change(number, RobotStatus::Faulted);
                }
                let consequence = match is_contained {
                    true => FaultConsequence::Contained,
                    false => FaultConsequence::Stop,
                };
                let (tick, robot) = (now, number);
                let fault = FaultEvent { tick, robot, consequence, description };
                Report::Fault(fault)
            }
        };
        if self.kept.len() == KEPT_EVENTS_MAX {
            self.kept.pop_front();
        }
        self.kept.push_back(event.clone());
        self.events.report(event);
    }

    /// Returns the number of the robot with an id. A robot without a previous report is added,
    /// which restarts for the client.
    fn number(&mut self, id: u16) -> usize {
        if let Some(number) = self.robots.iter().position(|(known, _)| *known == id) {
            return number;
        }
        self.robots.push((id, RobotStatus::Running));
        self.begin();
        self.robots.len() - 1
    }

    fn change(&mut self, number: usize, to: RobotStatus) {
        if let Some((_, state)) = self.robots.get_mut(number)
            && *state != to
        {
            *state = to;
            // A sample is sent at most once per tick, so a change needs a new tick.
            self.tick += 1;
        }
    }

    /// Returns width and height of the picture in mm.
    fn size(&self) -> [u32; 2] {
        [4 * APART + APART * self.robots.len() as u32, 3 * APART]
    }

    fn add_state(&mut self) {
        let (tick, plays, over) = (self.tick, !self.is_over, self.is_over);
        self.events.push(PageEvent::State(StateEvent { tick, plays, rate: None, over }));
    }
}

fn line(tick: u64, robot: usize, text: String) -> Report {
    Report::Line(LogEvent { tick, robot, text, answer: None })
}

impl Source for Watched {
    fn begin(&mut self) {
        self.samples.restart();
        let [robot, script] = &self.kind;
        let groups = self.robots.iter().map(|(id, _)| GroupDescription {
            name: Some(robot.clone()),
            robot: Some(robot.clone()),
            script: Some(script.clone()),
            glyph: GlyphName::Disc,
            count: 1,
            first_id: *id,
            radius: RADIUS.into(),
            link: None,
            slots: Some(0),
            wind: None,
            surroundings: Vec::new(),
            fence: None,
        });
        let begin = BeginEvent {
            watched: Some(true),
            size: self.size().map(f64::from),
            ticks_per_second: TICKS_PER_SECOND,
            end: 1,
            groups: groups.collect(),
            ..BeginEvent::default()
        };
        self.events = Backlog::default();
        self.events.push(PageEvent::Begin(Box::new(begin)));
        self.kept.iter().for_each(|kept| self.events.report(kept.clone()));
        self.add_state();
    }

    fn request(&mut self, _: &str, _: Duration) {
        let text = "these robots are watched, not steered";
        self.events.push(PageEvent::refused(text, None));
    }

    fn advance(&mut self, _: Duration, has_time: &mut dyn FnMut() -> bool) -> bool {
        while !self.is_over {
            match self.reports.try_recv() {
                Ok(report) => self.take(report),
                Err(TryRecvError::Empty) => return false,
                Err(TryRecvError::Disconnected) => {
                    self.is_over = true;
                    self.add_state();
                }
            }
            if !has_time() {
                return true;
            }
        }
        false
    }

    fn tick(&self) -> u64 {
        self.tick
    }

    fn take_events(&mut self) -> Vec<PageEvent> {
        self.events.take()
    }

    fn take_sample(&mut self) -> Vec<u8> {
        let count = self.robots.len() as i32;
        let apart = 10 * APART as i32;
        let place = |number: i32| (2 * number - count + 1) * apart / 2;
        let robots = (0..).zip(&self.robots).map(|(number, (_, state))| {
            Some(RecordedRobot {
                x: place(number),
                y: 0,
                z: 0,
                heading: 0x4000,
                led: 0,
                state: *state,
            })
        });
        let robots: Vec<Option<RecordedRobot>> = robots.collect();
        let bodies =
            self.robots.iter().map(|(id, _)| RecordedBody { id: *id, radius: 10 * RADIUS });
        let header = RecordingHeader {
            size: self.size(),
            tick_ms: 100,
            bodies: bodies.collect(),
            ground: Vec::new(),
            obstacles: Vec::new(),
            movables: Vec::new(),
        };
        self.samples.take(self.tick, &robots, &[], || header)
    }
}
