//! `bbz sim` with several runs: `--runs`, `--set`, `[sweep]`, and the columns of their table.

use crate::sim::{SCENARIO, exact, folder};
use crate::support::Folder;
use serde_json::Value;

#[test]
fn every_combination_is_run_with_every_seed() {
    let folder = folder("sim_batch");
    folder.write("s.toml", exact());
    let arguments = ["sim", "s.toml", "--runs", "3", "--seed", "5", "--csv", "runs.csv"];
    let set = ["--set", "robots.0.count=2,4", "--set", "medium.ir.loss=0,[0.1,0.5]"];
    let outcome = folder.bbz(&[arguments.as_slice(), &set].concat());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let table = String::from_utf8(folder.read("runs.csv")).unwrap();
    let rows: Vec<&str> = table.split_terminator("\r\n").collect();
    assert_eq!(rows.len(), 1 + 2 * 2 * 3);
    assert!(
        rows[0].starts_with(
            "seed,kilobot.count,medium.ir.loss,success,failed,held.0,first.0,since.0,mean global.n,"
        ),
        "{}",
        rows[0]
    );
    for (row, start) in rows[1..].iter().zip([
        "5,2,0,1,0,1,2,2,19,19,19,",
        "6,2,0,",
        "7,2,0,",
        "5,2,\"[0.1,0.5]\",1,",
        "6,2,\"[0.1,0.5]\",",
        "7,2,\"[0.1,0.5]\",",
        "5,4,0,",
        "6,4,0,",
        "7,4,0,",
        "5,4,\"[0.1,0.5]\",",
        "6,4,\"[0.1,0.5]\",",
        "7,4,\"[0.1,0.5]\",",
    ]) {
        assert!(row.starts_with(start), "{row}");
    }
    assert!(
        outcome.stdout.contains("kilobot.count=4 medium.ir.loss=0: 3 of 3 runs succeeded"),
        "{}",
        outcome.stdout
    );
    // The same command gives the same table.
    let again = folder.bbz(&[arguments.as_slice(), &set].concat());
    assert_eq!(again.stdout, outcome.stdout);
    assert_eq!(folder.read("runs.csv"), table.as_bytes());

    folder.write("s.toml", SCENARIO.replace("equals = 19", "equals = 20"));
    // What failed is counted, and the batch has done its work.
    let failed = folder.bbz(&["sim", "s.toml", "--runs", "2"]);
    assert_eq!((failed.status, failed.stderr.as_str()), (Some(0), ""));
    let lines = ["0 of 2 runs succeeded\n", " held in 0 of 2 runs, failed in 2\n"];
    lines.iter().for_each(|line| assert!(failed.stdout.contains(line), "{}", failed.stdout));
    assert_eq!(folder.bbz(&["sim", "s.toml"]).status, Some(1));
    let json = folder.bbz(&["sim", "s.toml", "--runs", "2", "--json"]);
    let result: Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(result["runs"][1]["seed"], 2);
    assert_eq!(result["runs"][1]["metrics"]["success"], 0.0);
}

/// A variant has the seed that it sets, not that of the first one.
#[test]
fn a_variant_of_the_seed_runs_with_that_seed() {
    let folder = folder("sim_seeds");
    // Robots stand at random places.
    folder.write("s.toml", exact().replace("[\"global.n\"]", "[\"x\"]"));
    let rows = |arguments: &[&str]| -> Vec<String> {
        let outcome = folder.bbz(&[&["sim", "s.toml", "--csv", "runs.csv"], arguments].concat());
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        let table = String::from_utf8(folder.read("runs.csv")).unwrap();
        table.lines().skip(1).map(str::to_owned).collect()
    };
    let single = |seed: &str| rows(&["--seed", seed]).remove(0);
    let metrics = |row: &str| row.split_once(",").unwrap().1.to_owned();
    let [one, two, three] = ["1", "2", "3"].map(single);
    assert_ne!(metrics(&one), metrics(&two));
    let expected: Vec<String> = [(1, &one), (3, &three), (2, &two)]
        .iter()
        .map(|(seed, row)| format!("{seed},{seed},{}", metrics(row)))
        .collect();
    assert_eq!(rows(&["--set", "world.seed=1,3,2"]), expected);
    // With several runs, each variant counts up from its own seed.
    let seeds = rows(&["--set", "world.seed=1,7", "--runs", "2"]);
    let seeds: Vec<&str> = seeds.iter().filter_map(|row| row.split(',').next()).collect();
    assert_eq!(seeds, ["1", "2", "7", "8"]);
    for runs in [&["--csv", "runs.csv"][..], &[]] {
        let both = [&["sim", "s.toml", "--seed", "5", "--set", "world.seed=1"], runs].concat();
        folder.bbz(&both).fails_with(3, &["`--seed` and `--set world.seed`", "leave out"]);
    }
}

