//! Carries out each guide and records the run in `tests/guides/runs.toml`.

use crate::Verdict;
use anyhow::{Context, Result};
use bittybuzz_builds::cargo_test::guides;
use bittybuzz_builds::shell::{Invocation, root};
use fs_err as fs;

/// The tests, one for each guide.
const TESTS: &str = "tests/guides/tests/guides.rs";

/// Returns the names of the tests, which stand in the list of guides.
pub fn items() -> Vec<String> {
    let text = fs::read_to_string(root().join(TESTS)).expect("the repository has this file");
    let names = text.lines().filter_map(|line| line.trim().split_once(": \"docs/"));
    names.map(|(name, _)| name.to_owned()).collect()
}

/// Carries out the guide of a test.
pub fn run(test: &str) -> Result<Verdict> {
    let date = Invocation::new("date", &["+%F"]).unannounced().output(0)?;
    let date = String::from_utf8(date.stdout).context("`date` prints text")?;
    let output = guides(date.trim(), &["--exact", test])
        .output_if(|output| output.status.code().is_some())?;
    let printed = String::from_utf8_lossy(&output.stdout);
    Ok(match output.status.success() && printed.contains("1 passed") {
        true => Verdict::Shown("carried out".to_owned()),
        false => Verdict::Missing(printed.into_owned()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_items_are_the_tests_of_the_guides() {
        let items = items();
        assert!(
            items.len() > 5 && items.iter().all(|item| item.starts_with("guide_to_")),
            "{items:?}"
        );
    }
}
