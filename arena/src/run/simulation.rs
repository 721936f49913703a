//! One run of a scenario with one seed, tick by tick.
//!
//! A simulation joins four parts: the world of the engine (bodies, links, light), in which each
//! robot has a brain with a virtual machine; the fleets of robots that run their firmware in
//! emulator programs; the events and commands that change the world; and the expectations that are
//! checked after each tick.
//!
//! # The order of a tick
//! 1. Events of the scenario and commands of the session act, in the order of their times and of
//!    the file.
//! 2. The engine runs all robots, moves bodies, and carries frames. Robots in emulators advance to
//!    the same time, and their signals move the bodies.
//! 3. Expectations are checked, measures are taken, and an observer receives the events of the
//!    tick.
//!
//! # Determinism
//! All random numbers come from the seed, by streams that belong to a robot or a link and not to a
//! thread. Work is divided by robot, and results are joined in the order of robots. So the same
//! scenario and seed give the same [`Simulation::digest`] on any number of threads, natively and in
//! WebAssembly.
//!
//! # Snapshots and sessions
//! A simulation owns everything that decides its further course, so a copy of it is a snapshot
//! ([`Simulation::snapshot`]). Every change to a running world is a command, which is stored with
//! its tick and can be written as an `[[event]]`: a session replays as a scenario. The state of
//! robots in emulators cannot be copied, so a run with them allows no snapshot.

use std::collections::BTreeMap;
use std::hash::Hasher;
use std::iter;
use std::path::Path;
use std::sync::Arc;

use bittybuzz_compiler::check::outside::called_flag;
use bittybuzz_inspect::{Inspection, Limits};

use crate::engine::{
    AddError, Attitude, Digest, Environment, HerdId, IntruderSettings, Lamp, MovableDisc, Pose,
    RobotState, RobotView, Stream, TICK_US, World,
};
use crate::robot::checks::{Findings, WatchStop, WatchedTick};
use crate::robot::{
    BatteryState, FaultCounts, Interest, LogLine, News, PoseError, PostMortem, ProgramId,
    ScriptNumber, SimRobot,
};
use crate::scenario::{
    ADVERSARIES_MAX, Adversary, Backend, NewNumbers, Quantity, ScenarioCause, ScenarioError,
    Selection, WorldChange, settings_error,
};

mod globals;
mod measuring;
mod observed;
mod questions;

pub use measuring::JoinedRobot;

use super::adversary::intruder;
use super::event_queue::EventQueue;
use super::expectation::Convergence;
use super::firmware::{FirmwareError, Fleets};
use super::place::poses;
use super::program::Program;
use super::settings::{
    engine_ground, engine_light, engine_loss, engine_movable, engine_obstacle, media, media_of,
    settings,
};
use super::setup::Setup;
use super::summary::{FaultOf, OverrunSummary, Summary, Unusable};
use super::{TICKS_PER_SECOND, tick_at};

/// The reason why the world has the brain of a robot whose id is known.
const JOINED: &str = "the world keeps every robot that has joined";

/// A run, which advances tick by tick.
pub struct Simulation {
    setup: Arc<Setup>,
    /// The engine's herd of each group, indexed by [`GroupId`](crate::scenario::GroupId).
    herds: Vec<HerdId>,
    world: World<SimRobot>,
    /// The robots that run their firmware.
    fleets: Option<Fleets>,
    event_queue: EventQueue,
    seed: u32,
    convergences: Vec<Convergence>,
    /// The measures that are known already, in the order of the file.
    measures: Vec<Option<f64>>,
    /// The places of the robots at the ticks that quantities refer to; `None` for absent robots.
    places: BTreeMap<u64, Arc<[Option<[f32; 2]>]>>,
    /// Faults of robots from before their last restart.
    faults: Vec<FaultOf>,
    /// The counters of robots from before their last restart.
    past: Past,
    news: News,
    end: u64,
    /// True if robots keep the content of their machines at a fault.
    keeps_post_mortems: bool,
    /// The events that the observer of the current tick uses; `None` in a tick without an observer.
    interest: Option<Interest>,
    /// True if robots have the memory for events, which they keep from one observed tick to the next.
    is_watched: bool,
}

