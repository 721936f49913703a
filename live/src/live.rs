//! A session and its client.

use std::time::Duration;

use bittybuzz_arena::run::{Session, Verdict};
use bittybuzz_arena::scenario::ScenarioError;
use bittybuzz_inspect::Limits;
use serde_json::{Value, json};

use crate::begin;
use crate::events::Notes;
use crate::inspection;
use crate::pace::{Pace, RATES};
use crate::request::Request;
use crate::samples::Samples;

/// The part of a robot's tables that is shown: enough to look at, and little enough to be sent often.
const LIMITS: Limits = Limits { depth: 4, values: 500 };

/// A session that a client steers and watches.
pub struct Live {
    session: Session,
    pace: Pace,
    samples: Samples,
    events: Vec<Value>,
    /// The robot whose memory is shown.
    inspected: Option<usize>,
    /// The verdicts of the expectations, as the client knows them.
    verdicts: Vec<Verdict>,
    /// Its robots' firmware could not go on.
    has_failed: bool,
}

impl Live {
    /// A session that stands still. Its first event is the world.
    #[must_use]
    pub fn new(session: Session) -> Self {
        let mut live = Live {
            session,
            pace: Pace::Still,
            samples: Samples::NEW,
            events: Vec::new(),
            inspected: None,
            verdicts: Vec::new(),
            has_failed: false,
        };
        live.begin();
        live
    }

    /// A client has come, perhaps in place of another one: the next events are all that it has to know.
    pub fn begin(&mut self) {
        self.samples.restart();
        self.verdicts.clear();
        self.events = vec![begin::describe(self.session.run())];
        self.tell_verdicts();
        self.tell_state();
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Carries a request out. `now` is the time on a clock of the caller's that never goes back.
    pub fn request(&mut self, text: &str, now: Duration) {
        match serde_json::from_str(text) {
            Ok(request) => self.carry_out(request, now),
            Err(error) => self.refuse(&format!("the request makes no sense: {error}"), None),
        }
    }

    /// Simulates the ticks that are due as long as `goes_on` returns true, which is asked before each, so that the caller can look
    /// after others. Returns true if some are still due.
    pub fn advance(&mut self, now: Duration, mut goes_on: impl FnMut() -> bool) -> bool {
        let run = self.session.run();
        let due = self.pace.due(run.now(), now);
        let (mut done, wanted) = (0, due.min(run.end().saturating_sub(run.now())));
        while done < wanted && !self.has_failed && goes_on() {
            self.tick();
            done += 1;
        }
        if due == 0 {
            return false;
        }
        self.pace.passed(done, due, self.session.run().now(), now);
        if self.session.run().is_over() || self.has_failed {
            self.pace = Pace::Still;
        }
        self.tell_verdicts();
        if self.pace == Pace::Still {
            self.tell_state();
        }
        self.pace.due(self.session.run().now(), now) > 0
    }

    /// Takes the events since the last question.
    pub fn take_events(&mut self) -> Vec<Value> {
        std::mem::take(&mut self.events)
    }

    /// Takes a sample: the robots as they are now. The memory of the robot that is inspected follows as an event.
    pub fn take_sample(&mut self) -> Vec<u8> {
        self.tell_inspection();
        self.samples.take(self.session.run())
    }

    fn carry_out(&mut self, request: Request, now: Duration) {
        match request {
            Request::Play { rate: None } => self.pace = Pace::Unlimited,
            Request::Play { rate: Some(rate) } if RATES.contains(&rate) => {
                self.pace = Pace::Rate { rate, since: now, from: self.session.run().now() };
            }
            Request::Play { rate: Some(rate) } => {
                let help = format!("it is from {} to {}", RATES.start(), RATES.end());
                return self.refuse(&format!("{rate} cannot be `rate`"), Some(help));
            }
            Request::Pause => self.pace = Pace::Still,
            Request::Step { ticks } => self.pace = Pace::Steps(ticks),
            Request::GoTo { tick } => {
                self.pace = Pace::Still;
                if let Err(error) = self.session.go_to(tick) {
                    return self.refuse(&error.to_string(), None);
                }
                self.tell_verdicts();
            }
            Request::Command { text } => {
                if let Err(errors) = self.session.command(&text) {
                    errors.iter().for_each(|error| self.refuse_command(error));
                }
                return;
            }
            Request::Inspect { robot } => {
                if let Some(robot) =
                    robot.filter(|robot| *robot >= self.session.run().robot_count())
                {
                    return self
                        .refuse(&format!("there is no robot with the number {robot}"), None);
                }
                self.inspected = robot;
                return self.tell_inspection();
            }
            Request::Commands => {
                let text = self.session.run().commands();
                self.events.push(json!({ "event": "commands", "text": text }));
                return;
            }
        }
        self.tell_state();
    }

    fn tick(&mut self) {
        let setup = self.session.run().setup().clone();
        let mut notes = Notes { setup: &setup, events: &mut self.events };
        if let Err(error) = self.session.tick_observed(&mut notes) {
            self.has_failed = true;
            self.events.push(json!({ "event": "failed", "text": error.to_string() }));
        }
        // The observer has seen the lines.
        self.session.take_log();
    }

    fn tell_state(&mut self) {
        let run = self.session.run();
        let rate = match self.pace {
            Pace::Rate { rate, .. } => Some(rate),
            _ => None,
        };
        self.events.push(json!({
            "event": "state",
            "tick": run.now(),
            "plays": self.pace != Pace::Still,
            "rate": rate,
            "over": run.is_over(),
        }));
    }

    /// Adds an event for each expectation whose verdict has changed.
    fn tell_verdicts(&mut self) {
        let convergences = self.session.run().convergences();
        let verdicts: Vec<Verdict> = convergences.iter().map(|one| one.verdict).collect();
        for (number, verdict) in verdicts.iter().enumerate() {
            if self.verdicts.get(number).unwrap_or(&Verdict::Open) == verdict {
                continue;
            }
            let verdict = match verdict {
                Verdict::Open => "open",
                Verdict::Held => "held",
                Verdict::Failed => "failed",
            };
            let tick = self.session.run().now();
            self.events.push(json!({
                "event": "expectation", "number": number, "verdict": verdict, "tick": tick,
            }));
        }
        self.verdicts = verdicts;
    }

    fn tell_inspection(&mut self) {
        let Some(robot) = self.inspected else { return };
        let run = self.session.run();
        let memory = run.inspect(robot, LIMITS).map(|memory| inspection::json(&memory));
        self.events.push(json!({
            "event": "inspection", "robot": robot, "tick": run.now(), "memory": memory,
        }));
    }

    fn refuse_command(&mut self, error: &ScenarioError) {
        self.refuse(&error.to_string(), error.help());
    }

    fn refuse(&mut self, text: &str, help: Option<String>) {
        self.events.push(json!({ "event": "refused", "text": text, "help": help }));
    }
}
