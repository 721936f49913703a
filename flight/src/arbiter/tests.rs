use super::*;
use SupervisorStage as Stage;

/// An arbiter with its clock and the stage of the robot.
struct Flight {
    arbiter: Arbiter,
    stage: Stage,
    now_ms: u64,
}

impl Flight {
    fn new(stage: Stage) -> Self {
        let mut flight = Flight { arbiter: Arbiter::new(), stage, now_ms: 5000 };
        flight.poll();
        flight
    }

    fn poll(&mut self) -> Arbitration {
        self.arbiter.poll(self.stage, self.now_ms)
    }

    fn source(&mut self) -> CommandSource {
        self.poll().source
    }

    fn station(&mut self, command: StationCommand) -> Result<Passage, CommandBlock> {
        self.arbiter.hear_station(self.now_ms);
        self.arbiter.pass_station(command, self.stage, self.now_ms)
    }

    fn script(&mut self, command: ScriptCommand) -> Result<Passage, CommandBlock> {
        self.arbiter.pass_script(command, self.stage, self.now_ms)
    }

    fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.poll();
    }

    /// Lets time pass in ticks of 1 ms, without a packet.
    fn wait(&mut self, duration_ms: u64) -> Arbitration {
        for _ in 0..duration_ms {
            self.now_ms += 1;
            self.poll();
        }
        self.poll()
    }
}

const BLOCKED_BY_STATION: Result<Passage, CommandBlock> =
    Err(CommandBlock::Outranked(CommandSource::Station));
const BLOCKED_BY_LANDING: Result<Passage, CommandBlock> =
    Err(CommandBlock::Outranked(CommandSource::Landing));
const BLOCKED_BY_SUPERVISOR: Result<Passage, CommandBlock> =
    Err(CommandBlock::Outranked(CommandSource::Supervisor));
const EXECUTED: Result<Passage, CommandBlock> = Ok(Passage::Execute);

#[test]
fn without_a_station_the_script_flies() {
    let mut flight = Flight::new(Stage::Armed);
    assert_eq!(flight.script(ScriptCommand::Fly), EXECUTED);
    flight.enter(Stage::Flying);
    assert_eq!(flight.wait(60_000), Arbitration { source: CommandSource::Script, renews: false });
    assert_eq!(flight.script(ScriptCommand::Land), EXECUTED);
    assert_eq!(flight.poll(), Arbitration { source: CommandSource::Landing, renews: true });
    assert_eq!(flight.script(ScriptCommand::Fly), BLOCKED_BY_LANDING);
    flight.enter(Stage::Landed);
    assert_eq!(flight.source(), CommandSource::Supervisor);
    flight.enter(Stage::Ready);
    assert_eq!(flight.source(), CommandSource::Script);
}

/// The script is in command again only after the station says so, or the flight ends.
#[test]
fn a_station_takes_the_robot_from_the_script() {
    for command in [StationCommand::Setpoint, StationCommand::Plan] {
        let mut flight = Flight::new(Stage::Flying);
        assert_eq!(flight.script(ScriptCommand::Fly), EXECUTED);
        assert_eq!(flight.station(command), EXECUTED);
        assert_eq!(flight.source(), CommandSource::Station);
        assert_eq!(flight.script(ScriptCommand::Fly), BLOCKED_BY_STATION);
        flight.wait(60_000);
        assert_eq!(flight.script(ScriptCommand::Fly), BLOCKED_BY_STATION, "silent in the air");
    }
}

#[test]
fn set_points_that_end_return_the_robot_to_the_script() {
    let mut flight = Flight::new(Stage::Flying);
    flight.script(ScriptCommand::Fly).unwrap();
    flight.station(StationCommand::Setpoint).unwrap();
    assert_eq!(flight.station(StationCommand::SetpointsEnd), Ok(Passage::Hover));
    assert_eq!(flight.source(), CommandSource::Script);
    assert_eq!(flight.script(ScriptCommand::Fly), EXECUTED);
    assert_eq!(flight.station(StationCommand::SetpointsEnd), Ok(Passage::Ignore));
}

/// cflib's `send_notify_setpoint_stop` comes before a command to plan.
#[test]
fn set_points_that_end_keep_a_robot_that_only_the_station_flew() {
    let mut flight = Flight::new(Stage::Armed);
    flight.station(StationCommand::Setpoint).unwrap();
    flight.enter(Stage::Flying);
    assert_eq!(flight.station(StationCommand::SetpointsEnd), Ok(Passage::Hover));
    assert_eq!(flight.poll(), Arbitration { source: CommandSource::Station, renews: true });
    assert_eq!(flight.script(ScriptCommand::Fly), BLOCKED_BY_STATION);
    assert_eq!(flight.station(StationCommand::Plan), EXECUTED);
}

