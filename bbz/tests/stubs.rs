//! `bbz stubs`: writes a robot that the script runs on.

use crate::support::Folder;

const SCRIPT: &str = "\
include \"lib.bzz\"

function init() {
  hello = function(x) { beep(x) }
}

function step() {
  drive(1, 2)
  if(distance(3) < 100 or touched()) drive(0)
  blink()
  say(1, 2, 3, 4, 5, 6, 7, 8)
  helper()
  hello(pos.x)
  log(math.abs(id), neighbors.count())
}
";

const EXPECTED: &str = r#"# The robot of patrol.bzz. Each function is only logged: give it an effect with `sets` or `reads`.

name = "my-rover"

# The body that `bbz sim` moves: a disc on two wheels.
[body]
drive = "differential"
radius_mm = 50
wheel_distance_mm = 80
speed_mm_s = 200

# The link over which robots exchange messages.
[[sensor]]
name = "radio"
kind = "range-and-bearing"
range_mm = 1000

[[table]]
name = "pos"
fields = "x: number, y: number, z: number, orientation: number"
help = "x, y and z in mm, orientation in degrees"

# First called in lib.bzz:1:21.
[[function]]
name = "ring"
accepts = [""]
logs = true
help = "called with 0 arguments"

# First called in patrol.bzz:4:25.
[[function]]
name = "beep"
accepts = ["a1: any"]
logs = true
help = "called with 1 argument"

# First called in patrol.bzz:8:3.
[[function]]
name = "drive"
accepts = ["a1: any", "a1: any, a2: any"]
logs = true
help = "called with 1 or 2 arguments"

# First called in patrol.bzz:9:6.
[[function]]
name = "distance"
accepts = ["a1: any"]
returns = "int"
logs = true
help = "called with 1 argument"

# First called in patrol.bzz:9:27.
[[function]]
name = "touched"
accepts = [""]
returns = "int"
logs = true
help = "called with 0 arguments"

# First called in patrol.bzz:10:3.
[[function]]
name = "blink"
accepts = [""]
logs = true
help = "called with 0 arguments"

# First called in patrol.bzz:11:3.
[[function]]
name = "say"
accepts = ["values: any..."]
logs = true
help = "called with 8 arguments"
"#;

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("patrol.bzz", SCRIPT);
    folder.write("lib.bzz", "function helper() { ring() }\n");
    folder
}

#[test]
fn a_robot_file_is_written_that_the_script_runs_on() {
    let folder = folder("stubs");
    let written = folder.bbz(&["stubs", "patrol.bzz", "-o", "My_Rover.toml"]);
    assert_eq!((written.status, written.stdout.as_str()), (Some(0), ""), "{}", written.stderr);
    let text = String::from_utf8(folder.read("My_Rover.toml")).unwrap();
    assert_eq!(text, EXPECTED);
    let printed = folder.bbz(&["stubs", "patrol.bzz"]);
    assert_eq!(printed.stdout, EXPECTED.replace("my-rover", "patrol"));

    let checked = folder.bbz(&["check", "patrol.bzz", "--robot", "My_Rover.toml"]);
    assert_eq!((checked.status, checked.stderr.as_str()), (Some(0), ""));
    let run = folder.bbz(&["run", "patrol.bzz", "--robot", "My_Rover.toml", "--steps", "1"]);
    assert_eq!(run.status, Some(0), "{}", run.stderr);
    let lines = "drive(1, 2)\ndistance(3)\ndrive(0)\nblink()\nsay(1, 2, 3, 4, 5, 6, 7, 8)\nring()\nbeep(0.000000)\n";
    assert!(run.stdout.starts_with(lines), "{}", run.stdout);

    let world = "[world]\nsize = [500, 500]\nduration = 1\n[[robots]]\nrobot = \"My_Rover.toml\"\nscript = \"patrol.bzz\"\n";
    folder.write("world.toml", world);
    let simulated = folder.bbz(&["sim", "world.toml"]);
    assert_eq!(simulated.status, Some(0), "{}{}", simulated.stdout, simulated.stderr);
    // The calls are logged.
    assert!(simulated.stdout.contains("     0.1     0  12345678\n"), "{}", simulated.stdout);
}

/// Tables of the robot, functions in them, and functions that return a text.
#[test]
fn tables_of_the_robot_are_written() {
    let folder = Folder::new("stubs_tables");
    let script = "\
        function step() {\n\
          if(status.speed.x > 1 or eyes[2].value > 0) ui.set_hex(3)\n\
          log(string.length(cell()), \" \", size(eyes), \" \", pose.position.z)\n\
        }\n";
    folder.write("host.bzz", script);
    let written = folder.bbz(&["stubs", "host.bzz", "-o", "host.toml"]);
    assert_eq!(written.status, Some(0), "{}", written.stderr);
    let text = String::from_utf8(folder.read("host.toml")).unwrap();
    for part in [
        "# Each value of a table is always 0: give it a sensor with `reads`.\n",
        "name = \"ui.set_hex\"\naccepts = [\"a1: any\"]\nlogs = true\n",
        "name = \"cell\"\naccepts = [\"\"]\nreturns = \"string\"\n",
        "# First used in host.bzz:2:4.\n[[value]]\nname = \"status.speed.x\"\nis = 0.0\n",
        "[[value]]\nname = \"eyes[].value\"\nis = 0.0\ncount = 8\n",
        // Tables that other hosts fill are written whole.
        "[[value]]\nname = \"pose.orientation.yaw\"\nis = 0.0\n",
    ] {
        assert!(text.contains(part), "{part}\nin\n{text}");
    }
    let run = folder.bbz(&["run", "host.bzz", "--robot", "host.toml", "--steps", "1"]);
    assert_eq!(
        (run.status, run.stdout.as_str()),
        (Some(0), "cell()\n0 8 0.000000\n"),
        "{}",
        run.stderr
    );
    let checked = folder.bbz(&["check", "host.bzz", "--robot", "host.toml"]);
    assert_eq!((checked.status, checked.stderr.as_str()), (Some(0), ""));
}

#[test]
fn a_script_that_calls_nothing_has_a_robot_without_functions() {
    let folder = Folder::new("stubs_none");
    folder.write("2 words.bzz", "function step() { log(1) }\n");
    let text = folder.bbz(&["stubs", "2 words.bzz"]).stdout;
    assert!(text.contains("name = \"robot-2-words\""), "{text}");
    assert!(!text.contains("[[function]]"), "{text}");
}

#[test]
fn a_mistake_writes_no_robot_file() {
    let folder = folder("stubs_refused");
    folder.write("wrong.bzz", "function step() { drive(1 }\n");
    let wrong = folder.bbz(&["stubs", "wrong.bzz", "-o", "out.toml"]);
    assert_eq!((wrong.status, folder.path("out.toml").exists()), (Some(2), false));
    assert!(wrong.stderr.contains("wrong.bzz:1"), "{}", wrong.stderr);
    let itself = folder.bbz(&["stubs", "patrol.bzz", "-o", "lib.bzz"]);
    assert_eq!(itself.status, Some(3), "{}", itself.stderr);
    // Both names would become the same constant of generated code.
    folder.write("alike.bzz", "goTo(1) go_to(1)\n");
    let alike = folder.bbz(&["stubs", "alike.bzz"]);
    assert_eq!((alike.status, alike.stdout.as_str()), (Some(3), ""));
    assert!(alike.stderr.contains("would both be the constant `GO_TO`"), "{}", alike.stderr);
}
