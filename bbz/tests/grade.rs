//! `bbz grade`: runs results again that were handed in.

use std::fs;

use crate::support::Folder;
use bittybuzz_live::{HandIn, SharedFiles, Shelf, TextFile};

const SCENARIO: &str = include_str!("../../examples/lessons/hops.toml");
const START: &str = include_str!("../../examples/lessons/hops.bzz");
const SOLUTION: &str = include_str!("../../examples/swarm/gradient.bzz");

/// The file that a page writes for a script.
fn hand_in(by: &str, script: &str) -> HandIn {
    let files = SharedFiles::default();
    files.add("hops.toml", SCENARIO);
    files.add("hops.bzz", script);
    let (mut run, _) = Shelf::new(files, "hops.toml".into()).open(1).unwrap();
    while !run.is_over() {
        run.tick().unwrap();
    }
    let file = |name: &str, text: &str| TextFile::new(name.to_owned(), text.to_owned());
    let scripts = vec![file("hops.bzz", script)];
    let title = "Count the hops".to_owned();
    let mut result = HandIn::new(by.to_owned(), title, file("hops.toml", SCENARIO), scripts);
    result.complete(&mut run);
    result
}

/// A folder with the assignment and some results.
fn folder(test: &str, results: &[(&str, &str)]) -> Folder {
    let folder = Folder::with(test, "hops.toml", SCENARIO);
    folder.write("hops.bzz", START);
    for (name, text) in results {
        folder.write(name, text);
    }
    folder
}

#[test]
fn results_run_again() {
    let (ada, ben) = (hand_in("Ada", SOLUTION), hand_in("Ben", START));
    assert!(ada.success && !ben.success);
    let folder = folder("grade", &[("b.json", &ben.text()), ("a.json", &ada.text())]);
    let outcome = folder.bbz(&["grade", "."]);
    assert_eq!((outcome.status, &*outcome.stderr), (Some(0), ""));
    let verdicts: Vec<&str> =
        outcome.stdout.lines().map(|line| line.split(';').next().unwrap()).collect();
    let expected = [
        "a.json: Ada: 6 of 6 held",
        "    held    source: robot 1: global.hops equals 0, always from 1 to 29.9 s",
        "    held    next: all of robots 0, 2, 3 to 5: global.hops equals 1, always from 10 to 29.9 s",
        "    held    last: all of robots 27 to 29: global.hops equals 9, always from 10 to 29.9 s",
        "    held    moved: all of robots 27 to 29: global.hops equals 1, within 45 s",
        "    held    stays: 6 or more of robots 21 to 29: global.hops below 6, always from 60 to 120 s",
        "    held    turned: 2 or more of robots 3 to 5: global.hops equals 9, always from 80 to 120 s",
        "b.json: Ben: 1 of 6 held",
        "    held    source: robot 1: global.hops equals 0, always from 1 to 29.9 s",
        "    FAILED  next: all of robots 0, 2, 3 to 5: global.hops equals 1, always from 10 to 29.9 s",
        "    FAILED  last: all of robots 27 to 29: global.hops equals 9, always from 10 to 29.9 s",
        "    FAILED  moved: all of robots 27 to 29: global.hops equals 1, within 45 s",
        "    FAILED  stays: 6 or more of robots 21 to 29: global.hops below 6, always from 60 to 120 s",
        "    FAILED  turned: 2 or more of robots 3 to 5: global.hops equals 9, always from 80 to 120 s",
    ];
    assert_eq!(verdicts, expected);
    // The digest is that of the simulator.
    folder.write("hops.bzz", SOLUTION);
    let simulated = folder.bbz(&["sim", "hops.toml", "--json"]);
    let graded = folder.bbz(&["grade", ".", "--json"]);
    assert!(graded.stdout.contains(&ada.digest), "{}", graded.stdout);
    assert!(simulated.stdout.contains(&ada.digest), "{}", simulated.stdout);
}