/// A command that is not renewed expires in the flight controller, whose supervisor then lands.
#[test]
fn the_loss_of_a_station_ends_the_life_of_its_plan() {
    let mut flight = Flight::new(Stage::Armed);
    flight.station(StationCommand::Plan).unwrap();
    flight.enter(Stage::Flying);
    for _ in 0..100 {
        flight.wait(STATION_LOST_MS);
        assert!(flight.poll().renews);
        flight.arbiter.hear_station(flight.now_ms);
    }
    assert!(flight.wait(STATION_LOST_MS).renews);
    assert_eq!(flight.wait(1), Arbitration { source: CommandSource::Station, renews: false });
    flight.enter(Stage::Landing);
    assert_eq!(flight.source(), CommandSource::Supervisor);
}

const MOTIONS: [StationCommand; 3] =
    [StationCommand::Setpoint, StationCommand::Plan, StationCommand::Thrust { is_zero: false }];

/// Bitcraze's firmware does the same until the motors stop, 2 s after the last set-point
/// (supervisor_state_machine.c, transitionsWarningLevelOut).
#[test]
fn a_station_that_comes_back_takes_the_robot_back() {
    for command in MOTIONS {
        let mut flight = Flight::new(Stage::Flying);
        flight.station(StationCommand::Thrust { is_zero: true }).unwrap();
        flight.station(command).unwrap();
        flight.wait(SETPOINT_FRESH_MS + 1);
        flight.enter(Stage::Landing);
        flight.wait(5000);
        assert_eq!(flight.source(), CommandSource::Supervisor);
        assert_eq!(flight.script(ScriptCommand::Fly), BLOCKED_BY_SUPERVISOR);
        assert_eq!(flight.station(command), Ok(Passage::Resume));
        flight.enter(Stage::Flying);
        assert_eq!(flight.source(), CommandSource::Station);
        assert_eq!(flight.station(command), EXECUTED);
    }
}

#[test]
fn a_station_that_did_not_fly_the_robot_ends_no_landing() {
    for command in MOTIONS {
        let mut flight = Flight::new(Stage::Flying);
        flight.script(ScriptCommand::Fly).unwrap();
        flight.station(StationCommand::Thrust { is_zero: true }).unwrap();
        flight.enter(Stage::Landing);
        assert_eq!(flight.station(command), BLOCKED_BY_SUPERVISOR);
    }
}

#[test]
fn a_station_ends_no_landing_that_was_commanded() {
    for command in MOTIONS {
        let mut flight = Flight::new(Stage::Flying);
        flight.station(StationCommand::Thrust { is_zero: true }).unwrap();
        flight.station(StationCommand::Setpoint).unwrap();
        flight.station(StationCommand::Land).unwrap();
        flight.enter(Stage::Landing);
        assert_eq!(flight.station(command), BLOCKED_BY_SUPERVISOR);
    }
}

/// A set-point that comes late continues the flight (supervisor, rule 5).
#[test]
fn a_robot_that_levels_out_takes_set_points() {
    let mut flight = Flight::new(Stage::Flying);
    flight.station(StationCommand::Setpoint).unwrap();
    flight.wait(SETPOINT_FRESH_MS + 1);
    flight.enter(Stage::LevelOut);
    assert_eq!(flight.script(ScriptCommand::Fly), BLOCKED_BY_STATION);
    assert_eq!(flight.station(StationCommand::Setpoint), EXECUTED);
}

#[test]
fn the_loss_of_a_station_without_the_robot_changes_nothing() {
    let mut flight = Flight::new(Stage::Flying);
    flight.script(ScriptCommand::Fly).unwrap();
    flight.arbiter.hear_station(flight.now_ms);
    // cflib sends a set-point without thrust when it closes its link.
    assert_eq!(flight.station(StationCommand::Thrust { is_zero: true }), Ok(Passage::Ignore));
    for _ in 0..10_000 {
        assert_eq!(flight.wait(1), Arbitration { source: CommandSource::Script, renews: false });
        assert_eq!(flight.script(ScriptCommand::Fly), EXECUTED);
    }
}

#[test]
fn on_the_ground_a_station_holds_the_robot_only_while_it_is_there() {
    for stage in [Stage::Preflight, Stage::Ready, Stage::Arming, Stage::Armed] {
        let mut flight = Flight::new(stage);
        flight.station(StationCommand::Setpoint).unwrap();
        assert_eq!(flight.wait(SETPOINT_FRESH_MS).source, CommandSource::Station);
        assert_eq!(flight.script(ScriptCommand::Fly), BLOCKED_BY_STATION);
        assert_eq!(flight.wait(1).source, CommandSource::Script);
        flight.station(StationCommand::Plan).unwrap();
        let holds = stage == Stage::Armed;
        let source = if holds { CommandSource::Station } else { CommandSource::Script };
        assert_eq!(flight.source(), source, "{stage:?}");
        assert_eq!(flight.wait(STATION_LOST_MS).source, source);
        assert_eq!(flight.wait(1).source, CommandSource::Script);
    }
}

