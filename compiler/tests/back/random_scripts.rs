//! Random scripts: whatever is written, the verifier takes what the compiler makes, nothing panics, and what the
//! compiler knows of a script does not change what it does.

use bittybuzz_vm_core::FaultCode;
use proptest::prelude::*;

use crate::back::machine::{FULL, Run, TINY, at_least, build, run, verify};

/// Names of which some are locals, some captured, some global, depending on the place.
const NAMES: [&str; 5] = ["a", "b", "c", "self", "g"];

fn expression() -> BoxedStrategy<String> {
    let leaf = prop_oneof![
        4 => prop::sample::select(NAMES.to_vec()).prop_map(str::to_owned),
        2 => (-20..300_i32).prop_map(|n| n.to_string()),
        1 => Just("nil".to_owned()),
        1 => Just("1.5".to_owned()),
        1 => Just("\"s\"".to_owned()),
        1 => Just("{}".to_owned()),
        1 => Just("named".to_owned()),
        1 => Just("math".to_owned()),
    ];
    leaf.prop_recursive(4, 30, 4, |inner| {
        let operator = prop::sample::select(vec![
            "+", "-", "*", "/", "%", "^", "&", "<<", "==", "!=", "<", ">=", "and", "or",
        ]);
        let wrapped =
            inner.clone().prop_map(|e| if e == "{}" { "g".to_owned() } else { format!("({e})") });
        prop_oneof![
            (wrapped.clone(), operator, wrapped.clone())
                .prop_map(|(l, op, r)| format!("({l} {op} {r})")),
            wrapped.clone().prop_map(|e| format!("(not {e})")),
            wrapped.clone().prop_map(|e| format!("(-{e})")),
            inner.clone().prop_map(|e| format!("g.field[{e}]")),
            (inner.clone(), inner.clone()).prop_map(|(x, y)| format!("named({x}, {y})")),
            inner.clone().prop_map(|x| format!("g.method({x})")),
            inner.clone().prop_map(|x| format!("g[\"k\"]({x}, 2)()")),
            inner.clone().prop_map(|x| format!("math.abs({x})")),
            inner.clone().prop_map(|x| format!("isnil({x})")),
            inner.clone().prop_map(|x| format!("{{.x = {x}, .3 = 4}}")),
            prop::collection::vec(statement(inner.clone()), 0..3)
                .prop_map(|body| format!("function(c, d) {{ {} }}", body.join("\n"))),
        ]
    })
    .boxed()
}

/// A condition: a table or lambda cannot stand alone in it.
fn statement(expression: impl Strategy<Value = String> + Clone + 'static) -> BoxedStrategy<String> {
    let e = expression.clone();
    let simple = prop_oneof![
        (prop::sample::select(vec!["a", "b", "c", "g"]), e.clone())
            .prop_map(|(n, e)| format!("{n} = {e};")),
        (prop::sample::select(vec!["v", "w"]), e.clone())
            .prop_map(|(n, e)| format!("var {n} = {e};")),
        e.clone().prop_map(|e| format!("g.f = {e};")),
        e.clone().prop_map(|e| format!("g[1] = {e};")),
        e.clone().prop_map(|e| format!("log({e});")),
        e.clone().prop_map(|e| format!("return ({e});").replace("({})", "nil")),
        Just("return;".to_owned()),
        Just("a = a + 1;".to_owned()),
    ];
    simple
        .prop_recursive(3, 12, 3, move |inner| {
            let body = prop::collection::vec(inner.clone(), 0..4).prop_map(|body| body.join("\n"));
            let condition = e.clone().prop_map(|e| if e == "{}" { "g".to_owned() } else { e });
            prop_oneof![
                (condition.clone(), body.clone()).prop_map(|(c, b)| format!("if({c}) {{ {b} }}")),
                (condition.clone(), body.clone(), body.clone())
                    .prop_map(|(c, b, o)| format!("if({c}) {{ {b} }} else {{ {o} }}")),
                (condition.clone(), inner.clone()).prop_map(|(c, s)| format!("if({c}) {s}")),
                (condition.clone(), body.clone())
                    .prop_map(|(c, b)| format!("while({c}) {{ {b} }}")),
                (prop::sample::select(vec!["0", "1"]), body.clone())
                    .prop_map(|(c, b)| format!("while({c}) {{ {b} }}")),
                (prop::sample::select(vec!["0", "1"]), body.clone(), body.clone())
                    .prop_map(|(c, b, o)| format!("if({c}) {{ {b} }} else {{ {o} }}")),
                (condition, body)
                    .prop_map(|(c, b)| format!("for(a = 0, {c}, a = a + 1) {{ {b} }}")),
            ]
        })
        .boxed()
}

fn script() -> impl Strategy<Value = String> {
    let body =
        || prop::collection::vec(statement(expression()), 0..6).prop_map(|body| body.join("\n"));
    (body(), body(), body()).prop_map(|(global, named, step)| {
        format!(
            "g = {{}}\nfunction named(a, b) {{ {named} }}\nfunction step() {{ {step} }}\n{global}\n"
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: at_least(300), failure_persistence: None, max_shrink_iters: 20000, ..ProptestConfig::default() })]

    /// The first line makes ordinary variables of what is else called directly, so it takes away what the compiler knows.
    #[test]
    fn optimizations_do_not_change_results(script in script()) {
        let blind = format!("{script}\nstep = step named = named math = math isnil = isnil log = log");
        for profile in [TINY, FULL] {
            if build(&script, profile).image.is_none() {
                continue;
            }
            let script = format!("{script}\nstep()");
            let blind = format!("{blind} step()");
            let (known, unknown) = (run(&script, profile), run(&blind, profile));
            // How deep calls may go depends on how large the frames are.
            let full = |run: &Run| {
                let code = run.fault.map(|fault| fault.code);
                matches!(code, Some(FaultCode::StackOverflow | FaultCode::OutOfMemory))
            };
            if known.ended && unknown.ended && !full(&known) && !full(&unknown) {
                prop_assert_eq!(&known.output, &unknown.output, "{}", script);
                prop_assert_eq!(
                    known.fault.map(|fault| fault.code),
                    unknown.fault.map(|fault| fault.code),
                    "{}",
                    script
                );
            }
        }
    }

    #[test]
    fn the_verifier_accepts_every_compiled_image(script in script()) {
        for profile in [TINY, FULL] {
            let compiled = build(&script, profile);
            let internal = compiled.diagnostics.iter().find(|d| d.code.text() == "E0699");
            prop_assert!(internal.is_none(), "{}\n{:?}", script, internal);
            if let Some(image) = compiled.image {
                let accepted = verify(&image, profile);
                prop_assert_eq!(accepted, Ok(()), "{}", script);
            }
        }
    }
}

#[test]
fn most_random_scripts_compile() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let strategy = script();
    let total = 200;
    let compiled = (0..total)
        .filter(|_| {
            let script = strategy.new_tree(&mut runner).expect("a script").current();
            build(&script, FULL).image.is_some()
        })
        .count();
    assert!(
        compiled * 2 > total,
        "only {compiled} of {total} compile: the test above would say little"
    );
}