/// Column names are data: a comment in the scenario does not change them.
#[test]
fn columns_are_named_after_expectations_and_not_after_lines() {
    let folder = folder("sim_names");
    let named = "[[expect]]\nname = \"counted\"\nat = 1\nvalue = \"global.n\"\nabove = 3\n";
    let scenario = format!("{SCENARIO}{named}");
    let header = |text: &str| {
        folder.write("s.toml", text);
        let outcome = folder.bbz(&["sim", "s.toml", "--csv", "runs.csv"]);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        String::from_utf8(folder.read("runs.csv")).unwrap().lines().next().unwrap().to_owned()
    };
    let columns =
        "seed,success,failed,held.0,first.0,since.0,held.counted,first.counted,since.counted,";
    assert!(header(&scenario).starts_with(columns), "{}", header(&scenario));
    assert_eq!(header(&format!("# a comment\n\n{scenario}")), header(&scenario));
    folder.write("s.toml", &scenario);
    let outcome = folder.bbz(&["sim", "s.toml"]);
    let line = "held    s.toml:14: counted: all: global.n above 3, at 1 s; ";
    assert!(outcome.stdout.contains(line), "{}", outcome.stdout);
    let json = folder.bbz(&["sim", "s.toml", "--json"]);
    let result: Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(result["expects"][0]["name"], Value::Null);
    assert_eq!(result["expects"][1]["name"], "counted");
}

