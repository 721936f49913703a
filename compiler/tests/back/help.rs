//! Help that names a cure, and the edits that apply it.

use crate::back::diagnostics::CASES;
use crate::back::machine::{FULL, build};

/// Editors and `--fix` apply edits, so a replacement that help names must be one.
#[test]
fn help_that_names_a_replacement_has_it_as_an_edit() {
    let mut replacements = 0;
    let others = [
        "fro(i = 0, i < 3, i = i + 1) { log(i) }",
        "funtcion f() { log(1) }",
        "x = sqrt(2)",
        "x = math.sqr(2)",
        "x = math.uniform(1)",
        "x = math.PI",
        "x = math.atan2(1, 2)",
        "x = math.rng_uniform(1, 2)",
        "x = rng.uniform(1, 2)",
        "sleep(100)",
        "x = this",
        "x = robot_id",
        "println(1)",
        "forwrad()",
        "function stpe() { log(1) }",
        "log(neighbors.get(1).distnace)",
        "if(neighbors.count) log(1)",
        "x = Nil",
        "x = VAR",
    ];
    for script in CASES.iter().map(|(script, ..)| *script).chain(others) {
        for found in build(script, FULL).diagnostics {
            let help = found.help.clone().unwrap_or_default();
            // Without its parameters the function's body would be wrong.
            if help.starts_with("write `function ") {
                continue;
            }
            let one = ["did you mean `", "it is `", "the keyword is written `", "write `"]
                .into_iter()
                .find_map(|start| help.strip_prefix(start));
            // A pattern with a place for something else is no replacement.
            let is_pattern = |text: &str| {
                ["...", "value", "condition", "file.bzz", "a < b"]
                    .iter()
                    .any(|it| text.contains(it))
            };
            let one = one.and_then(|rest| rest.split_once('`'));
            let Some((replacement, rest)) = one.filter(|(text, _)| !is_pattern(text)) else {
                assert!(
                    !help.contains("did you mean") || help.contains(" or "),
                    "{script}: {help}"
                );
                continue;
            };
            // A help with two alternatives leaves the choice to the author.
            if rest.contains(" or ") {
                continue;
            }
            let edit = found.edits.first();
            let edit = edit.unwrap_or_else(|| panic!("{script}: no edit for: {help}"));
            assert!(replacement.contains(edit.text.trim()), "{script}: {help}: {}", edit.text);
            replacements += 1;
        }
    }
    assert!(replacements >= 20, "{replacements}");
}

/// The edits of a mistake of which help names the cure, applied.
#[test]
fn edits_make_the_script_that_was_meant() {
    for (code, script, meant) in [
        ("E0219", "if(x = 1) log(1)", "if(x == 1) log(1)"),
        (
            "E0201",
            "s = swarm.create(1) s.select(id % 2 = 0)",
            "s = swarm.create(1) s.select(id % 2 == 0)",
        ),
        ("E0213", "if id > 3 { log(1) }", "if (id > 3) { log(1) }"),
        ("E0213", "if (id > 3) and (id < 9) { log(1) }", "if ((id > 3) and (id < 9)) { log(1) }"),
        ("E0204", "if(1 < id < 5) log(1)", "if(1 < id and id < 5) log(1)"),
        ("W0208", "log(neighbors[3])", "log(neighbors.get(3))"),
        ("E0218", "t = {} log(t.1)", "t = {} log(t[1])"),
        ("E0220", "t = {a = 1}", "t = {.a = 1}"),
        ("E0220", "t = {a: 1}", "t = {.a = 1}"),
        ("E0220", "t = {\"a\": 1}", "t = {.a = 1}"),
        ("E0215", "var x == 1 log(x)", "var x = 1 log(x)"),
        ("E0215", "x = 1\nx == 2\nlog(x)", "x = 1\nx = 2\nlog(x)"),
        ("E0106", "n = 1\nn += id - 2\nlog(n)", "n = 1\nn = n + id - 2\nlog(n)"),
        ("E0106", "t = {.n = 1}\nt.n *= 2\nlog(t.n)", "t = {.n = 1}\nt.n = t.n * 2\nlog(t.n)"),
        ("E0106", "n = 1\nn++\nlog(n)", "n = 1\nn = n + 1\nlog(n)"),
        ("E0106", "n = 1\nif(id) n--\nlog(n)", "n = 1\nif(id) n = n - 1\nlog(n)"),
        ("E0106", "for(i = 0, i < 3, i++) { log(i) }", "for(i = 0, i < 3, i = i + 1) { log(i) }"),
        ("E0217", "const x = 3\nlog(x)", "var x = 3\nlog(x)"),
        ("E0217", "def f(a) { log(a) }", "function f(a) { log(a) }"),
        (
            "W0106",
            "function f() { if(id) return\nid }\nf()",
            "function f() { if(id) return;\nid }\nf()",
        ),
        ("W0108", "if(!(id > 1)) log(1)", "if((not (id > 1))) log(1)"),
        (
            "W0219",
            "Count = 0\nfunction step() { count = count + 1 log(Count) }",
            "Count = 0\nfunction step() { count = Count + 1 log(Count) }",
        ),
    ] {
        let found = build(script, FULL).diagnostics.into_iter().find(|it| it.code.text() == code);
        let found = found.unwrap_or_else(|| panic!("{script}: no {code}"));
        let mut edited = script.to_owned();
        let mut edits = found.edits.clone();
        edits.sort_by_key(|edit| std::cmp::Reverse(edit.span.start));
        for edit in edits {
            let range = edit.span.start as usize..edit.span.end as usize;
            edited.replace_range(range, &edit.text);
        }
        assert_eq!(edited, meant, "{script}");
    }
    // There the same edit would change the meaning, or is no statement.
    for script in ["n = 1\nn -= id - 2\nlog(n)", "n = 1\nlog(n++)", "n = 1\nn *= id + 1\nlog(n)"] {
        let found =
            build(script, FULL).diagnostics.into_iter().find(|it| it.code.text() == "E0106");
        assert!(found.is_some_and(|found| found.edits.is_empty()), "{script}");
    }
}

