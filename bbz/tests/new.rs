//! `bbz new`, and a simulation without a scenario file: both make the scenario of a script.

use crate::support::Folder;

const SCRIPT: &str = "function step() { if(id == 3) log(\"step\") }\n";

/// A robot of one's own, with a link that reaches the next robots or without one.
fn robot_file(range_mm: Option<u32>) -> String {
    let link = range_mm.map_or(String::new(), |range| {
        format!("[[sensor]]\nname = \"radio\"\nkind = \"range-and-bearing\"\nrange_mm = {range}\n")
    });
    format!(
        "name = \"rover\"\n[body]\ndrive = \"unicycle\"\nradius_mm = 30\nspeed_mm_s = 100\nturn_deg_s = 90\n{link}"
    )
}

/// Every step of the README, on every robot: no message, and the expectation holds.
#[test]
fn a_new_folder_runs_on_every_robot() {
    let folder = Folder::new("new");
    for (file, range) in [("far.toml", Some(2000)), ("near.toml", Some(300)), ("alone.toml", None)]
    {
        folder.write(file, robot_file(range));
    }
    let shipped = ["kilobot", "zooids", "crazyflie", "footbot", "epuck", "khepera", "hiveboard"];
    for robot in shipped.into_iter().chain(["far.toml", "near.toml", "alone.toml"]) {
        let name = robot.replace('.', "_");
        let made = folder.bbz(&["new", &name, "--robot", robot]);
        made.succeeds_with(&format!("made {name}: try `bbz sim {name}/{name}.toml --view`\n"));
        let file = |extension: &str| format!("{name}/{name}.{extension}");
        folder
            .bbz(&["check", &file("bzz"), "--robot", robot, "--deny", "warnings"])
            .succeeds_with("");
        // Robots with a lamp show what they know: who watches them sees that they come to agree.
        let calls = folder.bbz(&["run", &file("bzz"), "--robot", robot, "--steps", "1"]);
        let is_lit = ["kilobot", "zooids", "crazyflie"].contains(&robot);
        assert_eq!(calls.stdout.contains("led("), is_lit, "{robot}: {calls:?}");
        let run = folder.bbz(&["sim", &file("toml"), "--headless"]);
        assert_eq!((run.status, run.stderr.as_str()), (Some(0), ""), "{robot}: {}", run.stdout);
        assert!(run.stdout.contains("held"), "{robot}: {}", run.stdout);
        let readme = String::from_utf8(folder.read(&format!("{name}/README.md"))).unwrap();
        for command in ["bbz check", "bbz sim", "bbz robots"] {
            assert!(readme.contains(command), "{readme}");
        }
    }
    folder
        .bbz(&["new", "kilobot", "--robot", "kilobot"])
        .fails_with(3, &["`kilobot` exists already"]);
    folder.bbz(&["new", "..", "--robot", "kilobot"]).fails_with(3, &["names no folder"]);
    folder.bbz(&["new", "a\nb", "--robot", "kilobot"]).fails_with(3, &["names no folder"]);
    folder.write("none.toml", "name = \"none\"\n");
    folder
        .bbz(&["new", "x", "--robot", "none.toml"])
        .fails_with(3, &["`none` cannot be simulated", "[body]"]);
    folder.bbz(&["new", "x", "--robot", "kilobto"]).fails_with(3, &["kilobto", "kilobot"]);
    assert!(!folder.path("x").exists());
}

#[test]
fn a_new_folder_may_be_below_others() {
    let folder = Folder::with("new_below", "rover.toml", &robot_file(Some(2000)));
    folder
        .bbz(&["new", "a/b", "--robot", "rover.toml"])
        .succeeds_with("made a/b: try `bbz sim a/b/b.toml --view`\n");
    let run = folder.bbz(&["sim", "a/b/b.toml", "--headless"]);
    assert_eq!(run.status, Some(0), "{}", run.stderr);
    // A shell gets a name with a space as one word.
    let made = folder.bbz(&["new", "two words", "--robot", "zooids"]);
    made.succeeds_with("made two words: try `bbz sim 'two words/two words.toml' --view`\n");
    let readme = String::from_utf8(folder.read("two words/README.md")).unwrap();
    assert!(readme.contains("bbz check 'two words.bzz' --robot zooids  "), "{readme}");
}

