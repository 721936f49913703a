//! Three robots in a row that run from power-on, with their timers and what they remember of their own puts.
//!
//! [`World`](crate::world::World) explores every order of frames, but makes each machine anew from its entries. A history is
//! the opposite: few events, between which the links are open or one robot is cut off, and the machines as they are. After
//! the last event all links are open, and nothing happens any more.

use std::cell::Cell;
use std::rc::Rc;

use bittybuzz_testkit::{Answer, FORGER, Program, Recorder, Swarm, TestRobot};
use bittybuzz_vm_core::message::{Message, StigmergyEntry};
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{FaultCode, Periods, Sizes, Value};
use stateright::{Model, Property};

/// Robots, in a row.
const ROBOTS: usize = 3;
/// Steps after an event, enough for a frame from one end of the row to the other.
const STEPS: usize = 4;
/// Steps after which every deletion is forgotten: more than 40 times 16.
const ABSENCE: usize = 700;
/// Steps of quiet after which replicas are compared, and in which frames are counted then.
const SETTLE: usize = 150;
const WINDOW: usize = 200;
/// Frames that three robots send in that window at most: beacons in five steps, and a sixth of that for entries where stores
/// are too small.
const FRAMES: usize = 3 * WINDOW / 5 * 7 / 6;

/// The class of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Class {
    /// An integer, which is in the frame.
    Number,
    /// A table with the integer, which travels in fragments.
    Table,
}

/// An event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Event {
    /// This robot puts another number, or a table, under a key.
    Put(usize, i32, Class),
    /// This robot deletes a key.
    Delete(usize, i32),
    /// This robot is switched off and on.
    Restart(usize),
    /// Nothing happens, for longer than a deletion keeps its place.
    Absence,
    /// A frame of no robot with a value under key 0 and this clock reaches all that are not cut off.
    Forge(u32),
}

/// The events that histories are made of.
#[derive(Clone, Debug)]
pub struct Histories {
    /// Events of a history at most.
    pub length: usize,
    /// Any of these may happen next.
    pub events: Vec<Event>,
    /// Robots that may be cut off while an event happens.
    pub cuts: Vec<usize>,
    /// Entries that a robot has room for.
    pub room: usize,
}

/// A history, and what came of it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct History {
    /// Events, and who was cut off in the steps that followed.
    pub events: Vec<(Event, Option<usize>)>,
    /// The value of each key that each robot knows when all is quiet.
    pub replicas: [Vec<Option<i32>>; ROBOTS],
    /// Frames of the window.
    pub frames: usize,
}

