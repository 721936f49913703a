//! `bbz guide` describes everything that the tables of the program contain, and its scripts compile.
//!
//! The tests read the same tables, so that a new built-in, command, option, keyword, code or robot
//! function needs no change here or in the guide.

use crate::support::Folder;
use bittybuzz_compiler::codes::DiagnosticCode;
use bittybuzz_compiler::token::KEYWORDS;
use bittybuzz_robot_files::all_shipped;
use bittybuzz_vm_core::FaultCode;
use bittybuzz_vm_core::builtin::TABLE;

/// The longest page about one robot that a person or an assistant reads as a whole, in lines.
const LINES_MAX: usize = 1100;

fn guide(folder: &Folder, arguments: &[&str]) -> String {
    let outcome = folder.bbz(&[&["guide"], arguments].concat());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    outcome.stdout
}

/// Returns the section of a page below this heading, up to the next heading of its level.
fn section<'a>(page: &'a str, heading: &str) -> &'a str {
    let level = heading.split(' ').next().unwrap();
    let (_, after) =
        page.split_once(&format!("\n{heading}\n")).unwrap_or_else(|| panic!("{heading}"));
    after.split(&format!("\n{level} ")).next().unwrap()
}

/// Returns the scripts of a page.
fn scripts(page: &str) -> Vec<&str> {
    let blocks = page.split("\n```buzz\n").skip(1);
    blocks.map(|block| block.split("\n```\n").next().unwrap()).collect()
}

#[test]
fn the_guide_has_all_words_functions_and_codes() {
    let page = guide(&Folder::new("guide"), &[]);
    for info in TABLE {
        assert!(page.contains(info.help), "{}", info.help);
    }
    for word in KEYWORDS {
        assert!(section(&page, "## Keywords").contains(&format!("`{}`", word.text())), "{word:?}");
    }
    for robot in all_shipped() {
        let section = section(&page, &format!("## Robot {}", robot.name));
        for value in &robot.values {
            assert!(section.contains(&format!("\n{}", value.path)), "{}", value.path);
        }
        for function in robot.functions.iter().filter(|function| !function.is_reader()) {
            assert!(section.contains(&function.help), "{}", function.name);
            for form in function.forms() {
                assert!(section.contains(&format!("\n{form}\n")), "{form}");
            }
        }
    }
    let messages = section(&page, "## Messages");
    for code in DiagnosticCode::ALL {
        let known = messages.contains(&format!(" {} {}", code.text(), code.title()));
        assert!(known, "{code:?} in\n{messages}");
    }
    assert_eq!(messages.matches(" R00").count(), FaultCode::ALL.len());
    let libraries = section(&page, "## Libraries");
    for (name, _) in bittybuzz_library::FILES {
        assert!(libraries.contains(&format!("\n{name}: ")), "{name}");
    }
    assert!(libraries.contains("\n  .append(t, x): Stores x behind the greatest key of t"));
}

#[test]
fn the_guide_has_all_commands_and_their_options() {
    let folder = Folder::new("guide_commands");
    let page = guide(&folder, &[]);
    let help = folder.bbz(&["--help"]).stdout;
    let (_, list) = help.split_once("Commands:\n").unwrap();
    let commands = list.lines().take_while(|line| !line.is_empty());
    let names = commands.filter_map(|line| line.split_whitespace().next());
    let described = section(&page, "## Commands");
    let mut compared = 0;
    for name in names.filter(|name| *name != "help") {
        let (_, after) = described.split_once(&format!("\nbbz {name} ")).expect(name);
        let section = after.split("\n\n").next().unwrap();
        let help = folder.bbz(&[name, "--help"]).stdout;
        let words = help.split(|c: char| c.is_whitespace() || "`,=[]".contains(c));
        for option in words.filter(|word| word.starts_with("--") && *word != "--help") {
            if help.contains(&format!(" {option} ")) || help.contains(&format!(" {option}\n")) {
                let is_own = help.lines().any(|line| {
                    let line = line.trim_start();
                    line.starts_with(option) || line.contains(&format!(", {option}"))
                });
                assert!(!is_own || section.contains(option), "bbz {name} {option}:\n{section}");
                compared += usize::from(is_own);
            }
        }
    }
    assert!(compared > 50, "{compared} options");
}

#[test]
fn the_scripts_of_the_guide_compile() {
    let folder = Folder::new("guide_scripts");
    let whole = scripts(&guide(&folder, &[])).len();
    for robot in all_shipped() {
        let page = guide(&folder, &["--robot", &robot.name]);
        let scripts = scripts(&page);
        assert!(scripts.len() > 8 && scripts.len() <= whole, "{} scripts", scripts.len());
        let lines = page.lines().count();
        assert!(lines <= LINES_MAX, "{}: {lines} lines", robot.name);
        for script in scripts {
            folder.write("s.bzz", format!("{script}\n"));
            let check = ["check", "s.bzz", "--robot", &robot.name, "--deny", "warnings"];
            let outcome = folder.bbz(&check);
            assert_eq!(outcome.status, Some(0), "{}{script}", outcome.stderr);
        }
    }
}

/// A function that a robot file adds is in the guide.
#[test]
fn the_guide_describes_the_robot_that_is_asked_for() {
    let folder = Folder::new("guide_robot");
    let page = guide(&folder, &["--robot", "kilobot"]);
    assert!(page.contains("\nset_motor("));
    // A script has to keep its messages short.
    assert!(page.contains("  one frame carries 9 bytes of a message\n"));
    assert!(!page.contains("\ntakeoff("));
    let own = include_str!("../../robots/kilobot/robot.toml").replace("\"kilobot\"", "\"mine\"");
    let function = "\n[[function]]\nname = \"wave\"\naccepts = [\"\"]\nhelp = \"waves an arm\"\n";
    folder.write("mine.toml", own + function);
    let page = guide(&folder, &["--robot", "mine.toml"]);
    assert!(section(&page, "## Robot mine").contains("\nwave()\n    waves an arm"), "{page}");
    let unknown = folder.bbz(&["guide", "--robot", "kilbot"]);
    unknown.fails_with(3, &["kilbot", "kilobot"]);
}
