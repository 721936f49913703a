//! Reading what `bbz` says on standard error.

/// One message: its headline and the place that follows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Whether it is an error; else a warning.
    pub error: bool,
    /// `E0201`, `W0102`, or `R0005` for a run-time error; none for a bad command line.
    pub code: Option<String>,
    /// The headline after the code.
    pub message: String,
    /// File and line, if a place was given.
    pub place: Option<(String, usize)>,
}

/// The messages in the order of the text. Notes, source lines and help belong to the message before them.
///
/// ```text
/// error[E0301]: `foo.bzz` is not found
///   --> main.bzz:3:1
/// ```
pub fn parse(stderr: &str) -> Vec<Diagnostic> {
    let mut found: Vec<Diagnostic> = Vec::new();
    for line in stderr.lines() {
        if let Some(diagnostic) = headline(line) {
            found.push(diagnostic);
        } else if let Some(place) = line.trim_start().strip_prefix("--> ")
            && let Some(last) = found.last_mut()
            && last.place.is_none()
        {
            last.place = parse_place(place);
        }
    }
    found
}

fn headline(line: &str) -> Option<Diagnostic> {
    let (error, rest) = if let Some(rest) = line.strip_prefix("error") {
        (true, rest)
    } else {
        (false, line.strip_prefix("warning")?)
    };
    let (code, message) = if let Some(rest) = rest.strip_prefix('[') {
        let (code, message) = rest.split_once("]: ")?;
        (Some(code.to_string()), message)
    } else {
        (None, rest.strip_prefix(": ")?)
    };
    Some(Diagnostic { error, code, message: message.to_string(), place: None })
}

/// `path:line:column`; the path itself may hold colons.
fn parse_place(text: &str) -> Option<(String, usize)> {
    let (rest, _column) = text.trim_end().rsplit_once(':')?;
    let (file, line) = rest.rsplit_once(':')?;
    Some((file.to_string(), line.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headline_and_place_are_joined() {
        let text = "warning[W0102]: first\n  --> a/b.bzz:12:5\n   |\n12 | x\n   |\n  --> c.bzz:1:1\n\n\
                    error: division by zero\n --> b.bzz:3:9\n";
        let found = parse(text);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].code.as_deref(), Some("W0102"));
        assert_eq!(found[0].place, Some(("a/b.bzz".to_string(), 12)));
        assert!(!found[0].error);
        assert_eq!(found[1].message, "division by zero");
        assert_eq!(found[1].place, Some(("b.bzz".to_string(), 3)));
    }

    #[test]
    fn other_lines_are_no_headlines() {
        assert_eq!(parse("errors: 3\nnote: error[E1]: x\n  --> a.bzz:1:1\n"), []);
    }
}
