//! The page docs/examples.md: each example with the texts of its scenario and its scripts.
//! `UPDATE_DOCS=1 cargo test --locked -p bittybuzz-live --lib examples` writes it.

use super::{AboutDescription, LedMeaning, Paragraph, Proposal, ScriptAbout};
use bittybuzz_arena::scenario::{Group, Scenario};
use std::env;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// The page, from the root.
const PAGE: &str = "docs/examples.md";

/// Folders of examples, from the root, and the titles of their chapters. Lessons have pages of their own.
const CHAPTERS: [(&str, &str); 7] = [
    ("examples/swarm", "Swarms"),
    ("examples/kilobot", "First steps of Kilobots"),
    ("examples/zooids", "Zooids"),
    ("examples/flight", "Flights"),
    ("examples", "Single robots"),
    ("examples/ground", "Painted ground"),
    ("examples/study", "Experiments of publications"),
];

const INTRODUCTION: &str = "\
# Examples

Each of these scenarios starts with the command below it; `--headless` in place of `--view` only prints the result.
The list of the [playground](playground.md) has most of them.
*Try* proposes commands, which the tab *About* of the page has as buttons.
Texts and colors come from the comments of scenarios and scripts ([scenario files](scenario.md)).
";

/// The colors that the sums of 1, 2 and 4 give.
const COLORS: [&str; 8] = ["off", "red", "green", "yellow", "blue", "magenta", "cyan", "white"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Returns the scenarios of a folder, from the root. Robot files have no robots to simulate.
fn scenarios(folder: &str) -> Vec<String> {
    let files = fs::read_dir(root().join(folder)).unwrap();
    let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
    let paths = names.map(|name| format!("{folder}/{name}"));
    let is_scenario = |path: &String| {
        path.ends_with(".toml")
            && fs::read_to_string(root().join(path)).unwrap().contains("\n[[robots]]\n")
    };
    let mut paths: Vec<String> = paths.filter(is_scenario).collect();
    paths.sort();
    paths
}

/// Returns the name of a file as a title.
fn title(path: &str) -> String {
    let name = Path::new(path).file_stem().unwrap().to_str().unwrap().replace('_', " ");
    name[..1].to_uppercase() + &name[1..]
}

fn paragraphs(text: &[Paragraph]) -> String {
    let own = text.iter().filter(|paragraph| paragraph.language.is_none());
    own.map(|paragraph| format!("\n{}\n", paragraph.text)).collect()
}

/// Describes the robots of a group, with a link to their script.
fn robots(group: &Group) -> String {
    let script = group.script.as_ref().map(|script| {
        // A scenario may have the script of another folder.
        let path = fs::canonicalize(script).unwrap();
        let path = path.strip_prefix(fs::canonicalize(root()).unwrap()).unwrap();
        let path = path.to_str().unwrap().replace('\\', "/");
        format!(": [{}](../{path})", script.file_name().unwrap().to_str().unwrap())
    });
    let count = group.count;
    format!("* {count} × `{}`{}\n", group.robot.name, script.unwrap_or_default())
}

fn example(path: &str) -> String {
    let file = root().join(path);
    let models = bittybuzz_robot_models::all();
    let scenario = Scenario::open(&file, &[], &models).unwrap_or_else(|e| panic!("{path}: {e:?}"));
    let mut scripts: Vec<&PathBuf> =
        scenario.groups.iter().flat_map(|group| &group.script).collect();
    scripts.dedup();
    let scripts = scripts
        .into_iter()
        .map(|script| ScriptAbout::new(String::new(), &fs::read_to_string(script).unwrap()));
    let text = fs::read_to_string(&file).unwrap();
    let AboutDescription { text, scripts, proposals } =
        AboutDescription::new(&text, scripts.collect());
    let mut page = format!("\n### {}\n{}", title(path), paragraphs(&text));
    scripts.iter().for_each(|script| page += &paragraphs(&script.text));
    page += "\n";
    scenario.groups.iter().for_each(|group| page += &robots(group));
    for LedMeaning { color, meaning, language } in scripts.iter().flat_map(|script| &script.leds) {
        if language.is_none() {
            writeln!(page, "* LED {}: {meaning}", COLORS[usize::from(*color)]).unwrap();
        }
    }
    for Proposal { label, command, language } in &proposals {
        if language.is_none() {
            writeln!(page, "* Try: {label} (`{}`)", command.replace('\n', ", ")).unwrap();
        }
    }
    page + &format!("\n```sh\nbbz sim {path} --view\n```\n")
}

#[test]
fn the_page_of_examples_is_up_to_date() {
    let mut page = INTRODUCTION.to_owned();
    for (folder, title) in CHAPTERS {
        let scenarios = scenarios(folder);
        assert!(!scenarios.is_empty(), "{folder}");
        writeln!(page, "\n## {title}").unwrap();
        scenarios.iter().for_each(|path| page += &example(path));
    }
    let file = root().join(PAGE);
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&file, &page).unwrap();
    }
    assert!(
        fs::read_to_string(&file).unwrap() == page,
        "`UPDATE_DOCS=1 cargo test --locked -p bittybuzz-live --lib examples` writes {PAGE} again"
    );
}
