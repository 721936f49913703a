//! Unmodified cflib 0.1.34 as the ground station of a robot that is nothing but these ports, through
//! UDP on this computer. cflib packs, the ports unpack. `cargo xtask ci` installs cflib and names its
//! Python in `BITTYBUZZ_CFLIB`; without it the tests are skipped.

use std::io::{BufRead, BufReader, Write};
use std::net::{Ipv4Addr, UdpSocket};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command as Program, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use bittybuzz_crtp::{
    Access, Command, HighLevelCommand, HighLevelOutcome, Identity, LogVariable, Parameter, Ports,
    Refusal, Setpoint, SupervisorInfo, Value, WireType, console,
};
use bittybuzz_random::Random;
use serde_json::{Value as Json, json};

use crate::oracle::{Meaning, assert_equal, expected, meaning};

/// Time after which a packet that should have come does not come.
const PATIENCE: Duration = Duration::from_secs(60);

/// The text that the robot prints when it is to notify a person. Its packets end within the letters
/// of three bytes.
const TEXT: &str = "The robot says €€€€€€€€€€€€€€€€€€€€ and more.\n";

/// Returns the value of a variable of the robot.
fn value_of(variable: LogVariable) -> Value {
    let id = variable as u8;
    match variable.wire() {
        WireType::F32 => Value::Float(f32::from(id) - 20.25),
        WireType::I8 => Value::Signed(-3),
        _ => Value::Unsigned(u32::from(id)),
    }
}

fn is_null(packet: &[u8]) -> bool {
    packet.first().is_some_and(|header| header & 0xf3 == 0xf3)
}

/// A robot at a UDP port of this computer, in a thread.
struct Robot {
    port: u16,
    commands: Receiver<Command>,
    ports: Arc<Mutex<Ports>>,
    info: Arc<Mutex<SupervisorInfo>>,
    has_ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Robot {
    fn new() -> Self {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(2))).unwrap();
        let port = socket.local_addr().unwrap().port();
        let identity = Identity { id: 0xe7, firmware: "BittyBuzz", device: "CF21" };
        let ports = Arc::new(Mutex::new(Ports::new(identity)));
        let info = Arc::new(Mutex::new(SupervisorInfo::default()));
        let has_ended = Arc::new(AtomicBool::new(false));
        let (sender, commands) = mpsc::channel();
        let thread = {
            let (ports, info, has_ended) = (ports.clone(), info.clone(), has_ended.clone());
            thread::spawn(move || {
                let start = Instant::now();
                let mut station = None;
                while !has_ended.load(Ordering::Relaxed) {
                    // The locks are free while the thread waits for a packet.
                    let mut room = [0; 64];
                    let received = socket.recv_from(&mut room).ok();
                    let packet = received.map(|(length, from)| (&room[..length], from));
                    let now_ms = start.elapsed().as_millis() as u64;
                    let (mut ports, info) = (ports.lock().unwrap(), *info.lock().unwrap());
                    if let Some((packet, from)) = packet {
                        station = Some(from);
                        answer(packet, &mut ports, &info, now_ms, &sender)
                            .iter()
                            // A station that is gone refuses packets.
                            .for_each(|answer| drop(socket.send_to(answer, from)));
                    }
                    while let Some(station) = station
                        && let Some(packet) = ports.poll_log(now_ms, value_of)
                    {
                        drop(socket.send_to(packet.bytes(), station));
                    }
                }
            })
        };
        Robot { port, commands, ports, info, has_ended, thread: Some(thread) }
    }

    fn next(&self) -> Command {
        self.commands.recv_timeout(PATIENCE).expect("a command")
    }

    fn ports(&self) -> std::sync::MutexGuard<'_, Ports> {
        self.ports.lock().unwrap()
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        self.has_ended.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has failed the test already.
            let _ = thread.join();
        }
    }
}

/// Handles a packet, and returns the answers.
fn answer(
    packet: &[u8],
    ports: &mut Ports,
    info: &SupervisorInfo,
    now_ms: u64,
    commands: &Sender<Command>,
) -> Vec<Vec<u8>> {
    if is_null(packet) {
        return vec![vec![0xff]];
    }
    let reaction = ports.receive(packet, now_ms, info);
    let outcome = match &reaction.command {
        Some(Command::HighLevel(_, answer)) => Some(answer.packet(HighLevelOutcome::Done)),
        Some(Command::Arming(_, answer)) => Some(answer.packet(true, info)),
        _ => None,
    };
    let text = match reaction.command {
        Some(Command::Notification { .. }) => TEXT,
        _ => "",
    };
    if let Some(command) = reaction.command {
        // A test that has ended takes no commands.
        let _ = commands.send(command);
    }
    let answers = reaction.answer.into_iter().chain(outcome).chain(console(text));
    answers.map(|answer| answer.bytes().to_vec()).collect()
}