impl Simulation {
    /// Creates the world before its first tick. The result does not depend on the number of
    /// `threads`; 0 uses one per core.
    pub fn new(setup: Arc<Setup>, seed: u32, threads: usize) -> Result<Self, ScenarioError> {
        let scenario = &setup.scenario;
        let settings = settings(scenario, seed, threads);
        let media = media(scenario);
        let poses = poses(scenario, settings.seed)?;
        let mut world = World::new(settings).map_err(settings_error)?;
        let herds = scenario
            .groups
            .iter()
            .map(|group| world.add_herd(group.model.clone(), media_of(scenario, media, group)));
        let herds: Result<Vec<HerdId>, _> = herds.collect();
        let herds = herds.map_err(settings_error)?;
        if !scenario.world.ground.is_empty() {
            world.set_ground(engine_ground(&scenario.world.ground));
        }
        for obstacle in &scenario.world.obstacles {
            let height = obstacle.height.map_or(f32::INFINITY, |height| height as f32);
            world.add_obstacle_of_height(engine_obstacle(obstacle.outline), height);
        }
        scenario.world.movables.iter().for_each(|disc| world.add_movable(engine_movable(disc)));
        // The program of a group from the start has the group's number.
        let groups = scenario.groups.iter().enumerate();
        let programs =
            groups.flat_map(|(number, of)| iter::repeat_n(ProgramId(number), of.count as usize));
        let robots = poses.into_iter().zip(programs);
        let lights = scenario.world.lights.iter();
        let lights = lights.map(|light| world.add_light(engine_light(*light))).collect();
        let mut simulation = Simulation {
            setup: setup.clone(),
            herds,
            world,
            fleets: None,
            event_queue: EventQueue::new(robots, lights),
            seed,
            convergences: vec![Convergence::START; setup.expects().len()],
            measures: vec![None; setup.measures().len()],
            places: BTreeMap::new(),
            faults: Vec::new(),
            past: Past::default(),
            news: News::default(),
            end: tick_at(scenario.world.duration),
            keeps_post_mortems: false,
            interest: None,
            is_watched: false,
        };
        let mut number = 0;
        for group in &scenario.groups {
            for _ in 0..group.count {
                if group.present {
                    simulation.start(number);
                }
                number += 1;
            }
        }
        let Simulation { world, event_queue, .. } = &simulation;
        simulation.fleets = Fleets::start(&setup, world, event_queue, seed)?;
        simulation.observe();
        Ok(simulation)
    }

    /// Returns a copy, whose further course is the same as that of this run, bit for bit. Returns
    /// `None` with robots in emulators, whose state cannot be copied.
    #[must_use]
    pub fn snapshot(&self) -> Option<Self> {
        if self.fleets.is_some() {
            return None;
        }
        let news = self.news.copy();
        let mut world = self.world.clone();
        for robot in world.brains_mut() {
            robot.set_news(news.clone());
            robot.stop_watching();
        }
        Some(Simulation {
            setup: self.setup.clone(),
            herds: self.herds.clone(),
            world,
            fleets: None,
            event_queue: self.event_queue.clone(),
            seed: self.seed,
            convergences: self.convergences.clone(),
            measures: self.measures.clone(),
            places: self.places.clone(),
            faults: self.faults.clone(),
            past: self.past.clone(),
            news,
            end: self.end,
            keeps_post_mortems: self.keeps_post_mortems,
            interest: None,
            is_watched: false,
        })
    }

    /// Returns about how many bytes a [`snapshot`](Self::snapshot) takes.
    pub(super) fn copy_bytes(&self) -> usize {
        let brains: usize = self.world.brains().map(SimRobot::bytes).sum();
        brains + self.world.len() * self.world.bytes_per_body() + size_of::<Self>()
    }

    /// Returns the run before its first tick, with its own setup or another one of the scenario.
    pub(super) fn anew(&self, setup: &Arc<Setup>) -> Self {
        let anew = Simulation::new(setup.clone(), self.seed, 1);
        let mut anew = anew.expect("the run began with the same scenario");
        anew.world.share_threads(&self.world);
        if self.keeps_post_mortems {
            anew.keep_post_mortems();
        }
        anew
    }