/// The world of each run differs, and so does the time of the event: two of the runs end before it.
#[test]
fn measures_are_columns_without_a_verdict() {
    let folder = folder("sim_measures");
    let script = "n = 0\nfunction step() { n = n + id }\n";
    folder.write("s.bzz", script);
    let measures = "[[measure]]\nname = \"ten\"\nvalue = \"sum(global.n)\"\nabove = 9\n\
        [[measure]]\nname = \"mean_n\"\nvalue = \"mean(global.n)\"\nat = 1\n";
    let text = "[world]\nsize = [900, 900]\nduration = 2\n\
        [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\n";
    folder.write("s.toml", format!("{text}{measures}"));
    let ids = "robots.0.first_id=0,0,1,2,5";
    let outcome = folder.bbz(&["sim", "s.toml", "--set", ids, "--csv", "runs.csv"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let table = String::from_utf8(folder.read("runs.csv")).unwrap();
    let rows: Vec<&str> = table.split_terminator("\r\n").collect();
    for (row, start) in rows.iter().zip([
        "seed,kilobot.first_id,success,failed,ten,mean_n,sent,",
        "1,0,1,0,,0,",
        "1,0,1,0,,0,",
        // More than 9 after 10, 5 and 2 steps, the first of which is in the second tick.
        "1,1,1,0,1.1,9,",
        "1,2,1,0,0.6,18,",
        "1,5,1,0,0.3,45,",
    ]) {
        assert!(row.starts_with(start), "{row}");
    }
    let one = folder.bbz(&["sim", "s.toml", "--set", "robots.0.first_id=2"]);
    let lines =
        ["measure ten: at 0.6 s; first time of sum(global.n) above 9\n", "measure mean_n: 18;"];
    lines.iter().for_each(|line| assert!(one.stdout.contains(line), "{}", one.stdout));
    let never = folder.bbz(&["sim", "s.toml", "--json"]);
    let result: Value = serde_json::from_str(&never.stdout).unwrap();
    assert_eq!(result["measures"]["ten"], Value::Null);
    assert_eq!(result["measures"]["mean_n"], 0.0);
}

/// A scenario with a global that decides, and the rows of the table of a batch of it without the
/// columns after those of the parameters and of the measure.
fn study(test: &str, more: &str, arguments: &[&str]) -> (Folder, String, Vec<String>) {
    let folder = folder(test);
    folder.write("s.bzz", "GROUP = 5\nn = 0\nfunction step() { n = n + GROUP }\n");
    let text = format!(
        "[world]\nsize = [900, 900]\nduration = 2\nseed = 7\n\
         [[robots]]\nname = \"walkers\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\nclock_skew = 0\n\
         [[measure]]\nname = \"n\"\nvalue = \"max(global.n)\"\n{more}"
    );
    folder.write("s.toml", text);
    let outcome = folder.bbz(&[&["sim", "s.toml", "--csv", "runs.csv"], arguments].concat());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let table = String::from_utf8(folder.read("runs.csv")).unwrap();
    let columns = table.lines().next().unwrap().split(',').position(|name| name == "n").unwrap();
    let row = |line: &str| line.split(',').take(columns + 1).collect::<Vec<&str>>().join(",");
    let rows = table.lines().map(row).collect();
    (folder, outcome.stdout, rows)
}

#[test]
fn a_range_of_a_global_has_its_column() {
    let set = ["--set", "robots.walkers.globals.GROUP=1:5:2"];
    let (folder, stdout, rows) = study("sim_range", "", &set);
    let expected = ["seed,GROUP,success,failed,n", "7,1,1,0,19", "7,3,1,0,57", "7,5,1,0,95"];
    assert_eq!(rows, expected);
    assert!(stdout.contains("GROUP=3: 1 of 1 runs succeeded\n"), "{stdout}");
    // The number of threads does not change the table.
    let table = folder.read("runs.csv");
    for threads in ["1", "3"] {
        let again = ["sim", "s.toml", "--csv", "runs.csv", "--threads", threads];
        assert_eq!(folder.bbz(&[&again[..], &set].concat()).status, Some(0));
        assert_eq!(folder.read("runs.csv"), table);
    }
    folder.bbz(&["sim", "s.toml", "--threads", "0"]).fails_with(3, &["0 is not in 1..=4096"]);
    assert_eq!(folder.bbz(&["sim", "s.toml", "--threads", "1"]).status, Some(0));
}

#[test]
fn keys_of_one_set_vary_together() {
    let set = "robots.walkers.globals.GROUP=1,4; world.duration=1,0.5";
    let (_, _, rows) = study("sim_pairs", "", &["--set", set, "--runs", "2"]);
    let expected = [
        "seed,GROUP,world.duration,success,failed,n",
        "7,1,1,1,0,9",
        "8,1,1,1,0,9",
        "7,4,0.5,1,0,16",
        "8,4,0.5,1,0,16",
    ];
    assert_eq!(rows, expected);
}

/// An event before it does not rename the data.
#[test]
fn the_number_of_an_event_has_the_name_of_its_global() {
    let event =
        |at: &str| format!("[[event]]\nat = {at}\nset = \"all\"\nglobal = \"GROUP\"\nnumber = 1\n");
    let other = "[[event]]\nat = 0.5\nfail = 0\n";
    let (.., rows) = study("sim_event", &event("0"), &["--set", "event.0.number=2,3"]);
    assert_eq!(rows, ["seed,GROUP,success,failed,n", "7,2,1,0,38", "7,3,1,0,57"]);
    let more = format!("{other}{}", event("0"));
    let (.., rows) = study("sim_event_later", &more, &["--set", "event.1.number=2,3"]);
    assert_eq!(rows[0], "seed,GROUP,success,failed,n");
}

const SWEEP: &str = "[sweep]\nseeds = 2\nchance = \"common\"\n\
    [[sweep.parameter]]\nkey = \"robots.walkers.globals.GROUP\"\nvalues = [2, 3]\n\
    [[sweep.parameter]]\nkey = \"world.duration\"\nname = \"seconds\"\nvalues = [1]\n";

#[test]
fn a_study_in_the_scenario_is_a_batch() {
    let (folder, stdout, rows) = study("sim_study", SWEEP, &[]);
    let expected = [
        "seed,GROUP,seconds,success,failed,n",
        "7,2,1,1,0,18",
        "8,2,1,1,0,18",
        "7,3,1,1,0,27",
        "8,3,1,1,0,27",
    ];
    assert_eq!(rows, expected);
    let line = "[sweep]: 2 points, 2 runs of each; all points have the same seeds (common random numbers)\n";
    assert!(stdout.starts_with(line), "{stdout}");
    // A single run is that of the file.
    let one = folder.bbz(&["sim", "s.toml"]);
    assert!(one.stdout.contains("measure n: 95; "), "{}", one.stdout);
    // The command adds a key, and says the number of runs.
    let more = ["--set", "medium.ir.loss=0,0.5", "--runs", "1"];
    let (.., rows) = study("sim_study_more", SWEEP, &more);
    assert_eq!(rows[0], "seed,GROUP,seconds,medium.ir.loss,success,failed,n");
    assert_eq!(rows.len(), 1 + 4);
    let twice = ["sim", "s.toml", "--csv", "runs.csv", "--set", "robots.0.globals.GROUP=1"];
    folder.bbz(&twice).fails_with(3, &["GROUP` has values in [sweep] (line 17) and in `--set`"]);
    let twice = ["--csv", "runs.csv", "--set", "world.seed=1", "--set", "world.seed=2"];
    let twice = [&["sim", "s.toml"], &twice[..]].concat();
    folder.bbz(&twice).fails_with(3, &["`world.seed` has values in two `--set`", "world.seed=1,2"]);
}

#[test]
fn independent_points_have_seeds_of_their_own() {
    let seeds = |test: &str, sweep: &str| -> Vec<String> {
        let (.., rows) = study(test, sweep, &[]);
        let point = |row: &String| row.split(',').take(2).collect::<Vec<&str>>().join(",");
        rows[1..].iter().map(point).collect()
    };
    let independent = SWEEP.replace("common", "independent");
    let few = seeds("sim_own_seeds", &independent);
    let more = seeds("sim_own_seeds_more", &independent.replace("[2, 3]", "[4, 3, 2]"));
    assert_eq!((few.len(), more.len()), (4, 6));
    assert!(few.iter().all(|run| more.contains(run)), "{few:?} {more:?}");
    let mut numbers: Vec<&str> = more.iter().filter_map(|run| run.split(',').next()).collect();
    numbers.sort_unstable();
    numbers.dedup();
    assert_eq!(numbers.len(), 6);
}

#[test]
fn a_mistake_of_a_study_is_at_its_parameter() {
    let (folder, ..) = study("sim_study_mistakes", SWEEP, &[]);
    let text = String::from_utf8(folder.read("s.toml")).unwrap();
    let refused = |from: &str, to: &str, parts: &[&str]| {
        folder.write("s.toml", text.replace(from, to));
        folder.bbz(&["sim", "s.toml", "--csv", "runs.csv"]).fails_with(2, parts);
    };
    refused(
        "globals.GROUP",
        "globals.GROPU",
        &["no script has a global `GROPU`", "s.toml:17:", "did you mean `GROUP`"],
    );
    refused(
        "[2, 3]",
        "[2, 3.5]",
        &["`GROUP` is an integer in line 1 of", "3.5 is a float", "s.toml:17:"],
    );
    refused(
        "walkers.globals",
        "talkers.globals",
        &["no group of robots is named `talkers`", "s.toml:17:"],
    );
    refused("\"world.duration\"", "\"world.duratoin\"", &["unknown key `duratoin`", "s.toml:20:"]);
    // A run that is shorter than a measure.
    let measure = "max(global.n)\"\nat = 2\n";
    refused(
        "max(global.n)\"\n",
        measure,
        &["`at` is not within the run", "`duration` in [world] is 1 s"],
    );
}

/// Runs are counted before anything is prepared for them.
#[test]
fn the_number_of_runs_is_limited() {
    let folder = folder("sim_many_runs");
    folder.bbz(&["sim", "s.toml", "--runs", "4000000000"]).fails_with(3, &["1..=1000000"]);
    let values = (0..1100).map(|n| n.to_string()).collect::<Vec<_>>().join(",");
    let set = [format!("world.seed={values}"), format!("robots.0.count={values}")];
    let set: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
    let words = "1 runs of 1210000 combinations of values are too many";
    folder.bbz(&[&["sim", "s.toml"], set.as_slice()].concat()).fails_with(3, &[words, "1000000"]);
    folder
        .bbz(&["sim", "s.toml", "--runs", "500001", "--set", "world.seed=1,2"])
        .fails_with(3, &["500001 runs of 2 combinations"]);
}
