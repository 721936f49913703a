//! `bbz sim --data`: the tables of a run. Python's libraries for tables read the Parquet files in
//! python/tests.

use std::fs::{self, File};

use bittybuzz_tables::{Form, TableReader, Values, Wanted};
use serde_json::Value;

use crate::support::Folder;

/// Two robots that walk, log and fail, and one that joins later.
const SCENARIO: &str = r#"
[world]
size = [1000, 1000]
duration = 3

[[robots]]
robot = "kilobot"
script = "s.bzz"
positions = [[-100, 0], [100, 0]]
heading = 0
first_id = 7

[[robots]]
name = "late"
robot = "kilobot"
script = "s.bzz"
positions = [[0, 300]]
heading = 90
present = false

[[event]]
at = 1
join = "late"

[[event]]
at = 2.5
fail = 7

[output]
every = 1

[output.data]
quantities = ["y", "heading", "led", "global.n", "global.word", "swarm.spread", "led"]
every = 0.5
messages = true
"#;

const SCRIPT: &str = "n = 0.5\nword = \"on\"\n\
    function step() {\n  n = n + 1\n  if(n == 3.5) log(\"robot \", id, \", \\\"late\\\"\")\n\
      neighbors.broadcast(\"n\", n)\n  if(n > 20) x = nil + 1\n}\n";

fn folder(test: &str) -> Folder {
    let folder = Folder::with(test, "s.toml", SCENARIO);
    folder.write("s.bzz", SCRIPT);
    folder
}

fn run(folder: &Folder, data: &str) -> String {
    let outcome = folder.bbz(&["sim", "s.toml", "--json", "--data", data]);
    // The faults of the script.
    assert_eq!(outcome.status, Some(1), "{}", outcome.stderr);
    let result: Value = serde_json::from_str(&outcome.stdout).unwrap();
    result["digest"].as_str().unwrap().to_owned()
}

#[test]
fn csv_has_a_row_for_each_robot_and_time() {
    let folder = folder("data_csv");
    let digest = run(&folder, "run.csv");
    let text = String::from_utf8(folder.read("run.csv")).unwrap();
    let rows: Vec<&str> = text.split_terminator("\r\n").collect();
    assert_eq!(rows[0], "run,tick,robot,y_tenths_mm,heading_tenths_deg,led,global.n,global.word");
    // Seven times of two robots, and four of the one that joins in the tick after a second.
    assert_eq!(rows.len(), 1 + 7 + 7 + 4);
    assert!(rows[1].starts_with("0,0,7,0,0,0,,"), "{}", rows[1]);
    let column = |row: &str, number: usize| row.split(',').nth(number).unwrap().to_owned();
    let keys: Vec<_> = rows[1..].iter().map(|row| (column(row, 2), column(row, 1))).collect();
    let expected = |id: &str, ticks: &[u32]| -> Vec<(String, String)> {
        ticks.iter().map(|tick| (id.to_owned(), tick.to_string())).collect()
    };
    let all = [0, 5, 10, 15, 20, 25, 30];
    let expected = [expected("7", &all), expected("8", &all), expected("9", &all[3..])].concat();
    assert_eq!(keys, expected);
    // A text is no number, and a global before the first step is nil.
    assert!(rows[1..].iter().all(|row| column(row, 7).is_empty()));
    assert_eq!(column(rows[2], 6), "4.5");
    // Data change nothing.
    let outcome = folder.bbz(&["sim", "s.toml", "--json"]);
    assert_eq!(serde_json::from_str::<Value>(&outcome.stdout).unwrap()["digest"], digest.as_str());
}

#[test]
fn a_folder_has_all_tables_and_the_same_bytes_each_time() {
    let folder = folder("data_folder");
    for name in ["one", "two"] {
        run(&folder, name);
    }
    for table in ["events", "faults", "logs", "messages", "robots", "runs", "swarm"] {
        let file = |run: &str| folder.read(&format!("{run}/{table}/00000.parquet"));
        assert!(file("one").starts_with(b"PAR1") && file("one").ends_with(b"PAR1"), "{table}");
        assert_eq!(file("one"), file("two"), "{table}");
    }
}

