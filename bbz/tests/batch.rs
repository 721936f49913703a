//! Batches of `bbz sim`: the results that are kept when the process is stopped, and the resumption
//! of the batch.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use crate::support::{Folder, finish};
use bittybuzz_random::Random;
use serde_json::Value;

/// Robots at random places that receive each other's messages: no two seeds have the same result.
const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 5\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 5\n\
    [output]\nplot = [\"x\", \"neighbors\"]\n\
    [[expect]]\nat = 1\nvalue = \"global.n\"\nabove = 3\n";

const SCRIPT: &str = "n = 0\nfunction step() { n = n + 1 forward() }\n";

/// Twenty runs that end at once, and twenty that last four weeks.
const ENDLESS: [&str; 8] =
    ["sim", "s.toml", "--runs", "20", "--set", "world.duration=1,2419200", "--csv", "runs.csv"];

fn folder(test: &str) -> Folder {
    let folder = Folder::with(test, "s.bzz", SCRIPT);
    folder.write("s.toml", SCENARIO);
    folder
}

/// Returns the number of complete chunks of the journal.
fn parts(folder: &Folder) -> usize {
    let Ok(entries) = folder.path("runs.csv.parts").read_dir() else { return 0 };
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.ends_with(".runs")).count()
}

/// Starts a batch, and returns when `count` parts are written or the process has ended.
fn start(folder: &Folder, arguments: &[&str], count: usize) -> Child {
    let mut child = folder.command(arguments).env("RAYON_NUM_THREADS", "2").spawn().unwrap();
    while parts(folder) < count && child.try_wait().unwrap().is_none() {
        thread::sleep(Duration::from_millis(1));
    }
    child
}

fn send(signal: &str, child: &Child) {
    let kill = [signal, &child.id().to_string()];
    assert!(Command::new("kill").args(kill).status().unwrap().success());
}

/// Kills a batch `kills` times, each time after some more parts were written, and compares the
/// resulting table with that of a single thread that nothing stops.
fn kill_and_resume(test: &str, runs: usize, kills: usize) {
    let folder = folder(test);
    let text = runs.to_string();
    let with_data = |data: &'static str| {
        ["sim", "s.toml", "--runs", &text, "--csv", "runs.csv", "--data", data]
    };
    let mut whole = folder.command(&with_data("whole"));
    let outcome = finish(whole.env("RAYON_NUM_THREADS", "1").spawn().unwrap());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    assert_eq!(folder.names(), ["runs.csv", "s.bzz", "s.toml", "whole"]);
    let expected = folder.read("runs.csv");
    assert_eq!(expected.split(|byte| *byte == b'\n').count(), 1 + runs + 1);
    std::fs::remove_file(folder.path("runs.csv")).unwrap();
    let resume = [&with_data("data")[..], &["--resume"]].concat();
    let total = runs.div_ceil(runs.div_ceil(1000));
    let (mut random, mut goal) = (Random::new(runs as u64), 0);
    for _ in 0..kills {
        let steps_max = (2 * (total - goal) / (kills + 1)).max(1);
        goal += 1 + random.below(steps_max as u32) as usize;
        let mut child = start(&folder, &resume, goal.min(total - 1));
        child.kill().unwrap();
        child.wait().unwrap();
        goal = parts(&folder).max(goal).min(total - 1);
    }
    let left = parts(&folder);
    let outcome = folder.bbz(&resume);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    println!("{kills} kills, {left} of {total} parts before the last start: {}", outcome.stderr);
    assert_eq!(folder.read("runs.csv"), expected);
    assert!(!folder.path("runs.csv.parts").exists());
    let [whole, data] = ["whole", "data"].map(|name| tables(&folder, name));
    assert_eq!(whole.len(), 5 * total, "robots, logs, faults, events and runs");
    assert!(whole == data, "the tables of --data differ");
}

/// Returns the files of `--data` with their contents.
fn tables(folder: &Folder, data: &str) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for table in folder.path(data).read_dir().unwrap() {
        let table = table.unwrap().file_name().into_string().unwrap();
        for file in folder.path(data).join(&table).read_dir().unwrap() {
            let name = format!("{table}/{}", file.unwrap().file_name().into_string().unwrap());
            files.insert(name.clone(), folder.read(&format!("{data}/{name}")));
        }
    }
    files
}

#[test]
fn a_batch_that_is_killed_goes_on_to_the_same_table() {
    kill_and_resume("batch_killed", 300, 5);
}

/// This test takes too long to run at every change.
#[test]
#[ignore = "minutes"]
fn a_batch_of_2000_runs_that_is_killed_20_times_goes_on_to_the_same_table() {
    kill_and_resume("batch_killed_often", 2000, 20);
}

