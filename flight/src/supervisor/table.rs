//! The tables in the module's documentation, executed and compared with the code.
//!
//! The test reads the rows from the documentation and states again, for each event, the conditions
//! in which it occurs. So it predicts the first change from any state under any conditions that
//! last.

use crate::calibration::ImuFault;
use std::collections::BTreeSet;
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

use super::*;

/// A row of the table of transitions.
#[derive(Debug)]
struct Row {
    from: Vec<String>,
    event: String,
    /// Time for which the event's condition holds first.
    time_ms: u32,
    to: String,
}

/// Returns the cells of all tables with this number of columns, without their heads.
fn tables(columns: usize) -> Vec<Vec<&'static str>> {
    include_str!("mod.rs")
        .lines()
        .filter_map(|line| line.strip_prefix("//! |")?.strip_suffix('|'))
        .map(|line| line.split('|').map(str::trim).collect::<Vec<_>>())
        .filter(|cells| cells.len() == columns)
        .filter(|cells| !["From", "State", "---"].contains(&cells[0]))
        .collect()
}

fn rows() -> Vec<Row> {
    let all_but_locked = || {
        let stages = SupervisorStage::ALL.iter();
        let others = stages.filter(|stage| **stage != SupervisorStage::Locked);
        others.map(|stage| format!("{stage:?}")).collect()
    };
    let row = |cells: Vec<&str>| Row {
        from: match cells[0] {
            "all but Locked" => all_but_locked(),
            stages => stages.split(", ").map(ToString::to_string).collect(),
        },
        event: cells[1].to_string(),
        time_ms: if cells[2].is_empty() { 0 } else { cells[2].parse().unwrap() },
        to: cells[3].to_string(),
    };
    tables(4).into_iter().map(row).collect()
}