/// The LEDs are red from 1 s to 3 s, and again from 10.2 s on.
#[test]
fn an_expectation_that_held_early_names_its_own_time() {
    let script = "n = 0\nfunction step() {\n  n = n + 1\n  led(0)\n  if(n >= 10 and n < 30) led(1)\n  if(n >= 101) led(1)\n}\n";
    let scenario = "[assignment]\ntitle = \"Red\"\ntext = \"Be red.\"\n[world]\nsize = [400, 400]\nduration = 12\n\
                    [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 2\nclock_skew = 0\n\
                    [[expect]]\nat = 2\nvalue = \"led\"\nequals = 1\n\
                    [[expect]]\nat = 12\nvalue = \"led\"\nequals = 1\n\
                    [[expect]]\nat = 5\nvalue = \"led\"\nequals = 1\n";
    let folder = Folder::with("grade_times", "s.toml", scenario);
    folder.write("s.bzz", script);
    let files = SharedFiles::default();
    files.add("s.toml", scenario);
    files.add("s.bzz", script);
    let (mut run, _) = Shelf::new(files, "s.toml".into()).open(1).unwrap();
    while !run.is_over() {
        run.tick().unwrap();
    }
    let file = |name: &str, text: &str| TextFile::new(name.to_owned(), text.to_owned());
    let (of, scripts) = (file("s.toml", scenario), vec![file("s.bzz", script)]);
    let mut result = HandIn::new("Ada".to_owned(), "Red".to_owned(), of, scripts);
    result.complete(&mut run);
    folder.write("a.json", result.text());
    let graded = folder.bbz(&["grade", "."]);
    let expected = [
        "a.json: Ada: 2 of 3 held",
        "    held    all: led equals 1, at 2 s; true at 2.0 s, and for good since 10.2 s",
        "    held    all: led equals 1, at 12 s; since 10.2 s",
        "    FAILED  all: led equals 1, at 5 s",
    ];
    assert_eq!(graded.stdout.lines().collect::<Vec<_>>(), expected);
    let simulated = folder.bbz(&["sim", "s.toml", "--headless"]).stdout;
    for line in [
        "all: led equals 1, at 2 s; true at 2.0 s, and for good since 10.2 s\n",
        "all: led equals 1, at 12 s; true for good since 10.2 s\n",
        "all: led equals 1, at 5 s; true for good since 10.2 s\n",
    ] {
        assert!(simulated.contains(line), "{simulated}");
    }
}

#[test]
fn results_that_differ_are_reported() {
    let ada = hand_in("Ada", SOLUTION);
    let copied = HandIn { by: "Eve\u{1b}[2J".to_owned(), ..ada.clone() };
    // Verdicts in the file do not count.
    let mut boasted = hand_in("Ben", START);
    boasted.expectations.clone_from(&ada.expectations);
    boasted.digest.clone_from(&ada.digest);
    let mut easier = hand_in("Cid", START);
    easier.scenario.text = easier.scenario.text.replace("equals = 9", "equals = 50");
    let mut edited = ada.clone();
    edited.scripts[0].text += "# And more.\n";
    let mut outside = ada.clone();
    outside.scripts[0].name = "../hops.bzz".to_owned();
    let wrong = TextFile::new("hops.bzz".to_owned(), "function step( {\n".to_owned());
    let broken = HandIn { scripts: vec![wrong], ..ada.clone() };
    let all = [&ada, &boasted, &easier, &copied, &edited, &outside, &broken].map(HandIn::text);
    let names = ["a.json", "b.json", "c.json", "d.json", "e.json", "f.json", "g.json"];
    let results: Vec<(&str, &str)> =
        names.into_iter().zip(all.iter().map(String::as_str)).collect();
    let folder = folder("grade-differs", &results);
    folder.write("h.json", "{\"by\": 1}");
    folder.write("i.json", [0xff, 0xfe]);
    let outcome = folder.bbz(&["grade", "."]);
    assert_eq!(outcome.status, Some(1));
    assert!(
        outcome.stderr.contains("7 of 9 results differ from their files or do not run"),
        "{}",
        outcome.stderr
    );
    for part in [
        "a.json: Ada: 6 of 6 held",
        "note: the same scripts as d.json",
        "b.json: Ben: 1 of 6 held",
        "note: it went another way where it was handed in",
        "c.json: Cid: 1 of 6 held",
        "note: it was handed in with another scenario",
        "d.json: Eve\u{fffd}[2J: 6 of 6 held",
        "e.json: does not run",
        "its script `hops.bzz` was changed after it was handed in",
        "f.json: does not run",
        "no robot of the assignment has the script `./../hops.bzz`",
        "g.json: does not run",
        "hops.bzz:1:16: ",
        "h.json: does not run",
        "it is no result of an assignment: invalid type: integer `1`, expected a string at line 1",
        "i.json: does not run",
    ] {
        assert!(outcome.stdout.contains(part), "{part}:\n{}", outcome.stdout);
    }
    let json = folder.bbz(&["grade", ".", "--json"]);
    assert_eq!(json.status, Some(1));
    for part in ["\"as_handed_in\":false", "\"same_scripts\":[\"d.json\"]", "\"runs\":false"] {
        assert!(json.stdout.contains(part), "{part}:\n{}", json.stdout);
    }
}

