//! The time of a single instruction grows in proportion to the size of what it works on, never faster.
//!
//! Time is counted in accesses to slots and bytes of the image, which are the same on every host. A collection does not
//! count: `Vm::accesses` leaves it out.

use std::cell::Cell;

use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_testkit::Recorder;
use bittybuzz_tests::compiler;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{CountedCode, Entry, Image, Outcome, Sighting, Sizes, Vm};

const SLOTS: usize = 8000;
/// Sizes at which each script runs; the last is eight times the first.
const COUNTS: [u16; 4] = [50, 100, 200, 400];
/// The most that eight times the size may do: eight times the work, and all of it once more where an allocation is tried
/// again after a collection. A square would be 64.
const GROWTH: f64 = 17.0;

/// The most accesses that an instruction of `step()` takes, on a machine with that number of neighbors.
fn longest<P: Profile>(script: &str, neighbors: u16) -> u64 {
    let compiled = compiler::compile(script.to_owned(), P::FULL, &MemoryFiles::default());
    let image = compiled.image.unwrap_or_else(|| panic!("{script}\n{:?}", compiled.diagnostics));
    let reads = Cell::new(0);
    let mut vm: Box<Vm<P, CountedCode<'_>, SLOTS>> = Box::new(Vm::new());
    vm.set_network_capacity(Sizes {
        neighbors: (neighbors / 4) as u8,
        bearings: true,
        entries: 4,
        swarms: 8,
    });
    vm.load(Image::new(CountedCode::new(&image, &reads)), |_| true)
        .unwrap_or_else(|error| panic!("{script}\n{error:?}"));
    for robot in 0..neighbors / 4 {
        vm.add_neighbor(robot + 2, &Sighting::default(), u8::MAX);
    }
    let mut host = Recorder::default();
    let mut longest = 0;
    for entry in [Entry::Global, Entry::Init, Entry::Step] {
        if !vm.begin(entry) {
            continue;
        }
        longest = 0;
        loop {
            let before = vm.accesses() + reads.get();
            let outcome = vm.run(&mut host, 1);
            longest = longest.max(vm.accesses() + reads.get() - before);
            match outcome {
                Outcome::Pending => {}
                Outcome::Done => break,
                other => panic!("{script}\n{other:?}"),
            }
        }
    }
    longest
}

/// Checks that the longest instruction of `step()` is at most proportional to `N` in the script.
fn check_growth<P: Profile>(script: &str) {
    let works = COUNTS.map(|count| longest::<P>(&script.replace('N', &count.to_string()), count));
    println!("{}: {works:?}", P::NAME);
    let growth = works[3] as f64 / works[0] as f64;
    assert!(growth <= GROWTH, "{}: {works:?} for N = {COUNTS:?}\n{script}", P::NAME);
}

fn check_in_both(script: &str) {
    check_growth::<Tiny>(script);
    check_growth::<Full>(script);
}

/// `t` is an array of `N` elements of which only the first and the last are left.
const GAP: &str = "t = {}
    for(i = 0, i < N, i = i + 1) t[i] = 1
    for(i = 1, i < N - 1, i = i + 1) t[i] = nil\n";

#[test]
fn removing_the_last_element_after_a_gap() {
    check_in_both(&format!("{GAP} function step() {{ t[N - 1] = nil }}"));
}

#[test]
fn iterating_over_a_gap() {
    check_in_both(&format!("{GAP} function step() {{ foreach(t, function(k, v) {{ }}) }}"));
}

#[test]
fn iterating_over_an_array() {
    check_in_both(
        "t = {}
         for(i = 0, i < N, i = i + 1) t[i] = 1
         function step() { foreach(t, function(k, v) { }) }",
    );
}

#[test]
fn iterating_over_removed_pairs() {
    check_in_both(
        "t = {}
         for(i = 1, i <= N, i = i + 1) t[0 - i] = 1
         for(i = 1, i < N, i = i + 1) t[0 - i] = nil
         function step() { foreach(t, function(k, v) { }) }",
    );
}

#[test]
fn inserting_after_other_pairs() {
    check_in_both(
        "t = {}
         for(i = 1, i <= N, i = i + 1) t[0 - i] = 1
         function step() { t[1000] = 1 t[0 - N] = nil t[1001] = 1 }",
    );
}

#[test]
fn sizes_copies_and_maps_of_tables() {
    check_in_both(
        "t = {}
         for(i = 1, i <= N, i = i + 1) t[0 - i] = 1
         function keep(k, v) { return v }
         function step() { size(t) clone(t) map(t, keep) filter(t, keep) }",
    );
}

#[test]
fn choosing_neighbors_of_a_swarm() {
    check_in_both(
        "s = swarm.create(1)
         s.join()
         function step() { s.exec(function() { neighbors.kin().count() neighbors.nonkin().count() }) }",
    );
}

#[test]
fn copying_a_library_that_the_script_has_changed() {
    check_in_both(
        "for(i = 1, i <= N, i = i + 1) math[i] = 1
         function nothing(k, v) { }
         function step() { m = math size(m) log(m) foreach(m, nothing) }",
    );
}
