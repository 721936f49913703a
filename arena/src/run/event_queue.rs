//! Events and commands, which change a world during a run.

use std::hash::Hash;

use crate::engine::{Digest, LightId, Pose, RobotId, RobotState, UnknownRobot, World};
use crate::scenario::{
    Adversary, LampSection, MoveTarget, Scenario, Selection, WorldChange, first_too_many,
};

use super::settings::{engine_light, engine_loss};
use super::{TICKS_PER_SECOND, tick_at};
use crate::robot::{ProgramId, SimRobot};

/// The position in the list of events, the commands, and the lasting effects of both.
#[derive(Clone)]
pub struct EventQueue {
    /// Index of the next event in the scenario.
    next: usize,
    /// The robots by their numbers in the scenario.
    robots: Vec<ScenarioRobot>,
    lights: Vec<LightId>,
    /// The part of each robot during a partition; 0 for robots in no part.
    parts: Option<Vec<u8>>,
    /// The tick before which each command acts, its text and its action; in order of ticks.
    commands: Vec<(u64, String, WorldChange)>,
    /// The number of commands that were carried out.
    carried_out: usize,
}

/// A robot of the scenario, present or to come.
#[derive(Clone)]
struct ScenarioRobot {
    start: Pose,
    /// The engine's id; `None` until the robot joins.
    id: Option<RobotId>,
    program: ProgramId,
}

impl EventQueue {
    /// Returns a queue before its first event. `robots` gives the start pose and the program of
    /// each robot.
    pub fn new(robots: impl Iterator<Item = (Pose, ProgramId)>, lights: Vec<LightId>) -> Self {
        let robots = robots.map(|(start, program)| ScenarioRobot { start, id: None, program });
        let (robots, parts, commands) = (robots.collect(), None, Vec::new());
        EventQueue { next: 0, robots, lights, parts, commands, carried_out: 0 }
    }

    /// Adds everything that decides the next ticks to a digest, except the scenario's events: start
    /// poses and programs of robots that have not joined yet, the partition, and commands that act
    /// before tick `now`.
    pub fn add_to(&self, digest: &mut Digest, now: u64) {
        for ScenarioRobot { start, id, program } in &self.robots {
            id.hash(digest);
            if id.is_none() {
                digest.pose(start);
                program.hash(digest);
            }
        }
        self.parts.hash(digest);
        let waiting = self.commands.iter().skip(self.carried_out);
        let due = waiting.take_while(|(tick, ..)| *tick <= now);
        due.for_each(|(.., action)| digest.text_of(action));
    }

    /// Returns the number of robots, present or to come.
    pub fn count(&self) -> usize {
        self.robots.len()
    }

    /// Returns the engine's id of a robot; `None` before the robot joins, and for a number that no
    /// robot has: users of a run may ask for any number.
    pub fn id(&self, number: usize) -> Option<RobotId> {
        self.robots.get(number)?.id
    }

    /// Returns the program of a robot.
    pub fn program(&self, number: usize) -> ProgramId {
        self.robots[number].program
    }

    /// Assigns a program to a robot for its next start.
    pub fn load(&mut self, number: usize, program: ProgramId) {
        self.robots[number].program = program;
    }

    /// Returns the number in the scenario of a robot in the world.
    pub fn number(&self, id: RobotId) -> usize {
        let number = self.robots.iter().position(|robot| robot.id == Some(id));
        number.expect("every robot in the world is one of the scenario")
    }

    /// Returns the scenario's numbers of all robots in the world, ordered by their id.
    pub fn numbers(&self) -> Vec<usize> {
        let there = self.robots.iter().enumerate();
        let mut pairs: Vec<(RobotId, usize)> =
            there.filter_map(|(number, robot)| Some((robot.id?, number))).collect();
        pairs.sort_unstable();
        // Ids count up from 0, so the index is the id.
        pairs.into_iter().map(|(_, number)| number).collect()
    }

    pub fn start_of(&self, number: usize) -> Pose {
        self.robots[number].start
    }

    pub fn joined(&mut self, number: usize, id: RobotId) {
        self.robots[number].id = Some(id);
    }

    /// Queues a command that acts before a tick. Commands of later ticks, which a run has after it
    /// was taken back, are removed.
    pub fn command(&mut self, tick: u64, text: &str, action: WorldChange) {
        let later = self.commands.partition_point(|(other, ..)| *other <= tick);
        self.commands.truncate(later);
        self.commands.push((tick, text.trim().to_owned(), action));
    }

