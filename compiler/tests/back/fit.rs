//! A script that cannot run on a robot is refused when it is built: what it needs is what the machine needs.

use bittybuzz_compiler::compile::Options;
use bittybuzz_compiler::diagnostic::Diagnostic;
use bittybuzz_compiler::fit::{CapacityError, capacity_errors, for_flash, sealed};
use bittybuzz_robot_spec::Robot;
use bittybuzz_testkit::Recorder;
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::seal::{self, SealedImage};
use bittybuzz_vm_core::{Entry, FaultCode, Image, ImageError, Outcome, Parts, Sizes, Vm, features};

use crate::back::machine::{TINY, build_with, image, robot};

fn diagnostics(script: &str, robot: Robot) -> Vec<Diagnostic> {
    build_with(script, &Options { robot: Some(robot), ..Options::default() }).diagnostics
}

fn codes(script: &str, robot: Robot) -> Vec<&'static str> {
    diagnostics(script, robot).iter().map(|diagnostic| diagnostic.code.text()).collect()
}

fn with_slots(slots: u32) -> Robot {
    robot(|robot| robot.vm.slots = slots)
}

/// Scripts that keep nothing in tables and take their deepest way; none recurses.
const SCRIPTS: [&str; 10] = [
    "",
    "x = 1",
    "x = 1 function step() { x = 1 + 2 * x }",
    "function a(p, q) { return p + q } function step() { x = a(1, a(2, 3)) }",
    "
    function c(p) { var u = p var v = p var w = p return u + v + w + (p - (p * (2 - p))) }
    function b(p, q) { var r = c(p) return r + c(q) }
    function a(p) { var x = p * 2 if(x) { var y = x x = b(x, y) + b(y, x) } return x }
    function init() { g = a(1) + a(2) h = g k = h }
    function step() { g = a(3) }
    function destroy() { g = a(a(a(4))) }",
    "
    function leaf(a, b, c, d, e, f, g, h, i, j, k, l, m, n) { return a + n }
    function way(p) { if(p > 0 and leaf(p, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13) > 0) return 1 return 0 }
    function init() { var i = 0 while(i < 3 or way(i) > 0) { i = i + 1 if(i > 5) return way(1) } }",
    "
    function deep(a) {
      return 1 - (a - (2 - (a - (3 - (a - (4 - (a - (5 - (a - (6 - (a - (7 - (a - (8 - a))))))))))))))
    }
    x = 1 - (2 - (3 - (4 - deep(4))))",
    "
    function s(a) { return a }
    function late(a) { for(i = 0, i < a, i = i + 1) { if(i == 2) s(s(s(i))) else s(0) } return i }
    function step() { y = not (late(4) == 4) and s(1) or late(4) x = y }",
    "function step(a, b) { return 1 - (2 - (3 - (4 - (5 - (6 - (7 - (8 - (x - 10)))))))) } x = 1",
    "
    function one() { return two() + two() }
    function two() { var a = three(1, 2, 3) var b = three(a, a, a) return a + b }
    function three(a, b, c) { var d = a var e = b var f = c return d + e * (f - (a - (b - c))) }
    z = one()",
];

/// Loads and runs with so many slots.
fn fault(image: &[u8], slots: usize) -> Result<(), FaultCode> {
    let mut vm: Box<Vm<Tiny, &[u8], 400>> = Box::new(Vm::new());
    match vm.load_limited(Image::new(image), slots, |_| true) {
        Ok(()) => {}
        Err(ImageError::TooManyGlobals(_)) => return Err(FaultCode::StackOverflow),
        Err(error) => panic!("{error:?}"),
    }
    for entry in [Entry::Global, Entry::Init, Entry::Step, Entry::Reset, Entry::Destroy] {
        if !vm.begin(entry) {
            continue;
        }
        match vm.run(&mut Recorder::default(), u16::MAX) {
            Outcome::Done => {}
            Outcome::Fault(fault) => return Err(fault.code),
            outcome => panic!("{outcome:?}"),
        }
    }
    Ok(())
}