    /// Replaces the commands from a number on, none of which was carried out, by others in their order.
    pub(super) fn replace_commands(
        &mut self,
        first: usize,
        others: &[(u64, String)],
    ) -> Result<(), Vec<ScenarioError>> {
        self.event_queue.truncate_commands(first);
        others.iter().try_for_each(|(tick, text)| self.command_at(*tick, text))
    }

    /// Copies the commands of a later state of the same run, and the scripts that they load, so
    /// that this state goes on to the later one.
    pub(super) fn copy_commands(&mut self, later: &Self) {
        self.setup = later.setup.clone();
        self.event_queue.copy_commands(&later.event_queue);
    }

    /// Replaces the ground of the scenario by an environment of the caller, which ground sensors
    /// read from the next tick on: brightness, 0 (black) to 1 (white). The environment is a part of
    /// the run's state, and decides with its copies if a snapshot goes on in the same way.
    pub fn set_ground(&mut self, environment: impl Environment + 'static) {
        self.world.set_ground(environment);
    }

    /// Returns true if the scenario's duration is over.
    pub fn is_over(&self) -> bool {
        self.world.now() >= self.end
    }

    /// Returns the number of ticks that have passed.
    pub fn now(&self) -> u64 {
        self.world.now()
    }

    /// Returns the number of ticks that the scenario lasts.
    pub fn end(&self) -> u64 {
        self.end
    }

    /// Returns the setup of the run.
    pub fn setup(&self) -> &Arc<Setup> {
        &self.setup
    }

    /// Returns the seed of the run.
    pub fn seed(&self) -> u32 {
        self.seed
    }

    /// Queues a command, which acts at the beginning of the next tick, after the events of the
    /// scenario. Its text has the keys of an `[[event]]` without `at`, such as `fail = 3`, or
    /// `move = 3` and `to = [100, 0]`. An error leaves the run unchanged, and names the place in
    /// the text and the remedy.
    pub fn command(&mut self, text: &str) -> Result<(), Vec<ScenarioError>> {
        self.command_at(self.now(), text)
    }

    /// Queues a command as [`command`](Self::command) does, which acts at the beginning of a later
    /// tick. Queued commands of still later ticks are removed, so that the commands of another run
    /// are given in their order.
    pub fn command_at(&mut self, tick: u64, text: &str) -> Result<(), Vec<ScenarioError>> {
        let refused = |cause| vec![ScenarioError { cause, place: None }];
        if tick >= self.end {
            return Err(refused(ScenarioCause::RunIsOver));
        }
        let action = self.setup.scenario.command(text)?;
        match &action {
            WorldChange::Load { robots, script, .. } => {
                let with_script = self.setup.with_script(robots, script);
                self.setup = Arc::new(with_script.map_err(refused)?);
            }
            WorldChange::Set { robots, global, .. } => {
                self.setup.check_global(robots, global).map_err(refused)?;
            }
            WorldChange::Adversary(adversary) => {
                let at = tick.max(self.now());
                if !self.event_queue.has_room_for(&self.setup.scenario, at, adversary) {
                    let at = (at as f64 / TICKS_PER_SECOND).to_string();
                    let max = ADVERSARIES_MAX;
                    return Err(refused(ScenarioCause::TooManyAdversaries { at, max }));
                }
            }
            WorldChange::Call { robots, function, .. } => {
                self.setup.check_function(robots, function).map_err(refused)?;
            }
            WorldChange::Ask { robots, question, .. } => {
                self.check_question(robots, question).map_err(refused)?;
            }
            _ => {}
        }
        self.event_queue.command(tick.max(self.now()), text, action);
        Ok(())
    }

    /// Returns all commands as `[[event]]`s. A scenario that ends with these replays the session
    /// without commands. A run that was taken back still has its later commands, until a new
    /// command replaces them.
    #[must_use]
    pub fn commands(&self) -> String {
        let mut text = String::new();
        for (tick, command) in self.event_queue.commands() {
            let at = tick as f64 / TICKS_PER_SECOND;
            text += &format!("[[event]]\nat = {at}\n{command}\n\n");
        }
        text
    }