/// Scripts of other people cannot read files of the person who grades.
#[test]
fn scripts_include_files_of_the_assignment_alone() {
    let secret = Folder::with("grade-secret", "secret.bzz", "root:x:0:0:root\n");
    let absolute = fs::canonicalize(secret.path("secret.bzz")).unwrap();
    let absolute = format!("include \"{}\"\n{SOLUTION}", absolute.display());
    let include = |path: &str| format!("include \"{path}\"\n{SOLUTION}");
    let [relative, near] = ["../grade-secret/secret.bzz", "near/hop.bzz"].map(include);
    let [helper, spelled] = ["helper.bzz", "./near/../helper.bzz"].map(include);
    let solution = "include \"near/solution.bzz\"\n".to_owned();
    let library = format!("include \"vec2.bzz\"\n{SOLUTION}");
    let ada = hand_in("Ada", SOLUTION);
    let with = |script: &str| {
        let script = TextFile::new("hops.bzz".to_owned(), script.to_owned());
        HandIn { scripts: vec![script], ..ada.clone() }.text()
    };
    let folder = folder(
        "grade-include",
        &[
            ("a.json", &with(&absolute)),
            ("b.json", &with(&relative)),
            ("c.json", &with(&near)),
            ("d.json", &with(&library)),
            ("e.json", &with(&solution)),
            ("f.json", &with(&helper)),
            ("g.json", &with(&spelled)),
        ],
    );
    fs::create_dir(folder.path("near")).unwrap();
    folder.write("near/hop.bzz", "HOP = 1\n");
    folder.write("near/solution.bzz", SOLUTION);
    folder.write("helper.bzz", "HELP = 1\n");
    folder.write("hops.bzz", format!("include \"helper.bzz\"\n{START}"));
    let outcome = folder.bbz(&["grade", "."]);
    assert!(!outcome.stdout.contains("root"), "{}", outcome.stdout);
    for part in [
        "a.json: does not run\n    ./hops.bzz:1:1: E0301: there is no file",
        "b.json: does not run\n    ./hops.bzz:1:1: E0301: there is no file",
        "c.json: does not run\n    it includes `near/hop.bzz`, which is no part of the assignment\n",
        "d.json: Ada: 6 of 6 held",
        "e.json: does not run\n    it includes `near/solution.bzz`, which is no part of the assignment\n",
        "f.json: Ada: 6 of 6 held",
        "g.json: Ada: 6 of 6 held",
    ] {
        assert!(outcome.stdout.contains(part), "{part}:\n{}", outcome.stdout);
    }
    // Folders of `-I` are the choice of the person who grades.
    let outcome = folder.bbz(&["grade", ".", "-I", "near"]);
    assert!(outcome.stdout.contains("c.json: Ada: 6 of 6 held"), "{}", outcome.stdout);
    let secret = secret.path(".").display().to_string();
    let outcome = folder.bbz(&["grade", ".", "-I", &secret]);
    assert!(outcome.stdout.contains("secret.bzz:1:5: "), "{}", outcome.stdout);
}

/// People read the script with the name that they know, and the other one would run.
#[test]
fn two_spellings_of_a_script_are_refused() {
    let ada = hand_in("Ada", SOLUTION);
    let mut results = Vec::new();
    for (file, name) in [
        ("a.json", "./hops.bzz"),
        ("b.json", "near/../hops.bzz"),
        ("c.json", "../grade-spellings/hops.bzz"),
        ("d.json", "HOPS.bzz"),
    ] {
        let harmless = TextFile::new("hops.bzz".to_owned(), START.to_owned());
        let hidden = TextFile::new(name.to_owned(), SOLUTION.to_owned());
        for scripts in [vec![hidden.clone(), harmless.clone()], vec![harmless, hidden]] {
            results.push((file, HandIn { scripts, ..ada.clone() }.text()));
        }
    }
    for (file, text) in results {
        let folder = folder("grade-spellings", &[(file, &text)]);
        fs::create_dir(folder.path("near")).unwrap();
        for line in [&["grade", "."][..], &["grade", ".", "--scenario", "hops.toml"]] {
            let outcome = folder.bbz(line);
            let (status, text) = (outcome.status, &outcome.stdout);
            assert_eq!(status, Some(1), "{text}");
            assert!(text.contains(&format!("{file}: does not run\n    ")), "{text}");
            assert!(text.contains(" twice\n") || text.contains("no robot of the"), "{text}");
        }
    }
}

/// Comments, spaces and functions that nothing calls do not make a script another one.
#[test]
fn copies_are_found_by_the_programs_that_run() {
    let copied = format!("# My own work.\n\n{}", SOLUTION.replace("  ", "     "));
    let padded = format!("{SOLUTION}\nfunction unused() {{ return 1 }}\n");
    let all = [SOLUTION, &copied, START, &padded].map(|script| hand_in("Ada", script).text());
    let names = ["a.json", "b.json", "c.json", "d.json"];
    let results: Vec<_> = names.into_iter().zip(all.iter().map(String::as_str)).collect();
    let folder = folder("grade-copies", &results);
    let json = folder.bbz(&["grade", ".", "--json"]).stdout;
    let same = |names: &str| json.matches(&format!("\"same_scripts\":[{names}]")).count();
    for others in ["\"b.json\",\"d.json\"", "\"a.json\",\"d.json\"", "", "\"a.json\",\"b.json\""] {
        assert_eq!(same(others), 1, "{others}: {json}");
    }
}

