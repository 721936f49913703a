//! What each diagnostic means, for `bbz explain`: the sections of docs/diagnostics.md.

const DIAGNOSTICS: &str = include_str!("../../docs/diagnostics.md");

/// The beginning of the heading of a section, which goes on with a code.
const HEADING: &str = "\n## ";

/// The section about a code, such as `E0101`, in Markdown with its heading.
pub fn explain(code: &str) -> Option<&'static str> {
    sections().find(|(heading, _)| heading.eq_ignore_ascii_case(code)).map(|(_, section)| section)
}

/// Every section with the code that it is about.
pub fn sections() -> impl Iterator<Item = (&'static str, &'static str)> {
    let starts = DIAGNOSTICS.match_indices(HEADING).map(|(start, _)| start + 1);
    starts.filter_map(|start| {
        let rest = DIAGNOSTICS.get(start..)?;
        let section = rest.get(..rest.find(HEADING).unwrap_or(rest.len()))?;
        let heading = section.strip_prefix("## ")?;
        let code = heading.split_whitespace().next()?;
        Some((code, section.trim_end()))
    })
}
