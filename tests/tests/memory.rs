//! What random programs hardly reach: structures that fill the memory, and programs that make garbage for a long time.

use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_tests::compiler;
use bittybuzz_tests::machine::{self, End, Settings, Trace};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{FaultCode, Torture, Vm};

const SLOTS: usize = 60_000;

fn run<P: Profile>(script: &str, settings: &Settings) -> Trace {
    let compiled = compiler::compile(script.to_owned(), P::FULL, &MemoryFiles::default());
    let Some(image) = compiled.image else { panic!("{script}\n{:#?}", compiled.diagnostics) };
    let mut vm: Box<Vm<P, &[u8], SLOTS>> = Box::new(Vm::new());
    machine::run(&mut vm, &image, settings)
}

fn settings(slots: usize) -> Settings {
    Settings { slots, budget: 10_000, torture: Torture::default(), audit: true, most: 100_000_000 }
}

fn lines(trace: &Trace) -> Vec<String> {
    let lines = trace.output.lines().filter_map(|line| line.strip_prefix("log "));
    lines.map(str::to_owned).collect()
}

/// The lines that a script logs before it ends, in both profiles.
fn logged(script: &str, slots: usize) -> Vec<String> {
    let [tiny, full] =
        [run::<Tiny>(script, &settings(slots)), run::<Full>(script, &settings(slots))];
    for trace in [&tiny, &full] {
        assert_eq!(trace.end, End::Complete, "{script}\n{}", trace.output);
    }
    assert_eq!(tiny.output, full.output);
    lines(&tiny)
}

#[test]
fn long_chains_survive_collections() {
    // 5000 tables of one cell each fill nine tenths of the memory; the garbage has the rest.
    let list = "
        head = nil
        for(i = 0, i < 5000, i = i + 1) head = { .n = i, .next = head }
        for(i = 0, i < 10000, i = i + 1) { var garbage = { .x = i } }
        n = 0
        sum = 0
        for(t = head, t != nil, t = t.next) { n = n + 1  sum = sum + t.n % 7 }
        log(n)
        log(sum)";
    let sum: i32 = (0..5000).map(|n| n % 7).sum();
    assert_eq!(logged(list, 39_000), ["5000".to_owned(), sum.to_string()]);
}

#[test]
fn nesting_has_no_limit_but_memory() {
    // Each function holds the one before; each bound method an object, which holds the method before.
    let closures = "
        function wrap(f) { return function(x) { if(x == 0) return 0  last = f  return x } }
        f = function(x) { return 1 }
        for(i = 0, i < 8000, i = i + 1) f = wrap(f)
        for(i = 0, i < 3000, i = i + 1) { var garbage = { .x = i } }
        n = 0
        for(last = f, f(1) == 1 and last != f, n = n + 1) f = last
        log(f(1))";
    assert_eq!(logged(closures, SLOTS), ["1"]);
    let arrays = "
        t = {}
        for(i = 0, i < 4000, i = i + 1) t = { .0 = 5, .1 = t }
        for(i = 0, i < 3000, i = i + 1) { var garbage = { .x = i } }
        n = 0
        while(size(t) > 0) { t = t[1]  n = n + 1 }
        log(n)";
    assert_eq!(logged(arrays, SLOTS), ["4000"]);
    let methods = "
        m = nil
        for(i = 0, i < 2500, i = i + 1) {
          var before = m
          var o = { .before = function() { return before } }
          o.get = function() { return self }
          m = o.get
        }
        n = 0
        while(m != nil) { n = n + 1  var o = m()  m = o.before() }
        log(n)";
    assert_eq!(logged(methods, SLOTS), ["2500"]);
}

