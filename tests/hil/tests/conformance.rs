//! The conformance scripts on the robot: what the reference machine printed comes over the debug probe, line by line.

use std::fs;

use bittybuzz_hil::{Core, trace};
use bittybuzz_tests::bbz;

#[test]
fn conformance_scripts_print_the_same() {
    let folder = bbz::root().join("tests/conformance");
    let mut names: Vec<String> = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter_map(|name| name.strip_suffix(".bzz").map(str::to_owned))
        // Nobody is near before the first step, and some files are only included by others.
        .filter(|name| !name.starts_with("nbr_"))
        .filter(|name| folder.join(format!("{name}.expect")).exists())
        .collect();
    names.sort();
    assert!(names.len() >= 40);
    let mut failures = Vec::new();
    for name in &names {
        let expected = fs::read_to_string(folder.join(format!("{name}.expect"))).unwrap();
        let (ending, output) = expected.split_once('\n').unwrap_or((&expected, ""));
        let trace = trace(Core::Unicorn, &format!("tests/conformance/{name}.bzz"), 3.0);
        let printed: Vec<&str> = trace.log().into_iter().map(|(_, text)| text).collect();
        let faults = trace.of("fault").count();
        // After a fault the script starts again, and fails again.
        let runs = faults.max(1);
        let expected = output.lines().collect::<Vec<_>>().repeat(runs);
        if printed != expected || (faults != 0) != (ending == "runtime-error") {
            failures.push(format!("{name}: {faults} faults, {printed:?} instead of {output:?}"));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
