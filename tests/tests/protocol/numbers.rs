//! Numbers of stigmergies: whatever numbers a script chooses, its first three stigmergies take one frame per entry.

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_testkit::{Program, SIZES, Swarm, TestRobot};
use bittybuzz_vm_core::image::Image;
use bittybuzz_vm_core::message::FrameKind;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Sizes, Value};
use std::cell::RefCell;
use std::rc::Rc;

/// Two robots with room for more stigmergies than those of other tests.
fn pair<P: Profile>(script: &str) -> Swarm<P> {
    let program = Program::new::<P>(script);
    let symbols = Rc::new(program.symbols.clone());
    of_image(program.leak(), &symbols)
}

fn of_image<P: Profile>(image: &'static [u8], symbols: &Rc<Symbols>) -> Swarm<P> {
    let robots = [1, 2].map(|id| {
        let mut robot = TestRobot::new(image, id, Sizes { entries: 12, ..SIZES });
        robot.host.symbols = Some(symbols.clone());
        robot
    });
    Swarm::of(robots.into())
}

/// Kind and length of each frame that two robots send in a number of steps.
fn frames<P: Profile>(swarm: &mut Swarm<P>, steps: usize) -> Vec<(FrameKind, usize)> {
    let frames = Rc::new(RefCell::new(Vec::new()));
    let seen = frames.clone();
    swarm.air.observe = Box::new(move |frame| {
        let kind = FrameKind::of(frame.bytes[0]).expect("a frame of ours");
        seen.borrow_mut().push((kind, frame.bytes.len()));
    });
    swarm.steps(steps);
    swarm.air.observe = Box::new(|_| {});
    frames.take()
}

/// Numbers that `tiny` can represent, and the greatest number.
fn numbers<P: Profile>() -> &'static [u16] {
    if P::FULL { &[0, 3, 5, 101, 65535] } else { &[0, 3, 5, 101, 32767] }
}

