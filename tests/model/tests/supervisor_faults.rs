//! Supervisors with a fault, which the model checker finds: so its properties can fail.

use std::collections::BTreeSet;
use std::fmt::Debug;
use std::hash::Hash;
use std::marker::PhantomData;

use bittybuzz_flight::supervisor::{
    BatteryLevel, Conditions, MotorPermission, SetpointFreshness, Supervisor, SupervisorStage,
};
use bittybuzz_model::supervisor::{
    Breach, Change, FALLS, FlightBounds, LOCK_LASTS, LOSSES, OTHERS, READY_AGAIN, REQUESTS,
    RULES_HOLD, SILENCE_ENDS, Supervision,
};
use stateright::{Checker, HasDiscoveries, Model};

/// A fault in a supervisor.
trait Fault: Copy + Debug + Eq + Hash + Send + Sync + 'static {
    /// Takes a step as the faulty supervisor does.
    fn step(
        supervisor: &mut Supervisor,
        elapsed_ms: u32,
        now: &mut Conditions,
    ) -> Option<MotorPermission>;
}

/// A supervisor with the fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct FaultySupervisor<F>(Supervisor, PhantomData<F>);

impl<F: Fault> Supervision for FaultySupervisor<F> {
    fn power_on() -> Self {
        FaultySupervisor(Supervisor::new(), PhantomData)
    }

    fn step(&mut self, elapsed_ms: u32, now: &Conditions) -> MotorPermission {
        let mut now = *now;
        let wrong = F::step(&mut self.0, elapsed_ms, &mut now);
        wrong.unwrap_or_else(|| self.0.step(elapsed_ms, &now).permission)
    }

    fn stage(&self) -> SupervisorStage {
        self.0.state().stage()
    }
}

/// Declares faults: a name, and the code that runs before the step or replaces it.
macro_rules! faults {
    ($(
        $(#[$doc:meta])*
        $name:ident: |$supervisor:ident, $elapsed:ident, $now:ident| $body:expr;
    )*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
            struct $name;

            impl Fault for $name {
                fn step(
                    $supervisor: &mut Supervisor,
                    $elapsed: u32,
                    $now: &mut Conditions,
                ) -> Option<MotorPermission> {
                    $body
                }
            }
        )*
    };
}

faults! {
    /// Motors follow a fresh set-point after a crash.
    FliesAfterCrash: |supervisor, _elapsed, now| {
        let crashed = supervisor.state().stage() == SupervisorStage::Crashed;
        (crashed && now.setpoint == SetpointFreshness::Fresh).then_some(MotorPermission::Follow)
    };

    /// Each step of an arm request counts as a new one.
    ArmsByHeldRequest: |supervisor, _elapsed, now| {
        let mut released = *now;
        released.requests.arm = false;
        supervisor.step(0, &released);
        None
    };

    /// A landing robot ignores the emergency stop.
    LandsDespiteStop: |supervisor, _elapsed, now| {
        now.requests.emergency_stop &= supervisor.state().stage() != SupervisorStage::Landing;
        None
    };

    /// A landing never times out.
    LandsForEver: |supervisor, _elapsed, now| {
        let landing = supervisor.state().stage() == SupervisorStage::Landing;
        landing.then(|| supervisor.step(0, now).permission)
    };

    /// A crashed robot ignores the recover request.
    NeverRecovers: |_supervisor, _elapsed, now| {
        now.requests.recover = false;
        None
    };

    /// An arm request ends a lock.
    ArmsLockedRobot: |supervisor, _elapsed, now| {
        if supervisor.state().stage() == SupervisorStage::Locked && now.requests.arm {
            *supervisor = Supervisor::new();
        }
        None
    };

    /// The battery is not looked at.
    ArmsWithLowBattery: |_supervisor, _elapsed, now| {
        now.battery = BatteryLevel::Good;
        None
    };

    /// A request to resume ends every landing.
    ResumesAnyLanding: |supervisor, _elapsed, now| {
        let landing = supervisor.state().stage() == SupervisorStage::Landing;
        let resumes = now.requests.resume && now.setpoint == SetpointFreshness::Fresh;
        (landing && resumes).then_some(MotorPermission::Follow)
    };

    /// Lift alone starts a flight. The checker found this fault in the first supervisor.
    FliesWithoutFreshSetpoint: |supervisor, _elapsed, now| {
        let lifts = supervisor.state().stage() == SupervisorStage::Armed && now.has_lift;
        if lifts && now.setpoint == SetpointFreshness::Late {
            now.setpoint = SetpointFreshness::Fresh;
        }
        None
    };
}

/// Explores a faulty supervisor until the property fails. Returns the rule that the last step
/// broke, if it broke one.
fn find<F: Fault>(property: &'static str, lists: &[&[Change]]) -> Option<Breach> {
    let failure = HasDiscoveries::AnyOf(BTreeSet::from([property]));
    let bounds = FlightBounds::<FaultySupervisor<F>>::new(&[1000], lists);
    let checker = bounds.checker().finish_when(failure).spawn_bfs().join();
    let path = checker.discovery(property).expect("the checker finds the fault");
    path.last_state().breach
}

/// The arm request alone.
const ARM: &[Change] = REQUESTS.split_at(1).0;
/// The request to resume alone.
const RESUME: &[Change] = REQUESTS.split_at(4).1;

#[test]
fn a_flight_after_a_crash_is_found() {
    let breach = find::<FliesAfterCrash>(RULES_HOLD, &[ARM, FALLS]);
    assert_eq!(breach, Some(Breach::MotorsBeforeRecovery));
}

#[test]
fn an_arm_request_that_counts_again_is_found() {
    let breach = find::<ArmsByHeldRequest>(RULES_HOLD, &[REQUESTS]);
    assert_eq!(breach, Some(Breach::StartWithoutPerson));
}

#[test]
fn an_ignored_emergency_stop_is_found() {
    let breach = find::<LandsDespiteStop>(RULES_HOLD, &[REQUESTS, LOSSES]);
    assert_eq!(breach, Some(Breach::MotorsAfterRequestToStop));
}

#[test]
fn a_landing_without_end_is_found() {
    find::<LandsForEver>(SILENCE_ENDS, &[LOSSES, REQUESTS]);
}

#[test]
fn a_crash_without_recovery_is_found() {
    find::<NeverRecovers>(READY_AGAIN, &[REQUESTS, FALLS]);
}

#[test]
fn a_lock_that_ends_is_found() {
    find::<ArmsLockedRobot>(LOCK_LASTS, &[REQUESTS]);
}

#[test]
fn a_start_with_a_low_battery_is_found() {
    let breach = find::<ArmsWithLowBattery>(RULES_HOLD, &[REQUESTS, OTHERS]);
    assert_eq!(breach, Some(Breach::StartDespiteChecks));
}

#[test]
fn a_landing_that_any_request_ends_is_found() {
    let breach = find::<ResumesAnyLanding>(RULES_HOLD, &[ARM, RESUME, LOSSES]);
    assert_eq!(breach, Some(Breach::FollowsDuringFinalLanding));
}

#[test]
fn a_flight_without_a_fresh_setpoint_is_found() {
    let breach = find::<FliesWithoutFreshSetpoint>(RULES_HOLD, &[ARM, LOSSES]);
    assert_eq!(breach, Some(Breach::FollowsOldSetpoint));
}
