//! Pages of the book that a test carries out: it writes their files, runs their commands, and compares the output.

use super::Folder;

/// A block of code: its language, the line before it, its text.
struct Block<'a> {
    language: &'a str,
    instruction: &'a str,
    text: String,
}

fn blocks(guide: &str) -> Vec<Block<'_>> {
    let mut blocks = Vec::new();
    let mut instruction = "";
    let mut lines = guide.lines();
    while let Some(line) = lines.next() {
        match line.strip_prefix("```") {
            Some(language) => {
                let inside = lines.by_ref().take_while(|line| *line != "```");
                let text = inside.map(|line| format!("{line}\n")).collect();
                blocks.push(Block { language, instruction, text });
                instruction = "";
            }
            None if !line.is_empty() => instruction = line,
            None => {}
        }
    }
    blocks
}

/// Returns the file name in lines such as `New file \`F\`:`.
fn file<'a>(instruction: &'a str, start: &str) -> Option<&'a str> {
    instruction.strip_prefix(start)?.strip_suffix("`:")
}

/// Returns true if a command printed the lines of the guide. A line `...` stands for any lines, and `...` at the end of a line
/// for its rest.
fn is_as_shown(printed: &str, shown: &str) -> bool {
    let mut rest = printed;
    let mut may_skip = false;
    for line in shown.split_inclusive('\n') {
        if line == "...\n" {
            may_skip = true;
            continue;
        }
        let begin = line.strip_suffix("...\n").unwrap_or(line);
        let found = match may_skip {
            true => rest.find(begin),
            false => rest.starts_with(begin).then_some(0),
        };
        let Some(at) = found else { return false };
        rest = &rest[at + begin.len()..];
        if begin != line {
            rest = rest.split_once('\n').map_or("", |(_, rest)| rest);
        }
        may_skip = false;
    }
    may_skip || rest.is_empty()
}

/// Runs the commands of a block.
fn run(folder: &Folder, commands: &str) {
    for step in commands.split("$ ").skip(1) {
        let (command, shown) = step.split_once('\n').unwrap();
        let words: Vec<&str> = command.split(' ').collect();
        let outcome = folder.bbz(words.strip_prefix(&["bbz"]).unwrap());
        let printed = outcome.stdout + &outcome.stderr;
        assert!(is_as_shown(&printed, shown), "{command}\n{printed}");
        assert_eq!(outcome.status == Some(0), !shown.starts_with("error"), "{command}\n{printed}");
    }
}

/// Writes the files of a page into the folder, and runs its commands there. Returns the number of blocks with commands.
pub fn carry_out(folder: &Folder, page: &str) -> usize {
    let mut commands = 0;
    for block in blocks(page) {
        if let Some(name) = file(block.instruction, "New file `") {
            folder.write(name, block.text);
        } else if let Some(name) = file(block.instruction, "At the end of `") {
            let before = String::from_utf8(folder.read(name)).unwrap();
            folder.write(name, before + &block.text);
        } else if block.language == "console" {
            run(folder, &block.text);
            commands += 1;
        } else {
            panic!("no instruction for\n{}", block.text);
        }
    }
    commands
}

#[test]
fn shown_lines_are_compared() {
    assert!(is_as_shown("a\nb\n", "a\nb\n") && is_as_shown("", ""));
    assert!(is_as_shown("a\nb\nc\n", "a\n...\nc\n") && is_as_shown("a\nb\n", "...\n"));
    assert!(!is_as_shown("a\nb\n", "a\n") && !is_as_shown("a\n", "a\nb\n"));
    assert!(!is_as_shown("a\nb\n", "b\n"));
    assert!(is_as_shown("a: 1\nb\n", "a: ...\nb\n") && !is_as_shown("b: 1\n", "a: ...\n"));
}