/// cflib in a process of its own.
struct Station {
    process: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
}

impl Station {
    /// Connects cflib to a robot, or returns `None` without cflib.
    fn connect(robot: &Robot) -> Option<Self> {
        let Some(python) = std::env::var_os("BITTYBUZZ_CFLIB") else {
            eprintln!(
                "skipped: BITTYBUZZ_CFLIB names no Python with tests/hil/cflib/requirements.txt"
            );
            return None;
        };
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cflib/client.py");
        let mut process = Program::new(python)
            .args(["-W", "ignore"])
            .arg(script)
            .arg(robot.port.to_string())
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (input, output) = (process.stdin.take(), process.stdout.take().unwrap());
        let mut station = Station { process, input, output: BufReader::new(output) };
        assert_eq!(station.line(), "connected\n");
        Some(station)
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        line
    }

    /// Gives an instruction, a name and its arguments, and returns the answer.
    fn ask(&mut self, instruction: &Json) -> Json {
        writeln!(self.input.as_mut().unwrap(), "{instruction}").unwrap();
        serde_json::from_str(&self.line()).expect("cflib answers")
    }
}

impl Drop for Station {
    fn drop(&mut self) {
        // The process ends with its input, and after a failed test at once.
        drop(self.input.take());
        if thread::panicking() {
            let _ = self.process.kill();
        }
        let _ = self.process.wait();
    }
}

/// Returns the C name of a type, as cflib shows it.
fn c_name(wire: WireType) -> &'static str {
    match wire {
        WireType::U8 => "uint8_t",
        WireType::U16 => "uint16_t",
        WireType::U32 => "uint32_t",
        WireType::I8 => "int8_t",
        WireType::I16 => "int16_t",
        WireType::I32 => "int32_t",
        WireType::F32 => "float",
        WireType::F16 => "FP16",
    }
}

#[test]
fn cflib_reads_both_tables() {
    let robot = Robot::new();
    let Some(mut station) = Station::connect(&robot) else { return };
    let tables = station.ask(&json!(["tables"]));
    let logs = LogVariable::ALL
        .iter()
        .map(|v| (format!("{}.{}", v.group(), v.name()), json!(c_name(v.wire()))));
    assert_eq!(tables[0], Json::Object(logs.collect()));
    let parameters = Parameter::ALL.iter().map(|p| {
        let access = if p.access() == Access::ReadOnly { "RO" } else { "RW" };
        (format!("{}.{}", p.group(), p.name()), json!([c_name(p.wire()), access]))
    });
    assert_eq!(tables[1], Json::Object(parameters.collect()));
    assert_eq!(robot.ports().refusals().total(), 0);
}

