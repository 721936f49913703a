//! The flight controller as the script's pilot gets it.

use bittybuzz_flight::Vec3;
use bittybuzz_flight::arbiter::{Arbiter, CommandSource, Passage, ScriptCommand};
use bittybuzz_flight::pilot::{Aircraft, AircraftStatus};
use bittybuzz_flight::planner::{Destination, PlanReport, VelocityCommand};
use bittybuzz_flight::stack::{FlightRefusal, FlightStack};

/// The reason for which the pilot acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScriptRank {
    /// The script called `land`, which outranks a station.
    Landing,
    /// Anything else.
    Usual,
}

/// A flight controller whose commands pass the order of sources. A robot that a station flies refuses
/// the script's, and expires without the station's.
pub struct ScriptAircraft<'a> {
    pub(super) arbiter: &'a mut Arbiter,
    pub(super) stack: &'a mut FlightStack,
    pub(super) rank: ScriptRank,
    pub(super) now_ms: u64,
}

impl ScriptAircraft<'_> {
    fn source(&mut self) -> CommandSource {
        self.arbiter.poll(self.stack.stage(), self.now_ms).source
    }

    /// Asks if the script may fly now.
    fn require_turn(&mut self) -> Result<(), FlightRefusal> {
        // A pilot repeats its command in each tick, which must not take the robot from a station.
        if self.source() != CommandSource::Script {
            return Err(FlightRefusal::NotFlying);
        }
        let stage = self.stack.stage();
        let passage = self.arbiter.pass_script(ScriptCommand::Fly, stage, self.now_ms);
        passage.map(drop).map_err(|_| FlightRefusal::NotFlying)
    }
}

impl Aircraft for ScriptAircraft<'_> {
    fn status(&self) -> AircraftStatus {
        self.stack.status()
    }

    fn arm(&mut self) -> Result<(), FlightRefusal> {
        match self.source() {
            CommandSource::Script => self.stack.arm(),
            _ => Err(FlightRefusal::NotReady),
        }
    }

    fn take_off(
        &mut self,
        height_m: f32,
        duration_s: Option<f32>,
    ) -> Result<PlanReport, FlightRefusal> {
        self.require_turn()?;
        self.stack.take_off(height_m, duration_s)
    }

    fn land(&mut self, duration_s: Option<f32>) -> Result<PlanReport, FlightRefusal> {
        if self.source() == CommandSource::Station && self.rank == ScriptRank::Usual {
            return Err(FlightRefusal::NotFlying);
        }
        let stage = self.stack.stage();
        match self.arbiter.pass_script(ScriptCommand::Land, stage, self.now_ms) {
            // A robot that lands already goes on, as the flight controller answers.
            Ok(Passage::Execute | Passage::Ignore) => self.stack.land(duration_s),
            _ => Err(FlightRefusal::NotFlying),
        }
    }

    fn go_to(&mut self, destination: Destination) -> Result<PlanReport, FlightRefusal> {
        self.require_turn()?;
        self.stack.go_to(destination, None)
    }

    fn fly(&mut self, velocity: &VelocityCommand) {
        if self.require_turn().is_ok() {
            self.stack.fly(velocity);
        }
    }

    fn hear_peer(&mut self, position_m: Vec3) {
        self.stack.hear_peer(position_m);
    }

    fn renew(&mut self) {
        if self.source() != CommandSource::Station || !self.stack.is_flying() {
            self.stack.renew();
        }
    }

    fn stop(&mut self) {
        if self.source() != CommandSource::Station || self.stack.has_landed() {
            self.stack.stop();
        }
    }

    fn set_script_fault(&mut self, has_fault: bool) {
        // The fault of a script ends its own flights only.
        let is_flown_by_station = self.source() == CommandSource::Station;
        self.stack.set_script_fault(has_fault && !is_flown_by_station);
    }
}
