//! Sources with many mistakes at once, of which the program makes the one that an environment variable names.

use super::mistake::Mistake;
use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;
use std::ops::Range;

/// The environment variable with the number of the mistake. Without it the program makes none.
pub const VARIABLE: &str = "BITTYBUZZ_MISTAKE";

/// Numbers of mistakes begin here.
pub const FIRST: usize = 1;

/// A file with its mistakes.
pub struct Combined {
    pub text: String,
    /// The part of the text that each mistake alone uses, and its number.
    arms: Vec<(Range<usize>, usize)>,
}

impl Combined {
    /// The mistake that a place of the text belongs to.
    pub fn owner(&self, byte: usize) -> Option<usize> {
        self.arms.iter().find(|(range, _)| range.contains(&byte)).map(|&(_, number)| number)
    }
}

/// Writes the bodies of the functions once for each of their mistakes. The mistakes have the numbers from [`FIRST`] in their
/// order, in which those of a function must follow each other.
pub fn combine(
    mistakes: &[&Mistake],
    read: impl Fn(&str) -> Result<String>,
) -> Result<BTreeMap<String, Combined>> {
    let mut files = BTreeMap::new();
    let mut number = FIRST;
    for of_file in mistakes.chunk_by(|one, next| one.file == next.file) {
        let file = &of_file[0].file;
        let combined = combine_file(&read(file)?, of_file, number).with_context(|| file.clone())?;
        ensure!(files.insert(file.clone(), combined).is_none(), "{file}: mistakes out of order");
        number += of_file.len();
    }
    Ok(files)
}

fn combine_file(original: &str, mistakes: &[&Mistake], mut number: usize) -> Result<Combined> {
    let mut changes = Vec::new();
    for mistake in mistakes {
        changes.push(mistake.find(original).with_context(|| mistake.name.clone())?);
    }
    let mut combined = Combined { text: String::new(), arms: Vec::new() };
    let mut done = 0;
    for function in changes.chunk_by(|one, next| one.body == next.body) {
        let body = function[0].body.clone();
        ensure!(done <= body.start, "a function inside another, or mistakes out of order");
        let text = &mut combined.text;
        text.push_str(&original[done..body.start]);
        // The original comes first: the compiler compares the types of the others with its type.
        let (count, source) = (function.len(), &original[body.clone()]);
        *text += &format!("{{ match crate::mistake::among({number}, {count}) {{ 0 => {source}");
        for (at, change) in function.iter().enumerate() {
            let last = at + 1 == count;
            let pattern = if last { "_".to_owned() } else { (at + 1).to_string() };
            *text += &format!(" {pattern} => ");
            let start = text.len();
            text.push_str(&original[body.start..change.place.start]);
            *text += &format!(" {} ", change.replacement);
            text.push_str(&original[change.place.end..body.end]);
            combined.arms.push((start..text.len(), number));
            number += 1;
        }
        *text += " } }";
        done = body.end;
    }
    combined.text.push_str(&original[done..]);
    Ok(combined)
}

/// The module that the root of the crate needs.
pub fn module() -> String {
    format!(
        r#"
mod mistake {{
    extern crate std;
    static CHOSEN: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
    /// 1 to `count` for a mistake of a function, 0 if none of them is chosen.
    pub(crate) fn among(first: u32, count: u32) -> u32 {{
        let number = || std::env::var("{VARIABLE}").map_or(0, |text| text.parse().expect("a number"));
        match CHOSEN.get_or_init(number).checked_sub(first) {{
            Some(at) if at < count => at + 1,
            _ => 0,
        }}
    }}
}}
"#
    )
}

#[cfg(test)]
mod tests {
    use super::super::mistake::list;
    use super::*;

    /// A mistake for each operator of the text, in functions of one line.
    fn mistakes(text: &str) -> Vec<Mistake> {
        let mut all = Vec::new();
        for (line, content) in text.lines().enumerate().map(|(at, content)| (at + 1, content)) {
            for (at, _) in content.match_indices(['+', '*']) {
                let span = |from: usize, to: usize| {
                    format!(
                        r#"{{"start": {{"line": {line}, "column": {}}}, "end": {{"line": {line}, "column": {}}}}}"#,
                        from + 1,
                        to + 1
                    )
                };
                all.push(format!(
                    r#"{{"name": "a.rs:{line}:{at}", "file": "a.rs", "replacement": "-", "function": {{"span": {}}}, "span": {}}}"#,
                    span(0, content.len()),
                    span(at, at + 1)
                ));
            }
        }
        list(&format!("[{}]", all.join(", "))).expect("the form of cargo-mutants")
    }

    #[test]
    fn each_mistake_has_a_body() {
        let text = "fn f(a: u8) -> u8 { a + a * 2 }\nfn g() {}\nfn h(a: u8) -> u8 { a * a }\n";
        let all = mistakes(text);
        let all: Vec<&Mistake> = all.iter().collect();
        let files = combine(&all, |_| Ok(text.to_owned())).expect("a file");
        let file = &files["a.rs"];
        assert_eq!(
            file.text,
            "fn f(a: u8) -> u8 { match crate::mistake::among(1, 2) { 0 => { a + a * 2 } 1 => { a  -  a * 2 } \
             _ => { a + a  -  2 } } }\nfn g() {}\nfn h(a: u8) -> u8 { match crate::mistake::among(3, 1) \
             { 0 => { a * a } _ => { a  -  a } } }\n"
        );
        let owner = |part: &str| file.owner(file.text.find(part).expect("a part"));
        assert_eq!(owner("a  -  a * 2"), Some(1));
        assert_eq!(owner("a + a  -  2"), Some(2));
        assert_eq!(owner("a  -  a }"), Some(3));
        assert_eq!((owner("a + a * 2"), owner("g()")), (None, None));
    }
}
