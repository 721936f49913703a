//! Scripts that make large structures and work on them: no instruction may take longer than the sizes of memory and image
//! allow. Work is counted in accesses to slots and bytes of the image, so the same input always takes the same.

use std::cell::Cell;
use std::collections::VecDeque;
use std::fmt::Write;
use std::hint::black_box;

use bittybuzz_robot_spec::NumberProfile as ProfileName;
use bittybuzz_vm_core::message::Fragment;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, CountedCode, Entry, Host, Image, Outcome, Reply, RobotFault,
    Sighting, Sizes, Value, Vm,
};

use crate::choices::Choices;
use crate::compile_text;

const SIZES: Sizes = Sizes { neighbors: 15, bearings: true, entries: 8, swarms: 4 };
/// Large, so that work that grows faster than memory stands out.
const SCRIPT_SLOTS: usize = 2000;
const SLOTS: usize = SCRIPT_SLOTS + SIZES.slots();
type Machine<'a, P> = Vm<P, CountedCode<'a>, SLOTS>;

/// The most accesses of an instruction for each slot of a script's memory, and for each byte of the image; and those that
/// depend on neither, such as for a message. A table is walked a few times at most. A slot of a text, which only the profile
/// `full` has, holds four bytes, and each of them is read and written by itself.
const PER_SLOT: u64 = 4;
const PER_TEXT_SLOT: u64 = 16;
const PER_BYTE: u64 = 2;
const CONSTANT: u64 = 2000;

/// Instructions of an entry.
const INSTRUCTIONS: u32 = 20_000;

/// The statements that an input may choose, `K` for a key and `V` for a value.
const STATEMENTS: &[&str] = &[
    "t[K] = V",
    "t[K] = nil",
    "u[K] = V",
    "u[K] = nil",
    "math[K] = V",
    "math[K] = nil",
    "x = t[K]",
    "x = t",
    "t = { }",
    "t = clone(u)",
    "t = map(u, pick)",
    "t = filter(u, pick)",
    "x = reduce(t, pick, 0)",
    "foreach(t, pick)",
    "foreach(math, pick)",
    "x = size(t) + size(math)",
    "m = math log(m, t, m)",
    "x = neighbors.kin().count() + neighbors.nonkin().count()",
    "w.exec(function() { x = neighbors.kin() })",
    "neighbors.foreach(pick)",
    "neighbors.broadcast(\"a\", t)",
    "neighbors.broadcast(\"a\", V)",
    "s.put(K, V)",
    "x = s.get(K)",
    "s.foreach(pick)",
    "x = s.size()",
    "if(t == u or t == x) x = 1",
    "x = x == V",
];

/// Those of the profile `full`.
const TEXTS: &[&str] = &[
    "x = string.tostring(K)",
    "if(isstring(x)) x = string.concat(x, x, \"ab\")",
    "if(isstring(x)) x = string.sub(x, 1, K)",
    "if(isstring(x)) t[x] = 1",
    "if(isstring(x)) u[string.concat(x, string.tostring(i))] = V",
    "if(isstring(x)) n = string.toint(x)",
    "if(isstring(x)) x = x < \"ab\"",
];

const KEYS: &[&str] = &["i", "0 - i", "n - i", "i * 7", "i % 5", "n", "3", "\"k\""];
const VALUES: &[&str] = &["1", "i", "t", "u", "x", "\"v\"", "2.5", "pick"];