/// A landing comes before a station, whichever source commanded it.
#[test]
fn a_landing_is_finished() {
    let mut flight = Flight::new(Stage::Flying);
    flight.station(StationCommand::Setpoint).unwrap();
    assert_eq!(flight.script(ScriptCommand::Land), EXECUTED);
    assert_eq!(flight.station(StationCommand::Land), Ok(Passage::Ignore), "it lands already");
    for command in [StationCommand::Setpoint, StationCommand::Plan, StationCommand::SetpointsEnd] {
        assert_eq!(flight.station(command), BLOCKED_BY_LANDING);
    }
    assert_eq!(flight.wait(60_000), Arbitration { source: CommandSource::Landing, renews: true });
    flight.enter(Stage::Landed);
    flight.enter(Stage::Ready);
    assert_eq!(flight.station(StationCommand::Land), Ok(Passage::Ignore), "on the ground");
    assert_eq!(flight.station(StationCommand::Setpoint), EXECUTED);
}

#[test]
fn a_station_can_always_turn_the_motors_off() {
    for stage in Stage::ALL {
        let mut flight = Flight::new(stage);
        let _ = flight.script(ScriptCommand::Fly);
        let _ = flight.script(ScriptCommand::Land);
        assert_eq!(flight.station(StationCommand::Stop), EXECUTED, "{stage:?}");
    }
}

#[test]
fn nobody_commands_a_robot_after_an_emergency_stop() {
    for stage in Stage::ALL {
        let mut flight = Flight::new(stage);
        assert_eq!(flight.station(StationCommand::EmergencyStop), EXECUTED);
        flight.enter(Stage::Locked);
        for stage in Stage::ALL {
            flight.enter(stage);
            let stop = Arbitration { source: CommandSource::EmergencyStop, renews: false };
            assert_eq!(flight.wait(10), stop);
            let blocked = Err(CommandBlock::Outranked(CommandSource::EmergencyStop));
            for command in [
                StationCommand::Setpoint,
                StationCommand::Plan,
                StationCommand::Land,
                StationCommand::Stop,
                StationCommand::SetpointsEnd,
            ] {
                assert_eq!(flight.station(command), blocked);
            }
            assert_eq!(flight.script(ScriptCommand::Fly), blocked);
            assert_eq!(flight.script(ScriptCommand::Land), blocked);
        }
    }
}

#[test]
fn a_sign_of_life_that_stays_away_is_an_emergency_stop() {
    let mut flight = Flight::new(Stage::Flying);
    flight.script(ScriptCommand::Fly).unwrap();
    assert_eq!(flight.wait(10_000).source, CommandSource::Script, "none was sent");
    for _ in 0..5 {
        assert_eq!(flight.station(StationCommand::KeepAlive), Ok(Passage::Ignore));
        assert_eq!(flight.wait(KEEP_ALIVE_MS).source, CommandSource::Script);
    }
    assert_eq!(flight.wait(1).source, CommandSource::EmergencyStop);
    flight.station(StationCommand::KeepAlive).unwrap();
    assert_eq!(flight.source(), CommandSource::EmergencyStop, "until power-on");
}

#[test]
fn thrust_counts_after_a_set_point_without_thrust() {
    let (zero, some) =
        (StationCommand::Thrust { is_zero: true }, StationCommand::Thrust { is_zero: false });
    let mut flight = Flight::new(Stage::Armed);
    assert_eq!(flight.station(some), Err(CommandBlock::ThrustLocked));
    assert_eq!(flight.source(), CommandSource::Script, "a blocked command takes nothing");
    assert_eq!(flight.station(zero), Ok(Passage::Ignore));
    assert_eq!(flight.station(some), EXECUTED);
    flight.enter(Stage::Flying);
    assert_eq!(flight.station(zero), EXECUTED, "the robot flies by thrust");
    flight.enter(Stage::Landed);
    flight.enter(Stage::Armed);
    assert_eq!(flight.station(some), Err(CommandBlock::ThrustLocked), "locked for each flight");
}

/// A robot on the ground is not landed, and the supervisor has the end of a flight to itself.
#[test]
fn the_supervisor_ends_flights() {
    for stage in [Stage::Landing, Stage::Landed, Stage::Tumbled, Stage::Crashed, Stage::Locked] {
        let mut flight = Flight::new(Stage::Flying);
        flight.station(StationCommand::Setpoint).unwrap();
        flight.enter(stage);
        // A robot that lands may have lost its set-points only.
        if stage != Stage::Landing {
            assert_eq!(flight.station(StationCommand::Setpoint), BLOCKED_BY_SUPERVISOR);
            assert_eq!(flight.station(StationCommand::Plan), BLOCKED_BY_SUPERVISOR, "{stage:?}");
        }
        for command in [StationCommand::Land, StationCommand::SetpointsEnd] {
            assert_eq!(flight.station(command), BLOCKED_BY_SUPERVISOR, "{stage:?}");
        }
        assert_eq!(flight.script(ScriptCommand::Fly), BLOCKED_BY_SUPERVISOR);
        assert_eq!(flight.script(ScriptCommand::Land), BLOCKED_BY_SUPERVISOR);
    }
}