/// A hundred thousand times, in room for a few.
#[test]
fn garbage_of_every_kind_is_freed() {
    let kinds = [
        ("cycles", "var a = { .n = 1 } var b = { .a = a } a.b = b  a.me = a  b[0] = b"),
        ("closures", "var n = i  var f = function(x) { return n + x }  f(1)"),
        (
            "wide closures",
            "var a = i var b = i var c = i var d = i var e = i
            var f = function(x) { return a + b + c + d + e + x }  f(1)",
        ),
        ("bound methods", "o.m = function() { return self }  kept = o.m"),
        (
            "arrays",
            "for(k = 0, k < 20, k = k + 1) t[k] = k  for(k = 19, k >= 0, k = k - 1) t[k] = nil",
        ),
        (
            "gaps",
            "for(k = 0, k < 20, k = k + 1) t[k] = k  for(k = 0, k < 20, k = k + 1) t[k] = nil",
        ),
        (
            "pairs",
            "for(k = 0, k < 9, k = k + 1) t[k * 7 + i % 3 + 1] = k
            for(k = 0, k < 9, k = k + 1) t[k * 7 + i % 3 + 1] = nil",
        ),
        (
            "iterations",
            "map(s, function(k, v) { return { .v = v } })
            filter(s, function(k, v) { return v })
            reduce(s, function(k, v, a) { return { .a = v } }, nil)",
        ),
        ("clones", "var c = clone(tree)"),
        ("libraries", "math.extra = { .n = i }  math.rng.extra = { .n = i }  size(math.rng)"),
        ("calls", "function2({ .a = i }, { .b = i })"),
    ];
    for (kind, body) in kinds {
        let script = format!(
            "
            o = {{}}
            t = {{}}
            s = {{ .0 = 1, .1 = 2, .a = 3 }}
            tree = {{ .0 = {{ .0 = 1 }}, .a = {{ .b = {{ .c = 1 }} }} }}
            function function2(a, b) {{ return {{ .a = a, .b = b }} }}
            count = 0
            for(round = 0, round < 100, round = round + 1)
              for(i = 0, i < 100, i = i + 1) {{
                {body}
                count = count + 1
              }}
            function step() {{
              for(round = 0, round < 300, round = round + 1)
                for(i = 0, i < 100, i = i + 1) {{
                  {body}
                }}
              count = count + 1
            }}
            function destroy() {{ log(count) }}"
        );
        assert_eq!(logged(&script, 500), ["10003"], "{kind}");
    }
}

/// Garbage of any amount leaves calls the room that it does not need itself.
#[test]
fn garbage_does_not_prevent_calls() {
    for count in [3, 10, 30, 40, 45, 50, 100, 200, 1000] {
        let script = format!(
            "
            function deep(n) {{ if(n == 0) return 0  return 1 + deep(n - 1) }}
            kept = {{}}
            for(i = 0, i < {count}, i = i + 1) kept[i % 3] = {{ .n = i }}
            log(deep(50))"
        );
        assert_eq!(logged(&script, 400), ["50"], "after {count} tables");
    }
}

/// The first step ends with most of the memory in use. Cells never move, so the table that the second step makes and keeps
/// must not lie where its calls need room.
#[test]
fn a_table_that_stays_does_not_prevent_calls() {
    for (first, long, before) in
        (0..8).flat_map(|a| (28..36).flat_map(move |b| (6..14).map(move |c| (a, b, c))))
    {
        let script = format!(
            "
            t = 0  keep = nil  head = nil
            function deep(n) {{ if(n > 0) return deep(n - 1) return 0 }}
            function step() {{
              t = t + 1
              if(t == 1) {{
                for(k = 0, k < {first}, k = k + 1) garbage = {{ .x = k }}
                garbage = nil
                for(k = 0, k < {long}, k = k + 1) head = {{ .k = k, .next = head }}
                head = nil
              }}
              else if(t == 2) {{
                for(k = 0, k < {before}, k = k + 1) garbage = {{ .x = k }}
                garbage = nil
                keep = {{ .x = 1 }}
                deep(12)
              }}
            }}"
        );
        // An audit collects at the end of each step.
        let trace = run::<Tiny>(&script, &Settings { audit: false, ..settings(339) });
        assert_eq!(trace.end, End::Complete, "{first}, {long}, {before}");
    }
}

/// Calls have taken nearly all of the largest memory, and no entry has allocated anything since.
#[test]
fn calls_may_take_the_largest_memory_in_each_step() {
    let script = "
        function deep(n) { if(n > 0) return deep(n - 1) return 0 }
        function step() { deep(30000) }";
    let compiled = compiler::compile(script.to_owned(), true, &MemoryFiles::default());
    let image = compiled.image.expect("it compiles");
    let mut vm: Box<Vm<Full, &[u8], 65_520>> = Box::new(Vm::new());
    let settings = Settings { audit: false, ..settings(65_520) };
    assert_eq!(machine::run(&mut vm, &image, &settings).end, End::Complete);
}