#[test]
fn a_signal_ends_a_batch_in_order() {
    for signal in ["-INT", "-TERM"] {
        let folder = folder(&format!("batch{signal}"));
        let child = start(&folder, &ENDLESS, 20);
        // No other process can resume the batch while this one works on it.
        let other = folder.bbz(&[&ENDLESS[..], &["--resume"]].concat());
        other.fails_with(3, &["another `bbz` is at work", "runs.csv.parts"]);
        send(signal, &child);
        let outcome = finish(child);
        assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
        outcome.reports(&["stopped by Ctrl-C or SIGTERM: 20 of 40 runs are finished", "--resume"]);
        let line = "world.duration=1: 20 of 20 runs succeeded\n";
        assert!(outcome.stdout.contains(line), "{}", outcome.stdout);
        assert!(!folder.path("runs.csv").exists());
        assert_eq!(parts(&folder), 20);
        // The batch resumes where it was: none of the twenty runs is simulated again.
        let resume = [&ENDLESS[..], &["--resume"]].concat();
        let mut child = folder.command(&resume).spawn().unwrap();
        await_line(&mut child, "20 of 40 runs were finished before");
        send(signal, &child);
        assert_eq!(finish(child).status, Some(130));
        assert_eq!(parts(&folder), 20);
    }
}

#[test]
fn a_batch_goes_on_only_as_what_it_was() {
    let folder = folder("batch_other");
    let child = start(&folder, &ENDLESS, 20);
    send("-TERM", &child);
    assert_eq!(finish(child).status, Some(130));
    let resume = [&ENDLESS[..], &["--resume"]].concat();
    let refused = |arguments: &[&str], parts: &[&str]| {
        folder.bbz(arguments).fails_with(3, parts);
        assert_eq!(self::parts(&folder), 20);
    };
    refused(&ENDLESS, &["runs.csv.parts` has finished runs", "--resume goes on"]);
    let others = "is of another experiment; not as they were: ";
    folder.write("s.bzz", format!("{SCRIPT}\n"));
    refused(&resume, &[others, "`s.bzz`", "remove the folder"]);
    folder.write("s.bzz", SCRIPT);
    folder.write("s.toml", SCENARIO.replace("500, 500", "500, 501"));
    refused(&resume, &[others, "the scenario"]);
    // A comment decides nothing.
    folder.write("s.toml", format!("# a comment\n{SCENARIO}"));
    let mut child = folder.command(&resume).spawn().unwrap();
    await_line(&mut child, "20 of 40 runs were finished before");
    send("-TERM", &child);
    assert_eq!(finish(child).status, Some(130));
}

/// Reads what a process prints until a line has this part.
fn await_line(child: &mut Child, part: &str) {
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut printed = String::new();
    while !printed.contains(part) {
        assert_ne!(stderr.read_line(&mut printed).unwrap(), 0, "only printed:\n{printed}");
    }
}

#[test]
fn a_damaged_chunk_is_set_aside_and_run_again() {
    let folder = folder("batch_damaged");
    let child = start(&folder, &ENDLESS, 20);
    send("-TERM", &child);
    assert_eq!(finish(child).status, Some(130));
    let names = folder.path("runs.csv.parts").read_dir().unwrap();
    let names = names.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let name = names.into_iter().find(|name| name.ends_with("-000003.runs")).unwrap();
    let place = format!("runs.csv.parts/{name}");
    let whole = folder.read(&place);
    folder.write(&place, &whole[..whole.len() - 9]);
    let resume = [&ENDLESS[..], &["--resume"]].concat();
    let mut child = folder.command(&resume).spawn().unwrap();
    await_line(&mut child, "19 of 40 runs were finished before");
    while parts(&folder) < 20 {
        thread::sleep(Duration::from_millis(1));
    }
    send("-TERM", &child);
    assert_eq!(finish(child).status, Some(130));
    assert_eq!(folder.read(&place), whole);
    let outcome = folder.bbz(&["sweep", "status", "runs.csv.parts"]);
    assert_eq!(outcome.status, Some(1), "{outcome:?}");
    assert!(outcome.stdout.starts_with("20 of 40 runs are finished"), "{outcome:?}");
}

