//! Limits of flight that people write to a Crazyflie's flash.

use bittybuzz_emulation::message::ResetCause;
use bittybuzz_hil::safety::reset;
use bittybuzz_hil::{Core, RADIO_RAW, Robot, captured_body, frames};

use crate::flight::{arm, firmware_log, last_motion, motions, run_until_logged, try_to_arm};

/// Rises, and flies beyond every limit.
const SCRIPT: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  if(n == 25) log(1, takeoff(1000.0))
  if(n == 26) log(2, goTo(2000.0, -1000.0, 1500.0))
}
";

/// The place of `fence.mostZ` in the table of docs/crtp.md.
const FENCE_MOST_Z: u16 = 22;

/// A write of `fence.mostZ`, to which the answer is the same packet with the value in force: port 2,
/// channel 2 (cflib, param.py).
fn height_limit(m: f32) -> Vec<u8> {
    [&[0x2e], &FENCE_MOST_Z.to_le_bytes()[..], &m.to_le_bytes()].concat()
}

#[test]
fn a_robot_stays_within_the_limits_in_its_flash() {
    let crazyflie = bittybuzz_robot_files::find("crazyflie").unwrap();
    let given = ["height_mm=700", "speed_mm_s=400", "fence_front_mm=600", "fence_right_mm=100"];
    let (address, bytes) =
        crazyflie.settings_content(&given.map(str::to_owned)).unwrap().expect("four settings");
    let mut robot = Robot::crazyflie(Core::Unicorn, SCRIPT);
    robot.write(address, &bytes);
    reset(&mut robot, ResetCause::PowerOn);
    robot.execute(&captured_body(1));
    robot.run_ms(2_000);
    let log = firmware_log(&robot);
    for line in ["speed in mm/s at most 400", "height in mm at most 700", "-y in mm at most 100"] {
        assert!(log.iter().any(|found| *found == format!("limit of flight: {line}")), "{log:?}");
    }
    assert_eq!(log.iter().filter(|line| line.starts_with("limit of flight")).count(), 4);

    // A ground station writes a higher limit, and is answered with the one that is in force.
    let from = robot.now();
    robot.send(RADIO_RAW, &height_limit(2.0));
    robot.run_ms(20);
    let answer = height_limit(0.7);
    let is_answered = |(at, packet): (_, &[u8])| at >= from && packet == answer;
    assert!(frames(&robot.events, RADIO_RAW).any(is_answered));

    arm(&mut robot);
    assert_eq!(run_until_logged(&mut robot, "1", 8_000), ["1", "0"], "takeoff");
    run_until_logged(&mut robot, "2", 12_000);
    let [x, y, z] = last_motion(&robot).position_m;
    let place = [0.6, -0.1, 0.7];
    let is_near = [x, y, z].iter().zip(place).all(|(found, wanted)| (found - wanted).abs() < 0.05);
    assert!(is_near, "{x} {y} {z}");
    let flight = motions(&robot.events);
    for pair in flight.windows(2) {
        let [before, after] = pair else { continue };
        let seconds = (after.at - before.at).as_secs_f64();
        let moved_m = after.position_m[0] - before.position_m[0];
        assert!(seconds == 0.0 || moved_m / seconds < 0.5, "{moved_m} m in {seconds} s");
    }
    let highest_m = flight.iter().map(|motion| motion.position_m[2]).fold(0.0, f64::max);
    assert!(highest_m < 0.75, "{highest_m}");
}

/// A power cut while limits are written leaves a number without its complement, and old scripts of another
/// firmware are no limits at all.
#[test]
fn a_robot_with_a_damaged_limit_does_not_arm_and_says_what_to_do() {
    let crazyflie = bittybuzz_robot_files::find("crazyflie").unwrap();
    let given = ["height_mm=700".to_owned()];
    let (address, written) = crazyflie.settings_content(&given).unwrap().expect("a setting");
    let at = written.iter().position(|byte| *byte != 0xff).unwrap();
    let cut = [&written[..at + 2], &vec![0xff; written.len() - at - 2]].concat();
    let one_bit = {
        let mut bytes = written.clone();
        bytes[at] ^= 1;
        bytes
    };
    for bytes in [cut, one_bit, vec![0; written.len()]] {
        let mut robot = Robot::crazyflie(Core::Unicorn, SCRIPT);
        robot.write(address, &bytes);
        reset(&mut robot, ResetCause::PowerOn);
        robot.execute(&captured_body(1));
        robot.run_ms(2_000);
        assert!(!try_to_arm(&mut robot));
        robot.run_ms(1_000);
        let log = firmware_log(&robot);
        let reason = "the robot does not arm: a limit of the flight in flash is damaged: \
                      `bbz flash --set` writes the limits";
        assert!(log.iter().any(|line| line == reason), "{log:?}");
        let heights: Vec<_> = motions(&robot.events).iter().map(|at| at.position_m[2]).collect();
        assert!(heights.iter().all(|height| (height - heights[0]).abs() < 0.01), "{heights:?}");
    }
}
