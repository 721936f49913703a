//! The order of the sources of commands: emergency stop, supervisor, landing, ground station, script.
//!
//! A robot has one flight controller and several sources that would command it. The arbiter decides
//! which of their commands the flight controller gets:
//!
//! 1. After an **emergency stop** no source commands the robot until the next power-on. Once a station
//!    sent a sign of life for it, a second without another one is an emergency stop as well.
//! 2. While the **supervisor** ends a flight, and until the robot is ready again, it takes no
//!    commands. One exception: a station whose commands expired takes the robot back by its next
//!    set-point or plan, before the robot is on the ground, if nothing else ended the flight.
//! 3. A **landing** that any source commanded is finished.
//! 4. A **ground station** has the robot from its first set-point or plan on, until it says that no
//!    more set-points follow, or the flight ends. A robot in the air whose station falls silent is
//!    not returned to the script: its command expires, and the supervisor lands it. The station has
//!    it until then, and may come back.
//! 5. The **script** has it otherwise. The loss of a station that does not command the robot changes
//!    nothing.
//!
//! To turn the motors off is permitted to a station at any time. A stop that ends a descent by
//! set-points comes as a landing (firmware/station, setpoint.rs). The thrust of a set-point counts only
//! after one without thrust, so that a stick that is up does not start a robot (Bitcraze's
//! crtp_commander_rpyt.c does the same).

#[cfg(test)]
mod tests;

use crate::supervisor::SupervisorStage;

/// Time in ms after the last packet of a station at which its plans expire.
pub const STATION_LOST_MS: u64 = 1000;
/// Time in ms after a station's last set-point from which on a robot on the ground is free again.
pub const SETPOINT_FRESH_MS: u64 = crate::supervisor::SETPOINT_LATE_MS as u64;
/// Time in ms after a sign of life for the emergency stop at which the next one is overdue.
pub const KEEP_ALIVE_MS: u64 = 1000;

/// A source of commands, from the first in rank to the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CommandSource {
    EmergencyStop,
    Supervisor,
    Landing,
    Station,
    Script,
}

/// A command of a ground station, as far as its rank depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StationCommand {
    /// A set-point of position, velocity or attitude.
    Setpoint,
    /// A set-point of thrust.
    Thrust {
        is_zero: bool,
    },
    /// No set-points follow for now.
    SetpointsEnd,
    /// A flight to plan.
    Plan,
    Land,
    /// Motors off.
    Stop,
    EmergencyStop,
    /// A sign of life for the emergency stop.
    KeepAlive,
}

/// A command of the script, as far as its rank depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ScriptCommand {
    Fly,
    Land,
}

/// The use of a command that the arbiter lets pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Passage {
    /// The flight controller executes the command.
    Execute,
    /// The flight controller brakes and hovers, because no command follows.
    Hover,
    /// The flight controller takes the robot back from the supervisor if the supervisor lands it for
    /// want of commands alone, and then executes the command.
    Resume,
    /// The command has no effect now.
    Ignore,
}

/// A reason why a command does not reach the flight controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CommandBlock {
    /// A source of higher rank is in command.
    Outranked(CommandSource),
    /// There was no set-point without thrust before.
    ThrustLocked,
}

/// The source in command, and the state of its command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Arbitration {
    pub source: CommandSource,
    /// The command in force gets a sign of life: a landing, or the plan of a station that is there.
    /// Set-points and the script give their own.
    pub renews: bool,
}

/// The hold of a ground station on the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Claim {
    Absent,
    Setpoints {
        last_ms: u64,
        by_thrust: bool,
    },
    /// A plan, or a hover after set-points.
    Plan,
}

/// The order of the sources.
#[derive(Clone, Copy, Debug)]
pub struct Arbiter {
    is_stopped: bool,
    /// The time of the last sign of life for the emergency stop, once there was one.
    keep_alive_ms: Option<u64>,
    /// The time of the station's last packet of any kind.
    heard_ms: Option<u64>,
    claim: Claim,
    /// The script had the robot in this flight, and gets it back when set-points end.
    has_script: bool,
    is_landing: bool,
    is_thrust_unlocked: bool,
    was_airborne: bool,
}

