//! Several robots and the air between them.

use std::rc::Rc;

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Fault, Periods, Sizes};

use crate::air::{Air, OUTSIDE, OnAir};
use crate::hostile::Hostile;
use crate::link::{Link, Received};
use crate::program::Program;
use crate::robot::{SIZES, TestRobot};

/// Robots that step together.
pub struct Swarm<P: Profile, C: ByteCode = &'static [u8], const SLOTS: usize = 600> {
    /// The robots.
    pub robots: Vec<TestRobot<P, C, SLOTS>>,
    /// The air between them.
    pub air: Air,
    /// A sender in the air that does not keep the rules.
    pub hostile: Option<Hostile<P>>,
    steps: u32,
}

impl<P: Profile> Swarm<P> {
    /// Robots of a Kilobot's sizes with ids 1, 2, ... that run one script, in a row, 10 mm from one
    /// to the next. They run three instructions at a time, so that everything is interrupted
    /// everywhere, and their periods are short.
    pub fn new(count: usize, script: &str) -> Self {
        Swarm::with_sizes(count, script, SIZES)
    }
}

impl<P: Profile, const SLOTS: usize> Swarm<P, &'static [u8], SLOTS> {
    /// Robots like those of [`Swarm::new`], of other sizes.
    pub fn with_sizes(count: usize, script: &str, sizes: Sizes) -> Self {
        let program = Program::new::<P>(script);
        let symbols = Rc::new(program.symbols.clone());
        let image = program.leak();
        let robots = (1..=count as u16).map(|id| {
            let mut robot = TestRobot::new(image, id, sizes);
            robot.budget = 3;
            robot.host.periods = Periods { beacon: 5, forget: 10, advertise: 10 };
            robot.host.symbols = Some(symbols.clone());
            robot
        });
        Swarm::of(robots.collect())
    }
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Swarm<P, C, SLOTS> {
    /// A swarm of these robots in perfect air.
    pub fn of(robots: Vec<TestRobot<P, C, SLOTS>>) -> Self {
        Swarm { robots, air: Air::default(), hostile: None, steps: 0 }
    }

    /// Gives every robot a link; those of the firmware are [`Queues`](crate::Queues).
    pub fn with_links<L: Link + 'static>(mut self, link: impl Fn() -> L) -> Self {
        for robot in &mut self.robots {
            robot.host.link = Box::new(link());
        }
        self
    }

    /// Runs one step of every robot, in order, and then delivers their frames.
    ///
    /// # Panics
    /// If a script stops.
    pub fn step(&mut self) {
        self.try_step();
        for robot in &self.robots {
            if let Some(fault) = robot.fault {
                panic!("robot {}: {fault:?}, after {:?}", robot.id, robot.host.lines());
            }
        }
    }

    /// Runs a number of steps.
    ///
    /// # Panics
    /// If a script stops.
    pub fn steps(&mut self, count: usize) {
        (0..count).for_each(|_| self.step());
    }

    /// Runs one step of every robot whose script has not stopped, delivers their frames, and
    /// returns the number of frames that the robots sent.
    pub fn try_step(&mut self) -> usize {
        for robot in &mut self.robots {
            // The robot keeps its fault.
            let _ = robot.step();
        }
        let sent = self.deliver();
        self.steps += 1;
        sent
    }

    fn deliver(&mut self) -> usize {
        let late = self.air.take_late();
        let robots = self.robots.len();
        let hostile = self.hostile.as_mut().map(|hostile| hostile.send(robots));
        let (turn, forged) = hostile.unwrap_or_default();
        let mut sent = 0;
        for from in 0..=robots {
            if from == turn {
                forged.iter().for_each(|bytes| self.put_on_air(None, bytes));
            }
            let Some(robot) = self.robots.get_mut(from) else { break };
            let frames = std::iter::from_fn(|| robot.host.link.pop_sent());
            for bytes in frames.take(self.air.frames_per_step).collect::<Vec<_>>() {
                sent += 1;
                if let Some(hostile) = &mut self.hostile {
                    hostile.receive(&bytes);
                }
                self.put_on_air(Some(from), &bytes);
            }
        }
        for (to, received) in late {
            self.robots[to].host.link.push(received);
        }
        sent
    }

    fn put_on_air(&mut self, from: Option<usize>, bytes: &[u8]) {
        (self.air.observe)(&OnAir { step: self.steps, from, bytes: bytes.to_vec() });
        for (to, robot) in self.robots.iter_mut().enumerate() {
            for received in self.air.carry(from, to, bytes) {
                robot.host.link.push(received);
            }
        }
    }

    /// Sends a frame from outside, 50 mm from every robot, to those whose numbers are given. No
    /// such frame is lost.
    pub fn inject(&mut self, frame: &[u8], to: impl IntoIterator<Item = usize>) {
        (self.air.observe)(&OnAir { step: self.steps, from: None, bytes: frame.to_vec() });
        for to in to {
            let received = Received { place: Some(OUTSIDE), ..Received::new(frame) };
            self.robots[to].host.link.push(received);
        }
    }

    /// Returns the faults of all robots.
    pub fn faults(&self) -> Vec<Option<Fault>> {
        self.robots.iter().map(|robot| robot.fault).collect()
    }

    /// Returns what every robot logged, line by line.
    pub fn logs(&self) -> Vec<Vec<String>> {
        self.robots.iter().map(|robot| robot.host.logs()).collect()
    }

    /// Returns what every robot logged last.
    pub fn last(&self) -> Vec<String> {
        self.robots.iter().map(|robot| robot.host.last_log().unwrap_or_default()).collect()
    }
}
