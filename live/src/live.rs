//! A session that a client controls.

mod debugger;
mod editing;
mod news;
mod robots;
mod trying;

use std::time::Duration;

use bittybuzz_arena::output::recorder;
use bittybuzz_arena::run::{FirmwareError, Session, TICKS_PER_SECOND, Verdict};
use bittybuzz_arena::scenario::{Quantity, ScenarioCause, ScenarioError};
use bittybuzz_compiler::explain::explain;
use bittybuzz_inspect::Limits;

use crate::about::AboutDescription;
use crate::backlog::Backlog;
use crate::begin;
use crate::changes::{self, Changes};
use crate::conditions;
use crate::edit;
use crate::events::EventCollector;
use crate::faults;
use crate::pace::{Pace, RATES};
use crate::page_event::{
    AttitudesEvent, BeginEvent, CommandsEvent, ConditionsEvent, DigestEvent, ExplanationEvent,
    FailedEvent, FaultEvent, LogEvent, MeasuresEvent, PageEvent, ScenarioEvent, ScriptsDescription,
    SeekingEvent, TrialsEvent,
};
use crate::reports::Reports;
use crate::request::Request;
use crate::samples::Samples;
use crate::series::{self, Series};
use crate::source::Source;
use crate::stepping::{Breakpoints, StepPosition};
use crate::trials::Trials;
use crate::unsaved::{Unsaved, UnsavedStore};
use crate::watch::Watch;
use crate::workshop::{Drafts, Workshop};
use debugger::Walk;

/// The limits on the tables of a robot that are shown: enough to read, and small enough to be sent
/// often.
const INSPECTION_LIMITS: Limits = Limits { depth: 4, values: 500 };

/// The greatest number of requests that wait for the end of a way.
const WAITING_MAX: usize = 64;

/// A request that has waited would act at a tick that the client has not chosen.
const LEFT: &str = "the run was paused on its way to the time of this request";

const TOO_MANY: &str = "too many requests wait until the run is there";

const NO_TRIALS: &str = "this session has no trials";

const NOT_EDITED: &str = "scripts of this session cannot be edited";

/// The time between two events about a long way to a tick.
const SEEKING_EVERY: Duration = Duration::from_millis(250);

/// A way to a tick, which the run simulates without showing it.
struct Seek {
    to: u64,
    /// The tick and the time at which the way began.
    from: u64,
    since: Duration,
    /// The time of the last event about it.
    told: Duration,
    /// Requests that are carried out when the run is there.
    then: Vec<Request>,
}

/// A session that a client controls and watches.
pub struct Live {
    session: Session,
    /// The text of the scenario.
    scenario: String,
    /// The text of the scenario with which the session was opened.
    opened: String,
    pace: Pace,
    /// `None` if the run is where the client wants it.
    seek: Option<Seek>,
    samples: Samples,
    events: Backlog,
    reports: Reports,
    /// The robot whose memory is sent after each sample.
    inspected: Option<usize>,
    watch: Watch,
    series: Series,
    /// `None` if scripts cannot be edited.
    drafts: Option<Drafts>,
    unsaved: Unsaved,
    trials: Option<Trials>,
    /// Lamps and commands, as they were last sent to the client.
    conditions: ConditionsEvent,
    /// The answers to questions that wait, as they were last sent to the client.
    answers: Vec<LogEvent>,
    /// The tick of these answers. A change of the commands makes them unknown.
    answered_at: Option<u64>,
    changes: Changes,
    /// The attitudes of robots, as they were last sent to the client.
    attitudes: AttitudesEvent,
    /// The verdicts of the expectations, as they were last sent to the client.
    verdicts: Vec<Verdict>,
    /// The measures, as they were last sent to the client.
    measures: MeasuresEvent,
    /// True if the emulation of robots failed, so that the run cannot go on.
    has_failed: bool,
    /// The client's choice whether the run pauses at a fault, if it made one.
    stop_on_error: Option<bool>,
    breakpoints: Breakpoints,
    /// The statement that is shown.
    position: Option<StepPosition>,
    /// A step to a statement that goes on in later ticks.
    walk: Option<Walk>,
}

