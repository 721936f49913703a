//! One robot as a function from its store and an event to its next store and the frames that it sends.
//!
//! Between two steps, all that matters of a machine is what is in its store: what is to be sent has been sent, and timers only
//! say when an entry is advertised again. Every transition therefore
//! starts with a new machine that receives these entries. The queries of the protocol then read its store.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::OnceLock;

use bittybuzz_testkit::{Answer, Program, Recorder, TestRobot};
use bittybuzz_vm_core::message::{CLOCK_MAX, Message, StigmergyEntry as EntryMessage};
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{Sizes, Value};

/// Robots' ids.
pub const ROBOTS: [u16; 3] = [1, 2, 3];
/// Keys of the stigmergy.
pub const KEYS: i32 = 2;
/// Who asks a robot for what it knows. No robot has this id.
const ASKER: u16 = 99;
/// Steps in which a robot advertises all it knows, though it waits longer from time to time.
const IDLE_STEPS: usize = 120;

/// A value under a key: who put it when, and the value; `None` if it was deleted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stamp {
    /// Lamport's clock.
    pub clock: u32,
    /// Who put it.
    pub robot: u16,
    /// `None`: deleted.
    pub value: Option<i32>,
}

/// What a robot knows.
pub type Replica = BTreeMap<i32, Stamp>;

/// An entry on its way.
pub type Frame = (i32, Stamp);

/// Which handler of conflicts the script has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rule {
    /// None.
    Default,
    /// The lower robot id wins.
    LowerRobot,
}

/// What happens to a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Event {
    /// The script puts a value under a key, or deletes it.
    Put(i32, Option<i32>),
    /// The script asks for the value under a key.
    Get(i32),
    /// The script creates the stigmergy again, which empties the replica.
    Forget,
    /// A frame arrives.
    Hear(Frame),
    /// Somebody who is no robot sends a frame.
    Forge(Frame),
    /// Nothing, for long enough that everything is advertised.
    Idle,
}

const SLOTS: usize = 350;
const SIZES: Sizes = Sizes { neighbors: 0, bearings: false, entries: 2, swarms: 0 };

/// What the script reads as `command()`; robot functions of a shipped robot have to do.
const SCRIPT: &str = r#"
function init() { s = stigmergy.create(1) handle() }
function step() {
  var command = forward()
  if(command >= 200) s = stigmergy.create(1)
  else if(command >= 100) s.get(command - 100)
  else if(command > 0) {
    var value = (command - 1) / 2
    if(value) s.put((command - 1) % 2, value) else s.put((command - 1) % 2, nil)
  }
}
"#;
const DEFAULT: &str = "function handle() {}";
const LOWER_ROBOT: &str = r#"
function handle() {
  s.onconflict(function(key, local, remote) { if(local.robot < remote.robot) return local return remote })
}
"#;

/// What a robot knows after an event, and what it has sent.
pub fn react(robot: u16, rule: Rule, known: &Replica, event: Event) -> (Replica, Vec<Frame>) {
    let mut machine = Running::knowing(robot, rule, known);
    let command = match event {
        Event::Put(key, value) => 1 + key + 2 * value.unwrap_or(0),
        Event::Get(key) => 100 + key,
        Event::Forget => 200,
        Event::Hear(frame) => {
            machine.receive(frame);
            0
        }
        Event::Forge(_) => 0,
        Event::Idle => {
            for step in 0..IDLE_STEPS {
                // At most one of two sums is the robot's own.
                if step % 10 < 2 {
                    let digest = step as u32 % 10;
                    machine.robot.receive(&Message::Digest { robot: ASKER, digest, floor: 0 });
                }
                machine.step(0);
            }
            0
        }
    };
    machine.step(command);
    let sent = machine.sent();
    // Until another robot has a put, its repetitions go before answers.
    sent.iter().filter(|(_, stamp)| stamp.clock != 0).for_each(|frame| machine.receive(*frame));
    let mut after = Replica::new();
    for key in 0..KEYS {
        machine.receive((key, Stamp { clock: 0, robot: ASKER, value: None }));
        // An answer may wait for the one before.
        (0..5).for_each(|_| machine.step(0));
        after.extend(machine.sent().into_iter().filter(|(_, stamp)| stamp.clock != 0));
    }
    (after, sent)
}