    /// Returns the commands in order: the tick before which each acts, and its text.
    pub fn command_list(&self) -> impl Iterator<Item = (u64, &str)> {
        self.event_queue.commands()
    }

    /// Returns the current lamps. A lamp that an event removed has intensity 0.
    pub fn lights(&self) -> &[Lamp] {
        self.world.lights()
    }

    /// Keeps the content of each robot's machine at its last fault from now on: globals, locals and
    /// calls. It does not change the run, and costs time and memory only at faults.
    pub fn keep_post_mortems(&mut self) {
        self.keeps_post_mortems = true;
        self.world.brains_mut().for_each(SimRobot::keep_post_mortem);
    }

    /// Returns the last fault of a robot since it was switched on, with the content of its machine
    /// at that moment unless it runs its firmware. Returns `None` if there was none, or if
    /// [post-mortems](Self::keep_post_mortems) were not kept then.
    pub fn post_mortem(&self, number: usize) -> Option<&PostMortem> {
        self.robot(number)?.state().last_fault.as_ref()?.0.as_deref()
    }

    /// Simulates 100 ms: events and commands first, then the world, then the expectations. A tick
    /// can fail only because of robots that run their firmware; the run cannot go on then.
    pub fn tick(&mut self) -> Result<(), FirmwareError> {
        if self.is_watched && self.interest.is_none() {
            self.world.brains_mut().for_each(SimRobot::stop_watching);
            self.is_watched = false;
        }
        let scenario = self.setup.scenario.clone();
        while let Some(action) = self.event_queue.due(&scenario, self.world.now()) {
            let mut kept = Vec::new();
            match &action {
                WorldChange::Load { robots, script, keep } => {
                    if *keep {
                        kept = self.globals_of(robots);
                    }
                    self.load(robots, script);
                }
                WorldChange::Set { robots, global, numbers, .. } => {
                    self.set(robots, global, numbers)
                }
                WorldChange::Call { robots, function, .. } => {
                    let flag = NewNumbers::Same(ScriptNumber::Int(1));
                    self.set(robots, &called_flag(function), &flag);
                }
                WorldChange::Ask { robots, question, .. } => self.ask(robots, question),
                _ => {}
            }
            for number in self.event_queue.act(&action, &mut self.world) {
                if let (Some(fleets), Some(id)) = (&mut self.fleets, self.event_queue.id(number)) {
                    fleets.switch_off(id)?;
                }
                self.start(number);
            }
            kept.iter().for_each(|(number, globals)| self.keep(*number, globals));
            if let WorldChange::Adversary(adversary) = &action {
                self.admit(adversary);
            }
            self.event_queue.settle(&mut self.world);
            // Without emulators, the rest has nothing to change.
            let Some(fleets) = &mut self.fleets else { continue };
            fleets.settle(&self.world)?;
            match &action {
                WorldChange::Loss(medium, loss) => {
                    fleets.lose(*medium, engine_loss(*loss))?;
                }
                WorldChange::Battery { robots, millivolts } => {
                    for id in robots.iter().filter_map(|number| self.event_queue.id(number)) {
                        fleets.set_battery(id, *millivolts)?;
                    }
                }
                _ => {}
            }
        }
        self.brown_out();
        match &mut self.fleets {
            None => self.world.tick(),
            Some(fleets) => self.world.tick_with(|world| fleets.advance(world))?,
        }
        self.observe();
        Ok(())
    }