impl Live {
    /// Returns a paused session with the text of its scenario. Its first event describes the world.
    #[must_use]
    pub fn new(mut session: Session, scenario: String) -> Self {
        session.keep_post_mortems();
        let conditions = conditions::describe(session.run(), &Changes::default());
        let series = Series::new(session.run());
        let mut live = Live {
            session,
            opened: scenario.clone(),
            scenario,
            pace: Pace::Paused,
            samples: Samples::NEW,
            events: Backlog::default(),
            reports: Reports::default(),
            seek: None,
            inspected: None,
            watch: Watch::default(),
            series,
            drafts: None,
            unsaved: Unsaved::default(),
            trials: None,
            conditions,
            answers: Vec::new(),
            answered_at: None,
            changes: Changes::default(),
            attitudes: AttitudesEvent::default(),
            verdicts: Vec::new(),
            measures: MeasuresEvent::default(),
            has_failed: false,
            stop_on_error: None,
            breakpoints: Breakpoints::default(),
            position: None,
            walk: None,
        };
        live.begin();
        live
    }

    /// Allows the client to edit the scripts of the session.
    #[must_use]
    pub fn with_workshop(mut self, workshop: impl Workshop + 'static) -> Self {
        let setup = self.session.run().setup();
        self.drafts = Some(Drafts::new(Box::new(workshop), setup));
        self.begin();
        self
    }

    /// Keeps texts that the client types and does not save.
    #[must_use]
    pub fn with_unsaved(mut self, store: impl UnsavedStore + 'static) -> Self {
        self.unsaved = Unsaved::new(store);
        self.begin();
        self
    }

