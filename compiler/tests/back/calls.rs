//! Calls: arguments, results, methods and self.

use bittybuzz_compiler::compile::Options;
use bittybuzz_vm_core::FaultCode;

use crate::back::machine::{FULL, build_with, image, listing, output, robot, run};

#[test]
fn arguments_are_evaluated_in_order_and_extra_ones_too() {
    let script = "
        function say(x) { log(x)  return x }
        function two(a, b) { return a * 10 + b }
        log(two(say(1), say(2), say(3), 4))
        f = two
        log(f(say(5), say(6), say(7)))";
    assert_eq!(output(script), "1\n2\n3\n12\n5\n6\n7\n56\n");
}

/// Scripts for hosts of Buzz, BittyBuzz's own among them, print so.
#[test]
fn print_is_log_unless_the_robot_or_the_script_has_another() {
    assert_eq!(output("print(\"y = \", 3, 4) print() f = print f(1)"), "y = 34\n\n1\n");
    assert_eq!(output("function print(x) { log(\"<\", x, \">\") } print(1)"), "<1>\n");
    // A robot with a function of that name and one parameter.
    let robot = robot(|robot| {
        robot
            .functions
            .iter_mut()
            .filter(|f| f.name == "led")
            .for_each(|f| f.name = "print".to_owned());
    });
    let options = Options { robot: Some(robot.clone()), robots: vec![robot], ..Options::default() };
    let codes = |script: &str| -> Vec<&str> {
        build_with(script, &options).diagnostics.iter().map(|d| d.code.text()).collect()
    };
    assert_eq!(codes("print(1)"), [""; 0]);
    assert_eq!(codes("print(1, 2)"), ["E0404"]);
}

#[test]
fn a_missing_argument_faults_only_where_it_is_read() {
    let script = "function f(a, b) { if(a) return 7  return b } log(f(1))";
    assert_eq!(output(script), "7\n");
    let missing = run("function f(a, b) { if(a) return 7  return b } log(f(0))", FULL);
    assert_eq!(missing.fault.map(|fault| fault.code), Some(FaultCode::MissingArgument));
}

#[test]
fn callee_before_arguments_and_table_before_key() {
    let script = "
        function t() { log(\"t\")  return { .f = function(x) { return x } } }
        function k() { log(\"k\")  return \"f\" }
        function v() { log(\"v\")  return 1 }
        log(t()[k()](v()))
        t()[k()] = v()
        t().f = v()
        g = function() { log(\"g\")  return function(x) { return x } }
        log(g()(v()))";
    assert_eq!(output(script), "t\nk\nv\n1\nt\nk\nv\nt\nv\ng\nv\n1\n");
}

#[test]
fn results_of_statements_leave_nothing_behind() {
    // Every kind of call as a statement, often enough that one left value each would overflow.
    let script = "
        function f() { return 1 }
        t = { .m = function() { return self } }
        g = function() { return 2 }
        i = 0
        while(i < 500) {
          f() g() t.m() t[\"m\"]() size(t) foreach(t, g) math.abs(1) log
          i = i + 1
        }
        log(i)";
    // `log` alone is no statement.
    assert_eq!(output(&script.replace(" log\n", "\n")), "500\n");
}

#[test]
fn self_is_the_table_of_a_method_call() {
    let script = "
        a = { .v = 1 }
        b = { .v = 2 }
        a.get = function() { return self.v }
        b.get = a.get
        log(a.get(), b[\"get\"]())
        g = a.get
        log(g())
        k = \"get\"
        log(b[k]())";
    // b.get was bound to a when it was read out of a, but the call b.get() has self b.
    assert_eq!(output(script), "12\n1\n2\n");
}

#[test]
fn a_lambda_has_the_self_of_its_creator() {
    let script = "
        t = { .v = 5 }
        t.make = function() { return function() { return self.v } }
        f = t.make()
        log(f())
        u = { .v = 6, .f = f }
        log(u.f())
        t.deep = function() { return function() { return function() { return self.v } } }
        log(t.deep()()())";
    assert_eq!(output(script), "5\n6\n5\n");
}

#[test]
fn self_and_captures_together() {
    let script = "
        t = { .v = 5 }
        t.make = function(n) {
          var k = n * 2
          return function(x) { return self.v + n + k + x }
        }
        f = t.make(10)
        log(f(100))";
    assert_eq!(output(script), "135\n");
}

#[test]
fn a_plain_named_function_has_nil_as_self() {
    let script = "function f() { return isnil(self) } log(f())
        t = { .f = f } log(t.f())
        function g() { return function() { return isnil(self) } } log(g()())";
    assert_eq!(output(script), "1\n0\n1\n");
}

#[test]
fn a_lambda_that_needs_no_self_is_no_closure() {
    // `init` is never put into a table, so its self is nil, and so is what the lambda would take over.
    let script = "function init() { t = { .f = function() { return self } } }";
    let (bytes, symbols) = image(script, FULL);
    let listing = listing(&bytes, &symbols);
    assert!(!listing.contains("CLOSURE"), "{listing}");
}

#[test]
fn functions_exist_before_the_first_line_and_can_be_replaced() {
    let script = "
        log(f())
        function f() { return 1 }
        f = function() { return 2 }
        log(f())
        function g() { return 3 }
        function g() { return 4 }
        log(g())";
    assert_eq!(output(script), "1\n2\n4\n");
}

#[test]
fn unused_functions_are_not_in_the_image() {
    let (with, _) = image("function unused(a) { return a * 2 } log(1)", FULL);
    let (without, _) = image("log(1)", FULL);
    assert_eq!(with.len(), without.len());
}

#[test]
fn replaced_built_ins_can_still_be_reached() {
    let script = "
        old = size
        size = function(t) { return old(t) + 100 }
        log(size({ .a = 1 }))
        id = id + 10
        log(id)";
    assert_eq!(output(script), "101\n11\n");
}