/// More seeds and more values are more runs, not others.
#[test]
fn a_batch_that_was_stopped_grows() {
    let folder = folder("batch_grows");
    let child = start(&folder, &ENDLESS, 20);
    send("-TERM", &child);
    assert_eq!(finish(child).status, Some(130));
    let more = |replaced: &[(&str, &'static str)]| -> Vec<String> {
        let other = |word: &str| {
            let found = replaced.iter().find(|(old, _)| *old == word);
            found.map_or(word, |(_, new)| *new).to_owned()
        };
        ENDLESS.iter().copied().chain(["--resume"]).map(other).collect()
    };
    let short = ("world.duration=1,2419200", "world.duration=1,2");
    let arguments = more(&[("20", "30"), short]);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = folder.bbz(&arguments);
    assert_eq!(outcome.status, Some(0), "{outcome:?}");
    assert!(outcome.stderr.contains("20 of 60 runs were finished before"), "{outcome:?}");
    let grown = folder.read("runs.csv");
    let fresh = ["sim", "s.toml", "--runs", "30", "--set", short.1, "--csv", "fresh.csv"];
    assert_eq!(folder.bbz(&fresh).status, Some(0));
    assert_eq!(folder.read("fresh.csv"), grown);
}

/// The program is not what its runs depend on: a compiler, a profile or a system may have made another one
/// of the same sources.
#[test]
fn a_batch_goes_on_with_another_program_of_the_same_sources() {
    let folder = folder("batch_program");
    let child = start(&folder, &ENDLESS, 20);
    send("-TERM", &child);
    assert_eq!(finish(child).status, Some(130));
    // Bytes after its end change nothing that a program does.
    let program = std::fs::read(env!("CARGO_BIN_EXE_bbz")).unwrap();
    folder.program("other", &[&program, &b"more"[..]].concat());
    let mut command = Command::new(folder.path("other"));
    command.args(ENDLESS).arg("--resume").current_dir(folder.path("."));
    let mut child = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    await_line(&mut child, "20 of 40 runs were finished before");
    send("-TERM", &child);
    assert_eq!(finish(child).status, Some(130));
}

/// The scenario of a script is in no file, so the options that make it identify the batch.
#[test]
fn a_batch_of_a_script_goes_on_only_with_its_robots() {
    let folder = folder("batch_script");
    let script = [&["sim", "s.bzz", "--robot", "kilobot", "--count", "5"], &ENDLESS[2..]].concat();
    let child = start(&folder, &script, 20);
    send("-TERM", &child);
    assert_eq!(finish(child).status, Some(130));
    let resume = [&script[..], &["--resume"]].concat();
    for (old, new, option) in [("5", "6", "--count"), ("kilobot", "zooids", "--robot")] {
        let other: Vec<&str> =
            resume.iter().map(|word| if *word == old { new } else { word }).collect();
        folder.bbz(&other).fails_with(3, &["another experiment; not as they were: --", option]);
        assert_eq!(parts(&folder), 20);
    }
}

#[test]
fn a_folder_that_is_no_journal_is_left_alone() {
    let folder = folder("batch_folder");
    std::fs::create_dir(folder.path("runs.csv.parts")).unwrap();
    folder.write("runs.csv.parts/notes.txt", "mine");
    let arguments = ["sim", "s.toml", "--runs", "2", "--csv", "runs.csv"];
    folder.bbz(&arguments).fails_with(3, &["runs.csv.parts`", "holds other files"]);
    assert_eq!(folder.read("runs.csv.parts/notes.txt"), b"mine");
    folder.bbz(&["sim", "s.toml", "--resume"]).fails_with(3, &["--csv"]);
    let stream = ["sim", "s.toml", "--csv", "/dev/stderr", "--resume"];
    folder.bbz(&stream).fails_with(3, &["`/dev/stderr` is no file"]);
    folder.bbz(&["sim", "s.toml", "--csv", "."]).fails_with(3, &["cannot write `.`"]);
}

#[test]
fn a_run_that_fails_is_a_row() {
    let folder = folder("batch_row");
    let set = ["--set", "robots.0.count=2,60000", "--runs", "2"];
    let arguments = [&["sim", "s.toml", "--csv", "runs.csv"], &set[..]].concat();
    let outcome = folder.bbz(&arguments);
    assert_eq!(outcome.status, Some(1));
    outcome.reports(&[
        "the run with seed 1",
        "no room for 60000 robots",
        "s.toml:4:",
        "make the world",
    ]);
    assert!(outcome.stdout.contains("kilobot.count=2: 2 of 2 runs succeeded\n"));
    assert!(outcome.stdout.contains("kilobot.count=60000: 0 of 2 runs succeeded\n"));
    let table = String::from_utf8(folder.read("runs.csv")).unwrap();
    let rows: Vec<&str> = table.split_terminator("\r\n").collect();
    assert!(rows[0].ends_with(",overruns,digest,error"), "{}", rows[0]);
    assert!(rows[1].starts_with("1,2,1,0,") && rows[1].ends_with(','), "{}", rows[1]);
    let empty = ",".repeat(rows[0].matches(',').count() - 2);
    for (row, seed) in rows[3..].iter().zip(1..) {
        let start = format!(
            "{seed},60000,0{empty}\"random placement found no room for 60000 robots, only for "
        );
        assert!(row.starts_with(&start), "{row}");
    }
    let json = folder.bbz(&[&["sim", "s.toml", "--json"], &set[..]].concat());
    let result: Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(result["runs"][0]["error"], Value::Null);
    assert!(
        result["runs"][2]["error"].as_str().unwrap().starts_with("random placement found no room")
    );
    assert_eq!(result["runs"][2]["metrics"]["success"], 0.0);
    // If no variant has a valid world, the scenario is wrong.
    let none = ["sim", "s.toml", "--runs", "2", "--csv", "none.csv", "--set"];
    let outcome = folder.bbz(&[&none[..], &["robots.0.count=60000"]].concat());
    outcome.fails_with(2, &["no room for 60000 robots"]);
    assert_eq!(folder.names(), ["runs.csv", "s.bzz", "s.toml"]);
}

#[test]
fn values_that_change_the_columns_are_refused() {
    let folder = folder("batch_columns");
    let plot = "output.plot=[\"x\"],[\"y\"]";
    let outcome = folder.bbz(&["sim", "s.toml", "--set", plot, "--csv", "runs.csv"]);
    outcome.fails_with(3, &["change which columns", "a table of its own"]);
}