#[test]
fn cflib_reads_and_writes_parameters() {
    let robot = Robot::new();
    let revision = Value::Unsigned(0xdead_beef);
    robot.ports().parameters_mut().set(Parameter::FirmwareRevision0, revision);
    let Some(mut station) = Station::connect(&robot) else { return };
    let mut read = |name: &str| station.ask(&json!(["read", name]));
    assert_eq!(read("firmware.revision0"), 0xdead_beef_u32.to_string());
    assert_eq!(read("stabilizer.estimator"), "2");
    assert_eq!(read("hlCommander.vtoff"), "0.5");
    let mut write = |name: &str, value: &str| station.ask(&json!(["write", name, value]));
    assert_eq!(write("hlCommander.vtoff", "0.25"), "0.25");
    // cflib shows what is in force, not what it wrote: its examples choose Mellinger's controller.
    assert_eq!(write("stabilizer.controller", "2"), "5");
    assert_eq!(write("commander.enHighLevel", "1"), "1");
    assert_eq!(write("kalman.resetEstimation", "1"), "1");
    assert_eq!(write("hlCommander.vland", "nan"), "0.5");
    robot.info.lock().unwrap().is_flying = true;
    assert_eq!(write("kalman.resetEstimation", "0"), "1");
    assert_eq!(write("posCtlPid.xVelMax", "0.5"), "0.5");
    assert_eq!(write("posCtlPid.xVelMax", "0.75"), "0.5");
    assert_eq!(write("fence.leastX", "-2.0"), "-2.0");
    assert_eq!(write("fence.leastX", "-3.0"), "-2.0");
    assert_eq!(station.ask(&json!(["default", "posCtlPid.xVelMax"])), json!(1.0));
    let changes: Vec<(Parameter, f32)> = robot
        .commands
        .try_iter()
        .map(|command| match command {
            Command::Parameter(change) => (change.parameter, change.value.as_f32()),
            command => panic!("{command:?}"),
        })
        .collect();
    let expected = [
        (Parameter::HlCommanderVtoff, 0.25),
        (Parameter::CommanderEnHighLevel, 1.0),
        (Parameter::KalmanResetEstimation, 1.0),
        (Parameter::PosCtlXVelMax, 0.5),
        (Parameter::FenceLeastX, -2.0),
    ];
    assert_eq!(changes, expected);
    let ports = robot.ports();
    for (reason, count) in [
        (Refusal::OutOfRange, 1),
        (Refusal::NotFinite, 1),
        (Refusal::InFlight, 1),
        (Refusal::Loosened, 2),
    ] {
        assert_eq!(ports.refusals().of(reason), count, "{reason:?}");
    }
    assert_eq!(ports.refusals().total(), 5);
}

#[test]
fn cflib_logs() {
    let robot = Robot::new();
    let Some(mut station) = Station::connect(&robot) else { return };
    let find = |name: &str| {
        let same = |v: &&LogVariable| format!("{}.{}", v.group(), v.name()) == name;
        *LogVariable::ALL.iter().find(same).unwrap()
    };
    // 26 bytes, so that cflib needs two packets, the first with half a variable at its end.
    let variables = [
        ("stateEstimate.x", "float"),
        ("stabilizer.yaw", "float"),
        ("kalman.varPX", "FP16"),
        ("pm.vbat", "FP16"),
        ("pm.state", "int8_t"),
        ("supervisor.info", "uint16_t"),
        ("range.front", "uint32_t"),
        ("motor.m1", "uint8_t"),
        ("gyro.z", "int16_t"),
        ("acc.z", "int32_t"),
    ];
    let rows = station.ask(&json!(["log", variables, 50, 8]));
    let rows = rows.as_array().unwrap();
    let expected: Vec<f64> = variables
        .iter()
        .map(|(name, ctype)| {
            let value = f64::from(value_of(find(name)).as_f32());
            if ctype.ends_with("_t") { value.trunc() } else { value }
        })
        .collect();
    for row in rows {
        let values: Vec<f64> =
            row[1].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
        assert_eq!(values, expected);
    }
    // Packets that the computer delays are left out, so a step is a whole number of periods, or
    // comes late.
    let times: Vec<u64> = rows.iter().map(|row| row[0].as_u64().unwrap()).collect();
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
    assert!(steps.clone().all(|step| step > 0), "{times:?}");
    // The estimator's reset of cflib waits until the variances in a log rest.
    station.ask(&json!(["reset_estimator"]));
    assert_eq!(robot.ports().refusals().total(), 0);
}

/// Returns a number in a range, with all digits of a 64-bit number.
fn number(random: &mut Random, most: f64) -> f64 {
    let share = random.bits() as f64 / u64::MAX as f64;
    most * (2.0 * share - 1.0)
}

