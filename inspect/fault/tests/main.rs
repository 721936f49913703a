//! Messages, values and calls of faults of real scripts.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use annotate_snippets::Renderer;
use bittybuzz_compiler::source::SourceMap;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_fault::{Backtrace, FaultDescription, FaultReport, KnownProgram};
use bittybuzz_inspect::{Limits, inspect};
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_testkit::profiles::Full;
use bittybuzz_testkit::{Program, SIZES, TestRobot};
use bittybuzz_vm_core::Entry;

/// A script whose global code has a fault.
struct Failed {
    robot: TestRobot<Full>,
    image: &'static [u8],
    symbols: Symbols,
    sources: SourceMap,
}

impl Failed {
    fn new(script: &str) -> Self {
        let compiled = Program::compile(script, &Program::options(NumberProfile::Full));
        let sources = compiled.sources.clone();
        let program = Program::from(compiled);
        let symbols = program.symbols.clone();
        let image = program.leak();
        let robot = TestRobot::new(image, 1, SIZES);
        let mut failed = Failed { robot, image, symbols, sources };
        failed.robot.enter(Entry::Global).expect_err("the script has a fault");
        failed
    }

    fn program(&self) -> KnownProgram<'_> {
        let profile = NumberProfile::Full;
        let (image, symbols) = (self.image, Some(&self.symbols));
        KnownProgram { image, profile, symbols, sources: &self.sources }
    }

    fn report<'a>(&self, program: KnownProgram<'a>) -> FaultReport<'a> {
        let fault = self.robot.fault.unwrap();
        let positions = self.robot.vm.calls().collect();
        FaultReport::new(&fault, Backtrace::new(program, positions, Some(Entry::Global)), None)
    }

    fn description(&self) -> FaultDescription {
        let content = inspect(&self.robot.vm, Some(&self.symbols), Limits::NONE);
        self.report(self.program()).with_content(Some(&content)).description()
    }

    /// The values as `name = value`.
    fn values(&self) -> Vec<String> {
        let values = self.description().values;
        values.iter().map(|one| format!("{} = {}", one.name, one.value)).collect()
    }
}

/// An index past the end of a table.
const AVERAGE: &str = "\
values = {.0 = 10, .1 = 20, .2 = 30}
function average(count) {
  var total = 0
  var i = 0
  while(i <= count) {
    total = total + values[i]
    i = i + 1
  }
  return total / count
}
average(3)
";

#[test]
fn the_values_of_an_instruction_are_those_of_its_names() {
    let failed = Failed::new(AVERAGE);
    let expected =
        ["total = 60", "values[i] = nil", "i = 3", "values = {.0 = 10, .1 = 20, .2 = 30}"];
    assert_eq!(failed.values(), expected);
}

#[test]
fn a_description_has_message_places_and_help() {
    let found = Failed::new(AVERAGE).description();
    assert_eq!(found.code, "R0001");
    assert_eq!(found.message, "cannot add an integer and nil: `values[i]` is nil");
    assert!(found.help.unwrap().contains("`isnil(x)` tests for it"));
    let places: Vec<_> = found.places.iter().flatten().collect();
    let names = places.iter().map(|place| (place.function.as_deref(), place.line));
    assert!(names.eq([(Some("average"), 6), (Some("global code"), 11)]));
    assert_eq!(places[0].text.as_deref(), Some("    total = total + values[i]"));
    // `total + values[i]`
    let ends = (places[0].column, places[0].end_line, places[0].end_column);
    assert_eq!(ends, (13, 6, 30));
    assert_eq!(found.left_out, 0);
}

#[test]
fn entries_of_tables_are_followed() {
    let script = "state = {.speeds = {.slow = 20}, .name = \"x\"}\nkey = \"fast\"\n\
                  log(state.speeds[key] * 2)\n";
    let expected = [
        "state.speeds[key] = nil",
        "key = \"fast\"",
        "state.speeds = {.slow = 20}",
        "state = {.speeds = {…}, .name = \"x\"}",
    ];
    assert_eq!(Failed::new(script).values(), expected);
}

#[test]
fn what_has_no_value_is_left_out() {
    // A method of nil: neither `t.f` nor the functions have values.
    let script = "function twice(x) { return 2 * x }\nt = nil\nlog(twice(t.f(2.5)))\n";
    assert_eq!(Failed::new(script).values(), ["t = nil"]);
    let script = "d = 0\nx = 2.0\nlog(math.abs(7) % d + x)\n";
    assert_eq!(Failed::new(script).values(), ["d = 0"]);
}

/// A recursion has more calls than anybody reads.
#[test]
fn the_calls_in_the_middle_are_left_out() {
    let failed = Failed::new("function f(n) { return f(n + 1) }\nf(0)\n");
    let found = failed.description();
    let count = failed.robot.vm.calls().count();
    assert_eq!((found.code.as_str(), found.places.len()), ("R0009", 8));
    assert_eq!(found.left_out, count - 8);
    let last = found.places.last().unwrap().as_ref().unwrap();
    assert_eq!(last.function.as_deref(), Some("global code"));
}

#[test]
fn without_symbols_and_texts_less_is_known() {
    let failed = Failed::new(AVERAGE);
    let unknown = failed.report(KnownProgram { symbols: None, ..failed.program() });
    let content = inspect(&failed.robot.vm, None, Limits::NONE);
    let found = unknown.with_content(Some(&content)).description();
    assert_eq!(found.message, "cannot add an integer and nil");
    assert_eq!((found.places, found.values), (vec![None, None], vec![]));
}

/// The terminal and the page have one source.
#[test]
fn the_message_for_terminals_has_the_same_words() {
    let failed = Failed::new(AVERAGE);
    let report = failed.report(failed.program());
    let text = Renderer::plain().render(&[report.message(&["in step 3".to_owned()])]);
    let FaultDescription { message, help, .. } = report.description();
    let expected = [
        format!("error[R0001]: {message}"),
        "--> test.bzz:6:13".to_owned(),
        "6 |     total = total + values[i]".to_owned(),
        "in `average`, called at test.bzz:11:1".to_owned(),
        "note: in step 3".to_owned(),
        format!("help: {}", help.unwrap()),
    ];
    let places: Vec<Option<usize>> = expected.iter().map(|part| text.find(part)).collect();
    assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{places:?}\n{text}");
    assert_eq!(report.json()["message"], message);
}
