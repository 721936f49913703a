//! Messages of every kind, right and wrong ones, for a robot whose script listens to all of them.

use std::sync::OnceLock;

use bittybuzz_testkit::{Program, Queues, Received, TestRobot};
use bittybuzz_vm_core::message::content::{ContentItem, ContentReader, ContentWriter, Head};
use bittybuzz_vm_core::message::{
    FRAGMENT_HEAD, FULL_FRAME, Fragment, Message, ScriptIdentity, StigmergyEntry, Swarms,
    TINY_FRAME, crc16,
};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Entry as EntryPoint, FaultCode, Outcome, Sizes, Value};

use crate::choices::Choices;

/// Logs each received message and stores nothing, so that no message makes it fault.
const SCRIPT: &str = r#"
n = 0
function show(x) {
  if(istable(x)) foreach(x, function(k, v) { n = (n + size(x)) % 1000 log(k, v) })
  else log(x)
}
function init() {
  neighbors.listen("a", function(topic, value, robot) { log(topic, robot) show(value) })
  neighbors.listen("b", function(topic, value, robot) { n = robot % 7 })
  s = stigmergy.create(1)
  s.put("k", 0)
  s.onconflict(function(k, l, r) { show(l) if(l.robot > r.robot) return l return r })
  s.onconflictlost(function(k, l) { log(k) show(l.data) })
  u = stigmergy.create(9)
  u.put(0.5, "b")
  w = swarm.create(1)
  w.join()
}
function step() {
  n = (n + 1) % 1000
  neighbors.foreach(function(robot, data) { log(robot, data.distance) })
  w.exec(function() { log(neighbors.kin().count(), neighbors.nonkin().count()) })
  neighbors.broadcast("a", n)
  if(n % 3 == 0) neighbors.broadcast("c", { .x = n, .y = { .1 = "a" } })
  s.put("k", n)
  show(u.get(0.5))
  log(s.size(), u.size())
}
"#;

/// Room for the frames of both profiles.
const FRAME: usize = FULL_FRAME;
const CONTENT: usize = 8 * (FRAME - FRAGMENT_HEAD);
/// Little memory, so that it is soon full.
pub(crate) const SIZES: Sizes = Sizes { neighbors: 3, bearings: true, entries: 5, swarms: 2 };
const SLOTS: usize = 350 + SIZES.slots();
type Robot<P> = TestRobot<P, &'static [u8], SLOTS>;

/// The robot's id.
const ROBOT: u16 = 3;

/// The first byte says which profile; every byte that follows decides something about a frame. Whether there was a message
/// that the robot understood.
pub fn run(data: &[u8]) -> bool {
    match data.split_first() {
        Some((first, rest)) if first % 2 == 0 => receive::<Tiny>(&mut Choices::new(rest)),
        Some((_, rest)) => receive::<Full>(&mut Choices::new(rest)),
        None => false,
    }
}

fn image<P: Profile>() -> &'static [u8] {
    static IMAGES: OnceLock<[Vec<u8>; 2]> = OnceLock::new();
    let images = IMAGES
        .get_or_init(|| [Program::new::<Tiny>(SCRIPT).image, Program::new::<Full>(SCRIPT).image]);
    &images[usize::from(P::FULL)]
}

fn receive<P: Profile>(choices: &mut Choices<'_>) -> bool {
    let mut robot: Robot<P> = TestRobot::new(image::<P>(), ROBOT, SIZES);
    robot.host.link = Box::new(Queues::<P, 10, 10>::default());
    let script = robot.script();
    let mut understood = false;
    for entry in [EntryPoint::Global, EntryPoint::Init] {
        if !step(&mut robot, entry) {
            return false;
        }
    }
    for _ in 0..20 {
        if choices.is_empty() {
            break;
        }
        for _ in 0..choices.below(6) {
            for frame in frames::<P>(choices, script) {
                understood |= check::<P>(&frame, script);
                robot.host.link.push(received(&frame, choices.byte()));
            }
        }
        if !step(&mut robot, EntryPoint::Step) {
            break;
        }
    }
    understood
}