/// Returns a call with arguments at random.
fn any_call(random: &mut Random) -> (&'static str, Json) {
    let r = random;
    let flag = |r: &mut Random| r.bits() & 1 == 1;
    let (speed, angle, rate, place) = (3.0, 180.0, 720.0, 30.0);
    match r.below(17) {
        0 => {
            let thrust = r.below(65_536);
            let path = "commander.send_setpoint";
            (path, json!([number(r, angle), number(r, angle), number(r, rate), thrust]))
        }
        1 => {
            let percent = f64::from(r.below(101));
            let path = "commander.send_setpoint_manual";
            let numbers = [number(r, angle), number(r, angle), number(r, rate)];
            (path, json!([numbers[0], numbers[1], numbers[2], percent, flag(r)]))
        }
        2 => ("commander.send_velocity_world_setpoint", {
            json!([number(r, speed), number(r, speed), number(r, speed), number(r, rate)])
        }),
        3 => ("commander.send_zdistance_setpoint", {
            json!([number(r, angle), number(r, angle), number(r, rate), number(r, place)])
        }),
        4 => ("commander.send_hover_setpoint", {
            json!([number(r, speed), number(r, speed), number(r, rate), number(r, place)])
        }),
        5 => {
            let mut three = |most| [number(r, most), number(r, most), number(r, most)];
            let vectors = [three(place), three(speed), three(20.0)];
            let rates = three(30.0);
            let quaternion = [number(r, 1.0), number(r, 1.0), number(r, 1.0), number(r, 1.0)];
            let [a, b, c] = vectors;
            let path = "commander.send_full_state_setpoint";
            (path, json!([a, b, c, quaternion, rates[0], rates[1], rates[2]]))
        }
        6 => ("commander.send_position_setpoint", {
            json!([number(r, place), number(r, place), number(r, place), number(r, angle)])
        }),
        7 | 8 => {
            let yaw = if flag(r) { json!(number(r, 3.0)) } else { Json::Null };
            let is_up = flag(r);
            let path =
                if is_up { "high_level_commander.takeoff" } else { "high_level_commander.land" };
            (path, json!([number(r, place), number(r, 30.0).abs(), 0, yaw]))
        }
        9 => {
            let numbers = [place, place, place, 6.0].map(|most| number(r, most));
            let [x, y, z, yaw] = numbers;
            let (duration, relative, linear) = (number(r, 30.0).abs(), flag(r), flag(r));
            ("high_level_commander.go_to", json!([x, y, z, yaw, duration, relative, linear, 0]))
        }
        10 => {
            let [angle, climb] = [6.0, 2.0].map(|most| number(r, most));
            let [first, last, duration] = [2.0, 2.0, 30.0].map(|most| number(r, most).abs());
            let arguments = json!([angle, first, last, climb, duration, flag(r), flag(r), 0]);
            ("high_level_commander.spiral", arguments)
        }
        11 => ("loc.send_extpos", json!([[number(r, place), number(r, place), number(r, place)]])),
        12 => {
            let position = [number(r, place), number(r, place), number(r, place)];
            let parts = [number(r, 1.0), number(r, 1.0), number(r, 1.0), number(r, 1.0) + 1.1];
            let length = parts.iter().map(|part| part * part).sum::<f64>().sqrt();
            ("loc.send_extpose", json!([position, parts.map(|part| part / length)]))
        }
        13 => ("platform.send_arming_request", json!([flag(r)])),
        14 => ("platform.send_user_notification", json!([flag(r)])),
        15 => ("supervisor.send_emergency_stop_watchdog", json!([])),
        _ => {
            let paths = [
                "commander.send_stop_setpoint",
                "commander.send_notify_setpoint_stop",
                "high_level_commander.stop",
                "platform.send_crash_recovery_request",
                "loc.send_emergency_stop",
                "loc.send_emergency_stop_watchdog",
                "supervisor.send_emergency_stop",
                "supervisor.send_crash_recovery_request",
            ];
            (paths[r.below(8) as usize], json!([]))
        }
    }
}

#[test]
fn commands_of_cflib_arrive_with_their_arguments() {
    let robot = Robot::new();
    let Some(mut station) = Station::connect(&robot) else { return };
    let mut random = Random::new(47);
    for _ in 0..500 {
        let (path, arguments) = any_call(&mut random);
        let mut instruction = vec![json!("call"), json!(path)];
        instruction.extend(arguments.as_array().unwrap().iter().cloned());
        let instruction = Json::Array(instruction);
        assert_eq!(station.ask(&instruction), Json::Null);
        let actual = meaning(Some(robot.next()));
        assert_equal(actual, expected(path, &arguments), &instruction.to_string());
    }
    assert_eq!(robot.ports().refusals().total(), 0);
}

