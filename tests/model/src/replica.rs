//! One robot, as a function: what it knows and what happens, to what it knows then and what it sends.
//!
//! Between two steps, all that matters of a machine is what is in its store: what is to be sent has been sent, and timers only
//! say when an entry is advertised again. So a machine with that knowledge is made anew for every transition, by telling it the
//! entries; and it is asked for what it knows with the protocol's own questions.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::OnceLock;

use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{Loader, MemoryFiles};
use bittybuzz_vm_core::message::{Entry as EntryMessage, Message, Script};
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Entry, Host, Image, Outcome, Reply, RobotFault, Sighting, Sizes,
    Value, Vm, builtin,
};

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
    /// Nothing, for long enough that everything is advertised.
    Idle,
}

const SLOTS: usize = 350;
const SIZES: Sizes = Sizes { neighbors: 0, bearings: false, entries: 2, swarms: 0 };
type Machine = Vm<Tiny, &'static [u8], SLOTS>;

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
    let mut machine = Running::new(robot, rule);
    for (key, stamp) in known {
        machine.tell((*key, *stamp));
    }
    machine.step(0);
    machine.link.sent.clear();
    let command = match event {
        Event::Put(key, value) => 1 + key + 2 * value.unwrap_or(0),
        Event::Get(key) => 100 + key,
        Event::Forget => 200,
        Event::Hear(frame) => {
            machine.tell(frame);
            0
        }
        Event::Idle => {
            (0..IDLE_STEPS).for_each(|_| machine.step(0));
            0
        }
    };
    machine.step(command);
    let sent = machine.sent();
    for key in 0..KEYS {
        machine.tell((key, Stamp { clock: 0, robot: ASKER, value: None }));
    }
    machine.step(0);
    let after = machine.sent().into_iter().filter(|(_, stamp)| stamp.clock != 0);
    (after.collect(), sent)
}

/// A machine that runs.
struct Running {
    vm: Box<Machine>,
    link: Link,
    script: Script,
}

impl Running {
    fn new(robot: u16, rule: Rule) -> Self {
        let mut vm: Box<Machine> = Box::new(Vm::new());
        vm.equip(SIZES);
        vm.load(Image::new(image(rule)), |_| true).expect("the compiler's image is accepted");
        vm.identify(robot, 1);
        let script = vm.header().map(|header| Script {
            hash: header.hash(),
            strings: header.strings() + builtin::string::COUNT,
        });
        let script = script.expect("a program is loaded");
        let mut running = Running { vm, link: Link::default(), script };
        running.run(Entry::Global);
        running.run(Entry::Init);
        running
    }

    /// A frame is waiting.
    fn tell(&mut self, (key, Stamp { clock, robot, value }): Frame) {
        let entry = Message::<Tiny>::Entry(EntryMessage {
            stigmergy: 1,
            owner: robot,
            clock,
            key: Value::int(key),
            value: value.map_or(Value::nil(), Value::int),
        });
        let mut frame = [0; 10];
        assert_eq!(entry.encode(self.script, &mut frame), Some(10));
        self.link.waiting.push_back(frame);
    }

    /// The entries that were sent since the last time.
    fn sent(&mut self) -> Vec<Frame> {
        let sent = std::mem::take(&mut self.link.sent);
        let frames = sent.iter().map(|frame| match Message::<Tiny>::decode(frame, self.script) {
            Ok(Message::Entry(entry)) => {
                let value = entry.value.as_int();
                assert_eq!(value.is_none(), entry.value.is_nil());
                let stamp = Stamp { clock: entry.clock, robot: entry.owner, value };
                (entry.key.as_int().expect("keys are integers"), stamp)
            }
            other => panic!("{other:?} was sent"),
        });
        frames.collect()
    }

    fn step(&mut self, command: i32) {
        self.link.command = command;
        self.run(Entry::Step);
    }

    fn run(&mut self, entry: Entry) {
        assert!(self.vm.begin(entry));
        for _ in 0..1000 {
            match self.vm.run(&mut self.link, 1000) {
                Outcome::Done => return,
                Outcome::Pending => {}
                outcome => panic!("{outcome:?} in {entry:?}"),
            }
        }
        panic!("{entry:?} does not end");
    }
}

fn image(rule: Rule) -> &'static [u8] {
    static IMAGES: OnceLock<[Vec<u8>; 2]> = OnceLock::new();
    let images = IMAGES.get_or_init(|| {
        [DEFAULT, LOWER_ROBOT].map(|handler| {
            let options = Options {
                profile: Some(bittybuzz_robots::Profile::Tiny),
                robot: None,
                robots: bittybuzz_robots::all_shipped(),
            };
            let files = MemoryFiles::default();
            let text = format!("{SCRIPT}{handler}");
            let compiled = compile(Path::new("model.bzz"), text, &Loader::new(&files), &options);
            compiled.image.unwrap_or_else(|| panic!("{:?}", compiled.diagnostics))
        })
    });
    match rule {
        Rule::Default => &images[0],
        Rule::LowerRobot => &images[1],
    }
}

/// What a machine hears and says.
#[derive(Default)]
struct Link {
    waiting: VecDeque<[u8; 10]>,
    sent: Vec<Vec<u8>>,
    command: i32,
}

impl Host<Tiny> for Link {
    fn call<C: ByteCode, const N: usize>(
        &mut self,
        _: u16,
        _: Arguments<'_, Tiny, C, N>,
        _: bool,
    ) -> Result<Reply<Tiny>, RobotFault> {
        Ok(Reply::Value(Value::int(self.command)))
    }

    fn log<C: ByteCode, const N: usize>(&mut self, _: Arguments<'_, Tiny, C, N>) {}

    fn delay_is_over(&mut self, _: i32, _: bool) -> bool {
        true
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }

    fn receive(&mut self, frame: &mut [u8], _: &mut Sighting<Tiny>) -> Option<usize> {
        let waiting = self.waiting.pop_front()?;
        frame.get_mut(..waiting.len())?.copy_from_slice(&waiting);
        Some(waiting.len())
    }

    fn send(&mut self, frame: &[u8]) {
        self.sent.push(frame.to_vec());
    }
}