#[test]
fn the_frames_are_the_same_whatever_the_number() {
    fn run<P: Profile>() {
        let of = |number: u16| {
            let script = format!(
                "NUMBER = {number}
                 function init() {{ v = stigmergy.create(NUMBER) v.put(id, id) v.put(\"k\", 1.5) }}
                 function step() {{ v.get(7) log(v.size(), \" \", v.id) }}"
            );
            let mut swarm = pair::<P>(&script);
            let frames = frames(&mut swarm, 40);
            assert_eq!(swarm.last(), [format!("3 {number}"), format!("3 {number}")]);
            frames
        };
        let expected = of(0);
        assert!(expected.iter().any(|(kind, _)| *kind == FrameKind::Entry));
        assert!(!expected.iter().any(|(kind, _)| *kind == FrameKind::Fragment));
        for number in numbers::<P>() {
            assert_eq!(of(*number), expected, "{}: {number}", P::NAME);
        }
    }
    run::<Tiny>();
    run::<Full>();
}

#[test]
fn only_the_fourth_stigmergy_takes_fragments() {
    fn run<P: Profile>(fragments: usize) {
        // In one order and in the other: the first three are those that come first.
        for backwards in [false, true] {
            let mut order = numbers::<P>().to_vec();
            if backwards {
                order.reverse();
            }
            for (place, number) in order.iter().enumerate() {
                let mut script = String::from("function init() {\n");
                for number in &order {
                    script += &format!("v{number} = stigmergy.create({number})\n");
                }
                script += &format!("}} function step() {{ if(id == 1) v{number}.put(1, 2) }}");
                let mut swarm = pair::<P>(&script);
                // The first step of the first robot sends nothing but the entry, and its digest.
                swarm.robots[0].step().expect("no fault");
                let sent = swarm.robots[0].take_sent();
                let count = |kind| {
                    sent.iter().filter(|frame| FrameKind::of(frame[0]) == Some(kind)).count()
                };
                let expected = if place < 3 { (1, 0) } else { (0, fragments) };
                let found = (count(FrameKind::Entry), count(FrameKind::Fragment));
                assert_eq!(found, expected, "{}: {number} of {order:?}", P::NAME);
            }
        }
    }
    run::<Tiny>(3);
    run::<Full>(1);
}

/// A constant and a number that is known at run time only are the same stigmergy if they are equal. Numbers that are not in
/// the script meet none of those that are, although the messages of these have small numbers.
#[test]
fn computed_numbers_are_the_stigmergies_of_these_numbers() {
    fn run<P: Profile>() {
        let mut swarm = pair::<P>(
            "function put(n) { stigmergy.create(n).put(1, n) }
             function get(n) { return stigmergy.create(n) }
             function init() {
               a = stigmergy.create(101)
               b = stigmergy.create(7)
               c = stigmergy.create(9)
               if(id == 1) {
                 # None of these is a constant of the script.
                 for(i = size({.x = 1}) - 1, i < 3, i = i + 1) { put(i) }
                 a.put(1, 101) b.put(1, 7) c.put(1, 9)
               } else {
                 t = {}
                 for(i = size(t), i < 3, i = i + 1) { t[i] = get(i) }
                 t[3] = get(100 + size({.x = 1}))
               }
             }
             function step() {
               if(id == 2) {
                 log(t[0].get(1), t[1].get(1), t[2].get(1), \" \", a.get(1), \" \", t[3].get(1), \" \",
                   b.get(1), c.get(1), \" \", t[0].id, t[1].id, t[2].id, \" \", t[3].id)
               }
             }",
        );
        swarm.steps(60);
        assert_eq!(swarm.last(), ["", "012 101 101 79 012 101"], "{}", P::NAME);
    }
    run::<Tiny>();
    run::<Full>();
}

/// Tables and float keys travel in fragments, with the number of the stigmergy in messages.
#[test]
fn long_entries_of_any_number_arrive() {
    fn run<P: Profile>() {
        for number in numbers::<P>() {
            let script = format!(
                "function init() {{
                   v = stigmergy.create({number})
                   w = stigmergy.create(2)
                   if(id == 1) {{ v.put(\"t\", {{.a = 8}}) v.put(2.5, 3) w.put(2.5, 4) }}
                 }}
                 function step() {{
                   if(not isnil(v.get(\"t\"))) log(v.get(\"t\").a, v.get(2.5), w.get(2.5), v.size(), w.size())
                 }}"
            );
            let mut swarm = pair::<P>(&script);
            swarm.steps(30);
            assert_eq!(swarm.last(), ["83421"; 2], "{}: {number}", P::NAME);
        }
    }
    run::<Tiny>();
    run::<Full>();
}

/// A restart of the script finds its stigmergy again, and handlers know their number.
#[test]
fn a_restart_keeps_the_entries_of_any_number() {
    let script = "n = 0 function init() { v = stigmergy.create(101) v.onconflict(function(k, a, b) { return a }) }
        function step() { n = n + 1 if(n == 3 and id == 1) v.put(1, 5) log(v.get(1), \" \", v.id) }";
    let mut swarm = pair::<Tiny>(script);
    swarm.steps(10);
    assert_eq!(swarm.last(), ["5 101"; 2]);
    let robot = &mut swarm.robots[1];
    robot.rest();
    robot.start().expect("no fault");
    robot.step().expect("no fault");
    assert_eq!(robot.host.last_log(), Some("5 101".to_owned()));
    assert_eq!(robot.vm.stigmergies().collect::<Vec<_>>(), [101]);
}

/// A table that no compiler writes gives some stigmergies the number of others, and harms nothing else.
#[test]
fn any_table_can_be_run() {
    let script = "function init() { for(i = size({}), i < 9, i = i + 1) { v = stigmergy.create(i) v.put(i, i) log(v.id) } }
        function step() { stigmergy.create(5).foreach(function(k, v, r) { log(k) }) }";
    let mut program = Program::new::<Tiny>(&format!("w = stigmergy.create(5) {script}"));
    let symbols = Rc::new(program.symbols.clone());
    let header = Image::new(program.image.as_slice()).header().expect("an image");
    let at = usize::from(header.stigmergies_at().expect("a number is above 2"));
    assert_eq!(program.image[at..at + 6], [5, 0, 1, 0, 2, 0]);
    for table in [[5, 5, 5], [1, 2, 0], [2, 1, 0], [0, 0, 0], [65535, 65534, 7]] {
        for (row, number) in table.iter().enumerate() {
            program.image[at + 2 * row..][..2].copy_from_slice(&u16::to_le_bytes(*number));
        }
        let mut swarm: Swarm<Tiny> = of_image(Vec::leak(program.image.clone()), &symbols);
        swarm.steps(20);
        assert!(swarm.robots[1].vm.replica(8, Value::int(8)).is_some(), "{table:?}");
    }
}
