//! Log blocks, parameters and the memory, byte by byte.

use bittybuzz_crtp::{
    Access, Command, HighLevelCommand, LogVariable, Parameter, Ports, Refusal, SupervisorInfo,
    TRAJECTORY_BYTES, Value,
};

use crate::commands::ports;

const ON_GROUND: SupervisorInfo = SupervisorInfo {
    can_be_armed: true,
    is_armed: false,
    is_auto_armed: false,
    can_fly: false,
    is_flying: false,
    is_tumbled: false,
    is_locked: false,
    is_crashed: false,
    is_plan_active: false,
    is_plan_finished: false,
    is_plan_disabled: false,
    has_deck_fault: false,
};
const IN_FLIGHT: SupervisorInfo = SupervisorInfo { is_flying: true, is_armed: true, ..ON_GROUND };

/// Sends a packet at a time in ms, and returns the answer.
fn ask_at(ports: &mut Ports, now_ms: u64, packet: &[u8]) -> Vec<u8> {
    let answer = ports.receive(packet, now_ms, &ON_GROUND).answer;
    answer.map_or(Vec::new(), |answer| answer.bytes().to_vec())
}

fn ask(ports: &mut Ports, packet: &[u8]) -> Vec<u8> {
    ask_at(ports, 0, packet)
}

fn value(variable: LogVariable) -> Value {
    Value::Unsigned(variable as u32)
}

/// Returns the packets of logs that are sent from one time to another in ms, with their times.
fn logged(ports: &mut Ports, from_ms: u64, to_ms: u64) -> Vec<(u64, Vec<u8>)> {
    let mut packets = Vec::new();
    for now_ms in from_ms..to_ms {
        while let Some(packet) = ports.poll_log(now_ms, value) {
            packets.push((now_ms, packet.bytes().to_vec()));
        }
    }
    packets
}

const BATTERY: u8 = LogVariable::PmVbatMv as u8;

#[test]
fn a_block_is_sent_in_its_period() {
    let mut ports = ports();
    assert_eq!(ask(&mut ports, &[0x5d, 6, 7, 0x22, BATTERY, 0, 0x11, BATTERY, 0]), [0x51, 6, 7, 0]);
    assert_eq!(ask_at(&mut ports, 1000, &[0x5d, 3, 7, 5]), [0x51, 3, 7, 0]);
    let packet = |time: [u8; 3]| {
        let [a, b, c] = time;
        vec![0x52, 7, a, b, c, BATTERY, 0, BATTERY]
    };
    let times = [(1050, [0x1a, 4, 0]), (1100, [0x4c, 4, 0]), (1150, [0x7e, 4, 0])];
    let expected = times.map(|(now_ms, time)| (now_ms, packet(time)));
    assert_eq!(logged(&mut ports, 1000, 1200), expected);
    // A stopped block is silent, and a period of 0 sends it once.
    assert_eq!(ask_at(&mut ports, 1200, &[0x5d, 4, 7]), [0x51, 4, 7, 0]);
    assert_eq!(logged(&mut ports, 1200, 1400), []);
    assert_eq!(ask_at(&mut ports, 1400, &[0x5d, 8, 7, 0, 0]), [0x51, 8, 7, 0]);
    assert_eq!(logged(&mut ports, 1400, 1600), [(1400, packet([0x78, 5, 0]))]);
    assert_eq!(ask_at(&mut ports, 1600, &[0x5d, 2, 7]), [0x51, 2, 7, 0]);
    assert_eq!(ask_at(&mut ports, 1600, &[0x5d, 8, 7, 10, 0]), [0x51, 8, 7, 2], "it is deleted");
    assert_eq!(ports.refusals().of(Refusal::LogBlock), 1);
}

#[test]
fn late_packets_are_left_out() {
    let mut ports = ports();
    ask(&mut ports, &[0x5d, 6, 1, 0x11, BATTERY, 0]);
    ask_at(&mut ports, 0, &[0x5d, 8, 1, 10, 0]);
    assert!(ports.poll_log(35, value).is_some());
    assert!(ports.poll_log(35, value).is_none(), "two periods passed without a poll");
    assert_eq!(logged(&mut ports, 36, 60).iter().map(|(at, _)| *at).collect::<Vec<_>>(), [45, 55]);
}