/// A frame, and what the link knows of its sender, which the second argument decides.
fn received(frame: &[u8], extra: u8) -> Received {
    Received {
        bytes: frame.to_vec(),
        sender: extra.is_multiple_of(3).then_some(u16::from(extra % 8)),
        place: extra.is_multiple_of(2).then_some([f32::from(extra); 3]),
    }
}

/// Runs an entry; `false` if that was the end, for want of memory.
fn step<P: Profile>(robot: &mut Robot<P>, entry: EntryPoint) -> bool {
    robot.host.link.begin_step(robot.vm.unwanted_topics());
    assert!(robot.vm.begin(entry), "{entry:?} does not begin");
    for _ in 0..10_000 {
        let outcome = robot.vm.run(&mut robot.host, 50);
        assert_eq!(robot.vm.audit(), Ok(()));
        match outcome {
            Outcome::Done => {
                for frame in robot.take_sent() {
                    assert!(!frame.is_empty() && frame.len() <= FRAME, "{frame:?}");
                    // The robot receives what it sends, as if from another of its id.
                    robot.host.link.push(received(&frame, 0));
                }
                return true;
            }
            Outcome::Pending | Outcome::Waiting => {}
            Outcome::Fault(fault) => {
                let is_memory =
                    matches!(fault.code, FaultCode::OutOfMemory | FaultCode::StackOverflow);
                assert!(is_memory, "a message is the script's fault: {fault:?}");
                return false;
            }
        }
    }
    panic!("{entry:?} does not end");
}

/// What can be read can be written, and is then read as the same. Whether it can be read.
fn check<P: Profile>(frame: &[u8], script: ScriptIdentity) -> bool {
    let Ok(message) = Message::<P>::decode(frame, script) else { return false };
    let mut room = [0; 64];
    let length = message.encode(script, &mut room).expect("a message that was read");
    let again = Message::<P>::decode(&room[..length], script);
    let same = match (&message, &again) {
        (Message::Swarms { robot, swarms }, Ok(Message::Swarms { robot: other, swarms: list })) => {
            robot == other && swarms.iter().eq(list.iter())
        }
        (message, Ok(again)) => format!("{message:?}") == format!("{again:?}"),
        _ => false,
    };
    assert!(same, "{message:?} and {again:?}");
    true
}

/// A frame, or those of a message in fragments.
fn frames<P: Profile>(choices: &mut Choices<'_>, script: ScriptIdentity) -> Vec<Vec<u8>> {
    let sealed = |message: &Message<'_, P>| {
        let mut frame = [0; FRAME];
        let length = message.encode(script, &mut frame);
        length.map(|length| frame[..length].to_vec()).into_iter().collect::<Vec<_>>()
    };
    let robot = u16::from(choices.byte() % 8);
    match choices.below(8) {
        0 => {
            let length = choices.below(FRAME + 1);
            vec![(0..length).map(|_| choices.byte()).collect()]
        }
        1 => {
            let topic = choices.byte().into();
            let value = value(choices);
            sealed(&Message::Broadcast { robot, topic, value })
        }
        2 | 3 => sealed(&Message::Entry(StigmergyEntry {
            stigmergy: choices.below(4) as u16,
            owner: robot,
            clock: clock(choices),
            key: value(choices),
            value: value(choices),
        })),
        4 if choices.flag() => sealed(&Message::Beacon { robot }),
        4 => {
            let digest = choices.byte().into();
            sealed(&Message::Digest { robot, digest, floor: clock(choices) })
        }
        5 => {
            let mut swarms = Swarms::default();
            for _ in 0..choices.below(5) {
                swarms.push(choices.below(4) as u16, choices.flag());
            }
            sealed(&Message::Swarms { robot, swarms })
        }
        kind => {
            let content =
                if kind == 6 { items::<P>(choices, script) } else { bytes(choices, script) };
            fragments::<P>(choices, robot, &content).iter().flat_map(sealed).collect()
        }
    }
}