/// A state to start from, reached by steps, and conditions under which the robot is usually there.
struct Start {
    supervisor: Supervisor,
    usual: Conditions,
    can_resume: bool,
    /// The start of an event's name, and the time for which its condition has held before.
    held: (&'static str, u32),
}

/// Returns the conditions of a robot that flies.
fn in_flight() -> Conditions {
    Conditions {
        is_still: false,
        has_lift: true,
        is_at_ground: false,
        is_low: false,
        ..Conditions::AT_REST
    }
}

/// Takes steps under conditions that `change` makes of `usual`.
fn reach(
    mut supervisor: Supervisor,
    usual: Conditions,
    stage: SupervisorStage,
    change: fn(&mut Conditions),
) -> Supervisor {
    let mut now = usual;
    change(&mut now);
    for elapsed_ms in [0, 1000, 1000] {
        supervisor.step(elapsed_ms, &now);
        if supervisor.state.stage() == stage {
            return supervisor;
        }
    }
    panic!("{stage:?} is not reached from {supervisor:?}");
}

fn starts() -> Vec<Start> {
    use SupervisorStage as Stage;
    let rest = Conditions::AT_REST;
    let fly = in_flight();
    let ready = reach(Supervisor::new(), rest, Stage::Ready, |_| {});
    let arming = reach(ready, rest, Stage::Arming, |now| now.requests.arm = true);
    let armed = reach(arming, rest, Stage::Armed, |_| {});
    let tumbled =
        reach(armed, rest, Stage::Tumbled, |now| now.inclination = Inclination::UpsideDown);
    let flying = reach(armed, fly, Stage::Flying, |_| {});
    let landing = reach(flying, fly, Stage::Landing, |now| now.has_script_fault = true);
    let level = reach(flying, fly, Stage::LevelOut, |now| {
        now.has_position = false;
        now.setpoint = SetpointFreshness::Late;
    });
    let mut level_without_lift = flying;
    let without_lift = Conditions { has_lift: false, ..fly };
    level_without_lift.step(0, &without_lift);
    level_without_lift.step(1000, &without_lift);
    let level_without_lift = reach(level_without_lift, without_lift, Stage::LevelOut, |now| {
        now.has_position = false;
        now.has_script_fault = true;
    });
    let no_way_back = reach(flying, fly, Stage::LevelOut, |now| {
        now.has_position = false;
        now.has_script_fault = true;
    });
    let landing_blind = reach(landing, fly, Stage::LevelOut, |now| now.has_position = false);
    let landing_late =
        reach(flying, fly, Stage::Landing, |now| now.setpoint = SetpointFreshness::Late);
    let landing_outside = reach(flying, fly, Stage::Landing, |now| now.is_outside_fence = true);
    let landed = reach(landing, fly, Stage::Landed, |now| now.is_at_ground = true);
    let crashed = reach(flying, fly, Stage::Crashed, |now| now.has_impact = true);
    let locked = reach(flying, fly, Stage::Locked, |now| now.requests.emergency_stop = true);
    let start = |supervisor, usual| Start { supervisor, usual, can_resume: false, held: ("", 0) };
    std::vec![
        start(Supervisor::new(), rest),
        start(ready, rest),
        // The arm request that led to this state ends.
        start(Supervisor { has_arm_request: false, ..arming }, rest),
        start(armed, rest),
        start(tumbled, Conditions { inclination: Inclination::UpsideDown, ..rest }),
        start(flying, fly),
        start(landing, fly),
        Start { can_resume: true, ..start(landing_late, fly) },
        Start {
            held: ("OutsideFence", 100),
            ..start(landing_outside, Conditions { is_outside_fence: true, ..fly })
        },
        Start { can_resume: true, ..start(level, Conditions { has_position: false, ..fly }) },
        Start {
            held: ("NoLift", 1000),
            ..start(level_without_lift, Conditions { has_position: false, ..without_lift })
        },
        start(no_way_back, Conditions { has_position: false, ..fly }),
        start(landing_blind, Conditions { has_position: false, ..fly }),
        start(landed, rest),
        start(crashed, Conditions { is_at_ground: true, ..fly }),
        start(locked, rest),
    ]
}

const CHANGES: &[fn(&mut Conditions)] = &[
    |_| {},
    |now| now.requests.emergency_stop = true,
    |now| now.requests.arm = true,
    |now| now.requests.disarm = true,
    |now| now.requests.recover = true,
    |now| now.requests.resume = true,
    |now| now.imu_fault = Some(ImuFault::Silent),
    |now| now.is_calibrated = false,
    |now| now.inclination = Inclination::Upright,
    |now| now.inclination = Inclination::Tilted,
    |now| now.inclination = Inclination::UpsideDown,
    |now| now.acceleration = Acceleration::Sideways,
    |now| now.acceleration = Acceleration::Upwards,
    |now| now.acceleration = Acceleration::FreeFall,
    |now| now.is_still = !now.is_still,
    |now| now.has_impact = true,
    |now| now.has_position = !now.has_position,
    |now| now.setpoint = SetpointFreshness::Late,
    |now| now.setpoint = SetpointFreshness::Lost,
    |now| now.has_script_fault = true,
    |now| now.is_outside_fence = true,
    |now| now.has_lift = !now.has_lift,
    |now| now.is_vain = true,
    |now| now.is_at_ground = !now.is_at_ground,
    |now| now.is_low = !now.is_low,
    |now| now.battery = BatteryLevel::Low,
    |now| now.battery = BatteryLevel::Empty,
    |now| now.rotors = RotorStatus::Turning,
    |now| now.rotors = RotorStatus::Slow,
    |now| now.rotors = RotorStatus::Blocked,
];

/// Returns all conditions that differ from the usual ones by at most three changes.
fn conditions(usual: Conditions) -> impl Iterator<Item = Conditions> {
    let count = CHANGES.len();
    (0..count).flat_map(move |a| {
        (a..count).flat_map(move |b| {
            (b..count).map(move |c| {
                let mut now = usual;
                for index in BTreeSet::from([a, b, c]) {
                    CHANGES[index](&mut now);
                }
                now
            })
        })
    })
}

/// Returns true if the event occurs under these conditions, once they last.
fn occurs(event: &str, start: &Start, now: &Conditions) -> bool {
    let is_late = now.setpoint != SetpointFreshness::Fresh;
    let is_lost = now.setpoint == SetpointFreshness::Lost;
    let is_empty = now.battery == BatteryLevel::Empty;
    let fails_armed =
        !now.is_calibrated || now.is_outside_fence || now.has_script_fault || is_lost || is_empty;
    let is_upright = now.inclination == Inclination::Upright;
    let fails = fails_armed || !is_upright || !now.is_still || now.battery == BatteryLevel::Low;
    match event {
        "EmergencyStop" => now.requests.emergency_stop,
        "ImuFault" => now.imu_fault.is_some(),
        "DisarmRequest" => now.requests.disarm,
        "ArmRequest" => now.requests.arm && !now.requests.disarm,
        "RecoverRequest" => now.requests.recover && now.is_still && is_upright,
        "ChecksPassed" => !fails,
        "CheckFailed" => fails,
        "ArmedCheckFailed" => fails_armed,
        "UpsideDown" => now.inclination == Inclination::UpsideDown,
        "WeightUpwards" => now.acceleration == Acceleration::Upwards,
        "WeightSideways" => {
            matches!(now.acceleration, Acceleration::Upwards | Acceleration::Sideways)
        }
        "RotorsIdle" => {
            matches!(now.rotors, RotorStatus::NotMeasured | RotorStatus::Turning)
        }
        "Lift" => now.has_lift && !is_late,
        "HardLanding" => {
            let descends = start.supervisor.state.stage() != SupervisorStage::Flying;
            now.has_impact && is_upright && (now.is_low || descends)
        }
        "Impact" => now.has_impact,
        "NoEffect" => now.is_vain,
        "BlockedRotor" => now.rotors == RotorStatus::Blocked,
        "SetpointLost" => is_lost && !now.has_position,
        "OutsideFenceWithoutPosition" => now.is_outside_fence && !now.has_position,
        "OutsideFence" => now.is_outside_fence,
        "Ground" => now.is_at_ground,
        "GroundWithoutLift" => now.is_at_ground && !now.has_lift,
        "NoLift" => !now.has_lift,
        "BatteryEmpty" => is_empty,
        "ScriptFault" => now.has_script_fault,
        "NoSetpoint" => is_late,
        "PositionLost" => !now.has_position,
        "PositionRegained" => now.has_position,
        "ResumeRequest" => now.requests.resume && !is_late && start.can_resume && !now.is_at_ground,
        "SetpointRenewed" => !is_late && start.can_resume,
        "Calm" => now.is_still && is_upright,
        "Timeout" | "DescentTimeout" => true,
        _ => panic!("the table has an unknown event {event}"),
    }
}

/// Returns the time for which the event's condition has still to hold.
fn time_ms(row: &Row, start: &Start) -> u32 {
    let (event, held_ms) = start.held;
    row.time_ms - if row.event.starts_with(event) { held_ms } else { 0 }
}

fn target(row: &Row, start: &Start, now: &Conditions) -> String {
    match row.to.as_str() {
        "Disarmed" if occurs("CheckFailed", start, now) => "Preflight".to_string(),
        "Disarmed" => "Ready".to_string(),
        "Descent" if now.has_position => "Landing".to_string(),
        "Descent" => "LevelOut".to_string(),
        stage => stage.to_string(),
    }
}

fn describe(transition: Option<SupervisorTransition>) -> Option<(String, String, String)> {
    let SupervisorTransition { from, event, to } = transition?;
    Some((format!("{from:?}"), format!("{event:?}"), format!("{to:?}")))
}

/// Compares the code with the rows that apply, which are in order. Returns the rows that were used.
fn check<'a>(start: &Start, now: &Conditions, applying: &[&'a Row]) -> Vec<&'a Row> {
    let mut supervisor = start.supervisor;
    let from = format!("{:?}", supervisor.state.stage());
    let change = |row: &Row| Some((from.clone(), row.event.clone(), target(row, start, now)));

    // The first step starts the timers, and takes what needs no time.
    let change_now = describe(supervisor.step(0, now).transition);
    if let Some(&row) = applying.iter().find(|row| time_ms(row, start) == 0) {
        assert_eq!(change_now, change(row), "{now:?}");
        return std::vec![row];
    }
    assert_eq!(change_now, None, "{now:?}");

    // When all timers end in one step, the first row counts.
    let mut delayed = supervisor;
    let change_later = describe(delayed.step(100_000, now).transition);
    assert_eq!(change_later, applying.first().and_then(|row| change(row)), "{now:?}");

    // Otherwise the shortest time counts, to the millisecond. `min_by_key` takes the first of
    // several.
    let Some(&shortest) = applying.iter().min_by_key(|row| time_ms(row, start)) else {
        return Vec::new();
    };
    let time_ms = time_ms(shortest, start);
    assert_eq!(supervisor.step(time_ms - 1, now).transition, None, "{now:?}");
    assert_eq!(describe(supervisor.step(1, now).transition), change(shortest), "{now:?}");
    std::vec![applying[0], shortest]
}