/// No block waits forever, whatever the periods of the others are.
#[test]
fn blocks_take_turns() {
    let mut ports = ports();
    for id in 0..3 {
        ask(&mut ports, &[0x5d, 6, id, 0x11, BATTERY, 0]);
        ask(&mut ports, &[0x5d, 8, id, 1, 0]);
    }
    // The link takes one packet in a millisecond, and three are due.
    let sent: Vec<u8> =
        (1..31).map(|now_ms| ports.poll_log(now_ms, value).unwrap().bytes()[1]).collect();
    for id in 0..3 {
        assert_eq!(sent.iter().filter(|sent| **sent == id).count(), 10, "{sent:?}");
    }
}

#[test]
fn without_a_station_blocks_end() {
    let mut ports = ports();
    ask_at(&mut ports, 0, &[0x5d, 6, 1, 0x11, BATTERY, 0]);
    ask_at(&mut ports, 0, &[0x5d, 8, 1, 100, 0]);
    let times: Vec<u64> = logged(&mut ports, 0, 3000).iter().map(|(at, _)| *at).collect();
    assert_eq!(times, [100, 200, 300, 400, 500, 600, 700, 800, 900, 1000]);
    assert_eq!(ask_at(&mut ports, 3000, &[0x5d, 8, 1, 10, 0]), [0x51, 8, 1, 2]);
}

/// Errors as cflib translates them (cflib/crazyflie/log.py, `_err_codes`).
#[test]
fn errors_of_log_blocks() {
    let mut ports = ports();
    let mut create = |id: u8, variables: &[[u8; 3]]| {
        ask(&mut ports, &[&[0x5d, 6, id][..], &variables.concat()].concat())[3]
    };
    let x = [0x77, LogVariable::StateEstimateX as u8, 0];
    assert_eq!(create(1, &[x; 6]), 0);
    assert_eq!(create(1, &[x]), 17, "it exists");
    assert_eq!(create(2, &[x; 7]), 7, "28 bytes are too big");
    assert_eq!(create(3, &[[0x77, 0xf0, 0xf0]]), 2, "no such variable");
    assert_eq!(create(4, &[[0x79, 0, 0]]), 2, "no such type");
    assert_eq!(create(5, &[[0x11, 0xff, 0xff]]), 2, "an address in memory");
    for id in 6..17 {
        assert_eq!(create(id, &[]), 0);
    }
    assert_eq!(create(17, &[]), 12, "there are 16 blocks");
    assert_eq!(ask(&mut ports, &[0x5d, 7, 99, 0x77, 0, 0])[3], 2, "no such block");
    assert_eq!(ask(&mut ports, &[0x5d, 7, 1, 0x22, BATTERY, 0])[3], 0, "26 bytes fit");
    assert_eq!(ask(&mut ports, &[0x5d, 7, 1, 0x11, BATTERY, 0])[3], 7, "27 do not");
    assert_eq!(ask(&mut ports, &[0x5d, 3, 1])[3], 8, "no period");
    assert_eq!(ask(&mut ports, &[0x5d, 9, 1])[3], 8, "no such command");
    assert_eq!(ask(&mut ports, &[0x5d, 5]), [0x51, 5, 0, 0]);
    assert_eq!(ask(&mut ports, &[0x5d, 6, 17]), [0x51, 6, 17, 0], "all blocks are deleted");
}

#[test]
fn all_blocks_have_128_variables_at_most() {
    let mut ports = ports();
    let byte = [0x11, BATTERY, 0];
    let mut create = |id: u8, count: usize| {
        ask(&mut ports, &[&[0x5d, 6, id][..], &vec![byte; count].concat()].concat())[3]
    };
    assert!((0..14).all(|id| create(id, 9) == 0));
    assert_eq!(create(14, 2), 0);
    assert_eq!(create(15, 1), 12);
}

