//! `bbz check`: several scripts, standard input, and warnings denied, silenced and mended.

use crate::support;
use std::io::Write;
use std::process::Stdio;

use crate::support::Folder;

const WRONG: &str = "x = size({}, 2)\n";
const DOUBTFUL: &str = "y = nil + 1\nlog(y)\n";

#[test]
fn several_files_are_counted_together() {
    let folder = Folder::with("check_several", "a.bzz", WRONG);
    folder.write("b.bzz", DOUBTFUL);
    folder.write("c.bzz", "z = 1\n");
    let outcome = folder.bbz(&["check", "c.bzz", "b.bzz", "a.bzz"]);
    outcome
        .fails_with(2, &["a.bzz:1:5", "b.bzz:1:5", "1 error and 1 warning", "`bbz explain E0403`"]);
    let outcome = folder.bbz(&["check", "b.bzz", "a.bzz", "--json"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(2), ""));
    let output: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    let codes: Vec<&str> = output["diagnostics"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|d| d["code"].as_str())
        .collect();
    assert_eq!(
        (codes, &output["errors"], &output["warnings"]),
        (vec!["W0301", "E0403"], &1.into(), &1.into())
    );
    // After a missing file, the messages about the earlier files are still printed.
    folder.bbz(&["check", "a.bzz", "d.bzz"]).fails_with(3, &["a.bzz:1:5", "d.bzz"]);
    folder.bbz(&["check", "c.bzz"]).succeeds_with("");
    folder.bbz(&["check"]).fails_with(3, &["<FILE>..."]);
}

#[test]
fn denied_warnings_are_errors() {
    let folder = Folder::with("check_deny", "b.bzz", DOUBTFUL);
    assert_eq!(folder.bbz(&["check", "b.bzz"]).status, Some(0));
    for deny in ["warnings", "W0301", "w0301"] {
        let outcome = folder.bbz(&["check", "b.bzz", "--deny", deny]);
        outcome.fails_with(2, &["warning[W0301]", "1 warning is denied by `--deny`"]);
        assert_eq!(folder.bbz(&["check", "b.bzz", "--deny", deny, "--json"]).status, Some(2));
    }
    assert_eq!(folder.bbz(&["check", "b.bzz", "--deny", "W0102"]).status, Some(0));
    folder.bbz(&["check", "b.bzz", "--deny", "E0403"]).fails_with(3, &["an error anyway"]);
    folder.bbz(&["check", "b.bzz", "--deny", "W9999"]).fails_with(3, &["the code of a warning"]);
}

#[test]
fn comments_silence_warnings() {
    let codes = |test: &str, script: &str| {
        let folder = Folder::with(test, "s.bzz", script);
        let output = folder.bbz(&["check", "s.bzz", "--json"]).stdout;
        let output: serde_json::Value = serde_json::from_str(&output).unwrap();
        let found = output["diagnostics"].as_array().unwrap();
        let line = |found: &serde_json::Value| {
            format!("{} {}", found["code"].as_str().unwrap(), found["line"])
        };
        found.iter().map(line).collect::<Vec<String>>().join(", ")
    };
    assert_eq!(codes("allow_none", "x = nil + 1\nlog(x)"), "W0301 1");
    assert_eq!(codes("allow_line", "x = nil + 1   # bbz: allow(W0301)\ny = nil + x"), "W0301 2");
    assert_eq!(
        codes("allow_next", "# bbz: allow(W0301)\n\n# why\nx = nil + 1\ny = nil + x"),
        "W0301 5"
    );
    assert_eq!(codes("allow_two", "# bbz: allow(W0302, W0301)\nx = nil + id / 0"), "");
    assert_eq!(codes("allow_other", "x = nil + 1 # bbz: allow(W0302)"), "W0301 1");
    // A comment that has no effect is reported.
    assert_eq!(codes("allow_error", "x = size() # bbz: allow(E0403)"), "E0403 1, W0112 1");
    assert_eq!(codes("allow_code", "x = 1 # bbz: allow(W0999)"), "W0112 1");
    assert_eq!(codes("allow_word", "x = 1 # bbz: alow(W0301)"), "W0112 1");
}

