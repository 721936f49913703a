//! `bbz sweep`: runs in a folder that processes and computers share.
#![cfg(unix)]

mod cluster;
mod report;

use std::fs;
use std::path::Path;
use std::process::{Child, Command};
use std::thread;
use std::time::Duration;

use crate::support::{Folder, finish};
use bittybuzz_random::Random;
use serde_json::Value;

/// Robots at random places that receive each other's messages: no two seeds have the same result.
const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 5\n\
    [[robots]]\nname = \"walkers\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 5\n\
    [output]\nplot = [\"x\", \"global.n\"]\n";

const SCRIPT: &str = "n = 0\nG = 1\nfunction step() { n = n + G forward() }\n";

const SWEEP: &str = "[sweep]\nseeds = 3\nchance = \"independent\"\n\
    [[sweep.parameter]]\nkey = \"robots.walkers.globals.G\"\nvalues = [1, 2]\n";

fn folder(test: &str) -> Folder {
    let folder = Folder::with(test, "s.bzz", SCRIPT);
    folder.write("s.toml", SCENARIO);
    folder
}

fn succeeds(folder: &Folder, words: &[&str]) -> String {
    let outcome = folder.bbz(words);
    assert_eq!(outcome.status, Some(0), "{words:?}: {outcome:?}");
    outcome.stdout
}

/// Returns the merged table.
fn merged(folder: &Folder, sweep: &str) -> String {
    succeeds(folder, &["sweep", "merge", sweep])
}

fn status(folder: &Folder, sweep: &str) -> Value {
    serde_json::from_str(&folder.bbz(&["sweep", "status", sweep, "--json"]).stdout).unwrap()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let place = to.join(entry.file_name());
        match entry.path().is_dir() {
            true => copy(&entry.path(), &place),
            false => drop(fs::copy(entry.path(), place).unwrap()),
        }
    }
}

