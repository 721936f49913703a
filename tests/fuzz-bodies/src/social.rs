//! Changed images of scripts that talk, on two to four robots, together with changed, repeated and invented frames.
//!
//! Whatever an image does that the verifier accepts, and whatever is on the air: nothing panics, memory is as it must be,
//! a robot starts again after a fault, and what it sends in a step is bounded by what it ran and received.

use std::sync::OnceLock;

use bittybuzz_robot_spec::NumberProfile as ProfileName;
use bittybuzz_testkit::{Received, Recorder};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Entry, Image, ImageError, Outcome, Torture, Vm};

use crate::choices::Choices;
use crate::messages::SIZES;
use crate::{compile_text, mutation};

/// Scripts that use all there is between robots, in the ways that go wrong.
const SCRIPTS: &[&str] = &[
    r#"
n = 0
function show(x) {
  if(istable(x)) foreach(x, function(k, v) { n = (n + size(x)) % 1000 log(k, v) }) else log(x)
}
function init() {
  neighbors.listen("a", function(topic, value, robot) { log(topic, robot) show(value) })
  neighbors.listen("b", function(topic, value, robot) {
    n = robot % 7
    if(isclosure(value)) value(1, 2, 3)
    if(istable(value)) value.x = value
  })
  s = stigmergy.create(1)
  s.put("k", 0)
  s.onconflict(function(k, l, r) { show(l) s.put(k, n) if(l.robot > r.robot) return l return r })
  s.onconflictlost(function(k, l) { log(k) show(l.data) s.put("z", l) })
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
  if(n % 3 == 0) neighbors.broadcast("b", { .x = n, .y = { .1 = "a" }, .f = show })
  if(n % 4 == 0) neighbors.broadcast("b", show)
  s.put("k", n)
  s.put("t", { .1 = n, .2 = { .3 = 4 } })
  show(u.get(0.5))
  log(s.size(), u.size())
}
"#,
    r#"
t = {}
function init() {
  s = stigmergy.create(0)
  s.onconflict(function(k, l, r) {
    t[k] = l.data
    foreach(t, function(a, b) { t[a] = nil })
    return { .robot = r.robot, .data = t }
  })
  s.foreach(function(k, v, r) { log(k, v, r) })
  neighbors.listen("a", function(v, x, r) {
    t[r] = x
    s.put(r, x)
    neighbors.ignore("b")
    neighbors.listen("a", math.abs)
  })
}
function step() {
  var m = neighbors.map(function(r, d) { return d.distance + r })
  t.m = m
  s.put(1, neighbors.count())
  s.put("m", t)
  t = m.filter(function(r, d) { return r > 1 })
  s.foreach(function(k, v, r) { s.put(k, nil) s.put(r, k) t = clone({ .a = v }) })
  log(m.reduce(function(r, d, a) { return a + d }, 0))
  neighbors.broadcast("a", { .t = { .1 = 1 } })
  s = stigmergy.create(0)
  var z = swarm.create(3)
  z.select(id % 2)
  z.others(4).exec(function() { z.leave() return swarm.id() })
  neighbors.foreach(function(r, d) { neighbors.foreach(function(q, e) { delay(1) t = {} }) })
}
"#,
];

const SLOTS: usize = 420 + SIZES.slots();
type Machine<'i, P> = Box<Vm<P, &'i [u8], SLOTS>>;

/// Instructions that an entry gets. What goes on after them is cut off, and starts again.
const INSTRUCTIONS: u32 = 3000;

/// The most frames of one step for each instruction run, and those that timers send. An instruction, and the handling of a
/// message is one, leads to one message, which takes eight fragments at most.
const FRAMES: usize = 8;
const FRAMES_BY_TIMERS: usize = 8 * 12;

fn images() -> &'static [Vec<u8>] {
    static IMAGES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    IMAGES.get_or_init(|| {
        let profiles = [ProfileName::Tiny, ProfileName::Full];
        let all = profiles.iter().flat_map(|profile| {
            SCRIPTS.iter().map(|script| {
                let compiled = compile_text(script, *profile);
                compiled.image.unwrap_or_else(|| panic!("{:?}", compiled.diagnostics))
            })
        });
        all.collect()
    })
}

/// The first byte chooses an image and the second the number of changes to it, of four bytes each; the others decide about
/// robots and frames. Returns whether the verifier accepts the image.
pub fn run(data: &[u8]) -> bool {
    let mut choices = Choices::new(data);
    let images = images();
    let mut image = images[choices.below(images.len())].clone();
    for _ in 0..choices.below(8) {
        let [kind, low, high, value] = std::array::from_fn(|_| choices.byte());
        mutation::change(&mut image, kind, u16::from_le_bytes([low, high]), value);
    }
    match play::<Full>(&image, &mut choices) {
        Err(ImageError::Profile) => play::<Tiny>(&image, &mut choices).is_ok(),
        result => result.is_ok(),
    }
}