#[test]
fn computed_memory_equals_the_memory_that_the_machine_needs() {
    let mut robot = with_slots(0);
    for script in SCRIPTS {
        let (image, _) = image(script, TINY);
        let mut fits = |slots| {
            robot.vm.slots = slots;
            capacity_errors(&image, &robot).is_empty()
        };
        let enough = (1..400).find(|slots| fits(*slots)).expect("400 slots are enough");
        assert_eq!(fault(&image, enough as usize), Ok(()), "{enough} slots\n{script}");
        let fault = fault(&image, enough as usize - 1);
        assert_eq!(fault, Err(FaultCode::StackOverflow), "{enough} slots\n{script}");
        assert!((enough..400).all(fits), "{script}");
    }
}

#[test]
fn too_many_globals_are_reported_at_the_first_that_does_not_fit() {
    // 16 slots in addition to the globals.
    let script = "a = 1 b = 2\nc = a + b\nd = c";
    assert_eq!(codes(script, with_slots(20)), [""; 0]);
    let errors = diagnostics(script, with_slots(18));
    let [error] = errors.as_slice() else { panic!("{errors:?}") };
    assert_eq!(error.code.text(), "E0606");
    assert_eq!(error.message, "4 globals need 20 slots of memory, the Kilobot has 18");
    assert_eq!(script.get(error.span.start as usize..error.span.end as usize), Some("c"));
    assert!(error.help.as_ref().is_some_and(|help| help.starts_with("at most 2 fit")), "{error:?}");
}

#[test]
fn too_deep_calls_are_reported_with_the_call_path() {
    let script = SCRIPTS[9];
    assert_eq!(codes(script, with_slots(22)), [""; 0]);
    let errors = diagnostics(script, with_slots(17));
    let [error] = errors.as_slice() else { panic!("{errors:?}") };
    assert_eq!(error.code.text(), "E0609");
    assert!(error.message.starts_with("`global code` -> `one()` -> `two()` -> `three()` needs "));
    let place = script.get(error.span.start as usize..error.span.end as usize);
    assert_eq!(place, Some("three(a, a, a)"), "{error:?}");
}

#[test]
fn recursive_calls_count_once() {
    let script = "
        function even(n) { var a = n var b = n var c = n var d = n if(n == 0) return a return d + b + odd(n - 1) + c }
        function odd(n) { var a = n var b = n var c = n var d = n if(n == 0) return a return d + b + even(n - 1) + c }
        function step() { x = even(10) }";
    assert_eq!(codes(script, with_slots(40)), [""; 0]);
    let (image, _) = image(script, TINY);
    let found = capacity_errors(&image, &with_slots(17));
    let [CapacityError::Stack { path, .. }] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!((path.functions.len(), path.calls.len()), (3, 2));
}

#[test]
fn capacity_checks_accept_any_bytes() {
    let (image, _) = image(SCRIPTS[4], TINY);
    let robot = with_slots(30);
    for at in 0..image.len() {
        for byte in [0, 1, 0x7f, 0x80, 0xff] {
            let mut damaged = image.clone();
            damaged[at] = byte;
            capacity_errors(&damaged, &robot);
            capacity_errors(&damaged[..at], &robot);
        }
    }
}

#[test]
fn an_image_must_fit_the_flash() {
    let small = robot(|robot| robot.budget.as_mut().unwrap().flash_bytes = 30);
    assert_eq!(codes("a = 1", small.clone()), [""; 0]);
    assert_eq!(codes("a = 1 b = 2 c = a + b log(a, b, c)", small), ["E0607"]);
    // Where the script has flash of its own, that counts: of 70 bytes after the header the firmware
    // reads 64, and the seal takes 30.
    let mut zooids = bittybuzz_robot_files::find("zooids").unwrap();
    zooids.layout.as_mut().unwrap().script.size = 4 + 70;
    let errors = diagnostics(&"a = 1 b = 2 c = a + b log(a, b, c) ".repeat(3), zooids);
    let [error] = errors.as_slice() else { panic!("{errors:?}") };
    assert_eq!(error.code.text(), "E0607");
    assert!(error.message.ends_with("has room for 34"), "{error:?}");
}

