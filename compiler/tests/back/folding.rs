//! What is computed when a script is compiled equals, bit for bit, what the machine would have computed.

use bittybuzz_robot_spec::NumberProfile;
use proptest::prelude::*;

use crate::back::machine::{FULL, TINY, at_least, image, listing, run};

const OPERATORS: [&str; 16] =
    ["+", "-", "*", "/", "%", "^", "&", "|", "<<", ">>", "==", "!=", "<", "<=", ">", ">="];

/// Literals of a profile, the edges among them.
fn literal(profile: NumberProfile) -> BoxedStrategy<String> {
    let (low, high) = match profile {
        NumberProfile::Tiny => (i32::from(i16::MIN), i32::from(i16::MAX)),
        NumberProfile::Full => (i32::MIN, i32::MAX),
    };
    let ints = prop_oneof![Just(low), Just(high), Just(low + 1), -40..40_i32, low..=high,];
    let floats = prop_oneof![
        (-1000..1000_i32).prop_map(|n| f64::from(n) / 8.0),
        (-40_000_000..40_000_000_i32).prop_map(|n| f64::from(n) / 1024.0),
        (1..1000_i32).prop_map(|n| f64::from(n) * 1e-7),
        Just(-0.0),
    ];
    prop_oneof![
        3 => ints.prop_map(|n| n.to_string()),
        3 => floats.prop_map(|n| format!("{n:?}")),
        1 => Just("nil".to_owned()),
        1 => Just("\"abc\"".to_owned()),
        1 => Just("\"table\"".to_owned()),
    ]
    .boxed()
}

/// Both ways to compute one thing: with literals for A and B, and with variables that hold them.
fn both(profile: NumberProfile, a: &str, b: &str, expression: &str) -> Result<(), TestCaseError> {
    let folded = format!("r = {}", expression.replace('A', a).replace('B', b));
    let expression = expression.replace('A', "a").replace('B', "b");
    let computed = format!("a = {a}\nb = {b}\nr = {expression}");
    let compiled = crate::back::machine::build(&folded, profile);
    // An order that the compiler refuses must fault.
    if compiled.image.is_none() {
        let fault = run(&computed, profile).fault;
        prop_assert!(fault.is_some(), "{folded}: {:?}", compiled.diagnostics);
        return Ok(());
    }
    let (x, y) = (run(&folded, profile), run(&computed, profile));
    prop_assert_eq!(
        x.fault.map(|fault| fault.code),
        y.fault.map(|fault| fault.code),
        "{}\n{}",
        folded,
        computed
    );
    prop_assert_eq!(x.global("r"), y.global("r"), "{}\n{}", folded, computed);
    Ok(())
}

fn binary(profile: NumberProfile) -> impl Strategy<Value = (String, String, &'static str)> {
    (literal(profile), literal(profile), prop::sample::select(OPERATORS.to_vec()))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: at_least(1000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn tiny((a, b, op) in binary(NumberProfile::Tiny)) {
        both(TINY, &a, &b, &format!("(A {op} B)"))?;
    }

    #[test]
    fn full((a, b, op) in binary(NumberProfile::Full)) {
        both(FULL, &a, &b, &format!("(A {op} B)"))?;
    }

    #[test]
    fn unary(a in literal(NumberProfile::Tiny), op in prop::sample::select(vec!["-", "!", "not ", "- -", "not not "])) {
        both(TINY, &a, "0", &format!("({op}(A))"))?;
        both(FULL, &a, "0", &format!("({op}(A))"))?;
    }

    #[test]
    fn one_literal((a, b, op) in binary(NumberProfile::Tiny)) {
        // Forms for one literal: additions, comparisons of floats with integers.
        for profile in [TINY, FULL] {
            let full = format!("a = {a}\nb = {b}\nr = (a {op} b)");
            let expected = run(&full, profile);
            for script in [format!("a = {a}\nr = (a {op} {b})"), format!("b = {b}\nr = ({a} {op} b)"),
                format!("function f(a) {{ a = (a {op} {b}) return a }} r = f({a})")] {
                let compiled = crate::back::machine::build(&script, profile);
                prop_assert!(compiled.image.is_some(), "{}", script);
                let found = run(&script, profile);
                prop_assert_eq!(found.fault.map(|f| f.code), expected.fault.map(|f| f.code), "{}", script);
                prop_assert_eq!(found.global("r"), expected.global("r"), "{}", script);
            }
        }
    }

    #[test]
    fn floats_next_to_floats(a in literal(NumberProfile::Tiny), n in -2000..2000_i32, op in prop::sample::select(vec!["+", "-"])) {
        for profile in [TINY, FULL] {
            let literal = format!("{}.0", n);
            let expected = run(&format!("a = {a}\nb = {literal}\nc = 1.0\nr = (a * c) {op} b"), profile);
            let found = run(&format!("a = {a}\nr = a * 1.0 {op} {literal}"), profile);
            prop_assert_eq!(found.fault.map(|f| f.code), expected.fault.map(|f| f.code));
            prop_assert_eq!(found.global("r"), expected.global("r"), "a = {}, {} {}", a, op, literal);
        }
    }
}

#[test]
fn constants_leave_no_code() {
    let code = |script: &str| {
        let (bytes, symbols) = image(script, FULL);
        listing(&bytes, &symbols)
    };
    for script in
        ["x = 2 * 3 + 4", "x = 2 ^ 10 / 4", "x = \"a\" < \"b\" and not 0", "x = -(-(5)) << 2"]
    {
        let listing = code(script);
        let instructions =
            listing.lines().filter(|line| line.contains(": ") && line.starts_with(' ')).count();
        assert_eq!(instructions, 3, "{listing}");
    }
}

#[test]
fn faults_are_not_folded_away() {
    for script in
        ["x = 1 / 0", "x = 1 % 0", "x = 1 << 40", "x = \"a\" + 1", "x = -nil", "x = 1.5 & 1"]
    {
        assert!(run(script, FULL).fault.is_some(), "{script}");
    }
}

#[test]
fn products_round_once() {
    // The exact product is 0.498 units in the last place away from the nearest float. Rounded to 32 bits first, it is
    // the midpoint of two floats, and the even one of them is the wrong one.
    let expected = Some(Err((6.79e-5_f32 * -72.875).to_bits()));
    assert_eq!(run("r = 6.79e-5 * -72.875", FULL).global("r"), expected);
    assert_eq!(run("a = 6.79e-5 r = a * -72.875", FULL).global("r"), expected);
}

#[test]
fn literals_round_once() {
    // Half a unit in the last place of binary32 above the midpoint of two 16-bit floats: rounding to binary32 first
    // would land on the midpoint, and then go to the even one below.
    let midpoint = 1.0 + 1.0 / 1024.0;
    let above = format!("x = {:?}", midpoint + 2.0_f64.powi(-30));
    assert_eq!(run(&above, TINY).global("x"), Some(Err((1.0_f32 + 1.0 / 512.0).to_bits())));
    let exact = format!("x = {midpoint:?}");
    assert_eq!(run(&exact, TINY).global("x"), Some(Err(1.0_f32.to_bits())));
    let below = format!("x = {:?}", midpoint + 2.0 / 1024.0 - 2.0_f64.powi(-30));
    assert_eq!(run(&below, TINY).global("x"), Some(Err((1.0_f32 + 1.0 / 512.0).to_bits())));
}