struct Robot<'i, P: Profile> {
    vm: Machine<'i, P>,
    host: Recorder,
    budget: u16,
    /// Frames that are not yet on the air.
    sent: Vec<Vec<u8>>,
    stage: Stage,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    Starts,
    Runs,
    Rests,
}

fn play<P: Profile>(image: &[u8], choices: &mut Choices<'_>) -> Result<(), ImageError> {
    let torture = Torture { collect_always: choices.flag(), ..Torture::default() };
    let slots = 100 + choices.below(256);
    let mut robots = Vec::new();
    for id in 1..=2 + choices.below(3) as u16 {
        let mut vm: Machine<'_, P> = Box::new(Vm::new());
        vm.set_network_capacity(SIZES);
        vm.load_limited(Image::new(image), slots, |_| true)?;
        vm.set_robot_id(id, 1);
        vm.torture = torture;
        let budget = 1 + u16::from(choices.byte() % 60);
        robots.push(Robot {
            vm,
            host: Recorder::default(),
            budget,
            sent: Vec::new(),
            stage: Stage::Starts,
        });
    }
    let mut air: Vec<Vec<u8>> = Vec::new();
    for _ in 0..12 {
        for robot in &mut robots {
            for _ in 0..choices.below(6) {
                let Some(frame) = frame(&air, choices) else { break };
                robot.host.link.push(received(&frame, choices));
            }
            step(robot, choices);
            // The recording would grow.
            robot.host.events.clear();
        }
        for from in 0..robots.len() {
            for frame in std::mem::take(&mut robots[from].sent) {
                for (to, robot) in robots.iter_mut().enumerate() {
                    if to != from {
                        robot.host.link.push(received(&frame, choices));
                    }
                }
                air.push(frame);
            }
        }
        let old = air.len().saturating_sub(60);
        air.drain(..old);
    }
    Ok(())
}

/// Returns an earlier frame with changes, or an invented one.
fn frame(air: &[Vec<u8>], choices: &mut Choices<'_>) -> Option<Vec<u8>> {
    if air.is_empty() {
        return None;
    }
    let mut frame = air[choices.below(air.len().min(256))].clone();
    if choices.flag() && frame.len() > 2 {
        frame[1] = choices.byte() % 6;
    }
    for _ in 0..choices.below(3) {
        let at = choices.below(frame.len());
        frame[at] = if choices.flag() { choices.byte() } else { frame[at] ^ 1 << choices.below(8) };
    }
    Some(frame)
}

fn received(frame: &[u8], choices: &mut Choices<'_>) -> Received {
    let known = choices.byte();
    Received {
        place: known.is_multiple_of(2).then_some([f32::from(known); 3]),
        sender: known.is_multiple_of(3).then_some(u16::from(known % 8)),
        ..Received::new(frame)
    }
}

fn step<P: Profile>(robot: &mut Robot<'_, P>, choices: &mut Choices<'_>) {
    if robot.stage == Stage::Rests && choices.flag() {
        robot.stage = Stage::Starts;
    }
    if robot.stage == Stage::Starts {
        robot.stage = Stage::Runs;
        for entry in [Entry::Global, Entry::Init] {
            enter(robot, entry);
        }
    }
    enter(robot, Entry::Step);
}

/// Runs an entry; after a fault, or where it does not end, the script rests.
fn enter<P: Profile>(robot: &mut Robot<'_, P>, entry: Entry) {
    if robot.stage == Stage::Rests && entry != Entry::Step || !robot.vm.begin(entry) {
        return;
    }
    let mut instructions = 0;
    let ended = loop {
        let outcome = robot.vm.run(&mut robot.host, robot.budget);
        instructions += u32::from(robot.budget);
        assert_eq!(robot.vm.audit(), Ok(()));
        match outcome {
            Outcome::Done => break true,
            Outcome::Fault(fault) => {
                assert!(
                    robot.stage != Stage::Rests,
                    "a resting robot fails: {fault:?}, {} slots free",
                    robot.vm.free_slots()
                );
                break false;
            }
            Outcome::Pending | Outcome::Waiting if instructions >= INSTRUCTIONS => break false,
            Outcome::Pending | Outcome::Waiting => {}
        }
    };
    let sent: Vec<_> = std::iter::from_fn(|| robot.host.link.pop_sent()).collect();
    // The handling of a message is an instruction, too.
    let most = FRAMES * instructions as usize + FRAMES_BY_TIMERS;
    assert!(sent.len() <= most, "{} frames in {instructions} instructions", sent.len());
    robot.sent.extend(sent);
    assert!(robot.stage != Stage::Rests || ended, "a resting robot neither fails nor goes on");
    if !ended {
        robot.vm.restart();
        assert_eq!(robot.vm.audit(), Ok(()));
        robot.stage = Stage::Rests;
    }
}