impl Default for Arbiter {
    fn default() -> Self {
        Self::new()
    }
}

impl Arbiter {
    /// Returns the order after power-on: the script's turn.
    pub const fn new() -> Self {
        Arbiter {
            is_stopped: false,
            keep_alive_ms: None,
            heard_ms: None,
            claim: Claim::Absent,
            has_script: false,
            is_landing: false,
            is_thrust_unlocked: false,
            was_airborne: false,
        }
    }

    /// Takes note of a packet of the ground station, whatever is in it.
    pub fn hear_station(&mut self, now_ms: u64) {
        self.heard_ms = Some(now_ms);
    }

    /// Decides about a command of the ground station.
    ///
    /// # Errors
    /// Returns why the command is blocked.
    pub fn pass_station(
        &mut self,
        command: StationCommand,
        stage: SupervisorStage,
        now_ms: u64,
    ) -> Result<Passage, CommandBlock> {
        match command {
            StationCommand::EmergencyStop => {
                self.is_stopped = true;
                return Ok(Passage::Execute);
            }
            StationCommand::KeepAlive => {
                self.keep_alive_ms = Some(now_ms);
                return Ok(Passage::Ignore);
            }
            StationCommand::Stop if !self.is_stopped => {
                self.end_flight();
                return Ok(Passage::Execute);
            }
            StationCommand::Thrust { is_zero: true } if !self.flies_by_thrust() => {
                // cflib sends this when it closes its link, so it must not end the flight of another source.
                self.is_thrust_unlocked = true;
                return Ok(Passage::Ignore);
            }
            _ => {}
        }
        if command == StationCommand::Land {
            return self.land(stage, now_ms);
        }
        let resumes = self.may_resume(command, stage);
        if !resumes {
            self.require(CommandSource::Station, stage, now_ms)?;
        }
        match command {
            StationCommand::Setpoint => {
                self.claim = Claim::Setpoints { last_ms: now_ms, by_thrust: false };
            }
            StationCommand::Thrust { .. } if !self.is_thrust_unlocked => {
                return Err(CommandBlock::ThrustLocked);
            }
            StationCommand::Thrust { .. } => {
                self.claim = Claim::Setpoints { last_ms: now_ms, by_thrust: true };
            }
            StationCommand::SetpointsEnd => return Ok(self.end_setpoints()),
            StationCommand::Plan => self.claim = Claim::Plan,
            StationCommand::Land
            | StationCommand::Stop
            | StationCommand::EmergencyStop
            | StationCommand::KeepAlive => {}
        }
        Ok(if resumes { Passage::Resume } else { Passage::Execute })
    }

    /// Decides about a command of the script.
    ///
    /// # Errors
    /// Returns why the command is blocked.
    pub fn pass_script(
        &mut self,
        command: ScriptCommand,
        stage: SupervisorStage,
        now_ms: u64,
    ) -> Result<Passage, CommandBlock> {
        match command {
            ScriptCommand::Land => self.land(stage, now_ms),
            ScriptCommand::Fly => {
                self.require(CommandSource::Script, stage, now_ms)?;
                self.has_script = true;
                self.claim = Claim::Absent;
                Ok(Passage::Execute)
            }
        }
    }

    /// Returns the source in command. Call this function in each tick of the flight controller,
    /// which stops the motors if the source is [`CommandSource::EmergencyStop`].
    pub fn poll(&mut self, stage: SupervisorStage, now_ms: u64) -> Arbitration {
        if self.keep_alive_ms.is_some_and(|last_ms| now_ms.saturating_sub(last_ms) > KEEP_ALIVE_MS)
        {
            self.is_stopped = true;
        }
        let is_airborne = is_airborne(stage);
        if self.was_airborne && !is_airborne {
            self.end_flight();
        }
        self.was_airborne = is_airborne;
        if self.claim == Claim::Plan && !is_airborne && stage != SupervisorStage::Armed {
            // The flight controller refused the plan.
            self.claim = Claim::Absent;
        }
        let source = self.source(stage, now_ms);
        let renews = match source {
            CommandSource::Landing => true,
            CommandSource::Station => self.claim == Claim::Plan && self.has_station(now_ms),
            _ => false,
        };
        Arbitration { source, renews }
    }