    /// Returns the session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Carries out a request, after those before it.
    fn execute(&mut self, request: Request, now: Duration) {
        if let Some(Seek { then, .. }) = &mut self.seek
            && request.is_about_now()
        {
            match request {
                // A time line that is dragged leads to its last place, and a new run begins at once.
                Request::GoTo { .. } | Request::Run { .. } | Request::Build { .. }
                    if then.is_empty() => {}
                _ if then.len() < WAITING_MAX => return then.push(request),
                _ => return self.refuse(TOO_MANY, None),
            }
        }
        if request.is_about_now() || request == Request::Pause {
            self.walk = None;
        }
        match request {
            Request::Play { rate: Some(rate) } if !RATES.contains(&rate) => {
                return self.refuse(&Pace::refusal(rate), None);
            }
            Request::Play { rate } => {
                if self.session.run().is_over()
                    && let Err(error) = self.session.go_to(0)
                {
                    return self.refuse(&error.to_string(), None);
                }
                if self.stops_in_this_tick() {
                    return;
                }
                self.pace = Pace::play(rate, now, self.session.run().now());
                self.add_verdicts();
                self.add_conditions();
            }
            Request::Pause => {
                self.pace = Pace::Paused;
                let waiting = self.seek.take().map(|seek| seek.then).unwrap_or_default();
                waiting.iter().for_each(|_| self.refuse(LEFT, None));
            }
            Request::Step { ticks } => {
                if self.stops_in_this_tick() {
                    return;
                }
                self.pace = Pace::Steps(ticks);
            }
            Request::Debug { robot, to } => return self.debug(robot, to, now),
            Request::Breakpoints { lines, robot } => return self.set_breakpoints(&lines, robot),
            Request::GoTo { tick } => {
                self.pace = Pace::Paused;
                if let Err(error) = self.session.approach(tick) {
                    return self.refuse(&error.to_string(), None);
                }
                let (from, to) = (self.session.run().now(), tick.min(self.session.run().end()));
                // The next turn goes there, and ends with the state.
                self.seek = Some(Seek { to, from, since: now, told: now, then: Vec::new() });
                return;
            }
            Request::Command { text } => {
                if let Err(errors) = self.session.command(&text) {
                    errors.iter().for_each(|error| self.refuse_command(error));
                }
                return self.add_conditions();
            }
            Request::Undo => return self.move_changes(true, now),
            Request::Redo => return self.move_changes(false, now),
            Request::DeleteCommand { number } => {
                let mut commands = changes::commands(self.session.run());
                if number >= commands.len() {
                    return self
                        .refuse(&format!("there is no change with the number {number}"), None);
                }
                commands.remove(number);
                self.replace_commands(&commands, now);
                return self.add_conditions();
            }
            Request::Inspect { robot } => {
                if let Some(robot) =
                    robot.filter(|robot| *robot >= self.session.run().robot_count())
                {
                    return self
                        .refuse(&format!("there is no robot with the number {robot}"), None);
                }
                self.inspected = robot;
                return self.add_inspection();
            }
            Request::Watch { messages, quantity } => {
                match self.quantity(quantity) {
                    Ok(quantity) => self.watch = Watch::new(messages, quantity),
                    Err(error) => self.refuse_command(&error),
                }
                return;
            }
            Request::Series { quantities, robots } => return self.subscribe(quantities, robots),
            Request::StopSeries => return self.series.stop(),
            Request::StopOnError { on } => {
                self.stop_on_error = Some(on);
                return;
            }
            Request::Scenario => {
                let (run, commands) = (self.session.run(), self.session.run().commands());
                let event = match &self.drafts {
                    Some(drafts) => edit::scenario(drafts, run.setup(), &self.scenario, &commands),
                    None => {
                        let text = format!("{}\n\n{commands}", self.scenario.trim_end());
                        let text = text.trim_end().to_owned() + "\n";
                        ScenarioEvent { text, missing: Vec::new() }
                    }
                };
                self.events.push(PageEvent::Scenario(event));
                return;
            }
            Request::Script { name } => {
                let (scenario, opened) = (self.scenario.clone(), self.opened.clone());
                return self.edit(|drafts, session| {
                    let texts = [scenario.as_str(), &opened];
                    Ok(vec![edit::show(drafts, session.run().setup(), &name, texts)?])
                });
            }
            Request::Check { name, text } => {
                return self.edit(|drafts, session| {
                    Ok(vec![edit::check(drafts, session.run().setup(), &name, &text)?])
                });
            }
            Request::Sweep { key, values, seeds, quantity } => {
                let sweep = self.quantity(quantity).map_err(|error| error.to_string());
                let sweep = sweep.and_then(|quantity| self.sweep(key, values, seeds, quantity));
                return self.start_trials(sweep);
            }
            Request::HandIn { by, texts } => {
                let hand_in = self.hand_in(by, &texts);
                return self.start_trials(hand_in);
            }
            Request::Grade { files } => return self.grade(files),
            Request::StopTrials => {
                self.trials = None;
                self.events.push(PageEvent::Trials(TrialsEvent { percent: 100 }));
                return;
            }
            Request::Run { texts, keep_changes } => {
                self.restart(&texts, keep_changes);
                return;
            }
            Request::Build { edit, texts, keep_changes } => {
                return self.build(&edit, texts, keep_changes);
            }
            Request::Load { name, text, robots, keep } => {
                self.edit(|drafts, session| {
                    let ran = edit::load(drafts, session, (&name, &text), robots.as_deref(), keep)?;
                    Ok(ran.to_vec())
                });
                return self.add_conditions();
            }
            Request::Write { name, text, over } => {
                return self.edit(|drafts, session| {
                    let (setup, text) = (session.run().setup(), (name.as_str(), text.as_str()));
                    Ok(vec![edit::write(drafts, setup, text, over.as_deref())?])
                });
            }
            Request::Unsaved { name, text, over } => {
                let mut unsaved = std::mem::take(&mut self.unsaved);
                self.edit(|drafts, session| {
                    let session = (&*drafts, &**session.run().setup());
                    unsaved.keep(session, &name, text.as_deref(), &over)?;
                    Ok(Vec::new())
                });
                self.unsaved = unsaved;
                return;
            }
            Request::Discard { id } => return self.unsaved.discard(&id),
            Request::Explain { code } => {
                match explain(&code) {
                    Some(text) => {
                        let text = text.to_owned();
                        self.events.push(PageEvent::Explanation(ExplanationEvent { code, text }));
                    }
                    None => self.refuse(&format!("there is no message `{code}`"), None),
                }
                return;
            }
            Request::Digest => {
                let run = self.session.run();
                let (tick, digest) = (run.now(), format!("{:016x}", run.digest()));
                self.events.push(PageEvent::Digest(DigestEvent { tick, digest }));
                return;
            }
            Request::Commands => {
                let text = self.session.run().commands();
                self.events.push(PageEvent::Commands(CommandsEvent { text }));
                return;
            }
        }
        self.add_state();
    }

    /// Parses a quantity. Its names must exist in some program.
    fn quantity(&self, text: Option<String>) -> Result<Option<Quantity>, ScenarioError> {
        let Some(text) = text else { return Ok(None) };
        let Some(quantity) = Quantity::parse(&text) else {
            return Err(ScenarioError {
                cause: ScenarioCause::UnknownQuantity { text },
                place: None,
            });
        };
        self.session.run().setup().probe(&quantity)?;
        Ok(Some(quantity))
    }