/// The script that an input decides.
fn script(choices: &mut Choices<'_>, full: bool) -> String {
    let mut text = String::from(
        "t = { } u = { } x = 0 n = 0 m = nil s = stigmergy.create(1) w = swarm.create(1)
         function pick(k, v, a) { x = v return k }
         function init() { w.join() neighbors.listen(\"a\", pick) }
         function step() { var i = 0\n",
    );
    for _ in 0..1 + choices.below(8) {
        let count = 4 * u16::from(choices.byte());
        let statement = match choices.below(STATEMENTS.len() + TEXTS.len()) {
            index if index < STATEMENTS.len() => STATEMENTS[index],
            index if full => TEXTS[index - STATEMENTS.len()],
            _ => STATEMENTS[0],
        };
        let statement = statement
            .replace('K', KEYS[choices.below(KEYS.len())])
            .replace('V', VALUES[choices.below(VALUES.len())]);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "n = {count} for(i = 0, i < n, i = i + 1) {{ {statement} }}");
        if choices.flag() {
            text.push_str(&statement);
            text.push('\n');
        }
    }
    text + "}"
}

/// The first byte decides the profile, the others a script. Returns whether one of its entries came to its end.
pub fn run(data: &[u8]) -> bool {
    match data.split_first() {
        Some((first, rest)) if first % 2 == 0 => measure::<Tiny>(rest, ProfileName::Tiny),
        Some((_, rest)) => measure::<Full>(rest, ProfileName::Full),
        None => false,
    }
}

fn measure<P: Profile>(data: &[u8], profile: ProfileName) -> bool {
    let script = script(&mut Choices::new(data), P::FULL);
    let compiled = compile_text(&script, profile);
    let image = compiled.image.unwrap_or_else(|| panic!("{script}\n{:?}", compiled.diagnostics));
    let reads = Cell::new(0);
    let mut vm: Box<Machine<'_, P>> = Box::new(Vm::new());
    vm.set_network_capacity(SIZES);
    if let Err(error) = vm.load(Image::new(CountedCode::new(&image, &reads)), |_| true) {
        panic!("{script}\n{error:?}");
    }
    for robot in 2..10 {
        vm.add_neighbor(robot, &Sighting::default(), u8::MAX);
    }
    let per_slot = if P::FULL { PER_TEXT_SLOT } else { PER_SLOT };
    let most = per_slot * SCRIPT_SLOTS as u64 + PER_BYTE * image.len() as u64 + CONSTANT;
    let mut link = Echo { frames: VecDeque::new(), contents: VecDeque::new() };
    let mut has_ended = false;
    for entry in [Entry::Global, Entry::Init, Entry::Step, Entry::Step] {
        if !vm.begin(entry) {
            break;
        }
        for _ in 0..INSTRUCTIONS {
            let before = vm.accesses() + reads.get();
            let outcome = vm.run(&mut link, 1);
            let work = vm.accesses() + reads.get() - before;
            guide(work * 64 / most);
            assert!(
                work <= most,
                "an instruction takes {work} accesses, more than {most}\n{script}"
            );
            match outcome {
                Outcome::Pending | Outcome::Waiting => {}
                Outcome::Done => {
                    has_ended = true;
                    break;
                }
                Outcome::Fault(_) => return has_ended,
            }
        }
    }
    has_ended
}

/// Shows the fuzzer that an input takes more work than others: each share of the bound is a branch of its own.
fn guide(share: u64) {
    macro_rules! branches {
        ($($number:literal)*) => {
            $(if share > $number {
                black_box($number);
            })*
        };
    }
    branches!(1 2 3 4 6 8 12 16 20 24 28 32 36 40 44 48 52 56 60);
}

/// A robot that receives its own frames as if another robot had sent them.
struct Echo {
    frames: VecDeque<Vec<u8>>,
    /// The contents of the long messages in `frames`, which has the first bytes of a fragment for
    /// each.
    contents: VecDeque<Vec<u8>>,
}

impl<P: Profile> Host<P> for Echo {
    fn call<C: ByteCode, const N: usize>(
        &mut self,
        _: u16,
        _: CallArguments<'_, P, C, N>,
        _: bool,
    ) -> Result<Reply<P>, RobotFault> {
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const N: usize>(&mut self, _: CallArguments<'_, P, C, N>) {}

    fn delay_is_over(&mut self, _: i32, _: bool) -> bool {
        true
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }

    fn receive(&mut self, frame: &mut [u8], _: &mut Sighting<P>) -> Option<usize> {
        let received = self.frames.pop_front()?;
        frame.get_mut(..received.len())?.copy_from_slice(&received);
        Some(received.len())
    }

    fn receive_content(&mut self, content: &mut [u8]) -> usize {
        let received = self.contents.pop_front().expect("each head in the queue has a content");
        content[..received.len()].copy_from_slice(&received);
        received.len()
    }

    fn send_content(&mut self, robot: u16, content: &[u8]) -> bool {
        let has_room = self.frames.len() < 30;
        if has_room {
            let robot = robot.wrapping_add(1);
            let head = Fragment { robot, number: 0, index: 0, last: false, content: &[] }.head();
            self.frames.push_back(head.to_vec());
            self.contents.push_back(content.to_vec());
        }
        has_room
    }

    fn send(&mut self, frame: &[u8]) {
        // The sender of a beacon and a broadcast (docs/wire-format.md).
        let mut frame = frame.to_vec();
        if let [_, low, ..] = frame.as_mut_slice() {
            *low = low.wrapping_add(1);
        }
        if self.frames.len() < 30 {
            self.frames.push_back(frame);
        }
    }
}