#[test]
fn help_names_the_likely_name() {
    let help = |script: &str| {
        let compiled = build(script, FULL);
        let found = compiled.diagnostics.first().unwrap_or_else(|| panic!("{script}"));
        found.help.clone().unwrap_or_default()
    };
    let cases = [
        ("counter = 1 log(conter)", "`counter`"),
        ("function steer() { } ster()", "`steer`"),
        ("function f() { var speed = 1 return sped } f()", "`speed`"),
        ("function f(speed) { return function() { return sped } } f(1)", "`speed`"),
        ("forwrad()", "`forward`"),
        ("x = sizee", "`size`"),
        ("x = neighbours.count()", "`neighbors`"),
        ("x = sqrt(2)", "`math.sqrt`"),
        ("broadcast(\"a\", 1)", "`neighbors.broadcast`"),
        ("uniform(1, 2)", "`math.rng.uniform`"),
        ("x = math.sqr(1)", "`math.sqrt`"),
        ("x = math.squareroot(1)", "`math.sqrt`"),
        ("x = math.uniform(1)", "`math.rng.uniform`"),
        ("x = math.random(1)", "`math.rng.uniform(a, b)`"),
        ("x = math.pow(2, 3)", "`x ^ y`"),
        ("x = pow(2, 3)", "`x ^ y`"),
        ("x = math.fmod(3, 2)", "`x % y`"),
        ("x = mod(3, 2)", "`x % y`"),
        ("x = math.atan2(1, 2)", "`math.atan`"),
        ("x = math.rng_uniform(1, 2)", "`math.rng.uniform`"),
        ("x = rng_uniform(1, 2)", "`math.rng.uniform`"),
        ("x = rng.uniform(1, 2)", "`math.rng`"),
        ("x = math.roundi(2.5)", "`math.round`"),
        ("neighbors.brodcast(1, 2)", "`neighbors.broadcast`"),
        ("stigmergy.put(\"a\", 1)", "`v = stigmergy.create(1)`"),
        ("stigmergy.get(\"a\")", "`v.get(key)`"),
        ("swarm.exec(function() { log(1) })", "`s = swarm.create(1)`"),
        ("swarm.join(1)", "`s.join()`"),
        ("swarm.creat(1)", "`swarm.create`"),
        ("function stpe() { log(1) }", "`function step()`"),
        ("x = neighbors.count > 3", "`neighbors.count()`"),
        ("log(neighbors.get(1).distnace)", "`distance`"),
        ("neighbors.listen(\"k\", function(v) { log(v + 1) })", "f(topic, value, id)"),
        ("x = true", "use 1"),
        ("x = false", "use 0"),
        ("x = null", "`nil`"),
        ("println(1)", "`log(...)`"),
        ("sleep(100)", "`delay(ms)`"),
        ("x = this", "`self`"),
        ("log(size())", "size(t)"),
        ("led()", "`led(color: int 0..7)`"),
    ];
    for (script, part) in cases {
        assert!(help(script).contains(part), "{script}: {}", help(script));
    }
    // Nothing is like it.
    assert_eq!(help("qqqqqqqq()"), "");
}