    /// Returns a hash of everything that decides the further course of the run: world, machines,
    /// frames that wait, random streams, and commands that are still pending. Runs with the same
    /// history have the same digest, on any number of threads, on any machine, natively or as
    /// WebAssembly, and after any restore of a snapshot. The digest of robots in emulators covers
    /// only their bodies.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        self.world.add_to(&mut digest);
        self.world.brains().for_each(|robot| robot.add_to(&mut digest));
        self.event_queue.add_to(&mut digest, self.now());
        digest.finish()
    }

    /// Returns the lines that were logged since the last call, with the number of the robot,
    /// ordered by robot.
    pub fn take_log(&mut self) -> Vec<(usize, LogLine)> {
        let mut lines = Vec::new();
        if !self.news.take() {
            return lines;
        }
        for number in 0..self.event_queue.count() {
            // A robot that has not joined has no log.
            let Some(id) = self.event_queue.id(number) else { continue };
            let robot = self.world.brain_mut(id).expect(JOINED);
            lines.extend(robot.take_log().into_iter().map(|line| (number, line)));
        }
        lines
    }

    /// Returns the visible state of a robot; `None` if it has not joined yet.
    pub fn view(&self, number: usize) -> Option<RobotView> {
        self.world.robot(self.event_queue.id(number)?)
    }

    /// Returns the attitudes of the robots that tilt, with their numbers.
    pub fn attitudes(&self) -> impl Iterator<Item = (usize, Attitude)> {
        let attitudes = self.world.attitudes();
        attitudes.map(|(id, attitude)| (self.event_queue.number(id), attitude))
    }

    /// Returns the discs that robots push, where they are, in the order of the scenario.
    pub fn movables(&self) -> impl ExactSizeIterator<Item = MovableDisc> {
        self.world.movables()
    }

    /// Returns true while a fault keeps the script of a robot from running.
    pub fn is_faulted(&self, number: usize) -> bool {
        self.robot(number).is_some_and(|robot| robot.state().is_faulted())
    }

    /// Reads the whole state of a robot's virtual machine, with the names of its script, without
    /// changing it. Returns `None` for a robot that has not joined yet, and for one that runs its
    /// firmware.
    pub fn inspect(&self, number: usize, limits: Limits) -> Option<Inspection> {
        let robot = self.robot(number)?;
        robot.inspect(robot.state().context.symbols.as_deref(), limits)
    }

    /// Watches the statements of a robot's script in the next tick, until
    /// [`take_statements`](Self::take_statements). A robot that has not joined and one that runs its
    /// firmware begin none.
    pub fn watch_statements(&mut self, number: usize, stop: WatchStop) {
        if let Some(id) = self.event_queue.id(number) {
            self.world.brain_mut(id).expect(JOINED).watch_statements(stop);
        }
    }

    /// Returns the part of the last tick that the watch on a robot has read, and ends the watch.
    /// Returns `None` if it stops at a statement that the script did not begin.
    pub fn take_statements(&mut self, number: usize) -> Option<WatchedTick> {
        let id = self.event_queue.id(number)?;
        self.world.brain_mut(id).expect(JOINED).take_statements()
    }

    /// Returns the battery of a robot. Returns `None` if its model has no battery and no event has
    /// set the voltage; of the robots that run their firmware, only those that fly have one.
    pub fn battery(&self, number: usize) -> Option<BatteryState> {
        let id = self.event_queue.id(number)?;
        if let Some(emulated) = self.fleets.as_ref().and_then(|fleets| fleets.battery(id)) {
            return Some(emulated);
        }
        let milliseconds = self.now() * u64::from(TICK_US / 1000);
        self.robot(number)?.battery(milliseconds)
    }

    /// Returns the numbers of the robots whose poses from outside are wrong, with the errors.
    pub fn pose_errors(&self) -> impl Iterator<Item = (usize, PoseError)> {
        let error = |number| Some((number, self.robot(number)?.pose_error()));
        let errors = (0..self.robot_count()).filter_map(error);
        errors.filter(|(_, error)| *error != PoseError::default())
    }

    /// Returns the program that a robot runs: that of its group, until an event or a command loads
    /// another one, with the questions at its end that the robot keeps.
    ///
    /// # Panics
    /// If the scenario has no robot of that number.
    pub fn program(&self, number: usize) -> &Program {
        let joined = self.robot(number).map(|robot| robot.state().context.program);
        let program = joined.unwrap_or_else(|| self.event_queue.program(number));
        &self.setup.loaded(program).program
    }

    /// Returns a robot; `None` before it joins, and for a number that no robot has.
    fn robot(&self, number: usize) -> Option<&SimRobot> {
        let id = self.event_queue.id(number)?;
        Some(self.world.brain(id).expect(JOINED))
    }

    /// Returns the number of robots in the scenario, absent ones included.
    pub fn robot_count(&self) -> usize {
        self.event_queue.count()
    }

    /// Returns the outcomes of the expectations, in the order of the file.
    pub fn convergences(&self) -> &[Convergence] {
        &self.convergences
    }

    /// Returns the summary of the run so far.
    pub fn summary(&mut self) -> Summary {
        let mut statistics = *self.world.statistics();
        let mut past = self.past.clone();
        let links = self.fleets.as_mut().map(Fleets::links).and_then(Result::ok);
        // The counters of an emulator that has ended are lost; the run has reported its end.
        for (medium, links, overflown) in links.unwrap_or_default() {
            statistics.add(medium, &links);
            past.dropped[0] += overflown;
        }
        let mut faults = self.faults.clone();
        for number in 0..self.event_queue.count() {
            // A robot that has not joined has no counters.
            let Some(robot) = self.robot(number) else { continue };
            past.add(number, robot, self.has_unexpected(number, robot));
            past.add_findings(robot);
            faults.extend(faults_of(number, robot));
        }
        faults.sort_by_key(|fault| (fault.record.tick, fault.robot));
        let Past { unusable, dropped, faults: fault_counts, unexpected, overruns, findings } = past;
        Summary {
            seed: self.seed,
            ticks: self.world.now(),
            robots: self.world.len(),
            convergences: self.convergences.clone(),
            statistics,
            first_crash: statistics
                .first_crash
                .map(|(tick, robot)| (tick, self.event_queue.number(robot))),
            unusable,
            dropped,
            faults,
            fault_counts,
            unexpected,
            overruns,
            values: self.setup.plots().iter().map(|probe| self.spread(probe)).collect(),
            measures: self.measures_now(),
            findings,
        }
    }

    /// Adds an adversary to the world.
    fn admit(&mut self, adversary: &Adversary) {
        let Adversary { kind, at: [x, y], height, group, range, rate, until } = *adversary;
        let settings = IntruderSettings {
            pose: Pose { z: height as f32, ..Pose::new(x as f32, y as f32, 0.0) },
            herd: self.herds[group.0],
            range_mm: range.map(|range| range as f32),
            period_us: rate.map(|rate| (1e6 / rate) as u64),
            until: tick_at(until),
        };
        let setup = &self.setup;
        let profile = setup.scenario.group(group).robot.profile;
        let image = &setup.loaded(ProgramId(group.0)).program.image;
        let make = |stream| intruder(kind, profile, image, stream);
        match self.world.add_intruder(settings, make) {
            // A world that is full of robots has no id for an adversary.
            Ok(()) | Err(AddError::TooMany) => {}
            Err(error) => panic!("the scenario places adversaries inside the world: {error}"),
        }
    }

    /// Restarts robots at random in groups with brown-outs.
    fn brown_out(&mut self) {
        let setup = self.setup.clone();
        let (mut first, tick) = (0, self.world.now());
        for group in &setup.scenario.groups {
            let numbers = first..first + group.count as usize;
            first = numbers.end;
            // Most groups have no brown-outs.
            let Some(every) = group.brown_out_every else { continue };
            // Times between two events of a Poisson process have this mean.
            let probability = 1.0 - libm::exp(-1.0 / (every * TICKS_PER_SECOND));
            for number in numbers {
                let runs = |view: RobotView| view.state == RobotState::Running;
                let mut chance = Stream::for_power(self.seed.into(), setup.id(number), tick);
                if self.view(number).is_some_and(runs) && chance.chance(probability as f32) {
                    self.start(number);
                }
            }
        }
    }

    /// Assigns a script to robots, for their next start.
    fn load(&mut self, robots: &Selection, script: &Path) {
        for number in robots.iter() {
            let program = self.setup.program_of(self.setup.group(number), script);
            let program = program.expect("the setup has the programs of all events and commands");
            self.event_queue.load(number, program);
        }
    }

    /// Switches a robot on. A robot that has already joined is switched off before.
    fn start(&mut self, number: usize) {
        let setup = self.setup.clone();
        let group = setup.group(number);
        let of = setup.scenario.group(group);
        let context = &setup.loaded(self.event_queue.program(number)).context;
        let there = self.event_queue.id(number);
        // A restarted robot gets other random numbers than at its first start.
        let seed = match there {
            Some(_) => self.seed ^ (self.world.now() as u32 + 1).wrapping_mul(0x9e37_79b9),
            None => self.seed,
        };
        let own_id = self.setup.id(number);
        let news = self.news.clone();
        let robot = match of.backend {
            Backend::Vm => SimRobot::new(&*of.model, context, news, own_id, seed),
            Backend::Firmware { .. } | Backend::Image(_) => {
                Ok(SimRobot::emulated(context, news, own_id))
            }
        };
        let mut robot = robot.expect("the machine accepted the image in the setup");
        if let Some(interest) = self.interest {
            robot.watch(interest);
        }
        if self.keeps_post_mortems {
            robot.keep_post_mortem();
        }
        if setup.is_checked() {
            robot.check(own_id, setup.costs(group));
        }
        let Some(id) = there else {
            let pose = self.event_queue.start_of(number);
            match self.world.add(self.herds[group.0], pose, robot) {
                Ok(id) => {
                    if let Some([slowest, fastest]) = of.clock_skew {
                        let share = f64::from(Stream::for_clock(self.seed.into(), own_id).unit());
                        // From percent to millionths.
                        let error_ppm = (slowest + (fastest - slowest) * share) * 1e4;
                        self.world.set_clock_error(id, error_ppm.round() as i32).expect(JOINED);
                    }
                    self.event_queue.joined(number, id);
                }
                // Adversaries have taken the last ids, so the robot cannot join.
                Err(AddError::TooMany) => {}
                Err(error) => panic!("the start poses are inside the world: {error}"),
            }
            return;
        };
        let old = self.world.brain(id).expect(JOINED);
        let has_unexpected = self.has_unexpected(number, old);
        self.past.add(number, old, has_unexpected);
        self.past.add_findings(old);
        self.faults.extend(faults_of(number, old));
        robot.adopt(self.world.brain_mut(id).expect(JOINED));
        self.world.restart(id, robot).expect(JOINED);
    }

    /// Returns true if a robot has had faults that no expectation counts.
    fn has_unexpected(&self, number: usize, robot: &SimRobot) -> bool {
        let FaultCounts { faults, restarts, handler_faults } = robot.state().fault_counts();
        let is_counted = |by: Quantity| {
            let expects = &self.setup.scenario.expects;
            let mut conditions = expects.iter().map(|expect| &expect.condition);
            conditions.any(|condition| condition.value == by && condition.robots.contains(number))
        };
        let has_stopped = faults > 0 && !is_counted(Quantity::Faults);
        // An expectation of restarts does not cover a script that did not start again.
        (has_stopped && (faults > restarts || !is_counted(Quantity::Restarts)))
            || (handler_faults > 0 && !is_counted(Quantity::HandlerFaults))
    }
}