#[test]
fn a_table_has_a_line_for_each_result_and_a_column_for_each_expectation() {
    let ada = hand_in("Ada \"the\" first, and only", SOLUTION);
    let ben = hand_in("=HYPERLINK(\"x\")", START);
    let results = [("a.json", ada.text()), ("b.json", ben.text()), ("c.json", "{}".to_owned())];
    let folder = folder("grade-csv", &results.each_ref().map(|(name, text)| (*name, &**text)));
    let outcome = folder.bbz(&["grade", ".", "--csv", "marks.csv"]);
    assert!(outcome.stdout.contains("6 of 6 held"), "{}", outcome.stdout);
    let table = String::from_utf8(folder.read("marks.csv")).unwrap();
    let lines: Vec<&str> = table.split("\r\n").collect();
    let expectations = "source,next,last,moved,stays,turned";
    let title = format!(
        "file,by,runs,success,held,expectations,{expectations},digest,as_handed_in,same_scripts,reason"
    );
    let first = format!(
        "a.json,\"Ada \"\"the\"\" first, and only\",true,true,6,6,true,true,true,true,true,true,{},true,,",
        ada.digest
    );
    let second = format!(
        "b.json,\"'=HYPERLINK(\"\"x\"\")\",true,false,1,6,true,false,false,false,false,false,{},true,,",
        ben.digest
    );
    assert_eq!(lines[..3], [title, first, second]);
    assert!(lines[3].starts_with("c.json,,false,,,,,,,,,,,,,it is no result"), "{}", lines[3]);
    assert_eq!(lines[4..], [""]);
    // Nothing that is read is overwritten.
    for name in ["a.json", "hops.toml", "hops.bzz"] {
        let before = folder.read(name);
        folder.bbz(&["grade", ".", "--csv", name]).fails_with(3, &[name]);
        assert_eq!(folder.read(name), before);
    }
}

#[test]
fn a_long_report_is_cut() {
    let ada = hand_in("Ada", SOLUTION);
    let script = TextFile::new("hops.bzz".to_owned(), "x = )\n".repeat(1000));
    let text = HandIn { scripts: vec![script], ..ada.clone() }.text();
    let mut doubled = ada.clone();
    doubled.scripts.push(ada.scripts[0].clone());
    let none = HandIn { scripts: Vec::new(), ..ada };
    let results = [("a.json", text), ("b.json", doubled.text()), ("c.json", none.text())];
    let folder = folder("grade-long", &results.each_ref().map(|(name, text)| (*name, &**text)));
    let outcome = folder.bbz(&["grade", "."]);
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert!(lines.len() < 20, "{}", outcome.stdout);
    assert!(outcome.stdout.contains("    and 995 more\n"), "{}", outcome.stdout);
    for part in ["it has the script `hops.bzz` twice", "it has no script"] {
        assert!(outcome.stdout.contains(part), "{part}:\n{}", outcome.stdout);
    }
}

#[test]
fn a_folder_without_an_assignment_is_refused() {
    let folder = folder("grade-folder", &[]);
    folder.bbz(&["grade", "."]).fails_with(3, &["`.` has no results (*.json)", "Hand in"]);
    folder.bbz(&["grade", "none"]).fails_with(3, &["none"]);
    folder.write("a.json", hand_in("Ada", SOLUTION).text());
    folder.write("other.toml", SCENARIO);
    folder.bbz(&["grade", "."]).fails_with(3, &["does not have one scenario", "--scenario FILE"]);
    let outcome = folder.bbz(&["grade", ".", "--scenario", "hops.toml"]);
    assert!(outcome.stdout.contains("a.json: Ada: 6 of 6 held"), "{}", outcome.stdout);
    // A mistake of the assignment is reported once.
    folder.write("other.toml", SCENARIO.replace("count = 30", "cuont = 30"));
    let line = SCENARIO.lines().position(|line| line == "count = 30").unwrap() + 1;
    let place = format!("the assignment does not run: other.toml:{line}:1: ");
    let outcome = folder.bbz(&["grade", ".", "--scenario", "other.toml"]);
    outcome.fails_with(3, &[&place, "did you mean `count`?"]);
    fs::remove_file(folder.path("hops.bzz")).unwrap();
    let outcome = folder.bbz(&["grade", ".", "--scenario", "hops.toml"]);
    outcome.fails_with(3, &["the assignment does not run", "hops.bzz"]);
}
