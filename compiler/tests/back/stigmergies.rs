//! The stigmergy table: which numbers of a script take one frame.

use bittybuzz_compiler::compile::{Compiled, Options};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_vm_core::builtin::Feature;
use bittybuzz_vm_core::image::{Image, ImageHeader};
use std::path::Path;

use crate::back::machine::{FULL, TINY, build, build_for, image, listing};

fn header(bytes: &[u8]) -> ImageHeader {
    Image::new(bytes).header().expect("an image")
}

/// The stigmergy table of an image.
fn table_of(bytes: &[u8]) -> Option<[u16; 3]> {
    let at = usize::from(header(bytes).stigmergies_at()?);
    Some([0, 2, 4].map(|row| u16::from_le_bytes([bytes[at + row], bytes[at + row + 1]])))
}

/// The stigmergy table of a script, which has to be the same in both profiles.
fn table(script: &str) -> Option<[u16; 3]> {
    let tables = [TINY, FULL].map(|profile| table_of(&image(script, profile).0));
    assert_eq!(tables[0], tables[1], "{script}");
    tables[0]
}

#[test]
fn numbers_below_three_need_no_table() {
    for script in [
        "v = stigmergy.create(0)",
        "v = stigmergy.create(1)",
        "v = stigmergy.create(2) w = stigmergy.create(1) u = stigmergy.create(0)",
        // Known at run time only.
        "v = stigmergy.create(id)",
        "function f(n) { return stigmergy.create(n) } v = f(5)",
        "t = {.n = 5} v = stigmergy.create(t.n)",
        // Only the first three take one frame.
        "v = stigmergy.create(2) w = stigmergy.create(1) u = stigmergy.create(0) x = stigmergy.create(9)",
        // No number of a stigmergy.
        "v = swarm.create(5)",
        "s = swarm v = s.create(5) w = stigmergy.create(1)",
        "t = {.create = function(n) { return n }} v = t.create(5) w = stigmergy.create(1)",
        "x = 5 v = stigmergy.create(1)",
    ] {
        assert_eq!(table(script), None, "{script}");
    }
}