    /// Returns true if an adversary may begin at a tick, as a command: fewer others than the limit
    /// send while it does.
    pub fn has_room_for(&self, scenario: &Scenario, tick: u64, adversary: &Adversary) -> bool {
        let times = |at, action: &WorldChange| match action {
            WorldChange::Adversary(known) => Some((at, known.until)),
            _ => None,
        };
        let seconds = |tick: u64| tick as f64 / TICKS_PER_SECOND;
        let events = scenario.events.iter().filter_map(|event| times(event.at, &event.action));
        // A command removes those of later ticks.
        let commands = self.commands.iter().take_while(|(other, ..)| *other <= tick);
        let commands = commands.filter_map(|(tick, _, action)| times(seconds(*tick), action));
        let mut all: Vec<(f64, f64)> = events.chain(commands).collect();
        all.push((seconds(tick), adversary.until));
        all.sort_by(|(one, _), (other, _)| one.total_cmp(other));
        first_too_many(all.into_iter()).is_none()
    }

    /// Removes the commands from a number on, none of which was carried out.
    pub fn truncate_commands(&mut self, count: usize) {
        debug_assert!(self.carried_out <= count);
        self.commands.truncate(count);
    }

    /// Copies the commands of a later state of the same run, so that those that are still pending
    /// here act again at their times.
    pub fn copy_commands(&mut self, later: &Self) {
        self.commands.clone_from(&later.commands);
    }

    /// Returns the commands in order: the tick before which each acts, and its text.
    pub fn commands(&self) -> impl Iterator<Item = (u64, &str)> {
        self.commands.iter().map(|(tick, text, _)| (*tick, text.as_str()))
    }

    /// Returns true if a question is asked before tick `now`.
    pub fn has_waiting_questions(&self, now: u64) -> bool {
        let waiting = self.commands.iter().skip(self.carried_out);
        let mut due = waiting.take_while(|(tick, ..)| *tick <= now);
        due.any(|(.., action)| matches!(action, WorldChange::Ask { .. }))
    }

    /// Returns the next action whose time has come: events of the scenario first, then commands.
    pub fn due(&mut self, scenario: &Scenario, now: u64) -> Option<WorldChange> {
        let event = scenario.events.get(self.next).filter(|event| tick_at(event.at) <= now);
        if let Some(event) = event {
            self.next += 1;
            return Some(event.action.clone());
        }
        let (tick, _, action) = self.commands.get(self.carried_out)?;
        if *tick > now {
            return None;
        }
        self.carried_out += 1;
        Some(action.clone())
    }

    /// Applies an action to the world. Returns the numbers of the robots whose scripts must be
    /// started.
    pub fn act(&mut self, action: &WorldChange, world: &mut World<SimRobot>) -> Vec<usize> {
        match action {
            WorldChange::Fail(robots) => self.each(robots, |id| world.fail(id)),
            WorldChange::Stop(robots) => self.each(robots, |id| world.stop(id)),
            WorldChange::Resume(robots) => self.each(robots, |id| world.resume(id)),
            WorldChange::Restart(robots) | WorldChange::Load { robots, .. } => {
                return robots.iter().filter(|number| self.id(*number).is_some()).collect();
            }
            WorldChange::BrownOut(robots) => {
                let runs = |id| world.robot(id).is_some_and(|it| it.state == RobotState::Running);
                let is_hit = |number: &usize| self.id(*number).is_some_and(runs);
                return robots.iter().filter(is_hit).collect();
            }
            WorldChange::Join(robots) => {
                return robots.iter().filter(|number| self.id(*number).is_none()).collect();
            }
            WorldChange::Move { robots, to, heading } => {
                self.displace(robots, *to, *heading, world)
            }
            WorldChange::Battery { robots, millivolts } => self.each(robots, |id| {
                let robot = world.brain_mut(id).ok_or(UnknownRobot(id))?;
                robot.set_battery(*millivolts);
                Ok(())
            }),
            WorldChange::Displace { robots, by } => self.each(robots, |id| {
                let robot = world.brain_mut(id).ok_or(UnknownRobot(id))?;
                robot.displace_poses(by.map(|part| part as f32));
                Ok(())
            }),
            WorldChange::Relabel(one, other) => self.pairs(one, other, |one, other| {
                for (own, seen) in [(one, other), (other, one)] {
                    let robot = world.brain_mut(own).ok_or(UnknownRobot(own))?;
                    robot.see_as(i32::from(seen.0) - i32::from(own.0));
                }
                Ok(())
            }),
            WorldChange::Light(lights) => self.relight(lights, world),
            WorldChange::Loss(medium, loss) => {
                world.set_loss(*medium, engine_loss(*loss));
            }
            WorldChange::Block(one, other) => self.pairs(one, other, |a, b| world.block(a, b)),
            WorldChange::Restore(one, other) => self.pairs(one, other, |a, b| world.unblock(a, b)),
            WorldChange::Partition(parts) => self.parts = Some(self.numbered(parts)),
            WorldChange::Heal => {
                self.parts = None;
                world.heal();
            }
            // The simulation applies these actions itself, because they need links and scripts.
            WorldChange::Adversary(_)
            | WorldChange::Set { .. }
            | WorldChange::Call { .. }
            | WorldChange::Ask { .. } => {}
        }
        Vec::new()
    }

