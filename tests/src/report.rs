//! One verdict over many scripts.

/// What went wrong with one script: a line `FILE:LINE: what`, then details, indented.
pub type Failure = String;

/// Panics with all failures together, or says how many runs were good.
///
/// `runs` guards against a test that passes because it found nothing to do.
pub fn conclude(subject: &str, runs: usize, at_least: usize, failures: &[Failure]) {
    assert!(runs >= at_least, "{subject}: only {runs} runs, {at_least} were expected");
    if failures.is_empty() {
        println!("{subject}: {runs} runs, all as expected");
    } else {
        panic!("{subject}: {} of {runs} runs failed\n\n{}\n", failures.len(), failures.join("\n"));
    }
}