#[test]
fn the_documented_transitions_agree_with_the_code() {
    let rows = rows();
    let mut used = BTreeSet::new();
    let mut stages = BTreeSet::new();
    for start in starts() {
        let stage = format!("{:?}", start.supervisor.state.stage());
        let from: Vec<&Row> = rows.iter().filter(|row| row.from.contains(&stage)).collect();
        for now in conditions(start.usual) {
            let mut applying = from.clone();
            applying.retain(|row| occurs(&row.event, &start, &now));
            let rows_used = check(&start, &now, &applying);
            used.extend(rows_used.iter().map(|row| (stage.clone(), &row.event)));
        }
        stages.insert(stage);
    }
    assert_eq!(stages.len(), SupervisorStage::ALL.len());
    for row in &rows {
        for stage in &row.from {
            assert!(used.contains(&(stage.clone(), &row.event)), "{stage} {} unused", row.event);
        }
    }
}

#[test]
fn the_documented_motor_states_agree_with_the_code() {
    let table = tables(2);
    for start in starts() {
        for now in conditions(start.usual) {
            let mut supervisor = start.supervisor;
            let permission = supervisor.step(0, &now).permission;
            let stage = format!("{:?}", supervisor.state.stage());
            let row = table.iter().find(|cells| cells[0] == stage);
            let words = row.map_or("Off", |cells| cells[1]);
            let expected = match words {
                "Follow with a fresh set-point, otherwise Idle" => match now.setpoint {
                    SetpointFreshness::Fresh => "Follow",
                    SetpointFreshness::Late | SetpointFreshness::Lost => "Idle",
                },
                word => word,
            };
            assert_eq!(format!("{permission:?}"), expected, "{stage} {now:?}");
        }
    }
}
