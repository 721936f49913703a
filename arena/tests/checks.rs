//! Checks of scripts: every anomaly with its count and first example, memory, and the same run with and without them.

use crate::busy;
use crate::script;
use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::robot::ProgramId;
use bittybuzz_arena::robot::checks::{
    Anomaly, Exact, Findings, MachineChecker, Occurrences, RunSlice,
};
use bittybuzz_arena::run::{Setup, Simulation};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::profile::NumberProfile as ProfileName;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_vm_core::number::{Full, Number, Profile, Tiny};
use bittybuzz_vm_core::{
    Argument, Axis, ByteCode, CallArguments, Entry, Host, Image, Outcome, Reply, RobotFault, Sizes,
    Value, Vm,
};

const SIZES: Sizes = Sizes { neighbors: 4, bearings: false, entries: 6, swarms: 2 };

type Machine<'i, P> = Vm<P, &'i [u8], 1024>;

/// A robot that can do nothing but log.
#[derive(Debug, Default, PartialEq)]
struct Logger {
    lines: Vec<String>,
}

impl<P: Profile> Host<P> for Logger {
    fn call<C: ByteCode, const N: usize>(
        &mut self,
        _: u16,
        _: CallArguments<'_, P, C, N>,
        _: bool,
    ) -> Result<Reply<P>, RobotFault> {
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const N: usize>(&mut self, arguments: CallArguments<'_, P, C, N>) {
        let item = |index| match arguments.item(index) {
            Argument::Int(value) => value.to_string(),
            Argument::Float(value) => format!("{value:?}"),
            Argument::String(text) => format!("{:?}", text.bytes().collect::<Vec<u8>>()),
            _ => "-".to_owned(),
        };
        self.lines.push((0..arguments.count()).map(item).collect::<Vec<_>>().join(" "));
    }

    fn delay_is_over(&mut self, _: i32, again: bool) -> bool {
        again
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }
}

fn compiled<P: Profile>(script: &str) -> (Vec<u8>, Symbols) {
    let profile = if P::FULL { ProfileName::Full } else { ProfileName::Tiny };
    let options = Options { profile: Some(profile), ..Options::default() };
    let files = MemoryFiles::default();
    let found =
        compile(Path::new("test.bzz"), script.to_owned(), &IncludeLoader::new(&files), &options);
    let image = found.image.unwrap_or_else(|| panic!("{:#?}\n{script}", found.diagnostics));
    (image, found.symbols.unwrap())
}

fn machine<P: Profile>(image: &[u8], slots: usize) -> Machine<'_, P> {
    let mut vm = Machine::new();
    vm.set_network_capacity(SIZES);
    vm.load_limited(Image::new(image), slots, |_| true).unwrap();
    vm.set_robot_id(7, 1);
    vm
}

