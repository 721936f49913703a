//! Paragraphs of a file's first comment in another language: `# text.fr: Un script d'essai.`

use super::{CommentProblem, is_request, language_problem, page_comments};

const FORM: &str = "a paragraph in another language is `# text.fr: Une horloge.` after an empty \
    comment line, in the comment with which the file begins";

/// Returns the malformed and misplaced paragraphs of a script or a scenario.
pub fn problems(text: &str) -> Vec<CommentProblem> {
    let lines: Vec<Option<&str>> = text
        .trim_start_matches('\u{feff}')
        .lines()
        .map(|line| line.trim().strip_prefix('#').map(str::trim))
        .collect();
    let head = lines.iter().take_while(|comment| comment.is_some()).count();
    // Without a language, `text:` is a part of the paragraph.
    let own = page_comments(text).filter(|one| one.kind == "text" && one.language.is_some());
    let problems = own.filter_map(|comment| {
        let line = comment.line;
        // The page takes requests out of a paragraph.
        let before = lines[..line].iter().rev().flatten().find(|before| !is_request(before));
        let is_first = before.is_none_or(|before| before.is_empty());
        let is_shown = line < head && is_first && !comment.text.is_empty();
        let help = language_problem("text", comment.language);
        let help = help.or_else(|| (!is_shown).then(|| FORM.to_owned()))?;
        Some(CommentProblem::new(line, "the page does not show this text", help))
    });
    problems.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paragraphs_that_are_not_shown_are_reported_with_their_line() {
        let lines = |text: &str| -> Vec<usize> {
            problems(text).into_iter().map(|problem| problem.line).collect()
        };
        assert!(
            lines("\u{feff}# text.fr: Un.\n# de deux\n#\n# text.fr: Deux.\nx = 1\n").is_empty()
        );
        assert!(lines("# One.\n# text: an ordinary word\n").is_empty());
        assert!(lines("# One.\n#\n# led: 1 = one\n# text.fr: Un.\n").is_empty());
        for (text, line) in [
            ("# One.\n# text.fr: Un.\n", 1),
            ("# One.\n#\n# text.fr:\n", 2),
            ("# text.french: Un.\n", 0),
            ("# text.: Un.\n", 0),
            ("x = 1\n# text.fr: Un.\n", 1),
            ("# One.\n\n#\n# text.fr: Un.\n", 3),
        ] {
            assert_eq!(lines(text), [line], "{text}");
        }
    }
}
