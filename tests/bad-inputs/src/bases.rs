//! Valid files, from which inputs are made.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;

/// A script whose instructions, strings and calls are of many kinds.
pub const SCRIPT: &str = "\
include \"vec2.bzz\"\n\
t = { .a = 1, .b = { .0 = 2, .1 = 3.5 } }\n\
function count(n) { if(n <= 0) { return 0 } return 1 + count(n - 1) }\n\
function init() { log(\"start \", count(5), \" \", t.b)\n  foreach(t, function(k, v) { log(k, \"=\", v) }) }\n\
function step() {\n  i = 0\n  while(i < 3) { i = i + 1 }\n  led(i % 8)\n  neighbors.broadcast(\"topic\", i)\n\
  if(neighbors.count() > 0) { x = i }\n}\n\
function destroy() { log('end') }\n";

/// A scenario with most kinds of sections.
pub const SCENARIO: &str = "\
[world]\nsize = [600, 400]\nduration = 3\nseed = 7\nambient = 300\n\
obstacles = [{ at = [0, 100], radius = 20 }]\n\n\
[medium.ir]\nloss = 0.1\n\n\
[[robots]]\nname = \"some\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 3\n\n\
[[event]]\nat = 1\nblock = [0, 2]\n\n\
[[expect]]\nat = 2\nvalue = \"global.i\"\nequals = 3\n";

/// An experiment of ARGoS.
pub const EXPERIMENT: &str = "\
<?xml version=\"1.0\" ?>\n<argos-configuration>\n  <framework><experiment length=\"10\" ticks_per_second=\"10\" random_seed=\"3\" /></framework>\n\
  <controllers><buzz_controller_kilobot id=\"k\" library=\"x\"><actuators /><sensors />\
<params bytecode_file=\"s.bo\" debug_file=\"s.bdb\" /></buzz_controller_kilobot></controllers>\n\
  <arena size=\"2,2,1\" center=\"0,0,0.5\">\n    <box id=\"w\" size=\"2,0.1,0.5\" movable=\"false\"><body position=\"0,1,0\" orientation=\"0,0,0\" /></box>\n\
    <distribute><position method=\"uniform\" min=\"-1,-1,0\" max=\"1,1,0\" /><orientation method=\"constant\" values=\"0,0,0\" />\
<entity quantity=\"4\" max_trials=\"100\"><kilobot id=\"kb\"><controller config=\"k\" /></kilobot></entity></distribute>\n  </arena>\n</argos-configuration>\n";

/// The longest time that a batch is given to keep its first run.
const PATIENCE: Duration = Duration::from_secs(60);

/// Valid files by format.
pub struct Bases {
    pub scripts: Vec<Vec<u8>>,
    pub scenarios: Vec<Vec<u8>>,
    /// The files of the shipped robots.
    pub robots: Vec<Vec<u8>>,
    /// These, and inputs of the fuzz target.
    pub robot_files: Vec<Vec<u8>>,
    pub objects: Vec<Vec<u8>>,
    pub recordings: Vec<Vec<u8>>,
    pub image: Vec<u8>,
    pub symbols: Vec<u8>,
    /// A result of the assignment in `s.toml`.
    pub hand_in: String,
    /// The journal of `bbz sim s.toml --runs 150 --csv runs.csv`, by file name.
    pub journal: Vec<(String, Vec<u8>)>,
}

impl Bases {
    /// Reads files of the repository, and makes the others with `bbz` in an empty folder.
    pub fn new(bbz: &Path, root: &Path, folder: &Path) -> io::Result<Self> {
        fs::write(folder.join("s.bzz"), SCRIPT)?;
        fs::write(folder.join("s.toml"), SCENARIO)?;
        let call = |arguments: &[&str]| {
            let mut command = Command::new(bbz);
            command.args(arguments).current_dir(folder).stdin(Stdio::null());
            command.stdout(Stdio::null()).stderr(Stdio::piped());
            command
        };
        for arguments in [
            &["build", "s.bzz", "--robot", "kilobot"][..],
            &["sim", "s.toml", "--headless", "--record", "s.bbr"],
        ] {
            let output = call(arguments).output()?;
            if !output.status.success() {
                let message = String::from_utf8_lossy(&output.stderr);
                return Err(io::Error::other(format!("{arguments:?}: {message}")));
            }
        }
        let mut recordings = corpus(root, "recording")?;
        recordings.push(fs::read(folder.join("s.bbr"))?);
        let mut scripts = [corpus(root, "script")?, corpus(root, "script_mutated")?].concat();
        scripts.push(SCRIPT.into());
        let mut scenarios = corpus(root, "scenario")?;
        scenarios.extend((0..20).map(|_| SCENARIO.into()));
        let shipped = ["kilobot", "crazyflie", "zooids"].into_iter();
        let robots =
            shipped.map(|name| fs::read(root.join("robots").join(name).join("robot.toml")));
        let robots = robots.collect::<io::Result<Vec<_>>>()?;
        Ok(Bases {
            scripts,
            scenarios,
            robot_files: [corpus(root, "robot_file")?, robots.clone()].concat(),
            robots,
            objects: [corpus(root, "bo")?, corpus(root, "bo_mutated")?].concat(),
            recordings,
            image: fs::read(folder.join("s.bbi"))?,
            symbols: fs::read(folder.join("s.sym"))?,
            hand_in: hand_in(SCRIPT),
            journal: journal(call, folder)?,
        })
    }
}

/// Returns a result whose script is this one.
pub fn hand_in(script: &str) -> String {
    json!({
        "bittybuzz": "0.1.0",
        "by": "Ada",
        "assignment": "Count",
        "scenario": { "name": "s.toml", "text": SCENARIO },
        "scripts": [{ "name": "s.bzz", "text": script }],
        "seed": 7,
        "seconds": 3.0,
        "digest": "0123456789abcdef",
        "success": false,
        "expectations": [],
    })
    .to_string()
}

/// Returns the committed inputs of a fuzz target, in the order of their names.
fn corpus(root: &Path, target: &str) -> io::Result<Vec<Vec<u8>>> {
    let folder = root.join("fuzz/corpus").join(target);
    let entries: io::Result<Vec<PathBuf>> =
        fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect();
    let mut paths = entries?;
    paths.sort();
    paths.into_iter().map(fs::read).collect()
}

/// Starts a batch, kills it after some runs, and returns its journal.
fn journal(call: impl Fn(&[&str]) -> Command, folder: &Path) -> io::Result<Vec<(String, Vec<u8>)>> {
    let parts = folder.join("runs.csv.parts");
    let mut batch = call(&["sim", "s.toml", "--runs", "150", "--csv", "runs.csv"]).spawn()?;
    let start = Instant::now();
    let has_fourth = || {
        let mut entries = fs::read_dir(&parts).into_iter().flatten().flatten();
        entries.any(|entry| entry.file_name().to_string_lossy().ends_with("-000003.runs"))
    };
    while !has_fourth() && start.elapsed() < PATIENCE {
        thread::sleep(Duration::from_millis(1));
    }
    batch.kill()?;
    batch.wait()?;
    let mut files = Vec::new();
    for entry in fs::read_dir(parts)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // A file that was being written has another name at each start.
        if !name.contains(".unfinished-") {
            files.push((name, fs::read(path)?));
        }
    }
    files.sort();
    Ok(files)
}