#[test]
fn a_robot_must_have_what_a_script_needs() {
    let deaf = robot(|robot| robot.vm.neighbors = 0);
    let script = "x = 1\nlog(neighbors.count())";
    let errors = diagnostics(script, deaf);
    let [error] = errors.as_slice() else { panic!("{errors:?}") };
    assert_eq!(error.code.text(), "E0608");
    assert!(script[error.span.start as usize..].starts_with("neighbors"), "{error:?}");
    let simple = || robot(|robot| robot.vm.maths = false);
    for script in ["x = 2 x = x ^ 2", "log(math.sqrt(2))", "f = math.sin", "m = math m.sin(1)"] {
        assert_eq!(codes(script, simple()), ["E0608"], "{script}");
    }
    for script in ["x = 2 x = x * 2.5", "log(math.abs(2), math.min(1, 2))"] {
        assert_eq!(codes(script, simple()), [""; 0], "{script}");
    }
}

/// What the tool seals for a robot file, a machine of that robot's sizes opens, and no other.
#[test]
fn a_sealed_image_is_for_its_robot() {
    let kilobot = bittybuzz_robot_files::find("kilobot").unwrap();
    let script = "function step() { forward() neighbors.broadcast(1, 2) }";
    let image = build_with(script, &Options { robot: Some(kilobot.clone()), ..Options::default() })
        .image
        .unwrap();
    let bytes = sealed(&image, &kilobot).unwrap();
    assert_eq!(bytes[..image.len()], image);
    const SIZES: Sizes = Sizes { neighbors: 15, bearings: false, entries: 4, swarms: 8 };
    const SLOTS: usize = 339 + SIZES.slots();
    let functions: Vec<u16> = kilobot.functions.iter().map(|function| function.hash()).collect();
    let robot = seal::robot::<Tiny>(features::<Tiny>(), SIZES, Parts::ALL, &functions);
    let mut vm: Box<Vm<Tiny, &[u8], SLOTS>> = Box::new(Vm::new());
    vm.set_network_capacity(SIZES);
    assert_eq!(vm.load_sealed(SealedImage::new(&bytes), robot), Ok(()));
    let mut smaller: Box<Vm<Tiny, &[u8], { SLOTS - 1 }>> = Box::new(Vm::new());
    smaller.set_network_capacity(SIZES);
    assert_eq!(smaller.load_sealed(SealedImage::new(&bytes), robot), Err(ImageError::Seal));

    // Both robots can run it, with other functions and memory.
    let of_a_zooid = sealed(&image, &bittybuzz_robot_files::find("zooids").unwrap()).unwrap();
    assert_eq!(vm.load_sealed(SealedImage::new(&of_a_zooid), robot), Err(ImageError::Seal));
    let crazyflie = bittybuzz_robot_files::find("crazyflie").unwrap();
    assert_eq!(sealed(&image, &crazyflie), Err(ImageError::Profile));
}

#[test]
fn an_image_gets_a_seal_if_the_robot_file_says_so() {
    let zooids = bittybuzz_robot_files::find("zooids").unwrap();
    let (image, _) = image("function step() { led(1) }", TINY);
    assert_eq!(for_flash(&image, &zooids).unwrap(), sealed(&image, &zooids).unwrap());
    let mut verified = zooids.clone();
    verified.layout.as_mut().unwrap().script_sealed = false;
    assert_eq!(for_flash(&image, &verified).unwrap(), image);
    // The robot itself checks it.
    assert_eq!(for_flash(b"no image", &verified).unwrap(), &b"no image"[..]);
    assert_eq!(for_flash(b"no image", &zooids), Err(ImageError::NotAnImage));
}