    /// Applies the partition to all robots in the world, including those that have just joined.
    pub fn settle(&self, world: &mut World<SimRobot>) {
        // Without a partition, there is nothing to apply.
        let Some(parts) = &self.parts else { return };
        let numbers = self.numbers();
        world.partition(|id| parts[numbers[usize::from(id.0)]]);
    }

    /// Calls `act` with the robots of a selection that have joined; the others are left out.
    fn each(&self, robots: &Selection, mut act: impl FnMut(RobotId) -> Result<(), UnknownRobot>) {
        for id in robots.iter().filter_map(|number| self.id(number)) {
            act(id).expect("the engine knows every robot that has joined");
        }
    }

    fn pairs(
        &self,
        one: &Selection,
        other: &Selection,
        mut act: impl FnMut(RobotId, RobotId) -> Result<(), UnknownRobot>,
    ) {
        for a in one.iter().filter_map(|number| self.id(number)) {
            self.each(other, |b| if a == b { Ok(()) } else { act(a, b) });
        }
    }

    /// Returns the part of each robot, counted from 1; 0 for a robot in no part.
    fn numbered(&self, parts: &[Selection]) -> Vec<u8> {
        let mut numbers = vec![0; self.robots.len()];
        for (part, robots) in parts.iter().enumerate() {
            for robot in robots.iter() {
                numbers[robot] = (part + 1) as u8;
            }
        }
        numbers
    }

    fn displace(
        &mut self,
        robots: &Selection,
        to: MoveTarget,
        heading: Option<f64>,
        world: &mut World<SimRobot>,
    ) {
        let pose = |number: usize| match self.id(number).and_then(|id| world.robot(id)) {
            Some(view) => view.pose,
            None => self.start_of(number),
        };
        let poses: Vec<(usize, Pose)> =
            robots.iter().map(|number| (number, pose(number))).collect();
        let mean = |axis: fn(&Pose) -> f32| {
            poses.iter().map(|(_, pose)| f64::from(axis(pose))).sum::<f64>() / poses.len() as f64
        };
        let [dx, dy] = match to {
            MoveTarget::By(by) => by,
            MoveTarget::To([x, y]) => [x - mean(|pose| pose.x), y - mean(|pose| pose.y)],
        };
        for (number, mut pose) in poses {
            pose.x += dx as f32;
            pose.y += dy as f32;
            if let Some(heading) = heading {
                pose = Pose { z: pose.z, ..Pose::new(pose.x, pose.y, heading.to_radians() as f32) };
            }
            let ScenarioRobot { id, start, .. } = &mut self.robots[number];
            match *id {
                Some(id) => {
                    let moved = world.move_to(id, pose);
                    moved.expect("the engine knows every robot that has joined");
                }
                // The engine clamps robots that are present to the area; robots that have yet to
                // join are clamped here.
                None => {
                    let area = world.settings().area;
                    pose.x = pose.x.clamp(-area.width / 2.0, area.width / 2.0);
                    pose.y = pose.y.clamp(-area.height / 2.0, area.height / 2.0);
                    *start = pose;
                }
            }
        }
    }

    fn relight(&mut self, lights: &[LampSection], world: &mut World<SimRobot>) {
        for (index, light) in lights.iter().enumerate() {
            match self.lights.get(index) {
                Some(id) => world.set_light(*id, engine_light(*light)),
                None => self.lights.push(world.add_light(engine_light(*light))),
            }
        }
        let off = crate::engine::Lamp { x: 0.0, y: 0.0, intensity: 0.0 };
        for id in self.lights.iter().skip(lights.len()) {
            world.set_light(*id, off);
        }
    }
}
