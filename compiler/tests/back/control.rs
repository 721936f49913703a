//! Conditions, branches, loops, and the values of `and`, `or` and `not`.

use crate::back::machine::{FULL, TINY, image, listing, output, run};

#[test]
fn and_or_stop_early_and_give_0_or_1() {
    let script = "
        function yes(x) { log(\"y\", x)  return 5 }
        function no(x) { log(\"n\", x)  return 0 }
        r = no(1) and yes(2)   log(r)
        r = yes(3) or no(4)    log(r)
        r = yes(5) and yes(6)  log(r)
        r = no(7) or no(8)     log(r)
        r = (no(9) or yes(10)) and yes(11)  log(r)
        r = nil or \"text\"    log(r)";
    let expected = "n1\n0\ny3\n1\ny5\ny6\n1\nn7\nn8\n0\nn9\ny10\ny11\n1\n1\n";
    assert_eq!(output(script), expected);
}

/// Terms in a row need no level each, neither in the compiler nor in the machine.
#[test]
fn long_rows() {
    let sum = " + 1".repeat(5000);
    assert_eq!(output(&format!("function f(a) {{ return a{sum} }} log(f(1))")), "5001\n");
    let script = format!(
        "function f(a, b) {{ if(a{}) return 1  return 0 }}
         function g(a, b) {{ return a{} }}
         log(f(1, 1), f(1, 0), g(0, 1), g(0, 0))",
        " and b".repeat(3000),
        " or b".repeat(3000)
    );
    assert_eq!(output(&script), "1010\n");
    let rows: String = (1..1500).map(|n| format!(" else if(n == {n}) r = -{n}")).collect();
    let script = format!(
        "function f(n) {{ var r = 1  if(n == 0) r = 0 {rows} else r = 2  return r }}
         log(f(0), \" \", f(1), \" \", f(1499), \" \", f(1500))"
    );
    assert_eq!(output(&script), "0 -1 -1499 2\n");
}

#[test]
fn every_truth_table_in_every_place() {
    // The same condition as a value, as an `if`, negated, and at the end of a loop.
    for a in ["0", "1", "nil", "0.0"] {
        for b in ["0", "2", "nil"] {
            for c in ["0", "3"] {
                for condition in
                    ["a and b or c", "a or b and c", "(a and b) or (not c)", "not (a or b) and c"]
                {
                    let script = format!(
                        "a = {a} b = {b} c = {c} n = 0
                         v = {condition}
                         if({condition}) n = n + 1 else n = n + 10
                         if(not ({condition})) n = n + 100
                         go = 1
                         while(go and ({condition})) {{ n = n + 1000 go = 0 }}
                         function f() {{ return {condition} }}
                         log(v, \" \", n, \" \", f())"
                    );
                    let truth = |text: &str| !matches!(text, "0" | "nil");
                    let (a, b, c) = (truth(a), truth(b), truth(c));
                    let expected = match condition {
                        "a and b or c" => (a && b) || c,
                        // `and` and `or` have the same precedence.
                        "a or b and c" => (a || b) && c,
                        "(a and b) or (not c)" => (a && b) || !c,
                        // `not` takes all that follows.
                        _ => !((a || b) && c),
                    };
                    let v = i32::from(expected);
                    let n = if expected { 1001 } else { 110 };
                    assert_eq!(output(&script), format!("{v} {n} {v}\n"), "{script}");
                }
            }
        }
    }
}

#[test]
fn comparisons_with_nan_are_false_and_stay_so_when_negated() {
    let script = "
        inf = 1e9 * 1e9 * 1e30
        nan = inf - inf
        n = 0
        if(nan < 1) n = n + 1
        if(not (nan < 1)) n = n + 10
        if(nan >= 1) n = n + 100
        if(not (nan >= 1)) n = n + 1000
        if(nan == nan) n = n + 2
        if(nan != nan) n = n + 20
        log(n)";
    let script = script.replace("1e9 * 1e9 * 1e30", "(2 ^ 100) * (2 ^ 100)");
    assert_eq!(output(&script), "1030\n");
}

#[test]
fn dead_branches_are_checked_but_not_generated() {
    let (bytes, symbols) =
        image("if(0) log(\"never\") else led(1)\nwhile(0) { motors(1, 2) }", TINY);
    assert!(!listing(&bytes, &symbols).contains("motors"));
    assert_eq!(symbols.imports, ["led"]);
    let compiled = crate::back::machine::build("if(0) nosuch(1)", FULL);
    assert!(compiled.image.is_none());
}

#[test]
fn code_after_a_return_is_not_in_the_image() {
    let script = "function f() { return 1  motors(1, 2) } log(f())";
    let (_, symbols) = image(script, FULL);
    assert_eq!(symbols.imports, [""; 0]);
}

#[test]
fn variables_end_with_their_statement() {
    let script = "
        x = 1
        if(x) var y = 2
        log(isnil(y))
        i = 0
        while(i < 3) { var z = i * 2  var w = z + 1  i = i + 1 }
        if(x) { var p = 1  if(p) { var q = 2  x = x + q } else { var r = 3 } var s = 4  x = x + s }
        log(x, i)";
    assert_eq!(output(script), "1\n73\n");
}

#[test]
fn endless_loops_are_left_by_return() {
    let script = "
        function f() { var i = 0  while(1) { i = i + 1  if(i == 5) return i } }
        log(f())
        function g() { while(1) { return 7 } }
        log(g())
        function h(n) { while(n) return 8  return 9 }
        log(h(0), h(1))";
    assert_eq!(output(script), "5\n7\n98\n");
}

#[test]
fn returns_in_all_branches() {
    let script = "
        function sign(x) { if(x < 0) { return -1 } else { if(x > 0) return 1 else return 0 } }
        log(sign(-5), sign(0), sign(9))
        function early(x) { if(x) return;  log(\"late\") }
        early(1)  early(0)
        log(early(1))";
    assert_eq!(output(script), "-101\nlate\nnil\n");
}

#[test]
fn return_at_the_top_level_ends_the_global_code() {
    assert_eq!(output("log(1) return\n;log(2)"), "1\n");
    assert_eq!(output("if(1) { var x = 2  log(x)  return x }\nlog(3)"), "2\n");
}

#[test]
fn long_branches_jump_far() {
    let body = "n = n + 1000 - 999  ".repeat(60);
    let script = format!(
        "n = 0
         if(n == 0) {{ {body} }} else {{ {body} n = 5000 }}
         log(n)
         n = 0
         i = 0
         while(i < 3) {{ {body} i = i + 1 }}
         log(n)
         r = n and (n + {many}) and 1
         log(r)",
        many = vec!["n"; 100].join(" + ")
    );
    assert_eq!(output(&script), "60\n180\n1\n");
}

#[test]
fn a_script_that_is_too_long_is_an_error() {
    let script = format!("n = 1\nif(n) {{ {} }}", "n = n + 1000\n".repeat(7000));
    let codes = |script: &str| -> Vec<&str> {
        crate::back::machine::build(script, FULL)
            .diagnostics
            .iter()
            .map(|d| d.code.text())
            .collect()
    };
    assert_eq!(codes(&script), ["E0604"]);
    let script = "n = n + 1000\n".repeat(20000);
    assert_eq!(codes(&format!("n = 1\n{script}")), ["E0605"]);
}

#[test]
fn additions_of_literals() {
    let script = "
        function f(i) {
          i = i + 1  i = 2 + i  i = i - 3  i = i + 127  i = i - 128  i = i + 1000  i = i - 1000
          var k = i + 5
          k = k - -5
          return k * 10 + i
        }
        log(f(10))";
    // 10 + 1 + 2 - 3 + 127 - 128 = 9; 9 + 5 + 5 = 19
    assert_eq!(output(script), "199\n");
    let negative_zero = run("z = -0.0 a = z - 0 b = z + 0", FULL);
    assert_eq!(negative_zero.global("a"), Some(Err((-0.0_f32).to_bits())));
    assert_eq!(negative_zero.global("b"), Some(Err(0.0_f32.to_bits())));
}

#[test]
fn local_additions_fault_like_others() {
    let faults = |script: &str| run(script, FULL).fault.map(|fault| fault.code);
    let by_local = faults("function f(x) { x = x + 1 return x } f(\"a\")");
    let by_global = faults("x = \"a\" x = x + 1");
    assert!(by_local.is_some());
    assert_eq!(by_local, by_global);
    assert_eq!(
        faults("function f(x) { x = x + 1 return x } f()"),
        faults("function f(x) { return x } f()")
    );
}
