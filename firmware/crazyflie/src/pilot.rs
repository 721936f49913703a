//! The pilot of the script: flight functions, and the permission of a person.
//!
//! The pilot is that of the crate [`bittybuzz_flight`], and flies as in the simulator. It runs in the
//! script's task and commands a copy of the flight controller
//! ([`pilot_desk`]), so a search for a path delays no sample.
//!
//! A script that does not complete its steps does not reach the pilot: the set-point then expires, and
//! the supervisor lands the robot.

use core::cell::RefCell;

use bittybuzz_board::log;
use bittybuzz_flight::pilot::{
    PermissionEnd, Pilot, PilotAnswer, PilotFunction, PilotMoment, PilotRefusal, PilotSettings,
};
use bittybuzz_flight::planner::PlanError;
use bittybuzz_station::{ScriptAircraft, ScriptRank, Station};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant};

use crate::flight::pilot_desk;
use crate::link;

/// The least time between two ticks of the pilot. Steps of a script come each 100 ms.
const PERIOD: Duration = Duration::from_millis(90);

/// A request of a person at a ground station.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PersonRequest {
    Arm,
    Disarm,
}

/// The last request of a person.
pub static REQUEST: Signal<CriticalSectionRawMutex, PersonRequest> = Signal::new();

/// The pilot, with the time of its last tick.
pub struct ScriptPilot {
    pilot: Pilot,
    station: &'static RefCell<Station>,
    ticked_at: Option<Instant>,
}

impl ScriptPilot {
    /// Returns a pilot without a permission.
    pub fn new(station: &'static RefCell<Station>) -> Self {
        ScriptPilot { pilot: Pilot::new(PilotSettings::CRAZYFLIE), station, ticked_at: None }
    }

    /// Executes a flight function with these arguments.
    pub fn call(
        &mut self,
        function: PilotFunction,
        numbers: &[f32],
        is_repeated: bool,
    ) -> PilotAnswer {
        let rank = match function {
            PilotFunction::Land => ScriptRank::Landing,
            _ => ScriptRank::Usual,
        };
        self.act(rank, |pilot, aircraft, moment| {
            pilot.call(function, numbers, is_repeated, aircraft, moment)
        })
        .unwrap_or(PilotAnswer::Refused { reason: PilotRefusal::NotReady, is_new: true })
    }

    /// Flies on, since the script has completed a step or waits on purpose.
    pub fn renew(&mut self) {
        let now = Instant::now();
        let is_due = |at: Instant| now.saturating_duration_since(at) >= PERIOD;
        if self.ticked_at.is_none_or(is_due) {
            self.ticked_at = Some(now);
            self.tick();
        }
    }

    /// Sets if a fault has stopped the script and it has not restarted.
    pub fn set_script_fault(&mut self, has_fault: bool) {
        self.pilot.set_script_fault(has_fault);
        self.tick();
    }

    fn tick(&mut self) {
        self.act(ScriptRank::Usual, |pilot, aircraft, moment| pilot.tick(aircraft, moment));
    }

    /// Lets the pilot act, after the request of a person. Returns `None` before the flight task was
    /// started.
    fn act<R>(
        &mut self,
        rank: ScriptRank,
        act: impl FnOnce(&mut Pilot, &mut ScriptAircraft<'_>, PilotMoment) -> R,
    ) -> Option<R> {
        let moment = PilotMoment {
            now_ms: Instant::now().as_millis(),
            battery_mv: link::STATE.battery_mv().unwrap_or(0),
        };
        match REQUEST.try_take() {
            Some(PersonRequest::Arm) => {
                self.pilot.permit(moment.now_ms);
                log::info!("a person armed the robot");
            }
            Some(PersonRequest::Disarm) => {
                self.pilot.forbid();
                log::info!("a person disarmed the robot");
            }
            None => {}
        }
        let pilot = &mut self.pilot;
        // Both tasks run in the thread executor, and neither holds the station while it waits.
        let mut station = self.station.borrow_mut();
        pilot_desk::command(|stack| {
            act(pilot, &mut station.script_aircraft(stack, rank, moment.now_ms), moment)
        })
    }
}

/// Writes the reason why the pilot refused a function to the log.
pub fn report(function: PilotFunction, reason: PilotRefusal) {
    let name = function.name();
    match reason {
        PilotRefusal::NotArmed => log::warning!("{=str}: no person armed the robot", name),
        PilotRefusal::Ended(PermissionEnd::ScriptFault) => log::warning!(
            "{=str}: an error stopped the script, so a person has to arm the robot again",
            name
        ),
        PilotRefusal::Ended(PermissionEnd::Fault) => log::warning!(
            "{=str}: a fault ended the last flight, so a person has to arm the robot again",
            name
        ),
        PilotRefusal::Ended(PermissionEnd::Crash) => {
            log::warning!("{=str}: the robot fell, so a person has to arm it again", name)
        }
        PilotRefusal::Ended(PermissionEnd::Battery) => log::warning!(
            "{=str}: the battery was low, so a person has to arm the robot again",
            name
        ),
        PilotRefusal::Ended(PermissionEnd::Time) => {
            log::warning!("{=str}: a person armed the robot more than 30 minutes ago", name)
        }
        PilotRefusal::Ended(PermissionEnd::Person) => {
            log::warning!("{=str}: a person disarmed the robot", name)
        }
        PilotRefusal::BatteryLow { battery_mv, needed_mv } => log::warning!(
            "{=str}: the battery has {=u16} mV, and a take-off needs {=u16} mV",
            name,
            battery_mv,
            needed_mv
        ),
        PilotRefusal::NotReady => log::warning!(
            "{=str}: the robot did not pass its checks: it has to stand upright and still",
            name
        ),
        PilotRefusal::NotFlying => log::warning!("{=str}: the robot does not fly", name),
        PilotRefusal::NoPosition => {
            log::warning!("{=str}: the robot does not know its position", name)
        }
        PilotRefusal::Plan(PlanError::NotFinite) => {
            log::warning!("{=str}: an argument is not a finite number", name)
        }
        PilotRefusal::Plan(PlanError::TooFar) => {
            log::warning!("{=str}: the place is more than 30 minutes away", name)
        }
        PilotRefusal::Plan(PlanError::Duration) => {
            log::warning!("{=str}: the flight would take more than 30 minutes", name)
        }
        PilotRefusal::Plan(PlanError::OutsideFence) => {
            log::warning!("{=str}: the robot is outside its fence", name)
        }
        PilotRefusal::Plan(_) => log::warning!("{=str}: there is no path to the place", name),
    }
}