#[test]
fn the_tables_have_entries_by_id() {
    let mut ports = ports();
    let [a, b] = (LogVariable::ALL.len() as u16).to_le_bytes();
    let info = ask(&mut ports, &[0x5c, 3]);
    assert_eq!((&info[..4], &info[8..]), (&[0x50, 3, a, b][..], &[16, 128][..]));
    assert_eq!(ask(&mut ports, &[0x5c, 2, 0, 0]), b"\x50\x02\x00\x00\x07stateEstimate\x00x\x00");
    assert_eq!(ask(&mut ports, &[0x5c, 2, a, b]), [0x50, 2], "beyond the end");
    let [a, b] = (Parameter::COUNT as u16).to_le_bytes();
    let info = ask(&mut ports, &[0x2c, 3]);
    assert_eq!((&info[..4], info.len()), (&[0x20, 3, a, b][..], 8));
    let deck = Parameter::DeckBcFlow2 as u8;
    let entry = ask(&mut ports, &[0x2c, 2, deck, 0]);
    assert_eq!(entry, [&[0x20, 2, deck, 0, 0x48][..], b"deck\0bcFlow2\0"].concat());
    assert_eq!(ask(&mut ports, &[0x2c, 2, 0xff, 0xff]), [0x20, 2]);
}

/// Two tables that a client keeps by their checksums must differ in these.
#[test]
fn names_are_unique() {
    let mut logs: Vec<_> = LogVariable::ALL.iter().map(|v| (v.group(), v.name())).collect();
    let mut parameters: Vec<_> = Parameter::ALL.iter().map(|p| (p.group(), p.name())).collect();
    for names in [&mut logs, &mut parameters] {
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
    let mut ports = ports();
    assert_ne!(ask(&mut ports, &[0x5c, 3])[4..8], ask(&mut ports, &[0x2c, 3])[4..8]);
}

fn write(ports: &mut Ports, parameter: Parameter, value: f32, info: &SupervisorInfo) -> bool {
    let bytes = parameter.wire().encode(value.into());
    let packet = [&[0x2e, parameter as u8, 0], &bytes[..parameter.wire().bytes()]].concat();
    let reaction = ports.receive(&packet, 0, info);
    // The answer has the value in force.
    let in_force = parameter.wire().encode(ports.parameters().get(parameter));
    let answer = reaction.answer.unwrap();
    let start = [0x22, parameter as u8, 0];
    assert_eq!(answer.bytes(), [&start, &in_force[..parameter.wire().bytes()]].concat());
    matches!(reaction.command, Some(Command::Parameter(_) | Command::EmergencyStop))
}

#[test]
fn values_stay_in_their_ranges() {
    for &parameter in Parameter::ALL {
        let mut ports = ports();
        let (least, most) = parameter.range();
        let is_ours = parameter.access() == Access::ReadOnly;
        assert_eq!(ports.parameters().get(parameter).as_f32(), parameter.first());
        for value in [least, most] {
            assert_eq!(write(&mut ports, parameter, value, &ON_GROUND), !is_ours, "{parameter:?}");
        }
        let before = ports.parameters().get(parameter);
        let mut wrong = vec![most + 1.0, f32::NAN, f32::INFINITY];
        if least > 0.0 {
            wrong.push(least / 2.0);
        }
        for value in wrong {
            // A byte holds neither NaN nor 256; `encode` makes others of them.
            if parameter.wire().bytes() == 4 || value == most + 1.0 && most < 255.0 {
                assert!(!write(&mut ports, parameter, value, &ON_GROUND), "{parameter:?} {value}");
            }
        }
        assert_eq!(ports.parameters().get(parameter), before);
    }
}

#[test]
fn limits_are_only_tightened_in_flight() {
    for &parameter in Parameter::ALL {
        let (least, most) = parameter.range();
        let (middle, step) = ((least + most) / 2.0, (most - least) / 10.0);
        let mut ports = ports();
        ports.parameters_mut().set(parameter, middle.into());
        let mut fly = |value| write(&mut ports, parameter, value, &IN_FLIGHT);
        match parameter.access() {
            Access::UpperLimit => {
                assert!(!fly(middle + step) && fly(middle) && fly(middle - step));
                assert!(!fly(middle), "it was tightened");
            }
            Access::LowerLimit => {
                assert!(!fly(middle - step) && fly(middle) && fly(middle + step));
                assert!(!fly(middle), "it was tightened");
            }
            Access::OnGround => {
                assert!(!fly(middle));
                assert!(write(&mut ports, parameter, middle, &ON_GROUND));
            }
            Access::Always => assert!(fly(middle)),
            Access::ReadOnly => assert!(!fly(middle)),
        }
    }
}

#[test]
fn parameters_by_name() {
    let mut ports = ports();
    let packet = |group: &str, name: &str, code: u8, value: &[u8]| {
        [&[0x2f, 0], group.as_bytes(), &[0], name.as_bytes(), &[0, code], value].concat()
    };
    let speed = 0.25_f32.to_le_bytes();
    let mut set = |packet: Vec<u8>| {
        let reaction = ports.receive(&packet, 0, &IN_FLIGHT);
        let error = reaction.answer.unwrap().bytes().last().copied().unwrap();
        (error, reaction.command.is_some())
    };
    assert_eq!(set(packet("hlCommander", "vtoff", 6, &speed)), (0, true));
    assert_eq!(set(packet("hlCommander", "vtof", 6, &speed)), (2, false));
    assert_eq!(set(packet("hlCommander", "vtoff", 8, &[1])), (22, false));
    assert_eq!(set(packet("hlCommander", "vtoff", 2, &speed)), (22, false), "as long as a float");
    assert_eq!(set(packet("hlCommander", "vtoff", 6, &speed[1..])), (22, false));
    assert_eq!(set(packet("deck", "bcFlow2", 8, &[1])), (13, false));
    assert_eq!(set(packet("kalman", "resetEstimation", 8, &[1])), (13, false));
    assert_eq!(ports.parameters().get(Parameter::HlCommanderVtoff), Value::Float(0.25));
    let answer = ask(&mut ports, &packet("deck", "no", 8, &[1]));
    assert_eq!(answer, b"\x23\x00deck\x00no\x00\x02");
    // Without a second zero there is no name.
    assert!(ask(&mut ports, b"\x2f\x00deck\x00no").is_empty());
}

#[test]
fn default_values_and_what_no_parameter_has() {
    let mut ports = ports();
    let id = Parameter::HlCommanderVtoff as u8;
    let half = 0.5_f32.to_le_bytes();
    assert_eq!(ask(&mut ports, &[0x2f, 8, id, 0]), [&[0x23, 8, id, 0, 0][..], &half].concat());
    assert_eq!(ask(&mut ports, &[0x2f, 6, id, 0]), [&[0x23, 6, id, 0][..], &half].concat());
    let deck = Parameter::DeckBcFlow2 as u8;
    assert_eq!(ask(&mut ports, &[0x2f, 8, deck, 0]), [0x23, 8, deck, 0, 2]);
    assert_eq!(ask(&mut ports, &[0x2f, 8, 0xff, 0xff]), [0x23, 8, 0xff, 0xff, 2]);
    for command in [2, 3, 4, 5, 7] {
        assert_eq!(ask(&mut ports, &[0x2f, command, id, 0]), [0x23, command, id, 0, 2]);
        assert!(ask(&mut ports, &[0x2f, command, id]).is_empty());
    }
    assert_eq!(ask(&mut ports, &[0x2d, 0xff, 0xff]), [0x21, 0xff, 0xff, 2], "no such parameter");
    assert_eq!(ask(&mut ports, &[0x2e, 0xff, 0xff, 1]), [0x22, 0xff, 0xff, 2]);
}

#[test]
fn the_memory_can_be_written_and_read() {
    let mut ports = ports();
    assert_eq!(ask(&mut ports, &[0x4c, 1]), [0x40, 1, 1]);
    let [a, b, c, d] = (TRAJECTORY_BYTES as u32).to_le_bytes();
    let info = ask(&mut ports, &[0x4c, 2, 0]);
    assert_eq!(info, [0x40, 2, 0, 0x12, a, b, c, d, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(ask(&mut ports, &[0x4c, 2, 1]), [0x40, 2, 1], "there is no other");
    let address = (TRAJECTORY_BYTES as u32 - 3).to_le_bytes();
    let packet =
        |header: u8, memory: u8, rest: &[u8]| [&[header, memory][..], &address, rest].concat();
    let answer = |header: u8, memory: u8, rest: &[u8]| packet(header, memory, rest);
    assert_eq!(ask(&mut ports, &packet(0x4e, 0, &[7, 8, 9])), answer(0x42, 0, &[0]));
    assert_eq!(ask(&mut ports, &packet(0x4d, 0, &[3])), answer(0x41, 0, &[0, 7, 8, 9]));
    // Beyond the end, and of a memory that is not there.
    assert_eq!(ask(&mut ports, &packet(0x4e, 0, &[7, 8, 9, 10])), answer(0x42, 0, &[5]));
    assert_eq!(ask(&mut ports, &packet(0x4d, 0, &[4])), answer(0x41, 0, &[5]));
    assert_eq!(ask(&mut ports, &packet(0x4d, 1, &[1])), answer(0x41, 1, &[5]));
    assert_eq!(ports.refusals().of(Refusal::Address), 3);
    let most = [0x4d, 0, 0xff, 0xff, 0xff, 0xff, 24];
    assert_eq!(ask(&mut ports, &most), [0x41, 0, 0xff, 0xff, 0xff, 0xff, 5]);
    // 24 bytes fit an answer.
    assert_eq!(ask(&mut ports, &[0x4d, 0, 0, 0, 0, 0, 24]).len(), 31);
    assert_eq!(ask(&mut ports, &[0x4d, 0, 0, 0, 0, 0, 25]), [0x41, 0, 0, 0, 0, 0, 5]);
}

#[test]
fn trajectories_are_checked_before_they_start() {
    let mut ports = ports();
    // At relative positions, with absolute yaw, reversed.
    let start = [0x8c, 13, 0, 1, 0, 1, 2, 0, 0, 0x80, 0x3f];
    let define = |id: u8, format: u8, offset: u32, pieces: u8| {
        [&[0x8c, 6, id, 1, format][..], &offset.to_le_bytes(), &[pieces]].concat()
    };
    assert_eq!(ask(&mut ports, &start)[4], 8, "it is not defined");
    assert_eq!(ask(&mut ports, &define(2, 0, 0, 1)), [0x80, 6, 2, 1, 0]);
    assert_eq!(ask(&mut ports, &start)[4], 8, "its piece has no duration");
    let duration = [&[0x4e, 0][..], &128_u32.to_le_bytes(), &1_f32.to_le_bytes()].concat();
    ask(&mut ports, &duration);
    let command = ports.receive(&start, 0, &ON_GROUND).command;
    let is_meant = matches!(
        command,
        Some(Command::HighLevel(
            HighLevelCommand::StartTrajectory {
                is_position_relative: true,
                is_yaw_relative: false,
                is_reversed: true,
                ..
            },
            _,
        ))
    );
    assert!(is_meant, "{command:?}");
    let wrong = [&[0x4e, 0][..], &4_u32.to_le_bytes(), &f32::NAN.to_le_bytes()].concat();
    ask(&mut ports, &wrong);
    assert_eq!(ask(&mut ports, &start)[4], 8, "it has a number that is none");
    assert_eq!(ports.refusals().of(Refusal::NotFinite), 1);
    for (packet, reason) in [
        (define(31, 0, 0, 1), Refusal::NoTrajectory),
        (define(2, 1, 0, 1), Refusal::Unsupported),
        (define(2, 2, 0, 1), Refusal::Unknown),
        (define(2, 0, 1, 16), Refusal::Address),
        (define(2, 0, u32::MAX, 255), Refusal::Address),
        (define(2, 0, 0, 0), Refusal::Address),
    ] {
        let before = ports.refusals().of(reason);
        assert_eq!(ask(&mut ports, &packet)[4], 8);
        assert_eq!(ports.refusals().of(reason), before + 1, "{packet:?}");
    }
    assert_eq!(ask(&mut ports, &define(30, 0, 0, 16))[4], 0);
}
