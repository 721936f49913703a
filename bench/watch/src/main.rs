//! Runs the same ticks twice: without an observer, and with the events, the samples and the copies
//! for going back that a page of `bbz sim --view` takes when it shows no messages.
//!
//! `bench-watch ROBOTS TICKS` runs Zooids that all hear each other. Callgrind counts the
//! instructions that are executed in [`counted`], and writes a file at each [`write_counts`].

use std::hint::black_box;
use std::process::ExitCode;
use std::time::Duration;

use bittybuzz_arena::run::{Session, Simulation};
use bittybuzz_live::{Live, PageEvent, SharedFiles, Shelf, Source};

/// Ticks before the first that is counted: scripts have begun, and frames arrive.
const BEFORE: u64 = 2;

/// The copies that `bbz sim --view` keeps at most.
const COPIES: usize = 32;

const SCRIPT: &str = "heard = 0\n\
    function init() { neighbors.listen(\"n\", function(topic, value, robot) { heard = heard + 1 }) }\n\
    function step() { neighbors.broadcast(\"n\", id) }\n";

/// Runs the work. Callgrind counts only in this function.
#[inline(never)]
fn counted(work: &mut dyn FnMut()) {
    black_box(work)();
}

/// Does nothing: Callgrind writes and clears its counts when this function is called.
#[inline(never)]
fn write_counts() {
    black_box(());
}

/// Returns the run before its first tick.
fn begin(robots: u32) -> Result<(Simulation, String), String> {
    let files = SharedFiles::default();
    files.add("crowd.bzz", SCRIPT);
    files.add(
        "crowd.toml",
        format!(
            "[world]\nsize = [4000, 4000]\nduration = 60\n\n\
             [[robots]]\nrobot = \"zooids\"\nscript = \"crowd.bzz\"\ncount = {robots}\n"
        ),
    );
    Shelf::new(files, "crowd.toml".into()).open(1)
}

/// Counts ticks of a run that nothing observes.
fn count_bare(robots: u32, ticks: u64) -> Result<u64, String> {
    let (mut run, _) = begin(robots)?;
    let mut advance =
        |ticks: u64| (0..ticks).try_for_each(|_| run.tick()).map_err(|error| error.to_string());
    advance(BEFORE)?;
    let mut outcome = Ok(());
    counted(&mut || outcome = advance(ticks));
    write_counts();
    outcome?;
    Ok(run.digest())
}

/// Counts the same ticks of a session, and the events and the sample that its client takes after each of them.
fn count_watched(robots: u32, ticks: u64) -> Result<u64, String> {
    let (run, text) = begin(robots)?;
    let mut live = Live::new(Session::new(run, COPIES), text);
    live.request("{\"play\":{}}", Duration::ZERO);
    let mut advance = |ticks: u64| {
        for _ in 0..ticks {
            let mut one = 0..1;
            live.advance(Duration::ZERO, &mut || one.next().is_some());
            black_box(live.take_sample());
            black_box(live.take_events().iter().map(PageEvent::to_json).collect::<Vec<String>>());
        }
    };
    advance(BEFORE);
    counted(&mut || advance(ticks));
    write_counts();
    Ok(live.session().run().digest())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let numbers = match &arguments[..] {
        [robots, ticks] => robots.parse().ok().zip(ticks.parse().ok()),
        _ => None,
    };
    let Some((robots, ticks)) = numbers else {
        eprintln!("usage: bench-watch ROBOTS TICKS");
        return ExitCode::from(2);
    };
    let digests =
        count_bare(robots, ticks).and_then(|bare| Ok((bare, count_watched(robots, ticks)?)));
    match digests {
        Ok((bare, watched)) if bare == watched => ExitCode::SUCCESS,
        Ok(_) => {
            eprintln!("an observer has changed the run");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
