//! The cost of watching: a tick that a page watches without messages, next to the same tick without
//! an observer.

use crate::error::BenchError;
use crate::host;
use crate::report::grouped;
use anyhow::Result;
use bittybuzz_builds::cargo_test::all_tests;
use bittybuzz_builds::shell::{is_installed, root, target};
use fs_err as fs;

/// The package of the program, which cargo builds as the tests are built, and its test.
const PACKAGE: &str = "bittybuzz-bench-watch";
const TEST: &str = "bench-watch";
/// The names of its functions, see [`host::count`].
const FUNCTIONS: [&str; 2] =
    ["bittybuzz_bench_watch::counted", "bittybuzz_bench_watch::write_counts"];

/// Numbers of robots that all hear each other, and ticks that are counted.
const CROWDS: [(u32, u32); 2] = [(300, 3), (1000, 1)];

/// The most that a watched tick may cost, in bare ticks.
const RATIO_MAX: f64 = 1.1;

/// Counts, and prints the counts.
pub fn run() -> Result<()> {
    let excesses = check()?;
    if excesses.is_empty() { Ok(()) } else { Err(BenchError::Grown(excesses).into()) }
}

/// Counts, prints the counts, and returns those that are over the limit.
pub fn check() -> Result<Vec<String>> {
    eprintln!("bench: watch");
    if !is_installed(host::RUNNER) {
        return Err(BenchError::Missing { program: host::RUNNER }.into());
    }
    // Before the test of a program, cargo builds the program.
    all_tests(&["--no-run", "--quiet", "--test", TEST], &[]).unannounced().run()?;
    let program = root().join("target/debug").join(PACKAGE);
    let folder = target()?.join("bench");
    fs::create_dir_all(&folder)?;
    let mut excesses = Vec::new();
    println!("{:<8}{:>18}{:>18}{:>8}", "Zooids", "bare tick", "watched tick", "ratio");
    for (robots, ticks) in CROWDS {
        let arguments = [robots.to_string(), ticks.to_string()];
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let (_, counts) = host::count(&program, FUNCTIONS, &arguments, &[], &folder)?;
        let [bare, watched] = counts[..] else {
            return Err(BenchError::Record { what: format!("{} counts", counts.len()) }.into());
        };
        let [bare, watched] = [bare, watched].map(|count| count / u64::from(ticks));
        let ratio = watched as f64 / bare as f64;
        println!("{robots:<8}{:>18}{:>18}{ratio:>8.3}", grouped(bare), grouped(watched));
        if ratio > RATIO_MAX {
            excesses.push(format!(
                "a watched tick of {robots} Zooids costs {ratio:.3} bare ones, and may cost {RATIO_MAX}"
            ));
        }
    }
    Ok(excesses)
}