fn clock(choices: &mut Choices<'_>) -> u32 {
    match choices.byte() {
        255 => u32::MAX >> choices.below(32),
        near => near.into(),
    }
}

fn value<P: Profile>(choices: &mut Choices<'_>) -> Value<P> {
    match choices.below(4) {
        0 => Value::nil(),
        1 => Value::int(i32::from(choices.byte()) - 3),
        2 => Value::float(f32::from(choices.byte()) / 2.0),
        _ => Value::string(choices.byte().into()),
    }
}

/// A content that begins with the right check.
fn bytes(choices: &mut Choices<'_>, script: ScriptIdentity) -> Vec<u8> {
    let content: Vec<u8> = (0..choices.below(CONTENT)).map(|_| choices.byte()).collect();
    let check = content.iter().fold(script.hash as u16, |check, byte| crc16(check, *byte));
    [&check.to_le_bytes()[..], &content].concat()
}

/// A content of items.
fn items<P: Profile>(choices: &mut Choices<'_>, script: ScriptIdentity) -> Vec<u8> {
    let head = if choices.flag() {
        Head::Broadcast
    } else {
        let stigmergy = [1, 9, 10][choices.below(3)];
        let owner = choices.below(8) as u16;
        Head::Entry { stigmergy, owner, clock: clock(choices), digest: choices.byte().into() }
    };
    let mut room = [0; CONTENT];
    let mut writer = ContentWriter::new(&mut room, script, head);
    let mut left = 2;
    while left > 0 {
        left -= 1;
        match choices.below(8) {
            0 => {
                let pairs = choices.below(4);
                writer.item::<P>(ContentItem::Table(pairs as u8));
                left += 2 * pairs;
            }
            1 if P::FULL => {
                let length = choices.below(12);
                writer.item::<P>(ContentItem::Text(length as u8));
                (0..length).for_each(|_| writer.byte(choices.byte()));
            }
            2 => writer.item::<P>(ContentItem::Function(choices.byte().into())),
            _ => writer.item::<P>(ContentItem::Plain(value(choices))),
        }
        if left > CONTENT {
            return Vec::new();
        }
    }
    let Some(length) = writer.finish() else { return Vec::new() };
    let content = room[..length].to_vec();
    let (again, reader) = ContentReader::new(&content, script);
    if reader.check::<P>(|_| {}).is_ok() {
        assert_eq!(again, head);
    }
    content
}

/// The fragments of a content, some of them twice, missing or somewhere else.
fn fragments<'c, P: Profile>(
    choices: &mut Choices<'_>,
    robot: u16,
    content: &'c [u8],
) -> Vec<Message<'c, P>> {
    let piece = if P::FULL { FULL_FRAME } else { TINY_FRAME } - FRAGMENT_HEAD;
    let pieces: Vec<&[u8]> = content.chunks(piece).take(8).collect();
    let number =
        if choices.flag() { choices.byte() } else { content.first().copied().unwrap_or(0) };
    let fragments = pieces.iter().enumerate().map(|(index, content)| {
        let last = index + 1 == pieces.len();
        Message::Fragment(Fragment { robot, number, index: index as u8, last, content })
    });
    let mut fragments: Vec<Message<'_, P>> = fragments.collect();
    if !fragments.is_empty() {
        for _ in 0..choices.below(4).saturating_sub(1) {
            let [from, to] = [0, 0].map(|_: u8| choices.below(fragments.len()));
            match choices.below(3) {
                0 => fragments.swap(from, to),
                1 => fragments.push(fragments[from]),
                _ => fragments[to] = fragments[from],
            }
        }
    }
    fragments
}
