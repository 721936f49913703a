//! Releases a version: runs the checks that people forget, and creates the tag.
//!
//! The tag starts `.github/workflows/release.yml`, which runs CI, packs the tools and the Python module for Linux, macOS and Windows
//! with `cargo xtask package`, starts both on each system, and publishes them with firmware, site, checksums,
//! attestations of their origin, and the section of CHANGELOG.md.

use crate::package::version;
use anyhow::{Context, Result, ensure};
use bittybuzz_builds::shell::{Invocation, root};
use fs_err as fs;

/// The file with the changes of all versions.
const CHANGELOG: &str = "CHANGELOG.md";

/// Checks the working copy, and tags its commit. With `notes`, prints the changes of this version
/// instead.
pub fn run(notes: bool) -> Result<()> {
    let version = version();
    let changes = fs::read_to_string(root().join(CHANGELOG))?;
    let section = section(&changes, version).with_context(|| {
        format!("{CHANGELOG} has no section `## [{version}] - YYYY-MM-DD`, or nothing in it")
    })?;
    if notes {
        println!("{section}");
        return Ok(());
    }
    let status = git(&["status", "--porcelain"])?;
    ensure!(status.is_empty(), "commit these changes first:\n{status}");
    let tag = format!("v{version}");
    let known = git(&["tag", "--list", &tag])?;
    ensure!(
        known.is_empty(),
        "{tag} is tagged already; the root's Cargo.toml has the next version"
    );
    Invocation::new("git", &["tag", "--annotate", "--message", &tag, &tag]).run()?;
    println!("Now: git push origin {tag}");
    Ok(())
}

fn git(arguments: &[&str]) -> Result<String> {
    let output = Invocation::new("git", arguments).unannounced().output(0)?;
    Ok(String::from_utf8(output.stdout)?)
}

/// Returns the text of a version's section, without its title; `None` if there is no such section
/// or its text is empty.
fn section<'a>(changes: &'a str, version: &str) -> Option<&'a str> {
    let (_, rest) = changes.split_once(&format!("\n## [{version}] - "))?;
    let (date, rest) = rest.split_once('\n')?;
    let is_date =
        date.len() == 10 && date.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-');
    let text = rest.split("\n## ").next().unwrap_or(rest).trim();
    (is_date && !text.is_empty()).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_need_a_date_and_a_text() {
        let changes =
            "# Changes\n\n## [0.2.0] - 2027-01-02\n\n### Added\n- A.\n\n## [0.1.0] - soon\n- B.\n";
        assert_eq!(section(changes, "0.2.0"), Some("### Added\n- A."));
        assert_eq!(section(changes, "0.1.0"), None);
        assert_eq!(section("\n## [1.0.0] - 2027-01-02\n\n## Old\n- C.\n", "1.0.0"), None);
        assert_eq!(section(changes, "3.0.0"), None);
    }

    #[test]
    fn this_version_has_a_section_and_can_be_cited() {
        let changes = fs::read_to_string(root().join(CHANGELOG)).unwrap();
        assert!(section(&changes, version()).is_some());
        let citation = fs::read_to_string(root().join("CITATION.cff")).unwrap();
        assert!(citation.contains(&format!("\nversion: {}\n", version())));
    }
}
