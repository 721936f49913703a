//! The controller's messages, with the types and data of kilolib's `message.h` and `ohc.h`.

use bittybuzz_kilobot::mode::{Act, ModeSwitch, RobotMode};

const DUTIES: [u8; 4] = [61, 62, 63, 64];

#[test]
fn types_of_the_messages() {
    let expected = [
        (0x80, Act::Boot, RobotMode::Waiting),
        (0x83, Act::Reset, RobotMode::Waiting),
        (0x84, Act::None, RobotMode::Asleep),
        (0x85, Act::None, RobotMode::Waiting),
        (0x86, Act::None, RobotMode::Charging),
        (0x87, Act::None, RobotMode::Battery),
        (0x88, Act::None, RobotMode::Running),
        (0x89, Act::None, RobotMode::Moving),
    ];
    for kind in 0..=255 {
        // These messages do nothing: calibration has no mode 5, and other types do not exist.
        let (_, act, state) = expected.into_iter().find(|(known, ..)| *known == kind).unwrap_or((
            kind,
            Act::None,
            RobotMode::Waiting,
        ));
        let mut mode = ModeSwitch::new(1, DUTIES);
        assert_eq!(mode.handle(kind, &[5, 0, 0, 0, 0, 0, 0, 0, 0]), act, "{kind:#x}");
        assert_eq!((mode.state, mode.id, mode.duties), (state, 1, DUTIES), "{kind:#x}");
    }
}

#[test]
fn calibration_is_tried_and_stored() {
    let mut mode = ModeSwitch::new(0xffff, DUTIES);
    let calibrate = |mode: &mut ModeSwitch, data| mode.handle(0x8a, &data);
    assert_eq!(calibrate(&mut mode, [0; 9]), Act::None, "there is nothing to store");
    assert_eq!(mode.state, RobotMode::Waiting);
    assert_eq!(calibrate(&mut mode, [1, 0x34, 0x12, 0, 0, 0, 0, 0, 0]), Act::None);
    assert_eq!((mode.state, mode.id, mode.shown), (RobotMode::Moving, 0x1234, [0, 0]));
    let _ = calibrate(&mut mode, [2, 0, 0, 81, 0, 0, 0, 0, 0]);
    assert_eq!(mode.shown, [81, 0]);
    let _ = calibrate(&mut mode, [3, 0, 0, 0, 82, 0, 0, 0, 0]);
    assert_eq!(mode.shown, [0, 82]);
    let _ = calibrate(&mut mode, [4, 0, 0, 0, 0, 83, 84, 0, 0]);
    assert_eq!(mode.shown, [83, 84]);
    assert_eq!(calibrate(&mut mode, [0; 9]), Act::Store);
    assert_eq!((mode.state, mode.id, mode.duties), (RobotMode::Waiting, 0x1234, [81, 82, 83, 84]));
}

/// New chips have an EEPROM of 0xff, and a programmer erases it.
#[test]
fn a_robot_with_erased_id_or_duties_does_not_run() {
    const RUN: u8 = 0x88;
    const CALIBRATE: u8 = 0x8a;
    let mut erased = [DUTIES; 4];
    for (index, duties) in erased.iter_mut().enumerate() {
        duties[index] = 0xff;
    }
    let robots = [(0xffff, DUTIES)].into_iter().chain(erased.map(|duties| (1, duties)));
    for (id, duties) in robots {
        let mut mode = ModeSwitch::new(id, duties);
        let _ = mode.handle(RUN, &[0; 9]);
        assert_eq!(mode.state, RobotMode::Uncalibrated, "{id:#x}, {duties:?}");
        // Values from the controller are valid at once, stored or not.
        let _ = mode.handle(CALIBRATE, &[1, 2, 0, 0, 0, 0, 0, 0, 0]);
        let _ = mode.handle(CALIBRATE, &[2, 0, 0, 65, 0, 0, 0, 0, 0]);
        let _ = mode.handle(CALIBRATE, &[3, 0, 0, 0, 65, 0, 0, 0, 0]);
        let _ = mode.handle(CALIBRATE, &[4, 0, 0, 0, 0, 65, 65, 0, 0]);
        let _ = mode.handle(RUN, &[0; 9]);
        assert_eq!(mode.state, RobotMode::Running, "{id:#x}, {duties:?}");
    }
    // Values next to the erased ones are valid.
    for id in [0, 0x00ff, 0xff00, 0xfffe] {
        let mut mode = ModeSwitch::new(id, [0xfe; 4]);
        let _ = mode.handle(RUN, &[0; 9]);
        assert_eq!(mode.state, RobotMode::Running, "{id:#x}");
    }
}

#[test]
fn the_id_is_shown_bit_by_bit() {
    let mut mode = ModeSwitch::new(0b1010_0000_0000_0001, DUTIES);
    for bit in 0..=255 {
        let _ = mode.handle(0x89, &[bit, 0, 0, 0, 0, 0, 0, 0, 0]);
        let is_set = matches!(bit, 0 | 13 | 15);
        assert_eq!(mode.shown, if is_set { [61, 0] } else { [0, 0] }, "bit {bit}");
        assert_eq!(mode.state, RobotMode::Moving);
    }
}

/// Any robot in range can send these messages. While the script runs, they change no id and no
/// duties.
#[test]
fn calibration_is_ignored_while_the_script_runs() {
    let mut mode = ModeSwitch::new(1, DUTIES);
    let _ = mode.handle(0x88, &[0; 9]);
    for kind in 0..=255 {
        assert_eq!(mode.handle(0x8a, &[kind, 9, 9, 9, 9, 9, 9, 0, 0]), Act::None, "mode {kind}");
        assert_eq!(
            (mode.state, mode.id, mode.duties),
            (RobotMode::Running, 1, DUTIES),
            "mode {kind}"
        );
    }
    // The controller pauses the script first.
    let _ = mode.handle(0x85, &[0; 9]);
    let _ = mode.handle(0x8a, &[1, 9, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!((mode.handle(0x8a, &[0; 9]), mode.id), (Act::Store, 9));
}