#[test]
fn cflib_flies_stored_trajectories() {
    let robot = Robot::new();
    let Some(mut station) = Station::connect(&robot) else { return };
    let mut random = Random::new(48);
    let axis =
        |random: &mut Random| -> Vec<f32> { (0..8).map(|_| number(random, 2.0) as f32).collect() };
    let pieces: Vec<(f32, [Vec<f32>; 4])> = (1..=10)
        .map(|seconds| (seconds as f32 / 4.0, [(); 4].map(|()| axis(&mut random))))
        .collect();
    let rows: Vec<Json> =
        pieces.iter().map(|(duration, [x, y, z, yaw])| json!([duration, x, y, z, yaw])).collect();
    assert_eq!(station.ask(&json!(["upload", rows])), json!(true));
    let call = |path: &str, more: Json| {
        let mut call = vec![json!("call"), json!(format!("high_level_commander.{path}"))];
        call.extend(more.as_array().unwrap().iter().cloned());
        Json::Array(call)
    };
    station.ask(&call("define_trajectory", json!([4, 0, 10])));
    station.ask(&call("start_trajectory", json!([4, 1.5, true, false, true])));
    let HighLevelCommand::StartTrajectory {
        trajectory,
        time_scale,
        is_position_relative,
        is_yaw_relative,
        is_reversed,
    } = (match robot.next() {
        Command::HighLevel(command, _) => command,
        command => panic!("{command:?}"),
    })
    else {
        panic!("another plan")
    };
    let flags = [is_position_relative, is_yaw_relative, is_reversed];
    assert_eq!((time_scale, flags), (1.5, [true, false, true]));
    assert_eq!(trajectory.len(), 10);
    let ports = robot.ports();
    for (number, (duration_s, axes)) in pieces.iter().enumerate() {
        let piece = ports.trajectory_piece(&trajectory, number).unwrap();
        assert_eq!(piece.duration_s, *duration_s);
        for degree in 0..8 {
            for (axis, coefficients) in axes.iter().take(3).enumerate() {
                assert_eq!(piece.position[degree][axis], coefficients[degree]);
            }
            assert_eq!(piece.yaw[degree], axes[3][degree]);
        }
    }
    assert_eq!(ports.trajectory_piece(&trajectory, 10), Err(Refusal::NoTrajectory));
    assert_eq!(ports.refusals().total(), 0);
}

#[test]
fn cflib_prints_the_console() {
    let robot = Robot::new();
    let Some(mut station) = Station::connect(&robot) else { return };
    assert_eq!(station.ask(&json!(["console"])), json!(TEXT));
}

#[test]
fn cflib_sees_the_supervisor() {
    let robot = Robot::new();
    let Some(mut station) = Station::connect(&robot) else { return };
    *robot.info.lock().unwrap() = SupervisorInfo {
        can_be_armed: true,
        is_flying: true,
        is_locked: true,
        is_plan_finished: true,
        ..SupervisorInfo::default()
    };
    let states = station.ask(&json!(["states"]));
    assert_eq!(states, json!(["Can be armed", "Is flying", "Is locked", "Finished HL trajectory"]));
}

/// The unmodified MotionCommander takes off, flies ahead and lands by set-points.
#[test]
fn the_motion_commander_flies_by_hover_setpoints() {
    let robot = Robot::new();
    let Some(mut station) = Station::connect(&robot) else { return };
    station.ask(&json!(["motion"]));
    // The station has returned when its last packets are sent, which may be before the robot reads them.
    let mut meanings = Vec::new();
    while meanings.last() != Some(&Meaning::SetpointsEnd) {
        match robot.next() {
            // It also resets the estimator by its parameter.
            Command::Parameter(_) => {}
            command => meanings.push(meaning(Some(command))),
        }
    }
    let hovers: Vec<[f32; 4]> = meanings
        .iter()
        .filter_map(|meaning| match meaning {
            Meaning::Setpoint(Setpoint::Hover {
                ahead_m_s,
                left_m_s,
                yaw_rate_rad_s,
                height_m,
            }) => Some([*ahead_m_s, *left_m_s, *yaw_rate_rad_s, *height_m]),
            _ => None,
        })
        .collect();
    let highest = hovers.iter().map(|hover| hover[3]).fold(0.0, f32::max);
    assert!((0.25..0.4).contains(&highest), "{highest}");
    assert!(hovers.iter().any(|hover| hover[0] == 0.2), "0.2 m/s is its speed");
    assert!(hovers.iter().all(|hover| hover[1] == 0.0 && hover[2] == 0.0));
    let end = &meanings[meanings.len() - 2..];
    assert_eq!(end, [Meaning::Setpoint(Setpoint::Stop), Meaning::SetpointsEnd]);
}
