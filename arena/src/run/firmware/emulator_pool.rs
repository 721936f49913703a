//! The processes that emulate the robots of one model: one for all robots, or one for each.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use bittybuzz_emulation::message::{Command, EmulatorEvent, RobotEvent, RobotStatistics};
use bittybuzz_emulation::{ClientError, Emulator};

use super::p2p::P2pAir;
use super::pace::Pace;

/// The emulator processes; robots have their number in the pool.
pub enum EmulatorPool {
    /// One process emulates all robots and the radio channel between them.
    Shared(Emulator),
    /// Each robot has a process of its own, and the pool simulates the radio channel.
    Apart(PerRobot),
}

/// Robots with one process each, and the radio channel between them.
pub struct PerRobot {
    robots: Vec<Emulator>,
    air: P2pAir,
    now: Duration,
    /// The longest time that robots run before they exchange frames.
    turn: Duration,
    /// The pace of robots with doors for ground stations.
    pace: Option<Pace>,
    /// The robots that each robot cannot receive.
    deaf: Vec<BTreeSet<usize>>,
}

impl EmulatorPool {
    /// Starts one process for `count` robots of that name, all with the firmware in `path`.
    pub fn shared(
        program: &Path,
        name: &str,
        count: usize,
        path: &Path,
    ) -> Result<Self, ClientError> {
        let arguments = ["--robot", name, "--count", &count.to_string()];
        let mut emulator = Emulator::spawn_with(program, &arguments)?;
        emulator.load(path)?;
        Ok(EmulatorPool::Shared(emulator))
    }

    /// Starts one process for each of `count` robots, with the firmware in `path`. They run at the
    /// same time, and exchange frames after each `turn`.
    pub fn apart(
        program: &Path,
        count: usize,
        path: &Path,
        turn: Duration,
    ) -> Result<Self, ClientError> {
        let robots = (0..count).map(|_| {
            let mut emulator = Emulator::spawn(program)?;
            emulator.load(path)?;
            Ok(emulator)
        });
        let robots = robots.collect::<Result<Vec<Emulator>, ClientError>>()?;
        let deaf = vec![BTreeSet::new(); count];
        let (air, now, pace) = (P2pAir::default(), Duration::ZERO, None);
        Ok(EmulatorPool::Apart(PerRobot { robots, air, now, turn, pace, deaf }))
    }

    /// Lets the robots run no faster than the clock of this computer, as far as they have processes
    /// of their own.
    pub fn keep_pace(&mut self) {
        if let EmulatorPool::Apart(of) = self {
            of.pace = Some(Pace::default());
        }
    }

    /// Executes a command on a robot.
    pub fn execute_on(&mut self, robot: usize, command: &Command) -> Result<(), ClientError> {
        match self {
            EmulatorPool::Shared(emulator) => emulator.execute_on(robot, command),
            EmulatorPool::Apart(PerRobot { robots, deaf, .. }) => match command {
                Command::Deaf { to } => {
                    deaf[robot].clone_from(to);
                    Ok(())
                }
                _ => robots[robot].execute(command),
            },
        }
    }

    /// Executes a command on the radio channel, or on all robots.
    pub fn execute(&mut self, command: &Command) -> Result<(), ClientError> {
        match (self, command) {
            (EmulatorPool::Shared(emulator), _) => emulator.execute(command),
            (EmulatorPool::Apart(of), Command::Air { lose, seed }) => {
                of.air.lose(*lose, *seed);
                Ok(())
            }
            (EmulatorPool::Apart(of), _) => {
                of.robots.iter_mut().try_for_each(|emulator| emulator.execute(command))
            }
        }
    }

    /// Executes commands on robots, then runs all robots until a time. Passes their events to
    /// `on_event`.
    pub fn run_after(
        &mut self,
        commands: &[(usize, Command)],
        until: Duration,
        mut on_event: impl FnMut(RobotEvent),
    ) -> Result<(), ClientError> {
        match self {
            EmulatorPool::Shared(emulator) => {
                emulator.run_all_after(commands, until, on_event)?;
                Ok(())
            }
            EmulatorPool::Apart(of) => {
                for (robot, command) in commands {
                    of.robots[*robot].execute(command)?;
                }
                of.run(until, &mut on_event)
            }
        }
    }

    /// Returns the counters of a robot.
    pub fn statistics_of(&mut self, robot: usize) -> Result<RobotStatistics, ClientError> {
        match self {
            EmulatorPool::Shared(emulator) => emulator.statistics_of(robot),
            EmulatorPool::Apart(of) => {
                let mut statistics = of.robots[robot].statistics()?;
                statistics.air.carried = of.air.carried;
                statistics.air.collided = of.air.collided;
                statistics.air.lost = of.air.lost;
                Ok(statistics)
            }
        }
    }
}

impl PerRobot {
    fn run(
        &mut self,
        until: Duration,
        on_event: &mut impl FnMut(RobotEvent),
    ) -> Result<(), ClientError> {
        while self.now < until {
            if let Some(pace) = &mut self.pace {
                pace.wait(self.now);
            }
            self.now = until.min(self.now + self.turn);
            for emulator in &mut self.robots {
                emulator.begin_run(&[], self.now)?;
            }
            // The events of the first robot come first, whichever is ready first.
            for (robot, emulator) in self.robots.iter_mut().enumerate() {
                let air = &mut self.air;
                emulator.finish_run(0, |RobotEvent { timed, .. }| {
                    if let EmulatorEvent::P2p { port, payload, air: long } = &timed.event {
                        air.send(robot, timed.at, *long, *port, payload.clone());
                    }
                    on_event(RobotEvent { robot, timed });
                })?;
            }
            let deaf = &self.deaf;
            let receives = |one: usize, other: usize| !deaf[one].contains(&other);
            for (robot, command) in self.air.carry(self.now, self.robots.len(), receives) {
                self.robots[robot].execute(&command)?;
            }
        }
        Ok(())
    }
}