/// 300,500 rows are compressed in three groups.
#[test]
fn a_long_run_has_one_file_with_each_row_once() {
    let folder = folder("data_groups");
    folder.write(
        "s.toml",
        "[world]\nsize = [2000, 2000]\nduration = 60\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 500\n\
         [output.data]\nquantities = [\"led\"]\nevery = 0.1\n",
    );
    folder.write("s.bzz", "function step() { led(3) }\n");
    let outcome = folder.bbz(&["sim", "s.toml", "--data", "run"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let files: Vec<_> = fs::read_dir(folder.path("run/robots")).unwrap().collect();
    let [file] = &files[..] else { panic!("{files:?}") };
    let file = File::open(file.as_ref().unwrap().path()).unwrap();
    let table = TableReader::open(file, Form::Parquet).unwrap();
    assert_eq!(table.columns()[1..3], ["tick", "robot"]);
    let mut pieces = table.select(vec![(1, Wanted::Numbers), (2, Wanted::Numbers)]);
    let mut is_seen = vec![false; 500 * 601];
    while let Some(piece) = pieces.next_piece().unwrap() {
        let [Values::Numbers(ticks), Values::Numbers(robots)] = piece else { panic!("{piece:?}") };
        for (tick, robot) in ticks.iter().zip(robots) {
            let place = &mut is_seen[*robot as usize * 601 + *tick as usize];
            assert!(!*place, "robot {robot} at {tick}");
            *place = true;
        }
    }
    assert!(is_seen.iter().all(|seen| *seen));
}

#[test]
fn destinations_that_cannot_take_tables_are_refused() {
    let folder = folder("data_refused");
    std::fs::create_dir(folder.path("full")).unwrap();
    folder.write("full/a", "");
    for (data, expected) in [
        ("full", "error: `full` holds files already\nhelp: name another folder, or remove them\n"),
        (
            "run.parquet",
            "error: `run.parquet` would be a single file of Parquet\n\
             help: name a folder, such as `run`, or a file that ends in .csv\n",
        ),
    ] {
        let outcome = folder.bbz(&["sim", "s.toml", "--headless", "--data", data]);
        assert_eq!(outcome.status, Some(3));
        assert!(outcome.stderr.ends_with(expected), "{}", outcome.stderr);
    }
    let many = ["sim", "s.toml", "--headless", "--runs", "2"];
    let outcome = folder.bbz(&[&many[..], &["--data", "run.csv"]].concat());
    assert_eq!(outcome.status, Some(3));
    let expected = "error: `run.csv` would be a single file for several runs\n\
                    help: name a folder, such as `run`\n";
    assert!(outcome.stderr.ends_with(expected), "{}", outcome.stderr);
    let set = ["--set", "output.data.messages=true,false", "--data", "run"];
    let outcome = folder.bbz(&[&many[..], &set].concat());
    assert_eq!(outcome.status, Some(3));
    assert!(outcome.stderr.contains("change which columns the tables of --data have"));
    // The scenario is an input, and a file is no folder.
    let outcome = folder.bbz(&["sim", "s.toml", "--headless", "--data", "s.toml"]);
    assert_eq!(outcome.status, Some(3));
    assert_eq!(folder.read("s.toml"), SCENARIO.as_bytes());
}

#[test]
fn unknown_quantities_have_a_place() {
    for (quantity, place, message) in
        [("\"globl.n\"", 33, "globl.n"), ("\"global.m\"", 33, "m"), ("5", 33, "string")]
    {
        let text = SCENARIO.replace("\"y\", \"heading\"", quantity);
        let folder = Folder::with("data_unknown", "s.toml", &text);
        folder.write("s.bzz", SCRIPT);
        let outcome = folder.bbz(&["sim", "s.toml", "--headless", "--data", "run"]);
        assert_eq!(outcome.status, Some(2), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(&format!("s.toml:{place}:")), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(message), "{}", outcome.stderr);
        assert!(!folder.path("run").exists());
    }
}

#[test]
fn a_recording_becomes_a_table_with_the_same_poses() {
    let folder = folder("data_export");
    let record = ["sim", "s.toml", "--headless", "--record", "run.bbr", "--data", "run.csv"];
    assert_eq!(folder.bbz(&record).status, Some(1));
    let outcome = folder.bbz(&["export", "run.bbr", "poses.csv"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let rows = |name: &str, columns: &[usize]| -> Vec<Vec<String>> {
        let text = String::from_utf8(folder.read(name)).unwrap();
        let rows = text.split_terminator("\r\n").map(|row| row.split(',').collect::<Vec<_>>());
        let chosen = rows.map(|row| columns.iter().map(|column| row[*column].to_owned()).collect());
        chosen.collect()
    };
    // run, tick, robot, y, heading, led
    let poses = rows("poses.csv", &[0, 1, 2, 4, 6, 7]);
    assert_eq!(poses[0], ["run", "tick", "robot", "y_tenths_mm", "heading_tenths_deg", "led"]);
    let data = rows("run.csv", &[0, 1, 2, 3, 4, 5]);
    let each_second =
        |row: &&Vec<String>| row[1].parse().is_ok_and(|tick: u32| tick.is_multiple_of(10));
    let sampled: Vec<&Vec<String>> = data[1..].iter().filter(each_second).collect();
    assert_eq!(poses[1..].iter().collect::<Vec<_>>(), sampled);
    let states = rows("poses.csv", &[1, 2, 8]);
    let last = |robot: &str| states.iter().rfind(|row| row[1] == robot).unwrap()[2].clone();
    assert_eq!([last("7"), last("8")], ["failed", "faulted"].map(str::to_owned));
    let outcome = folder.bbz(&["export", "run.bbr", "poses"]);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(folder.read("poses/robots/00000.parquet").starts_with(b"PAR1"));
}

#[test]
fn files_that_are_no_recordings_are_refused() {
    let folder = folder("data_no_recording");
    folder.write("empty.bbr", "");
    for (file, expected) in [
        ("s.toml", "error: cannot convert `s.toml`: "),
        ("empty.bbr", "error: cannot convert `empty.bbr`: "),
        ("none.bbr", "error: there is no file `none.bbr`"),
    ] {
        let outcome = folder.bbz(&["export", file, "out"]);
        assert_eq!(outcome.status, Some(3), "{}", outcome.stderr);
        assert!(outcome.stderr.starts_with(expected), "{}", outcome.stderr);
        assert!(!folder.path("out").exists());
    }
    let record = ["sim", "s.toml", "--headless", "--record", "run.bbr"];
    folder.bbz(&record);
    let bytes = folder.read("run.bbr");
    folder.write("half.bbr", &bytes[..bytes.len() / 2]);
    let outcome = folder.bbz(&["export", "half.bbr", "half"]);
    assert_eq!(outcome.status, Some(3), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("cannot convert `half.bbr`"), "{}", outcome.stderr);
}