#[test]
fn the_first_three_numbers_change_places_with_the_small_ones() {
    for (script, expected) in [
        ("v = stigmergy.create(5)", [5, 1, 2]),
        ("v = stigmergy.create(3) w = stigmergy.create(101)", [3, 101, 2]),
        ("v = stigmergy.create(101) w = stigmergy.create(3)", [101, 3, 2]),
        (
            "v = stigmergy.create(9) w = stigmergy.create(8) u = stigmergy.create(7) x = stigmergy.create(6)",
            [9, 8, 7],
        ),
        // Each counts once, at its first place.
        (
            "v = stigmergy.create(9) w = stigmergy.create(9) u = stigmergy.create(7) x = stigmergy.create(9)",
            [9, 7, 2],
        ),
        // Small numbers keep their places.
        ("v = stigmergy.create(0) w = stigmergy.create(3) u = stigmergy.create(5)", [0, 3, 5]),
        ("v = stigmergy.create(9) w = stigmergy.create(0)", [0, 9, 2]),
        ("v = stigmergy.create(9) w = stigmergy.create(1) u = stigmergy.create(8)", [9, 1, 8]),
        ("v = stigmergy.create(9) w = stigmergy.create(2) u = stigmergy.create(0)", [0, 9, 2]),
        // Code that never runs counts, and so do functions that nothing calls.
        ("if(0) v = stigmergy.create(9) w = stigmergy.create(8)", [9, 8, 2]),
        ("function f() { return stigmergy.create(9) } w = stigmergy.create(8)", [9, 8, 2]),
        ("w = stigmergy.create(8) function f() { return stigmergy.create(9) }", [8, 9, 2]),
        (
            "if(x) { while(x) v = stigmergy.create(9) } else { for(i = 0, i < 1, i = i + 1) v = stigmergy.create(8) } x = 1",
            [9, 8, 2],
        ),
        (
            "t = {.f = function() { return stigmergy.create(9) }} v = t.f() v = stigmergy.create(8)",
            [9, 8, 2],
        ),
        // A variable, whose value may follow.
        ("N = 9 v = stigmergy.create(N)", [9, 1, 2]),
        ("function init() { v = stigmergy.create(N) } N = 9", [9, 1, 2]),
        ("function init() { var n = 9 v = stigmergy.create(n) }", [9, 1, 2]),
        ("N = 9 M = N v = stigmergy.create(M)", [9, 1, 2]),
        ("N = 9 if(id) N = 8 v = stigmergy.create(N)", [9, 8, 2]),
        ("var n = 9 v = stigmergy.create(n)", [9, 1, 2]),
        // Variables of functions are their own.
        (
            "function init() { var n = 7 return n } function step() { var n = 9 return stigmergy.create(n) }",
            [9, 1, 2],
        ),
        ("n = 7 function f(n) { return stigmergy.create(n) } v = stigmergy.create(8)", [8, 1, 2]),
        ("function init() { var n = 9 f = function() { return stigmergy.create(n) } }", [9, 1, 2]),
        // An expression of constants.
        ("v = stigmergy.create(2 + 3)", [5, 1, 2]),
        ("N = 80 v = stigmergy.create(N + 1) w = stigmergy.create((N - 1) * 2)", [81, 158, 2]),
        ("v = stigmergy.create(-(-5))", [5, 1, 2]),
        // By another name.
        ("s = stigmergy v = s.create(5)", [5, 1, 2]),
        ("c = stigmergy.create v = c(5)", [5, 1, 2]),
        ("s = stigmergy c = s.create v = c(5)", [5, 1, 2]),
        ("function init() { var s = stigmergy v = s.create(5) }", [5, 1, 2]),
        // Numbers that no stigmergy can have take no place.
        ("v = stigmergy.create(-5) w = stigmergy.create(5)", [5, 1, 2]),
        ("v = stigmergy.create(5.0) w = stigmergy.create(6)", [6, 1, 2]),
    ] {
        assert_eq!(table(script), Some(expected), "{script}");
    }
    let (bytes, _) = image("v = stigmergy.create(65535) w = stigmergy.create(70000)", FULL);
    assert_eq!(table_of(&bytes), Some([65535, 1, 2]));
}

/// The table costs six bytes, and only where a number is above 2.
#[test]
fn a_table_has_six_bytes() {
    let length = |number: u16| image(&format!("v = stigmergy.create({number})"), TINY).0.len();
    assert_eq!(length(3), length(2) + 6);
    assert_eq!(length(2), length(0));
    let with = image("v = stigmergy.create(9)", TINY).0;
    let without = image("v = stigmergy.create(2)", TINY).0;
    assert_eq!(header(&with).features(), Feature::Stigmergy as u8 | Feature::StigmergyTable as u8);
    assert_eq!(header(&without).features(), Feature::Stigmergy as u8);
}

/// Robots of all kinds agree on the table and on the script hash, also where a robot has no stigmergy.
#[test]
fn the_table_does_not_depend_on_the_robot() {
    let script = "function init() { if(goTo) { a = stigmergy.create(7) } else { b = stigmergy.create(8) } c = stigmergy.create(9) }
        function unused() { return stigmergy.create(6) }";
    let compile = |robot| build_for(script, TINY, robot).image.expect("no errors");
    let images = [None, Some("kilobot"), Some("crazyflie"), Some("zooids")].map(compile);
    for bytes in &images {
        assert_eq!(table_of(bytes), Some([7, 8, 9]));
        assert_eq!(header(bytes).hash(), header(&images[0]).hash());
    }
    // This robot does not use stigmergy.
    let script = "function init() { if(goTo) { a = stigmergy.create(7) a.put(1, 2) } }";
    let of = |robot| build_for(script, TINY, Some(robot)).image.expect("no errors");
    let [flies, drives] = ["crazyflie", "kilobot"].map(of);
    assert_eq!((table_of(&flies), table_of(&drives)), (Some([7, 1, 2]), None));
    assert_eq!(header(&flies).hash(), header(&drives).hash());
}