#[test]
fn a_script_is_simulated_without_a_scenario() {
    let folder = Folder::with("sim_script", "s.bzz", SCRIPT);
    folder.write("rover.toml", robot_file(None));
    for robot in ["kilobot", "zooids", "crazyflie", "rover.toml"] {
        let run = folder.bbz(&["sim", "s.bzz", "--robot", robot, "--count", "4"]);
        assert_eq!(run.status, Some(0), "{robot}: {}", run.stderr);
        assert!(run.stdout.contains("     3  step\n"), "{robot}: {}", run.stdout);
        assert!(run.stdout.contains("4 robots, 60.0 s"), "{robot}: {}", run.stdout);
    }
    let ten = folder.bbz(&["sim", "s.bzz", "--robot", "zooids", "--headless"]);
    assert!(ten.stdout.starts_with("10 robots"), "{}", ten.stdout);
    let set = folder.bbz(&[
        "sim",
        "s.bzz",
        "--robot",
        "zooids",
        "--set",
        "world.duration=2",
        "--headless",
    ]);
    assert!(set.stdout.starts_with("10 robots, 2.0 s"), "{}", set.stdout);
    let csv = ["sim", "s.bzz", "--robot", "zooids", "--runs", "2", "--csv", "runs.csv"];
    assert_eq!(folder.bbz(&csv).status, Some(0));
    assert_eq!(folder.read("runs.csv").iter().filter(|byte| **byte == b'\n').count(), 3);
}

/// Whoever simulates a script without a scenario plays the person who arms the robots.
#[test]
fn crazyflies_of_a_script_without_a_scenario_are_armed() {
    let script = "function init() { log(\"up \", takeoff(300)) }\nfunction step() { }\n";
    let folder = Folder::with("new_armed", "s.bzz", script);
    let run = folder.bbz(&["sim", "s.bzz", "--robot", "crazyflie", "--count", "1"]);
    assert_eq!(run.status, Some(0), "{}", run.stderr);
    assert!(run.stdout.contains("up 1"), "{}", run.stdout);
}

#[test]
fn a_script_needs_its_robots_and_a_scenario_has_them() {
    let folder = Folder::with("sim_robots", "s.bzz", SCRIPT);
    folder.write("wrong.bzz", "x = \n");
    folder.write("w.toml", "[world]\nsize = [500, 500]\nduration = 1\n[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\n");
    folder
        .bbz(&["sim", "s.bzz"])
        .fails_with(3, &["`s.bzz` is a script", "--robot NAME --count 10"]);
    folder
        .bbz(&["sim", "w.toml", "--robot", "kilobot"])
        .fails_with(3, &["`w.toml` is a scenario", "--set robots.0.count=20"]);
    folder.bbz(&["sim", ".", "--robot", "kilobot"]).fails_with(3, &["folder"]);
    folder.bbz(&["sim", "none.bzz", "--robot", "kilobot"]).fails_with(3, &["none.bzz"]);
    folder.bbz(&["sim", "s.bzz", "--robot", "kilobto"]).fails_with(3, &["kilobto"]);
    folder.bbz(&["sim", "s.bzz", "--robot", "kilobot", "--count", "0"]).fails_with(3, &["--count"]);
    folder.bbz(&["sim", "s.bzz", "--count", "3"]).fails_with(3, &["--robot"]);
    folder.bbz(&["sim", "wrong.bzz", "--robot", "kilobot"]).fails_with(2, &["wrong.bzz:"]);
}
