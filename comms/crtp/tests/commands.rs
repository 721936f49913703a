//! Commands that cflib does not send, and packets that are refused.

use bittybuzz_crtp::{
    ArmingRequest, Command, Height, HighLevelCommand, HighLevelOutcome, Identity, MeasuredPose,
    Pace, Packet, Parameter, PeerPosition, Ports, Reaction, Refusal, Setpoint, SupervisorInfo,
    Value, Vertical, VerticalFlight,
};

use crate::oracle::{Meaning, meaning};

const OWN_ID: u8 = 0xe7;

pub fn ports() -> Ports {
    Ports::new(Identity { id: OWN_ID, firmware: "BittyBuzz 0.1", device: "CF21" })
}

fn receive(ports: &mut Ports, header: u8, parts: &[&[u8]]) -> Reaction {
    ports.receive(&[&[header][..], &parts.concat()].concat(), 0, &SupervisorInfo::default())
}

fn answer(reaction: &Reaction) -> &[u8] {
    reaction.answer.as_ref().map_or(&[], Packet::bytes)
}

/// Returns the meaning of a packet that is not refused.
fn parsed(header: u8, parts: &[&[u8]]) -> Meaning {
    let mut ports = ports();
    let reaction = receive(&mut ports, header, parts);
    assert_eq!(ports.refusals().total(), 0);
    meaning(reaction.command)
}