#[test]
fn strings_are_freed() {
    let script = "
        text = \"\"
        for(i = 0, i < 100000, i = i + 1) {
          text = string.concat(string.tostring(i), \" and some more that needs a second cell \", text)
          text = string.sub(text, 0, 50)
        }
        log(string.length(text))";
    let trace = run::<Full>(script, &settings(300));
    assert_eq!(trace.end, End::Complete);
    assert!(trace.output.contains("log 50\n"), "{}", trace.output);
}

/// Memory that one script has filled is empty for the next, and so is the memory after a fault.
#[test]
fn a_full_machine_accepts_the_next_script() {
    let compile = |script: &str| {
        let compiled = compiler::compile(script.to_owned(), true, &MemoryFiles::default());
        compiled.image.expect("the script is right")
    };
    let endless = compile("t = {} while(1) t = { .t = t }");
    let deep = compile("function f(n) { return f(n + 1) + 1 } f(0)");
    let next = compile("log(math.changed)  math.changed = 1  x = {}  log(size(x))");
    let mut vm: Box<Vm<Full, &[u8], SLOTS>> = Box::new(Vm::new());
    for _ in 0..2 {
        for (image, code) in [(&endless, FaultCode::OutOfMemory), (&deep, FaultCode::StackOverflow)]
        {
            let trace = machine::run(&mut vm, image, &settings(SLOTS));
            assert!(matches!(trace.end, End::Fault(fault) if fault.code == code), "{trace:?}");
            let trace = machine::run(&mut vm, &next, &settings(60));
            assert_eq!(trace.end, End::Complete);
            assert!(trace.output.contains("log nil\nlog 0\n"), "{}", trace.output);
        }
    }
}

/// A library that the script left alone, while it changed another, is not confused with its changes.
#[test]
fn changes_of_one_library_do_not_affect_another() {
    let script = "
        log(size(math.rng))
        math.extra = 1
        log(size(math.rng))
        math.rng.more = 2
        log(size(math.rng))";
    assert_eq!(logged(script, 400), ["4", "4", "5"]);
}

/// The cause that stopped a script, and the last line that it logged.
fn last_line_and_fault(script: &str, slots: usize) -> (Option<String>, Option<FaultCode>) {
    let trace = run::<Full>(script, &settings(slots));
    let fault = match &trace.end {
        End::Fault(fault) => Some(fault.code),
        End::Complete => None,
        other => panic!("{other:?}"),
    };
    (lines(&trace).pop(), fault)
}

#[test]
fn a_text_of_a_chip_has_at_most_1000_bytes() {
    let too_long = Some(FaultCode::TextTooLong);
    let thousand = Some("1000".to_owned());
    let growing = "
        a = \"0123456789\"
        text = string.concat(a, a)
        while(1) { text = string.concat(text, a)  log(string.length(text)) }";
    assert_eq!(last_line_and_fault(growing, 4096), (thousand.clone(), too_long));

    let repeated = "
        a = \"0123456789\"
        text = string.concat(a, a, a, a, a)
        text = string.concat(text, text, text, text)
        log(string.length(string.concat(text, text, text, text, string.sub(text, 0, COUNT))))";
    let part = "a = \"LITERAL\"\nlog(string.length(string.sub(a, 5, COUNT)))"
        .replace("LITERAL", &"x".repeat(3000));
    for (script, most) in [(repeated, 200), (part.as_str(), 1005)] {
        let most_script = script.replace("COUNT", &most.to_string());
        assert_eq!(last_line_and_fault(&most_script, 4096), (thousand.clone(), None));
    }
    let more = part.replace("COUNT", "1006");
    assert_eq!(last_line_and_fault(&more, 4096), (None, too_long));

    // The memory alone limits the texts of a computer.
    let (last, fault) = last_line_and_fault(growing, 30_000);
    assert_eq!(fault, Some(FaultCode::OutOfMemory));
    assert!(last.and_then(|line| line.parse::<u32>().ok()) > Some(10_000));
}

#[test]
fn texts_have_the_order_of_their_bytes() {
    let endings =
        ["", "a", "b", "z", "aa", "ab", "az", "zzzz", "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"];
    let script = "
        first = string.concat(\"?\", \"FIRST\")
        second = string.concat(\"?\", \"SECOND\")
        log(first < second, first <= second, first > second, first >= second, first == second)";
    for first in endings {
        for second in endings {
            let script = script.replace("FIRST", first).replace("SECOND", second);
            let truths =
                [first < second, first <= second, first > second, first >= second, first == second];
            let expected = truths.map(|truth| u8::from(truth).to_string()).join(" ");
            let logged = lines(&run::<Full>(&script, &settings(2000)));
            assert_eq!(logged, [expected], "{first} {second}");
        }
    }
}
