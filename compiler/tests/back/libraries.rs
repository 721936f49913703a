//! Libraries: direct calls where they are untouched, tables where the script treats them as such.

use bittybuzz_vm_core::builtin::{self, Feature, Library};
use bittybuzz_vm_core::image::{FORM_LIBRARIES, Image, ImageHeader};

use crate::back::machine::{FULL, TINY, image, listing, output, run};

fn header(script: &str) -> ImageHeader {
    let (bytes, _) = image(script, FULL);
    Image::new(bytes.as_slice()).header().expect("an image")
}

fn rows(script: &str) -> Vec<String> {
    let (bytes, symbols) = image(script, FULL);
    let listing = listing(&bytes, &symbols);
    listing
        .lines()
        .filter_map(|line| line.strip_prefix("member "))
        .map(|row| row.trim().to_owned())
        .collect()
}

#[test]
fn untouched_libraries_need_no_table() {
    let header = header(
        "x = math.abs(-1) y = math.rng.uniform(1, 2) neighbors.listen(\"k\", log) f = math.min",
    );
    assert_eq!(header.form() & FORM_LIBRARIES, 0);
    assert_eq!(header.features(), Feature::Neighbors as u8);
}

#[test]
fn features_are_those_of_the_functions_used() {
    assert_eq!(header("x = math.abs(1)").features(), 0);
    assert_eq!(header("x = math.sin(1)").features(), Feature::Maths as u8);
    assert_eq!(header("x = string.length(\"a\")").features(), Feature::Strings as u8);
    assert_eq!(header("s = swarm.create(1)").features(), Feature::Swarm as u8);
    assert_eq!(header("v = stigmergy.create(1)").features(), Feature::Stigmergy as u8);
    // What never runs is not needed.
    assert_eq!(header("if(0) x = math.sin(1)").features(), 0);
    // All of a library that is used as a value is.
    assert_eq!(header("m = math").features(), Feature::Maths as u8);
}

#[test]
fn pi_is_a_literal() {
    assert_eq!(run("x = math.pi", FULL).global("x"), Some(Err(std::f32::consts::PI.to_bits())));
    // 3.140625 is the nearest with nine bits of fraction.
    assert_eq!(run("x = math.pi", TINY).global("x"), Some(Err(3.140_625_f32.to_bits())));
}

#[test]
fn a_library_can_be_extended_and_changed() {
    let script = "
        math.twice = function(x) { return 2 * x }
        log(math.twice(4), math.abs(-3))
        old = math.abs
        math.abs = function(x) { return old(x) + 100 }
        log(math.abs(-3), math.max(1, 2))
        log(isnil(math.other))";
    assert_eq!(output(script), "83\n1032\n1\n");
    // Only the changed member has to be found by name.
    assert_eq!(rows(script), ["math.\"abs\" = math.abs"]);
}

#[test]
fn a_library_that_is_a_value_has_all_members() {
    let script = "m = math  log(m.abs(-4), math.min(2, 1))  m.abs = function(x) { return 7 }  log(math.abs(-4))";
    assert_eq!(output(script), "41\n7\n");
    let members =
        builtin::TABLE.iter().filter(|b| matches!(b.library, Library::Math | Library::Rng));
    assert_eq!(rows(script).len(), members.count());
}

#[test]
fn a_library_whose_name_is_assigned_is_the_first_value_of_a_variable() {
    assert_eq!(output("log(math.abs(-4)) math = { .abs = 1 } log(math.abs)"), "4\n1\n");
    assert_eq!(output("x = math.rng.uniform(1) math = nil log(x, isnil(math))"), "01\n");
}

#[test]
fn a_library_behind_a_computed_key() {
    let script = "k = \"abs\"  log(math[k](-5))  math[\"abs\"] = 1  log(math.abs)";
    assert_eq!(output(script), "5\n1\n");
}

#[test]
fn objects_have_the_members_that_the_script_names() {
    assert_eq!(
        rows("s = swarm.create(1) s.join() log(s[\"id\"])"),
        ["SwarmObject.\"id\" = SwarmObject.id", "SwarmObject.\"join\" = SwarmObject.join"]
    );
    assert_eq!(rows("n = neighbors.kin() log(n.count())"), ["Snapshot.\"count\" = Snapshot.count"]);
    assert_eq!(
        rows("v = stigmergy.create(1) v.put(\"a\", 1)"),
        ["StigmergyObject.\"put\" = StigmergyObject.put"]
    );
    // Through a value of the function, too.
    assert_eq!(rows("c = swarm.create s = c(1) s.leave()").len(), 1);
}

#[test]
fn testing_a_library_is_no_use_as_a_value() {
    assert_eq!(rows("if(math) log(math.abs(-1)) if(not isnil(string)) log(1)"), [""; 0]);
}

#[test]
fn a_replaced_random_generator() {
    let script = "math.rng = { .uniform = function(a) { return a } }  log(math.rng.uniform(5))";
    assert_eq!(output(script), "5\n");
    let script = "r = math.rng  r.setseed(1)  a = r.uniform(100)  math.rng.setseed(1)  log(a == math.rng.uniform(100))";
    assert_eq!(output(script), "1\n");
}

#[test]
fn isnil_is_a_comparison() {
    let (bytes, symbols) = image("x = 1 y = isnil(x) if(isnil(y)) log(1)", FULL);
    let listing = listing(&bytes, &symbols);
    assert!(!listing.contains("isnil"), "{listing}");
    assert_eq!(
        output("x = nil y = 0 log(isnil(x), isnil(y), isnil(\"\"), isnil(nil), isnil(isnil))"),
        "10010\n"
    );
}

#[test]
fn positions_are_found_by_name() {
    let script = "log(pos.x, \" \", pos.y)";
    assert_eq!(rows(script), ["pos.\"x\" = pos.x", "pos.\"y\" = pos.y"]);
    assert_eq!(output(script), "1.0 2.0\n");
}