    /// Subscribes to curves.
    fn subscribe(&mut self, quantities: Vec<String>, robots: Vec<usize>) {
        let max = series::CURVES_MAX;
        if quantities.len() > max || robots.len() > series::ROBOTS_MAX {
            return self.refuse(&format!("more than {max} curves or robots have no room"), None);
        }
        let count = self.session.run().robot_count();
        if let Some(robot) = robots.iter().find(|robot| **robot >= count) {
            return self.refuse(&format!("there is no robot with the number {robot}"), None);
        }
        let parsed = quantities.into_iter().map(|text| self.quantity(Some(text)));
        match parsed.collect::<Result<Vec<_>, _>>() {
            Ok(parsed) => {
                let quantities = parsed.into_iter().flatten().collect();
                self.series.subscribe(quantities, robots, self.session.run());
            }
            Err(error) => self.refuse_command(&error),
        }
    }

    /// Simulates a tick that the client sees, and returns its faults.
    fn simulate(&mut self) -> Vec<FaultEvent> {
        self.reports.has_sent(self.session.run().now());
        self.observe(true)
    }

    /// Simulates a tick, and returns its faults.
    fn observe(&mut self, is_seen: bool) -> Vec<FaultEvent> {
        let tick = self.session.run().now();
        let setup = self.session.run().setup().clone();
        let is_new = !self.reports.knows(tick);
        let mut unseen = Watch::default();
        let mut collector = EventCollector {
            setup: &setup,
            drafts: self.drafts.as_ref(),
            events: is_seen.then_some(&mut self.events),
            reports: is_new.then_some(&mut self.reports),
            faults: Vec::new(),
            watch: if is_seen { &mut self.watch } else { &mut unseen },
        };
        let outcome = self.session.tick_observed(&mut collector);
        let faults = collector.faults;
        if let Err(error) = outcome {
            self.fail(&error);
        }
        self.reports.has_observed(tick);
        // The observer has received the lines already.
        self.session.take_log();
        self.series.record(self.session.run());
        faults
    }

    /// Simulates a tick of a way that the client does not see.
    fn pass(&mut self) {
        if !self.reports.knows(self.session.run().now()) {
            self.observe(false);
            return;
        }
        if let Err(error) = self.session.advance_unseen() {
            self.fail(&error);
        }
        self.series.record(self.session.run());
    }

    fn fail(&mut self, error: &FirmwareError) {
        self.has_failed = true;
        let text = error.to_string();
        self.events.push(PageEvent::Failed(FailedEvent { text }));
    }

    /// Goes on a way to a tick as long as `has_time` returns true. Returns true if the run is not
    /// there yet.
    fn advance_to(
        &mut self,
        mut seek: Seek,
        now: Duration,
        has_time: &mut dyn FnMut() -> bool,
    ) -> bool {
        while self.session.run().now() < seek.to && !self.has_failed && has_time() {
            self.pass();
        }
        let at = self.session.run().now();
        if at < seek.to && !self.has_failed {
            let (gone, left) = ((at - seek.from).max(1), seek.to - at);
            if now >= seek.told + SEEKING_EVERY {
                seek.told = now;
                let left = (now - seek.since).as_secs_f64() * left as f64 / gone as f64;
                self.events.push(PageEvent::Seeking(SeekingEvent { tick: seek.to, left }));
            }
            self.seek = Some(seek);
            return true;
        }
        self.add_verdicts();
        self.add_conditions();
        self.add_state();
        seek.then.into_iter().for_each(|request| self.execute(request, now));
        // Requests that waited may have begun another way, or play.
        self.seek.is_some() || self.pace != Pace::Paused
    }

    /// Simulates the ticks of the session that are due, as long as `has_time` returns true. Returns
    /// true if ticks are still due.
    fn advance_run(&mut self, now: Duration, has_time: &mut dyn FnMut() -> bool) -> bool {
        if let Some(seek) = self.seek.take() {
            return self.advance_to(seek, now, has_time);
        }
        let run = self.session.run();
        let due = self.pace.due(run.now(), now, TICKS_PER_SECOND);
        let (mut done, wanted) = (0, due.min(run.end().saturating_sub(run.now())));
        let mut stop = None;
        while done < wanted && !self.has_failed && stop.is_none() && has_time() {
            // A step to a statement passes no other one.
            let faults = match self.walk {
                Some(_) => Some(self.simulate()),
                None => self.simulate_to_breakpoint(now),
            };
            let Some(faults) = faults else { return true };
            done += 1;
            if self.stops_on_error() {
                stop = faults::stop(&faults);
            }
        }
        if due == 0 {
            return false;
        }
        self.pace.passed(done, due, self.session.run().now(), now);
        if self.session.run().is_over() || self.has_failed || stop.is_some() {
            self.pace = Pace::Paused;
        }
        if self.pace == Pace::Paused {
            self.add_verdicts();
            self.add_conditions();
            self.add_state();
        }
        let is_stopped = stop.is_some();
        self.events.extend(stop.map(PageEvent::Stopped));
        if self.pace == Pace::Paused && !is_stopped && !self.has_failed {
            self.go_on_with_step(now);
        }
        self.pace.due(self.session.run().now(), now, TICKS_PER_SECOND) > 0
    }