const SCRIPT: &str = "function init() { s = stigmergy.create(1) }
function show(value) { if(isnil(value)) return -1 if(istable(value)) return value.a return value }
function step() {
  var command = forward()
  if(command >= 4000) log(show(s.get(0)), \" \", show(s.get(1)), \" \", show(s.get(2)))
  else if(command > 0) {
    var key = (command / 100) % 10
    var value = command % 100
    if(command >= 3000) s.put(key, nil)
    else if(command >= 2000) s.put(key, {.a = value})
    else s.put(key, value)
  }
}";

impl Histories {
    fn run(&self, events: Vec<(Event, Option<usize>)>) -> History {
        thread_local! {
            static PROGRAM: &'static Program = Box::leak(Box::new(Program::new::<Tiny>(SCRIPT)));
        }
        let program = PROGRAM.with(|program| *program);
        let commands: [Rc<Cell<i32>>; ROBOTS] = Default::default();
        let sizes = Sizes { neighbors: 3, bearings: false, entries: self.room as u16, swarms: 0 };
        let symbols = Rc::new(program.symbols.clone());
        let robots = commands.iter().zip(1..).map(|(command, id)| {
            let mut robot = TestRobot::new(&program.image[..], id, sizes);
            let answer = command.clone();
            // A command is for one step.
            robot.host = Recorder::answering(move |_| Answer::Int(answer.take()));
            robot.host.periods = Periods { beacon: 5, forget: 15, advertise: 10 };
            robot.host.symbols = Some(symbols.clone());
            robot
        });
        let mut swarm: Swarm<Tiny> = Swarm::of(robots.collect());
        let cut = Rc::new(Cell::new(None));
        let is_cut = cut.clone();
        swarm.air.reaches = Box::new(move |from, to| {
            from.abs_diff(to) == 1 && is_cut.get().is_none_or(|cut| cut != from && cut != to)
        });
        swarm.steps(STEPS);
        for (number, (event, robot)) in events.iter().enumerate() {
            cut.set(*robot);
            let value = number as i32 + 1;
            let steps = if *event == Event::Absence { ABSENCE } else { STEPS };
            match *event {
                Event::Put(robot, key, class) => {
                    let kind = if class == Class::Table { 2000 } else { 1000 };
                    commands[robot].set(kind + 100 * key + value);
                }
                Event::Delete(robot, key) => commands[robot].set(3000 + 100 * key),
                Event::Restart(robot) => swarm.robots[robot].restart(),
                Event::Absence => {}
                Event::Forge(clock) => {
                    let (key, value) = (Value::int(0), Value::int(value));
                    let entry = StigmergyEntry { stigmergy: 1, owner: FORGER, clock, key, value };
                    let frame = swarm.robots[0].frame(&Message::Entry(entry));
                    swarm.inject(&frame, (0..ROBOTS).filter(|to| *robot != Some(*to)));
                }
            }
            (0..steps).for_each(|_| _ = step(&mut swarm));
        }
        cut.set(None);
        (0..SETTLE).for_each(|_| _ = swarm.try_step());
        let frames = (0..WINDOW).map(|_| swarm.try_step()).sum();
        commands.iter().for_each(|command| command.set(4000));
        swarm.try_step();
        let known = |line: String| -> Vec<Option<i32>> {
            let number = |word: &str| word.parse().ok().filter(|value| *value >= 0);
            line.split(' ').map(number).collect()
        };
        assert_eq!(swarm.faults(), [None; ROBOTS], "{events:?}");
        let replicas: Vec<_> = swarm.last().into_iter().map(known).collect();
        let replicas = replicas.try_into().expect("there are three robots");
        History { events, replicas, frames }
    }
}

/// Runs a step and returns the number of frames sent. A script that puts where there is no room starts again, as on all
/// hosts.
fn step(swarm: &mut Swarm<Tiny>) -> usize {
    let frames = swarm.try_step();
    for robot in &mut swarm.robots {
        if let Some(fault) = robot.fault {
            assert_eq!(fault.code, FaultCode::StoreFull, "the script has no other fault");
            robot.rest();
            robot.start().expect("init() does not put");
        }
    }
    frames
}

impl History {
    /// Returns true if there is room for all keys that were put.
    fn has_room(&self, room: usize) -> bool {
        let key_of = |(event, _): &(Event, _)| match event {
            Event::Put(_, key, _) => Some(*key),
            Event::Forge(_) => Some(0),
            _ => None,
        };
        let mut keys: Vec<i32> = self.events.iter().filter_map(key_of).collect();
        keys.sort_unstable();
        keys.dedup();
        keys.len() <= room
    }

    /// Returns true if robots that know a key know the same value; and if there is room for all keys, all know them.
    fn is_equal(&self, room: usize) -> bool {
        if self.has_room(room) {
            return self.replicas.iter().all(|known| *known == self.replicas[0]);
        }
        (0..3).all(|key| {
            let mut values = self.replicas.iter().filter_map(|known| known[key]);
            let first = values.next();
            values.all(|value| Some(value) == first)
        })
    }

    /// Returns true unless the last put of key 0 is lost: of a robot that alone puts there, whatever it has forgotten before;
    /// or of any robot, where all links were open and no robot has forgotten anything. Otherwise puts may have been at the same
    /// time, and where there is no room a put is a fault.
    fn is_kept(&self, room: usize) -> bool {
        let is_put = |(event, _): &&(Event, Option<usize>)| {
            matches!(event, Event::Put(_, 0, _) | Event::Delete(_, 0) | Event::Forge(_))
        };
        let writer = |(event, _): &(Event, _)| match event {
            Event::Put(robot, ..) | Event::Delete(robot, _) => *robot,
            _ => ROBOTS,
        };
        if !self.has_room(room) {
            return true;
        }
        let puts: Vec<_> = self.events.iter().filter(is_put).collect();
        let Some(last) = puts.last() else { return true };
        let (Event::Put(robot, ..), _) = last else { return true };
        let at = self.events.iter().rposition(|event| event == *last).unwrap_or(0);
        let value = Some(at as i32 + 1);
        // A robot that is switched off before another one has received its put loses that.
        let restarts = |(event, _): &(Event, _)| matches!(event, Event::Restart(_));
        let is_forgotten = self.events[at..].iter().any(restarts);
        let is_alone = !is_forgotten && puts.iter().all(|put| writer(put) == *robot);
        let is_open = self.events.iter().all(|event| event.1.is_none() && !restarts(event));
        !(is_alone || is_open) || self.replicas.iter().all(|known| known[0] == value)
    }

    /// Returns true unless a deletion of key 0 is lost that came after all puts of that key, where all robots heard these
    /// puts and none has lost its memory since.
    fn is_deleted(&self) -> bool {
        let is_write = |event: &Event| matches!(event, Event::Put(_, 0, _) | Event::Delete(_, 0));
        let mut writes = self.events.iter().filter(|(event, _)| is_write(event));
        let Some((Event::Delete(..), _)) = writes.next_back() else { return true };
        let is_unsure = |(event, cut): &(Event, Option<usize>)| match event {
            Event::Put(_, 0, _) => cut.is_some(),
            event => matches!(event, Event::Restart(_) | Event::Forge(_)),
        };
        self.events.iter().any(is_unsure) || self.replicas.iter().all(|known| known[0].is_none())
    }
}

impl Model for Histories {
    type State = History;
    type Action = (Event, Option<usize>);

    fn init_states(&self) -> Vec<History> {
        vec![self.run(Vec::new())]
    }

    fn actions(&self, history: &History, actions: &mut Vec<Self::Action>) {
        if history.events.len() < self.length {
            let cuts = || self.cuts.iter().copied().map(Some).chain([None]);
            actions.extend(self.events.iter().flat_map(|event| cuts().map(|cut| (*event, cut))));
        }
    }

    fn next_state(&self, history: &History, action: Self::Action) -> Option<History> {
        Some(self.run([&history.events[..], &[action]].concat()))
    }

    fn properties(&self) -> Vec<Property<Self>> {
        let always =
            |name, is_right: fn(&Histories, &History) -> bool| Property::always(name, is_right);
        vec![
            always("replicas are equal where there is room", |model, history| {
                history.is_equal(model.room)
            }),
            always("the last put is kept", |model, history| history.is_kept(model.room)),
            always("a deletion lasts", |_, history| history.is_deleted()),
            always("quiet robots send few frames", |_, history| history.frames <= FRAMES),
        ]
    }
}
