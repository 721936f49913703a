//! The controller's messages, with types and data as kilolib's `message.h` and `ohc.h` have them.

use bittybuzz_kilobot::controller::{Calibration, Command, command};
use bittybuzz_kilobot::life::{Act, Life, State};

const DUTIES: [u8; 4] = [61, 62, 63, 64];

#[test]
fn types_of_the_messages() {
    let data = [5, 0, 0, 0, 0, 0, 0, 0, 0];
    let expected = [
        (0x80, Some(Command::Boot)),
        (0x81, None),
        (0x82, None),
        (0x83, Some(Command::Reset)),
        (0x84, Some(Command::Sleep)),
        (0x85, Some(Command::Wake)),
        (0x86, Some(Command::Charge)),
        (0x87, Some(Command::Voltage)),
        (0x88, Some(Command::Run)),
        (0x89, Some(Command::ReadId(5))),
        // There is no mode 5.
        (0x8a, None),
        (0x8b, None),
        (0xff, None),
        (0, None),
        (0x7f, None),
    ];
    for (kind, is) in expected {
        assert_eq!(command(kind, &data), is, "{kind:#x}");
    }
}

#[test]
fn calibration_is_tried_and_stored() {
    let calibrate = |data| command(0x8a, &data).unwrap();
    assert_eq!(
        calibrate([4, 0, 0, 0, 0, 71, 72, 0, 0]),
        Command::Calibrate(Calibration::Straight(71, 72))
    );
    let mut life = Life::new(0xffff, DUTIES);
    let save = calibrate([0; 9]);
    assert_eq!(life.obey(save), Act::None, "there is nothing to store");
    assert_eq!(life.obey(calibrate([1, 0x34, 0x12, 0, 0, 0, 0, 0, 0])), Act::None);
    assert_eq!((life.state, life.id, life.shown()), (State::Moving, 0x1234, [0, 0]));
    let _ = life.obey(calibrate([2, 0, 0, 81, 0, 0, 0, 0, 0]));
    assert_eq!(life.shown(), [81, 0]);
    let _ = life.obey(calibrate([3, 0, 0, 0, 82, 0, 0, 0, 0]));
    assert_eq!(life.shown(), [0, 82]);
    let _ = life.obey(calibrate([4, 0, 0, 0, 0, 83, 84, 0, 0]));
    assert_eq!(life.shown(), [83, 84]);
    assert_eq!(life.obey(save), Act::Store);
    assert_eq!((life.state, life.id, life.duties), (State::Waiting, 0x1234, [81, 82, 83, 84]));
}

#[test]
fn the_id_is_shown_bit_by_bit() {
    let mut life = Life::new(0b1010_0000_0000_0001, DUTIES);
    for bit in 0..=255 {
        let _ = life.obey(Command::ReadId(bit));
        let is_set = matches!(bit, 0 | 13 | 15);
        assert_eq!(life.shown(), if is_set { [61, 0] } else { [0, 0] }, "bit {bit}");
        assert_eq!(life.state, State::Moving);
    }
}

#[test]
fn states() {
    let mut life = Life::new(1, DUTIES);
    assert_eq!(life.state, State::Waiting);
    let states = [
        (Command::Run, State::Running),
        (Command::Run, State::Running),
        (Command::Wake, State::Waiting),
        (Command::Voltage, State::Battery),
        (Command::Charge, State::Charging),
        (Command::Sleep, State::Asleep),
        (Command::Run, State::Running),
    ];
    for (command, state) in states {
        assert_eq!(life.obey(command), Act::None);
        assert_eq!(life.state, state);
    }
    assert_eq!(life.obey(Command::Boot), Act::Boot);
    assert_eq!(life.obey(Command::Reset), Act::Reset);
}