    /// Returns true if the run pauses at a fault. In an assignment, a fault is something to mend.
    fn stops_on_error(&self) -> bool {
        let is_assignment = || self.session.run().setup().scenario.assignment.is_some();
        self.stop_on_error.unwrap_or_else(is_assignment)
    }

    fn refuse_command(&mut self, error: &ScenarioError) {
        self.refuse(&error.to_string(), error.help());
    }

    fn refuse(&mut self, text: &str, help: Option<String>) {
        self.events.push(PageEvent::refused(text, help));
    }
}

impl Source for Live {
    fn begin(&mut self) {
        self.inspected = None;
        self.watch = Watch::default();
        self.series.restart();
        self.samples.restart();
        self.verdicts.clear();
        self.measures = MeasuresEvent::default();
        self.attitudes = AttitudesEvent::default();
        self.trials = None;
        self.reports.forget_sent(0);
        (self.position, self.walk) = (None, None);
        self.breakpoints = Breakpoints::default();
        let setup = self.session.run().setup();
        let scripts = self.drafts.as_ref().map(|drafts| ScriptsDescription {
            names: edit::names(setup),
            scenario: edit::name_of_scenario(drafts, setup),
            file: drafts.workshop().scenario().display().to_string(),
            writable: edit::writable(drafts, setup),
            begun: edit::begun(drafts, setup, &self.scenario),
            unsaved: self.unsaved.begin(drafts, setup, &self.opened),
        });
        let controls = self.drafts.as_ref().map(|drafts| edit::controls(drafts, setup));
        let drafts = self.drafts.as_ref();
        let about = drafts.map(|drafts| {
            AboutDescription::new(&self.scenario, edit::about_scripts(drafts, setup))
        });
        let stops_on_error = Some(self.stops_on_error());
        let world = begin::describe(self.session.run());
        let begin = BeginEvent { scripts, controls, about, stops_on_error, ..world };
        self.events = Backlog::default();
        self.events.push(PageEvent::Begin(Box::new(begin)));
        // The description of the world does not say if changes can be undone: an event will.
        self.conditions = conditions::describe(self.session.run(), &Changes::default());
        (self.answers, self.answered_at) = (Vec::new(), None);
        self.add_verdicts();
        self.add_state();
    }

    fn request(&mut self, text: &str, now: Duration) {
        match serde_json::from_str(text) {
            Ok(request) => self.execute(request, now),
            Err(error) => self.refuse(&format!("the request makes no sense: {error}"), None),
        }
    }

    fn advance(&mut self, now: Duration, has_time: &mut dyn FnMut() -> bool) -> bool {
        let mut has_more = self.advance_run(now, has_time);
        if let Some(trials) = &mut self.trials {
            if trials.advance(&mut self.events, has_time) {
                has_more = true;
            } else {
                self.trials = None;
            }
        }
        // A run on its way to a tick records the points itself.
        if self.seek.is_none() {
            has_more |= self.series.advance(&self.session, has_time);
        }
        has_more
    }

    fn tick(&self) -> u64 {
        self.session.run().now()
    }

    fn take_events(&mut self) -> Vec<PageEvent> {
        // Here and not after each turn, so that a client that does not read has one of each.
        self.add_verdicts();
        self.add_conditions();
        self.leave_statement(false);
        self.events.extend(self.series.take());
        self.events.take()
    }

    fn take_sample(&mut self) -> Vec<u8> {
        self.add_inspection();
        self.add_attitudes();
        self.events.extend(self.watch.take(self.session.run()));
        let run = self.session.run();
        let (robots, movables) = (recorder::robots(run), recorder::movables(run));
        self.samples.take(run.now(), &robots, &movables, || recorder::header(run))
    }
}
