//! No text of others controls the terminal: every command gets all controls in everything that it reads.

use std::fs;

use bittybuzz_bad_inputs::controls::{escaped, found_in, hostile};
use bittybuzz_live::{HandIn, TextFile};

use crate::support::Folder;

fn assert_harmless(place: &str, text: &str) {
    // Colors are those of this program.
    let mut rest = text.to_owned();
    while let Some(start) = rest.find("\u{1b}[") {
        let parameters = rest[start + 2..].find(|c: char| !c.is_ascii_digit() && c != ';').unwrap();
        let end = start + 2 + parameters;
        assert_eq!(&rest[end..=end], "m", "{place}: {text:?}");
        rest.replace_range(start..=end, "");
    }
    let found = found_in(&rest);
    assert!(found.is_none(), "{place}: {found:?} in {text:?}");
}

const ROBOTS: &str = "[world]\nsize = [400, 400]\nduration = 1\n[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 2\n";

#[test]
fn no_command_prints_controls_of_others() {
    let evil = hostile();
    let named = format!("n{evil}").replace('/', "");
    let printing = format!(
        "x = 0\nlog(\"{evil}\")\nfunction step() {{ log(\"{evil}\") assert(0, \"{evil}\") }}\n"
    );
    let wrong = format!("x = \"{evil}\" = {evil}\ninclude \"{evil}\"\nunknown(\"{evil}\")\n");
    let text = escaped(&evil);
    let expecting = format!(
        "{ROBOTS}[[expect]]\nat = 1\nvalue = \"global.x\"\nequals = \"{text}\"\n[assignment]\ntitle = \"{text}\"\ntext = \"{text}\"\n"
    );
    let named_expectation = expecting.replace("at = 1", &format!("at = 1\nname = \"{text}\""));
    let unknown = format!("{ROBOTS}\"{text}\" = \"{text}\"\n# {evil}\n");
    let argos = format!("<argos-configuration><x a=\"{evil}\">{evil}</x></argos-configuration>");
    let folder = Folder::new("controls");
    for (file, content) in [
        ("s.bzz", printing.as_str()),
        ("wrong.bzz", &wrong),
        ("expect.toml", &expecting),
        ("named.toml", &named_expectation),
        ("unknown.toml", &unknown),
        ("x.argos", &argos),
        ("robot.toml", &unknown),
        ("trace.txt", &format!("1.0 INFO {evil}\n{evil}\n")),
    ] {
        folder.write(file, content);
    }
    let [script, scenario] = ["bzz", "toml"].map(|end| format!("{named}.{end}"));
    folder.write(&script, &printing);
    folder.write(&scenario, &expecting);
    fs::create_dir(folder.path("class")).unwrap();
    folder.write("class/s.bzz", "x = 1\n");
    folder.write("class/t.toml", &expecting);
    let text_file = |text: &str| TextFile::new("s.bzz".to_owned(), text.to_owned());
    let (of, scripts) = (text_file(&expecting), vec![text_file(&printing)]);
    let hand_in = HandIn::new(evil.clone(), evil.clone(), of, scripts);
    let broken = HandIn { scripts: vec![text_file(&wrong)], ..hand_in.clone() };
    folder.write(&format!("class/{named}.json"), hand_in.text());
    folder.write("class/broken.json", broken.text());
    folder.write("class/none.json", format!("{{\"{}\": 1}}", escaped(&evil)));

    let robot = ["--robot", "kilobot"];
    let (s, evil) = (script.as_str(), evil.as_str());
    let mut lines: Vec<Vec<&str>> = vec![
        vec!["explain", evil],
        vec!["robots", evil],
        vec![evil],
        vec!["check", "s.bzz", "--deny", evil],
        vec!["run", "s.bzz", evil],
        vec!["import", "x.argos"],
        vec!["trace", "trace.txt"],
        vec!["sim", "expect.toml", "--set", evil],
        vec!["sim", "expect.toml", "--headless", "--runs", "2", "--csv", "runs.csv"],
        vec!["sim", "expect.toml", "--runs", "2", "--json"],
        vec!["grade", "class"],
        vec!["grade", "class", "--json"],
        vec!["grade", "class", "--csv", "marks.csv"],
        vec!["flash", s, "--robot", evil],
        vec!["new", "n\u{9b}31m\u{202e}"],
    ];
    for file in [s, "s.bzz", "wrong.bzz", "none\u{1b}[2J.bzz"] {
        for command in ["check", "build", "run", "disasm"] {
            lines.push([&[command, file], &robot[..]].concat());
            if command != "disasm" {
                lines.push([&[command, file, "--json"], &robot[..]].concat());
            }
        }
        lines.push(vec!["stubs", file]);
        lines.push(vec!["flash", file, "--robot", "kilobot", "--programmer", "none"]);
        lines.push(vec!["check", file, "--robot", "robot.toml"]);
    }
    for file in [scenario.as_str(), "expect.toml", "named.toml", "unknown.toml"] {
        lines.push(vec!["sim", file, "--headless"]);
        lines.push(vec!["sim", file, "--json"]);
    }
    for line in lines {
        let outcome = folder.bbz(&line);
        assert_harmless(&format!("standard output of {line:?}"), &outcome.stdout);
        assert_harmless(&format!("standard error of {line:?}"), &outcome.stderr);
        let mut colored = folder.command(&line);
        colored.env("CLICOLOR_FORCE", "1");
        let output = colored.output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_harmless(&format!("colored standard error of {line:?}"), &text);
    }
    let marks = String::from_utf8(folder.read("marks.csv")).unwrap();
    assert!(marks.contains("\\u009b31m"), "{marks}");
    for table in ["runs.csv", "marks.csv"] {
        let text = String::from_utf8(folder.read(table)).unwrap();
        assert_harmless(table, &text);
    }
}

/// Programs that read objects get the characters that a script printed.
#[test]
fn strings_in_objects_keep_their_characters() {
    let evil = hostile().replace('\u{1b}', "");
    let folder = Folder::with("controls-json", "s.bzz", &format!("log(\"{evil}\")\n"));
    let outcome = folder.bbz(&["run", "s.bzz", "--json"]);
    let printed = outcome.stdout.lines().find(|line| line.contains("printed")).unwrap();
    let object: serde_json::Value = serde_json::from_str(printed).unwrap();
    assert_eq!(object["printed"], evil);
}