/// The order is that of the tokens, in whatever file they are.
#[test]
fn included_files_count_where_they_are_included() {
    let files = MemoryFiles::default()
        .with("a.bzz", "function a() { return stigmergy.create(7) }")
        .with("b.bzz", "include \"c.bzz\"\nb = stigmergy.create(8)")
        .with("c.bzz", "c = stigmergy.create(9)");
    let compile = |text: &str| -> Compiled {
        let loader = IncludeLoader::new(&files);
        let options = Options { profile: Some(TINY), ..Options::default() };
        bittybuzz_compiler::compile::compile(
            Path::new("main.bzz"),
            text.to_owned(),
            &loader,
            &options,
        )
    };
    let included = compile("include \"b.bzz\"\nm = stigmergy.create(6)\ninclude \"a.bzz\"");
    let bytes = included.image.expect("no errors");
    assert_eq!(table_of(&bytes), Some([9, 8, 6]));
    // The same tokens in one file are the same script.
    let flat = compile(
        "c = stigmergy.create(9) b = stigmergy.create(8) m = stigmergy.create(6)
         function a() { return stigmergy.create(7) }",
    );
    let flat = flat.image.expect("no errors");
    assert_eq!(table_of(&flat), table_of(&bytes));
    assert_eq!(header(&flat).hash(), header(&bytes).hash());
}

/// Compilers before the table gave a stigmergy with a number above 2 another number in messages, so the hash differs
/// from theirs. That of other scripts does not.
#[test]
fn the_hash_covers_the_table() {
    use bittybuzz_compiler::parser::parse;
    use bittybuzz_vm_core::hash::fnv_1a_from;
    use bittybuzz_vm_core::message;
    let without_table = |script: &str| {
        let files = MemoryFiles::default();
        let parsed = parse(Path::new("main.bzz"), script.to_owned(), &IncludeLoader::new(&files));
        fnv_1a_from(parsed.token_hash, &[0, message::VERSION])
    };
    let hash = |script: &str| header(&image(script, TINY).0).hash();
    let small = "v = stigmergy.create(2)";
    assert_eq!(hash(small), without_table(small));
    let great = "v = stigmergy.create(3)";
    assert_eq!(hash(great), fnv_1a_from(without_table(great), &[3, 0, 1, 0, 2, 0]));
}

#[test]
fn the_listing_shows_the_table() {
    let (bytes, symbols) = image("v = stigmergy.create(0) w = stigmergy.create(101)", TINY);
    let listing = listing(&bytes, &symbols);
    let lines: Vec<&str> = listing.lines().filter(|line| line.starts_with("stigmergy ")).collect();
    assert_eq!(lines, ["stigmergy 0  0", "stigmergy 1  101", "stigmergy 2  2"]);
}

/// The warning names the cost, once per number, at the first place after three others.
#[test]
fn stigmergies_after_the_third_are_reported_where_they_cost() {
    let script = "a = stigmergy.create(9) b = stigmergy.create(0)\nc = stigmergy.create(8) a = stigmergy.create(9)\n\
        N = 101 d = stigmergy.create(N) e = stigmergy.create(N)\nf = stigmergy.create(1)";
    let reported = |compiled: Compiled| -> Vec<(u32, String)> {
        let found = compiled.diagnostics.iter().map(|found| {
            assert_eq!(found.code.text(), "W0225");
            (compiled.sources.line_column(found.span).line, found.message.clone())
        });
        found.collect()
    };
    let three = |number| format!("each entry of stigmergy {number} takes 3 frames");
    let expected = vec![(3, three(101)), (4, three(1))];
    assert_eq!(reported(build(script, TINY)), expected);
    assert_eq!(reported(build_for(script, TINY, Some("kilobot"))), expected);
    // One fragment is one frame.
    assert_eq!(reported(build(script, FULL)), []);
}
