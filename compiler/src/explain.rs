//! The explanation of each code, for `bbz explain` and editors: the sections of docs/diagnostics.md
//! and docs/run-time-errors.md.

const DIAGNOSTICS: &str = include_str!("../../docs/diagnostics.md");
const RUN_TIME_ERRORS: &str = include_str!("../../docs/run-time-errors.md");

/// The beginning of a section's heading; a code follows.
const HEADING: &str = "\n## ";

/// Returns the section about a code, such as `E0101` or `R0005`, in Markdown with its heading.
pub fn explain(code: &str) -> Option<&'static str> {
    let mut all = sections().chain(run_time_sections());
    all.find(|(heading, _)| heading.eq_ignore_ascii_case(code)).map(|(_, section)| section)
}

/// Returns every section about a message of the compiler, with its code.
pub fn sections() -> impl Iterator<Item = (&'static str, &'static str)> {
    sections_of(DIAGNOSTICS)
}

/// Returns every section about an error of a running script, with its code.
pub fn run_time_sections() -> impl Iterator<Item = (&'static str, &'static str)> {
    sections_of(RUN_TIME_ERRORS)
}

fn sections_of(text: &'static str) -> impl Iterator<Item = (&'static str, &'static str)> {
    let starts = text.match_indices(HEADING).map(|(start, _)| start + 1);
    starts.filter_map(|start| {
        let rest = text.get(start..)?;
        let section = rest.get(..rest.find(HEADING).unwrap_or(rest.len()))?;
        let heading = section.strip_prefix("## ")?;
        let code = heading.split_whitespace().next()?;
        Some((code, section.trim_end()))
    })
}
