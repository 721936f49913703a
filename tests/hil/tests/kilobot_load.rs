//! A Kilobot among fifteen others that all send: its script keeps its pace.

use std::time::Duration;

use bittybuzz_comms::infrared::{frame_of, message_of};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_hil::kilobots::behavior;
use bittybuzz_hil::{Command, Kilobots};
use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::builtin::string;
use bittybuzz_vm_core::message::{Message, ScriptIdentity, TINY_FRAME};
use bittybuzz_vm_core::number::Tiny;

/// Each step turns the LED, and says how much was heard. It uses nothing of the machine that the gradient does not.
const SCRIPT: &str = "\
heard = 0
n = 0
function init() {
  neighbors.listen(\"number\", function(topic, value, robot) { heard = heard + 1 })
}
function step() {
  n = n + 1
  led(n % 2)
  neighbors.broadcast(\"heard\", heard)
}
";

const NEIGHBORS: u16 = 15;
const SECONDS: u64 = 20;

/// Fifteen neighbors send so many frames a second each, in turn. Times of the steps, how many messages the script has heard, and how
/// many the robot has sent.
fn among_neighbors(rate: u64) -> (Vec<Duration>, i32, i32) {
    let mut robots = Kilobots::in_image(SCRIPT, &behavior("gradient"), 1);
    let symbols = Symbols::from_json(&robots.symbols()).unwrap();
    let strings = string::COUNT + symbols.strings.len() as u16;
    let script = ScriptIdentity { hash: symbols.script_hash, strings };
    let number = |name: &str| (0..strings).find(|n| symbols.string(*n) == Some(name)).unwrap();
    let (topic, answer) = (number("number"), number("heard"));
    robots.start();
    let period = Duration::from_secs(1) / (u32::from(NEIGHBORS) * rate as u32);
    let start = robots.now();
    for count in 0..SECONDS * u64::from(NEIGHBORS) * rate {
        let robot = 100 + (count % u64::from(NEIGHBORS)) as u16;
        // Never the same twice: doubles are dropped.
        let value = Value::<Tiny>::int((count / u64::from(NEIGHBORS)) as i32);
        let mut frame = [0; TINY_FRAME];
        let length = Message::Broadcast { robot, topic, value }.encode(script, &mut frame).unwrap();
        let payload = message_of(&frame[..length]).unwrap().to_vec();
        let at = start + period * count as u32;
        robots.execute_on(0, &Command::Radio { at: at.max(robots.now()), payload });
        robots.run_for(period);
    }
    robots.run_ms(1000);
    let steps = robots.colors(0, start).iter().map(|(at, _)| *at).collect();
    let heard = robots.sent(0).iter().rev().find_map(|(_, message)| {
        let frame = frame_of(message)?;
        match Message::<Tiny>::decode(&frame, script) {
            Ok(Message::Broadcast { topic, value, .. }) if topic == answer => value.as_int(),
            _ => None,
        }
    });
    (steps, heard.unwrap(), robots.sent(0).len() as i32)
}

fn keeps_its_pace(steps: &[Duration]) {
    assert!(steps.len() as u64 >= 10 * SECONDS, "{} steps", steps.len());
    for pair in steps.windows(2) {
        let period = pair[1] - pair[0];
        // A step that begins while the robot sends comes 4.4 ms late; the next one comes in time.
        let tolerance = Duration::from_millis(15);
        let tick = Duration::from_millis(100);
        assert!((tick - tolerance..=tick + tolerance).contains(&period), "{period:?}");
    }
}

#[test]
fn thirty_frames_a_second() {
    let (steps, heard, own) = among_neighbors(2);
    keeps_its_pace(&steps);
    let sent = SECONDS as i32 * 30;
    println!("{heard} of {sent} messages heard");
    // While it sends it is deaf, so that each of its messages costs at most one of those that come every 33 ms. Fifteen of them take
    // as long as the pause between two of its own, so either nearly all of its messages cost one, or nearly none.
    assert!((sent - own..=sent).contains(&heard), "{heard} of {sent}, {own} sent");
    assert!(own <= 43, "two a second: {own}");
}

/// Two thirds of what fits on the air; more than its queue holds between two steps.
#[test]
fn a_hundred_and_fifty_frames_a_second() {
    let (steps, heard, _) = among_neighbors(10);
    keeps_its_pace(&steps);
    println!("{heard} of {} messages heard", SECONDS * 150);
    // Ten wait at most from step to step.
    assert!(heard >= SECONDS as i32 * 10 * 8, "{heard}");
}