fn wait_until(is_so: impl Fn() -> bool) {
    while !is_so() {
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn thirty_seeds_become_sixty_and_thirty_are_run() {
    let folder = folder("sweep_grows");
    let plan = |runs: &str| {
        succeeds(&folder, &["sweep", "plan", "s.toml", "--runs", runs, "--chunk", "7"])
    };
    assert_eq!(plan("30"), "s.sweep: 1 points, 30 runs in 5 chunks\n");
    succeeds(&folder, &["sweep", "run", "s.sweep"]);
    assert_eq!(plan("60"), "s.sweep: 1 points, 60 runs in 9 chunks; 30 runs are finished\n");
    let counts = status(&folder, "s.sweep");
    assert_eq!((&counts["finished"], &counts["runs"]), (&30.into(), &60.into()));
    // Rows that were not simulated now show that finished runs are kept.
    let rows = folder.path("s.sweep").read_dir().unwrap().map(|entry| entry.unwrap().path());
    let rows: Vec<String> = rows
        .filter(|path| path.extension().is_some_and(|end| end == "known" || end == "runs"))
        .map(|path| fs::read_to_string(path).unwrap())
        .collect();
    assert_eq!(rows.iter().map(|text| text.lines().count() - 2).sum::<usize>(), 30);
    succeeds(&folder, &["sweep", "run", "s.sweep", "--threads", "1"]);
    let table = merged(&folder, "s.sweep");
    succeeds(&folder, &["sim", "s.toml", "--runs", "60", "--csv", "whole.csv"]);
    assert_eq!(folder.read("whole.csv"), table.as_bytes());
    // More values, and chunks of another size, by the scenario itself.
    folder.write("s.toml", format!("{SCENARIO}{SWEEP}"));
    assert_eq!(
        succeeds(&folder, &["sweep", "plan", "s.toml", "--folder", "t", "--chunk", "2"]),
        "t: 2 points, 6 runs in 3 chunks\n"
    );
    succeeds(&folder, &["sweep", "run", "t"]);
    folder.write(
        "s.toml",
        format!("{SCENARIO}{}", SWEEP.replace("[1, 2]", "[0, 1, 2]").replace("= 3", "= 5")),
    );
    assert_eq!(
        succeeds(&folder, &["sweep", "plan", "s.toml", "--folder", "t", "--chunk", "4"]),
        "t: 3 points, 15 runs in 4 chunks; 6 runs are finished\n"
    );
    succeeds(&folder, &["sweep", "run", "t"]);
    succeeds(&folder, &["sim", "s.toml", "--csv", "whole.csv"]);
    assert_eq!(folder.read("whole.csv"), merged(&folder, "t").as_bytes());
    assert!(
        merged(&folder, "t").starts_with("seed,G,success,"),
        "the column has the name of the global"
    );
}

#[test]
fn a_folder_moves_and_another_computer_takes_half() {
    let folder = folder("sweep_moves");
    fs::create_dir_all(folder.path("here/lib")).unwrap();
    for name in ["s.toml", "s.bzz"] {
        fs::rename(folder.path(name), folder.path(&format!("here/{name}"))).unwrap();
    }
    folder.write("here/s.bzz", format!("include \"more.bzz\"\n{SCRIPT}"));
    folder.write("here/lib/more.bzz", "m = 1\n");
    let set = "robots.walkers.globals.G=1:4";
    let plan = ["here/s.toml", "-I", "here/lib", "--runs", "5", "--set", set, "--chunk", "3"];
    succeeds(&folder, &[&["sweep", "plan"], &plan[..]].concat());
    let whole =
        ["here/s.toml", "-I", "here/lib", "--runs", "5", "--set", set, "--csv", "whole.csv"];
    succeeds(&folder, &[&["sim"], &whole[..]].concat());
    copy(&folder.path("here"), &folder.path("there/deeper"));
    fs::rename(folder.path("here"), folder.path("moved")).unwrap();
    for (sweep, shard) in [("moved/s.sweep", "1/2"), ("there/deeper/s.sweep", "2/2")] {
        succeeds(&folder, &["sweep", "run", sweep, "--shard", shard]);
        let outcome = folder.bbz(&["sweep", "merge", sweep]);
        outcome.fails_with(3, &["of 20 runs of", "are not finished", "bbz sweep run"]);
    }
    let partial = folder.bbz(&["sweep", "merge", "moved/s.sweep", "--partial"]);
    assert_eq!((partial.status, partial.stdout.lines().count()), (Some(0), 1 + 9));
    copy(&folder.path("there/deeper/s.sweep"), &folder.path("moved/s.sweep"));
    assert_eq!(merged(&folder, "moved/s.sweep").as_bytes(), folder.read("whole.csv"));
    // Both at once, and each chunk twice, change nothing.
    copy(&folder.path("moved/lib"), &folder.path("again/lib"));
    for name in ["s.toml", "s.bzz"] {
        fs::copy(folder.path(&format!("moved/{name}")), folder.path(&format!("again/{name}")))
            .unwrap();
    }
    fs::create_dir(folder.path("again/s.sweep")).unwrap();
    fs::copy(folder.path("moved/s.sweep/plan.json"), folder.path("again/s.sweep/plan.json"))
        .unwrap();
    let both: Vec<Child> = (0..2)
        .map(|_| folder.command(&["sweep", "run", "again/s.sweep"]).spawn().unwrap())
        .collect();
    for child in both {
        let outcome = finish(child);
        assert_eq!(outcome.status, Some(0), "{outcome:?}");
    }
    assert_eq!(merged(&folder, "again/s.sweep").as_bytes(), folder.read("whole.csv"));
}

/// Kills a process that runs a sweep forty times.
#[test]
fn a_sweep_that_is_killed_goes_on_to_the_same_table() {
    let folder = folder("sweep_killed");
    succeeds(&folder, &["sim", "s.toml", "--runs", "400", "--csv", "whole.csv"]);
    succeeds(&folder, &["sweep", "plan", "s.toml", "--runs", "400", "--chunk", "2"]);
    let chunks = || {
        let names = folder.path("s.sweep").read_dir().unwrap();
        let names = names.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name.ends_with(".runs")).count()
    };
    let mut random = Random::new(40);
    for _ in 0..40 {
        let goal = chunks() + random.below(6) as usize;
        let mut child = folder.command(&["sweep", "run", "s.sweep"]).spawn().unwrap();
        while chunks() < goal && child.try_wait().unwrap().is_none() {
            thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        child.wait().unwrap();
    }
    println!("{} of 200 chunks after 40 kills", chunks());
    succeeds(&folder, &["sweep", "run", "s.sweep"]);
    assert_eq!(merged(&folder, "s.sweep").as_bytes(), folder.read("whole.csv"));
}

#[test]
fn a_value_that_is_given_twice_is_two_points() {
    let folder = folder("sweep_twice");
    let set = ["--set", "robots.walkers.globals.G=1,2,1", "--runs", "2"];
    succeeds(&folder, &[&["sim", "s.toml", "--csv", "whole.csv"], &set[..]].concat());
    succeeds(&folder, &[&["sweep", "plan", "s.toml", "--chunk", "1"], &set[..]].concat());
    succeeds(&folder, &["sweep", "run", "s.sweep"]);
    assert_eq!(merged(&folder, "s.sweep").as_bytes(), folder.read("whole.csv"));
}

#[test]
fn ctrl_c_keeps_finished_runs_of_a_chunk() {
    let folder = folder("sweep_stopped");
    let set = "world.duration=1,2419200";
    succeeds(&folder, &["sweep", "plan", "s.toml", "--runs", "3", "--set", set, "--chunk", "2"]);
    // Three runs end at once, of which the third is in a chunk with one that takes four weeks.
    let run = ["sweep", "run", "s.sweep", "--chunk", "0", "--chunk", "1", "--threads", "1"];
    let mut child = folder.command(&run).spawn().unwrap();
    let missing = || status(&folder, "s.sweep")["missing_chunks"].clone();
    while missing() != serde_json::json!([1, 2]) {
        assert_eq!(child.try_wait().unwrap(), None);
    }
    let kill = ["-INT", &child.id().to_string()];
    assert!(Command::new("kill").args(kill).status().unwrap().success());
    let outcome = finish(child);
    let counts = status(&folder, "s.sweep");
    let finished = counts["finished"].as_u64().unwrap();
    // The signal may come before the end of the third run, but all that are counted are kept.
    assert!((2..=3).contains(&finished), "{counts}");
    let counted = format!("stopped by Ctrl-C or SIGTERM: {finished} of 4 runs are finished");
    outcome.fails_with(130, &[&counted]);
    assert_eq!(counts["missing_chunks"], serde_json::json!([1, 2]));
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let folder = folder("sweep_refused");
    let plan = ["sweep", "plan", "s.toml", "--runs", "4", "--chunk", "2"];
    succeeds(&folder, &plan);
    succeeds(&folder, &["sweep", "run", "s.sweep", "--chunk", "0"]);
    let run = ["sweep", "run", "s.sweep"];
    let others = "is of another experiment; not as they were: ";
    let refused = |name: &str, text: String, parts: &[&str]| {
        let old = folder.read(name);
        folder.write(name, text);
        folder.bbz(&run).fails_with(3, parts);
        folder.bbz(&plan).fails_with(3, parts);
        folder.write(name, old);
    };
    refused(
        "s.bzz",
        format!("{SCRIPT}\n"),
        &["plan.json`", others, "`s.bzz`", "remove the folder"],
    );
    refused("s.toml", SCENARIO.replace("500, 500", "500, 501"), &[others, "the scenario"]);
    // A comment decides nothing.
    folder.write("s.toml", format!("# a comment\n{SCENARIO}"));
    succeeds(&folder, &["sweep", "run", "s.sweep", "--chunk", "0"]);
    // A plan of another version, and then rows of another version.
    let text = String::from_utf8(folder.read("s.sweep/plan.json")).unwrap();
    let own = text.split('"').nth(5).unwrap().to_owned();
    assert!(own.starts_with(env!("CARGO_PKG_VERSION")), "{own}");
    let other = format!("{} 0123456789abcdef", env!("CARGO_PKG_VERSION"));
    folder.write("s.sweep/plan.json", text.replace(&own, &other));
    folder.bbz(&run).fails_with(3, &["plan.json` is of bbz", &own, &other, "not mixed"]);
    folder.bbz(&["sweep", "merge", "s.sweep"]).fails_with(3, &["-000000.runs", &own, &other]);
    // Damage.
    folder.write("s.sweep/plan.json", &text[..text.len() / 2]);
    folder.bbz(&run).fails_with(3, &["plan.json` is no plan", "finished runs are kept"]);
    folder.write("s.sweep/plan.json", text);
    // A scenario that is gone.
    fs::rename(folder.path("s.toml"), folder.path("t.toml")).unwrap();
    folder.bbz(&run).fails_with(3, &["s.toml`"]);
    fs::rename(folder.path("t.toml"), folder.path("s.toml")).unwrap();
    folder.bbz(&[&run[..], &["--chunk", "2"]].concat()).fails_with(3, &["no chunk 2", "0 to 1"]);
    for shard in ["0/2", "3/2", "1", "a/b", "1/0"] {
        folder.bbz(&[&run[..], &["--shard", shard]].concat()).fails_with(3, &["such as 1/4"]);
    }
    folder.bbz(&["sweep", "run", "."]).fails_with(3, &["`.` has no plan", "bbz sweep plan"]);
    folder.bbz(&["sweep", "run", "nowhere"]).fails_with(3, &["`nowhere` has no plan"]);
    folder.bbz(&["sweep", "run", "s.toml"]).fails_with(3, &["`s.toml` has no plan"]);
    folder
        .bbz(&["sweep", "plan", "s.bzz"])
        .fails_with(3, &["`s.bzz` is a script", "needs a scenario"]);
    for table in ["s.sweep/plan.json", "./s.sweep/../s.sweep/runs.csv"] {
        let merge = ["sweep", "merge", "s.sweep", "--partial", "-o", table];
        folder.bbz(&merge).fails_with(3, &["is in the folder of the sweep", "outside"]);
    }
    folder.bbz(&["sweep", "plan", "nothing.toml"]).fails_with(3, &["nothing.toml`"]);
    let elsewhere = ["sweep", "plan", "s.toml", "--folder", "."];
    folder.bbz(&elsewhere).fails_with(3, &["holds other files", "--folder"]);
    let columns = ["sweep", "plan", "s.toml", "--set", "output.plot=[\"x\"],[\"y\"]"];
    folder.bbz(&columns).fails_with(3, &["change which columns"]);
    folder.bbz(&["sweep", "plan", "s.toml", "--chunk-seconds", "0"]).fails_with(3, &["above 0"]);
    folder.write("bad.toml", SCENARIO.replace("5\n", "5\nspin = 1\n"));
    folder.bbz(&["sweep", "plan", "bad.toml"]).fails_with(2, &["bad.toml:"]);
    folder.write("script.toml", SCENARIO.replace("s.bzz", "bad.bzz"));
    folder.write("bad.bzz", "function step( {\n");
    folder.bbz(&["sweep", "plan", "script.toml"]).fails_with(2, &["bad.bzz:1"]);
}

#[test]
fn a_damaged_chunk_is_named_and_run_again() {
    let folder = folder("sweep_damaged");
    succeeds(&folder, &["sweep", "plan", "s.toml", "--runs", "4", "--chunk", "2"]);
    succeeds(&folder, &["sweep", "run", "s.sweep"]);
    let table = merged(&folder, "s.sweep");
    let names = folder.path("s.sweep").read_dir().unwrap();
    let names = names.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let name = names.into_iter().find(|name| name.ends_with("-000001.runs")).unwrap();
    let place = format!("s.sweep/{name}");
    let whole = folder.read(&place);
    folder.write(&place, &whole[1..]);
    let outcome = folder.bbz(&["sweep", "run", "s.sweep"]);
    assert_eq!(outcome.status, Some(0));
    outcome.reports(&["-000001.runs` is damaged", "-000001.runs.damaged-", "simulated again"]);
    assert_eq!(folder.read(&place), whole);
    assert_eq!(merged(&folder, "s.sweep"), table);
}

#[test]
fn a_run_that_fails_is_a_row_and_tried_again_on_demand() {
    let folder = folder("sweep_failed");
    let set = ["--set", "robots.0.count=2,60000", "--runs", "2", "--chunk", "4"];
    succeeds(&folder, &[&["sweep", "plan", "s.toml"], &set[..]].concat());
    let run = ["sweep", "run", "s.sweep"];
    let outcome = folder.bbz(&run);
    outcome.fails_with(1, &["the run with seed 2", "no room for 60000 robots"]);
    let counts = status(&folder, "s.sweep");
    assert_eq!((&counts["finished"], &counts["failed"]), (&4.into(), &2.into()));
    // They count as finished, so that an engine does not repeat them without end.
    folder.bbz(&run).fails_with(1, &["no room for 60000 robots", "--retry"]);
    folder.bbz(&[&run[..], &["--retry"]].concat()).fails_with(1, &["s.toml:", "make the world"]);
    let outcome = folder.bbz(&["sweep", "merge", "s.sweep", "-o", "runs.csv"]);
    assert_eq!(outcome.status, Some(1));
    let table = String::from_utf8(folder.read("runs.csv")).unwrap();
    assert_eq!(table.matches("no room for 60000 robots").count(), 2);
}