#[test]
fn comments_that_the_page_cannot_use_are_warnings() {
    for (comment, message, help) in [
        ("# led: red = waiting", "no meaning of an LED color", "`# led: 2 = in a group`"),
        ("# led.fr: deux = groupe", "no meaning of an LED color", "`# led: 2 = in a group`"),
        ("# led.french: 2 = ensemble", "no meaning of an LED color", "`# led.fr: …`"),
        ("# slider: N 1-5", "no slider of the page", "`# slider: NAME 1..50 step 1`"),
        ("# text.fr: Un script.", "does not show this text", "`# text.fr: Une horloge.`"),
        ("# try: It fails: fail = 0", "proposes no commands", "in the scenario"),
    ] {
        let script = format!("n = 1\nlog(n)\n  {comment}\r\n");
        let folder = Folder::with("check_page_comments", "s.bzz", &script);
        let outcome = folder.bbz(&["check", "s.bzz"]);
        assert_eq!(outcome.status, Some(0), "{comment}");
        for part in ["warning[W0113]", "s.bzz:3:3", message, help] {
            assert!(outcome.stderr.contains(part), "{comment}: {}", outcome.stderr);
        }
    }
    let good = "# A test.\n#\n# text.fr: Un essai.\n\n# led: 1 = on\n# led.fr: 1 = allumé\n\
        # switch: n\n# try: nothing\n# Text: any\n# retry: n = 1\nn = 1\nlog(n)\n";
    let folder = Folder::with("check_good_page_comments", "s.bzz", good);
    let outcome = folder.bbz(&["check", "s.bzz"]);
    assert_eq!((outcome.status, &*outcome.stderr), (Some(0), ""));
}

#[test]
fn standard_input_is_a_script() {
    let folder = Folder::with("check_input", "near.bzz", "function near() { return 1 }\n");
    let check = |script: &[u8], arguments: &[&str]| {
        let mut command = folder.command(&[&["check", "-"], arguments].concat());
        let mut child = command.stdin(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(script).unwrap();
        support::finish(child)
    };
    check(b"include \"near.bzz\"\nlog(near())", &[]).succeeds_with("");
    check(WRONG.as_bytes(), &[]).fails_with(2, &["<standard input>:1:5", "E0403"]);
    check(b"x = \"\xff\"", &[]).fails_with(2, &["E0304"]);
    check(b"x = 1 && 2", &["--fix"]).fails_with(3, &["cannot be mended", "`edits`"]);
}

#[test]
fn standard_input_may_have_the_path_of_a_file() {
    let folder = Folder::new("check_path");
    std::fs::create_dir(folder.path("src")).unwrap();
    folder.write("src/near.bzz", "function near() { return 1 }\n");
    folder.write("src/s.bzz", "this is the text on disk");
    let check = |script: &str, arguments: &[&str]| {
        let mut command = folder.command(&[&["check"], arguments].concat());
        let mut child = command.stdin(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
        support::finish(child)
    };
    let includes = "include \"near.bzz\"\nlog(near())";
    check(includes, &["-", "--path", "src/s.bzz"]).succeeds_with("");
    check(includes, &["-", "--path", "src/unsaved.bzz"]).succeeds_with("");
    check(includes, &["-"]).fails_with(2, &["E0301"]);
    check(WRONG, &["-", "--path", "src/s.bzz"]).fails_with(2, &["src/s.bzz:1:5", "E0403"]);
    let json = check(WRONG, &["-", "--json", "--path", "src/s.bzz"]);
    assert!(json.stdout.contains("\"src/s.bzz\""), "{}", json.stdout);
    check("", &["src/s.bzz", "--path", "src/s.bzz"]).fails_with(3, &["--path", "bbz check -"]);
    check("", &["-", "-", "--path", "src/s.bzz"]).fails_with(3, &["--path"]);
}

#[test]
fn fix_corrects_unambiguous_mistakes() {
    let folder = Folder::with(
        "check_fix",
        "s.bzz",
        "// a comment\nfunction f(a, b,) {\n  if(a && b || a ~= true) { return null }\n  elseif(a === 2) { b = 3 }\n  \
         for(i = 0; i < 3; i = i + 1) { log(“i”, i) }\n  return { .x = 0.0., .y = conter }\n}\nf(1, 2)\n",
    );
    let outcome = folder.bbz(&["check", "s.bzz", "--fix"]);
    // A similar name is only suggested.
    assert_eq!(
        String::from_utf8(folder.read("s.bzz")).unwrap(),
        "# a comment\nfunction f(a, b) {\n  if(a and b or a != 1) { return nil }\n  else if(a == 2) { b = 3 }\n  \
         for(i = 0, i < 3, i = i + 1) { log(\"i\", i) }\n  return { .x = 0.0, .y = conter }\n}\nf(1, 2)\n"
    );
    assert!(outcome.stderr.contains("mended"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("conter"), "{}", outcome.stderr);
    assert!(!outcome.stderr.contains("error"), "{}", outcome.stderr);
    let before = folder.read("s.bzz");
    folder.bbz(&["check", "s.bzz", "--fix"]);
    assert_eq!(folder.read("s.bzz"), before);
}