/// The digest in the beacons of a robot.
pub fn digest(known: &Replica) -> u32 {
    let mut machine = Running::knowing(ASKER, Rule::Default, known);
    for _ in 0..IDLE_STEPS {
        machine.step(0);
        let (sent, script) = (machine.robot.take_sent(), machine.robot.script());
        for frame in sent {
            if let Ok(Message::Digest { digest, .. }) = Message::<Tiny>::decode(&frame, script) {
                return digest;
            }
        }
    }
    panic!("no digest was sent");
}

/// A machine that runs.
struct Running {
    robot: TestRobot<Tiny, &'static [u8], SLOTS>,
    /// The script's next command.
    command: Rc<Cell<i32>>,
}

impl Running {
    fn new(robot: u16, rule: Rule) -> Self {
        let mut robot = TestRobot::new(image(rule), robot, SIZES);
        let command = Rc::new(Cell::new(0));
        let answer = command.clone();
        robot.host = Recorder::answering(move |_| Answer::Int(answer.get()));
        robot.begin().expect("the script does not fail");
        Running { robot, command }
    }

    /// A machine that has received these entries.
    fn knowing(robot: u16, rule: Rule, known: &Replica) -> Self {
        let mut machine = Running::new(robot, rule);
        for (key, stamp) in known {
            if stamp.value.is_none() {
                // The deletion of a key that is not there would leave nothing.
                let clock = if stamp.clock > 1 { stamp.clock - 1 } else { CLOCK_MAX };
                let deleted = Stamp { clock, robot: stamp.robot, value: Some(1) };
                machine.receive((*key, deleted));
            }
            machine.receive((*key, *stamp));
        }
        machine.step(0);
        machine.robot.take_sent();
        machine
    }

    /// Receives a frame, which waits for the next step.
    fn receive(&mut self, (key, Stamp { clock, robot, value }): Frame) {
        let entry = Message::<Tiny>::Entry(EntryMessage {
            stigmergy: 1,
            owner: robot,
            clock,
            key: Value::int(key),
            value: value.map_or(Value::nil(), Value::int),
        });
        assert_eq!(self.robot.frame(&entry).len(), 10);
        self.robot.receive(&entry);
    }

    /// The entries that were sent since the last time.
    fn sent(&mut self) -> Vec<Frame> {
        let (sent, script) = (self.robot.take_sent(), self.robot.script());
        let frames = sent.iter().filter_map(|frame| match Message::<Tiny>::decode(frame, script) {
            Ok(Message::Entry(entry)) => {
                let value = entry.value.as_int();
                assert_eq!(value.is_none(), entry.value.is_nil());
                let stamp = Stamp { clock: entry.clock, robot: entry.owner, value };
                Some((entry.key.as_int().expect("keys are integers"), stamp))
            }
            Ok(Message::Digest { .. }) => None,
            other => panic!("{other:?} was sent"),
        });
        frames.collect()
    }

    fn step(&mut self, command: i32) {
        self.command.set(command);
        self.robot.step().expect("the script does not fail");
    }
}

fn image(rule: Rule) -> &'static [u8] {
    static IMAGES: OnceLock<[Vec<u8>; 2]> = OnceLock::new();
    let images = IMAGES.get_or_init(|| {
        [DEFAULT, LOWER_ROBOT]
            .map(|handler| Program::new::<Tiny>(&format!("{SCRIPT}{handler}")).image)
    });
    match rule {
        Rule::Default => &images[0],
        Rule::LowerRobot => &images[1],
    }
}