/// Returns the faults of a robot since it was switched on.
fn faults_of(number: usize, robot: &SimRobot) -> impl Iterator<Item = FaultOf> {
    let places = robot.state().fault_places().iter();
    places.map(move |record| FaultOf { robot: number, record: record.clone() })
}

/// The sums of the robots' counters for the summary.
#[derive(Debug, Clone, Default)]
struct Past {
    unusable: Unusable,
    dropped: [u64; 2],
    faults: FaultCounts,
    /// Robots with faults that no expectation counts.
    unexpected: usize,
    overruns: OverrunSummary,
    findings: BTreeMap<ProgramId, Findings>,
}

impl Past {
    fn add(&mut self, number: usize, robot: &SimRobot, has_unexpected: bool) {
        self.faults += robot.state().fault_counts();
        self.unusable = self.unusable.add(robot.counters(), robot.unwanted());
        for (sum, count) in self.dropped.iter_mut().zip(robot.dropped()) {
            *sum += u64::from(count);
        }
        self.unexpected += usize::from(has_unexpected);
        if let Some(overruns) = &robot.state().overruns {
            self.overruns.add(number, overruns);
        }
    }

    /// Adds the results of a robot's checks, if it is checked.
    fn add_findings(&mut self, robot: &SimRobot) {
        if let Some(findings) = robot.findings() {
            let program = robot.state().context.script;
            self.findings.entry(program).or_default().merge(findings);
        }
    }
}
