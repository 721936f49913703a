//! Comments are plain English: words that make a reader guess the noun of a sentence are rare.
//!
//! The limits are per 1,000 words of comments outside tests. lilos, hubris, smoltcp and defmt have 0.2 to 0.8 "what", at most 0.3
//! of each other group, and at most 0.9 % of documentation that begins with a question word.

use std::fs;
use std::path::Path;

use bittybuzz_builds::shell::root;

/// Groups of words, and their highest number per 1,000 words. An entry of two words counts that
/// pair.
const LIMITS: [(&[&str], f64); 5] = [
    (&["what"], 0.5),
    (&["tell", "tells", "told", "telling"], 0.1),
    (&["so many", "so much", "so long", "so far"], 0.1),
    (&["nobody", "somebody", "anybody", "everybody", "whoever"], 0.1),
    (&["behind"], 0.1),
];

/// Words that must not begin documentation, because documentation names its item first, and the
/// highest share of documentation that may begin with them.
const RIDDLES: [&str; 12] =
    ["What", "Whether", "How", "Where", "Why", "Who", "When", "That", "Of", "In", "As", "Until"];
const RIDDLES_MAX: f64 = 0.005;

/// The comments of a tree of files: all words in lower case, and the first words of documentation.
#[derive(Default)]
struct Comments {
    words: Vec<String>,
    first: Vec<String>,
}

impl Comments {
    fn read(&mut self, folder: &Path) {
        for entry in fs::read_dir(folder).unwrap().flatten() {
            let path = entry.path();
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if path.is_dir() {
                // Outputs of builds, hidden folders and tests are skipped.
                if !matches!(&*name, "target" | "tests") && !name.starts_with('.') {
                    self.read(&path);
                }
            } else if name.ends_with(".rs") {
                self.add(&fs::read_to_string(&path).unwrap());
            }
        }
    }

    fn add(&mut self, text: &str) {
        let mut was_document = false;
        for line in text.lines().map(str::trim_start) {
            let document = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
            let comment = document.or_else(|| line.strip_prefix("//"));
            let words: Vec<&str> = comment
                .unwrap_or_default()
                .split(|c: char| !c.is_alphanumeric() && c != '_')
                .filter(|word| !word.is_empty())
                .collect();
            if document.is_some() && !was_document {
                self.first.push(words.first().copied().unwrap_or_default().to_owned());
            }
            self.words.extend(words.into_iter().map(str::to_lowercase));
            was_document = document.is_some();
        }
    }

    /// Returns the number of times per 1,000 words that one of a group's words occurs.
    fn rate(&self, group: &[&str]) -> f64 {
        let pairs = self.words.windows(2).map(|pair| pair.join(" "));
        let all = self.words.iter().cloned().chain(pairs);
        let count = all.filter(|word| group.contains(&word.as_str())).count();
        1000.0 * count as f64 / self.words.len() as f64
    }

    fn riddles(&self) -> f64 {
        let count = self.first.iter().filter(|word| RIDDLES.contains(&word.as_str())).count();
        count as f64 / self.first.len() as f64
    }
}

#[test]
fn comments_are_plain() {
    let mut comments = Comments::default();
    comments.read(root());
    assert!(comments.words.len() > 100_000, "{} words", comments.words.len());
    for (group, most) in LIMITS {
        let rate = comments.rate(group);
        assert!(rate <= most, "{group:?}: {rate:.2} per 1,000 words of comments, at most {most}");
    }
    let riddles = comments.riddles();
    assert!(riddles <= RIDDLES_MAX, "{:.1} % of documentation begin as riddles", 100.0 * riddles);
}

#[test]
fn riddles_are_found() {
    let mut comments = Comments::default();
    comments
        .add("/// What nobody told. So\n/// many are behind.\nfn f() {}\n// Plain.\n/// A noun.\n");
    assert_eq!(comments.first, ["What", "A"]);
    assert_eq!(comments.words.len(), 10);
    for (group, _) in LIMITS {
        assert_eq!(comments.rate(group), 100.0, "{group:?}");
    }
    assert_eq!(comments.riddles(), 0.5);
}
