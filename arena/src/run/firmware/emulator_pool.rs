//! The processes that emulate the robots of one model: one for all robots, or one for each.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use bittybuzz_emulation::message::{Command, RobotEvent, RobotStatistics};
use bittybuzz_emulation::{ClientError, Emulator};

use super::pace::Pace;
use super::radio_turns::{RadioTurns, TurnLength};

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
    turns: RadioTurns,
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
    /// same time, and exchange frames after each turn.
    pub fn apart(
        program: &Path,
        count: usize,
        path: &Path,
        turn: TurnLength,
    ) -> Result<Self, ClientError> {
        let robots = (0..count).map(|_| {
            let mut emulator = Emulator::spawn(program)?;
            emulator.load(path)?;
            Ok(emulator)
        });
        let robots = robots.collect::<Result<Vec<Emulator>, ClientError>>()?;
        let deaf = vec![BTreeSet::new(); count];
        Ok(EmulatorPool::Apart(PerRobot { robots, turns: RadioTurns::new(turn), deaf }))
    }

    /// Lets the robots run no faster than the clock of this computer, as far as they have processes
    /// of their own.
    pub fn keep_pace(&mut self) {
        if let EmulatorPool::Apart(of) = self {
            of.turns.pace = Some(Pace::default());
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
                of.turns.air.lose(*lose, *seed);
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
        on_event: impl FnMut(RobotEvent),
    ) -> Result<(), ClientError> {
        match self {
            EmulatorPool::Shared(emulator) => emulator.run_all_after(commands, until, on_event),
            EmulatorPool::Apart(PerRobot { robots, turns, deaf }) => {
                for (robot, command) in commands {
                    robots[*robot].execute(command)?;
                }
                let mut robots: Vec<&mut Emulator> = robots.iter_mut().collect();
                let receives = |one: usize, other: usize| !deaf[one].contains(&other);
                turns.run(&mut robots, until, receives, on_event)
            }
        }
    }

    /// Returns the counters of a robot.
    pub fn statistics_of(&mut self, robot: usize) -> Result<RobotStatistics, ClientError> {
        match self {
            EmulatorPool::Shared(emulator) => emulator.statistics_of(robot),
            EmulatorPool::Apart(of) => {
                let mut statistics = of.robots[robot].statistics()?;
                statistics.air.carried = of.turns.air.carried;
                statistics.air.collided = of.turns.air.collided;
                statistics.air.lost = of.turns.air.lost;
                Ok(statistics)
            }
        }
    }
}