    fn source(&self, stage: SupervisorStage, now_ms: u64) -> CommandSource {
        if self.is_stopped {
            CommandSource::EmergencyStop
        } else if is_over(stage) {
            CommandSource::Supervisor
        } else if self.is_landing {
            CommandSource::Landing
        } else if self.is_claimed(stage, now_ms) {
            CommandSource::Station
        } else {
            CommandSource::Script
        }
    }

    /// Blocks a command of a source that another one outranks.
    fn require(
        &self,
        source: CommandSource,
        stage: SupervisorStage,
        now_ms: u64,
    ) -> Result<(), CommandBlock> {
        let in_command = self.source(stage, now_ms);
        if in_command < source { Err(CommandBlock::Outranked(in_command)) } else { Ok(()) }
    }

    /// Returns true if this command of a station may end a landing of the supervisor: it moves a robot
    /// that the station flew and that no source commanded to land.
    fn may_resume(&self, command: StationCommand, stage: SupervisorStage) -> bool {
        let moves = matches!(
            command,
            StationCommand::Setpoint
                | StationCommand::Thrust { is_zero: false }
                | StationCommand::Plan
        );
        moves
            && stage == SupervisorStage::Landing
            && self.claim != Claim::Absent
            && !self.is_landing
            && !self.is_stopped
    }

    /// Returns true if the station holds the robot. On the ground its set-points must be fresh for
    /// that, or it must be there; in the air a silent station keeps the robot until the supervisor
    /// has landed it.
    fn is_claimed(&self, stage: SupervisorStage, now_ms: u64) -> bool {
        let is_fresh = match self.claim {
            Claim::Absent => return false,
            Claim::Plan => self.has_station(now_ms),
            Claim::Setpoints { last_ms, .. } => now_ms.saturating_sub(last_ms) <= SETPOINT_FRESH_MS,
        };
        is_fresh || is_airborne(stage)
    }

    /// Returns true if the station sent any packet within [`STATION_LOST_MS`].
    fn has_station(&self, now_ms: u64) -> bool {
        self.heard_ms.is_some_and(|heard_ms| now_ms.saturating_sub(heard_ms) <= STATION_LOST_MS)
    }

    fn flies_by_thrust(&self) -> bool {
        matches!(self.claim, Claim::Setpoints { by_thrust: true, .. })
    }

    fn land(&mut self, stage: SupervisorStage, now_ms: u64) -> Result<Passage, CommandBlock> {
        self.require(CommandSource::Landing, stage, now_ms)?;
        if !is_airborne(stage) {
            return Ok(Passage::Ignore);
        }
        let is_new = !self.is_landing;
        self.is_landing = true;
        Ok(if is_new { Passage::Execute } else { Passage::Ignore })
    }

    /// Ends the set-points of a station. Its plans may follow, and until then the robot hovers; a
    /// robot that the script had before goes back to it.
    fn end_setpoints(&mut self) -> Passage {
        let Claim::Setpoints { .. } = self.claim else { return Passage::Ignore };
        self.claim =
            if self.has_script || !self.was_airborne { Claim::Absent } else { Claim::Plan };
        if self.was_airborne { Passage::Hover } else { Passage::Ignore }
    }

    fn end_flight(&mut self) {
        self.claim = Claim::Absent;
        self.has_script = false;
        self.is_landing = false;
        self.is_thrust_unlocked = false;
    }
}

/// Returns true in the air.
fn is_airborne(stage: SupervisorStage) -> bool {
    matches!(stage, SupervisorStage::Flying | SupervisorStage::Landing | SupervisorStage::LevelOut)
}

/// Returns true if the supervisor ends a flight or the robot has to get ready after one. A robot that
/// levels out takes commands: a set-point that comes late continues the flight.
fn is_over(stage: SupervisorStage) -> bool {
    matches!(
        stage,
        SupervisorStage::Landing
            | SupervisorStage::Landed
            | SupervisorStage::Tumbled
            | SupervisorStage::Crashed
            | SupervisorStage::Locked
    )
}