/// Returns the reason why a packet is refused.
fn refusal(header: u8, parts: &[&[u8]]) -> Refusal {
    let mut ports = ports();
    let reaction = receive(&mut ports, header, parts);
    assert_eq!(reaction.command, None);
    assert_eq!(ports.refusals().total(), 1);
    Refusal::ALL.into_iter().find(|reason| ports.refusals().of(*reason) == 1).unwrap()
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn shorts(numbers: &[i16]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Type 4 of port 7: roll, pitch, rate of yaw and vertical speed (crtp_commander_generic.c).
#[test]
fn an_attitude_with_a_vertical_speed() {
    let expected = Setpoint::Attitude {
        roll_rad: 5_f32.to_radians(),
        pitch_rad: 10_f32.to_radians(),
        yaw_rate_rad_s: 90_f32.to_radians(),
        vertical: Vertical::SpeedMS(0.5),
    };
    let data = floats(&[5.0, -10.0, 90.0, 0.5]);
    assert_eq!(parsed(0x7c, &[&[4], &data]), Meaning::Setpoint(expected));
}

/// Old commands of port 8: their clients are gone from cflib (crtp_commander_high_level.c).
#[test]
fn old_high_level_commands() {
    let flight = |height, yaw_rad, pace| VerticalFlight { height, yaw_rad, pace };
    let take_off = |flight| Meaning::HighLevel(HighLevelCommand::TakeOff(flight));
    let land = |flight| Meaning::HighLevel(HighLevelCommand::Land(flight));
    let by_duration = flight(Height::Absolute(0.5), Some(0.0), Pace::DurationS(2.0));
    assert_eq!(parsed(0x8c, &[&[1, 0], &floats(&[0.5, 2.0])]), take_off(by_duration));
    assert_eq!(parsed(0x8c, &[&[2, 0], &floats(&[0.5, 2.0])]), land(by_duration));
    // Height, relative or not, yaw, the present one or not, speed.
    let with_speed = |command: u8, relative: u8, present: u8, speed: f32| {
        let (height, yaw, speed) = (floats(&[0.5]), floats(&[1.5]), floats(&[speed]));
        parsed(0x8c, &[&[command, 0], &height, &[relative], &yaw, &[present], &speed])
    };
    let absolute = flight(Height::Absolute(0.5), Some(1.5), Pace::SpeedMS(0.25));
    assert_eq!(with_speed(9, 0, 0, 0.25), take_off(absolute));
    assert_eq!(with_speed(10, 0, 0, 0.25), land(absolute));
    let above = flight(Height::Above(0.5), None, Pace::Default);
    assert_eq!(with_speed(9, 1, 1, 0.0), take_off(above));
    // A relative landing counts downwards.
    let below = flight(Height::Above(-0.5), None, Pace::Default);
    assert_eq!(with_speed(10, 1, 1, -1.0), land(below));
}

#[test]
fn only_members_of_a_group_obey_its_commands() {
    let mut ports = ports();
    let stop = |ports: &mut Ports, groups| receive(ports, 0x8c, &[&[3, groups]]);
    assert!(stop(&mut ports, 0).command.is_some(), "group 0 is everybody");
    let other = stop(&mut ports, 2);
    assert_eq!((other.command.as_ref(), answer(&other)), (None, &[0x80, 3, 2, 0, 0][..]));
    let set = receive(&mut ports, 0x8c, &[&[0, 0b110]]);
    assert_eq!((set.command.as_ref(), answer(&set)), (None, &[0x80, 0, 6, 0, 0][..]));
    for (groups, obeys) in [(0, true), (1, false), (2, true), (4, true), (9, false), (0xff, true)] {
        assert_eq!(stop(&mut ports, groups).command.is_some(), obeys, "{groups}");
    }
    let own = ports.parameters().get(Parameter::HlCommanderGroupmask);
    assert_eq!(own, Value::Unsigned(6));
    assert_eq!(ports.refusals().total(), 0);
}

/// The answer repeats three bytes of the command, and has an errno (crtp_commander_high_level.c).
#[test]
fn answers_to_high_level_commands() {
    let mut ports = ports();
    let take_off = receive(&mut ports, 0x8c, &[&[1, 0], &floats(&[0.5, 2.0])]);
    let Some(Command::HighLevel(_, pending)) = take_off.command else { panic!("{take_off:?}") };
    for (outcome, errno) in
        [(HighLevelOutcome::Done, 0), (HighLevelOutcome::Busy, 16), (HighLevelOutcome::Refused, 8)]
    {
        assert_eq!(pending.packet(outcome).bytes(), [0x80, 1, 0, 0, errno]);
    }
    let wrong = receive(&mut ports, 0x8c, &[&[1, 0], &floats(&[f32::NAN, 2.0])]);
    assert_eq!((wrong.command.as_ref(), answer(&wrong)), (None, &[0x80, 1, 0, 0, 8][..]));
}

#[test]
fn answers_to_requests_to_arm() {
    let mut ports = ports();
    let info = SupervisorInfo { is_armed: true, is_crashed: true, ..SupervisorInfo::default() };
    let cases: [(&[u8], ArmingRequest, &[u8]); 5] = [
        (&[0x9d, 1, 1], ArmingRequest::Arm, &[0x91, 0x81, 1, 1]),
        (&[0x9d, 1, 0], ArmingRequest::Disarm, &[0x91, 0x81, 1, 1]),
        (&[0x9d, 2], ArmingRequest::Recover, &[0x91, 0x82, 1, 0]),
        (&[0xdc, 1, 1], ArmingRequest::Arm, &[0xd0, 1, 1, 1]),
        (&[0xdc, 2], ArmingRequest::Recover, &[0xd0, 2, 1, 0]),
    ];
    for (packet, request, expected) in cases {
        let reaction = ports.receive(packet, 0, &info);
        let Some(Command::Arming(actual, pending)) = reaction.command else { panic!("{packet:?}") };
        assert_eq!(actual, request);
        assert_eq!(pending.packet(true, &info).bytes(), expected);
        assert_eq!(pending.packet(false, &info).bytes()[expected.len() - 2], 0);
    }
}

#[test]
fn packed_positions_are_the_robots_own_or_those_of_others() {
    let item = |id: u8, mm: [i16; 3]| [&[id][..], &shorts(&mm)].concat();
    let items = [
        item(1, [1000, -2000, 500]),
        item(OWN_ID, [-32_768, 32_767, 1]),
        item(2, [0, 0, 0]),
        item(3, [4, 5, 6]),
    ];
    let Meaning::Localization(found) = parsed(0x6e, &[&items.concat()]) else { panic!() };
    let position_m = [-32.768, 32.767, 0.001];
    assert_eq!(found.own, Some(MeasuredPose { position_m, quaternion: None }));
    let peers = [(1, [1.0, -2.0, 0.5]), (2, [0.0; 3]), (3, [0.004, 0.005, 0.006])];
    assert_eq!(found.peers, peers.map(|(id, position_m)| PeerPosition { id, position_m }));
    // Two poses of 11 bytes: 0xc0000000 is the quaternion 0, 0, 0, 1.
    let pose = |id: u8| [item(id, [1, 2, 3]), vec![0, 0, 0, 0xc0]].concat();
    let Meaning::Localization(found) = parsed(0x6d, &[&[9], &pose(OWN_ID), &pose(9)]) else {
        panic!()
    };
    let own =
        MeasuredPose { position_m: [0.001, 0.002, 0.003], quaternion: Some([0.0, 0.0, 0.0, 1.0]) };
    assert_eq!((found.own, found.peers.len(), found.peers[0].id), (Some(own), 1, 9));
    for (header, start) in [(0x6e, vec![]), (0x6d, vec![9])] {
        assert_eq!(refusal(header, &[&start]), Refusal::Length, "none");
        assert_eq!(refusal(header, &[&start, &[OWN_ID, 1, 2]]), Refusal::Length, "a part of one");
    }
    // Parts of sqrt(1/2) each, so the largest would be imaginary.
    let wrong = [item(1, [0; 3]), vec![0xff, 0xfd, 0xf7, 0x1f]].concat();
    assert_eq!(refusal(0x6d, &[&[9], &pose(OWN_ID), &wrong]), Refusal::NotUnit);
}

#[test]
fn numbers_that_are_not_finite_or_not_plausible_are_refused() {
    /// A command with numbers: the header, bytes before them, the numbers, bytes after them.
    type Case = (u8, &'static [u8], &'static [f32], &'static [u8]);
    let cases: [Case; 12] = [
        (0x3c, &[], &[1.0; 3], &[0, 0]),
        (0x7c, &[1], &[1.0; 4], &[]),
        (0x7c, &[2], &[1.0; 4], &[]),
        (0x7c, &[4], &[1.0; 4], &[]),
        (0x7c, &[5], &[1.0; 4], &[]),
        (0x7c, &[7], &[1.0; 4], &[]),
        (0x7c, &[11], &[1.0; 3], &[0, 0, 0]),
        (0x8c, &[1, 0], &[1.0; 2], &[]),
        (0x8c, &[12, 0, 0, 0], &[1.0; 5], &[]),
        (0x8c, &[11, 0, 0, 0], &[1.0; 5], &[]),
        (0x6c, &[], &[1.0; 3], &[]),
        (0x6d, &[8], &[0.5; 7], &[]),
    ];
    for (header, start, numbers, end) in cases {
        assert!(!matches!(parsed(header, &[start, &floats(numbers), end]), Meaning::Nothing));
        for at in 0..numbers.len() {
            for (wrong, reasons) in [
                (f32::NAN, [Refusal::NotFinite; 2]),
                (f32::INFINITY, [Refusal::NotFinite; 2]),
                (f32::NEG_INFINITY, [Refusal::NotFinite; 2]),
                (1e30, [Refusal::OutOfRange, Refusal::NotUnit]),
                (-1e6, [Refusal::OutOfRange, Refusal::NotUnit]),
            ] {
                let mut numbers = numbers.to_vec();
                numbers[at] = wrong;
                let reason = refusal(header, &[start, &floats(&numbers), end]);
                assert!(reasons.contains(&reason), "{header:#x} {start:?} {at}: {reason:?}");
            }
        }
    }
}

#[test]
fn radii_durations_and_time_scales_are_positive() {
    let spiral = |numbers: [f32; 5]| refusal(0x8c, &[&[11, 0, 0, 0], &floats(&numbers)]);
    assert_eq!(spiral([1.0, -0.01, 1.0, 1.0, 1.0]), Refusal::OutOfRange);
    assert_eq!(spiral([1.0, 1.0, -0.01, 1.0, 1.0]), Refusal::OutOfRange);
    assert_eq!(spiral([1.0, 1.0, 1.0, 1.0, -0.01]), Refusal::OutOfRange);
    for (scale, reason) in [
        (0.0, Refusal::OutOfRange),
        (0.009, Refusal::OutOfRange),
        (100.1, Refusal::OutOfRange),
        (-1.0, Refusal::OutOfRange),
        (0.01, Refusal::NoTrajectory),
        (100.0, Refusal::NoTrajectory),
    ] {
        assert_eq!(refusal(0x8c, &[&[13, 0, 0, 0, 0, 0], &floats(&[scale])]), reason, "{scale}");
        assert_eq!(refusal(0x8c, &[&[5, 0, 0, 0, 0], &floats(&[scale])]), reason, "{scale}");
    }
}

/// The stops are executed whatever follows them, everything else needs its exact length.
#[test]
fn lengths_are_exact_but_for_stops() {
    let exact: [(u8, &[u8]); 14] = [
        (0x3c, &[0; 14]),
        (0x7c, &[1; 17]),
        (0x7c, &[4; 17]),
        (0x7c, &[7; 17]),
        (0x7d, &[0; 5]),
        (0x8c, &[0; 2]),
        (0x8c, &[1; 10]),
        (0x8c, &[7; 15]),
        (0x8c, &[4; 23]),
        (0x8c, &[12; 24]),
        (0x6c, &[0; 12]),
        (0x9c, &[12]),
        (0x9d, &[1, 1]),
        (0xdc, &[3, 1]),
    ];
    for (header, data) in exact {
        let mut ports = ports();
        for length in 0..=30 {
            let sent: Vec<u8> = data.iter().copied().chain([0; 30]).take(length).collect();
            receive(&mut ports, header, &[&sent]);
            if length == data.len() {
                assert_eq!(ports.refusals().of(Refusal::Length), length as u32, "{header:#x}");
            }
        }
        assert_eq!(ports.refusals().of(Refusal::Length), 30, "{header:#x} {data:?}");
    }
    let stops: [(u8, &[u8], Meaning); 6] = [
        (0x7c, &[0], Meaning::Setpoint(Setpoint::Stop)),
        (0x8c, &[3, 0], Meaning::HighLevel(HighLevelCommand::Stop)),
        (0x6d, &[3], Meaning::EmergencyStop),
        (0x6d, &[4], Meaning::EmergencyStopWatchdog),
        (0x9d, &[3], Meaning::EmergencyStop),
        (0x9d, &[4], Meaning::EmergencyStopWatchdog),
    ];
    for (header, data, expected) in stops {
        assert_eq!(parsed(header, &[data]), expected);
        assert_eq!(parsed(header, &[data, &[0xff; 20]]), expected);
    }
}

#[test]
fn commands_that_the_robot_does_not_have_are_refused() {
    for (header, data, reason) in [
        (0x10, &[1][..], Refusal::Unknown),
        (0x3d, &[0; 14], Refusal::Unknown),
        (0x7c, &[12], Refusal::Unknown),
        (0x7c, &[3; 9], Refusal::Unsupported),
        (0x7d, &[1, 0, 0, 0, 0], Refusal::Unknown),
        (0x7e, &[0], Refusal::Unknown),
        (0x8c, &[14, 0], Refusal::Unknown),
        (0x9c, &[13], Refusal::Unknown),
        (0x9d, &[0], Refusal::Unknown),
        (0x9e, &[1, 1], Refusal::Unknown),
        (0x6f, &[0; 12], Refusal::Unknown),
        (0x6d, &[0], Refusal::Unknown),
        (0xdc, &[0, 1], Refusal::Unsupported),
        (0xdc, &[4], Refusal::Unknown),
        (0xdd, &[3], Refusal::Unknown),
        (0xde, &[1], Refusal::Unknown),
        (0x0c, b"a", Refusal::Unknown),
    ] {
        assert_eq!(refusal(header, &[data]), reason, "{header:#x} {data:?}");
    }
    let mut ports = ports();
    for wrong in [&[][..], &[0x3c; 32]] {
        assert_eq!(ports.receive(wrong, 0, &SupervisorInfo::default()), Reaction::default());
    }
    assert_eq!(ports.refusals().of(Refusal::NoPacket), 2);
}

#[test]
fn the_link_echoes_and_tells_its_source() {
    let mut ports = ports();
    let echo = receive(&mut ports, 0xfc, &[&[1, 2, 3]]);
    assert_eq!(answer(&echo), [0xf0, 1, 2, 3]);
    let source = receive(&mut ports, 0xfd, &[&[0]]);
    assert_eq!(&answer(&source)[..19], b"\xf1Bitcraze Crazyflie");
    assert_eq!(answer(&source).len(), 31);
    assert_eq!(receive(&mut ports, 0xfe, &[&[1]]), Reaction::default());
    assert_eq!(receive(&mut ports, 0xff, &[]), Reaction::default());
    let version = receive(&mut ports, 0xdd, &[&[0]]);
    assert_eq!(answer(&version), [0xd1, 0, 12, 0, 0, 0]);
    assert_eq!(answer(&receive(&mut ports, 0xdd, &[&[1]])), b"\xd1\x01BittyBuzz 0.1");
    assert_eq!(answer(&receive(&mut ports, 0xdd, &[&[2]])), b"\xd1\x02CF21");
    assert_eq!(ports.refusals().total(), 0);
}

/// Answers say that there is no Loco and no Lighthouse deck.
#[test]
fn requests_to_absent_decks_are_answered() {
    let mut ports = ports();
    assert_eq!(answer(&receive(&mut ports, 0x6d, &[&[2, 5, 1, 2]])), [0x61, 2, 5, 0]);
    assert_eq!(answer(&receive(&mut ports, 0x6d, &[&[11, 1, 0, 1, 0]])), [0x61, 11, 0]);
}

#[test]
fn bits_of_the_supervisor() {
    let mut ports = ports();
    let info = SupervisorInfo { is_armed: true, has_deck_fault: true, ..SupervisorInfo::default() };
    assert_eq!(info.bits(), 0x0802);
    let mut ask = |bit| ports.receive(&[0x9c, bit], 0, &info).answer.unwrap().bytes().to_vec();
    assert_eq!(ask(1), [0x90, 0x81, 0]);
    assert_eq!(ask(2), [0x90, 0x82, 1]);
    assert_eq!(ask(11), [0x90, 0x8b, 0]);
    assert_eq!(ask(12), [0x90, 0x8c, 0x02, 0x08]);
}

#[test]
fn a_write_to_stop_is_an_emergency_stop() {
    let id = Parameter::StabilizerStop as u8;
    assert_eq!(parsed(0x2e, &[&[id, 0, 1]]), Meaning::EmergencyStop);
    let mut ports = ports();
    let reaction = receive(&mut ports, 0x2e, &[&[id, 0, 0]]);
    assert!(matches!(reaction.command, Some(Command::Parameter(_))));
}
