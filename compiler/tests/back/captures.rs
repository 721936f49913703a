//! Captured variables are snapshots; only what a lambda uses is captured.

use crate::back::machine::{FULL, image, listing, output};

#[test]
fn a_snapshot_is_taken_when_the_lambda_is_created() {
    let script = "
        function f() {
          var a = 1
          var g = function() { return a }
          a = 2
          return g() * 10 + a
        }
        log(f())";
    assert_eq!(output(script), "12\n");
}

#[test]
fn assigning_a_captured_variable_changes_one_call_only() {
    let script = "
        function counter() {
          var n = 0
          var t = {}
          t.n = 0
          return function(x) { n = n + x  t.n = t.n + 1  return n * 10 + t.n }
        }
        c = counter()
        log(c(1), \" \", c(2), \" \", c(3))";
    assert_eq!(output(script), "11 22 33\n");
}

#[test]
fn a_changed_copy_is_what_inner_lambdas_capture() {
    let script = "
        function f() {
          var n = 1
          return function() {
            n = n + 1
            var g = function() { return n }
            n = n + 10
            return g() * 100 + n
          }
        }
        log(f()())";
    assert_eq!(output(script), "212\n");
}

#[test]
fn captures_pass_through_functions_that_do_not_use_them() {
    let script = "
        function f(a) {
          var b = 2
          return function() { return function() { return function(c) { return a * 100 + b * 10 + c } } }
        }
        log(f(1)()()(3))";
    assert_eq!(output(script), "123\n");
}

#[test]
fn parameters_shadow_and_blocks_end() {
    let script = "
        function f(x) { return function(x) { return x + 1 } }
        log(f(100)(1))
        if(1) { var hidden = 5  g = function() { return hidden } }
        log(g())
        log(isnil(hidden))";
    assert_eq!(output(script), "2\n5\n1\n");
}

#[test]
fn locals_of_blocks_at_the_top_level_are_captured() {
    let script = "
        fs = {}
        for(i = 0, i < 3, i = i + 1) {
          var j = i * i
          fs[i] = function() { return j }
        }
        log(fs[0](), fs[1](), fs[2]())";
    assert_eq!(output(script), "014\n");
}

#[test]
fn one_variable_is_captured_once() {
    let script = "function f(a, b) { return function() { return b + b + b } } log(f(1, 2)())";
    let (bytes, symbols) = image(script, FULL);
    let listing = listing(&bytes, &symbols);
    assert!(listing.contains("CLOSURE 2 1 "), "{listing}");
    assert_eq!(output(script), "6\n");
}

#[test]
fn more_captures_than_a_heap_cell_holds() {
    let script = "
        function f(a, b, c, d, e, g, h, i) {
          return function() { return a + b * 2 + c * 3 + d * 4 + e * 5 + g * 6 + h * 7 + i * 8 }
        }
        log(f(1, 2, 3, 4, 5, 6, 7, 8)())";
    assert_eq!(output(script), "204\n");
}

#[test]
fn the_variable_itself_is_nil_in_its_own_first_value() {
    let script = "
        x = 7
        function f() { var x = isnil(x)  return x }
        log(f())
        function g() { var h = function() { return isnil(h) }  return h() }
        log(g())";
    assert_eq!(output(script), "1\n1\n");
}

#[test]
fn hidden_slots_shift_the_variables() {
    // Closure and self lie below the variables of the lambda.
    let script = "
        t = { .v = 1 }
        t.f = function(a) {
          return function(b) {
            var c = 4
            if(c) { var d = 5  c = c + d }
            var e = 6
            return self.v * 10000 + a * 1000 + b * 100 + c * 10 + e
          }
        }
        log(t.f(2)(3))";
    assert_eq!(output(script), "12396\n");
}