/// Runs the script and this many steps, in slices of that budget. Returns the outcomes of all slices.
fn drive<P: Profile>(
    vm: &mut Machine<'_, P>,
    steps: u64,
    mut run: impl FnMut(&mut Machine<'_, P>, u64, bool) -> Outcome,
) -> Vec<(Outcome, Vec<u16>)> {
    let mut ends = Vec::new();
    let entries = [(Entry::Global, 0), (Entry::Init, 0)];
    for (entry, tick) in entries.into_iter().chain((1..=steps).map(|tick| (Entry::Step, tick))) {
        if !vm.begin(entry) {
            continue;
        }
        loop {
            let outcome = run(vm, tick, entry == Entry::Step);
            ends.push((outcome, vm.calls().collect()));
            match outcome {
                Outcome::Pending | Outcome::Waiting => {}
                Outcome::Done => break,
                Outcome::Fault(_) => return ends,
            }
        }
    }
    ends
}

/// Runs a script that is checked; none of its entries may fail.
fn findings<P: Profile>(script: &str, steps: u64) -> Findings {
    let (image, _) = compiled::<P>(script);
    let mut checker = MachineChecker::new(7, None);
    let mut host = Logger::default();
    let ends = drive(&mut machine::<P>(&image, 900), steps, |vm, tick, is_step| {
        checker.run(vm, &mut host, RunSlice { budget: 1000, tick, is_step })
    });
    assert_eq!(ends.last().unwrap().0, Outcome::Done, "{script}");
    checker.findings().clone()
}

/// An anomaly as people read it: kind, count, operation, exact result, the machine's result.
type Line = (Anomaly, u64, String, String, String);

fn lines(findings: &Findings) -> Vec<Line> {
    let line = |((_, anomaly), found): (&(u16, Anomaly), &Occurrences)| {
        let Occurrences { count, first } = found;
        let exact = match first.exact {
            Exact::Int(value) => value.to_string(),
            Exact::Real(value) => format!("{value:?}"),
            Exact::Unknown => "?".to_owned(),
        };
        let result = match first.result {
            Number::Int(value) => value.to_string(),
            Number::Float(value) => format!("{value:?}"),
        };
        (*anomaly, *count, first.operation.to_string(), exact, result)
    };
    findings.places.iter().map(line).collect()
}

/// Runs code in each of two steps, after global code, and compares its only anomaly.
#[track_caller]
fn only<P: Profile>(
    global: &str,
    code: &str,
    anomaly: Anomaly,
    operation: &str,
    exact: &str,
    result: &str,
) {
    let script = format!("{global}\nfunction step() {{ {code} }}\n");
    let found = findings::<P>(&script, 2);
    let texts = [operation, exact, result].map(str::to_owned);
    let [operation, exact, result] = texts;
    assert_eq!(lines(&found), [(anomaly, 2, operation, exact, result)], "{script}");
    let first = found.places.values().next().unwrap().first.at;
    assert_eq!((first.tick, first.robot), (1, 7));
}

#[track_caller]
fn none<P: Profile>(global: &str, code: &str) {
    let script = format!("{global}\nfunction step() {{ {code} }}\n");
    assert_eq!(lines(&findings::<P>(&script, 2)), [], "{script}");
}

/// 2^15 is the first integer that `tiny` does not have.
#[test]
fn integers_of_16_bits_wrap() {
    use Anomaly::Wrapped;
    let wraps = |global: &str, code: &str, operation: &str, exact: i64| {
        // The low 16 bits, as a signed number.
        let result = (exact + 0x8000).rem_euclid(0x10000) - 0x8000;
        let (exact, result) = (exact.to_string(), result.to_string());
        only::<Tiny>(global, code, Wrapped, operation, &exact, &result);
    };
    wraps("d = 300", "log(d * d)", "300 * 300", 90_000);
    wraps("m = 32767 n = 1", "log(m + n)", "32767 + 1", 32_768);
    wraps("m = -32767 n = 2", "log(m - n)", "-32767 - 2", -32_769);
    wraps("m = -32767 - 1 n = -1", "log(m / n)", "-32768 / -1", 32_768);
    wraps("m = -32767 - 1", "log(-m)", "-(-32768)", 32_768);
    wraps("m = -32767 - 1", "log(math.abs(m))", "math.abs(-32768)", 32_768);
    wraps("m = 1 n = 15", "log(m << n)", "1 << 15", 32_768);
    wraps("m = 32767", "log(m + 1)", "32767 + 1", 32_768);
    wraps("m = -32767 - 1", "log(m - 1)", "-32768 - 1", -32_769);
    none::<Tiny>("m = -32767 - 1 n = -1", "log(m % n)");
    none::<Tiny>("m = -1 n = 15", "log(m << n, m >> n)");
    none::<Tiny>("m = 32766 n = -32767", "log(m + 1, n - 1, -n, math.abs(n), m / n)");
    // What wraps in 16 bits fits 32.
    none::<Full>("d = 300", "log(d * d)");
}

#[test]
fn integers_of_32_bits_wrap() {
    use Anomaly::Wrapped;
    only::<Full>("d = 65536", "log(d * d)", Wrapped, "65536 * 65536", "4294967296", "0");
    let most = "m = 2147483647";
    only::<Full>(most, "log(m + 1)", Wrapped, "2147483647 + 1", "2147483648", "-2147483648");
    only::<Full>(most, "log(m << 1)", Wrapped, "2147483647 << 1", "4294967294", "-2");
}

/// `i + 1` on a local is one instruction. Its place is that of the same code where it fails for a nil.
#[test]
fn fused_instructions_have_their_places() {
    let sources = [
        "function step() {\n  var i = m\n\n  i = i + 1\n  log(i)\n}\n",
        "function step() {\n  log(1,\n    m + 1)\n}\n",
        "function step() {\n  log(1,\n    m * m)\n}\n",
        "function step() {\n  log(1,\n    m\n    + n)\n}\n",
    ];
    for source in sources {
        let wrong = compiled::<Tiny>(&format!("m = nil n = nil\n{source}"));
        let mut vm = machine::<Tiny>(&wrong.0, 900);
        let mut host = Logger::default();
        let ends = drive(&mut vm, 1, |vm, _, _| vm.run(&mut host, 1000));
        let Some((Outcome::Fault(fault), _)) = ends.last() else { panic!("{ends:?}") };
        let place = |(_, symbols): &(Vec<u8>, Symbols), position: u16| {
            symbols.position(position.into()).unwrap()
        };
        let expected = place(&wrong, fault.position);

        let script = format!("m = 32767 n = 32767\n{source}");
        let found = findings::<Tiny>(&script, 1);
        let (position, anomaly) = *found.places.keys().next().unwrap();
        assert_eq!((found.places.len(), anomaly), (1, Anomaly::Wrapped), "{script}");
        let mut here = place(&compiled::<Tiny>(&script), position);
        // The first line is longer.
        assert_eq!(here.line, expected.line, "{script}");
        here.file = expected.file;
        assert_eq!(here, expected, "{script}");
    }
}

/// `tiny` has floats below 2^32, `full` below 2^128.
#[test]
fn floats_become_infinite() {
    use Anomaly::Infinite;
    let big = "b = 65536.0";
    let exact = "4294967296.0";
    only::<Tiny>(big, "log(b * b)", Infinite, "65536.0 * 65536.0", exact, "inf");
    only::<Tiny>("b = 1.0 z = 0.0", "log(b / z)", Infinite, "1.0 / 0.0", "inf", "inf");
    only::<Tiny>("b = -1.0 z = 0", "log(b / z)", Infinite, "-1.0 / 0", "-inf", "-inf");
    // An infinity is born once: the sum and the product only hand it on.
    only::<Tiny>(
        big,
        "var i = -(b * b) log(i + 1, i * 2.0)",
        Infinite,
        "65536.0 * 65536.0",
        exact,
        "inf",
    );
    only::<Tiny>("b = 2 n = 40", "log(b ^ n)", Infinite, "2 ^ 40", "1099511627776.0", "inf");
    only::<Tiny>("b = 0.0", "log(math.log(b))", Infinite, "math.log(0.0)", "-inf", "-inf");
    none::<Full>(big, "log(b * b)");
    let huge = "h = 340000000000000000000000000000000000000.0";
    let found = findings::<Full>(&format!("{huge} function step() {{ log(h + h) }}"), 3);
    assert_eq!(lines(&found)[0].0, Infinite);
    assert_eq!(lines(&found)[0].1, 3);
    // e^1000 is beyond binary64, too.
    only::<Full>("b = 1000", "log(math.exp(b))", Infinite, "math.exp(1000)", "inf", "inf");
}

#[test]
fn floats_become_nan() {
    use Anomaly::NotANumber;
    let zero = "z = 0.0";
    only::<Tiny>(zero, "log(z / z)", NotANumber, "0.0 / 0.0", "NaN", "NaN");
    only::<Full>(zero, "var n = z / z log(n + 1, n * z)", NotANumber, "0.0 / 0.0", "NaN", "NaN");
    let minus = "m = -1.0";
    only::<Tiny>(minus, "log(math.sqrt(m))", NotANumber, "math.sqrt(-1.0)", "NaN", "NaN");
    only::<Full>(minus, "log(m ^ 0.5)", NotANumber, "-1.0 ^ 0.5", "NaN", "NaN");
    only::<Tiny>("a = 2 z = 0.0", "log(a % z)", NotANumber, "2 % 0.0", "NaN", "NaN");
    // Infinity is an operand, NaN is new.
    let script = "b = 65536.0 function step() { var i = b * b log(i - i) }";
    let kinds: Vec<_> = lines(&findings::<Tiny>(script, 1)).into_iter().map(|l| l.0).collect();
    assert_eq!(kinds, [Anomaly::Infinite, NotANumber]);
}

/// The smallest float of `tiny` is 2^-30, and it has no subnormal ones; those of `full` go down to 2^-149.
#[test]
fn floats_flush_to_zero() {
    use Anomaly::Flushed;
    // 2^-16 squared is 2^-32.
    let small = "h = 1.0 / 256 s = h / 256";
    let exact = format!("{:?}", 2f64.powi(-32));
    let s = format!("{:?}", 2f32.powi(-16));
    only::<Tiny>(small, "log(s * s)", Flushed, &format!("{s} * {s}"), &exact, "0.0");
    none::<Full>(small, "log(s * s)");
    // 2^-30 * (1 + 1/512) - 2^-30 = 2^-39
    let close = "h = 1.0 / 32768.0 x = h / 32768.0 y = 1.001953125 * x";
    let difference = format!("{:?} - {:?}", 2f32.powi(-30) * (1.0 + 1.0 / 512.0), 2f32.powi(-30));
    let exact = format!("{:?}", 2f64.powi(-39));
    only::<Tiny>(close, "log(y - x)", Flushed, &difference, &exact, "0.0");
    none::<Full>(close, "log(y - x)");
    only::<Tiny>(
        "n = -40",
        "log(2 ^ n)",
        Flushed,
        "2 ^ -40",
        &format!("{:?}", 2f64.powi(-40)),
        "0.0",
    );
    // Zeros that are exact.
    none::<Tiny>(
        "x = 1.5 z = 0.0",
        "log(x - x, x * z, z / x, x % 0.5, z ^ 2, math.sin(z), math.log(1))",
    );
    // 2^-100 squared is 2^-200: too small for binary32.
    let found = findings::<Full>("n = -100 s = 2.0 ^ n function step() { log(s * s) }", 4);
    let s = format!("{:?}", 2f32.powi(-100));
    let exact = format!("{:?}", 2f64.powi(-200));
    assert_eq!(lines(&found), [(Flushed, 4, format!("{s} * {s}"), exact, "0.0".to_owned())]);
    // e^-1000 is too small even for binary64, but it is not zero.
    only::<Full>("b = -1000", "log(math.exp(b))", Flushed, "math.exp(-1000)", "0.0", "0.0");
}

#[test]
fn conversions_to_integers_saturate() {
    use Anomaly::Saturated;
    let many = "x = 40000.0";
    only::<Tiny>(many, "log(int(x))", Saturated, "int(40000.0)", "40000.0", "32767");
    only::<Tiny>(
        many,
        "log(math.floor(-x))",
        Saturated,
        "math.floor(-40000.0)",
        "-40000.0",
        "-32768",
    );
    // The greatest float of `tiny` below 2^15.
    none::<Tiny>("x = 32736.0", "log(math.ceil(x), math.round(x), int(x))");
    none::<Full>(many, "log(int(x))");
    let more = "x = 3000000000.0";
    only::<Full>(
        more,
        "log(math.round(x))",
        Saturated,
        "math.round(3000000000.0)",
        "3000000000.0",
        "2147483647",
    );
    let script = "z = 0.0 function step() { log(int(z / z)) }";
    let found = lines(&findings::<Full>(script, 1));
    assert_eq!(found[1].0, Saturated);
    assert_eq!((found[1].3.as_str(), found[1].4.as_str()), ("NaN", "0"));
}

/// Built-in functions are found in variables and in libraries, too.
#[test]
fn functions_that_are_values_are_checked() {
    let infinite = |global: &str, code: &str| {
        let exact = format!("{:?}", libm::exp(100.0));
        only::<Tiny>(global, code, Anomaly::Infinite, "math.exp(100)", &exact, "inf");
    };
    infinite("x = 100", "log(math.exp(x))");
    infinite("x = 100 f = math.exp", "log(f(x))");
    infinite("x = 100 m = math", "log(m.exp(x))");
    // Nobody sees the result.
    none::<Tiny>("x = 100", "math.exp(x)");
}

/// `step` and eleven calls of `f`.
#[test]
fn calls_are_as_deep_as_the_recursion() {
    let script = "function f(n) { if(n > 0) f(n - 1) }\nfunction step() { f(10) }\n";
    let found = findings::<Tiny>(script, 2);
    let peak = found.calls.unwrap();
    assert_eq!((peak.value, peak.at.tick, peak.at.robot), (12, 1, 7));
}

/// A cell, which is seven slots, for each empty table that can be reached.
#[test]
fn the_peak_counts_tables_but_not_garbage() {
    let peak = |body: &str| {
        let script = format!("a = nil b = nil c = nil i = 0\nfunction init() {{ {body} }}\n");
        findings::<Tiny>(&script, 0).slots.unwrap().value
    };
    let one = peak("a = {}");
    assert_eq!(peak("a = {} b = {}"), one + 7);
    assert_eq!(peak("a = {} b = {} c = {}"), one + 14);
    // The new table is made while the variable still has the old one.
    assert_eq!(peak("while(i < 100) { a = {} i = i + 1 }"), one + 7);
}

/// The peak is the least memory with which the script runs.
#[test]
fn a_script_needs_exactly_as_many_slots_as_its_peak() {
    fn check<P: Profile>() {
        let scripts = [
            "t = {} i = 0 while(i < 30) { t[i] = i i = i + 1 }",
            "t = {} i = 0 while(i < 30) { t[i] = {} i = i + 1 }",
            "function f(n) { if(n > 0) return 1 + f(n - 1) return 0 }\nfunction step() { f(20) }",
            "k = {}\nfunction f(n) { if(n > 0) return 1 + f(n - 1) return 0 }\n\
             function step() { k = nil k = { .a = 1, .b = 2 } f(9) foreach(k, function(x, y) { f(y) }) }",
        ];
        for script in scripts {
            let (image, _) = compiled::<P>(script);
            let peak = findings::<P>(script, 3).slots.unwrap().value;
            let last = |slots: usize| {
                let mut host = Logger::default();
                let mut vm = machine::<P>(&image, slots);
                drive(&mut vm, 3, |vm, _, _| vm.run(&mut host, 1000)).pop().unwrap().0
            };
            assert_eq!(last(peak), Outcome::Done, "{peak} slots: {script}");
            assert!(matches!(last(peak - 1), Outcome::Fault(_)), "{peak} slots: {script}");
        }
    }
    check::<Tiny>();
    check::<Full>();
}

#[test]
fn entries_of_stigmergies_are_counted() {
    let script =
        "v = stigmergy.create(1) n = 0\nfunction step() { n = n + 1 if(n < 4) v.put(n, n) }\n";
    let peak = findings::<Tiny>(script, 6).entries.unwrap();
    assert_eq!((peak.value, peak.at.tick), (3, 3));
}

/// Slices end at the same instruction, whatever their budget: after text, in callbacks, waits and faults.
#[test]
fn checks_do_not_change_the_end_of_a_slice() {
    fn check<P: Profile>(scripts: &[&str]) {
        for script in scripts {
            let (image, _) = compiled::<P>(script);
            for budget in [1, 2, 3, 7, 50, 400] {
                let mut plain_host = Logger::default();
                let mut plain = machine::<P>(&image, 400);
                let expected = drive(&mut plain, 20, |vm, _, _| vm.run(&mut plain_host, budget));
                let mut host = Logger::default();
                let mut checker = MachineChecker::new(7, None);
                let mut vm = machine::<P>(&image, 400);
                let found = drive(&mut vm, 20, |vm, tick, is_step| {
                    checker.run(vm, &mut host, RunSlice { budget, tick, is_step })
                });
                assert_eq!(found, expected, "slices of {budget}: {script}");
                assert_eq!(host, plain_host, "{script}");
                assert_eq!(vm.free_slots(), plain.free_slots(), "{script}");
            }
        }
    }
    let both = [
        "n = 300\nfunction step() { n = n * n + 1 log(n, math.rng.uniform(n), n ^ 0.5) }",
        "t = {}\nfunction step() { t[size(t)] = {} log(size(map(t, function(k, v) { return k * k }))) }",
        "function step() { delay(5) log(1) foreach({.a = 1, .b = 2}, function(k, v) { log(6 / v) }) }",
        "function f(n) { return f(n + 1) }\nfunction step() { f(0) }",
        "n = 3\nfunction step() { n = n - 1 log(6 / n) }",
        "v = stigmergy.create(1)\nfunction step() { v.put(\"a\", 1) neighbors.broadcast(\"b\", 2) log(v.get(\"a\")) }",
    ];
    check::<Tiny>(&both);
    check::<Full>(&both);
    check::<Full>(&[
        "s = \"0123456789\" f = string.concat\nfunction step() { var t = string.concat(s, s, s) log(t, f(t, s)) foreach({.a = t}, f) }",
        "s = \"0123456789\"\nfunction step() { s = string.concat(s, s) log(string.length(s), string.sub(s, 3, 30)) }",
    ]);
}

/// All that can be seen of a world is the same, tick by tick.
#[test]
fn checks_do_not_change_the_world() {
    let plain = busy::setup("checks", "");
    let checked = Arc::into_inner(busy::setup("checks", "")).unwrap().checked(|_| None);
    let mut without = Simulation::new(plain, 5, 1).unwrap();
    let mut with = Simulation::new(Arc::new(checked), 5, 2).unwrap();
    assert_eq!(busy::rest(&mut with), busy::rest(&mut without));
    let mut summary = with.summary();
    assert_eq!(summary.findings.len(), 3, "of each group");
    // The keys 0, 1 and 2. A Crazyflie rises for 50 s in its first step, in which it puts one.
    let entries = summary.findings.values().map(|findings| findings.entries.unwrap().value);
    assert_eq!(entries.collect::<Vec<_>>(), [3, 3, 1]);
    summary.findings.clear();
    assert_eq!(format!("{summary:?}"), format!("{:?}", without.summary()));
}

/// Text uses up the budget of a tick, so that a step lasts for several. Checks must not change how many.
#[test]
fn checks_do_not_change_a_world_that_prints_much_text() {
    let script = "s = \"0123456789\" n = 0\nfunction step() {\n  n = n + 1\n  var i = 0\n\
                  while(i < 3000) { i = i + 1 var t = string.concat(s, s, s) }\n  log(n)\n}\n";
    let folder = script::folder("checks_text", &[("s.bzz", script)]);
    let world = "[world]\nsize = [1000, 1000]\nduration = 5\n\
                 [[robots]]\nrobot = \"crazyflie\"\nscript = \"s.bzz\"\ncount = 2\narea = [300, 300]\n";
    let run = |has_checks: bool| {
        let (scenario, programs) = script::read(&folder, world);
        let setup = Setup::new(scenario, programs).unwrap();
        let setup = if has_checks { setup.checked(|_| None) } else { setup };
        let mut simulation = Simulation::new(Arc::new(setup), 1, 1).unwrap();
        let seen = busy::rest(&mut simulation);
        (seen, simulation.summary().overruns)
    };
    let (seen, overruns) = run(false);
    assert!(overruns.missed > 10, "{overruns:?}");
    assert_eq!(run(true), (seen, overruns));
}

/// Robots of a group are added up; the first example is the earliest, and of one tick that of the lowest id.
#[test]
fn findings_of_a_group_are_added_up() {
    let script =
        "n = 0 big = 32767\nfunction step() { n = n + 1 if(n + id > 9) led((big + id) % 8) }\n";
    let folder = script::folder("checks_group", &[("s.bzz", script)]);
    let world = "[world]\nsize = [1000, 1000]\nduration = 2\n\
                 [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 3\nfirst_id = 4\n\
                 [[event]]\nat = 1\nrestart = 5\n";
    let (scenario, programs) = script::read(&folder, world);
    let setup = Setup::new(scenario, programs).unwrap().checked(|_| None);
    let mut simulation = Simulation::new(Arc::new(setup), 1, 1).unwrap();
    busy::rest(&mut simulation);
    let summary = simulation.summary();
    let found = lines(&summary.findings[&ProgramId(0)]);
    // In 20 ticks 19 steps, from tick 1 on. Robots 4, 5 and 6 wrap from step 6, 5 and 4 on: 14, 15 and 16 times. Robot 5 is
    // switched off and on at tick 10, after step 9 and its 5 wraps; steps 1 to 9 come again in ticks 11 to 19, with 5 more.
    let count = 14 + (5 + 5) + 16;
    let line =
        (Anomaly::Wrapped, count, "32767 + 6".to_owned(), "32773".to_owned(), "-32763".to_owned());
    assert_eq!(found, [line]);
    let first = summary.findings[&ProgramId(0)].places.values().next().unwrap().first.at;
    assert_eq!((first.tick, first.robot), (4, 6));
}
