//! Scripts that are handed in and compiled.

use bittybuzz_live::{Assignment, HandIn, SharedFiles, Shelf, TextFile};

use super::{CONSTANT, Limits};

/// Scripts of an assignment that are compiled. Each is a text in the file of the hand-in, in the
/// hand-in, among the files of the assignment and in the messages about it.
#[test]
fn scripts_of_an_assignment() {
    let files = SharedFiles::default();
    let scenario = "[world]\nsize = [1000, 1000]\nduration = 1\n\n[[robots]]\nrobot = \"kilobot\"\n\
                    script = \"a.bzz\"\ncount = 2\n";
    files.add("a.bzz", "function step() { }\n");
    files.add("s.toml", scenario);
    let shelf = Shelf::new(files, "s.toml".into());
    let assignment = Assignment::new(&shelf, scenario).unwrap();
    let hand_in = |scripts: Vec<(String, String)>| {
        let scripts = scripts.into_iter().map(|(name, text)| TextFile::new(name, text)).collect();
        let scenario = TextFile::new("s.toml".to_owned(), scenario.to_owned());
        let (by, title) = ("Ada".to_owned(), "Count".to_owned());
        serde_json::to_string(&HandIn::new(by, title, scenario, scripts)).unwrap()
    };
    let limits = Limits { per_byte: 256, constant: 2 * CONSTANT };
    let check = |shape: &str, size, make: &dyn Fn(usize) -> Vec<(String, String)>| {
        limits.check(
            shape,
            size,
            |n| hand_in(make(n)),
            |text: &str| drop(assignment.prepare(text)),
        );
    };
    let script = |text: String| vec![("a.bzz".to_owned(), text)];
    check("statements", 500, &|n| script("x = 1\n".repeat(n)));
    check("mistakes", 500, &|n| script((0..n).map(|i| format!("u{i}()\n")).collect()));
    check("bytes that are no tokens", 20_000, &|n| script("$".repeat(n)));
    check("includes", 300, &|n| script("include \"b.bzz\"\n".repeat(n)));
    check("scripts", 300, &|n| (0..n).map(|i| (format!("{i}.bzz"), String::new())).collect());
    check("a long name", 20_000, &|n| vec![("x".repeat(n), String::new())]);
    check("a deep name", 10_000, &|n| vec![("x/".repeat(n), String::new())]);
    check("a name with ways back", 10_000, &|n| vec![("../".repeat(n), String::new())]);
}
